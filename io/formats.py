"""The table of file formats: what files with each suffix can contain. Nothing is read or written here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from ..errors import InputError
from . import extensions, extras

PNG = b"\x89PNG\r\n\x1a\n"
PICTURE_BEGINNINGS = {
    PNG[:4]: "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"GIF8": "GIF",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
}
"""The first bytes of picture files, with the names of their formats; WebP has its name after the length."""
HELD_SUFFIXES = {"PNG": ".png", "JPEG": ".jpg", "WebP": ".webp"}
"""Suffixes of pictures that meshes and drawings can contain."""


FONTS = (".ttf", ".otf")
"""Suffixes of fonts, in which a text is set: `font.ttf#text=Word`."""
WEB_FONTS = {".woff": b"wOFF", ".woff2": b"wOF2"}
"""Suffixes of fonts of web pages, and the first bytes of their files."""
WEB_FONT = "web fonts are compressed and not read; name the .ttf or .otf (`fonttools ttLib.woff2 decompress`)"
"""Why a web font is refused."""


KINDS = {
    "picture": "pictures",
    "drawing": "drawings",
    "outlines": "outlines",
    "mesh": "meshes",
    "overlay": "numbers at vertices",
    "flat": "flattenings",
    "plot": "plots",
    "stmap": "STMaps",
    "map": "saved maps",
    "manifest": "jobs",
    "constraints": "pins and strokes",
    "world": "places on a map of the earth",
}
"""The attributes of `Format`, in words."""
MOST_LISTED_SUFFIXES = 8
"""A message that lists more is not read."""
USUAL_SUFFIXES = (".png", ".svg", ".jpg", ".obj", ".glb", ".tif", ".exr", ".npz")
"""The suffixes that most people use, which messages list first."""
EXTENDED = ("mesh", "uv", "overlay")
"""Contents, as attributes of `Format`, for which extensions have formats."""


@dataclass(frozen=True)
class PictureFormat:
    """The types of pixels that a picture format can store.

    Attributes:
        light: "display" for encoded colours with straight alpha, "linear" for floats with associated alpha, or "any".
        bits: of integers, for each supported size.
        grey: whether it supports pictures with fewer than three channels.
        alpha: whether it supports alpha.
        hidden: whether colours are kept where alpha is 0.
        named: whether it stores any colour space; otherwise sRGB is assumed, or linear for floats.
        profile: whether it stores a colour profile (ICC).
        encoder: OpenImageIO's name for the compression.
    """

    light: str = "any"
    bits: tuple[int, ...] = (8, 16)
    grey: bool = True
    alpha: bool = True
    hidden: bool = True
    named: bool = False
    profile: bool = True
    encoder: str = ""


@dataclass(frozen=True)
class Format:
    """The contents of files with a suffix.

    Attributes:
        picture: the pixels that can be stored, if any.
        drawing: outlines and artwork.
        mesh: module and class of `io.meshes` for a mesh format; of an extension, `package.module:Class`.
        uv: whether iccm writes meshes with texture coordinates.
        could_hold_uv: whether such files could hold texture coordinates, but are not written.
        overlay: of an extension, the class that reads numbers at vertices, from files without a mesh.
        flat: a flattening.
        plot: a figure.
        stmap: whether an STMap, which needs floats.
        manifest: jobs.
        constraints: pins and strokes.
        map: a map, without loss.
        world: where a picture lies on a map of the earth.
        outlines: shapes in formats that are only read.
        extra: the extra of iccm that installs what an extension's format needs.
    """

    picture: PictureFormat | None = None
    drawing: bool = False
    mesh: str = ""
    uv: bool = False
    could_hold_uv: bool = False
    overlay: str = ""
    flat: bool = False
    plot: bool = False
    stmap: bool = False
    manifest: bool = False
    constraints: bool = False
    map: bool = False
    world: bool = False
    outlines: bool = False
    extra: extras.Extra | None = None


_JPEG = Format(PictureFormat("display", (8,), alpha=False, hidden=False, encoder="jpeg:95"))
_TIFF = Format(PictureFormat(), stmap=True)
TIFF_SUFFIXES = (".tif", ".tiff")
READ_ONLY = (".gif", ".jp2", ".j2k", ".ppm", ".pgm", ".pbm", ".pnm", ".dds", ".avif", ".heic", ".heif")
"""Suffixes of pictures that can be read but not written."""
# All other picture formats listed here are lossless within their description; OpenImageIO supports more, which lose
# something.
FORMATS = {
    ".png": Format(PictureFormat("display", named=True), plot=True),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    **dict.fromkeys(TIFF_SUFFIXES, _TIFF),
    ".exr": Format(PictureFormat("linear", (), hidden=False, named=True, profile=False), stmap=True),
    ".webp": Format(PictureFormat("display", (8,), grey=False, hidden=False, encoder="lossless")),
    ".hdr": Format(PictureFormat("linear", (), grey=False, alpha=False, hidden=False, profile=False)),
    ".bmp": Format(PictureFormat("display", (8,), grey=False, profile=False)),
    # readers take the second channel of two for a colour
    ".tga": Format(PictureFormat("display", (8,), grey=False, profile=False)),
    ".jxl": Format(PictureFormat(grey=False, named=True, encoder="jpegxl:100")),
    ".dpx": Format(PictureFormat(named=True, profile=False)),
    **dict.fromkeys(READ_ONLY, Format(PictureFormat("display", (8,)))),
    ".svg": Format(drawing=True, flat=True, plot=True),
    ".svgz": Format(drawing=True),
    ".pdf": Format(plot=True),
    ".obj": Format(drawing=True, mesh="obj_format.ObjFormat", uv=True, flat=True),
    ".glb": Format(mesh="gltf_format.GltfFormat", uv=True),
    ".ply": Format(mesh="ply_format.PlyFormat", uv=True),
    ".gltf": Format(mesh="gltf_format.GltfFormat", uv=True),
    ".off": Format(mesh="off_stl_formats.OffFormat"),
    ".stl": Format(mesh="off_stl_formats.StlFormat"),
    ".toml": Format(manifest=True),
    ".jsonl": Format(manifest=True),
    ".ndjson": Format(manifest=True),
    ".json": Format(constraints=True, outlines=True),
    ".geojson": Format(outlines=True),
    ".geojsonl": Format(outlines=True),
    ".geojsons": Format(outlines=True),
    ".topojson": Format(outlines=True),
    **dict.fromkeys((".gpkg", ".shp", ".kml", ".fgb"), Format(outlines=True)),
    **dict.fromkeys(FONTS, Format(outlines=True)),
    ".dxf": Format(outlines=True, drawing=True, flat=True),
    ".npz": Format(map=True),
    **dict.fromkeys((".pgw", ".jgw", ".tfw", ".wld", ".prj"), Format(world=True)),
}


EXPORTS = {
    "drawing": ((".pdf", ".ai", ".eps", ".ps", ".cdr", ".wmf", ".emf"), ".svg"),
    "plan": ((".dwg",), ".dxf"),
    "mesh": (
        (".fbx", ".blend", ".dae", ".3ds", ".max", ".ma", ".mb", ".c4d", ".x3d", ".step", ".stp"),
        ".glb or .obj",
    ),
    "picture": ((".psd", ".psb", ".xcf", ".kra", ".ora", ".clip", ".dng", ".cr2", ".nef"), ".png or .tif"),
}
"""By kind of content: suffixes of other programs' files, and the formats that these programs export."""


