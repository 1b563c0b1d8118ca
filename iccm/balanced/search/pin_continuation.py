"""Move pins to their goals, among the starts and on the meshes that follow."""

from dataclasses import replace
from functools import partial

import numpy as np

from ... import progress
from ...arrays import Complex
from ..constraints import strokes
from ..constraints.strokes import StrokePair
from ..errors import OutOfTime, Stuck, first_success, successes, until_time_is_over
from ..meshing.mesh import Sizes
from ..model import mesh_sizes
from ..model.boundary_pairs import Match
from ..model.discrete_map import GOOD_ENOUGH, DiscreteMap, folds
from ..model.mesh_map import MeshMap
from ..model.solution import SolveLog
from . import initial_matches
from .candidates import without_duplicates
from .grid_paths import route
from .homotopy import MOVING_DECREASE, move_straight, satisfy_constraints, stages_unless_met
from .levels import (
    BACKWARD_STEPS,
    RELEASED_STEPS,
    Level,
    interpolate_on,
    refine,
)

FIRST_STEPS = 3  # Newton steps before pins are moved; as for starts without pins
BROUGHT = 6  # starts, best without pins, that are moved in stages if none met its pins
LED = 2  # starts, of these, whose pins are led around each other if still none met them
HELD_STEPS = 10  # steps of unfolding around held pins; if it succeeds, then mostly within these
FEW_FOLDS = 20  # most folds with which that is tried: with more it failed on 33 of 34 meshes
RELAXING_STEPS = 20  # Newton steps without pins, if a map with pins folds on a new mesh
REMESHES = 2  # new meshes per straight piece of a pin's path
KEPT = 3  # starts, best with pins met, that are converged
TURNED_STARTS = 3  # elastic matches at the rotation that fits the pins best
BESIDE = 0.5  # share of evenly spaced goals mixed into the closest points, on strokes whose ends slide
STRONG = 3.0  # times the energy without pins, from which a note reports strong stretch
STRETCHED = "The pins stretch the picture strongly: the energy is more than three times that without pins."
RELEASES = 2  # rounds of releasing corners with pins held


def aim_feet(pairs: tuple[StrokePair, ...], state: DiscreteMap, even: float) -> DiscreteMap:
    """Return the map with the goals of strokes whose ends slide moved close to their present images."""
    return replace(state, inside=strokes.aim_feet(state.inside, pairs, state.u[state.inner], even))


def lead_one_by_one(level: Level, state: DiscreteMap) -> DiscreteMap:
    """Lead pins to their goals one after the other, the nearest first, around the other pins and the outline.

    If a pin gets stuck, the map is returned as far as that went.
    """
    goals = state.inside.goals
    state = state.hold_in_place()
    for pin in np.argsort(np.abs(goals - state.inside.goals), kind="stable"):
        positions = state.inside.goals
        for place in route(level.target.curve, positions[pin], goals[pin], np.delete(positions, pin)):
            aims = state.inside.goals.copy()
            aims[pin] = place
            state = move_on_new_meshes(level, state, aims)
            if state.miss > 0:
                return state.with_goals(goals)
    return state


def move_on_new_meshes(level: Level, state: DiscreteMap, aims: Complex) -> DiscreteMap:
    """Move pins straight, on new meshes if they get stuck; return the map as close to the goals as it came."""
    for attempt in range(1 + REMESHES):
        trial = move_straight(state.with_goals(aims))
        if trial.miss == 0 or attempt == REMESHES:
            break
        rested = trial.hold_in_place().forward(1.0, FIRST_STEPS, MOVING_DECREASE, corners=True)
        try:
            sizes = mesh_sizes.graded(rested.z, rested.u, rested.faces, 0.5 * level.size**2)
            state = refine(level, rested, sizes, only=HELD_STEPS)
        except Stuck:
            break
    return trial


def pin_aligned_matches(level: Level, pins: Complex) -> list[Match]:
    """Return elastic matches at the rotation that fits the pins (k, 2) best; none for fewer than two pins."""
    if len(pins) < 2:
        return []
    a, b = pins.T - pins.T.mean(axis=1, keepdims=True)
    source, target = level.source.curve, level.target.curve
    distinct = initial_matches.Different(source, target)
    initial_matches.first_new(
        distinct,
        initial_matches.elastic_matches(source, target, float(np.angle(np.vdot(a, b)))),
        TURNED_STARTS,
    )
    return distinct.matches


def rank(state: DiscreteMap) -> tuple[float, float]:
    """Return a sort key of maps.

    Maps that meet their constraints come first, by energy; the others follow by their distance to the goals.
    """
    return state.miss, state.value


