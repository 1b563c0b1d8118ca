"""Exact coverage of pixels by a closed polyline, row band by row band, in double precision."""

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from ..jit import kernel

NOTHING = 1e-6
"""Area of a pixel that round-off may leave or take, by hand: far above round-off, far below a byte."""


def coverage(loop: Complex, row: int, rows: int, width: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """How much of each pixel a closed polyline covers, and which pixel centres it surrounds.

    Args:
        loop: (k,) points in pixel units, x right, *y down*, pixel (i, j) being the square [j, j+1] × [i, i+1].
        row, rows: the band of rows [row, row + rows).
        width: pixels a row.

    Returns:
        (rows, width) covered area in [0, 1] (winding numbers add up and are clipped), and (rows, width) whether the
        winding number of the centre is not zero. Both ignore the loop's direction.
    """
    inside = np.empty((rows, width), dtype=np.bool_)
    return _coverage(loop, row, rows, width, inside), inside


def coverage_box(loop: Complex, row: int, rows: int, width: int) -> NDArray[np.float32]:
    """The first that `coverage` gives."""
    return _coverage(loop, row, rows, width, np.empty((0, width), dtype=np.bool_))


def _coverage(
    loop: Complex, row: int, rows: int, width: int, inside: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """The covered area; fills in `inside`, unless it has no rows."""
    start = loop - 1j * row
    end = np.roll(start, -1)
    falls = start.imag > end.imag
    low, high = np.where(falls, end, start), np.where(falls, start, end)
    near = (high.imag > 0) & (low.imag < rows) & (low.imag < high.imag)
    out = np.empty((rows, width), dtype=np.float32)
    sign = np.where(falls[near], -1.0, 1.0)
    _cover(low[near], high[near], sign, np.zeros(width + 2), np.zeros(width + 1, np.int64), out, inside)
    return out


@kernel
def _cover(low, high, sign, area, turns, out, inside):
    """Fills in both, row by row, so that what is added up stays in the processor's cache.

    Args:
        low, high: (s,) lower and upper ends of the segments, *y down*.
        sign: (s,) 1, or -1 where a segment runs from its upper end to the lower.
        area: (width + 2,) zeros; differences along a row of the signed area.
        turns: (width + 1,) zeros; and of the winding number of the pixels' centres.
        out, inside: (rows, width), written; `inside` may have no rows.
    """
    width, whether = out.shape[1], inside.shape[0] > 0
    for i in range(out.shape[0]):
        for s in range(low.size):
            if high[s].imag >= i and low[s].imag < i + 1:
                _add(low[s], high[s], sign[s], i, area, turns, width)
        total, turn, value = 0.0, 0, 0.0
        for j in range(width):
            if area[j] != 0 or turns[j] != 0:
                total += area[j]
                turn += turns[j]
                area[j], turns[j] = 0.0, 0
                value = abs(total)  # what is round-off from nothing or from all becomes 0 or 1
                value = 0.0 if value < NOTHING else (1.0 if value > 1 - NOTHING else value)
            out[i, j] = value
            if whether:
                inside[i, j] = turn != 0
        area[width], area[width + 1], turns[width] = 0.0, 0.0, 0


@kernel
def _add(a, b, sign, i, area, turns, width):
    """Adds what the segment from a up to b does to row i."""
    slope = (b.real - a.real) / (b.imag - a.imag)
    y0, y1 = max(a.imag, float(i)), min(b.imag, i + 1.0)
    if a.imag <= i + 0.5 < b.imag:
        x = a.real + (i + 0.5 - a.imag) * slope
        turns[min(max(math.ceil(x - 0.5), 0), width)] += int(sign)
    if y1 > y0:
        x0 = a.real + (y0 - a.imag) * slope
        x1 = a.real + (y1 - a.imag) * slope
        _span(area, min(x0, x1), max(x0, x1), sign * (y1 - y0), width)


@kernel
def _span(out, x0, x1, height, width):
    """Spreads `height` over the pixels that a piece of a segment within one row passes, x0 <= x1.

    A pixel left of the piece gets nothing, one right of it all of `height`: the running sum of `out` is the area.
    """
    if x1 <= 0:
        out[0] += height
        return
    if x0 >= width:
        return
    lo, hi = max(x0, 0.0), min(x1, float(width))
    if x1 - x0 < 1e-12:
        j = min(int(lo), width - 1)
        part = height * (j + 1 - lo)
        out[j] += part
        out[j + 1] += height - part
        return
    density = height / (x1 - x0)
    out[0] += density * (lo - x0)
    before = 0.0  # what pixels so far have in total, of this piece
    for j in range(int(lo), min(math.ceil(hi), width)):
        l0, l1 = max(lo, j), min(hi, j + 1)
        done = density * (l1 - lo)
        part = density * (l1 - l0) * (j + 1 - 0.5 * (l0 + l1)) + density * (l0 - lo)
        out[j] += part - before
        before = part
        if j + 1 >= hi:
            out[j + 1] += done - before
            before = done
