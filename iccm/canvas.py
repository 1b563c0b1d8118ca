"""A raster in the plane, and where its pixels come from."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .cauchy import Complex
from .coverage import coverage
from .inverse import Inverse

Box = tuple[complex, complex]
LEAST = 1e-6  # smaller coverages are round-off


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

    def as_dict(self) -> dict[str, int]:
        """For reports."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class Band:
    """Rows [row, row + rows) of a raster: the pixels it needs, where they come from, and how they are stretched.

    Attributes:
        row: the first row.
        coverage: (rows, width) covered area of each pixel.
        at: (p,) flat indices into the band of the pixels that are covered at all.
        z: (p,) their points in the source.
        z_w, z_wbar: (p,) Wirtinger derivatives of the inverse there.
    """

    row: int
    coverage: NDArray[np.float32]
    at: NDArray[np.int64]
    z: Complex
    z_w: Complex
    z_wbar: Complex


@dataclass(eq=False)
class Raster:
    """The inverse of a map on the pixels of a canvas, band by band."""

    inverse: Inverse
    canvas: Canvas
    threads: int | None = None
    diagnostics: Diagnostics = field(default_factory=Diagnostics)

    def __post_init__(self):
        self.loop = self.canvas.pixels(self.inverse.outline.w)
        z, w = self.inverse._rim()
        self.rim = z, w, cKDTree(np.column_stack([w.real, w.imag]))

    def band(self, row: int, rows: int) -> Band:
        """The rows [row, row + rows)."""
        covered, inside = coverage(self.loop, row, rows, self.canvas.width)
        at = np.flatnonzero((covered > LEAST) | inside)
        w = self.canvas.centres(row, rows).ravel()[at]
        within = inside.ravel()[at]
        z = np.full(at.size, complex(np.nan, np.nan))
        z[within] = self.inverse(w[within], self.threads)
        lost = np.flatnonzero(np.isnan(z))
        z[lost] = self.rim[0][self.rim[2].query(np.column_stack([w[lost].real, w[lost].imag]))[1]]
        self.diagnostics.inside += int(within.sum())
        self.diagnostics.exact += int(within.sum())
        self.diagnostics.edge += int((~within).sum())
        self.diagnostics.fallback += int(within[lost].sum())
        _, a, b = self.inverse.forward.jet(z, self.threads)
        jacobian = np.abs(a) ** 2 - np.abs(b) ** 2
        return Band(row, covered, at, z, a.conj() / jacobian, -b / jacobian)
