"""Correspondences of two shapes with one hole each, by way of a ring: each is mapped onto it, and it may turn.

Elastic matching pairs the two outlines of a shape apart from each other; a map onto a ring tells how they belong
together.
"""

from contextlib import suppress

import numpy as np

from ...curve import Curve
from ..errors import Stuck
from ..model.boundary_pairs import HoleMatch, Match
from ..model.discrete_map import GOOD_ENOUGH
from . import initial_matches
from .hole_partners import Partners
from .levels import Level, UnitProblem

INNER = 0.5  # radius of the hole in radii of the ring
CORNERS = 96  # of its outer outline
TURNS = 8  # of the ring that are tried
CORNER_FINENESS = 6e-3  # of the diagonal, as for other coarse meshes
STEPS = 40  # of Newton on the way to it


def ring() -> tuple[Curve, Curve]:
    """The outlines of a ring of area one, the hole's clockwise."""
    corners = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS)
    outer, inner = Curve(corners), Curve(INNER * corners[::-1])
    root = np.sqrt(outer.area + inner.area)
    return Curve(outer.z / root), Curve(inner.z / root)


def onto_ring(outer: Curve, hole: Curve, level: Level) -> Match | None:
    """How the outlines of a shape with a hole correspond to those of a ring; None where every start folds."""
    goal = ring()
    problem = UnitProblem(outer, goal[0], level.problem.energy.without_rotation(), holes=((hole,), goal[1:]))
    own = Level.of(problem, level.size, 0.0, CORNER_FINENESS, level.steepest)
    matches = [next(initial_matches.elastic_matches(own.source.curve, own.target.curve, 0.0))]
    matches += initial_matches.arclength_matches(own.source.curve, own.target.curve)[:1]
    partners = Partners(*own.domains, ())
    for match in matches:
        with suppress(Stuck):
            state = own.started(partners.of(match))
            return state.forward(1.0, STEPS, GOOD_ENOUGH, corners=False).match
    return None


def ring_matches(level: Level) -> list[Match]:
    """Correspondences of two shapes with one hole each; none where one cannot be mapped onto a ring."""
    sides = ((level.source, level.holes[0][0]), (level.target, level.holes[1][0]))
    found = [onto_ring(outer.curve, hole.curve, level) for outer, hole in sides]
    if found[0] is None or found[1] is None:
        return []
    return [_compose(found[0], found[1], k / TURNS) for k in range(TURNS)]


def _compose(there: Match, back: Match, lap: float) -> Match:
    """To the ring, on by a share of a lap, and back."""
    outer = through(there, back, lap)
    hole = through(there.holes[0].match, back.holes[0].match, -lap)  # it runs clockwise
    return outer._replace(holes=(HoleMatch(0, 0, hole),))


def through(there: Match, back: Match, lap: float) -> Match:
    """To a curve that turns, on by a share of a lap, and back."""
    way = there.tau + lap * (there.tau[-1] - there.tau[0])
    return Match(there.s, back.inverse().at(way))
