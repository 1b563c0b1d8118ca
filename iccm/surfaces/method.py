"""Balanced maps with a surface on either side: the energy is that of the surface, not of its flattening.

A surface is solved for in its even layout, with the metric of `balanced.metric` averaged over the solver's triangles;
the last map is on the surface's own triangles, those of the target where both sides are surfaces, since its texture
coordinates are what is written.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Complex, Flags
from ..balanced import fit, method
from ..balanced.constraints.validate import Pins, check
from ..balanced.errors import NoMapError, Stuck
from ..balanced.holes.given import Holes, named_partners, unequal
from ..balanced.injectivity import refuse_folds
from ..balanced.minimise.unfold import unfold_in
from ..balanced.model.discrete_map import DiscreteMap
from ..balanced.model.frames import UnitFrame, frames_of
from ..balanced.model.metric import LaidMetric, Metrics
from ..balanced.model.settings import Settings, Solution, SolveLog
from ..balanced.search import final_mesh, multilevel
from ..balanced.search.final_mesh import Meshed
from ..balanced.search.levels import UnitProblem, relax_stretched
from ..balanced.search.warm_start import continue_from
from ..maps.triangulated.map import TriangulatedMap
from ..meshes.flatten import Flattening
from ..problem import Options, Problem
from ..result import Fit
from . import icp_start, rigid
from .ground import ground_of
from .side import Side
from .target_mesh_map import OwnMap, on_own_mesh

SURE = 1.3  # energy of a map of surfaces that are alike from which down no other is looked for, by hand
STEPS, DECREASE = 40, 1e-3  # of Newton's method in space, and the relative decrease that ends it
ROUNDED = 0.2  # of the tolerance: for outlines between two surfaces, by hand
Layouts = tuple[Flattening | None, Flattening | None]


@dataclass(frozen=True, eq=False)
class _Prepared:
    """A problem with surfaces where it is solved.

    Attributes:
        sides: source and target.
        frames: their unit coordinates.
        unit: the problem in them.
        pins: where they are solved for.
        regions: rigid ones, polygons in the plane of the surface.
    """

    sides: tuple[Side, Side]
    frames: tuple[UnitFrame, UnitFrame]
    unit: UnitProblem
    pins: Pins
    regions: tuple[Complex, ...] = ()

    @property
    def onto(self) -> bool:
        """Whether the last map is on the target's own triangles; else it is on the source's."""
        return self.sides[1].layout is not None


def solve(problem: Problem, options: Options, layouts: Layouts, start: TriangulatedMap | None = None) -> Fit:
    """The balanced map of a problem whose source, target or both are layouts of surfaces; without holes it goes on from
    an earlier one, if given.

    Raises:
        NoMapError: no map without folds was found.
        InputError: pins or strokes that no one-to-one map meets; a surface without an even layout.
    """
    source, target = problem.given
    strokes = problem.given_strokes
    given = Holes(problem.source_holes, problem.target_holes, problem.hole_partners)
    holes, pins, numbers = named_partners(given, source, target, problem.given_pins, strokes)
    settings = fit.settings_of(options)
    journal = SolveLog(notes=unequal(holes))
    checked_pins = check(source, target, pins, strokes, numbers)
    journal.notes += checked_pins.notes
    sides = Side.of((source, *holes.source), layouts[0]), Side.of((target, *holes.target), layouts[1])
    if options.fit in ("contain", "cover"):
        found = _partial(sides, checked_pins, holes, settings)
        map = TriangulatedMap(found.source, found.image, found.faces, found.loops)
        result = fit.result_of(problem, found, map, (holes, pins), settings, drawn=True)
        if fit.loses_too_much(result, options):
            return solve(problem, replace(options, fit="whole"), layouts, start)
        result.notes.extend(fit.parts_lost(result))
        return replace(result, layouts=layouts)
    regions = problem.rigid or problem.rigid_target
    before = None if start is None or holes.source or holes.target or len(start.loops) > 1 else start
    try:
        ready = _prepare(sides, holes, checked_pins, settings, regions)
        found, exact = _solve(ready, checked_pins, settings, journal, before)
    except NoMapError:  # found in even layouts, it folds in the user's, or none was found
        ready = _prepare((sides[0].as_given, sides[1].as_given), holes, checked_pins, settings, regions)
        found, exact = _solve(ready, checked_pins, settings, journal, before)
    map = TriangulatedMap(found.source, found.image, found.faces, found.loops)
    map = (
        replace(map, bulge=np.zeros(len(map.edges.ends), complex))
        if exact
        else fit.straighten_lines(map, found.lines)
    )
    laid = None
    if regions:
        outlines, flat = rigid.laid_by_themselves(
            map, ready.sides[ready.onto].given, regions, of_target=ready.onto
        )
        found = replace(found, rigid=outlines, rigid_of_target=ready.onto)
        laid = flat, np.sqrt(sides[1].area / sides[0].area)
    result = fit.result_of(problem, found, map, (holes, pins), settings, drawn=True, laid=laid)
    result = replace(result, layouts=layouts)
    if regions:
        fit.check_sizes(result, options.rigid_size)
    if not (len(pins) or len(strokes)) or all(layouts):
        result.notes.extend(fit.strain(result.distortion))
    return result


def _partial(sides: tuple[Side, Side], pins: Pins, holes: Holes, settings: Settings) -> Solution:
    """A partial map, of the outlines of even layouts: bays have no surface whose metric would be theirs."""
    curves = [side.solved for side in sides]
    inner = Holes(tuple(curves[0][1:]), tuple(curves[1][1:]), holes.partners)
    moved = _inward(pins, sides)
    points = np.concatenate([moved.inner, moved.outer])
    strokes = [(stroke.source, stroke.target) for stroke in moved.strokes]
    found = method.solve(curves[0][0], curves[1][0], settings, points, strokes, inner)
    z, u = (side.outward(w, side.is_on(w)) for side, w in zip(sides, (found.source, found.image)))
    for name, w in (("source", z), ("image", u)):
        refuse_folds(name, w, found.faces)
    filled = found.filled and (sides[0].loop_outward(found.filled[0]), sides[1].loop_outward(found.filled[1]))
    return replace(found, source=z, image=u, filled=filled)


def _prepare(
    sides: tuple[Side, Side],
    holes: Holes,
    pins: Pins,
    settings: Settings,
    regions: tuple[Complex, ...] = (),
) -> _Prepared:
    """The problem in unit coordinates of even layouts."""
    curves = [side.solved for side in sides]
    inner = Holes(tuple(curves[0][1:]), tuple(curves[1][1:]), holes.partners)
    frames = frames_of(curves[0][0], curves[1][0], settings.turn, inner.sides)
    moved = _inward(pins, sides)
    upright = 0.0 if settings.turn is None or pins.count > 1 or pins.strokes else multilevel.UPRIGHT
    outlines = frames[0].curve(curves[0][0]), frames[1].curve(curves[1][0])
    if all(side.layout for side in sides):  # what one plane rounds off another may magnify
        settings = replace(settings, tolerance=ROUNDED * settings.tolerance)
    unit = multilevel.with_constraints(*outlines, inner.unit(frames), moved.unit(frames), settings, upright)
    return _Prepared(sides, frames, unit._replace(metrics=_metrics(sides, frames)), moved, regions)


def _metrics(sides: tuple[Side, Side], frames: tuple[UnitFrame, UnitFrame]) -> Metrics:
    source, target = (
        None if side.even is None else LaidMetric.of(side.even, frame) for side, frame in zip(sides, frames)
    )
    return source, target


def _inward(pins: Pins, sides: tuple[Side, Side]) -> Pins:
    """Pins and strokes where the problem is solved."""
    inner, outer = (
        np.column_stack([side.inward(z) for side, z in zip(sides, each.T)])
        for each in (pins.inner, pins.outer)
    )
    strokes = tuple(
        replace(
            stroke, source=sides[0].curve_inward(stroke.source), target=sides[1].curve_inward(stroke.target)
        )
        for stroke in pins.strokes
    )
    return replace(pins, inner=inner, outer=outer, strokes=strokes)


def _gone_on(ready: _Prepared, start: TriangulatedMap, settings: Settings) -> DiscreteMap:
    """An earlier map with the constraints met, where the problem is solved."""
    z, u = (side.inward(w) for side, w in zip(ready.sides, (start.source, start.image)))
    sketch = method.sketch_of(TriangulatedMap(z, u, start.faces, start.loops), ready.frames)
    try:
        return continue_from(final_mesh.final_level(ready.unit, settings), sketch)
    except Stuck:
        raise NoMapError("start: cannot be gone on from without folds; do without it") from None


def _solve(
    ready: _Prepared,
    pins: Pins,
    settings: Settings,
    journal: SolveLog,
    start: TriangulatedMap | None,
) -> tuple[Solution, bool]:
    """The map in the user's planes, and whether it is on a surface's own triangles."""
    alike = None if start is not None else _from_similarity(ready, settings, journal)
    if alike is not None and alike.energy < SURE:
        return _of_own(ready, alike, pins, settings, journal), True
    try:
        if start is None:
            used, state = multilevel.coarse_to_fine(ready.unit, journal)
        else:
            used, state = ready.unit, _gone_on(ready, start, settings)
    except NoMapError:
        if alike is None:
            raise
        return _of_own(ready, alike, pins, settings, journal), True
    met = final_mesh.meets_constraints(used, state)
    try:
        state_there = _own_start(ready, used, state)
        own = None if state_there is None else _on_own(ready, state_there, settings, journal)
    except (Stuck, NoMapError):  # a surface of few triangles may leave no room
        own = None
    if ready.regions:
        own = _with_rigid(ready, own, settings, journal)
    if alike is not None and (own is None or not met or alike.energy < own.energy):
        own, met = alike, True
    if own is not None:
        return replace(_of_own(ready, own, pins, settings, journal), met=met), True
    last = final_mesh.finish(used, state, settings, journal)
    last = multilevel.invert(last) if used.inverted else last
    z, u = (
        side.outward(frame.world(w), _among(w, last.outer))
        for side, frame, w in zip(ready.sides, ready.frames, (last.z, last.u))
    )
    return replace(_solution(ready, last, z, u, pins, settings, journal), met=met), False


def _among(w: Complex, outer: slice) -> Flags:
    """(n,) which of a map's vertices are on its outer outline."""
    on = np.zeros(w.size, bool)
    on[outer] = True
    return on


