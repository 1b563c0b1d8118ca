"""A raster in the plane, and where its pixels come from."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..arrays import Box, Complex
from ..maps.inverse import Inverse
from ..parallel import in_order
from . import inverse_tiles
from .coverage import coverage


@dataclass(frozen=True)
class Canvas:
    """width × height pixels over a box (lower left, upper right) of the plane, row 0 on top."""

    width: int
    height: int
    box: Box

    @property
    def step(self) -> tuple[float, float]:
        """Width and height of a pixel."""
        size = self.box[1] - self.box[0]
        return size.real / self.width, size.imag / self.height

    def centres(self, row: int = 0, rows: int | None = None) -> Complex:
        """(rows, width) pixel centres of a band of rows."""
        rows = self.height - row if rows is None else rows
        dx, dy = self.step
        x = self.box[0].real + (np.arange(self.width) + 0.5) * dx
        y = self.box[1].imag - (np.arange(row, row + rows) + 0.5) * dy
        return x[None, :] + 1j * y[:, None]

    def pixels(self, w: Complex) -> Complex:
        """Points of the plane in pixel units, x right, y down."""
        dx, dy = self.step
        return (w.real - self.box[0].real) / dx + 1j * (self.box[1].imag - w.imag) / dy


@dataclass
class Diagnostics:
    """What became of the pixels of a raster.

    Attributes:
        inside: pixels whose centre is in the image of the source.
        edge: pixels outside that the image touches; they show the nearest boundary point.
        exact: pixels solved one by one instead of by an expansion.
        fallback: pixels inside for which no solution was found; they show the nearest boundary point.
    """

    inside: int = 0
    edge: int = 0
    exact: int = 0
    fallback: int = 0

    def add(self, other: "Diagnostics") -> None:
        """Adds the counts of another part of the raster."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)

    def as_dict(self) -> dict[str, int]:
        """For reports."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class Band:
    """Rows [row, row + rows) of a raster: where its pixels come from, and how they are stretched.

    Attributes:
        row: the first row.
        coverage: (rows, width) covered area of each pixel.
        z: (rows, width) their points in the source; NaN where nothing is covered.
        right, down: (rows, width) how z changes from a pixel to the next on the right and to the next one below.
        diagnostics: what became of the pixels.
    """

    row: int
    coverage: NDArray[np.float32]
    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]
    diagnostics: Diagnostics


@dataclass(eq=False)
class Raster:
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
        # Everything that bands share is made before threads ask for it.
        self.loop = self.canvas.pixels(self.inverse.outline.w)
        self.rim = self.inverse.rim
        self.rim_tree = cKDTree(np.column_stack([self.rim[1].real, self.rim[1].imag]))
        self.seeds = self._flood()

    def _flood(self) -> Complex:
        """Source points of the middles of coarse blocks."""
        dx, dy = (inverse_tiles.COARSE * step for step in self.canvas.step)
        rows, width = (
            -(-self.canvas.height // inverse_tiles.COARSE),
            -(-self.canvas.width // inverse_tiles.COARSE),
        )
        inside = coverage(self.loop / inverse_tiles.COARSE, 0, rows, width)[1]
        origin = complex(self.canvas.box[0].real + 0.5 * dx, self.canvas.box[1].imag - 0.5 * dy)
        seeds = np.full(inside.shape, complex(np.nan, np.nan))
        i, j = np.nonzero(inside)
        if i.size:
            numbers = self.inverse.seed_numbers(origin + j * dx - 1j * i * dy, 1)[:, 0]
            seeds[i, j] = self.inverse.seeds[0][numbers]
        grid = inverse_tiles.Grid(origin, dx, dy)
        return inverse_tiles.flood(self.inverse.forward.tree, grid, inside, seeds, self.tolerance)

    def bands(self, threads: int | None = None) -> Iterator[Band]:
        """All bands from top to bottom, a few being worked on at a time."""
        return in_order(self.band, range(0, self.canvas.height, inverse_tiles.TILE), threads)

    def band(self, row: int) -> Band:
        """The band that starts at the given row."""
        rows, width = min(inverse_tiles.TILE, self.canvas.height - row), self.canvas.width
        covered, inside = coverage(self.loop, row, rows, width)
        z = np.full((rows, width), complex(np.nan, np.nan))
        right = np.full((rows, width), complex(np.nan, np.nan), dtype=np.complex64)
        band = Band(row, covered, z, right, right.copy(), Diagnostics())
        some = (covered > 0) | inside
        if some.any():
            self._solve(band, inside, some)
        return band

    def _solve(self, band: Band, inside: NDArray[np.bool_], some: NDArray[np.bool_]) -> None:
        dx, dy = self.canvas.step
        origin = complex(self.canvas.box[0].real + 0.5 * dx, self.canvas.box[1].imag - (band.row + 0.5) * dy)
        first = band.row // inverse_tiles.COARSE
        seeds = self.seeds[first : first + inverse_tiles.TILE // inverse_tiles.COARSE]
        full = _blocks(inside & (band.coverage == 1), np.all)
        out = inverse_tiles.Solved(band.z, band.right, band.down)
        grid = inverse_tiles.Grid(origin, dx, dy)
        tree = self.inverse.forward.tree
        exact = inverse_tiles.fill(
            tree, grid, inside, full, _blocks(some, np.any), seeds, self.tolerance, out, self.slopes
        )
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
        _, a, b = self.inverse.forward.jet(z, threads=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            jacobian = np.abs(a) ** 2 - np.abs(b) ** 2
            z_w, z_wbar = a.conj() / jacobian, -b / jacobian
        band.z.ravel()[at] = z
        band.right.ravel()[at] = (z_w + z_wbar) * dx
        band.down.ravel()[at] = -1j * (z_w - z_wbar) * dy

    def _places(self, band: Band, at: NDArray[np.intp]) -> Complex:
        dx, dy = self.canvas.step
        i, j = np.divmod(at, self.canvas.width)
        low, high = self.canvas.box
        return low.real + (j + 0.5) * dx + 1j * (high.imag - (band.row + i + 0.5) * dy)

    def _touch(self, band: Band, at: NDArray[np.intp], inside: NDArray[np.bool_]) -> None:
        """Pixels that the outline touches, and those without a solution: the nearest boundary point stands for them."""
        if not at.size:
            return
        w = self._places(band, at)
        near = self.rim_tree.query(np.column_stack([w.real, w.imag]))[1]
        self._put(band, at, self.rim[0][near])
        lost = int(inside.ravel()[at].sum())
        band.diagnostics.fallback += lost
        band.diagnostics.edge += at.size - lost


def _blocks(mask: NDArray[np.bool_], reduce: Callable) -> NDArray[np.bool_]:
    """all() or any() over blocks of LEAST² pixels; what lies beyond the band changes neither."""
    fill = reduce is np.all
    rows, width = mask.shape
    pad = [(0, -rows % inverse_tiles.LEAST), (0, -width % inverse_tiles.LEAST)]
    mask = (
        np.pad(mask, pad, constant_values=fill)
        if rows % inverse_tiles.LEAST or width % inverse_tiles.LEAST
        else mask
    )
    cut = mask.reshape(mask.shape[0] // inverse_tiles.LEAST, inverse_tiles.LEAST, -1, inverse_tiles.LEAST)
    return reduce(reduce(cut, axis=1), axis=2)
