"""Pins and strokes: pairs drawn in two files, or listed in a JSON file (see `listing`).

In drawings, these are elements whose id or Inkscape label is `pin-NAME` (the centre of a circle or ellipse) or
`stroke-NAME` (a path). The same name in source and target makes a pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Complex, Real
from ...curve import Curve
from ...errors import InputError
from ..point_syntax import Place
from .shape import Shape

if TYPE_CHECKING:
    from .listing import ConstraintsFile, PinEntry, StrokeEntry

ROTATED_RADIUS_SHARE, CIRCLE_PINS = 0.05, 6
"""Of the diagonal: radius of the disk that rotates with a pin, if there is room; and number of pins around it that
impose the rotation."""
LEAST_ROOM_SHARE = 2e-3
"""Of the diagonal: least distance to the outline of a pin that rotates the shape."""


MARK_SHARE = 0.025
"""Relative to the shape's size (the square root of its area): smaller circles only mark the position of a pin."""


@dataclass(frozen=True, eq=False)
class PlaneConstraints:
    """Constraints in the core plane.

    Attributes:
        pins: (k, 2) points of the source and of the target.
        pin_weights: (k,) positive, relative to each other.
        strokes: open curves of the source, each with one of the target.
        stroke_weights: one positive number per stroke, relative to each other.
        names: of the pins and of the strokes, empty for those that have none.
        settings: of each pin, further settings by name, see `iccm.Pin`.
        stroke_widths: of each stroke, width of the band around it that keeps its form; 0 for none.
    """

    pins: Complex
    pin_weights: Real
    strokes: list[tuple[Curve, Curve]]
    stroke_weights: Real
    names: tuple[list[str], list[str]]
    settings: list[dict[str, float]]
    stroke_widths: list[float]

    def check_weights(self) -> None:
        """Refuse different weights, since solvers use one weight for all pins and one for all strokes.

        Raises:
            InputError: weights differ.
        """
        for weights, kind in ((self.pin_weights, "pin"), (self.stroke_weights, "stroke")):
            if weights.size and np.ptp(weights):
                raise InputError(
                    f"{kind}s: different weights are not supported; use --{kind}-weight for all of them"
                )


def collect(
    source: Shape, target: Shape, listed: ConstraintsFile | None = None, *, exact: bool = False
) -> PlaneConstraints:
    """Return all constraints: the pairs drawn in both files, then those that are listed.

    If source and target are the same shape, drawn constraints stay where they are. If pins are `exact`, rotations are
    imposed by further pins on circles around them.

    Raises:
        InputError: a drawn name without a partner, a stroke whose points all coincide, or shapes with sizes other than
            those given in the list.
    """
    if listed:
        listed.check(source, target)
    pins: list[tuple] = [
        (source.pins[name], target.pins[name], 1.0, name, _drawn_settings(source, name))
        for name in _common_names(source, target, "pins")
    ]
    listed_pins = listed.pins_of(source, target) if listed else []
    for pin in listed_pins:
        pairs = pairs_at(source, target, pin.source, pin.target)
        pins += [
            (*pair, pin.weight, pin.name, in_the_plane(pin.settings, source, target, *pair)) for pair in pairs
        ]
    strokes: list[tuple] = [
        (source.strokes[name], target.strokes[name], 1.0, name, 0.0)
        for name in _common_names(source, target, "strokes")
    ]
    for number, stroke in enumerate(listed.strokes if listed else []):
        a, b = _curves(stroke, number, source, target)
        unit = float(np.mean([source.unit_at(z) for z in a.z])) if stroke.width else 1.0
        strokes.append((a, b, stroke.weight, stroke.name, stroke.width * unit))
        if stroke.ends == "stick":
            pins += [(a.z[end], b.z[end], stroke.weight, stroke.name, {"radius": 0.0}) for end in (0, -1)]
    if exact and any(pin.turn is not None for pin in listed_pins):
        pins += _around(source, target, listed_pins)
    return PlaneConstraints(
        np.array([pin[:2] for pin in pins], dtype=complex).reshape(-1, 2),
        np.array([pin[2] for pin in pins], dtype=float),
        [stroke[:2] for stroke in strokes],
        np.array([stroke[2] for stroke in strokes], dtype=float),
        ([pin[3] for pin in pins], [stroke[3] for stroke in strokes]),
        [pin[4] for pin in pins],
        [stroke[4] for stroke in strokes],
    )


