"""Polygons that programs cut in other ways than iccm does."""

from itertools import combinations

import numpy as np

from iccm.flattening.opening import concave, open_up
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
    found = open_up(flat, patch, np.concatenate(patch.loops))
    assert concave(as_uv(found), patch) == 0
    assert np.flatnonzero(found != flat).size == 1
    place = dict(zip(patch.vertex, found))
    for quad in QUADS:  # by hand: every three corners turn as the whole
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
