"""Pins and strokes that are listed in a JSON file.

Coordinates are in the units of the source and target files::

    {
      "pins": [
        {"name": "nose", "source": [120, 80], "target": [310.5, 42], "weight": 1}
      ],
      "strokes": [
        {"name": "arm", "source": [[10, 10], [40, 12]], "target": [[5, 90], [9, 70], [30, 66]],
         "weight": 1, "ends": "free"}
      ]
    }

"landmarks" are pins by name, {"source": {"nose": "v17", …}, "target": {"nose": [0.1, 2, 0.3], …}}, as tools list them
for each model.

"files" may describe the shapes, {"source": {"file": "a.svg", "size": [512, 512]}, "target": …}; then shapes of other
sizes are refused. `name` (for messages), `weight` (relative to the other pins or strokes, 1) and `ends` are optional. A
pin may have a `radius` (of the patch that keeps its form, in the source's units; 0 is exact), a `tolerance` (allowed
distance from its goal, in the target's units), a `turn` (degrees, counter-clockwise) and a `scale` (relative to the
mean scale of the map), as in `iccm.Pin`. A stroke may have a `width`, in the source's units: the band around it keeps
its form. A stroke with ends "free" slides along its target; with "stick" its end points are pinned to those of the
target.

"rigid" may list regions of the source that keep their form: "#id" of an element, the name of a mask, or polygons.

"start" may contain an earlier map to continue from, see `starts`.

Points have the forms of `iccm.io.point_syntax`; on a mesh, a stroke of vertices follows the edges from each to the
next.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, PrivateAttr, SerializerFunctionWrapHandler, ValidationError, model_serializer

from ...errors import InputError, naming
from .. import files, limits
from ..checked import StrictModel, first
from ..point_syntax import PIN_SETTINGS, Place
from .landmarks import landmarks_file
from .landmarks.pairs import LandmarkPairs
from .shape import Shape
from .starts import StartingMap

OPTIONAL = "radius", "tolerance", "scale"  # settings of a pin that are written only if they are given
SAME_SIZE_SHARE = 1e-3  # relative difference of sizes that is accepted
Size = Annotated[float, Field(gt=0, le=limits.COORDINATE, strict=True)]
Polygon = Annotated[list[Place], Field(min_length=3)]
Positive = Annotated[float, Field(gt=0, le=limits.COORDINATE, strict=True)]
Weight = Annotated[float, Field(gt=0, le=1e12, strict=True)]


class _Entry(StrictModel):
    name: str = Field(default="", max_length=200)
    weight: Weight = 1.0


class PinEntry(_Entry):
    """A point of the source and its goal, in file units."""

    source: Place
    target: Place
    radius: Annotated[float, Field(ge=0, le=limits.COORDINATE, strict=True)] | None = None
    tolerance: Positive | None = None
    turn: Annotated[float, Field(ge=-360, le=360, strict=True)] | None = None
    scale: Positive | None = None

    @model_serializer(mode="wrap")
    def _without_defaults(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write the pin without settings that are not given, like the editor's page."""
        return {
            name: value for name, value in write(self).items() if name not in OPTIONAL or value is not None
        }

    @property
    def settings(self) -> dict[str, float]:
        """The pin's settings other than its points, by name."""
        values = {name: getattr(self, name) for name in PIN_SETTINGS.values()}
        return {name: value for name, value in values.items() if value is not None}


