"""The minimum degree ordering, compared with elimination on sets."""

import itertools

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.linalg import ordering


def mesh(count: int, seed: int = 0):
    return Delaunay(np.random.default_rng(seed).random((count, 2))).simplices.astype(np.int64)


def columns_by_sets(faces, order):
    """The columns of the factor, by eliminating one vertex after the other from the graph."""
    neighbours = [set() for _ in order]
    for face in faces.tolist():
        for v in face:
            neighbours[v].update(face)
    columns = []
    for v in order.tolist():
        column = neighbours[v] - {v}
        for w in column:
            neighbours[w] |= column
            neighbours[w].discard(v)
        columns.append(column)
    return columns


@pytest.mark.parametrize("route", [ordering._by_quotient_graph, ordering._by_superlu])
@pytest.mark.parametrize("count", [3, 12, 150])
def test_columns_are_those_of_the_factor(route, count):
    faces = mesh(count)
    order = route(faces, count)
    assert np.array_equal(np.sort(order.order), np.arange(count))
    sets = columns_by_sets(faces, order.order)
    for column, first, last in zip(sets, order.ends, order.ends[1:]):
        assert sorted(column) == sorted(order.columns[first:last].tolist())


def test_vertices_of_least_degree_go_first():
    faces = mesh(60)
    left = {v: set(faces[(faces == v).any(axis=1)].ravel().tolist()) - {v} for v in range(60)}
    updated = set()  # for others, the number of triangles is used as the degree
    for v in ordering._by_quotient_graph(faces, 60).order.tolist():
        column = left.pop(v)
        if v in updated:
            assert len(column) <= min((len(left[w]) for w in updated if w in left), default=60)
        for w in column:
            left[w] = (left[w] | column) - {v, w}
        updated |= column
    assert len(updated) > 40


def test_the_factor_is_about_as_small_as_with_superlu():
    faces = mesh(2000, seed=1)
    sizes = [route(faces, 2000).columns.size for route in (ordering._by_quotient_graph, ordering._by_superlu)]
    assert sizes[0] < 1.2 * sizes[1]


def test_a_long_factor_gets_more_room(monkeypatch):
    faces = mesh(400)
    order = ordering._by_quotient_graph(faces, 400)
    monkeypatch.setattr(ordering, "FIRST_ENTRIES_PER_VERTEX", 1)
    again = ordering._by_quotient_graph(faces, 400)
    assert all(np.array_equal(a, b) for a, b in zip(order, again))


def test_triangles_may_overlap_and_be_more_than_there_are_vertices():
    """Every three of eight vertices: 21 triangles at each vertex, while a surface has at most seven."""
    faces = np.array(list(itertools.combinations(range(8), 3)))
    order = ordering.minimum_degree(faces, 8)
    assert sorted(order.order) == list(range(8))
    assert np.diff(order.ends).tolist() == list(range(7, -1, -1))
