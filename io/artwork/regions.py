"""The domains of the maps that transfer a drawing: which domain contains a shape, and the map on it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import shapely

from ...arrays import Complex
from ...curve import Curve
from ...maps.approximation import AnyMap, triangulated
from ...maps.harmonic import HarmonicMap
from ..shapes.shape import Shape
from ..svg.path_data import PenPath
from .clip import Domain

NEAR_DIAGONAL_SHARE = 3e-4
"""Of the source's diagonal: points this close outside count as on the outline, which is flattened."""
MAP_ERROR_SHARE = 0.1
"""Of the tolerance: allowed error of the map when paths are fitted within the tolerance: a tenth, so that it can be
neglected."""
ALONG = np.arange(9) / 8  # parameters at which segments are tested


class MapDomain:
    """The domain of a map.

    Args:
        source: the shape that the map was made for.
        map: source → target, core plane.
        tolerance: of images, in the target's units.
    """

    def __init__(self, source: Shape, map: AnyMap, tolerance: float):
        exact = isinstance(map, HarmonicMap)
        self.map: Any = triangulated(map, image_error=MAP_ERROR_SHARE * tolerance) if exact else map
        self.rims = [Curve(rim) for rim in map.rims]
        gap = float(self.rims[0].distances(source.curve.z).max())
        self.domain = Domain(
            self.rims[0], max(1.2 * gap, NEAR_DIAGONAL_SHARE * source.curve.diagonal), self.rims[1:]
        )

    def images(self, z: Complex) -> tuple[Complex, ...]:
        """Return points and images; points outside are moved to the outline."""
        return self._inside(lambda z: (self.map(z),), z)

    def jet(self, z: Complex) -> tuple[Complex, ...]:
        """Return points, images and derivatives; points outside are moved to the outline."""
        return self._inside(self.map.jet, z)

    def _inside(self, evaluate: Callable[[Complex], tuple[Complex, ...]], z: Complex) -> tuple[Complex, ...]:
        """Return points, moved to the outline where they are outside, and what the map's function has there."""
        z = z.copy()
        values = evaluate(z)
        extent = float(np.abs(self.rims[0].z).max())
        for inward in (
            0.0,
            1e-9 * self.map.diagonal + 8 * np.spacing(extent),
        ):  # retry a little further inside if rounding leaves a point outside
            outside = np.flatnonzero(np.isnan(values[0]))
            if not outside.size:
                break
            z[outside] = self._on_rim(z[outside], inward)
            for into, corrected in zip(values, evaluate(z[outside])):
                into[outside] = corrected
        return z, *values

    def _on_rim(self, z: Complex, inward: float) -> Complex:
        """Return the closest points of the boundary, moved inwards by a distance."""
        arclengths = np.array([rim.closest(z) for rim in self.rims])
        feet = np.array([rim.at(s) for rim, s in zip(self.rims, arclengths)])
        nearest = np.abs(feet - z).argmin(axis=0)
        for number, (rim, s) in enumerate(zip(self.rims, arclengths)):
            edge, _ = rim.locate(s)
            feet[number] -= inward * rim.normals[edge]
        return feet[nearest, np.arange(z.size)]


class MapDomains:
    """The domains of several maps, sorted by area."""

    def __init__(self, regions: Sequence[MapDomain]):
        self.in_order = regions
        self.all = sorted(regions, key=lambda region: region.domain.polygon.area)
        reaches = [region.domain.reach for region in self.all]
        self.outer = [
            region
            for k, region in enumerate(self.all)
            if not any(reach.contains(region.domain.polygon) for reach in reaches[k + 1 :])
        ]

    def of(self, runs: Sequence[PenPath]) -> list[MapDomain]:
        """Return the smallest domain that contains all subpaths, or else all domains that are not inside another."""
        if len(self.all) == 1:
            return self.all
        z = np.concatenate([piece.at(ALONG) for run in runs for piece in run.pieces])
        for region in self.all:
            if shapely.contains_xy(region.domain.reach, z.real, z.imag).all():
                return [region]
        return self.outer
