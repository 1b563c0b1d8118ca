"""A painted region, prepared for many queries whether points are inside."""

import numpy as np
import shapely

from ..arrays import Complex, Flags, xy_of
from ..polygons import polygons_of

FEW_PARTS = 64
"""Number of parts up to which they are queried together. GEOS finds edges beside a point by their y alone, which is
fast for a few parts; but the letters of a line of text all have the same y."""


class PaintedRegion:
    """A region with its area, prepared for queries.

    Parameters
    ----------
    painted
        A valid Polygon or MultiPolygon.
    """

    def __init__(self, painted: shapely.Geometry):
        self.painted = painted
        self.area = float(painted.area)
        self._parts = polygons_of(painted)
        self._tree = shapely.STRtree(self._parts) if len(self._parts) > FEW_PARTS else None
        shapely.prepare(painted if self._tree is None else self._parts)

    def contains(self, z: Complex) -> Flags:
        """Mark the points z (any shape) that lie in the region."""
        if self._tree is None:
            return shapely.contains_xy(self.painted, z.real, z.imag)
        places = z.ravel()
        inside = np.zeros(places.size, dtype=bool)
        points, parts = self._tree.query(shapely.points(places.real, places.imag))
        order = np.argsort(parts, kind="stable")
        points, parts = points[order], parts[order]
        first_of_each_part = np.flatnonzero(np.diff(parts, prepend=-1))
        for number, candidates in zip(parts[first_of_each_part], np.split(points, first_of_each_part[1:])):
            candidates = candidates[~inside[candidates]]
            xy = xy_of(places[candidates])
            inside[candidates] = shapely.contains_xy(self._parts[number], xy)
        return inside.reshape(z.shape)
