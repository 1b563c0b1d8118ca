"""Solve a problem by the balanced method: from a `Problem` and `Options` to a `Fit`."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..errors import InputError, all_names
from ..fit_data import Details
from ..fits import leaves_out_parts
from ..maps import bounds
from ..maps.approximation import triangulated
from ..maps.distortion import Distortion
from ..maps.regions import SIZE_OFF_SHARE, RigidRegion, Rings, mean_scale, triangles_in
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import NO_FACES, bulges
from ..options import Options
from ..pins import Softness
from ..plane import diagonal
from ..problem import Holes, Problem
from ..result import Fit
from ..status import Status
from . import cartogram
from .coarse import CoarseMap
from .constraints.soft import MOST_LIMIT_RATIO, bands_of, patches_of, softness_of
from .constraints.validate import check, check_free
from .errors import NoMapError, OutOfTime
from .holes.given import open_holes, unequal, with_paired_holes
from .method import solve as solved
from .model.solution import Solution
from .rigid.given import NO_REGIONS, regions_of

LAYERED = "Where the shape overlaps itself, pictures show the layer that is farther from the {}."

EVEN_BALANCE = 1.0  # the balance with equal weights of angles and areas
NOTED_AREA_SHARE = 5e-4  # relative to the area; less is not reported
NOTED_ROTATION_RADIANS = np.radians(5)  # less is not reported
NOTED_DISTANCE = 5e-5  # relative to the diagonal; in per cent, less reads 0.00


def solve(
    problem: Problem,
    options: Options,
    start: TriangulatedMap | None = None,
    *,
    coarse: CoarseMap | None = None,
) -> Fit:
    """Return the balanced map of a problem, with notes about what it leaves out or cannot meet.

    Args:
        problem: the domains and constraints.
        options: options of the solver.
        start: an earlier map to start from.
        coarse: a coarse map of the problem, which is refined if there are no constraints.

    Raises:
        NoMapError: no map without folds was found.
        InputError: no one-to-one map meets the pins or strokes.
    """
    fit = solve_once(problem, options, start, coarse=coarse)
    if problem.size_map and options.balance >= cartogram.AREAS_MET_BALANCE:
        whole = replace(options, fit="whole")
        fit = cartogram.match_areas(
            problem.size_map,
            fit,
            lambda sizes, *before: solve_once(replace(problem, size_map=sizes), whole, *before),
        )
    return fit


def solve_once(
    problem: Problem,
    options: Options,
    start: TriangulatedMap | None = None,
    remesh: bool = False,
    coarse: CoarseMap | None = None,
) -> Fit:
    """Return the balanced map of a problem with its notes, without fitting a size map and without suggestions.

    Args:
        problem: the domains and constraints.
        options: options of the solver.
        start: an earlier map to start from.
        remesh: whether to solve on a new mesh, on which the outlines slide, even if the start has the same
            outlines.
        coarse: see `solve`.

    Raises:
        NoMapError: no map without folds was found.
        InputError: no one-to-one map meets the pins or strokes.
    """
    if start is None and options.balance > EVEN_BALANCE and not leaves_out_parts(options.fit):
        options = replace(options, fit="whole")
        attempt = _attempt(problem, options, _map_of_less_balance(problem, options), remesh=True)
    else:
        attempt = _attempt(problem, options, start, remesh=remesh, coarse=coarse)
    attempt = _with_exact_pins(attempt, problem, options, start, remesh=remesh)
    fit = attempt.fit
    if attempt.options.fit != "whole" and loses_too_much(
        fit.coverage.left_out, fit.coverage.uncovered, options
    ):
        return solve_once(problem, replace(options, fit="whole"), start)
    if fit.rigid:
        check_sizes(fit, options.rigid_size)
    if attempt.is_free:
        fit.notes.extend(stretch_notes(fit.distortion))
    if attempt.is_free or options.turn is not None:  # by default, pins determine the rotation
        fit.notes.extend(rotation_notes(attempt.rotation, options.rotation))
    map = triangulated(fit.map)
    fit.notes.extend(soft_pin_notes(map, attempt.soft_pins))
    fit.notes.extend(bounds.bound_notes(map, options.max_dilatation, options.max_stretch))
    return fit


def _map_of_less_balance(problem: Problem, options: Options) -> TriangulatedMap:
    """Return the map of half the balance, but at least EVEN_BALANCE, to start from.

    The weight of areas is raised by a factor of two at a time: separate searches with large weights find minima
    that are increasingly far from the best, rotated and less uniform in scale.
    """
    less_balanced = replace(options, balance=max(EVEN_BALANCE, options.balance / 2), rigid_size=None)
    return triangulated(solve_once(replace(problem, rigid=(), rigid_target=()), less_balanced).map)


class _Attempt(NamedTuple):
    """A map, and the options with which it was solved.

    Attributes:
        fit: the map, without notes on its quality.
        options: the options, adapted to the constraints.
        rotation: mean rotation of the picture in radians.
        is_free: whether there are neither pins nor strokes, except pins in holes.
        soft_pins: (k, 2) pins that need not be met exactly.
    """

    fit: Fit
    options: Options
    rotation: float
    is_free: bool
    soft_pins: Complex


def _with_exact_pins(
    attempt: _Attempt, problem: Problem, options: Options, start: TriangulatedMap | None, *, remesh: bool
) -> _Attempt:
    """Return an attempt with exact pins, if the given one misses the places of soft pins.

    First the pins that miss are made exact, then all soft ones: the place of a pin matters more than the shape
    of its surroundings. Pins that were given with more than a place stay soft. If pins are missed all the same,
    the first attempt is returned.
    """
    free = ~problem.softness.is_given & problem.softness.is_soft
    exact = np.zeros(len(problem.pins), bool)
    best = attempt
    for everything in (False, True):
        if best.fit.status is not Status.PINS or not len(best.soft_pins):
            break
        soft = free & np.isin(problem.pins[:, 0], best.soft_pins[:, 0])
        missed = soft & ~_are_near(best, problem.pins)
        newly_exact = soft if everything else missed
        if not newly_exact.any():
            break
        exact |= newly_exact
        softness = problem.softness.with_pins(np.flatnonzero(exact), Softness.exact(int(exact.sum())))
        try:
            best = _attempt(replace(problem, softness=softness), options, start, remesh=remesh)
        except (NoMapError, OutOfTime):
            break
    if best is attempt or best.fit.status is Status.PINS:
        return attempt
    best.fit.notes.append(exact_pin_note(np.flatnonzero(exact)))
    return best


def _are_near(attempt: _Attempt, pins: Complex) -> Flags:
    """Return (k,) whether pins (k, 2) are as close to their places as soft ones must be; true if they have no
    limit.
    """
    fit = attempt.fit
    assert fit.details.softness is not None
    limits = {
        point: limit for point, limit in zip(fit.pins[:, 0].tolist(), fit.details.softness.limits.tolist())
    }
    pin_limits = np.array([limits.get(point, np.nan) for point in pins[:, 0].tolist()])
    # exact pins, and pins in holes, have no limit
    return near_places(triangulated(fit.map), pins, pin_limits)


def exact_pin_note(numbers: Index) -> str:
    """Return a sentence on soft pins (k,) that were made exact because they would miss their places."""
    labels = [str(number + 1) for number in numbers]
    if len(labels) == 1:
        return f"Pin {labels[0]} is met exactly, because as a soft pin it would miss its place (radius)."
    return f"Pins {all_names(labels)} are met exactly, because as soft pins some would miss their places (radius)."


def _attempt(
    problem: Problem,
    options: Options,
    start: TriangulatedMap | None,
    *,
    remesh: bool,
    coarse: CoarseMap | None = None,
) -> _Attempt:
    """Solve a problem directly, or through its inverse if regions of the target are rigid."""
    source, target = problem.outlines
    between = with_paired_holes(replace(problem, source=source, target=target))
    pins, regions = between.pins, problem.rigid or problem.rigid_target
    if options.exact_pins or regions:  # pins in a rigid region determine its similarity
        between = replace(between, softness=Softness.exact(len(pins)))
    constrained = len(pins) or between.strokes or regions or problem.size_map or problem.importance
    if problem.rigid_target:
        solution = solve_inverse(between, options, start, remesh=remesh)
    else:
        solution = solved(between, options, start, remesh=remesh, coarse=None if constrained else coarse)
    linear = in_regions(solution.map, solution.rigid, of_target=solution.rigid_of_target)
    map = straighten_lines(solution.map, solution.lines, linear)
    map = bounds.straighten_beyond_bounds(map, options.max_dilatation, options.max_stretch)
    in_bounds = bounds.meets_bounds(map, options.max_dilatation, options.max_stretch)
    fit = result_of(problem, solution, map, (between.holes, pins), options, in_bounds=in_bounds)
    is_free = not (len(pins) or len(between.strokes))
    return _Attempt(fit, options, solution.rotation, is_free=is_free, soft_pins=solution.soft_pins)


def solve_inverse(
    problem: Problem, options: Options, start: TriangulatedMap | None, *, remesh: bool
) -> Solution:
    """Solve a problem with rigid regions of the target through its inverse, in which they are regions of the source.

    The inverse map has the same energy. See `method.solve` for the arguments.

    Raises:
        NoMapError: no map without folds was found.
        InputError: no one-to-one map meets the pins or strokes, or the source has more holes than the target.
    """
    # Checked here, so that messages do not confuse source and target.
    check(*problem.outlines, problem.pins, problem.strokes, problem.pin_numbers)
    holes = problem.holes
    if len(holes.source) > len(holes.target):
        raise InputError("rigid_target: the source has more holes than the target; set holes to fill or cut")
    inverse_start = start and start.linear_inverse()
    solution = solved(problem.inverse(), options.inverse(), inverse_start, remesh=remesh)
    inverse_notes, hole_notes = unequal(holes.inverse()), unequal(holes)
    notes = [note for note in solution.notes if note not in inverse_notes]
    return replace(
        solution.inverse(), notes=[*hole_notes, *notes] if len(notes) < len(solution.notes) else notes
    )


def loses_too_much(hidden: float, bare: float, options: Options) -> bool:
    """Return whether these shares, of the source that is hidden and of the target that is bare, exceed those allowed.

    They are those of a solved map; the search only estimates them.
    """
    return hidden > options.max_left_out + NOTED_AREA_SHARE or bare > options.max_uncovered + NOTED_AREA_SHARE


def result_of(
    problem: Problem,
    solution: Solution,
    map: TriangulatedMap,
    constraints: tuple[Holes, Complex],
    options: Options,
    *,
    in_bounds: bool,
    region_layout: tuple[Complex, float] | None = None,
) -> Fit:
    """Return the `Fit` of a solution.

    Args:
        problem: the domains and constraints.
        solution: the solution.
        map: its map, with curved patches.
        constraints: the holes, and the pins (k, 2) that are not in holes.
        options: options of the solver.
        in_bounds: whether the patches meet the bounds on distortion.
        region_layout: for rigid regions of a surface: (n,) positions of vertices with each region flattened, and the
            map's mean scale.
    """
    source, target, strokes = problem.source, problem.target, problem.strokes
    holes, pins = constraints
    status = _status(solution, in_bounds, options)
    flat, mean = region_layout or (None, mean_scale(source, target, holes.sides))
    of_target = solution.rigid_of_target
    rigid = [RigidRegion.of(map, rings, mean, of_target=of_target, flat=flat) for rings in solution.rigid]
    if status.ok and not near_places(map, solution.soft_pins, solution.softness.limits).all():
        status = Status.PINS
    if status.ok and not all(region.is_rigid for region in rigid):
        status = Status.BENT
    energies = [{"total": float(energy)} for energy in solution.energies]
    return Fit(
        *(map, status, energies, source, target, pins, strokes, list(solution.notes)),
        source_holes=holes.source,
        target_holes=holes.target,
        rigid=rigid,
        details=Details(
            hole_partners=solution.partners,
            filled=solution.filled,
            softness=softness_of(pins, solution.soft_pins, solution.softness),
        ),
        _covering_map=solution.covering_map,
    )


def deform(problem: Problem, options: Options, start: TriangulatedMap | None = None) -> Fit:
    """Return the deformation of a problem without a target.

    Args:
        problem: the source and constraints.
        options: options of the solver.
        start: an earlier deformation to start from.

    Raises:
        NoMapError: the shape cannot be meshed.
        InputError: the constraints are invalid, as in `check_free`.
    """
    from .deform import method as deforming

    source, pins, strokes = problem.source, problem.pins, problem.strokes
    holes, hole_notes = open_holes(
        problem.holes.source, source, pins[:, 0], [source_stroke for source_stroke, _ in strokes]
    )
    constraints = check_free(source, pins, strokes, holes)
    notes = [*hole_notes, *constraints.notes]
    softness = problem.softness
    if options.exact_pins or problem.rigid:  # the pins of a rigid region determine its similarity
        softness = Softness.exact(len(pins))
    bands = bands_of(strokes, problem.stroke_widths)
    patches = patches_of(source, None, (holes, ()), pins, softness, constraints, bands=bands)
    constraints = constraints.without(patches.points[:, 0])
    regions = regions_of(problem.rigid, source, holes, pins, strokes) if problem.rigid else NO_REGIONS
    solution = deforming.solve(source, constraints, options, start, holes, regions, patches)
    map = solution.map
    if not solution.simple:
        bottom = pins[0, 0] if len(pins) else strokes[0][0].z[0]
        map = replace(map, faces=map.faces[drawing_order(map.source[map.faces].mean(axis=1), bottom)])
        notes.append(LAYERED.format("first pin" if len(pins) else "beginning of the first stroke"))
    map = straighten_lines(map, solution.lines, in_regions(map, regions.polygons))
    map = bounds.straighten_beyond_bounds(map, options.max_dilatation, options.max_stretch)
    bounded = solution.reached and bounds.meets_bounds(map, options.max_dilatation, options.max_stretch)
    constraints_met = solution.met and bool(near_places(map, patches.points, patches.softness.limits).all())
    rigid = [RigidRegion.of(map, rings) for rings in regions.polygons]
    if not constraints_met:
        status = Status.PINS
    elif not all(bone.is_rigid for bone in rigid):
        status = Status.BENT
    elif not bounded:
        status = Status.BOUNDS
    else:
        status = Status.MET if solution.simple else Status.OVERLAP
    notes.extend(soft_pin_notes(map, patches.points))
    energies = [{"total": energy} for energy in solution.energies]
    return Fit(
        *(map, status, energies, source, None, pins, strokes, notes),
        source_holes=holes,
        rigid=rigid,
        details=Details(softness=softness_of(pins, patches.points, patches.softness)),
    )


def drawing_order(middles: Complex, bottom: complex) -> Index:
    """Return (m,) an order of triangles; where several overlap, pictures show the last.

    They are ordered by the distance of their midpoints in the source from `bottom`, the point of the lowest
    layer.
    """
    return np.argsort(np.abs(middles - bottom), kind="stable")


def straighten_lines(map: TriangulatedMap, lines: Index, linear: Index = NO_FACES) -> TriangulatedMap:
    """Return the map with curved patches such that the edges of strokes are mapped to straight lines.

    Args:
        map: the map.
        lines: (l, 2) vertex pairs of the edges.
        linear: (k,) triangles on which the map stays linear.
    """
    if not len(lines) and not linear.size:
        return map
    return replace(map, bulge=bulges(map.faces, map.image, map.source, map.edges, lines, linear))


def in_regions(map: TriangulatedMap, regions: Sequence[Rings], *, of_target: bool = False) -> Index:
    """Return (k,) the triangles in rigid regions of the source, or of the target."""
    return np.concatenate([NO_FACES, *(triangles_in(map, rings, of_target=of_target) for rings in regions)])


def check_sizes(fit: Fit, requested: float | str | None) -> None:
    """Add a note on rigid regions that had to be smaller than usual, or larger in the target, for lack of room.

    Raises:
        InputError: they had to be smaller, or larger, than requested.
    """
    for k, region in enumerate(fit.rigid):
        goal = requested if isinstance(requested, float | int) else 1.0
        room = goal / region.scale if region.of_target else region.scale / goal
        if requested == "free" or not region.is_rigid or room > 1 - SIZE_OFF_SHARE:
            continue
        limit_word, alternative, round_size = (
            ("from", "larger", np.ceil) if region.of_target else ("up to", "smaller", np.floor)
        )
        size = f"{round_size(round(1000 * region.scale) / 10) / 100:.2f} times the mean scale"
        if requested is not None:
            raise InputError(
                f"rigid_size: region {k + 1} has room for a size {limit_word} {size}, not for {goal:g}; choose a "
                f"{alternative} size"
            )
        fit.notes.append(
            f"Rigid region {k + 1} is mapped at {size}, to fit near its place; rigid_size sets another size (regions)."
        )


def _status(solution: Solution, in_bounds: bool, options: Options) -> Status:
    if not solution.met:
        return Status.PINS
    if solution.gap > options.tolerance:
        return Status.GAP
    if solution.source_gap > options.tolerance:
        return Status.SOURCE_GAP
    return Status.REACHED if solution.reached and in_bounds else Status.BOUNDS


def stretch_notes(distortion: Distortion) -> list[str]:
    """Return a note if the shapes make a large stretch unavoidable, such as a ring, a bar or a spiral and a block."""
    if distortion.strain is None:
        return []
    return [
        "The shapes differ so much that the picture is strongly stretched: on 5 % of the target, lengths "
        "change by a factor of more than {:.1f}, and the dilatation exceeds {:.0f}.".format(
            *distortion.strain
        )
    ]


def near_places(map: TriangulatedMap, pins: Complex, limits: Real) -> Flags:
    """Return (k,) whether pins (k, 2) are as close to their places as soft ones must be, within their limits (k,).

    A limit that is not a number is none.
    """
    if not len(pins):
        return np.ones(0, bool)
    points, places = pins.T
    return np.isnan(limits) | (np.abs(map(points) - places) <= MOST_LIMIT_RATIO * limits)


def soft_pin_notes(map: TriangulatedMap, pins: Complex) -> list[str]:
    """Return a note on the largest distance of soft pins from their places, if there is any."""
    if not len(pins):
        return []
    points, places = pins.T
    largest = float(np.abs(map(points) - places).max()) / diagonal(map.image)
    if largest < NOTED_DISTANCE:
        return []
    return [
        f"Soft pins miss their places by up to {largest:.2%} of the target's diagonal: give them a smaller tolerance "
        "to come closer (10,20:30,40,tolerance=2), or meet their places exactly, which bends the picture there "
        "(exact_pins)."
    ]


def rotation_notes(rotation: float, requested: float | None) -> list[str]:
    """Return a note if the picture is rotated by another angle than requested.

    Args:
        rotation: mean rotation in radians.
        requested: requested rotation in radians; None if any is accepted.
    """
    if requested is None:
        return []
    difference = np.degrees(np.angle(np.exp(1j * (rotation - requested))))
    if abs(np.radians(difference)) <= NOTED_ROTATION_RADIANS:
        return []
    turn = np.degrees(np.angle(np.exp(1j * rotation)))
    return [
        f"The picture is rotated by {turn:.0f} degrees instead of {np.degrees(requested):g}, because of the "
        "shapes or the constraints (turn)."
    ]
