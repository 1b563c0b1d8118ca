"""A raster in the plane, and bands of its rows with the source points of their pixels."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex

BAND_ROWS = 128  # rows processed at a time, which bounds memory
LONGER_SIDE_PIXELS = 1024  # default length of a picture's longer side in pixels


def proportional(longer: int, extent: complex) -> tuple[int, int]:
    """Return width and height in pixels with the proportions of an extent, given the longer side."""
    scale = longer / max(extent.real, extent.imag)
    return max(1, round(extent.real * scale)), max(1, round(extent.imag * scale))


@dataclass(frozen=True)
class Canvas:
    """A raster of width × height pixels over a box (lower left, upper right) of the plane, row 0 at the top."""

    width: int
    height: int
    box: Box

    @classmethod
    def about(cls, width: int, height: int, box: Box) -> "Canvas":
        """Create a canvas of square pixels over a box, enlarged about its middle to the pixels' proportions."""
        low, high = box
        scale = max((high - low).real / width, (high - low).imag / height)
        middle, half = (low + high) / 2, scale * complex(width, height) / 2
        return cls(width, height, (middle - half, middle + half))

    @property
    def step(self) -> tuple[float, float]:
        """Width and height of a pixel in the plane."""
        size = self.box[1] - self.box[0]
        return size.real / self.width, size.imag / self.height

    def centres(self, row: int = 0, rows: int | None = None) -> Complex:
        """Return (rows, width) centres of the pixels in a band of rows; in all rows by default."""
        rows = self.height - row if rows is None else rows
        return self.centre(np.arange(row, row + rows)[:, None], np.arange(self.width))

    def centre(self, row, column, size: int = 1):
        """Return the centres of blocks of size × size pixels in the plane; rows and columns count blocks."""
        dx, dy = self.step
        low, high = self.box
        return low.real + (column + 0.5) * size * dx + 1j * (high.imag - (row + 0.5) * size * dy)

    def pixels(self, w: Complex) -> Complex:
        """Convert points of the plane to pixel units, x right, y down."""
        dx, dy = self.step
        return (w.real - self.box[0].real) / dx + 1j * (self.box[1].imag - w.imag) / dy


@dataclass
class Diagnostics:
    """Counts of pixels by how their source point was found.

    Attributes:
        inside: pixels whose centre is in the image of the source.
        edge: pixels outside that the image touches; they show the nearest boundary point.
        fallback: pixels inside where a map with folds shows only its back; they show the nearest boundary point.
    """

    inside: int = 0
    edge: int = 0
    fallback: int = 0

    def add(self, other: "Diagnostics") -> None:
        """Add the counts of another part of the raster, in place."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)

    def as_dict(self) -> dict[str, int]:
        """Return the counts by name, for reports."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class Band:
    """Rows [row, row + rows) of a raster: source points of their pixels, and derivatives.

    Attributes:
        row: the first row.
        coverage: (rows, width) covered share of each pixel.
        z: (rows, width) source point of each pixel; NaN where it is not covered.
        right, down: (rows, width) changes of z to the next pixel on the right, and to the next one below.
        diagnostics: counts of pixels.
        mixed: second source points, where two maps share a pixel.
    """

    row: int
    coverage: NDArray[np.float32]
    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]
    diagnostics: Diagnostics
    mixed: "Mixed | None" = None


class Mixed(NamedTuple):
    """Pixels of a band that show two source points.

    Attributes:
        pixels: (k,) flat indices of the pixels.
        share: (k,) share of the covered area that belongs to the second point.
        z, right, down: (k,) the second point and its derivatives, as in `Band`.
    """

    pixels: NDArray[np.intp]
    share: NDArray[np.float32]
    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]
