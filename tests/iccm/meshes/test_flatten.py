"""Flattening: known conformal maps with the order of convergence; cuts; repairs."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.flattening import flatten, tutte
from iccm.meshes import cut as seam
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.flatten import Flattening, farthest, lscm, overlap, upright
from iccm.meshes.layout import turned_over
from iccm.meshes.mesh import Mesh
from iccm.meshes.stretch import stretches
from tests.cases import some_fast


def disk_grid(rings):
    """Vertices (complex, |z| <= 1) and triangles of a disk with 6 k vertices on ring k."""
    z = [np.zeros(1, complex)] + [
        k / rings * np.exp(2j * np.pi * (np.arange(6 * k) + 0.5 * (k % 2)) / (6 * k))
        for k in range(1, rings + 1)
    ]
    z = np.concatenate(z)
    from scipy.spatial import Delaunay

    faces = Delaunay(np.column_stack([z.real, z.imag])).simplices
    p = z[faces]
    area = ((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag
    faces = faces[np.abs(area) > 1e-9]
    area = area[np.abs(area) > 1e-9]
    faces[area < 0] = faces[area < 0][:, ::-1]
    return z, faces


def hemisphere(z):
    """Stereographic projection of the unit disk onto the half sphere: conformal."""
    q = 1 + np.abs(z) ** 2
    return np.column_stack([2 * z.real / q, 2 * z.imag / q, (2 - q) / q])


def saddle(z):
    """Enneper's minimal surface over |z| <= 0.8: conformal by Weierstrass."""
    u, v = 0.8 * z.real, 0.8 * z.imag
    return np.column_stack([u - u**3 / 3 + u * v**2, v - v**3 / 3 + v * u**2, u**2 - v**2])


def bumpy(z):
    """A surface of revolution z = 0.4 exp(-4 r²), where r is the radius in space, over its conformal radius."""
    r = np.linspace(1e-9, 1, 4001)
    slope = -3.2 * r * np.exp(-4 * r**2)
    extra = (np.sqrt(1 + slope**2) - 1) / r  # d log rho = sqrt(1 + h'²) dr / r
    log_rho = np.log(r) + np.concatenate([[0], np.cumsum(0.5 * (extra[1:] + extra[:-1]) * np.diff(r))])
    radius = np.interp(np.abs(z), np.exp(log_rho - log_rho[-1]), r, left=0.0)
    radius[np.abs(z) == 0] = 0
    out = radius * np.exp(1j * np.angle(z))
    return np.column_stack([out.real, out.imag, 0.4 * np.exp(-4 * radius**2)])


SURFACES = [hemisphere, saddle, bumpy]


def surface(make, rings):
    z, faces = disk_grid(rings)
    return z, disk_patch(Mesh.triangles(make.__name__, make(z), faces))


@pytest.mark.parametrize("make", SURFACES)
def test_lscm_keeps_angles_within_the_discretisation_error(make):
    errors = []
    for rings in (6, 12, 24):
        _, piece = surface(make, rings)
        layout = flatten(piece)
        assert layout.method == "lscm"
        errors.append(layout.report()["dilatation"]["p95"] - 1)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 1 / 24  # the edge length
    assert rates.min() > 0.8, (errors, rates)


