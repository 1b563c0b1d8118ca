"""The stages of a solve, from two outlines in unit coordinates to a map on the last mesh."""

from collections.abc import Callable

import numpy as np

from .. import progress
from ..arrays import Complex, Index
from ..curve import Curve
from ..maps.distortion import Distortion
from . import starts
from .constraints import continuation, meeting
from .constraints.given import Pins, with_points
from .discrete import DiscreteMap
from .failure import NoMapError, Stuck
from .holes.circles import circle_starts
from .holes.discs import through_disc
from .holes.given import Holes
from .holes.outlines import manageable_holes
from .holes.partners import Partners
from .holes.rings import ring_matches
from .levels import Level, Sketch, UnitProblem, alternated, eased, refined, released, score, screened, started
from .meshing import sizing
from .meshing.mesh import Sizes
from .metric import PLANES, Metrics
from .minimise.measures import derivatives, stretches, within
from .outline import manageable
from .pairs import Match
from .similar import similar_with_holes, similarity
from .solution import Settings, SolveLog
from .symmetry import Half, half_of, mirrored

COARSE, FINE = 0.1, 0.04  # mesh sizes h, of domains of area one; .08 and .03 found maps within 1 % of these
LIMBS = 0.55
"""Over the outline's length, of area one: the coarse h of shapes with limbs, at least 0.6 of COARSE."""
SMALLER = (1.0, 0.5)  # factors of the mesh sizes, where larger ones fail
COARSE_EXACTNESS = (5e-4, 6e-3)  # fineness of the outlines and of the corners, of the diagonal
FINE_EXACTNESS = (2e-4, 6e-4)  # with 1e-3 limbs fold on the last mesh, with 3e-4 no map is better
STEEPEST, STEEPEST_FINE = 8.0, 20.0  # slope of a match, relative to the mean, that a mesh follows
TRIANGLES_PER_AREA = 4.6  # number of triangles times h²: measured, outline and grading included
POWERS = (3.0, 4.0, 6.0, 8.0, 12.0, 16.0)  # q: the first for all, the others while a bound is not met
# Where K on 95 % of the target is above SHEARED, θ up to 1 is lowered until it is not, unless less than EVEN of the
# target is within 2 x then, or its p95 stretch above STRETCHED: K is at most 5 on 76 % of 180 pairs (seeds 31 to 33).
# AIMED is where K is to go on the fine mesh, from which the last one differs by 2 %; below TOO_FAR it went too far, if
# less than AMPLE is within 2 x. From HOPELESS on none got there. K falls about as θ to the power STEEP.
SHEARED, AIMED, TOO_FAR, HOPELESS, STRETCHED = 4.9, 4.8, 4.5, 8.7, 5.0
EVEN, AMPLE = 0.8, 0.9
# Where K is small enough and sizes are even, the last mesh leans a LITTLE to angles; of 24 pairs one fell below 90 % of
# the area within 2 x by that, and two above a p95 stretch of 3.
LITTLE_FROM, LITTLE = 0.95, 0.75  # the share within 2 x from which it does, and the factor of θ
STEEP, LEAST_LEAN, LEANINGS = 0.4, 0.2, 3  # the share of θ that is left at least, and how many are tried
UPRIGHT = 3.0  # weight of the turn among starts: 82 % of 40 pairs turn by less than 20°, with 2 75 %, for 1 % of energy
STRAIGHTENINGS, STRAIGHT = 3, 0.5  # rounds, and degrees that may be left
ROUND = 0.95  # 4π · area / length², 1 for a disc and .91 for a hexagon
FINE_ROUNDS, FINE_BACKWARD = 8, 4  # rounds of steps on the map and its inverse; 2 or 3 do for most pairs
LAST_ROUNDS = 4  # of such steps; later ones where a squeezed triangle widens slowly
UNSETTLED = "The map had not settled on its last mesh: its stretch could be smaller."
LAST_STEPS, LAST_DECREASE = 50, 2e-3  # of Newton on the last mesh, and the relative decrease that ends them
SYMMETRIC_ENOUGH = 0.1  # of the tolerance: asymmetry that may be dropped


Meshed = DiscreteMap | Sketch


