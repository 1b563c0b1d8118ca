"""Kernels of triangulations, against the same in plain Python: equal bits."""

import numpy as np
import pytest

from iccm.balanced.errors import Stuck
from iccm.balanced.meshing import delaunay, mesh
from iccm.maps.triangulated import adjacency
from iccm.plane import polygon_area
from tests.core.compare import run_both
from tests.core.reference import meshing as plain


def star(rng, count):
    """A simple polygon of area one without symmetry, star-shaped around 0."""
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radius = 1 + 0.4 * np.cos(3 * angle + rng.uniform(0, 6)) + 0.1 * rng.standard_normal(count)
    z = radius * np.exp(1j * angle)
    return z / np.sqrt(polygon_area(z))


def sizes(rng, area):
    return mesh.Sizes(-1 - 1.1j, 0.4, area * rng.uniform(0.3, 1, (5, 7)))


def clip_ears(z, n, faces, across):
    assert n == z.size
    return plain.clip_ears(z, *np.empty((4, n), np.int64), faces, across)


def insert(z, border, given, faces, across, triangles, links, stack, room):
    assert room == stack.size
    return plain._insert_given(z, border, given, faces, across, triangles, stack, links)


def remove_holes(faces, across, triangles, first, last, links, given, stack, room):
    assert room == stack.size and given == links.size
    return plain._carve(faces, across, triangles, first, last, links, stack)


def refine(
    z, given, room, faces, across, triangles, links, stack, stack_room, x, y, side, areas, columns, rows
):
    assert room == z.size and stack_room == stack.size and areas.shape == (columns, rows)
    mark, cavity = np.zeros(len(faces), np.int64), np.empty(4000, np.int64)
    grid = mesh.Sizes(complex(x, y), side, areas)
    stack[0] = 0
    vertices, triangles[0] = plain._refine_and_split(
        z, given, faces, across, triangles[0], stack, 0, links, mark, cavity, grid
    )
    return vertices


def compared(monkeypatch, *args, steps):
    def work():
        try:
            return mesh.triangulate(*args)
        except Stuck as error:
            return (str(error),)

    with monkeypatch.context() as patched:
        patched.setattr(delaunay, "_clip_ears", clip_ears)
        plainly = work()
    compiled, reference = run_both(monkeypatch, mesh, steps, work)
    for a, b, c in zip(compiled, reference, plainly, strict=True):
        assert np.array_equal(a, b) and np.array_equal(a, c)
    return compiled


@pytest.mark.parametrize("seed", range(3))
def test_a_polygon(monkeypatch, seed):
    rng = np.random.default_rng(seed)
    outline = star(rng, 40)
    _, faces = compared(monkeypatch, outline, sizes(rng, 0.02), steps={"_refine": refine})
    assert len(faces) > 100


@pytest.mark.parametrize("seed", range(3))
def test_a_polygon_with_a_hole(monkeypatch, seed):
    rng = np.random.default_rng(seed)
    outline = star(rng, 30)
    hole = 0.3 * np.abs(outline).min() * star(rng, 9).conj() + 0.05
    args = outline, sizes(rng, 0.03), mesh.NOTHING, None, [hole]
    steps = {"_insert": insert, "_remove_holes": remove_holes, "_refine": refine}
    _, faces = compared(monkeypatch, *args, steps=steps)
    assert len(faces) > 50


@pytest.mark.parametrize("seed", range(3))
def test_a_polygon_with_lines(monkeypatch, seed):
    """One that edges of the first triangulation cross."""
    rng = np.random.default_rng(seed)
    outline = star(rng, 30)
    count = 7
    x = 0.6 * np.abs(outline).min() * np.sort(rng.uniform(-1, 1, count))
    line = x + 1j * x[::-1] * rng.uniform(-1, 1, count)
    links = np.append(np.arange(1, count), -1)
    steps = {"_insert": insert, "_refine": refine}
    compared(monkeypatch, outline, sizes(rng, 0.03), line, links, steps=steps)


def test_lines_that_cross_cannot_be_kept(monkeypatch):
    square = np.array([0, 1.1, 1 + 1j, 1j]) - 0.4 - 0.5j
    cross = np.array([-0.2, 0.31, -0.2j, 0.22j])
    links = np.array([1, -1, 3, -1])
    result = compared(monkeypatch, square, mesh.Sizes.even(0.1), cross, links, steps={"_insert": insert})
    assert len(result) == 1


def test_a_clockwise_polygon_has_no_ears(monkeypatch):
    clockwise = np.array([0, 1j, 1 + 1.1j, 1.2 + 0.5j, 1])
    faces, across = np.empty((9, 3), np.int64), np.full((9, 3), -1)
    calls = lambda: delaunay.clip_ears(clockwise, faces, across)  # noqa: E731
    compiled, expected = run_both(monkeypatch, delaunay, {"_clip_ears": clip_ears}, calls)
    assert compiled == expected == -1


def triangulated(rng, count):
    """A triangulation that is not Delaunay: ears of a polygon."""
    z = star(rng, count)
    faces, across = np.empty((count, 3), np.int64), np.full((count, 3), -1)
    triangles = delaunay.clip_ears(z, faces, across)
    return z, faces[:triangles].copy(), across[:triangles].copy()


@pytest.mark.parametrize("seed", range(3))
def test_flips_make_a_triangulation_delaunay_but_for_links(seed):
    rng = np.random.default_rng(seed)
    z, faces, across = triangulated(rng, 60)
    t = int(np.flatnonzero(across[:, 0] >= 0)[7])
    links = np.full(60, -1)
    links[faces[t, 1]] = faces[t, 2]
    results = []
    for flip_all in (
        lambda *args: delaunay.legalise(*args),
        lambda z, f, a, stack, links: plain.legalise(z, f, a, stack, 0, links),
    ):
        f, a = faces.copy(), across.copy()
        stack = np.zeros(500, np.int64)
        stack[0], stack[1 : 1 + len(f)] = len(f), np.arange(len(f))
        flip_all(z, f, a, stack, links)
        assert stack[0] == 0
        results.append((f, a))
    assert not np.array_equal(results[0][0], faces)
    assert all(np.array_equal(compiled, expected) for compiled, expected in zip(*results))
    assert any({faces[t, 1], faces[t, 2]} <= set(row) for row in results[0][0].tolist())


@pytest.mark.parametrize("seed", range(3))
def test_an_edge_is_recovered(seed):
    rng = np.random.default_rng(seed)
    z, faces, across = triangulated(rng, 50)
    z = z.copy()
    v, w = 3, 31
    results = []
    for recover in (mesh.recover, plain.recover):
        f, a = faces.copy(), across.copy()
        done = recover(z, f, a, len(f), v, w, np.full(50, -1))
        results.append((done, f, a))
    assert results[0][0] == results[1][0]
    assert all(np.array_equal(compiled, expected) for compiled, expected in zip(*results))


@pytest.mark.parametrize("seed", range(3))
def test_neighbours(seed):
    rng = np.random.default_rng(seed)
    _, faces, _ = triangulated(rng, 50)
    faces = rng.permuted(faces, axis=0)
    faces = faces[: len(faces) - 3 * seed]
    across = adjacency.neighbours(faces, 50)
    expected = np.full_like(faces, -1)
    sides = {(f[(k + 1) % 3], f[(k + 2) % 3]): t for t, f in enumerate(faces.tolist()) for k in range(3)}
    for t, f in enumerate(faces.tolist()):
        for k in range(3):
            expected[t, k] = sides.get((f[(k + 2) % 3], f[(k + 1) % 3]), -1)
    assert np.array_equal(across, expected)
