"""The cost of rotating the picture: a factor on the energy.

The rotation is the argument φ of S = ∫ f_z dA, which is that of the mean derivative, and of the rotation
closest to it. S is linear in the image, and its conjugate is that of the inverse map. A map costs its energy
times (1 + w (1 - cos φ)/2)^q: upside down it costs 1 + w times as much, at q = 1.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex
from ...native import Record, function, record
from .energy import RestShapes

UprightRecord = record("struct Upright { const Complex *moments; double weight; }")
_rotation_factor = function(
    "double iccm_minimise_rotation_factor(const Upright *upright, const Complex *u, double q, int64_t n)"
)
_rotation_derivatives = function(
    """int64_t iccm_minimise_rotation_derivatives(
        const Upright *upright, const Complex *u, double q, Complex *turning, double *slopes, int64_t n)"""
)


class Upright(NamedTuple):
    """The cost of a rotation.

    Attributes:
        moments: (n,) complex κ of the vertices, with S = Σ κ u.
        weight: w of the formula; 0 if all rotations cost the same.
    """

    moments: Complex
    weight: float

    @classmethod
    def of(cls, rest: RestShapes, count: int, weight: float) -> "Upright":
        """Return the cost for rest triangles with `count` vertices."""
        weights, out = (
            np.maximum(rest.weights, 0),
            np.empty(count, np.complex128),
        )  # virtual triangles do not count
        shares = (rest.gradients * weights[:, None]).ravel()
        for part, filled in ((shares.real, out.real), (shares.imag, out.imag)):
            filled[:] = np.bincount(rest.corners.ravel(), part, count)
        return cls(out, float(weight))

    def record(self) -> Record:
        """Return the struct that is passed to the core."""
        return UprightRecord(self.moments, self.weight)


ANY_ROTATION = Upright(np.empty(0, np.complex128), 0.0)


def rotation_cost(weight: float, cosine: float) -> float:
    """Return the factor on the energy for a rotation with this cosine, at q = 1."""
    return 1 + 0.5 * weight * (1 - cosine)


def rotation_factor(upright: Upright, u: Complex, q: float) -> float:
    """Return the factor on the energy of images u (n,); infinite if their rotation is undefined."""
    return float(_rotation_factor(upright.record(), u, q, u.size))


def rotation_derivatives(upright: Upright, u: Complex, q: float, turning: Complex) -> tuple[float, float]:
    """Compute derivatives of the factor's logarithm with respect to the angle, and fill in the angle's gradient.

    Args:
        upright: the cost.
        u: (n,) images.
        q: power.
        turning: (n,) complex, x + iy, written: the derivative of the angle with respect to each vertex.

    Returns:
        The first derivative, and the second one if it is positive, else 0.
    """
    slopes = np.empty(2)
    _rotation_derivatives(upright.record(), u, q, turning, slopes, u.size)
    return float(slopes[0]), float(slopes[1])
