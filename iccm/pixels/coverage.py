"""Exact coverage of pixels by a closed polyline, one band of rows at a time, in double precision."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex
from ..native import function
from ..plane import polygon_area
from .canvas import Canvas

_cover = function("""int64_t iccm_pixels_cover(
    const Complex *low, const Complex *high, const double *sign, int64_t count, int64_t rows, int64_t width,
    float *covered, bool *inside, bool winding)""")


def coverage(loop: Complex, row: int, rows: int, width: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the share of each pixel that a closed polyline covers, and which pixel centres it encloses.

    Args:
        loop: (k,) points in pixel units, x right, *y down*; pixel (i, j) is the square [j, j+1] × [i, i+1].
        row, rows: the band of rows [row, row + rows).
        width: pixels per row.

    Returns:
        (rows, width) covered area in [0, 1] (winding numbers add up and are clipped), and (rows, width) whether the
        winding number of the centre is not zero. Neither depends on the loop's direction.
    """
    inside = np.empty((rows, width), dtype=np.bool_)
    return _coverage(loop, row, rows, width, inside), inside


def coverage_box(loop: Complex, row: int, rows: int, width: int) -> NDArray[np.float32]:
    """Return only the covered area that `coverage` computes."""
    return _coverage(loop, row, rows, width, np.empty((0, width), dtype=np.bool_))


def _coverage(
    loop: Complex, row: int, rows: int, width: int, inside: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Return the covered area; fills `inside` unless it has no rows."""
    start = loop.astype(np.complex128) - 1j * row
    end = np.roll(start, -1)
    falls = start.imag > end.imag
    low, high = np.where(falls, end, start), np.where(falls, start, end)
    crosses = (high.imag > 0) & (low.imag < rows) & (low.imag < high.imag)
    out = np.empty((rows, width), dtype=np.float32)
    sign = np.where(falls[crosses], -1.0, 1.0)
    _cover(low[crosses], high[crosses], sign, sign.size, rows, width, out, inside, inside.shape[0] > 0)
    return out


def painted_share(rings: Sequence[Complex], canvas: Canvas) -> NDArray[np.float32]:
    """Return the share of each pixel that a region covers, (height, width) in [0, 1].

    Parameters
    ----------
    rings
        The region's boundaries, closed polylines: those of parts counter-clockwise, those of holes clockwise.
    canvas
        The raster.
    """
    covered = np.zeros((canvas.height, canvas.width), np.float32)
    for ring in rings:
        area = coverage_box(canvas.pixels(ring), 0, canvas.height, canvas.width)
        covered += area if polygon_area(ring) > 0 else -area
    return np.clip(covered, 0, 1)
