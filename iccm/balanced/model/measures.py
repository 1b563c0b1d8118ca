"""Measure a piecewise linear map: rotation, stretch, dilatation and scale."""

import numpy as np

from ...arrays import Complex, Index, Real
from ...maps.distortion import weighted_quantile
from ...plane import triangle_areas
from .metric import PLANES, Metrics, rest_geometry

MOST_DILATED, DILATATION_HALVINGS = 1e6, 30
"""Upper end of the search for the least dilatation, and the number of bisections (on a logarithmic scale)."""


def derivatives(
    z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES
) -> tuple[Complex, Complex, Real]:
    """Return the derivatives of a piecewise linear map, one value per triangle.

    Args:
        z: (n,) vertices.
        u: (n,) their images.
        faces: (m, 3) triangles.
        metrics: of source and target, where these stand for surfaces; the derivatives are then those between
            the surfaces.

    Returns:
        (m,) f_z, (m,) f_z̄, and the (m,) areas of the source's triangles.
    """
    gradients, areas = rest_geometry(z, u, faces, metrics)
    values = u[faces]
    return (gradients * values).sum(1), (gradients.conj() * values).sum(1), areas


def mean_rotation(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> float:
    """Return the mean rotation of the picture in radians: the argument of the mean f_z.

    The inverse map has the opposite rotation exactly.
    """
    a, _, areas = derivatives(z, u, faces, metrics)
    return float(np.angle(np.sum(areas * a)))


def stretches(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> tuple[Real, Real, Real]:
    """Return (m,) dilatation K = s1/s2, stretch max(s1, 1/s2) and determinant, with both domains scaled to area one."""
    a, b, _ = derivatives(z, u, faces, metrics)
    large, small = np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)
    small = np.maximum(small, 1e-300)
    return large / small, np.maximum(large, 1 / small), large * small


def least_dilatations(z: Complex, u: Complex, faces: Index, border: int) -> Real:
    """Return lower bounds (m,) on the dilatation that follow from the angles at the outline's vertices; 1 inside.

    The triangles around a vertex of the outline (one of the first `border`) have to fill the angle of the image
    there. With dilatation K, an angle α of a triangle becomes one between 2 atan(tan(α/2) / K) and 2 atan(K
    tan(α/2)). The bound is the smallest K with which these angles can add up to the image's, found by
    bisection.
    """
    boundary_triangles = np.flatnonzero((faces < border).any(axis=1))
    corner_indices = faces[boundary_triangles]

    def angles(w: Complex) -> Real:
        corners = w[corner_indices]
        return np.angle((np.roll(corners, 1, 1) - corners) / (np.roll(corners, -1, 1) - corners))

    def around(values: Real) -> Real:
        return np.bincount(corner_indices.ravel(), values.ravel(), z.size)[:border].astype(float)

    half, angle_sums = np.tan(0.5 * angles(z)), around(angles(u))
    low, high = np.zeros(border), np.full(border, np.log(MOST_DILATED))
    for _ in range(DILATATION_HALVINGS):
        middle = 0.5 * (low + high)
        k = np.append(np.exp(middle), np.ones(z.size - border))[corner_indices]
        can = (angle_sums <= around(2 * np.arctan(k * half))) & (
            angle_sums >= around(2 * np.arctan(half / k))
        )
        low, high = np.where(can, low, middle), np.where(can, middle, high)
    least = np.ones(len(faces))
    least[boundary_triangles] = np.append(np.exp(low), np.ones(z.size - border))[corner_indices].max(axis=1)
    return least


def stretch_quantile(z: Complex, u: Complex, faces: Index, share: float) -> float:
    """Return the stretch that is not exceeded on a share of the area, source and target counting half each."""
    _, stretch, determinant = stretches(z, u, faces)
    return weighted_quantile(stretch, triangle_areas(z[faces]) * (1 + determinant), share)
