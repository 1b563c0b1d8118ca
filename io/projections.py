"""Equal-area projections of longitudes and latitudes on the sphere with the earth's surface area (Snyder 1987)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..arrays import Real

RADIUS_METRES = 6371007.181  # of the sphere with the area of the WGS 84 ellipsoid
WIDEST_DEGREES = 150.0  # of longitude or latitude for the azimuthal projection
LEAST_GAP_DEGREES = 20.0
"""Of longitude: if no data lie in such a gap, the map is cut there instead of at 180 degrees."""
NEAR_DEGREES = 1e-6  # of longitude: points this close to 180 degrees are on the meridian
EQUAL_EARTH = 1.340264, -0.081106, 0.000893, 0.003796  # coefficients (Šavrič, Patterson and Jenny 2018)


@dataclass(frozen=True)
class EqualArea:
    """An equal-area projection: Lambert's azimuthal one around a point, or Equal Earth for most of the world.

    Attributes:
        longitude: of the centre, in degrees.
        latitude: of the centre; None for Equal Earth.
    """

    longitude: float
    latitude: float | None

    @classmethod
    def of(cls, geometries: Sequence[shapely.Geometry]) -> EqualArea:
        """Return the projection for geometries in degrees.

        They lie in the arc of longitudes opposite the widest gap. Without a gap it is Equal Earth around Greenwich, for
        a wide arc or a wide range of latitudes Equal Earth around the arc's middle, else Lambert's projection around
        the middle.
        """
        xy = shapely.get_coordinates(np.array(geometries))
        longitudes = np.unique(xy[:, 0] % 360)
        gaps = np.diff(longitudes, append=longitudes[0] + 360)
        widest = int(np.argmax(gaps))
        low, high = float(xy[:, 1].min()), float(xy[:, 1].max())
        if gaps[widest] < LEAST_GAP_DEGREES:
            return cls(0.0, None)
        span = 360 - float(gaps[widest])
        start = float(longitudes[(widest + 1) % longitudes.size])
        centre = (start + span / 2 + 180) % 360 - 180
        is_wide = span > WIDEST_DEGREES or high - low > WIDEST_DEGREES
        return cls(round(centre, 4), None if is_wide else round((low + high) / 2, 4))

    @property
    def name(self) -> str:
        """The coordinate reference system, as PROJ and GDAL read it."""
        if self.latitude is None:
            return f"+proj=eqearth +lon_0={self.longitude:g} +R={RADIUS_METRES} +units=m"
        origin = f"+lat_0={self.latitude:g} +lon_0={self.longitude:g}"
        return f"+proj=laea {origin} +R={RADIUS_METRES} +units=m"

    def project(self, geometry: shapely.Geometry) -> shapely.Geometry:
        """Return a polygon or multipolygon in metres, with parts that were cut at 180 degrees joined."""
        parts = [shapely.transform(part, self._near_centre) for part in shapely.get_parts(geometry)]
        if self.longitude and len(parts) > 1:
            parts = list(shapely.get_parts(shapely.union_all(parts)))
        whole = parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)
        return shapely.transform(whole, self.forward)

    def _near_centre(self, xy: Real) -> Real:
        """Return coordinates of a polygon in degrees shifted by full turns to within 180 degrees of the centre."""
        x = np.where(np.abs(np.abs(xy[:, 0]) - 180) < NEAR_DEGREES, np.copysign(180.0, xy[:, 0]), xy[:, 0])
        turns = np.round((self.longitude - (x.min() + x.max()) / 2) / 360)
        return np.column_stack([x + 360 * turns, xy[:, 1]])

    def forward(self, degrees: Real) -> Real:
        """Return (n, 2) metres for (n, 2) degrees."""
        across = np.radians(degrees[:, 0] - self.longitude)
        up = np.radians(np.clip(degrees[:, 1], -90, 90))
        if self.latitude is None:
            return RADIUS_METRES * _equal_earth(across, up)
        latitude = np.radians(self.latitude)
        toward = np.sin(latitude) * np.sin(up) + np.cos(latitude) * np.cos(up) * np.cos(across)
        size = np.sqrt(2 / np.maximum(1 + toward, 1e-9))
        x = np.cos(up) * np.sin(across)
        y = np.cos(latitude) * np.sin(up) - np.sin(latitude) * np.cos(up) * np.cos(across)
        return RADIUS_METRES * size[:, None] * np.column_stack([x, y])


def _equal_earth(across: Real, up: Real) -> Real:
    a, b, c, d = EQUAL_EARTH
    t = np.arcsin(np.sqrt(3) / 2 * np.sin(up))
    slope = 9 * d * t**8 + 7 * c * t**6 + 3 * b * t**2 + a
    y = d * t**9 + c * t**7 + b * t**3 + a * t
    return np.column_stack([2 * np.sqrt(3) * across * np.cos(t) / (3 * slope), y])
