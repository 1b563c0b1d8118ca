"""Paths inside a domain that avoid its outline and other points: Dijkstra's algorithm on a grid."""

from typing import TYPE_CHECKING

import numpy as np
import shapely

from ...arrays import Complex, complex_of, xy_of
from ...curve import Curve
from ...meshes.topology import walk
from ...plane import longer_side

if TYPE_CHECKING:
    from scipy.sparse import csr_array

GRID_CELLS_ACROSS = 160  # along the longer side
# Relative to the diagonal: a cell with this clearance costs twice as much as one far from everything.
NARROW_SHARE = 0.04
LEAST_CLEARANCE_CELLS = 0.2  # relative to the cell size
STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Rows and columns to four of the eight neighbours of a cell; the others are their opposites."""


def route(domain: Curve, begin: complex, goal: complex, obstacles: Complex) -> Complex:
    """Return (k,) points on the cheapest path from `begin` to `goal`; cells cost more the smaller their clearance.

    Args:
        domain: the path stays inside this curve.
        begin: start, inside.
        goal: end, inside; the last point returned.
        obstacles: (p,) points that the path avoids, like the outline.
    """
    from scipy.sparse.csgraph import dijkstra  # slow to import, and seldom needed

    low, high = domain.box
    cell = longer_side(low, high) / GRID_CELLS_ACROSS
    x, y = (np.arange(int(size / cell) + 2) * cell for size in ((high - low).real, (high - low).imag))
    w = (low + x[None, :] + 1j * y[:, None]).ravel()
    inside = domain.contains(w)
    clearance = domain.distances(w)
    clearance = np.min([clearance, *(np.abs(w - obstacle) for obstacle in obstacles)], axis=0)
    cost = 1 + (NARROW_SHARE * domain.diagonal / np.maximum(clearance, LEAST_CLEARANCE_CELLS * cell)) ** 2
    graph = _graph(cost.reshape(y.size, x.size), inside.reshape(y.size, x.size))
    start, end = (int(np.argmin(np.where(inside, np.abs(w - place), np.inf))) for place in (begin, goal))
    _, predecessors = dijkstra(graph, directed=False, indices=end, return_predecessors=True)
    points = np.concatenate([[begin], w[walk(predecessors, start)[1:-1]], [goal]])
    line = shapely.LineString(xy_of(points)).simplify(cell)
    return complex_of(shapely.get_coordinates(line))[1:]


def _graph(cost: np.ndarray, inside: np.ndarray) -> "csr_array":
    """Return a sparse graph of the cells inside; an edge weighs the mean cost of its two cells times their distance."""
    from scipy.sparse import csr_array

    rows, columns = cost.shape
    number = np.arange(cost.size).reshape(cost.shape)
    tails, heads, lengths = [], [], []
    for down, right in STEPS:
        a = slice(0, rows - down), slice(max(0, -right), columns - max(0, right))
        b = slice(down, rows), slice(max(0, right), columns + min(0, right))
        linked = inside[a] & inside[b]
        tails.append(number[a][linked])
        heads.append(number[b][linked])
        lengths.append((0.5 * (cost[a] + cost[b]) * np.hypot(down, right))[linked])
    ends = np.concatenate(tails), np.concatenate(heads)
    return csr_array((np.concatenate(lengths), ends), (cost.size, cost.size))
