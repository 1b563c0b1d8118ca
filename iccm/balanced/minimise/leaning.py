"""How much a map leans to angles: less θ than asked for where K is near its bound, as long as sizes allow it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...maps.distortion import Distortion
from ..discrete import DiscreteMap
from ..levels import FINE_BACKWARD, POWERS, SETTLED, Sketch, UnitProblem, alternated
from ..metric import PLANES
from .emphasis import BalanceField, emphasised
from .measures import derivatives, within

# Where K on 95 % of the target is above SHEARED, θ is lowered until it is not, but for less than EVEN of the target
# within 2 x, or a p95 stretch above STRETCHED. At AMPLE nothing more is wished. The last mesh differs by 2 % of K.
SHEARED, TOO_FAR, STRETCHED, EVEN, AMPLE = 4.88, 4.3, 4.9, 0.8, 0.903
HOPELESS = 10.0  # K from which none got there: three of two times 60 pairs, up to 13
LESS, LEAST = 0.8, 0.1  # the factor of θ from round to round, and its least share
RESTING = 20  # steps, as on the last mesh, before θ is taken; on the map alone: on its inverse weighed triangles shrink
# Where K is small enough and sizes are even, the last mesh leans a LITTLE to angles. From .95 on, it took two of 240
# pairs below 90 % of the area within 2 x.
LITTLE_FROM, LITTLE = 0.98, 0.75  # the share within 2 x from which it does, and the factor of θ


def leaning(problem: UnitProblem, state: DiscreteMap | Sketch) -> float:
    """θ for the last mesh: a little smaller where sizes are even and, without pins, K is small enough as it is."""
    even = within(2.0, state.z, state.u, state.material, state.metrics) >= LITTLE_FROM
    if state.balance or problem.holed or problem.theta > 1 or not even:
        return problem.theta
    fine_already = problem.constrained or sheared(over_target(problem, state)) <= SHEARED
    return LITTLE * problem.theta if fine_already else problem.theta


def own_balance(problem: UnitProblem, state: DiscreteMap) -> float | BalanceField:
    """θ of a map, as its field if it has one."""
    return problem.theta if state.balance is None else state.balance.times(problem.theta)


def balance_on(state: DiscreteMap, before: DiscreteMap | Sketch, theta: float) -> float | BalanceField:
    """θ of a map that comes from another one, as a field if that has one."""
    if before.balance is None:
        return theta
    return before.balance.carried(before.z, before.faces, state.z, state.faces).times(theta)


def leant(problem: UnitProblem, state: DiscreteMap) -> tuple[UnitProblem, DiscreteMap]:
    """The fine map with angles kept better where that is needed and sizes allow it, and the problem with its θ.

    Holes that shrink need all of θ, and who asks for θ > 1 asks for even sizes; pins stay where they are met.
    """
    settled = problem.holed or problem.constrained or problem.theta > 1
    if settled or not SHEARED < sheared(over_target(problem, state)) < HOPELESS:
        return problem, state
    best = None
    for less, tried in leaning_on(problem, state):
        found = over_target(problem, tried)
        if fits(found) and (best is None or found.within(2) >= AMPLE):
            tried = tried.forward(own_balance(less, tried), POWERS[0], RESTING, SETTLED, corners=True)
            found = over_target(problem, tried)
            best = (less, tried) if fits(found) else best
        if found.within(2) < EVEN or sheared(found) < TOO_FAR or (fits(found) and found.within(2) >= AMPLE):
            break
    return best or (problem, state)


def leaning_on(problem: UnitProblem, state: DiscreteMap) -> Iterator[tuple[UnitProblem, DiscreteMap]]:
    """The problem with less and less θ, and a fine map for each, that goes on from the one before.

    On surfaces, whose metric the field does not know of, θ is the same for all triangles.
    """
    share = 1.0
    while share >= LEAST:
        less = problem._replace(theta=share * problem.theta)
        if problem.metrics == PLANES:
            state = replace(state, balance=emphasised(state.z, state.u, state.faces).mean(state.balance))
        state = alternated(state, own_balance(less, state), POWERS[0], 1, FINE_BACKWARD)
        yield less, state
        share *= LESS


def over_target(problem: UnitProblem, state: DiscreteMap | Sketch) -> Distortion:
    """The figures of a map over the area of the target that was given."""
    z, u, metrics = state.z, state.u, state.metrics
    if problem.inverted:
        z, u, metrics = u, z, metrics[::-1]
    f_z, f_zbar, areas = derivatives(z, u, state.material, metrics)
    return Distortion(areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2), f_z, f_zbar, 1.0)


def fits(found: Distortion) -> bool:
    """Whether K is small enough, and sizes still allow it."""
    even = found.within(2) >= EVEN and found.quantile(found.stretches, 0.95) <= STRETCHED
    return even and sheared(found) <= SHEARED


def sheared(found: Distortion) -> float:
    """K on 95 % of the target."""
    return found.quantile(found.dilatations, 0.95)
