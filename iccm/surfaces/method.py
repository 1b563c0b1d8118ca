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
from ..balanced.model.solution import Solution
from ..balanced.search import final_mesh, multilevel
from ..balanced.search.levels import FINE_POWER, Level
from ..balanced.search.unit_problem import SolvedProblem, UnitProblem
from ..balanced.search.warm_start import continue_from
from ..fit_data import with_details
from ..maps.triangulated.map import TriangulatedMap, without_bulges
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
    surface_problem = SurfaceProblem.of(problem, options, layouts)
    if any(surface_problem.holes.sides) or (start is not None and len(start.loops) > 1):
        start = None
    try:
        solution, exact = _solve(surface_problem, start)
    except NoMapError:  # no map was found, or it folds in the user's planes: try these instead
        surface_problem = surface_problem.as_given
        solution, exact = _solve(surface_problem, start)
    # an exact map is linear on each of the surface's own triangles
    map = without_bulges(solution.map) if exact else fit.straighten_lines(solution.map, solution.lines)
    soft_pins, softness = surface_problem.soft_pins
    solution = replace(solution, soft_pins=soft_pins, softness=softness)
    region_layout = None
    if surface_problem.regions:
        outlines, flat = rigid.laid_by_themselves(
            map,
            surface_problem.sides[surface_problem.onto].given,
            surface_problem.regions,
            of_target=surface_problem.onto,
        )
        solution = replace(solution, rigid=outlines, rigid_of_target=surface_problem.onto)
        region_layout = flat, np.sqrt(surface_problem.sides[1].area / surface_problem.sides[0].area)
    constraints = surface_problem.holes, surface_problem.points
    result = fit.result_of(
        problem,
        solution,
        map,
        constraints,
        surface_problem.options,
        in_bounds=True,
        region_layout=region_layout,
    )
    result = with_details(result, layouts=layouts)
    if surface_problem.regions:
        fit.check_sizes(result, options.rigid_size)
    result.notes.extend(fit.soft_pin_notes(map, soft_pins))
    if not (len(surface_problem.points) or problem.strokes) or all(layouts):
        result.notes.extend(fit.stretch_notes(result.distortion))
    return result


def _from_start(problem: SurfaceProblem, start: TriangulatedMap) -> OwnMap | None:
    """Return the map between two surfaces that an earlier map leads to, on one side's own triangles.

    None with constraints, between other shapes, and where it folds.
    """
    is_constrained = len(problem.points) or problem.strokes or problem.regions
    if is_constrained or not all(side.layout for side in problem.sides):
        return None
    sketch = _sketch(problem, start)
    try:
        return _map_on_own_mesh(problem, sketch.inverse() if problem.onto else sketch)
    except (Stuck, NoMapError):
        return None


def _sketch(problem: SurfaceProblem, start: TriangulatedMap) -> MeshMap:
    """Return an earlier map in unit coordinates."""
    z, u = problem.sides[0].inward(start.source), problem.sides[1].inward(start.image)
    return method.sketch_of(TriangulatedMap(z, u, start.faces, start.loops), problem.to_unit)


def _resume(problem: SurfaceProblem, start: TriangulatedMap) -> DiscreteMap:
    """Return an earlier map with the new constraints satisfied, in unit coordinates."""
    try:
        return continue_from(final_mesh.final_level(problem.unit), _sketch(problem, start))
    except Stuck:
        raise NoMapError("start: cannot continue from this map without folds; leave it out") from None


