"""Layouts by Newton's method: their energy, limits, and invariants."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely

from iccm import deadline
from iccm.errors import InputError
from iccm.flattening import METHODS, coarsening, flatten, method, multigrid, scaffold, seams, tutte
from iccm.flattening.free import Elastic, surface
from iccm.flattening.scaffold import FRAME_CORNERS, frame, outside, relax_with_scaffold
from iccm.flattening.seams import ShortestPaths, angle_sums
from iccm.io.options import of_command
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import Flattening, overlap
from iccm.meshes.mesh import Mesh, face_areas
from iccm.meshes.topology import Triangles, walk
from iccm.plane import triangle_areas
from tests.core.reference import coarsening as plain
from tests.triangulations import hull


def grid(n, m, place):
    """A patch of n × m points of the unit square, mapped to space by `place(x, y)`."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    k = np.arange(n * m).reshape(n, m)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh.triangles("grid", np.column_stack(place(x.ravel(), y.ravel())), faces)


def cylinder(x, y):
    return np.cos(2 * x), y, np.sin(-2 * x)


def dome(x, y):
    return x, y, 0.9 * np.sin(np.pi * x) * np.sin(np.pi * y)


def sphere(n=24, m=16):
    """A closed triangulated sphere, with points slightly perturbed so that nothing is symmetric."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, np.pi * np.arange(1, m) / m, indexing="ij")
    points = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], axis=-1).reshape(-1, 3)
    points = np.vstack([points, [0, 1, 0], [0, -1, 0]])
    points *= 1 + 0.02 * np.random.default_rng(3).standard_normal((len(points), 1))
    return Mesh.triangles("sphere", points, hull(points / np.linalg.norm(points, axis=1, keepdims=True)))


def winding(turns, n=90, m=9):
    """A ramp that winds around an axis: flattened, it covers a ring `turns` times."""
    return grid(
        n,
        m,
        lambda x, y: (
            (0.4 + y) * np.cos(turns * 2 * np.pi * x),
            (0.4 + y) * np.sin(turns * 2 * np.pi * x),
            0.3 * x,
        ),
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_surface_that_can_be_unrolled_is_unrolled(method):
    layout = flatten(disk_patch(grid(13, 7, cylinder)), method=method)
    report = layout.report()
    assert report["dilatation"]["max"] == pytest.approx(1, abs=2e-3)
    assert layout.strained(100) == pytest.approx(1, abs=2e-3)
    assert overlap(layout) is None


def test_a_hidden_plane_of_a_large_closed_surface_is_nearly_even_and_does_not_overlap(monkeypatch):
    monkeypatch.setattr(method, "LARGE_VERTEX_COUNT", 100)
    monkeypatch.setattr(coarsening, "LARGE_VERTEX_COUNT", 100)
    patch = disk_patch(sphere(36, 20), cut=True)
    plain, hidden = (flatten(patch, grow=True, purpose=purpose) for purpose in ("domain", "solver"))
    assert (plain.method, hidden.method) == ("conformal", "balanced")
    assert overlap(hidden) is None
    assert plain.even is not None
    assert hidden.strained(95) < 1.1 * plain.even.strained(95)
    small = flatten(disk_patch(sphere(8, 6), cut=True), grow=True, purpose="solver")
    assert small.method == "conformal"


def test_newton_ends_where_the_energy_has_no_slope():
    patch = disk_patch(grid(12, 10, dome))
    sheet = surface(patch.points, patch.faces)
    start = tutte.convex(patch, patch.loops[0]) / np.sqrt(np.pi)
    u = sheet.relaxed(start, 1.0, 100, 1e-14)
    rng = np.random.default_rng(0)
    for _ in range(5):
        direction = rng.standard_normal((u.size, 2)) @ np.array([1, 1j])
        slope = (sheet.energy(u + 1e-6 * direction, 1.0) - sheet.energy(u - 1e-6 * direction, 1.0)) / 2e-6
        before = (
            sheet.energy(start + 1e-7 * direction, 1.0) - sheet.energy(start - 1e-7 * direction, 1.0)
        ) / 2e-7
        assert abs(slope) < 1e-5 * abs(before)


def test_the_energy_is_half_the_symmetric_dirichlet_energy():
    patch = disk_patch(grid(9, 9, dome))
    layout = flatten(patch, method="balanced")
    major, minor = layout.stretch
    area = face_areas(patch.points[patch.faces])
    expected = np.sum(area * (major**2 + minor**2 + major**-2 + minor**-2)) / (4 * area.sum())
    unit = layout.flat / np.sqrt(area.sum())
    assert surface(patch.points, patch.faces).energy(unit, 1.0) == pytest.approx(expected)


def test_even_layouts_stretch_less_and_conformal_ones_keep_angles_better():
    patch = disk_patch(sphere(), cut=True)
    even, conformal = (flatten(patch, grow=True, method=name) for name in ("balanced", "conformal"))
    assert even.strained(95) < conformal.strained(95)
    assert conformal.report()["dilatation"]["p95"] < even.report()["dilatation"]["p95"]
    assert conformal.report()["dilatation"]["p95"] < 1.3
    assert even.strained(95) < 1.6
    assert overlap(even) is None and overlap(conformal) is None


def test_a_conformal_layout_of_a_cut_surface_has_less_spread_of_areas_than_least_squares():
    patch = disk_patch(sphere(), cut=True)
    spread = {}
    for name in ("conformal", "lscm"):
        area = flatten(patch, grow=True, method=name).report()["log10_area"]
        spread[name] = area["p95"] - area["p05"]
    assert spread["conformal"] < 0.8 * spread["lscm"]


def tube(around=16, along=25, length=6.0):
    """An open cylinder of radius 1 and its two loops, which is developable but closed."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0, length, along), indexing="ij")
    points = np.column_stack([np.cos(u).ravel(), v.ravel(), -np.sin(u).ravel()])
    k = np.arange(around * along).reshape(around, along)
    a, b = k, np.roll(k, -1, axis=0)
    quads = np.stack([a[:, :-1], b[:, :-1], b[:, 1:], a[:, 1:]], axis=-1).reshape(-1, 4)
    return Mesh.triangles("tube", points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))


