"""A raster in the plane, and bands of its rows with where their pixels come from."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Complex

BAND_ROWS = 128  # rows that are worked on at a time (by hand)
LONGER_SIDE_PIXELS = 1024  # of a picture, in pixels, unless stated otherwise


def proportional(longer: int, extent: complex) -> tuple[int, int]:
    """Width and height in pixels of what has the extent's proportions, from its longer side."""
    scale = longer / max(extent.real, extent.imag)
    return max(1, round(extent.real * scale)), max(1, round(extent.imag * scale))


@dataclass(frozen=True)
class Canvas:
    """width × height pixels over a box (lower left, upper right) of the plane, row 0 on top."""

    width: int
    height: int
    box: Box

    @classmethod
    def about(cls, width: int, height: int, box: Box) -> "Canvas":
        """Square pixels that show a box, which grows about its middle to the proportions of width and height."""
        low, high = box
        scale = max((high - low).real / width, (high - low).imag / height)
        middle, half = (low + high) / 2, scale * complex(width, height) / 2
        return cls(width, height, (middle - half, middle + half))

    @property
    def step(self) -> tuple[float, float]:
        """Width and height of a pixel."""
        size = self.box[1] - self.box[0]
        return size.real / self.width, size.imag / self.height

    def centres(self, row: int = 0, rows: int | None = None) -> Complex:
        """Return (rows, width) pixel centres of a band of rows."""
        rows = self.height - row if rows is None else rows
        return self.centre(np.arange(row, row + rows)[:, None], np.arange(self.width))

    def centre(self, row, column, size: int = 1):
        """Return the point of the plane in the centre of the blocks of size × size pixels at such rows and columns of
        blocks.
        """
        dx, dy = self.step
        low, high = self.box
        return low.real + (column + 0.5) * size * dx + 1j * (high.imag - (row + 0.5) * size * dy)

    def pixels(self, w: Complex) -> Complex:
        """Return points of the plane in pixel units, x right, y down."""
        dx, dy = self.step
        return (w.real - self.box[0].real) / dx + 1j * (self.box[1].imag - w.imag) / dy


@dataclass
class Diagnostics:
    """What became of the pixels of a raster.

    Attributes:
        inside: pixels whose centre is in the image of the source.
        edge: pixels outside that the image touches; they show the nearest boundary point.
        fallback: pixels inside where a map that folds shows only its back; they show the nearest boundary point.
    """

    inside: int = 0
    edge: int = 0
    fallback: int = 0

    def add(self, other: "Diagnostics") -> None:
        """Add the counts of another part of the raster."""
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
        mixed: what else is seen where two maps share a pixel.
    """

    row: int
    coverage: NDArray[np.float32]
    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]
    diagnostics: Diagnostics
    mixed: "Mixed | None" = None


class Mixed(NamedTuple):
    """Pixels of a band that show two places of the source.

    Attributes:
        at: (k,) their numbers, row by row.
        share: (k,) of the covered area that belongs to the other place.
        z, right, down: (k,) the other place, as in `Band`.
    """

    at: NDArray[np.intp]
    share: NDArray[np.float32]
    z: Complex
    right: NDArray[np.complex64]
    down: NDArray[np.complex64]
