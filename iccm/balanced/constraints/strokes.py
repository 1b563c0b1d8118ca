"""Strokes as chains of mesh vertices: vertices at corners of either polyline are fixed, the others slide."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from ...arrays import Complex, Real, complex_of, xy_of
from ...curve import Curve
from ..minimise.sliding import Rail
from ..model.boundary_pairs import MERGED_SPACING_SHARE, Match, subdivide
from ..model.inner_constraints import Foot, InnerConstraints
from ..model.outline import SHARP_CORNER_RADIANS

LEAST_PARTS_OF_STROKE = 4  # of a stroke with an end on the outline
STROKE_FINENESS_SHARE = (
    1e-4  # relative to the diagonal: largest distance of simplified strokes from the given ones
)


@dataclass(frozen=True, eq=False)
class StrokePair:
    """An open polyline in the source and its goal in the target.

    Attributes:
        source: in the source.
        target: in the target.
        sticks: for its first and last end, whether it is mapped to the same end of the target's polyline;
            otherwise it slides along it.
        covered: for its first and last end, whether the image covers that end of the source's polyline; False
            is possible in inverse maps only.
        on_outline: for its first and last end, whether it lies on the outlines; such ends stick.
    """

    source: Curve
    target: Curve
    sticks: tuple[bool, bool] = (False, False)
    covered: tuple[bool, bool] = (True, True)
    on_outline: tuple[bool, bool] = (False, False)

    def inverse(self) -> "StrokePair":
        """Return the stroke of the inverse map."""
        return StrokePair(self.target, self.source, self.covered, self.sticks, self.on_outline)

    @property
    def even(self) -> Match:
        """The correspondence that is proportional to arclength."""
        return Match(np.array([0, self.source.length]), np.array([0, self.target.length]))

    @property
    def rails(self) -> tuple[Rail, Rail]:
        """The closed rails in source and target on which vertices slide."""
        return rail_of(self.source), rail_of(self.target)


def simplify(curve: Curve, fineness: float) -> Curve:
    """Return a stroke with fewer vertices, within `fineness` (a length) of it."""
    line = shapely.LineString(xy_of(curve.z)).simplify(fineness)
    return Curve(complex_of(shapely.get_coordinates(line)), closed=False)


def rail_of(curve: Curve) -> Rail:
    """Return the stroke traversed forth and back as a rail; sliding vertices stop at its sharp corners and its ends."""
    loop = Curve(np.append(curve.z, curve.z[-2:0:-1]))
    edges = loop.edges
    sharp = np.abs(np.angle(edges / np.roll(edges, 1))) > SHARP_CORNER_RADIANS
    sharp[[0, curve.z.size - 1]] = True
    return Rail(loop.knots, loop.z, loop.knots[:-1][sharp])


def inside(
    strokes: tuple[StrokePair, ...], matches: list[Match], spacing: float, pins: Complex
) -> InnerConstraints:
    """Return the vertices of strokes, at most `spacing` apart on either side, and those of pins (k, 2)."""
    pin_constraints = InnerConstraints.of_pins(pins)
    parts = [_chain(stroke, match, spacing) for stroke, match in zip(strokes, matches)]
    sizes = [part[0].size for part in parts]
    links = [np.append(start + 1 + np.arange(n - 1), -1) for start, n in zip(np.cumsum([0, *sizes]), sizes)]
    s, tau, at_source, at_target, stuck = ([part[k] for part in parts] for k in range(5))
    return InnerConstraints(
        np.concatenate([*(stroke.source.at(x) for stroke, x in zip(strokes, s)), pin_constraints.z]),
        np.concatenate([*(stroke.target.at(x) for stroke, x in zip(strokes, tau)), pin_constraints.goals]),
        np.concatenate([*s, pin_constraints.s]),
        np.concatenate([*tau, pin_constraints.tau]),
        np.concatenate(
            [np.repeat(np.arange(len(sizes)), sizes).astype(np.int64), pin_constraints.stroke_index]
        ),
        np.concatenate([*links, pin_constraints.links]),
        np.concatenate([*at_source, pin_constraints.at_source]),
        np.concatenate([*at_target, pin_constraints.at_target]),
        np.concatenate([*stuck, pin_constraints.stuck]),
        tuple(stroke.rails for stroke in strokes),
        feet_of(strokes, sizes),
    )


def feet_of(strokes: tuple[StrokePair, ...], sizes: list[int]) -> tuple[Foot, ...]:
    """Return the points where strokes meet the outline; `sizes` are the numbers of inner vertices of the strokes."""
    starts = np.cumsum([0, *sizes])
    return tuple(
        Foot(int(starts[k] + end * (sizes[k] - 1)), complex(stroke.source.z[-end]), k, end)
        for k, stroke in enumerate(strokes)
        for end in (0, 1)
        if stroke.on_outline[end]
    )


def aim_feet(
    inside: InnerConstraints, strokes: tuple[StrokePair, ...], u: Complex, even: float
) -> InnerConstraints:
    """Return the constraints with the goals of strokes whose ends slide moved close to their present images.

    Args:
        inside: constraints as returned by `inside`.
        strokes: the strokes.
        u: (k,) present images of the vertices.
        even: share of the former goals that is mixed into the closest points, which may accumulate.
    """
    from scipy.optimize import isotonic_regression  # slow to import, and seldom needed

    goals, tau, at_target = inside.goals.copy(), inside.tau.copy(), inside.at_target.copy()
    for k, stroke in enumerate(strokes):
        if all(stroke.sticks):
            continue
        chain = np.flatnonzero(inside.stroke_index == k)
        closest = isotonic_regression(stroke.target.closest(u[chain])).x
        places = (1 - even) * closest + even * inside.tau[chain]
        share = (inside.tau[chain] - inside.tau[chain[0]]) / np.ptp(inside.tau[chain])
        first, last = (tau[chain[end]] - places[end] if stroke.sticks[end] else 0.0 for end in (0, -1))
        tau[chain] = places + (1 - share) * first + share * last
        goals[chain], at_target[chain] = stroke.target.at(tau[chain]), inside.stuck[chain]
    return inside._replace(goals=goals, tau=tau, at_target=at_target)


def _chain(stroke: StrokePair, match: Match, spacing: float) -> tuple[Any, ...]:
    """Return the vertices of a stroke in order, without those on the outlines.

    Returns:
        s, τ, whether at a corner of the source, whether at a corner of the target, and whether fixed even if
        corners are released.
    """
    if any(stroke.on_outline):  # at least two vertices are inside
        spacing = min(spacing, max(stroke.source.length, stroke.target.length) / LEAST_PARTS_OF_STROKE)
    ends, goals = match.s[[0, -1]], match.tau[[0, -1]]
    s0, t0 = _between(stroke.source.knots, *ends), _between(stroke.target.knots, *goals)
    s = np.concatenate([ends, s0, np.interp(t0, match.tau, match.s)])
    tau = np.concatenate([goals, np.interp(s0, match.s, match.tau), t0])
    kind = np.repeat([3, 1, 2], [2, s0.size, t0.size])
    order = np.lexsort((tau, s))
    places = _merge_corners(list(zip(s[order], tau[order], kind[order])), MERGED_SPACING_SHARE * spacing)
    s, tau, kind = (
        np.array([p[0] for p in places]),
        np.array([p[1] for p in places]),
        np.array([p[2] for p in places]),
    )
    interval, share = subdivide(np.maximum(np.diff(s), np.diff(tau)), spacing)
    corner = np.append(share == 0, True)
    kinds = np.append(kind[interval], kind[-1])
    at_source, at_target, stuck = (
        corner & (kinds & 1 > 0),
        corner & (kinds & 2 > 0),
        np.zeros(kinds.size, bool),
    )
    at_source[[0, -1]] = stroke.covered
    at_target[[0, -1]] = stuck[[0, -1]] = stroke.sticks
    chain = (
        np.append(s[interval] + share * np.diff(s)[interval], s[-1]),
        np.append(tau[interval] + share * np.diff(tau)[interval], tau[-1]),
        at_source,
        at_target,
        stuck,
    )
    first, last = stroke.on_outline
    return tuple(part[int(first) : part.size - int(last)] for part in chain)


def _between(values: Real, low: float, high: float) -> Real:
    return values[(values > low) & (values < high)]


def _merge_corners(places: list, tolerance: float) -> list:
    """Merge neighbours, one a corner of the source and one of the target, into one where both gaps are small."""
    merged = [places[0]]
    for s, tau, kind in places[1:]:
        previous = merged[-1]
        close = s - previous[0] < tolerance and tau - previous[1] < tolerance
        if close and kind + previous[2] == 3 and kind != 3:
            merged_s = s if kind == 1 else previous[0]
            merged[-1] = (merged_s, previous[1] if kind == 1 else tau, 3)
        elif s - previous[0] < 1e-9 or tau - previous[1] < 1e-9:
            merged[-1] = (s, tau, 3) if kind == 3 else previous
        else:
            merged.append((s, tau, kind))
    return merged
