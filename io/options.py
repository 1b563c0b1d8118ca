"""The options of every command, each described once: the command line, `Job` and manifests are made from this table.

To add an option, add a row to the class of its command, or to `JobOptions`, which describes a job: `map`, `deform`,
manifests and `edit` make one. A row says which other commands have it, too. Nothing heavy is imported: help reads this.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

from .. import fits
from ..deadline import DEFAULT
from . import formats, limits

LARGEST = 1e6  # factor of a texture's size
DIGITS = 15  # of a number of bytes, K, M, G or T
KINDS = ("colour", "normal", "normal-down", "data")
"""What a picture's channels are."""
ALIKE = 0.75
"""How much of a mistyped name agrees with one that is suggested, by `difflib`: --sise does with --size."""
CERTIFIED = 0.99  # share of the source's area that `--require-injective` asks for


@dataclass(frozen=True)
class Option:
    """What is to be said of an option beside its name and type.

    Attributes:
        help: a sentence; what the default means in brackets, where that is None.
        metavar: what stands for the value.
        default: its value when it is not given.
        least, above, most: the smallest number allowed, or the one below it, and the largest.
        parse: makes the value of what was typed.
        validated: the pydantic type, where it is more than the annotation says; imported when it is needed.
        solver: whether it goes to `iccm.fit` and `iccm.deform`, unless it is None.
        commands: those that have it; of a row that says none those of its class.
        short: a second name.
        required: whether it must be given.
        flag: its value where it is given without one.
        brief: the sentence of the short help, where `help` says more.
        basic: whether the short help of a command with many options shows it; those of its own class it always shows.
        aliases: other names that people try, each with what becomes of its value, `{}` as it is. They are not shown.
        old: former names. They work until the next major version, with a notice.
        hidden: commands whose help does not show it, since there is a better way, which `instead` names.
        words: what people call it, for hints where a name is not known.
    """

    help: str
    metavar: str | None = None
    _: KW_ONLY
    default: Any = None
    least: int | None = None
    above: int | None = None
    most: int | None = None
    parse: Callable[[Any], Any] | None = None
    validated: Callable[[], Any] | None = None
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

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """How pydantic checks a field that this describes."""
        from pydantic import BeforeValidator, Field

        checks: list[Any] = [Field(ge=self.least, gt=self.above, le=self.most)]
        checks += [BeforeValidator(self.parse)] if self.parse else []
        return handler(Annotated[self.validated() if self.validated else source, *checks])


def _option(*words: str, **more: Any) -> Any:
    """An `Option` in the place of its default."""
    return Option(*words, **more)


def _table(*commands: str) -> Callable[[type], type]:
    """Annotate a class with its options, and give it their defaults, as pydantic wants them."""

    def fill(cls: type) -> type:
        for name, hint in get_type_hints(cls).items():
            option = getattr(cls, name)
            row = replace(option, commands=option.commands or commands)
            cls.__annotations__[name] = Annotated[hint, row]
            setattr(cls, name, option.default)
        return cls

    return fill


FREE = 0
"""A side of a picture that follows from the other one and the proportions of what is shown."""


def size(value: Any) -> Any:
    """`WxH`, one number for the longer side, or `Wx` and `xH` for one side alone, the other being `FREE`."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*(\d+)()\s*|\s*(\d*)\s*[xX×]\s*(\d*)\s*", value)
        parts = [part for part in match.groups() if part is not None] if match else []
        if not any(parts):
            raise ValueError(f"{value!r} is not WxH or N, such as 1024x768 or 1024")
        is_single = match is not None and match[1] is not None
        value = [int(parts[0])] if is_single else [int(part or FREE) for part in parts]
        given = [int(part) for part in parts if part]
    else:
        given = [value] if isinstance(value, int) else value
        if isinstance(given, list | tuple) and len(given) == 2 and list(given) != [FREE, FREE]:
            given = [side for side in given if side != FREE]
    if isinstance(given, list | tuple) and any(
        isinstance(n, int) and not 1 <= n <= limits.SIDE for n in given
    ):
        raise ValueError(f"a side must be from 1 to {limits.SIDE} pixels")
    sides = [value] if isinstance(value, int) else value
    return tuple(sides) if isinstance(sides, list | tuple) else value


def kind(value: Any) -> Any:
    """What a picture's channels are; American spelling is taken, too."""
    value = "colour" if value == "color" else value
    if value not in KINDS:
        raise ValueError(f"{value!r} is not one of color, {', '.join(KINDS[1:])}")
    return value


