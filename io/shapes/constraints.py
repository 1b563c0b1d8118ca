"""Pins and strokes: pairs drawn in two files, or listed in a JSON file, see `listing`.

Drawn: elements whose id or Inkscape label is `pin-NAME` (a circle's or ellipse's centre) or `stroke-NAME` (a path); the
same name in source and target makes a pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Complex, Real
from ...curve import Curve
from ...errors import InputError
from ..point_syntax import Place
from .shape import Shape

if TYPE_CHECKING:
    from .listing import Listed, Pin, Stroke


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


def collect(source: Shape, target: Shape, listed: Listed | None = None) -> Constraints:
    """All constraints of a run: the pairs drawn in both files, then those that are listed.

    With one shape as both, what is drawn in it stays where it is.

    Raises:
        InputError: a drawn name without its partner, a stroke whose points all coincide, or shapes of another size than
            the list is for.
    """
    if listed:
        listed.check(source, target)
    pins = [(*_both(source.pins, target.pins, name), 1.0) for name in _paired(source, target, "pins")]
    pins += [
        (*pair, pin.weight)
        for pin in _pins(listed)
        for pair in pairs_at(source, target, pin.source, pin.target)
    ]
    names = _paired(source, target, "strokes")
    strokes = [(*_both(source.strokes, target.strokes, name), 1.0) for name in names]
    for number, stroke in enumerate(listed.strokes if listed else []):
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
    again = [pin.name for pin in _pins(listed) for _ in pairs_at(source, target, pin.source, pin.target)]
    pins = [*_paired(source, target, "pins"), *again]
    strokes = listed.strokes if listed else []
    for stroke in strokes:
        pins += 2 * [stroke.name] if stroke.ends == "stick" else []
    return pins, [*_paired(source, target, "strokes"), *(stroke.name for stroke in strokes)]


def pairs_at(source: Shape, target: Shape, start: Place, end: Place) -> list[tuple[complex, complex]]:
    """The points of the core planes that a pin from a place to a place ties together: where both meshes are cut through
    it, on both sides.

    Raises:
        InputError: a place that is not on its shape.
    """
    here, there = source.all_at(start), target.all_at(end)
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


def _pins(listed: Listed | None) -> list[Pin]:
    return listed.all_pins if listed else []


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
