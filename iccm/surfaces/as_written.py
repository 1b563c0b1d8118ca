"""Distortion and accuracy of new texture coordinates.

A file stores only the vertices of a map. A viewer interpolates linearly between them, so the numbers here describe the
piecewise linear map and the straight chords between its boundary vertices, not the map that was solved for.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from ..arrays import Complex, Real, xy_of
from ..curve import Curve, boundary_samples, hausdorff
from ..maps.distortion import Distortion, weighted_quantile
from ..maps.triangulated.simple import fault
from ..meshes.flatten import Flattening, overlap
from ..meshes.mesh import face_areas
from ..meshes.stretch import laid_flat, linear
from ..plane import orientation, polygon_area, triangle_areas

SLIT_AREA_SHARE = 1e-12  # of the layout's area: rounding makes a slit enclose less than this
SAMPLES_PER_EDGE = 8
"""Samples of each chord at which its distance to the outline is taken: outlines between vertices bend once at
most."""


@dataclass(frozen=True, eq=False)
class WrittenCoordinates:
    """Measurements of a surface's new texture coordinates.

    Attributes:
        distortion: of the map from the picture's plane to the surface, one sample per triangle.
        boundary: `rms` and two-sided `hausdorff` distance between the picture's outline and the chords between boundary
            vertices, relative to the outline's diagonal; 0 for packed charts.
        log10_area: quantiles of log10 of the area scale, weighted by area in the picture.
        packed: whether these are charts inside the picture, which need not reach its outline.
        one_to_one: whether it is certain that no two triangles overlap.
    """

    distortion: Distortion
    boundary: dict[str, float]
    log10_area: dict[str, float]
    packed: bool = False
    one_to_one: bool = False

    @classmethod
    def of(cls, z: Complex, layout: Flattening, outline: Curve) -> "WrittenCoordinates":
        """Measure a layout with vertices z (n,) in the plane of a picture with the given outline.

        Charts that are packed inside the picture do not have to reach the outline.
        """
        corners, space = z[layout.patch.faces], layout.patch.points[layout.patch.faces]
        layout_areas, space_areas = np.abs(triangle_areas(corners)), face_areas(space)
        return cls(
            _distortion(corners, space, float(np.sqrt(space_areas.sum() / layout_areas.sum()))),
            {"rms": 0.0, "hausdorff": 0.0} if layout.outlines else _boundary(z[layout.loop], outline),
            _scales(layout_areas, space_areas),
            bool(layout.outlines),
            _is_one_to_one(z, layout),
        )

    def report(self) -> dict[str, Any]:
        """Return the measurements as they appear in the JSON report."""
        figures = self.distortion.report()
        figures.pop("turn")  # triangles in space have no upright direction
        boundary = {} if self.packed else {"boundary": self.boundary}
        if self.one_to_one:
            figures["injective"] = {
                "certified": True,
                "share": 1.0,
                "zeros": 0,
                "simple_image": True,
                "obstacle": "",
            }
        return {**figures, **boundary, "log10_area": self.log10_area}


def _is_one_to_one(z: Complex, layout: Flattening) -> bool:
    """Return whether it is certain, by exact predicates, that a layout's triangles at z (n,) do not overlap.

    If all triangles are counter-clockwise, the number of triangles over a point is the winding number of the boundary
    about it. A simple outer boundary winds at most once about any point. A hole may be a slit: it adds nothing as long
    as it winds about no point, or clockwise.
    """
    faces, loops = layout.patch.faces, layout.patch.loops
    if not np.isfinite(z).all() or (orientation(*(z[faces[:, k]] for k in range(3))) <= 0).any():
        return False
    if layout.outlines:
        return overlap(replace(layout, flat=z)) is None
    holes = [z[loop] for loop in loops if not np.array_equal(loop, layout.loop)]
    most = SLIT_AREA_SHARE * abs(polygon_area(z[layout.loop]))
    return not fault([z[layout.loop]]) and all(_area_wound(hole) <= most for hole in holes)


def _area_wound(loop: Complex) -> float:
    """Return the area of the points about which a closed polyline (n,) has a positive winding number."""
    if not fault([loop]):
        return max(polygon_area(loop), 0.0)
    if not fault([loop[::-1]]):
        return 0.0
    ring = shapely.LineString(xy_of(np.append(loop, loop[:1])))
    regions = shapely.get_parts(shapely.polygonize([shapely.node(ring)]))
    inside = [complex(region.representative_point().x, region.representative_point().y) for region in regions]
    winding = [np.angle((np.roll(loop, -1) - z) / (loop - z)).sum() for z in inside]
    return float(sum(region.area for region, turns in zip(regions, winding) if turns > 1))


def _scales(layout_areas: Real, space_areas: Real) -> dict[str, float]:
    scales = np.log10(np.maximum(space_areas, 1e-300) / np.maximum(layout_areas, 1e-300))
    shares = {"p05": 0.05, "median": 0.5, "p95": 0.95}
    return {name: weighted_quantile(scales, layout_areas, share) for name, share in shares.items()}


def _distortion(corners: Complex, space: Real, scale: float) -> Distortion:
    with np.errstate(all="ignore"):
        f_z, f_zbar = linear(corners, laid_flat(space))
    finite = np.isfinite(f_z) & np.isfinite(f_zbar)
    f_z, f_zbar = (np.where(finite, part, 1.0) for part in (f_z, f_zbar))  # no area: counts as folded
    return Distortion(face_areas(space), f_z, f_zbar, scale)


def _boundary(z: Complex, outline: Curve) -> dict[str, float]:
    chords = Curve(z)
    away = outline.distances(boundary_samples(z, SAMPLES_PER_EDGE))
    rms = np.sqrt(np.average(away**2, weights=np.repeat(chords.lengths, SAMPLES_PER_EDGE)))
    return {
        "rms": float(rms) / outline.diagonal,
        "hausdorff": hausdorff(chords, outline) / outline.diagonal,
    }