def memory(value: Any) -> Any:
    """Bytes of `2G`, `1.5GiB` or `800M`; units are powers of 1024."""
    if not isinstance(value, str):
        return value
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([KMGT]?)(?:i?B)?\s*", value, re.IGNORECASE)
    if not found:
        raise ValueError(f"{value!r} is no size, such as 2G or 800M")
    if len(found[1]) > DIGITS:
        raise ValueError(f"{value[:DIGITS]}… is more than any memory")
    return int(float(found[1]) * 1024 ** " KMGT".index(found[2].upper() or " "))


def pair(value: Any) -> Any:
    """`X,Y`."""
    return _numbers(value, (2,), "two numbers, such as 10,-5")


def scale(value: Any) -> Any:
    """`S`, or `SX,SY`, above 0."""
    found = _numbers(value, (1, 2), "a factor, such as 0.25, or two, such as 0.25,0.5")
    if isinstance(found, tuple) and not all(1 / LARGEST <= n <= LARGEST for n in found):
        raise ValueError(f"a factor must be from {1 / LARGEST:g} to {LARGEST:g}")
    return found


def _numbers(value: Any, counts: tuple[int, ...], what: str) -> Any:
    """Numbers between commas, as many as there may be; what is no text and no number as it is."""
    try:
        parts = (
            value.split(",")
            if isinstance(value, str)
            else value
            if isinstance(value, list | tuple)
            else [value]
        )
        found = tuple(map(float, parts)) if value is not None else None
    except (TypeError, ValueError):
        found = ()
    if found is not None and (len(found) not in counts or not all(map(math.isfinite, found))):
        raise ValueError(f"{value!r} is not {what}")
    return found


def turn(value: Any) -> Any:
    """Degrees, or `any`."""
    if not isinstance(value, str):
        return value
    try:
        return "any" if value.strip().lower() == "any" else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is no angle in degrees, such as 90, nor any") from None


def rigid_size(value: Any) -> Any:
    """A factor above 0, or `free`."""
    try:
        found = value if value == "free" or not isinstance(value, str) else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is no factor, such as 1.2, nor free") from None
    if isinstance(found, float | int) and not 0 < found < math.inf:
        raise ValueError(f"{found:g} is no factor above 0")
    return found


def vertices(value: Any) -> Any:
    """A number of vertices, or `source`."""
    if value == "source":
        return value
    if isinstance(value, str) and not value.isdecimal():
        raise ValueError(f"{value!r} is neither a number nor source")
    count = int(value) if isinstance(value, str) else value
    if isinstance(count, int) and not 3 <= count <= limits.VERTICES:
        raise ValueError(f"{count} is not between 3 and {limits.VERTICES}")
    return count


def share(value: Any) -> Any:
    """A share of the area; true is the usual one, and false none."""
    if isinstance(value, bool):
        return CERTIFIED if value else None
    try:
        found = float(value) if isinstance(value, str) else value
    except ValueError:
        raise ValueError(f"{value!r} is no share, such as 0.99") from None
    if isinstance(found, float | int) and not 0 < found <= 1:
        raise ValueError(f"{found:g} is no share above 0, at most 1")
    return found


def many(value: Any) -> Any:
    """One value where several may stand."""
    return () if value is None else (value,) if isinstance(value, str | Path) else value


def _pins() -> Any:
    from .point_syntax import Pin

    return tuple[Pin, ...]


MESHES = " ".join(formats.holding("uv"))
"""The suffixes of meshes that are written with texture coordinates."""
MESHES_ALONE = " ".join(suffix for suffix in formats.holding("uv") if not formats.FORMATS[suffix].flat)
"""Likewise, of those that hold no flattening."""
OUTPUT = "-o"
"""The name of an STMap that stands for the file that --output names."""
EVERY = ("map", "deform", "apply")
EDITED = ("map", "deform", "edit")  # what is seen on the page
MORPHED = (*EDITED, "morph")


@_table("apply")
class ApplyOptions:
    """Those of `iccm apply`."""

    output: str = _option(
        "What to write, in the format of INPUT; - for stdout.", "FILE", required=True, short="-o"
    )
    inverse: bool = _option("From the target back to the source (of a map in .npz).", default=False)
    unmapped: Literal["drop", "keep", "refuse"] = _option(
        "Points, lines and polygons outside the map's domain: left out; kept, without a place; or nothing is written. "
        "What reaches out is cut off, or refused.",
        default="drop",
        old=("outside",),
    )
    columns: str | None = _option(
        "Columns of x and y in a table, by name or number.  [default: those called x and y, else the first two]",
        "X,Y",
    )
    max_line_error: float | None = _option(
        "How far lines may be from their true images, in the units of the output.  [default: 2e-4 of its diagonal]",
        "DISTANCE",
        above=0,
        old=("tolerance",),
    )
    report: str | None = _option("What was carried and what lay outside, as JSON; - for stdout.", "FILE.json")


