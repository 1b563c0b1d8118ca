"""Sparse Cholesky factors of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.

The multifrontal method (Duff and Reid, *The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations*,
1983; Liu, SIAM Review 1992): what takes time is dense. The vertices are ordered and the pattern of the factor is found
once a mesh (`ordering`, `fronts`), and every Newton step only fills in numbers. A vertex that may move along one
direction only, or not at all, keeps its block: the missing unknown has a one on the diagonal.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Index, Real
from ...jit import NUMPY, kept, kernel
from .fronts import Fronts, fronts_of
from .ordering import minimum_degree

DENSE = NUMPY | {"fastmath": {"contract", "reassoc"}}


class BlockPattern(NamedTuple):
    """The pattern of the matrices of one mesh.

    Attributes:
        position: (n,) row of each vertex in the order of elimination.
        order: (n,) the vertex of each row.
        starts: (n + 1,) where each row of the upper triangle begins in `columns`.
        columns: (e,) its block columns, ascending: the diagonal comes first.
        corners: (m, 3) vertices of the triangles in ascending position.
        slots: (m, 6) entries in `columns` of the pairs 00, 01, 02, 11, 12, 22 of a triangle's corners.
        diagonal: (n,) the entry of each vertex with itself.
        ahead: (b,) the entry of each outline vertex with the next one.
        fronts: of the factor.
    """

    position: Index
    order: Index
    starts: Index
    columns: Index
    corners: Index
    slots: Index
    diagonal: Index
    ahead: Index
    fronts: Fronts


class Factor(NamedTuple):
    """A factor L of a matrix H = L Lᵀ, and room for what makes and applies it.

    Attributes:
        values: (room,) columns of the fronts, and what waits for their parents.
        place: (n,) where the rows of a front are in it.
        waiting: (f,) fronts whose parents have not come yet, a stack.
        sources: (f + 1,) where what each of them has left begins in `values`.
        unknowns: (2n,) of a system that is solved.
        part: (2n,) of those, the ones in a front.
    """

    values: Real
    place: Index
    waiting: Index
    sources: Index
    unknowns: Real
    part: Real

    @classmethod
    def of(cls, system: BlockPattern) -> "Factor":
        """Room for the factors of matrices with a pattern."""
        n, number = system.position.size, system.fronts.parents.size
        place, waiting = np.empty(n, np.int64), np.empty(number, np.int64)
        sources = np.empty(number + 1, np.int64)
        return cls(np.empty(system.fronts.room), place, waiting, sources, *np.empty((2, 2 * n)))


def system_of(faces: Index, following: Index, count: int) -> BlockPattern:
    """The pattern for triangles (m, 3) of `count` vertices.

    Args:
        faces: triangles.
        following: (b,) the next outline vertex of each of the first b vertices.
        count: of vertices.
    """
    order, fronts = fronts_of(minimum_degree(faces, count))
    position = np.empty(count, np.int64)
    position[order] = np.arange(count)
    corners = np.take_along_axis(faces, np.argsort(position[faces], axis=1), axis=1)
    places = position[corners]
    pairs = [places[:, i] * count + places[:, j] for i, j in ((0, 1), (0, 2), (1, 2))]
    keys, where = np.unique(np.concatenate([*pairs, np.arange(count) * (count + 1)]), return_inverse=True)
    first, second, third, own = np.split(where, np.cumsum([len(faces)] * 3))
    diagonal = own[position]
    slots = np.stack(
        [diagonal[corners[:, 0]], first, second, diagonal[corners[:, 1]], third, diagonal[corners[:, 2]]],
        axis=1,
    )
    ends = position[np.stack([np.arange(following.size), following])]
    ahead = np.searchsorted(keys, ends.min(axis=0) * count + ends.max(axis=0))
    starts = np.searchsorted(keys, np.arange(count + 1) * count)
    corners = np.ascontiguousarray(corners)
    return BlockPattern(position, order, starts, keys % count, corners, slots, diagonal, ahead, fronts)


@kernel
def _assemble(system, matrix, front, factor, place, panel, tall):
    """Adds a front's part of the matrix to its columns, and fills in where its rows are."""
    fronts = system.fronts
    first, end = fronts.starts[front], fronts.starts[front + 1]
    for c in range(first, end):
        place[c] = 2 * (c - first)
    at = 2 * (end - first)
    for p in range(fronts.beyond_starts[front], fronts.beyond_starts[front + 1]):
        place[fronts.beyond[p]] = at
        at += 2
    for c in range(first, end):
        column = panel + place[c] * tall
        for p in range(system.starts[c], system.starts[c + 1]):
            slot = column + place[system.columns[p]]
            factor[slot] = matrix[p, 0]
            factor[slot + 1] = matrix[p, 1]
            factor[slot + tall] = matrix[p, 2]
            factor[slot + tall + 1] = matrix[p, 3]


