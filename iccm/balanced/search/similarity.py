"""Similar shapes, for which the similarity is the map: no energy is lower."""

import numpy as np

from ...curve import Curve
from ...plane import rotation
from ..model.boundary_pairs import HoleMatch, Match
from .unit_problem import UnitProblem

SAME_OUTLINE_SHARE = 1e-9  # relative to the root of the area: outlines this close are the same
OUTLINE_SAMPLES = 256  # points of each outline that are compared
# Relative to the root of the area: vertices whose distance from the centroid is within this of the largest one all
# count as farthest.
AS_FAR_SHARE = 1e-7
MOST_STARTS = 64  # positions tried; a regular polygon has as many as vertices, which would take too long


def similarity(source: Curve, target: Curve, *, rotates: bool) -> Match | None:
    """Return the correspondence of two similar outlines; None if they are not similar.

    If there are several, it is the one with the least rotation.

    Args:
        source: outline with area one and centroid 0.
        target: the same.
        rotates: whether the target may be a rotated source.
    """
    if abs(source.length - target.length) > SAME_OUTLINE_SHARE * source.length:
        return None
    steps = np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    w = source.at(source.length * steps)
    starts = []
    for start in _far_vertices(target, np.abs(source.z).max()):
        v = target.at(start + target.length * steps)
        factor = rotation(w, v) if rotates else 1.0
        if np.abs(factor * w - v).max() < SAME_OUTLINE_SHARE * 10:
            starts.append((abs(np.angle(factor)), start))
    if not starts:
        return None
    start = min(starts)[1]
    return Match(np.array([0.0, source.length]), start + np.array([0.0, target.length]))


def _far_vertices(curve: Curve, radius: float) -> np.ndarray:
    """Return the arclengths of the vertices to which the source's first vertex, its farthest, may be mapped."""
    return curve.knots[:-1][np.abs(np.abs(curve.z) - radius) < AS_FAR_SHARE][:MOST_STARTS]


def similar_with_holes(problem: UnitProblem, match: Match) -> Match | None:
    """Return the match of similar outlines with the matches of holes.

    Returns:
        The match; None unless the holes are similar in the same way, and their partners are those requested.
    """
    if len(problem.holes.source) != len(problem.holes.target):
        return None
    w = problem.source.at(match.s[:1] + problem.source.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
    v = problem.target.at(
        match.tau[:1] + problem.target.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    )
    partners = [_same(hole, problem.holes.target, rotation(w, v)) for hole in problem.holes.source]
    holes = tuple(HoleMatch(i, *pair) for i, pair in enumerate(partners) if pair)
    as_wished = set(problem.holes.partners) <= {(hole.source, hole.target) for hole in holes}
    return match._replace(holes=holes) if len(holes) == len(partners) and as_wished else None


def _same(hole: Curve, candidates: tuple[Curve, ...], factor: complex) -> tuple[int, Match] | None:
    """Find the curve among others that equals this one rotated.

    Returns:
        Its number, and the correspondence; None if there is none.
    """
    ends = np.array([0.0, 1.0])
    w = factor * hole.at(hole.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
    for number, candidate in enumerate(candidates):
        start = candidate.closest(w[:1])
        v = candidate.at(start + candidate.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
        if np.abs(w - v).max() < SAME_OUTLINE_SHARE * 10:
            return number, Match(ends * hole.length, start + ends * candidate.length)
    return None
