"""Sparse Cholesky factors of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.

The multifrontal method (Duff and Reid, *The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations*,
1983; Liu, SIAM Review 1992): what takes time is dense. The vertices are ordered and the pattern of the factor is found
once a mesh (`ordering`, `fronts`), and every Newton step only fills in numbers. A vertex that may move along one
direction only, or not at all, keeps its block: the missing unknown has a one on the diagonal.

Of [[H, g], [gᵀ, ·]] the factor's last row is (L⁻¹ g)ᵀ: with it as one more row of every front, half of solving is done.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Index, Real
from ..jit import NUMPY, in_place, kept
from .fronts import Fronts, fronts_of
from .ordering import minimum_degree

DENSE = NUMPY | {"_nrt": False}
"""No `fastmath`: sums in an order of the processor's would lead some partial maps elsewhere, and save no time."""


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
    """A factor L of a matrix H = L Lᵀ and L⁻¹ g, and room for what makes and applies them.

    Attributes:
        values: (room,) columns of the fronts, and what waits for their parents.
        place: (n,) where the rows of a front are in it.
        waiting: (f,) fronts whose parents have not come yet, a stack.
        sources: (f + 1,) where what each of them has left begins in `values`.
        part: (2n + 1,) the rows of a front in a solution.
        left: (2n,) of a gradient, while it is eliminated.
    """

    values: Real
    place: Index
    waiting: Index
    sources: Index
    part: Real
    left: Real

    @classmethod
    def of(cls, system: BlockPattern) -> "Factor":
        """Room for the factors of matrices with a pattern."""
        n, number = system.position.size, system.fronts.parents.size
        place, waiting, sources = (np.empty(size, np.int64) for size in (n, number, number + 1))
        part, left = np.empty(2 * n + 1), np.empty(2 * n)
        return cls(np.empty(system.fronts.room), place, waiting, sources, part, left)


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
    places = np.sort(position[faces], axis=1)
    corners = order[places]
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
    return BlockPattern(position, order, starts, keys % count, corners, slots, diagonal, ahead, fronts)


@in_place
def _assemble(system, matrix, gradient, front, values, place, panel, tall):
    """Adds a front's part of the matrix and of the gradient to its columns, and fills in where its rows are."""
    fronts = system.fronts
    first, end = fronts.starts[front], fronts.starts[front + 1]
    for c in range(first, end):
        place[c] = 2 * (c - first)
    at = 2 * (end - first)
    for p in range(fronts.beyond_starts[front], fronts.beyond_starts[front + 1]):
        place[fronts.beyond[p]] = at
        at += 2
    for c in range(first, end):
        column, g = panel + place[c] * tall, gradient[system.order[c]]
        for p in range(system.starts[c], system.starts[c + 1]):
            slot = column + place[system.columns[p]]
            values[slot] = matrix[p, 0]
            values[slot + 1] = matrix[p, 1]
            values[slot + tall] = matrix[p, 2]
            values[slot + tall + 1] = matrix[p, 3]
        values[column + tall - 1], values[column + 2 * tall - 1] = g.real, g.imag


@in_place
def _extend_add(fronts, child, values, place, source, panel, tall, own, update):
    """Adds what a child has left to the columns and the rest of its parent's front."""
    beyond = fronts.beyond[fronts.beyond_starts[child] : fronts.beyond_starts[child + 1]]
    size = 2 * beyond.size + 1
    for p in range(beyond.size):
        column = place[beyond[p]]
        for half in range(2):
            left = values[source + (2 * p + half) * size : source + (2 * p + half + 1) * size]
            goal = panel + (column + half) * tall
            if column >= own:
                goal = update + (column - own + half) * (tall - own) - own
            for q in range(p, beyond.size):
                row = goal + place[beyond[q]]
                values[row] += left[2 * q]
                values[row + 1] += left[2 * q + 1]
            values[goal + tall - 1] += left[size - 1]


@in_place
def _column(panel, tall, own, update, c):
    """Where the diagonal entry of a front's column c is: among its own ones, or in what it leaves to its parent."""
    return panel + c * (tall + 1) if c < own else update + (c - own) * (tall - own + 1)


@in_place
def _rank_8(values, block, begin, panel, tall, own, update):
    """Subtracts from the lower triangle of all columns from `begin` on the eight at `block` times themselves."""
    for c in range(begin, tall - 1):
        goal, at, count = _column(panel, tall, own, update, c), block + c, tall - c
        x = values[goal : goal + count]
        a = values[at : at + count]
        b = values[at + 1 * tall : at + 1 * tall + count]
        c_ = values[at + 2 * tall : at + 2 * tall + count]
        d = values[at + 3 * tall : at + 3 * tall + count]
        e = values[at + 4 * tall : at + 4 * tall + count]
        f = values[at + 5 * tall : at + 5 * tall + count]
        g = values[at + 6 * tall : at + 6 * tall + count]
        h = values[at + 7 * tall : at + 7 * tall + count]
        a0, b0, c0, d0, e0, f0, g0, h0 = a[0], b[0], c_[0], d[0], e[0], f[0], g[0], h[0]
        for i in range(count):
            x[i] -= (
                a0 * a[i] + b0 * b[i] + c0 * c_[i] + d0 * d[i] + e0 * e[i] + f0 * f[i] + g0 * g[i] + h0 * h[i]
            )


