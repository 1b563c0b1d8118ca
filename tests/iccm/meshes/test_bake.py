"""Baking: the triangle of each texel, and its colour."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.maps.extended_inverse import ExtendedInverse, bends
from iccm.maps.harmonic import HarmonicMap
from iccm.meshes import bake as baking
from iccm.meshes.bake import BakedPart
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.layout import layout
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import Mesh
from iccm.meshes.rasterise import affine, open_edges, rasterise
from iccm.meshes.surface import Surface
from iccm.meshes.topology import Triangles
from iccm.pixels.sampler import Sampler
from iccm.pixels.warp import Texture

SQUARE = np.concatenate(
    [np.linspace(a, b, 16, endpoint=False) for a, b in ((0, 1), (1, 1 + 1j), (1 + 1j, 1j), (1j, 0))]
)


def g(z):
    """A conformal map of the unit square."""
    return z + 0.15 * z**2


def mapped():
    return HarmonicMap(SQUARE, g(SQUARE), 0 * SQUARE)


def square_grid(n, place=lambda z: z):
    """The square's image under `place` as a flat mesh of n² quads, with UVs at the preimages."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    z = (x + 1j * y).ravel()
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1)
    w = place(z)
    points = np.column_stack([w.real, w.imag, 0 * w.real])
    return Mesh(
        "grid", points, quads, 4 * np.arange(n * n + 1), np.column_stack([z.real, z.imag]), quads.copy()
    )


def smooth_texture(size=256):
    """Smooth colours, so that filters do not matter: red right, green up, blue a wave."""
    t = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(t, 1 - t)
    return np.stack([x, y, 0.5 + 0.4 * np.sin(5 * x + 3 * y)], axis=-1).astype(np.float32)


# ---- rasteriser


def test_every_texel_of_a_triangulated_rectangle_belongs_to_exactly_one_triangle():
    rng = np.random.default_rng(0)
    from scipy.spatial import Delaunay

    corners = np.array([[0, 0], [32, 0], [32, 20], [0, 20]])
    inner = (
        np.floor(rng.uniform([1, 1], [31, 19], size=(80, 2)) * 2) / 2
    )  # many vertices and edges on texel centres
    points = np.unique(np.vstack([corners, inner]), axis=0)
    faces = Delaunay(points).simplices
    turned = np.where(rng.random(len(faces))[:, None] < 0.5, faces, faces[:, ::-1])
    ownership = rasterise(points[turned], 32, 20)
    assert ownership.overlaps == 0
    assert (ownership.owner >= 0).all()


def test_a_texel_belongs_to_the_triangle_that_holds_its_centre():
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, 16, size=(1, 3, 2))
    ownership = rasterise(corners, 16, 16)
    y, x = np.mgrid[:16, :16] + 0.5
    weights = np.linalg.solve(
        np.vstack([corners[0].T, np.ones(3)]), np.stack([x.ravel(), y.ravel(), np.ones(256)])
    )
    assert ((ownership.owner.ravel() >= 0) == (weights > 0).all(axis=0)).all()


def test_overlaps_are_counted():
    triangle = np.array([[0, 0], [8, 0], [0, 8]], float)
    ownership = rasterise(np.stack([triangle, triangle + 20, triangle + 2]), 16, 16)
    shared = sum((x + 0.5) + (y + 0.5) < 8 for x in range(2, 8) for y in range(2, 8))
    assert ownership.overlaps == shared
    covered = sum(x + y + 1 < 8 for x in range(8) for y in range(8))
    assert rasterise(np.stack([triangle, triangle, triangle]), 16, 16).overlaps == covered


def test_triangles_outside_are_cut_off_or_wrap_around():
    corners = np.array([[[14, 2], [22, 2], [14, 10]]], float)
    plain, wrapped = (rasterise(corners, 16, 16, wrap=w) for w in (False, True))
    assert (plain.owner[:, :2] < 0).all()
    assert (wrapped.owner[2, [14, 15, 0, 1, 2, 3, 4]] == 0).all()


def test_texels_that_a_border_touches_go_to_it():
    corners = np.array([[[4.2, 4.2], [4.4, 4.2], [4.2, 4.4]]])  # smaller than a texel, off its centre
    ownership = rasterise(corners, 8, 8, border=np.array([True]))
    assert ownership.owner[4, 4] == 0
    assert not ownership.centre.any()
    assert (ownership.owner >= 0).sum() == 1