@_table("flatten")
class FlattenOptions:
    """Those of `iccm flatten`."""

    output: tuple[str, ...] = _option(
        "The outline (.svg), the flat mesh (.obj), or the mesh with its flattening as texture coordinates "
        f"({MESHES_ALONE}).",
        "FILE",
        default=(),
        parse=many,
        short="-o",
    )
    uv: str | None = _option(f"The mesh with its flattening as texture coordinates ({MESHES}).", "FILE")
    method: str = _option(
        "conformal: angles kept, one-to-one; lscm: least squares, whether it folds or not; balanced: angles and areas.",
        "[conformal|lscm|balanced]", default="conformal",
    )  # fmt: skip
    onto: str | None = _option(
        "Flatten onto the outline of a drawing or picture (outline.svg, sheet.svg#id), as evenly as the surface "
        "allows, instead of by a --method.", "OUTLINE",
    )  # fmt: skip
    carry_maps: bool = _option(
        "With --uv of a GLB or OBJ: carry the maps of its materials to the new coordinates.", default=False
    )
    subdivide_rim: bool = _option(
        "With --onto: split triangles at the rim until the edges between their vertices follow it.",
        default=False,
    )
    cut_open: bool = _option(
        "Cut a closed surface, or one with handles, open.",
        default=False,
        old=("cut",),
        words="seam seams unwrap open",
    )
    report: str | None = _option("Figures of the flattening as JSON; - for stdout.", "FILE.json")
    plot: str | None = _option(
        "The flat mesh and the surface with a checkerboard (.png .svg .pdf).", "FILE.png"
    )


@_table("morph")
class MorphOptions:
    """Those of `iccm morph` beside the job's."""

    frames: int = _option(
        "How many, the first and the last shape among them.", "N", default=24, least=2, most=10_000
    )
    fps: float = _option("Frames a second of animations.", default=12.0, above=0, most=1000)
    output: tuple[str, ...] = _option(
        "An animation (.webp .png .gif), or with {number} in the name a file a frame: a picture, or artwork (.svg). "
        "May be repeated.", "FILE", default=(), parse=many, required=True, short="-o",
    )  # fmt: skip
    target_texture: str | None = _option("What TARGET shows: the texture fades to it on the way.", "IMAGE")


@_table("relayout")
class RelayoutOptions:
    """Those of `iccm relayout`."""

    texture: tuple[str, ...] = _option(
        "A picture of colours to carry over; may be repeated, as the next three.",
        "IMAGE",
        default=(),
        parse=many,
    )
    normal: tuple[str, ...] = _option(
        "A tangent-space normal map, y up (OpenGL, glTF, Blender).", "IMAGE", default=(), parse=many
    )
    normal_down: tuple[str, ...] = _option("One with y down (DirectX).", "IMAGE", default=(), parse=many)
    data: tuple[str, ...] = _option(
        "A picture of numbers: roughness, height, masks.", "IMAGE", default=(), parse=many
    )
    output: tuple[str, ...] = _option(
        "What to write: NEW as .glb or .obj with all maps of OLD's materials; or pictures, one for each given, or "
        "one name with {stem} in it, the picture's own. May be repeated.",
        "FILE", default=(), parse=many, required=True, short="-o",
    )  # fmt: skip
    size: tuple[int] | tuple[int, int] | None = _option(
        "Of the pictures made; one number: square.  [default: as dense on the surface as the old ones]",
        "WxH|N",
        parse=size,
    )
    match: Literal["auto", "index", "topology", "position"] = _option(
        "Triangles go to each other where their corners are in one place (position), by their order (index), or by how "
        "they are connected (topology); auto: by place if half of them do, else by order, if the same vertices have "
        "the same faces, else by connectivity, if it is the same, else by place after a similarity.",
        default="auto",
    )
    limit: float = _option(
        "Largest distance between the surfaces, as a share of the diagonal; texels farther away stay empty.",
        default=0.01,
        least=0,
    )
    padding: int | None = _option("Texels to spread past the charts.  [default: size / 32]", least=-1)
    report: str | None = _option("What was found, as JSON; - for stdout.", "FILE.json")


