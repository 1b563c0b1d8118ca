"""A minimum degree ordering of a mesh's vertices, and the pattern of the Cholesky factor of its matrices.

The quotient graph of George and Liu 1989 (The Evolution of the Minimum Degree Ordering Algorithm) is simple for
a mesh: the graph of its matrices is a union of cliques, the triangles, so that every edge lies in an element
from the beginning. Eliminating a vertex merges the elements around it into one, whose vertices are its column
of the factor.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Index
from ..native import function
from ..sorting import grouped

LARGE_VERTEX_COUNT = 8000
"""Number of vertices above which SuperLU's ordering pays off. Measured: SciPy takes 0.2 CPU-seconds to import;
at 4,000 vertices its ordering saves 15 ms and a tenth of the factor, at 12,000 60 ms, at 50,000 half a second
and a third of the work.
"""
FIRST_ENTRIES_PER_VERTEX = 16  # entries of the factor per vertex for which memory is allocated at first

_minimum_degree = function(
    """int64_t iccm_linalg_minimum_degree(
        const int64_t *starts, int64_t *around, int64_t *count, int64_t *degree, int64_t *after, int64_t *before,
        int64_t *members, int64_t room, int64_t *first, int64_t *size, int64_t *marked, int64_t *order, int64_t n,
        int64_t m)"""
)
_fill = function(
    """int64_t iccm_linalg_fill(
        const int64_t *starts, const int64_t *around, const int64_t *corners, const int64_t *order, int64_t *ends,
        int64_t *members, int64_t room, int64_t *work, int64_t n)"""
)


class Elimination(NamedTuple):
    """An order of a mesh's vertices, and the resulting factor of its matrices.

    Attributes:
        order: (n,) the vertices in the order of elimination.
        ends: (n + 1,) where each column of the factor, in that order, begins in `columns`.
        columns: (f,) vertices below the diagonal, unsorted.
    """

    order: Index
    ends: Index
    columns: Index


def minimum_degree(faces: Index, count: int) -> Elimination:
    """Return a minimum degree ordering for triangles (m, 3) of `count` vertices, each of which is in a triangle."""
    return _by_superlu(faces, count) if count > LARGE_VERTEX_COUNT else _by_quotient_graph(faces, count)


def _by_superlu(faces: Index, count: int) -> Elimination:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spilu

    tails, heads, corners = faces.ravel(), np.roll(faces, -1, axis=1).ravel(), faces.ravel()
    vertices = np.arange(count)
    rows, columns = np.concatenate([tails, heads, vertices]), np.concatenate([heads, tails, vertices])
    values = np.where(
        rows == columns, 20.0, 1.0
    )  # diagonally dominant, so that there is no pivoting, and all other entries are dropped
    graph = csc_matrix((values, (rows, columns)), (count, count))
    options = {"SymmetricMode": True}
    lu = spilu(
        graph, drop_tol=0.9, fill_factor=1, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
    )
    order = np.argsort(lu.perm_c)
    by_vertex, starts = grouped(corners, count)
    around, room = by_vertex // 3, 4 * FIRST_ENTRIES_PER_VERTEX * count
    ends, work = np.zeros(count + 1, np.int64), np.empty(4 * count, np.int64)
    while True:
        members = np.empty(room, np.int64)
        if _fill(starts, around, corners, order, ends, members, room, work, count):
            return Elimination(order, ends, members[: ends[-1]])
        room *= 2


def _by_quotient_graph(faces: Index, count: int) -> Elimination:
    m, corners = len(faces), faces.ravel()
    by_vertex, starts = grouped(corners, count)
    around, degree = by_vertex // 3, np.diff(starts)
    rings, room = np.arange(2 * count + 1), FIRST_ENTRIES_PER_VERTEX * count
    first, size = np.append(3 * np.arange(m + 1), np.zeros(count, np.int64)), np.repeat([3, 0], [m, count])
    while True:
        order, marked = np.zeros((2, count), np.int64)
        members = np.append(corners, np.zeros(room, np.int64))
        elements = around.copy()
        element_count = degree.copy()
        approximate_degree = np.minimum(degree, count)  # overlapping triangles can outnumber the vertices
        next_in_ring, previous_in_ring = rings.copy(), rings.copy()
        remaining = size.copy()
        if _minimum_degree(
            starts, elements, element_count, approximate_degree, next_in_ring, previous_in_ring, members, members.size,
            first, remaining, marked, order, count, m,
        ):  # fmt: skip
            return Elimination(order, first[m:] - first[m], members[first[m] : first[-1]])
        room *= 2