def constrained(
    source: Curve,
    target: Curve,
    holes: Holes,
    pins: Pins,
    settings: Settings,
    journal: SolveLog,
    start: Sketch | None = None,
) -> tuple[Meshed, bool]:
    """The map in unit coordinates that meets pins, and whether it does; gone on to from an earlier one if given.

    Raises:
        NoMapError: none without folds was found.
    """
    upright = 0.0 if settings.turn is None or pins.count > 1 or pins.strokes else UPRIGHT
    problem = with_constraints(source, target, holes, pins, settings, upright)
    if start is not None and len(problem.holes[0]) < len(problem.holes[1]):  # it is they that are filled
        back, met = further(problem.inverse(), inverted(start), settings, journal)
        if met:  # else from scratch: what fills the holes is not in the earlier map, and may be in the way
            return inverted(back), met
    elif start is not None:
        return further(problem, start, settings, journal)
    used, found = solved(problem, journal)
    state = finished(used, found, settings, journal)
    return (inverted(state) if used.inverted else state), meets(used, found)


def with_constraints(
    source: Curve, target: Curve, holes: Holes, pins: Pins, settings: Settings, upright: float
) -> UnitProblem:
    """The problem in unit coordinates, with vertices at the pins of its outlines."""
    anchors = tuple(tuple(side.tolist()) for side in pins.outer.T)
    curves = [with_points(c, side) for c, side in zip((source, target), pins.outer.T)]
    curves = [manageable(c, settings.tolerance, a) for c, a in zip(curves, anchors)]
    problem = UnitProblem(curves[0], curves[1], settings.theta, upright, (anchors[0], anchors[1]))
    return with_holes(problem._replace(pins=pins.inner, strokes=pins.strokes), holes, settings)


def further(
    problem: UnitProblem, start: Sketch, settings: Settings, journal: SolveLog
) -> tuple[DiscreteMap, bool]:
    """The map that goes on from an earlier one, and whether it meets all constraints.

    Raises:
        NoMapError: the earlier one cannot be carried to these outlines without folds.
    """
    level = last_level(problem, settings)
    try:
        state = continuation.continued(level, start, problem)
    except Stuck:
        raise NoMapError("start: cannot be gone on from without folds; do without it") from None
    theta = leaning(problem, state)
    return lowered(eased(state, problem.theta), theta, settings, journal), meets(problem, state)


def meets(problem: UnitProblem, state: DiscreteMap) -> bool:
    """Whether a map meets all constraints."""
    goals = state.inside.goals[state.inside.own < 0]
    return (state.bound or not state.inside.z.size) and bool(np.all(goals == problem.pins[:, 1]))


def mapped(
    source: Curve, target: Curve, holes: Holes, settings: Settings, journal: SolveLog
) -> tuple[Meshed, bool]:
    """The map in unit coordinates, and whether it is the mirror image of itself.

    Raises:
        NoMapError: none without folds was found.
    """
    upright = 0.0 if settings.turn is None else UPRIGHT
    simple, goal = (manageable(c, settings.tolerance) for c in (source, target))
    problem = with_holes(UnitProblem(simple, goal, settings.theta, upright), holes, settings)
    same = similarity(source, target, turns=settings.turn is None)
    same = same and similar_with_holes(problem, same)
    if same is not None:
        journal.notes.append("The shapes are similar: the map is the similarity.")
        return onto_itself(problem, same, settings), False
    upright_pair = settings.turn == 0 and not problem.holed
    halves = (half_of(source), half_of(target)) if upright_pair else (None, None)
    if halves[0] and halves[1]:
        try:
            return by_halves(problem, halves[0], halves[1], settings, journal)
        except (Stuck, NoMapError):
            journal.notes.append("The shapes are symmetric, but no symmetric map without folds was found.")
    return whole(problem, settings, journal), False


def whole(problem: UnitProblem, settings: Settings, journal: SolveLog) -> Meshed:
    """All stages."""
    used, fine_map = solved(problem, journal)
    state = finished(used, fine_map, settings, journal)
    return inverted(state) if used.inverted else state


def solved(problem: UnitProblem, journal: SolveLog, share: float = 1.0) -> tuple[UnitProblem, DiscreteMap]:
    """All stages but the last, of the problem or of its inverse; and which of the two, with the θ that was settled on.

    Maps that no finer mesh takes over (spirals onto stars) are left on a coarse one with all corners.

    Args:
        problem: `share` of what was given (a half, or all of it).
        journal: of what happens.
        share: see above.

    Raises:
        NoMapError: none without folds was found.
    """
    closest = None
    for smaller in SMALLER:
        for used in ways(problem):
            try:
                sizes = coarse_size(used) * smaller / np.sqrt(share), FINE * smaller / np.sqrt(share)
                state = coarse(used, sizes[0], journal)
                if not meets(used, state) and closest is not None:
                    continue
                found = used, fine(used, state, sizes[1], journal)
            except Stuck:
                continue
            if meets(*found):
                return leant(used, state, found[1], sizes, journal)
            closest = closest or found
    if closest is not None:
        return closest
    for used in ways(problem):
        try:
            return used, coarse(used, coarse_size(used) / np.sqrt(share), journal, FINE_EXACTNESS)
        except Stuck:
            continue
    raise NoMapError(
        "no map without folds was found: the shapes are too thin or too intricate for the mesh sizes tried"
    )


