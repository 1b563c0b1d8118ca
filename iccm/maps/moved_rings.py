"""Images of closed polylines inside the source of a map."""

from collections.abc import Iterable

import shapely

from ..arrays import Complex, complex_of, xy_of
from ..curve import Curve
from .approximation import AnyMap

RING_SPACING_SHARE = 0.01
"""Longest edge of a mapped ring, relative to the diagonal of the source: maps are nearly linear on this length."""


def move_rings(map: AnyMap, rings: Iterable[Complex]) -> list[Complex]:
    """Return the images of closed polylines, with edges subdivided so that they follow the map.

    Points that lie outside the source by rounding are moved onto its outline.
    """
    outline = Curve(map.polygon)
    longest = RING_SPACING_SHARE * outline.diagonal
    closed = [shapely.segmentize(shapely.LinearRing(xy_of(ring)), longest) for ring in rings]
    return [map(outline.pulled_in(complex_of(shapely.get_coordinates(ring)[:-1]))) for ring in closed]
