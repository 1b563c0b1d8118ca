"""Maps of surfaces: known ones, equivalent computations, and independence of the layout."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
import scipy.spatial

import iccm
from iccm.balanced.model.metric import LaidMetric, rest_geometry
from iccm.balanced.model.unit_coordinates import unit_similarity
from iccm.balanced.search.levels import FINE_POWER
from iccm.curve import Curve
from iccm.errors import InputError
from iccm.flattening import even_layout, flatten
from iccm.flattening.opening import open_up
from iccm.meshes.cut import cut_through
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import overlap
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import Mesh, face_areas
from iccm.meshes.stretch import Linear, linear
from iccm.surfaces.boundary_slivers import lift
from iccm.surfaces.refined import RefinedSurface
from tests.core.reference.minimise import density
from tests.triangulations import hull


def grid(n, m, place, name="grid"):
    """A mesh of n × m points of the unit square, mapped to space by `place(x, y)`."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    k = np.arange(n * m).reshape(n, m)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh.triangles(name, np.column_stack(place(x.ravel(), y.ravel())), faces)


def cylinder(x, y):
    return np.cos(2 * x), y, np.sin(-2 * x)


def hill(x, y):
    return x, y, 0.9 * np.exp(-9 * ((x - 0.6) ** 2 + (y - 0.45) ** 2))


