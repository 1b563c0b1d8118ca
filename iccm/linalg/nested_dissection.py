"""Nested dissection of a surface's vertices: an elimination order with large dense blocks and little fill.

George, *Nested Dissection of a Regular Finite Element Mesh*, SIAM Journal on Numerical Analysis 10, 1973.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real

LEAF_VERTICES = 96  # sets of fewer vertices are not divided: their fill-in is small in any order
ONE, OTHER, BETWEEN = 0, 1, 2  # sides of a division
Numbers = NDArray[np.integer]  # 32 bits where that saves memory
Node = tuple[int, int, list[int]]
"""Start and end of its vertices in the order, and its children."""


def nested_dissection(ends: Numbers, points: Real) -> tuple[Index, list[Node]]:
    """Return an order of elimination (n,), and its tree: start, end and children of each node, children first.

    Vertices are divided at the median along the longest side of their box; those of one half that are coupled
    to the other come last.

    Args:
        ends: (2, e) vertices that are coupled.
        points: (n, 3) their positions.
    """
    order, nodes = np.empty(len(points), np.int64), list[Node]()
    side, xyz = np.zeros(len(points), np.int8), np.ascontiguousarray(points.T)

    def divide(vertices: Numbers, ends: Numbers, start: int) -> int:
        *parts, last = (
            _bisect(ends, xyz, vertices, side) if vertices.size > LEAF_VERTICES else [(vertices, ends)]
        )
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


def _bisect(ends: Numbers, xyz: Real, vertices: Numbers, side: np.ndarray) -> list[tuple[Numbers, Numbers]]:
    """Return two parts that are not coupled, and the vertices between them, each with the couplings inside.

    They are taken by indices rather than flags, which would take five times as long.
    """
    coordinates = xyz.take(vertices, axis=1)
    half = np.argpartition(coordinates[np.argmax(np.ptp(coordinates, axis=1))], vertices.size // 2)
    side[vertices] = OTHER
    side[vertices[half[: vertices.size // 2]]] = ONE
    tail_side, head_side = side.take(ends)
    crossing = ends.take(np.flatnonzero(tail_side != head_side), axis=1)
    side[crossing[side[crossing] == ONE]] = BETWEEN
    (tail_side, head_side), side_of = side.take(ends), side.take(vertices)
    return [
        (
            vertices.take(np.flatnonzero(side_of == part)),
            ends.take(np.flatnonzero((tail_side == part) & (head_side == part)), axis=1),
        )
        for part in (ONE, OTHER, BETWEEN)
    ]
