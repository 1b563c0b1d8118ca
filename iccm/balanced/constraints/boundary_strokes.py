"""Strokes that touch the outlines.

An end on the outline acts as a pin there, and a stroke along the outline as two pins. Since outlines are mapped
onto each other, nothing else remains to be met: a curve along one outline is mapped to a curve along the other,
with ends mapped to ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Complex, Flags, Index, complex_of, xy_of
from ...curve import Curve
from ...errors import ConstraintError
from ...problem import ON_OUTLINE_SHARE

# Relative to ON_OUTLINE_SHARE: length from its end on which a stroke may stay close to the outline.
BESIDE_END_DISTANCES = 20.0
SAMPLES_PER_LENGTH = 2.0  # of a stroke, per length ON_OUTLINE_SHARE
CLEAR_DISTANCES = 2.0  # of ON_OUTLINE_SHARE: an end that is cut off the outline begins this far from it
SAME_POINT_SHARE = 1e-9  # relative to the diagonal: due to rounding
NAMES = ("source", "target")


@dataclass(frozen=True, eq=False)
class DrawnStroke:
    """A stroke, with its number among the given ones.

    Attributes:
        number: from 0 on.
        curves: in the source and in the target.
        sticks: for both ends, whether it is mapped to the same end in the target.
        on_outline: for both ends, whether it is on the outlines; such ends stick.
    """

    number: int
    curves: tuple[Curve, Curve]
    sticks: tuple[bool, bool]
    on_outline: tuple[bool, bool] = (False, False)

    @property
    def feet(self) -> Complex:
        """Ends on the outlines, in the source and in the target; shape (k, 2)."""
        return np.array([[c.z[-e] for c in self.curves] for e in (0, 1) if self.on_outline[e]]).reshape(-1, 2)


def separate(
    domains: tuple[Curve, ...], strokes: Sequence[tuple[Curve, Curve]], sticks: Flags
) -> tuple[list[DrawnStroke], list[DrawnStroke]]:
    """Return the strokes inside, with their ends on the outlines moved exactly onto them, and those along the outlines.

    Args:
        domains: source and target, or the source alone.
        strokes: as given.
        sticks: (s, 2) the ends of strokes that stick.

    Raises:
        ConstraintError: a stroke leaves its shape, or touches its outline elsewhere than at an end, or in one
            shape only.
    """
    inner, along = [], []
    for k, (pair, stuck) in enumerate(zip(strokes, sticks)):
        drawn_stroke = DrawnStroke(k, pair, (bool(stuck[0]), bool(stuck[1])))
        runs_along = [_is_along(curve, stroke) for curve, stroke in zip(domains, pair)]
        if any(runs_along):
            along.append(_along(domains, drawn_stroke, runs_along))
        else:
            inner.append(_snap_ends(domains, drawn_stroke))
    return inner, along


def _is_along(curve: Curve, stroke: Curve) -> bool:
    z = stroke.at(_samples(curve, stroke))
    return bool(np.all(curve.distances(z) <= ON_OUTLINE_SHARE * curve.diagonal))


def _along(domains: tuple[Curve, ...], drawn_stroke: DrawnStroke, runs_along: Sequence[bool]) -> DrawnStroke:
    """Return a stroke along both outlines, with its ends on them.

    Raises:
        ConstraintError: it runs along one outline only, or along them in opposite directions.
    """
    k = drawn_stroke.number
    if len(domains) < 2:
        raise ConstraintError(
            f"stroke {k + 1}: runs along the outline, which is free to move in a deformation; draw the "
            "stroke inside the shape",
            strokes=[k],
        )
    if not all(runs_along):
        side, other_side = NAMES if runs_along[0] else NAMES[::-1]
        raise ConstraintError(
            f"stroke {k + 1}: runs along the outline in the {side} but not in the {other_side}; draw both "
            "along the outline or both inside, since the map takes outline to outline",
            strokes=[k],
        )
    if len({_goes_round(*pair) for pair in zip(domains, drawn_stroke.curves)}) > 1:
        raise ConstraintError(
            f"stroke {k + 1}: runs along the outlines in opposite directions; reverse it in the source or "
            "in the target",
            strokes=[k],
        )
    ends = [Curve(c.nearest(s.z[[0, -1]]), closed=False) for c, s in zip(domains, drawn_stroke.curves)]
    return DrawnStroke(k, (ends[0], ends[1]), (True, True), (True, True))


def _goes_round(curve: Curve, stroke: Curve) -> bool:
    """Return whether a stroke along a closed curve has the same direction as the curve."""
    s = curve.closest(stroke.at(_samples(curve, stroke)))
    return bool(_wrapped(np.diff(s), curve.length).sum() > 0)


def _wrapped(steps: np.ndarray, length: float) -> np.ndarray:
    return np.mod(steps + 0.5 * length, length) - 0.5 * length


def _snap_ends(domains: tuple[Curve, ...], drawn_stroke: DrawnStroke) -> DrawnStroke:
    """Return a stroke inside, with ends close to both outlines moved onto them.

    An end on the outline in the target only is cut off; if it has a pin, that is an error, as is an end on the outline
    in the source only.
    """
    k, curves = drawn_stroke.number, list(drawn_stroke.curves)
    near = np.array(
        [c.distances(s.z[[0, -1]]) <= ON_OUTLINE_SHARE * c.diagonal for c, s in zip(domains, curves)]
    )
    for end in (0, 1):
        on_source, on_target = near[0, end], near[-1, end]
        if on_source and not on_target:
            raise ConstraintError(
                f"stroke {k + 1}: ends on the outline in the source but not in the target; end both on "
                "the outline or both inside, since the map takes outline to outline",
                strokes=[k],
            )
        if on_target and not on_source and drawn_stroke.sticks[end]:
            raise ConstraintError(
                f"stroke {k + 1}: ends on the outline in the target but not in the source; end both on "
                "the outline, or remove the pin at that end",
                strokes=[k],
            )
    on_outline = bool(near[:, 0].all()), bool(near[:, 1].all())
    for side, curve in enumerate(domains):
        for end in (0, 1):
            if near[side, end] and on_outline[end]:
                curves[side] = _extend_to_outline(curve, curves[side], end)
            elif near[side, end]:
                curves[side] = _cut_off(curve, curves[side], end)
        _refuse_touching(curve, curves[side], on_outline, k, side)
    sticks = drawn_stroke.sticks[0] or on_outline[0], drawn_stroke.sticks[1] or on_outline[1]
    return DrawnStroke(k, (curves[0], curves[1]), sticks, on_outline)


def _refuse_touching(curve: Curve, stroke: Curve, on_outline: tuple[bool, bool], k: int, side: int) -> None:
    s = _samples(curve, stroke)
    z = stroke.at(s)
    unit = ON_OUTLINE_SHARE * curve.diagonal
    bad = (curve.distances(z) < unit) | ~curve.contains(z)
    for end, from_end in ((0, s), (1, stroke.length - s)):
        if on_outline[end]:
            bad &= from_end > BESIDE_END_DISTANCES * unit
    if bad.any():
        raise ConstraintError(
            f"stroke {k + 1}: leaves the shape or touches its outline between its ends, in the "
            f"{NAMES[side]}; keep it inside, or split it there",
            strokes=[k],
        )


def _extend_to_outline(curve: Curve, stroke: Curve, end: int) -> Curve:
    """Return the stroke extended to the outline at an end that is close to it, or cut where it leaves the shape."""
    z = stroke.z[::-1] if end else stroke.z
    foot = curve.nearest(z[:1])
    if abs(foot[0] - z[0]) <= SAME_POINT_SHARE * curve.diagonal:
        z = np.append(foot, z[1:])
    elif curve.contains(z[:1])[0]:
        z = np.append(foot, z)
    else:
        first_inside = 1 + int(np.argmax(np.append(curve.contains(z[1:-1]), True)))
        intersection = shapely.LineString(xy_of(z[[first_inside - 1, first_inside]])).intersection(
            _ring(curve)
        )
        crossings = complex_of(shapely.get_coordinates(intersection))
        foot = crossings[[np.abs(crossings - z[first_inside - 1]).argmin()]] if crossings.size else foot
        z = np.append(curve.nearest(foot), z[first_inside:])
    return Curve(z[::-1] if end else z, closed=False)


def _cut_off(curve: Curve, stroke: Curve, end: int) -> Curve:
    """Return the stroke without the part at an end that is close to the outline."""
    from_end = Curve(stroke.z[::-1], closed=False) if end else stroke
    s = _samples(curve, from_end)
    z = from_end.at(s)
    clear = (curve.distances(z) > CLEAR_DISTANCES * ON_OUTLINE_SHARE * curve.diagonal) & curve.contains(z)
    start = s[np.argmax(clear)] if clear.any() else 0.0
    z = np.append(
        from_end.at(np.array([start])), from_end.z[from_end.knots > start + 1e-12 * from_end.length]
    )
    return Curve(z[::-1] if end else z, closed=False)


def refuse_other_sides(
    domains: tuple[Curve, ...], strokes: Sequence[DrawnStroke], pins: Complex, numbers: Index
) -> None:
    """Raise ConstraintError if a pin or stroke changes sides of a stroke that divides the shapes.

    Args:
        domains: source and target, or the source alone.
        strokes: the strokes inside the domains.
        pins: (k, 2) pins inside.
        numbers: (k,) their numbers.
    """
    for stroke in strokes:
        if len(domains) < 2 or not all(stroke.on_outline):
            continue
        rest_of_strokes = [s for s in strokes if s is not stroke]
        middles = np.array([[c.at(0.5 * c.length) for c in s.curves] for s in rest_of_strokes]).reshape(-1, 2)
        points = np.concatenate([pins, middles])
        is_left = [_left_of(c, s, side) for c, s, side in zip(domains, stroke.curves, points.T)]
        for k in np.flatnonzero(is_left[0] != is_left[1]):
            is_pin = k < len(pins)
            pin = [int(numbers[k])] if is_pin else []
            stroke_numbers = [] if is_pin else [rest_of_strokes[k - len(pins)].number]
            name = f"pin {pin[0] + 1}" if is_pin else f"stroke {stroke_numbers[0] + 1}"
            raise ConstraintError(
                f"{name}: lies on different sides of stroke {stroke.number + 1} in the source and in the "
                "target; that stroke divides the shape, so move one of the two points",
                pin,
                [*stroke_numbers, stroke.number],
            )


def _left_of(curve: Curve, stroke: Curve, points: Complex) -> Flags:
    """Return which points of a domain are to the left of a stroke that divides it."""
    first, last = curve.closest(stroke.z[[0, -1]])
    knots = curve.knots[:-1]
    after = np.mod(knots - last, curve.length)
    between = after < np.mod(first - last, curve.length)
    ring = np.append(stroke.z, curve.z[between][np.argsort(after[between])])
    return Curve(ring).contains(points)


def _samples(curve: Curve, stroke: Curve) -> np.ndarray:
    """Return arclengths along a stroke, dense enough to detect whether it touches a shape's outline.

    They include the stroke's vertices.
    """
    count = int(np.ceil(SAMPLES_PER_LENGTH * stroke.length / (ON_OUTLINE_SHARE * curve.diagonal)))
    return np.union1d(np.linspace(0, stroke.length, min(count, 20_000) + 2), stroke.knots)


def _ring(curve: Curve) -> shapely.LineString:
    return shapely.LineString(xy_of(np.append(curve.z, curve.z[0])))