def test_the_affine_interpolation_of_corners():
    corners = np.array([[[0, 0], [4, 1], [1, 5]]], float)
    values = corners[..., 0] * 2 + 3j * corners[..., 1] + 1
    assert affine(corners, values)[0] == pytest.approx([1, 2, 3j])


def test_borders_of_charts():
    tetrahedron = Triangles(np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), 4)
    assert not open_edges(tetrahedron.faces, tetrahedron.twin).any()
    torn = tetrahedron.faces.copy()
    torn[3, 0] = 4  # the last triangle has its own coordinate at vertex 1
    assert open_edges(torn, tetrahedron.twin).tolist() == [True, True, False, True]
    fan = Triangles(tetrahedron.faces[:3], 4)
    assert open_edges(fan.faces, fan.twin).tolist() == [True, True, True]


# ---- the inverse, and triangles under points


def test_points_outside_the_image_take_the_nearest_boundary_point():
    pull = ExtendedInverse(mapped())
    inside = mapped()(np.array([0.3 + 0.4j, 0.9 + 0.1j]))
    assert np.abs(pull(inside) - [0.3 + 0.4j, 0.9 + 0.1j]).max() < 0.05 / 1024
    assert pull.outside == 0
    out = pull(np.array([g(0.5) - 0.01j]))
    assert abs(out[0] - 0.5) < 2e-3
    assert (pull.outside, pull.away) == (1, pytest.approx(0.01, rel=0.05))


def test_the_bend_of_the_inverse_is_the_error_of_linear_interpolation():
    pull = ExtendedInverse(mapped())
    z = np.array([0.4 + 0.4j, 0.5 + 0.4j, 0.45 + 0.5j])
    w = g(z)
    middle = 0.5 * (w[[0, 1, 2]] + w[[1, 2, 0]])
    missed = np.abs(pull(middle) - 0.5 * (z[[0, 1, 2]] + z[[1, 2, 0]])).max()
    assert bends(np.array([[0, 1, 2]]), w, *pull.slopes(z))[0] == pytest.approx(missed, rel=0.05)


def test_points_are_located_in_their_triangles():
    layout = flatten(disk_patch(square_grid(9)))
    locate = Locator(layout)
    rng = np.random.default_rng(2)
    low, high = layout.boundary.box
    z = low + rng.random(500) * (high - low).real + 1j * rng.random(500) * (high - low).imag
    triangle, weights = locate(z)
    assert (weights >= 0).all()
    assert np.abs(np.einsum("pk,pk->p", weights, layout.flat[layout.patch.faces[triangle]]) - z).max() < 1e-12
    triangle, weights = locate(np.array([high + 0.3]))  # outside: the nearest border point
    assert np.einsum("pk,pk->p", weights, layout.flat[layout.patch.faces[triangle]])[0] == pytest.approx(
        high, abs=1e-9
    )


# ---- baking


def baked(mesh, size=64, texture=None, pull=None, kind="colour", **options):
    piece = disk_patch(mesh)
    layout_found = flatten(piece)
    # the flattening of a flat mesh is itself, moved: undo that, so that the map is the one that is known
    shift = (mesh.points[piece.vertex[0], 0] + 1j * mesh.points[piece.vertex[0], 1]) - layout_found.flat[0]
    object.__setattr__(layout_found, "flat", layout_found.flat + shift)
    texture = texture if texture is not None else Texture(smooth_texture(), (0, 1 + 1j), transfer="linear")
    charts = layout("grid", mesh.uv, mesh.uv_corners[piece.corner], piece.triangles.twin, size, size)
    pull = ExtendedInverse(mapped()) if pull is None else pull
    read = Sampler(texture, kind=kind)
    return baking.bake([BakedPart(layout_found, pull, texture)], charts, read, **options), charts


