"""Automatic pins between two closed meshes with the same connectivity, and the cut through pins."""

import itertools

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from iccm.io.shapes import seam_order as module
from iccm.io.shapes.seam_order import MAPS_TRIED, PINNED_VERTICES, same_vertices
from iccm.meshes.disk_patch import nearest, sound_piece
from iccm.meshes.mesh import Mesh


def written(path, points, faces):
    rows = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(rows))
    return str(path)


@pytest.fixture
def ball():
    """200 points of a sphere, with triangles oriented outwards."""
    points = np.random.default_rng(0).normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices
    inward = np.linalg.det(points[faces]) < 0
    return points, np.where(inward[:, None], faces[:, ::-1], faces)


@pytest.mark.parametrize("shuffled", [False, True])
def test_vertices_are_matched_by_place_in_any_order(shuffled, ball, tmp_path):
    points, faces = ball
    rng = np.random.default_rng(1)
    order = rng.permutation(len(points)) if shuffled else np.arange(len(points))
    place = np.argsort(order)  # the new index of each vertex
    new_faces = place[faces][rng.permutation(len(faces))] if shuffled else faces
    longer = points[order] * [1, 1.2, 3] + 0.05 * np.sin(7 * points[order])
    pins = same_vertices(
        (written(tmp_path / "a.obj", points, faces), written(tmp_path / "b.obj", longer, new_faces)),
        (None, None),
    )
    assert len({end for _, end in pins}) == PINNED_VERTICES
    for start, end in pins:
        assert place[int(start[1:]) - 1] == int(end[1:]) - 1


def test_other_connectivity_has_no_matching_vertices(ball, tmp_path):
    points, faces = ball
    a, b = faces[0], next(f for f in faces[1:] if len({*faces[0], *f}) == 4)
    (p,), (q,) = {*a} - {*b}, {*b} - {*a}
    k = list(a).index(p)
    u, v = a[(k + 1) % 3], a[(k + 2) % 3]
    flipped = np.array([[p, u, q], [q, v, p], *(f for f in faces[1:] if list(f) != list(b))])
    assert len(flipped) == len(faces)
    specs = written(tmp_path / "a.obj", points, faces), written(tmp_path / "b.obj", points, flipped)
    assert same_vertices(specs, (None, None)) == []


def test_open_meshes_have_none(ball, tmp_path):
    points, faces = ball
    spec = written(tmp_path / "a.obj", points, faces[1:])
    assert same_vertices((spec, spec), (None, None)) == []


@pytest.mark.parametrize("twisted, chosen", [([False], 0), ([True, False], 1), ([True] * MAPS_TRIED, 0)])
def test_the_first_seam_whose_map_is_not_twisted_is_used(twisted, chosen, monkeypatch, ball, tmp_path):
    points, faces = ball
    points = points * [1, 1.2, 2]
    stops = [
        int(np.argmax(points @ direction))
        for direction in ([0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 1, 0.5], [-1, -1, 0])
    ]
    specs = written(tmp_path / "a.obj", points, faces), written(tmp_path / "b.obj", points, faces)
    orders, tried_orders = list(itertools.permutations(range(len(stops))))[::7], []
    monkeypatch.setattr(module, "agreed_orders", lambda *args: [np.array(order) for order in orders])
    monkeypatch.setattr(module, "same_seam", lambda *args: None)
    monkeypatch.setattr(
        module, "_twists", lambda *args: tried_orders.append(args) or twisted[len(tried_orders) - 1]
    )
    pins = [(f"v{stop + 1}", f"v{stop + 1}") for stop in stops]
    assert module.seam_order(specs, (None, None), pins) == (list(orders[chosen]), None)
    assert len(tried_orders) == len(twisted)


@pytest.mark.slow
def test_a_surface_is_twisted_only_if_landmarks_are_swapped(ball, tmp_path):
    points, faces = ball
    whole = sound_piece(Mesh.triangles("ball", points * [1, 1, 3], faces))
    stops = np.array(nearest(whole, np.array([[0, 0, 3], [0, 1, 1], [0, 1, -1], [0, 0, -3.0]])))
    assert not module._twists(whole, whole, np.column_stack([stops, stops]), None)
    assert module._twists(whole, whole, np.column_stack([stops, stops[[0, 2, 1, 3]]]), None)
