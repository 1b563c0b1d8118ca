"""The sheet of a folded map that is seen: the one that continues from the widest place."""

import numpy as np

from ..arrays import Complex, Index, Real
from ..native import function
from .triangulated.patches import cross

_flood = function(
    """int64_t iccm_maps_flood(
        const int64_t *widest, int64_t k, const int64_t *across, const double *clearance, int64_t m, double *reached)"""
)


def by_sheets(image: Complex, faces: Index, across: Index, clearance: Real) -> tuple[Index, int]:
    """Return the triangles in the order in which they lie over each other, and how many are seen at all.

    Of two triangles over one place the one lies on top to which a wider way leads from the triangle with most room
    around its image, over triangles that are not turned over. These are not seen, and come last.

    Args:
        image: (n,) images of the vertices.
        faces: (m, 3) triangles.
        across: (m, 3) those beyond their sides, -1 for none.
        clearance: (m,) how far each one's image is from that of the boundary.
    """
    a, b, c = image[faces].T
    up = cross(b - a, c - a) > 0
    upright = np.flatnonzero(up)
    widest = upright[np.argsort(-clearance[upright], kind="stable")]
    reached = np.full(len(faces), -1.0)
    across, clearance = np.ascontiguousarray(across, np.int64), np.ascontiguousarray(clearance, np.float64)
    _flood(widest, widest.size, across, clearance, len(faces), reached)
    order = widest[np.argsort(-reached[widest], kind="stable")]
    return faces[np.concatenate([order, np.flatnonzero(~up)])], upright.size
