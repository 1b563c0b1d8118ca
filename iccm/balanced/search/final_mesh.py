"""Transfer a map to the fine mesh and to the final one, and lower its worst stretch there."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ... import progress
from ...arrays import Complex, Index, Real
from ...options import Options
from ..errors import OutOfTime, Stuck, check_time, first_success, successes
from ..model import mesh_sizes
from ..model.discrete_map import EASED, EASING_STEPS, DiscreteMap
from ..model.energy import Energy
from ..model.measures import least_dilatations, stretches
from ..model.mesh_map import MeshMap
from ..model.metric import PLANES, Metrics
from ..model.outline_split import split_at_vertices
from ..model.retriangulation import flip_edges
from ..model.solution import SolveLog
from . import pin_continuation
from .levels import FINE_BACKWARD, FINE_POWER, FINE_ROUNDS, Level
from .unit_problem import SolvedProblem, UnitProblem

# With 1e-3, protrusions fold on the final mesh; with 3e-4, maps are not better.
FINE_EXACTNESS = (2e-4, 6e-4)
STEEPEST_FINE = 20.0  # largest slope of a match that a mesh follows, relative to the mean
TRIANGLES_PER_AREA = 4.6  # number of triangles times h², measured, including outline and grading
FINEST_FOLDS = (
    "The map folds on the finest mesh, so the result uses the next coarser one and follows "
    "the outlines less closely."
)
LAST_ROUNDS = 4  # rounds of steps; later ones are needed if a squeezed triangle widens slowly
UNSETTLED = (
    "The map had not converged on its last mesh: a longer search could stretch the picture less (effort)."
)
BOUND_ROUNDS = 40  # rounds of raising the weights of triangles that exceed bounds
BOUND_AIM = 0.99  # relative to a bound: the value aimed at, since bounds are approached from above
KNOTTED_ENERGY_RATIO = (
    1.1  # times the energy on the mesh before; a finer mesh with all corners changes it by a few per cent
)
# Newton steps on the final mesh, and the relative decrease that ends them.
LAST_STEPS, LAST_DECREASE = 50, 2e-4
LAST_DECREASE_WITH_PINS = 1e-5
"""The same with soft pins, whose springs are weak; maps on different meshes then agree better."""

STIFFENINGS, MOST_STIFFENED = 8, 10.0
"""Rounds of stiffening the springs of pins beyond their limits, and the largest factor of a round."""
BLOCKED_MISS, BLOCKED_ENERGY = 0.95, 2.0
"""Relative to the distance before a round of stiffening, and to the energy before all rounds. A pin that stays
farther away while the energy is larger is blocked by the outline or by other pins, and stiffer springs would
not bring it closer.
"""
AIMED_LIMITS = 0.95
"""Distance aimed at for soft pins beyond their limit, relative to the limit, so that the rounds end."""
NARROW_AIM, NARROW_TOLERANCE, NARROW_ROUNDS = 0.99, 0.01, 4
"""The same for maps that continue from another one, how far from it such pins may end, and the rounds that bring them
there. The map that follows a drag aims at the same distance, so that it is hardly changed by the last rounds.
"""
STIFFEST, SPRING_BISECTIONS = 1e6, 10
"""Largest factor by which the springs of a saved map may be stiffer, and halvings of its logarithm to find it to 1.4 %.
"""
MOST_PRESENT_LIMITS = 1.1
"""Distance of a pin from its place, relative to its limit, beyond which it is not held there by a stiffer spring."""
SPRING_POWER, MOST_SPRING_POWER = 2.0, 8.0
"""How the stiffness of a spring depends on the distance aimed at, as the power of the ratio of distances: before it is
measured, and the largest power assumed.
"""


def has_fine_mesh(problem: UnitProblem, size: float) -> bool:
    """Return whether `fine_map` can build a mesh of this size; the map itself is not needed."""
    return not Level.of(problem, size, *FINE_EXACTNESS, STEEPEST_FINE).is_too_long


def fine_map(problem: UnitProblem, state: DiscreteMap, size: float, journal: SolveLog) -> DiscreteMap:
    """Return the map on a finer mesh, with lower worst stretch."""
    progress.tell("fine map")
    check_time()
    level = Level.of(problem, size, *FINE_EXACTNESS, STEEPEST_FINE)
    state = on_finer(level, state)
    if problem.constrained and not SolvedProblem(problem, state).meets_constraints:
        state = pin_continuation.again(level, state)
    state = state.alternate(FINE_POWER, FINE_ROUNDS, FINE_BACKWARD)
    journal.energies.append(state.value)
    return state


def on_finer(level: Level, state: MeshMap) -> DiscreteMap:
    """Return the map on the mesh of a finer level, with smaller triangles where it magnifies."""
    sizes = mesh_sizes.graded(state.z, state.u, state.faces, 0.5 * level.size**2)
    return pin_continuation.refine_pinned(level, state, sizes).relax()


def finish(problem: UnitProblem, state: MeshMap, journal: SolveLog, share: float = 1.0) -> MeshMap:
    """Return the map on the final mesh; unchanged if it folds there."""
    try:
        return on_final_mesh(problem, state, journal, share)
    except Stuck as error:
        if not isinstance(error, OutOfTime):
            journal.notes.append(FINEST_FOLDS)
        return state


def on_final_mesh(problem: UnitProblem, state: MeshMap, journal: SolveLog, share: float = 1.0) -> DiscreteMap:
    """Return the map on the final mesh, whose boundary has every vertex of both outlines.

    These vertices are inserted after the map has converged. If that folds, or raises the energy too much, the
    map is solved again with these vertices in the mesh from the beginning.

    Raises:
        Stuck: it folds either way.
    """
    progress.tell("last map")

    def energy(map: MeshMap) -> float:
        return problem.energy.between(map.z, map.u, map.material, map.metrics)

    def solved(smooth: bool) -> tuple[DiscreteMap, DiscreteMap]:
        last = on_finer(final_level(problem, share, smooth=smooth), state)
        last = descend(last, FINE_POWER, journal)
        return eased(split_at_vertices(last) if smooth else last), last

    candidates = []
    for candidate in successes(partial(solved, smooth) for smooth in (True, False)):
        candidates.append(candidate)
        if energy(candidate[0]) <= KNOTTED_ENERGY_RATIO * energy(state):
            break
    if not candidates:
        raise Stuck("the last mesh folds")
    best, sliding = min(candidates, key=lambda pair: energy(pair[0]))
    followed = follow_pins(sliding, lambda state: descend(state, FINE_POWER, journal))
    if followed is not sliding:
        best, sliding = eased(split_at_vertices(followed)), followed
    if not problem.options.has_bounds:
        return best

    def bounded_before_split() -> DiscreteMap:  # with all vertices in the mesh, the outlines hardly slide
        return flip_edges(split_at_vertices(meet_bounds(sliding, problem.options, journal)), FINE_POWER)

    return meet_bounds(first_success(bounded_before_split, lambda: best), problem.options, journal)


def eased(state: DiscreteMap) -> DiscreteMap:
    """Return the map after a few steps, with its triangulation adapted to it.

    Triangles change especially at new vertices on its outlines.
    """
    # Steps use the metric at the vertices' present positions, so the outline is kept there.
    if state.metrics != PLANES:
        return state.move_inside(FINE_POWER, EASING_STEPS, EASED)
    state = flip_edges(state, FINE_POWER).forward(FINE_POWER, EASING_STEPS, EASED, corners=True)
    return flip_edges(state, FINE_POWER).backward(FINE_POWER, EASING_STEPS, EASED)


def final_size(problem: UnitProblem, share: float = 1.0) -> float:
    """Return the edge length of the final mesh of a problem that is this share of the given one, for area one."""
    return float(np.sqrt(TRIANGLES_PER_AREA / (problem.triangles * share)))


def final_level(problem: UnitProblem, share: float = 1.0, *, smooth: bool = False) -> Level:
    """Return the level of the final mesh, with all vertices of the outlines; see `Level.of` for `smooth`."""
    return Level.of(
        problem, final_size(problem, share), 0.0, FINE_EXACTNESS[1] * smooth, STEEPEST_FINE, smooth=smooth
    )


def meet_bounds(
    state: DiscreteMap,
    options: Options,
    journal: SolveLog,
    decrease: float | None = None,
    *,
    springs: Real | None = None,
) -> DiscreteMap:
    """Return the converged map with lower worst stretch, and with the requested bounds met.

    See `descend` for `decrease`, and `follow_pins` for `springs`.
    """
    return meet_bounds_by(
        lambda state, q: descend(state, q, journal, decrease), state, options, springs=springs
    )


def meet_bounds_by(
    descent: Callable[[DiscreteMap, float], DiscreteMap],
    state: DiscreteMap,
    options: Options,
    scale: Callable[[DiscreteMap], float] = lambda state: 1.0,
    *,
    springs: Real | None = None,
) -> DiscreteMap:
    """Lower the worst stretch of a map, and meet the bounds on its distortion.

    Triangles that exceed a bound get larger weights, in proportion to the excess, until they meet it. The
    weights are multipliers, found as in Lawson's algorithm, and the map hardly changes elsewhere. Corners of
    the outlines at which the bound is impossible are left as they are. If the bounds cannot be met, the map
    with the least excess is returned.

    Args:
        descent: Newton's method for a power q.
        state: the map to start from.
        options: the bounds.
        scale: returns the scale of a map, relative to which lengths are measured.
        springs: see `follow_pins`.
    """
    state = follow_pins(descent(state, FINE_POWER), lambda state: descent(state, FINE_POWER), springs=springs)
    closest, nearest, weights = state, np.inf, np.ones(len(state.faces))
    bound = min(options.max_dilatation or np.inf, (options.max_stretch or np.inf) ** 2)
    for _ in progress.counted("last map, bounds", range(BOUND_ROUNDS if options.has_bounds else 0)):
        over, least = _excesses_and_least(state, options, scale(state))
        movable = np.where(least <= bound, over, 0)
        if movable.max() <= 1:
            return state
        if over.max() < nearest:
            closest, nearest = state, over.max()
        weights = np.maximum(1, weights * (movable / BOUND_AIM) ** FINE_POWER)
        state = replace(descent(replace(state, multipliers=weights), FINE_POWER), multipliers=None)
    return closest


def follow_pins(
    state: DiscreteMap,
    descent: Callable[[DiscreteMap], DiscreteMap],
    *,
    springs: Real | None = None,
) -> DiscreteMap:
    """Return the converged map with stiffer springs for soft pins that are beyond their limits.

    A spring pulled by a constant force is extended by the force over its stiffness. Since the force grows as
    the pin comes closer, stiffness is raised by the square of the ratio by which the distance is too large. The
    rounds end when the worst pin is blocked.

    Where a pin ends within its limit depends on the rounds before. With `springs`, pins end just within it, wherever
    the map began.

    Args:
        state: the map.
        descent: returns the converged map from another one.
        springs: (k,) stiffness that pins have before they miss their limits; None to leave pins that are within them.
    """
    previous_miss = np.inf
    begun = state.value
    for _ in range(STIFFENINGS):
        pins = state.energy.pins
        if pins is None or not pins.source.size:
            break
        missed = pins.misses(state.z, state.u, state.faces) / pins.limits
        blocked = missed.max() > BLOCKED_MISS * previous_miss and state.value > BLOCKED_ENERGY * begun
        if missed.max() <= 1:
            break
        if blocked:
            return state
        previous_miss = missed.max()
        stiffer = pins.stiffer(np.clip((missed / AIMED_LIMITS) ** 2, 1, MOST_STIFFENED))
        state = descent(state.with_energy(replace(state.energy, pins=stiffer)))
    else:
        return state
    return state if springs is None else _narrow(state, springs, descent)


def with_present_springs(state: DiscreteMap, known: Real | None = None) -> tuple[DiscreteMap, Real]:
    """Return a converged map with springs as stiff as they must have been for its soft pins to be where they are, and
    the factors (k,) by which these are stiffer.

    A map is saved without them. With others, it would move away from there, and not come back to quite the same place.
    The stiffness is found by bisection: one Newton step moves a pin outwards if its spring is softer, inwards if it is
    stiffer. No spring becomes softer. Those of pins well within their limits stay as they are, and so do those of pins
    far beyond, which were blocked, or have moved since.

    Args:
        state: the map, with springs as they are before any is made stiffer.
        known: (k,) factors above 1 where they are known; None if none is.
    """
    pins = state.energy.pins
    if pins is None:
        return state, np.empty(0)
    factors = np.ones(pins.springs.size) if known is None else known
    begun = pins.misses(state.z, state.u, state.faces)
    missed = begun / pins.limits
    stiffened = (missed > AIMED_LIMITS - NARROW_TOLERANCE) & (missed < MOST_PRESENT_LIMITS) & (factors == 1)
    low, high = np.zeros(begun.size), np.full(begun.size, np.log(STIFFEST))
    for _ in range(SPRING_BISECTIONS if stiffened.any() else 0):
        middle = np.where(stiffened, (low + high) / 2, 0.0)
        trial = state.with_energy(replace(state.energy, pins=pins.stiffer(factors * np.exp(middle))))
        step = trial.forward(FINE_POWER, 1, 0.0)
        is_softer = pins.misses(step.z, step.u, step.faces) > begun
        low, high = np.where(is_softer, middle, low), np.where(is_softer, high, middle)
    factors = np.where(stiffened, np.exp(low), factors)
    return state.with_energy(replace(state.energy, pins=pins.stiffer(factors))), factors


def _narrow(state: DiscreteMap, springs: Real, descent: Callable[[DiscreteMap], DiscreteMap]) -> DiscreteMap:
    """Return the map with pins of stiffened springs just within their limits, rather than anywhere within them.

    Args:
        state: the converged map.
        springs: (k,) the stiffness before any of them was made stiffer.
        descent: returns the converged map from another one.
    """
    powers, previous = np.full(springs.size, SPRING_POWER), None
    for _ in range(NARROW_ROUNDS):
        pins = state.energy.pins
        assert pins is not None
        missed = np.maximum(pins.misses(state.z, state.u, state.faces) / pins.limits, np.finfo(float).tiny)
        stiffness = pins.springs / springs
        away = np.where(stiffness > 1, np.abs(missed - NARROW_AIM), np.maximum(missed - NARROW_AIM, 0))
        if away.max(initial=0.0) <= NARROW_TOLERANCE:
            break
        if previous is not None:
            # the secant of both rounds, in logarithms
            change = np.log(stiffness / previous[0]), np.log(previous[1] / missed)
            has_secant = (np.abs(change[0]) > NARROW_TOLERANCE) & (change[0] * change[1] > 0)
            powers[has_secant] = np.clip(
                (change[0] / np.where(has_secant, change[1], 1))[has_secant], 1, MOST_SPRING_POWER
            )
        previous = stiffness, missed
        goal_stiffness = np.maximum(stiffness * (missed / NARROW_AIM) ** powers, 1)
        factors = np.clip(goal_stiffness / stiffness, 1 / MOST_STIFFENED, MOST_STIFFENED)
        state = descent(state.with_energy(replace(state.energy, pins=pins.stiffer(factors))))
    return state


def last_decrease(energy: Energy) -> float:
    """Return the relative decrease that ends Newton's method on the final mesh."""
    return LAST_DECREASE if energy.pins is None else LAST_DECREASE_WITH_PINS