def box(n=3):
    """A closed cube of side 2, with n × n squares on each face, which is developable except for its eight corners."""
    x = np.linspace(-1, 1, n + 1)
    grids = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    points = grids[np.abs(grids).max(axis=1) == 1]
    # on a sphere only for the hull, so that every point is a vertex of it
    return Mesh.triangles("box", points, hull(points / np.linalg.norm(points, axis=1, keepdims=True)))


@pytest.mark.parametrize("method", ["conformal", "balanced"])
def test_the_seam_of_a_chart_joins_holes_where_that_unrolls_the_surface(method):
    patch = disk_patch(tube())
    holed, chart = (
        flatten(patch, grow=True, method=method, purpose=purpose) for purpose in ("domain", "texture")
    )
    assert len(holed.patch.loops) == 2
    assert len(chart.patch.loops) == 1 and overlap(chart) is None
    assert chart.strained(100) == pytest.approx(1, abs=1e-3)
    assert holed.strained(95) > 1.2
    side = np.sqrt(face_areas(patch.points[patch.faces]).sum())
    assert chart.patch.seam_length == pytest.approx(6 / side)


def test_the_outline_stays_the_one_that_was_chosen_as_the_seam_grows():
    mesh = tube()
    mesh = mesh.part(
        np.linalg.norm(mesh.points[mesh.corners].reshape(-1, 3, 3).mean(axis=1) - [1, 0, 0], axis=1) > 0.5,
        "slit",
    )
    patch = disk_patch(mesh)
    lengths = [len(loop) for loop in patch.loops]
    layout = flatten(patch, loop=2, grow=True)
    chosen = set(patch.vertex[patch.loops[1]].tolist())
    assert len(lengths) > 1 and chosen <= set(layout.patch.vertex[layout.loop].tolist())


