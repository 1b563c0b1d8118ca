"""Holes as the user gave them, and the partners that pins name."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ...arrays import Complex, Index, xy_of
from ...curve import Curve
from ...errors import InputError
from ...plane import Similarity
from ...problem import Holes, Problem
from ..constraints.validate import AT_OUTLINE_SHARE
from ..model.unit_coordinates import unit_curve

ON_RIM_SHARE = 1e-3  # relative to the diagonal: points this close to a hole touch its outline
FOLLOWED_SHARE = 0.05
"""Relative to a hole's diagonal: largest distance of its outline in a map, which follows small holes less closely."""


def unit_holes(to_unit: tuple[Similarity, Similarity], holes: Holes) -> Holes:
    """Return holes in unit coordinates."""
    source = tuple(unit_curve(to_unit[0], hole) for hole in holes.source)
    target = tuple(unit_curve(to_unit[1], hole) for hole in holes.target)
    return Holes(source, target, holes.partners)


def with_paired_holes(problem: Problem) -> Problem:
    """Return the problem with holes paired in which pins lie, and with the other pins only, which keep their numbers.

    Raises:
        InputError: as `named_partners`.
    """
    assert problem.target is not None
    outlines = problem.source, problem.target
    holes, pins, numbers = named_partners(problem.holes, *outlines, problem.pins, problem.strokes)
    softness = problem.softness.of_pins(numbers)
    return replace(problem, pins=pins, pin_numbers=numbers, softness=softness, holes=holes)


def named_partners(
    holes: Holes, source: Curve, target: Curve, pins: Complex, strokes: Sequence[tuple[Curve, Curve]]
) -> tuple[Holes, Complex, Index]:
    """Pair holes in which pins (k, 2) lie; return the holes with partners, the other pins, and their numbers.

    Raises:
        InputError: a pin is in a hole or on its outline in one shape only; pins name two partners for a hole;
            or a stroke touches or crosses a hole.
    """
    holes_of_pins = [_hole_at(side, pins[:, k]) for k, side in enumerate(holes.sides)]
    partners = dict(holes.partners)
    for k, (i, j) in enumerate(zip(*holes_of_pins)):
        if (i < 0) != (j < 0):
            inside, out = ("source", "target") if i >= 0 else ("target", "source")
            raise InputError(
                f"pin {k + 1}: is in a hole in the {inside} but not in the {out}; place both points in "
                "holes to pair these holes, or both outside of holes"
            )
        if i >= 0 and partners.setdefault(i, j) != j:
            raise InputError(
                f"pin {k + 1}: pairs a hole that another pin pairs with a different hole; "
                "remove one of the two pins"
            )
    if len(set(partners.values())) < len(partners):
        raise InputError(
            "pins: two holes of the source are paired with the same hole of the target; move one of the pins"
        )
    outside = np.flatnonzero(holes_of_pins[0] < 0)
    for k, (outer, side) in enumerate(zip((source, target), holes.sides)):
        _refuse_touching(
            ("source", "target")[k], outer, side, pins[:, k], outside, [pair[k] for pair in strokes]
        )
    return holes._replace(partners=tuple(partners.items())), pins[outside], outside


def _hole_at(holes: Sequence[Curve], z: Complex) -> Index:
    """Return (k,) the hole that contains each point, -1 for none."""
    containing = np.full(z.size, -1)
    for number, hole in enumerate(holes):
        containing[hole.contains(z)] = number
    return containing


def hole_at(z: Complex, holes: Sequence[Curve]) -> int:
    """Return the hole on whose outline the points lie, -1 for none."""
    for number, hole in enumerate(holes):
        if hole.distances(z).max() < FOLLOWED_SHARE * hole.diagonal:
            return number
    return -1


def _refuse_touching(
    name: str, outer: Curve, holes: Sequence[Curve], z: Complex, numbers: Index, strokes: Sequence[Curve]
) -> None:
    """Raise InputError if one of the pins z[rest], or a stroke, touches a hole."""
    tolerance = ON_RIM_SHARE * outer.diagonal
    for hole in holes:
        ring = hole.polygon
        for k in numbers:
            if ring.distance(shapely.Point(z[k].real, z[k].imag)) < tolerance:
                raise InputError(
                    f"pin {k + 1}: is on the outline of a hole in the {name}; move it off the outline"
                )
        for k, stroke in enumerate(strokes):
            if ring.distance(shapely.LineString(xy_of(stroke.z))) < tolerance:
                raise InputError(
                    f"stroke {k + 1}: touches or crosses a hole in the {name}; draw it around the hole"
                )


def open_holes(
    holes: Sequence[Curve], outer: Curve, z: Complex, strokes: Sequence[Curve]
) -> tuple[tuple[Curve, ...], list[str]]:
    """Return the holes of a deformed shape that no pin (k,) and no stroke moves, and notes about the others.

    The others are deformed as if they were filled.
    """
    tolerance = ON_RIM_SHARE * outer.diagonal
    lines = [shapely.LineString(xy_of(stroke.z)) for stroke in strokes]
    open_holes = []
    for hole in holes:
        ring = hole.polygon
        on_rim = hole.distances(z) <= AT_OUTLINE_SHARE * outer.diagonal
        is_moved = bool(np.any(hole.contains(z) & ~on_rim)) or any(
            ring.distance(line) < tolerance for line in lines
        )
        if not is_moved:
            open_holes.append(hole)
    filled = len(holes) - len(open_holes)
    if not filled:
        return tuple(open_holes), []
    subject = "A hole contains" if filled == 1 else f"{filled} holes contain"
    return tuple(open_holes), [
        f"{subject} pins or strokes: the shape is deformed as if it were filled there."
    ]


def unequal(holes: Holes) -> list[str]:
    """Return a note if one domain has more holes than the other."""
    counts = [len(side) for side in holes.sides]
    difference = abs(counts[0] - counts[1])
    if not difference:
        return []
    unmatched = (
        f"{difference} hole{'s' * (difference > 1)} of the {'source' if counts[0] > counts[1] else 'target'}"
    )
    ending = "shrunk to a slit" if counts[0] > counts[1] else "opened from a slit"
    return [
        f"The source has {counts[0]} hole{'s' * (counts[0] != 1)} and the target {counts[1]}: {unmatched} {ending}."
    ]
