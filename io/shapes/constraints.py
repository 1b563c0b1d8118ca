"""Pins and strokes: pairs drawn in two files, or listed in a JSON file.

Drawn: elements whose id or Inkscape label is `pin-NAME` (a circle's or ellipse's centre) or `stroke-NAME` (a path); the
same name in source and target makes a pair.

Listed, coordinates in the units of the source and target files::

    {
      "pins": [
        {"name": "nose", "source": [120, 80], "target": [310.5, 42], "weight": 1}
      ],
      "strokes": [
        {"name": "arm", "source": [[10, 10], [40, 12]], "target": [[5, 90], [9, 70], [30, 66]],
         "weight": 1, "ends": "free"}
      ]
    }

"landmarks" are such pins by name, {"source": {"nose": "v17", …}, "target": {"nose": [0.1, 2, 0.3], …}}, as tools list
them for each model.

"files" may tell which shapes they are for, {"source": {"file": "a.svg", "size": [512, 512]}, "target": …}: those of
another size are refused then. `name` (for messages), `weight` (relative to the other pins or strokes, 1) and `ends` are
optional. A stroke with ends "free" slides along its target; with "stick" its first and last points also are pinned to
those of the target.

"start" may hold an earlier map to go on from, see `starts`.

A place has the forms of `iccm.io.places`; on a mesh a stroke of vertices follows the edges from each to the next.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...arrays import Complex, Real
from ...curve import Curve
from ...errors import InputError
from .. import files
from ..places import LARGEST, TAGS, Place
from .shape import Shape
from .starts import StartingMap

MAX_BYTES = 16 * 2**20
MESSAGES = {
    "extra_forbidden": "unknown key",
    "missing": "is missing",
    "model_type": "must be an object, {…}",
}
SAME_SIZE = 1e-3  # relative
Size = Annotated[float, Field(gt=0, le=LARGEST, strict=True)]
Weight = Annotated[float, Field(gt=0, le=1e12, strict=True)]


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    name: str = Field(default="", max_length=200)
    weight: Weight = 1.0


class Pin(_Entry):
    """A point of the source and where it should go, in file units."""

    source: Place
    target: Place


class Stroke(_Entry):
    """A polyline of the source and the one that it should lie on, in file units."""

    source: list[Place] = Field(min_length=2)
    target: list[Place] = Field(min_length=2)
    ends: Literal["free", "stick"] = "free"


class ConstrainedFile(BaseModel):
    """A shape that places belong to: the file's name, and width and height of its canvas."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    file: str = ""
    size: tuple[Size, Size]


class ConstrainedFiles(BaseModel):
    """The shapes that constraints belong to."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    source: ConstrainedFile | None = None
    target: ConstrainedFile | None = None


class Landmarks(BaseModel):
    """Named places of the source and of the target; the same name in both makes a pin."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    source: dict[str, Place] = {}
    target: dict[str, Place] = {}


class Listed(BaseModel):
    """What a constraints file holds."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    files: ConstrainedFiles = ConstrainedFiles()
    pins: list[Pin] = []
    strokes: list[Stroke] = []
    start: StartingMap | None = None
    landmarks: Landmarks = Landmarks()

    @property
    def all_pins(self) -> list[Pin]:
        """The pins, then the landmarks, in the source's order.

        Raises:
            InputError: a landmark of one side only.
        """
        here, there = self.landmarks.source, self.landmarks.target
        for alone, side in ((here.keys() - there.keys(), "source"), (there.keys() - here.keys(), "target")):
            if alone:
                names = ", ".join(sorted(alone)[:12])
                raise InputError(f"landmarks: {names}: given for the {side} alone; give each for both")
        marks = [Pin(name=name[:200], source=place, target=there[name]) for name, place in here.items()]
        return [*self.pins, *marks]

    def check(self, source: Shape, target: Shape) -> None:
        """Refuse shapes of another size than they were made for.

        Raises:
            InputError: both sizes.
        """
        for shape, sheet in ((source, self.files.source), (target, self.files.target)):
            low, high = shape.box
            size = np.array([(high - low).real, (high - low).imag])
            if sheet and not np.allclose(size, sheet.size, rtol=SAME_SIZE):
                there, here = ("{:g} x {:g}".format(*each) for each in (sheet.size, size))
                cure = 'scale the places, or take its size out of "files"'
                raise InputError(
                    f"the constraints are for {sheet.file or 'a shape'} of {there}, and {shape.spec} is {here}; {cure}"
                )


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints in the core plane.

    Attributes:
        pins: (k, 2) points of the source and of the target.
        pin_weights: (k,) positive, relative to each other.
        strokes: open curves of the source, each with one of the target.
        stroke_weights: one positive number a stroke, relative to each other.
    """

    pins: Complex
    pin_weights: Real
    strokes: list[tuple[Curve, Curve]]
    stroke_weights: Real


