"""The conformal map of a patch to the unit disk, for patches whose free flattening overlaps itself.

Among the harmonic maps whose boundary values run once around the circle, the conformal one has the least Dirichlet
energy (Douglas's solution of Plateau's problem; Pinkall, Polthier, *Computing Discrete Minimal Surfaces*, 1993, for the
cotangents). The unknowns are the boundary angles alone.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from .cauchy import Complex
from .curve import Real
from .mesh import Index, face_areas
from .patch import Patch
from .stretch import stretches
from .topology import Triangles

STEPS = 80
REACH = 4.0  # most that the logarithm of a gap changes in a step
MOST_DAMPING = 1e6
ATTEMPTS = 60
THIRD = 2 * np.pi / 3
MOST = 3000  # boundary vertices: their matrix is dense


def conformal(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, as conformal as the triangles allow.

    The boundary angles are the harmonic measure seen from a vertex deep inside, or those of least energy: where the
    disk is crowded the energy is blind to small parts, so the one that keeps angles better on the surface is taken.
    """
    whole, points, outline = filled(patch, outline)
    laplacian = cotangents(whole, points)
    gaps = [_harmonic_measure(laplacian, outline, _deepest(whole, points, outline))]
    if outline.size <= MOST:
        gaps.append(least_energy(_schur(laplacian, outline), gaps[0]))
    maps = [_harmonic(laplacian, outline, np.exp(1j * _angles(g)))[: patch.triangles.count] for g in gaps]
    return min(maps, key=lambda flat: _angle_error(patch, flat))


def _angle_error(patch: Patch, flat: Complex) -> float:
    """Mean logarithm of the dilatation over the surface, turned triangles counting as very bad ones."""
    corners = patch.points[patch.faces]
    major, minor = stretches(corners, flat[patch.faces])
    error = np.log(np.maximum(major, 1e-300) / np.maximum(minor, 1e-12 * np.maximum(major, 1e-300)))
    return float(np.average(error, weights=face_areas(corners)))


def convex(patch: Patch, outline: Index) -> Complex:
    """(p,) positions in the unit disk, each inner vertex at the mean of its neighbours: one to one (Tutte)."""
    whole, points, outline = filled(patch, outline)
    ones = np.ones(whole.tail.size)
    graph = coo_matrix((ones, (whole.tail, whole.head)), shape=(whole.count,) * 2).tocsr()
    graph = ((graph + graph.T) > 0).astype(float)
    degree = np.asarray(graph.sum(axis=1)).ravel()
    laplacian = csr_matrix((degree, (np.arange(whole.count),) * 2)) - graph
    boundary = np.exp(1j * _arclength_angles(points[outline]))
    return _harmonic(laplacian, outline, boundary)[: patch.triangles.count]


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


def least_energy(schur: Real, gap: Real) -> Real:
    """Gaps between neighbours (n,), all positive, for the angles of least conformal energy.

    That is ½(cᵀSc + sᵀSs) - area of the polygon, c = cos, s = sin of the angles.

    The energy is zero exactly for a conformal map. Three of the points stay a third of the circle apart, which takes
    up the freedom of the disk's Möbius maps; the gaps between are a softmax, so that they stay positive however
    small. Newton's method with Levenberg's damping.
    """
    n = gap.size
    if n <= 3:  # a triangle is conformal to every other
        return gap
    cuts = np.searchsorted(_angles(gap), [THIRD, 2 * THIRD])
    third = np.array([0, min(max(cuts[0], 1), n - 2), min(max(cuts[1], 2), n - 1)])
    arc = np.repeat(np.arange(3), np.diff([*third, n]))
    u = np.log(gap)
    energy, damping = _energy(schur, _gaps(u, third, arc)), 1e-2
    for _ in range(STEPS):
        gradient, hessian = _newton_system(schur, _gaps(u, third, arc), third, arc)
        scale = np.abs(np.diag(hessian)).max()
        while damping < MOST_DAMPING:
            trial = u - np.clip(_solve_damped(hessian, gradient, damping * scale), -REACH, REACH)
            lower = _energy(schur, _gaps(trial, third, arc))
            if lower < energy:
                break
            damping *= 8
        else:
            break
        settled = energy - lower < 1e-9 * energy
        u, energy, damping = trial, lower, max(damping / 8, 1e-12)
        if settled:
            break
    return _gaps(u, third, arc)