def test_the_seam_of_a_chart_is_extended_through_convex_vertices_until_angles_are_kept():
    patch = disk_patch(box(), cut=True)
    short, chart = (flatten(patch, grow=True, purpose=purpose) for purpose in ("domain", "texture"))
    assert short.dilated(95) > 1.3 >= chart.dilated(95)
    assert overlap(chart) is None
    assert chart.patch.seam_length > short.patch.seam_length
    ends, degree = np.unique(chart.patch.seam, return_counts=True)
    corners = np.flatnonzero((np.abs(patch.mesh.points) == 1).all(axis=1))
    assert np.isin(ends[degree == 1], corners).sum() >= 3


def test_sums_along_paths_are_those_of_a_walk():
    patch = disk_patch(grid(9, 7, dome))
    paths = ShortestPaths.of(patch, patch.loops[0][:3], joins=False)
    values = np.random.default_rng(5).random(len(patch.points))
    sums = paths.sum_along(values)
    for vertex in range(len(values)):
        assert sums[vertex] == pytest.approx(values[walk(paths.predecessors, vertex)[:-1]].sum())


def test_angles_about_the_corners_of_a_box_are_three_right_ones():
    patch = disk_patch(box(), cut=True)
    around = np.bincount(patch.vertex, angle_sums(patch), minlength=len(patch.mesh.points))
    corner = (np.abs(patch.mesh.points) == 1).all(axis=1)
    np.testing.assert_allclose(around, np.where(corner, 1.5 * np.pi, 2 * np.pi))


@pytest.mark.parametrize("laps", [1.3, 2.5])
def test_a_winding_ramp_is_laid_out_without_overlaps(laps):
    patch = disk_patch(winding(laps))
    assert overlap(flatten(patch, method="lscm")) == "an outline that crosses itself"
    layout = flatten(patch)
    assert layout.method == "conformal" and "crosses itself" in layout.notes[0]
    assert overlap(layout) is None
    assert layout.report()["dilatation"]["p95"] < 1.15


def test_a_hole_that_crosses_itself_is_an_overlap():
    mesh = grid(5, 5, lambda x, y: (x, y, 0 * x))
    patch = disk_patch(mesh.part(~np.isin(np.arange(32), [5, 6, 9, 10, 21, 22, 25, 26]), "ring"))
    outline, hole = patch.loops
    flat = patch.points[:, 0] + 1j * patch.points[:, 1]
    assert overlap(Flattening(patch, flat, outline, "given")) is None
    away = flat.copy()
    away[hole] = flat[hole] + 3  # outside of the outline
    assert overlap(Flattening(patch, away, outline, "given")) is not None


def test_a_scaffold_fills_the_frame_around_the_layout():
    mesh = grid(6, 6, lambda x, y: (x, y, 0 * x))
    patch = disk_patch(mesh.part(np.arange(50) != 12, "holed"))
    flat = patch.points[:, 0] + 1j * patch.points[:, 1]
    around = frame(flat[patch.loops[0]])
    faces = outside(flat, around, patch.loops)
    a, b, c = np.concatenate([around, flat])[faces.T]
    area = 0.5 * ((b - a).conj() * (c - a)).imag
    assert (area > 0).all()
    whole = shapely.Polygon(np.column_stack([around.real, around.imag])).area
    assert area.sum() == pytest.approx(whole - (1 - 0.02))
    assert faces.min() == 0 and faces.max() < FRAME_CORNERS + flat.size


def test_a_scaffold_prevents_overlaps_of_free_newton():
    patch = disk_patch(winding(1.4, 40, 4))
    sheet = surface(patch.points, patch.faces)
    start = tutte.convex(patch, patch.loops[0]) / np.sqrt(np.pi)
    free, scaffolded = (
        sheet.relaxed(start, 1.0, 150, 1e-5),
        relax_with_scaffold(sheet, start, patch.loops, 1.0, range(200), 1e-5),
    )
    outline = patch.loops[0]
    assert overlap(Flattening(patch, free, outline, "free")) is not None
    assert overlap(Flattening(patch, scaffolded, outline, "held")) is None
    assert 1 < sheet.energy(free, 1.0) < sheet.energy(scaffolded, 1.0) < sheet.energy(start, 1.0)