def cap(angle, rings=14, spokes=48):
    """A cap of the unit sphere around its pole, up to an angle from it."""
    turn = 2 * np.pi * np.arange(spokes) / spokes
    theta = angle * np.arange(1, rings + 1) / rings
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    points = [np.column_stack([np.sin(t) * ring, np.full(spokes, np.cos(t))]) for t in theta]
    k = 1 + np.arange(rings * spokes).reshape(rings, spokes)
    faces = [np.column_stack([np.zeros(spokes, int), k[0], np.roll(k[0], -1)])]
    for inner, outer in itertools.pairwise(k):
        a, b, c, d = inner, outer, np.roll(outer, -1), np.roll(inner, -1)
        faces += [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    return Mesh.triangles("cap", np.concatenate([[[0, 0, 1.0]], *points]), np.concatenate(faces))


def rectangle(width, height, per_side=1):
    corners = np.array([0, width, width + 1j * height, 1j * height])
    return np.concatenate(
        [a + (b - a) * np.arange(per_side) / per_side for a, b in zip(corners, np.roll(corners, -1))]
    )


def circle(n=160):
    return np.exp(2j * np.pi * np.arange(n) / n)


def warped(layout):
    """The same surface with another layout, by an analytic map of the plane."""
    z = layout.flat / np.abs(layout.flat).max()
    flat = z + 0.3 * z**2
    assert overlap(replace(layout, flat=flat)) is None
    return replace(layout, flat=flat, method="conformal")


def stretch_of(fit):
    return fit.distortion.report()["stretch"]


def test_a_metric_is_that_of_the_surface():
    layout = flatten(disk_patch(grid(9, 7, lambda x, y: (x, 2 * y, 0 * x))))
    squeezed = replace(layout, flat=3 * layout.flat.real + 1j * layout.flat.imag)
    outline = Curve.domain(squeezed.flat[squeezed.loop])
    frame = unit_similarity(outline).rotated(0.4)
    triangles = frame(np.array([[0, 0.3, 0.1 + 0.2j], [-0.2, -0.1j, 0.2]]) + frame.centre)
    jacobian = LaidMetric.of(squeezed, frame).over(triangles)
    major, minor = np.abs(jacobian.a) + np.abs(jacobian.b), np.abs(jacobian.a) - np.abs(jacobian.b)
    np.testing.assert_allclose(major / minor, 3, rtol=1e-9)
    np.testing.assert_allclose(major * minor, 1, rtol=1e-9)  # both areas are normalised


def test_a_metric_in_a_mirror_is_mirrored():
    layout = even_layout(flatten(disk_patch(grid(9, 9, hill))))
    frame = unit_similarity(Curve.domain(layout.flat[layout.loop])).rotated(0.3)
    mirrored = frame._replace(mirrored=True)
    corners = layout.flat[layout.patch.faces[::7]]
    plain, reflected = (LaidMetric.of(layout, f).over(f(corners)) for f in (frame, mirrored))
    np.testing.assert_allclose(reflected.a, plain.a.conj(), atol=1e-12)
    np.testing.assert_allclose(reflected.b, plain.b.conj(), atol=1e-12)


class Constant:
    """The same linear map everywhere."""

    def __init__(self, a, b):
        self.a, self.b = a, b

    def over(self, z):
        return Linear(np.full(len(z), self.a), np.full(len(z), self.b))


@pytest.mark.parametrize("sides", [(True, False), (False, True), (True, True)])
def test_rest_shapes_give_the_jacobian_between_surfaces(sides):
    rng = np.random.default_rng(5)
    z = rng.standard_normal(60) + 1j * rng.standard_normal(60)
    faces = np.arange(60).reshape(-1, 3)
    u = (1.3 + 0.4j) * z + (0.2 - 0.5j) * z.conj()
    metrics = (Constant(1.4 + 0j, 0.3 + 0.6j), Constant(0.8 + 0j, -0.2 + 0.1j))
    gradients, areas = rest_geometry(z, u, faces, tuple(m if on else None for m, on in zip(metrics, sides)))
    values = u[faces]
    jacobian = (gradients * values).sum(1), (gradients.conj() * values).sum(1)
    expected, size = Linear(np.array([1.3 + 0.4j]), np.array([0.2 - 0.5j])), 1.0
    if sides[0]:
        kept = metrics[0].over(z[:1])
        expected, size = expected @ kept.inverse(), kept.determinant
    if sides[1]:
        expected = metrics[1].over(z[:1]) @ expected
    singular = [np.abs(a) + s * np.abs(b) for a, b in (jacobian, expected) for s in (1, -1)]
    np.testing.assert_allclose(singular[0], np.broadcast_to(singular[2], 20), rtol=1e-9)
    np.testing.assert_allclose(singular[1], np.broadcast_to(singular[3], 20), rtol=1e-9)
    plain = rest_geometry(z, u, faces, (None, None))[1]
    np.testing.assert_allclose(areas, size * plain, rtol=1e-12)


@pytest.mark.parametrize("layout_of", [lambda layout: layout, warped], ids=["as it is", "warped"])
@pytest.mark.parametrize("onto_surface", [False, True])
def test_a_rolled_sheet_is_mapped_onto_its_rectangle_without_stretch(layout_of, onto_surface):
    layout = layout_of(flatten(disk_patch(grid(25, 13, cylinder))))
    sheet = rectangle(2.0, 1.0)
    fit = iccm.fit(sheet, layout, turn="any") if onto_surface else iccm.fit(layout, sheet, turn="any")
    assert fit.status.ok
    assert fit.certificate.share > 0.9999
    assert stretch_of(fit)["p95"] < 1.002
    assert fit.distortion.report()["dilatation"]["p95"] < 1.003


@pytest.mark.slow
def test_the_figures_of_a_surface_do_not_depend_on_its_layout():
    layout = flatten(disk_patch(grid(21, 21, hill)))
    heart = rectangle(1.0, 1.0)
    plain, distorted = (stretch_of(iccm.fit(surface, heart)) for surface in (layout, warped(layout)))
    assert plain["p95"] == pytest.approx(distorted["p95"], rel=0.02)
    assert plain["p50"] == pytest.approx(distorted["p50"], rel=0.02)


@pytest.mark.slow
def test_a_map_and_its_inverse_are_as_even():
    layout = flatten(disk_patch(grid(17, 17, hill)))
    forward, back = iccm.fit(layout, circle()), iccm.fit(circle(), layout)
    # stretch is max(s1, 1/s2) over the target's area: the inverse has it with the weights of the other side
    assert stretch_of(forward)["p95"] == pytest.approx(stretch_of(back)["p95"], rel=0.15)


def radial(angle, theta, q, n=400):
    """The best radial map of a cap onto a disc, by minimising the energy over its profile: stretches and weights."""
    t = angle * (np.arange(n) + 0.5) / n
    ring, step = np.sin(t) / (1 - np.cos(angle)) ** 0.5, angle / n / (1 - np.cos(angle)) ** 0.5
    weight = np.sin(t) * angle / n / (1 - np.cos(angle))

    def stretches(logs):
        r = np.append(0, np.cumsum(np.exp(logs)))
        r = r / r[-1] * 2**0.5  # of area 2π, like the cap
        return np.diff(r) / step, 0.5 * (r[1:] + r[:-1]) / ring

    def energy(logs):
        s, c = stretches(logs)
        return float(weight @ [density(0.5 * (a * a + b * b), a * b, theta, q, 0.5) for a, b in zip(s, c)])

    optimum = scipy.optimize.minimize(energy, np.zeros(n), method="L-BFGS-B", options={"maxiter": 60})
    s, c = stretches(optimum.x)
    return np.maximum(np.maximum(s, c), 1 / np.minimum(s, c)), weight * s * c


@pytest.mark.slow
def test_a_cap_of_a_sphere_is_mapped_onto_a_disc_as_by_the_best_radial_map():
    angle = 2.2
    fit = iccm.fit(flatten(disk_patch(cap(angle, 28, 96))), circle(), turn="any")
    stretch, weight = radial(angle, 1.0, FINE_POWER, 120)
    order = np.argsort(stretch)
    expected = stretch[order][np.searchsorted(np.cumsum(weight[order]), 0.95 * weight.sum())]
    conformal = iccm.fit(flatten(disk_patch(cap(angle))), circle(), method="conformal")
    assert stretch_of(fit)["p95"] == pytest.approx(expected, rel=0.03)
    assert fit.distortion.within(2) > 0.999 > conformal.distortion.within(2)


def test_a_conformal_map_of_a_surface_has_the_surface_s_figures():
    layout = flatten(disk_patch(cap(2.2)))
    flat = iccm.fit(layout.boundary, circle(), method="conformal")
    spatial = iccm.fit(layout, circle(), method="conformal")
    assert stretch_of(spatial)["p95"] > 1.3 * stretch_of(flat)["p95"]


def test_texture_coordinates_fold_nowhere_and_the_triangles_are_the_surface_s_own():
    layout = flatten(disk_patch(grid(15, 15, hill)))
    fit = iccm.fit(layout, circle())
    image = lift(fit.map(layout.flat), layout.patch.faces, layout.loop, 2.0)
    a, b, c = image[layout.patch.faces].T
    assert (((b - a).conj() * (c - a)).imag > 0).all()
    from scipy.spatial import cKDTree

    tree = cKDTree(np.column_stack([fit.map.source.real, fit.map.source.imag]))
    assert tree.query(np.column_stack([layout.flat.real, layout.flat.imag]))[0].max() < 1e-9


@pytest.mark.parametrize("seed", [3, 9, 12])
def test_parts_cut_off_by_a_corner_of_the_outline_are_given_room(seed):
    """From one side of a square to the next, a coarse mesh's edge cuts off the corner, with inner vertices behind
    it.
    """
    rng = np.random.default_rng(seed)
    inside = np.sqrt(rng.uniform(size=120)) * np.exp(2j * np.pi * rng.uniform(size=120)) * 0.999
    z = np.concatenate([inside, np.exp(2j * np.pi * np.sort(rng.uniform(size=25)))])
    points = np.column_stack([z.real, z.imag, 0.5 * z.real**2])
    faces = scipy.spatial.Delaunay(points[:, :2]).simplices
    faces = np.where(up(z, faces)[:, None] > 0, faces, faces[:, ::-1])
    layout = flatten(disk_patch(Mesh.triangles("disc", points, faces[np.abs(up(z, faces)) > 1e-6])))
    fit = iccm.fit(layout, np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j]))
    faces = layout.patch.faces
    image = lift(fit.map(layout.flat), faces, layout.loop, 2 * 2**0.5)
    opened = open_up(image, layout.patch, layout.loop)
    assert (up(image, faces) <= 0).any() and (up(opened, faces) > 0).all()
    assert (opened[layout.loop] == image[layout.loop]).all()
    assert np.isin(np.flatnonzero(opened != image), faces[up(image, faces) <= 0]).all()


