"""Stretch of the triangles of a surface under a piecewise linear map to the plane."""

from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Real
from ..parallel import over_slices

SLIVER_HEIGHT_SHARE = 1e-4
"""Height relative to the longest side that is assumed for triangles with less, including those without area, since
rounding decides their shape.
"""


class Linear(NamedTuple):
    """Linear maps of the plane, z -> a z + b z̄, with (m,) complex a and b."""

    a: Complex
    b: Complex

    def __matmul__(self, first: "Linear") -> "Linear":
        """Return the composition: `first`, then these maps."""
        a, b = first
        return Linear(self.a * a + self.b * b.conj(), self.a * b + self.b * a.conj())

    @property
    def determinant(self) -> Real:
        """Ratio of areas; shape (m,)."""
        return np.abs(self.a) ** 2 - np.abs(self.b) ** 2

    def inverse(self) -> "Linear":
        """Return the inverse maps."""
        return Linear(self.a.conj() / self.determinant, -self.b / self.determinant)


def linear(z: Complex, w: Complex) -> Linear:
    """Return the linear parts of the affine maps of triangles z (m, 3) to w (m, 3)."""
    e, f, p, q = z[:, 1] - z[:, 0], z[:, 2] - z[:, 0], w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
    across = e * f.conj() - f * e.conj()
    return Linear((p * f.conj() - q * e.conj()) / across, (q * e - p * f) / across)


def laid_flat(space: Real) -> Complex:
    """Return (m, 3) congruent copies in the plane of (m, 3, 3) triangles in space, counter-clockwise.

    All have an area: a sliver is made a little higher, and a triangle that is a point becomes a small
    equilateral one.
    """
    flat, length = np.empty(space.shape[:2], complex), np.empty(len(space))

    def work(part: slice) -> None:
        flat[part], length[part] = _laid_flat(space[part])

    over_slices(work, len(space))
    point = length == 0
    if point.any():
        small = SLIVER_HEIGHT_SHARE * length.mean() + 1e-300
        flat[point] = small * np.array([0, 1, np.exp(1j * np.pi / 3)])
    return flat


def _laid_flat(space: Real) -> tuple[Complex, Real]:
    """Return the copies of triangles, of size zero if they are points, and the lengths of their longest sides."""
    sides = np.linalg.norm(np.roll(space, -1, axis=1) - space, axis=-1)
    order = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3  # the longest side first
    a, b, c = np.moveaxis(np.take_along_axis(space, order[..., None], axis=1), 1, 0)
    length = sides.max(axis=1)
    by = np.where(length == 0, 1.0, length)
    x = np.einsum("ij,ij->i", b - a, c - a) / by
    y = np.maximum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / by, SLIVER_HEIGHT_SHARE * length)
    flat = np.empty(space.shape[:2], complex)
    np.put_along_axis(flat, order, np.stack([0j * x, length + 0j, x + 1j * y], axis=1), axis=1)
    return flat, length


def stretches(space: Real, plane: Complex) -> tuple[Real, Real]:
    """Return the singular values of the affine maps of (m, 3, 3) triangles in space to (m, 3) in the plane.

    The smaller one has the sign of the orientation.
    """
    flat, (major, minor) = laid_flat(space), np.empty((2, len(space)))

    def work(part: slice) -> None:
        along = linear(flat[part], plane[part])
        conformal, anti = np.abs(along.a), np.abs(along.b)
        major[part], minor[part] = conformal + anti, conformal - anti

    over_slices(work, len(space))
    return major, minor
