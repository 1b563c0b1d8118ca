"""The options of a run, each described once: the command line and `Job` are both made from this class.

To add an option, add a line to `Options`. Nothing heavy is imported: `iccm map --help` reads this.
"""

import re
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

MAX_SIDE = 1 << 17
DIGITS = 15  # of a number of bytes, K, M, G or T
MOST_MEMORY = 1 << 62
MOST_VERTICES = 4000  # of a map's polygon
CERTIFIED = 0.99  # share of the source's area that `--require-injective` asks for
MOST_BALANCE = 10  # beyond 4 areas hardly change, and angles pay for it


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
        commands: those that have it.
        short: a second name.
        flag: its value where it is given without one.
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
    commands: tuple[str, ...] = ("map", "deform")
    short: str = ""
    flag: str | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """How pydantic checks a field that this describes."""
        from pydantic import BeforeValidator, Field

        checks: list[Any] = [Field(ge=self.least, gt=self.above, le=self.most)]
        checks += [BeforeValidator(self.parse)] if self.parse else []
        return handler(Annotated[self.validated() if self.validated else source, *checks])


def _option(*words: str, **more: Any) -> Any:
    """An `Option` in the place of its default."""
    return Option(*words, **more)


def _fields(cls: type) -> type:
    """The class with annotations that hold the options, and their defaults, as pydantic wants them."""
    for name, hint in get_type_hints(cls).items():
        option = getattr(cls, name)
        cls.__annotations__[name] = Annotated[hint, option]
        setattr(cls, name, option.default)
    return cls