def descend(state: DiscreteMap, q: float, journal: SolveLog, decrease: float | None = None) -> DiscreteMap:
    """Return the map on the final mesh after Newton steps; a note is added if they do not converge.

    Thin triangles at the outline prevent it from sliding past corners, so that steps alternate with steps on
    the inside, which widen them.

    Args:
        state: the map.
        q: power of the density.
        journal: collects energies and notes.
        decrease: relative decrease that ends the steps; that of `last_decrease` by default.
    """
    decrease = last_decrease(state.energy) if decrease is None else decrease
    previous = np.inf
    for _ in range(LAST_ROUNDS):
        state = state.forward(q, LAST_STEPS, decrease, corners=True)
        if previous - state.value < decrease * state.value:
            break
        previous = state.value
        state = state.move_inside(q, LAST_STEPS, decrease)
        if state.settled and previous - state.value < decrease * previous:
            break
    journal.energies.append(state.value)
    if not state.settled and UNSETTLED not in journal.notes:
        journal.notes.append(UNSETTLED)
    return state


def _excesses_and_least(state: DiscreteMap, options: Options, scale: float) -> tuple[Real, Real]:
    """Return (m,) `excesses`, 0 in virtual triangles, and the smallest dilatations that the outlines' angles permit."""
    over = excesses(state.z, state.u / scale, state.faces, options, state.metrics)
    if state.weights is not None:
        over[state.weights != 1] = 0
    if state.metrics != PLANES:
        return over, np.ones(over.size)
    return over, least_dilatations(state.z, state.u, state.faces, state.border)


def excesses(z: Complex, u: Complex, faces: Index, options: Options, metrics: Metrics = PLANES) -> Real:
    """Return (m,) ratios of dilatation and stretch to their bounds; the bounds are met where these are at most 1."""
    dilatation, stretch, _ = stretches(z, u, faces, metrics)
    bounds = (options.max_dilatation or np.inf, options.max_stretch or np.inf)
    return np.maximum(dilatation / bounds[0], stretch / bounds[1])
