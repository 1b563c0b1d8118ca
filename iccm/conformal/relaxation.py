"""The relaxation of a boundary correspondence that makes it conformal (a Riemann-Hilbert problem).

Values w_j on the target are the boundary values of a holomorphic map exactly when the coordinates reproduce them,
D w = 0: the consistency energy with the closeness held at zero. Its unknowns are n real numbers instead of
the 2n of Eq. 13 (R. Wegmann, *Methods for numerical conformal mapping*, Handbook of Complex Analysis 2, 2005).
Here they are
the relative strains of the map between the two circles of harmonic measure. That map is smooth at the corners of both
shapes, and the vertices are placed anew on the correspondence after each step.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from ..arrays import Complex, Real
from ..curve import Curve
from .correspondence import CircleMap, Correspondence
from .riemann_hilbert import LEAST_DAMPING, consistency, interpolate_means, shares, stretches
from .vertices import Allowance, place

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
ENOUGH_ERROR_SHARE = 0.6  # residual, relative to the error allowed
ROUGH_SLOPE = 0.5
"""Relative change of dw/dturn from vertex to vertex, from which on a vertex loses its weight."""
FADE_POWER = 4  # power by which it does
QUOTIENT_STEP_SPACINGS = 0.05
"""Step of the difference quotients along the target, relative to the vertices' spacing."""
MOST_STEP_STRAIN = 1.0  # of one step
PRIOR_WEIGHT = 0.1  # strain that is thought likely, squared and inverted, relative to the residual
FIRST_DAMPING = 1e-3
MOST_DAMPING = 1e3
SLOW_RESIDUAL_SHARE = 0.9  # stop when a step leaves more than this share of the residual


@dataclass(frozen=True, eq=False)
class State:
    """Vertices on a correspondence, and how far their values are from those of a holomorphic map.

    Attributes:
        s, tau: (n,) arclengths of the vertices and of their images.
        defect: (n, n) matrix C_v - I.
        residual: (n,) defect · T(τ).
        weight: (n,) square roots of the vertices' shares, over the error allowed there.
    """

    source: Curve
    target: Curve
    s: Real
    tau: Real
    defect: Complex
    residual: Complex
    weight: Real

    @classmethod
    def of(cls, source: Curve, target: Curve, s: Real, tau: Real, allowed: Allowance) -> "State":
        """From vertices."""
        defect = consistency(source.at(s))
        weight = np.sqrt(shares(source, s, target, tau)) / allowed(s, stretches(s, source, tau, target))
        return cls(source, target, s, tau, defect, defect @ target.at(tau), weight)

    @property
    def phi(self) -> Complex:
        """(n,) coefficients of the map."""
        return interpolate_means(self.target.at(self.tau), self.source.at(self.s))

    @property
    def energy(self) -> float:
        """The consistency energy, ‖D T(τ)‖² weighted by the vertices' shares."""
        return float(shares(self.source, self.s, self.target, self.tau) @ np.abs(self.residual) ** 2)

    @property
    def norm(self) -> float:
        """Root mean square of the residual, relative to the error allowed."""
        return float(np.linalg.norm(self.weight * self.residual))


def lay(c: Correspondence, pairs: Callable, allowed: Allowance, most: int) -> State:
    """Vertices placed on a correspondence."""
    source, target = c.source.measure.curve, c.target.measure.curve
    fine_s, fine_tau = pairs(c)
    s, tau = place(fine_s, fine_tau, source, target, allowed, most)
    return State.of(source, target, s, tau, allowed)


def follow(c: Correspondence, state: State) -> Correspondence:
    """Return the correspondence brought to where Newton's method moved the vertices' images.

    Steps leave the target's corners where they are (`relaxation_step`); this moves them.
    """
    between, turn = circle_map(c), c.source.circle.turn(state.s)
    return replace(c, between=between.shifted(turn, c.target.circle.turn(state.tau) - between(turn)))