def test_a_layout_that_leaves_a_scaffold_no_room_stays(monkeypatch):
    """GEOS does not triangulate next to an outline that almost touches itself."""
    patch = disk_patch(grid(4, 4, dome))
    sheet, start = surface(patch.points, patch.faces), tutte.convex(patch, patch.loops[0])
    monkeypatch.setattr(scaffold, "_triangulations", lambda polygons: np.empty(0, object))
    assert (relax_with_scaffold(sheet, start, patch.loops, 1.0, range(9), 1e-5) == start).all()


def test_one_polygon_that_geos_refuses_does_not_empty_the_other_holes(monkeypatch):
    """All holes of a layout are triangulated at once."""
    triangulate = scaffold.shapely.constrained_delaunay_triangles

    def moody(polygons):
        if any(polygon.area < 0.01 for polygon in polygons):
            raise shapely.errors.GEOSException("too thin")
        return triangulate(polygons)

    monkeypatch.setattr(scaffold.shapely, "constrained_delaunay_triangles", moody)
    square = np.array([0, 1, 1 + 1j, 1j])
    around, u = frame(10 * square), np.concatenate([10 * square, 0.05 * square, 2 + square])
    faces = outside(u, around, [np.arange(4), np.arange(4, 8), np.arange(8, 12)])
    area = np.abs(triangle_areas(np.concatenate([around, u])[faces])).sum()
    ring = shapely.Polygon(np.column_stack([around.real, around.imag])).area - 100
    assert area == pytest.approx(ring + 1)


def test_coarsening_a_surface_with_small_holes_leaves_a_surface():
    """At a hole of three edges, a collapse without a fold may make two triangles of one edge four."""
    whole = grid(40, 40, lambda x, y: (x, y + 0.1 * x, 0 * x))
    faces = whole.corners.reshape(-1, 3)[np.random.default_rng(1).random(len(whole.starts) - 1) > 0.15]
    patch = disk_patch(Mesh.triangles("scan", whole.points, faces))
    z = patch.points[:, 0] + 1j * patch.points[:, 1]
    assert sum(loop.size == 3 for loop in patch.loops) > 50
    coarse, _ = coarsening.coarser(patch.points, patch.faces, z, len(z) // 8)
    vertices, local = np.unique(coarse, return_inverse=True)
    shape = Triangles(local.reshape(-1, 3), vertices.size)
    assert vertices.size < len(z) and not shape.crowded_edges
    assert np.unique(shape.fans()).size == vertices.size  # it touches itself nowhere
    assert len(shape.loops()) == len(patch.loops)


def test_a_layout_is_what_was_reached_when_the_time_is_over(monkeypatch):
    patch = disk_patch(winding(1.4, 40, 4))
    monkeypatch.setattr(deadline, "SEARCH_TIME_SHARE", 0.0)
    with deadline.limited(100):
        early = flatten(patch, method="balanced")
        assert deadline.current().cut
    late = flatten(patch, method="balanced")
    assert overlap(early) is None and early.strained(95) > 1.1 * late.strained(95)


def test_the_command_offers_exactly_the_methods_that_exist():
    _, method = of_command("flatten")["method"]
    assert method.metavar.strip("[]").split("|") == list(METHODS)


def test_faces_without_area_are_laid_out_by_newton_and_refused_by_least_squares():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0], [0.5, 0, 0]]
    patch = disk_patch(Mesh.triangles("seam", points, [[0, 4, 1], [0, 1, 2], [0, 2, 3]]))
    layout = flatten(patch)
    assert layout.method == "conformal"
    assert overlap(layout) is None
    with pytest.raises(InputError, match="seam: LSCM has no solution"):
        flatten(patch, method="lscm")


def test_lengthening_a_seam_takes_no_more_scaffolds_than_a_layout(monkeypatch):
    """A mesh with shuffled faces would continue forever without improving."""
    layout = flatten(disk_patch(grid(4, 4, dome)))
    layouts = []

    def slow(start, sheet, theta, steps):
        layouts.extend(itertools.islice(steps, 140))
        return start

    monkeypatch.setattr(seams, "sharper", lambda flattening: replace(flattening.patch))
    monkeypatch.setattr(method, "_angle_loss", lambda flattening: np.inf)
    monkeypatch.setattr(method, "_relax", slow)
    monkeypatch.setattr(method, "_conformal", lambda even, sheet, steps: even)
    assert method._lengthen_seam(layout) is layout
    assert len(layouts) <= method.SCAFFOLD_STEPS and len(layouts) > 0.9 * method.SCAFFOLD_STEPS


