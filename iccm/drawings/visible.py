"""Measure what is visible of two drawings: the share of each triangle of a map that is painted on both sides."""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from .region import PaintedRegion

EDGE_SUBDIVISIONS = 3
"""Subdivisions of a triangle's edge: each triangle is sampled at the centroids of EDGE_SUBDIVISIONS² equal parts."""


class VisibleShares(NamedTuple):
    """Visible share of each triangle.

    Attributes:
        both: (m,) share that is painted in the source and in the target.
        textured: (m,) share that is painted in the target and covered by the texture.
    """

    both: Real
    textured: Real


def visible_shares(
    z: Complex,
    u: Complex,
    faces: Index,
    source: PaintedRegion,
    target: PaintedRegion,
    *,
    covering: PaintedRegion | None,
    subdivision: int = EDGE_SUBDIVISIONS,
) -> VisibleShares:
    """Measure the visible share of each triangle; arguments as for `cost.cost_of`."""
    weights = middles(subdivision)
    samples = z[faces] @ weights.T
    from_source = source.contains(samples)
    in_target = target.contains(u[faces] @ weights.T)
    textured = in_target if covering is None else in_target & covering.contains(samples)
    return VisibleShares((from_source & in_target).mean(axis=1), textured.mean(axis=1))


def middles(parts: int) -> Real:
    """Return barycentric coordinates (parts², 3) of the centroids of a triangle's equal parts."""
    points = []
    for i in range(parts):
        for j in range(parts - i):
            points.append((i + 1 / 3, j + 1 / 3))
            if j < parts - i - 1:
                points.append((i + 2 / 3, j + 2 / 3))
    first, second = np.array(points).T / parts
    return np.column_stack([first, second, 1 - first - second])
