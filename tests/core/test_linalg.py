"""Kernels of sparse factorisations, compared with plain Python: the same whole numbers."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.linalg import fronts, ordering
from tests.core.reference import linalg as reference


def mesh(count: int, seed: int):
    return Delaunay(np.random.default_rng(seed).random((count, 2))).simplices.astype(np.int64)


def with_reference(monkeypatch, module, name, plain, work):
    """Return the results of work() with the compiled kernel, and with the plain one, which has the same signature."""
    compiled = work()
    calls = []

    def instead(*args):
        calls.append(name)
        return plain(*args)

    monkeypatch.setattr(module, name, instead)
    result = work()
    assert calls
    return compiled, result


@pytest.mark.parametrize("count, seed", [(3, 0), (40, 1), (300, 2)])
def test_minimum_degree(monkeypatch, count, seed):
    faces = mesh(count, seed)

    def plain(starts, around, counts, degree, after, before, members, room, first, size, marked, order, n, m):
        assert room == members.size and (n, m) == (count, len(faces))
        return reference.minimum_degree(
            starts, around, counts, degree, after, before, members, first, size, marked, order
        )

    work = lambda: ordering._by_quotient_graph(faces, count)  # noqa: E731
    for compiled, expected in zip(*with_reference(monkeypatch, ordering, "_minimum_degree", plain, work)):
        assert np.array_equal(compiled, expected)


def test_minimum_degree_with_too_little_room_is_repeated(monkeypatch):
    faces = mesh(200, 5)
    enough = ordering._by_quotient_graph(faces, 200)
    monkeypatch.setattr(ordering, "FIRST_ENTRIES_PER_VERTEX", 1)
    assert all(
        np.array_equal(expected, repeated)
        for expected, repeated in zip(enough, ordering._by_quotient_graph(faces, 200))
    )


@pytest.mark.parametrize("count, seed", [(3, 0), (40, 1), (300, 2)])
def test_columns_of_a_given_order(monkeypatch, count, seed):
    faces = mesh(count, seed)

    def plain(starts, around, corners, order, ends, members, room, work, n):
        assert room == members.size and n == count
        return reference.fill(starts, around, corners, order, ends, members)

    work = lambda: ordering._by_superlu(faces, count)  # noqa: E731
    for compiled, expected in zip(*with_reference(monkeypatch, ordering, "_fill", plain, work)):
        assert np.array_equal(compiled, expected)


@pytest.mark.parametrize("few, zeros", [(4, 0.2), (1, 0.0), (9, 0.5)])
def test_supernodes(monkeypatch, few, zeros):
    order = ordering.minimum_degree(mesh(300, 3), 300)
    for module in (fronts, reference):
        monkeypatch.setattr(module, "LEAST_FRONT_VERTICES", few)
        monkeypatch.setattr(module, "MOST_ZEROS_SHARE", zeros)

    def plain(parents, counts, size, free, old, room, place, starts, last, n, least, share):
        assert (n, least, share) == (300, few, zeros)
        return reference.supernodes(parents, counts, size, free, old, room, place, starts, last)

    work = lambda: fronts.fronts_of(order)  # noqa: E731
    compiled, expected = with_reference(monkeypatch, fronts, "_supernodes", plain, work)
    assert np.array_equal(compiled[0], expected[0])
    assert all(np.array_equal(a, b) for a, b in zip(compiled[1], expected[1]))
