"""Deformations: pins and strokes are met without folds, and every part of the shape is as rigid as they permit.

The energy is that of `minimise.energy` over the shape's area only; at balance 1 it is half the symmetric
Dirichlet energy (Smith and Schaefer, *Bijective Parameterization with Free Boundaries*, 2015). The shape is
first moved by the rigid motion that fits its pins best, then deformed on a coarse mesh, and at last on the
final mesh.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Complex, Index
from ...curve import Curve
from ...maps.triangulated.map import TriangulatedMap
from ...maps.triangulated.simple import fault
from ...options import Options
from ...plane import Similarity
from .. import injectivity
from ..constraints.soft import NO_PATCHES, PinnedPatches
from ..constraints.validate import Pins, put_pins, with_points
from ..errors import NoMapError, Stuck
from ..holes.outlines import manageable_holes
from ..meshing.transfer import interpolate
from ..model.discrete_map import DiscreteMap, folds
from ..model.energy import Energy
from ..model.mesh_map import MeshMap
from ..model.outline import manageable
from ..model.solution import Solution
from ..model.unit_coordinates import unit_curve, unit_ring, unit_similarity
from ..rigid.given import NO_REGIONS, RigidRegions, aims_of
from ..rigid.solve import Rigid, harden
from ..search.final_mesh import excesses, meet_bounds_by
from ..search.homotopy import satisfy_constraints
from ..search.levels import EVENED_SHARE
from ..search.pin_continuation import BESIDE, aim_feet
from ..search.unit_problem import FINAL_TRIANGLES
from .mesh import SPACING_MESH_SIZES, mesh_of

COARSE_MESH_SIZE = 0.08  # edge length h, for a domain of area one
TRIANGLES_PER_AREA = 4.0  # number of triangles times h²
MOVING_STEPS, SETTLING_STEPS, SETTLED = 60, 40, 1e-7
"""Most Newton steps while constrained vertices move to their goals, and once they are there, and the relative decrease
of the energy at which both end."""
# Relative to the constraints' spread: below it, the best rotation is undefined, as for mirrored points.
UNROTATED_SPREAD_SHARE = 1e-3
SAME_PLACE_SHARE = 1e-9  # of the root of the area
DEFORMATION_ROUNDS, FORWARD_STEPS, BACKWARD_STEPS, ROUND_DECREASE = 4, 8, 3, 1e-4
"""If strokes slide: rounds of steps, steps on the map and on its inverse, and the relative decrease that ends
them.
"""
MOST_BOUNDARY_VERTICES = 40_000
"""Of a mesh. A shape with more is some 200,000 times as long as wide; the time of triangulation is quadratic in it."""
RELEASE_MESHES = 3  # meshes on which ends of strokes slide


def solve(
    source: Curve,
    pins: Pins,
    options: Options,
    start: TriangulatedMap | None = None,
    holes: Sequence[Curve] = (),
    regions: RigidRegions = NO_REGIONS,
    patches: PinnedPatches = NO_PATCHES,
) -> Solution:
    """Return the deformation of a domain by pins and strokes.

    Args:
        source: its outer outline.
        pins: the pins and strokes; pins on outlines may be on any of them.
        options: options of the solver.
        start: an earlier deformation to start from.
        holes: outlines of its holes, clockwise.
        regions: rigid regions ("bones"), which may rotate; two pins in one determine its similarity.
        patches: the soft ones among the pins; the others are exact.

    Raises:
        NoMapError: the shape cannot be meshed.
        InputError: no similarity maps the pins in a region.
    """
    similarity = unit_similarity(source, holes)
    unit_pins = pins.unit((similarity, similarity))
    to_unit = similarity, similarity
    energy = Energy.of(options).in_unit(to_unit, None if patches.are_none else patches.unit(to_unit))
    outlines = _outlines(
        [unit_curve(similarity, curve) for curve in (source, *holes)], unit_pins.outer[:, 0], options
    )
    try:
        bones = RigidRegions(
            tuple(tuple(unit_ring(similarity, ring) for ring in rings) for rings in regions.polygons)
        )
        levels = refine(
            outlines,
            unit_pins,
            energy,
            options,
            None if start is None else _in_unit(similarity, start),
            bones,
        )
    except Stuck as error:
        raise NoMapError(f"deform: {error}") from None
    return _solution(levels, similarity, pins, options)


def _outlines(curves: Sequence[Curve], points: Complex, options: Options) -> list[Curve]:
    """Return the outlines simplified, with vertices at points on them."""
    distances = [curve.distances(points) for curve in curves]
    nearest = np.argmin(distances, axis=0)
    outer, *holes = (with_points(curve, points[nearest == k]) for k, curve in enumerate(curves))
    anchors = [tuple(points[nearest == k].tolist()) for k in range(len(curves))]
    simple = manageable(outer, options.tolerance, anchors[0])
    return [simple, *manageable_holes(simple, holes, options.tolerance, anchors[1:])]


def refine(
    outlines: Sequence[Curve],
    pins: Pins,
    energy: Energy,
    options: Options,
    start: MeshMap | None,
    bones: RigidRegions = NO_REGIONS,
) -> list[DiscreteMap]:
    """Return the deformation on successive meshes, the last one fine."""
    size, energy = np.sqrt(TRIANGLES_PER_AREA / FINAL_TRIANGLES), energy.without_rotation()
    vertices = sum(outline.length for outline in outlines) / (SPACING_MESH_SIZES * size)
    if vertices > MOST_BOUNDARY_VERTICES:
        raise NoMapError(
            f"deform: the shape is too thin: its mesh needs {vertices:.0f} boundary vertices, more than "
            f"{MOST_BOUNDARY_VERTICES}; make it wider, or deform a part of it (file#part)"
        )
    levels = []
    if start is None:
        levels = [roughly(outlines, pins, energy, max(COARSE_MESH_SIZE, size))]
        rough = levels[0].forward(1.0, FORWARD_STEPS, SETTLED, corners=False) if pins.strokes else levels[0]
        start, matches = rough, rough.inside.matches
    else:
        matches = aim_feet(
            pins.strokes, start_from(mesh_of(outlines, pins, energy, size), start), EVENED_SHARE
        ).inside.matches
    fine = start_from(mesh_of(outlines, pins, energy, size, matches, bones.polygons), start)
    levels.append(relax(satisfy_constraints(fine, MOVING_STEPS, SETTLED), 1.0))
    if bones.polygons:
        levels.append(stiffen(levels[-1], bones, pins))
    levels.append(meet_bounds_by(relax, levels[-1], options, scale_of))
    return levels


def stiffen(state: DiscreteMap, bones: RigidRegions, pins: Pins) -> DiscreteMap:
    """Return the map with rigid bones."""
    aims, is_prescribed, pinned_points = aims_of(bones, pins.inner, 1.0)
    rigid = Rigid(bones.polygons, aims, ~is_prescribed, np.zeros(is_prescribed.size, bool), pinned_points)
    return harden(state, rigid, state.value)


def roughly(outlines: Sequence[Curve], pins: Pins, energy: Energy, size: float) -> DiscreteMap:
    """Return the deformation on a coarse mesh; ends of strokes that slide pass corners when the mesh is renewed."""
    state = aim_feet(pins.strokes, rigid_motion(mesh_of(outlines, pins, energy, size)), BESIDE)
    state = relax(satisfy_constraints(state, MOVING_STEPS, SETTLED), 1.0)
    for _ in range(RELEASE_MESHES if any(not all(stroke.sticks) for stroke in pins.strokes) else 0):
        freed = state.forward(1.0, FORWARD_STEPS, SETTLED, corners=False)
        new = start_from(mesh_of(outlines, pins, energy, size, freed.inside.matches), freed)
        new = relax(satisfy_constraints(new, MOVING_STEPS, SETTLED), 1.0)
        if new.miss > 0 or new.value > (1 - ROUND_DECREASE) * state.value:
            break
        state = new
    return state


def scale_of(state: DiscreteMap) -> float:
    """Return the mean scale of the deformation."""
    return float(np.sqrt(abs(sum(Curve(state.u[loop]).area for loop in state.boundary.slices))))


def start_from(state: DiscreteMap, start: MeshMap) -> DiscreteMap:
    """Return the mesh with the images of an earlier map; if these fold, with a rigid motion."""
    try:
        return transfer(state, start)
    except Stuck:
        return rigid_motion(state)


def rigid_motion(state: DiscreteMap) -> DiscreteMap:
    """Return the shape moved by the rotation and translation that fit the constraints best."""
    sources, goals = state.z[state.aimed], state.goals
    if state.energy.pins is not None:
        sources = np.append(sources, state.energy.pins.source)
        goals = np.append(goals, state.energy.pins.target)
    rotation = np.vdot(sources - sources.mean(), goals - goals.mean())
    rotation = (
        rotation / abs(rotation)
        if abs(rotation) > UNROTATED_SPREAD_SHARE * np.sum(np.abs(sources - sources.mean()) ** 2)
        else 1.0
    )
    return replace(state, u=goals.mean() + rotation * (state.z - sources.mean()))


def relax(state: DiscreteMap, q: float) -> DiscreteMap:
    """Return the converged map.

    Constraints that have not met their goals stay where they are, and vertices of strokes slide.
    """
    goals = state.goals
    relaxed = state if state.miss == 0 else state.hold_in_place()
    relaxed = relaxed.forward(q, SETTLING_STEPS, SETTLED)
    for _ in range(DEFORMATION_ROUNDS if state.inside.strokes else 0):
        previous = relaxed.value
        relaxed = relaxed.backward(q, BACKWARD_STEPS, SETTLED).forward(q, FORWARD_STEPS, SETTLED)
        if previous - relaxed.value < ROUND_DECREASE * previous:
            break
    return relaxed if state.miss == 0 else relaxed.with_goals(goals)


def transfer(state: DiscreteMap, start: MeshMap) -> DiscreteMap:
    """Return a map on the mesh of `state` that agrees with `start`, another map of the same shape.

    Images are copied if both meshes are the same, and interpolated otherwise.

    Raises:
        Stuck: folds remain.
    """
    is_same_mesh = start.z.size == state.z.size and len(start.faces) == len(state.faces)
    is_same_mesh = is_same_mesh and np.abs(start.z - state.z).max() < SAME_PLACE_SHARE
    is_same_mesh = is_same_mesh and np.array_equal(_sorted(start.faces), _sorted(state.faces))
    u = start.u.copy() if is_same_mesh else interpolate(start.z, start.faces, start.u, state.z)
    mapped = replace(state, u=u)
    if not folds(mapped.faces, mapped.u):
        return mapped
    return mapped.hold_in_place().unfold_locally().with_goals(mapped.goals)


def _sorted(faces: Index) -> Index:
    return faces[np.lexsort(faces.T)]


def _in_unit(similarity: Similarity, start: TriangulatedMap) -> MeshMap:
    """Return an earlier deformation in unit coordinates."""
    border = sum(loop.size for loop in start.loops)
    return MeshMap.plain(similarity(start.source), similarity(start.image), start.faces, border)


def _solution(levels: list[DiscreteMap], similarity: Similarity, pins: Pins, options: Options) -> Solution:
    """Return the map in the given coordinates, checked there."""
    state = levels[-1]
    z, u = similarity.pull_back(state.z), similarity.pull_back(state.u)
    put_pins(pins, z, u, state.border, state.first_pin)
    loops = tuple(np.arange(state.border)[rim] for rim in state.boundary.slices)
    injectivity.refuse_folds("source", z, state.faces)
    injectivity.refuse_folds("image", u, state.faces)
    injectivity.refuse_touching("source", *(z[loop] for loop in loops))
    images = [u[loop] for loop in loops]
    simple = injectivity.is_simple(images[0]) and not (len(images) > 1 and fault(images))
    over = excesses(state.z, state.u / scale_of(state), state.faces, options)
    return Solution(
        TriangulatedMap(z, u, state.faces, loops),
        [level.value for level in levels],
        reached=bool(over.max() <= 1),
        met=state.miss == 0,
        simple=simple,
        lines=state.lines,
    )
