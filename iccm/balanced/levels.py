"""From many coarse starts to one fine map.

Coarse maps for all starts, a few Newton steps, the best go on; corners are released, so that those of one outline may
pass those of the other, and pinned again on a new mesh; the best of all goes to the fine mesh, where the worst stretch
is lowered (q = 3).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from ..curve import Curve
from ..errors import InputError
from .discrete import DiscreteMap, folds, turn_of
from .kernels import Complex, Real
from .mesh import Sizes
from .outline import Outline
from .pairs import Match, boundary_pairs, limited, through
from .transfer import interpolate

SPACING = 0.75  # of the outline's vertices, in mesh sizes
SCREENING = ((3, 9), (5, 5))  # Newton steps, then how many maps go on; within 1 % of keeping all
RELEASES = 3  # rounds of released corners
RELEASED_STEPS = 8
STEEPEST = 8.0  # slope of a match, relative to the mean, that a coarse mesh follows
STEEPEST_FINE = 20.0
FORWARD, BACKWARD = 8, 3  # Newton steps on the map and on its inverse, in turn
SETTLED = 1e-3  # relative decrease of a round that ends it
GOOD_ENOUGH = 1e-4  # relative decrease of a Newton step that counts as none


class Problem(NamedTuple):
    """What is solved, in unit coordinates.

    Attributes:
        source: boundary of the source, of area one.
        target: boundary of the target, of area one.
        theta: weight of the area part.
        upright: weight of the turn when maps are compared.
        anchors: pairs of arclengths (as shares of the length) that must correspond; None for none.
    """

    source: Curve
    target: Curve
    theta: float
    upright: float
    anchors: Match | None = None


@dataclass(frozen=True, eq=False)
class Level:
    """The two outlines at one fineness and the size h of the triangles."""

    source: Outline
    target: Outline
    size: float
    anchors: Match | None
    steepest: float

    @classmethod
    def of(cls, problem: Problem, size: float, fineness: float, corner_fineness: float, steepest: float) -> "Level":
        """The level of mesh size h; fineness of outlines and corners as shares of their diagonals."""
        source = Outline.of(problem.source, fineness, corner_fineness)
        target = Outline.of(problem.target, fineness, corner_fineness)
        anchors = problem.anchors and Match(problem.anchors.s * source.length, problem.anchors.tau * target.length)
        return cls(source, target, size, anchors, steepest)

    def mapped(self, match: Match, sizes: Sizes | None = None) -> DiscreteMap:
        """A mesh for a match, without an inside yet."""
        match = through(limited(match, self.steepest), self.anchors)
        pairs = boundary_pairs(self.source, self.target, match, SPACING * self.size, self.anchors)
        sizes = sizes or Sizes.even(0.5 * self.size**2)
        return DiscreteMap.on(self.source, self.target, pairs, sizes, self.anchors)


def score(state: DiscreteMap, upright: float) -> float:
    """The energy, made larger the more the picture is turned."""
    return state.energy * (1 + 0.5 * upright * (1 - np.cos(turn_of(state))))


def screened(level: Level, matches: list[Match], problem: Problem) -> tuple[list[DiscreteMap], int]:
    """The best maps after a few steps, best first, and how many matches failed."""
    states, failed = [], 0
    for match in matches:
        try:
            states.append(level.mapped(match).unfolded())
        except InputError:
            failed += 1
    for steps, keep in SCREENING:
        states = [s.forward(problem.theta, 1.0, steps, GOOD_ENOUGH, corners=False) for s in states]
        states = sorted(states, key=lambda s: score(s, problem.upright))[:keep]
    return states, failed


def alternated(state: DiscreteMap, theta: float, q: float, rounds: int, backward: int) -> DiscreteMap:
    """Newton steps on the map and on its inverse in turn, so that neither shape's corners are privileged."""
    for _ in range(rounds):
        before = state.energy
        state = state.forward(theta, q, FORWARD, 0.5 * GOOD_ENOUGH, corners=True)
        state = state.backward(theta, q, backward, 0.5 * GOOD_ENOUGH)
        if before - state.energy < SETTLED * state.energy:
            break
    return state


def released(level: Level, state: DiscreteMap, problem: Problem) -> DiscreteMap:
    """The best map of a few rounds: corners pinned on a new mesh, settled, released."""
    best, best_score = None, np.inf
    for attempt in range(1 + RELEASES):
        if attempt:
            state = state.forward(problem.theta, 1.0, RELEASED_STEPS, GOOD_ENOUGH, corners=False)
        try:
            state = level.mapped(state.match).unfolded()
        except InputError:
            break
        state = alternated(state, problem.theta, 1.0, 4, BACKWARD)
        new_score = score(state, problem.upright)
        improved = new_score < best_score
        if improved:
            best, best_score = state, new_score
        if not improved:
            break
    if best is None:
        raise InputError("no map without folds was found for this correspondence of the outlines")
    return best


def lifted(curve: Curve, points: Complex) -> Real:
    """Arclengths of the closest points of a curve, made monotone, for points in order along it."""
    s = np.mod(curve.closest(points), curve.length)
    steps = np.mod(np.diff(s) + 0.5 * curve.length, curve.length) - 0.5 * curve.length
    return isotonic_regression(s[0] + np.append(0, np.cumsum(steps))).x


def matched_on(level: Level, state: DiscreteMap) -> Match:
    """The match of a map's outlines, carried to the outlines of another level."""
    s = lifted(level.source.curve, state.z[: state.border])
    tau = lifted(level.target.curve, state.u[: state.border])
    return Match(np.append(s, s[0] + level.source.length), np.append(tau, tau[0] + level.target.length))


def refined(level: Level, state: DiscreteMap, sizes: Sizes | None = None) -> DiscreteMap:
    """The map carried to a finer level, without folds."""
    fine = level.mapped(matched_on(level, state), sizes)
    inside = interpolate(state.z, state.faces, state.u, fine.z[fine.border :])
    carried = replace(fine, u=np.concatenate([fine.u[: fine.border], inside]))
    if not folds(carried.faces, carried.u):
        return carried
    try:
        return carried.unfolded(harmonic=False)
    except InputError:
        return fine.unfolded()