def read(path: str | Path, *, max_bytes: int = MAX_BYTES) -> Listed:
    """The pins and strokes of a JSON file (see the module for its form; - for stdin), in file units.

    Raises:
        InputError: not JSON, an unknown or missing key, a value out of range; the message names the key.
    """
    data = (
        sys.stdin.buffer.read(max_bytes) if str(path) == "-" else files.read_bytes(path, max_bytes=max_bytes)
    )
    try:
        return Listed.model_validate(json.loads(data, object_pairs_hook=_once))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except ValidationError as error:
        raise InputError(f"{path}: {_first(error)}") from error
    except RecursionError as error:
        raise InputError(f"{path}: nested too deeply") from error
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {str(error).splitlines()[0]}") from error


def collect(source: Shape, target: Shape, listed: Listed | None = None) -> Constraints:
    """All constraints of a run: the pairs drawn in both files, then those that are listed.

    With one shape as both, what is drawn in it stays where it is.

    Raises:
        InputError: a drawn name without its partner, a stroke whose points all coincide, or shapes of another size than
            the list is for.
    """
    listed = listed or Listed()
    listed.check(source, target)
    pins = [(*_both(source.pins, target.pins, name), 1.0) for name in _paired(source, target, "pins")]
    pins += [(*pair, pin.weight) for pin in listed.all_pins for pair in pairs_at(source, target, pin)]
    names = _paired(source, target, "strokes")
    strokes = [(*_both(source.strokes, target.strokes, name), 1.0) for name in names]
    for number, stroke in enumerate(listed.strokes):
        a, b = _curves(stroke, number, source, target)
        strokes.append((a, b, stroke.weight))
        if stroke.ends == "stick":
            pins += [(a.z[end], b.z[end], stroke.weight) for end in (0, -1)]
    return Constraints(
        np.array([p[:2] for p in pins], dtype=complex).reshape(-1, 2),
        np.array([p[2] for p in pins], dtype=float),
        [(a, b) for a, b, _ in strokes],
        np.array([weight for _, _, weight in strokes], dtype=float),
    )


def names(source: Shape, target: Shape, listed: Listed | None = None) -> tuple[list[str], list[str]]:
    """The names of all pins, and of all strokes, in the order of `collect`; those that have none are empty."""
    listed = listed or Listed()
    again = [pin.name for pin in listed.all_pins for _ in pairs_at(source, target, pin)]
    pins = [*_paired(source, target, "pins"), *again]
    for stroke in listed.strokes:
        pins += 2 * [stroke.name] if stroke.ends == "stick" else []
    return pins, [*_paired(source, target, "strokes"), *(stroke.name for stroke in listed.strokes)]


def pairs_at(source: Shape, target: Shape, pin: Pin) -> list[tuple[complex, complex]]:
    """The points of the core planes that a pin ties together: where both meshes are cut through it, on both sides.

    Raises:
        InputError: a place that is not on its shape.
    """
    here, there = source.all_at(pin.source), target.all_at(pin.target)
    return list(zip(here, there)) if len(here) == len(there) else [(here[0], there[0])]


def pair(
    source: Shape, target: Shape, listed: Listed | None = None
) -> tuple[Complex, list[tuple[Curve, Curve]]]:
    """Pins (k, 2) and pairs of strokes in the core plane, for a solver that weighs them all alike.

    Raises:
        InputError: as `collect`, and weights that differ.
    """
    found = collect(source, target, listed)
    for weights, kind in ((found.pin_weights, "pin"), (found.stroke_weights, "stroke")):
        if weights.size and np.ptp(weights):
            raise InputError(
                f"{kind}s: weights that differ are not supported; use --{kind}-weight for all of them"
            )
    return found.pins, found.strokes


def _paired(source: Shape, target: Shape, kind: str) -> list[str]:
    """The names drawn in both files, in the source's order."""
    here, there = getattr(source, kind), getattr(target, kind)
    for alone, by, other in (
        (here.keys() - there.keys(), source, target),
        (there.keys() - here.keys(), target, source),
    ):
        if alone:
            names = ", ".join(sorted(alone)[:12])
            raise InputError(
                f"{by.path}: {names}: not drawn in {other.path}; draw each in both files, or in none"
            )
    return list(here)


def _both(here: dict[str, Any], there: dict[str, Any], name: str) -> tuple[Any, Any]:
    return here[name], there[name]


def _curves(stroke: Stroke, number: int, source: Shape, target: Shape) -> tuple[Curve, Curve]:
    name = f"strokes.{number}{f' ({stroke.name})' if stroke.name else ''}"
    return source.along(stroke.source, f"{name}: source"), target.along(stroke.target, f"{name}: target")


def _once(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object whose keys are all different: JSON leaves open what a repeated one means."""
    found: dict[str, Any] = {}
    for key, value in items:
        if key in found:
            raise InputError(f"the key {key!r} is given twice in one object")
        found[key] = value
    return found


def _first(error: ValidationError) -> str:
    """The first thing that is wrong, with its place, and how many more there are."""
    errors = error.errors(include_url=False, include_context=False, include_input=False)
    parts = [str(part) for part in errors[0]["loc"] if part not in TAGS]
    place = ".".join(parts) or "the file"
    message = MESSAGES.get(errors[0]["type"], errors[0]["msg"]).removeprefix("Value error, ")
    more = f" (and {len(errors) - 1} more mistakes)" if len(errors) > 1 else ""
    return f"{place[:200]}: {message}{more}"
