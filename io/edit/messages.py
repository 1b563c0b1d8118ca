"""Messages from the page, validated: they are untrusted input."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from ...errors import InputError
from ...fits import FITS, FitName
from ...options import MAX_BALANCE
from .. import limits
from ..checked import StrictModel, first
from ..point_syntax import Place as Spot
from ..shapes.listing import PinEntry, Polygon, StrokeEntry


class _Message(StrictModel):
    model_config = ConfigDict(allow_inf_nan=False)


class Scene(_Message):
    """The edited state: pins, strokes and rigid regions in file units, as in constraints files, and settings of the
    map.
    """

    pins: list[PinEntry] = Field(default=[], max_length=limits.PAGE_PINS)
    strokes: list[StrokeEntry] = Field(default=[], max_length=limits.PAGE_STROKES)
    rigid: list[str | Polygon] = Field(default=[], max_length=limits.PAGE_STROKES)
    balance: float = Field(default=1.0, gt=0, le=MAX_BALANCE)
    turn: float | Literal["any"] = 0.0
    fit: FitName = "auto"

    @model_validator(mode="after")
    def _short(self) -> Scene:
        lines = [line for stroke in self.strokes for line in (stroke.source, stroke.target)]
        if any(len(line) > limits.PAGE_POINTS for line in (*lines, *self.rigid)):
            raise ValueError(
                f"a stroke or region has more than {limits.PAGE_POINTS} points; draw it with fewer"
            )
        return self

    @property
    def constrained(self) -> bool:
        """Whether there are pins, strokes or rigid regions."""
        return bool(self.pins or self.strokes or self.rigid)

    @property
    def whole(self) -> bool:
        """Whether the whole outlines, or whole frames, of both drawings are certain to be mapped onto each other, so
        that maps can continue from each other.
        """
        mode = FITS[self.fit]
        return not mode.leaves_out_parts and (self.constrained or not mode.is_searched)

    @property
    def key(self) -> str:
        """What the map depends on: everything except the names, as JSON."""
        nameless = {"name": True}
        return self.model_dump_json(exclude={"pins": {"__all__": nameless}, "strokes": {"__all__": nameless}})


class Follow(_Message):
    """A request for the coarse map while something is being dragged."""

    type: Literal["follow"]
    seq: int
    scene: Scene


class Solve(_Message):
    """A request for the converged map, as `iccm map` computes it from the saved constraints.

    `way` selects one of two known maps, see `MapChoice`, or searches for a map that meets all pins, even if it differs
    from the one that is seen. `hand` says what the hand that drags something is doing: the map stays where it is seen.
    If it releases a converged map, `way` is the one that was seen.
    """

    type: Literal["solve"]
    seq: int
    scene: Scene
    way: Literal["", "fresh", "kept", "search"] = ""
    hand: Literal["", "resting", "released"] = ""


class Place(_Message):
    """A request for the images of points of one side on the other."""

    type: Literal["place"]
    id: int
    side: Literal["source", "target"]
    points: list[Spot] = Field(min_length=1, max_length=limits.PAGE_POINTS)


class _FileMessage(_Message):
    id: int
    scene: Scene
    name: str = Field(min_length=1, max_length=200)
    replace: bool = False


class Save(_FileMessage):
    """A request to save pins and strokes as JSON."""

    type: Literal["save"]


class Draw(_FileMessage):
    """A request to draw pins and strokes into copies of the SVG files, whose names end in this suffix."""

    type: Literal["draw"]


class Forget(_Message):
    """A request to delete the unsaved changes of an earlier session."""

    type: Literal["forget"]
    id: int


class Suggest(_Message):
    """A request for pins that both drawings suggest."""

    type: Literal["suggest"]
    id: int
    scene: Scene


class AddHandles(_Message):
    """A request for pins in rows and columns on the source, where the map takes them."""

    type: Literal["handles"]
    id: int
    scene: Scene
    rows: int = Field(ge=1, le=limits.HANDLES)
    columns: int = Field(ge=1, le=limits.HANDLES)


class ReadPins(_Message):
    """Pins from a file chosen in the browser: constraints as JSON, or landmarks of another program."""

    type: Literal["read-pins"]
    id: int
    name: str = Field(min_length=1, max_length=200)
    text: str


class WritePins(_Message):
    """A request for pins as landmarks of another program, to download."""

    type: Literal["write-pins"]
    id: int
    scene: Scene
    suffix: str = Field(max_length=20)


class Export(_FileMessage):
    """A request for what `iccm map` writes; without `write`, only for the command that writes it."""

    type: Literal["export"]
    size: int = Field(default=1024, ge=1, le=limits.SIDE)
    write: bool = True


class Download(_Message):
    """A request for what `iccm map` writes, as a file to download."""

    scene: Scene
    name: str = Field(min_length=1, max_length=200)
    size: int = Field(default=1024, ge=1, le=limits.SIDE)


Message = Annotated[
    Follow | Solve | Place | Suggest | AddHandles | Save | Draw | Export | Forget | ReadPins | WritePins,
    Field(discriminator="type"),
]
_READ: TypeAdapter[Message] = TypeAdapter(Message)


def read(text: str) -> Message:
    """Parse a message from the page.

    Raises:
        InputError: the message is invalid.
    """
    try:
        return _READ.validate_json(text)
    except ValidationError as error:
        raise InputError(f"invalid message: {first(error, whole='')}") from None


def read_download(text: bytes) -> Download:
    """Parse a request for a download.

    Raises:
        InputError: the request is invalid.
    """
    try:
        return Download.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"invalid message: {first(error, whole='')}") from None


def scene_of(
    pins: list[PinEntry], strokes: list[StrokeEntry], rigid: list[str | Polygon], **how: Any
) -> Scene:
    """Return a scene that was not made on the page.

    `how` are settings of the map, such as its balance.

    Raises:
        InputError: the scene is not valid, for example because it has too many pins.
    """
    try:
        return Scene.model_validate({"pins": pins, "strokes": strokes, "rigid": rigid, **how})
    except ValidationError as error:
        raise InputError(f"iccm edit: {first(error)}") from None
