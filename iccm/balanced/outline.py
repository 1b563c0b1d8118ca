"""Outlines made ready for one level of the solver: simplified, with corners where vertices belong."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..curve import Curve
from .kernels import Complex, Index, Real
from .sliding import Rail

SHARP = np.radians(20)  # turn from which sliding vertices stop at a corner; smaller kinks are passed


@dataclass(frozen=True, eq=False)
class Outline:
    """One loop of a domain's boundary at one level.

    Attributes:
        curve: the simplified polyline, counter-clockwise.
        corners: (c,) ascending arclengths of the vertices that every mesh of this level holds.
    """

    curve: Curve
    corners: Real

    @classmethod
    def of(cls, curve: Curve, fineness: float, corner_fineness: float) -> "Outline":
        """Simplified to `fineness`, the vertices kept at `corner_fineness` being corners; both shares of the diagonal."""
        fine = simplified(curve, fineness)
        return cls(fine, fine.knots[kept_vertices(fine, corner_fineness)])

    @property
    def length(self) -> float:
        """Arclength all around."""
        return self.curve.length

    @cached_property
    def rail(self) -> Rail:
        """The polyline that vertices slide on."""
        edges = self.curve.edges
        sharp = np.abs(np.angle(edges / np.roll(edges, 1))) > SHARP
        return Rail(self.curve.knots, self.curve.z, self.curve.knots[:-1][sharp])


def simplified(curve: Curve, fineness: float) -> Curve:
    """The curve with fewer of its vertices, within `fineness` of its diagonal, still simple and its first vertex kept."""
    kept = kept_vertices(curve, fineness)
    return curve if kept.size == curve.z.size else Curve(curve.z[kept])


def kept_vertices(curve: Curve, fineness: float) -> Index:
    """The vertices that Douglas and Peucker (1973) keep, with the topology preserved."""
    ring = shapely.Polygon(_pairs(curve.z)).simplify(fineness * curve.diagonal).exterior
    kept = shapely.get_coordinates(ring) @ np.array([1, 1j])
    place = {z: k for k, z in enumerate(curve.z.tolist())}
    return np.unique([place[z] for z in kept.tolist()])


def _pairs(z: Complex) -> Real:
    return np.column_stack([z.real, z.imag])
