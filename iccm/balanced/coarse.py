"""Coarse maps between outlines, cheap enough to compare several pairs of outlines before one is solved."""

from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..arrays import Flags
from ..curve import Curve
from ..errors import InputError
from ..plane import Similarity
from .constraints.validate import UNPINNED
from .errors import Stuck
from .holes.given import NONE, Holes
from .model.discrete_map import BAY, FILLED, DiscreteMap
from .model.frames import frames_of, unit_curve
from .model.mesh_map import MeshMap
from .model.settings import Settings, SolveLog
from .search import multilevel
from .search.partial import bay_choices
from .search.unit_problem import UnitProblem


class CoarseMap(NamedTuple):
    """A map on a coarse mesh, in the given coordinates.

    Attributes:
        map: the map, with weights for the triangles that fill concavities or holes.
        turning: the factor by which its rotation raises the cost.
    """

    map: MeshMap
    turning: float

    @property
    def voids(self) -> Flags:
        """(m,) the virtual triangles, which fill concavities or holes and do not belong to the map."""
        weights = self.map.weights
        if weights is None:
            return np.zeros(len(self.map.faces), bool)
        return (weights == FILLED) | (weights == BAY)


def coarse_map(source: Curve, target: Curve, settings: Settings, *, most: float = np.inf) -> CoarseMap | None:
    """Return the best coarse map between two whole outlines without holes, starting from elastic matches.

    Args:
        source: outline of the source.
        target: outline of the target.
        settings: options of the map.
        most: give up if the energy of all candidates is above this after a few steps.

    Returns:
        The map; None if there is none.
    """
    frames = frames_of(source, target, settings.turn, ((), ()))
    problem = _problem(source, target, NONE, frames, settings)
    return _solved(multilevel.directions(problem)[0], frames, most)


def coarse_filled(source: Curve, target: Curve, settings: Settings) -> Iterator[CoarseMap]:
    """Yield coarse maps of two outlines with filled concavities.

    The filled side is the one that `settings.fit` (contain or cover) names.
    """
    frames = frames_of(source, target, settings.turn, ((), ()))
    for problem in bay_choices(_problem(source, target, NONE, frames, settings), settings):
        map = _solved(problem, frames)
        if map is not None:
            yield map


def coarse_holed(source: Curve, target: Curve, holes: Holes, settings: Settings) -> CoarseMap | None:
    """Return the best coarse map that takes holes onto holes; None if there is none."""
    frames = frames_of(source, target, settings.turn, holes.sides)
    problem = _problem(source, target, holes, frames, settings)
    return _solved(multilevel.directions(problem)[0], frames)


def _problem(
    source: Curve, target: Curve, holes: Holes, frames: tuple[Similarity, Similarity], settings: Settings
) -> UnitProblem:
    outlines = unit_curve(frames[0], source), unit_curve(frames[1], target)
    return multilevel.problem_of(*outlines, holes.unit(frames), UNPINNED, settings)


def _solved(
    used: UnitProblem, frames: tuple[Similarity, Similarity], most: float = np.inf
) -> CoarseMap | None:
    """Return the coarse map of a problem, or the inverse of that of an inverse problem, in the given coordinates."""
    with suppress(Stuck, InputError):
        plain = not (used.holed or used.bays)
        size = multilevel.coarse_size(used)
        state: DiscreteMap = multilevel.coarse_map(used, size, SolveLog(), elastic=plain, most=most)
        z, u = (state.u, state.z) if used.inverted else (state.z, state.u)
        # a mirrored solution is mirrored back, after which its triangles would be clockwise
        faces = state.faces[:, ::-1] if frames[0].mirrored else state.faces
        map = MeshMap.plain(
            frames[0].pull_back(z), frames[1].pull_back(u), faces, state.border, weights=state.weights
        )
        return CoarseMap(map, used.energy.rotation_cost(state.turn))
    return None
