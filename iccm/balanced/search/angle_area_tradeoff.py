"""How much a map leans to angles or to sizes: less θ than asked for where K is near its bound, as long as sizes allow
it; more where angles cannot be kept, so that at least sizes are."""

from collections.abc import Callable

import numpy as np

from ...maps.distortion import Distortion
from ..errors import Stuck
from ..model.discrete_map import DiscreteMap
from ..model.measures import derivatives, within
from ..model.sketch import Sketch
from .levels import FINE_BACKWARD, POWERS, UnitProblem, alternated

# Where K on 95 % of the target is above SHEARED, θ up to 1 is lowered until it is not, unless less than EVEN of the
# target is within 2 x then, or its p95 stretch above STRETCHED. AIMED is where K is to go on the fine mesh, from which
# the last one differs by 2 %; below TOO_FAR it went too far, if less than AMPLE is within 2 x. From HOPELESS on none
# of 180 pairs (seeds 31 to 33) got there by way of a coarse map, from FARTHEST on none of 330 (35, 61 to 63) at all.
# K falls about as θ to the power STEEP.
SHEARED, AIMED, TOO_FAR, HOPELESS, FARTHEST, STRETCHED = 4.9, 4.8, 4.5, 8.7, 10.5, 5.0
EVEN, AMPLE = 0.8, 0.9
STEEP, LEAST_LEAN, LEANINGS = 0.4, 0.2, 3  # the share of θ that is left at least, and how many are tried
# Where no θ does, θ from 1 on is raised instead, so that AMPLE of the target is within 2 x: by so much for what is
# missing, which is enough for 28 of 32 such pairs of seed 35, and a K that is DEARER than that is too dear (by eye).
MORE, MORE_EACH, MOST_MORE = 0.2, 10.0, 1.5
EVENINGS, NEARLY = 2, 0.98  # rounds with it, and how near the fine mesh comes to the last one
DEARER = 1.9
# Where K is small enough and sizes are even, the last mesh leans a LITTLE to angles. From .95 on, it took two of 240
# pairs below 90 % of the area within 2 x.
LITTLE_FROM, LITTLE = 0.98, 0.75  # the share within 2 x from which it does, and the factor of θ


def leaning(problem: UnitProblem, state: DiscreteMap | Sketch) -> float:
    """θ for the last mesh: a little smaller where sizes are even and, without pins, K is small enough as it is."""
    even = within(2.0, state.z, state.u, state.material, state.metrics) >= LITTLE_FROM
    if problem.holed or problem.theta > 1 or not even:
        return problem.theta
    fine_already = problem.constrained or sheared(over_target(problem, state)) <= SHEARED
    return LITTLE * problem.theta if fine_already else problem.theta


def leant(
    problem: UnitProblem,
    state: DiscreteMap,
    again: Callable[[UnitProblem, DiscreteMap], tuple[DiscreteMap, DiscreteMap]],
    start: DiscreteMap,
) -> tuple[UnitProblem, DiscreteMap]:
    """The fine map with angles kept better where that is needed and sizes allow it, else with sizes that are even where
    angles cannot be kept; and the problem with its θ.

    Holes that shrink need all of θ, and pins stay where they are met.

    Args:
        problem: with the θ asked for. Below 1, or with bounds, it is never raised, above 1 never lowered.
        state: its fine map.
        again: the coarse and the fine map of a problem with less θ, from a coarse one.
        start: the coarse map.
    """
    first = over_target(problem, state)
    if problem.holed or problem.constrained or sheared(first) <= SHEARED:
        return problem, state
    found = None
    if problem.theta <= 1 and sheared(first) < FARTHEST:
        found = to_angles(problem, state, first, again, start)
    if found is None and problem.theta >= 1 and not problem.bounded and first.within(2) < AMPLE:
        found = to_sizes(problem, state, first)
    return found or (problem, state)


def to_angles(
    problem: UnitProblem,
    state: DiscreteMap,
    first: Distortion,
    again: Callable[[UnitProblem, DiscreteMap], tuple[DiscreteMap, DiscreteMap]],
    start: DiscreteMap,
) -> tuple[UnitProblem, DiscreteMap] | None:
    """The problem with less θ, and a fine map whose K is small enough: one that goes on from the fine map, or, where
    that does not do, one that goes on from the coarse map; None where sizes do not allow it.

    Args:
        problem: see `leant`, as for `state`, `again` and `start`.
        first: the figures with all of θ.
    """

    def onward(less: UnitProblem) -> DiscreteMap:
        nonlocal state
        state = alternated(state, less.theta, POWERS[0], 1, FINE_BACKWARD)
        return state

    def anew(less: UnitProblem) -> DiscreteMap:
        nonlocal start
        start, fine = again(less, start)
        return fine

    found = searched(problem, first, onward)
    if found is None and sheared(first) < HOPELESS:
        found = searched(problem, first, anew)
    return found


def searched(
    problem: UnitProblem, first: Distortion, mapped: Callable[[UnitProblem], DiscreteMap]
) -> tuple[UnitProblem, DiscreteMap] | None:
    """The problem with less θ and its map, whose K is small enough; by a few secants of log K over log θ.

    Args:
        problem: with all of θ.
        first: the figures with that.
        mapped: the map for less θ; raises Stuck where there is none.
    """
    found, share, steep, best = first, 1.0, STEEP, None
    for _ in range(LEANINGS):
        share *= max((AIMED / sheared(found)) ** (1 / steep), LEAST_LEAN / share)
        less = problem._replace(theta=share * problem.theta)
        try:
            tried = mapped(less)
        except Stuck:
            break
        found = over_target(problem, tried)
        far = found.within(2) < EVEN or stretched(found) > STRETCHED
        steep = max(np.log(sheared(found) / sheared(first)) / np.log(share), 0.1)
        if sheared(found) > SHEARED:
            if far or sheared(first) * LEAST_LEAN**steep > SHEARED or share <= LEAST_LEAN:
                break
            continue
        if not far:
            best = less, tried
        if sheared(found) > TOO_FAR or found.within(2) >= AMPLE:
            break
    return best


def to_sizes(
    problem: UnitProblem, state: DiscreteMap, first: Distortion
) -> tuple[UnitProblem, DiscreteMap] | None:
    """The problem with more θ, and the fine map that goes on with it, sizes even; None where that does not make them
    so, or shears or stretches too much."""
    theta = problem.theta + min(MORE + MORE_EACH * (AMPLE - first.within(2)), MOST_MORE)
    state = alternated(state, theta, POWERS[0], EVENINGS, FINE_BACKWARD)
    found = over_target(problem, state)
    torn = stretched(first) <= STRETCHED < stretched(found) / NEARLY
    if torn or found.within(2) < NEARLY * AMPLE or sheared(found) > DEARER * sheared(first):
        return None
    return problem._replace(theta=theta), state


def over_target(problem: UnitProblem, state: DiscreteMap | Sketch) -> Distortion:
    """The figures of a map over the area of the target that was given."""
    z, u, metrics = state.z, state.u, state.metrics
    if problem.inverted:
        z, u, metrics = u, z, metrics[::-1]
    f_z, f_zbar, areas = derivatives(z, u, state.material, metrics)
    return Distortion(areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2), f_z, f_zbar, 1.0)


def sheared(found: Distortion) -> float:
    """K on 95 % of the target."""
    return found.quantile(found.dilatations, 0.95)


def stretched(found: Distortion) -> float:
    """The stretch on 95 % of the target."""
    return found.quantile(found.stretches, 0.95)
