"""Adjacency of triangles across edges, for edge flips.

A triangulation consists of two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the
triangle beyond the edge opposite each of them, -1 on the outline.
"""

import numpy as np

from .arrays import Index
from .native import function

_neighbours = function(
    "int64_t iccm_maps_neighbours(const int64_t *faces, int64_t m, int64_t vertices, int64_t *across)"
)


def neighbours(faces: Index, count: int) -> Index:
    """Return (t, 3) the triangles across the edges of faces (t, 3), whose vertices are below `count`."""
    faces = np.ascontiguousarray(faces, np.int64)
    across = np.empty_like(faces)
    _neighbours(faces, len(faces), count, across)
    return across
