"""The final map of a surface, on its own triangles: its vertices become texture coordinates without folds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..balanced.errors import Stuck, Tangled
from ..balanced.meshing.transfer import interpolate
from ..balanced.model.boundary import MatchedBoundary
from ..balanced.model.boundary_pairs import loops_of
from ..balanced.model.discrete_map import FILLED, PASSED_OVER, DiscreteMap
from ..balanced.model.inner_constraints import InnerConstraints
from ..balanced.model.mesh_map import MeshMap
from ..balanced.model.outline import Outline
from ..balanced.search.levels import Level, match_on
from ..balanced.search.unit_problem import UnitProblem
from ..curve import Curve
from ..flattening.scaffold import filling
from ..linalg.cholesky import system_of
from ..meshes.mesh import face_areas
from ..meshes.stretch import Linear, laid_flat, linear
from ..plane import Similarity, cross, triangle_areas
from .own_metric import OwnMetric
from .refined import RefinedSurface
from .side import Side

UNFOLDING_STEPS, POLISHING_STEPS = 200, 30  # steps at most: a bunny with holes takes over 40
ROOM_HALVINGS = 4  # times that triangles around folds are halved at most: each makes four times as many
THIN_AREA_RATIO = 0.1  # of the mean area: triangles at the boundary with less are moved, too
COARSE_TRIANGLES = 4000
"""Edges of surfaces with fewer triangles are halved, which lowers median errors by 20 to 40 %."""
SAME_PLACE_SHARE = 1e-9  # of the length: arclengths that differ by less are the same place


@dataclass(frozen=True, eq=False)
class OwnMap:
    """A map on a surface's own triangles.

    Attributes:
        state: the map in unit coordinates; the surface is the source.
        mesh: the triangles in the surface's numbering.
        order: (n,) the mesh's vertex behind each vertex of the map.
        energy: for a map between surfaces, the energy before its worst stretch was lowered.
    """

    state: DiscreteMap
    mesh: RefinedSurface
    order: Index
    energy: float = np.inf

    def near(self, hit: Flags) -> Flags:
        """Mark (n,) the mesh's vertices in triangles that share a vertex with the map's triangles `hit` (m,)."""
        faces = self.state.faces
        is_adjacent = np.isin(faces, faces[hit]).any(axis=1)
        marks = np.zeros(self.mesh.count, bool)
        marks[self.order[faces[is_adjacent]]] = True
        return marks

    def of_layout(self, flat: Complex) -> Complex:
        """Interpolate values at the layout's vertices to the vertices of the map."""
        return self.mesh.carried(flat)[self.order]

    def of_points(self, points: Real) -> Real:
        """Interpolate points (p, 3) of the surface's vertices in space to the vertices of the map."""
        return self.mesh.carried(points)[self.order]


def on_own_mesh(
    sides: Sequence[Side],
    to_unit: Sequence[Similarity],
    level: Level,
    state: MeshMap,
) -> OwnMap:
    """Return a map without folds on the surface's own triangles, from a map on any mesh.

    Args:
        sides: the surface, which is the source of the map, and the target.
        to_unit: the similarities to their unit coordinates.
        level: what is solved, with the surface as source. All vertices of surfaces are added to its outlines.
        state: the map so far.

    Raises:
        Stuck: no such map was found.
    """
    source_holes, problem = [loop.source for loop in state.loops], level.problem
    loops, rims = _rims(sides[0], to_unit[0], source_holes, (problem.source, problem.holes.source))
    loops = [np.roll(loop, -rim.first) for loop, rim in zip(loops, rims)]
    exact_level = _with_exact(level, rims, source_holes, target=False)
    if sides[1].even is not None:  # a vertex that hardly matters in one layout may matter in another
        target_holes = [loop.target for loop in state.loops]
        _, target_rims = _rims(sides[1], to_unit[1], target_holes, (problem.target, problem.holes.target))
        exact_level = _with_exact(exact_level, target_rims, target_holes, target=True)
    exact_level = _reanchor(exact_level)
    boundary = exact_level.boundary(match_on(exact_level, state), fewest=1)
    return _mesh(sides[0], to_unit[0], state, problem, boundary, loops)