def annulus_cut_open():
    """A dome with a hole, flattened without folds."""
    mesh = grid(40, 40, dome)
    middle = np.abs(mesh.points[mesh.corners.reshape(-1, 3)].mean(axis=1)[:, :2] - 0.5).max(axis=1)
    patch = disk_patch(Mesh.triangles("ring", mesh.points, mesh.corners.reshape(-1, 3)[middle > 0.2]))
    return patch, tutte.convex(patch, patch.loops[0])


def test_a_coarser_triangulation_has_no_folds_and_as_many_holes():
    patch, z = annulus_cut_open()
    faces, removed = coarsening.coarser(patch.points, patch.faces, z, 300)
    left = np.unique(faces)
    assert left.size < 400 and left.size + removed.vertex.size == z.size
    assert (triangle_areas(z[faces]) > 0).all()
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, shared = np.unique(sides, axis=0, return_counts=True)
    assert shared.max() == 2 and left.size - len(edges) + len(faces) == 0  # of a ring


def test_a_boundary_that_stays_is_that_of_the_coarser_triangulation():
    patch, z = annulus_cut_open()
    rim = np.concatenate(patch.loops)
    faces, removed = coarsening.coarser(patch.points, patch.faces, z, 300, rim)
    assert removed.vertex.size and not np.isin(removed.vertex, rim).any()
    assert triangle_areas(z[faces]).sum() == pytest.approx(triangle_areas(z[patch.faces]).sum(), rel=1e-12)


def test_vertices_of_a_flat_surface_are_restored_to_their_places_and_stay():
    patch, z = annulus_cut_open()
    flat = np.column_stack([z.real, z.imag, 0 * z.real])
    faces, removed = coarsening.coarser(flat, patch.faces, z, 300)
    image = np.exp(0.7j) * z + 3
    restored = np.full_like(image, np.nan)
    restored[np.unique(faces)] = image[np.unique(faces)]
    assert coarsening.reinsert_vertices(removed, flat, 1.0, restored)
    assert np.abs(restored - image).max() < 1e-12


def test_vertices_are_restored_without_folds_after_their_triangles_changed():
    patch, z = annulus_cut_open()
    faces, removed = coarsening.coarser(patch.points, patch.faces, z, 300)
    restored = np.full_like(z, np.nan)
    kept = np.unique(faces)
    coarse = surface(patch.points[kept], np.searchsorted(kept, faces))
    restored[kept] = coarse.relaxed(z[kept], 1.0, 40, 1e-6)
    assert coarsening.reinsert_vertices(removed, patch.points, 1.0, restored)
    assert (triangle_areas(restored[patch.faces]) > 0).all()


@pytest.mark.parametrize("theta", [1.0, 0.1])
def test_the_force_on_a_vertex_is_the_gradient_of_the_total_energy(theta):
    """Compared with the plain version of the core's functions, which tests/core compares with the core."""
    patch, z = annulus_cut_open()
    unit = patch.points / np.sqrt(patch.areas.sum())
    sheet = surface(patch.points, patch.faces)
    v = int(np.setdiff1d(np.arange(z.size), np.concatenate(patch.loops))[50])
    around = np.array([np.roll(face, -list(face).index(v))[1:] for face in patch.faces if v in face])

    def moved(by):
        u = z.copy()
        u[v] += by
        return sheet.energy(u, theta), plain._pull(unit, around, v, u, theta, 1.0, 0.0)

    (whole, (local, slope, xx, yy, xy)), h = moved(0), 1e-3 * np.abs(z[around] - z[v]).min()
    east, west, north, south = (moved(h * direction) for direction in (1, -1, 1j, -1j))
    assert east[0] - whole == pytest.approx(east[1][0] - local, rel=1e-6)
    assert slope == pytest.approx((east[0] - west[0] + 1j * (north[0] - south[0])) / (2 * h), rel=1e-3)
    turns = [(a[1][1] - b[1][1]) / (2 * h) for a, b in ((east, west), (north, south))]
    assert [xx, xy, xy, yy] == pytest.approx([w for t in turns for w in (t.real, t.imag)], rel=1e-3)


