"""Coarse maps composed of maps to a disc, for outlines whose harmonic map cannot be unfolded, such as spirals.

Every shape has a map to a disc without folds, the harmonic map with positive weights (Tutte, *How to draw a
graph*, 1963; Floater 2003), for any correspondence of the outline with the circle. This map is balanced. Then
the map of the source to the disc, a rotation, and the inverse of the target's map are composed. The result is
one-to-one up to the resolution of the source's mesh; remaining folds are removed.
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
DISC_ROTATIONS = 8  # rotations of the disc that are tried
CORNER_FINENESS = 6e-3  # relative to the diagonal, as for other coarse meshes
DISC_STEPS = 40  # Newton steps for the map to the disc


def disc() -> Curve:
    """Return the outline of a disc of area one."""
    outline = Curve(np.exp(2j * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS))
    return Curve(outline.z / np.sqrt(outline.area))


def onto_disc(curve: Curve, level: Level) -> DiscreteMap:
    """Return the balanced map of a shape to a disc.

    Raises:
        Stuck: its triangles are too thin for double precision.
    """
    problem = UnitProblem(curve, disc(), level.problem.energy.without_rotation().without_pins())
    disc_level = Level.of(problem, level.size, 0.0, CORNER_FINENESS, level.steepest)
    match = initial_matches.arclength_matches(disc_level.source.curve, disc_level.target.curve)[0]
    return disc_level.started(match).forward(1.0, DISC_STEPS, GOOD_ENOUGH, corners=False)


def through_disc(level: Level) -> list[DiscreteMap]:
    """Return maps without folds through a disc, for those of its rotations that give one.

    There are none if the level has pairs of holes, pins or strokes.
    """
    if level.pinned or level.anchors or all(level.holes):
        return []
    try:
        source_map, target_map = (onto_disc(outline.curve, level) for outline in (level.source, level.target))
    except Stuck:
        return []
    maps = []
    for k in range(DISC_ROTATIONS):
        with suppress(Stuck):
            maps.append(_compose(level, source_map, target_map, k / DISC_ROTATIONS))
    return maps


def compose_matches(forward: Match, backward: Match, lap: float) -> Match:
    """Compose a match to a curve with the inverse of another match.

    The former is shifted by a share `lap` of the curve's length.
    """
    shifted = forward.tau + lap * (forward.tau[-1] - forward.tau[0])
    return Match(forward.s, backward.inverse().at(shifted))


def _compose(level: Level, source_map: DiscreteMap, target_map: DiscreteMap, lap: float) -> DiscreteMap:
    """Compose a map to the disc, a rotation by a share of a full turn, and the inverse of another map."""
    new = level.mapped(compose_matches(source_map.match, target_map.match, lap))
    middle = interpolate(source_map.z, source_map.faces, source_map.u, new.z) * np.exp(2j * np.pi * lap)
    u = interpolate(target_map.u, target_map.faces, target_map.z, middle)
    return new.moved_to_border(u).unfolded(harmonic=False)