def screen(level: Level, matches: list[Match]) -> tuple[list[DiscreteMap], float]:
    """Return the best maps with pins moved, best first, and the least energy without pins.

    Pins are moved straight; if no map meets its pins, in stages; and if still none does, around each other.
    """

    def started(match: Match) -> DiscreteMap:
        return level.mapped(match).unfold_from_harmonic().forward(1.0, FIRST_STEPS, 1e-4, corners=False)

    states = list(successes(partial(started, match) for match in progress.counted("starts", matches)))
    free = min((state.value for state in states), default=np.inf)
    states = [aim_feet(level.problem.strokes, state, BESIDE) for state in states]
    straight = (move_straight(state) for state in progress.counted("pins moved", states))
    pairs = list(zip(states, until_time_is_over(straight)))
    ends = sorted((end for _, end in pairs), key=rank)
    if ends and ends[0].miss > 0:
        pairs = sorted(pairs, key=lambda pair: pair[0].value)[:BROUGHT]
        states = [state for state, _ in pairs]
        staged = (stages_unless_met(*pair) for pair in progress.counted("pins moved in stages", pairs))
        ends = sorted([*until_time_is_over(staged), *ends], key=rank)
    if ends and ends[0].miss > 0 and not level.problem.strokes:
        ways = progress.counted("pins led around each other", states[:LED])
        led = (lead_one_by_one(level, state) for state in ways)
        ends = sorted([*until_time_is_over(led), *ends], key=rank)
    return ends[:KEPT], free


def settle_pinned(level: Level, state: DiscreteMap) -> DiscreteMap:
    """Return the best map of a few rounds with pins held: release corners, make a new mesh, converge."""
    try:
        best = state = state.alternate(1.0, 4, BACKWARD_STEPS)
    except OutOfTime:
        return state
    for _ in range(RELEASES):
        try:
            state = state.forward(1.0, RELEASED_STEPS, GOOD_ENOUGH, corners=False)
            state = refine_pinned(level, state).alternate(1.0, 4, BACKWARD_STEPS)
        except Stuck:
            break
        if state.value >= best.value:
            break
        best = state
    return best


def refine_pinned(level: Level, state: MeshMap, sizes: Sizes | None = None) -> DiscreteMap:
    """Return the map on a new mesh with its pins held; if that folds, pins are released and moved again.

    Raises:
        Stuck: the map folds, or its pins are no longer met.
    """
    if not (isinstance(state, DiscreteMap) and state.bound and state.inside.z.size):
        return refine(level, state, sizes)
    fine = interpolate_on(level, state, sizes)
    released = replace(state, bound=False)

    def relaxed() -> DiscreteMap:
        return refine(level, released.forward(1.0, RELAXING_STEPS, MOVING_DECREASE, corners=True), sizes)

    def moved_again() -> DiscreteMap:
        new = first_success(lambda: replace(fine, bound=False).unfold_locally(), relaxed)
        new = satisfy_constraints(replace(new, inside=new.inside.with_pins_of(released.inside)))
        if new.miss > 0:
            raise Stuck("the constraints are not met on the new mesh")
        return new

    return first_success(lambda: unfold_pinned(fine), moved_again)


def unfold_pinned(fine: DiscreteMap) -> DiscreteMap:
    """Return the map unfolded with its constraints held.

    Raises:
        Stuck: that would take long, or fails.
    """
    if folds(fine.faces, fine.u) > FEW_FOLDS:
        raise Stuck("too many folds next to the constraints")
    return fine.unfold_locally(steps=HELD_STEPS)


def again(level: Level, state: DiscreteMap) -> DiscreteMap:
    """Return the map with pins met that were not reached on coarser meshes.

    It is unchanged if they are not met on this mesh either.
    """
    if level.problem.strokes:
        return state
    free = replace(state.with_goals(level.problem.pins[:, 1].copy()), bound=False)
    new = satisfy_constraints(free)
    new = new if new.miss == 0 else lead_one_by_one(level, free)
    return new if new.miss == 0 else state


def coarse(level: Level, matches: list[Match], journal: SolveLog) -> DiscreteMap:
    """Return the best map of all starts on coarse meshes, with pins met or as close as they came.

    Raises:
        Stuck: every start folds.
    """
    matches = matches + pin_aligned_matches(level, level.problem.all_pins)
    states, free = screen(level, matches)
    if not states:
        raise Stuck("no starting map")
    exact = without_duplicates([state for state in states if state.miss == 0])
    if exact:
        best = min((settle_pinned(level, s) for s in exact), key=lambda s: s.value)
    elif level.problem.strokes:
        best = settle_pinned(level, replace(states[0], bound=False))
    else:
        best = settle_pinned(level, states[0].hold_in_place())
    earlier = [note for note in journal.notes if note != STRETCHED]  # an abandoned attempt may have noted it
    journal.notes = [*earlier, STRETCHED] if best.value > STRONG * free else earlier
    journal.energies.append(best.value)
    return best
