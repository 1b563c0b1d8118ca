"""The edges of a triangulation, and the triangles beside them."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Index


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a triangulation; side k of a triangle is the one opposite to its corner k.

    Attributes:
        ends: (e, 2) vertices; on the rim in the order in which the triangle turns, so that the inside is on the left.
        sides: (m, 3) edge on each side of a triangle.
        rim: (r,) edges with a triangle on one side only.
        beside: (r,) that triangle.
        opposite: (r,) and its corner that does not lie on the edge, 0, 1 or 2.
    """

    ends: Index
    sides: Index
    rim: Index
    beside: Index
    opposite: Index


def edges_of(faces: Index) -> Edges:
    """The edges of (m, 3) faces."""
    tail, head = (np.roll(faces, -k, axis=1).ravel() for k in (1, 2))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    key = low * (int(faces.max(initial=0)) + 1) + high
    _, first, sides, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    rim = np.flatnonzero(count == 1)
    ends = np.stack([low[first], high[first]], axis=1)
    ends[rim] = np.stack([tail[first[rim]], head[first[rim]]], axis=1)
    return Edges(ends, sides.reshape(faces.shape), rim, first[rim] // 3, first[rim] % 3)
