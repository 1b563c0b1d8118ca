"""The conformal map of a patch to the unit disk, for patches whose free flattening overlaps itself.

Among the harmonic maps whose boundary values run once around the circle, the conformal one has the least Dirichlet energy
(Douglas's solution of Plateau's problem; Pinkall, Polthier, *Computing Discrete Minimal Surfaces*, 1993, for the cotangents).
The unknowns are the boundary angles alone.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from .cauchy import Complex
from .curve import Real
from .mesh import Index
from .patch import Patch
from .topology import Triangles

STEPS = 60
MOST = 3000  # boundary vertices: their matrix is dense


def conformal(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, as conformal as the triangles allow."""
    from .flatten import filled

    whole, points, outline = filled(patch, outline)
    laplacian = cotangents(whole, points)
    angle = _arclength_angles(points[outline])
    if outline.size <= MOST:
        angle = least_energy(_schur(laplacian, outline), angle)
    return _harmonic(laplacian, outline, np.exp(1j * angle))[: patch.triangles.count]


def convex(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, each inner vertex at the mean of its neighbours: one to one whatever the triangles (Tutte)."""
    from .flatten import filled

    whole, points, outline = filled(patch, outline)
    ones = np.ones(whole.tail.size)
    graph = coo_matrix((ones, (whole.tail, whole.head)), shape=(whole.count,) * 2).tocsr()
    graph = ((graph + graph.T) > 0).astype(float)
    degree = np.asarray(graph.sum(axis=1)).ravel()
    laplacian = csr_matrix((degree, (np.arange(whole.count),) * 2)) - graph
    boundary = np.exp(1j * _arclength_angles(points[outline]))
    return _harmonic(laplacian, outline, boundary)[: patch.triangles.count]


def cotangents(whole: Triangles, points: Real) -> csr_matrix:
    """The cotangent Laplacian, positive semi-definite; angles near 0 and π are held off so that every entry is finite."""
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


def least_energy(schur: Real, angle: Real) -> Real:
    """Increasing angles of least Dirichlet energy ½(cᵀSc + sᵀSs), c = cos, s = sin, by damped Newton steps.

    Three of them stay where they are, which takes up the freedom of the disk's Möbius maps.
    """
    n = angle.size
    free = np.setdiff1d(np.arange(n), [0, n // 3, 2 * n // 3])
    energy = _energy(schur, angle)
    damping = 1e-3
    for _ in range(STEPS):
        c, s = np.cos(angle), np.sin(angle)
        pull_c, pull_s = schur @ c, schur @ s
        gradient = (c * pull_s - s * pull_c)[free]
        hessian = schur * (np.outer(s, s) + np.outer(c, c)) - np.diag(c * pull_c + s * pull_s)
        hessian = hessian[np.ix_(free, free)]
        scale = np.abs(np.diag(hessian)).mean()
        step = np.zeros(n)
        step[free] = -_solve_damped(hessian, gradient, damping * scale)
        reach = _reach(angle, step)
        trial = angle + reach * step
        lower = _energy(schur, trial)
        if lower < energy:
            done = energy - lower < 1e-12 * energy
            angle, energy, damping = trial, lower, max(damping / 5, 1e-9)
            if done:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return angle


def _solve_damped(hessian: Real, gradient: Real, damping: float) -> Real:
    """(H + λI)⁻¹ g with λ raised until the matrix is positive definite."""
    eye = np.eye(len(hessian))
    while True:
        try:
            return cho_solve(cho_factor(hessian + damping * eye), gradient)
        except np.linalg.LinAlgError:
            damping *= 4


def _reach(angle: Real, step: Real) -> float:
    """How much of the step keeps the angles increasing, at most all of it."""
    gap = np.diff(angle, append=angle[0] + 2 * np.pi)
    closing = -np.diff(step, append=step[0])
    return float(min(1.0, 0.8 * np.min(gap / np.maximum(closing, 1e-300))))


def _energy(schur: Real, angle: Real) -> float:
    c, s = np.cos(angle), np.sin(angle)
    return 0.5 * float(c @ schur @ c + s @ schur @ s)


def _arclength_angles(ring: Real) -> Real:
    steps = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    return 2 * np.pi * np.concatenate([[0.0], np.cumsum(steps)[:-1]]) / steps.sum()


def _split(laplacian: csr_matrix, outline: Index):
    inner = np.setdiff1d(np.arange(laplacian.shape[0]), outline)
    rows = laplacian[inner]
    return inner, rows[:, inner].tocsc(), rows[:, outline].tocsc()


def _schur(laplacian: csr_matrix, outline: Index) -> Real:
    """The energy as a matrix of boundary values alone: L_bb - L_bi L_ii⁻¹ L_ib."""
    inner, inside, across = _split(laplacian, outline)
    border = laplacian[outline][:, outline].toarray()
    if not inner.size:
        return border
    schur = border - across.T @ splu(inside).solve(across.toarray())
    return 0.5 * (schur + schur.T)


def _harmonic(laplacian: csr_matrix, outline: Index, boundary: Complex) -> Complex:
    """The extension of boundary values that the Laplacian takes to zero inside."""
    inner, inside, across = _split(laplacian, outline)
    z = np.zeros(laplacian.shape[0], complex)
    z[outline] = boundary
    if inner.size:
        right = -(across @ boundary)
        solved = splu(inside).solve(np.column_stack([right.real, right.imag]))
        z[inner] = solved[:, 0] + 1j * solved[:, 1]
    return z
