"""Surfaces whose even layouts are almost the same shape: a map that starts from the similarity between these.

The usual starts know outlines alone, and what stands out inside (legs, ears) may be squeezed to nothing on a coarse
mesh while what it should go to is drawn from its base; no later step mends that.
"""

import numpy as np

from ..arrays import Complex
from ..balanced.model.boundary_pairs import Match, loops_of
from ..balanced.model.mesh_map import MeshMap
from ..balanced.search import initial_matches
from ..balanced.search.unit_problem import UnitProblem
from ..curve import Curve
from ..plane import Similarity

OUTLINE_SAMPLES = 256  # of an outline
SHARES = np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
FARTHEST_UNITS = 100.0  # in unit coordinates
FAR = FARTHEST_UNITS * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
CLOSEST_POINT_ROUNDS = 30  # of closest points
CLOSE_RMS = 0.15  # root mean square distance of outlines and pins, of areas of one, up to which it is tried


def similarity_sketch(problem: UnitProblem) -> MeshMap | None:
    """Return the similarity that fits pins and outlines best, as a map on two triangles around both outlines, whose
    points come first; None where none fits well.
    """
    if problem.strokes or len(problem.holes[0]) != len(problem.holes[1]):
        return None
    near = similarity(problem)
    if near is None:
        return None
    pairs = _partners(problem, near)
    outlines = [problem.source, *(problem.holes[0][i] for i, _ in pairs)]
    loops = loops_of([(i, j, OUTLINE_SAMPLES) for i, j in pairs], OUTLINE_SAMPLES)
    z = np.concatenate([*(curve.at(curve.length * SHARES) for curve in outlines), FAR])
    first = OUTLINE_SAMPLES * len(outlines)
    faces = first + np.array([[0, 1, 2], [0, 2, 3]])
    return MeshMap.plain(z, near(z), faces, first, loops=loops, metrics=problem.metrics)


def _partners(problem: UnitProblem, near: Similarity) -> list[tuple[int, int]]:
    """Return which hole of the source goes to which of the target: those wished, the others by their middles."""
    from scipy.optimize import linear_sum_assignment

    here, there = (np.array([curve.z.mean() for curve in side], complex) for side in problem.holes)
    away = np.abs(near(here)[:, None] - there)
    for i, j in problem.partners:
        away[i, j] = -FARTHEST_UNITS
    return [(int(i), int(j)) for i, j in zip(*linear_sum_assignment(away))]


def similarity(problem: UnitProblem) -> Similarity | None:
    """Return the similarity that takes the source closest to the target; None if that is not close."""
    found = [_icp(problem, match) for match in _matches(problem)]
    away, near = min(found, key=lambda each: each[0])
    return near if away < CLOSE_RMS else None


def unlikeness(source: Curve, target: Curve, here: Complex, there: Complex) -> float:
    """Return how far the similarity that fits two outlines best leaves them apart, relative to the root of the area.

    Args:
        source: an outline.
        target: as above.
        here: (k,) points of the source, and
        there: where they go; in between it goes by lengths.
    """
    s = source.length * SHARES
    z, w = source.at(s), target.at(_interpolate(source, target, (here, there)).at(s))
    away = Similarity.fit(z, w)(z) - w
    return float(np.sqrt(np.mean(np.abs(away) ** 2) / target.area))


def _matches(problem: UnitProblem) -> list[Match]:
    """Correspondences of the outlines to begin with."""
    source, target = problem.source, problem.target
    if problem.anchors[0]:
        return [_interpolate(source, target, (np.array(problem.anchors[0]), np.array(problem.anchors[1])))]
    turns = initial_matches.ANY_TURN if problem.energy.upright == 0 else initial_matches.TURNS
    return initial_matches.candidates(source, target, turns)


def _interpolate(source: Curve, target: Curve, pins: tuple[Complex, Complex]) -> Match:
    """In proportion to lengths between points of the outlines."""
    s, tau = (curve.closest(side) for curve, side in zip((source, target), pins))
    order = np.argsort(s)
    s, tau = s[order], tau[order]
    tau = tau[0] + np.mod(tau - tau[0], target.length)
    return Match(np.append(s, s[0] + source.length), np.append(tau, tau[0] + target.length))


def _icp(problem: UnitProblem, match: Match) -> tuple[float, Similarity]:
    """Return the similarity for a correspondence, made better by closest points, and how far it is off."""
    pins, goals = problem.all_pins.T
    s = problem.source.length * SHARES
    z, w = problem.source.at(s), problem.target.at(match.at(s))
    weight = np.append(np.ones(OUTLINE_SAMPLES), np.full(pins.size, OUTLINE_SAMPLES / max(pins.size, 1)))
    for _ in range(CLOSEST_POINT_ROUNDS):
        near = Similarity.fit(np.append(z, pins), np.append(w, goals), weight)
        if problem.anchors[0]:
            break
        w = problem.target.nearest(near(z))
    away = near(np.append(z, pins)) - np.append(w, goals)
    return float(np.sqrt(weight @ np.abs(away) ** 2 / weight.sum())), near
