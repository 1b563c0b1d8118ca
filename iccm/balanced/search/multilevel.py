"""The stages of a solve, from two outlines in unit coordinates to a map on the final mesh."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...curve import Curve
from ...drawings.cost import LOST_POINT_ENERGY
from ...maps.triangulated.map import TriangulatedMap
from ...plane import rotation
from ..constraints.soft import MOST_LIMIT_RATIO
from ..constraints.validate import with_points
from ..errors import NoMapError, OutOfTime, Stuck, check_time, first_success, successes
from ..holes.outlines import manageable_holes
from ..model.boundary_pairs import Match
from ..model.discrete_map import DiscreteMap
from ..model.mesh_map import MeshMap
from ..model.metric import PLANES
from ..model.outline import manageable
from ..model.solution import SolveLog
from . import initial_matches, pin_continuation, warm_start
from .candidates import HOPELESS, best_of, screen
from .final_mesh import (
    FINE_EXACTNESS,
    FINEST_FOLDS,
    STEEPEST_FINE,
    final_level,
    final_size,
    fine_map,
    finish,
    has_fine_mesh,
    meet_bounds,
    on_final_mesh,
    with_present_springs,
)
from .hole_partners import Partners
from .levels import Level, initial_maps
from .partial import bay_choices, with_bays, with_bays_like
from .rounding import restore_outline, rounded
from .similarity import similar_with_holes, similarity
from .symmetry import Half, half_of, mirror
from .unit_problem import SolvedProblem, UnitProblem

COARSE_MESH_SIZE, FINE_MESH_SIZE, FINER_MESH_SIZE = 0.1, 0.05, 0.04
"""Mesh sizes h for domains of area one; 0.08 and 0.03 resulted in maps within 1 % of those with 0.1 and 0.04.
FINE_MESH_SIZE suffices for simple shapes; holes, pins, and a surface's metric, which is averaged over
triangles, need FINER_MESH_SIZE.
"""
COARSE_SIZE_BY_LENGTH = 0.55
"""Coarse h of shapes with protrusions times the length of the outline, for area one; h is at least 0.6
COARSE_MESH_SIZE.
"""
SMALLER = (1.0, 0.5)  # factors of the mesh sizes; smaller sizes are tried if larger ones fail
COARSE_EXACTNESS = (5e-4, 6e-3)  # fineness of the outlines and of the corners, relative to the diagonal
STEEPEST = 8.0  # largest slope of a match that a coarse mesh follows, relative to the mean
SYMMETRIC_ENOUGH = 0.1  # relative to the tolerance: asymmetry that may be ignored
SYMMETRY_WORTH = 1.15
"""Cost relative to the best map, up to which a symmetric map is preferred: people see at once that one leans, but not
that a tenth of the distortion is saved."""
USELESS_ENERGY = HOPELESS * LOST_POINT_ENERGY
"""Energy from which a coarse map with pins is useless: on average, lengths change 50 times as much in one
direction as in the other.
"""
SLIDING_BALANCE = 2.0
"""Balance up to which outlines slide in a sequence. With larger weights of areas, their steps end before they have
converged: with 4, the energy of a map onto a moved outline was 1000 times that of a map from scratch.
"""
NO_MAP = "no map without folds was found: the shapes are too thin or too intricate for the mesh sizes tried"
SIMILAR = "The shapes are similar: the map is the similarity."
ASKEW = (
    "The shapes are symmetric, the map is not: no symmetric one without folds costs as little energy. A pin from one "
    "axis to the other, inside the shapes, may lead to a symmetric one."
)


def constrained_map(
    given: UnitProblem,
    journal: SolveLog,
    start: MeshMap | None = None,
    *,
    remesh: bool = False,
    outlines_moved: bool = False,
) -> tuple[MeshMap, bool]:
    """Return the map in unit coordinates that meets pins and strokes, and whether it does.

    Args:
        given: the problem with its outlines as they are.
        journal: collects energies and notes.
        start: an earlier map to start from.
        remesh: whether to solve on a new mesh in any case.
        outlines_moved: whether the start was carried from other outlines.

    Raises:
        NoMapError: none without folds was found.
    """
    points = np.concatenate([given.pins, given.outline_pins]).T
    exact_outlines = [
        [outer.z, *(hole.z for hole in inner), side]
        for outer, inner, side in zip((given.source, given.target), given.holes.sides, points)
    ]
    if start is None and not given.options.has_bounds:
        source, target = (
            with_points(curve, side)
            for curve, side in zip((given.source, given.target), given.outline_pins.T)
        )
        given = rounded(given._replace(source=source, target=target))
    problem = simplified(given, None if remesh else start)
    # With other sizes, material has to move past corners.
    slides = remesh and given.metrics[0] is not None
    slides = slides or (outlines_moved and given.energy.balance <= SLIDING_BALANCE)
    # The target's holes are filled, in the inverse problem.
    if start is not None and len(problem.holes.source) < len(problem.holes.target):
        inverse_map, constraints_met = solve_from(problem.inverse(), start.inverse(), journal, slides=slides)
        # Else solve from scratch: the triangles that fill holes are not in the earlier map, and may be in the
        # way.
        if constraints_met:
            return inverse_map.inverse(), constraints_met
    elif start is not None:
        return solve_from(problem, start, journal, slides=slides)
    best = coarse_to_fine(problem, journal)
    for filled in bay_choices(problem):
        log = SolveLog()
        try:
            covering = coarse_to_fine(filled, log)
        except NoMapError:
            continue
        if covering.meets_constraints and covering.cost < best.cost:
            best = covering
            journal.add(log)
    return restore_outline(whole_map(*best, journal), *exact_outlines), best.meets_constraints


def simplified(given: UnitProblem, start: MeshMap | None = None) -> UnitProblem:
    """Return the problem with its outlines simplified to the tolerance, with vertices at the pins on them.

    The outlines are those of the earlier map `start` if it follows the given ones.
    """
    source, target, sides, tolerance = given.source, given.target, given.holes.sides, given.options.tolerance
    if start is not None:
        followed = warm_start.outlines_followed(start, given)
        if followed is not None:
            (source, target, sides), tolerance = followed, 0.0
    source, target = (
        manageable(with_points(curve, points), tolerance, anchors)
        for curve, points, anchors in zip((source, target), given.outline_pins.T, given.anchors)
    )
    rims, goals = (
        tuple(manageable_holes(outline, inner, tolerance)) for outline, inner in zip((source, target), sides)
    )
    holes = given.holes._replace(source=rims, target=goals)
    return given._replace(source=source, target=target, holes=holes)


def solve_from(
    problem: UnitProblem, start: MeshMap, journal: SolveLog, *, slides: bool = False
) -> tuple[DiscreteMap, bool]:
    """Return the map that starts from an earlier one, and whether it meets all constraints.

    If the outlines slide, their correspondence is optimized again. Where outlines have moved, each map of a sequence
    would otherwise keep the one that was carried to its outlines, and their shear would add up: a flag that waves would
    only be sheared, and its lettering would not rotate with the cloth.

    Raises:
        NoMapError: the earlier map cannot be transferred to these outlines without folds.
    """

    def slid() -> DiscreteMap:
        state = warm_start.slide_anew(final_level(problem, smooth=True), start)
        return meet_bounds(state, problem.options, journal)

    def kept() -> DiscreteMap:
        return _with_kept_outlines(problem, start, journal)

    state = first_success(slid, kept) if slides else kept()
    return state, SolvedProblem(problem, state).meets_constraints


def _with_kept_outlines(problem: UnitProblem, start: MeshMap, journal: SolveLog) -> DiscreteMap:
    """Return the map that starts from an earlier one and from its correspondence of the outlines.

    Raises:
        NoMapError: the earlier map cannot be transferred to these outlines without folds.
    """
    level, options = final_level(problem), problem.options
    if options.keep_start and not options.has_bounds:
        # however coarse: where maps fold on finer meshes, it is the result of a solve
        kept = warm_start.met_on_its_mesh(level, start, coarse=True)
        if kept is not None and _meets_soft_pins(kept):
            journal.energies.append(problem.energy.between(kept.z, kept.u, kept.material, kept.metrics))
            return kept
    same_mesh_map = warm_start.met_on_its_mesh(level, start)
    # with other sizes, or pins that may have moved, the map has to change
    at_rest = same_mesh_map is not None and problem.metrics == PLANES and problem.energy.pins is None
    decrease = warm_start.AT_REST_DECREASE if at_rest else None
    try:
        state = same_mesh_map or warm_start.continue_from(level, start)
    except Stuck:
        raise NoMapError("start: cannot be continued without folds; leave it out") from None
    springs = None if state.energy.pins is None else state.energy.pins.springs
    if same_mesh_map is not None:
        state, _ = with_present_springs(state)
    return meet_bounds(state, options, journal, decrease, springs=springs)


def _meets_soft_pins(state: DiscreteMap) -> bool:
    """Return whether all soft pins are as close to their places as they must be in the smooth map of the result."""
    pins = state.energy.pins
    if pins is None:
        return True
    w, image = (state.u, state.z) if pins.inverted else (state.z, state.u)
    map = TriangulatedMap(w, image, state.material, (np.arange(state.z.size)[state.outer],))
    return bool((np.abs(map(pins.source) - pins.target) <= MOST_LIMIT_RATIO * pins.limits).all())


def free_map(given: UnitProblem, journal: SolveLog, begun: SolvedProblem | None = None) -> MeshMap:
    """Return the map in unit coordinates of a problem without exact pins and strokes.

    Args:
        given: the problem with its outlines as they are.
        journal: collects energies and notes.
        begun: a coarse map of this problem or of its inverse, with concavities filled if the map is to have them, which
            is refined; None to search for one, with concavities filled if the option `fit` asks for that and it costs
            less.

    Raises:
        NoMapError: none without folds was found.
    """
    problem = simplified(given)
    match = find_similarity(given, problem)
    if match is not None:
        journal.notes.append(SIMILAR)
        return similarity_map(problem, match)
    exact_outlines = [
        [curve.z for curve in (outer, *inner)]
        for outer, inner in zip((given.source, given.target), given.holes.sides)
    ]
    if not given.options.has_bounds:  # restored outlines might exceed bounds again
        given = rounded(given)
    problem = simplified(given)
    begun = begun or cheapest_filled(problem)
    uneven = given.options.rotation != 0 or problem.holed or problem.metrics != PLANES
    uneven = uneven or not problem.energy.is_mirror_symmetric
    halves = (None, None) if uneven else (half_of(given.source), half_of(given.target))
    if halves[0] and halves[1]:
        state = solve_symmetric(problem, (halves[0], halves[1]), journal, begun)
    else:
        state = whole_map(*coarse_to_fine(problem, journal, begun=begun), journal)
    return restore_outline(state, *exact_outlines)


def cheapest_filled(problem: UnitProblem) -> SolvedProblem | None:
    """Return the cheapest coarse map of the problem as it is, and with concavities filled as the option `fit` asks.

    None if the fit fills none, or no such map is found.
    """
    filled = bay_choices(problem)
    candidates = [directions(problem)[0], *filled] if filled else []

    def solved(used: UnitProblem) -> SolvedProblem:
        return SolvedProblem(used, best_of_starts(used, coarse_size(used), SolveLog()))

    found = successes(partial(solved, used) for used in candidates)
    return min(found, key=lambda candidate: candidate.cost, default=None)


def whole_map(used: UnitProblem, state: MeshMap, journal: SolveLog) -> MeshMap:
    """Return the map on the final mesh, from the result of `coarse_to_fine`, in the direction of the given problem."""
    state = finish(used, state, journal)
    return state.inverse() if used.inverted else state


def solve_symmetric(
    problem: UnitProblem,
    halves: tuple[Half, Half],
    journal: SolveLog,
    begun: SolvedProblem | None = None,
) -> MeshMap:
    """Return the map of two symmetric shapes; it is symmetric if that costs little, or if concavities are filled.

    See `free_map` for `begun`.

    Raises:
        NoMapError: none without folds was found.
    """
    free = None
    half_log, free_log = SolveLog(), SolveLog()
    right = half_problem(problem, halves)
    if begun is not None:
        right = with_bays_like(right, begun.problem) or right
    half = next(successes([partial(coarse_to_fine, right, half_log, share=0.5)]), None)
    most = np.inf if half is None else half.cost / SYMMETRY_WORTH
    # No map has an energy below 1. A map without a fine mesh is not better than a map of halves with one.
    has_no_mesh = not any(has_fine_mesh(used, fine_size(used)) for used in directions(problem))
    only_half = half is not None and (has_no_mesh or bool(half.problem.bays))
    if most > 1 and not only_half:
        try:
            free = coarse_to_fine(problem, free_log, begun=begun)
        except (NoMapError, OutOfTime):
            if half is None:
                raise

    def symmetric() -> MeshMap:
        assert half is not None
        map = mirrored_half_map(problem, halves, *half, half_log, unfinished=has_no_mesh)
        journal.add(half_log)
        return map

    def askew() -> MeshMap:
        journal.add(free_log)
        whole = free or coarse_to_fine(problem, journal, begun=begun)
        journal.notes.append(ASKEW)
        return whole_map(*whole, journal)

    is_symmetric = half is not None and (free is None or free.cost >= most)
    return first_success(symmetric, askew) if is_symmetric else askew()


class Attempt(NamedTuple):
    """One way to solve a problem.

    Attributes:
        problem: the problem or its inverse.
        coarse_size: edge length of the coarse mesh.
        fine_size: that of the fine mesh; None to stay on the coarse one.
        exactness: fineness of the coarse mesh's outlines and of their corners, relative to the diagonal.
        begun: the coarse map to refine; None to search for one.
    """

    problem: UnitProblem
    coarse_size: float
    fine_size: float | None
    exactness: tuple[float, float] = COARSE_EXACTNESS
    begun: DiscreteMap | None = None

    @property
    def has_mesh(self) -> bool:
        """Whether the fine mesh, if it has one, can be built."""
        return self.begun is not None or self.fine_size is None or has_fine_mesh(self.problem, self.fine_size)

    def coarse(self, journal: SolveLog) -> DiscreteMap:
        """Return the coarse map.

        Raises:
            Stuck: every start folds.
        """
        if self.begun is None:
            return best_of_starts(self.problem, self.coarse_size, journal, self.exactness)
        journal.energies.append(self.begun.value)
        return self.begun


def rounds_of_attempts(
    problem: UnitProblem, share: float, begun: SolvedProblem | None, *, patient: bool
) -> list[list[Attempt]]:
    """Return the attempts at a problem in the order in which they are made, each for the problem and its inverse.

    0. From the coarse map that there is, if there is one.
    1. With triangles of the usual size.
    2. With smaller triangles, for outlines that are too thin for the usual ones.
    3. On a coarse mesh with all corners, for maps that cannot be transferred to a finer one (spirals to stars).

    Args:
        problem: the problem.
        share: share of the given domain that the problem is: one half, or all.
        begun: the problem or its inverse with a coarse map; None if there is none.
        patient: whether to search with other sizes if the first do not succeed.
    """
    unit = 1 / np.sqrt(share)
    rounds = [
        [
            Attempt(used, coarse_size(used) * smaller * unit, fine_size(used) * smaller * unit)
            for used in directions(problem)
        ]
        for smaller in SMALLER
    ]
    rounds.append(
        [Attempt(used, coarse_size(used) * unit, None, FINE_EXACTNESS) for used in directions(problem)]
    )
    if begun is not None:
        used, state = begun
        rounds.insert(0, [Attempt(used, coarse_size(used), fine_size(used), begun=state)])
    return rounds if patient else rounds[: 1 + (begun is not None)]


def coarse_to_fine(
    problem: UnitProblem,
    journal: SolveLog,
    share: float = 1.0,
    *,
    patient: bool = True,
    begun: SolvedProblem | None = None,
) -> SolvedProblem:
    """Solve a problem or its inverse up to the fine mesh, and return which of both with the map.

    The first attempt that meets all constraints is the result. If none does, the first map is returned that misses
    some. Maps that pins stretch too much stay on the mesh that they have: smaller triangles would take long, and mostly
    fail, too.

    Args:
        problem: the problem.
        journal: collects energies and notes.
        share: see `rounds_of_attempts`.
        patient: see `rounds_of_attempts`.
        begun: see `rounds_of_attempts`.

    Raises:
        NoMapError: none without folds was found.
        OutOfTime: the time was over before one was found.
    """
    closest: SolvedProblem | None = None
    for attempts in rounds_of_attempts(problem, share, begun, patient=patient):
        unrefined: list[SolvedProblem] = []
        for attempt in attempts:
            if closest is None and attempt.begun is None:
                check_time()
            if not attempt.has_mesh:
                continue
            try:
                if attempt.fine_size is None:
                    return closest or SolvedProblem(attempt.problem, attempt.coarse(journal))
                solved = SolvedProblem(attempt.problem, attempt.coarse(journal))
                unrefined.append(solved)
                if closest is not None and not solved.meets_constraints:
                    continue
                refined = SolvedProblem(attempt.problem, fine_map(*solved, attempt.fine_size, journal))
            except OutOfTime:
                if closest or unrefined:
                    return closest or unrefined[-1]
                continue  # to the check of the time
            except Stuck:
                continue
            if refined.meets_constraints:
                return refined
            closest = closest or refined
        too_stretched = problem.constrained and all(
            solved.state.value > USELESS_ENERGY for solved in unrefined
        )
        if unrefined and too_stretched and closest is None:
            return min(unrefined, key=lambda solved: (not solved.meets_constraints, solved.cost))
    if closest is None:
        raise NoMapError(NO_MAP)
    return closest


def coarse_size(problem: UnitProblem) -> float:
    """Return the coarse mesh size, which is smaller if an outline is long relative to its area."""
    length = max(problem.source.length, problem.target.length)
    return COARSE_MESH_SIZE * float(np.clip(COARSE_SIZE_BY_LENGTH / (COARSE_MESH_SIZE * length), 0.6, 1.0))


def fine_size(problem: UnitProblem) -> float:
    """Return the fine mesh size."""
    plain = problem.metrics == PLANES and not (problem.holed or problem.constrained)
    return FINE_MESH_SIZE if plain else FINER_MESH_SIZE


def directions(problem: UnitProblem) -> tuple[UnitProblem, ...]:
    """Return the problem and its inverse in the order in which they are tried, or only one of them if holes are filled.

    Without constraints and holes, the one with the longer outline is meshed first: triangles that fit its
    protrusions can be spread over a block, but those of a block hardly fit into protrusions (8 % less energy on
    20 hard pairs).
    """
    if problem.bays:
        return (problem,)
    inverse = problem.inverse()
    surplus = len(problem.holes.source) - len(problem.holes.target)
    if surplus:
        return (problem if surplus > 0 else inverse,)
    longer = problem.target.length > problem.source.length and not (problem.constrained or problem.holed)
    return (inverse, problem) if longer else (problem, inverse)


def half_problem(problem: UnitProblem, halves: tuple[Half, Half]) -> UnitProblem:
    """Return the problem of the right halves, of area one, with the ends of their axes pinned."""
    curves = [Curve(half.curve.z / np.sqrt(half.curve.area)) for half in halves]
    anchors = [(complex(c.z[0]), complex(c.z[half.top])) for c, half in zip(curves, halves)]
    simple, goal = (manageable(c, problem.options.tolerance, a) for c, a in zip(curves, anchors))
    ends, energy = (anchors[0], anchors[1]), problem.energy.without_rotation().of_part(0.5)
    return UnitProblem(simple, goal, energy, problem.options, ends, halved=True, triangles=problem.triangles)


def mirrored_half_map(
    problem: UnitProblem,
    halves: tuple[Half, Half],
    used: UnitProblem,
    half: DiscreteMap,
    journal: SolveLog,
    *,
    unfinished: bool = False,
) -> MeshMap:
    """Return the map of the right halves, mirrored.

    It is transferred to the given outlines if these are not quite symmetric.

    Raises:
        Stuck: it folds on the final mesh, unless `unfinished`, in which case it is returned on the mesh before.
    """
    exact = max(side.asymmetry for side in halves) < SYMMETRIC_ENOUGH * problem.options.tolerance
    if exact:
        try:
            half = on_final_mesh(used, half, journal, share=0.5)
        except OutOfTime:
            pass
        except Stuck:
            if not unfinished:
                raise
            journal.notes.append(FINEST_FOLDS)
    outline = 1 + int(np.searchsorted(half.pairs.s, half.matched.axis - 1e-9))
    sketch = mirror(half, outline)
    source_half, target_half = halves[::-1] if used.inverted else halves
    sketch = replace(
        sketch,
        z=sketch.z * np.sqrt(source_half.curve.area) + source_half.axis,
        u=sketch.u * np.sqrt(target_half.curve.area) + target_half.axis,
    )
    if used.bays and not exact:
        return whole_map(with_bays(problem.inverse() if used.inverted else problem), sketch, journal)
    sketch = sketch.inverse() if used.inverted else sketch
    return sketch if exact else finish(problem, sketch, journal)


def best_of_starts(
    problem: UnitProblem,
    size: float,
    journal: SolveLog,
    exactness: tuple[float, float] = COARSE_EXACTNESS,
    *,
    most: float = np.inf,
) -> DiscreteMap:
    """Return the best map of all starts on coarse meshes.

    Args:
        problem: the problem.
        size: edge length of the mesh.
        journal: collects energies and notes.
        exactness: fineness of the outlines and of the corners, relative to the diagonal.
        most: give up if the energy of all maps is above this after a few steps.

    Raises:
        Stuck: every start folds.
        NoMapError: all energies are above `most`.
    """
    check_time()
    level = Level.of(problem, size, *exactness, STEEPEST)
    matches = correspondences(level)
    if problem.energy.pins is not None and not problem.constrained:
        matches = matches + pin_continuation.pin_aligned_matches(level, problem.energy.pins.pairs)
    if problem.constrained:
        return pin_continuation.coarse(level, matches, journal)
    states = screen(initial_maps(level, matches), problem.options.effort)
    if states and states[0].value > most:
        raise NoMapError("all maps found are stretched too much")
    best = best_of(level, states)
    journal.energies.append(best.value)
    return best


def correspondences(level: Level) -> list[Match]:
    """Return the correspondences of the outlines to start from."""
    problem = level.problem
    curves = level.source.curve, level.target.curve
    free = problem.energy.upright == 0 and level.anchors is None
    turns = initial_matches.ANY_TURN if free else initial_matches.TURNS
    matches = initial_matches.candidates(*curves, turns, problem.options.effort)
    if problem.holed:
        return with_partners(level, matches)
    if problem.halved:  # arclength cannot be shifted, since the ends are pinned
        return matches[: 1 - problem.options.effort * initial_matches.ARCLENGTH_SHIFTS]
    if problem.energy.upright > 0 and not problem.constrained:
        return initial_matches.without_upside_down(matches, *curves) or matches
    return matches


def with_partners(level: Level, matches: list[Match]) -> list[Match]:
    """Return the matches with matches of holes."""
    partners = Partners(*level.domains, level.problem.holes.partners, level.prescribed_match)
    return [partners.of(match) for match in matches]


def find_similarity(given: UnitProblem, problem: UnitProblem) -> Match | None:
    """Return the correspondence of similar domains, whose similarity has the least energy; None if there is none.

    Args:
        given: the problem with its outlines as they are.
        problem: the same with simplified outlines.
    """
    metric, energy = problem.metrics[0], problem.energy
    if (metric and not metric.keeps_sizes) or energy.pins or energy.terms:
        return None  # other maps may have less energy
    match = similarity(given.source, given.target, rotates=problem.options.rotation is None)
    return None if match is None else similar_with_holes(problem, match)


def similarity_map(problem: UnitProblem, match: Match) -> MeshMap:
    """Return the similarity as a map on the final mesh."""
    state = Level.of(problem, final_size(problem), 0.0, 0.0, STEEPEST_FINE).mapped(match)
    turn = rotation(state.z[: state.border], state.u[: state.border])
    loops = state.loops
    return MeshMap.plain(state.z, state.z * turn, state.faces, state.border, loops=loops)