def test_multigrid_reaches_the_result_of_newtons_method(monkeypatch):
    patch, z = annulus_cut_open()
    sheet = surface(patch.points, patch.faces)
    exact = sheet.energy(sheet.relaxed(z, 1.0, 60, 1e-12), 1.0)
    monkeypatch.setattr(coarsening, "LARGE_VERTEX_COUNT", 100)
    monkeypatch.setattr("iccm.flattening.free.LARGE_VERTEX_COUNT", 100)
    energy = sheet.energy(multigrid.relaxed(sheet, patch.points, z, 1.0, 60, 1e-5), 1.0)
    assert exact - 1e-12 <= energy < exact * (1 + 2e-5)


def bumpy(x, y):
    """Noise that is stronger on one side: a coarser triangulation has less of its area, and other proportions."""
    noise = np.random.default_rng(4).standard_normal(x.size)
    return x, y, 0.4 * np.sin(3 * x + y) * np.sin(2 * y) + 0.012 * x**2 * noise


def relaxed_by_multigrid(monkeypatch, mesh, theta=1.0):
    """Return the energies of layouts by Newton's method and by multigrid, and the size of the largest system solved."""
    patch = disk_patch(mesh)
    start = flatten(patch, method="conformal")
    u, sheet = start.flat / np.sqrt(patch.areas.sum()), surface(patch.points, patch.faces)
    least = sheet.energy(sheet.relaxed(u, theta, 60, 1e-9), theta)
    monkeypatch.setattr(multigrid, "HUGE_VERTEX_COUNT", 2000)
    sizes, solve = [], Elastic.relaxed
    monkeypatch.setattr(
        Elastic, "relaxed", lambda self, u, *how: sizes.append(u.size) or solve(self, u, *how)
    )
    layout = multigrid.relaxed(surface(patch.points, patch.faces), patch.points, u, theta, 60, 1e-5)
    assert (triangle_areas(layout[patch.faces]) > 0).all()
    return least, sheet.energy(layout, theta), max(sizes), u.size


@pytest.mark.slow
@pytest.mark.parametrize(("place", "share"), [(dome, 2e-4), (bumpy, 2e-3)])
def test_a_huge_surface_is_as_even_as_by_newtons_method_without_its_factorisations(monkeypatch, place, share):
    least, energy, largest, count = relaxed_by_multigrid(monkeypatch, grid(93, 87, place))
    assert energy < (1 + share) * least and largest < count / 4


@pytest.mark.slow
def test_newtons_method_takes_over_where_multigrid_does_not_converge(monkeypatch):
    monkeypatch.setattr(multigrid, "MOST_CYCLES", 1)
    least, energy, largest, count = relaxed_by_multigrid(monkeypatch, grid(93, 87, bumpy))
    assert energy < (1 + 1e-4) * least and largest == count


def test_a_huge_surface_that_cannot_be_coarsened_is_relaxed_by_newtons_method(monkeypatch):
    monkeypatch.setattr(multigrid, "much_coarser", lambda *args: None)
    least, energy, largest, count = relaxed_by_multigrid(monkeypatch, grid(30, 70, dome))
    assert energy < (1 + 1e-4) * least and largest == count


def flattened_from_coarsest(monkeypatch, mesh, **how):
    """Return a flattening as of a huge surface, and the sizes of the surfaces for which LSCM was computed."""
    sizes, lscm = [], method.lscm
    monkeypatch.setattr(
        method, "lscm", lambda patch, loop: sizes.append(len(patch.points)) or lscm(patch, loop)
    )
    for module in (multigrid, method):
        monkeypatch.setattr(module, "HUGE_VERTEX_COUNT", 1500)
    return flatten(disk_patch(mesh), method="balanced", **how), sizes


