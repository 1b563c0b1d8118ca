"""Partial maps with a surface on either side.

They map between the outlines of even layouts: concavities are filled, and a filled concavity has no surface from which
to take a metric.
"""

from dataclasses import replace

import numpy as np

from ..balanced import fit, method
from ..balanced.fit import NOTED_AREA_SHARE
from ..balanced.injectivity import refuse_folds
from ..balanced.model.solution import Solution
from ..fit_data import with_details
from ..options import Options
from ..problem import Problem
from ..result import Fit
from .problem import Layouts, SurfaceProblem


def solve(problem: Problem, options: Options, layouts: Layouts) -> Fit | None:
    """Return the map with concavities filled; None where it would leave out more than is allowed.

    Raises:
        NoMapError, InputError: as `method.solve`.
    """
    surface_problem = SurfaceProblem.of(problem, options, layouts)
    solution = _solve(surface_problem)
    soft_pins, softness = surface_problem.soft_pins
    solution = replace(solution, soft_pins=soft_pins, softness=softness)
    result = fit.result_of(
        problem,
        solution,
        solution.map,
        (surface_problem.holes, surface_problem.points),
        surface_problem.options,
        in_bounds=True,
    )
    if fit.loses_too_much(result.coverage.left_out, result.coverage.uncovered, options):
        return None
    result.notes.extend(_coverage_notes(result))
    return with_details(result, layouts=layouts)


def _coverage_notes(result: Fit) -> list[str]:
    """Return notes on the hidden share of the source and the bare share of the target."""
    notes = []
    if result.coverage.left_out >= NOTED_AREA_SHARE:
        notes.append(
            f"{result.coverage.left_out:.1%} of the source is hidden, since concavities or holes of the target leave "
            "no room for it (fit)."
        )
    if result.coverage.uncovered >= NOTED_AREA_SHARE:
        notes.append(
            f"{result.coverage.uncovered:.1%} of the target stays bare, where concavities or holes of the source "
            "open (fit)."
        )
    return notes


def _solve(problem: SurfaceProblem) -> Solution:
    """Return the map in the user's planes."""
    sides, pins = problem.sides, problem.inner_pins
    holes = problem.inner_holes
    between = Problem(
        sides[0].solved[0],
        sides[1].solved[0],
        np.concatenate([pins.inner, pins.outer]),
        [(stroke.source, stroke.target) for stroke in pins.strokes],
        holes,
        softness=problem.inner_softness,
    )
    solution = method.solve(between, problem.options)
    map = solution.map
    z, u = (side.outward(w, side.is_on(w)) for side, w in zip(sides, (map.source, map.image)))
    for name, w in (("source", z), ("image", u)):
        refuse_folds(name, w, map.faces)
    filled = solution.filled and (
        sides[0].loop_outward(solution.filled[0]),
        sides[1].loop_outward(solution.filled[1]),
    )
    return replace(solution, map=replace(map, source=z, image=u), filled=filled)
