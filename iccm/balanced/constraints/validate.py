"""Check pins and strokes as the user gave them, and separate those on the outlines from those inside."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ...arrays import Complex, Flags, Index, Real, is_among, xy_of
from ...curve import Curve
from ...errors import ConstraintError
from ...plane import Similarity, bounding_box, longer_side
from ...problem import ON_OUTLINE_SHARE
from ..model.unit_coordinates import round_to_unit_grid
from .boundary_strokes import NAMES, DrawnStroke, refuse_other_sides, separate
from .strokes import STROKE_FINENESS_SHARE, StrokePair, simplify

# Relative to the diagonal: a pin closer than this stretches the picture between it and the outline.
NEAR_OUTLINE_SHARE = 0.02
AT_OUTLINE_SHARE = 1e-6
"""Relative to the diagonal: pins closer than this are on the outline if the outline is free, where pins close
to it do no harm.
"""
SAME_POINT_SHARE = 1e-9  # of the diagonal


@dataclass(frozen=True, eq=False)
class Pins:
    """Pins and strokes of two domains, in the user's coordinates.

    Attributes:
        inner: (k, 2) pins inside.
        outer: (l, 2) pins on the outlines, including ends of strokes, moved onto them, in the order of the
            source's outline.
        strokes: pairs of polylines inside, simplified.
        notes: messages about pins that are close to an outline.
    """

    inner: Complex
    outer: Complex
    strokes: tuple[StrokePair, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of pins, including ends of strokes on the outlines."""
        return len(self.inner) + len(self.outer)

    def unit(self, to_unit: tuple[Similarity, Similarity]) -> "Pins":
        """Return the pins in unit coordinates, on the grid."""

        def in_unit(pins: Complex) -> Complex:
            return np.column_stack(
                [round_to_unit_grid(similarity, side) for similarity, side in zip(to_unit, pins.T)]
            )

        inner, outer = in_unit(self.inner), in_unit(self.outer)
        strokes = tuple(
            StrokePair(
                Curve(to_unit[0](stroke.source.z), closed=False),
                Curve(to_unit[1](stroke.target.z), closed=False),
                stroke.sticks,
                on_outline=stroke.on_outline,
            )
            for stroke in self.strokes
        )
        return Pins(inner, outer, strokes, self.notes)

    def without(self, sources: Complex) -> "Pins":
        """Return the constraints without the inner pins that lie at `sources` (k,), points of the source."""
        return replace(self, inner=self.inner[~is_among(self.inner[:, 0], sources)])

    def inverse(self) -> "Pins":
        """Return the pins and strokes of the inverse map."""
        inner, outer = (np.ascontiguousarray(side[:, ::-1]) for side in (self.inner, self.outer))
        return Pins(inner, outer, tuple(stroke.inverse() for stroke in self.strokes), self.notes)


NO_PINS = np.empty((0, 2), np.complex128)
UNPINNED = Pins(NO_PINS, NO_PINS)


def check(
    source: Curve,
    target: Curve,
    pins: Complex,
    strokes: Sequence[tuple[Curve, Curve]] = (),
    numbers: Index | None = None,
) -> Pins:
    """Check and sort the pins (k, 2) and strokes of two domains.

    Args:
        source: outline of the source.
        target: outline of the target.
        pins: (k, 2) points of the source and their places.
        strokes: polylines of the source and of the target.
        numbers: (k,) numbers of the pins for messages, from 0; consecutive by default.

    Raises:
        InputError: a pin is outside its shape; a point is pinned to two places, or two points to one; a pin or
            the end of a stroke is on one outline only; the order of pins on the outlines differs; a stroke
            leaves its shape, or touches its outline between its ends, itself, another stroke or a pin; or a pin
            or stroke changes sides of a stroke that divides the shape.
    """
    domains = source, target
    pins, numbers, ends = _apart_from_ends(pins, strokes, source.diagonal, target.diagonal, numbers)
    distances = np.column_stack([_inside(c, pins[:, k], numbers, k) for k, c in enumerate(domains)])
    outer = distances < ON_OUTLINE_SHARE
    for k in np.flatnonzero(outer[:, 0] != outer[:, 1]):
        side_with, side_without = ("source", "target") if outer[k, 0] else ("target", "source")
        raise ConstraintError(
            f"pin {numbers[k] + 1}: is on the outline in the {side_with} but not in the {side_without}; place both "
            "points on the outline or both inside, since the map takes outline to outline",
            [numbers[k]],
        )
    outer = outer[:, 0]
    near_pins = np.flatnonzero(~outer & (distances.min(axis=1) < NEAR_OUTLINE_SHARE))
    notes = tuple(
        f"Pin {numbers[k] + 1} is very close to the outline: the picture is stretched in between. Move "
        "the pin away from the outline or onto it."
        for k in near_pins
    )
    inner, along = separate(domains, strokes, ends)
    simplified = check_strokes(domains, inner, pins, numbers)
    refuse_other_sides(domains, inner, pins[~outer], numbers[~outer])
    rim = OutlinePoints.of(pins[outer], numbers[outer], [*inner, *along])
    return Pins(pins[~outer], rim.in_order(source, target), simplified, notes)


