"""A map whose image has holes: pixels in them stay empty."""

from collections.abc import Sequence

import numpy as np

from ..arrays import Complex
from . import preimages
from .canvas import Band, Canvas
from .coverage import coverage


class Holed:
    """A map in the place of one, for pictures and STMaps, without what it takes into holes.

    Args:
        map: source → target, of any kind.
        holes: closed polylines of the target's plane.
    """

    def __init__(self, map: preimages.AnyMap, holes: Sequence[Complex]):
        self.map, self.holes = map, holes

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> "HoledPreimages":
        """As `preimages.Mapping` has it."""
        whole = preimages.of(self.map, canvas, tolerance, slopes)
        return HoledPreimages(whole, [canvas.pixels(hole) for hole in self.holes])


class HoledPreimages:
    """Where the pixels of a canvas come from, none of those in the holes.

    Args:
        whole: the same without holes.
        loops: the holes in pixels.
    """

    def __init__(self, whole: preimages.Bands, loops: Sequence[Complex]):
        self.whole, self.loops = whole, loops

    def band(self, row: int) -> Band:
        """The band that starts at the given row."""
        band = self.whole.band(row)
        rows, width = band.coverage.shape
        for loop in self.loops:
            if not (loop.imag.max() > row and loop.imag.min() < row + rows):
                continue
            covered, inside = coverage(loop, row, rows, width)
            band.diagnostics.inside -= int((inside & (band.coverage > 0)).sum())
            np.maximum(band.coverage - covered, 0, out=band.coverage)
        band.z[band.coverage == 0] = complex(np.nan, np.nan)
        return band
