"""Choose the visible sheet of a folded map: the one that is connected to the widest place."""

import numpy as np

from ..arrays import Complex, Index, Real
from ..native import function
from .triangulated.patches import cross

_flood = function(
    """int64_t iccm_maps_flood(
        const int64_t *widest, int64_t k, const int64_t *across, const double *clearance, int64_t m, double *reached)"""
)


def by_sheets(image: Complex, faces: Index, across: Index, clearance: Real) -> tuple[Index, int]:
    """Return the triangles in the order in which they cover each other, and the number of visible ones.

    Of two triangles with overlapping images, that one is on top which can be reached by a wider path from the
    triangle with the largest clearance, over triangles that are not turned over. Turned-over triangles are
    invisible, and come last.

    Args:
        image: (n,) images of the vertices.
        faces: (m, 3) triangles.
        across: (m, 3) the triangles across their sides, -1 for none.
        clearance: (m,) distance of each image from the image of the boundary.
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
