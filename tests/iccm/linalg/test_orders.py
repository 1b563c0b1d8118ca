"""Both factorisations, in all orders, compared with SciPy's on random meshes."""

import numpy as np
import pytest
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import Delaunay

from iccm.linalg import ordering
from iccm.linalg.cholesky import Factor, back_substitute, factorise, system_of
from iccm.linalg.hermitian import Hermitian, solve
from iccm.meshes.topology import Triangles


def mesh(count, seed):
    """Points (n, 3) of a bumpy surface, triangles, and a Hermitian matrix over its edges, positive definite."""
    rng = np.random.default_rng(seed)
    xy = rng.random((count, 2))
    faces = Delaunay(xy).simplices.astype(np.int64)
    shape = Triangles(faces, count)
    once = np.flatnonzero((shape.twin < 0) | (shape.twin > np.arange(shape.twin.size)))
    ends = np.stack([shape.tail[once], shape.head[once]])
    values = rng.standard_normal(once.size) + 1j * rng.standard_normal(once.size)
    most = sum(np.bincount(end, np.abs(values), count) for end in ends) + rng.random(count) + 0.1
    return np.column_stack([xy, np.sin(9 * xy.sum(axis=1))]), faces, Hermitian(most, ends, values)


def expected(matrix, right):
    half = coo_array((matrix.values, tuple(matrix.ends)), shape=(right.size,) * 2).tocsc()
    return spsolve((half + half.conj().T + diags_array(matrix.diagonal)).tocsc(), right)


def by_blocks(faces, matrix, right):
    """With a 2 × 2 block [[x, -y], [y, x]] for each entry x + iy."""
    system = system_of(faces, np.empty(0, np.int64), right.size)
    blocks, factor, step = np.zeros((system.columns.size, 4)), Factor.of(system), np.empty_like(right)
    entry = {
        (row, system.columns[k]): k
        for row, (first, end) in enumerate(zip(system.starts, system.starts[1:]))
        for k in range(first, end)
    }
    blocks[system.diagonal, 0] = blocks[system.diagonal, 3] = matrix.diagonal
    for (i, j), value in zip(system.position[matrix.ends.T].tolist(), matrix.values.tolist()):
        z = value if i < j else value.conjugate()
        blocks[entry[min(i, j), max(i, j)]] = z.real, -z.imag, z.imag, z.real
    assert factorise(system, blocks, -right, factor)
    back_substitute(system, factor, step)
    return step


@pytest.mark.parametrize("large", [0, 10**9])
@pytest.mark.parametrize(("count", "seed"), [(3, 0), (5, 1), (60, 2), (700, 3), (2500, 4)])
def test_solutions_are_scipys(count, seed, large, monkeypatch):
    monkeypatch.setattr(ordering, "LARGE_VERTEX_COUNT", large)  # for more, SuperLU finds the order
    points, faces, matrix = mesh(count, seed)
    right = np.exp(1j * np.arange(count)) * np.arange(1, count + 1)
    expected_values = expected(matrix, right)
    assert solve(matrix, points, right) == pytest.approx(expected_values, rel=1e-9, abs=1e-9)
    assert by_blocks(faces, matrix, right) == pytest.approx(expected_values, rel=1e-9, abs=1e-9)


def test_parts_of_a_mesh_that_nothing_joins():
    (points, faces, matrix), shift = mesh(90, 5), 90
    two_parts = Hermitian(
        np.tile(matrix.diagonal, 2), np.hstack([matrix.ends, matrix.ends + shift]), np.tile(matrix.values, 2)
    )
    right = np.arange(180.0) + 1j
    expected_values = expected(two_parts, right)
    assert by_blocks(np.vstack([faces, faces + shift]), two_parts, right) == pytest.approx(
        expected_values, rel=1e-9
    )
    assert solve(two_parts, np.vstack([points, points + 7]), right) == pytest.approx(
        expected_values, rel=1e-9
    )