@dataclass(frozen=True, eq=False)
class _ExactOutline:
    """An outline through all vertices of a layout, and which of them is the first of the problem's outline."""

    outline: Outline
    first: int


def _outline_of(z: Complex, simple: Curve) -> _ExactOutline:
    """Return the outline through all vertices z (n,), parametrized like `simple`.

    `simple` has some of these vertices, and other points on edges between them.
    """
    first = int(np.argmin(np.abs(z - simple.z[0])))
    z = np.roll(z, -first)
    nearest = [int(np.argmin(np.abs(z - w))) for w in simple.z]
    on = np.abs(z[nearest] - simple.z) < SAME_PLACE_SHARE * simple.length
    nearest_on = np.array(nearest)[on]
    if (np.diff(nearest_on) <= 0).any():
        raise Stuck("the outline of the surface touches itself")
    curve = Curve(z)
    knots, exact_knots = simple.knots[:-1][on], np.append(curve.knots[nearest_on], curve.length)
    origins = np.interp(curve.knots, exact_knots, np.append(knots, simple.length))
    return _ExactOutline(Outline(curve, curve.knots[:-1], origins), first)


def _rims(
    side: Side, similarity: Similarity, holes: list[int], simple: tuple[Curve, Sequence[Curve]]
) -> tuple[list[Index], list[_ExactOutline]]:
    """Return a surface's loops and exact outlines in unit coordinates: the outer ones, and those of `holes` (numbers).

    `simple` holds the outlines of the problem, in the same coordinates.
    """
    flat, outlines = similarity(side.solver_layout.flat), [simple[0], *(simple[1][k] for k in holes)]
    loops = [side.loops[k] for k in (0, *(1 + k for k in holes))]
    loops = [loop[::-1] if similarity.mirrored else loop for loop in loops]
    return loops, [_outline_of(flat[loop], curve) for loop, curve in zip(loops, outlines)]


def _with_exact(level: Level, rims: list[_ExactOutline], numbers: list[int], *, target: bool) -> Level:
    """Return the level with a surface's exact outlines as its source or target, and as its holes `numbers`."""
    hole_outlines = [list(holes) for holes in level.holes]
    for hole, rim in zip(numbers, rims[1:]):
        hole_outlines[target][hole] = rim.outline
    level = replace(level, holes=(tuple(hole_outlines[0]), tuple(hole_outlines[1])))
    exact = rims[0].outline
    return replace(level, target=exact) if target else replace(level, source=exact)


def _reanchor(level: Level) -> Level:
    """Return the level with pins on outlines placed anew, since the outlines have changed."""
    if level.anchors is None:
        return level
    s = level.source.curve.closest(np.array(level.problem.anchors[0]))
    order = np.argsort(s)
    tau = level.target.arclengths(level.problem.anchors[1])[order]
    tau = tau[0] + np.mod(tau - tau[0], level.target.length)
    return replace(level, anchors=level.anchors._replace(s=s[order], tau=tau))


def _mesh(
    side: Side,
    similarity: Similarity,
    state: MeshMap,
    problem: UnitProblem,
    boundary: MatchedBoundary,
    loops: list[Index],
) -> OwnMap:
    """Build the mesh with the given boundary, and the map on it; where triangles have no room, they are made smaller.

    `loops` are the surface's own vertices along each outline.
    """
    closing = [side.loops[1 + loop.source] for loop in state.filled]
    mesh, weights = _cover_holes(side, closing)
    mesh, pinned = _with_pins(mesh, side, similarity.pull_back(problem.pins[:, 0]))
    fixed = np.zeros(mesh.count, bool)
    fixed[np.concatenate([*loops, pinned])] = True
    mesh, rim = _with_boundary(mesh.without_chords(fixed), loops, boundary)
    if problem.metrics[1] is not None and len(mesh.faces) < COARSE_TRIANGLES:
        mesh = mesh.without_chords(np.ones(mesh.count, bool))
    builder = _MapBuilder(side, similarity, problem, boundary, [rim, pinned, *closing])
    for rounds in reversed(range(ROOM_HALVINGS)):
        own_map = builder.map(mesh, weights[mesh.original], state)
        try:
            return replace(own_map, state=_relax_slivers(_unfold(own_map.state, harmonic=not rounds)))
        except Tangled as error:
            if not rounds:
                raise
            mesh = mesh.without_chords(own_map.near(triangle_areas(error.u[own_map.state.faces]) <= 0))
    raise AssertionError


