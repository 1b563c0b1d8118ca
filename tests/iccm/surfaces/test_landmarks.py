"""Meshes of the same surface mapped onto each other, with a known inverse; protrusions are not lost, and cuts agree."""

from dataclasses import replace
from itertools import pairwise, permutations

import igl
import numpy as np
import pytest
from scipy.spatial import Delaunay

import iccm
from iccm.arrays import xy_of
from iccm.balanced.minimise.energy import Objective
from iccm.balanced.minimise.in_space import assemble_in_space, total_in_space
from iccm.balanced.minimise.sliding import border_energy
from iccm.balanced.minimise.unfold import unfold_in
from iccm.balanced.model.energy import WITHOUT_ROTATION, Energy
from iccm.balanced.model.metric import LaidMetric
from iccm.balanced.model.unit_coordinates import unit_curve, unit_similarity
from iccm.balanced.search import multilevel
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.flattening import even_layout, flatten
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job
from iccm.io.shapes import constraints
from iccm.io.shapes.listing import ConstraintsFile, PinEntry
from iccm.meshes.cut import cut_through
from iccm.meshes.disk_patch import disk_patch, nearest, sound_piece
from iccm.meshes.geodesics import GeodesicGraph
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import Mesh, face_areas
from iccm.plane import triangle_areas
from iccm.status import Status
from iccm.surfaces import icp_start, seams, trilateration
from iccm.surfaces.ground import ground_of
from iccm.surfaces.inserted import with_vertices
from iccm.surfaces.refined import RefinedSurface
from tests.triangulations import hull, spiral_points

HORNS = np.array([0.45, -0.25 + 0.4j, -0.3 - 0.35j])


def horned(n, seed):
    """A disc with three horns, on about n points at random places."""
    rng = np.random.default_rng(seed)
    z = np.sqrt(rng.uniform(0, 0.97, n)) * np.exp(2j * np.pi * rng.uniform(size=n))
    around = HORNS[rng.integers(3, size=n)] + 0.17 * (rng.standard_normal(n) + 1j * rng.standard_normal(n))
    z = np.concatenate([z, around[np.abs(around) < 0.97], np.exp(2j * np.pi * np.arange(80) / 80)])
    faces = Delaunay(xy_of(z)).simplices
    a, b, c = z[faces.T]
    turned = ((b - a).conj() * (c - a)).imag < 0
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    height = sum(0.9 * np.exp(-(np.abs(z - horn) ** 2) / 0.02) for horn in HORNS)
    return Mesh.triangles("horned", np.column_stack([z.real, z.imag, height]), faces)


def capsule(n, long=3.0):
    """A closed, rounded cylinder along z."""
    unit = spiral_points(n)
    high = unit[:, 2]
    width = np.minimum(1, 2.2 * np.sqrt(1 - np.abs(high)) / np.sqrt(1 - high**2).clip(1e-9))[:, None]
    return Mesh.triangles("capsule", unit * (1, 1, long) * width ** (1, 1, 0), hull(unit))


def away(fit, source, target):
    """Distances in space, relative to the diagonal, of the target's vertices from their preimages."""
    z = fit.inverse(target.flat)
    face, weights = Locator(source)(z, 1)
    came = np.einsum("pk,pkc->pc", weights, source.patch.points[source.patch.faces[face]])
    size = np.linalg.norm(np.ptp(target.patch.points, axis=0))
    return np.linalg.norm(came - target.patch.points, axis=1) / size


def on_rim(layout, step):
    """Every step-th point of the boundary, in order."""
    return layout.flat[np.argsort(layout.patch.vertex)[-80::step]]


LIMBS = np.array([[1, 0, 0.2], [-6, 8, 0], [-5, -7, 5], [1, 3, 10], [2, -2, -10], [3, 9, -4.0]])
LIMBS /= np.linalg.norm(LIMBS, axis=1, keepdims=True)


def limbed(n):
    """A closed surface with six protrusions."""
    unit = spiral_points(n)
    distance = np.linalg.norm(unit[:, None] - LIMBS, axis=2)
    return Mesh.triangles(
        "limbed", unit * (1 + 0.9 * np.exp(-(distance**2) / 0.08).sum(axis=1))[:, None], hull(unit)
    )


def written(mesh, path):
    """Write a mesh to a file, and return its path."""
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in mesh.points.tolist()))
    with path.open("a") as file:
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in (mesh.corners.reshape(-1, 3) + 1).tolist())
    return str(path)