def _solve(problem: SurfaceProblem, start: TriangulatedMap | None) -> tuple[Solution, bool]:
    """Return the map in the user's planes, and whether it is on the surface's own triangles."""
    similar = _from_similarity(problem) if start is None else _from_start(problem, start)
    if similar is not None and (start is not None or similar.energy < SURE_ENERGY):
        return _own_solution(problem, similar), True
    try:
        if start is None:
            used_problem, state = multilevel.coarse_to_fine(problem.unit, problem.journal)
        else:
            used_problem, state = problem.unit, _resume(problem, start)
    except NoMapError:
        if similar is None:
            raise
        return _own_solution(problem, similar), True
    constraints_met = SolvedProblem(used_problem, state).meets_constraints
    try:
        own_start = _own_start(problem, used_problem, state)
        own_map = None if own_start is None else _map_on_own_mesh(problem, own_start)
    except (Stuck, NoMapError):  # a surface with few triangles may leave no room
        own_map = None
    if problem.regions:
        own_map = _keep_rigid(problem, own_map)
    if similar is not None and (own_map is None or not constraints_met or similar.energy < own_map.energy):
        own_map, constraints_met = similar, True
    if own_map is not None:
        return replace(_own_solution(problem, own_map), met=constraints_met), True
    last = multilevel.whole_map(used_problem, state, problem.journal)
    z, u = (
        side.outward(similarity.pull_back(w), _mark_outer(w, last.outer))
        for side, similarity, w in zip(problem.sides, problem.to_unit, (last.z, last.u))
    )
    return replace(_solution(problem, last, z, u), met=constraints_met), False


def _mark_outer(w: Complex, outer: slice) -> Flags:
    """Mark (n,) the vertices of a map that are on its outer outline."""
    on = np.zeros(w.size, bool)
    on[outer] = True
    return on


def _solution(problem: SurfaceProblem, last: MeshMap, z: Complex, u: Complex) -> Solution:
    """Return the solution for a map with vertices z (n,) and images u (n,) in the user's planes."""
    outlines = problem.sides[0].outlines, problem.sides[1].outlines
    return method.solution_of(
        problem.unit._replace(energy=problem.unit.energy.without_pins()),
        last,
        z,
        u,
        problem.to_unit,
        outlines,
        problem.journal,
        problem.pins,
    )


def _own_solution(problem: SurfaceProblem, own_map: OwnMap) -> Solution:
    """Return a map on a surface's own triangles as a solution in the user's planes."""
    onto, other_side, similarity = (
        problem.onto,
        problem.sides[not problem.onto],
        problem.to_unit[not problem.onto],
    )
    own_places = own_map.of_layout(problem.sides[onto].given.flat)
    other_places = _repair(
        own_map.state,
        other_side.outward(
            similarity.pull_back(own_map.state.u), _mark_outer(own_map.state.u, own_map.state.outer)
        ),
        mirrored=similarity.mirrored,
    )
    if onto:
        return _solution(problem, own_map.state.inverse(), other_places, own_places)
    return _solution(problem, own_map.state, own_places, other_places)


def _own_start(problem: SurfaceProblem, used: UnitProblem, state: DiscreteMap) -> DiscreteMap | None:
    """Return a map of the surface from which the solve on the surface's own triangles starts.

    None where the own triangles cannot be used: with strokes, with pins that were released, and where holes of the
    other side would have to shrink.
    """
    if state.inside.strokes or (not state.bound and state.inside.z.size):
        return None
    if used.inverted == problem.onto:
        return state
    return None if state.filled else state.swap_sides()


def _from_similarity(problem: SurfaceProblem) -> OwnMap | None:
    """Return the map found from a similarity of both layouts; None where they are not alike, or it folds."""
    if not all(side.layout for side in problem.sides):
        return None
    sketch = icp_start.similarity_sketch(problem.unit)
    if sketch is None:
        return None
    try:
        return _map_on_own_mesh(problem, sketch.inverse() if problem.onto else sketch)
    except (Stuck, NoMapError):
        return None


