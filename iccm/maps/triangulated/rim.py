"""The boundary edges of a triangulated map, for points slightly outside, which are treated as their nearest points."""

import numpy as np

from ...arrays import Complex, Real
from ...buckets import nearest_segments
from .adjacency import Edges, Index


class Rim:
    """The boundary edges in one plane.

    Args:
        points: (n,) vertices in that plane.
        edges: of the triangulation.
    """

    def __init__(self, points: Complex, edges: Edges):
        self.beside, self.opposite = edges.beside, edges.opposite
        ends = edges.ends[edges.rim]
        self.start, self.along = points[ends[:, 0]], np.diff(points[ends], axis=1)[:, 0]

    def closest(self, w: Complex) -> tuple[Index, Real, Real]:
        """Return the boundary edge nearest to each of points (p,), the fraction of it, and the distance.

        All are (p,); fractions are in [0, 1].
        """
        edge, part = nearest_segments(w, self.start, self.start + self.along)
        return edge, part, np.abs(self.start[edge] + part * self.along[edge] - w)

    def places(self, edge: Index, part: Real) -> tuple[Index, Real]:
        """Return (p,) the triangles at fractions of edges, and (p, 3) barycentric coordinates there."""
        corner, rows = self.opposite[edge], np.arange(edge.size)
        place = np.zeros((edge.size, 3))
        place[rows, (corner + 1) % 3], place[rows, (corner + 2) % 3] = 1 - part, part
        return self.beside[edge], place


def unslid(part: Real, slide: Real) -> Real:
    """Return the fraction of the image's edge that corresponds to a fraction of the source's, for |slide| < 1/2.

    It is the root t in [0, 1] of t + 2 t (1 - t) slide = part.
    """
    first = 1 + 2 * slide
    return 2 * part / (first + np.sqrt(np.maximum(first**2 - 8 * slide * part, 0)))
