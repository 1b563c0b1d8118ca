"""Move constrained points to their goals along paths, if they cannot go straight."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...arrays import Complex
from ...plane import Similarity
from ..model.discrete_map import DiscreteMap

# First and least share of the path in a stage; Newton steps in each.
FIRST_SHARE, LEAST_SHARE, STAGE_STEPS = 0.25, 0.02, 15
MOVING_STEPS = 40  # most Newton steps while constrained points move straight, which bounds the time
MOVING_DECREASE = 1e-3  # relative decrease of a step that ends a stage: the next stage moves the points again
LEAST_FACTOR = 1e-3  # scale of the similarity below which constraints are only translated


def path_to(start: Complex, goals: Complex) -> Callable[[float], Complex]:
    """Return a path from points (k,) to goals (k,).

    It is a similarity that rotates and grows uniformly, and straight lines for the rest. The path is a function
    of a share between 0 and 1.
    """
    middle, end = start.mean(), goals.mean()
    factor = Similarity.fit(start, goals).factor
    factor = factor if abs(factor) > LEAST_FACTOR else 1.0
    deformation = goals - end - factor * (start - middle)

    def position(share: float) -> Complex:
        if share >= 1:
            return goals
        rotated = np.exp(share * np.log(complex(factor))) * (start - middle)
        return middle + share * (end - middle) + rotated + share * deformation

    return position


def satisfy_constraints(
    state: DiscreteMap, steps: int = MOVING_STEPS, decrease: float = MOVING_DECREASE
) -> DiscreteMap:
    """Move constrained vertices to their goals, straight or in stages; return the map as close as it came."""
    return stages_unless_met(state, move_straight(state, steps, decrease))


def stages_unless_met(state: DiscreteMap, straight: DiscreteMap) -> DiscreteMap:
    """Move constrained vertices to their goals in stages, if they were not met by moving straight.

    Args:
        state: the map to start from.
        straight: the map to which `move_straight` took it.
    """
    if straight.miss == 0:
        return straight
    return min(move_in_stages(state), straight, key=lambda candidate: candidate.miss)


def move_straight(
    state: DiscreteMap, steps: int = MOVING_STEPS, decrease: float = MOVING_DECREASE
) -> DiscreteMap:
    """Move constrained vertices straight to their goals, as far as they can move."""
    return replace(state, bound=True).forward(1.0, steps, decrease)


def move_in_stages(state: DiscreteMap) -> DiscreteMap:
    """Move constrained vertices along a path to their goals, in stages that become smaller if they get stuck.

    The map is returned as far as that went.
    """
    goals = state.goals
    path = path_to(state.u[state.aimed], goals)
    share, step = 0.0, FIRST_SHARE
    while share < 1 and step > LEAST_SHARE:
        new = min(1.0, share + step)
        trial = move_straight(state.with_goals(path(new)), STAGE_STEPS)
        if trial.miss > 0:
            step *= 0.5
            continue
        state, share, step = trial, new, 1.5 * step
    return state.with_goals(goals)
