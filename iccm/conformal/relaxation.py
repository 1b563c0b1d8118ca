"""The relaxation of a boundary correspondence that makes it conformal (a Riemann-Hilbert problem).

Values w_j on the target are the boundary values of a holomorphic map exactly if the coordinates reproduce them,
D w = 0. This is the consistency energy with the closeness held at zero, with n real unknowns instead of the 2n
of Eq. 13 (R. Wegmann, *Methods for numerical conformal mapping*, Handbook of Complex Analysis 2, 2005). The
unknowns here are the relative strains of the map between the two circles of harmonic measure. That map is
smooth at the corners of both shapes, and vertices are placed anew on the correspondence after each step.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from ..arrays import Complex, Real
from ..curve import Curve
from .correspondence import TURN, CircleMap, Correspondence
from .riemann_hilbert import LEAST_DAMPING, consistency, interpolate_means, shares, stretches
from .symmetry import shift_of, translation
from .vertices import Allowance, place

# Values were chosen by hand unless a comment gives a reason.
ENOUGH_ERROR_SHARE = 0.6  # residual relative to the allowed error at which relaxation ends
ROUGH_SLOPE = 0.5
"""Relative change of dw/dturn between neighbouring vertices above which a vertex loses its weight."""
FADE_POWER = 4  # power with which the weight decreases
QUOTIENT_STEP_SPACINGS = 0.05
"""Step of the difference quotients along the target, relative to the vertices' spacing."""
MOST_STEP_STRAIN = 1.0  # largest strain in one step
PRIOR_WEIGHT = 0.1  # inverse of the expected squared strain, relative to the residual
FIRST_DAMPING = 1e-3  # of the first step; divided or multiplied by ten as steps succeed or fail
MOST_DAMPING = 1e3  # damping above which a step is given up
SLOW_RESIDUAL_SHARE = 0.9  # stop when a step leaves more than this share of the residual


@dataclass(frozen=True, eq=False)
class State:
    """Vertices on a correspondence, and the distance of their values from those of a holomorphic map.

    Attributes:
        s, tau: (n,) arclengths of the vertices and of their images.
        defect: (n, n) matrix C_v - I.
        residual: (n,) defect · T(τ).
        weight: (n,) square roots of the vertices' shares, over the allowed error there.
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
        """Return the state of vertices."""
        defect = consistency(source.at(s))
        weight = np.sqrt(shares(source, s, target, tau)) / allowed(s, stretches(s, source, tau, target))
        return cls(source, target, s, tau, defect, defect @ target.at(tau), weight)

    @property
    def phi(self) -> Complex:
        """Coefficients of the map; shape (n,)."""
        return interpolate_means(self.target.at(self.tau), self.source.at(self.s))

    @property
    def energy(self) -> float:
        """The consistency energy, ‖D T(τ)‖² weighted by the vertices' shares."""
        return float(shares(self.source, self.s, self.target, self.tau) @ np.abs(self.residual) ** 2)

    @property
    def norm(self) -> float:
        """Root mean square of the residual, relative to the allowed error."""
        return float(np.linalg.norm(self.weight * self.residual))


def lay(c: Correspondence, pairs: Callable, allowed: Allowance, most: int) -> State:
    """Place vertices on a correspondence."""
    source, target = c.source.measure.curve, c.target.measure.curve
    fine_s, fine_tau = pairs(c)
    s, tau = place(fine_s, fine_tau, source, target, allowed, most)
    return State.of(source, target, s, tau, allowed)


def follow(c: Correspondence, state: State) -> Correspondence:
    """Return the correspondence adapted to the vertices' images after Newton's method.

    Relaxation steps do not move the target's corners (`relaxation_step`); this does.
    """
    between, turn = circle_map(c), c.source.circle.turn(state.s)
    moved = between.shifted(turn, c.target.circle.turn(state.tau) - between(turn))
    return with_fixed_points(replace(c, between=moved))


def circle_map(c: Correspondence) -> CircleMap:
    """Return the map between the circles with knots, converted from a Möbius map if it is one."""
    return c.between if isinstance(c.between, CircleMap) else CircleMap.of(c)


def with_fixed_points(c: Correspondence) -> Correspondence:
    """Return the correspondence composed with the Möbius map of the target's circle that puts fixed points back.

    A strain of the circle map moves them, and a map composed with a Möbius map is as conformal as before.
    """
    if not c.fixed.size:
        return c
    between = circle_map(c)
    present = np.exp(1j * TURN * between(c.source.circle.turn(c.fixed)))
    places = np.exp(1j * TURN * c.target.circle.turn(c.fixed_images))
    shift = shift_of(present[:2], places[:2], present[2:], places[2:]) if c.fixed.size > 2 else 0.0
    back = translation(present[:2], places[:2], shift or 0.0)(between.b)
    return replace(c, between=CircleMap(between.a, back - np.round(back[0] - between.b[0])))


def relax(
    c: Correspondence, pairs: Callable, allowed: Allowance, most: int, steps: int
) -> tuple[Correspondence, list[State]]:
    """Strain the map between the circles until the boundary values are holomorphic, as far as its knots permit.

    Args:
        c: the correspondence to start from; the map between its circles is a CircleMap.
        pairs: returns a fine sequence of corresponding arclengths of a correspondence.
        allowed: allowed error at each place.
        most: most vertices.
        steps: most Levenberg-Marquardt steps.

    Returns:
        The final correspondence, and the states after each step; the last one belongs to it.
    """
    states, damping = [lay(c, pairs, allowed, most)], FIRST_DAMPING
    for _ in range(steps):
        state = states[-1]
        if state.norm <= ENOUGH_ERROR_SHARE:
            break
        between = circle_map(c)
        solve = relaxation_step(c, state)
        previous_norm = state.norm
        while damping <= MOST_DAMPING:
            trial = with_fixed_points(replace(c, between=between.strained(*solve(damping))))
            placed = lay(trial, pairs, allowed, most)
            if placed.norm < previous_norm:
                break
            damping *= 10
        else:
            break
        c, damping = trial, max(damping / 10, LEAST_DAMPING)
        states.append(placed)
        if placed.norm > SLOW_RESIDUAL_SHARE * previous_norm:
            break
    return c, states


def relaxation_step(c: Correspondence, state: State) -> Callable[[float], tuple[Real, float]]:
    """Return the step in the strains of the circle map's gaps and in its shift, as a function of the damping.

    A strain is the relative change of a gap, so that clusters of knots at corners move with their surroundings
    at no cost. At the target's corners, dw/dturn is singular: the vertices that accumulate there would hold the
    corner in place, although they are placed anew after the step. Therefore they have no weight.
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
    displacements = (weight[:, None] * state.defect * slope) @ between.hats(turn)
    tail = np.cumsum(displacements[:, ::-1], axis=1)[:, ::-1]  # effect of moving all knots from k on
    drift = displacements @ (between.b - between.b[0])  # the sum of the gaps is constant
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
