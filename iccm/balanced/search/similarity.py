"""Shapes that are similar: the similarity is the map, no energy is lower."""

import numpy as np

from ...curve import Curve
from ...plane import rotation
from ..model.boundary_pairs import HoleMatch, Match
from .unit_problem import UnitProblem

SAME_OUTLINE_SHARE = 1e-9  # of the root of the area: outlines this close are the same
OUTLINE_SAMPLES = 256  # of each outline, compared one by one
AS_FAR_SHARE = 1e-7  # vertices this close to the farthest from the centroid may be it
MOST_STARTS = 64  # tried; a regular polygon has as many as vertices (by hand)


def similarity(source: Curve, target: Curve, *, turns: bool) -> Match | None:
    """Return the correspondence under which the target is the source, turned if `turns`; None where they are not
    similar.

    Of several the one with the least turn. Both curves have area one and centroid 0.
    """
    if abs(source.length - target.length) > SAME_OUTLINE_SHARE * source.length:
        return None
    steps = np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    w = source.at(source.length * steps)
    found = []
    for start in _far_vertices(target, np.abs(source.z).max()):
        v = target.at(start + target.length * steps)
        turn = rotation(w, v) if turns else 1.0
        if np.abs(turn * w - v).max() < SAME_OUTLINE_SHARE * 10:
            found.append((abs(np.angle(turn)), start))
    if not found:
        return None
    start = min(found)[1]
    return Match(np.array([0.0, source.length]), start + np.array([0.0, target.length]))


def _far_vertices(curve: Curve, radius: float) -> np.ndarray:
    """Arclengths of the vertices where the source's first one, its farthest, may go."""
    return curve.knots[:-1][np.abs(np.abs(curve.z) - radius) < AS_FAR_SHARE][:MOST_STARTS]


def similar_with_holes(problem: UnitProblem, match: Match) -> Match | None:
    """Return the match of similar outlines with those of holes; None unless these are similar in the same way, and the
    partners those that are wished.
    """
    if len(problem.holes[0]) != len(problem.holes[1]):
        return None
    w = problem.source.at(match.s[:1] + problem.source.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
    v = problem.target.at(
        match.tau[:1] + problem.target.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    )
    found = [_same(hole, problem.holes[1], rotation(w, v)) for hole in problem.holes[0]]
    holes = tuple(HoleMatch(i, *pair) for i, pair in enumerate(found) if pair)
    as_wished = set(problem.partners) <= {(hole.source, hole.target) for hole in holes}
    return match._replace(holes=holes) if len(holes) == len(found) and as_wished else None


def _same(hole: Curve, others: tuple[Curve, ...], turn: complex) -> tuple[int, Match] | None:
    """Return which of other curves is this one turned, and how they correspond."""
    ends = np.array([0.0, 1.0])
    w = turn * hole.at(hole.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
    for number, other in enumerate(others):
        start = other.closest(w[:1])
        v = other.at(start + other.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES)
        if np.abs(w - v).max() < SAME_OUTLINE_SHARE * 10:
            return number, Match(ends * hole.length, start + ends * other.length)
    return None
