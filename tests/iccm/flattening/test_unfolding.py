"""Nets of hard surfaces: known nets, invariance, and no overlap."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh

from iccm.arrays import xy_of
from iccm.flattening.segmentation import charts_of, dilated
from iccm.flattening.unfolding import Faceted
from iccm.flattening.whole import flatten_each
from iccm.meshes.disk_patch import sound_piece
from iccm.meshes.flatten import overlap
from iccm.meshes.mesh import Mesh
from iccm.meshes.patch import patch_of


def piece_of(surface):
    return sound_piece(Mesh.triangles("piece", surface.vertices, surface.faces))


def prism(*polygon, height):
    """A prism over a polygon, of which each side is two triangles."""
    z, n = np.array(polygon, complex), len(polygon)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(xy_of(z))))
    number = {complex(corner): k for k, corner in enumerate(z)}
    lid = np.array([[number[complex(*xy)] for xy in part.exterior.coords[:3]] for part in triangles])
    a, b, c = z[lid].T
    lid = np.where((((b - a).conj() * (c - a)).imag < 0)[:, None], lid[:, ::-1], lid)
    k, after = np.arange(n), (np.arange(n) + 1) % n
    sides = np.concatenate([np.column_stack([k, after, after + n]), np.column_stack([k, after + n, k + n])])
    points = np.concatenate([np.column_stack([xy_of(z), np.full(n, x)]) for x in (0.0, height)])
    return trimesh.Trimesh(points, np.concatenate([lid[:, ::-1], lid + n, sides]), process=False)


def nets(piece, **options):
    return charts_of(piece, grow=True, method="balanced", **options)


def length(charts):
    return sum(chart.seam for chart in charts)


def outline(chart):
    return shapely.Polygon(xy_of(chart.layout.flat[chart.layout.loop]))


SHAPES = {
    "cube": trimesh.creation.box((1, 1, 1)),
    "plank": trimesh.creation.box((6, 1.5, 0.3)),
    "house": prism(0, 4, 4 + 2.5j, 2 + 4j, 2.5j, height=5),
    "stairs": prism(0, 3, 3 + 1j, 2 + 1j, 2 + 2j, 1 + 2j, 1 + 3j, 3j, height=2),
    "arrow": prism(1j, 3 + 1j, 3, 5 + 1.5j, 3 + 3j, 3 + 2j, 2j, height=0.5),
    "cylinder": trimesh.creation.cylinder(1, 3, sections=24),
    "cone": trimesh.creation.cone(1, 2, sections=24),
}


@pytest.mark.parametrize("name", SHAPES)
def test_hard_surfaces_become_one_net_without_distortion(name):
    piece = piece_of(SHAPES[name])
    (chart,) = nets(piece)
    layout = chart.layout
    assert overlap(layout) is None and not layout.flipped.size
    assert layout.dilatation.max() < 1.001 and layout.strain.max() < 1.001
    assert outline(chart).area == pytest.approx(piece.areas.sum(), rel=1e-4)


def test_a_cube_becomes_a_cross():
    """A row of four squares with one on either side of the second."""
    (chart,) = nets(piece_of(trimesh.creation.box((1, 1, 1))))
    cross = outline(chart)
    assert length([chart]) == pytest.approx(7) and cross.length == pytest.approx(14)
    assert shapely.oriented_envelope(cross).area == pytest.approx(12)
    ring = np.array(cross.exterior.coords)
    counts = np.array([np.unique(np.round(np.sort(np.abs(ring @ axis)), 6)).size for axis in np.eye(2)])
    assert counts.max() >= 3


@pytest.mark.parametrize("size", [(6, 1.5, 0.3), (2, 1, 0.6), (3, 3, 0.2)])
def test_a_box_is_cut_along_its_shortest_edges(size):
    """Five edges are joined, a longest spanning tree of the faces: three of the longest, one of the middle length."""
    long, middle, short = sorted(size, reverse=True)
    total = 4 * (long + middle + short)
    charts = nets(piece_of(trimesh.creation.box(size)))
    assert len(charts) == 1 and length(charts) == pytest.approx(total - 3 * long - 2 * middle)


def up_in(layout, axis):
    """The direction of the model's up on each triangle in the plane, and the slope's sine."""
    piece = layout.patch
    corners, z = piece.points[piece.faces], layout.flat[piece.faces]
    height = corners[..., axis]
    edges = np.roll(z, -2, axis=1) - np.roll(z, -1, axis=1)
    return 1j * (height * edges).sum(axis=1) / (2 * piece.areas)


@pytest.mark.parametrize("name", ["cube", "plank", "stairs", "arrow"])
def test_a_picture_is_upright_on_all_sides_of_standing_nets(name):
    (charts,) = flatten_each([piece_of(SHAPES[name])], grow=True, method="balanced", standing=True)
    ups = np.concatenate([up_in(layout, 1) for layout in charts])
    assert sum(len(layout.patch.faces) for layout in charts) == len(SHAPES[name].faces)
    steep = np.abs(ups) > 0.1
    assert steep.any() and np.abs(np.angle(ups[steep]) - np.pi / 2).max() < np.radians(1)


def test_a_floor_is_laid_along_its_edges():
    """Its sides are turned by 20 degrees in the model; the picture follows them, with the model's back up."""
    floor = trimesh.Trimesh([[0, 0, 0], [5, 0, 0], [5, 0, -2], [0, 0, -2]], [[0, 1, 2], [0, 2, 3]])
    floor.apply_transform(trimesh.transformations.rotation_matrix(np.radians(20), (0, 1, 0)))
    ((layout,),) = flatten_each([piece_of(floor)], grow=True, method="balanced", standing=True)
    sides = layout.flat[np.roll(layout.loop, -1)] - layout.flat[layout.loop]
    assert np.abs(sides.real * sides.imag).max() < 1e-9
    back = up_in(layout, 2)  # z is to the front
    assert np.abs(np.angle(-back) - np.pi / 2).max() < np.radians(21)