def coarse_size(problem: UnitProblem) -> float:
    """The coarse mesh size: smaller where an outline is long for its area."""
    length = max(problem.source.length, problem.target.length)
    return COARSE * float(np.clip(LIMBS / (COARSE * length), 0.6, 1.0))


def ways(problem: UnitProblem) -> tuple[UnitProblem, ...]:
    """The problem and its inverse in the order in which they are tried; one of them where it has more holes to fill.

    Without constraints and holes the one with the longer outline is meshed first: triangles that fit its limbs can be
    spread over a block, those of a block hardly fit into limbs (energy -8 % on 20 hard pairs).
    """
    inverse = problem.inverse()
    surplus = len(problem.holes[0]) - len(problem.holes[1])
    if surplus:
        return (problem if surplus > 0 else inverse,)
    longer = problem.target.length > problem.source.length and not (problem.constrained or problem.holed)
    return (inverse, problem) if longer else (problem, inverse)


def finished(
    problem: UnitProblem, state: Meshed, settings: Settings, journal: SolveLog, share: float = 1.0
) -> Meshed:
    """The map on the last mesh, or as it is where that folds."""
    try:
        return last(problem, state, settings, journal, share)
    except Stuck:
        journal.notes.append(
            "The finest mesh folds: the outlines are followed as closely as the one before allows."
        )
        return state


def inverted(state: Meshed) -> Sketch:
    """The inverse map."""
    loops, filled = (tuple(loop.inverse() for loop in each) for each in (state.loops, state.filled))
    given = state.u, state.z, state.faces, state.border, state.first_pin, state.lines
    return Sketch(*given, loops, filled, state.weights, state.metrics[::-1])


def by_halves(
    problem: UnitProblem, source: Half, target: Half, settings: Settings, journal: SolveLog
) -> tuple[Meshed, bool]:
    """The map of the right halves, mirrored; carried to the outlines given where those are not quite symmetric."""
    roots = np.sqrt([source.curve.area, target.curve.area])
    curves = [Curve(half.curve.z / root) for half, root in zip((source, target), roots)]
    anchors = [(complex(c.z[0]), complex(c.z[half.top])) for c, half in zip(curves, (source, target))]
    simple, goal = (manageable(c, settings.tolerance, a) for c, a in zip(curves, anchors))
    half_problem = UnitProblem(simple, goal, problem.theta, 0.0, (anchors[0], anchors[1]), halved=True)
    used, half = solved(half_problem, journal, share=0.5)
    exact = max(source.asymmetry, target.asymmetry) < SYMMETRIC_ENOUGH * settings.tolerance
    if exact:
        half = last(used, half, settings, journal, share=0.5)
    outline = 1 + int(np.searchsorted(half.pairs.s, half.axis - 1e-9))
    z, u = (half.u, half.z) if used.inverted else (half.z, half.u)
    z, u, faces, border = mirrored(z, u, half.faces, half.border, outline)
    sketch = Sketch(z * roots[0] + source.axis, u * roots[1] + target.axis, faces, border)
    whole_problem = problem._replace(theta=used.theta)
    return (sketch if exact else finished(whole_problem, sketch, settings, journal)), True


def coarse(
    problem: UnitProblem, size: float, journal: SolveLog, exactness: tuple[float, float] = COARSE_EXACTNESS
) -> DiscreteMap:
    """The best map of all starts on coarse meshes, for outlines and corners of a certain fineness."""
    level = Level.of(problem, size, *exactness, STEEPEST)
    free = problem.upright == 0 and level.anchors is None
    matches = starts.candidates(
        level.source.curve, level.target.curve, starts.ANY_TURN if free else starts.TURNS
    )
    if problem.holed:
        matches = with_partners(level, matches, problem)
    if problem.constrained:
        return meeting.coarse(level, matches, problem, journal)
    states = started(level, matches)
    journal.starts["tried"] += len(matches)
    journal.starts["failed"] += len(matches) - len(states)
    most = max(len(match.holes) for match in matches)
    if most > 1 or (most and not states):
        states += circle_starts(level, matches, problem.theta)
    states = screened(states or through_disc(level, problem.theta), problem)
    settled = []
    for state in progress.counted("coarse maps, corners released", states):
        try:
            settled.append(released(level, state, problem))
        except Stuck:
            continue
    if not settled:
        raise Stuck("no start")
    best = min(settled, key=lambda state: score(state, problem.upright))
    best = straightened(level, best, problem)
    journal.level("coarse", best, 1.0)
    return best


