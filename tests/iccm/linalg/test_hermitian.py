"""Large Hermitian systems, compared with dense ones and libigl."""

import numpy as np
import pytest
import trimesh
from scipy.sparse import csr_matrix, diags

from iccm.linalg import hermitian, nested_dissection
from iccm.meshes import flatten
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.mesh import Mesh


def system(n, seed):
    """A Hermitian positive definite matrix over the neighbours of points on a surface."""
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    pairs = cKDTree(points).query_pairs(3 / np.sqrt(n), output_type="ndarray")
    values = rng.normal(size=len(pairs)) + 1j * rng.normal(size=len(pairs))
    half = csr_matrix((values, pairs.T), (n, n))
    whole = half + half.getH()
    most = 1 + np.asarray(abs(whole).sum(axis=1)).ravel()
    return hermitian.Hermitian(most, pairs.T, values), (whole + diags(most)).toarray(), points


@pytest.mark.parametrize("n", [1, 50, 97, 900])
def test_the_solution_is_that_of_the_dense_matrix(n):
    matrix, dense, points = system(n, n)
    right = np.exp(1j * np.arange(n))
    solution = hermitian.solve(matrix, points, right)
    assert solution == pytest.approx(np.linalg.solve(dense, right), abs=1e-12)


def test_parts_that_nothing_couples_are_solved_each():
    matrix, dense, points = system(300, 7)
    twice = hermitian.Hermitian(
        np.tile(matrix.diagonal, 2), np.hstack([matrix.ends, matrix.ends + 300]), np.tile(matrix.values, 2)
    )
    right = np.exp(1j * np.arange(600))
    solution = hermitian.solve(twice, np.vstack([points, 9 + points]), right)
    expected = [np.linalg.solve(dense, half) for half in (right[:300], right[300:])]
    assert solution == pytest.approx(np.concatenate(expected), abs=1e-12)


def test_entries_in_one_place_add_up():
    diagonal, ends, values = system(300, 4)[0]
    points, right = system(300, 4)[2], np.ones(300, complex)
    halves = hermitian.Hermitian(
        diagonal, np.hstack([ends, ends[::-1]]), np.append(0.3 * values, 0.7 * values.conj())
    )
    summed, repeated = (
        hermitian.solve(matrix, points, right)
        for matrix in (hermitian.Hermitian(diagonal, ends, values), halves)
    )
    assert repeated == pytest.approx(summed, abs=1e-12)


def test_parts_are_coupled_only_through_later_parts():
    matrix, dense, points = system(900, 1)
    order, nodes = nested_dissection.nested_dissection(matrix.ends, points)
    assert sorted(order) == list(range(900)) and nodes[-1][1] == 900
    coupled = dense[np.ix_(order, order)] != 0
    begins = {}
    for number, (start, _, children) in enumerate(nodes):
        begins[number] = min([start, *(begins[child] for child in children)])
        for row_child in children:
            for column_child in children:
                if row_child != column_child:
                    a, b = (slice(begins[child], nodes[child][1]) for child in (row_child, column_child))
                    assert not coupled[a, b].any()


def test_a_matrix_that_is_not_definite_is_refused():
    matrix, _, points = system(300, 2)
    matrix = matrix._replace(diagonal=matrix.diagonal - 1e3)
    with pytest.raises(np.linalg.LinAlgError):
        hermitian.solve(matrix, points, np.ones(300, complex))


def test_least_squares_of_large_patches_are_libigls(monkeypatch):
    cap = trimesh.creation.icosphere(4).slice_plane([0, 0, -0.6], [0, 0, 1])
    points = cap.vertices * (1 + 0.2 * np.sin(5 * cap.vertices[:, :1]))
    patch = disk_patch(Mesh.triangles("m", points, cap.faces))
    theirs = flatten.lscm(patch, patch.loops[0])
    monkeypatch.setattr(flatten, "LARGE_VERTEX_COUNT", 0)
    monkeypatch.setattr("igl.lscm", lambda *words: pytest.fail("libigl was asked"))
    ours = flatten.lscm(patch, patch.loops[0])
    assert ours == pytest.approx(theirs, abs=1e-9 * np.abs(theirs).max())
