"""How constrained points go to their goals where they cannot go straight."""

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from ...arrays import Complex
from ...plane import Similarity

FIRST_SHARE, LEAST_SHARE, STAGE_STEPS = 0.25, 0.02, 15  # of the way in stages; Newton steps in each
MOVING_DECREASE = 1e-3  # relative, of a step that ends a stage (by hand)
LEAST_FACTOR = 1e-3  # by which constraints shrink: below, they are taken as moved only


def way_to(begun: Complex, goals: Complex) -> Callable[[float], Complex]:
    """The way from points (k,) to goals (k,): a similarity turns and grows evenly, the rest goes straight.

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


class Aimed(Protocol):
    """A map in the making, and how far it is from its goals."""

    @property
    def miss(self) -> float:
        """0 where they are met."""
        ...


State = TypeVar("State", bound=Aimed)


def in_stages(
    state: State, way: Callable[[float], Complex], moved: Callable[[State, Complex], State]
) -> State:
    """The map moved along a way in stages, smaller where it gets stuck; or as far as that goes.

    Args:
        state: at the beginning of the way.
        way: as `way_to` makes it.
        moved: takes a map to goals (k,), or as close to them as it gets.
    """
    share, step = 0.0, FIRST_SHARE
    while share < 1 and step > LEAST_SHARE:
        new = min(1.0, share + step)
        tried = moved(state, way(new))
        if tried.miss > 0:
            step *= 0.5
            continue
        state, share, step = tried, new, 1.5 * step
    return state
