"""A minimum degree ordering of a mesh's vertices, and with it the pattern of the Cholesky factor of its matrices.

The quotient graph of George and Liu 1989 (The Evolution of the Minimum Degree Ordering Algorithm), which is simple for
a mesh: the graph of its matrices is a union of cliques, the triangles, so that every edge lies in an element from the
start. A vertex that is eliminated joins the elements around it into one, whose vertices are its column of the factor.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Index
from ..jit import kernel

LARGE = 8000
"""Vertices beyond which SuperLU's ordering pays. Measured: SciPy takes 0.2 CPU-seconds to import; at 4,000 vertices its
ordering saves 15 ms and a tenth of the factor, at 12,000 60 ms, at 50,000 half a second and a third of the work."""
ROOM = 16  # entries of the factor per vertex that are made room for at first


class Elimination(NamedTuple):
    """An order of a mesh's vertices, and what it makes of its matrices.

    Attributes:
        order: (n,) the vertices as they are eliminated.
        ends: (n + 1,) where each column of the factor, in that order, begins in `columns`.
        columns: (f,) vertices below the diagonal, unsorted.
    """

    order: Index
    ends: Index
    columns: Index


def minimum_degree(faces: Index, count: int) -> Elimination:
    """A minimum degree ordering of triangles (m, 3) of `count` vertices, each of which has one."""
    return _by_superlu(faces, count) if count > LARGE else _by_quotient_graph(faces, count)


def _by_superlu(faces: Index, count: int) -> Elimination:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spilu

    tails, heads, corners = faces.ravel(), np.roll(faces, -1, axis=1).ravel(), faces.ravel()
    own = np.arange(count)
    rows, columns = np.concatenate([tails, heads, own]), np.concatenate([heads, tails, own])
    values = np.where(
        rows == columns, 20.0, 1.0
    )  # dominant, so that nothing is pivoted, and all else is dropped
    graph = csc_matrix((values, (rows, columns)), (count, count))
    options = {"SymmetricMode": True}
    lu = spilu(
        graph, drop_tol=0.9, fill_factor=1, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
    )
    order = np.argsort(lu.perm_c)
    starts = np.append(0, np.cumsum(np.bincount(corners, minlength=count)))
    around, room, ends = np.argsort(corners, kind="stable") // 3, 4 * ROOM * count, np.zeros(count + 1, int)
    while True:
        members = np.empty(room, np.int64)
        if _fill(starts, around, corners, order, ends, members):
            return Elimination(order, ends, members[: ends[-1]])
        room *= 2


@kernel
def _fill(starts, around, corners, order, ends, members):
    """Fills in the columns of the factor for an order; False where there is too little room.

    Args:
        starts: (n + 1,) where the triangles of each vertex begin in `around`.
        around: (3m,) triangles of the vertices.
        corners: (3m,) of the triangles.
        order: (n,) vertices as they are eliminated.
        ends: (n + 1,) where each column begins in `members`, written.
        members: vertices of the columns, written.
    """
    n = order.size
    rank, marked = np.empty(n, np.int64), np.full(n, -1)
    child, sibling = np.full(n, -1), np.full(n, -1)  # of columns: each is part of that of its first row
    for c in range(n):
        rank[order[c]] = c
    for c in range(n):
        end, least = ends[c], n
        if end + n > members.size:
            return False
        for p in range(starts[order[c]], starts[order[c] + 1]):
            for v in corners[3 * around[p] : 3 * around[p] + 3]:
                if rank[v] > c and marked[v] != c:
                    marked[v], members[end], least = c, v, min(least, rank[v])
                    end += 1
        below = child[c]
        while below >= 0:
            for v in members[ends[below] : ends[below + 1]]:
                if rank[v] > c and marked[v] != c:
                    marked[v], members[end], least = c, v, min(least, rank[v])
                    end += 1
            below = sibling[below]
        ends[c + 1] = end
        if least < n:
            sibling[c], child[least] = child[least], c
    return True


def _by_quotient_graph(faces: Index, count: int) -> Elimination:
    m, corners = len(faces), faces.ravel()
    degree = np.bincount(corners, minlength=count)
    starts, around = np.append(0, np.cumsum(degree)), np.argsort(corners, kind="stable") // 3
    rings, room = np.arange(2 * count + 1), ROOM * count
    first, size = np.append(3 * np.arange(m + 1), np.zeros(count, np.int64)), np.repeat([3, 0], [m, count])
    while True:
        order, marked = np.zeros((2, count), np.int64)
        members = np.append(corners, np.zeros(room, np.int64))
        near = np.minimum(degree, count)  # triangles that overlap may be more than there are vertices
        copies = [array.copy() for array in (around, degree, near, rings, rings)]
        if _eliminate(starts, *copies, members, first, size.copy(), marked, order):
            return Elimination(order, first[m:] - first[m], members[first[m] : first[-1]])
        room *= 2


@kernel
def _enter(v, ring, after, before):
    """Puts a vertex first into a ring."""
    first = after[ring]
    before[first], after[v], before[v], after[ring] = v, first, ring, v


@kernel
def _leave(v, after, before):
    """Takes it out."""
    after[before[v]], before[after[v]] = after[v], before[v]


@kernel
def _eliminate(starts, around, count, degree, after, before, members, first, size, marked, order):
    """Eliminates the vertices one by one; False where there is too little room.

    Args:
        starts: (n + 1,) where the elements of each vertex begin in `around`.
        around: (3m,) elements of the vertices, at first the triangles.
        count: (n,) how many elements each vertex has.
        degree: (n,) of the vertices, at first the number of triangles, n at most.
        after: (2n + 1,) the next in a ring of vertices of one degree d and of n + d; at first itself.
        before: the one before.
        members: vertices of the elements, at first of the triangles; the columns of the factor are appended.
        first: (m + n + 1,) where each element begins in `members`.
        size: (m + n,) of the elements; 0: part of a later one.
        marked: (n,) zeros.
        order: (n,) the order, written.
    """
    n = order.size
    m = size.size - n
    least = stamp = 0
    for v in range(n - 1, -1, -1):
        _enter(v, n + degree[v], after, before)
    for new in range(m, m + n):
        while after[n + least] == n + least:
            least += 1
        pivot, end = after[n + least], first[new]
        if end + n > members.size:
            return False
        _leave(pivot, after, before)
        order[new - m] = pivot
        stamp += 1
        marked[pivot] = stamp
        # the elements of the pivot become one, of all their vertices
        for p in range(starts[pivot], starts[pivot] + count[pivot]):
            e = around[p]
            for j in range(first[e], first[e] + size[e]):
                v = members[j]
                if marked[v] != stamp:
                    marked[v], members[end] = stamp, v
                    end += 1
            size[e] = 0
        first[new + 1], size[new] = end, end - first[new]
        for c in range(first[new], end):
            v = members[c]
            _leave(v, after, before)
            # its elements are those that are left and the new one; how many vertices these have is its degree
            kept, wide = starts[v], 0
            stamp += 1
            for p in range(starts[v], starts[v] + count[v]):
                e = around[p]
                if size[e] > 0:
                    around[kept] = e
                    kept += 1
            around[kept], count[v] = new, kept + 1 - starts[v]
            for p in range(starts[v], kept + 1):
                e = around[p]
                for j in range(first[e], first[e] + size[e]):
                    if marked[members[j]] != stamp:
                        marked[members[j]] = stamp
                        wide += 1
            degree[v] = wide
            least = min(least, degree[v])
            _enter(v, n + degree[v], after, before)
    return True
