"""The dense blocks of a sparse Cholesky factor.

Consecutive columns with nearly the same rows are merged into one *front*, a dense trapezoid: a relaxed
supernode (Ashcraft and Grimes, *The Influence of Relaxed Supernode Partitions on the Multifrontal Method*, ACM
Transactions on Mathematical Software 15, 1989). It stores some zeros, which costs no more than skipping them.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Index
from ..native import function
from .ordering import Elimination

LEAST_FRONT_VERTICES = 4
"""Least number of vertices of a front, if it has an adjacent child to merge; values from 2 to 8 take the same
time.
"""
MOST_ZEROS_SHARE = 0.2  # largest share of zeros in a front; the time for 0.1 to 0.4 differs by less than 5 %

_supernodes = function(
    """int64_t iccm_linalg_supernodes(
        const int64_t *parents, const int64_t *counts, int64_t *size, int64_t *free, int64_t *old, int64_t *zeros,
        int64_t *place, int64_t *starts, int64_t *last, int64_t n, int64_t few, double share)"""
)


class Fronts(NamedTuple):
    """The fronts of one mesh's matrices in the order of elimination, children before parents.

    Attributes:
        starts: (f + 1,) the first vertex of each, in the order of elimination.
        beyond_starts: (f + 1,) where each begins in `beyond`.
        beyond: later vertices to which each is coupled, ascending.
        parents: (f,) the front to which each adds its update; f if there is none.
        panels: (f + 1,) where the columns of each begin in the factor: 2 (k + b) + 1 rows of 2 k columns.
        room: number of entries of the factor, including updates that wait for parents.
    """

    starts: Index
    beyond_starts: Index
    beyond: Index
    parents: Index
    panels: Index
    room: int


def fronts_of(elimination: Elimination) -> tuple[Index, Fronts]:
    """Return an order of elimination (n,) with the same factor, in which fronts are contiguous, and the fronts."""
    n, ends = elimination.order.size, elimination.ends
    counts, rows = np.diff(ends), np.empty(elimination.order.size, np.int64)
    rows[elimination.order] = np.arange(n)
    rows = rows[elimination.columns]
    parents = np.full(n, n)
    parents[counts > 0] = np.minimum.reduceat(rows, ends[:-1][counts > 0])
    place, starts, last = np.empty(n, np.int64), np.empty(n + 1, np.int64), np.empty(n, np.int64)
    size, free = np.ones(n + 1, np.int64), np.full(n + 1, n)
    old, zeros = np.empty(n, np.int64), np.empty(n, np.int64)
    number = _supernodes(
        parents,
        counts,
        size,
        free,
        old,
        zeros,
        place,
        starts,
        last,
        n,
        LEAST_FRONT_VERTICES,
        MOST_ZEROS_SHARE,
    )
    starts, last = starts[: number + 1], last[:number]
    wide = counts[last]
    beyond_starts = np.append(0, np.cumsum(wide))
    front = np.repeat(np.arange(number), wide)
    entries = ends[last][front] + np.arange(front.size) - beyond_starts[front]
    beyond = np.sort(front * n + place[rows[entries]]) % n
    above = np.full(number, number)
    above[wide > 0] = np.searchsorted(starts, beyond[beyond_starts[:-1][wide > 0]], side="right") - 1
    columns = np.diff(starts)
    panels = np.append(0, np.cumsum(2 * columns * (2 * (columns + wide) + 1)))
    order = np.empty(n, np.int64)
    order[place] = elimination.order
    return order, Fronts(
        starts, beyond_starts, beyond, above, panels, int(panels[-1]) + _waiting(wide, above)
    )


def _waiting(wide: Index, parents: Index) -> int:
    """Return the largest number of entries that wait for parents, including those of the current front."""
    squares = (2 * wide + 1) ** 2
    used = np.bincount(parents, squares, wide.size + 1)[:-1].astype(np.int64)
    waiting = np.append(0, np.cumsum(squares - used))[:-1]
    return int((waiting + squares).max())
