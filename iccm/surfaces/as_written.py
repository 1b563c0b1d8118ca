"""The figures of new texture coordinates: of the linear maps and the chords that a file holds, not of the map behind
them, of which it has the vertices alone."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Complex
from ..curve import Curve, boundary_samples
from ..maps.distortion import Distortion
from ..meshes.flatten import Flattening
from ..meshes.mesh import face_areas
from ..meshes.stretch import laid_flat, linear
from ..plane import triangle_areas
from ..result import distances, hausdorff

PER_EDGE = 8  # places of a chord whose distances are taken (by hand)


@dataclass(frozen=True, eq=False)
class Written:
    """What new coordinates of a surface are.

    Attributes:
        distortion: from the plane of the picture to the surface, a sample a triangle.
        boundary: `rms` and two-sided `hausdorff` distance of the chords between its vertices to the picture's outline,
            relative to that.
    """

    distortion: Distortion
    boundary: dict[str, float]

    @classmethod
    def of(cls, z: Complex, layout: Flattening, outline: Curve) -> "Written":
        """Of a layout's vertices (n,) in the plane of a picture with this outline."""
        return cls(_distortion(z, layout), _boundary(z[layout.loop], outline))

    def report(self) -> dict[str, Any]:
        """As in the JSON report."""
        found = self.distortion.report()
        found.pop("turn")  # triangles in space have no upright
        return {**found, "boundary": self.boundary}


def _distortion(z: Complex, layout: Flattening) -> Distortion:
    corners, space = z[layout.patch.faces], layout.patch.points[layout.patch.faces]
    area, before = face_areas(space), np.abs(triangle_areas(corners))
    with np.errstate(all="ignore"):
        f_z, f_zbar = linear(corners, laid_flat(space))
    known = np.isfinite(f_z) & np.isfinite(f_zbar)
    f_z, f_zbar = (np.where(known, part, 1.0) for part in (f_z, f_zbar))  # without area: folded
    return Distortion(area, f_z, f_zbar, float(np.sqrt(area.sum() / before.sum())))


def _boundary(z: Complex, outline: Curve) -> dict[str, float]:
    chords = Curve(z)
    away = distances(boundary_samples(z, PER_EDGE), outline)
    rms = np.sqrt(np.average(away**2, weights=np.repeat(chords.lengths, PER_EDGE)))
    return {
        "rms": float(rms) / outline.diagonal,
        "hausdorff": hausdorff(chords, outline) / outline.diagonal,
    }
