"""The pieces of a mesh that nothing connects."""

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components

from ..arrays import Index, Real
from .mesh import Mesh


def pieces_of(mesh: Mesh) -> Index:
    """(f,) the piece that each face is in, 0 being the one with the largest area; vertices in one place are one."""
    if not mesh.corners.size:
        return np.zeros(0, np.int64)
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    vertex = place.ravel()[mesh.corners]
    first = np.repeat(vertex[mesh.starts[:-1]], mesh.sizes)
    count = len(mesh.points)
    graph = scipy.sparse.coo_array((np.ones(vertex.size), (first, vertex)), (count, count))
    _, label = connected_components(graph, directed=False)
    _, piece = np.unique(label[vertex[mesh.starts[:-1]]], return_inverse=True)
    size = np.bincount(piece.ravel(), weights=areas_of(mesh))
    rank = np.empty(size.size, np.int64)
    rank[np.argsort(-size, kind="stable")] = np.arange(size.size)
    return rank[piece.ravel()]


def areas_of(mesh: Mesh) -> Real:
    """(f,) areas of the faces: half the length of the sum of the cross products of their edges."""
    after = np.arange(1, mesh.corners.size + 1)
    after[mesh.starts[1:] - 1] = mesh.starts[:-1]
    points = mesh.points[mesh.corners]
    origin = np.repeat(points[mesh.starts[:-1]], mesh.sizes, axis=0)
    products = np.cross(points - origin, points[after] - origin)
    return 0.5 * np.linalg.norm(np.add.reduceat(products, mesh.starts[:-1]), axis=1)