@_table("batch")
class BatchOptions:
    """Those of `iccm batch`."""

    root: str | None = _option("Where outputs go and stay.  [default: the manifest's folder]", "DIR")
    allow_outside: bool = _option(
        "Let outputs leave the root, and globs the manifest's folder.", default=False, old=("outside",)
    )
    workers: int | None = _option(
        "Processes.  [default: all cores]", least=1, short="-j", words="jobs processes cores parallel"
    )
    threads: int = _option("Threads of each worker.", default=1, least=1)
    dask: str | None = _option(
        "Use a Dask cluster, such as tcp://host:8786, instead of processes.", "ADDRESS"
    )
    timeout: float | None = _option("Time limit of each job.", "SECONDS", above=0)
    retries: int = _option("How often a job is run again after its worker died.", default=1, least=0)
    fail_fast: bool = _option("Begin no job after the first that fails.", default=False)
    resume: bool = _option(
        "Skip jobs, or frames of a --sequence, that an earlier run finished and nothing has changed since.",
        default=False, commands=("batch", "map"),
    )  # fmt: skip
    dry_run: bool = _option(
        "Check everything, run nothing.", default=False, old=("check",), words="validate test"
    )
    html: str | None = _option("A page for people: status, figures, pictures, links to outputs.", "FILE.html")


@_table("check")
class CheckOptions:
    """Those of `iccm check`."""

    tolerances: str | None = _option("Limits.  [default: BASELINES/tolerances.toml, if it is there]", "FILE")
    junit: str | None = _option("JUnit report for CI: one test case per file.", "FILE.xml")
    diff: str | None = _option("Pictures of what differs: baseline, run, difference.", "DIR")
    html: str | None = _option(
        "A page of its own for people: pictures before and after, figures, limits.", "FILE.html"
    )
    summary: str | None = _option("A summary in Markdown for a CI's step page; - for stdout.", "FILE.md")
    json: bool = _option("One JSON object per file on stdout, each on its line.", default=False)
    update: bool = _option("Make the run the baselines.", default=False)
    only: tuple[str, ...] = _option(
        "The files that are compared, or made baselines, as a name or a pattern. May be repeated.", "NAME", default=(),
        parse=many,
    )  # fmt: skip


@_table("info")
class InfoOptions:
    """Those of `iccm info`."""

    json: bool = _option("One JSON object per file, each on its line.", default=False)
    plot: str | None = _option("A sheet of one file's numbered parts (.png .svg .pdf).", "FILE.png")


@_table("doctor")
class DoctorOptions:
    """Those of `iccm doctor`."""

    json: bool = _option("One JSON object per finding, each on its line.", default=False)


@_table("completion")
class CompletionOptions:
    """Those of `iccm completion`."""

    shell: Literal["bash", "zsh", "fish"] | None = _option(
        "The shell.  [default: the login shell, by $SHELL]"
    )


@_table("plugins")
class PluginsOptions:
    """Those of `iccm plugins`."""

    to: str | None = _option(
        "The folder of extensions to use; for blender also a .zip to install from.  [default: the program's own]",
        "DIR",
    )