class _MapBuilder(NamedTuple):
    """Data that stay the same while triangles are made smaller.

    `first` lists the vertices of the boundary, of pins, and of the holes to be filled.
    """

    side: Side
    similarity: Similarity
    problem: UnitProblem
    boundary: MatchedBoundary
    first: list[Index]

    def map(self, mesh: RefinedSurface, weights: Real, state: MeshMap) -> OwnMap:
        """Return the map so far on a mesh; it may have folds."""
        side, similarity, boundary, (rim, pinned) = self.side, self.similarity, self.boundary, self.first[:2]
        first = np.concatenate(self.first)
        order = np.append(first, np.setdiff1d(np.arange(mesh.count), first))
        faces = np.argsort(order)[mesh.faces]
        z = similarity(mesh.carried(side.solver_layout.flat)[order])
        material, constrained = weights == 1, rim.size + pinned.size
        maps = _to_surface(mesh, side, material, z[faces], mirrored=similarity.mirrored)
        faces = np.ascontiguousarray(faces[:, ::-1] if similarity.mirrored else faces)
        following = np.append(boundary.following, np.arange(rim.size, constrained))
        unpaired = [(loop.source, -1, vertices.size) for loop, vertices in zip(state.filled, self.first[2:])]
        pins = np.column_stack([z[rim.size : constrained], self.problem.pins[:, 1]])
        u = interpolate(state.z, state.faces, state.u, z)
        u[: rim.size] = boundary.images()
        discrete_map = DiscreteMap(
            faces,
            z,
            u,
            boundary=boundary.with_filled(loops_of(unpaired, constrained)),
            pattern=system_of(faces, following, z.size),
            inside=InnerConstraints.of_pins(pins),
            bound=pinned.size > 0,
            weights=None if material.all() else weights,
            metrics=(OwnMetric(maps, material), self.problem.metrics[1]),
        ).with_energy(self.problem.energy.without_rotation())
        return OwnMap(discrete_map, mesh, order)


def _cover_holes(side: Side, closing: list[Index]) -> tuple[RefinedSurface, Real]:
    """Return the surface with triangles in the holes `closing` and in ignored holes, and all triangles' weights."""
    patch = side.given.patch
    kinds = [FILLED] * len(closing) + [PASSED_OVER] * len(side.passed_over)
    fills = [filling(side.given.flat, loop) for loop in (*closing, *side.passed_over)]
    weights = np.repeat([1.0, *kinds], [len(patch.faces), *map(len, fills)])
    return RefinedSurface.of(np.concatenate([patch.faces, *fills]), len(patch.points)), weights


def _unfold(map: DiscreteMap, *, harmonic: bool) -> DiscreteMap:
    """Remove folds from a map: first those at the boundary and pins locally, if that fails all at once.

    Args:
        map: the map.
        harmonic: whether the last attempt may start from the harmonic map.

    Raises:
        Tangled: folds remain.
    """
    map = map.move_to_border(map.u)
    try:
        return map.unfold_locally(
            polish=POLISHING_STEPS,
            steps=UNFOLDING_STEPS,
            weighed=True,
            thin=THIN_AREA_RATIO,
            most=1.0,
        )
    except Tangled:
        if not harmonic:
            raise
        return map.unfold_from_harmonic(polish=POLISHING_STEPS, steps=UNFOLDING_STEPS, weighed=True)