def test_a_cylinder_becomes_a_strip_and_two_lids():
    radius, height, sides = 1.0, 3.0, 24
    (chart,) = nets(piece_of(trimesh.creation.cylinder(radius, height, sections=sides)))
    edge = 2 * radius * np.sin(np.pi / sides)
    assert length([chart]) == pytest.approx(height + 2 * (sides - 1) * edge)


def seam_middles(piece, charts):
    """The sorted middles of the seams."""
    ends = piece.mesh.points[np.concatenate([chart.layout.patch.seam for chart in charts])]
    middles = np.round(ends.mean(axis=1), 5) + 0.0
    return sorted(map(tuple, middles))


@pytest.mark.parametrize("name", ["cube", "plank", "stairs", "cylinder"])
@pytest.mark.parametrize("seed", [1, 2])
def test_seams_depend_neither_on_noise_nor_on_the_order_of_faces(name, seed):
    surface, draw = SHAPES[name], np.random.default_rng(seed)
    piece = piece_of(surface)
    faces = np.array(surface.faces)[draw.permutation(len(surface.faces))]
    faces = np.array([np.roll(face, turn) for face, turn in zip(faces, draw.integers(0, 3, len(faces)))])
    points = np.array(surface.vertices) + 1e-9 * draw.standard_normal((len(surface.vertices), 3))
    order = draw.permutation(len(points))
    shuffled = sound_piece(Mesh.triangles("shuffled", points[order], np.argsort(order)[faces]))
    assert seam_middles(shuffled, nets(shuffled)) == seam_middles(piece, nets(piece))