@in_place
def _rank_2(values, block, begin, panel, tall, own, update):
    """As `_rank_8`, two of them; four by themselves take as long as twice two."""
    for c in range(begin, tall - 1):
        goal, at, count = _column(panel, tall, own, update, c), block + c, tall - c
        x = values[goal : goal + count]
        a = values[at : at + count]
        b = values[at + tall : at + tall + count]
        a0, b0 = a[0], b[0]
        for i in range(count):
            x[i] -= a0 * a[i] + b0 * b[i]


@in_place
def _eliminate(values, panel, tall, own, update):
    """Eliminates the `own` columns of a front; False where they are not positive definite."""
    begin = 0
    while begin < own:
        wide = 8 if own - begin >= 8 else 2
        block = panel + begin * tall
        for j in range(wide):
            column = block + j * tall
            x = values[column + begin + j : column + tall]
            for k in range(j):
                a = values[block + k * tall + begin + j : block + (k + 1) * tall]
                a0 = a[0]
                for i in range(x.size):
                    x[i] -= a0 * a[i]
            if not x[0] > 0:
                return False
            scale = 1 / np.sqrt(x[0])
            for i in range(x.size):
                x[i] *= scale
        begin += wide
        if wide == 8:
            _rank_8(values, block, begin, panel, tall, own, update)
        else:
            _rank_2(values, block, begin, panel, tall, own, update)
    return True


@kept(**DENSE)
def factorise(system, matrix, gradient, factor):
    """Fills in the factor of a matrix and what `downhill` needs of a gradient; False where the matrix is not positive
    definite.

    Args:
        system: its pattern.
        matrix: (e, 4) blocks xx, xy, yx, yy of the upper triangle.
        gradient: (n,) complex, x + iy of each vertex.
        factor: written.
    """
    fronts, values, place = system.fronts, factor.values, factor.place
    waiting, sources, top = factor.waiting, factor.sources, 0
    number = fronts.parents.size
    sources[0] = fronts.panels[number]
    for front in range(number):
        own = 2 * (fronts.starts[front + 1] - fronts.starts[front])
        rest = 2 * (fronts.beyond_starts[front + 1] - fronts.beyond_starts[front]) + 1
        panel, tall = fronts.panels[front], own + rest
        update = sources[top]
        values[panel : panel + own * tall] = 0.0
        values[update : update + rest * rest] = 0.0
        _assemble(system, matrix, gradient, front, values, place, panel, tall)
        # in postorder the updates of a front's children are on top of the stack
        while top > 0 and fronts.parents[waiting[top - 1]] == front:
            top -= 1
            _extend_add(fronts, waiting[top], values, place, sources[top], panel, tall, own, update)
        if not _eliminate(values, panel, tall, own, update):
            return False
        goal = sources[top]
        # its own moves down over those that are taken up
        if goal < update:
            goals, left = values[goal : goal + rest * rest], values[update : update + rest * rest]
            for i in range(rest * rest):
                goals[i] = left[i]
        if rest > 1:
            waiting[top] = front
            top += 1
            sources[top] = goal + rest * rest
    return True


@kept(**DENSE)
def eliminate_again(system, gradient, factor):
    """Puts another gradient g (n,) in the place of the one that was factorised with H: L⁻¹ g."""
    fronts, values, left = system.fronts, factor.values, factor.left
    for row in range(system.order.size):
        g = gradient[system.order[row]]
        left[2 * row], left[2 * row + 1] = g.real, g.imag
    for front in range(fronts.parents.size):
        first, end = fronts.starts[front], fronts.starts[front + 1]
        own, beyond = (
            2 * (end - first),
            fronts.beyond[fronts.beyond_starts[front] : fronts.beyond_starts[front + 1]],
        )
        tall, at = own + 2 * beyond.size + 1, fronts.panels[front]
        for j in range(own):
            column = at + j * tall
            found = left[2 * first + j] / values[column + j]
            values[column + tall - 1] = found
            for i in range(j + 1, own):
                left[2 * first + i] -= values[column + i] * found
            for p in range(beyond.size):
                row = column + own + 2 * p
                left[2 * beyond[p]] -= values[row] * found
                left[2 * beyond[p] + 1] -= values[row + 1] * found


@kept(**DENSE)
def downhill(system, factor, step):
    """Fills in the step -H⁻¹ g (n,), complex, for the factor of H and g: the x with Lᵀ x + L⁻¹ g = 0."""
    fronts, part, values = system.fronts, factor.part, factor.values
    for front in range(fronts.parents.size - 1, -1, -1):
        first, end = fronts.starts[front], fronts.starts[front + 1]
        own, at = 2 * (end - first), fronts.panels[front + 1]
        tall = own
        for p in range(fronts.beyond_starts[front], fronts.beyond_starts[front + 1]):
            found = step[system.order[fronts.beyond[p]]]
            part[tall], part[tall + 1] = found.real, found.imag
            tall += 2
        part[tall] = 1.0  # for the row of L⁻¹ g
        tall += 1
        for j in range(own - 1, -1, -1):
            later, column = part[j + 1 : tall], values[at + j + 1 - tall : at]
            s = 0.0
            for i in range(later.size):
                s -= later[i] * column[i]
            part[j] = s / values[at + j - tall]
            at -= tall
        for c in range(first, end):
            step[system.order[c]] = complex(part[2 * (c - first)], part[2 * (c - first) + 1])
