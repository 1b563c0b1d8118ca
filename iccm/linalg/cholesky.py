"""Sparse Cholesky factors of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.

The multifrontal method (Duff and Reid, *The Multifrontal Solution of Indefinite Sparse Symmetric Linear
Equations*, 1983; Liu, SIAM Review 1992) does nearly all work on dense blocks. The vertices are ordered and the
pattern of the factor is computed once per mesh (`ordering`, `fronts`); each Newton step only fills in numbers.
A vertex that may move in one direction only, or not at all, keeps its block: the missing unknown has a one on
the diagonal.

The last row of the factor of [[H, g], [gᵀ, ·]] is (L⁻¹ g)ᵀ. With it as an additional row of every front, the
factorisation also does the forward substitution.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Complex, Index, Real
from ..native import Record, function, record
from ..sorting import counting_order_of_pairs
from .fronts import Fronts, fronts_of
from .ordering import minimum_degree

FrontsRecord = record(
    """struct Fronts {
        const int64_t *starts; const int64_t *beyond_starts; const int64_t *beyond; const int64_t *parents;
        const int64_t *panels; int64_t count; }"""
)
BlockPatternRecord = record(
    """struct BlockPattern {
        const int64_t *order; const int64_t *starts; const int64_t *columns; const int64_t *diagonal;
        const int64_t *ahead; int64_t n; int64_t e; Fronts fronts; }"""
)
FactorRecord = record(
    """struct Factor {
        double *values; int64_t *place; int64_t *waiting; int64_t *sources; double *part; double *left; }"""
)
_factorise = function(
    """int64_t iccm_linalg_factorise(
        const BlockPattern *pattern, const double *matrix, const Complex *gradient, Factor *factor)"""
)
_forward_substitute = function(
    "int64_t iccm_linalg_forward_substitute(const BlockPattern *pattern, const Complex *gradient, Factor *factor)"
)
_back_substitute = function(
    "int64_t iccm_linalg_back_substitute(const BlockPattern *pattern, Factor *factor, Complex *step)"
)


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """The pattern of the matrices of one mesh.

    Attributes:
        position: (n,) row of each vertex in the order of elimination.
        order: (n,) the vertex of each row.
        starts: (n + 1,) index in `columns` of the first entry of each row of the upper triangle.
        columns: (e,) its block columns, ascending, starting with the diagonal.
        corners: (m, 3) vertices of the triangles in ascending position.
        slots: (m, 6) entries in `columns` of the pairs 00, 01, 02, 11, 12, 22 of a triangle's corners.
        diagonal: (n,) the entry of each vertex with itself.
        ahead: (b,) the entry of each boundary vertex with the next one.
        fronts: the fronts of the factor.
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

    def entries(self, tails: Index, heads: Index) -> Index:
        """Return the entries in `columns` of pairs (k,) of vertices, in either order.

        Raises:
            ValueError: a pair has no block.
        """
        n = self.position.size
        keys = np.repeat(np.arange(n), np.diff(self.starts)) * n + self.columns
        ends = np.sort([self.position[tails], self.position[heads]], axis=0)
        pair_keys = ends[0] * n + ends[1]
        entries = np.searchsorted(keys, pair_keys)
        if not np.array_equal(keys.take(entries, mode="clip"), pair_keys):
            raise ValueError("pairs of vertices without a block: the pattern belongs to other stencils")
        return entries

    @cached_property
    def record(self) -> Record:
        """The struct that is passed to the core."""
        fronts = self.fronts
        dense = FrontsRecord(
            fronts.starts,
            fronts.beyond_starts,
            fronts.beyond,
            fronts.parents,
            fronts.panels,
            fronts.parents.size,
        )
        return BlockPatternRecord(
            self.order,
            self.starts,
            self.columns,
            self.diagonal,
            self.ahead,
            self.order.size,
            self.columns.size,
            dense,
        )


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor L of a matrix H = L Lᵀ, the vector L⁻¹ g, and work arrays.

    Attributes:
        values: (room,) columns of the fronts, and updates for their parents.
        place: (n,) position of each row in the current front.
        waiting: (f,) stack of fronts whose parents have not been processed.
        sources: (f + 1,) where the update of each of them begins in `values`.
        part: (2n + 1,) the rows of a front in a solution.
        left: (2n,) a gradient during its elimination.
    """

    values: Real
    place: Index
    waiting: Index
    sources: Index
    part: Real
    left: Real

    @cached_property
    def record(self) -> Record:
        """The struct that is passed to the core."""
        return FactorRecord(self.values, self.place, self.waiting, self.sources, self.part, self.left)

    @classmethod
    def of(cls, system: BlockPattern) -> "Factor":
        """Allocate a factor for matrices with a pattern."""
        n, number = system.position.size, system.fronts.parents.size
        place, waiting, sources = (np.empty(size, np.int64) for size in (n, number, number + 1))
        part, left = np.empty(2 * n + 1), np.empty(2 * n)
        return cls(np.empty(system.fronts.room), place, waiting, sources, part, left)


def system_of(faces: Index, following: Index, count: int, stencils: Sequence[Index] = ()) -> BlockPattern:
    """Return the pattern for triangles (m, 3) of `count` vertices.

    Args:
        faces: triangles.
        following: (b,) the next vertex, on the boundary, of each of the first b vertices.
        count: number of vertices.
        stencils: (k, s) further sets of vertices for all pairs of which there are blocks.
    """
    stencil_pairs = _pairs_of(stencils)
    cliques = (
        np.concatenate([faces, np.column_stack([stencil_pairs, stencil_pairs[:, 1]])])
        if len(stencil_pairs)
        else faces
    )
    order, fronts = fronts_of(minimum_degree(cliques, count))
    position = np.empty(count, np.int64)
    position[order] = np.arange(count)
    places = np.sort(position[faces], axis=1)
    corners = order[places]
    ends, every = np.sort(position[stencil_pairs], axis=1), np.arange(count)
    rows = np.concatenate([places[:, 0], places[:, 0], places[:, 1], every, ends[:, 0]])
    columns = np.concatenate([places[:, 1], places[:, 2], places[:, 2], every, ends[:, 1]])
    by_entry = counting_order_of_pairs(rows, columns, count)
    keys = rows[by_entry] * count + columns[by_entry]
    is_new = np.append(True, keys[1:] != keys[:-1])
    where = np.empty(rows.size, np.int64)
    where[by_entry] = np.cumsum(is_new) - 1
    keys = keys[is_new]
    first, second, third, diagonal_entries = np.split(where, np.cumsum([len(faces)] * 3))
    diagonal = diagonal_entries[position]
    slots = np.stack(
        [diagonal[corners[:, 0]], first, second, diagonal[corners[:, 1]], third, diagonal[corners[:, 2]]],
        axis=1,
    )
    ends = position[np.stack([np.arange(following.size), following])]
    ahead = np.searchsorted(keys, ends.min(axis=0) * count + ends.max(axis=0))
    starts = np.searchsorted(keys, np.arange(count + 1) * count)
    return BlockPattern(position, order, starts, keys % count, corners, slots, diagonal, ahead, fronts)


def _pairs_of(stencils: Sequence[Index]) -> Index:
    """Return (p, 2) all pairs of distinct vertices of stencils (k, s)."""
    if not stencils:
        return np.empty((0, 2), np.int64)
    pairs = [np.empty((0, 2), np.int64)]
    for vertices in stencils:
        tails, heads = np.triu_indices(vertices.shape[1], 1)
        pairs.append(np.column_stack([vertices[:, tails].ravel(), vertices[:, heads].ravel()]))
    unique_pairs = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    return unique_pairs[unique_pairs[:, 0] < unique_pairs[:, 1]]


def factorise(pattern: BlockPattern, matrix: Real, gradient: Complex, factor: Factor) -> bool:
    """Factorise a matrix, and do the forward substitution for a gradient.

    Args:
        pattern: of the matrix.
        matrix: (e, 4) blocks xx, xy, yx, yy of the upper triangle.
        gradient: (n,) complex, x + iy for each vertex.
        factor: written.

    Returns:
        False if the matrix is not positive definite.
    """
    return bool(_factorise(pattern.record, matrix, gradient, factor.record))


def forward_substitute(pattern: BlockPattern, gradient: Complex, factor: Factor) -> None:
    """Replace L⁻¹ g in the factor by that of another gradient g (n,)."""
    _forward_substitute(pattern.record, gradient, factor.record)


def back_substitute(pattern: BlockPattern, factor: Factor, step: Complex) -> None:
    """Fill in the step -H⁻¹ g (n,), complex, for the factor of H and L⁻¹ g."""
    _back_substitute(pattern.record, factor.record, step)
