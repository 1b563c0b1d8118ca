"""The block factorisation, compared with dense linear algebra."""

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.linalg.cholesky import Factor, back_substitute, factorise, system_of


@pytest.fixture(scope="module")
def meshed():
    angles = 2 * np.pi * np.arange(24) / 24
    z, faces = triangulate(np.exp(1j * angles) / np.sqrt(np.pi), Sizes.even(0.02))
    return z, faces, system_of(faces, (np.arange(24) + 1) % 24, z.size)


def filled(system, rng):
    """A random symmetric positive definite matrix with the system's pattern, as blocks and dense."""
    n = system.position.size
    matrix, dense = np.zeros((system.columns.size, 4)), np.zeros((2 * n, 2 * n))
    for k in range(n):
        for p in range(system.starts[k], system.starts[k + 1]):
            i = system.columns[p]
            block = rng.standard_normal((2, 2))
            if i == k:
                block = block + block.T + 30 * np.eye(2)
            matrix[p] = block.ravel()
            dense[2 * k : 2 * k + 2, 2 * i : 2 * i + 2] = block
            dense[2 * i : 2 * i + 2, 2 * k : 2 * k + 2] = block.T
    return matrix, dense


def test_solves_like_numpy(meshed):
    _, _, system = meshed
    rng = np.random.default_rng(1)
    matrix, dense = filled(system, rng)
    n = system.position.size
    factor = Factor.of(system)
    g = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    assert factorise(system, matrix, g, factor)
    step = np.empty(n, complex)
    back_substitute(system, factor, step)
    right = np.empty(2 * n)
    right[2 * system.position], right[2 * system.position + 1] = g.real, g.imag
    expected = -np.linalg.solve(dense, right)
    assert np.allclose(step.real, expected[2 * system.position], atol=1e-12)
    assert np.allclose(step.imag, expected[2 * system.position + 1], atol=1e-12)


def test_an_indefinite_matrix_is_refused(meshed):
    _, _, system = meshed
    matrix, _ = filled(system, np.random.default_rng(2))
    matrix[system.diagonal[5], 0] = -1.0
    assert not factorise(system, matrix, np.ones(system.position.size, complex), Factor.of(system))


def test_slots_name_the_pairs_of_each_triangle(meshed):
    _, faces, system = meshed
    rows = np.repeat(np.arange(system.position.size), np.diff(system.starts))
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    assert np.array_equal(np.sort(system.corners, axis=1), np.sort(faces, axis=1))
    for slot, (i, j) in zip(system.slots.T, pairs):
        assert np.array_equal(rows[slot], system.position[system.corners[:, i]])
        assert np.array_equal(system.columns[slot], system.position[system.corners[:, j]])
    for v, slot in enumerate(system.ahead):
        ends = {system.position[v], system.position[(v + 1) % 24]}
        assert {rows[slot], system.columns[slot]} == ends
