"""Balanced maps: piecewise linear homeomorphisms between triangulations of two shapes.

They minimise the symmetric energy of `model.energy`, with boundary vertices that slide on the target's outline.
The search is in `search`; this module converts to unit coordinates and back, and checks the result.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Complex
from ..curve import Curve, closer_outline, hausdorff, interior_grid
from ..errors import InputError
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..plane import Similarity
from ..problem import Holes, Problem
from . import injectivity
from .coarse import CoarseMap
from .constraints.soft import bands_of, patches_of
from .constraints.validate import UNPINNED, Pins, check, put_pins
from .holes.filled import Cut, covering, without_filled
from .holes.given import hole_at, unequal, unit_holes
from .model.boundary_pairs import loops_of
from .model.energy import Energy
from .model.measures import mean_rotation
from .model.mesh_map import MeshMap
from .model.metric import FieldMetric
from .model.solution import Solution, SolveLog
from .model.unit_coordinates import unit_curve, unit_ring, unit_similarities
from .motion import carry_map
from .rigid.given import NO_REGIONS, RigidRegions, aims_of, regions_of
from .rigid.solve import Rigid, is_rigid_similarity, keep_rigid
from .search import multilevel
from .search.final_mesh import excesses
from .search.unit_problem import FINAL_TRIANGLES, UnitProblem

FIELD_SAMPLES = 20_000  # points in the source at which the means of fields are computed


def solve(
    problem: Problem,
    options: Options,
    start: TriangulatedMap | None = None,
    *,
    remesh: bool = False,
    coarse: CoarseMap | None = None,
    triangles: int = FINAL_TRIANGLES,
) -> Solution:
    """Return the balanced map of a problem.

    Unmatched holes of the source shrink to slits, and unmatched holes of the target open from slits.

    Args:
        problem: the domains and constraints. No pin is in a hole, and rigid regions are those of the source.
        options: options of the solver.
        start: an earlier map to start from; its outlines are moved to those of the problem if they differ.
        remesh: whether the start needs a new mesh in any case, because its options were different.
        coarse: a coarse map of the problem without constraints, which is refined.
        triangles: approximate number of triangles of the final mesh.

    Raises:
        NoMapError: no map without folds was found.
        InputError: no one-to-one map meets the pins or strokes, or the start has other holes.
    """
    source, target, pins, strokes = problem.source, problem.target, problem.pins, problem.strokes
    assert target is not None
    holes, fields = problem.holes, (problem.size_map, problem.importance)
    carried = None if start is None else carry_map(start, source, target, holes.sides)
    to_unit = unit_similarities(source, target, options.rotation, holes.sides)
    metric = None
    if any(fields):
        metric = FieldMetric.of(
            to_unit[0], interior_grid(source, FIELD_SAMPLES, [hole.z for hole in holes.source]), *fields
        )
    journal = SolveLog()
    numbers, constraints = problem.pin_numbers, UNPINNED
    if len(pins) or len(strokes):
        constraints = check(source, target, pins, strokes, numbers)
    bands = bands_of(strokes, problem.stroke_widths)
    patches = patches_of(source, target, holes.sides, pins, problem.softness, constraints, numbers, bands)
    energy = Energy.of(options).in_unit(to_unit, None if patches.are_none else patches.unit(to_unit))
    constraints = constraints.without(patches.points[:, 0])
    outlines = unit_curve(to_unit[0], source), unit_curve(to_unit[1], target)
    unit = UnitProblem.of(
        outlines, unit_holes(to_unit, holes), constraints.unit(to_unit), energy, options, metric
    )
    unit = unit._replace(triangles=triangles)
    regions = NO_REGIONS
    if constraints.count or constraints.strokes or start is not None:
        journal.notes += [*unequal(holes), *constraints.notes]
        start_sketch = None if carried is None else sketch_of(carried, to_unit, holes_of(carried, holes))
        state, constraints_met = multilevel.constrained_map(
            unit,
            journal,
            start_sketch,
            remesh=remesh or carried is not start,
            outlines_moved=carried is not start,
        )
    else:
        begun = None if coarse is None else coarse.solved
        state, constraints_met = multilevel.free_map(unit, journal, begun), True
        journal.notes += [*unequal(holes), *constraints.notes]
    if problem.rigid:
        regions = regions_of(problem.rigid, source, holes.source, pins, strokes)
        state = _keep_rigid(state, regions, unit, to_unit[0], journal)
    z, u = _world(state, to_unit)
    domains = (source, *holes.source), (target, *holes.target)
    solution = solution_of(unit, state, z, u, to_unit, domains, journal, constraints)
    return replace(
        solution,
        met=constraints_met,
        rigid=regions.polygons,
        soft_pins=patches.points,
        softness=patches.softness,
    )


def _keep_rigid(
    state: MeshMap,
    regions: RigidRegions,
    given: UnitProblem,
    source_to_unit: Similarity,
    journal: SolveLog,
) -> MeshMap:
    """Return the map changed so that regions are rigid.

    Args:
        state: the map in unit coordinates.
        regions: the regions in the given coordinates.
        given: the problem with its outlines as they are.
        source_to_unit: the similarity from the given to unit coordinates of the source.
        journal: collects energies and notes.

    Raises:
        InputError: the target has more holes than the source, or no similarity maps the pins in a region.
        NoMapError: no map without folds follows the regions' outlines.
    """
    if len(given.holes.target) > len(given.holes.source):
        raise InputError("rigid: the target has more holes than the source; set holes to fill or cut")
    notes, size = list(regions.notes), given.options.rigid_scale
    unit = RigidRegions(
        tuple(tuple(unit_ring(source_to_unit, ring) for ring in rings) for rings in regions.polygons)
    )
    problem = multilevel.simplified(given)
    aims, is_prescribed, pinned_points = aims_of(unit, given.pins, size or 1.0)
    free = ~is_prescribed & (size is None)
    requested = Rigid(
        unit.polygons,
        aims,
        ~is_prescribed & (problem.energy.upright == 0),
        free,
        pinned_points,
        given.options.rigid_size is None,
    )
    if not problem.constrained:
        match = multilevel.find_similarity(given, problem)
        if match is not None:
            similar = multilevel.similarity_map(problem._replace(regions=unit.polygons), match)
            if is_rigid_similarity(similar, requested):
                journal.notes += notes
                return similar
    journal.notes = [note for note in journal.notes if note != multilevel.SIMILAR] + notes
    return keep_rigid(problem, state, requested, journal)


def sketch_of(
    map: TriangulatedMap, to_unit: tuple[Similarity, Similarity], holes: Sequence[tuple[int, int, int]] = ()
) -> MeshMap:
    """Convert a map to unit coordinates, and move the vertices of its outlines to the front.

    Args:
        map: the map in the given coordinates.
        to_unit: the similarities of both sides to unit coordinates.
        holes: (loop of the map, hole of the source, hole of the target) for holes with a partner.
    """
    mirrored = to_unit[0].mirrored
    rims = [map.loops[k][::-1] if mirrored else map.loops[k] for k in (0, *(k for k, _, _ in holes))]
    border = np.concatenate(rims)
    order = np.append(border, np.setdiff1d(np.arange(map.source.size), border))
    faces = np.argsort(order)[map.faces[:, ::-1] if mirrored else map.faces]
    z, u = to_unit[0](map.source)[order], to_unit[1](map.image)[order]
    loops = loops_of([(i, j, rim.size) for (_, i, j), rim in zip(holes, rims[1:])], rims[0].size)
    return MeshMap.plain(z, u, np.ascontiguousarray(faces), border.size, loops=loops)


def _world(state: MeshMap, to_unit: tuple[Similarity, Similarity]) -> tuple[Complex, Complex]:
    return to_unit[0].pull_back(state.z), to_unit[1].pull_back(state.u)


def holes_of(map: TriangulatedMap, holes: Holes) -> list[tuple[int, int, int]]:
    """Match the loops of a map with the holes of both domains.

    Returns:
        (loop, hole of the source, hole of the target) for holes with a partner.

    Raises:
        InputError: the map belongs to domains with other holes, or pairs holes differently than requested.
    """
    matches = []
    for number, loop in enumerate(map.loops[1:], 1):
        i, j = hole_at(map.source[loop], holes.source), hole_at(map.image[loop], holes.target)
        if i >= 0 and j >= 0:
            matches.append((number, i, j))
    if len(matches) < min(len(side) for side in holes.sides) or len(map.loops) - 1 > len(holes.target):
        raise InputError("start: belongs to shapes with other holes; use a map of these shapes")
    partners = {i: j for _, i, j in matches}
    if any(partners.get(i, j) != j for i, j in holes.partners):
        raise InputError("start: pairs the holes differently; use a map with the same pairs of holes")
    return matches


def solution_of(
    problem: UnitProblem,
    state: MeshMap,
    z: Complex,
    u: Complex,
    to_unit: tuple[Similarity, Similarity],
    outlines: tuple[Sequence[Curve], Sequence[Curve]],
    journal: SolveLog,
    pins: Pins,
) -> Solution:
    """Return the solution in the given coordinates, checked there.

    Args:
        problem: the problem in unit coordinates.
        state: its map.
        z: (n,) the map's vertices in the given coordinates.
        u: (n,) their images.
        to_unit: the similarities of both sides to unit coordinates.
        outlines: the outlines of both domains, outer ones first.
        journal: energies and messages of the solve.
        pins: the given pins and strokes.

    Raises:
        NoMapError: rounding, or another flattening of a surface, folds it.
    """
    mirror = to_unit[0].mirrored
    put_pins(pins, z, u, state.border, state.first_pin)
    cut = without_filled(state, mirrored=mirror)
    filled = None if cut.filled is None else (z[cut.filled], u[cut.filled])
    covering_map = None
    if len(cut.faces) < len(state.faces) and filled is None:
        covering_map = covering(state, z, u, mirrored=mirror)
    z, u, loops = z[cut.vertices], u[cut.vertices], cut.loops
    for name, w in (("source", z), ("image", u)):
        injectivity.refuse_folds(name, w, cut.faces)
        injectivity.refuse_touching(name, *(w[loop] for loop in loops))
    gaps = []  # of both sides, relative to the outer outline's diagonal
    for side, (w, curves) in enumerate(zip((z, u), outlines)):
        goals = _goals(cut, filled, w, curves, side)
        gaps.append(max(hausdorff(Curve(rim), curve) / curves[0].diagonal for rim, curve in goals))
    source_gap, gap = gaps
    metrics = state.metrics
    lean = mean_rotation(state.z, state.u, state.material, metrics) * (-1 if mirror else 1)
    rotation = np.angle(np.exp(1j * lean) * to_unit[0].factor / to_unit[1].factor)
    excess = excesses(state.z, state.u, state.material, problem.options, metrics).max()
    return Solution(
        TriangulatedMap(z, u, cut.faces, loops),
        journal.energies,
        reached=bool(max(gap, source_gap) <= problem.options.tolerance and excess <= 1),
        energy=problem.energy.between(state.z, state.u, state.material, metrics),
        rotation=float(rotation),
        gap=gap,
        source_gap=source_gap,
        notes=journal.notes,
        lines=cut.lines,
        partners=cut.partners,
        filled=filled,
        covering_map=covering_map,
    )


def _goals(
    cut: Cut, filled: tuple[Complex, Complex] | None, w: Complex, curves: Sequence[Curve], side: int
) -> Iterator[tuple[Complex, Curve]]:
    """Yield the loops of a map with vertices w, and the outlines on which they should lie.

    The side is 0 for the source, 1 for the target.
    """
    yield closer_outline(w[cut.loops[0]], filled and filled[side], curves[0]), curves[0]
    for loop, partners in zip(cut.loops[1:], cut.partners):
        if partners[side] >= 0:
            yield w[loop], curves[1 + partners[side]]
