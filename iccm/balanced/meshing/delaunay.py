"""A constrained Delaunay triangulation under edit: ear clipping to begin with, flips that keep it Delaunay.

A triangulation is two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the triangle beyond the
edge opposite each of them, -1 on the outline. Both have room for more triangles than there are.
"""

import numpy as np

from ...arrays import Complex, Index
from ...native import function

_clip_ears = function(
    "int64_t iccm_meshing_clip_ears(const Complex *z, int64_t n, int64_t *faces, int64_t *across)"
)
_legalise = function(
    """int64_t iccm_meshing_legalise(
        const Complex *z, int64_t *faces, int64_t *across, const int64_t *links, int64_t linked, int64_t *stack,
        int64_t stack_size)"""
)


def clip_ears(z: Complex, faces: Index, across: Index) -> int:
    """Triangulate the simple counter-clockwise polygon z (n,); the number of triangles, or -1 where it fails.

    Meisters, *Polygons have ears*, 1975.

    Args:
        z: (n,) vertices.
        faces: (n - 2 or more, 3) triangles, written.
        across: (n - 2 or more, 3) their neighbours, written.
    """
    return _clip_ears(z, z.size, faces, across)


def legalise(z: Complex, faces: Index, across: Index, stack: Index, links: Index) -> None:
    """Flip edges, from the triangles on the stack on, until all are Delaunay but those that stay (Lawson 1977).

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        stack: triangles to look at, after their number; emptied.
        links: (c,) the vertex to which each of the first c is joined by an edge that stays, -1 for none.
    """
    z = np.ascontiguousarray(z, np.complex128)
    _legalise(z, faces, across, links, links.size, stack, stack.size)