def _map_on_own_mesh(problem: SurfaceProblem, state: MeshMap) -> OwnMap:
    """Return the map on one side's own triangles, from a map whose source is that side.

    Raises:
        Stuck: there is no such map.
    """
    unit_problem = problem.unit.inverse() if problem.onto else problem.unit
    step = -1 if problem.onto else 1
    level = final_mesh.final_level(unit_problem)
    own_map = on_own_mesh(problem.sides[::step], problem.to_unit[::step], level, state)
    with suppress(OutOfTime):
        own_map = _minimize(problem, own_map)
        if own_map.state.energy.pins is not None and problem.sides[not problem.onto].even is None:
            own_map = _slide_boundary(problem, own_map, level)
    return own_map


def _slide_boundary(problem: SurfaceProblem, own_map: OwnMap, level: Level) -> OwnMap:
    """Return the map on one side's own triangles after sliding its boundary until that is stable.

    Corners of the other side's outline are images of vertices, so these vertices cannot slide. The boundary then stays
    where coarser meshes put it, which is not accurate enough if only weak springs control how the map is rotated.
    Therefore vertices slide past the corners, and the mesh is rebuilt with vertices where the corners end up.

    Raises:
        OutOfTime: the time limit was reached.
    """
    step = -1 if problem.onto else 1
    for _ in range(MOST_SLIDES):
        state = own_map.state.forward(
            FINE_POWER, NEWTON_STEPS, final_mesh.LAST_DECREASE_WITH_PINS, corners=False
        )
        try:
            candidate = on_own_mesh(problem.sides[::step], problem.to_unit[::step], level, state)
        except Stuck:
            break
        candidate = _minimize(problem, candidate)
        if not candidate.state.value < (1 - WORTHWHILE_SLIDE_DECREASE) * own_map.state.value:
            break
        own_map = candidate
    return own_map


def _minimize(problem: SurfaceProblem, own_map: OwnMap) -> OwnMap:
    """Minimize the energy of the map on one side's own triangles, then lower its distortion to the requested bounds.

    Raises:
        OutOfTime: the time limit was reached.
    """
    options, journal = problem.options, problem.journal
    other_layout = problem.sides[not problem.onto].even
    if other_layout is None:
        initial, settled = started_coarsely(
            own_map.state.relax(),
            own_map.of_points(problem.sides[problem.onto].given.patch.points),
            lambda state: final_mesh.descend(state, FINE_POWER, journal),
        )
        if settled and not options.has_bounds:
            journal.energies.append(initial.value)
            return replace(own_map, state=initial)
        return replace(own_map, state=final_mesh.meet_bounds(initial, options, journal))
    initial = replace(own_map.state, ground=ground_of(other_layout, problem.to_unit[not problem.onto]))
    soft = initial.energy.pins is not None
    decrease = final_mesh.LAST_DECREASE_WITH_PINS if soft else LEAST_DECREASE
    first = initial.forward(1.0, NEWTON_STEPS, decrease)
    journal.energies.append(first.value)
    state = final_mesh.meet_bounds_by(
        lambda state, q: state.forward(q, NEWTON_STEPS, decrease), first, options
    )
    return replace(own_map, state=state, energy=first.value)


def _keep_rigid(problem: SurfaceProblem, own_map: OwnMap | None) -> OwnMap:
    """Return the map on the surface's own triangles with its rigid regions.

    Raises:
        InputError: as `rigid.keep_rigid`.
        NoMapError: no map without folds keeps them rigid.
    """
    if own_map is None:
        raise NoMapError("rigid: found no map without folds that follows the surface's triangles")
    places = own_map.of_layout(problem.sides[problem.onto].given.flat)
    options = problem.options.inverse() if problem.onto else problem.options
    return rigid.keep_rigid(own_map, places, problem.regions, options, problem.journal)


def _repair(state: DiscreteMap, images: Complex, *, mirrored: bool) -> Complex:
    """Return images (n,) in the user's plane after unfolding the few triangles that folded on the way there.

    They are returned as they are if that fails.
    """
    fixed = np.arange(images.size) < state.constrained
    try:
        unfolded = unfold_in(images.conj() if mirrored else images, state.faces, fixed, state.u)
    except Stuck:
        return images
    return unfolded.conj() if mirrored else unfolded