def check_free(
    source: Curve,
    pins: Complex,
    strokes: Sequence[tuple[Curve, Curve]] = (),
    holes: Sequence[Curve] = (),
) -> Pins:
    """Check and sort the pins (k, 2) and strokes of a domain with free outlines. Their goals can be anywhere.

    Raises:
        InputError: a pin is outside its shape, a point is pinned to two places, or a stroke leaves its shape,
            or touches its outline between its ends, itself, another stroke or a pin.
    """
    pins, numbers, ends = _apart_from_ends(pins, strokes, source.diagonal, None)
    distances = _inside(source, pins[:, 0], numbers, 0)
    for hole in holes:
        hole_distances = hole.distances(pins[:, 0]) / source.diagonal
        distances = np.minimum(distances, hole_distances)
    outer = distances < AT_OUTLINE_SHARE
    inner, _ = separate((source,), strokes, ends)
    simplified = check_strokes((source,), inner, pins, numbers)
    rim = OutlinePoints.of(pins[outer], numbers[outer], inner).points
    outline_pins = rim[np.argsort(source.closest(rim[:, 0]))] if len(rim) else rim
    return Pins(pins[~outer], outline_pins, simplified)


def _apart_from_ends(
    pins: Complex,
    strokes: Sequence[tuple[Curve, Curve]],
    unit: float,
    image_unit: float | None,
    numbers: Index | None = None,
) -> tuple[Complex, Index, Flags]:
    """Return the pins without repeated ones and without those at ends of strokes.

    Returns:
        The pins, their numbers, and for both ends of each stroke (s, 2) whether a pin fixes it.
    """
    pins, unique = _without_repeats(pins, unit, image_unit)
    numbers = unique if numbers is None else numbers[unique]
    ends = _at_ends(pins, strokes, unit, image_unit or unit)
    is_apart = ~ends.any(axis=(0, 1))
    return pins[is_apart], numbers[is_apart], np.asarray(ends.any(axis=2), bool)


def _at_ends(pins: Complex, strokes: Sequence[tuple[Curve, Curve]], unit: float, image_unit: float) -> Flags:
    """Return (s, 2, k) whether a pin is at an end of a stroke in the source and at the same end in the target."""
    at_ends = np.zeros((len(strokes), 2, len(pins)), bool)
    for k, (a, b) in enumerate(strokes):
        for end in (0, -1):
            at_source = np.abs(pins[:, 0] - a.z[end]) <= SAME_POINT_SHARE * unit
            at_ends[k, end] = at_source & (np.abs(pins[:, 1] - b.z[end]) <= SAME_POINT_SHARE * image_unit)
    return at_ends


def check_strokes(
    domains: tuple[Curve, ...], strokes: Sequence[DrawnStroke], pins: Complex, numbers: Index
) -> tuple[StrokePair, ...]:
    """Check the strokes inside, and return them simplified.

    Args:
        domains: source and target, or the source alone.
        strokes: those inside.
        pins: those that are not ends of strokes.
        numbers: their numbers among those given.

    Raises:
        InputError: as in `check`.
    """
    for side, (curve, name) in enumerate(zip(domains, NAMES)):
        lines = [_line(stroke.curves[side].z) for stroke in strokes]
        unit = curve.diagonal
        for line, stroke in zip(lines, strokes):
            k = stroke.number
            ends = stroke.curves[side].z[[0, -1]]
            if abs(ends[1] - ends[0]) < ON_OUTLINE_SHARE * unit:
                raise ConstraintError(
                    f"stroke {k + 1}: is closed in the {name}; open it, or draw two strokes with a gap between them",
                    strokes=[k],
                )
            if not line.is_simple:
                raise ConstraintError(
                    f"stroke {k + 1}: crosses or touches itself in the {name}; remove the crossing",
                    strokes=[k],
                )
            for previous_line, previous in zip(lines, strokes):
                if previous is stroke:
                    break
                if line.distance(previous_line) < ON_OUTLINE_SHARE * unit:
                    j = previous.number
                    raise ConstraintError(
                        f"strokes {j + 1} and {k + 1}: cross or touch in the {name}; leave a gap between them",
                        strokes=[j, k],
                    )
            for z, number in zip(pins[:, side], numbers):
                if line.distance(shapely.Point(z.real, z.imag)) < ON_OUTLINE_SHARE * unit:
                    raise ConstraintError(
                        f"pin {number + 1} and stroke {k + 1}: touch in the {name}; move or remove one of them",
                        [number],
                        [k],
                    )
    units = [domains[0].diagonal, domains[-1].diagonal]
    return tuple(_simplified(stroke, units) for stroke in strokes)