def grid_mesh(n, m, place, name="grid"):
    """Quads over n × m points of the unit square, mapped to space by `place(x, y)`."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    number = np.arange(n * m).reshape(n, m)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(
        -1, 4
    )
    return Mesh(
        name, np.column_stack(place(x.ravel(), y.ravel())), quads.ravel(), 4 * np.arange(len(quads) + 1)
    )


def torus(n=24, m=12):
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = 2 + 0.7 * np.cos(v)
    points = np.stack([r * np.cos(u), 0.7 * np.sin(v), r * np.sin(u)], axis=-1).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    quads = np.stack([i, np.roll(i, -1, 0), np.roll(i, -1, (0, 1)), np.roll(i, -1, 1)], axis=-1)
    return Mesh("torus", points, quads.reshape(-1), 4 * np.arange(n * m + 1))


def test_a_plane_mesh_is_unchanged_up_to_its_centre():
    mesh = grid_mesh(7, 5, lambda x, y: (2 * x, y, 0 * x))
    layout = flatten(disk_patch(mesh))
    expected = mesh.points[:, 0] + 1j * mesh.points[:, 1]
    moved = layout.flat - expected[layout.patch.vertex]
    assert np.abs(moved - moved[0]).max() < 1e-9
    assert layout.report()["dilatation"]["max"] == pytest.approx(1, abs=1e-9)
    assert layout.boundary.area == pytest.approx(2)


@pytest.mark.parametrize(
    "place",
    [
        lambda x, y: (0 * x, y, -x),  # faces +x: right is -z
        lambda x, y: (x, 0 * x, -y),  # a floor: up is -z
        lambda x, y: (-x, y, 0 * x),  # faces -z
    ],
)
def test_a_wall_or_floor_is_seen_from_outside_and_upright(place):
    layout = flatten(disk_patch(grid_mesh(4, 4, place)))
    number = np.argsort(layout.patch.vertex)
    corners = layout.flat[number][[0, 12, 15, 3]]  # (0,0) (1,0) (1,1) (0,1)
    assert np.allclose(corners - corners[0], [0, 1, 1 + 1j, 1j], atol=1e-8)


def test_holes_stay_holes_and_the_longest_loop_is_the_outline():
    mesh = grid_mesh(11, 11, lambda x, y: (x, y, 0.2 * x * y))
    keep = np.ones(100, bool)
    keep[[22, 23, 77]] = False
    piece = disk_patch(mesh.part(keep, "holes"))
    assert [len(loop) for loop in piece.loops] == [40, 6, 4]
    layout = flatten(piece)
    assert layout.report()["holes"] == 2
    assert layout.loop.size == 40
    assert overlap(layout) is None


@pytest.mark.parametrize("loop", [0, 4])
def test_a_missing_loop_is_refused(loop):
    mesh = grid_mesh(4, 4, lambda x, y: (x, y, 0 * x))
    with pytest.raises(InputError, match=f"no boundary {loop}; choose 1"):
        flatten(disk_patch(mesh), loop=loop)


def ramp(name="ramp"):
    """More than a full turn of a winding ramp: flattened it must overlap itself."""
    angle = 2.4 * np.pi
    return grid_mesh(
        61,
        13,
        lambda x, y: (
            (0.3 + 1.7 * y) * np.sin(angle * x),
            0.1 * angle * x,
            (0.3 + 1.7 * y) * np.cos(angle * x),
        ),
        name,
    )


def test_a_flattening_that_overlaps_is_repaired_with_a_note():
    piece = disk_patch(ramp())
    plain = Flattening(piece, upright(piece, lscm(piece, piece.loops[0])), piece.loops[0], "lscm")
    assert overlap(plain) is not None
    layout = flatten(piece)
    assert layout.method == "conformal"
    assert overlap(layout) is None
    assert "crosses itself" in layout.notes[0]
    assert layout.report()["dilatation"]["p95"] < 1.05


def test_tuttes_map_is_one_to_one_even_with_a_hole():
    mesh = ramp()
    keep = np.ones(mesh.sizes.size, bool)
    keep[300] = False
    piece = disk_patch(mesh.part(keep, "holed ramp"))
    flat = tutte.convex(piece, piece.loops[0])
    assert overlap(Flattening(piece, flat, piece.loops[0], "tutte")) is None


def test_a_hole_turned_inside_out_is_an_overlap():
    """Joukowski's map z + 1/z flips no triangle of a ring around the unit circle, and covers an ellipse twice."""
    radii, spokes = [0.4, 0.7, 1, 1.5, 3], 24
    z = np.concatenate([r * np.exp(2j * np.pi * np.arange(spokes) / spokes) for r in radii])
    k = np.arange(spokes * (len(radii) - 1)).reshape(-1, spokes)
    quads = np.stack([k, k + spokes, np.roll(k, -1, 1) + spokes, np.roll(k, -1, 1)], axis=-1).reshape(-1, 4)
    middle = z.size + np.arange(len(quads))
    faces = np.vstack([np.column_stack([quads[:, [j, (j + 1) % 4]], middle]) for j in range(4)])
    z = np.concatenate([z, z[quads].mean(axis=1)])
    piece = disk_patch(Mesh.triangles("ring", np.column_stack([z.real, z.imag, 0 * z.real]), faces))
    z = piece.points[:, 0] + 1j * piece.points[:, 1]
    outline = max(piece.loops, key=lambda loop: np.abs(z[loop]).max())
    assert overlap(Flattening(piece, z, outline, "itself")) is None
    twice = Flattening(piece, z + 1 / z, outline, "Joukowski")
    assert not twice.flipped.size
    assert overlap(twice) == "an inverted hole"


@pytest.mark.parametrize("holed", [False, True])
def test_a_torus_is_cut_along_edges_of_the_file_into_one_disk(holed):
    mesh = torus()
    if holed:
        keep = np.ones(mesh.sizes.size, bool)
        keep[[40, 41]] = False
        mesh = mesh.part(keep, "torus with a hole")
    with pytest.raises(InputError, match=r"has 1 handle.*--no-cut"):
        disk_patch(mesh)
    piece = disk_patch(mesh, cut=True)
    assert piece.genus == 0
    assert len(piece.loops) == 1 + holed
    assert len(piece.seam) == 24 + 12
    border = piece.triangles.twin < 0
    assert piece.drawn[border].all()
    layout = flatten(piece, grow=True)
    assert layout.report()["seam_edges"] >= 36
    assert overlap(layout) is None