@kernel
def _take_up(fronts, child, factor, place, source, panel, tall, own, update):
    """Adds what a child has left to the columns and the rest of its parent's front."""
    beyond = fronts.beyond[fronts.beyond_starts[child] : fronts.beyond_starts[child + 1]]
    size = 2 * beyond.size
    for p in range(beyond.size):
        column = place[beyond[p]]
        for half in range(2):
            left = factor[source + (2 * p + half) * size : source + (2 * p + half + 1) * size]
            goal = panel + (column + half) * tall
            if column >= own:
                goal = update + (column - own + half) * (tall - own) - own
            for q in range(p, beyond.size):
                row = goal + place[beyond[q]]
                factor[row] += left[2 * q]
                factor[row + 1] += left[2 * q + 1]


@kernel
def _rank_8(factor, at, tall, goal, size, columns, count):
    """Subtracts from the lower triangle of `columns` columns at `goal`, `size` apart, 8 others times themselves."""
    for _ in range(columns):
        x = factor[goal : goal + count]
        a = factor[at : at + count]
        b = factor[at + 1 * tall : at + 1 * tall + count]
        c = factor[at + 2 * tall : at + 2 * tall + count]
        d = factor[at + 3 * tall : at + 3 * tall + count]
        e = factor[at + 4 * tall : at + 4 * tall + count]
        f = factor[at + 5 * tall : at + 5 * tall + count]
        g = factor[at + 6 * tall : at + 6 * tall + count]
        h = factor[at + 7 * tall : at + 7 * tall + count]
        a0, b0, c0, d0, e0, f0, g0, h0 = a[0], b[0], c[0], d[0], e[0], f[0], g[0], h[0]
        for i in range(count):
            x[i] -= (
                a0 * a[i] + b0 * b[i] + c0 * c[i] + d0 * d[i] + e0 * e[i] + f0 * f[i] + g0 * g[i] + h0 * h[i]
            )
        at += 1
        goal += size + 1
        count -= 1


@kernel
def _rank_4(factor, at, tall, goal, size, columns, count):
    """Subtracts from the lower triangle of `columns` columns at `goal`, `size` apart, 4 others times themselves."""
    for _ in range(columns):
        x = factor[goal : goal + count]
        a = factor[at : at + count]
        b = factor[at + 1 * tall : at + 1 * tall + count]
        c = factor[at + 2 * tall : at + 2 * tall + count]
        d = factor[at + 3 * tall : at + 3 * tall + count]
        a0, b0, c0, d0 = a[0], b[0], c[0], d[0]
        for i in range(count):
            x[i] -= a0 * a[i] + b0 * b[i] + c0 * c[i] + d0 * d[i]
        at += 1
        goal += size + 1
        count -= 1


@kernel
def _rank_2(factor, at, tall, goal, size, columns, count):
    """Subtracts from the lower triangle of `columns` columns at `goal`, `size` apart, 2 others times themselves."""
    for _ in range(columns):
        x = factor[goal : goal + count]
        a = factor[at : at + count]
        b = factor[at + 1 * tall : at + 1 * tall + count]
        a0, b0 = a[0], b[0]
        for i in range(count):
            x[i] -= a0 * a[i] + b0 * b[i]
        at += 1
        goal += size + 1
        count -= 1


@kernel
def _eliminated(factor, panel, tall, own, update):
    """Eliminates the `own` columns of a front; False where they are not positive definite."""
    beyond = tall - own
    begin = 0
    while begin < own:
        wide = 8 if own - begin >= 8 else 4 if own - begin >= 4 else 2
        block = panel + begin * tall
        for j in range(wide):
            column = block + j * tall
            x = factor[column + begin + j : column + tall]
            for k in range(j):
                a = factor[block + k * tall + begin + j : block + (k + 1) * tall]
                a0 = a[0]
                for i in range(x.size):
                    x[i] -= a0 * a[i]
            if not x[0] > 0:
                return False
            scale = 1 / np.sqrt(x[0])
            for i in range(x.size):
                x[i] *= scale
        begin += wide
        for row, goal, size, columns in (
            (begin, panel + begin * tall + begin, tall, own - begin),
            (own, update, beyond, beyond),
        ):
            if wide == 8:
                _rank_8(factor, block + row, tall, goal, size, columns, tall - row)
            elif wide == 4:
                _rank_4(factor, block + row, tall, goal, size, columns, tall - row)
            else:
                _rank_2(factor, block + row, tall, goal, size, columns, tall - row)
    return True


