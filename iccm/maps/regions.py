"""Rigid regions of a map, and figures about them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from ..arrays import Complex, Index, complex_of, xy_of
from ..curve import Curve, polygon_of
from ..plane import triangle_areas
from .distortion import weighted_quantile
from .triangulated.map import TriangulatedMap, inverted
from .triangulated.patches import gradients

BENT_DILATATION = 1.02  # a region is not rigid if the dilatation exceeds this on 5 % of its area
SIZE_OFF_SHARE = (
    # Relative to the scale: largest differences of the scale within a rigid region, and from the requested one.
    0.02
)

Rings = tuple[Complex, ...]


@dataclass(frozen=True, eq=False)
class RigidRegion:
    """A rigid region of the source or of the target.

    Attributes:
        rings: its outline, counter-clockwise, then those of holes in it.
        dilatation: s1/s2 that is not exceeded on 95 % of its area.
        sizes: linear scale relative to the mean scale of the map (for a deformation, relative to the source):
            the 5th, 50th and 95th percentile over its area.
        turn: its rotation in degrees, counter-clockwise.
        of_target: whether it is a region of the target, in whose plane its rings are.
    """

    rings: Rings
    dilatation: float
    sizes: tuple[float, float, float]
    turn: float
    of_target: bool = False

    @classmethod
    def of(
        cls,
        map: TriangulatedMap,
        rings: Rings,
        mean: float = 1.0,
        *,
        of_target: bool = False,
        flat: Complex | None = None,
    ) -> "RigidRegion":
        """Return the figures of a region of a map, whose mesh has the region's outline as edges.

        Args:
            map: the map.
            rings: the region, on its side.
            mean: the map's mean scale.
            of_target: whether the side is the target.
            flat: (n,) positions of the mesh's vertices if the region is flattened separately; by default those
                of the map.
        """
        faces = map.faces[triangles_in(map, rings, of_target=of_target)]
        source, image = map.source, map.image
        if flat is not None:
            source, image = (source, flat) if of_target else (flat, image)
        areas = triangle_areas(source[faces])
        a, b = inverted(*gradients(faces, image, source))
        dilatations = (np.abs(a) + np.abs(b)) / np.maximum(np.abs(a) - np.abs(b), 1e-300)
        sizes = np.sqrt(np.maximum(np.abs(a) ** 2 - np.abs(b) ** 2, 0)) / mean
        least, middle, most = (weighted_quantile(sizes, areas, q) for q in (0.05, 0.5, 0.95))
        turn = float(np.degrees(np.angle(np.sum(areas * a))))
        dilatation = weighted_quantile(dilatations, areas, 0.95)
        return cls(rings, dilatation, (least, middle, most), turn, of_target)

    @property
    def scale(self) -> float:
        """Its scale relative to the mean scale of the map."""
        return self.sizes[1]

    @property
    def is_rigid(self) -> bool:
        """Whether it is visually indistinguishable from a similar one."""
        least, middle, most = self.sizes
        return (
            self.dilatation <= BENT_DILATATION
            and max(most - middle, middle - least) <= SIZE_OFF_SHARE * middle
        )

    def report(self) -> dict[str, Any]:
        """Return the figures for the report."""
        size = dict(zip(("p05", "p50", "p95"), self.sizes))
        side = {"of": "target"} if self.of_target else {}
        return {"dilatation": self.dilatation, "size": size, "scale": self.scale, "turn": self.turn, **side}


def mean_scale(domain: Curve, target: Curve | None, holes: tuple[Sequence[Curve], Sequence[Curve]]) -> float:
    """Return the root of the ratio of both areas, without holes; 1 without a target."""
    if target is None:
        return 1.0
    areas = [
        outer.area - sum(abs(hole.area) for hole in inner) for outer, inner in zip((domain, target), holes)
    ]
    return float(np.sqrt(areas[1] / areas[0]))


def triangles_in(map: TriangulatedMap, rings: Rings, *, of_target: bool = False) -> Index:
    """Return (k,) the triangles of a map whose centroids are in a region of the source, or of the target."""
    polygon = polygon_of(*rings)
    shapely.prepare(polygon)
    middles = (map.image if of_target else map.source)[map.faces].mean(axis=1)
    return np.flatnonzero(shapely.contains_xy(polygon, middles.real, middles.imag))


def rings_of(z: Complex, faces: Index) -> list[Rings]:
    """Return the outlines of the area that triangles (m, 3) of a mesh without folds cover.

    There is one item per part: its outline, counter-clockwise, and those of its holes.
    """
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, times = np.unique(sides, axis=0, return_counts=True)
    lines = shapely.linestrings(xy_of(z[edges[times == 1]]))
    parts = [
        shapely.geometry.polygon.orient(part)
        for part in shapely.get_parts(shapely.build_area(shapely.multilinestrings(lines)))
    ]
    return [
        tuple(complex_of(shapely.get_coordinates(ring)[:-1]) for ring in (part.exterior, *part.interiors))
        for part in parts
    ]


def outline_in_source(region: RigidRegion, inverse: Callable[[Complex], Complex]) -> Complex:
    """Return (p,) the outer outline of a rigid region, in the source of the map with this inverse."""
    return inverse(region.rings[0]) if region.of_target else region.rings[0]
