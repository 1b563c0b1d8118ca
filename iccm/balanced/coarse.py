"""Coarse maps between outlines, cheap enough to compare several pairs of outlines; the best one is refined."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

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


@dataclass(frozen=True, eq=False)
class CoarseMap:
    """A map on a coarse mesh, from which a solve of the same outlines continues.

    Attributes:
        problem: the problem in unit coordinates that the map solves; it may be the inverse of the given one.
        state: the map.
        frames: of the unit coordinates.
    """

    problem: UnitProblem
    state: DiscreteMap
    frames: tuple[Similarity, Similarity]

    @cached_property
    def map(self) -> MeshMap:
        """The map in the given coordinates and direction, with weights for the triangles that fill gaps."""
        state = self.state
        z, u = (state.u, state.z) if self.problem.inverted else (state.z, state.u)
        # a mirrored solution is mirrored back, after which its triangles would be clockwise
        faces = state.faces[:, ::-1] if self.frames[0].mirrored else state.faces
        return MeshMap.plain(
            self.frames[0].pull_back(z),
            self.frames[1].pull_back(u),
            faces,
            state.border,
            weights=state.weights,
        )

    @property
    def rotation_cost(self) -> float:
        """The factor by which its rotation raises the cost."""
        return self.problem.energy.rotation_cost(self.state.turn)

    @property
    def voids(self) -> Flags:
        """(m,) the virtual triangles, which fill concavities or holes and do not belong to the map."""
        weights = self.state.weights
        if weights is None:
            return np.zeros(len(self.state.faces), bool)
        return (weights == FILLED) | (weights == BAY)


def coarse_map(
    source: Curve, target: Curve, settings: Settings, *, holes: Holes = NONE, most: float = np.inf
) -> CoarseMap | None:
    """Return the best coarse map between two whole outlines, which takes holes onto holes.

    Args:
        source: outline of the source.
        target: outline of the target.
        settings: options of the map.
        holes: of both.
        most: give up if the energy of all candidates is above this after a few steps.

    Returns:
        The map; None if there is none.
    """
    problem, frames = _problem(source, target, holes, settings)
    return _solved(multilevel.directions(problem)[0], frames, most)


def coarse_filled(
    source: Curve, target: Curve, settings: Settings, *, holes: Holes = NONE
) -> Iterator[CoarseMap]:
    """Yield coarse maps of two outlines with filled concavities.

    The filled side is the one that `settings.fit` (contain or cover) names.
    """
    problem, frames = _problem(source, target, holes, settings)
    for filled in bay_choices(problem, settings):
        map = _solved(filled, frames)
        if map is not None:
            yield map


def _problem(
    source: Curve, target: Curve, holes: Holes, settings: Settings
) -> tuple[UnitProblem, tuple[Similarity, Similarity]]:
    """Return the problem that a solve of these outlines refines, and the frames of its unit coordinates."""
    frames = frames_of(source, target, settings.turn, holes.sides)
    outlines = multilevel.rounded(
        unit_curve(frames[0], source), unit_curve(frames[1], target), holes.unit(frames)
    )
    return multilevel.problem_of(*outlines, UNPINNED, settings.in_frames(frames)), frames


def _solved(
    problem: UnitProblem, frames: tuple[Similarity, Similarity], most: float = np.inf
) -> CoarseMap | None:
    """Return the coarse map of a problem; None if there is none, or its energy is above `most`."""
    try:
        state = multilevel.coarse_map(problem, multilevel.coarse_size(problem), SolveLog(), most=most)
    except (Stuck, InputError):
        return None
    return CoarseMap(problem, state, frames)
