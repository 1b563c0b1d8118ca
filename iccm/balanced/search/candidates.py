"""Choose the best of many coarse maps.

After a few Newton steps, the best maps continue. Corners are released, so that corners of one outline can pass
those of the other, and fixed again on a new mesh.
"""

from contextlib import suppress
from functools import partial

import numpy as np

from ... import deadline, progress
from ..errors import OutOfTime, Stuck, first_success, successes
from ..model import mesh_sizes
from ..model.discrete_map import GOOD_ENOUGH, DiscreteMap
from .levels import BACKWARD_STEPS, RELEASED_STEPS, Level, refine

SCREENING = ((3, 9), (5, 5))
"""Newton steps, and the number of maps that continue: the result is within 2 % of that of converging all nine,
on 78 pairs. More steps, (5, 9), (12, 5), are within 1 %, but rotate more pictures: 24 % of 45 pairs by more
than 20°, instead of 20 %.
"""
PROMISING_ENERGY_RATIO = 1.5
"""Energy relative to the least, up to which maps continue. The mean energy of 78 pairs is 0.2 % larger with
this limit, and the slowest tenth takes a third less time; with 1.2 the energy is 0.9 % larger.
"""
HOPELESS = 5
"""Ratio of the energy after screening to the cost of the alternative, above which a map is abandoned. On 60
pairs of frames, convergence divided such large energies by at most 5.
"""
ALIKE = 1e-3, np.radians(1.0)  # relative energy, and rotation: two maps this close converge to the same one
SETTLING, ROUNDS = 2, 4
"""Rounds of steps on a new mesh, for all maps and for the finalists. With 1 and 2, worse maps were chosen for 2
of 95 pairs.
"""
CLOSE, FINALISTS = 1.1, 2
"""Energy relative to the least, up to which corners are released, and the largest number of such maps. On 16
pairs, with corners of all maps released, the best was among these, or better by at most 0.5 %.
"""
RELEASE_ROUNDS = 3  # rounds of released corners
RELEASE_GAIN_SHARE = 3e-3  # relative gain of energy from which there is another round


def screen(states: list[DiscreteMap], starts: int) -> list[DiscreteMap]:
    """Return the best maps after a few steps, best first; `starts` times as many as usual continue."""
    for steps, keep in SCREENING:
        counted = progress.counted(f"coarse maps, {steps} steps", states)
        with suppress(OutOfTime):
            states = [s.forward(1.0, steps, GOOD_ENOUGH, corners=False) for s in counted]
        states = sorted(states, key=lambda s: s.value)[: keep * starts]
    return [s for s in states if s.value <= PROMISING_ENERGY_RATIO * states[0].value]


def without_duplicates(states: list[DiscreteMap]) -> list[DiscreteMap]:
    """Return the maps, best first, without those that are equivalent to a better one."""
    distinct: list[DiscreteMap] = []
    for state in states:
        if not any(are_equivalent(state, earlier) for earlier in distinct):
            distinct.append(state)
    return distinct


def are_equivalent(first: DiscreteMap, second: DiscreteMap) -> bool:
    """Return whether two maps have the same energy and rotation."""
    rotation = np.angle(np.exp(1j * (first.rotation - second.rotation)))
    return bool(abs(first.value / second.value - 1) < ALIKE[0] and abs(rotation) < ALIKE[1])


def best_of(level: Level, states: list[DiscreteMap]) -> DiscreteMap:
    """Return the best of some maps, which are given best first.

    All converge on new meshes; then corners of the finalists are released.

    Raises:
        Stuck: none converges.
    """
    distinct = progress.counted("coarse maps", without_duplicates(states))
    settled = list(successes(partial(settle, level, state, SETTLING) for state in distinct))
    if not settled:
        if deadline.ends_search():
            return states[0]
        raise Stuck("no starting map")
    settled.sort(key=lambda s: s.value)
    most = FINALISTS * level.problem.options.effort
    finalists = [state for state in settled[:most] if state.value <= CLOSE * settled[0].value]
    counted = progress.counted("coarse maps, corners released", finalists)
    return min((release_corners(level, s) for s in counted), key=lambda s: s.value)


def settle(level: Level, state: DiscreteMap, rounds: int) -> DiscreteMap:
    """Return the converged map on a new mesh, or if it folds there, on its own, where it may still improve.

    Raises:
        Stuck: it folds there too.
    """
    state = first_success(partial(remesh, level, state), lambda: state)
    state = state.alternate(1.0, rounds, BACKWARD_STEPS)
    if not np.isfinite(state.value):
        raise Stuck("found no map without folds for this correspondence of the outlines")
    return state


def release_corners(level: Level, state: DiscreteMap) -> DiscreteMap:
    """Return the best map of a few rounds: release corners, fix them again on a new mesh, converge."""
    best = state
    for _ in range(RELEASE_ROUNDS):
        try:
            state = state.forward(1.0, RELEASED_STEPS, GOOD_ENOUGH, corners=False)
            state = remesh(level, state).alternate(1.0, ROUNDS, BACKWARD_STEPS)
        except Stuck:
            break
        previous, best = best.value, min(best, state, key=lambda s: s.value)
        if not best.value < (1 - RELEASE_GAIN_SHARE) * previous:
            break
    return best


def remesh(level: Level, state: DiscreteMap) -> DiscreteMap:
    """Return a map on a new mesh for the same match.

    It is a new map for the match, or if that folds, the same map transferred, at last to smaller triangles
    where it magnifies.

    Raises:
        Stuck: all of these fold.
    """
    return first_success(
        lambda: level.started(state.match),
        lambda: refine(level, state),
        lambda: refine(level, state, mesh_sizes.graded(state.z, state.u, state.faces, 0.5 * level.size**2)),
    )