@kept(**DENSE)
def factorise(system, matrix, factor):
    """Fills in the factor of a matrix; False where the matrix is not positive definite.

    Args:
        system: its pattern.
        matrix: (e, 4) blocks xx, xy, yx, yy of the upper triangle.
        factor: written.
    """
    fronts, values, place = system.fronts, factor.values, factor.place
    waiting, sources, top = factor.waiting, factor.sources, 0
    number = fronts.parents.size
    sources[0] = fronts.panels[number]
    for front in range(number):
        own = 2 * (fronts.starts[front + 1] - fronts.starts[front])
        beyond = 2 * (fronts.beyond_starts[front + 1] - fronts.beyond_starts[front])
        panel, tall = fronts.panels[front], own + beyond
        update = sources[top]
        values[panel : panel + own * tall] = 0.0
        values[update : update + beyond * beyond] = 0.0
        _assemble(system, matrix, front, values, place, panel, tall)
        while top > 0 and fronts.parents[waiting[top - 1]] == front:
            top -= 1
            _take_up(fronts, waiting[top], values, place, sources[top], panel, tall, own, update)
        if not _eliminated(values, panel, tall, own, update):
            return False
        goal = sources[top]
        if goal < update:
            goals, left = values[goal : goal + beyond * beyond], values[update : update + beyond * beyond]
            for i in range(beyond * beyond):
                goals[i] = left[i]
        if beyond > 0:
            waiting[top] = front
            top += 1
            sources[top] = goal + beyond * beyond
    return True


@kept(**DENSE)
def downhill(system, factor, gradient, step):
    """Fills in the step -H⁻¹ g (n,) for the factor of H and a gradient (n,), both complex, x + iy of each vertex."""
    fronts, n = system.fronts, system.position.size
    u, part, values = factor.unknowns, factor.part, factor.values
    for v in range(n):
        at = 2 * system.position[v]
        u[at], u[at + 1] = -gradient[v].real, -gradient[v].imag
    for front in range(fronts.parents.size):
        first, own = 2 * fronts.starts[front], 2 * (fronts.starts[front + 1] - fronts.starts[front])
        beyond = fronts.beyond[fronts.beyond_starts[front] : fronts.beyond_starts[front + 1]]
        tall, at = own + 2 * beyond.size, fronts.panels[front]
        for i in range(tall):
            part[i] = u[first + i] if i < own else 0.0
        for j in range(own):
            part[j] /= values[at]
            s, later = part[j], part[j + 1 : tall]
            column = values[at + 1 : at + tall - j]
            for i in range(later.size):
                later[i] -= s * column[i]
            u[first + j] = s
            at += tall + 1
        for p in range(beyond.size):
            u[2 * beyond[p]] += part[own + 2 * p]
            u[2 * beyond[p] + 1] += part[own + 2 * p + 1]
    for front in range(fronts.parents.size - 1, -1, -1):
        first, own = 2 * fronts.starts[front], 2 * (fronts.starts[front + 1] - fronts.starts[front])
        beyond = fronts.beyond[fronts.beyond_starts[front] : fronts.beyond_starts[front + 1]]
        tall, at = own + 2 * beyond.size, fronts.panels[front + 1]
        for p in range(beyond.size):
            part[own + 2 * p], part[own + 2 * p + 1] = u[2 * beyond[p]], u[2 * beyond[p] + 1]
        for j in range(own - 1, -1, -1):
            s, later, column = u[first + j], part[j + 1 : tall], values[at - (tall - j - 1) : at]
            for i in range(later.size):
                s -= later[i] * column[i]
            part[j] = s / values[at - (tall - j)]
            u[first + j] = part[j]
            at -= tall
    for v in range(n):
        at = 2 * system.position[v]
        step[v] = complex(u[at], u[at + 1])
