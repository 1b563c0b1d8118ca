"""Constrained Delaunay triangulation: ear clipping for a first triangulation, and flips that make it Delaunay.

A triangulation consists of two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the
triangle beyond the edge opposite each of them, -1 on the outline. Both have room for more triangles than there
are.
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
    """Triangulate the simple counter-clockwise polygon z (n,).

    Meisters, *Polygons have ears*, 1975.

    Args:
        z: (n,) vertices.
        faces: (n - 2 or more, 3) triangles, written.
        across: (n - 2 or more, 3) their neighbours, written.

    Returns:
        The number of triangles, or -1 if it fails.
    """
    return _clip_ears(z, z.size, faces, across)


def legalise(z: Complex, faces: Index, across: Index, stack: Index, links: Index) -> None:
    """Flip edges, starting with the triangles on the stack, until all but the constrained ones are Delaunay.

    The method is that of Lawson 1977.

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        stack: the number of triangles to check, followed by these; emptied.
        links: (c,) the vertex to which each of the first c is joined by a constrained edge, -1 for none.
    """
    z = np.ascontiguousarray(z, np.complex128)
    _legalise(z, faces, across, links, links.size, stack, stack.size)