def straightened(level: Level, state: DiscreteMap, problem: UnitProblem) -> DiscreteMap:
    """The map with its turn taken out where a shape is round, so that any turn costs the same."""
    for _ in range(STRAIGHTENINGS):
        laps = state.turn / (2 * np.pi)
        if problem.upright == 0 or abs(laps) < STRAIGHT / 360:
            break
        s, tau, holes = state.match
        round_source, round_target = (4 * np.pi / o.length**2 > ROUND for o in (level.source, level.target))
        if round_target:
            match = Match(s, tau - laps * level.target.length, holes)
        elif round_source:
            match = Match(s + laps * level.source.length, tau, holes)
        else:
            break
        try:
            new = released(level, level.mapped(match), problem)
        except Stuck:
            break
        if score(new, problem.upright) >= score(state, problem.upright):
            break
        state = new
    return state


def with_partners(level: Level, matches: list[Match], problem: UnitProblem) -> list[Match]:
    """The matches with those of holes, and those by way of a ring where there is one hole."""
    partners = Partners(*level.domains, problem.partners)
    rings = ring_matches(level, problem.theta) if [len(side) for side in level.holes] == [1, 1] else []
    return [partners.of(match) for match in matches] + rings


def with_holes(problem: UnitProblem, holes: Holes, settings: Settings) -> UnitProblem:
    """The problem with its holes."""
    source = tuple(manageable_holes(problem.source, holes.source, settings.tolerance))
    target = tuple(manageable_holes(problem.target, holes.target, settings.tolerance))
    return problem._replace(holes=(source, target), partners=holes.partners)


def fine(problem: UnitProblem, state: DiscreteMap, size: float, journal: SolveLog) -> DiscreteMap:
    """The map on a finer mesh, its worst stretch lowered."""
    progress.tell("fine map")
    level = Level.of(problem, size, *FINE_EXACTNESS, STEEPEST_FINE)
    state = on_finer(level, state, problem)
    if problem.constrained and not meets(problem, state):
        state = meeting.again(level, state, problem)
    state = alternated(state, problem.theta, POWERS[0], FINE_ROUNDS, FINE_BACKWARD)
    journal.level("fine", state, POWERS[0])
    return state


def on_finer(level: Level, state: Meshed, problem: UnitProblem) -> DiscreteMap:
    """The map on the mesh of a finer level, smaller triangles where it magnifies."""
    sizes = sizing.graded(state.z, state.u, state.faces, 0.5 * level.size**2)
    return eased(carried(level, state, problem, sizes), problem.theta)


def last(
    problem: UnitProblem, state: Meshed, settings: Settings, journal: SolveLog, share: float = 1.0
) -> DiscreteMap:
    """The map on the mesh that is returned, whose outline holds every vertex of both outlines."""
    progress.tell("last map")
    theta = leaning(problem, state)
    state = on_finer(last_level(problem, settings, share), state, problem)
    return lowered(state, theta, settings, journal)


def last_level(problem: UnitProblem, settings: Settings, share: float = 1.0) -> Level:
    """The outlines with all their vertices, and the size of the last mesh."""
    size = np.sqrt(TRIANGLES_PER_AREA / (settings.triangles * share))
    return Level.of(problem, size, 0.0, 0.0, STEEPEST_FINE)


def lowered(state: DiscreteMap, theta: float, settings: Settings, journal: SolveLog) -> DiscreteMap:
    """The map at rest with its worst stretch lowered, until the bounds asked for are met."""
    return lowered_by(lambda state, q: descended(state, theta, q, journal), state, settings)


def lowered_by(
    descent: Callable[[DiscreteMap, float], DiscreteMap], state: DiscreteMap, settings: Settings
) -> DiscreteMap:
    """As `lowered`, by what descends for a power q."""
    tried: list[DiscreteMap] = []
    for q in progress.counted("last map, worst stretch lowered", POWERS):
        state = descent(state, q)
        tried.append(state)
        if _excess(state, settings) <= 1:
            return state
    return min(tried, key=lambda state: _excess(state, settings))


