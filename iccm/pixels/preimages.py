"""Source points of the pixels of a canvas: `of` a map of any kind, in bands of rows."""

from collections.abc import Callable
from typing import Protocol

from ..maps.approximation import ERROR_TEXELS, triangulated
from ..maps.boundary_image import outline
from ..maps.harmonic import HarmonicMap
from ..maps.triangulated.map import TriangulatedMap
from .canvas import Band, Canvas
from .triangulated_preimages import TriangulatedPreimages

USUAL_ERROR_TEXELS = 0.05
"""The error of source points asked for that ERROR_TEXELS of a triangulated map keeps, in the same units."""
OUTLINE_ERROR_PIXELS = 0.01
"""Pixels, that the outline may be off: less than one of 255 levels of coverage takes."""


Bands = Callable[[int], Band]
"""From a row to the band of `canvas.BAND` rows that starts there: where their pixels come from. Threads may ask."""


class Mapping(Protocol):
    """A map of another kind: it knows itself where pixels come from."""

    def preimages(self, canvas: Canvas, tolerance: float, slopes: bool) -> Bands:
        """Arguments as for `of`."""


AnyMap = HarmonicMap | TriangulatedMap | Mapping


def of(map: AnyMap, canvas: Canvas, tolerance: float, slopes: bool = True) -> Bands:
    """Return where the pixels of a canvas come from under a map.

    Args:
        map: source → target.
        canvas: the pixels, in the target's plane.
        tolerance: accuracy of the source points asked for, in units of the source.
        slopes: whether the bands' `right` and `down` are wanted.
    """
    if isinstance(map, HarmonicMap):
        edge = outline(map, OUTLINE_ERROR_PIXELS * min(canvas.step))
        drawn = triangulated(map, ERROR_TEXELS / USUAL_ERROR_TEXELS * tolerance)
        return TriangulatedPreimages(drawn, canvas, slopes, edge).band
    if isinstance(map, TriangulatedMap):
        return TriangulatedPreimages(map, canvas, slopes).band
    return map.preimages(canvas, tolerance, slopes)