def _simplified(stroke: DrawnStroke, units: Sequence[float]) -> StrokePair:
    a, b = (simplify(c, STROKE_FINENESS_SHARE * unit) for c, unit in zip(stroke.curves, units))
    return StrokePair(a, b, stroke.sticks, on_outline=stroke.on_outline)


def _line(z: Complex) -> shapely.LineString:
    return shapely.LineString(xy_of(z))


def _without_repeats(pins: Complex, unit: float, image_unit: float | None) -> tuple[Complex, Index]:
    """Return the pins without repeated ones, and their indices.

    Without `image_unit`, two points may have the same place.
    """
    keep: list[int] = []
    for k, (z, w) in enumerate(pins):
        same_source = [j for j in keep if abs(pins[j, 0] - z) <= SAME_POINT_SHARE * unit]
        same_goal = [j for j in keep if abs(pins[j, 1] - w) <= SAME_POINT_SHARE * (image_unit or unit)]
        if any(j in same_goal for j in same_source):
            continue
        if same_source:
            raise ConstraintError(
                f"pins {same_source[0] + 1} and {k + 1}: the same source point has two targets; remove one of the pins",
                [same_source[0], k],
            )
        if same_goal and image_unit is not None:
            raise ConstraintError(
                f"pins {same_goal[0] + 1} and {k + 1}: two source points have the same target; move one "
                "of the targets",
                [same_goal[0], k],
            )
        keep.append(k)
    return pins[keep], np.array(keep, np.int64)


def _inside(curve: Curve, z: Complex, numbers: Index, side: int) -> Real:
    """Return the distances of pins from an outline, relative to its diagonal.

    Raises:
        ConstraintError: a pin is outside.
    """
    if not z.size:
        return np.empty(0)
    distances = curve.distances(z)
    outside = np.flatnonzero(~curve.contains(z) & (distances > ON_OUTLINE_SHARE * curve.diagonal))
    if outside.size:
        k, name = outside[0], ("source", "target")[side]
        raise ConstraintError(
            f"pin {numbers[k] + 1}: ({z[k].real:g}, {z[k].imag:g}) is outside the {name} shape by "
            f"{distances[k]:.3g}; move it inside",
            [numbers[k]],
        )
    return distances / curve.diagonal


