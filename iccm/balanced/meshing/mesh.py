"""Triangulate a simple polygon with well-shaped triangles, keeping its boundary, and points and lines inside.

Delaunay refinement (Ruppert 1995; Shewchuk 2002) that never splits an edge of the outline: circumcentres of
triangles that are too large or too thin are inserted unless they are too close to the outline. No inner edge
joins two vertices of the outline, of given points or of lines (except the edges of these lines), since such an
edge could turn over when its vertices move or slide. Lines are recovered by flips (Sloan 1993).
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
    """Largest areas of triangles, on a grid of square cells.

    Attributes:
        corner: lower left corner of the grid.
        side: side of a cell.
        areas: (columns, rows) limits; points outside the grid belong to the nearest cell.
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
    """Triangulate a polygon with holes, inner points and constrained edges.

    Args:
        outline: (b,) a simple polygon, counter-clockwise, of area about one.
        sizes: limits on the areas of triangles.
        inside: (k,) points inside that become vertices.
        links: (k,) for each of these, the index of another one to which an edge must lead; -1 for none.
        holes: simple disjoint polygons inside, clockwise, that no triangle covers.
        rays: (outline vertex, index into `inside`) pairs that an edge must join; one of the two must have no
            link yet.

    Returns:
        (n,) vertices, those of the outline first and in order, then those of holes, then `inside`; and (m, 3)
        counter-clockwise triangles.

    Raises:
        Stuck: the polygons are so thin or so close to each other that rounding decides, or a line cannot be
            kept.
    """
    around = closed_links([hole.size for hole in holes])
    rims = around.size
    links = np.append(around, np.full(inside.size, -1) if links is None else links + rims * (links >= 0))
    inside = np.concatenate([*holes, inside])
    border, input_count = outline.size, outline.size + inside.size
    room = int(12 * polygon_area(outline) / sizes.areas.mean() + 16 * input_count + 4000)
    z = np.empty(room, np.complex128)
    z[:border], z[border:input_count] = outline, inside
    all_links = np.full(input_count, -1)
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
        triangles = _insert(z, border, input_count, faces, across, triangles, all_links, stack, stack.size)
    if triangles < 0:
        raise Stuck("the mesh cannot follow a stroke or the outline of a hole; move it away from the outline")
    if rims:
        rim_end = border + rims
        triangles = _remove_holes(
            faces, across, triangles, border, rim_end, all_links, input_count, stack, stack.size
        )
        if not triangles:
            raise Stuck("the outline of a hole crosses another outline; remove the crossing")
    count, areas = np.array([triangles]), np.ascontiguousarray(sizes.areas, np.float64)
    vertices = _refine(
        z, input_count, room, faces, across, count, all_links, stack, stack.size,
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
    """Flip the edges that cross the segment from vertex v to w until that is an edge.

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        triangles: number of triangles.
        v, w: the ends.
        links: (c,) the vertex to which each of the first c must be joined, -1 for none. Edges are recovered in
            the order of these vertices: no earlier one is removed for a later one.

    Returns:
        Whether the edge is in the mesh.
    """
    z = np.ascontiguousarray(z, np.complex128)
    return bool(_recover(z, faces, across, triangles, v, w, links, links.size))
