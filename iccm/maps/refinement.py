"""Triangulations of a polygon's inside with marked edges refined, in which all triangles keep a good shape.

Triangles that are too thin are improved by Rivara's Lepp-Delaunay method (Rivara, Hitschfeld, Simpson,
*Terminal-edges Delaunay (small-angle based) algorithm*, Computer-Aided Design 33, 2001): starting from a thin
triangle, go to the neighbour across the longest side until that side is the longest of both triangles, and
split it at its midpoint. Flips in between keep the triangulation Delaunay. They are decided by the roughness,
the sum of squared sides over the area, which is minimal for the Delaunay triangulation (Musin 1997). It
decreases with every flip, so that rounding cannot cause an endless loop, however close vertices are. The
polygon's edges are kept, or split at their midpoints.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, Real, complex_of
from ..curve import polygon_of
from ..native import function
from .triangulated.adjacency import Edges, edges_across, neighbours

THIN_RATIO = 0.15
"""Twice the area over the squared longest side: about 9 degrees, below which interpolation errors grow."""
TINIEST_SIDE_SHARE = (
    # Relative to the polygon's diagonal: rounding determines the shape of triangles with shorter sides.
    1e-14
)

_refine = function(
    """int64_t iccm_maps_refine(
        Complex *z, int64_t vertices, int64_t vertex_room, int64_t *faces, int64_t *across, int64_t *triangles,
        int64_t triangle_room, int64_t *stack, int64_t stack_size, double thin, double tiniest)"""
)


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Vertices (n,), counter-clockwise triangles (m, 3), and the triangles across the sides opposite to their corners.

    The latter are -1 on the boundary.
    """

    z: Complex
    faces: Index
    across: Index

    @classmethod
    def of(cls, polygon: Complex) -> "Triangulation":
        """Triangulate the inside of a simple counter-clockwise polygon; its vertices come first."""
        parts = shapely.constrained_delaunay_triangles(polygon_of(polygon))
        corners = complex_of(shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, 2::-1])
        order = np.argsort(polygon)
        return shaped(polygon, order[np.searchsorted(polygon[order], corners)])

    @cached_property
    def edges(self) -> Edges:
        """The edges of the triangulation."""
        return edges_across(self.faces, self.across)

    def refined(self, marked: Flags) -> "Triangulation":
        """Return the Delaunay triangulation with the marked edges (e,) split at their midpoints."""
        return shaped(*self.split(marked))

    @property
    def lengths(self) -> Real:
        """Lengths of the edges; shape (e,)."""
        return np.abs(np.diff(self.z[self.edges.ends], axis=1)[:, 0])

    def split(self, marked: Flags) -> tuple[Complex, Index]:
        """Return vertices (n,) and triangles (m, 3) with the marked edges (e,) split at their midpoints.

        A triangle is cut from the midpoint of the longest of its marked sides, first to the corner opposite.
        """
        ends, sides = self.edges.ends[marked], self.edges.sides
        middle = np.full(marked.size, -1)
        middle[marked] = self.z.size + np.arange(len(ends))
        z = np.concatenate([self.z, 0.5 * (self.z[ends[:, 0]] + self.z[ends[:, 1]])])
        first = np.where(middle[sides] >= 0, self.lengths[sides], -1).argmax(axis=1)
        turn = (first[:, None] + np.arange(3)) % 3  # the longest of the cut sides lies opposite corner 0
        (a, b, c), (p, q, r) = (
            np.take_along_axis(values, turn, axis=1).T for values in (self.faces, middle[sides])
        )
        cut = p >= 0
        parts = [
            (~cut, (a, b, c)),
            (cut & (r < 0), (a, b, p)),
            (cut & (r >= 0), (r, b, p)),
            (cut & (r >= 0), (a, r, p)),
            (cut & (q < 0), (a, p, c)),
            (cut & (q >= 0), (a, p, q)),
            (cut & (q >= 0), (q, p, c)),
        ]
        return z, np.concatenate([np.stack(corners, axis=1)[where] for where, corners in parts])

    @property
    def loop(self) -> Index:
        """The boundary vertices, in order; shape (r,)."""
        ends = self.edges.ends[self.edges.rim]
        after = dict(zip(ends[:, 0].tolist(), ends[:, 1].tolist()))
        loop = [int(ends[0, 0])]
        while (following := after[loop[-1]]) != loop[0]:
            loop.append(following)
        return np.array(loop)


def shaped(z: Complex, faces: Index) -> Triangulation:
    """Return a Delaunay triangulation with vertices added where triangles are thin."""
    n, m = z.size, len(faces)
    room = 3 * n + 2000
    points, triangles, across = np.empty(room, np.complex128), *np.empty((2, 2 * room, 3), np.int64)
    points[:n], triangles[:m], across[:m] = z, faces, neighbours(faces, n)
    stack = np.zeros(8 * room, np.int64)
    stack[0], stack[1 : m + 1] = m, np.arange(m)
    tiniest = TINIEST_SIDE_SHARE * float(np.hypot(np.ptp(z.real), np.ptp(z.imag)))
    count = np.array([m])
    n = _refine(
        points, n, room, triangles, across, count, len(triangles), stack, stack.size, THIN_RATIO, tiniest**2
    )
    m = int(count[0])
    return Triangulation(points[:n].copy(), triangles[:m].copy(), across[:m].copy())
