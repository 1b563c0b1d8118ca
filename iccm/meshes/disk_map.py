"""The conformal map of a patch to the unit disk, for patches whose free flattening overlaps itself.

A conformal map keeps harmonic measure, and from the middle of the disk that is the angle on the circle: so the boundary
goes where its harmonic measure, seen from a vertex deep inside, says. What lies inside follows harmonically (Pinkall,
Polthier, *Computing Discrete Minimal Surfaces*, 1993, for the cotangents).
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from ..arrays import Complex, Index, Real
from .patch import Patch
from .topology import Triangles


def conformal(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, as conformal as the triangles allow; a vertex deep inside goes to the middle.

    Raises:
        RuntimeError: triangles too thin for a linear system.
    """
    whole, points, outline = filled(patch, outline)
    inside = Dirichlet(cotangents(whole, points), outline)
    gap = harmonic_measure(inside, deepest(whole, points, outline))
    angle = 2 * np.pi * np.concatenate([[0.0], np.cumsum(gap)[:-1]])
    return inside.extended(np.exp(1j * angle))[: patch.triangles.count]


def convex(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, each inner vertex at the mean of its neighbours: one to one (Tutte)."""
    whole, points, outline = filled(patch, outline)
    ones = np.ones(whole.tail.size)
    graph = coo_matrix((ones, (whole.tail, whole.head)), shape=(whole.count,) * 2).tocsr()
    graph = ((graph + graph.T) > 0).astype(float)
    degree = np.asarray(graph.sum(axis=1)).ravel()
    laplacian = csr_matrix((degree, (np.arange(whole.count),) * 2)) - graph
    boundary = np.exp(1j * _arclength_angles(points[outline]))
    return Dirichlet(laplacian, outline).extended(boundary)[: patch.triangles.count]


def filled(patch: Patch, outline: Index) -> tuple[Triangles, Real, Index]:
    """Triangles and points of the patch with every hole but the outline closed by a fan around its centre."""
    faces, points = [patch.faces], [patch.points]
    count = patch.triangles.count
    for loop in patch.loops:
        if np.array_equal(loop, outline):
            continue
        back = loop[::-1]
        faces.append(np.column_stack([back, np.roll(back, -1), np.full(loop.size, count)]))
        points.append(patch.points[loop].mean(axis=0, keepdims=True))
        count += 1
    return Triangles(np.concatenate(faces), count), np.concatenate(points), outline


def cotangents(whole: Triangles, points: Real) -> csr_matrix:
    """The cotangent Laplacian, positive semi-definite, finite for every triangle that has an area."""
    corner = points[whole.faces]
    rows, columns, weights = [], [], []
    for k in range(3):
        u, v = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        sine = np.linalg.norm(np.cross(u, v), axis=1)
        half = 0.5 * np.einsum("ij,ij->i", u, v) / np.maximum(sine, 1e-300)
        rows += [whole.faces[:, (k + 1) % 3], whole.faces[:, (k + 2) % 3]]
        columns += [whole.faces[:, (k + 2) % 3], whole.faces[:, (k + 1) % 3]]
        weights += [half, half]
    off = coo_matrix((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))))
    off = off.tocsr()
    total = np.asarray(off.sum(axis=1)).ravel()
    return (csr_matrix((total, (np.arange(whole.count),) * 2)) - off).tocsr()


def deepest(whole: Triangles, points: Real, outline: Index) -> int:
    """The vertex farthest from the outline along edges."""
    every = np.ones(whole.tail.size, bool)
    return int(np.argmax(whole.paths(points, outline, every)[0]))


def harmonic_measure(inside: "Dirichlet", centre: int) -> Real:
    """(b,) share of the boundary from each vertex of the outline to the next, as seen from the vertex `centre`.

    Obtuse triangles can make a vertex's measure negative: it then counts as very small.
    """
    if not inside.inner.size:
        return np.full(inside.outline.size, 1 / inside.outline.size)
    seen = -(inside.across.T @ inside.solve((inside.inner == centre).astype(float)))
    seen = np.maximum(seen, 1e-12 * seen.max())
    gap = seen + np.roll(seen, -1)
    return gap / gap.sum()


def _arclength_angles(ring: Real) -> Real:
    steps = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    return 2 * np.pi * np.concatenate([[0.0], np.cumsum(steps)[:-1]]) / steps.sum()


class Dirichlet:
    """A Laplacian with its values on an outline given, its inner part factored once.

    Args:
        laplacian: (n, n) symmetric.
        outline: (b,) vertices with given values.

    Raises:
        RuntimeError: the inner part is singular.
    """

    def __init__(self, laplacian: csr_matrix, outline: Index):
        self.outline = outline
        self.inner = np.setdiff1d(np.arange(laplacian.shape[0]), outline)
        rows = laplacian[self.inner]
        self.across = rows[:, outline].tocsc()
        self.solve = _factored(rows[:, self.inner].tocsc()) if self.inner.size else np.asarray

    def extended(self, boundary: Complex) -> Complex:
        """(n,) values that the Laplacian takes to zero inside, from those on the outline (b,)."""
        right = -(self.across @ boundary)
        solved = self.solve(np.column_stack([right.real, right.imag]))
        z = np.empty(self.outline.size + self.inner.size, complex)
        z[self.outline], z[self.inner] = boundary, solved[:, 0] + 1j * solved[:, 1]
        return z


def _factored(matrix) -> Callable[[Real], Real]:
    """Solves with a symmetric matrix, ordered as one: half the fill of scipy's default."""
    return splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve
