"""The table of options of every command, from which the command line, `Job` and manifests are made.

To add an option, add a row to the class of its command, or to `JobOptions` for `map`, `deform`, `edit` and manifests. A
row also names other commands that have the option. Nothing heavy is imported, because help reads this module.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_type_hints

from .. import fits
from .. import options as solver
from ..deadline import DEFAULT_SECONDS
from . import formats, limits, point_syntax, values

FILES = ("FILE", "IMAGE", "DIR", "OUT", "REGION")
"""Words in the placeholders of options whose values name files."""
NAMES = ("NAME", "ADDRESS", "SPECIMEN")
"""Placeholders of options whose values name other things."""
LARGEST_SIZE_FACTOR = 1e6  # factor of a texture's size
MOST_BYTE_DIGITS = 15  # digits of a number of bytes, K, M, G or T
KINDS = ("colour", "normal", "normal-down", "data")
"""Kinds of a picture's channels."""
SIMILARITY_RATIO = 0.75
"""Similarity (by `difflib`) of a mistyped name to the name suggested: --sise is similar enough to --size."""
TEXELS_BETWEEN_CHARTS = 4  # enough to keep their colours apart in a mipmap of a quarter of the size
CERTIFIED_AREA_SHARE = 0.99  # share of the source's area for `--require-injective` without a value


@dataclass(frozen=True)
class Option:
    """The description of an option besides its name and type.

    Attributes:
        help: a sentence; in brackets the meaning of the default, if that is None.
        metavar: placeholder for the value.
        default: the value if it is not given.
        least, above, most: smallest number allowed, or exclusive lower bound, and largest number. Options of the solver
            have the bounds and defaults of `iccm.options`, unless a row narrows them.
        topic: its heading in the help of commands with many options, a key of `TOPICS` in `io.option_groups`.
        parse: converts the text of the value.
        parse_each: converts each value of an option that may be repeated.
        solver: whether it is passed to `iccm.fit` and `iccm.deform`, unless it is None.
        commands: those that have the option; if empty, those of its class, or every command if the class names none.
        short: the one-letter name.
        required: whether it must be given.
        flag: its value if it is given without one.
        brief: the text in the short help, if `help` says more.
        basic: whether the short help of a command with many options includes it; those of its class are always
            included.
        aliases: other names that users try, each with a template for the value; they are not listed.
        old: former names, which work until the next major version, with a notice.
        hidden: commands that do not list it, because there is a better way, described by `instead`.
        words: synonyms, to suggest the option for unknown names.
    """

    help: str
    metavar: str | None = None
    _: KW_ONLY
    default: Any = None
    topic: str = ""
    least: float | None = None
    above: float | None = None
    most: float | None = None
    parse: Callable[[Any], Any] | None = None
    parse_each: Callable[[Any], Any] | None = None
    solver: bool = False
    commands: tuple[str, ...] = ()
    short: str = ""
    required: bool = False
    flag: str | None = None
    brief: str = ""
    basic: bool = False
    aliases: tuple[tuple[str, str], ...] = ()
    old: tuple[str, ...] = ()
    hidden: tuple[str, ...] = ()
    instead: str = ""
    words: str = ""

    @property
    def names_files(self) -> bool:
        """Whether its values name files, folders or parts of files."""
        return any(word in (self.metavar or "") for word in FILES)

    def value_of(self, raw: Any, hint: Any) -> Any:
        """Return the value of an option in the form that a job stores.

        Args:
            raw: text from the command line, or a value from a manifest or Python.
            hint: the type of the option.

        Raises:
            WrongValue: the value is invalid.
        """
        try:
            value = self.parse(raw) if self.parse else raw
            if self.parse_each and isinstance(value, list | tuple):
                value = values.each_of(value, self.parse_each)
            value = values.convert(value, hint)
            values.check_bounds(value, least=self.least, more_than=self.above, most=self.most)
            if self.names_files or self.metavar in NAMES:
                values.check_names(value)
        except values.WrongValue:
            raise
        except ValueError as error:
            raise values.WrongValue(str(error)) from None
        return value


def _option(*words: str, **more: Any) -> Any:
    """Return an `Option` in place of a default."""
    return Option(*words, **more)


TABLE: list[type] = []
"""All classes of options, in the order of help, which is that of this module."""


def _table(*commands: str) -> Callable[[type], type]:
    """Return a decorator for a class whose attributes are `Option` rows.

    The decorator completes the rows, moves them to the annotations, makes their defaults the attributes' values, and
    adds the class to `TABLE`.

    Args:
        commands: commands that have the options whose rows name none; if empty, every command has them.
    """

    def fill(cls: type) -> type:
        for name, hint in get_type_hints(cls).items():
            option = getattr(cls, name)
            if option.solver:
                option = _of_solver(name, hint, option)
            row = option if option.commands or not commands else replace(option, commands=commands)
            cls.__annotations__[name] = Annotated[hint, row]
            setattr(cls, name, row.default)
        TABLE.append(cls)
        return cls

    return fill


def _of_solver(name: str, hint: Any, option: Option) -> Option:
    """Complete the row of a solver option from `iccm.options`.

    The solver's default applies if the row has none; if None is allowed, the solver chooses it. The solver's bounds
    apply unless the row narrows them.
    """
    row = solver.ROWS[name]
    if option.default is None and NoneType not in get_args(hint):
        option = replace(option, default=solver.DEFAULTS[name])
    if option.least is None and option.above is None and math.isfinite(row.least) and row.is_number:
        option = replace(option, least=None if row.above is not None else row.least, above=row.above)
    if option.most is None and math.isfinite(row.most) and row.is_number:
        option = replace(option, most=row.most)
    return option


FREE_SIDE = 0
"""A side of a picture that follows from the other side and the proportions of the visible area."""


def size(value: Any) -> Any:
    """Parse a size: `WxH`, one number for the longer side, or `Wx` and `xH` for one side, with `FREE_SIDE` for the
    other."""
    if isinstance(value, str):
        return _parsed_size(value)
    if isinstance(value, int):
        sides = [value]
    elif isinstance(value, list | tuple):
        sides = [*value]
    else:
        return value  # pydantic refuses it
    is_one_free = len(sides) == 2 and sides != [FREE_SIDE, FREE_SIDE]
    _check_sides([side for side in sides if side != FREE_SIDE] if is_one_free else sides)
    return tuple(sides)


def _parsed_size(text: str) -> tuple[int, ...]:
    """Return the sides of a written size.

    Raises:
        ValueError: it has another form, no number, or sides that are not permitted.
    """
    if re.fullmatch(r"\s*\d+\s*", text):
        _check_sides([int(text)])
        return (int(text),)
    match = re.fullmatch(r"\s*(\d*)\s*[xX×]\s*(\d*)\s*", text)
    if match is None or not any(match.groups()):
        raise ValueError(f"{text!r} is not a size; write WxH or N, such as 1024x768 or 1024")
    _check_sides([int(side) for side in match.groups() if side])
    return tuple(int(side) if side else FREE_SIDE for side in match.groups())


def _check_sides(sides: list[Any]) -> None:
    """Raise ValueError if a number is too small or too large; pydantic refuses other values."""
    if any(isinstance(side, int | float) and not 1 <= side <= limits.SIDE for side in sides):
        raise ValueError(f"each side must be between 1 and {limits.SIDE} pixels")


