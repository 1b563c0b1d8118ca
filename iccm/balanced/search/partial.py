"""Maps with filled concavities, for the fits that leave parts out.

If the source's concavities are filled, all of the source is shown, and the target stays bare where they open
(contain). If the target's are filled, all of the target is covered, and parts of the source are hidden (cover).
"""

import numpy as np

from ...fits import FITS
from ..holes.bays import fill_half_hull, fill_hull
from .unit_problem import UnitProblem

LARGEST_FILLED_AREA = 16.0
"""Largest area with filled concavities, relative to the shape's. An arrowhead of wire, for example, would need
500 times as many triangles as without, and leave nearly all of the target bare.
"""


def bay_choices(problem: UnitProblem) -> list[UnitProblem]:
    """Return the problem with the concavities of one side filled, for each side that may have them filled.

    For the target's concavities this is the inverse problem.
    """
    problems: list[UnitProblem] = []
    for side in FITS[problem.options.fit].fills:
        with_filled_bays = with_bays(problem if side == "source" else problem.inverse())
        if (
            with_filled_bays.bays
            and can_fill(with_filled_bays)
            and with_filled_bays.source.area <= LARGEST_FILLED_AREA
        ):
            problems.append(with_filled_bays)
    return problems


def with_bays_like(problem: UnitProblem, example: UnitProblem) -> UnitProblem | None:
    """Return the problem with concavities filled on the same side as in another problem; None if that is impossible."""
    if not example.bays:
        return problem
    bay_problem = with_bays(problem.inverse() if example.inverted else problem)
    return bay_problem if can_fill(bay_problem) else None


def can_fill(problem: UnitProblem) -> bool:
    """Return whether holes without a partner are on the side whose concavities are filled."""
    return len(problem.holes.source) >= len(problem.holes.target)


def with_bays(problem: UnitProblem) -> UnitProblem:
    """Return the problem with the concavities of its source filled, except where the outline is pinned."""
    if not problem.halved:
        filled = fill_hull(problem.source, problem.anchors[0])
        return problem._replace(source=filled.outline, bays=filled.bays)
    ends, goals = problem.anchors
    top = int(np.flatnonzero(problem.source.z == ends[1])[0])
    filled, upper = fill_half_hull(problem.source, top)
    anchors = (complex(filled.outline.z[0]), upper), goals
    return problem._replace(source=filled.outline, bays=filled.bays, anchors=anchors)
