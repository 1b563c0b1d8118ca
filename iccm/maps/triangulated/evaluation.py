"""Values and derivatives of the patches at given positions."""

import numpy as np

from ...arrays import Complex, Real
from ...native import function
from ...parallel import over_slices
from .adjacency import Index

_evaluate = function(
    """int64_t iccm_maps_evaluate(
        const Complex *control, const Complex *corners, const int64_t *triangle, const double *place, int64_t start,
        int64_t stop, int64_t p, Complex *out)"""
)


def evaluate(
    patches: Complex, corners: Complex, triangle: Index, place: Real, threads: int | None = None
) -> tuple[Complex, Complex, Complex, Complex]:
    """Evaluate the inverse and its derivatives.

    Args:
        patches: (m, 6) source points of the corners, and bulges of the sides opposite to them.
        corners: (m, 3) corners in the image.
        triangle, place: (p,) triangles, -1 for none, and (p, 3) barycentric coordinates in the image.
        threads: number of threads; by default one per processor. The result does not depend on it.

    Returns:
        z, w, and the derivatives of z with respect to w and w̄; (p,) each, NaN if there is no triangle.
    """
    count = triangle.size
    patches, corners = (np.ascontiguousarray(array, np.complex128) for array in (patches, corners))
    triangle, place = np.ascontiguousarray(triangle, np.int64), np.ascontiguousarray(place, np.float64)
    out = np.full((4, count), complex(np.nan, np.nan))
    over_slices(
        lambda part: _evaluate(patches, corners, triangle, place, part.start, part.stop, count, out),
        count,
        threads,
    )
    return out[0], out[1], out[2], out[3]
