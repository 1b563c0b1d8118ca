"""The domains of the maps that carry a drawing: what lies in them, and the maps there."""

from collections.abc import Sequence
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

NEAR = 3e-4  # of the source's diagonal: no farther outside counts as on the outline, which is flattened
EXACTER = 0.1  # by this share of the tolerance maps may err of which paths are images within it (by hand)
ALONG = np.arange(9) / 8  # parameters on a piece at which it is looked for


class Region:
    """The domain of a map.

    Args:
        source: the shape that the map was made for.
        map: source → target, core plane.
        tolerance: of images, in the target's units.
    """

    def __init__(self, source: Shape, map: AnyMap, tolerance: float):
        exact = isinstance(map, HarmonicMap)
        self.map: Any = triangulated(map, image_error=EXACTER * tolerance) if exact else map
        self.rims = [Curve(rim) for rim in map.rims]
        gap = float(self.rims[0].distances(source.curve.z).max())
        self.domain = Domain(self.rims[0], max(1.2 * gap, NEAR * source.curve.diagonal), self.rims[1:])

    def jet(self, z: Complex) -> tuple[Complex, ...]:
        """Points, images and derivatives; points that are not inside are replaced by those of the outline."""
        z = z.copy()
        jet = self.map.jet(z)
        far = float(np.abs(self.rims[0].z).max())
        for inward in (
            0.0,
            1e-9 * self.map.diagonal + 8 * np.spacing(far),
        ):  # where rounding puts it outside again
            lost = np.flatnonzero(np.isnan(jet[0]))
            if not lost.size:
                break
            z[lost] = self._on_rim(z[lost], inward)
            for values, found in zip(jet, self.map.jet(z[lost])):
                values[lost] = found
        return z, *jet

    def _on_rim(self, z: Complex, inward: float) -> Complex:
        """Return the closest points of the boundary, moved inward."""
        arclengths = np.array([rim.closest(z) for rim in self.rims])
        feet = np.array([rim.at(s) for rim, s in zip(self.rims, arclengths)])
        nearest = np.abs(feet - z).argmin(axis=0)
        for number, (rim, s) in enumerate(zip(self.rims, arclengths)):
            edge, _ = rim.locate(s)
            feet[number] -= inward * rim.normals[edge]
        return feet[nearest, np.arange(z.size)]


class Regions:
    """The domains of several maps, the smallest first."""

    def __init__(self, regions: Sequence[Region]):
        self.given = regions
        self.all = sorted(regions, key=lambda region: region.domain.polygon.area)
        reaches = [region.domain.reach for region in self.all]
        self.outer = [
            region
            for k, region in enumerate(self.all)
            if not any(reach.contains(region.domain.polygon) for reach in reaches[k + 1 :])
        ]

    def of(self, runs: Sequence[PenPath]) -> list[Region]:
        """Return the smallest that holds all of the runs; where none does, those that are in no other."""
        if len(self.all) == 1:
            return self.all
        z = np.concatenate([piece.at(ALONG) for run in runs for piece in run.pieces])
        for region in self.all:
            if shapely.contains_xy(region.domain.reach, z.real, z.imag).all():
                return [region]
        return self.outer
