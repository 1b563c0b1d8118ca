"""The inverse of a triangulated map on the pixels of a canvas, band by band: scanlines over the quadratic patches.

A row's line of centres meets each triangle between two of its sides. Where it meets a side is worked out once the same
way for both triangles, so that the spans of neighbours abut: every centre inside belongs to one triangle.
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

EMPTY, FILLED, TOUCHED = 0, 1, 2  # states of a pixel; the last: only the outline comes near its centre
_fill = function("""int64_t iccm_pixels_fill(
    const Complex *corners, const Complex *powers, const int64_t *chosen, const double *reach, int64_t count,
    int64_t row, int64_t rows, int64_t width, const float *covered, Complex *z, Complex64 *right, Complex64 *down,
    bool slopes, uint8_t *state)""")
BYTES_PER_PIXEL = 33  # of a pixel: 16 for z, 8 for right and for down, and its state


@dataclass(eq=False)
class TriangulatedPreimages:
    """Where the pixels of a canvas come from under a triangulated map: exact, whatever is asked for.

    Attributes:
        map: source to target.
        canvas: the pixels, in the target's plane.
        slopes: whether the bands' `right` and `down` are wanted; else they are NaN.
        outline: what covers pixels; None for the triangles' own boundary.
    """

    map: TriangulatedMap
    canvas: Canvas
    slopes: bool = True
    outline: Complex | None = None

    def __post_init__(self) -> None:
        # Everything that bands share is made before threads ask for it.
        loops = [self.map.image[loop] for loop in self.map.loops] if self.outline is None else [self.outline]
        self.loop = self.canvas.pixels(_joined(loops))
        drawn: slice | Index = slice(None)
        if self.map.seen is not None:
            drawn = np.arange(self.map.seen)[::-1]  # what lies on top is drawn last
        centres = self.canvas.pixels(self.map.corners[drawn]) - 0.5 * (1 + 1j)
        self.corners = np.ascontiguousarray(centres, np.complex128)
        self.powers = powers(self.corners, self.map.patches[drawn])
        self.blocks = Blocks(self.canvas.width)
        self.top, self.bottom = (f(centres.imag, axis=1) for f in (np.min, np.max))

    def band(self, row: int) -> Band:
        """Return the band that starts at the given row."""
        rows, width = min(BAND_ROWS, self.canvas.height - row), self.canvas.width
        area = coverage_box(self.loop, row, rows, width)
        z, right, down, state = self.blocks.arrays(rows, width)
        state.fill(EMPTY)
        chosen = np.flatnonzero((self.bottom >= row) & (self.top < row + rows))
        reach = np.stack([self.top[chosen], self.bottom[chosen]], axis=1)
        if not self.slopes:
            right = down = np.empty((0, 0), np.complex64)
        inside = _fill(
            *(self.corners, self.powers, chosen, reach, chosen.size, row, rows, width),
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
        """Of a map that folds, what lies over as much of its back is not inside, and its back alone is, with nothing to
        show there: the nearest boundary point stands for it."""
        inside = coverage(self.loop, band.row, *state.shape)[1]
        back = inside & (state != FILLED)
        state[~inside & (state == FILLED)] = EMPTY
        state[(state == EMPTY) & (band.coverage > 0) | back] = TOUCHED
        band.z[state == EMPTY] = complex(np.nan, np.nan)
        lost = int(back.sum())
        band.diagnostics.inside, band.diagnostics.fallback = int(inside.sum()), lost
        band.diagnostics.edge -= lost  # which are not of the outline

    def _touch(self, band: Band, at: NDArray[np.intp]) -> None:
        """Pixels that the outline touches: the nearest boundary point stands for them."""
        if not at.size:
            return
        low, high = self.canvas.box
        dx, dy = self.canvas.step
        i, j = np.divmod(at, self.canvas.width)
        w = low.real + (j + 0.5) * dx + 1j * (high.imag - (band.row + i + 0.5) * dy)
        edge, part, _ = self.map.image_rim.closest(w)
        z, z_w, z_wbar = self.map.jet_at(*self.map.image_rim.places(edge, part))
        band.z.ravel()[at] = z
        band.diagnostics.edge += at.size
        if not self.slopes:
            return
        band.right.ravel()[at] = (z_w + z_wbar) * dx
        band.down.ravel()[at] = -1j * (z_w - z_wbar) * dy


class Blocks:
    """Memory for bands, used again when nobody holds a band's arrays any more.

    Pages fresh from the system cost about as much as filling them. NumPy asks for large ones, which plain buffers are
    not made of.

    Args:
        width: pixels a row.
    """

    def __init__(self, width: int):
        self.size = BYTES_PER_PIXEL * BAND_ROWS * width
        self.free: list[ctypes.Array] = []

    def arrays(self, rows: int, width: int) -> tuple[Complex, NDArray, NDArray, NDArray[np.uint8]]:
        """z, right, down, and the states, all to be written, (rows, width) each."""
        try:
            memory = self.free.pop()
        except IndexError:
            memory = (ctypes.c_ubyte * self.size).from_buffer(np.empty(self.size, np.uint8))  # type: ignore[arg-type]
        shape, count = (rows, width), rows * width
        # Its own base is not an array, so that it is the base of all its views, and dies with the last of them.
        block: NDArray[np.uint8] = np.frombuffer(memory, np.uint8, BYTES_PER_PIXEL * count)  # type: ignore[call-overload]
        weakref.finalize(block, self.free.append, memory).atexit = False
        z, right, down, state = np.split(block, [16 * count, 24 * count, 32 * count])
        across, below = (part.view(np.complex64).reshape(shape) for part in (right, down))
        return z.view(np.complex128).reshape(shape), across, below, state.reshape(shape)


def _joined(loops: list[Complex]) -> Complex:
    """Return one closed polyline through all loops: to each hole there is a way, and back, which covers nothing."""
    start = loops[0][:1]
    parts = [np.concatenate([start, hole, hole[:1]]) for hole in loops[1:]]
    return np.concatenate([loops[0], *parts])


def powers(corners: Complex, patches: Complex) -> Complex:
    """Return (m, 6) coefficients of 1, x, y, x², xy, y² of each patch, x and y being counted from its first corner.

    Args:
        corners: (m, 3) in the plane of x and y, of either turn.
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
        """Coefficient of the product of coordinates i and j."""
        pairs = ((l1, l2, d0), (l2, l0, d1), (l0, l1, d2))
        return sum((a[i] * b[j] + (a[j] * b[i] if i != j else 0)) * (2 * d) for a, b, d in pairs)

    return np.ascontiguousarray(np.stack([z0, x, y, second(0, 0), second(0, 1), second(1, 1)], axis=1))