def _relax_slivers(map: DiscreteMap) -> DiscreteMap:
    """Use the shapes that triangles in holes have in the image as their rest shapes: in the source they are slivers."""
    metric = map.metrics[0]
    assert isinstance(metric, OwnMetric)
    if metric.material.all():
        return map
    content = linear(map.z[map.faces], map.u[map.faces])
    maps = Linear(
        *(np.where(metric.material, original, image) for original, image in zip(metric.maps, content))
    )
    return replace(map, metrics=(OwnMetric(maps, metric.material), map.metrics[1]))


def _with_pins(mesh: RefinedSurface, side: Side, places: Complex) -> tuple[RefinedSurface, Index]:
    """Return the mesh with vertices at points (k,) of the even layout, and the numbers of these vertices."""
    numbers = []
    for z in places:
        flat = mesh.carried(side.solver_layout.flat)
        mesh, number = mesh.with_point(*_holding(flat[mesh.faces], z))
        numbers.append(number)
    if len(set(numbers)) < len(numbers):
        raise Stuck("pins: two pins are on the same vertex; remove one of them")
    return mesh, np.array(numbers, np.int64)


def _holding(corners: Complex, z: complex) -> tuple[int, Real]:
    """Return the triangle of (m, 3) that contains a point, and the point's barycentric coordinates (3,).

    By rounding a point may lie in no triangle. Then it is the one whose least coordinate is largest, and coordinates
    are clipped at 0.
    """
    a, b, c = (corners - z).T
    areas = np.array([cross(p, q) for p, q in ((b, c), (c, a), (a, b))])
    shares = areas / areas.sum(axis=0)
    face = int(np.argmax(shares.min(axis=0)))
    return face, np.maximum(shares[:, face], 0)


def _with_boundary(
    mesh: RefinedSurface, loops: list[Index], boundary: MatchedBoundary
) -> tuple[RefinedSurface, Index]:
    """Return the mesh with all vertices (b,) of the boundary inserted on its loops, and their numbers in order."""
    s = boundary.pairs.s
    rim = np.empty(s.size, np.int64)
    tails, heads, new = ([np.empty(0, np.int64)] for _ in range(3))
    shares = [np.empty(0)]
    for loop, (outline, _, part) in zip(loops, boundary.loops):
        edge, share = outline.curve.locate(s[part])
        length = outline.curve.lengths[edge]
        at_head = (1 - share) * length < SAME_PLACE_SHARE * outline.length
        edge, share = np.where(at_head, edge + 1, edge) % loop.size, np.where(at_head, 0, share)
        on = share * length < SAME_PLACE_SHARE * outline.length
        rim[part][on] = loop[edge[on]]
        between = np.flatnonzero(~on)
        new.append(part.start + between)
        tails.append(loop[edge[between]])
        heads.append(loop[(edge[between] + 1) % loop.size])
        shares.append(share[between])
    places = np.concatenate(new)
    rim[places] = mesh.count + np.arange(places.size)
    tail, head = np.concatenate(tails), np.concatenate(heads)
    return mesh.with_points_on(tail, head, np.concatenate(shares)), rim


def _to_surface(mesh: RefinedSurface, side: Side, material: Flags, z: Complex, *, mirrored: bool) -> Linear:
    """Return the linear maps from triangles z (m, 3) to the surface.

    Triangles in holes are not on the surface; their rest shapes are those in the user's plane.
    """
    space, flat = mesh.carried(side.given.patch.points), mesh.carried(side.given.flat)
    rest_corners = flat[mesh.faces]
    rest_corners[material] = laid_flat(space[mesh.faces[material]])
    scale = 1 / np.sqrt(face_areas(space[mesh.faces[material]]).sum())
    return linear(z, scale * (rest_corners.conj() if mirrored else rest_corners))