def up(z, faces):
    """Twice the signed areas."""
    a, b, c = z[faces].T
    return ((b - a).conj() * (c - a)).imag


def test_pins_of_a_surface_are_met():
    layout = flatten(disk_patch(grid(17, 17, hill)))
    inner = 8 * 17 + 8
    between = layout.flat[layout.patch.faces[100]].mean()
    pins = [(layout.flat[inner], 0.2 + 0.1j), (between, -0.4 - 0.2j)]
    fit = iccm.fit(layout, circle(), pins=pins, exact_pins=True)
    assert fit.status.ok
    for z, w in pins:
        assert abs(complex(fit.map(np.array([z]))[0]) - w) < 1e-9


@pytest.mark.slow
def test_strokes_of_a_surface_are_met():
    layout = flatten(disk_patch(grid(17, 17, hill)))
    z = layout.flat[[5 * 17 + 5, 8 * 17 + 8, 11 * 17 + 9]]
    fit = iccm.fit(layout, circle(), strokes=[(z, np.array([-0.4, 0, 0.4 + 0.1j]))])
    assert fit.status.ok
    assert fit.report()["strokes"][0]["error"] < 5e-4


@pytest.mark.parametrize("listed", [True, False])
def test_holes_of_a_surface_are_closed_or_ignored(listed):
    mesh = grid(17, 17, hill)
    middle = mesh.points[mesh.corners.reshape(-1, 3)].mean(axis=1)
    kept = np.hypot(middle[:, 0] - 0.3, middle[:, 1] - 0.6) > 0.12
    layout = flatten(disk_patch(mesh.part(kept, "holed")))
    hole = next(loop for loop in layout.patch.loops if not np.array_equal(loop, layout.loop))
    fit = iccm.fit(layout, circle(), source_holes=[layout.flat[hole]] if listed else [])
    assert fit.status.ok
    image = lift(fit.map(layout.flat), layout.patch.faces, layout.loop, 2.0)
    a, b, c = image[layout.patch.faces].T
    assert (((b - a).conj() * (c - a)).imag > 0).all()
    size = abs(Curve(image[hole]).area)
    natural = np.pi * abs(Curve(layout.flat[hole]).area) / layout.boundary.area
    assert size < 0.25 * natural if listed else 0.25 * natural < size < 2 * natural