def leaning(problem: UnitProblem, state: Meshed) -> float:
    """θ for the last mesh: a little smaller where sizes are even and, without pins, K is small enough as it is."""
    even = within(2.0, state.z, state.u, state.material, state.metrics) >= LITTLE_FROM
    if problem.holed or problem.theta > 1 or not even:
        return problem.theta
    fine_already = problem.constrained or _sheared(over_target(problem, state)) <= SHEARED
    return LITTLE * problem.theta if fine_already else problem.theta


def leant(
    problem: UnitProblem,
    start: DiscreteMap,
    state: DiscreteMap,
    sizes: tuple[float, float],
    journal: SolveLog,
) -> tuple[UnitProblem, DiscreteMap]:
    """The fine map with angles kept better where that is needed and sizes allow it, and the problem with its θ.

    Holes that shrink need all of θ, and who asks for θ > 1 asks for even sizes; pins stay where they are met.

    Args:
        problem: with the θ asked for.
        start: its coarse map.
        state: its fine one.
        sizes: of both meshes.
        journal: of what happens.
    """
    first, share, steep = over_target(problem, state), 1.0, STEEP
    found, best = first, (problem, state)
    settled = problem.holed or problem.constrained or problem.theta > 1
    if settled or not SHEARED < _sheared(first) < HOPELESS:
        return best
    level = Level.of(problem, sizes[0], *COARSE_EXACTNESS, STEEPEST)
    for _ in range(LEANINGS):
        share *= max((AIMED / _sheared(found)) ** (1 / steep), LEAST_LEAN / share)
        less = problem._replace(theta=share * problem.theta)
        try:
            start = released(level, start, less)
            tried = fine(less, start, sizes[1], journal)
        except Stuck:
            break
        found = over_target(problem, tried)
        far = found.within(2) < EVEN or found.quantile(found.stretches, 0.95) > STRETCHED
        if _sheared(found) <= SHEARED and not far:
            best = less, tried
        if _sheared(found) > SHEARED:
            if far or share <= LEAST_LEAN:
                break
        elif _sheared(found) > TOO_FAR or found.within(2) >= AMPLE:
            break
        steep = max(np.log(_sheared(found) / _sheared(first)) / np.log(share), 0.1)
    return best


def over_target(problem: UnitProblem, state: Meshed) -> Distortion:
    """The figures of a map over the area of the target that was given."""
    z, u, metrics = state.z, state.u, state.metrics
    if problem.inverted:
        z, u, metrics = u, z, metrics[::-1]
    f_z, f_zbar, areas = derivatives(z, u, state.material, metrics)
    return Distortion(areas * (np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2), f_z, f_zbar, 1.0)


def _sheared(found: Distortion) -> float:
    return found.quantile(found.dilatations, 0.95)


def descended(state: DiscreteMap, theta: float, q: float, journal: SolveLog) -> DiscreteMap:
    """The map on the last mesh after Newton's steps; a note where they do not settle."""
    for _ in range(LAST_ROUNDS):
        state = state.forward(theta, q, LAST_STEPS, LAST_DECREASE, corners=True)
        if state.settled:
            break
    journal.level("last", state, q)
    if not state.settled and UNSETTLED not in journal.notes:
        journal.notes.append(UNSETTLED)
    return state


def carried(level: Level, state: Meshed, problem: UnitProblem, sizes: Sizes) -> DiscreteMap:
    """The map on a finer mesh, pins as they were."""
    if isinstance(state, DiscreteMap):
        return meeting.carried(level, state, problem.theta, sizes)
    return refined(level, state, sizes)


def _excess(state: DiscreteMap, settings: Settings) -> float:
    return excess(state.z, state.u, state.material, settings, state.metrics)


def excess(z: Complex, u: Complex, faces: Index, settings: Settings, metrics: Metrics = PLANES) -> float:
    """How many times the bounds asked for the largest dilatation and stretch are: at most 1 where they are met."""
    dilatation, stretch, _ = stretches(z, u, faces, metrics)
    bounds = (settings.max_dilatation or np.inf, settings.max_stretch or np.inf)
    return float(max(dilatation.max() / bounds[0], stretch.max() / bounds[1]))


def onto_itself(problem: UnitProblem, match: Match, settings: Settings) -> Meshed:
    """The similarity on a mesh."""
    size = np.sqrt(TRIANGLES_PER_AREA / settings.triangles)
    state = Level.of(problem, size, 0.0, 0.0, STEEPEST_FINE).mapped(match)
    turn = np.vdot(state.z[: state.border], state.u[: state.border])
    loops = state.holes.loops
    return Sketch(state.z, state.z * turn / abs(turn), state.faces, state.border, loops=loops)
