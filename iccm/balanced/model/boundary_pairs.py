"""Pairs (s, τ) of arclengths on the two outlines: the vertices of a mesh's boundary and where they go."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Flags, Index, Real, distinct
from ..errors import Stuck
from .outline import Outline

# Relative to the spacing; corners of source and target closer than this are merged.
MERGED_SPACING_SHARE = 0.35
SOURCE, TARGET, BOTH = 1, 2, 3  # the outline whose corner is at a pair


class Match(NamedTuple):
    """A monotone, piecewise linear correspondence of two closed outlines.

    Attributes:
        s: (k,) ascending arclengths on the source; the last is the first plus the length.
        tau: (k,) ascending arclengths on the target, in the same way.
        holes: the correspondences of holes, which run clockwise.
    """

    s: Real
    tau: Real
    holes: "tuple[HoleMatch, ...]" = ()

    def at(self, s: Real) -> Real:
        """Return τ at arclengths s, on any lap."""
        laps = np.floor((s - self.s[0]) / self._length)
        return np.interp(s - laps * self._length, self.s, self.tau) + laps * (self.tau[-1] - self.tau[0])

    @property
    def _length(self) -> float:
        return self.s[-1] - self.s[0]

    def inverse(self) -> "Match":
        """Return the correspondence from target to source."""
        holes = tuple(HoleMatch(hole.target, hole.source, hole.match.inverse()) for hole in self.holes)
        return Match(self.tau, self.s, holes)


class HoleMatch(NamedTuple):
    """The correspondence of two holes.

    Attributes:
        source: index of the hole of the source.
        target: index of the hole of the target.
        match: the correspondence of their outlines.
    """

    source: int
    target: int
    match: Match


class Loop(NamedTuple):
    """The vertices of a hole's outline in a mesh.

    Attributes:
        source: index of the hole of the source.
        target: index of the hole of the target; -1 if it has no partner and is filled.
        first: its first vertex; the others follow.
        after: one past its last vertex.
    """

    source: int
    target: int
    first: int
    after: int

    @property
    def vertices(self) -> slice:
        """The range of its vertices."""
        return slice(self.first, self.after)

    def inverse(self) -> "Loop":
        """Return the loop in the inverse map."""
        return self._replace(source=self.target, target=self.source)


def loops_of(sizes: Sequence[tuple[int, int, int]], first: int) -> tuple[Loop, ...]:
    """Return loops with consecutive vertices from `first` on.

    Args:
        sizes: (source, target, number of vertices) of each.
        first: the first vertex.
    """
    ends = first + np.cumsum([0, *(size for _, _, size in sizes)])
    return tuple(Loop(i, j, int(a), int(b)) for (i, j, _), a, b in zip(sizes, ends, ends[1:]))


class Pairs(NamedTuple):
    """The boundary vertices of a mesh, in order, loop by loop.

    Attributes:
        s: (b,) arclengths on the source, ascending.
        tau: (b,) arclengths on the target, ascending.
        at_source: (b,) whether the vertex is at a corner of the source.
        at_target: (b,) whether the vertex is at a corner of the target.
    """

    s: Real
    tau: Real
    at_source: Flags
    at_target: Flags

    @classmethod
    def joined(cls, loops: "Sequence[Pairs]") -> "Pairs":
        """Concatenate the pairs of several loops."""
        return cls(*(np.concatenate(parts) for parts in zip(*loops)))

    def of(self, selection: "Index | Flags | slice") -> "Pairs":
        """Return a selection of the pairs."""
        return Pairs(
            self.s[selection], self.tau[selection], self.at_source[selection], self.at_target[selection]
        )


def pass_through(match: Match, anchors: Match | None, even: float = 0.0) -> Match:
    """Return the match changed so that it passes through the anchors, affinely between neighbours.

    Args:
        match: a correspondence.
        anchors: pairs that must correspond, in order, without the end of the lap; None for none.
        even: share of the linear correspondence between anchors that is mixed in, for matches that may be
            steep.
    """
    if anchors is None:
        return match
    length, goal = match.s[-1] - match.s[0], match.tau[-1] - match.tau[0]
    s = np.append(anchors.s, anchors.s[0] + length)
    tau = np.append(anchors.tau, anchors.tau[0] + goal)
    laps = np.floor((match.s[:-1] - s[0]) / length)
    knots = distinct(np.concatenate([match.s[:-1] - laps * length, s]))
    old, old_ends = match.at(knots), match.at(s)
    k = np.clip(np.searchsorted(s, knots, side="right") - 1, 0, s.size - 2)
    share = np.clip((old - old_ends[k]) / np.maximum(old_ends[k + 1] - old_ends[k], 1e-300), 0, 1)
    if even:
        share = (1 - even) * share + even * (knots - s[k]) / (s[k + 1] - s[k])
    return Match(knots, tau[k] + share * (tau[k + 1] - tau[k]))


def limit_slope(match: Match, steepest: float) -> Match:
    """Return the match with slopes, relative to the mean one, between 1/steepest and steepest."""
    ds = np.diff(match.s)
    goal = match.tau[-1] - match.tau[0]
    mean = goal / (match.s[-1] - match.s[0])
    steps = ds * np.clip(np.diff(match.tau) / np.maximum(ds * mean, 1e-300), 1 / steepest, steepest)
    return Match(match.s, match.tau[0] + np.append(0, np.cumsum(steps)) * goal / steps.sum())


def boundary_pairs(
    source: Outline, target: Outline, match: Match, spacing: float, anchors: Match | None = None
) -> Pairs:
    """Return the corners of both outlines with their partners, and as many pairs between them as the spacing requires.

    Args:
        source: outline of the source.
        target: outline of the target.
        match: their correspondence, through the anchors.
        spacing: the longest edge allowed on either side.
        anchors: pairs that must correspond; corners of both outlines.

    Raises:
        Stuck: two corners coincide.
    """
    s, tau, kind = _corner_pairs(source, target, match, anchors)
    if not s.size:  # discs have no corners: any pair can be the first
        s, tau, kind = match.s[:1], match.tau[:1], np.zeros(1, int)
    if anchors is None:
        s, tau, kind = _begun_after_widest_gap(s, tau, kind, source.length, target.length)
    s, tau, kind = _merge_corners(s, tau, kind, source.length, target.length, MERGED_SPACING_SHARE * spacing)
    ds, dt = _gaps(s, source.length), _gaps(tau, target.length)
    if min(ds.min() / source.length, dt.min() / target.length) < 1e-10:
        raise Stuck("two corners of the outlines coincide")
    gap, share = subdivide(np.maximum(ds, dt), spacing)
    is_corner = share == 0
    return Pairs(
        s[gap] + share * ds[gap],
        tau[gap] + share * dt[gap],
        is_corner & (kind[gap] & SOURCE > 0),
        is_corner & (kind[gap] & TARGET > 0),
    )


def subdivide(gaps: Real, spacing: float) -> tuple[Index, Real]:
    """Divide gaps into equal parts no longer than the spacing.

    Returns:
        (k,) the gap of each part, and (k,) the share of the gap at which the part begins.
    """
    parts = np.maximum(1, np.ceil(gaps / spacing - 1e-6)).astype(np.int64)
    gap = np.repeat(np.arange(parts.size), parts)
    return gap, (np.arange(parts.sum()) - (np.cumsum(parts) - parts)[gap]) / parts[gap]


def _corner_pairs(source: Outline, target: Outline, match: Match, anchors: Match | None):
    """Return (s, τ, kind) of all corners, ascending from the beginning of the match."""
    s0, t0 = match.s[0], match.tau[0]
    source_corners = s0 + np.sort(np.mod(source.corners - s0, source.length))
    target_corners = t0 + np.sort(np.mod(target.corners - t0, target.length))
    if anchors is not None:
        source_corners = source_corners[are_distinct(source_corners, anchors.s, source.length)]
        target_corners = target_corners[are_distinct(target_corners, anchors.tau, target.length)]
    fixed_s = np.empty(0) if anchors is None else s0 + np.mod(anchors.s - s0, source.length)
    fixed_tau = np.empty(0) if anchors is None else t0 + np.mod(anchors.tau - t0, target.length)
    s = np.concatenate([source_corners, np.interp(target_corners, match.tau, match.s), fixed_s])
    tau = np.concatenate([np.interp(source_corners, match.s, match.tau), target_corners, fixed_tau])
    kind = np.repeat([SOURCE, TARGET, BOTH], [source_corners.size, target_corners.size, fixed_s.size])
    order = np.lexsort((tau, s))
    return s[order], tau[order], kind[order]


def _begun_after_widest_gap(s: Real, tau: Real, kind, length: float, goal: float):
    """Return the same pairs, starting after the widest gap, so that no pairs are merged across the end of the lap."""
    k = int(np.argmax(_gaps(s, length) / length + _gaps(tau, goal) / goal)) + 1
    later = np.arange(s.size) < k
    return tuple(np.roll(values, -k) for values in (s + length * later, tau + goal * later, kind))


def are_distinct(values: Real, reference: Real, length: float) -> Flags:
    """Return which arclengths of a closed curve differ from all of the others."""
    gap = np.mod(values[:, None] - reference + 0.5 * length, length) - 0.5 * length
    return np.all(np.abs(gap) > 1e-9 * length, axis=1)


def _merge_corners(s: Real, tau: Real, kind, length: float, goal: float, tolerance: float):
    """Merge neighbours, one a corner of the source and one of the target, into one pair where both gaps are small.

    The pair takes its place on each outline from that outline's corner, which widens one neighbouring gap on
    each side. A merge that would more than double such a gap is skipped.
    """
    s, tau, kind = s.copy(), tau.copy(), kind.copy()
    count = s.size
    previous, following = (np.arange(count) - 1) % count, (np.arange(count) + 1) % count
    ds, dt = _gaps(s, length), _gaps(tau, goal)
    mixed = (kind != kind[following]) & (kind != BOTH) & (kind[following] != BOTH)
    close = np.flatnonzero(mixed & (ds < tolerance) & (dt < tolerance))
    keep = np.ones(count, bool)
    for i in close[np.argsort((ds + dt)[close], kind="stable")]:
        j = following[i]
        if kind[i] == BOTH or kind[j] == BOTH or not (keep[i] and keep[j]) or j == 0:
            continue
        p, n = previous[i], following[j]
        ahead, behind = (ds[j], dt[p]) if kind[i] == SOURCE else (dt[j], ds[p])
        widened = (ds[i], dt[i]) if kind[i] == SOURCE else (dt[i], ds[i])
        if widened[0] > ahead or widened[1] > behind:
            continue
        s[i], tau[i] = (s[i], tau[j]) if kind[i] == SOURCE else (s[j], tau[i])
        kind[i], keep[j] = BOTH, False
        previous[n], following[i] = i, n
        for v in (p, i):
            ds[v] = s[following[v]] - s[v] + (length if following[v] <= v else 0)
            dt[v] = tau[following[v]] - tau[v] + (goal if following[v] <= v else 0)
    return s[keep], tau[keep], kind[keep]


def _gaps(values: Real, length: float) -> Real:
    return np.diff(values, append=values[0] + length)
