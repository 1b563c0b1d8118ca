"""Paths of constrained points to their goals where they cannot go straight."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...arrays import Complex
from ...plane import Similarity
from ..model.discrete_map import DiscreteMap

FIRST_SHARE, LEAST_SHARE, STAGE_STEPS = 0.25, 0.02, 15  # of the way in stages; Newton steps in each
MOVING_STEPS = 40  # of Newton while constrained points move straight (by hand)
MOVING_DECREASE = 1e-3  # relative, of a step that ends a stage (by hand)
LEAST_FACTOR = 1e-3  # by which constraints shrink: below, they are taken as moved only


def path_to(begun: Complex, goals: Complex) -> Callable[[float], Complex]:
    """Return the way from points (k,) to goals (k,): a similarity turns and grows evenly, the rest goes straight.

    It takes a share of the way, 1 for the goals themselves.
    """
    middle, end = begun.mean(), goals.mean()
    factor = Similarity.fit(begun, goals).factor
    factor = factor if abs(factor) > LEAST_FACTOR else 1.0
    rest = goals - end - factor * (begun - middle)

    def at(share: float) -> Complex:
        if share >= 1:
            return goals
        turned = np.exp(share * np.log(complex(factor))) * (begun - middle)
        return middle + share * (end - middle) + turned + share * rest

    return at


def satisfy_constraints(
    state: DiscreteMap, steps: int = MOVING_STEPS, decrease: float = MOVING_DECREASE
) -> DiscreteMap:
    """Return the map with constrained vertices at their goals, straight or in stages; or as close as they got."""
    straight = move_straight(state, steps, decrease)
    if straight.miss == 0:
        return straight
    return min(move_in_stages(state), straight, key=lambda each: each.miss)


def move_straight(
    state: DiscreteMap, steps: int = MOVING_STEPS, decrease: float = MOVING_DECREASE
) -> DiscreteMap:
    """Return the map with constrained vertices moved straight to their goals, as far as they go."""
    return replace(state, bound=True).forward(1.0, steps, decrease)


def move_in_stages(state: DiscreteMap) -> DiscreteMap:
    """Return the map with constrained vertices moved along a path to their goals in stages, smaller where they get
    stuck; or as far as that goes.
    """
    goals = state.goals
    way = path_to(state.u[state.aimed], goals)
    share, step = 0.0, FIRST_SHARE
    while share < 1 and step > LEAST_SHARE:
        new = min(1.0, share + step)
        tried = move_straight(state.with_goals(way(new)), STAGE_STEPS)
        if tried.miss > 0:
            step *= 0.5
            continue
        state, share, step = tried, new, 1.5 * step
    return state.with_goals(goals)
