"""How a piecewise linear map from a surface to the plane stretches its triangles."""

import numpy as np

from ..arrays import Complex, Real

SLIVER = 1e-4
"""Of the longest side: triangles lower than this count as so high, those without area too (by hand)."""


def laid_flat(space: Real) -> Complex:
    """(m, 3) congruent copies in the plane of (m, 3, 3) triangles in space, counter-clockwise.

    All have an area: a sliver is made a little higher, a triangle that is a point is equilateral and small.
    """
    sides = np.linalg.norm(np.roll(space, -1, axis=1) - space, axis=-1)
    order = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3  # the longest side first
    a, b, c = np.moveaxis(np.take_along_axis(space, order[..., None], axis=1), 1, 0)
    length = sides.max(axis=1)
    point = length == 0
    length = np.where(point, SLIVER * length.mean() + 1e-300, length)
    x = np.einsum("ij,ij->i", b - a, c - a) / length
    y = np.maximum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / length, SLIVER * length)
    top = np.where(point, length * np.exp(1j * np.pi / 3), x + 1j * y)
    flat = np.empty(space.shape[:2], complex)
    np.put_along_axis(flat, order, np.stack([0 * top, length + 0j, top], axis=1), axis=1)
    return flat


def stretches(space: Real, plane: Complex) -> tuple[Real, Real]:
    """Singular values of the affine maps of (m, 3, 3) triangles in space to (m, 3) in the plane, the smaller signed."""
    flat = laid_flat(space)
    (p, q), (s, t) = ((w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]) for w in (flat, plane))
    across = p * q.conj() - q * p.conj()
    conformal, anti = np.abs((s * q.conj() - t * p.conj()) / across), np.abs((t * p - s * q) / across)
    return conformal + anti, conformal - anti
