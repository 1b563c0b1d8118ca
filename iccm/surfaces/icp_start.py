"""An initial map for surfaces whose even layouts have almost the same shape: a similarity found by closest points.

The usual initial maps see only the outlines. On a coarse mesh, protrusions inside the layout (legs, ears) may then be
squeezed to nothing while their counterparts are stretched out of their base, and no later step repairs that.
"""

import numpy as np

from ..arrays import Complex
from ..balanced.model.boundary_pairs import Match, loops_of
from ..balanced.model.mesh_map import MeshMap
from ..balanced.search import initial_matches
from ..balanced.search.unit_problem import UnitProblem
from ..curve import Curve
from ..plane import Similarity

OUTLINE_SAMPLES = 256  # per outline
SHARES = np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
FARTHEST_UNITS = 100.0  # half the side of the square around both outlines, in unit coordinates
FAR = FARTHEST_UNITS * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
CLOSEST_POINT_ROUNDS = 30  # iterations of ICP
CLOSE_RMS = 0.15  # RMS distance of outlines and pins, at area one, up to which the similarity is used


def similarity_sketch(problem: UnitProblem) -> MeshMap | None:
    """Return the similarity that fits pins and outlines best as a map on two triangles around both outlines.

    The outlines' samples are its first vertices. Returns None where no similarity fits well.
    """
    if problem.strokes or len(problem.holes.source) != len(problem.holes.target):
        return None
    placing = similarity(problem)
    if placing is None:
        return None
    pairs = _partners(problem, placing)
    outlines = [problem.source, *(problem.holes.source[i] for i, _ in pairs)]
    loops = loops_of([(i, j, OUTLINE_SAMPLES) for i, j in pairs], OUTLINE_SAMPLES)
    z = np.concatenate([*(curve.at(curve.length * SHARES) for curve in outlines), FAR])
    first = OUTLINE_SAMPLES * len(outlines)
    faces = first + np.array([[0, 1, 2], [0, 2, 3]])
    return MeshMap.plain(z, placing(z), faces, first, loops=loops, metrics=problem.metrics)


def _partners(problem: UnitProblem, placing: Similarity) -> list[tuple[int, int]]:
    """Return pairs (source hole, target hole): given partners first, the others assigned by distance of centroids."""
    from scipy.optimize import linear_sum_assignment

    sources = np.array([hole.z.mean() for hole in problem.holes.source], complex)
    targets = np.array([hole.z.mean() for hole in problem.holes.target], complex)
    away = np.abs(placing(sources)[:, None] - targets)
    for i, j in problem.holes.partners:
        away[i, j] = -FARTHEST_UNITS
    return [(int(i), int(j)) for i, j in zip(*linear_sum_assignment(away))]


def similarity(problem: UnitProblem) -> Similarity | None:
    """Return the similarity that maps the source closest to the target; None if the best one is not close."""
    fits = [_icp(problem, match) for match in _matches(problem)]
    away, best = min(fits, key=lambda fit: fit[0])
    return best if away < CLOSE_RMS else None


def unlikeness(source: Curve, target: Curve, source_points: Complex, target_points: Complex) -> float:
    """Return the RMS distance between two outlines after the best similarity, relative to the root of the area.

    Args:
        source: an outline.
        target: the outline that it is compared with.
        source_points: (k,) corresponding points on the source.
        target_points: (k,) their images on the target. Between them, points correspond by arclength.
    """
    s = source.length * SHARES
    z, w = source.at(s), target.at(_interpolate(source, target, (source_points, target_points)).at(s))
    away = Similarity.fit(z, w)(z) - w
    return float(np.sqrt(np.mean(np.abs(away) ** 2) / target.area))


def _matches(problem: UnitProblem) -> list[Match]:
    """Return correspondences of the outlines from which ICP starts."""
    source, target = problem.source, problem.target
    if problem.anchors[0]:
        return [_interpolate(source, target, (np.array(problem.anchors[0]), np.array(problem.anchors[1])))]
    rotations = initial_matches.ANY_TURN if problem.energy.upright == 0 else initial_matches.TURNS
    return initial_matches.candidates(source, target, rotations)


def _interpolate(source: Curve, target: Curve, pins: tuple[Complex, Complex]) -> Match:
    """Return the correspondence of two outlines that is linear in arclength between given pairs of points."""
    s, tau = (curve.closest(side) for curve, side in zip((source, target), pins))
    order = np.argsort(s)
    s, tau = s[order], tau[order]
    tau = tau[0] + np.mod(tau - tau[0], target.length)
    return Match(np.append(s, s[0] + source.length), np.append(tau, tau[0] + target.length))


def _icp(problem: UnitProblem, match: Match) -> tuple[float, Similarity]:
    """Run ICP from a correspondence; return the RMS distance that is left, and the similarity.

    With pins on the outline the correspondence is kept, and the similarity is fitted once.
    """
    pins, goals = problem.all_pins.T
    s = problem.source.length * SHARES
    z, w = problem.source.at(s), problem.target.at(match.at(s))
    weight = np.append(np.ones(OUTLINE_SAMPLES), np.full(pins.size, OUTLINE_SAMPLES / max(pins.size, 1)))
    for _ in range(CLOSEST_POINT_ROUNDS):
        placing = Similarity.fit(np.append(z, pins), np.append(w, goals), weight)
        if problem.anchors[0]:
            break
        w = problem.target.nearest(placing(z))
    away = placing(np.append(z, pins)) - np.append(w, goals)
    return float(np.sqrt(weight @ np.abs(away) ** 2 / weight.sum())), placing