def blocks(*cells):
    """The surface of boxes of 1 × 1.3 × 0.7 at cells of a grid, of which each face is two triangles."""
    cells, faces = np.array(cells), []
    for axis, side in np.ndindex(3, 2):
        step, across, ahead = np.eye(3, dtype=int)[[axis, (axis + 1) % 3, (axis + 2) % 3]]
        beside = cells + (1 if side else -1) * step
        first = cells[~(beside[:, None] == cells).all(axis=2).any(axis=1)] + side * step
        face = np.stack([first, first + across, first + across + ahead, first + ahead], axis=1)
        faces.append(face if side else face[:, ::-1])
    points, number = np.unique(np.concatenate(faces).reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(-1, 4)
    return trimesh.Trimesh(
        points * [1, 1.3, 0.7], np.concatenate([number[:, :3], number[:, [0, 2, 3]]]), process=False
    )


@pytest.mark.parametrize(
    "cells",
    [
        [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1), (1, 0, 1)],
        [(0, -1, -1), (0, -1, 0), (0, 0, 0), (1, -1, -1), (1, -1, 0)],
    ],
)
def test_faces_that_meet_again_in_the_plane_do_not_overlap_after_rotation(cells):
    """Faces that come to lie side by side in a net are kept apart, whatever packing does to it."""
    charts = nets(piece_of(blocks(*cells)))
    assert dilated(charts) < 1.001
    for chart in charts:
        for turn in np.exp(1j * np.linspace(0, 2 * np.pi, 40)):
            assert not overlap(replace(chart.layout, flat=turn * chart.layout.flat))


def test_organic_pieces_stay_one_chart():
    piece = piece_of(trimesh.creation.icosphere(3))
    assert Faceted(piece).hard_share == 0
    (chart,) = nets(piece)
    assert dilated([chart]) < 1.5


def test_one_chart_is_kept_on_request_and_within_the_bound():
    piece = piece_of(trimesh.creation.box((1, 1, 1)))
    whole = nets(piece, charts="one")
    assert dilated(whole) > 1.4 and length(whole) < 7
    assert length(nets(piece, max_distortion=2.0)) == pytest.approx(length(whole))


def test_polygons_are_not_cut_along_their_diagonals():
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    mesh = replace(Mesh.triangles("quads", points, np.array([[0, 1, 2]])), corners=np.ravel(quads))
    piece = sound_piece(replace(mesh, starts=4 * np.arange(7)))
    ends = piece.mesh.points[nets(piece)[0].layout.patch.seam]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) == pytest.approx(np.ones(7))


def test_a_surface_of_slivers_keeps_all_of_its_faces():
    """Rows of points on one edge make triangles without area, whose normals are noise."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, -1]], float)
    faces = np.array([[0, 1, 3], [1, 2, 3], [0, 2, 1], [0, 4, 2]])
    charts = nets(patch_of("slivers", points, faces))
    assert np.sort(np.concatenate([chart.triangles for chart in charts])).tolist() == [0, 1, 2, 3]
    assert not any(overlap(chart.layout) for chart in charts)


def comb(teeth):
    """A flat bar with teeth, whose sides are one strip that is far longer than wide."""
    top = [k + z for k in range(teeth - 1, -1, -1) for z in (0.6 + 2j, 0.6 + 14j, 14j, 2j)]
    return piece_of(prism(0, teeth - 0.4, *top, height=1.5))


def test_long_strips_are_cut_where_they_would_waste_texture():
    piece = comb(20)
    charts = nets(piece)
    assert sum(len(chart.triangles) for chart in charts) == len(piece.faces)
    assert dilated(charts) < 1.01 and not any(overlap(chart.layout) for chart in charts)
    boxes = [shapely.oriented_envelope(shapely.MultiPoint(xy_of(chart.layout.flat))) for chart in charts]
    area = piece.areas.sum()
    assert sum(box.area for box in boxes) < 2.5 * area
    assert max(box.length for box in boxes) < 5 * np.sqrt(area)


def test_nets_are_as_long_as_allowed():
    surface = Faceted(comb(8))
    side = np.sqrt(surface.piece.areas.sum())
    for longest in (1.5 * side, 2.5 * side):
        net = surface.net(longest)
        charts = [xy_of(net.flat[net.chart == k].ravel()) for k in range(net.chart.max() + 1)]
        assert max(np.linalg.norm(np.ptp(chart, axis=0)) for chart in charts) <= 1.001 * longest
        assert len(charts) > 1
    assert surface.net().chart.max() + 1 < len(charts)
