"""Balanced maps with a surface on either side, whose energy is that of the surface and not of its flattening.

First a planar problem is solved between even layouts, with the surfaces' metrics (`balanced.model.metric`) averaged
over the solver's triangles. The final map is found on the surface's own triangles, since its vertices become the
texture coordinates; where both sides are surfaces, these are the target's triangles.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Flags
from ..balanced import fit, method
from ..balanced.errors import NoMapError, OutOfTime, Stuck
from ..balanced.minimise.unfold import unfold_in
from ..balanced.model.discrete_map import DiscreteMap
from ..balanced.model.mesh_map import MeshMap
from ..balanced.model.settings import Solution
from ..balanced.search import final_mesh, multilevel
from ..balanced.search.levels import FINE_POWER, Level
from ..balanced.search.unit_problem import UnitProblem
from ..balanced.search.warm_start import continue_from
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..problem import Problem
from ..result import Fit
from . import icp_start, rigid
from .coarse_start import started_coarsely
from .ground import ground_of
from .problem import Layouts, SurfaceProblem
from .target_mesh_map import OwnMap, on_own_mesh

SURE_ENERGY = 1.3
"""Energy of a map between similar surfaces below which no other map is sought: sizes then differ by little."""
MOST_SLIDES, WORTHWHILE_SLIDE_DECREASE = 4, 1e-3
"""Most times that the boundary is slid, and the least relative decrease that is worth another time."""
NEWTON_STEPS, LEAST_DECREASE = 40, 1e-3  # of Newton's method in space, and the relative decrease that ends it


def solve(problem: Problem, options: Options, layouts: Layouts, start: TriangulatedMap | None = None) -> Fit:
    """Return the balanced map of a problem whose source, target or both are layouts of surfaces.

    If the problem has no holes, the solution may continue from an earlier map `start`.

    Raises:
        NoMapError: no map without folds was found.
        InputError: pins or strokes that no one-to-one map satisfies; a surface without an even layout.
    """
    asked = SurfaceProblem.of(problem, options, layouts)
    if any(asked.holes.sides) or (start is not None and len(start.loops) > 1):
        start = None
    try:
        found, exact = _solve(asked, start)
    except NoMapError:  # no map was found, or it folds in the user's planes: try these instead
        asked = asked.as_given
        found, exact = _solve(asked, start)
    if exact:  # linear on each of the surface's own triangles
        map = replace(found.map, bulge=np.zeros(len(found.map.edges.ends), complex))
    else:
        map = fit.straighten_lines(found.map, found.lines)
    soft_pins, softness = asked.soft_pins
    found = replace(found, soft_pins=soft_pins, softness=softness)
    laid = None
    if asked.regions:
        outlines, flat = rigid.laid_by_themselves(
            map, asked.sides[asked.onto].given, asked.regions, of_target=asked.onto
        )
        found = replace(found, rigid=outlines, rigid_of_target=asked.onto)
        laid = flat, np.sqrt(asked.sides[1].area / asked.sides[0].area)
    given = asked.holes, asked.points
    result = fit.result_of(problem, found, map, given, asked.settings, drawn=True, laid=laid)
    result = replace(result, layouts=layouts)
    if asked.regions:
        fit.check_sizes(result, options.rigid_size)
    result.notes.extend(fit.soft_pin_notes(map, soft_pins))
    if not (len(asked.points) or problem.strokes) or all(layouts):
        result.notes.extend(fit.stretch_notes(result.distortion))
    return result


def _gone_on(asked: SurfaceProblem, start: TriangulatedMap) -> DiscreteMap:
    """Return an earlier map with the new constraints satisfied, in unit coordinates."""
    z, u = (side.inward(w) for side, w in zip(asked.sides, (start.source, start.image)))
    sketch = method.sketch_of(TriangulatedMap(z, u, start.faces, start.loops), asked.frames)
    try:
        return continue_from(final_mesh.final_level(asked.unit, asked.settings), sketch)
    except Stuck:
        raise NoMapError("start: cannot continue from this map without folds; leave it out") from None


def _solve(asked: SurfaceProblem, start: TriangulatedMap | None) -> tuple[Solution, bool]:
    """Return the map in the user's planes, and whether it is on the surface's own triangles."""
    alike = None if start is not None else _from_similarity(asked)
    if alike is not None and alike.energy < SURE_ENERGY:
        return _of_own(asked, alike), True
    try:
        if start is None:
            used, state = multilevel.coarse_to_fine(asked.unit, asked.journal)
        else:
            used, state = asked.unit, _gone_on(asked, start)
    except NoMapError:
        if alike is None:
            raise
        return _of_own(asked, alike), True
    met = final_mesh.meets_constraints(used, state)
    try:
        state_there = _own_start(asked, used, state)
        own = None if state_there is None else _on_own(asked, state_there)
    except (Stuck, NoMapError):  # a surface with few triangles may leave no room
        own = None
    if asked.regions:
        own = _with_rigid(asked, own)
    if alike is not None and (own is None or not met or alike.energy < own.energy):
        own, met = alike, True
    if own is not None:
        return replace(_of_own(asked, own), met=met), True
    last = multilevel.whole_map(used, state, asked.settings, asked.journal)
    z, u = (
        side.outward(frame.pull_back(w), _among(w, last.outer))
        for side, frame, w in zip(asked.sides, asked.frames, (last.z, last.u))
    )
    return replace(_solution(asked, last, z, u), met=met), False


def _among(w: Complex, outer: slice) -> Flags:
    """Mark (n,) the vertices of a map that are on its outer outline."""
    on = np.zeros(w.size, bool)
    on[outer] = True
    return on


def _solution(asked: SurfaceProblem, last: MeshMap, z: Complex, u: Complex) -> Solution:
    """Return the solution for a map with vertices z (n,) and images u (n,) in the user's planes."""
    given = asked.sides[0].outlines, asked.sides[1].outlines
    return method.solution_of(last, z, u, asked.frames, given, asked.settings, asked.journal, asked.pins)


