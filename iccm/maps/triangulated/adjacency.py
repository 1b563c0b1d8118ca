"""The edges of a triangulation, and the triangles at them."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Index
from ...native import function
from ...sorting import counting_order_of_pairs

_number_edges = function(
    """int64_t iccm_maps_number_edges(
        const int64_t *faces, const int64_t *across, int64_t m, int64_t *ends, int64_t *sides, int64_t *rim,
        int64_t *beside, int64_t *opposite, int64_t *rim_count)"""
)


_neighbours = function(
    "int64_t iccm_maps_neighbours(const int64_t *faces, int64_t m, int64_t vertices, int64_t *across)"
)


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a triangulation; side k of a triangle is opposite to its corner k.

    Attributes:
        ends: (e, 2) vertices; for boundary edges in the orientation of the triangle, so that the inside is on
            the left.
        sides: (m, 3) edge on each side of a triangle.
        rim: (r,) boundary edges, with a triangle on one side only.
        beside: (r,) that triangle.
        opposite: (r,) its corner opposite to the edge: 0, 1 or 2.
    """

    ends: Index
    sides: Index
    rim: Index
    beside: Index
    opposite: Index


def edges_of(faces: Index) -> Edges:
    """Return the edges of (m, 3) faces, ordered by their smaller vertex, then by the larger."""
    faces = np.ascontiguousarray(faces, np.int64)
    tail, head = (np.roll(faces, -k, axis=1).ravel() for k in (1, 2))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    count = int(faces.max(initial=-1)) + 1
    order = counting_order_of_pairs(low, high, count)
    new = np.ones(low.size, bool)
    new[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    first, sides = order[new], np.empty(low.size, np.int64)
    sides[order] = np.cumsum(new) - 1
    rim = np.flatnonzero(np.diff(np.append(np.flatnonzero(new), low.size)) == 1)
    ends = np.stack([low[first], high[first]], axis=1)
    ends[rim] = np.stack([tail[first[rim]], head[first[rim]]], axis=1)
    return Edges(ends, sides.reshape(faces.shape), rim, first[rim] // 3, first[rim] % 3)


def edges_across(faces: Index, across: Index) -> Edges:
    """Return the edges of (m, 3) faces with known neighbours (m, 3), -1 for none, in the order of the triangles."""
    m = len(faces)
    ends, sides = np.empty((3 * m, 2), np.int64), np.empty((m, 3), np.int64)
    rim, beside, corner = np.empty((3, 3 * m), np.int64)
    around = np.empty(1, np.int64)
    count = _number_edges(faces, across, m, ends, sides, rim, beside, corner, around)
    outer = slice(int(around[0]))
    return Edges(ends[:count], sides, rim[outer].copy(), beside[outer].copy(), corner[outer].copy())


def loops_along(tails: Index, heads: Index) -> list[Index]:
    """Return the loops, as vertices in order, that directed edges from tails (e,) to heads (e,) form."""
    after = dict(zip(tails.tolist(), heads.tolist()))
    loops = []
    while after:
        start, step = after.popitem()
        loop = [start]
        while step != start:
            loop.append(step)
            step = after.pop(step)
        loops.append(np.array(loop))
    return loops


def neighbours(faces: Index, count: int) -> Index:
    """Return (t, 3) the triangles across the edges of faces (t, 3), whose vertices are below `count`.

    Each is opposite to a corner of the triangle; -1 on the outline.
    """
    faces = np.ascontiguousarray(faces, np.int64)
    across = np.empty_like(faces)
    _neighbours(faces, len(faces), count, across)
    return across