def _gaps(u: Real, third: Index, arc: Index) -> Real:
    """(n,) angles between neighbours: a third of the circle in each of three arcs."""
    share = np.exp(u - np.maximum.reduceat(u, third)[arc])
    return THIRD * share / np.add.reduceat(share, third)[arc]


def _angles(gap: Real) -> Real:
    return np.concatenate([[0.0], np.cumsum(gap)[:-1]])


def _energy(schur: Real, gap: Real) -> float:
    c, s = np.cos(_angles(gap)), np.sin(_angles(gap))
    return 0.5 * float(c @ schur @ c + s @ schur @ s) - 0.5 * float(np.sin(gap).sum())


def _newton_system(schur: Real, gap: Real, third: Index, arc: Index) -> tuple[Real, Real]:
    """Gradient and Hessian of the energy by the logarithms of the gaps, through angles and softmax."""
    angle = _angles(gap)
    c, s = np.cos(angle), np.sin(angle)
    pull_c, pull_s = schur @ c, schur @ s
    by_angle = c * pull_s - s * pull_c
    second = schur * (np.outer(s, s) + np.outer(c, c)) - np.diag(c * pull_c + s * pull_s)
    by_gap = _later(by_angle) - 0.5 * np.cos(gap)
    second = _later(_later(second).T) + np.diag(0.5 * np.sin(gap))
    mean = (np.add.reduceat(gap * by_gap, third) / THIRD)[arc]
    gradient = gap * (by_gap - mean)
    same = arc[:, None] == arc[None, :]
    softmax = np.diag(gap) - np.outer(gap, gap) * same / THIRD
    bend = np.diag(gradient) - same * (np.outer(gradient, gap) + np.outer(gap, gradient)) / THIRD
    return gradient, softmax @ second @ softmax + bend


def _later(values: Real) -> Real:
    """Sums over all later rows: a gap moves every angle after it."""
    return np.concatenate([np.cumsum(values[::-1], axis=0)[::-1][1:], np.zeros_like(values[:1])])


def _solve_damped(hessian: Real, gradient: Real, damping: float) -> Real:
    """(H + λI)⁻¹ g with λ raised until the matrix is positive definite; nothing when it never is."""
    eye = np.eye(len(hessian))
    for _ in range(ATTEMPTS):
        try:
            return cho_solve(
                cho_factor(hessian + damping * eye, check_finite=False), gradient, check_finite=False
            )
        except np.linalg.LinAlgError:
            damping *= 4
    return np.zeros_like(gradient)


def _deepest(whole: Triangles, points: Real, outline: Index) -> int:
    """The vertex farthest from the outline along edges."""
    every = np.ones(whole.tail.size, bool)
    return int(np.argmax(whole.paths(points, outline, every)[0]))


def _harmonic_measure(laplacian: csr_matrix, outline: Index, centre: int) -> Real:
    """(n,) gaps between the angles of neighbours on the outline when `centre` goes to the middle of the disk.

    Obtuse triangles can make a vertex's measure negative: it then counts as very small.
    """
    inner, inside, across = _split(laplacian, outline)
    if not inner.size:
        return np.full(outline.size, 2 * np.pi / outline.size)
    seen = -(across.T @ splu(inside).solve((inner == centre).astype(float)))
    seen = np.maximum(seen, 1e-12 * seen.max())
    gap = seen + np.roll(seen, -1)
    return 2 * np.pi * gap / gap.sum()


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