@pytest.mark.parametrize("cells", [2, 8, 32])
def test_baking_into_the_preimages_gives_the_texture_back(cells):
    """UVs at f⁻¹ of the vertices: the atlas is the source's square again, except that the mesh is piecewise linear."""
    (pixels, report), charts = baked(square_grid(cells, g), 64)
    expected = smooth_texture(64)
    assert charts.owners.centre.all()
    bend = 0.3 / 8 * 2 / cells**2  # |g''| e² / 8 on a diagonal e
    # the harmonic approximation of g is off by 4e-5
    assert np.abs(pixels[..., :2] - expected[..., :2]).max() < bend + 5e-4
    assert report["outside_distance"] < 0.01


def test_interpolated_and_solved_texels_agree():
    (solved, report), _ = baked(square_grid(6, g), 64, max_error=1e-9)
    (quick, two), _ = baked(square_grid(6, g), 64, max_error=0.5)
    assert report["exact_triangles"] == 72
    assert two["exact_triangles"] < 72
    assert np.abs(solved - quick).max() < 1.0 / 256


class Recorder(Texture):
    """A texture that records the derivatives of requested samples."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        object.__setattr__(self, "seen", [])

    def places(self, z, right, down):
        self.seen.append((z, right, down))
        return super().places(z, right, down)


@pytest.mark.parametrize("max_error", [1e-9, 10.0])
def test_texels_have_the_footprint_of_their_inverse_under_a_sheared_map(max_error):
    """If the coordinates are the preimages, a texel is a texel of the source again, for any map in between."""
    phi, psi = 2 * SQUARE + 0.1 * SQUARE**2, (0.3 + 0.5j) * SQUARE.conj()
    sheared = HarmonicMap(SQUARE, phi, psi)
    texture = Recorder(smooth_texture(), (0, 1 + 1j), transfer="linear")
    mesh = square_grid(16, lambda z: 2 * z + 0.1 * z**2 + (0.3 + 0.5j) * z.conj())
    baked(mesh, 32, texture, ExtendedInverse(sheared), max_error=max_error)
    z, right, down = (np.concatenate(parts) for parts in zip(*texture.seen))
    inner = (np.abs(z.real - 0.5) < 0.45) & (np.abs(z.imag - 0.5) < 0.45)
    assert inner.sum() > 500
    assert right[inner] == pytest.approx(np.full(inner.sum(), 1 / 32), abs=1e-3)
    assert down[inner] == pytest.approx(np.full(inner.sum(), -1j / 32), abs=1e-3)


def test_an_oblong_picture_has_a_scale_of_its_own_in_each_direction():
    uv, faces = np.array([[0, 0], [1, 0], [1, 1], [0, 0.75]]), np.array([[0, 1, 2], [0, 2, 3]])
    grid = layout("grid", uv, faces, Triangles(faces, 4).twin, 48, 16)
    assert grid.shape == (16, 48)
    # y points down
    assert grid.corners.tolist() == [[[0, 16], [48, 16], [48, 0]], [[0, 16], [48, 0], [0, 4]]]
    assert grid.owners.owner[15, 47] == 0 and grid.owners.owner[8, 1] == 1 and grid.owners.owner[1, 1] == -1


def test_mirrored_and_shifted_charts_show_the_same_colours():
    mesh = square_grid(6, g)
    (plain, _), _ = baked(mesh, max_error=1e-9)
    flip = replace_uv(mesh, lambda uv: np.column_stack([1 - uv[:, 0], uv[:, 1]]))
    (mirrored, report), _ = baked(flip, max_error=1e-9)
    assert report["mirrored_triangles"] == 72
    # on an edge, either triangle may determine the footprint
    assert np.abs(mirrored[:, ::-1] - plain).max() < 1e-3
    (shifted, report), _ = baked(replace_uv(mesh, lambda uv: uv + np.array([2, -1])), max_error=1e-9)
    assert report["outside_triangles"] == 72
    assert np.abs(shifted - plain).max() < 1e-3


def replace_uv(mesh, change):
    from dataclasses import replace

    return replace(mesh, uv=change(mesh.uv))


def test_overlapping_coordinates_are_reported():
    mesh = replace_uv(square_grid(4), lambda uv: np.column_stack([np.abs(uv[:, 0] - 0.5), uv[:, 1]]))
    (_, report), _ = baked(mesh, 32, pull=ExtendedInverse(HarmonicMap(SQUARE, SQUARE, 0 * SQUARE)))
    assert report["overlapping_texels"] == 32 * 32 // 2


def test_charts_are_counted_and_seams_padded():
    mesh = replace_uv(square_grid(4), lambda uv: 0.25 + 0.5 * uv)
    identity = ExtendedInverse(HarmonicMap(SQUARE, SQUARE, 0 * SQUARE))
    (bare, report), charts = baked(mesh, 64, pull=identity, padding=0)
    (some, _), _ = baked(mesh, 64, pull=identity, padding=5)
    (full, _), _ = baked(mesh, 64, pull=identity, padding=-1)
    covered = charts.owners.owner >= 0
    assert report["charts"] == 1
    assert (bare[~covered] == 0).all()
    assert (some[32, 11:16] == some[32, 16]).all()
    assert (some[32, :10] == 0).all()
    assert (full[32, :16] == full[32, 16]).all()
    assert (some[covered] == bare[covered]).all()
    (usual, report), _ = baked(mesh, 64, pull=identity)
    assert report["padding"] == -1 and (usual == full).all()


def test_alpha_and_integers_keep_their_form():
    pixels = (255 * np.dstack([smooth_texture(64), np.ones((64, 64))])).astype(np.uint8)
    pixels[:, :32, 3] = 0
    (out, _), _ = baked(square_grid(4, g), 32, Texture(pixels, (0, 1 + 1j), alpha=3))
    assert out.dtype == np.uint8
    assert out.shape == (32, 32, 4)
    assert set(np.unique(out[:, [4, 28], 3])) == {0, 255}


@pytest.mark.parametrize("value", [np.nan, 1e9, 30.0])
def test_absurd_coordinates_are_refused(value):
    mesh = square_grid(2)
    mesh.uv[3, 0] = value
    with pytest.raises(InputError, match="grid: texture coordinates"):
        piece = disk_patch(mesh)
        layout("grid", mesh.uv, mesh.uv_corners[piece.corner], piece.triangles.twin, 8, 8)


# ---- normals

FLAT = np.array([128, 128, 255], np.uint8)


def stored(n, down=False):
    """Normals (..., 3) as bytes, with 128 for zero."""
    n = np.asarray(n, float) * ([1, -1, 1] if down else [1, 1, 1])
    return np.rint(n / np.linalg.norm(n, axis=-1, keepdims=True) * 127 + 128).astype(np.uint8)


def one_normal(n, down=False):
    """A texture with the same normal everywhere, as data rather than colours."""
    pixels = np.broadcast_to(stored(n, down), (16, 16, 3)).copy()
    return Texture(pixels, (0, 1 + 1j), transfer="linear")


@pytest.mark.parametrize("error", [1e-9, 10.0], ids=["solved", "interpolated"])
@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize(
    ("place", "matrix"),
    [
        (lambda uv: uv, [[1, 0], [0, 1]]),
        # rotated by 90 degrees to the left
        (lambda uv: np.column_stack([1 - uv[:, 1], uv[:, 0]]), [[0, -1], [1, 0]]),
        (lambda uv: np.column_stack([1 - uv[:, 0], uv[:, 1]]), [[-1, 0], [0, 1]]),  # mirrored
        (lambda uv: uv[:, ::-1], [[0, 1], [1, 0]]),
        (
            lambda uv: np.column_stack([uv[:, 0] + 0.4 * uv[:, 1], uv[:, 1]]) / 1.4,
            [[1, 0], [0, 1]],
        ),  # sheared
    ],
    ids=["same", "turned", "mirrored", "transposed", "sheared"],
)
def test_normals_are_expressed_in_the_frame_of_the_chart(place, matrix, down, error):
    """On the surface, the frame is the direction in which u increases and, perpendicular to it, the side where v
    does.
    """
    n = np.array([0.6, 0.3, 0.74])
    mesh = replace_uv(square_grid(4), place)
    identity = ExtendedInverse(HarmonicMap(SQUARE, SQUARE, 0 * SQUARE))
    kind = "normal-down" if down else "normal"
    (out, _), charts = baked(mesh, 32, one_normal(n, down), identity, kind=kind, max_error=error, padding=0)
    expected = stored(np.append(np.array(matrix) @ n[:2], n[2]), down)
    inside = charts.owners.centre
    assert inside.sum() > 300
    assert np.abs(out[inside].astype(int) - expected).max() <= 1


def test_normals_rotate_with_their_map():
    """The map's angle is that of its derivative; a flat normal stays exactly flat."""
    mesh, n = square_grid(6, g), np.array([0.6, 0.3, 0.74])
    chart = replace_uv(mesh, lambda uv: square_of(mesh.points[:, :2]))
    (out, _), charts = baked(chart, 64, one_normal(n), kind="normal", padding=0, max_error=1e-9)
    y, x = np.nonzero(charts.owners.centre)
    low, size = extent(mesh.points[:, :2])
    w = (x + 0.5) / 64 * size + low[0] + 1j * ((1 - (y + 0.5) / 64) * size + low[1])
    z = (-1 + np.sqrt(1 + 0.6 * w)) / 0.3  # the inverse of g
    turn = (1 + 0.3 * z) / np.abs(1 + 0.3 * z)
    flat = (n[0] + 1j * n[1]) * turn
    expected = stored(np.column_stack([flat.real, flat.imag, np.full(z.size, n[2])]))
    assert np.abs(np.angle(turn)).max() > 0.2
    off = np.abs(out[y, x].astype(int) - expected).max(axis=1)
    deep = (np.abs(z.real - 0.5) < 0.45) & (
        np.abs(z.imag - 0.5) < 0.45
    )  # at the boundary the polygon differs from the curve
    assert off[deep].max() <= 1
    assert off.max() <= 5
    (level, _), _ = baked(chart, 64, one_normal([0, 0, 1]), kind="normal", padding=-1)
    assert (level == FLAT).all()