@pytest.mark.slow
def test_meshes_of_few_triangles_go_onto_each_other_by_landmarks(tmp_path):
    meshes = limbed(160), limbed(320)
    source, target = (written(mesh, tmp_path / f"{k}.obj") for k, mesh in enumerate(meshes))
    points = meshes[1].points
    tips = [int(np.argmax(points @ limb)) for limb in LIMBS]
    pins = [(tuple(points[tip].tolist()), f"v{tip + 1}") for tip in tips]
    inputs = Inputs(Job(source=source, target=target, pin=pins, cut=True))
    source_shape, target_shape = inputs.shape(source), inputs.shape(target, target=True)
    marks = constraints.collect(
        source_shape, target_shape, ConstraintsFile(pins=[PinEntry(source=a, target=b) for a, b in pins])
    ).pins
    fit = iccm.fit(source_shape.domain, target_shape.domain, pins=marks)
    assert fit.status is Status.REACHED
    apart = away(fit, *fit.details.layouts)
    assert np.median(apart) < 0.008  # 0.0165 with cuts along the edges, and no more triangles
    assert np.quantile(apart, 0.95) < 0.035


@pytest.mark.parametrize("n", [160, 400])
def test_distances_are_geodesic(n):
    whole = sound_piece(capsule(n))
    fine, stops = trilateration.subdivide(whole.points, whole.faces), np.array([0, n // 3])
    distances = trilateration.distances(fine, fine.carried(whole.points), stops)[:n]
    none, faces = np.zeros(0, np.int64), np.ascontiguousarray(whole.faces)
    exact = [
        igl.exact_geodesic(whole.points, faces, stops[k : k + 1], none, np.arange(n), none) for k in (0, 1)
    ]
    exact = np.column_stack(exact) / np.sqrt(face_areas(whole.points[whole.faces]).sum())
    assert (distances > exact - 1e-9).all()
    assert np.median(distances - exact) < 0.005


def test_distances_on_flat_triangles_are_those_in_the_plane():
    """For a cube whose triangles were halved before."""
    x, y, z = np.indices((2, 2, 2)).reshape(3, -1)
    corners = np.column_stack([x, y, z]).astype(float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    once = trilateration.subdivide(corners, faces)
    points = once.carried(corners)
    again = trilateration.subdivide(points, once.faces)
    places = again.carried(points)
    distances = trilateration.distances(again, places, np.array([0]))[:, 0] * np.sqrt(6)
    on_sides = places.min(axis=1) == 0  # on the three sides around the first corner
    straight = np.linalg.norm(places, axis=1)[on_sides]
    np.testing.assert_allclose(distances[on_sides], straight, rtol=0.02)
    assert (distances[~on_sides] > np.linalg.norm(places, axis=1)[~on_sides] + 0.01).all()


def subdivided():
    """A polyhedron with its triangles halved twice, on which libigl's exact geodesics from vertex 28 never end."""
    corners = [
        (-1, 1, 2),
        (-1, 2, -1),
        (-2, 3, -3),
        (-1, -2, -3),
        (1, -1, -1),
        (-2, -2, -3),
        (0, 0, 2),
        (-2, 2, -3),
    ]
    points = np.array([*corners, (-3, 0, 0)], float)
    faces = ["324", "028", "237", "421", "201", "573", "825", "275", "416", "610", "634", "653", "608", "856"]
    fine = RefinedSurface.of(np.array([[int(v) for v in face] for face in faces]), len(points))
    for _ in range(2):
        fine = fine.without_chords(np.ones(fine.count, bool))
    return sound_piece(Mesh.triangles("subdivided", fine.carried(points), fine.faces))


def test_geodesics_on_flat_subdivided_faces_end():
    whole, stops = subdivided(), np.array([28, 4])
    distances = GeodesicGraph.of(whole.points, whole.triangles).distances(stops)[:, : len(whole.points)]
    fine = trilateration.subdivide(whole.points, whole.faces)
    continuous = trilateration.distances(fine, fine.carried(whole.points), stops)[: len(whole.points)].T
    area = face_areas(whole.points[whole.faces]).sum()
    np.testing.assert_allclose(distances / np.sqrt(area), continuous, rtol=0.01, atol=1e-12)
    np.testing.assert_allclose(distances[0, 4], distances[1, 28])
    cut = cut_through(whole, [28, 4, 0])
    assert len(cut.loops) == 1 and not cut.genus
    across = sum(distances[k, end] for k, end in ((0, 4), (1, 0)))
    assert across - 1e-9 < cut.seam_length * np.sqrt(area) < 1.3 * across


@pytest.mark.parametrize("n", [160, 3000])
def test_paths_between_points_on_edges_are_nearly_geodesic(n):
    whole, stops = sound_piece(limbed(n)), np.array([0, n // 3])
    distances = GeodesicGraph.of(whole.points, whole.triangles).distances(stops)[:, :n]
    none, faces = np.zeros(0, np.int64), np.ascontiguousarray(whole.faces)
    exact = np.array(
        [igl.exact_geodesic(whole.points, faces, stops[[k]], none, np.arange(n), none) for k in (0, 1)]
    )
    assert (distances > exact - 1e-9).all()
    assert (distances - exact).mean() < 0.003 * exact.mean() and (distances < 1.015 * exact + 1e-12).all()


@pytest.mark.slow
def test_horns_go_onto_horns_without_landmarks_on_them():
    source, target = (flatten(disk_patch(horned(*how))) for how in ((500, 1), (900, 2)))
    rims = [on_rim(even_layout(layout), 20) for layout in (source, target)]
    assert icp_start.unlikeness(even_layout(source).boundary, even_layout(target).boundary, *rims) < 0.05
    fit = iccm.fit(source, target, pins=np.column_stack([on_rim(layout, 40) for layout in (source, target)]))
    assert fit.status.ok
    misses = away(fit, source, target)
    assert np.median(misses) < 0.01
    assert np.quantile(misses, 0.95) < 0.03


@pytest.fixture(scope="module")
def shaken():
    """A map of a surface onto a copy on its own triangles, with inner vertices displaced."""
    source, target = (even_layout(flatten(disk_patch(horned(*how)))) for how in ((120, 3), (200, 4)))
    frames = [unit_similarity(layout.boundary) for layout in (source, target)]
    curves = [unit_curve(frame, layout.boundary) for frame, layout in zip(frames, (source, target))]
    metrics = tuple(LaidMetric.of(layout, frame) for layout, frame in zip((source, target), frames))
    problem = UnitProblem(*curves, WITHOUT_ROTATION, metrics=metrics)
    level = multilevel.Level.of(problem, 0.08, 1e-3, 1e-3, 20.0)
    match = icp_start._interpolate(*curves, (curves[0].z[:1], curves[1].z[[0]]))
    state = level.mapped(match).unfold_from_harmonic()
    return replace(state, ground=ground_of(target, frames[1]))


def test_the_gradient_in_space_is_that_of_the_energy(shaken):
    rest_shapes, surface = replace(shaken, energy=Energy(0.8, 0.0))._in_space(shaken.ground)
    objective, matrix = Objective.of(0.8, 1.0), np.empty((shaken.pattern.columns.size, 4))
    gradient = np.empty(shaken.u.size, complex)
    value = assemble_in_space(rest_shapes, surface, shaken.u, objective, matrix, gradient)
    assert value == pytest.approx(total_in_space(rest_shapes, surface, shaken.u, objective))
    step = 1e-7
    for v in np.random.default_rng(1).integers(shaken.border, shaken.u.size, 12):
        differences = []
        for direction in (1, 1j):
            ends = [shaken.u + sign * step * direction * (np.arange(shaken.u.size) == v) for sign in (1, -1)]
            differences.append(
                np.subtract(*(total_in_space(rest_shapes, surface, u, objective) for u in ends)) / (2 * step)
            )
        scale = 1e-4 * max(1, abs(gradient[v]))
        assert abs(complex(*differences) - gradient[v]) < scale


@pytest.mark.slow
def test_newtons_method_in_space_lowers_the_energy_and_folds_nothing(shaken):
    def energy(state):
        rest_shapes, surface = state._in_space(state.ground)
        tau, constraints = state.constraints(True, True, state.inside.at_target)
        inside = total_in_space(rest_shapes, surface, state.u, Objective.of(1.0, 1.0))
        return inside + border_energy(constraints.border, tau)

    before, result = energy(shaken), shaken.forward(1.0, 40, 1e-3)
    assert result.value == pytest.approx(energy(result))
    assert result.value < 0.9 * before
    assert (triangle_areas(result.u[result.faces]) > 0).all()
    outline = result.matched.target.curve
    assert outline.distances(result.u[: result.border]).max() < 1e-9


def test_a_fold_is_undone_and_the_rest_stays(shaken):
    state = shaken
    u = state.u.copy()
    inner = np.flatnonzero(np.abs(u) < 0.2)
    worst = int(inner[np.argmin(np.abs(u[inner]))])
    rings = np.zeros(u.size, bool)
    rings[worst] = True
    for _ in range(3):
        rings[state.faces[rings[state.faces].any(axis=1)]] = True
    u[worst] += 0.25
    assert (triangle_areas(u[state.faces]) <= 0).any()
    unfolded = unfold_in(u, state.faces, np.arange(u.size) < state.border, state.u)
    assert (triangle_areas(unfolded[state.faces]) > 0).all()
    moved = np.abs(unfolded - state.u) > 1e-12
    assert moved.sum() < 0.5 * u.size
    np.testing.assert_array_equal(unfolded[: state.border], state.u[: state.border])


@pytest.mark.slow
def test_seams_take_an_order_in_which_they_are_the_same_on_both():
    fine, coarse = capsule(1600), capsule(900)
    turn = np.array([0, np.pi, 0.3, np.pi / 2])
    high = np.array([-2.2, -0.2, 1.9, 2.5])
    stops = []
    for mesh, ahead in ((coarse, -0.12), (fine, 0.12)):  # one is reached around either side
        angles = turn + ahead * np.array([0, 1, 0, 0])
        points = np.column_stack([np.cos(angles), np.sin(angles), high])
        stops.append(nearest(sound_piece(mesh), points))
    wholes = sound_piece(coarse), sound_piece(fine)
    numbers = np.array(stops).T
    assert seams._unlikeness(*wholes, numbers) > 0.15  # a rotation around the axis
    order = seams.agreed_orders(*wholes, numbers)[0]
    assert sorted(order) == [0, 1, 2, 3]
    assert seams._unlikeness(*wholes, numbers[order]) < 0.05


def test_seams_of_one_surface_agree_in_any_order():
    whole = sound_piece(capsule(500))
    stops = np.array(nearest(whole, np.array([[0, 0, 3], [1, 0, 1], [0, 1, -1], [0, 0, -3.0]])))
    (order,) = seams.agreed_orders(whole, whole, np.column_stack([stops, stops]))
    assert sorted(order) == [0, 1, 2, 3]
    assert seams._unlikeness(whole, whole, np.column_stack([stops, stops])[order]) < 1e-6


def test_the_cheapest_orders_come_first():
    cost = np.random.default_rng(4).random((6, 6))
    cost += cost.T
    every = [order for order in permutations(range(6)) if order[0] < order[-1]]
    totals = sorted(sum(cost[a, b] for a, b in pairwise(order)) for order in every)
    costs = [sum(cost[a, b] for a, b in pairwise(order.tolist())) for order in seams._orders(cost)]
    assert costs == pytest.approx(totals[: seams.ORDERS_TRIED])


def test_many_landmarks_are_ordered_too():
    places = np.random.default_rng(5).permutation(14)
    cost = np.abs(places[:, None] - places) ** 2.0
    best = next(seams._orders(cost))
    assert (np.abs(np.diff(places[best])) == 1).all()


@pytest.mark.parametrize("spot", [(0.3, 0.2), (0.5, 0.5), (0.25, 0.5), (0, 0)])
def test_vertices_are_inserted_at_the_requested_points(spot):
    x, y = np.meshgrid(np.linspace(0, 1, 3), np.linspace(0, 1, 3), indexing="ij")
    k = np.arange(9).reshape(3, 3)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1)
    points = np.column_stack([x.ravel(), y.ravel(), x.ravel() * y.ravel()])
    uv = points[:, :2] @ [[2, 1], [0, 3.0]] + 0.5
    mesh = Mesh("sheet", points, quads, 4 * np.arange(5), uv=uv, uv_corners=quads)
    result = with_vertices(sound_piece(mesh), np.array([[*spot, spot[0] * spot[1]]]))
    faces = result.corners.reshape(-1, 3)
    old = sound_piece(mesh)
    assert face_areas(result.points[faces]).sum() == pytest.approx(face_areas(old.points[old.faces]).sum())
    np.testing.assert_array_equal(result.points[:9], points)
    inserted = result.points[np.abs(result.points[:, :2] - spot).max(axis=1) < 0.1]
    assert len(inserted) == 1
    np.testing.assert_allclose(
        result.uv[result.uv_corners],
        result.points[result.corners][:, :2] @ [[2, 1], [0, 3.0]] + 0.5,
        atol=1e-12,
    )


def sheet(width, n=9):
    """A flat sheet, 1 high."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, width, n), np.linspace(0, 1, n)))
    xy = np.column_stack([x, y])
    return Mesh.triangles("sheet", np.column_stack([xy, 0 * x]), Delaunay(xy).simplices)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "status"), [(1.2, "REACHED"), (40, "TWISTED")])
def test_a_surface_that_is_squeezed_onto_another_is_not_reached(width, status):
    source, target = (flatten(disk_patch(sheet(w))) for w in (1, width))
    corners = [layout.flat[np.abs(layout.patch.points).sum(axis=1).argmin()] for layout in (source, target)]
    fit = iccm.fit(source, target, pins=[corners])
    assert fit.status.name == status
    assert fit.status.ok == (status == "REACHED")
    assert any("strongly stretched" in note for note in fit.notes) == (status == "TWISTED")


@pytest.mark.slow
def test_nearly_folded_maps_between_surfaces_get_a_note():
    source, target = (flatten(disk_patch(sheet(width))) for width in (1, 400))
    corners = [layout.flat[np.abs(layout.patch.points).sum(axis=1).argmin()] for layout in (source, target)]
    notes = iccm.fit(source, target, pins=[corners]).report()["notes"]
    assert any(note.startswith("squeezed: ") and "folds" in note for note in notes)
    notes = iccm.fit(source, source, pins=[[corners[0], corners[0]]]).report()["notes"]
    assert not any("squeezed" in note for note in notes)
