"""Sparse LDLᵀ of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.

Up-looking factorisation (Davis, *Direct Methods for Sparse Linear Systems*, 2006, chapter 4; QDLDL, Stellato et al.
2020) on blocks, so that an index is read once for eight products. The vertices are ordered and the pattern of the
factor is found once a mesh (`ordering`), and every Newton step only fills in numbers. A vertex that may move along one
direction only, or not at all, keeps its block: the missing unknown has a one on the diagonal.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Index
from ...jit import NUMPY, kept, kernel
from .ordering import Elimination, minimum_degree


class BlockPattern(NamedTuple):
    """The pattern of the matrices of one mesh.

    Attributes:
        position: (n,) row of each vertex in the order of elimination.
        starts: (n + 1,) where each column begins in `rows`.
        rows: (e,) block rows of the upper triangle, column by column.
        corners: (m, 3) vertices of the triangles in ascending position.
        slots: (m, 6) entries in `rows` of the pairs 00, 01, 02, 11, 12, 22 of a triangle's corners.
        diagonal: (n,) the entry of each vertex with itself.
        ahead: (b,) the entry of each outline vertex with the next one.
        factor_starts: (n + 1,) where each column of the factor begins.
        factor_rows: (f,) its block rows.
        reach_starts: (n + 1,) where each row of the factor begins in `reach`.
        reach: (f,) the columns of each row, in the order of elimination.
    """

    position: Index
    starts: Index
    rows: Index
    corners: Index
    slots: Index
    diagonal: Index
    ahead: Index
    factor_starts: Index
    factor_rows: Index
    reach_starts: Index
    reach: Index


def system_of(faces: Index, following: Index, count: int) -> BlockPattern:
    """The pattern for triangles (m, 3) of `count` vertices.

    Args:
        faces: triangles.
        following: (b,) the next outline vertex of each of the first b vertices.
        count: of vertices.
    """
    elimination = minimum_degree(faces, count)
    position = np.empty(count, np.int64)
    position[elimination.order] = np.arange(count)
    corners = np.take_along_axis(faces, np.argsort(position[faces], axis=1), axis=1)
    places = position[corners]
    pairs = [places[:, j] * count + places[:, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    keys, where = np.unique(np.concatenate([*pairs, np.arange(count) * (count + 1)]), return_inverse=True)
    first, second, third, own = np.split(where, np.cumsum([len(faces)] * 3))
    diagonal = own[position]
    slots = np.stack(
        [diagonal[corners[:, 0]], first, second, diagonal[corners[:, 1]], third, diagonal[corners[:, 2]]],
        axis=1,
    )
    ends = position[np.stack([np.arange(following.size), following])]
    ahead = np.searchsorted(keys, ends.max(axis=0) * count + ends.min(axis=0))
    starts = np.searchsorted(keys, np.arange(count + 1) * count)
    rows = keys % count
    return BlockPattern(
        position,
        starts,
        rows,
        np.ascontiguousarray(corners),
        slots,
        diagonal,
        ahead,
        *_factor_pattern(elimination, position),
    )


def _factor_pattern(elimination: Elimination, position: Index) -> tuple[Index, Index, Index, Index]:
    """The last four fields of `BlockPattern`: the factor by columns and by rows, both sorted."""
    n, ends = position.size, elimination.ends
    column, row = np.repeat(np.arange(n), np.diff(ends)), position[elimination.columns]
    reach_starts = np.append(0, np.cumsum(np.bincount(row, minlength=n)))
    return ends, np.sort(column * n + row) % n, reach_starts, np.sort(row * n + column) % n


@kept(**NUMPY, fastmath={"contract", "reassoc"})
def factorise(system, matrix, factor, pivots):
    """Fills in the factor of a matrix; False where the matrix is not positive definite.

    Args:
        system: its pattern.
        matrix: (e, 4) blocks xx, xy, yx, yy of the upper triangle.
        factor: (f, 4) blocks of the unit lower triangle, written.
        pivots: (n, 3) inverses xx, xy, yy of the diagonal blocks, written.
    """
    n = system.starts.size - 1
    column, filled = np.zeros((n, 4)), system.factor_starts[:n].copy()
    for k in range(n):
        last = system.starts[k + 1] - 1  # rows are sorted: the diagonal comes last
        for p in range(system.starts[k], last):
            i = system.rows[p]
            for b in range(4):
                column[i, b] = matrix[p, b]
        xx, xy, yy = matrix[last, 0], matrix[last, 1], matrix[last, 3]
        for r in range(system.reach_starts[k], system.reach_starts[k + 1]):
            c = system.reach[r]
            y0, y1, y2, y3 = column[c, 0], column[c, 1], column[c, 2], column[c, 3]
            column[c, 0] = column[c, 1] = column[c, 2] = column[c, 3] = 0.0
            end = filled[c]
            for p in range(system.factor_starts[c], end):
                i = system.factor_rows[p]
                l0, l1, l2, l3 = factor[p, 0], factor[p, 1], factor[p, 2], factor[p, 3]
                column[i, 0] -= l0 * y0 + l1 * y2
                column[i, 1] -= l0 * y1 + l1 * y3
                column[i, 2] -= l2 * y0 + l3 * y2
                column[i, 3] -= l2 * y1 + l3 * y3
            p0, p1, p2 = pivots[c, 0], pivots[c, 1], pivots[c, 2]
            w0, w1 = p0 * y0 + p1 * y2, p0 * y1 + p1 * y3
            w2, w3 = p1 * y0 + p2 * y2, p1 * y1 + p2 * y3
            factor[end, 0], factor[end, 1], factor[end, 2], factor[end, 3] = w0, w2, w1, w3
            filled[c] = end + 1
            xx -= y0 * w0 + y2 * w2
            xy -= y0 * w1 + y2 * w3
            yy -= y1 * w1 + y3 * w3
        determinant = xx * yy - xy * xy
        if not (xx > 0 and determinant > 0):
            return False
        pivots[k, 0], pivots[k, 1], pivots[k, 2] = yy / determinant, -xy / determinant, xx / determinant
    return True


@kernel
def downhill(system, factor, pivots, gradient):
    """The step -H⁻¹ g (n,) for the factor of H and a gradient (n,), both complex, x + iy of each vertex."""
    n = system.starts.size - 1
    u = np.empty(n, np.complex128)
    for v in range(n):
        u[system.position[v]] = -gradient[v]
    for c in range(n):
        x, y = u[c].real, u[c].imag
        for p in range(system.factor_starts[c], system.factor_starts[c + 1]):
            i = system.factor_rows[p]
            u[i] -= complex(factor[p, 0] * x + factor[p, 1] * y, factor[p, 2] * x + factor[p, 3] * y)
    for c in range(n - 1, -1, -1):
        x, y = u[c].real, u[c].imag
        a, b = pivots[c, 0] * x + pivots[c, 1] * y, pivots[c, 1] * x + pivots[c, 2] * y
        for p in range(system.factor_starts[c], system.factor_starts[c + 1]):
            w = u[system.factor_rows[p]]
            a -= factor[p, 0] * w.real + factor[p, 2] * w.imag
            b -= factor[p, 1] * w.real + factor[p, 3] * w.imag
        u[c] = complex(a, b)
    solution = np.empty(n, np.complex128)
    for v in range(n):
        solution[v] = u[system.position[v]]
    return solution
