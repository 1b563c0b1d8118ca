"""The balance as a field: triangles near a bound count more, angles where K is near its own, sizes where the scale is.

What pictures are judged by are shares of the area: those over which K is at most 5, and the scale within 2 x. A share
changes by the triangles that are near the bound alone: with a smooth step in place of the bound, its derivative is a
bump there. Triangles are weighed by these bumps, anew after some steps (iteratively reweighted least squares, as
Holland and Welsch, *Robust regression using iteratively reweighted least-squares*, 1977), upon a weight of one that
all keep: what is far beyond a bound is not given up.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real, at_vertices
from ..meshing.transfer import interpolate
from .measures import stretches

MOST_SHEARED, MOST_SCALED = 5.0, 2.0  # the bounds: of K = s1 / s2, and of the scale and its inverse
NEAR = 0.2  # width of the bumps, of logarithms: .15 and .3 did for fewer of 67 pairs
WEIGHT = 30.0  # at the bound of K; 10 and 100 did for a few fewer
SMOOTHINGS = 2  # averages with the triangles around, so that the field has no steps
LARGEST = 2.0  # θ of a triangle


class BalanceField(NamedTuple):
    """θ and a weight for every triangle.

    Attributes:
        thetas: (m,) of the area part.
        weights: (m,) factors of the density.
    """

    thetas: Real
    weights: Real

    @classmethod
    def even(cls, theta: float, count: int) -> "BalanceField":
        """The same for all."""
        return cls(np.full(count, float(theta)), np.ones(count))

    def times(self, theta: float) -> "BalanceField":
        """With all θ multiplied, but for those that would be too large."""
        return self._replace(thetas=np.minimum(theta * self.thetas, LARGEST))

    def mean(self, other: "BalanceField | None") -> "BalanceField":
        """The geometric mean with another field, which damps what would go to and fro."""
        if other is None:
            return self
        return BalanceField(*(np.sqrt(a * b) for a, b in zip(self, other)))

    def twice(self) -> "BalanceField":
        """For the triangles and as many others, mirror images of theirs."""
        return BalanceField(*(np.tile(values, 2) for values in self))

    def carried(self, z: Complex, faces: Index, new: Complex, new_faces: Index) -> "BalanceField":
        """From triangles of one mesh to those of another of the same shape."""
        weights, thetas = np.log(self.weights), np.log(self.thetas)
        means = at_vertices(weights, faces, z.size) + 1j * at_vertices(thetas, faces, z.size)
        found = interpolate(z, faces, means, new)[new_faces].mean(axis=1)
        most = np.abs(thetas).max()  # beyond an outline they are extended linearly
        carried = np.clip(found.real, 0, weights.max())
        return BalanceField(np.exp(np.clip(found.imag, -most, most)), np.exp(carried))


def emphasised(z: Complex, u: Complex, faces: Index) -> BalanceField:
    """The field for a map z -> u (n,) on triangles (m, 3) without folds, both areas taken as one; θ is 1 away from the
    bounds."""
    dilatations, _, determinants = stretches(z, u, faces)
    sheared = bump(np.log(dilatations / MOST_SHEARED))
    scaled = bump(np.abs(0.5 * np.log(np.maximum(determinants, 1e-300))) - np.log(MOST_SCALED))
    leaning = np.exp(smoothed(scaled - sheared, faces, z.size))
    return BalanceField(leaning, 1 + WEIGHT * smoothed(sheared, faces, z.size))


def bump(x: Real) -> Real:
    """The derivative of a smooth step at zero, by its largest value."""
    return np.exp(-0.5 * (x / NEAR) ** 2)


def smoothed(values: Real, faces: Index, count: int) -> Real:
    """Values of triangles (m,), averaged over those around the corners."""
    for _ in range(SMOOTHINGS):
        values = at_vertices(values, faces, count)[faces].mean(axis=1)
    return values
