"""Figures of a piecewise linear map: turn, stretch, dilatation and scale."""

import numpy as np

from ...arrays import Complex, Index, Real
from ...maps.distortion import weighted_quantile
from ...plane import triangle_areas
from .metric import PLANES, Metrics, rest_geometry

MOST_DILATED, DILATATION_HALVINGS = 1e6, 30
"""Where the least dilatation is looked for, on a logarithmic scale."""


def derivatives(
    z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES
) -> tuple[Complex, Complex, Real]:
    """Return (m,) f_z, f_z̄ and areas of the source's triangles, between surfaces where there are metrics."""
    gradients, areas = rest_geometry(z, u, faces, metrics)
    values = u[faces]
    return (gradients * values).sum(1), (gradients.conj() * values).sum(1), areas


def turn_of(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> float:
    """Radians by which the map turns the picture on average: those of its mean derivative, and of the inverse map's."""
    a, _, areas = derivatives(z, u, faces, metrics)
    return float(np.angle(np.sum(areas * a)))


def stretches(z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> tuple[Real, Real, Real]:
    """Return (m,) dilatation K = s1/s2, stretch max(s1, 1/s2) and determinant, both domains' areas taken as one."""
    a, b, _ = derivatives(z, u, faces, metrics)
    large, small = np.abs(a) + np.abs(b), np.abs(a) - np.abs(b)
    small = np.maximum(small, 1e-300)
    return large / small, np.maximum(large, 1 / small), large * small


def least_dilatations(z: Complex, u: Complex, faces: Index, border: int) -> Real:
    """Return (m,) the least dilatation that triangles at a vertex of the outline, the first `border` ones, can all
    have, by the angles inside; 1 elsewhere. With dilatation K a triangle's angle α becomes one between 2 atan(tan(α/2)
    / K) and 2 atan(K tan(α/2)), and these have to sum up to the angle of the image.
    """
    beside = np.flatnonzero((faces < border).any(axis=1))
    near = faces[beside]

    def angles(w: Complex) -> Real:
        corners = w[near]
        return np.angle((np.roll(corners, 1, 1) - corners) / (np.roll(corners, -1, 1) - corners))

    def around(values: Real) -> Real:
        return np.bincount(near.ravel(), values.ravel(), z.size)[:border].astype(float)

    half, found = np.tan(0.5 * angles(z)), around(angles(u))
    low, high = np.zeros(border), np.full(border, np.log(MOST_DILATED))
    for _ in range(DILATATION_HALVINGS):
        middle = 0.5 * (low + high)
        k = np.append(np.exp(middle), np.ones(z.size - border))[near]
        can = (found <= around(2 * np.arctan(k * half))) & (found >= around(2 * np.arctan(half / k)))
        low, high = np.where(can, low, middle), np.where(can, middle, high)
    least = np.ones(len(faces))
    least[beside] = np.append(np.exp(low), np.ones(z.size - border))[near].max(axis=1)
    return least


def stretch_quantile(z: Complex, u: Complex, faces: Index, share: float) -> float:
    """Return the stretch that a share of the area keeps to, half the source's and half the target's."""
    _, stretch, determinant = stretches(z, u, faces)
    return weighted_quantile(stretch, triangle_areas(z[faces]) * (1 + determinant), share)