def size(value: Any) -> Any:
    """`WxH`, or one number for the longer side."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*(\d+)(?:\s*[xX×]\s*(\d+))?\s*", value)
        if not match:
            raise ValueError(f"{value!r} is not WxH or N, such as 1024x768 or 1024")
        value = [int(part) for part in match.groups() if part]
    sides = [value] if isinstance(value, int) else value
    if isinstance(sides, list | tuple) and any(isinstance(n, int) and not 1 <= n <= MAX_SIDE for n in sides):
        raise ValueError(f"a side must be from 1 to {MAX_SIDE} pixels")
    return tuple(sides) if isinstance(sides, list | tuple) else value


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


def turn(value: Any) -> Any:
    """Degrees, or `any`."""
    if not isinstance(value, str):
        return value
    try:
        return "any" if value.strip().lower() == "any" else float(value)
    except ValueError:
        raise ValueError(f"{value!r} is no angle in degrees, such as 90, nor any") from None


def vertices(value: Any) -> Any:
    """A number of vertices, or `source`."""
    if value == "source":
        return value
    if isinstance(value, str) and not value.isdecimal():
        raise ValueError(f"{value!r} is neither a number nor source")
    count = int(value) if isinstance(value, str) else value
    if isinstance(count, int) and not 3 <= count <= MOST_VERTICES:
        raise ValueError(f"{count} is not between 3 and {MOST_VERTICES}")
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
    from ..point_syntax import Pin

    return tuple[Pin, ...]


EVERY = ("map", "deform", "apply")
EDITED = ("map", "deform", "edit")  # what is seen on the page


@_fields
class JobOptions:
    """What can be said about a run, in the order in which help shows it."""

    texture: str | None = _option(
        "Picture to carry along.  [default: a numbered checkerboard]", "IMAGE", commands=EDITED
    )
    normal: tuple[str, ...] = _option(
        "A tangent-space normal map, y up, through the same map, as the next two: each gets an -o, or {stem} in one "
        "stands for its name; a mesh (-o x.glb) shows one itself. May be repeated.", "IMAGE", default=(), parse=many,
    )  # fmt: skip
    normal_down: tuple[str, ...] = _option("One with y down (DirectX).", "IMAGE", default=(), parse=many)
    data: tuple[str, ...] = _option(
        "A picture of numbers: roughness, height, masks.", "IMAGE", default=(), parse=many
    )
    output: tuple[str, ...] = _option(
        "What to write, by suffix: a picture (.png .jpg .tif .exr .webp .hdr), a mesh (.obj), artwork (.svg); "
        "- for a PNG on stdout. May be repeated.  [default, when nothing else is written: SOURCE-TARGET.png or "
        "SHAPE-deformed.png here]", "FILE", default=(), parse=many, short="-o",
    )  # fmt: skip
    report: str | None = _option("Figures of the run as JSON; - for stdout.", "FILE.json")
    plot: str | None = _option("A figure: grids, energy, distortion (.png .svg .pdf).", "FILE.png")
    stmap: str | None = _option("The map itself, for `iccm apply` and compositors.", "FILE.exr")
    force: bool = _option("Replace files that exist.", default=False, commands=EVERY)

    parts: Literal["largest", "all"] = _option(
        "What is mapped of files that draw several outlines: the largest, or each onto its partner.",
        default="largest", commands=("map",),
    )  # fmt: skip
    plane: Literal["flat", "uv"] = _option(
        "The plane that meshes lie in: their flattening, or their own texture coordinates, as #uv does.",
        default="flat",
    )
    holes: Literal["keep", "fill"] = _option(
        "Whether holes go onto holes and stay transparent in pictures, or are taken for inside and painted over.",
        default="keep", commands=EDITED,
    )  # fmt: skip
    pin: tuple[Any, ...] = _option(
        "A point of the source and where it goes, in the files' units. May be repeated.", "SX,SY:TX,TY",
        default=(), parse=many, validated=_pins, commands=EDITED,
    )  # fmt: skip
    constraints: str | None = _option(
        "Pins and strokes from a file; - for stdin.", "FILE.json", commands=EDITED
    )
    pin_weight: float | None = _option(
        "Pull of the pins against the outline's (conformal, paper); balanced meets them.  [default: 1]",
        "W",
        above=0,
        solver=True,
    )
    stroke_weight: float | None = _option(
        "Pull of the strokes (likewise).  [default: 1]", "W", above=0, solver=True
    )

    quasi: float | None = _option(
        "Quasi-conformal, with this weight against shear.", "WEIGHT", above=0, solver=True
    )
    method: Literal["balanced", "conformal", "paper"] | None = _option(
        "balanced: even sizes, outline, pins and strokes met; conformal: angles kept exactly; paper: Algorithm 1 as "
        "published.  [default: balanced; conformal with its own options]", solver=True,
    )  # fmt: skip
    balance: float = _option(
        "0 keeps angles only, 1 is even, more keeps areas (balanced).", "THETA",
        default=1.0, least=0, most=MOST_BALANCE, solver=True, commands=EDITED,
    )  # fmt: skip
    turn: float | Literal["any"] = _option(
        "Degrees by which the picture should be turned; any leaves it to the shapes (balanced).  [default: 0]",
        "DEGREES|any", default=0.0, parse=turn, solver=True, commands=("map", "edit"),
    )  # fmt: skip
    max_dilatation: float | None = _option(
        "Bound on the dilatation to meet (balanced).",
        "K",
        above=1,
        solver=True,
        commands=EDITED,
    )
    max_stretch: float | None = _option(
        "Bound on the stretch to meet (balanced).", "S", above=1, solver=True, commands=EDITED
    )
    order: Literal[0, 1] | None = _option(
        "Distance of zeroth or first order.  [default: by method]", least=0, most=1, solver=True
    )
    max_iterations: int | None = _option("Stop after N.  [default: by method]", "N", least=1, solver=True)
    vertices: int | Literal["source"] | None = _option(
        "Boundary vertices, or the source's own and no others.  [default: by shape]", "N|source",
        parse=vertices, solver=True,
    )  # fmt: skip
    samples_per_edge: int | None = _option(
        "Samples between two vertices, with --method paper.  [default: 4]", "N", least=1, most=64, solver=True
    )
    weights: Literal["relative", "paper"] | None = _option(
        "Means that do not depend on sizes and counts, or sums as the paper has them.  [default: relative]",
        solver=True,
    )
    smoothness: float | None = _option(
        "Resistance to bending.  [default: by command]", "W", least=0, solver=True
    )
    tolerance: float = _option(
        "Boundary gap to reach, relative to the target's diagonal.",
        default=1e-3,
        above=0,
        solver=True,
        commands=EDITED,
    )
    require_injective: float | None = _option(
        "Exit code 1 unless it is certified one-to-one on this share of the source's area.  [0.99]", "[SHARE]",
        above=0, most=1, parse=share, flag=str(CERTIFIED),
    )  # fmt: skip

    size: tuple[int] | tuple[int, int] | None = _option(
        "Pixels of the picture, or its longer side.  [default: 1024]", "WxH|N", parse=size
    )
    texture_box: Literal["viewbox", "bbox"] | None = _option(
        "What of the source the texture covers: its canvas, or its outline's bounding box.  "
        "[default: viewbox; of the checkerboard bbox]",
        commands=EDITED,
    )
    target_box: Literal["viewbox", "bbox"] | None = _option(
        "What pictures show: the target's canvas, or its outline's bounding box.  "
        "[default: viewbox; bbox of a shape that takes little of its canvas]",
        commands=EDITED,
    )
    filter: Literal["auto", "nearest", "linear", "cubic", "lanczos", "spline"] = _option(
        "Sampling of the texture; nearest for label maps and masks.",
        default="auto",
        commands=(*EVERY, "edit", "relayout"),
    )
    kind: Literal["colour", "normal", "normal-down", "data"] = _option(
        "What the --texture's channels are; normals (y up or down) turn with the map.",
        default="colour",
        commands=EVERY,
    )
    colorspace: str | None = _option(
        "The texture's, as OpenColorIO names it.  [default: what it says]", "NAME", commands=(*EVERY, "edit")
    )
    edge: Literal["clamp", "transparent"] = _option(
        "What lies outside the texture.", default="clamp", commands=(*EVERY, "edit")
    )
    padding: int | None = _option("Pixels to spill past the outline; -1: all.", "N", least=-1)
    fill: Literal["push-pull", "nearest"] = _option("How padding is filled.", default="push-pull")
    max_pixel_error: float = _option("Error that fast evaluation may make, in texels.", default=0.05, above=0)
    max_pixels: int = _option(
        "Refuse larger pictures.", default=1 << 28, least=1, commands=(*EVERY, "edit", "relayout")
    )
    memory: int | None = _option(
        "Bound on the process, such as 2G: pictures that do not fit go through a scratch file.", "SIZE",
        least=1, most=MOST_MEMORY, parse=memory, commands=EVERY,
    )  # fmt: skip
    max_segments: int = _option(
        "Refuse SVGs that draw more lines and curves.", default=1 << 20, least=1, commands=EDITED
    )

    bake: bool = _option(
        "Fill the texture layout that the target mesh has, not a new one.", default=False, commands=("map",)
    )
    carry_maps: bool = _option(
        "Carry the other maps of a mesh's materials (normals, roughness, …) to the new coordinates, too.",
        default=False, commands=("map",),
    )  # fmt: skip
    cut: bool = _option(
        "Cut a closed mesh, or one with handles, open.", default=False, commands=(*EVERY, "edit")
    )
    max_faces: int = _option("Refuse larger meshes.", default=5_000_000, least=1, commands=(*EVERY, "edit"))
    outside: bool = _option(
        "Take material libraries and pictures that a mesh names from anywhere, not only from its folder and below.",
        default=False,
    )


def described() -> dict[str, tuple[Any, Option]]:
    """The type and the description of each option of `JobOptions`, by name."""
    hints = get_type_hints(JobOptions, include_extras=True)
    return {name: (hint.__origin__, hint.__metadata__[0]) for name, hint in hints.items()}


SOLVER = tuple(name for name, (_, option) in described().items() if option.solver)
