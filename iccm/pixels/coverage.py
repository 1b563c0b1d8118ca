"""Exact coverage of pixels by a closed polyline, row band by row band, in double precision."""

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from ..jit import kernel

NOTHING = (
    1e-6  # area of a pixel that round-off may leave or take, by hand: far above round-off, far below a byte
)


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
    area = np.zeros((rows, width + 2))
    turns = np.zeros((rows, width + 1), dtype=np.int16)
    shifted = loop - 1j * row
    end = np.roll(shifted, -1)
    near = (np.maximum(shifted.imag, end.imag) > 0) & (np.minimum(shifted.imag, end.imag) < rows)
    _accumulate(shifted[near], end[near], area, turns)
    covered = np.empty((rows, width), dtype=np.float32)
    inside = np.empty((rows, width), dtype=np.bool_)
    _resolve(area, turns, covered, inside)
    return covered, inside


@kernel
def _resolve(area, turns, covered, inside):
    """Sums along the rows. What is round-off from nothing or from all becomes 0 or 1."""
    for i in range(covered.shape[0]):
        total, turn = 0.0, 0
        for j in range(covered.shape[1]):
            total += area[i, j]
            turn += turns[i, j]
            value = abs(total)
            covered[i, j] = 0.0 if value < NOTHING else (1.0 if value > 1 - NOTHING else value)
            inside[i, j] = turn != 0


@kernel
def _accumulate(start, end, area, turns):
    """Adds every segment's signed area, as differences along the row, and its crossings of the rows' centre lines."""
    rows, width = area.shape[0], area.shape[1] - 2
    for s in range(start.size):
        a, b = start[s], end[s]
        sign = 1.0
        if a.imag > b.imag:
            a, b, sign = b, a, -1.0
        if a.imag == b.imag or b.imag <= 0 or a.imag >= rows:
            continue
        slope = (b.real - a.real) / (b.imag - a.imag)
        first = max(0, math.floor(a.imag))
        last = min(rows - 1, math.floor(b.imag))
        for i in range(first, last + 1):
            y0, y1 = max(a.imag, i), min(b.imag, i + 1)
            if a.imag <= i + 0.5 < b.imag:
                x = a.real + (i + 0.5 - a.imag) * slope
                turns[i, min(max(math.ceil(x - 0.5), 0), width)] += int(sign)
            if y1 > y0:
                x0 = a.real + (y0 - a.imag) * slope
                x1 = a.real + (y1 - a.imag) * slope
                _span(area[i], min(x0, x1), max(x0, x1), sign * (y1 - y0), width)


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