def test_a_hole_of_a_surface_is_mapped_onto_that_of_the_target():
    mesh = grid(17, 17, hill)
    middle = mesh.points[mesh.corners.reshape(-1, 3)].mean(axis=1)
    layout = flatten(disk_patch(mesh.part(np.hypot(middle[:, 0] - 0.5, middle[:, 1] - 0.5) > 0.15, "ring")))
    hole = next(loop for loop in layout.patch.loops if not np.array_equal(loop, layout.loop))
    fit = iccm.fit(layout, circle(), source_holes=[layout.flat[hole]], target_holes=[0.3 * circle(40)])
    assert fit.status.ok
    assert fit._boundary["hausdorff"] < 1e-3
    np.testing.assert_allclose(np.abs(fit.map(layout.flat[hole])), 0.3, atol=2e-3)


@pytest.mark.slow
def test_remeshed_copies_go_onto_each_other():
    coarse, fine = (flatten(disk_patch(grid(n, n, hill, f"hill {n}"))) for n in (16, 23))
    places = [(3, 3), (12, 3), (12, 12), (3, 12), (8, 8), (6, 10)]
    rows = [5 * 0 + i * 16 + j for i, j in places]
    points = coarse.patch.points[rows]
    nearest_fine = [int(np.argmin(((fine.patch.points - p) ** 2).sum(axis=1))) for p in points]
    goal = fine.patch.points[nearest_fine]
    nearest_coarse = [int(np.argmin(((coarse.patch.points - p) ** 2).sum(axis=1))) for p in goal]
    fit = iccm.fit(coarse, fine, pins=np.column_stack([coarse.flat[nearest_coarse], fine.flat[nearest_fine]]))
    face, weight = Locator(coarse)(fit.inverse(fine.flat), 1)
    images = np.einsum("pk,pkc->pc", weight, coarse.patch.points[coarse.patch.faces[face]])
    away = np.linalg.norm(images - fine.patch.points, axis=1) / np.linalg.norm(
        np.ptp(fine.patch.points, axis=0)
    )
    assert fit.status.ok
    assert np.median(away) < 0.015  # the pins themselves are off by up to half an edge, 0.02
    assert away.max() < 0.06


