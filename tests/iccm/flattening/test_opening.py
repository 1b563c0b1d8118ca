"""Polygons that other programs triangulate differently."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.flattening.opening import concave, open_up, tuck_in
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.mesh import Mesh, fans

GRID = np.arange(16).reshape(4, 4)
QUADS = np.stack([GRID[:-1, :-1], GRID[:-1, 1:], GRID[1:, 1:], GRID[1:, :-1]], axis=-1).reshape(-1, 4)


def polygons(points, faces):
    starts = np.cumsum([0, *map(len, faces)])
    return Mesh("sheet", np.array(points, float), np.concatenate(faces), starts)


def test_a_quad_that_a_vertex_makes_concave_is_opened_and_counts_until_then():
    x, y = np.meshgrid(range(4), range(4))
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    patch = disk_patch(polygons(points, QUADS))
    flat = points[patch.vertex, 0] + 1j * points[patch.vertex, 1]
    inner = int(np.flatnonzero(patch.vertex == 5)[0])
    flat[inner] = 1.7 + 1.7j  # beyond the diagonal from 6 to 9, before 10
    a, b, c = flat[patch.faces].T
    assert (((b - a).conj() * (c - a)).imag > 0).all()
    as_uv = lambda z: np.column_stack([z.real, z.imag])  # noqa: E731
    assert concave(as_uv(flat), patch) == 1
    opened = open_up(flat, patch, np.concatenate(patch.loops))
    assert concave(as_uv(opened), patch) == 0
    assert np.flatnonzero(opened != flat).size == 1
    place = dict(zip(patch.vertex, opened))
    for quad in QUADS:  # by hand: all triples of corners have the orientation of the whole
        for p, q, r in combinations([place[k] for k in quad], 3):
            assert ((q - p).conj() * (r - p)).imag > 0


def test_fans_are_those_of_quads_and_of_polygons_that_are_convex_in_space():
    t = 2 * np.pi * np.arange(5) / 5
    ring = np.column_stack([np.cos(t), np.sin(t), 0 * t])
    dented = ring * [[0.1], [1], [1], [1], [1]]
    corners, face = fans(polygons(np.concatenate([ring, dented]), [np.arange(5), np.arange(5, 10)]))
    assert (face == 0).all()
    assert sorted(map(tuple, np.sort(corners, axis=1))) == list(combinations(range(5), 3))
    assert len(fans(Mesh.triangles("t", ring, [[0, 1, 2]]))[0]) == 0


@pytest.mark.parametrize(
    "height, room, moved", [(1e-3, 0, [7, 8]), (0, 1e-3, [1, 2, 3, 4, 5, 7, 8]), (0, 1e-5, [])]
)
def test_vertices_cut_off_by_a_chord_are_moved_beyond_it(height, room, moved):
    """A cap on a square whose outline leaves it a thousandth of its height, or nothing: it is extended by that."""
    arc = np.exp(1j * np.linspace(0, np.pi, 7))
    cap = np.concatenate([arc, [0.2 + 0.4j, -0.2 + 0.4j]])
    below = np.array([1, -1, -1 - 2j, 1 - 2j, -0.5 - 1j, 0.5 - 1j, 0.1 - 0.4j, -0.1 - 1.5j])
    z = np.concatenate([cap, below[2:]])
    numbers = np.array([0, 6, *range(9, 15)])
    parts = [(cap, np.arange(9)), (below, numbers)]
    faces = np.concatenate(
        [vertices[Delaunay(np.column_stack([w.real, w.imag])).simplices] for w, vertices in parts]
    )
    mesh = Mesh.triangles("cap", np.column_stack([z.real, z.imag, 0 * z.real]), faces)
    patch = disk_patch(mesh)
    flat = z[patch.vertex]
    flat = np.where(patch.vertex < 7, flat.real + 1j * height * flat.imag, flat)
    assert (up(flat, patch.faces) <= 0).any()
    tucked = tuck_in(flat, patch, room)
    assert (up(tucked, patch.faces) > 0).all() == bool(moved)
    assert sorted(patch.vertex[tucked != flat]) == moved


def up(z, faces):
    """Twice the signed areas."""
    a, b, c = z[faces].T
    return ((b - a).conj() * (c - a)).imag