def in_the_plane(
    settings: dict[str, float], source: Shape, target: Shape, start: complex, end: complex
) -> dict[str, float]:
    """Return a pin's settings with lengths converted from the files' units to the core planes, at its points."""
    converted = dict(settings)
    if "radius" in converted:
        converted["radius"] *= source.unit_at(start)
    if "tolerance" in converted:
        converted["tolerance"] *= target.unit_at(end)
    return converted


def _drawn_settings(source: Shape, name: str) -> dict[str, float]:
    """Return the radius of a drawn pin as a setting, if its circle is more than a mark."""
    radius = source.pin_radii.get(name, 0.0)
    is_mark = radius < MARK_SHARE * np.sqrt(abs(source.curve.area))
    return {} if is_mark else {"radius": radius}


def _around(source: Shape, target: Shape, listed: list[PinEntry]) -> list[tuple]:
    """Return pins on circles around those that rotate the shape.

    Raises:
        InputError: there is a target, which determines the rotation; or there is no room around a pin.
    """
    if target is not source:
        raise InputError("turn: a rotation of pins is only possible in a deformation, without a target")
    pins: list[tuple] = []
    z = np.array([source.at(pin.source) for pin in listed])
    outlines, size = (source.curve, *map(Curve, source.holes)), source.curve.diagonal
    for k, pin in enumerate(listed):
        if pin.turn is None:
            continue
        away = [outline.distances(z[k : k + 1])[0] for outline in outlines]
        room = min([*away, *np.abs(np.delete(z, k) - z[k])])
        if room < LEAST_ROOM_SHARE * size:
            raise InputError(
                f"pin {k + 1}: too close to the outline or to other pins to rotate the shape; move it away"
            )
        around = min(ROTATED_RADIUS_SHARE * size, room / 2) * np.exp(
            2j * np.pi * np.arange(CIRCLE_PINS) / CIRCLE_PINS
        )
        goals = target.at(pin.target) + around * np.exp(1j * np.radians(pin.turn))
        pins += [(*pair, pin.weight, pin.name, {}) for pair in zip(z[k] + around, goals)]
    return pins


def pairs_at(source: Shape, target: Shape, start: Place, end: Place) -> list[tuple[complex, complex]]:
    """Return pairs of points in the core planes for a pin; several if both meshes are cut through it.

    Raises:
        InputError: a place is not on its shape.
    """
    starts, ends = source.all_at(start), target.all_at(end)
    return list(zip(starts, ends)) if len(starts) == len(ends) else [(starts[0], ends[0])]


def _common_names(source: Shape, target: Shape, kind: str) -> list[str]:
    """Return the names drawn in both files, in the source's order; refuse names drawn in only one."""
    in_source, in_target = getattr(source, kind), getattr(target, kind)
    for unmatched, shape, other in (
        (in_source.keys() - in_target.keys(), source, target),
        (in_target.keys() - in_source.keys(), target, source),
    ):
        if unmatched:
            names = ", ".join(sorted(unmatched)[:12])
            raise InputError(
                f"{shape.path}: {names}: missing in {other.path}; draw each pin and stroke in both files or in neither"
            )
    return list(in_source)


def _curves(stroke: StrokeEntry, number: int, source: Shape, target: Shape) -> tuple[Curve, Curve]:
    name = f"strokes.{number}{f' ({stroke.name})' if stroke.name else ''}"
    return source.along(stroke.source, f"{name}: source"), target.along(stroke.target, f"{name}: target")