@_table("map", "deform")
class JobOptions:
    """What can be said about a run, in the order in which help shows it."""

    texture: str | None = _option(
        "Picture or SVG to carry along; checker is a numbered checkerboard.  "
        "[default: SOURCE if it has several colours, else checker; --texture SOURCE shows one of a single colour]",
        "IMAGE", commands=MORPHED, basic=True,
        brief="The picture or SVG to carry along.  [default: SOURCE if it has several colours, else a checkerboard]",
        aliases=(("image", "{}"), ("picture", "{}"), ("photo", "{}")), words="pattern input material fill",
    )  # fmt: skip
    normal: tuple[str, ...] = _option(
        "A tangent-space normal map, y up, to carry through the same map. Each picture of this option and the next two "
        "gets an -o, or one -o names all with {stem}, the picture's name; a mesh (-o x.glb) shows a normal map "
        "itself. May be repeated.", "IMAGE", default=(), parse=many,
    )  # fmt: skip
    normal_down: tuple[str, ...] = _option("One with y down (DirectX).", "IMAGE", default=(), parse=many)
    data: tuple[str, ...] = _option(
        "A picture of numbers: roughness, height, masks.", "IMAGE", default=(), parse=many
    )
    output: tuple[str, ...] = _option(
        "What to write, by suffix: a picture (.png .jpg .tif .exr .webp .hdr), a mesh (.obj), artwork (.svg), "
        "the map itself (.npz); - for a PNG on stdout. May be repeated.  [default, when nothing else is "
        "written: SOURCE-TARGET.png or SHAPE-deformed.png here]", "FILE", default=(), parse=many, short="-o",
        basic=True,
        brief="What to write: .png .jpg .exr, .svg (the drawing), .obj .glb (a mesh), .npz (the map). May be repeated.",
        aliases=(("out", "{}"),), words="save write result export",
    )  # fmt: skip
    report: str | None = _option("Figures of the run as JSON; - for stdout.", "FILE.json")
    plot: str | None = _option(
        "A figure: grids, the picture carried, distortion, notes (.png .svg .pdf).", "FILE.png"
    )
    stmap: str | None = _option(
        "The map itself, for `iccm apply` and compositors; without a name, what -o names is one (-o map.exr --stmap).",
        "[FILE.exr]", flag=OUTPUT, words="uvmap displacement warp",
    )  # fmt: skip
    force: bool = _option(
        "Replace files that exist.",
        default=False,
        commands=(*EVERY, "morph", "flatten", "relayout", "batch", "info", "init"),
        basic=True,
        aliases=(("overwrite", "{}"),),
        words="replace clobber yes",
    )

    parts: Literal["auto", "joined", "each", "all", "largest"] = _option(
        "How drawings of several parts are mapped. joined: each drawing as one thing, in a frame around all its parts; "
        "all: each part onto a partner of its own; auto: whichever of these costs less; each: the source onto every "
        "part of the target, such as the letters of a word; largest: the largest part of each alone.",
        default="auto", commands=("map", "morph"), basic=True,
        brief="How drawings of several parts are mapped.", words="pieces components letters multiple all whole",
    )  # fmt: skip
    gaps: Literal["paper", "transparent"] = _option(
        "What pictures show where a drawing that is its own texture paints nothing: paper, a tint of the drawing's own "
        "colours; or nothing (transparent).",
        default="paper", commands=("map",), brief="What to show where the drawing paints nothing.",
        words="background transparent alpha paper bare",
    )  # fmt: skip
    trace: Literal["auto", "dark", "light", "inside"] = _option(
        "What of a picture is the shape: auto, by its alpha, else what stands out, or the inside of a line; dark, "
        "light: what is so against its background; inside: what a line encloses.", default="auto", commands=MORPHED,
        words="threshold background silhouette alpha invert",
    )  # fmt: skip
    plane: Literal["flat", "uv"] = _option(
        "The plane that meshes are mapped in: flat, flattened; uv, their own texture coordinates, as #uv does.",
        default="flat", hidden=("map", "deform"), instead="write #uv after the mesh's name: FILE#uv",
    )  # fmt: skip
    holes: Literal["auto", "keep", "cut", "fill"] = _option(
        "keep: holes go onto holes and stay transparent in pictures; cut: the map passes over them, and pictures leave "
        "the target's transparent; fill: they are ignored and painted over; auto: kept or cut, whichever costs "
        "less, and filled in shapes drawn by lines alone.", default="auto", commands=MORPHED, basic=True,
        brief="Whether holes go onto holes, are cut out, or filled.",
        words="hole counters islands",
    )  # fmt: skip
    pin: tuple[Any, ...] = _option(
        "A point of the source and where it goes, in the files' units. May be repeated.", "SX,SY:TX,TY",
        default=(), parse=many, validated=_pins, commands=MORPHED, basic=True,
        brief="A point of the source and where it goes. May be repeated.",
        words="point points landmark landmarks anchor correspondence pins handle",
    )  # fmt: skip
    exact_pins: bool = _option(
        "Take each pin exactly to its place, whatever distortion that costs, instead of drawing a patch around it "
        "there.",
        default=False, solver=True, commands=("map", "deform", "morph"), words="hard strict soft nail",
    )  # fmt: skip
    constraints: str | None = _option(
        "Pins and strokes from a file; - for stdin.", "FILE.json", commands=MORPHED, words="strokes pins-file"
    )
    rigid: tuple[str, ...] = _option(
        "A region of the source that keeps its form and moves as a whole: #id, an element of its drawing or a group or "
        "material of its OBJ or GLB, or a mask, white where it is rigid. May be repeated.", "REGION", default=(),
        parse=many, basic=True,
        brief="A part of the source that keeps its form: #id, or a mask. May be repeated.",
        words="mask protect keep lock stiff bones",
    )  # fmt: skip
    rigid_target: tuple[str, ...] = _option(
        "Likewise a region of the target, where nothing is to be bent; instead of --rigid. May be repeated.", "REGION",
        default=(), parse=many, commands=("map",),
    )  # fmt: skip
    rigid_size: float | Literal["free"] | None = _option(
        "Size of rigid regions, by the mean scale of the map; free: as suits it.  "
        "[default: 1, or as large as there is room]",
        "FACTOR|free", parse=rigid_size, solver=True, commands=("map",),
    )  # fmt: skip
    importance: str | None = _option(
        "A picture on the source's canvas, bright where distortion hurts: on white ten times as much as on black.",
        "IMAGE", commands=("map",),
    )  # fmt: skip
    size_map: str | None = _option(
        "A picture on the source's canvas, bright where things are to be larger: on white twice as long as on black.",
        "IMAGE", commands=("map",),
    )  # fmt: skip
    start: str | None = _option(
        "An earlier map (.npz) to go on from, of these shapes or of what they were a frame before, so that nothing "
        "jumps; anew where they differ too much (balanced).", "FILE.npz",
    )  # fmt: skip
    sequence: bool = _option(
        "SOURCE, TARGET or --texture are patterns of frames ('frames/*.svg'), one picture each: each frame's map goes "
        "on from the one before, and is kept beside the picture (.npz).", default=False, commands=("map",),
    )  # fmt: skip
    pin_weight: float | None = _option(
        "Weight of the pins against the outline (conformal, paper); balanced meets them exactly.  [default: 1]",
        "W",
        above=0,
        solver=True,
    )
    stroke_weight: float | None = _option(
        "Weight of the strokes, likewise.  [default: 1]", "W", above=0, solver=True
    )

    quasi: float | None = _option(
        "Quasi-conformal, with this weight against shear (conformal, paper).", "WEIGHT", above=0, solver=True
    )
    method: Literal["balanced", "conformal", "paper"] | None = _option(
        "balanced: even sizes, outline, pins and strokes met; conformal: angles kept exactly; paper: Algorithm 1 as "
        "published.  [default: balanced; conformal with its own options]", solver=True,
    )  # fmt: skip
    balance: float = _option(
        "0 keeps angles only, 1 is even, more keeps areas (balanced).", "THETA",
        default=1.0, least=0, most=limits.BALANCE, solver=True, commands=MORPHED,
    )  # fmt: skip
    turn: float | Literal["any"] | None = _option(
        "Degrees by which to turn the picture; any: as suits the shapes best (balanced).  [default: 0, or as pins say]",
        "DEGREES|any", parse=turn, solver=True, commands=("map", "morph", "edit"), basic=True,
        brief="Degrees by which to turn the picture.",
        aliases=(("rotate", "{}"),), words="rotation angle orientation upright",
    )  # fmt: skip
    fit: fits.FitName | None = _option(
        fits.help_text(),
        solver=True, commands=("map", "morph"), basic=True,
        brief="Whether parts may be left out where the shapes differ.", words="mode crop contain cover frame",
    )  # fmt: skip
    place: Literal["fill", "inside", "slice"] = _option(
        "How the drawing lies on the target. fill: it takes the target's form; inside: it keeps its proportions and is "
        "as large as it can be inside the target; slice: it keeps its proportions and covers the target, and what "
        "hangs over is cut.", default="fill", solver=True, commands=("map",), basic=True,
        brief="Fill the target, or keep the drawing's proportions: inside it, or covering it.",
        words="aspect proportions ratio undistorted logo meet preserve",
    )  # fmt: skip
    max_left_out: float | None = _option(
        "Largest share of the source that may be left out, such as 0.1.  [default: no limit]", "SHARE",
        least=0, most=1, solver=True, commands=("map",),
    )  # fmt: skip
    max_uncovered: float | None = _option(
        "Largest share of the target that may stay uncovered.  [default: no limit]", "SHARE",
        least=0, most=1, solver=True, commands=("map",),
    )  # fmt: skip
    effort: int | None = _option(
        "Multiply the search effort by N: slower, and sometimes a better map.  [default: 1]", "N",
        least=1, most=16, solver=True, commands=("map", "morph"), old=("starts",), words="quality tries attempts",
    )  # fmt: skip
    max_dilatation: float | None = _option(
        "Largest dilatation allowed (balanced).",
        "K",
        above=1,
        solver=True,
        commands=EDITED,
    )
    max_stretch: float | None = _option(
        "Largest stretch allowed (balanced).", "S", above=1, solver=True, commands=EDITED
    )
    order: Literal[0, 1] | None = _option(
        "Distance of zeroth or first order.  [default: by method]", least=0, most=1, solver=True
    )
    max_iterations: int | None = _option("Stop after N.  [default: by method]", "N", least=1, solver=True)
    vertices: int | Literal["source"] | None = _option(
        "Number of boundary vertices; source: exactly those of the file.  [default: by shape]", "N|source",
        parse=vertices, solver=True,
    )  # fmt: skip
    samples_per_edge: int | None = _option(
        "Samples between two vertices, with --method paper.  [default: 4; with --literal 1, the vertex]",
        "N",
        least=1,
        most=64,
        solver=True,
    )
    literal: bool = _option(
        "The paper to the letter: the source's own vertices, samples there alone, sums, whole steps (paper).",
        default=False, solver=True,
    )  # fmt: skip
    smoothness: float | None = _option(
        "Resistance to bending.  [default: by command]", "W", least=0, solver=True
    )
    tolerance: float = _option(
        "Distance to reach between the mapped outline and the target's, relative to its diagonal.",
        default=1e-3,
        above=0,
        solver=True,
        commands=MORPHED,
    )
    require_injective: float | None = _option(
        "Exit code 1 unless the map is certified one-to-one on this share of the source's area.  [0.99]", "[SHARE]",
        above=0, most=1, parse=share, flag=str(CERTIFIED),
    )  # fmt: skip

    size: tuple[int] | tuple[int, int] | None = _option(
        "Pixels of the picture, or its longer side; 800x and x600 give one side.  [default: 1024]",
        "WxH|N",
        parse=size,
        commands=(*EVERY, "morph"),
        basic=True,
        brief="Pixels of the picture, or of its longer side.  [default: 1024]",
        aliases=(("width", "{}x"), ("height", "x{}")),
        words="resolution dimensions dpi pixels res scale",
    )
    texture_box: Literal["viewbox", "bbox"] | None = _option(
        "What of the source the texture covers: its canvas, or its outline's bounding box.  "
        "[default: viewbox; of the checkerboard bbox]",
        commands=(*MORPHED, "apply"),
    )
    target_box: Literal["viewbox", "bbox"] | None = _option(
        "What pictures show: the target's canvas, or its outline's bounding box.  "
        "[default: viewbox; bbox of a shape that takes little of its canvas]",
        commands=(*MORPHED, "apply"),
    )
    filter: Literal["auto", "nearest", "linear", "cubic", "lanczos", "spline"] = _option(
        "Sampling of the texture; nearest for label maps and masks.",
        default="auto",
        commands=(*EVERY, "morph", "edit", "relayout"),
    )
    kind: Literal["colour", "normal", "normal-down", "data"] = _option(
        "What the picture's channels are; normals (y up or down) turn with the map.  [default: color]",
        "[color|normal|normal-down|data]",
        default="colour",
        parse=kind,
        commands=EVERY,
        hidden=("map", "deform"),
        instead="name the picture with --normal, --normal-down or --data instead of --texture",
    )
    colorspace: str | None = _option(
        "The texture's, as OpenColorIO names it.  [default: what it says]", "NAME", commands=(*EVERY, "edit")
    )
    edge: Literal["clamp", "transparent", "repeat", "mirror"] = _option(
        "What lies outside the texture: its edge goes on, nothing, or the texture again, in its own proportions.",
        default="clamp", commands=(*EVERY, "edit"), words="wrap tile tiling border repeat",
    )  # fmt: skip
    texture_scale: tuple[float] | tuple[float, float] | None = _option(
        "Size of the texture, by that at which it covers the source, about its middle; across and down.",
        "S|SX,SY", parse=scale,
    )  # fmt: skip
    texture_offset: tuple[float, float] | None = _option(
        "Moves the texture on the source, in the file's units.", "X,Y", parse=pair
    )
    texture_turn: float = _option(
        "Turns the texture on the source, counter-clockwise about its middle.", "DEGREES", default=0.0
    )
    padding: int | None = _option(
        "Pixels by which colours extend past the outline; -1: over the whole picture.", "N", least=-1
    )
    padding_fill: Literal["push-pull", "nearest"] = _option(
        "How padding is filled.", default="push-pull", old=("fill",)
    )
    max_pixel_error: float = _option("Error that fast evaluation may make, in texels.", default=0.05, above=0)
    max_pixels: int = _option(
        "Refuse larger pictures.",
        default=limits.PIXELS,
        least=1,
        commands=(*EVERY, "morph", "edit", "relayout"),
    )
    memory: int | None = _option(
        "Bound on the process, such as 2G: pictures that do not fit go through a scratch file.", "SIZE",
        least=1, most=limits.MEMORY, parse=memory, commands=EVERY,
    )  # fmt: skip
    max_segments: int = _option(
        "Refuse SVGs that draw more lines and curves.", default=limits.SEGMENTS, least=1, commands=MORPHED
    )

    bake: bool = _option(
        "Write the picture for the texture coordinates that the target mesh has, instead of new ones.",
        default=False,
        commands=("map",),
    )
    carry_maps: bool = _option(
        "Carry the other maps of a mesh's materials (normals, roughness, …) to the new coordinates, too.",
        default=False, commands=("map",),
    )  # fmt: skip
    subdivide_rim: bool = _option(
        "Split a mesh's triangles at its rim until edges between their vertices follow the outline to the tolerance.",
        default=False, commands=("map",),
    )  # fmt: skip
    cut_open: bool = _option(
        "Cut a closed mesh, or one with handles, open.", default=False, commands=EDITED, old=("cut",),
        words="seam seams unwrap open",
    )  # fmt: skip
    max_faces: int = _option(
        "Refuse larger meshes.",
        default=limits.FACES,
        least=1,
        commands=(*EDITED, "flatten", "relayout", "info"),
    )
    allow_outside: bool = _option(
        "Take material libraries and pictures that a mesh names from anywhere, not only from its folder and below.",
        default=False, commands=("map", "deform", "flatten", "relayout"), old=("outside",),
    )  # fmt: skip


