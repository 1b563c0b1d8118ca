"""Source points of a canvas's pixels for maps of any kind, in bands of rows."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..arrays import Box, Real
from ..maps.approximation import ERROR_TEXELS, triangulated
from ..maps.boundary_image import outline
from ..maps.harmonic import HarmonicMap
from ..maps.triangulated.map import TriangulatedMap
from .canvas import BAND_ROWS, Band, Canvas, Diagnostics
from .triangulated_preimages import TriangulatedPreimages

USUAL_ERROR_TEXELS = 0.05
"""Requested error of source points, in texels, for which triangulated maps are made with ERROR_TEXELS."""
OUTLINE_ERROR_PIXELS = 0.01  # pixels: error of the outline, less than one of 255 levels of coverage


Bands = Callable[[int], Band]
"""A function from a row to the band of `canvas.BAND_ROWS` rows that starts there; it must be thread-safe."""


class Mapping(Protocol):
    """A map of another kind, which computes its own preimages."""

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> Bands:
        """Return preimages of pixels; arguments as for `of`."""


class Unchanged:
    """The identity on a box, which shows a picture where it is.

    Args:
        box: lower left and upper right corner.
    """

    def __init__(self, box: Box):
        self.box = box

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> Bands:
        """See `Mapping`."""
        low, high = canvas.pixels(np.array(self.box))
        across = _covered(low.real, high.real, canvas.width)
        down = _covered(high.imag, low.imag, canvas.height)

        def band(row: int) -> Band:
            rows = min(BAND_ROWS, canvas.height - row)
            coverage = (down[row : row + rows, None] * across).astype(np.float32)
            z = canvas.centres(row, rows)
            z[coverage == 0] = complex(np.nan, np.nan)
            dx, dy = canvas.step
            right, below = (np.full(z.shape, step, np.complex64) for step in (dx, -1j * dy))
            inside = Diagnostics(inside=int((coverage >= 0.5).sum()))
            return Band(row, coverage, z, right, below, inside)

        return band


def _covered(first: float, last: float, count: int) -> Real:
    """Return the covered share of each of `count` pixels in a line, given the ends of what covers them."""
    edges = np.arange(count + 1)
    return np.diff(np.clip(edges, first, last))


AnyMap = HarmonicMap | TriangulatedMap | Mapping


def of(map: AnyMap, canvas: Canvas, tolerance: float, slopes: bool = True) -> Bands:
    """Return the source points of a canvas's pixels under a map.

    Args:
        map: source → target.
        canvas: the pixels, in the target's plane.
        tolerance: requested accuracy of the source points, in units of the source.
        slopes: whether the bands need `right` and `down`.
    """
    if isinstance(map, HarmonicMap):
        edge = outline(map, OUTLINE_ERROR_PIXELS * min(canvas.step))
        triangulated_map = triangulated(map, ERROR_TEXELS / USUAL_ERROR_TEXELS * tolerance)
        return TriangulatedPreimages(triangulated_map, canvas, slopes, edge).band
    if isinstance(map, TriangulatedMap):
        return TriangulatedPreimages(map, canvas, slopes).band
    return map.preimages(canvas, tolerance, slopes)