def rows_and_columns(value: Any) -> Any:
    """Parse the size of a lattice: `ROWSxCOLUMNS`, or two numbers."""
    counts = value
    if isinstance(value, str):
        match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×]\s*(\d{1,9})\s*", value)
        if match is None:
            raise ValueError(f"{value!r} is not a lattice; write rows and columns, such as 4x5")
        counts = [int(match[1]), int(match[2])]
    are_counts = isinstance(counts, list | tuple) and all(isinstance(count, int) for count in counts)
    if are_counts and (min(counts, default=1) < 1 or math.prod(counts) > limits.HANDLES):
        raise ValueError(f"a lattice has at least 1x1 and at most {limits.HANDLES} points, such as 4x5")
    return counts


def kind(value: Any) -> Any:
    """Parse the kind of a picture's channels; American spelling is accepted, too."""
    value = "colour" if value == "color" else value
    if value not in KINDS:
        raise ValueError(f"{value!r} is not one of color, {', '.join(KINDS[1:])}")
    return value


def memory(value: Any) -> Any:
    """Parse an amount of memory, such as `2G`, `1.5GiB` or `800M`; units are powers of 1024."""
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([KMGT]?)(?:i?B)?\s*", value, re.IGNORECASE)
    if not match:
        raise ValueError(f"{value!r} is not an amount of memory; write one such as 2G or 800M")
    if len(match[1]) > MOST_BYTE_DIGITS:
        raise ValueError(f"{value[:MOST_BYTE_DIGITS]}… is more memory than any computer has")
    return int(float(match[1]) * 1024 ** " KMGT".index(match[2].upper() or " "))


def pair(value: Any) -> Any:
    """Parse two numbers: `X,Y`."""
    return _numbers(value, (2,), "two numbers, such as 10,-5")


def scale(value: Any) -> Any:
    """Parse one or two positive factors: `S` or `SX,SY`."""
    factors = _numbers(value, (1, 2), "a factor, such as 0.25, or two, such as 0.25,0.5")
    if isinstance(factors, tuple) and not all(
        1 / LARGEST_SIZE_FACTOR <= n <= LARGEST_SIZE_FACTOR for n in factors
    ):
        raise ValueError(f"a factor must be between {1 / LARGEST_SIZE_FACTOR:g} and {LARGEST_SIZE_FACTOR:g}")
    return factors


def _numbers(value: Any, counts: tuple[int, ...], what: str) -> Any:
    """Parse numbers separated by commas; their number must be in `counts`. Other values are returned unchanged."""
    try:
        parts = value.split(",") if isinstance(value, str) else value
        if not isinstance(parts, list | tuple):
            parts = [parts]
        numbers = tuple(map(float, parts)) if value is not None else None
    except (TypeError, ValueError, OverflowError):  # of an integer beyond all floats
        numbers = ()
    if numbers is not None and (len(numbers) not in counts or not all(map(math.isfinite, numbers))):
        raise ValueError(f"{value!r} is not {what}")
    return numbers


def turn(value: Any) -> Any:
    """Parse an angle in degrees, or `any`."""
    if not isinstance(value, str):
        return value
    try:
        return "any" if value.strip().lower() == "any" else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is not an angle; give degrees, such as 90, or the word any") from None


def rigid_size(value: Any) -> Any:
    """Parse a factor above 0, or `free`."""
    try:
        factor = value if value == "free" or not isinstance(value, str) else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is not a factor; give a number, such as 1.2, or the word free") from None
    if isinstance(factor, float | int) and not 0 < factor < math.inf:
        raise ValueError("a factor must be above 0, such as 1.2")
    return factor


def band_width(value: Any) -> Any:
    """Parse a width above 0, or `auto`."""
    try:
        width = value if value == "auto" or not isinstance(value, str) else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is not a width; give a number, such as 20, or the word auto") from None
    if isinstance(width, float | int) and not 0 < width <= limits.SVG_NUMBER:
        raise ValueError("a width must be above 0, such as 20")
    return width


def vertices(value: Any) -> Any:
    """Parse a number of vertices, or `source`."""
    if value == "source":
        return value
    if isinstance(value, str) and not value.isdecimal():
        raise ValueError(f"{value!r} is not a number of vertices; give a number or the word source")
    count = int(value) if isinstance(value, str) else value
    if isinstance(count, int) and not 3 <= count <= limits.VERTICES:
        raise ValueError(f"{count:d} is not between 3 and {limits.VERTICES}")
    return count


def share(value: Any) -> Any:
    """Parse a share of the area; True is the default share, and False is None."""
    if isinstance(value, bool):
        return CERTIFIED_AREA_SHARE if value else None
    try:
        area_share = float(value) if isinstance(value, str) else value
    except ValueError:
        raise ValueError(f"{value!r} is not a share; give a number such as 0.99") from None
    if isinstance(area_share, float | int) and not 0 < area_share <= 1:
        raise ValueError("a share must be above 0 and at most 1, such as 0.99")
    return area_share


def many(value: Any) -> Any:
    """Return a value as a sequence, for options that accept several."""
    if value is None:
        return ()
    return (value,) if isinstance(value, str | Path) else value


MESHES = " ".join(suffix for suffix, form in formats.FORMATS.items() if form.uv)
"""Suffixes of meshes that are written with texture coordinates; extensions add some, which help does not load."""
OUTPUT = "-o"
"""Value of --stmap that refers to the file in --output."""
EVERY = ("map", "deform", "apply")
EDITED = ("map", "deform", "edit")  # commands whose options affect the picture on the page
MORPHED = (*EDITED, "morph")


@_table("apply")
class ApplyOptions:
    """Options of `iccm apply`."""

    output: str = _option(
        "What to write, in the format of INPUT; - for stdout.",
        "FILE",
        required=True,
        short="-o",
        topic="output",
    )
    inverse: bool = _option(
        "Carry from the target back to the source (only for a map in an .npz file).", default=False
    )
    unmapped: Literal["drop", "keep", "refuse"] = _option(
        "What to do with points, lines and polygons outside the map's domain. drop: leave them out; "
        "keep: keep them, without a position; refuse: write nothing and report an error. Lines and "
        "polygons that cross the border are clipped (with refuse, an error).",
        default="drop",
        old=("outside",),
    )
    columns: str | None = _option(
        "Columns of x and y in a table, by name or number.  [default: those whose names say so, such as x and y, "
        "Centroid X and Centroid Y, lon and lat]",
        "X,Y",
    )
    pixel_size: float | None = _option(
        "Size of a unit of the map, such as a pixel of its picture, in the units of INPUT's coordinates.",
        "NUMBER", above=0, words="scale micrometre micron um calibration resolution spacing",
    )  # fmt: skip
    unit: Literal["um", "mm", "cm", "m", "in", "ft"] | None = _option(
        "Unit of INPUT's coordinates, for maps between files with sizes in real units.  [default: that of the map's "
        "files]",
        words="units scale size millimetres inches",
    )
    report: str | None = _option(
        "Report of what was carried and what lay outside the map (JSON); - for stdout.",
        "FILE.json",
        topic="output",
    )


