"""The inverse of a triangulated map at the pixels of a canvas, by bands: scanline rasterization of quadratic patches.

The line through a row's pixel centres meets each triangle between two of its sides. The intersection with a side is
computed in the same way for both triangles, so that neighbouring spans abut exactly: every centre inside belongs to one
triangle.
"""

import ctypes
import weakref
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Index
from ..maps.triangulated.map import TriangulatedMap
from ..native import function
from .canvas import BAND_ROWS, Band, Canvas, Diagnostics
from .coverage import coverage, coverage_box

EMPTY, FILLED, TOUCHED = 0, 1, 2
"""States of a pixel; TOUCHED: covered by the image, but its centre is outside."""
_fill = function("""int64_t iccm_pixels_fill(
    const Complex *corners, const Complex *powers, const int64_t *chosen, const double *reach, int64_t count,
    int64_t row, int64_t rows, int64_t width, const float *covered, Complex *z, Complex64 *right, Complex64 *down,
    bool slopes, uint8_t *state)""")
BYTES_PER_PIXEL = 33  # per pixel: 16 for z, 8 for right, 8 for down, 1 for the state


@dataclass(eq=False)
class TriangulatedPreimages:
    """Source points of a canvas's pixels under a triangulated map; exact, whatever tolerance is requested.

    Attributes:
        map: source to target.
        canvas: the pixels, in the target's plane.
        slopes: whether the bands need `right` and `down`; else they are NaN.
        outline: determines the coverage of pixels; None for the triangles' own boundary.
    """

    map: TriangulatedMap
    canvas: Canvas
    slopes: bool = True
    outline: Complex | None = None

    def __post_init__(self) -> None:
        # Shared data are computed here, before threads use them.
        loops = [self.map.image[loop] for loop in self.map.loops] if self.outline is None else [self.outline]
        self.loop = self.canvas.pixels(_joined(loops))
        drawing_order: slice | Index = slice(None)
        if self.map.seen is not None:
            drawing_order = np.arange(self.map.seen)[::-1]  # triangles on top are drawn last
        centres = self.canvas.pixels(self.map.corners[drawing_order]) - 0.5 * (1 + 1j)
        self.corners = np.ascontiguousarray(centres, np.complex128)
        self.powers = powers(self.corners, self.map.patches[drawing_order])
        self.blocks = Blocks(self.canvas.width)
        self.top, self.bottom = (f(centres.imag, axis=1) for f in (np.min, np.max))

    def band(self, row: int) -> Band:
        """Return the band that starts at a row."""
        rows, width = min(BAND_ROWS, self.canvas.height - row), self.canvas.width
        area = coverage_box(self.loop, row, rows, width)
        z, right, down, state = self.blocks.arrays(rows, width)
        state.fill(EMPTY)
        in_band = np.flatnonzero((self.bottom >= row) & (self.top < row + rows))
        reach = np.stack([self.top[in_band], self.bottom[in_band]], axis=1)
        if not self.slopes:
            right = down = np.empty((0, 0), np.complex64)
        inside = _fill(
            *(self.corners, self.powers, in_band, reach, in_band.size, row, rows, width),
            *(area, z, right, down, self.slopes, state),
        )
        if not self.slopes:
            right = down = np.broadcast_to(np.complex64(complex(np.nan, np.nan)), z.shape)
        band = Band(row, area, z, right, down, Diagnostics(inside=inside))
        if self.map.seen is not None:
            self._unfold(band, state)
        self._touch(band, np.flatnonzero(state == TOUCHED))
        return band

    def _unfold(self, band: Band, state: NDArray[np.uint8]) -> None:
        """Correct a band of a map with folds by winding numbers.

        Pixels where front and back cancel are outside. Pixels where only the back is visible are inside, and show the
        nearest boundary point.
        """
        inside = coverage(self.loop, band.row, *state.shape)[1]
        back = inside & (state != FILLED)
        state[~inside & (state == FILLED)] = EMPTY
        state[(state == EMPTY) & (band.coverage > 0) | back] = TOUCHED
        band.z[state == EMPTY] = complex(np.nan, np.nan)
        reversed_count = int(back.sum())
        band.diagnostics.inside, band.diagnostics.fallback = int(inside.sum()), reversed_count
        band.diagnostics.edge -= reversed_count  # they are not at the outline

    def _touch(self, band: Band, pixels: NDArray[np.intp]) -> None:
        """Set the source points of pixels that the outline touches to the nearest boundary points.

        `pixels` are (k,) flat indices.
        """
        if not pixels.size:
            return
        low, high = self.canvas.box
        dx, dy = self.canvas.step
        i, j = np.divmod(pixels, self.canvas.width)
        w = low.real + (j + 0.5) * dx + 1j * (high.imag - (band.row + i + 0.5) * dy)
        edge, part, _ = self.map.image_rim.closest(w)
        z, z_w, z_wbar = self.map.jet_at(*self.map.image_rim.places(edge, part))
        band.z.ravel()[pixels] = z
        band.diagnostics.edge += pixels.size
        if not self.slopes:
            return
        band.right.ravel()[pixels] = (z_w + z_wbar) * dx
        band.down.ravel()[pixels] = -1j * (z_w - z_wbar) * dy


