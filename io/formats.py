"""The table of file formats: what each suffix can hold. Nothing is read or written here."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from ..errors import InputError

PNG = b"\x89PNG\r\n\x1a\n"
PICTURE_BEGINNINGS = {
    PNG[:4]: "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"GIF8": "GIF",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
}
"""The first bytes of files of pictures, with the names of their formats; WebP has its name after its length."""
HELD_SUFFIXES = {"PNG": ".png", "JPEG": ".jpg", "WebP": ".webp"}
"""The suffixes of pictures that meshes and drawings hold."""


@dataclass(frozen=True)
class PictureFormat:
    """How a format holds pixels.

    Attributes:
        light: "display" for encoded colours with straight alpha, "linear" for floats with associated alpha, or "any".
        bits: of the integers that it holds.
        grey: whether it holds pictures of fewer than three channels.
        alpha: whether it holds alpha.
        hidden: whether it keeps colours where alpha is 0.
        named: whether it says any colour space; others are taken for sRGB, or linear when they hold floats.
        encoder: what OpenImageIO calls the compression.
    """

    light: str = "any"
    bits: tuple[int, ...] = (8, 16)
    grey: bool = True
    alpha: bool = True
    hidden: bool = True
    named: bool = False
    encoder: str = ""


@dataclass(frozen=True)
class Format:
    """What files of a suffix hold.

    Attributes:
        picture: how they hold pixels, if they do.
        drawing: outlines and artwork.
        mesh: a mesh: module and class of `io.meshes` that read and write the format.
        uv: a mesh that iccm writes with texture coordinates.
        flat: a flattening.
        plot: a figure.
        stmap: a map, as floats.
        manifest: jobs.
        constraints: pins and strokes.
        map: a map, exactly.
        outlines: shapes, that are read alone.
    """

    picture: PictureFormat | None = None
    drawing: bool = False
    mesh: str = ""
    uv: bool = False
    flat: bool = False
    plot: bool = False
    stmap: bool = False
    manifest: bool = False
    constraints: bool = False
    map: bool = False
    outlines: bool = False


_JPEG = Format(PictureFormat("display", (8,), alpha=False, hidden=False, encoder="jpeg:95"))
_TIFF = Format(PictureFormat(), stmap=True)
READ_ONLY = (".gif", ".jp2", ".j2k", ".ppm", ".pgm", ".pbm", ".pnm", ".dds", ".avif", ".heic", ".heif")
"""Suffixes of pictures that are read, and not written."""
# Every other picture format here gives back what it is said to hold; OpenImageIO knows more, which lose something.
FORMATS = {
    ".png": Format(PictureFormat("display", named=True), plot=True),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".exr": Format(PictureFormat("linear", (), hidden=False, named=True), stmap=True),
    ".webp": Format(PictureFormat("display", (8,), grey=False, hidden=False, encoder="lossless")),
    ".hdr": Format(PictureFormat("linear", (), grey=False, alpha=False, hidden=False)),
    ".bmp": Format(PictureFormat("display", (8,), grey=False)),
    ".tga": Format(PictureFormat("display", (8,))),
    ".jxl": Format(PictureFormat(grey=False, named=True, encoder="jpegxl:100")),
    ".dpx": Format(PictureFormat(named=True)),
    **dict.fromkeys(READ_ONLY, Format(PictureFormat("display", (8,)))),
    ".svg": Format(drawing=True, flat=True, plot=True),
    ".svgz": Format(drawing=True),
    ".pdf": Format(plot=True),
    ".obj": Format(drawing=True, mesh="obj_format.ObjFormat", uv=True, flat=True),
    ".glb": Format(mesh="gltf_format.GltfFormat", uv=True),
    ".ply": Format(mesh="ply_format.PlyFormat", uv=True),
    ".gltf": Format(mesh="gltf_format.GltfFormat"),
    ".off": Format(mesh="off_stl_formats.OffFormat"),
    ".stl": Format(mesh="off_stl_formats.StlFormat"),
    ".toml": Format(manifest=True),
    ".jsonl": Format(manifest=True),
    ".ndjson": Format(manifest=True),
    ".json": Format(constraints=True, outlines=True),
    ".geojson": Format(outlines=True),
    ".geojsonl": Format(outlines=True),
    ".topojson": Format(outlines=True),
    ".ttf": Format(outlines=True),
    ".otf": Format(outlines=True),
    ".dxf": Format(outlines=True),
    ".npz": Format(map=True),
}


def suffix_of(name: str | PathLike) -> str:
    """Return the suffix, in lower case."""
    return Path(name).suffix.lower()


def written(output: str) -> str:
    """Return a name whose suffix reports what an output holds: standard output is a PNG."""
    return "stdout.png" if output == "-" else output


def of(name: str | PathLike) -> Format:
    """Return what a file holds by its suffix; nothing where that is unknown."""
    return FORMATS.get(suffix_of(name), Format())


def picture(name: str | PathLike) -> PictureFormat:
    """Return how a file holds pixels by its suffix; of a suffix that is not in the table anything is expected."""
    return of(name).picture or PictureFormat()


def holding(what: str, *, written: bool = False) -> tuple[str, ...]:
    """Return the suffixes of files that hold something, one of the attributes of `Format`; only those that are
    `written`.
    """
    return tuple(suffix for suffix in FORMATS if _holds(suffix, what, written=written))


def _holds(suffix: str, what: str, *, written: bool) -> bool:
    held = getattr(FORMATS.get(suffix, Format()), what)
    return bool(held) and not (written and what == "picture" and suffix in READ_ONLY)


def check(name: str | PathLike, what: str, said: str, *others: str) -> None:
    """Refuse an output whose format does not hold something.

    Args:
        name: of the output.
        what: the attribute of `Format` that says so.
        said: of one that does not.
        others: what else may be named, of which the message reports.

    Raises:
        InputError: naming the suffixes that do, or that it is a folder.
    """
    if _holds(suffix_of(name), what, written=True):
        return
    if Path(name).is_dir():
        raise InputError(f"{name}: is a folder; name a file in it")
    known = dict.fromkeys(suffix for held in (what, *others) for suffix in holding(held, written=True))
    raise InputError(f"{name}: {said}; use one of {' '.join(known)}")


def check_report(name: str | None) -> None:
    """Refuse a name for a report that promises a picture, a drawing or a mesh.

    Raises:
        InputError: it does.
    """
    held = of(name or "")
    if held.picture or held.drawing or held.mesh or held.plot:
        raise InputError(f"{name}: the report is JSON; choose a name that ends in .json for --report")


def suffix_of_content(content: bytes) -> str:
    """Return the suffix of a picture's file by its first bytes: ".png", ".jpg", ".webp", or "" for others."""
    return HELD_SUFFIXES.get(picture_kind(content), "")


def picture_kind(content: bytes) -> str:
    """Return the format of a picture's file by its first bytes, such as "PNG", or "" for others."""
    if content[8:12] == b"WEBP":
        return "WebP"
    return next((kind for start, kind in PICTURE_BEGINNINGS.items() if content.startswith(start)), "")
