"""One run, described and validated: the command line, a batch and CI all make one of these."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from ...errors import InputError

Place = tuple[float, float] | tuple[float, float, float] | Annotated[str, Field(pattern=r"^v\d+$")]
"""A point in a file's units, in space for a mesh, or a mesh's vertex such as v17."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
MAX_SIDE = 1 << 17
CERTIFIED = 0.99
"""Share of the source's area that `require_injective` asks for."""
WRITTEN = ("report", "plot", "stmap")
"""Fields that name a file to write, beside `output`."""


def _pin(value: Any) -> Any:
    """`SX,SY:TX,TY` as typed, or two places, or four numbers."""
    if isinstance(value, str):
        sides = [_place(side) for side in value.split(":")]
        if len(sides) != 2:
            raise ValueError(f"{value!r} is not SX,SY:TX,TY, such as 10,20:30,40")
        return tuple(sides)
    if isinstance(value, list | tuple) and len(value) == 4:
        return (value[:2], value[2:])
    return value


def _place(text: str) -> Any:
    number = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"
    if re.fullmatch(r"\s*[vV]\d+\s*", text):
        return text.strip().lower()
    if not re.fullmatch(f"{number}(?:,{number}){{1,2}}", text):
        raise ValueError(
            f"{text!r} is no place; a pin is SX,SY:TX,TY, such as 10,20:30,40 (on a mesh also v17 or X,Y,Z)"
        )
    return tuple(float(word) for word in text.split(","))


def _size(value: Any) -> Any:
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
    return int(float(found[1]) * 1024 ** " KMGT".index(found[2].upper() or " "))


def _many(value: Any) -> Any:
    """One value where several may stand."""
    return () if value is None else (value,) if isinstance(value, str | Path) else value


def _share(value: Any) -> Any:
    """True is the default share; false is none."""
    return {True: CERTIFIED, False: None}[value] if isinstance(value, bool) else value


Share = Annotated[float, BeforeValidator(_share), Field(gt=0, le=1, allow_inf_nan=False)]
Size = Annotated[tuple[int] | tuple[int, int], BeforeValidator(_size)]
Bytes = Annotated[int, BeforeValidator(memory), Field(ge=1)]
Names = Annotated[tuple[str, ...], BeforeValidator(_many)]
Pin = Annotated[tuple[Place, Place], BeforeValidator(_pin)]
Pins = Annotated[tuple[Pin, ...], BeforeValidator(_many)]


class Job(BaseModel):
    """What to map onto what, how, and what to write. Paths are as the user gave them; coordinates in file units.

    `target` None means a deformation of the source by its constraints alone.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    source: str = Field(min_length=1)
    target: str | None = None
    texture: str | None = None
    colorspace: str | None = None
    output: Names = ()
    size: Size | None = None
    texture_box: Literal["viewbox", "bbox"] = "viewbox"
    filter: Literal["auto", "nearest", "linear", "cubic", "lanczos", "spline"] = "auto"
    kind: Literal["colour", "normal", "normal-down", "data"] = "colour"
    edge: Literal["clamp", "transparent"] = "clamp"
    padding: int | None = Field(None, ge=-1)
    fill: Literal["push-pull", "nearest"] = "push-pull"
    max_pixel_error: Positive = 0.05
    max_pixels: int = Field(1 << 28, ge=1)
    memory: Bytes | None = None
    max_faces: int = Field(5_000_000, ge=1)
    cut: bool = False
    bake: bool = False
    pin: Pins = ()
    constraints: str | None = None
    quasi: Positive | None = None
    method: Literal["conformal", "paper"] = "conformal"
    order: Literal[0, 1] | None = None
    max_iterations: int | None = Field(None, ge=1)
    vertices: Annotated[int, Field(ge=3, le=4000)] | Literal["source"] | None = None
    samples_per_edge: int | None = Field(None, ge=1, le=64)
    weights: Literal["relative", "paper"] | None = None
    tolerance: Positive = 1e-3
    pin_weight: Positive | None = None
    stroke_weight: Positive | None = None
    smoothness: float | None = Field(None, ge=0)
    report: str | None = None
    plot: str | None = None
    stmap: str | None = None
    force: bool = False
    require_injective: Share | None = None

    @model_validator(mode="after")
    def _one_stream(self) -> Job:
        if [*self.output, self.report].count("-") > 1:
            raise ValueError("only one output can be `-`: stdout is one stream")
        return self

    @property
    def outputs(self) -> tuple[str, ...]:
        """Every file that the job writes, in no particular order; stdout is not a file."""
        names = [*self.output, *(getattr(self, field) for field in WRITTEN)]
        return tuple(name for name in names if name and name != "-")

    @property
    def inputs(self) -> tuple[str, ...]:
        """Every file that the job reads, as a path without its `#id`; stdin is not a file."""
        specs = [path_of(self.source), path_of(self.target or ""), self.texture, self.constraints]
        return tuple(dict.fromkeys(name for name in specs if name and name != "-"))


def path_of(spec: str) -> str:
    """The file of `file#id`; a file whose own name has a # wins."""
    return spec if "#" not in spec or Path(spec).exists() else spec.rpartition("#")[0]


def make(values: dict[str, Any]) -> Job:
    """A job from the options of the command line.

    Raises:
        InputError: the first mistake, by the name of its option.
    """
    try:
        return Job(**values)
    except ValidationError as error:
        raise InputError("; ".join(_of_option(key, text) for key, text in mistakes(error))) from None


def _of_option(key: str, text: str) -> str:
    """A mistake in the words of the command line, which counts from 1; one that concerns no option as it is."""
    if key in ("source", "target"):
        return f"{key.upper()}: {text}"
    option, _, rest = key.partition(".")
    number = f" {int(rest.split('.')[0]) + 1}" if rest[:1].isdecimal() else ""
    return f"--{option.replace('_', '-')}{number}: {text}" if option else text


def mistakes(error: ValidationError) -> list[tuple[str, str]]:
    """(key, what is wrong) for each mistake pydantic found."""
    found: dict[str, str] = {}
    for item in error.errors(include_url=False, include_context=False):
        key = ".".join(str(part) for part in item["loc"] if not str(part).startswith(("tuple[", "function-")))
        found.setdefault(key.removesuffix(".0") if key.startswith("size") else key, _plain(item["msg"]))
    return list(found.items())


def _plain(message: str) -> str:
    if "as a unicode string" in message:
        return "the name is not UTF-8; rename the file"
    return message.removeprefix("Value error, ").replace("Extra inputs are not permitted", "unknown key")
