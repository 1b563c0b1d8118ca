"""Hermitian systems over the vertices of large surfaces, by nested dissection and a multifrontal factorisation.

George, *Nested Dissection of a Regular Finite Element Mesh*, 1973; Liu, *The Multifrontal Method for Sparse Matrix
Solution*, SIAM Review 1992. What counts is done by dense products of matrices, so that twice the vertices take little
more than twice the time up to millions. Between fronts Python runs, so that signals are heard.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import blas, solve_triangular
from scipy.sparse import csr_matrix

from . import progress
from .arrays import Complex, Index, Real
from .blas import on_one_thread

LEAF = 96  # vertices that are not divided further (by hand)


class Front(NamedTuple):
    """The vertices from `start` to `end` in the order of elimination, once they are eliminated.

    Attributes:
        start, end: of them.
        beyond: (b,) later ones that they are coupled to.
        inner: (k, k) the lower triangle of their factor.
        outer: (b, k) its rows beyond.
    """

    start: int
    end: int
    beyond: Index
    inner: Any
    outer: Any


@on_one_thread
def solve(matrix: csr_matrix, points: Real, right: Complex) -> Complex:
    """(n,) the solution of a Hermitian positive definite system of which every unknown belongs to a point (n, 3).

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite.
    """
    order, nodes = dissected(matrix, points)
    matrix = matrix[order][:, order].tocsr()
    matrix.sort_indices()
    fronts = list(_fronts(matrix, nodes))
    found = right[order]
    for front in fronts:
        own = solve_triangular(front.inner, found[front.start : front.end], lower=True, check_finite=False)
        found[front.start : front.end] = own
        found[front.beyond] -= front.outer @ own
    for front in reversed(fronts):
        own = found[front.start : front.end] - front.outer.conj().T @ found[front.beyond]
        found[front.start : front.end] = solve_triangular(
            front.inner, own, trans="C", lower=True, check_finite=False
        )
    solution = np.empty_like(found)
    solution[order] = found
    return solution


def dissected(matrix: csr_matrix, points: Real) -> tuple[Index, list[tuple[int, int, list[int]]]]:
    """An order of elimination (n,), and its tree: start, end and children of each node, children first.

    Vertices are halved along the longest side of their box; those of one half next to the other come last.
    """
    order, nodes = np.empty(len(points), np.int64), list[tuple[int, int, list[int]]]()
    side = np.zeros(len(points), np.int8)

    def divide(vertices: Index, start: int) -> int:
        parts = _divided(matrix, points, vertices, side) if vertices.size > LEAF else [vertices]
        children = []
        for part in parts[:-1]:
            if part.size:
                children.append(divide(part, start))
                start += part.size
        order[start : start + parts[-1].size] = parts[-1]
        nodes.append((start, start + parts[-1].size, children))
        return len(nodes) - 1

    divide(np.arange(len(points)), 0)
    return order, nodes


def _divided(matrix: csr_matrix, points: Real, vertices: Index, side: np.ndarray) -> list[Index]:
    """Two parts that are not coupled, and the vertices between them; `side` is zero before and after."""
    at = points[vertices]
    along = at[:, np.argmax(np.ptp(at, axis=0))]
    first = np.zeros(vertices.size, bool)
    first[np.argpartition(along, vertices.size // 2)[: vertices.size // 2]] = True
    one, other = vertices[first], vertices[~first]
    side[other] = 1
    near = matrix[one]
    touching = np.zeros(one.size, bool)
    rows = np.repeat(np.arange(one.size), np.diff(near.indptr))
    touching[rows[side[near.indices] > 0]] = True
    side[other] = 0
    return [one[~touching], other, one[touching]]


def _fronts(matrix: csr_matrix, nodes: list[tuple[int, int, list[int]]]) -> Iterator[Front]:
    """Eliminates the nodes, one after the other."""
    waiting = dict[int, tuple[Index, Complex]]()  # what a node has to add to those above it, and where
    for number, (start, end, children) in enumerate(nodes):
        progress.tell("flatten: factorise", number, len(nodes))
        first, last = matrix.indptr[start], matrix.indptr[end]
        columns, values = matrix.indices[first:last], matrix.data[first:last]
        rows = np.repeat(np.arange(end - start), np.diff(matrix.indptr[start : end + 1]))
        added = [waiting.pop(child) for child in children]
        beyond = np.unique(np.concatenate([columns[columns >= end], *(at[at >= end] for at, _ in added)]))
        front = np.zeros(
            (end - start + beyond.size,) * 2, complex, order="F"
        )  # of all of it the lower half counts
        later = columns >= start
        front[_place(columns[later], start, end, beyond), rows[later]] = values[later].conj()
        for at, update in added:
            place = _place(at, start, end, beyond)
            front.T[np.ix_(place, place)] += update.T  # row by row
        own = end - start
        inner = np.linalg.cholesky(front[:own, :own])
        outer, rest = front[own:, :own], front[own:, own:]
        if beyond.size:
            outer = blas.ztrsm(1.0, inner, outer, side=1, lower=1, trans_a=2)
            rest = blas.zherk(-1.0, outer, 1.0, rest, lower=1)
        waiting[number] = beyond, rest
        yield Front(start, end, beyond, inner, outer)


def _place(vertices: Index, start: int, end: int, beyond: Index) -> Index:
    """Rows of a front."""
    return np.where(vertices < end, vertices - start, end - start + np.searchsorted(beyond, vertices))
