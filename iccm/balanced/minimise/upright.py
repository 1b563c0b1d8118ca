"""The cost of turning the picture: a factor on the energy.

Its turn is the argument φ of S = ∫ f_z dA: of the mean derivative, and of the rotation closest to it. S is linear in
the image and the same, conjugated, for the inverse map. A map costs its energy times (1 + w (1 - cos φ)/2)^q: upside
down 1 + w times as much, at q = 1.
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
    """The cost of a turn.

    Attributes:
        moments: (n,) complex κ of the vertices, S = Σ κ u.
        weight: w of the formula; 0 where any turn is as good.
    """

    moments: Complex
    weight: float

    @classmethod
    def of(cls, rest: RestShapes, count: int, weight: float) -> "Upright":
        """For `count` vertices of rest triangles."""
        weights, out = (
            np.maximum(rest.weights, 0),
            np.empty(count, np.complex128),
        )  # virtual triangles do not count
        shares = (rest.gradients * weights[:, None]).ravel()
        for part, filled in ((shares.real, out.real), (shares.imag, out.imag)):
            filled[:] = np.bincount(rest.corners.ravel(), part, count)
        return cls(out, float(weight))

    def record(self) -> Record:
        """For the core."""
        return UprightRecord(self.moments, self.weight)


ANY_ROTATION = Upright(np.empty(0, np.complex128), 0.0)


def rotation_cost(weight: float, cosine: float) -> float:
    """Return what a rotation of this cosine multiplies the energy by, at q = 1."""
    return 1 + 0.5 * weight * (1 - cosine)


def rotation_factor(upright: Upright, u: Complex, q: float) -> float:
    """Return what the energy of images u (n,) is multiplied by; infinite where they have no rotation."""
    return float(_rotation_factor(upright.record(), u, q, u.size))


def rotation_derivatives(upright: Upright, u: Complex, q: float, turning: Complex) -> tuple[float, float]:
    """Compute derivatives of the factor's logarithm by the angle, and fill in the angle's gradient.

    Args:
        upright: the cost.
        u: (n,) images.
        q: power.
        turning: (n,) complex, x + iy, written: the derivative of the angle by each vertex.

    Returns:
        The first derivative, and the second one where it is positive, else 0.
    """
    slopes = np.empty(2)
    _rotation_derivatives(upright.record(), u, q, turning, slopes, u.size)
    return float(slopes[0]), float(slopes[1])
