"""Geodesics of surfaces: nearly shortest paths, made of straight lines within triangles.

Lanthier, Maheshwari, Sack, *Approximating Shortest Paths on Weighted Polyhedral Surfaces*, 2001. The time is
bounded on any mesh; libigl's exact geodesics do not terminate on some meshes with subdivided flat faces.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from ..arrays import Index, Real
from .topology import Triangles, walk

MOST_PARTS_OF_EDGE = 8
"""Parts of an edge; with these, geodesics are 0.2 to 0.4 % too long on average (capsules and protrusions of 320
to 18,000 triangles).
"""
# Straight lines within triangles, for which Dijkstra's algorithm takes about two seconds.
MOST_ARCS = 2_000_000
SAMPLES_PER_PART = 8  # of each straight part of a path


@dataclass(frozen=True, eq=False)
class GeodesicGraph:
    """Points on triangles, and the straight lines between those of one triangle.

    Attributes:
        points: (p, 3) points; the vertices come first.
        tails: (a,) first point of each line.
        heads: (a,) second point of each line.
    """

    points: Real
    tails: Index
    heads: Index

    @classmethod
    def of(cls, points: Real, shape: Triangles, finest: int = MOST_PARTS_OF_EDGE) -> "GeodesicGraph":
        """Return the vertices and points on the edges, as many on each as keep the graph small.

        Args:
            points: (n, 3) vertices.
            shape: the triangles.
            finest: parts of an edge, at most.
        """
        few = (k for k in range(finest, 1, -1) if 3 * k * (k - 1) * len(shape.faces) <= MOST_ARCS)
        parts = next(few, 1)
        low, high = np.minimum(shape.tail, shape.head), np.maximum(shape.tail, shape.head)
        _, first, edge = np.unique(low * len(points) + high, return_index=True, return_inverse=True)
        low, high = low[first], high[first]
        share = np.arange(1, parts)[:, None] / parts
        between = points[low][:, None] * (1 - share) + points[high][:, None] * share
        inner = len(points) + np.arange(low.size * (parts - 1)).reshape(-1, parts - 1)
        chains = np.column_stack([low, inner, high])
        a, b, c = (
            inner[edge].reshape(-1, 3, parts - 1).swapaxes(0, 1)
        )  # on the sides that begin at each corner
        across = [(a, b), (b, c), (c, a)]
        across += [(shape.faces[:, [k]], side) for k, side in ((0, b), (1, c), (2, a))]
        lines = [(chains[:, :-1].ravel(), chains[:, 1:].ravel())]
        for side, neighbours in across:
            ends = np.broadcast_arrays(side[:, :, None], neighbours[:, None])
            lines.append((ends[0].ravel(), ends[1].ravel()))
        tails, heads = (np.concatenate(ends) for ends in zip(*lines))
        return cls(np.concatenate([points, between.reshape(-1, 3)]), tails, heads)

    @classmethod
    def within(cls, points: Real, groups: Index) -> "GeodesicGraph":
        """Return a graph of points (p, 3), with lines between all points of each flat group (m, k)."""
        tails, heads = (groups[:, k].ravel() for k in np.triu_indices(groups.shape[1], 1))
        low, high = np.minimum(tails, heads), np.maximum(tails, heads)
        _, first = np.unique(low * len(points) + high, return_index=True)
        return cls(points, low[first], high[first])

    @cached_property
    def _graph(self):
        lengths = np.linalg.norm(self.points[self.tails] - self.points[self.heads], axis=1)
        return coo_array((lengths, (self.tails, self.heads)), shape=2 * (len(self.points),)).tocsr()

    def distances(self, stops: Index) -> Real:
        """Return (k, p) distances from vertices (k,) to all points; infinite if there is no path."""
        return dijkstra(self._graph, directed=False, indices=stops)

    def path(self, start: int, end: int) -> Real:
        """Return (p, 3) closely spaced points along the shortest path between two vertices."""
        predecessors = dijkstra(self._graph, directed=False, indices=start, return_predecessors=True)[1]
        ends = self.points[walk(predecessors, end)]
        share = np.arange(SAMPLES_PER_PART)[:, None, None] / SAMPLES_PER_PART
        along = (ends[:-1] * (1 - share) + ends[1:] * share).reshape(-1, 3)
        return np.concatenate([along, ends[-1:]])