def suffix_of(name: str | PathLike) -> str:
    """Return the suffix in lower case; for names that only an extension's pattern or longer suffix fits, this."""
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix in FORMATS or not suffix:
        return suffix
    return extensions.fitting(path.name.lower(), suffix) or suffix


def written(output: str) -> str:
    """Return a name with the suffix of an output's format: standard output is a PNG."""
    return "stdout.png" if output == "-" else output


def of(name: str | PathLike) -> Format:
    """Return the format of a file by its suffix; an empty format if it is unknown."""
    return _of_suffix(suffix_of(name))


def _of_suffix(suffix: str) -> Format:
    """Return the format of a suffix, among those of iccm itself, then among those of extensions.

    Raises:
        InputError: the extension cannot be loaded, or does not name a format.
    """
    if suffix in FORMATS or not suffix:
        return FORMATS.get(suffix, Format())
    form = extensions.format_of(suffix)
    if form is None:
        return Format()
    if not isinstance(form, Format):
        raise InputError(
            f"{suffix}: the extension names a {type(form).__name__}, not an iccm.io.formats.Format"
        )
    return form


def every() -> dict[str, Format]:
    """Return the formats by suffix: those of iccm itself, then those of extensions that can be loaded."""
    formats = dict(FORMATS)
    for suffix in extensions.formats():
        try:
            formats.setdefault(suffix, _of_suffix(suffix))
        except InputError:  # `iccm doctor` reports it
            continue
    return formats


def picture(name: str | PathLike) -> PictureFormat:
    """Return the picture format of a file by its suffix; for unknown suffixes one that supports everything."""
    return of(name).picture or PictureFormat()


def holding(what: str, *, written: bool = False) -> tuple[str, ...]:
    """Return the suffixes of files that can contain something, given as an attribute of `Format`; with `written`, only
    those that can be written.
    """
    formats = every() if what in EXTENDED else FORMATS
    return tuple(suffix for suffix, form in formats.items() if _holds(suffix, form, what, written=written))