@_table("compose")
class ComposeOptions:
    """Options of `iccm compose`."""

    output: str = _option("The saved map to write (.npz).", "FILE", required=True, short="-o", topic="output")


@_table("cartogram")
class CartogramOptions:
    """Options of `iccm cartogram`."""

    by: str = _option(
        "The property, or the column of --values, in proportion to which areas are.",
        "NAME",
        required=True,
    )
    values: str | None = _option("CSV file with the values.", "FILE.csv")
    key: str | None = _option(
        "Property of the regions, and column of --values, by which both are joined.  [default: the first column]",
        "NAME",
    )
    max_points: int = _option(
        "Simplify borders to about this many points together.", "N", default=10000, least=100
    )
    output: str = _option(
        "The cartogram to write (.geojson); - for stdout.", "FILE", required=True, short="-o", topic="output"
    )
    save: str | None = _option(
        "Saved map, for other layers by iccm apply; for regions in a projected coordinate system.",
        "FILE.npz",
        topic="output",
    )
    report: str | None = _option(
        "Report of areas and distortion (JSON); - for stdout.", "FILE.json", topic="output"
    )


@_table("field")
class FieldOptions:
    """Options of `iccm field`."""

    output: str = _option(
        "What to write: .nrrd .mha .nii .nii.gz, .npz, .exr or .tif.",
        "FILE",
        required=True,
        short="-o",
        topic="output",
    )
    fixed: str | None = _option(
        "Picture that covers the target's canvas: the field has its pixels, and in .nrrd .mha .nii its place in space."
        "  [default: a pixel for each unit]",
        "IMAGE",
        topic="output",
    )
    size: tuple[int] | tuple[int, int] | None = _option(
        "Size of the field in pixels, or its longer side.  [default: that of --fixed]",
        "WxH|N",
        parse=size,
        topic="output",
    )
    moving: str | None = _option(
        "Picture that covers the source's canvas, to which the field refers.  [default: a pixel for each unit]",
        "IMAGE",
        topic="output",
    )
    vectors: Literal["stmap", "pixels"] | None = _option(
        "Contents of a picture. stmap: places in the source from 0 to 1; pixels: distances to them in pixels, to the "
        "right (red) and upwards (green).  [default: stmap]",
        topic="output",
    )


@_table("map")
class TextOptions:
    """Options of `iccm map` that set a text in place of a file."""

    text: str | None = _option(
        "Use this text in --font as SOURCE: iccm map --text Hello heart.svg; --fit box bends it into the target.",
        "TEXT",
        basic=True,
        topic="shapes",
        words="word words letters string",
    )
    target_text: str | None = _option(
        "Use this text in --font as TARGET: iccm map photo.jpg --target-text Sky.", "TEXT", topic="shapes"
    )
    font: str | None = _option(
        "Font of --text and --target-text: a .ttf or .otf file, or the name of an installed font, such as "
        "'DejaVu Serif Bold'.  [default: DejaVu Sans Bold]",
        "FILE|NAME",
        topic="shapes",
        words="typeface family",
    )
    font_variation: str | None = _option(
        "Axes of a variable --font, such as wght=700 or wght=700,wdth=85.",
        "AXIS=VALUE",
        topic="shapes",
        words="variable weight width axis",
    )


@_table("flatten")
class FlattenOptions:
    """Options of `iccm flatten`."""

    output: tuple[str, ...] = _option(
        "What to write: the outline (.svg .dxf), the flat mesh (.obj), the mesh with its flattening as "
        "texture coordinates (as --uv), or a picture of --overlay (.png .tif .exr).",
        "FILE",
        default=(),
        parse=many,
        short="-o",
        topic="output",
    )
    uv: str | None = _option(
        f"Write the mesh with its flattening as texture coordinates ({MESHES}, and mesh formats of extensions: "
        "iccm info --formats).",
        "FILE",
        topic="output",
    )
    method: str = _option(
        "How to flatten. conformal: keeps angles, never folds; lscm: least squares conformal maps, which "
        "may fold; balanced: keeps angles and areas as far as possible.",
        "[conformal|lscm|balanced]", default="balanced",
        topic="method",
    )  # fmt: skip
    overlay: str | None = _option(
        "Numbers or labels at the vertices (GIFTI, FreeSurfer's curv, thickness or annot, .mgh, .txt, an array of "
        "a VTK file as part.vtp#pressure), shown in the flattening by -o FILE.png, or as plain numbers "
        "by -o FILE.tif or .exr.",
        "FILE",
        topic="output",
        words="curvature sulc thickness annot labels colour data scalar",
    )
    colormap: str | None = _option(
        "Colour map of --overlay, as Matplotlib names it.  [default: coolwarm around 0, viridis for one sign]",
        "NAME",
        topic="output",
    )
    overlay_range: tuple[float, float] | None = _option(
        "Numbers of --overlay at both ends of the colour map.  [default: the 2nd and 98th percentile]",
        "LOW,HIGH",
        parse=pair,
        topic="output",
    )
    onto: str | None = _option(
        "Flatten onto the outline of a drawing or picture (outline.svg, sheet.svg#id), with as uniform a "
        "scale as the surface allows. Replaces --method.", "OUTLINE",
    )  # fmt: skip
    carry_maps: bool = _option(
        "With --uv FILE.glb or .obj: carry the other maps of its materials to the new coordinates.",
        default=False,
        topic="mesh",
    )
    subdivide_rim: bool = _option(
        "With --onto: split triangles at the boundary until its edges follow the outline.",
        default=False,
        topic="mesh",
    )
    parts: Literal["all", "largest"] = _option(
        "Which pieces to flatten. all: every piece of every geometry, packed side by side at one scale; "
        "largest: only the largest piece.",
        default="all", words="pieces components multiple all whole islands",
        topic="shapes",
    )  # fmt: skip
    margin: int = _option(
        "Distance between charts, in texels of a texture of 1024 by 1024.",
        "TEXELS", default=TEXELS_BETWEEN_CHARTS, least=0, most=256, words="padding gap spacing",
    )  # fmt: skip
    charts: Literal["auto", "one"] = _option(
        "Where to cut a piece. auto: hard surfaces that one chart would distort are cut along their edges into nets, "
        "such as a cross for a cube, with the shortest seams; one: each piece stays one chart.",
        default="auto", words="islands segmentation seams net unfold unwrap smart uv",
        topic="mesh",
    )  # fmt: skip
    max_distortion: float | None = _option(
        "With --charts auto: distortion from which a piece is cut into more charts: the dilatation (longer over "
        "shorter axis of a small circle's image) on all but 5 % of its area.  [default: 1.1 for hard surfaces, "
        "1.5 for others]",
        "RATIO", least=1, words="stretch tolerance bound k95",
        topic="mesh",
    )  # fmt: skip
    seams: str | None = _option(
        "Seams to cut along: an OBJ file with lines (l) between vertices of the mesh, or a mesh whose texture "
        "coordinates have them. Charts are divided further only where they cannot be flattened, or exceed "
        "--max-distortion.  [default: lines in the mesh's own OBJ file]",
        "FILE", words="seam mark edges cut uv borders blender",
        topic="mesh",
    )  # fmt: skip
    unit: Literal["um", "mm", "cm", "m", "in", "ft"] | None = _option(
        "Unit of the mesh, for the size of .svg and .dxf.  [default: the mesh's own (glTF, USD, 3MF), else mm]",
        words="units scale size millimetres inches metres dimension",
        topic="output",
    )  # fmt: skip
    no_cut: bool = _option(
        "Refuse surfaces that have to be cut open: closed ones, and those with handles. Do not cut bag-like ones.",
        default=False, words="seam seams unwrap open",
        topic="mesh",
    )  # fmt: skip
    cut_open: bool = _option(
        "Cut open closed surfaces, also with --onto.",
        default=False,
        old=("cut",),
        hidden=("flatten",), instead="surfaces are cut where they have to be, unless --no-cut is given",
        topic="mesh",
    )  # fmt: skip
    report: str | None = _option(
        "Report of the flattening (JSON); - for stdout.", "FILE.json", topic="output"
    )
    plot: str | None = _option(
        "Plot the flat mesh, colored by its distortion, and the surface with a checkerboard (.png .svg .pdf).",
        "FILE.png",
        topic="output", words="heat map distortion",
    )  # fmt: skip
    preview: str | None = _option(
        "Contact sheet: the mesh with a checkerboard from four sides.",
        "FILE.png",
        topic="output", words="render thumbnail turntable views",
    )  # fmt: skip


