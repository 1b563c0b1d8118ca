"""Quality triangulations of a simple polygon that keep its boundary, and points and lines inside, as they are.

Delaunay refinement (Ruppert 1995; Shewchuk 2002) that never splits an edge of the outline: circumcentres of triangles
too large or too thin are inserted unless they would come too close to the outline. No inner edge joins two vertices
of the outline, of given points and of lines (but for the edges of these lines): where such vertices move or slide it
would turn over. Lines are recovered by flips (Sloan 1993).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...native import function
from ...plane import polygon_area, triangle_areas
from ..errors import Stuck
from .delaunay import clip_ears

_insert = function(
    """int64_t iccm_meshing_insert(
        Complex *z, int64_t border, int64_t given, int64_t *faces, int64_t *across, int64_t triangles,
        const int64_t *links, int64_t *stack, int64_t stack_size)"""
)
_remove_holes = function(
    """int64_t iccm_meshing_remove_holes(
        int64_t *faces, int64_t *across, int64_t triangles, int64_t first, int64_t last, const int64_t *links,
        int64_t given, int64_t *stack, int64_t stack_size)"""
)
_refine = function(
    """int64_t iccm_meshing_refine(
        Complex *z, int64_t given, int64_t room, int64_t *faces, int64_t *across, int64_t *triangles,
        const int64_t *links, int64_t *stack, int64_t stack_size, double corner_x, double corner_y, double side,
        const double *areas, int64_t columns, int64_t row_count)"""
)
_recover = function(
    """int64_t iccm_meshing_recover(
        const Complex *z, int64_t *faces, int64_t *across, int64_t triangles, int64_t v, int64_t w,
        const int64_t *links, int64_t linked)"""
)


class Sizes(NamedTuple):
    """The largest area a triangle may have, as a grid of square cells.

    Attributes:
        corner: lower left corner of the grid.
        side: of a cell.
        areas: (columns, rows) area limits; points outside belong to the nearest cell.
    """

    corner: complex
    side: float
    areas: Real

    @classmethod
    def even(cls, area: float) -> "Sizes":
        """Return the same limit everywhere."""
        return cls(0j, 1.0, np.full((1, 1), float(area)))


NOTHING = np.empty(0, np.complex128)


def triangulate(
    outline: Complex,
    sizes: Sizes,
    inside: Complex = NOTHING,
    links: Index | None = None,
    holes: Sequence[Complex] = (),
    rays: Sequence[tuple[int, int]] | Index = (),
) -> tuple[Complex, Index]:
    """Vertices (n,), the outline's first and in order, then those of holes and those given, and counter-clockwise
    triangles (m, 3).

    Args:
        outline: (b,) a simple polygon, counter-clockwise, of area about one.
        sizes: how large the triangles may be.
        inside: (k,) points inside that become vertices.
        links: (k,) for each of them the one, by its place among them, to which an edge must lead; -1 for none.
        holes: simple polygons inside, clockwise and apart, that no triangle covers.
        rays: vertices of the outline and of those given inside, by their places among these, that an edge must join;
            one of the two is linked to no other yet.

    Raises:
        Stuck: the polygons are so thin or so close to each other that rounding decides, or a line cannot be kept.
    """
    around = closed_links([hole.size for hole in holes])
    rims = around.size
    links = np.append(around, np.full(inside.size, -1) if links is None else links + rims * (links >= 0))
    inside = np.concatenate([*holes, inside])
    border, given = outline.size, outline.size + inside.size
    room = int(12 * polygon_area(outline) / sizes.areas.mean() + 16 * given + 4000)
    z = np.empty(room, np.complex128)
    z[:border], z[border:given] = outline, inside
    all_links = np.full(given, -1)
    all_links[border:] = np.where(links >= 0, links + border, -1)
    for vertex, place in rays:
        inner = border + rims + place
        if all_links[inner] < 0:
            all_links[inner] = vertex
        else:
            all_links[vertex] = inner
    faces, across = np.empty((2 * room, 3), np.int64), np.full((2 * room, 3), -1)
    triangles = clip_ears(z[:border], faces, across)
    if triangles < 0 or not triangle_areas(z[faces[:triangles]]).min() > 0:
        raise Stuck("the outline is too thin to be triangulated in double precision; make it wider")
    stack = np.zeros(8 * room, np.int64)
    if inside.size:
        triangles = _insert(z, border, given, faces, across, triangles, all_links, stack, stack.size)
    if triangles < 0:
        raise Stuck("the mesh cannot follow a stroke or the outline of a hole; move it away from the outline")
    if rims:
        last = border + rims
        triangles = _remove_holes(faces, across, triangles, border, last, all_links, given, stack, stack.size)
        if not triangles:
            raise Stuck("the outline of a hole crosses another outline; remove the crossing")
    count, areas = np.array([triangles]), np.ascontiguousarray(sizes.areas, np.float64)
    vertices = _refine(
        z, given, room, faces, across, count, all_links, stack, stack.size,
        float(sizes.corner.real), float(sizes.corner.imag), float(sizes.side), areas, *areas.shape,
    )  # fmt: skip
    return z[:vertices].copy(), faces[: count[0]].copy()


def closed_links(sizes: Sequence[int]) -> Index:
    """Return (k,) the next vertex on each of several loops of given sizes, which follow each other."""
    links, end = np.arange(1, sum(sizes) + 1), 0
    for size in sizes:
        links[end + size - 1], end = end, end + size
    return links


def recover(z: Complex, faces: Index, across: Index, triangles: int, v: int, w: int, links: Index) -> bool:
    """Flip edges that cross the one from vertex v to w until that is in the mesh; False where it cannot be.

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        triangles: how many there are.
        v, w: the ends.
        links: (c,) the vertex to which each of the first c must be joined, -1 for none. Edges are recovered in the
            order of these vertices: no earlier one is given up for a later one.
    """
    z = np.ascontiguousarray(z, np.complex128)
    return bool(_recover(z, faces, across, triangles, v, w, links, links.size))