def test_new_vertices_are_where_they_should_be():
    mesh = grid(4, 4, lambda x, y: (x, y, x * y))
    faces = mesh.corners.reshape(-1, 3)
    refined = RefinedSurface.of(faces, 16)
    refined, inside = refined.with_point(4, np.array([0.5, 0.3, 0.2]))
    refined, vertex = refined.with_point(0, np.array([0.0, 1.0, 0.0]))
    edge_face = int(np.flatnonzero(np.isin(refined.faces, [5, 6]).sum(axis=1) == 2)[0])
    weights = np.where(np.isin(refined.faces[edge_face], [5, 6]), [0.25, 0.25, 0.25], 0)
    refined, on_edge = refined.with_point(edge_face, weights / weights.sum())
    still = np.zeros(refined.count, bool)
    still[[0, 1, 4, 5, inside]] = True
    refined = refined.without_chords(still)
    refined = refined.with_points_on(np.array([1, 2, 1]), np.array([2, 3, 2]), np.array([0.2, 0.5, 0.7]))
    points = refined.carried(mesh.points)
    assert vertex == faces[0][1]
    np.testing.assert_allclose(points[inside], np.array([0.5, 0.3, 0.2]) @ mesh.points[faces[4]])
    np.testing.assert_allclose(points[on_edge], mesh.points[[5, 6]].mean(axis=0))
    flat = points[:, 0] + 1j * points[:, 1]
    a, b, c = flat[refined.faces].T
    areas = 0.5 * ((b - a).conj() * (c - a)).imag
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(1)
    parts = np.bincount(refined.original, areas, minlength=len(faces))
    np.testing.assert_allclose(parts, 1 / 18)
    edges = np.unique(np.sort(refined.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    assert refined.count - len(edges) + len(refined.faces) == 1
    inner = edges[still[np.minimum(edges, still.size - 1)].all(axis=1) & (edges < still.size).all(axis=1)]
    assert {tuple(e) for e in inner.tolist()} <= {(0, 1), (0, 4)}  # of the boundary


def test_triangles_on_a_straight_side_are_lifted_and_others_stay():
    loop = np.arange(5)
    flat = np.array([0, 0.5, 1, 1 + 1j, 1j], complex)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]])
    lifted = lift(flat, faces, loop, 2**0.5)
    assert lifted[1].imag < 0
    np.testing.assert_array_equal(np.delete(lifted, 1), np.delete(flat, 1))
    hollow = flat + 0.1j * (np.arange(5) == 1)
    np.testing.assert_array_equal(lift(hollow, faces, loop, 2**0.5), hollow)
    point = np.array(
        [0, 0.5, 0, 1 + 1j, 1j], complex
    )  # the side opposite vertex 1 has no direction to lift it
    np.testing.assert_array_equal(lift(point, faces[:1], loop, 2**0.5), point)


def sphere(n=24, m=16):
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, np.pi * np.arange(1, m) / m, indexing="ij")
    points = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], axis=-1).reshape(-1, 3)
    points = np.vstack([points, [0, 1, 0], [0, -1, 0]])
    shaken = points + 1e-9 * np.random.default_rng(1).standard_normal(points.shape)
    return Mesh.triangles("sphere", points, hull(shaken))


def test_a_closed_surface_is_cut_through_points_along_geodesics():
    mesh = sphere()
    points = np.array([[1, 0, 0], [0, 0, 1], [-1, 0, 0.0]])
    piece = disk_patch(mesh, cut=True, through=points)
    outline = piece.loops[0]
    ends = [np.flatnonzero(np.linalg.norm(piece.points[outline] - p, axis=1) < 1e-9) for p in points]
    assert [len(group) for group in ends] == [1, 2, 1]
    assert piece.genus == 0 and len(piece.loops) == 1
    length = np.linalg.norm(piece.points[outline] - np.roll(piece.points[outline], -1, axis=0), axis=1).sum()
    assert length == pytest.approx(2 * np.pi, rel=0.02)  # twice half a great circle
    assert np.abs(piece.points[outline][:, 1]).max() < 1e-9
    assert face_areas(piece.points[piece.faces]).sum() == pytest.approx(
        face_areas(mesh.points[mesh.corners.reshape(-1, 3)]).sum()
    )


