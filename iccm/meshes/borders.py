"""Edges at which a seam costs less, because the file has a border there, and lengths of edges for shortest seams."""

import numpy as np

from ..arrays import Flags, Index, Real, distinct_rows
from .mesh import Mesh
from .topology import Triangles

PREFERRED_LENGTH_SHARE = 0.4
"""Length of a preferred edge for seams, relative to its own: a seam along such edges may be 2.5 times longer."""
SPLIT_NORMAL_COSINE = 0.99
"""Cosine of the angle (8 degrees) between two normals of a corner from which the file means a hard edge; less is
rounding."""
SAME_COORDINATE = 1e-6
"""Difference of texture coordinates that does not count as a border: files have six digits."""
TIE_SHARE = 1e-6
"""Relative amount by which lengths vary over the surface, so that of equal paths always the same is the shortest. It is
far above rounding, and far below what is seen."""
GENERIC_DIRECTIONS = np.array([[0.8017, 0.5345, 0.2673], [-0.3117, 0.6291, 0.7121]])
"""Two directions that no symmetry of usual models relates to each other."""


def preferred_edges(mesh: Mesh, shape: Triangles, corner: Index) -> Flags:
    """Mark (3m,) the half-edges at which the file has a border: of its texture coordinates, materials, or smoothness.

    Args:
        mesh: the mesh of the triangles.
        shape: the (m, 3) triangles.
        corner: (m, 3) corner of the mesh for each corner of theirs.
    """
    inner = np.flatnonzero(shape.twin >= 0)
    opposite = shape.twin[inner]
    ends = _sides(corner.ravel(), inner, opposite)
    border = np.zeros(shape.twin.size, bool)
    if mesh.uv is not None and mesh.uv_corners is not None:
        numbers = mesh.uv_corners[ends]
        known = (numbers >= 0).all(axis=(0, 1))
        uv = mesh.uv[np.maximum(numbers, 0)]
        border[inner] |= known & ~(np.abs(uv[:, 0] - uv[:, 1]) <= SAME_COORDINATE).all(axis=(0, 2))
    if mesh.normals is not None and mesh.normal_corners is not None:
        normal = mesh.normals[mesh.normal_corners[ends]]
        border[inner] |= ((normal[:, 0] * normal[:, 1]).sum(axis=2) < SPLIT_NORMAL_COSINE).all(axis=0)
    if mesh.materials is not None:
        material = mesh.materials[np.searchsorted(mesh.starts, corner[:, 0], side="right") - 1]
        border[inner] |= material[inner // 3] != material[opposite // 3]
    # where all edges are borders, as of triangles that are shaded flat, none is preferred
    return border if 2 * np.count_nonzero(border) < inner.size else np.zeros(border.size, bool)


def marked_edges(mesh: Mesh, shape: Triangles, vertex: Index) -> Flags:
    """Mark (3m,) the half-edges on edges that are marked as seams; vertices at the same place count as one.

    Args:
        mesh: the mesh of the triangles.
        shape: the (m, 3) triangles.
        vertex: (n,) vertex of the mesh for each of theirs.
    """
    if mesh.seams is None or not len(mesh.seams):
        return np.zeros(shape.twin.size, bool)
    place = distinct_rows(mesh.points)[1]

    def key(ends: Index) -> Index:
        a, b = place[ends]
        return np.minimum(a, b) * len(mesh.points) + np.maximum(a, b)

    edges = key(vertex[np.stack([shape.tail, shape.head])])
    return (shape.twin >= 0) & np.isin(edges, key(mesh.seams.T))


def _sides(corner: Index, half: Index, opposite: Index) -> Index:
    """Return (2, 2, e) the corners at both ends of edges, on the one side and on the other."""
    after, after_opposite = (3 * (edge // 3) + (edge + 1) % 3 for edge in (half, opposite))
    return corner[np.array([[half, after_opposite], [after, opposite]])]


def seam_lengths(points: Real, shape: Triangles, preferred: Flags) -> Real:
    """Return (3m,) lengths of half-edges for shortest seams: shorter where they are preferred, and without ties."""
    ends = points[shape.tail], points[shape.head]
    length = np.linalg.norm(ends[0] - ends[1], axis=1)
    length *= 1 + TIE_SHARE * generic(points, (ends[0] + ends[1]) / 2)
    return np.where(preferred, PREFERRED_LENGTH_SHARE * length, length)


def generic(points: Real, at: Real) -> Real:
    """Return (k,) numbers from -1 to 1 at places (k, 3) on a surface with points (n, 3).

    They vary smoothly without any symmetry, so that they decide between places that are equal otherwise.
    """
    low = points.min(axis=0)
    size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-300)
    x, y = GENERIC_DIRECTIONS @ ((at - low) / size).T
    return np.sin(3 * x + np.cos(2 * y))