class StrokeEntry(_Entry):
    """A polyline of the source and its goal, in file units."""

    source: list[Place] = Field(min_length=2)
    target: list[Place] = Field(min_length=2)
    ends: Literal["free", "stick"] = "free"
    width: Annotated[float, Field(ge=0, le=limits.COORDINATE, strict=True)] = 0.0

    @model_serializer(mode="wrap")
    def _without_default(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write the stroke without a width unless one is given, like the editor's page."""
        return {name: value for name, value in write(self).items() if name != "width" or value}


class ConstrainedFile(StrictModel):
    """A shape to which constraints belong: the file's name, and width and height of its canvas."""

    file: str = ""
    size: tuple[Size, Size]


class ConstrainedFiles(StrictModel):
    """The shapes to which constraints belong."""

    source: ConstrainedFile | None = None
    target: ConstrainedFile | None = None


class Landmarks(StrictModel):
    """Named points of the source and of the target; the same name in both makes a pin."""

    source: dict[str, Place] = Field({})
    target: dict[str, Place] = Field({})


class ConstraintsFile(StrictModel):
    """The content of a constraints file."""

    files: ConstrainedFiles = ConstrainedFiles()
    pins: list[PinEntry] = Field([])
    strokes: list[StrokeEntry] = Field([])
    rigid: list[str | Polygon] = Field([])
    start: StartingMap | None = None
    landmarks: Landmarks = Landmarks()
    _pairs: list[LandmarkPairs] = PrivateAttr([])

    @property
    def all_pins(self) -> list[PinEntry]:
        """The pins, then the landmarks, in the source's order.

        Raises:
            InputError: a landmark is given on one side only.
        """
        sources, targets = self.landmarks.source, self.landmarks.target
        for unmatched, side in (
            (sources.keys() - targets.keys(), "source"),
            (targets.keys() - sources.keys(), "target"),
        ):
            if unmatched:
                names = ", ".join(sorted(unmatched)[:12])
                raise InputError(f"landmarks: {names}: only given for the {side}; give each for both shapes")
        marks = [
            PinEntry(name=name[:200], source=place, target=targets[name]) for name, place in sources.items()
        ]
        return [*self.pins, *marks]

    def pins_of(self, source: Shape, target: Shape) -> list[PinEntry]:
        """Return all pins in the units of the files of two shapes, including those in other programs' coordinates.

        Raises:
            InputError: as `all_pins`, or landmarks of images for a mesh.
        """
        pairs = [pair for landmarks in self._pairs for pair in landmarks.in_file_units(source, target)]
        return [*self.all_pins, *(PinEntry(name=name[:200], source=a, target=b) for name, a, b in pairs)]

    def add_pairs(self, pairs: LandmarkPairs) -> None:
        """Add pairs of landmarks of other programs to the pins."""
        self._pairs.append(pairs)

    def check(self, source: Shape, target: Shape) -> None:
        """Refuse shapes whose sizes differ from those that the constraints were made for.

        Raises:
            InputError: sizes differ; the message gives both.
        """
        for shape, sheet in ((source, self.files.source), (target, self.files.target)):
            low, high = shape.box
            size = np.array([(high - low).real, (high - low).imag])
            if sheet and not np.allclose(size, sheet.size, rtol=SAME_SIZE_SHARE):
                expected, actual = ("{:g} x {:g}".format(*extent) for extent in (sheet.size, size))
                cure = 'scale the points, or remove the size from "files"'
                raise InputError(
                    f"the constraints were made for {sheet.file or 'a shape'} with size {expected}, but "
                    f"{shape.spec} has size {actual}; {cure}"
                )


def typed_pins(pairs: Iterable[tuple[Any, ...]]) -> list[PinEntry]:
    """Return pins from the command line (--pin) as those of a file, in file units.

    Args:
        pairs: of each pin the two ends, and its settings if it has any.
    """
    return [
        PinEntry(source=source, target=target, **(settings[0] if settings else {}))
        for source, target, *settings in pairs
    ]


def read(path: str | Path, *, max_bytes: int = limits.CONSTRAINTS_BYTES) -> ConstraintsFile:
    """Read a constraints file, or landmark pairs of another program (see `landmarks`), in file units.

    The module's docstring describes the format; "-" is stdin.

    Raises:
        InputError: not JSON, an unknown or missing key, a value out of range; the message names the key.
    """
    landmarks = landmarks_file.file_of(str(path))
    if landmarks is not None:
        pairs = landmarks.read()
        with naming(path):
            return _of_pairs(pairs)
    is_stdin = str(path) == "-"
    data = sys.stdin.buffer.read(max_bytes) if is_stdin else files.read_bytes(path, max_bytes=max_bytes)
    with naming(path):
        return parse(str(path), data)


def parse(name: str, data: bytes) -> ConstraintsFile:
    """Parse the content of a constraints file or of a landmarks file.

    Raises:
        InputError: as `read`; the message starts with what is wrong.
    """
    landmarks = landmarks_file.file_of(name)
    if landmarks is not None:
        return _of_pairs(landmarks.parse(data))
    try:
        return ConstraintsFile.model_validate(files.parse_json(data, once=True))
    except ValidationError as error:
        raise InputError(first(error)) from error


def _of_pairs(pairs: LandmarkPairs) -> ConstraintsFile:
    """Return a constraints file whose pins are another program's landmarks."""
    pairs.check_count()
    listed = ConstraintsFile()
    listed.add_pairs(pairs)
    return listed
