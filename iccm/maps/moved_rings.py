"""Closed polylines inside the source where a map takes them."""

from collections.abc import Iterable

import shapely

from ..arrays import Complex, complex_of, xy_of
from ..curve import Curve
from .approximation import AnyMap

RING_SPACING_SHARE = 0.01
"""Longest edge of a ring that is carried, relative to the diagonal of the source: within that maps bend little."""


def move_rings(map: AnyMap, rings: Iterable[Complex]) -> list[Complex]:
    """Return the images of closed polylines, whose edges are subdivided so that they follow the map.

    Points that lie outside the source by rounding are moved onto its outline.
    """
    outline = Curve(map.polygon)
    longest = RING_SPACING_SHARE * outline.diagonal
    closed = [shapely.segmentize(shapely.LinearRing(xy_of(ring)), longest) for ring in rings]
    return [map(outline.pulled_in(complex_of(shapely.get_coordinates(ring)[:-1]))) for ring in closed]