def _of_own(asked: SurfaceProblem, own: OwnMap) -> Solution:
    """Return a map on a surface's own triangles as a solution in the user's planes."""
    onto, other, frame = asked.onto, asked.sides[not asked.onto], asked.frames[not asked.onto]
    here = own.of_layout(asked.sides[onto].given.flat)
    there = _repair(
        own.state,
        other.outward(frame.pull_back(own.state.u), _among(own.state.u, own.state.outer)),
        mirrored=frame.mirrored,
    )
    if onto:
        return _solution(asked, own.state.inverse(), there, here)
    return _solution(asked, own.state, here, there)


def _own_start(asked: SurfaceProblem, used: UnitProblem, state: DiscreteMap) -> DiscreteMap | None:
    """Return the map, its source the surface, that the map on the surface's own triangles starts from.

    None where the own triangles cannot be used: with strokes, with pins that were released, and where holes of the
    other side would have to shrink.
    """
    if state.inside.strokes or (not state.bound and state.inside.z.size):
        return None
    if used.inverted == asked.onto:
        return state
    return None if state.filled else state.swap_sides()


def _from_similarity(asked: SurfaceProblem) -> OwnMap | None:
    """Return the map found from a similarity of both layouts; None where they are not alike, or it folds."""
    if not all(side.layout for side in asked.sides):
        return None
    sketch = icp_start.similarity_sketch(asked.unit)
    if sketch is None:
        return None
    try:
        return _on_own(asked, sketch.inverse() if asked.onto else sketch)
    except (Stuck, NoMapError):
        return None