def test_a_seam_that_would_cross_itself_is_refused():
    x = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 2, 1], [5, 3, 2], [5, 4, 3], [5, 1, 4]])
    whole = disk_patch(Mesh.triangles("octahedron", x, faces), cut=True).mesh
    from iccm.meshes.patch import Patch
    from iccm.meshes.topology import Triangles

    patch = Patch(whole, x, Triangles(faces, 6), np.arange(6), faces)
    with pytest.raises(InputError, match="through the pins"):
        cut_through(patch, [1, 3, 2, 4, 0, 5])


def test_linear_maps_compose_and_invert():
    rng = np.random.default_rng(2)
    z, w, v = (rng.standard_normal((7, 3)) + 1j * rng.standard_normal((7, 3)) for _ in range(3))
    first, second = linear(z, w), linear(w, v)
    composed, back = second @ first, linear(w, z)
    np.testing.assert_allclose(composed.a, linear(z, v).a, rtol=1e-8)
    np.testing.assert_allclose(composed.b, linear(z, v).b, rtol=1e-8)
    np.testing.assert_allclose(first.inverse().a, back.a, rtol=1e-8)


@pytest.mark.slow
def test_surfaces_are_mapped_onto_shapes_with_bays_and_back_like_their_outlines():
    u = np.array([0, 3, 3 + 3j, 2 + 3j, 2 + 1j, 1 + 1j, 1 + 3j, 3j])
    plain = iccm.fit(rectangle(1, 1), u, fit="cover")
    flat = flatten(disk_patch(grid(15, 15, lambda x, y: (x, y, 0 * x))))
    for layout in (flat, warped(flat)):  # for any layout it is the same surface
        fit = iccm.fit(layout, u, fit="cover")
        assert fit.status.ok and fit.report()["injective"]["certified"] and fit.details.filled is not None
        assert fit.coverage.uncovered == pytest.approx(0, abs=1e-3)
        assert stretch_of(fit)["p95"] == pytest.approx(stretch_of(plain)["p95"], rel=0.1)
    assert stretch_of(iccm.fit(flat, u))["p95"] > 1.2 * stretch_of(plain)["p95"]
    contained, with_bays = iccm.fit(u, flat, fit="contain"), iccm.fit(u, rectangle(1, 1), fit="contain")
    assert contained.status.ok and contained.report()["injective"]["certified"]
    assert (
        contained.coverage.uncovered == pytest.approx(with_bays.coverage.uncovered, abs=2e-3)
        and with_bays.coverage.uncovered > 1e-3
    )


@pytest.mark.slow
def test_rigid_regions_of_a_surface_have_pins_and_are_refused():
    layout = flatten(disk_patch(grid(25, 17, cylinder)))
    low, high = layout.boundary.box
    middle, size = (low + high) / 2, abs(high - low)
    disc = middle + 0.12 * size * circle(40)
    pins = np.array([[middle, 0.1], [middle + 0.06 * size, 0.1 + 0.1j]])
    fit = iccm.fit(layout, circle(), rigid=[disc], pins=pins)
    (region,) = fit.rigid
    assert fit.status.ok and region.is_rigid and np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 1e-9
    assert region.turn == pytest.approx(90, abs=1)  # as the pins determine, and so is its size
    assert region.scale == pytest.approx(0.1 / (0.06 * size) * np.sqrt(2 / Curve(circle()).area), rel=0.02)
    for region, message in (
        (0.01 * disc + 9 * size, "no triangle"),
        (middle + 1e-4 * (disc - middle), "no triangle"),
    ):
        with pytest.raises(InputError, match=message):
            iccm.fit(layout, circle(), rigid=[region])
    with pytest.raises(InputError, match=r"region 1: no similarity.*pins"):
        wrong = np.append(pins, [[middle + 0.06j * size, -0.2]], axis=0)
        iccm.fit(layout, circle(), rigid=[disc], pins=wrong)
    with pytest.raises(InputError, match="between two surfaces"):
        iccm.fit(layout, layout, rigid=[disc])
