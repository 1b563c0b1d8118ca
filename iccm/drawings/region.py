"""A painted region, asked many times which points it contains."""

import shapely

from ..arrays import Complex, Flags


class Region:
    """A region with its area, prepared for queries.

    Parameters
    ----------
    painted
        A valid Polygon or MultiPolygon.
    """

    def __init__(self, painted: shapely.Geometry):
        self.painted = painted
        self.area = float(painted.area)
        shapely.prepare(painted)

    def contains(self, z: Complex) -> Flags:
        """Return which points (any shape) lie in it."""
        return shapely.contains_xy(self.painted, z.real, z.imag)
