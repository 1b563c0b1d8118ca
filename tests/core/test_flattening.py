"""Half-edge collapses and their reversal, compared with the same in plain Python."""

import numpy as np
import pytest

from iccm.flattening import coarsening
from tests.core.compare import run_both
from tests.core.reference import coarsening as plain
from tests.triangulations import irregular

BENT = np.array([0, 3 + 0.2j, 2.8 + 1.9j, 1.1 + 0.7j, 0.9 + 2.5j, -0.3 + 1.4j])


def surface(seed):
    """A bumpy surface and a layout of it without folds: (n, 3) points, (m, 3) faces and (n,) positions."""
    rng = np.random.default_rng(seed)
    z, faces, _ = irregular(BENT, 0.25, seed)
    height = 0.3 * np.sin(2 * z.real + 1) + 0.2 * z.imag**2 + 0.01 * rng.standard_normal(z.size)
    return np.column_stack([z.real, z.imag, height]), faces, z + 0.05 * z**2


def remove(
    faces, points, polar, z, n, starts, around, blocked, most, vertex, into, triangle, weights, ends, edges
):
    assert n == z.size and most == vertex.size and not polar
    return plain._round(
        faces, points, z, starts, around, blocked, most, vertex, into, triangle, weights, ends, edges
    )


@pytest.mark.parametrize("seed", range(2))
def test_collapses(monkeypatch, seed):
    points, faces, z = surface(seed)
    stay = np.array([3, 60, 61])

    def work():
        coarse, removed = coarsening.coarser(points, faces, z, z.size // 8, stay)
        return coarse, *removed

    compiled, expected = run_both(monkeypatch, coarsening, {"_remove": remove}, work)
    assert len(compiled[0]) < 0.5 * len(faces) and np.isin(stay, compiled[0]).all()
    for a, b in zip(compiled, expected, strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize(
    ("seed", "theta", "bent", "how"),
    [(0, 1.0, 0.05, {}), (0, 1.0, 0.2, {}), (1, 1.7, 0.08, {}), (1, 1.0, 0.06, {"q": 3.0, "share": 0.5})],
)
def test_removed_vertices_are_restored(monkeypatch, seed, theta, bent, how):
    """Up to rounding errors that Newton's steps propagate: powers and bisectors are computed by other functions.

    In a layout that is bent too much, the coarse triangles themselves fold.
    """
    points, faces, z = surface(seed)
    _, removed = coarsening.coarser(points, faces, z, z.size // 8)
    # another layout of the coarse triangles, in which the former positions of vertices are not always visible
    other_layout = z + bent * np.sin(9 * z.imag) * (1 + 0.5j)
    start = np.where(np.isin(np.arange(z.size), removed.vertex), np.nan, other_layout)

    def put_back(vertex, into, triangle, weights, starts, edges, count, points, theta, q, share, gain, u):
        assert (count, gain) == (vertex.size, plain.SMALL)
        return plain.put_back(vertex, into, triangle, weights, starts, edges, points, theta, q, share, u)

    def work():
        u = start.copy()
        return coarsening.reinsert_vertices(removed, points, theta, u, **how), u

    compiled, expected = run_both(monkeypatch, coarsening, {"_put_back": put_back}, work)
    assert compiled[0] == expected[0] == (bent < 0.1)
    assert np.allclose(compiled[1], expected[1], rtol=0, atol=1e-12, equal_nan=True)


def test_vertices_are_moved_one_by_one(monkeypatch):
    points, faces, z = surface(1)
    fixed = np.isin(np.arange(z.size), z.size - 1 - np.arange(9)) | (np.abs(z) > 0.9 * np.abs(z).max())
    bent = z + 0.03 * np.sin(9 * z.imag) * (1 + 0.5j)
    forces = 0.02 * z * np.exp(1j * z.real)

    def smooth(faces, points, count, starts, around, fixed, forces, sweeps, theta, q, share, gain, u):
        assert (count, gain) == (u.size, plain.SMALL)
        return plain.smooth(faces, points, starts, around, fixed, forces, sweeps, theta, q, share, u)

    def work():
        u = bent.copy()
        coarsening.smooth(faces, points, fixed, 2, 1.0, u, forces=forces, q=3.0, share=0.5)
        return u

    compiled, expected = run_both(monkeypatch, coarsening, {"_smooth": smooth}, work)
    assert np.allclose(compiled, expected, rtol=0, atol=1e-11)
    assert (compiled[fixed] == bent[fixed]).all() and np.abs(compiled - bent).max() > 1e-3


def test_gradient(monkeypatch):
    points, faces, z = surface(0)
    flat = points.copy()
    a, b, c = faces[7]
    flat[c] = flat[a] + 0.3 * (flat[b] - flat[a])  # a sliver
    bent = z + 0.03 * np.sin(9 * z.imag) * (1 + 0.5j)

    def gradient(faces, points, n, m, theta, q, share, u, slopes):
        assert (n, m) == (u.size, len(faces))
        return plain.gradient(faces, points, theta, q, share, u, slopes)

    def work():
        return coarsening.gradient(faces, flat, 0.7, bent, q=2.0, share=0.3)

    compiled, expected = run_both(monkeypatch, coarsening, {"_gradient": gradient}, work)
    assert compiled[0] == pytest.approx(expected[0], rel=1e-12)
    assert np.allclose(compiled[1], expected[1], rtol=1e-9, atol=1e-9 * np.abs(compiled[1]).max())
    folded = bent.copy()
    folded[faces[7, 0]] = 2 * bent[faces[7, 1]] - bent[faces[7, 0]]
    assert coarsening.gradient(faces, flat, 0.7, folded)[0] == np.inf


def test_interpolation_and_its_transpose(monkeypatch):
    points, faces, z = surface(1)
    _, removed = coarsening.coarser(points, faces, z, z.size // 8)

    def interpolate(vertex, corners, weights, count, step):
        return plain.interpolate(vertex, corners, weights, step)

    def restrict(vertex, corners, weights, count, forces):
        return plain.restrict(vertex, corners, weights, forces)

    def work():
        step, forces = z**2, np.exp(1j * z)
        coarsening.interpolate(removed, step)
        coarsening.restrict(removed, forces)
        return step, forces

    instead = {"_interpolate": interpolate, "_restrict": restrict}
    (step, forces), expected = run_both(monkeypatch, coarsening, instead, work)
    assert np.allclose(step, expected[0], rtol=0, atol=1e-12)
    assert np.allclose(forces, expected[1], rtol=0, atol=1e-12)
    kept = np.setdiff1d(np.arange(z.size), removed.vertex)
    assert np.vdot(np.exp(1j * z), step) == pytest.approx(np.vdot(forces[kept], step[kept]), rel=1e-12)