def _on_own(asked: SurfaceProblem, state: MeshMap) -> OwnMap:
    """Return the map on one side's own triangles, from a map whose source is that side.

    Raises:
        Stuck: there is no such map.
    """
    problem = asked.unit.inverse() if asked.onto else asked.unit
    step = -1 if asked.onto else 1
    level = final_mesh.final_level(problem, asked.settings)
    own = on_own_mesh(asked.sides[::step], asked.frames[::step], level, state)
    with suppress(OutOfTime):
        own = _descended(asked, own)
        if own.state.energy.pins is not None and asked.sides[not asked.onto].even is None:
            own = _slid(asked, own, level)
    return own


def _slid(asked: SurfaceProblem, own: OwnMap, level: Level) -> OwnMap:
    """Return the map on one side's own triangles after sliding its boundary until that is stable.

    Corners of the other side's outline are images of vertices, so these vertices cannot slide. The boundary then stays
    where coarser meshes put it, which is not accurate enough if only weak springs control how the map is rotated.
    Therefore vertices slide past the corners, and the mesh is rebuilt with vertices where the corners end up.

    Raises:
        OutOfTime: the time limit was reached.
    """
    step = -1 if asked.onto else 1
    for _ in range(MOST_SLIDES):
        slid = own.state.forward(FINE_POWER, NEWTON_STEPS, final_mesh.LAST_DECREASE_WITH_PINS, corners=False)
        try:
            other = on_own_mesh(asked.sides[::step], asked.frames[::step], level, slid)
        except Stuck:
            break
        other = _descended(asked, other)
        if not other.state.value < (1 - WORTHWHILE_SLIDE_DECREASE) * own.state.value:
            break
        own = other
    return own


def _descended(asked: SurfaceProblem, own: OwnMap) -> OwnMap:
    """Minimize the energy of the map on one side's own triangles, then lower its distortion to the requested bounds.

    Raises:
        OutOfTime: the time limit was reached.
    """
    settings, journal = asked.settings, asked.journal
    other = asked.sides[not asked.onto].even
    if other is None:
        begun, settled = started_coarsely(
            own.state.relaxed(),
            own.of_points(asked.sides[asked.onto].given.patch.points),
            lambda state: final_mesh.descend(state, FINE_POWER, journal),
        )
        if settled and not settings.bounded:
            journal.energies.append(begun.value)
            return replace(own, state=begun)
        return replace(own, state=final_mesh.meet_bounds(begun, settings, journal))
    begun = replace(own.state, ground=ground_of(other, asked.frames[not asked.onto]))
    soft = begun.energy.pins is not None
    decrease = final_mesh.LAST_DECREASE_WITH_PINS if soft else LEAST_DECREASE
    first = begun.forward(1.0, NEWTON_STEPS, decrease)
    journal.energies.append(first.value)
    state = final_mesh.meet_bounds_by(
        lambda state, q: state.forward(q, NEWTON_STEPS, decrease), first, settings
    )
    return replace(own, state=state, energy=first.value)


def _with_rigid(asked: SurfaceProblem, own: OwnMap | None) -> OwnMap:
    """Return the map on the surface's own triangles with its rigid regions.

    Raises:
        InputError: as `rigid.keep_rigid`.
        NoMapError: no map without folds keeps them rigid.
    """
    if own is None:
        raise NoMapError("rigid: found no map without folds that follows the surface's triangles")
    places = own.of_layout(asked.sides[asked.onto].given.flat)
    settings = asked.settings.inverse() if asked.onto else asked.settings
    return rigid.keep_rigid(own, places, asked.regions, settings, asked.journal)


def _repair(state: DiscreteMap, there: Complex, *, mirrored: bool) -> Complex:
    """Return images (n,) in the user's plane after unfolding the few triangles that folded on the way there.

    They are returned as they are if that fails.
    """
    held = np.arange(there.size) < state.constrained
    try:
        found = unfold_in(there.conj() if mirrored else there, state.faces, held, state.u)
    except Stuck:
        return there
    return found.conj() if mirrored else found