@pytest.mark.parametrize("place", [dome, bumpy])
def test_a_huge_surface_needs_no_layout_of_all_its_vertices_to_start_from(monkeypatch, place):
    mesh = grid(73, 67, place)
    newton = flatten(disk_patch(mesh), method="balanced")
    layout, sizes = flattened_from_coarsest(monkeypatch, mesh)
    unit = newton.patch.points / np.sqrt(newton.patch.areas.sum())
    least, energy = (
        coarsening.gradient(sheet.patch.faces, unit, 1.0, method._unit(sheet))[0]
        for sheet in (newton, layout)
    )
    assert layout.method == "balanced" and overlap(layout) is None
    assert energy < 1.003 * least
    assert sizes and max(sizes) < len(mesh.points) / 4


def test_a_huge_surface_whose_coarse_layout_has_no_room_for_all_vertices_starts_from_a_layout_of_all(
    monkeypatch,
):
    monkeypatch.setattr(multigrid, "reinsert_vertices", lambda *given: False)
    mesh = grid(73, 67, dome)
    layout, sizes = flattened_from_coarsest(monkeypatch, mesh)
    assert overlap(layout) is None and max(sizes) == len(mesh.points)


def test_triangles_collapsed_without_a_layout_are_still_a_surface_with_as_many_holes():
    patch, _ = annulus_cut_open()
    bent = patch.points + np.column_stack([0 * patch.points[:, :2], np.sin(9 * patch.points[:, 0])])
    faces, removed = coarsening.coarser(bent, patch.faces, None, 300)
    left = np.unique(faces)
    shape = Triangles(np.searchsorted(left, faces), left.size)
    assert left.size < 700 and left.size + removed.vertex.size == len(bent)
    assert shape.crowded_edges == 0 and len(shape.loops()) == 2
    assert left.size - shape.edge_count + len(faces) == 0  # Euler's number of a ring
    assert np.allclose(removed.weights.sum(axis=1), 1)


def test_a_coarser_layout_agrees_at_the_remaining_vertices():
    patch, z = annulus_cut_open()
    layout = Flattening(patch, z, patch.loops[0], "balanced")
    assert coarsening.coarser_layout(layout, z.size + 1) is None  # there is none for a small surface
    coarse, kept = coarsening.coarser_layout(layout, z.size)
    assert kept.size < 0.5 * z.size and len(coarse.patch.loops) == 2 and overlap(coarse) is None
    assert np.array_equal(coarse.patch.points, patch.points[kept]) and np.array_equal(coarse.flat, z[kept])
    assert np.isin(kept[coarse.loop], layout.loop).all()


def test_the_seam_of_a_large_surface_grows_on_a_coarser_triangulation(monkeypatch):
    patch = disk_patch(sphere(40, 30), cut=True)
    monkeypatch.setattr(method, "COARSE_SEAM_VERTICES", 300)
    sizes, roughly = [], method._roughly
    monkeypatch.setattr(method, "_roughly", lambda start: sizes.append(len(start.flat)) or roughly(start))
    layout = flatten(patch, grow=True, method="balanced")
    assert len(layout.patch.seam) > len(patch.seam) and layout.strained(95) < method.STRETCHED_P95
    assert min(sizes) < 300 and sum(size >= len(patch.points) for size in sizes) == 1


def test_unnecessary_paths_of_a_seam_are_removed(monkeypatch):
    patch = disk_patch(sphere(40, 30), cut=True)
    start = method._start(patch, patch.loops[0])
    _, _, alone = method._with_seam(start, True, method.STRETCHED_P95)
    rim, ends, calls = np.concatenate(patch.loops), seams.ends, []
    neighbours = patch.faces[np.isin(patch.faces, rim).sum(axis=1) == 1]
    short = int(np.setdiff1d(neighbours, rim)[0])  # next to the seam: a cut there helps little

    def first_the_short_one(result, joins):
        calls.append(result)
        return [short] if len(calls) == 1 else ends(result, joins)

    monkeypatch.setattr(seams, "ends", first_the_short_one)
    layout, _, paths = method._with_seam(start, True, method.STRETCHED_P95)
    assert len(calls) > 1 and short not in paths and len(paths) <= len(alone) + 1
    assert layout.strained(95) < method.STRETCHED_P95 and overlap(layout) is None