@_table(*EVERY, "morph", "edit", "relayout")
class CommonOptions:
    """Of the run, not of the job."""

    threads: int | None = _option(
        "Threads; their number never changes the result.  [default: all cores]",
        "N",
        least=1,
        words="cores jobs cpu",
    )
    time_limit: float = _option(
        "Take no longer: the search for a map ends with the best so far, or a line says what took so long.", "SECONDS",
        default=DEFAULT, above=0, commands=("map", "deform", "morph", "apply", "flatten", "relayout"),
    )  # fmt: skip
    dry_run: bool = _option(
        "Read and check everything, say what would be written, and write nothing.", default=False,
        commands=("map", "deform"),
    )  # fmt: skip
    watch: bool = _option(
        "Run again whenever an input changes, until Ctrl-C; what the first run wrote is replaced.", default=False,
        commands=("map", "deform"),
    )  # fmt: skip
    open: bool = _option(
        "Show what was written, its first file, in the program that the system opens such files with.", default=False,
        commands=("map", "deform"),
    )  # fmt: skip


@_table("edit")
class EditOptions:
    """Those of `iccm edit` beside the job's."""

    port: int | None = _option("Port of the page.  [default: any that is free]", "N", least=0, most=65535)
    no_browser: bool = _option("Show the page's address, and leave it to you to open it.", default=False)