def test_a_closed_surface_is_refused_with_advice_and_cut_on_demand():
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    mesh = Mesh.triangles("tetrahedron", np.vstack([np.zeros(3), np.eye(3)]), faces)
    with pytest.raises(InputError, match=r"is closed.*--no-cut"):
        disk_patch(mesh)
    piece = disk_patch(mesh, cut=True)
    assert len(piece.loops) == 1
    assert piece.triangles.count == 5
    assert overlap(flatten(piece)) is None


def test_the_seam_grows_until_areas_are_even():
    z, faces = disk_grid(8)
    bag = hemisphere(3.0 * z)  # a sphere with a small opening
    piece = disk_patch(Mesh.triangles("bag", bag, faces))
    spread = {}
    for grow in (False, True):
        cut = disk_patch(closed_bag(bag, faces, z), cut=True)
        low, _, high = flatten(cut, grow=grow).report()["log10_area"].values()
        spread[grow] = high - low
    assert len(piece.loops) == 1
    assert spread[True] <= spread[False]
    assert spread[True] < 2


def closed_bag(points, faces, z):
    """The bag closed by a fan of triangles."""
    rim = np.flatnonzero(np.abs(z) > 1 - 1e-9)
    rim = rim[np.argsort(np.angle(z[rim]))]
    lid = np.column_stack([np.roll(rim, -1), rim, np.full(rim.size, len(points))])
    return Mesh.triangles("closed bag", np.vstack([points, [0, 0, -1.0]]), np.vstack([faces, lid]))


def test_stretches_of_a_known_affine_map():
    space = np.array([[[0, 0, 0], [1, 0, 0], [0, 0, 1.0]]])
    major, minor = stretches(space, np.array([[0, 3, 2j]]))
    assert (major[0], minor[0]) == (pytest.approx(3), pytest.approx(2))
    assert stretches(space, np.array([[0, 3, -2j]]))[1][0] == pytest.approx(-2)


@pytest.mark.parametrize("count", [50, 3000])
def test_the_farthest_points_of_a_curve(count):
    t = 2 * np.pi * np.arange(count) / count
    points = np.column_stack([3 * np.cos(t + 0.3), np.sin(t + 0.3), 0 * t])
    a, b = farthest(points)
    assert np.linalg.norm(points[a] - points[b]) > 6 * np.cos(2 * np.pi / count)


@pytest.mark.parametrize("seed", range(12))
def test_a_torus_with_holes_anywhere_becomes_one_piece_without_handles(seed):
    rng = np.random.default_rng(seed)
    mesh = torus(*rng.integers(4, 9, 2))
    keep = rng.random(mesh.sizes.size) < 0.85
    try:
        piece = disk_patch(mesh.part(keep, "holey torus"), cut=True)
    except InputError as error:  # two holes that meet at a corner
        assert "touches itself" in str(error) or "pieces" in str(error)
        return
    assert piece.genus == 0
    assert not piece.triangles.components().any()
    assert piece.drawn[piece.triangles.twin < 0].all()
    assert overlap(flatten(piece)) is None


def test_a_cut_without_loops_leaves_one_disk_without_holes():
    mesh = torus()
    keep = np.ones(mesh.sizes.size, bool)
    keep[[40, 41, 150]] = False
    closed = mesh.part(keep, "torus with two holes")
    whole = whole_patch(closed)
    piece = whole.cut(whole.triangles.along(seam.spanning_cut(whole)))
    assert (piece.genus, len(piece.loops)) == (0, 1)


def whole_patch(mesh):
    """The patch before it is cut open."""
    import iccm.meshes.disk_patch as module

    seen = []
    with pytest.MonkeyPatch.context() as change:
        change.setattr(module, "open_to_disk", lambda whole: seen.append(whole) or whole)
        disk_patch(mesh, cut=True)
    return seen[0]


@pytest.mark.parametrize("seed", some_fast(range(60), 12))
def test_random_meshes_are_flattened_without_overlap_or_refused_in_one_line(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    if seed % 2:
        points = rng.integers(-2, 3, size=(n, 3)).astype(float)
        mesh = Mesh.triangles("noise", points, rng.integers(0, n, size=(int(rng.integers(1, 8)), 3)))
    else:
        steep = rng.choice([0.1, 1, 10])
        mesh = grid_mesh(n, n, lambda x, y: (x, y, steep * rng.random(x.size)))
        mesh = mesh.part(rng.random(mesh.sizes.size) < rng.choice([0.6, 0.95, 1]), "noise")
    for cut in (False, True):
        try:
            layout = flatten(disk_patch(mesh, cut=cut), grow=cut)
        except InputError as error:
            assert str(error).startswith("noise: ")
            assert "\n" not in str(error)
        else:
            assert overlap(layout) is None
            assert layout.boundary.area > 0


def test_triangles_that_nobody_sees_are_not_counted_as_flipped():
    space = np.array([[[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    flipped = space[:, [0, 2, 1], :2]
    assert turned_over(flipped) == {"flipped": 2, "degenerate": 0}
    assert turned_over(flipped, space) == {"flipped": 1, "degenerate": 0}
