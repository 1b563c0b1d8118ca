"""Where the pixels of a canvas come from: `of` a map of any kind, in bands of rows."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, xy_of
from ..maps.evaluate import Evaluator
from ..maps.harmonic import HarmonicMap
from ..maps.inverse import Inverse, inverse_derivatives
from ..maps.triangulated.map import TriangulatedMap
from ..parallel import in_order
from .canvas import Band, Canvas, Diagnostics
from .coverage import coverage
from .inverse_tiles import COARSE, SMALLEST, TILE, PixelGrid, Solved, fill, flood
from .triangulated_preimages import TriangulatedPreimages


class Bands(Protocol):
    """Where the pixels of a canvas come from, band by band of `inverse_tiles.TILE` rows; threads may ask at once."""

    def band(self, row: int) -> Band:
        """The band that starts at the given row."""


class Mapping(Protocol):
    """A map of any other kind than the harmonic: it knows itself where pixels come from."""

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> Bands:
        """Arguments as for `of`."""


AnyMap = HarmonicMap | Evaluator | Inverse | TriangulatedMap | Mapping


def of(map: AnyMap, canvas: Canvas, tolerance: float, slopes: bool = True) -> Bands:
    """Where the pixels of a canvas come from under a map.

    Args:
        map: source → target.
        canvas: the pixels, in the target's plane.
        tolerance: accuracy of the source points asked for, in units of the source.
        slopes: whether the bands' `right` and `down` are wanted.
    """
    if isinstance(map, HarmonicMap | Evaluator):
        map = Inverse(map, 2 * min(canvas.step))
    if isinstance(map, Inverse):
        return Preimages(map, canvas, tolerance, slopes)
    if isinstance(map, TriangulatedMap):
        return TriangulatedPreimages(map, canvas, slopes)
    return map.preimages(canvas, tolerance, slopes)


@dataclass(eq=False)
class Preimages:
    """The inverse of a map on the pixels of a canvas, band by band.

    Attributes:
        inverse: its resolution should be a pixel or two of the canvas.
        canvas: the pixels.
        tolerance: accuracy of the source points asked for, in units of the source.
        slopes: whether `right` and `down` are wanted.
    """

    inverse: Inverse
    canvas: Canvas
    tolerance: float
    slopes: bool = True

    def __post_init__(self):
        from scipy.spatial import cKDTree

        # Everything that bands share is made before threads ask for it.
        self.loop = self.canvas.pixels(self.inverse.boundary_image.w)
        self.rim = self.inverse.rim
        self.rim_tree = cKDTree(np.column_stack([self.rim[1].real, self.rim[1].imag]))
        self.seeds = self._flood()

    def _flood(self) -> Complex:
        """Source points of the middles of coarse blocks."""
        rows, width = (-(-size // COARSE) for size in (self.canvas.height, self.canvas.width))
        inside = coverage(self.loop / COARSE, 0, rows, width)[1]
        seeds = np.full(inside.shape, complex(np.nan, np.nan))
        i, j = np.nonzero(inside)
        if i.size:
            numbers = self.inverse.seed_numbers(self.canvas.centre(i, j, COARSE), 1)[:, 0]
            seeds[i, j] = self.inverse.seeds[0][numbers]
        return flood(self.inverse.forward.tree, self._grid(0, COARSE), inside, seeds, self.tolerance)

    def _grid(self, row: int, size: int = 1) -> PixelGrid:
        """The blocks of size × size pixels from a row of them on."""
        dx, dy = self.canvas.step
        return PixelGrid(self.canvas.centre(row, 0, size), size * dx, size * dy)

    def bands(self, threads: int | None = None) -> Iterator[Band]:
        """All bands from top to bottom, a few being worked on at a time."""
        return in_order(self.band, range(0, self.canvas.height, TILE), threads)

    def band(self, row: int) -> Band:
        """The band that starts at the given row."""
        rows, width = min(TILE, self.canvas.height - row), self.canvas.width
        covered, inside = coverage(self.loop, row, rows, width)
        z = np.full((rows, width), complex(np.nan, np.nan))
        right = np.full((rows, width), complex(np.nan, np.nan), dtype=np.complex64)
        band = Band(row, covered, z, right, right.copy(), Diagnostics())
        some = (covered > 0) | inside
        if some.any():
            self._solve(band, inside, some)
        return band

    def _solve(self, band: Band, inside: NDArray[np.bool_], some: NDArray[np.bool_]) -> None:
        first = band.row // COARSE
        seeds = self.seeds[first : first + TILE // COARSE]
        full = _blocks(inside & (band.coverage == 1), np.all)
        out, busy = Solved(band.z, band.right, band.down), _blocks(some, np.any)
        tree, grid = self.inverse.forward.tree, self._grid(band.row)
        exact = fill(tree, grid, inside, full, busy, seeds, self.tolerance, out, self.slopes)
        band.diagnostics.inside = int(inside.sum())
        band.diagnostics.exact = exact
        left = np.flatnonzero(inside & np.isnan(band.z))
        if left.size:
            self._retry(band, left)
        self._touch(band, np.flatnonzero(some & np.isnan(band.z)), inside)

    def _retry(self, band: Band, at: NDArray[np.intp]) -> None:
        """Pixels that their neighbours did not lead to, from many seeds."""
        z = self.inverse(self._places(band, at), threads=1)
        found = np.isfinite(z)
        self._put(band, at[found], z[found])
        band.diagnostics.exact += int(found.sum())

    def _put(self, band: Band, at: NDArray[np.intp], z: Complex) -> None:
        dx, dy = self.canvas.step
        z_w, z_wbar = inverse_derivatives(*self.inverse.jet(z, threads=1)[1:])
        band.z.ravel()[at] = z
        band.right.ravel()[at] = (z_w + z_wbar) * dx
        band.down.ravel()[at] = -1j * (z_w - z_wbar) * dy

    def _places(self, band: Band, at: NDArray[np.intp]) -> Complex:
        i, j = np.divmod(at, self.canvas.width)
        return self.canvas.centre(band.row + i, j)

    def _touch(self, band: Band, at: NDArray[np.intp], inside: NDArray[np.bool_]) -> None:
        """Pixels that the outline touches, and those without a solution: the nearest boundary point stands for them."""
        if not at.size:
            return
        w = self._places(band, at)
        near = self.rim_tree.query(xy_of(w))[1]
        self._put(band, at, self.rim[0][near])
        lost = int(inside.ravel()[at].sum())
        band.diagnostics.fallback += lost
        band.diagnostics.edge += at.size - lost


def _blocks(mask: NDArray[np.bool_], reduce: Callable) -> NDArray[np.bool_]:
    """all() or any() over blocks of LEAST² pixels; what lies beyond the band changes neither."""
    rows, width = mask.shape
    pad = [(0, -rows % SMALLEST), (0, -width % SMALLEST)]
    mask = np.pad(mask, pad, constant_values=reduce is np.all)
    return reduce(mask.reshape(mask.shape[0] // SMALLEST, SMALLEST, -1, SMALLEST), axis=(1, 3))