def extent(xy):
    """Lower left corner and longer side of points (n, 2)."""
    return xy.min(axis=0), np.ptp(xy, axis=0).max()


def square_of(xy):
    """Points moved and scaled into the unit square."""
    low, size = extent(xy)
    return (xy - low) / size


@pytest.mark.parametrize(
    ("place", "matrix"),
    [
        (lambda uv: np.column_stack([1 - uv[:, 1], uv[:, 0]]), [[0, 1], [-1, 0]]),
        (lambda uv: np.column_stack([1 - uv[:, 0], uv[:, 1]]), [[-1, 0], [0, 1]]),
    ],
    ids=["turned", "mirrored"],
)
def test_normals_of_a_textured_mesh_come_from_the_frame_of_its_chart(place, matrix):
    """The source's own chart is rotated or mirrored on the surface, the target's is not."""
    mesh, n = square_grid(4), np.array([0.6, 0.3, 0.74])
    flattening = flatten(disk_patch(mesh))
    object.__setattr__(
        flattening, "flat", flattening.flat + (mesh.points[0, :2] @ [1, 1j] - flattening.flat[0])
    )
    uv = place(mesh.uv)[mesh.uv_corners[flattening.patch.corner]]
    source = Surface.of(Locator(flattening), uv, (16, 16))
    faces = mesh.uv_corners[flattening.patch.corner]
    grid = layout("grid", mesh.uv, faces, flattening.patch.triangles.twin, 32, 32)
    identity = ExtendedInverse(HarmonicMap(SQUARE, SQUARE, 0 * SQUARE))
    out, _ = baking.bake(
        [BakedPart(flattening, identity, source)], grid, Sampler(one_normal(n), kind="normal")
    )
    expected = stored(np.append(np.array(matrix) @ n[:2], n[2]))
    assert np.abs(out.astype(int) - expected).max() <= 1


def test_normals_need_three_channels():
    grey = Texture(np.full((8, 8, 1), 128, np.uint8), (0, 1 + 1j))
    with pytest.raises(InputError, match="normal map needs 3"):
        baked(square_grid(2), 8, grey, kind="normal")


def test_a_triangle_as_wide_as_the_picture_keeps_its_last_column():
    """The triangle at the right border is not mistaken for one that wrapped around from the left."""
    (out, _), _ = baked(square_grid(1), 8, pull=ExtendedInverse(HarmonicMap(SQUARE, SQUARE, 0 * SQUARE)))
    assert np.abs(out[:, :, 0] - (np.arange(8) + 0.5) / 8).max() < 0.01
