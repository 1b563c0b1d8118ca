"""The balanced method as one of the methods: a problem and options in, a fit out."""

from dataclasses import replace

import numpy as np

from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import bulges
from ..problem import Options, Problem
from ..result import Fit, Status
from .holes.given import Holes, named
from .method import solve as solved
from .solution import Settings, Solution


def solve(problem: Problem, options: Options) -> Fit:
    """The balanced map of a problem.

    Raises:
        NoMapError: no map without folds was found.
        InputError: pins or strokes that no one-to-one map meets.
    """
    source, target = problem.given
    settings = Settings(
        theta=options.balance,
        turn=None if options.turn == "any" else float(np.radians(options.turn)),
        tolerance=options.tolerance,
        max_dilatation=options.max_dilatation,
        max_stretch=options.max_stretch,
    )
    strokes = problem.given_strokes
    given = Holes(problem.source_holes, problem.target_holes, problem.hole_partners)
    holes, pins, numbers = named(given, source, target, problem.given_pins, strokes)
    found = solved(source, target, settings, pins, strokes, holes, numbers)
    map = TriangulatedMap(found.source, found.image, found.faces, found.loops)
    if len(found.lines):
        bulge = bulges(found.faces, found.image, found.source, map.edges, found.lines)
        map = replace(map, bulge=bulge)
    status = _status(found, options)
    energies = [{"total": float(level["energy"])} for level in found.energies]
    return Fit(
        *(map, status, energies, source, target, pins, strokes, list(found.notes)),
        source_holes=holes.source,
        target_holes=holes.target,
        hole_partners=found.partners,
    )


def _status(found: Solution, options: Options) -> Status:
    if not found.met:
        return Status.PINS
    if found.gap > options.tolerance:
        return Status.GAP
    return Status.REACHED if found.reached else Status.BOUNDS
