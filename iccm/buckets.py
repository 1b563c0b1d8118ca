"""A grid of square buckets over the plane, for fast searches of nearest segments."""

from typing import NamedTuple

import numpy as np

from .arrays import Complex, Index, Real
from .native import function
from .sorting import grouped

CELLS = 2  # buckets per box: each query then tests about six boxes
ENTRIES = 32  # most bucket entries per box, on average: long slanting boxes could fill the memory

_nearest_segments = function(
    """int64_t iccm_maps_nearest_segments(
        const Complex *points, int64_t p, const Complex *start, const Complex *along, double low_x, double low_y,
        double size, int64_t columns, int64_t rows_count, const int64_t *begin, const int64_t *boxes, int64_t *segment,
        double *part)"""
)


class BucketGrid(NamedTuple):
    """Square buckets, and the boxes that overlap each of them.

    Attributes:
        low: lower left corner.
        size: side of a bucket.
        columns, rows: their numbers.
        begin: (columns · rows + 1,) index in `patches` of each bucket's first box, row by row.
        patches: numbers of the boxes.
    """

    low: complex
    size: float
    columns: int
    rows: int
    begin: Index
    patches: Index

    @classmethod
    def of(cls, boxes: Real) -> "BucketGrid":
        """Return the grid for boxes (m, 4): least x, least y, greatest x and greatest y."""
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
    """Return the beginnings and the contents of the buckets.

    Args:
        first: (m, 2) first column and row of each box.
        across: (m, 2) number of columns and rows that it overlaps.
        columns: of the grid.
        rows: of the grid.
    """
    count = across.prod(axis=1)
    patch = np.repeat(np.arange(len(first)), count)
    within = np.arange(patch.size) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, across[patch, 0])
    bucket = (first[patch, 1] + row) * columns + first[patch, 0] + column
    entries, begin = grouped(bucket, columns * rows)
    return begin, patch[entries]


class SegmentGrid:
    """Segments in a grid of buckets, for fast searches of the nearest one.

    Args:
        start: (s,) beginnings of the segments.
        end: (s,) their ends.
    """

    def __init__(self, start: Complex, end: Complex):
        start, end = (np.ascontiguousarray(ends, np.complex128) for ends in (start, end))
        x, y = np.sort([start.real, end.real], axis=0), np.sort([start.imag, end.imag], axis=0)
        self.start, self.along = start, end - start
        self.grid = BucketGrid.of(np.stack([x[0], y[0], x[1], y[1]], axis=1))

    def nearest(self, w: Complex) -> tuple[Index, Real]:
        """Return the nearest segment to each point, and the position of the nearest point on it.

        Args:
            w: (p,) points.

        Returns:
            (p,) segments, the first of several equally near ones, and (p,) positions between 0 and 1. Points that
            are not finite have segment 0.
        """
        w, grid = np.ascontiguousarray(w, np.complex128), self.grid
        segment, part = np.empty(w.size, np.int64), np.empty(w.size)
        _nearest_segments(
            w, w.size, self.start, self.along,
            grid.low.real, grid.low.imag, grid.size, grid.columns, grid.rows, grid.begin, grid.patches,
            segment, part,
        )  # fmt: skip
        return segment, part


def nearest_segments(w: Complex, start: Complex, end: Complex) -> tuple[Index, Real]:
    """Search once among segments, see `SegmentGrid.nearest`."""
    return SegmentGrid(start, end).nearest(w)