def circle_map(c: Correspondence) -> CircleMap:
    """Return the map between the circles with knots, made from a Möbius map where it is one."""
    return c.between if isinstance(c.between, CircleMap) else CircleMap.of(c)


def relax(
    c: Correspondence, pairs: Callable, allowed: Allowance, most: int, steps: int
) -> tuple[Correspondence, list[State]]:
    """Strain the map between the circles until the boundary values are holomorphic, as far as its knots can tell.

    Args:
        c: the correspondence to start from, between the circles a CircleMap.
        pairs: gives a fine sequence of corresponding arclengths of a correspondence.
        allowed: error allowed at each place.
        most: vertices at most.
        steps: Levenberg-Marquardt steps at most.

    Returns:
        The correspondence reached and the states on the way, the last one its own.
    """
    states, damping = [lay(c, pairs, allowed, most)], FIRST_DAMPING
    for _ in range(steps):
        state = states[-1]
        if state.norm <= ENOUGH_ERROR_SHARE:
            break
        between = circle_map(c)
        solve = relaxation_step(c, state)
        before = state.norm
        while damping <= MOST_DAMPING:
            trial = replace(c, between=between.strained(*solve(damping)))
            found = lay(trial, pairs, allowed, most)
            if found.norm < before:
                break
            damping *= 10
        else:
            break
        c, damping = trial, max(damping / 10, LEAST_DAMPING)
        states.append(found)
        if found.norm > SLOW_RESIDUAL_SHARE * before:
            break
    return c, states


def relaxation_step(c: Correspondence, state: State) -> Callable[[float], tuple[Real, float]]:
    """Return the step in the strains of the circle map's gaps and its shift, as a function of the damping.

    A strain is the relative change of a gap: the corners' clusters of knots then move along with their
    surroundings at no cost. At the target's corners dw/dturn is singular: the vertices that crowd there would hold the
    corner where it is, though they are placed anew after the step; so they have no weight in it.
    """
    between = circle_map(c)
    turn = c.source.circle.turn(state.s)
    image = between(turn)
    across = np.roll(image, -1) - np.roll(image, 1)
    across[[0, -1]] += 1
    step = np.maximum(QUOTIENT_STEP_SPACINGS * across, 1e-15)
    ahead, back = (state.target.at(c.target.circle.arclength(image + sign * step)) for sign in (1, -1))
    slope = (ahead - back) / (2 * step)
    change = np.abs(np.roll(slope, -1) - np.roll(slope, 1)) / np.maximum(np.abs(slope), 1e-300)
    rough = np.minimum(np.maximum.reduce([change, np.roll(change, 1), np.roll(change, -1)]), 1e30)
    weight = state.weight / (1 + (rough / ROUGH_SLOPE) ** FADE_POWER)
    moved = (weight[:, None] * state.defect * slope) @ between.hats(turn)
    tail = np.cumsum(moved[:, ::-1], axis=1)[:, ::-1]  # what moving all knots from k on does
    drift = moved @ (between.b - between.b[0])  # the gaps keep their sum
    columns = (np.hstack([tail[:, 1:], np.zeros((tail.shape[0], 1))]) - drift[:, None]) * between.gaps
    columns = np.hstack([columns, tail[:, :1]])
    scale = np.linalg.norm(columns, axis=0)
    scale = np.maximum(scale, 1e-14 * scale.max())
    columns /= scale
    residual = weight * state.residual
    gram = columns.real.T @ columns.real + columns.imag.T @ columns.imag
    load = columns.real.T @ residual.real + columns.imag.T @ residual.imag
    prior = PRIOR_WEIGHT * state.norm**2 / between.gaps.size / scale**2

    def solve(damping: float) -> tuple[Real, float]:
        damped = gram + np.diag(1e-2 * damping + prior + 1e-12)
        x = -scipy.linalg.cho_solve(scipy.linalg.cho_factor(damped, check_finite=False), load) / scale
        shrink = min(1.0, MOST_STEP_STRAIN / max(float(np.abs(x[:-1]).max()), 1e-300))
        return shrink * x[:-1], float(shrink * x[-1])

    return solve
