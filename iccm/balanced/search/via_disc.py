"""Maps by way of a disc, for outlines between which the harmonic map folds beyond repair (spirals, shapes with many
teeth).

Onto a disc every shape has a map without folds, the harmonic one with positive weights (Tutte, *How to draw a graph*,
1963; Floater 2003), whatever goes where on the circle. It is balanced; then there, the disc turned, and back by the
other shape's is one to one. On a mesh of the source it is so up to what the triangles resolve; what folds is undone
from there.
"""

from contextlib import suppress

import numpy as np

from ...curve import Curve
from ..errors import Stuck
from ..meshing.transfer import interpolate
from ..model.boundary_pairs import Match
from ..model.discrete_map import GOOD_ENOUGH, DiscreteMap
from . import initial_matches
from .levels import Level
from .unit_problem import UnitProblem

DISC_CORNERS = 96  # of the disc's outline
DISC_ROTATIONS = 8  # of the disc that are tried
CORNER_FINENESS = 6e-3  # relative to the diagonal, as for other coarse meshes
DISC_STEPS = 40  # of Newton on the way to it


def disc() -> Curve:
    """Return the outline of a disc of area one."""
    outline = Curve(np.exp(2j * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS))
    return Curve(outline.z / np.sqrt(outline.area))


def onto_disc(curve: Curve, level: Level) -> DiscreteMap:
    """Return the balanced map of a shape onto a disc.

    Raises:
        Stuck: its triangles are too thin for double precision.
    """
    problem = UnitProblem(curve, disc(), level.problem.energy.without_rotation().without_pins())
    own = Level.of(problem, level.size, 0.0, CORNER_FINENESS, level.steepest)
    match = initial_matches.arclength_matches(own.source.curve, own.target.curve)[0]
    return own.started(match).forward(1.0, DISC_STEPS, GOOD_ENOUGH, corners=False)


def through_disc(level: Level) -> list[DiscreteMap]:
    """Map without folds between outlines without pairs of holes, pins and strokes; those turns of the disc that give
    one.
    """
    if level.pinned or level.anchors or all(level.holes):
        return []
    try:
        there, back = (onto_disc(outline.curve, level) for outline in (level.source, level.target))
    except Stuck:
        return []
    found = []
    for k in range(DISC_ROTATIONS):
        with suppress(Stuck):
            found.append(_compose(level, there, back, k / DISC_ROTATIONS))
    return found


def through(there: Match, back: Match, lap: float) -> Match:
    """Return the match to a curve, on by a share of its length, and from there back by the other one."""
    way = there.tau + lap * (there.tau[-1] - there.tau[0])
    return Match(there.s, back.inverse().at(way))


def _compose(level: Level, there: DiscreteMap, back: DiscreteMap, lap: float) -> DiscreteMap:
    """There, on by a share of a lap, and back."""
    new = level.mapped(through(there.match, back.match, lap))
    middle = interpolate(there.z, there.faces, there.u, new.z) * np.exp(2j * np.pi * lap)
    u = interpolate(back.u, back.faces, back.z, middle)
    return new.moved_to_border(u).unfolded(harmonic=False)