def _holds(suffix: str, form: Format, what: str, *, written: bool) -> bool:
    return bool(getattr(form, what)) and not (written and what == "picture" and suffix in READ_ONLY)


def one_of(suffixes: Iterable[str]) -> str:
    """Return a list of suffixes for a message: all of them if they are few, else the first ones and the command that
    lists all.

    >>> one_of([".png", ".tif"])
    'one of .png .tif'
    """
    known = [*USUAL_SUFFIXES, *every()]
    listed = sorted(suffixes, key=lambda suffix: known.index(suffix) if suffix in known else len(known))
    if len(listed) <= MOST_LISTED_SUFFIXES:
        return f"one of {' '.join(listed)}"
    return f"one of {' '.join(listed[:MOST_LISTED_SUFFIXES])} … (`iccm info --formats` lists all)"


def table() -> list[str]:
    """Return a line for each suffix: what such files can contain, and a star where they are only read."""
    lines = []
    for suffix, form in every().items():
        kinds = [KINDS[kind] for kind in KINDS if getattr(form, kind) and kind != "uv"]
        is_mesh_read_only = bool(form.mesh) and not form.uv
        are_outlines_read_only = form.outlines and not (form.drawing or form.constraints)
        is_read_only = suffix in READ_ONLY or is_mesh_read_only or are_outlines_read_only or form.overlay
        lines.append(f"{suffix:9} {', '.join(kinds)}{' *' if is_read_only else ''}")
    return lines


def check(name: str | PathLike, what: str, problem: str, *others: str) -> None:
    """Check that the format of an output can contain something.

    Args:
        name: of the output.
        what: the attribute of `Format` to check.
        problem: the message if it cannot.
        others: further attributes whose suffixes the message lists.

    Raises:
        InputError: it cannot, or is a folder; the message lists suitable suffixes.
    """
    if _holds(suffix_of(name), of(name), what, written=True):
        return
    if Path(name).is_dir():
        raise InputError(f"{name}: is a folder; name a file in it")
    suffixes = dict.fromkeys(suffix for kind in (what, *others) for suffix in holding(kind, written=True))
    raise InputError(f"{name}: {problem}; use {one_of(suffixes)}")


def remedy(name: str | PathLike, kind: str, suffixes: Sequence[str]) -> str:
    """Return what to do with a file that cannot be read: how to export it, or which suffixes can be read.

    Args:
        name: of the file.
        kind: the kind of content that is expected: "shape", "picture" or "mesh".
        suffixes: that can be read.
    """
    suffix = suffix_of(name)
    kinds = {"shape": tuple(EXPORTS), "picture": ("picture", "drawing"), "mesh": ("mesh",)}[kind]
    for cause in kinds:
        known, export = EXPORTS[cause]
        if suffix in known:
            return f"export it as {export} from the program that made it"
    return f"use {one_of(suffixes)}"


def check_report(name: str | None) -> None:
    """Check that the name of a report does not have the suffix of a picture, a drawing or a mesh.

    Raises:
        InputError: it does.
    """
    kind = of(name or "")
    if kind.picture or kind.drawing or kind.mesh or kind.plot:
        raise InputError(f"{name}: the report is JSON; choose a name that ends in .json for --report")


def why_no_coordinates(name: str | PathLike) -> str:
    """Return why a mesh with texture coordinates cannot be written to a file, for messages."""
    suffix = suffix_of(name)
    if of(name).could_hold_uv:
        return f"iccm reads {suffix} files, but does not write them"
    return f"{suffix[1:].upper()} files cannot hold texture coordinates"


def check_plot(name: str) -> None:
    """Check that the figure of `--plot` can be drawn into a file.

    Raises:
        InputError: figures are not written with this suffix, or matplotlib is not installed.
    """
    check(name, "plot", "unknown suffix for --plot")
    extras.require("--plot", "matplotlib")


def is_svg(beginning: bytes) -> bool:
    """Return whether a file that begins like this is an SVG drawing."""
    return beginning.lstrip().startswith((b"<svg", b"<?xml", b"<!--")) and b"<svg" in beginning


def suffix_of_content(content: bytes) -> str:
    """Return the suffix for a picture's content: ".png", ".jpg", ".webp", or "" for others."""
    return HELD_SUFFIXES.get(picture_kind(content), "")


def picture_kind(content: bytes) -> str:
    """Return the format of a picture's content, such as "PNG", or "" for others."""
    if content[8:12] == b"WEBP":
        return "WebP"
    return next((kind for start, kind in PICTURE_BEGINNINGS.items() if content.startswith(start)), "")