class Blocks:
    """A pool of memory for bands; a block is reused when no array refers to it any more.

    Fresh pages from the system cost about as much as filling them. NumPy requests them for large arrays, so these
    blocks are plain buffers.

    Args:
        width: pixels per row.
    """

    def __init__(self, width: int):
        self.size = BYTES_PER_PIXEL * BAND_ROWS * width
        self.free: list[ctypes.Array] = []

    def arrays(self, rows: int, width: int) -> tuple[Complex, NDArray, NDArray, NDArray[np.uint8]]:
        """Return uninitialized arrays z, right, down and states, (rows, width) each."""
        try:
            memory = self.free.pop()
        except IndexError:
            memory = (ctypes.c_ubyte * self.size).from_buffer(np.empty(self.size, np.uint8))  # type: ignore[arg-type]
        shape, count = (rows, width), rows * width
        # `block` has no array as its base; so it is the base of all views, and dies with the last of them.
        block: NDArray[np.uint8] = np.frombuffer(memory, np.uint8, BYTES_PER_PIXEL * count)  # type: ignore[call-overload]
        weakref.finalize(block, self.free.append, memory).atexit = False
        z, right, down, state = np.split(block, [16 * count, 24 * count, 32 * count])
        across, below = (part.view(np.complex64).reshape(shape) for part in (right, down))
        return z.view(np.complex128).reshape(shape), across, below, state.reshape(shape)


def _joined(loops: list[Complex]) -> Complex:
    """Join loops to one closed polyline; the paths to each hole and back coincide, and cover nothing."""
    start = loops[0][:1]
    parts = [np.concatenate([start, hole, hole[:1]]) for hole in loops[1:]]
    return np.concatenate([loops[0], *parts])


def powers(corners: Complex, patches: Complex) -> Complex:
    """Return (m, 6) coefficients of 1, x, y, x², xy, y² of each patch, with x and y relative to its first corner.

    Args:
        corners: (m, 3) in the plane of x and y, in either orientation.
        patches: (m, 6) values at the corners and bulges of the sides opposite to them.
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u.real * v.imag - u.imag * v.real
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0)
    l1, l2 = np.stack([v.imag, -v.real]) * scale, np.stack([-u.imag, u.real]) * scale
    l0 = -l1 - l2
    z0, z1, z2, d0, d1, d2 = patches.T
    x, y = (l1[k] * (z1 - z0 + 2 * d2) + l2[k] * (z2 - z0 + 2 * d1) for k in (0, 1))

    def second(i: int, j: int) -> Complex:
        """Return the coefficient of the product of coordinates i and j."""
        pairs = ((l1, l2, d0), (l2, l0, d1), (l0, l1, d2))
        return sum((a[i] * b[j] + (a[j] * b[i] if i != j else 0)) * (2 * d) for a, b, d in pairs)

    return np.ascontiguousarray(np.stack([z0, x, y, second(0, 0), second(0, 1), second(1, 1)], axis=1))
