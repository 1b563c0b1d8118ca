"""Square buckets over a plane, so that what is near a point is found without a look at all there is."""

from typing import NamedTuple

import numpy as np

from .arrays import Complex, Index, Real
from .native import function

CELLS = 2  # buckets for a box: a point then looks at about six boxes
ENTRIES = 32  # of the buckets for a box at most: long slanting ones would fill the memory

_nearest_segments = function(
    """int64_t iccm_maps_nearest_segments(
        const Complex *points, int64_t p, const Complex *start, const Complex *along, double low_x, double low_y,
        double size, int64_t columns, int64_t rows_count, const int64_t *begin, const int64_t *boxes, int64_t *segment,
        double *part)"""
)


class BucketGrid(NamedTuple):
    """Square buckets, and the boxes that each touches.

    Attributes:
        low: lower left corner.
        size: of a bucket.
        columns, rows: how many there are.
        begin: (columns · rows + 1,) where each bucket's boxes begin, row by row.
        patches: their numbers.
    """

    low: complex
    size: float
    columns: int
    rows: int
    begin: Index
    patches: Index

    @classmethod
    def of(cls, boxes: Real) -> "BucketGrid":
        """For boxes (m, 4), least x, least y, greatest x and greatest y."""
        low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
        count = len(boxes)
        size = max(
            float(np.sqrt(np.prod(high - low) / (CELLS * count))), float((high - low).max()) / 4096, 1e-300
        )
        while True:
            first = np.floor((boxes[:, :2] - low) / size).astype(np.int64)
            across = np.floor((boxes[:, 2:] - low) / size).astype(np.int64) - first + 1
            if across.prod(axis=1).sum() <= ENTRIES * count:
                break
            size *= 2
        columns, rows = (int(n) for n in np.floor((high - low) / size).astype(np.int64) + 1)
        return cls(complex(*low), size, columns, rows, *_buckets(first, across, columns, rows))


def _buckets(first: Index, across: Index, columns: int, rows: int) -> tuple[Index, Index]:
    """Begins and contents of the buckets, given (m, 2) each box's first column and row, and how many it touches."""
    count = across.prod(axis=1)
    patch = np.repeat(np.arange(len(first)), count)
    within = np.arange(patch.size) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, across[patch, 0])
    bucket = (first[patch, 1] + row) * columns + first[patch, 0] + column
    begin = np.concatenate([[0], np.cumsum(np.bincount(bucket, minlength=columns * rows))])
    return begin, patch[np.argsort(bucket, kind="stable")]


def nearest_segments(w: Complex, start: Complex, end: Complex) -> tuple[Index, Real]:
    """For points (p,), the nearest of segments (s,), the first of equals, and how far along it the nearest point lies,
    in [0, 1]. Points that are not finite have the first one."""
    w, start, end = (np.ascontiguousarray(given, np.complex128) for given in (w, start, end))
    x, y = np.sort([start.real, end.real], axis=0), np.sort([start.imag, end.imag], axis=0)
    grid = BucketGrid.of(np.stack([x[0], y[0], x[1], y[1]], axis=1))
    segment, part = np.empty(w.size, np.int64), np.empty(w.size)
    _nearest_segments(
        w, w.size, start, end - start,
        grid.low.real, grid.low.imag, grid.size, grid.columns, grid.rows, grid.begin, grid.patches,
        segment, part,
    )  # fmt: skip
    return segment, part
