"""Square buckets over a plane, so that what is near a point is found without a look at all there is."""

from typing import NamedTuple

import numpy as np

from .arrays import Complex, Index, Real
from .jit import kernel

CELLS = 2  # buckets for a box: a point then looks at about six boxes
ENTRIES = 32  # of the buckets for a box at most: long slanting ones would fill the memory


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
    x, y = np.sort([start.real, end.real], axis=0), np.sort([start.imag, end.imag], axis=0)
    grid = BucketGrid.of(np.stack([x[0], y[0], x[1], y[1]], axis=1))
    segment, part = np.zeros(w.size, np.int64), np.zeros(w.size)
    _nearest(np.ascontiguousarray(w, np.complex128), start, end - start, grid, segment, part)
    return segment, part


@kernel
def _nearest(w, start, along, grid, segment, part):
    """Rings of buckets around each point, until none that is left can hold anything nearer."""
    for n in range(w.size):
        place = w[n] - grid.low
        x, y = place.real / grid.size, place.imag / grid.size
        if not abs(x) + abs(y) < np.inf:
            continue
        column = int(min(max(x, 0.0), grid.columns - 1.0))
        row = int(min(max(y, 0.0), grid.rows - 1.0))
        # a point outside the grid is at least this far from it, beside what the rings so far reach
        beside_x, beside_y = max(-x, x - grid.columns, 0.0), max(-y, y - grid.rows, 0.0)
        beside, cell = beside_x * beside_x + beside_y * beside_y, grid.size * grid.size
        best, ring, most, within = np.inf, 0, max(grid.columns, grid.rows), 0.0
        while ring <= most and not best <= (beside + within) * cell:
            for r in range(max(row - ring, 0), min(row + ring + 1, grid.rows)):
                # the first and the last row of a ring whole, of the others the two ends
                step = 1 if abs(r - row) == ring else 2 * ring
                for c in range(column - ring, column + ring + 1, step):
                    if not 0 <= c < grid.columns:
                        continue
                    bucket = r * grid.columns + c
                    for b in range(grid.begin[bucket], grid.begin[bucket + 1]):
                        s = grid.patches[b]
                        d, off = along[s], w[n] - start[s]
                        length = d.real * d.real + d.imag * d.imag
                        t = d.real * off.real + d.imag * off.imag
                        t = min(t / length, 1.0) if t > 0 else 0.0
                        x_away, y_away = off.real - t * d.real, off.imag - t * d.imag
                        squared = x_away * x_away + y_away * y_away
                        if squared < best or (squared == best and s < segment[n]):
                            best, segment[n], part[n] = squared, s, t
            within = float(ring * ring)
            ring += 1
