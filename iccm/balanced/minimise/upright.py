"""The cost of turning the picture: a factor on the energy.

Its turn is the argument φ of S = ∫ f_z dA: of the mean derivative, and of the rotation closest to it. S is linear in
the image and the same, conjugated, for the inverse map. A map costs its energy times (1 + w (1 - cos φ)/2)^q: upside
down 1 + w times as much, at q = 1.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex
from ...jit import in_place
from ..kernels import dot
from .energy import RestShapes


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
        """For `count` vertices of triangles at rest."""
        weights, out = np.maximum(rest.weights, 0), np.empty(count, np.complex128)  # voids do not count
        shares = (rest.gradients * weights[:, None]).ravel()
        for part, filled in ((shares.real, out.real), (shares.imag, out.imag)):
            filled[:] = np.bincount(rest.corners.ravel(), part, count)
        return cls(out, float(weight))


ANY_TURN = Upright(np.empty(0, np.complex128), 0.0)


@in_place
def _moment(upright, u):
    """S."""
    found = 0j
    for v in range(u.size):
        found += upright.moments[v] * u[v]
    return found


@in_place
def turn_cost(weight, cosine):
    """What a turn of this cosine multiplies the energy by, at q = 1."""
    return 1 + 0.5 * weight * (1 - cosine)


@in_place
def turn_factor(upright, u, q):
    """What the energy of images u (n,) is multiplied by; infinite where they have no turn."""
    if upright.weight == 0:
        return 1.0
    moment = _moment(upright, u)
    size = abs(moment)
    return turn_cost(upright.weight, moment.real / size) ** q if size > 0 else np.inf


@in_place
def turn_derivatives(upright, u, q, turning):
    """First and second derivative of the factor's logarithm by the turn; fills in the turn's gradient.

    Args:
        upright: the cost.
        u: (n,) images.
        q: power.
        turning: (n,) complex, x + iy, written: the derivative of the turn by each vertex.

    Returns:
        The first derivative, and the second one where it is positive, else 0.
    """
    moment = _moment(upright, u)
    if moment == 0:  # a map so squeezed that rounding leaves it no turn
        for v in range(u.size):
            turning[v] = 0j
        return 0.0, 0.0
    inverse = 1 / moment
    for v in range(u.size):
        share = upright.moments[v] * inverse
        turning[v] = complex(share.imag, share.real)
    cosine, half = moment.real / abs(moment), 0.5 * upright.weight
    factor = turn_cost(upright.weight, cosine)
    slope = half * moment.imag / abs(moment) / factor
    return q * slope, q * max(half * cosine / factor - slope * slope, 0.0)


@in_place
def bend_step(turning, answer, curvature, step):
    """The step -H⁻¹g made the one for H + c t tᵀ, t being the turn's gradient (Sherman and Morrison).

    Args:
        turning: (n,) t.
        answer: (n,) -H⁻¹t.
        curvature: c.
        step: (n,) changed in place.
    """
    along, across = 0.0, 0.0
    for v in range(step.size):
        along += dot(turning[v], step[v])
        across += dot(turning[v], answer[v])
    share = curvature * along / (1 - curvature * across)
    for v in range(step.size):
        step[v] += share * answer[v]