@_table("morph")
class MorphOptions:
    """Options of `iccm morph`, in addition to those of a job."""

    frames: int = _option(
        "Number of frames, including the first and the last shape.", "N", default=24, least=2, most=10_000
    )
    fps: float = _option("Frames per second.", default=12.0, above=0, most=1000)
    back_and_forth: bool = _option(
        "Run animations to the target and back, so that they loop without a jump.", default=False,
        words="loop ping-pong boomerang alternate yoyo reverse bounce mirror endless",
    )  # fmt: skip
    output: tuple[str, ...] = _option(
        "What to write: an animation in a loop (.webp .gif .png, .svg with SMIL, .css.svg with CSS, .json for Lottie), "
        "or one file for each frame if the name contains {number}: pictures, or artwork (.svg). May be repeated.",
        "FILE",
        default=(), parse=many, required=True, short="-o",
        topic="output",
    )  # fmt: skip
    target_texture: str | None = _option("Texture of TARGET; the source's texture fades into it.", "IMAGE")


@_table("relayout")
class RelayoutOptions:
    """Options of `iccm relayout`."""

    texture: tuple[str, ...] = _option(
        "A colour texture to transfer. May be repeated, like the next three options.",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    normal: tuple[str, ...] = _option(
        "A tangent-space normal map with y pointing up (OpenGL, glTF, Blender).",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    normal_down: tuple[str, ...] = _option(
        "A normal map with y pointing down (DirectX convention).",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    data: tuple[str, ...] = _option(
        "A picture of numbers, such as roughness, height or a mask.",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    output: tuple[str, ...] = _option(
        "What to write: NEW as .glb or .obj with all maps of OLD's materials; or pictures, one -o for "
        "each input picture, or one name with {stem} for all of them. May be repeated.",
        "FILE", default=(), parse=many, required=True, short="-o",
        topic="output",
    )  # fmt: skip
    size: tuple[int] | tuple[int, int] | None = _option(
        "Size of the new pictures; one number makes them square.  [default: as dense on the surface as "
        "the old ones]",
        "WxH|N",
        parse=size,
        topic="output",
    )
    match: Literal["auto", "index", "topology", "position"] = _option(
        "How triangles of the two meshes are matched. position: by the positions of their corners; "
        "index: by their order in the files; topology: by how they are connected; auto: by position if "
        "that matches half of them, else by order if the faces have the same vertices, else by topology "
        "if it is the same, else by position after a similarity.",
        default="auto",
    )
    limit: float = _option(
        "Largest distance between the surfaces, relative to the diagonal; texels farther away stay empty.",
        default=0.01,
        least=0,
        topic="mesh",
    )
    padding: int | None = _option(
        "Texels by which colours extend beyond the charts, -1 for all; normals are flat beyond.  [default: -1, and "
        "size / 32 for normals]",
        least=-1,
        topic="output",
    )
    report: str | None = _option("Report of the transfer (JSON); - for stdout.", "FILE.json", topic="output")


@_table("batch")
class BatchOptions:
    """Options of `iccm batch`."""

    root: str | None = _option(
        "Folder for outputs; nothing is written outside it.  [default: the manifest's folder]", "DIR"
    )
    allow_outside: bool = _option(
        "Allow outputs outside the root folder, and patterns that match files outside the manifest's folder.",
        default=False,
        old=("outside",),
        topic="output",
    )
    workers: int | None = _option(
        "Number of worker processes.  [default: all cores]",
        least=1,
        commands=("batch", "standardize"),
        short="-j",
        words="jobs processes cores parallel",
        topic="limits",
    )
    threads: int = _option(
        "Threads per worker.", default=1, least=1, commands=("batch", "standardize"), topic="limits"
    )
    dask: str | None = _option(
        "Use a Dask cluster, such as tcp://host:8786, instead of processes.",
        "ADDRESS",
        topic="limits",
    )
    timeout: float | None = _option(
        "Time limit for each job.", "SECONDS", above=0, commands=("batch", "standardize"), topic="limits"
    )
    retries: int = _option("How often to retry a job whose worker died.", default=1, least=0, topic="limits")
    fail_fast: bool = _option("Start no further jobs after the first failure.", default=False)
    resume: bool = _option(
        "Skip jobs (or frames of a --sequence) that an earlier run completed and whose inputs have not changed.",
        default=False, commands=("batch", "map", "standardize"),
        topic="limits",
    )  # fmt: skip
    dry_run: bool = _option(
        "Check all jobs without running them.",
        default=False,
        old=("check",),
        words="validate test",
        topic="output",
    )
    html: str | None = _option(
        "Write a page with status, figures, thumbnails and links to the outputs.",
        "FILE.html",
        topic="output",
    )


@_table("standardize")
class StandardizeOptions:
    """Options of `iccm standardize`."""

    output: str = _option("Folder to write.", "OUT", required=True, short="-o", topic="output")
    landmarks: str | None = _option(
        "Landmarks: a file for all specimens (.tps, or a table with a column of specimens), a folder with a file for "
        "each, or the name of such a file with {stem}.  [default: files beside the specimens]",
        "FILE|DIR",
        words="points pins tps",
        topic="constraints",
    )
    outlines: str | None = _option(
        "Drawings with the outlines, if they are not the silhouettes in the pictures, such as 'outlines/{stem}.svg'; "
        "the canvas of each is its picture.",
        "FILE",
        words="masks contours silhouettes",
        topic="shapes",
    )
    reference: str | None = _option(
        "Map onto this specimen instead of the mean shape.", "SPECIMEN", words="target mean", topic="shapes"
    )
    reflect: bool = _option(
        "Use mirror images of pictures that fit the others better, such as those of left and right wings.",
        default=False,
        words="mirror flip reflection",
        topic="shapes",
    )
    size: tuple[int] | tuple[int, int] | None = _option(
        "Size of the pictures in pixels, or its longer side.  [default: 1024]",
        "WxH|N",
        parse=size,
        topic="output",
    )


@_table("check")
class CheckOptions:
    """Options of `iccm check`."""

    tolerances: str | None = _option(
        "File of allowed differences.  [default: BASELINES/tolerances.toml, if it exists]",
        "FILE",
    )
    junit: str | None = _option(
        "Write a JUnit report for CI, with one test case per file.", "FILE.xml", topic="output"
    )
    diff: str | None = _option(
        "Write pictures of each difference: baseline, run, difference.", "DIR", topic="output"
    )
    html: str | None = _option(
        "Write a page with pictures before and after, figures and limits.",
        "FILE.html",
        topic="output",
    )
    summary: str | None = _option(
        "Write a summary in Markdown, such as for a CI job's page; - for stdout.",
        "FILE.md",
        topic="output",
    )
    json: bool = _option("Print one JSON object per file, one per line.", default=False, topic="output")
    update: bool = _option("Replace the baselines by this run.", default=False)
    only: tuple[str, ...] = _option(
        "Compare or update only these files (a name or a pattern). May be repeated.", "NAME", default=(),
        parse=many,
    )  # fmt: skip


@_table("info")
class InfoOptions:
    """Options of `iccm info`."""

    formats: bool = _option(
        "List all suffixes, and what such files can contain.", default=False, topic="output"
    )
    json: bool = _option("Print one JSON object per file, one per line.", default=False, topic="output")
    plot: str | None = _option(
        "Draw the numbered parts of one file (.png .svg .pdf).", "FILE.png", topic="output"
    )


@_table("doctor")
class DoctorOptions:
    """Options of `iccm doctor`."""

    json: bool = _option("Print one JSON object per finding, one per line.", default=False, topic="output")


@_table("completion")
class CompletionOptions:
    """Options of `iccm completion`."""

    shell: Literal["bash", "zsh", "fish"] | None = _option(
        "The shell to set up.  [default: the login shell, from $SHELL]"
    )


@_table("plugins")
class PluginsOptions:
    """Options of `iccm plugins`."""

    to: str | None = _option(
        "The folder of extensions to install into; for Blender also the name of a .zip file to write.  "
        "[default: the program's own folder]",
        "DIR",
    )


@_table("map", "deform")
class JobOptions:
    """Options of a job, by topic, in the order in which help shows them."""

    texture: str | None = _option(
        "Picture or SVG to carry through the map; checker is a numbered checkerboard.  [default: SOURCE, "
        "or checker if both shapes are plain outlines of one colour]",
        "IMAGE", commands=MORPHED, basic=True,
        brief="Picture or SVG to carry through the map.  [default: SOURCE, or a checkerboard for two plain "
              "outlines]",
        aliases=(("image", "{}"), ("picture", "{}"), ("photo", "{}")), words="pattern input material fill",
        topic="texture",
    )  # fmt: skip
    background: Literal["paper", "transparent", "target"] | None = _option(
        "What to show behind the result. paper: a tint of the colours of a drawing that is its own texture, inside "
        "TARGET; transparent: nothing; target: TARGET's own drawing or photo, on its whole canvas.  [default: paper; "
        "transparent for file#canvas]",
        commands=("map",), basic=True,
        brief="What to show behind the result; target: TARGET's own drawing or photo.",
        old=("gaps",), words="transparent alpha paper bare over under composite keep below behind backdrop",
        topic="texture",
    )  # fmt: skip
    normal: tuple[str, ...] = _option(
        "A tangent-space normal map with y pointing up, to carry through the same map. Give one -o for "
        "each picture of this option and the next two, or one -o with {stem}, the picture's name, for "
        "all; a mesh (-o x.glb) includes its normal map. May be repeated.", "IMAGE", default=(), parse=many,
        topic="texture",
    )  # fmt: skip
    normal_down: tuple[str, ...] = _option(
        "A normal map with y pointing down (DirectX convention).",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    data: tuple[str, ...] = _option(
        "A picture of numbers, such as roughness, height or a mask.",
        "IMAGE",
        default=(),
        parse=many,
        topic="texture",
    )
    texture_box: Literal["viewbox", "bbox"] | None = _option(
        "Area of the source that the texture covers: its canvas (viewbox) or its outline's bounding box "
        "(bbox).  [default: viewbox; for the checkerboard bbox]",
        commands=(*MORPHED, "apply"),
        topic="texture",
    )
    texture_scale: tuple[float] | tuple[float, float] | None = _option(
        "Size of the texture relative to the size at which it covers the source, scaled about its "
        "centre; two numbers: across and down.",
        "S|SX,SY", parse=scale,
        topic="texture",
    )  # fmt: skip
    texture_offset: tuple[float, float] | None = _option(
        "Move the texture on the source, in the file's units.",
        "X,Y",
        parse=pair,
        topic="texture",
    )
    texture_turn: float = _option(
        "Rotate the texture on the source, counter-clockwise about its centre.",
        "DEGREES",
        default=0.0,
        topic="texture",
    )
    edge: Literal["clamp", "transparent", "repeat", "mirror"] = _option(
        "What to show beyond the texture's edge. clamp: the colours of its edge; transparent: nothing; "
        "repeat, mirror: the texture again.",
        default="clamp", commands=(*EVERY, "edit"), words="wrap tile tiling border repeat",
        topic="texture",
    )  # fmt: skip
    filter: Literal["auto", "nearest", "linear", "cubic", "lanczos", "spline"] = _option(
        "Filter that samples the texture; use nearest for label maps and masks.",
        default="auto",
        commands=(*EVERY, "morph", "edit", "relayout"),
        topic="texture",
    )
    kind: Literal["colour", "normal", "normal-down", "data"] = _option(
        "Meaning of the picture's channels; normals (y up or down) are rotated with the map.  [default: color]",
        "[color|normal|normal-down|data]",
        default="colour",
        parse=kind,
        commands=EVERY,
        hidden=("map", "deform"),
        instead="pass the picture to --normal, --normal-down or --data instead of --texture",
        topic="texture",
    )
    colorspace: str | None = _option(
        "Colour space of the texture (OpenColorIO name).  [default: from the file]",
        "NAME",
        commands=(*EVERY, "edit"),
        topic="texture",
    )
    output: tuple[str, ...] = _option(
        "What to write, by suffix: a picture (.png .jpg .tif .exr .webp .hdr), a mesh (.obj), artwork (.svg), "
        "the map itself (.npz); - for a PNG on stdout. May be repeated.  [default, when nothing else is "
        "written: SOURCE-TARGET.png or SHAPE-deformed.png here]", "FILE", default=(), parse=many, short="-o",
        basic=True,
        brief="What to write: .png .jpg .exr, .svg (the drawing), .obj .glb (a mesh), .npz (the map). May be repeated.",
        aliases=(("out", "{}"),), words="save write result export",
        topic="output",
    )  # fmt: skip
    size: tuple[int] | tuple[int, int] | None = _option(
        "Size of the picture in pixels, or its longer side; 800x and x600 set one side.  [default: 1024]",
        "WxH|N",
        parse=size,
        commands=(*EVERY, "morph"),
        basic=True,
        brief="Size of the picture in pixels, or its longer side.  [default: 1024]",
        aliases=(("width", "{}x"), ("height", "x{}")),
        words="resolution dimensions dpi pixels res scale",
        topic="output",
    )
    target_box: Literal["viewbox", "bbox"] | None = _option(
        "Area of the target that pictures show: its canvas (viewbox) or its outline's bounding box "
        "(bbox).  [default: viewbox; bbox if the shape takes up little of its canvas]",
        commands=(*MORPHED, "apply"),
        topic="output",
    )
    padding: int | None = _option(
        "Pixels by which colours extend beyond the outline, or beyond the charts of a mesh; -1: over the whole "
        "picture.  [default: 0; charts: -1, and size / 32 for normals]",
        "N",
        least=-1,
        topic="output",
    )
    padding_fill: Literal["push-pull", "nearest"] = _option(
        "How to fill the padding.",
        default="push-pull",
        old=("fill",),
        topic="output",
    )
    stmap: str | None = _option(
        "Write the map as an STMap, for `iccm apply` and compositors; without FILE, the file of -o is "
        "the STMap (-o map.exr --stmap).",
        "[FILE.exr]", flag=OUTPUT, words="uvmap displacement warp",
        topic="output",
    )  # fmt: skip
    report: str | None = _option("Report of the run (JSON); - for stdout.", "FILE.json", topic="output")
    max_line_error: float | None = _option(
        "Largest distance of lines in drawings (.svg .dxf) and files of lines from their exact images, in the units of "
        "the output; in .dxf in millimetres.  [default: 2e-4 of the target's diagonal]",
        "DISTANCE",
        above=0,
        commands=("map", "deform", "apply"),
        topic="output",
        words="tolerance precision accuracy",
    )
    plot: str | None = _option(
        "Plot grids, the result, distortion and notes (.png .svg .pdf).", "FILE.png", topic="output"
    )
    preview: str | None = _option(
        "Contact sheet of a mesh target: its textured surface from four sides.",
        "FILE.png", commands=("map",), words="render thumbnail turntable views",
        topic="output",
    )  # fmt: skip
    compare: str | None = _option(
        "Contact sheet of the results of all values of --fit, with their costs, to choose one by eye.",
        "FILE.png", commands=("map",), words="sheet candidates choose alternatives side-by-side",
        topic="output",
    )  # fmt: skip
    force: bool = _option(
        "Replace existing files.",
        default=False,
        commands=(
            *EVERY,
            "compose",
            "cartogram",
            "field",
            "morph",
            "flatten",
            "relayout",
            "batch",
            "standardize",
            "info",
            "init",
        ),
        basic=True,
        aliases=(("overwrite", "{}"),),
        words="replace clobber yes",
        topic="output",
    )
    parts: Literal["auto", "joined", "each", "elements", "all", "largest"] = _option(
        "How drawings of several parts are mapped. joined: each drawing as a whole, in a frame around "
        "all its parts; all: each part onto a separate partner; auto: whichever of these two costs less; "
        "each: the source onto every part of the target, such as the letters of a word; elements: onto "
        "every letter or element with all of its parts, such as an i with its dot; largest: only the "
        "largest part of each.",
        default="auto", commands=("map", "morph"), basic=True,
        brief="How drawings of several parts are mapped.", words="pieces components letters multiple all whole",
        topic="shapes",
    )  # fmt: skip
    fit: fits.FitName | None = _option(
        fits.help_text(),
        solver=True, commands=("map", "morph"), basic=True,
        brief="What may be cropped or left empty where the shapes differ; box bends a drawing or text into the target.",
        words="mode crop contain cover frame",
        topic="shapes",
    )  # fmt: skip
    detail: float | None = _option(
        "How much the edges of a drawing or photo that is its own picture count when maps are compared, from 0 "
        "(only areas count) to 1. With detail, the drawing may be placed whole and upright in the target, with paper "
        "around.  [default: 1; 0 with --texture]",
        "WEIGHT", least=0, most=1, commands=("map",),
        words="compose composition subject saliency edges",
        topic="shapes",
    )  # fmt: skip
    faces: Literal["auto", "on", "off"] = _option(
        "Whether faces in a photo that is its own picture count as much as all of its other detail, and are hardly "
        "bent. auto: in photos, also embedded ones; on: in drawings, too; off: nowhere.",
        default="auto", commands=("map",), words="face portrait people head detector",
        topic="shapes",
    )  # fmt: skip
    place: solver.PlaceName = _option(
        "How the drawing is placed on the target. fill: it takes the target's form; inside: it keeps its "
        "proportions and is as large as possible inside the target; slice: it keeps its proportions, "
        "covers the target and is cropped to it.", solver=True, commands=("map",), basic=True,
        brief="Fill the target, or keep the drawing's proportions inside it or covering it.",
        words="aspect proportions ratio undistorted logo meet preserve",
        topic="shapes",
    )  # fmt: skip
    along: float | Literal["auto"] | None = _option(
        "Bend the source's box along a line of the target, like text on a path: it becomes a band of this width, in "
        "the target's units, with the source's baseline on the line; auto: the width that keeps the source's "
        "proportions.",
        "WIDTH|auto", parse=band_width, commands=("map",),
        words="path line curve follow text-on-path brush ribbon arc",
        topic="shapes",
    )  # fmt: skip
    holes: Literal["auto", "keep", "cut", "fill"] = _option(
        "How holes are treated. keep: holes are mapped onto holes and stay transparent; cut: the map "
        "ignores holes, and the target's stay transparent; fill: the map ignores holes and paints over "
        "them; auto: keep or cut, whichever costs less, and fill for shapes drawn only with lines.", default="auto",
        commands=MORPHED, basic=True,
        brief="Map holes onto holes, cut them out, or fill them.",
        words="hole counters islands",
        topic="shapes",
    )  # fmt: skip
    max_left_out: float | None = _option(
        "Largest share of the source that may be hidden, such as 0.1.  [default: no limit]", "SHARE",
        solver=True, commands=("map",),
        topic="shapes",
    )  # fmt: skip
    max_uncovered: float | None = _option(
        "Largest share of the target that may stay bare, such as 0.1.  [default: no limit]", "SHARE",
        solver=True, commands=("map",),
        topic="shapes",
    )  # fmt: skip
    trace: Literal["auto", "dark", "light", "inside"] = _option(
        "Which part of a picture is the shape. auto: its opaque part, else the part that stands out from "
        "the background, or the inside of a line; dark, light: the part that is darker or lighter than "
        "the background; inside: the area that a line encloses.", default="auto", commands=MORPHED,
        words="threshold background silhouette alpha invert",
        topic="shapes",
    )  # fmt: skip
    sequence: bool = _option(
        "SOURCE, TARGET or --texture are patterns of frames ('frames/*.svg'). Each frame continues from "
        "the map of the previous one, and its map is saved next to its picture (.npz).",
        default=False, commands=("map",),
        topic="shapes",
    )  # fmt: skip
    pin: tuple[Any, ...] = _option(
        "A source point and its target point, in the files' units. May be repeated.", "SX,SY:TX,TY",
        default=(), parse=many, parse_each=point_syntax.pin, commands=MORPHED, basic=True,
        brief="A source point and its target point, which is met closely, or exactly with --exact-pins. May be "
        "repeated.",
        words="point points landmark landmarks anchor correspondence pins handle",
        topic="constraints",
    )  # fmt: skip
    exact_pins: bool = _option(
        "Map each pin exactly onto its target point, whatever distortion that causes. Without this option, "
        "a small patch around the pin is brought close to it.",
        solver=True, commands=("map", "deform", "morph", "edit"), words="hard strict soft nail",
        topic="constraints",
    )  # fmt: skip
    rigid: tuple[str, ...] = _option(
        "A region of the source that is moved, rotated and scaled but not bent: #id of an element of the "
        "drawing (or a group or material of an OBJ or GLB), or a mask picture that is white where rigid. "
        "May be repeated.", "REGION", default=(),
        parse=many, basic=True,
        brief="A part of the source that is not bent: #id, or a mask. May be repeated.",
        words="mask protect keep lock stiff bones",
        topic="constraints",
    )  # fmt: skip
    rigid_target: tuple[str, ...] = _option(
        "A region of the target in which the picture is not bent, given like --rigid, which it replaces. "
        "May be repeated.", "REGION",
        default=(), parse=many, commands=("map",),
        topic="constraints",
    )  # fmt: skip
    rigid_each: bool = _option(
        "Keep each part of a rigid group rigid separately, such as the letters of a word; without this option, the "
        "group moves as one body.",
        default=False,
        words="separate group letters",
        topic="constraints",
    )
    rigid_size: float | Literal["free"] | None = _option(
        "Size of rigid regions relative to the mean scale of the map; free: chosen by the solver.  "
        "[default: 1, or as large as there is room]",
        "FACTOR|free", parse=rigid_size, solver=True, commands=("map",),
        topic="constraints",
    )  # fmt: skip
    constraints: str | None = _option(
        "Read pins and strokes from a JSON file, - for stdin; or pairs of landmarks of BigWarp (.csv), QGIS (.points) "
        "or TPS (.tps), or the ground control points of a GeoTIFF (.tif).",
        "FILE",
        commands=MORPHED,
        aliases=(("pins", "{}"),),
        words="strokes pins-file",
        topic="constraints",
    )
    source_landmarks: str | None = _option(
        "Read points on the source from a file of any program (.csv .tps .json .roi .zip .pts). Each becomes a pin to "
        "the point of --target-landmarks with the same name, or to that at the same place in the list.",
        "FILE",
        commands=("map", "morph"),
        words="points pins imagej napari elastix labelme fiji",
        topic="constraints",
    )
    target_landmarks: str | None = _option(
        "Read points on the target, see --source-landmarks.", "FILE", commands=("map", "morph"),
        words="points pins imagej napari elastix labelme fiji",
        topic="constraints",
    )  # fmt: skip
    handles: tuple[int, int] | None = _option(
        "Write the map to -o FILE.json with handles: so many rows and columns of soft pins on the source's bounding "
        "box. --constraints FILE.json then makes the same map again; move handles in the file or in iccm edit to "
        "change it.",
        "ROWSxCOLUMNS", parse=rows_and_columns, commands=("map",),
        words="lattice envelope grid cage ffd mesh warp control",
        topic="constraints",
    )  # fmt: skip
    importance: str | None = _option(
        "A picture on the source's canvas that is bright where distortion matters: white counts ten "
        "times as much as black.",
        "IMAGE", commands=("map",),
        topic="constraints",
    )  # fmt: skip
    size_map: str | None = _option(
        "A picture on the source's canvas that is bright where the result should be larger: lengths on "
        "white become twice those on black.",
        "IMAGE", commands=("map",),
        topic="constraints",
    )  # fmt: skip
    start: str | None = _option(
        "Continue from an earlier map (.npz) of these shapes or of the previous frame, so that the "
        "result does not jump; if the shapes differ too much, a new map is computed (balanced).", "FILE.npz",
        topic="constraints",
    )  # fmt: skip
    method: solver.MethodName | None = _option(
        "balanced: nearly uniform scale, meets the outline, pins and strokes; conformal: keeps angles "
        "exactly; paper: Algorithm 1 as published.  [default: balanced; conformal with its own options]", solver=True,
        topic="method",
    )  # fmt: skip
    balance: float = _option(
        "Weight of areas against angles: 0 keeps angles only, 1 weights both equally, larger values keep "
        "areas (balanced).", "THETA",
        solver=True, commands=MORPHED,
        topic="method",
    )  # fmt: skip
    turn: float | Literal["any"] | None = _option(
        "Rotation of the picture in degrees, counter-clockwise; any: whatever suits the shapes best "
        "(balanced).  [default: 0, or from pins]",
        "DEGREES|any", parse=turn, solver=True, commands=("map", "morph", "edit"), basic=True,
        brief="Rotation of the picture in degrees.",
        aliases=(("rotate", "{}"),), words="rotation angle orientation upright",
        topic="method",
    )  # fmt: skip
    effort: int | None = _option(
        "Multiply the search effort by N: slower, and sometimes a better map.  [default: 1]", "N",
        solver=True, commands=("map", "morph"), old=("starts",), words="quality tries attempts",
        topic="method",
    )  # fmt: skip
    max_dilatation: float | None = _option(
        "Largest dilatation allowed (balanced).",
        "K",
        above=1,
        solver=True,
        commands=EDITED,
        topic="method",
    )
    max_stretch: float | None = _option(
        "Largest stretch allowed (balanced).",
        "S",
        above=1,
        solver=True,
        commands=EDITED,
        topic="method",
    )
    tolerance: float = _option(
        "Largest distance between the mapped outline and the target's outline, relative to its diagonal.",
        solver=True,
        commands=MORPHED,
        topic="method",
    )
    require_injective: float | None = _option(
        "Exit with code 1 unless the map is certified one-to-one on this share of the source's area.  [0.99]",
        "[SHARE]",
        above=0, most=1, parse=share, flag=str(CERTIFIED_AREA_SHARE),
        topic="method",
    )  # fmt: skip
    plane: Literal["flat", "uv"] = _option(
        "The plane in which meshes are mapped. flat: their flattening; uv: their texture coordinates, like #uv.",
        default="flat", hidden=("map", "deform"), instead="append #uv to the mesh's name instead: FILE#uv",
        topic="mesh",
    )  # fmt: skip
    cut_open: bool = _option(
        "Also cut a mesh with a boundary, where that makes the scale more uniform, if it is mapped by landmarks or "
        "onto another mesh; all other meshes are cut automatically where necessary.",
        default=False, commands=EDITED, old=("cut",), words="seam seams unwrap open",
        topic="mesh",
    )  # fmt: skip
    no_cut: bool = _option(
        "Refuse closed meshes and those with handles instead of cutting them open.", default=False,
        commands=EDITED, words="seam seams unwrap open",
        topic="mesh",
    )  # fmt: skip
    bake: bool = _option(
        "Keep the texture coordinates that the target mesh already has, and bake a picture for them; a mesh (.glb "
        ".gltf .obj) gets it as its material.",
        default=False,
        commands=("map",),
        topic="mesh",
    )
    overlap: Literal["refuse", "mirror"] = _option(
        "Charts that overlap in the layout of the mesh and show different parts of the texture. refuse: exit with 1; "
        "mirror: they are meant to share their texels, as mirrored halves are, which show the first of them.",
        default="refuse", commands=("map", "relayout"), words="overlapping stacked mirrored symmetric uv",
        topic="mesh",
    )  # fmt: skip
    carry_maps: bool = _option(
        "Also carry the other maps of a mesh's materials (normals, roughness, …) to the new coordinates.",
        default=False, commands=("map",),
        topic="mesh",
    )  # fmt: skip
    subdivide: int = _option(
        "Halve the edges of all triangles of the target N times, each into four: maps onto meshes of few triangles, "
        "such as boxes, then stretch the picture much less.",
        "N", default=0, least=0, most=6, commands=("map",), words="subdivision refine tessellate coarse box",
        topic="mesh",
    )  # fmt: skip
    subdivide_rim: bool = _option(
        "Split triangles at the boundary of a mesh until its edges follow the outline to the tolerance.",
        default=False, commands=("map",),
        topic="mesh",
    )  # fmt: skip
    allow_outside: bool = _option(
        "Allow a mesh to use material libraries and pictures outside its folder.",
        default=False, commands=("map", "deform", "flatten", "relayout"), old=("outside",),
        topic="mesh",
    )  # fmt: skip
    quasi: float | None = _option(
        "Allow a quasi-conformal map, with this weight against shear (conformal, paper).",
        "WEIGHT",
        above=0,
        solver=True,
        topic="paper",
    )
    smoothness: float | None = _option(
        "Resistance to bending.  [default: depends on the command]",
        "W",
        solver=True,
        topic="paper",
    )
    pin_weight: float | None = _option(
        "Weight of pins relative to the outline (conformal, paper).  [default: 1]",
        "W",
        above=0,
        solver=True,
        topic="paper",
    )
    stroke_weight: float | None = _option(
        "Weight of strokes relative to the outline (conformal, paper).  [default: 1]",
        "W",
        above=0,
        solver=True,
        topic="paper",
    )
    order: Literal[0, 1] | None = _option(
        "Order of the distance that is minimised, 0 or 1.  [default: depends on the method]",
        solver=True,
        topic="paper",
    )
    vertices: int | Literal["source"] | None = _option(
        "Number of boundary vertices; source: the vertices of the file.  [default: depends on the shape]", "N|source",
        parse=vertices, solver=True,
        topic="paper",
    )  # fmt: skip
    samples_per_edge: int | None = _option(
        "Samples per edge with --method paper.  [default: 4; with --literal only the vertex itself]",
        "N",
        most=64,
        solver=True,
        topic="paper",
    )
    literal: bool = _option(
        "Follow the paper to the letter: the source's vertices, samples only at vertices, sums instead "
        "of integrals, full steps (paper).", solver=True,
        topic="paper",
    )  # fmt: skip
    max_iterations: int | None = _option(
        "Stop after N iterations.  [default: depends on the method]",
        "N",
        solver=True,
        topic="paper",
    )
    memory: int | None = _option(
        "Limit on memory, such as 2G; larger pictures use a temporary file.", "SIZE",
        least=1, most=limits.MEMORY, parse=memory, commands=EVERY,
        topic="limits",
    )  # fmt: skip
    max_pixel_error: float = _option(
        "Largest error of the fast evaluation, in texels.",
        default=0.05,
        above=0,
        topic="limits",
    )
    max_pixels: int = _option(
        "Refuse pictures with more pixels.",
        default=limits.PIXELS,
        least=1,
        commands=(*EVERY, "morph", "edit", "relayout"),
        topic="limits",
    )
    max_segments: int = _option(
        "Refuse SVG files with more lines and curves.",
        default=limits.SEGMENTS,
        least=1,
        commands=MORPHED,
        topic="limits",
    )
    max_faces: int = _option(
        "Refuse meshes with more faces.",
        default=limits.FACES,
        least=1,
        commands=(*EDITED, "flatten", "relayout", "info"),
        topic="limits",
    )


@_table(*EVERY, "morph", "edit", "relayout")
class CommonOptions:
    """Options of the run that do not affect the result."""

    threads: int | None = _option(
        "Number of threads; it never changes the result.  [default: all cores]",
        "N",
        least=1,
        words="cores jobs cpu",
        topic="limits",
    )
    time_limit: float = _option(
        "Time limit: a search for a map then returns the best map so far; anything else ends with an error that "
        "names the step.", "SECONDS",
        default=DEFAULT_SECONDS, above=0, commands=("map", "deform", "morph", "apply", "flatten", "relayout"),
        topic="limits",
    )  # fmt: skip
    dry_run: bool = _option(
        "Check all inputs and list the outputs without writing them.", default=False,
        commands=("map", "deform"),
        topic="output",
    )  # fmt: skip
    watch: bool = _option(
        "Run again whenever an input changes, until Ctrl-C; later runs replace the outputs of the first.",
        default=False,
        commands=("map", "deform"),
        topic="output",
    )  # fmt: skip
    open: bool = _option(
        "Open the first file that was written in the system's default program.", default=False,
        commands=("map", "deform"),
        topic="output",
    )  # fmt: skip


@_table("edit")
class EditOptions:
    """Options of `iccm edit`, in addition to those of a job."""

    port: int | None = _option("Port of the page.  [default: any free port]", "N", least=0, most=65535)
    no_browser: bool = _option("Print the page's address instead of opening it.", default=False)


@_table()
class MessageOptions:
    """Options of every command, for messages on stderr."""

    verbose: bool = _option("Show all figures and each step.", default=False, short="-v", topic="messages")
    quiet: bool = _option(
        "Show only errors and warnings about the result.", default=False, short="-q", topic="messages"
    )
    log_format: Literal["text", "json"] = _option(
        "Show messages as text, or as JSON with one object per line.",
        default="text",
        topic="messages",
    )
    debug: bool = _option("Show tracebacks of errors.", default=False, topic="messages")


def options_of(table: type = JobOptions) -> dict[str, tuple[Any, Option]]:
    """Return type and description of each option of a class, by name."""
    hints = get_type_hints(table, include_extras=True)
    return {name: (hint.__origin__, hint.__metadata__[0]) for name, hint in hints.items()}


def of_command(command: str, *tables: type) -> dict[str, tuple[Any, Option]]:
    """Return type and description of each option of a command, by name; only from `tables`, if any are given."""
    rows = (row for table in tables or TABLE for row in options_of(table).items())
    return {name: row for name, row in rows if not row[1].commands or command in row[1].commands}


def suggest(name: str, options: Mapping[str, Option | None]) -> list[str]:
    """Suggest the options that an unknown name probably stands for: by synonyms, else by similar spelling.

    Args:
        name: the name as typed, without dashes.
        options: the options of the command, by name.
    """
    options_by_key = {key: option for key, option in options.items() if option}
    if meant := [key for key, option in options_by_key.items() if name in option.words.split()]:
        return meant
    spelt = {key.replace("_", "-"): key for key in options}
    spelt |= {
        alias: key for key, option in options_by_key.items() for alias in (*dict(option.aliases), *option.old)
    }
    return [spelt[word] for word in get_close_matches(name.replace("_", "-"), spelt, 1, SIMILARITY_RATIO)]


SOLVER = tuple(name for name, (_, option) in options_of().items() if option.solver)
