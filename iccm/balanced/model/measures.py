"""Figures of a piecewise linear map: turn, stretch, dilatation and scale."""

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...maps.distortion import weighted_quantile
from ...plane import triangle_areas
from ..minimise.energy import NO_SLOTS, Objective, RestShapes, energy_of
from .metric import PLANES, Metrics, rest_geometry


def derivatives(
    z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES
) -> tuple[Complex, Complex, Real]:
    """(m,) f_z, f_z̄ and areas of the source's triangles, between surfaces where there are metrics."""
    gradients, areas = rest_geometry(z, u, faces, metrics)
    values = u[faces]
    return (gradients * values).sum(1), (gradients.conj() * values).sum(1), areas


def turn_of(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> float:
    """Radians by which the map turns the picture on average: over half the source's area and half the target's.

    Both areas are taken as one.
    """
    a, b, areas = derivatives(z, u, faces, metrics)
    weight = areas * (1 + np.abs(a) ** 2 - np.abs(b) ** 2)
    return float(np.angle(np.sum(weight * a / np.maximum(np.abs(a), 1e-300))))


def stretches(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> tuple[Real, Real, Real]:
    """(m,) dilatation K = s1/s2, stretch max(s1, 1/s2) and determinant, both domains' areas taken as one."""
    a, b, _ = derivatives(z, u, faces, metrics)
    large, small = np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)
    small = np.maximum(small, 1e-300)
    return large / small, np.maximum(large, 1 / small), large * small


def forced(z: Complex, u: Complex, faces: Index, border: int, dilatation: float) -> Flags:
    """(m,) triangles at vertices of the outline, the first `border` ones, where the angles inside leave no piecewise
    linear map a dilatation so small: it takes a triangle's angle α to between 2 atan(tan(α/2) / K) and
    2 atan(K tan(α/2)), which have to sum up to the angle of the image."""

    def angles(w: Complex) -> Real:
        corners = w[faces]
        return np.angle((np.roll(corners, 1, 1) - corners) / (np.roll(corners, -1, 1) - corners))

    def around(values: Real) -> Real:
        return np.bincount(faces.ravel(), values.ravel(), z.size)

    half, found = np.tan(0.5 * angles(z)), around(angles(u))
    beyond = found > around(2 * np.arctan(dilatation * half))
    beyond |= found < around(2 * np.arctan(half / dilatation))
    beyond[border:] = False
    return beyond[faces].any(axis=1)


def stretch_quantile(z: Complex, u: Complex, faces: Index, share: float) -> float:
    """The stretch that a share of the area keeps to, half the source's and half the target's."""
    _, stretch, determinant = stretches(z, u, faces)
    return weighted_quantile(stretch, triangle_areas(z[faces]) * (1 + determinant), share)


def energy_between(z: Complex, u: Complex, faces: Index, theta: float, metrics: Metrics = PLANES) -> float:
    """The energy at q = 1 without the outline's term, both areas taken as one."""
    if metrics == PLANES:
        return energy_of(z, u, faces, theta)
    rest = RestShapes(faces, NO_SLOTS, *rest_geometry(z, u, faces, metrics))
    return rest.energy(u, Objective.of(theta, 1.0))