@_table(
    *("map", "deform", "morph", "apply", "edit", "flatten", "relayout"),
    *("batch", "init", "check", "info", "doctor", "completion", "plugins", "help"),
)
class MessageOptions:
    """Of messages on stderr."""

    verbose: bool = _option("Show all figures and what is done.", default=False, short="-v")
    quiet: bool = _option("Errors, and doubts about the result, only.", default=False, short="-q")
    log_format: Literal["text", "json"] = _option(
        "Messages as text or as one JSON object a line.", default="text"
    )
    debug: bool = _option("Tracebacks for errors.", default=False)


TABLE: tuple[type, ...] = (
    *(
        ApplyOptions,
        FlattenOptions,
        MorphOptions,
        RelayoutOptions,
        BatchOptions,
        CheckOptions,
        InfoOptions,
        DoctorOptions,
        CompletionOptions,
        PluginsOptions,
    ),
    *(JobOptions, CommonOptions, EditOptions, MessageOptions),
)
"""Every option of every command, in the order of help."""


def options_of(table: type = JobOptions) -> dict[str, tuple[Any, Option]]:
    """The type and the description of each option of a class, by name."""
    hints = get_type_hints(table, include_extras=True)
    return {name: (hint.__origin__, hint.__metadata__[0]) for name, hint in hints.items()}


def of_command(command: str, *tables: type) -> dict[str, tuple[Any, Option]]:
    """The type and the description of each option of a command, by name; of these tables alone, if any are named."""
    rows = (row for table in tables or TABLE for row in options_of(table).items())
    return {name: row for name, row in rows if command in row[1].commands}


def suggest(name: str, options: Mapping[str, Option | None]) -> list[str]:
    """The options that an unknown name probably means: by what people call them, else the one spelt most alike.

    Args:
        name: what was typed, without dashes.
        options: those that there are, by name.
    """
    known = {key: option for key, option in options.items() if option}
    if meant := [key for key, option in known.items() if name in option.words.split()]:
        return meant
    spelt = {key.replace("_", "-"): key for key in options}
    spelt |= {other: key for key, option in known.items() for other in (*dict(option.aliases), *option.old)}
    return [spelt[near] for near in get_close_matches(name.replace("_", "-"), spelt, 1, ALIKE)]


SOLVER = tuple(name for name, (_, option) in options_of().items() if option.solver)
