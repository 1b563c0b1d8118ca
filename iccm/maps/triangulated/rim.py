"""The rim of a triangulated map: what lies a little outside belongs to its nearest point."""

import numpy as np

from ...arrays import Complex, Real
from ...buckets import nearest_segments
from .adjacency import Edges, Index


class Rim:
    """The edges on the rim, in one plane.

    Args:
        points: (n,) vertices in that plane.
        edges: of the triangulation.
    """

    def __init__(self, points: Complex, edges: Edges):
        self.beside, self.opposite = edges.beside, edges.opposite
        ends = edges.ends[edges.rim]
        self.start, self.along = points[ends[:, 0]], np.diff(points[ends], axis=1)[:, 0]

    def closest(self, w: Complex) -> tuple[Index, Real, Real]:
        """For points (p,), the nearest edge of the rim, the fraction of it in [0, 1], and the distance; all (p,)."""
        edge, part = nearest_segments(w, self.start, self.start + self.along)
        return edge, part, np.abs(self.start[edge] + part * self.along[edge] - w)

    def places(self, edge: Index, part: Real) -> tuple[Index, Real]:
        """Return the triangles at fractions of edges (p,), and barycentric coordinates there (p, 3)."""
        corner, at = self.opposite[edge], np.arange(edge.size)
        place = np.zeros((edge.size, 3))
        place[at, (corner + 1) % 3], place[at, (corner + 2) % 3] = 1 - part, part
        return self.beside[edge], place


def unslid(part: Real, slide: Real) -> Real:
    """Return where on the image's edge a fraction of the source's goes, for |slide| < 1/2: the root t of t + 2 t (1 -
    t) slide = part in [0, 1].
    """
    first = 1 + 2 * slide
    return 2 * part / (first + np.sqrt(np.maximum(first**2 - 8 * slide * part, 0)))
