"""Organic surfaces: seams within a bound of distortion, the same ones whatever the order of faces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from iccm.flattening import flatten, method, multigrid
from iccm.flattening.bisection import halves
from iccm.flattening.segmentation import charts_of, dilated
from iccm.meshes.disk_patch import open_piece, sound_piece
from iccm.meshes.flatten import overlap
from iccm.meshes.mesh import Mesh


def pear():
    """A closed surface without symmetries, uneven enough that one chart is distorted."""
    ball = trimesh.creation.icosphere(3)
    x, y, z = ball.vertices.T
    waist = 1 - 0.55 * np.exp(-6 * (z - 0.2) ** 2)
    points = np.column_stack([1.1 * waist * x + 0.2 * z**2, 0.8 * waist * y + 0.1 * x * z, 1.9 * z + 0.1 * y])
    return points, np.array(ball.faces)


def piece_of(points, faces, **attributes):
    return sound_piece(Mesh.triangles("pear", points, faces, **attributes))


def shuffled(points, faces, seed):
    """The same surface with noise and in another order, and the old number of each vertex."""
    draw = np.random.default_rng(seed)
    faces = faces[draw.permutation(len(faces))]
    faces = np.array([np.roll(face, turn) for face, turn in zip(faces, draw.integers(0, 3, len(faces)))])
    order = draw.permutation(len(points))
    noisy = points + 1e-9 * draw.standard_normal(points.shape)
    return noisy[order], np.argsort(order)[faces]


def middles(charts):
    ends = [chart.layout.patch.mesh.points[chart.layout.patch.seam] for chart in charts]
    return sorted(map(tuple, np.round(np.concatenate(ends).mean(axis=1), 5).tolist()))


@pytest.mark.slow
@pytest.mark.parametrize("bound", [None, 1.15])
def test_charts_meet_the_bound_of_distortion(bound):
    piece = piece_of(*pear())
    charts = charts_of(piece, grow=True, method="balanced", max_distortion=bound)
    assert dilated(charts) <= (bound or 1.5)
    assert (len(charts) == 1) == (bound is None)
    assert not any(overlap(chart.layout) for chart in charts)
    assert sorted(np.concatenate([chart.triangles for chart in charts])) == list(range(len(piece.faces)))


@pytest.mark.slow
@pytest.mark.parametrize("bound", [None, 1.15])
def test_seams_do_not_depend_on_noise_or_the_order_of_faces(bound):
    points, faces = pear()
    first, second = (
        middles(charts_of(piece_of(*surface), grow=True, method="balanced", max_distortion=bound))
        for surface in ((points, faces), shuffled(points, faces, 4))
    )
    assert first == second


def test_both_halves_are_connected_and_whole():
    points, faces = pear()
    label = halves(piece_of(points, faces))
    assert 0.1 < label.mean() < 0.9


@pytest.mark.parametrize("border", [{"uv"}, {"materials"}, {"normals"}])
@pytest.mark.parametrize("place", [3, 10])
def test_seams_prefer_borders_of_the_file(border, place):
    """The side of a tube opens where its file has a border, although all of its edges are equal."""
    sides = 16
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    angle = 2 * np.pi * k / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 2.0)])
    faces = np.stack(
        [np.column_stack([k, after, after + sides]), np.column_stack([k, after + sides, k + sides])]
    )
    faces = faces.transpose(1, 0, 2).reshape(-1, 3)
    turned = (faces - place) % sides + sides * (faces // sides)
    turned += (sides * 2) * (
        (turned % sides == 0) & (faces.min(axis=1) % sides == (place - 1) % sides)[:, None]
    )
    attributes = {
        "uv": {"uv": np.random.default_rng(2).random((4 * sides, 2)), "uv_corners": turned.ravel()},
        "normals": {
            "normals": np.repeat([[0, 0, 1.0], [1.0, 0, 0]], 2 * sides, axis=0),
            "normal_corners": turned.ravel(),
        },
        "materials": {"materials": np.repeat((k >= place).astype(int), 2)},
    }[min(border)]
    charts = charts_of(piece_of(points, faces, **attributes), grow=True, method="balanced")
    seam = np.concatenate([chart.layout.patch.seam for chart in charts])
    assert {tuple(sorted(edge)) for edge in seam.tolist()} <= {(place, place + sides), (0, sides)}


def ring(points):
    """Mark the vertices of a parallel of a ball."""
    z = points[:, 2]
    return np.isclose(z, z[z > 0].min())


def test_marked_seams_are_the_only_ones():
    ball = trimesh.creation.uv_sphere(count=(7, 16))
    points, faces = np.array(ball.vertices), np.array(ball.faces)
    edges = np.array(ball.edges_unique)
    rim = edges[ring(points)[edges].all(axis=1)]
    piece = piece_of(points, faces, seams=rim)
    charts = charts_of(piece, grow=True, method="balanced")
    assert len(charts) == 2 and sum(len(chart.layout.patch.seam) for chart in charts) == len(rim)
    seam = np.concatenate([chart.layout.patch.seam for chart in charts])
    assert {tuple(sorted(edge)) for edge in seam.tolist()} == {tuple(sorted(edge)) for edge in rim.tolist()}
    more = charts_of(piece, grow=True, method="balanced", max_distortion=1.1)
    assert len(more) > 2 and dilated(more) <= 1.1


def test_marked_seams_at_joined_vertices_are_found():
    """A file that repeats vertices may mark a seam by any of them."""
    ball = trimesh.creation.uv_sphere(count=(7, 16))
    points = np.array(ball.vertices)[np.array(ball.faces)].reshape(-1, 3)
    faces = np.arange(len(points)).reshape(-1, 3)
    flat = ring(points)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    mesh = replace(Mesh.triangles("ball", points, faces), seams=edges[flat[edges].all(axis=1)])
    assert len(charts_of(sound_piece(mesh), grow=True, method="balanced")) == 2


@pytest.mark.parametrize("crosses", [False, True])
def test_huge_closed_surfaces_are_laid_out_without_a_system_of_all_vertices(monkeypatch, crosses):
    """The seam grows on a coarser triangulation, from which the layout is refined, also where its outline crosses."""
    points, faces = trimesh.remesh.subdivide(*pear())
    piece = piece_of(points, faces)
    for module in (method, multigrid):
        monkeypatch.setattr(module, "HUGE_VERTEX_COUNT", 600)
    sizes, start, check = [], method._start, method.overlap

    def first_crosses(layout):
        large = len(layout.flat) > 600 and not calls
        calls.extend([layout] if large else [])
        return "crosses" if large else check(layout)

    calls = [] if crosses else [None]
    monkeypatch.setattr(method, "overlap", first_crosses)
    monkeypatch.setattr(
        method, "_start", lambda patch, loop: sizes.append(len(patch.points)) or start(patch, loop)
    )
    layout = flatten(
        open_piece(piece, cut=True), grow=True, method="balanced", purpose="texture", stretch=1.4
    )
    assert overlap(layout) is None and layout.strained(95) < 1.5
    assert sizes and max(sizes) < len(points) / 2
