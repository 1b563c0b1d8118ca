"""Divide a boundary into panels, small at corners and where the domain is thin."""

from functools import cache

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve, corners_of

# Values were chosen by hand unless a comment gives a reason.
CORNER = np.radians(
    12
)  # a vertex with a larger angle is a corner, where densities and derivatives are singular
GROWTH_PER_DISTANCE = 0.4  # growth of the panel length with the distance from a corner
PAIRS_AT_ONCE = 1 << 21  # of samples that are processed at a time: 0.1 GB
THICKNESS_SHARE = 0.35  # longest panel, relative to the local thickness


def corners(curve: Curve) -> np.ndarray:
    """Return the indices of the vertices at which densities and derivatives are singular."""
    return corners_of(curve, CORNER)


def thickness(curve: Curve, per_length: float) -> tuple[np.ndarray, Complex, Real]:
    """Return the radius of the largest inner disc that touches the boundary, at sample points.

    The shrinking ball method is used.

    Returns:
        Edge, point and radius of each sample; samples are about `per_length` apart, with at least one per edge.
    """
    counts = np.maximum(1, np.ceil(curve.lengths / per_length)).astype(int)
    edge = np.repeat(np.arange(counts.size), counts)
    t = (np.arange(edge.size) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[edge]
    z = curve.z[edge] + t * curve.edges[edge]
    rows = max(1, PAIRS_AT_ONCE // edge.size)
    radius = np.concatenate([_touching(curve, edge, z, k, k + rows) for k in range(0, edge.size, rows)])
    return edge, z, np.minimum(radius, curve.diagonal)


def _touching(curve: Curve, edge: np.ndarray, z: Complex, first: int, end: int) -> Real:
    """Return the result of `thickness` for some of the samples."""
    mine = edge[first:end]
    d = z[None, :] - z[first:end, None]
    ahead = -(curve.normals[mine].conj()[:, None] * d).real
    is_visible = (ahead > 1e-9 * curve.diagonal) & (mine[:, None] != edge[None, :])
    return np.where(is_visible, np.abs(d) ** 2 / np.where(is_visible, 2 * ahead, 1.0), np.inf).min(axis=1)


def graded(curve: Curve, longest: float, at_corners: Real) -> Real:
    """Return the arclengths of panel ends, including all vertices of the curve.

    Args:
        curve: the boundary.
        longest: longest panel.
        at_corners: (c,) panel length at each of `corners(curve)`.

    Returns:
        (p,) increasing arclengths; the division of an edge does not depend on the first vertex or the direction
        of the curve.
    """
    where = curve.z[corners(curve)]
    edge, z, radius = thickness(curve, longest)
    out = []
    for k, length in enumerate(curve.lengths):
        mine = edge == k
        t = _positions(int(mine.sum()))
        positions = curve.z[k] + t * curve.edges[k]
        thin = np.interp(t, np.abs(z[mine] - curve.z[k]) / length, radius[mine])
        size = np.clip(THICKNESS_SHARE * thin, 0.02 * longest, longest)
        if where.size:
            size = np.minimum(
                size, (at_corners + GROWTH_PER_DISTANCE * np.abs(positions[:, None] - where)).min(axis=1)
            )
        work = np.concatenate([[0.0], np.cumsum(np.diff(t) * length * 0.5 * (1 / size[1:] + 1 / size[:-1]))])
        count = max(1, int(np.ceil(work[-1] - 1e-6)))
        out.append(curve.knots[k] + length * np.interp(work[-1] * np.arange(count) / count, work, t))
    return np.concatenate(out)


@cache
def _positions(samples: int) -> Real:
    """Return the positions on an edge at which the panel length is evaluated.

    Some are evenly spaced, and others accumulate at both ends.
    """
    ends = np.concatenate([[0.0], np.geomspace(1e-12, 0.5, 80)])
    return np.unique(np.concatenate([np.linspace(0, 1, 4 * samples + 1), ends, 1 - ends]))
