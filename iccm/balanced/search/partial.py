"""Partial maps: the cheapest of the whole map and of maps with filled concavities or ignored holes.

If the source's concavities are filled, all of the source is shown, and the target stays bare where they open
(contain). If the target's are filled, all of the target is covered, and parts of the source are hidden (cover).
A point without a partner costs LOST (`drawings.cost`).
"""

import numpy as np

from ...curve import inside_any
from ...fits import FITS
from ...plane import triangle_areas
from ..holes.bays import fill_half_hull, fill_hull
from ..holes.given import Holes
from ..model.discrete_map import DiscreteMap
from ..model.measures import stretch_quantile
from ..model.outline import Outline
from ..model.settings import Settings
from .hole_partners import Partners
from .unit_problem import Numbers, UnitProblem

GOOD_STRETCH = 2.2  # a whole map is accepted with at most this stretch on 95 % of the area,
GOOD_ROTATION_RADIANS = np.radians(20)  # and at most this rotation
LARGEST_FILLED_AREA = 16.0
"""Largest area with filled concavities, relative to the shape's. An arrowhead of wire, for example, would need
500 times as many triangles as without, and leave nearly all of the target bare.
"""


def hole_choices(problem: UnitProblem) -> list[UnitProblem]:
    """Return the problem with all of its holes, with those that have partners, and with those of requested pairs only.

    The map ignores the other holes.
    """
    counts = tuple(map(len, problem.holes))
    choices: list[Numbers] = [problem.numbers]
    if counts[0] != counts[1] and all(counts):
        sources = [Outline.of(curve, 0.0, 0.0) for curve in (problem.source, *problem.holes[0])]
        targets = [Outline.of(curve, 0.0, 0.0) for curve in (problem.target, *problem.holes[1])]
        pairs = Partners(sources, targets, problem.partners).assigned(0.0)
        choices.append((tuple(pairs[0].tolist()), tuple(pairs[1].tolist())))
    if any(counts):
        wished = [tuple(pair[k] for pair in problem.partners) for k in (0, 1)]
        choices.append((wished[0], wished[1]))
    return [with_holes_of(problem, numbers) for numbers in dict.fromkeys(choices)]


def with_holes_of(problem: UnitProblem, numbers: Numbers) -> UnitProblem:
    """Return the problem with only those of its holes that have the given numbers."""
    holes = Holes(*problem.holes, problem.partners)
    selected, passed = holes.only(numbers), holes.others(numbers)
    return problem._replace(holes=selected.sides, partners=selected.partners, passed=passed, numbers=numbers)


def bay_choices(problem: UnitProblem, settings: Settings) -> list[UnitProblem]:
    """Return the problem with the concavities of one side filled, for each side that may have them filled.

    For the target's concavities this is the inverse problem.
    """
    problems: list[UnitProblem] = []
    for side in FITS[settings.fit].fills:
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
    return len(problem.holes[0]) >= len(problem.holes[1])


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


def lost_shares(problem: UnitProblem, state: DiscreteMap) -> tuple[float, float]:
    """Return the share of the source's area that is hidden, and of the target's that is bare.

    These are virtual triangles, and holes that are ignored. The map may be of the problem or of its inverse;
    the shares are always of the given source and target.
    """
    void = np.zeros(len(state.faces), bool) if state.weights is None else state.weights != 1
    source = ~void & inside_any(problem.passed[0], state.z[state.faces].mean(axis=1))
    target = ~void & inside_any(problem.passed[1], state.u[state.faces].mean(axis=1))
    areas = [np.abs(triangle_areas(w[state.faces])) for w in (state.z, state.u)]
    visible = areas[0] * ~void
    hidden = float((visible * target).sum() / visible.sum())
    bare = float((areas[1] * (void | source)).sum() / areas[1].sum())
    return (bare, hidden) if problem.inverted else (hidden, bare)


def is_good(problem: UnitProblem, state: DiscreteMap) -> bool:
    """Return whether a whole map is accepted without trying partial ones.

    That is so if it has little stretch, and is as upright as requested.
    """
    upright = problem.energy.upright == 0 or abs(state.turn) <= GOOD_ROTATION_RADIANS
    return upright and stretch_quantile(state.z, state.u, state.material, 0.95) <= GOOD_STRETCH


def cost(problem: UnitProblem, state: DiscreteMap) -> float:
    """Return the cost by which partial maps are compared.

    It is the mean energy at q = 1 over source and target, without the outline's term, with the cost of rotation
    and of uncovered parts.
    """
    shares = lost_shares(problem, state)
    return problem.energy.cost(state.z, state.u, state.material, shares, state.metrics, state.turn)


def is_within(problem: UnitProblem, state: DiscreteMap, settings: Settings) -> bool:
    """Return whether no more of the source is hidden, and no more of the target bare, than allowed."""
    left_out, uncovered = lost_shares(problem, state)
    return left_out <= settings.max_left_out and uncovered <= settings.max_uncovered
