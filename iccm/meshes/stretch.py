"""How a piecewise linear map from a surface to the plane stretches its triangles."""

import numpy as np

from ..arrays import Complex, Real


def laid_flat(space: Real) -> Complex:
    """(m, 3) congruent copies in the plane of (m, 3, 3) triangles in space, counter-clockwise."""
    e1, e2 = space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]
    length = np.linalg.norm(e1, axis=1)
    x = np.einsum("ij,ij->i", e1, e2) / length
    y = np.linalg.norm(np.cross(e1, e2), axis=1) / length
    return np.stack([np.zeros_like(length), length, x + 1j * y], axis=1)


def stretches(space: Real, plane: Complex) -> tuple[Real, Real]:
    """Singular values of the affine maps of (m, 3, 3) triangles in space to (m, 3) in the plane, the smaller signed."""
    at = laid_flat(space)
    length, x, y = at[:, 1].real, at[:, 2].real, at[:, 2].imag
    along = (plane[:, 1] - plane[:, 0]) / length
    aside = (plane[:, 2] - plane[:, 0] - x * along) / y
    conformal, anti = 0.5 * np.abs(along - 1j * aside), 0.5 * np.abs(along + 1j * aside)
    return conformal + anti, conformal - anti