@dataclass(frozen=True, eq=False)
class OutlinePoints:
    """Points on the outlines that must correspond.

    Attributes:
        points: (k, 2) in the source and in the target.
        pins: (k,) number of the pin; -1 for ends of strokes.
        strokes: (k,) number of the stroke; -1 for pins.
    """

    points: Complex
    pins: Index
    strokes: Index

    @classmethod
    def of(cls, pins: Complex, numbers: Index, strokes: Sequence[DrawnStroke]) -> "OutlinePoints":
        """Collect pins (k, 2) with their numbers, and the ends of strokes on the outlines."""
        feet = [stroke.feet for stroke in strokes]
        stroke_numbers = [np.full(len(f), stroke.number) for f, stroke in zip(feet, strokes)]
        count = sum(map(len, feet))
        return cls(
            np.concatenate([pins, *feet]),
            np.append(numbers, np.full(count, -1)),
            np.concatenate([np.full(len(pins), -1), *stroke_numbers]).astype(np.int64),
        )

    def name(self, k: int) -> str:
        """Return the name of the k-th point in messages."""
        return f"pin {self.pins[k] + 1}" if self.pins[k] >= 0 else f"stroke {self.strokes[k] + 1}"

    def refused(self, message: str, indices: Sequence[int]) -> ConstraintError:
        """Return an error about some of the points."""
        pins = [self.pins[k] for k in indices if self.pins[k] >= 0]
        return ConstraintError(message, pins, [self.strokes[k] for k in indices if self.pins[k] < 0])

    def in_order(self, source: Curve, target: Curve) -> Complex:
        """Return (k, 2) the points moved onto the outlines, in their order around the source, without duplicates.

        Raises:
            ConstraintError: the order around the target differs.
        """
        if not len(self.points):
            return self.points
        s, tau = source.closest(self.points[:, 0]), target.closest(self.points[:, 1])
        order = self._once(np.argsort(s, kind="stable"), s / source.length, tau / target.length)
        gaps = np.mod(np.diff(tau[order], append=tau[order[0]]), target.length)
        if order.size > 1 and abs(gaps.sum() - target.length) > 0.5 * target.length:
            wrong = _out_of_order(tau[order], target.length, order)
            only_pins = all(self.pins[wrong] >= 0)
            names = ", ".join(str(self.pins[k] + 1) if only_pins else self.name(k) for k in wrong)
            raise self.refused(
                f"pins on the outline out of order: {names}; put them in the same order around both outlines",
                wrong,
            )
        return np.column_stack([source.at(s), target.at(tau)])[order]

    def _once(self, order: Index, s: Real, tau: Real) -> Index:
        """Return the order without duplicate points, which occur where two strokes along the outline meet."""
        keep: list[int] = []
        for k in order:
            for j in keep[-1:] + keep[:1]:
                same_source, same_target = (_round_gap(x[k], x[j]) < SAME_POINT_SHARE for x in (s, tau))
                if same_source and same_target:
                    break
                if same_source or same_target:
                    names = f"{self.name(j)} and {self.name(k)}"
                    raise self.refused(
                        f"{names}: at the same place on the outline of the {NAMES[int(same_target)]}, but at "
                        "different places on the other outline; move or remove one of them",
                        [j, k],
                    )
            else:
                keep.append(k)
        return np.array(keep, np.int64)


def _round_gap(a: float, b: float) -> float:
    return abs((a - b + 0.5) % 1 - 0.5)


def _out_of_order(tau: Real, length: float, order: Index) -> list[int]:
    """Return the pins that are out of order: all except the largest subset that is in order from some pin on."""
    best: list[int] = []
    for first in range(tau.size):
        lifted = np.mod(np.roll(tau, -first) - tau[first], length)
        chain = [0]
        runs = [[0]]
        for k in range(1, tau.size):
            ending = [run for run in runs if lifted[run[-1]] < lifted[k]]
            runs.append([*max(ending, key=len), k])
        chain = max(runs, key=len)
        if len(chain) > len(best):
            best = [(c + first) % tau.size for c in chain]
    return sorted(int(order[k]) for k in range(tau.size) if k not in best)


def put_pins(pins: Pins, z: Complex, u: Complex, border: int, first: int) -> None:
    """Put the vertices of pins exactly at their places, which removes the rounding errors of unit coordinates.

    Pins that are not met are left as they are.

    Args:
        pins: in the coordinates of z and u.
        z: (n,) vertices of the source, those of the outline first, then those of inner pins; changed in place.
        u: (n,) their images; changed in place.
        border: number of vertices on the outline.
        first: index of the first inner pin's vertex.
    """
    tolerance, image_tolerance = (1e-8 * longer_side(*bounding_box(w)) for w in (z, u))
    vertices = first + np.arange(len(pins.inner))
    if len(pins.outer):
        on_outline = np.abs(pins.outer[:, :1] - z[None, :border]).argmin(axis=1)
        vertices = np.append(vertices, on_outline)
    for v, (source, target) in zip(vertices, np.concatenate([pins.inner, pins.outer])):
        if abs(z[v] - source) < tolerance and abs(u[v] - target) < image_tolerance:
            z[v], u[v] = source, target


def with_points(curve: Curve, points: Complex) -> Curve:
    """Return the closed curve with vertices at points that lie on it."""
    if not points.size:
        return curve
    s = np.mod(curve.closest(points), curve.length)
    distances = np.abs(points[:, None] - curve.z[None, :])
    is_new = distances.min(axis=1) > SAME_POINT_SHARE * curve.diagonal
    z = curve.z.copy()
    z[distances.argmin(axis=1)[~is_new]] = points[~is_new]
    knots = np.append(curve.knots[:-1], s[is_new])
    return Curve(np.append(z, points[is_new])[np.argsort(knots, kind="stable")])
