"""Hermitian systems over the vertices of large surfaces, by nested dissection and a multifrontal factorisation.

George, *Nested Dissection of a Regular Finite Element Mesh*, 1973; Liu, *The Multifrontal Method for Sparse Matrix
Solution*, SIAM Review 1992. What counts is done by dense products of matrices, so that twice the vertices take little
more than twice the time up to millions. Between fronts Python runs, so that signals are heard.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack
from scipy.sparse import csr_matrix

from .. import progress
from ..arrays import Complex, Index, Real
from ..blas import on_one_thread

LEAF = 96  # vertices that are not divided further (by hand)
STRIP = 64  # columns that are added at once, so that they stay in the processor's memory (by hand)
ONE, OTHER, BETWEEN = 0, 1, 2  # sides of a division
Numbers = NDArray[np.integer]  # of 32 bits where that saves memory


class Hermitian(NamedTuple):
    """A Hermitian matrix.

    Attributes:
        diagonal: (n,) of it.
        ends: (2, e) rows and columns of entries beside it, of each pair one; those in one place add up.
        values: (e,) these entries.
    """

    diagonal: Real
    ends: Numbers
    values: Complex


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
def solve(matrix: Hermitian, points: Real, right: Complex) -> Complex:
    """(n,) the solution of a Hermitian positive definite system of which every unknown belongs to a point (n, 3).

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite.
    """
    order, nodes = dissected(matrix.ends, points)
    fronts = [front for front in _fronts(*_ordered(matrix, order), nodes) if front.end > front.start]
    found = right[order]
    for front in fronts:
        own = blas.ztrsv(front.inner, found[front.start : front.end], lower=1)
        found[front.start : front.end] = own
        found[front.beyond] -= front.outer @ own
    for front in reversed(fronts):
        own = found[front.start : front.end]
        own -= (found[front.beyond].conj() @ front.outer).conj()
        found[front.start : front.end] = blas.ztrsv(front.inner, own, lower=1, trans=2)
    solution = np.empty_like(found)
    solution[order] = found
    return solution


def _ordered(matrix: Hermitian, order: Index) -> tuple[Real, csr_matrix]:
    """The diagonal, and what is above it, with the unknowns in another order."""
    place = np.empty(order.size, np.int32)
    place[order] = np.arange(order.size, dtype=np.int32)
    row, column = place[matrix.ends[0]], place[matrix.ends[1]]
    values = np.where(row < column, matrix.values, matrix.values.conj())
    ends = np.minimum(row, column), np.maximum(row, column)
    return matrix.diagonal[order], csr_matrix((values, ends), (order.size,) * 2)


def dissected(ends: Numbers, points: Real) -> tuple[Index, list[tuple[int, int, list[int]]]]:
    """An order of elimination (n,), and its tree: start, end and children of each node, children first.

    Vertices are halved along the longest side of their box; those of one half next to the other come last.

    Args:
        ends: (2, e) vertices that are coupled.
        points: (n, 3) where they are.
    """
    order, nodes = np.empty(len(points), np.int64), list[tuple[int, int, list[int]]]()
    side, xyz = np.zeros(len(points), np.int8), np.ascontiguousarray(points.T)

    def divide(vertices: Numbers, ends: Numbers, start: int) -> int:
        *parts, last = _divided(ends, xyz, vertices, side) if vertices.size > LEAF else [(vertices, ends)]
        children = []
        for part, inner in parts:
            if part.size:
                children.append(divide(part, inner, start))
                start += part.size
        order[start : start + last[0].size] = last[0]
        nodes.append((start, start + last[0].size, children))
        return len(nodes) - 1

    divide(np.arange(len(points), dtype=np.int32), ends, 0)
    return order, nodes


def _divided(ends: Numbers, xyz: Real, vertices: Numbers, side: np.ndarray) -> list[tuple[Numbers, Numbers]]:
    """Two parts that are not coupled, and the vertices between them, each with the ends of what is coupled inside.

    Taken by their numbers, not by flags, which takes five times as long.
    """
    at = xyz.take(vertices, axis=1)
    half = np.argpartition(at[np.argmax(np.ptp(at, axis=1))], vertices.size // 2)
    side[vertices] = OTHER
    side[vertices[half[: vertices.size // 2]]] = ONE
    one, other = side.take(ends)
    crossing = ends.take(np.flatnonzero(one != other), axis=1)
    side[crossing[side[crossing] == ONE]] = BETWEEN
    (one, other), own = side.take(ends), side.take(vertices)
    return [
        (
            vertices.take(np.flatnonzero(own == part)),
            ends.take(np.flatnonzero((one == part) & (other == part)), axis=1),
        )
        for part in (ONE, OTHER, BETWEEN)
    ]


def _fronts(diagonal: Real, above: csr_matrix, nodes: list[tuple[int, int, list[int]]]) -> Iterator[Front]:
    """Eliminates the nodes, one after the other."""
    waiting = dict[int, tuple[Index, Complex]]()  # what a node has to add to those above it, and where
    for number, (start, end, children) in enumerate(nodes):
        progress.tell("flatten: factorise", number, len(nodes))
        own, entries = end - start, slice(above.indptr[start], above.indptr[end])
        columns, values = above.indices[entries], above.data[entries]
        added = [waiting.pop(child) for child in children]
        beyond = np.unique(np.concatenate([columns[columns >= end], *(at[at >= end] for at, _ in added)]))
        # of both the lower half counts
        panel = np.zeros((own + beyond.size, own), complex, order="F")
        rest = np.zeros((beyond.size, beyond.size), complex, order="F")
        np.fill_diagonal(panel, diagonal[start:end])
        rows = np.repeat(np.arange(own), np.diff(above.indptr[start : end + 1]))
        panel[_place(columns, start, end, beyond), rows] = values.conj()
        for at, update in added:
            place, inside = _place(at, start, end, beyond), int(np.searchsorted(at, end))
            _add(update, panel, place, range(0, inside, STRIP), inside)
            _add(update, rest, place - own, range(inside, at.size, STRIP), at.size)
        inner, fault = lapack.zpotrf(panel[:own], lower=1)
        if fault:
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        outer = panel[own:]
        if beyond.size:
            outer = blas.ztrsm(1.0, inner, outer, side=1, lower=1, trans_a=2)
            rest = blas.zherk(-1.0, outer, 1.0, rest, lower=1, overwrite_c=1)
        waiting[number] = beyond, rest
        yield Front(start, end, beyond, inner, outer)


def _add(update: Complex, to: Complex, place: Index, firsts: range, end: int) -> None:
    """Adds the columns up to `end` of a lower half, in strips that begin at `firsts`, at their places in another's."""
    for first in firsts:
        last = min(first + STRIP, end)
        to.T[np.ix_(place[first:last], place[first:])] += update.T[first:last, first:]  # row by row


def _place(vertices: Index, start: int, end: int, beyond: Index) -> Index:
    """Rows of a front."""
    return np.where(vertices < end, vertices - start, end - start + np.searchsorted(beyond, vertices))