def _solution(
    ready: _Prepared,
    last: Meshed,
    z: Complex,
    u: Complex,
    pins: Pins,
    settings: Settings,
    journal: SolveLog,
) -> Solution:
    """Of a map with vertices z (n,) and u (n,) in the user's planes."""
    given = ready.sides[0].outlines, ready.sides[1].outlines
    return method.solution_of(last, z, u, ready.frames, given, settings, journal, False, pins)


def _of_own(ready: _Prepared, own: OwnMap, pins: Pins, settings: Settings, journal: SolveLog) -> Solution:
    """The map on a surface's own triangles in the user's planes."""
    onto, other, frame = ready.onto, ready.sides[not ready.onto], ready.frames[not ready.onto]
    here = own.of_layout(ready.sides[onto].given.flat)
    there = _repair(
        own.state,
        other.outward(frame.world(own.state.u), _among(own.state.u, own.state.outer)),
        mirrored=frame.mirrored,
    )
    if onto:
        return _solution(ready, multilevel.invert(own.state), there, here, pins, settings, journal)
    return _solution(ready, own.state, here, there, pins, settings, journal)


def _own_start(ready: _Prepared, used: UnitProblem, state: DiscreteMap) -> DiscreteMap | None:
    """The map from which that on the own triangles goes on, these being its source; None where it is to be on others:
    with strokes, and where holes of the other side are to shrink."""
    if state.inside.strokes or (not state.bound and state.inside.z.size):
        return None
    if used.inverted == ready.onto:
        return state
    return None if state.filled else state.inverse()


