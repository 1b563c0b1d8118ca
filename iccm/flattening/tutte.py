"""A layout of any patch without folds: each vertex at the mean of its neighbours, the outline on a circle.

Tutte, *How to draw a graph*, 1963; Floater, *Parametrization and smooth approximation of surface triangulations*, 1997.
"""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from ..arrays import Complex, Index, Real, complex_of, xy_of
from ..blas import on_one_thread
from ..meshes.patch import Patch
from ..meshes.topology import Triangles


@on_one_thread
def convex(patch: Patch, outline: Index) -> Complex:
    """Return (p,) positions in the unit disk, one-to-one except for rounding; holes are closed temporarily.

    Raises:
        RuntimeError: the linear system is singular.
    """
    whole = filled(patch, outline)
    z = np.zeros(whole.count, complex)
    z[outline] = np.exp(1j * _angles(patch.points[outline]))
    return settled(whole, z, np.setdiff1d(np.arange(whole.count), outline))[: patch.triangles.count]


def settled(shape: Triangles, z: Complex, inner: Index) -> Complex:
    """Return positions z (n,) with the inner vertices at the mean of their neighbours.

    There are no folds if the other vertices form a convex outline.

    Raises:
        RuntimeError: the linear system is singular.
    """
    if not inner.size:
        return z
    graph = coo_matrix((np.ones(shape.tail.size), (shape.tail, shape.head)), shape=(shape.count,) * 2).tocsr()
    graph = ((graph + graph.T) > 0).astype(float)
    degree = np.asarray(graph.sum(axis=1)).ravel()
    rows = (csr_matrix((degree, (np.arange(shape.count),) * 2)) - graph)[inner]
    positions = z.copy()
    positions[inner] = 0
    right = -(rows @ positions)
    # ordered as a symmetric matrix: half the fill-in of scipy's default
    factor = splu(
        rows[:, inner].tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    positions[inner] = complex_of(factor.solve(xy_of(right)))
    return positions


def filled(patch: Patch, outline: Index) -> Triangles:
    """Return the triangles of the patch with every hole but the outline closed by a fan around a new vertex."""
    faces, count = [patch.faces], patch.triangles.count
    for loop in patch.loops:
        if np.array_equal(loop, outline):
            continue
        back = loop[::-1]
        faces.append(np.column_stack([back, np.roll(back, -1), np.full(loop.size, count)]))
        count += 1
    return Triangles(np.concatenate(faces), count)


def _angles(ring: Real) -> Real:
    steps = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    return 2 * np.pi * np.concatenate([[0.0], np.cumsum(steps)[:-1]]) / steps.sum()
