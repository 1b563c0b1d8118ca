"""The edges of a triangulation, and the triangles beside them."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Index
from ...jit import kernel


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
    """The edges of (m, 3) faces, ordered by their lower vertex, then by the other."""
    tail, head = (np.roll(faces, -k, axis=1).ravel() for k in (1, 2))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    count = int(faces.max(initial=-1)) + 1
    order = _by_counting(low, _by_counting(high, np.arange(low.size), count), count)
    new = np.ones(low.size, bool)
    new[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    first, sides = order[new], np.empty(low.size, np.int64)
    sides[order] = np.cumsum(new) - 1
    rim = np.flatnonzero(np.diff(np.append(np.flatnonzero(new), low.size)) == 1)
    ends = np.stack([low[first], high[first]], axis=1)
    ends[rim] = np.stack([tail[first[rim]], head[first[rim]]], axis=1)
    return Edges(ends, sides.reshape(faces.shape), rim, first[rim] // 3, first[rim] % 3)


@kernel
def _by_counting(key, order, count):
    """`order` sorted by key[order], numbers below `count`; equal ones stay in order."""
    place, out = np.zeros(count + 1, np.int64), np.empty(order.size, np.int64)
    for k in key:
        place[k + 1] += 1
    for k in range(count):
        place[k + 1] += place[k]
    for at in order:
        out[place[key[at]]] = at
        place[key[at]] += 1
    return out
