"""Stable orders of small integers, such as the numbers of vertices, in linear time.

NumPy sorts integers of 64 bits by comparison: a million triangles' corners take ten times as long.
"""

import numpy as np

from .arrays import Index
from .native import function

_order = function("int64_t iccm_maps_order(const int64_t *keys, int64_t n, int64_t bound, int64_t *order)")
_order_pairs = function(
    """int64_t iccm_maps_order_pairs(
        const int64_t *first, const int64_t *second, int64_t n, int64_t bound, int64_t *order)"""
)


def counting_order(keys: Index, bound: int) -> Index:
    """Return the stable order (n,) of numbers (n,) from 0 to below `bound`, which should not be much above n."""
    keys, order = np.ascontiguousarray(keys, np.int64), np.empty(keys.size, np.int64)
    _order(keys, keys.size, bound, order)
    return order


def counting_order_of_pairs(first: Index, second: Index, bound: int) -> Index:
    """Return the stable order (n,) of pairs of such numbers, by the first, then by the second."""
    first, second = np.ascontiguousarray(first, np.int64), np.ascontiguousarray(second, np.int64)
    order = np.empty(first.size, np.int64)
    _order_pairs(first, second, first.size, bound, order)
    return order


def grouped(keys: Index, bound: int) -> tuple[Index, Index]:
    """Group the indices of numbers (n,) from 0 to below `bound` by the number.

    Returns:
        (n,) the indices, in order within each group, and (bound + 1,) where the group of each number begins: that of
        k is indices[starts[k] : starts[k + 1]].

    >>> indices, starts = grouped(np.array([2, 0, 2]), 3)
    >>> indices.tolist(), starts.tolist()
    ([1, 0, 2], [0, 1, 1, 3])
    """
    return counting_order(keys, bound), np.append(0, np.cumsum(np.bincount(keys, minlength=bound)))
