"""Coarse maps between outlines, cheap enough to compare several pairs of outlines; the best one is refined."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Flags
from ..curve import Curve
from ..errors import InputError
from ..options import Options
from ..plane import Similarity, stretched
from ..problem import NO_HOLES, Holes
from .constraints.validate import UNPINNED
from .errors import Stuck
from .holes.given import unit_holes
from .model.discrete_map import BAY, FILLED
from .model.energy import Energy
from .model.mesh_map import MeshMap
from .model.solution import SolveLog
from .model.unit_coordinates import unit_curve, unit_similarities
from .search import multilevel
from .search.partial import bay_choices
from .search.rounding import rounded
from .search.unit_problem import SolvedProblem, UnitProblem


@dataclass(frozen=True, eq=False)
class CoarseMap:
    """A map on a coarse mesh, from which a solve of the same outlines continues.

    Attributes:
        solved: the problem in unit coordinates, which may be the inverse of the given one, and the map.
        to_unit: the similarities of both sides to unit coordinates.
        stretch: ratio by which the source's width was stretched relative to its height before it was mapped.
    """

    solved: SolvedProblem
    to_unit: tuple[Similarity, Similarity]
    stretch: float = 1.0

    @cached_property
    def map(self) -> MeshMap:
        """The map in the given coordinates and direction, with weights for the triangles that fill gaps."""
        problem, state = self.solved
        z, u = (state.u, state.z) if problem.inverted else (state.z, state.u)
        # a mirrored solution is mirrored back, after which its triangles would be clockwise
        faces = state.faces[:, ::-1] if self.to_unit[0].mirrored else state.faces
        return MeshMap.plain(
            stretched(self.to_unit[0].pull_back(z), 1 / self.stretch),
            self.to_unit[1].pull_back(u),
            faces,
            state.border,
            weights=state.weights,
        )

    @property
    def rotation_cost(self) -> float:
        """The factor by which its rotation raises the cost."""
        problem, state = self.solved
        return problem.energy.rotation_cost(state.rotation)

    @property
    def voids(self) -> Flags:
        """The virtual triangles, which fill concavities or holes and do not belong to the map; shape (m,)."""
        weights = self.solved.state.weights
        if weights is None:
            return np.zeros(len(self.solved.state.faces), bool)
        return (weights == FILLED) | (weights == BAY)


def coarse_map(
    source: Curve,
    target: Curve,
    options: Options,
    *,
    holes: Holes = NO_HOLES,
    most: float = np.inf,
    stretch: float = 1.0,
) -> CoarseMap | None:
    """Return the best coarse map between two whole outlines, which takes holes onto holes.

    Args:
        source: outline of the source.
        target: outline of the target.
        options: options of the solver.
        holes: of both.
        most: give up if the energy of all candidates is above this after a few steps.
        stretch: ratio by which the source's width is stretched relative to its height before it is mapped.

    Returns:
        The map; None if there is none.
    """
    if stretch != 1:
        source = Curve(stretched(source.z, stretch))
    problem, to_unit = _problem(source, target, holes, options)
    coarse = _solved(multilevel.directions(problem)[0], to_unit, most)
    return None if coarse is None else replace(coarse, stretch=stretch)


def coarse_filled(
    source: Curve, target: Curve, options: Options, *, holes: Holes = NO_HOLES
) -> Iterator[CoarseMap]:
    """Yield coarse maps of two outlines with filled concavities.

    The filled side is the one that the option `fit` (contain or cover) names.
    """
    problem, to_unit = _problem(source, target, holes, options)
    for filled in bay_choices(problem):
        map = _solved(filled, to_unit)
        if map is not None:
            yield map


def _problem(
    source: Curve, target: Curve, holes: Holes, options: Options
) -> tuple[UnitProblem, tuple[Similarity, Similarity]]:
    """Return the problem that a solve of these outlines refines, and the similarities to its unit coordinates."""
    to_unit = unit_similarities(source, target, options.rotation, holes.sides)
    outlines = unit_curve(to_unit[0], source), unit_curve(to_unit[1], target)
    energy = Energy.of(options).in_unit(to_unit)
    given = UnitProblem.of(outlines, unit_holes(to_unit, holes), UNPINNED, energy, options)
    return multilevel.simplified(rounded(given)), to_unit


def _solved(
    problem: UnitProblem, to_unit: tuple[Similarity, Similarity], most: float = np.inf
) -> CoarseMap | None:
    """Return the coarse map of a problem; None if there is none, or its energy is above `most`."""
    try:
        state = multilevel.best_of_starts(problem, multilevel.coarse_size(problem), SolveLog(), most=most)
    except (Stuck, InputError):
        return None
    return CoarseMap(SolvedProblem(problem, state), to_unit)