def _from_similarity(ready: _Prepared, settings: Settings, journal: SolveLog) -> OwnMap | None:
    """The map that comes from the similarity of both layouts; None where they are not alike, or it folds."""
    if not all(side.layout for side in ready.sides):
        return None
    sketch = icp_start.similarity_sketch(ready.unit)
    if sketch is None:
        return None
    try:
        return _on_own(ready, multilevel.invert(sketch) if ready.onto else sketch, settings, journal)
    except (Stuck, NoMapError):
        return None


def _on_own(ready: _Prepared, state: Meshed, settings: Settings, journal: SolveLog) -> OwnMap:
    """The map on the own triangles of one side, from one of which that side is the source.

    Raises:
        Stuck: there is none.
    """
    problem = ready.unit.inverse() if ready.onto else ready.unit
    step = -1 if ready.onto else 1
    level = final_mesh.final_level(problem, settings)
    own = on_own_mesh(ready.sides[::step], ready.frames[::step], level, state)
    other = ready.sides[not ready.onto].even
    if other is None:
        begun = relax_stretched(own.state)
        return replace(own, state=final_mesh.meet_bounds(begun, settings, journal))
    begun = replace(own.state, ground=ground_of(other, ready.frames[not ready.onto]))
    first = begun.forward(1.0, STEPS, DECREASE)
    journal.level("own", first, 1.0)
    state = final_mesh.meet_bounds_by(lambda state, q: state.forward(q, STEPS, DECREASE), first, settings)
    return replace(own, state=state, energy=first.energy)


def _with_rigid(ready: _Prepared, own: OwnMap | None, settings: Settings, journal: SolveLog) -> OwnMap:
    """The map on the own triangles with rigid regions.

    Raises:
        InputError: as `rigid.keep_rigid`.
        NoMapError: none keeps them without folds.
    """
    if own is None:
        raise NoMapError("rigid: no map without folds follows the surface's own triangles")
    places = own.of_layout(ready.sides[ready.onto].given.flat)
    asked = settings.inverse() if ready.onto else settings
    return rigid.keep_rigid(own, places, ready.regions, asked, journal)


def _repair(state: DiscreteMap, there: Complex, *, mirrored: bool) -> Complex:
    """Images (n,) in the user's plane, the few triangles that fold on the way there unfolded; as they are where that
    fails."""
    held = np.arange(there.size) < state.constrained
    try:
        found = unfold_in(there.conj() if mirrored else there, state.faces, held, state.u)
    except Stuck:
        return there
    return found.conj() if mirrored else found
