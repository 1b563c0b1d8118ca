"""Prepare outlines for one level of the solver: simplify them, and choose the corners that get vertices."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ...arrays import Index, Real, complex_of, distinct
from ...curve import Curve
from ..minimise.sliding import Rail

SHARP_CORNER_RADIANS = np.radians(20)  # angle from which sliding vertices stop at a corner

FINENESS_OF_TOLERANCE = (
    0.2  # relative to the tolerance: largest distance of simplified outlines from the given ones
)
MOST_OUTLINE_VERTICES = 3000  # outlines with more are simplified further


@dataclass(frozen=True, eq=False)
class Outline:
    """One loop of a domain's boundary at one level.

    Attributes:
        curve: the simplified polyline, counter-clockwise.
        corners: (c,) ascending arclengths of the vertices that every mesh of this level has.
        origins: (n + 1,) arclengths of the polyline's knots on the original curve.
    """

    curve: Curve
    corners: Real
    origins: Real

    @classmethod
    def of(
        cls,
        curve: Curve,
        fineness: float,
        corner_fineness: float,
        always: tuple[complex, ...] = (),
        spacing: float = np.inf,
    ) -> "Outline":
        """Simplify a curve, and choose its corners by simplifying it further.

        Args:
            curve: the curve to simplify.
            fineness: largest distance of the polyline from the curve, relative to the diagonal.
            corner_fineness: the same for the polyline of the corners alone.
            always: vertices that are kept, and are corners.
            spacing: edge length of the mesh. If finite, a vertex is a corner only where the outline bends by
                more than SHARP_CORNER_RADIANS within this length.
        """
        kept = kept_vertices(curve, fineness, always)
        fine = Curve(curve.z[kept])
        origins = np.append(curve.knots[kept], curve.knots[kept[0]] + curve.length)
        corners = kept_vertices(fine, corner_fineness, always)
        if spacing < np.inf:
            turning = _turning_within(Curve(fine.z[corners]), spacing) > SHARP_CORNER_RADIANS
            corners = corners[turning | np.isin(fine.z[corners], always)]
        return cls(fine, fine.knots[corners], origins)

    def original(self, s: Real) -> Real:
        """Return the arclengths on the original curve, linear between two vertices; laps are kept."""
        laps = np.floor(s / self.length)
        return np.interp(s - laps * self.length, self.curve.knots, self.origins) + laps * self._lap

    def simplified_from(self, s: Real) -> Real:
        """Return the arclengths on the simplified polyline; the inverse of `original`."""
        laps = np.floor((s - self.origins[0]) / self._lap)
        return np.interp(s - laps * self._lap, self.origins, self.curve.knots) + laps * self.length

    @property
    def shares(self) -> Real:
        """Positions of the vertices as shares of the original curve's length, from 0 to 1; shape (n,)."""
        return np.mod(self.origins[:-1] / self._lap, 1)

    def at_shares(self, shares: Real) -> Real:
        """Return the arclengths at shares of the original curve's length."""
        return self.simplified_from(shares * self._lap)

    @property
    def _lap(self) -> float:
        return float(self.origins[-1] - self.origins[0])

    def arclengths(self, vertices: tuple[complex, ...]) -> Real:
        """Return the arclengths of the polyline's vertices closest to the given points."""
        return self.curve.knots[[int(np.argmin(np.abs(self.curve.z - v))) for v in vertices]]

    @property
    def length(self) -> float:
        """Total arclength."""
        return self.curve.length

    @cached_property
    def rail(self) -> Rail:
        """The polyline that vertices slide on."""
        edges = self.curve.edges
        sharp = np.abs(np.angle(edges / np.roll(edges, 1))) > SHARP_CORNER_RADIANS
        return Rail(self.curve.knots, self.curve.z, self.curve.knots[:-1][sharp])


def _turning_within(curve: Curve, spacing: float) -> Real:
    """Return (n,) the turning angles in radians of a closed polyline around each vertex.

    They cover half the spacing before and after the vertex.
    """
    turning_angles = np.angle(curve.edges / np.roll(curve.edges, 1))
    sums = np.append(0, np.cumsum(np.tile(turning_angles, 3)))
    knots = curve.knots[:-1]
    laps = np.concatenate([knots - curve.length, knots, knots + curve.length])
    first = np.searchsorted(laps, knots - 0.5 * spacing)
    after = np.searchsorted(laps, knots + 0.5 * spacing, side="right")
    return np.maximum(np.abs(sums[after] - sums[first]), np.abs(turning_angles))


def simplify(curve: Curve, fineness: float, always: tuple[complex, ...] = ()) -> Curve:
    """Return the curve with fewer vertices, within `fineness` relative to its diagonal.

    It stays simple and keeps its first vertex.
    """
    kept = kept_vertices(curve, fineness, always)
    return curve if kept.size == curve.z.size else Curve(curve.z[kept])


def kept_vertices(curve: Curve, fineness: float, always: tuple[complex, ...] = ()) -> Index:
    """Return the indices of the vertices that simplification keeps, and of those in `always`.

    The method is that of Douglas & Peucker (1973), with the topology preserved.
    """
    ring = curve.polygon.simplify(fineness * curve.diagonal).exterior
    kept = complex_of(shapely.get_coordinates(ring)).tolist()
    place = {z: k for k, z in enumerate(curve.z.tolist())}
    return distinct(np.array([place[z] for z in (*kept, *always)]))


def manageable(curve: Curve, tolerance: float, always: tuple[complex, ...] = ()) -> Curve:
    """Return the outline simplified within a share of the tolerance, and further where it has too many vertices.

    Args:
        curve: the outline.
        tolerance: of the map, relative to the outline's diagonal.
        always: vertices to keep, fewer than MOST_OUTLINE_VERTICES.

    Each round simplifies the result of the last one: the time of GEOS is quadratic in the number of vertices on thin
    strips. The distances of all rounds add up to less than three times that of the last.
    """
    fineness = FINENESS_OF_TOLERANCE * tolerance
    fine = simplify(curve, fineness, always)
    while fine.z.size > MOST_OUTLINE_VERTICES:
        fineness *= 1.5
        fine = simplify(fine, fineness, always)
    return fine
