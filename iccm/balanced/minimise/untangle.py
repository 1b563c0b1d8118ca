"""A map without folds for a given correspondence of the outlines.

First the inside is harmonic with positive weights (mean values, Floater 2003: one-to-one onto a convex target, and
close to it else); then folds are undone with the outline held, by Newton on an energy that is finite for them.
"""

import numpy as np

from ...jit import kernel
from ..kernels import dot, move
from .cholesky import downhill, factorise
from .energy import assemble, least_determinant, total
from .newton import ARMIJO, REGULAR, SHORTEST_STEP, regularise
from .sliding import restrict

LEAST_WEIGHT = 0.08  # of an edge: cotangents of obtuse angles are negative and would fold
ENOUGH = 1e-3  # determinant from which a triangle counts as unfolded
POLISHED = 0.2
"""Ε once nothing is folded: steps on a smooth energy widen thin triangles faster than on a barrier."""
DEEP = 0.16  # ε² = 1e-6 + DEEP · min(d, 0)²: with 0.04 fish onto hippo stays folded, found by trial
SLOW = 3e-3  # relative decrease below which ε shrinks
SHRINK = 0.6  # of ε where the energy hardly falls: without it a few folds lock up
LEAST_EPSILON = 1e-5  # below, what is folded stays so (by hand)
STEPS = 40  # at most (by hand)


@kernel
def _stiffness(system, gradients, areas, u, matrix, gradient):
    """Fills in the matrix of a graph with cotangent weights, floored, and gradient = matrix · u."""
    matrix.fill(0.0)
    gradient.fill(0j)
    for t in range(system.corners.shape[0]):
        for k, m, pair in ((0, 1, 1), (0, 2, 2), (1, 2, 4)):
            cotangent = -4 * areas[t] * dot(gradients[t, k], gradients[t, m])
            weight = max(cotangent, LEAST_WEIGHT)
            i, j, slot = system.corners[t, k], system.corners[t, m], system.slots[t, pair]
            for own in (system.diagonal[i], system.diagonal[j]):
                matrix[own, 0] += weight
                matrix[own, 3] += weight
            matrix[slot, 0] -= weight
            matrix[slot, 3] -= weight
            gradient[i] += weight * (u[i] - u[j])
            gradient[j] += weight * (u[j] - u[i])


@kernel
def _epsilon(least, before, shrink):
    """How far below zero the smoothed determinant reaches."""
    if least > 0:
        return POLISHED
    epsilon = np.sqrt(1e-6 + DEEP * least * least)
    if before > 0:
        epsilon = min(epsilon, before * shrink)
    return max(epsilon, LEAST_EPSILON)


@kernel
def untangle(system, gradients, areas, u, border, harmonic, steps, polish):
    """Fills in the inside of u, given on the outline, so that no triangle is folded; the least determinant.

    Args:
        system: pattern of the mesh.
        gradients: (m, 3) of the hat functions on the source, corners as in the system.
        areas: (m,) of the source's triangles.
        u: (n,) images, changed in place but for the first `border` ones.
        border: how many vertices stay where they are, those of the outline first.
        harmonic: whether the inside begins as the harmonic one instead of as given.
        steps: the most there may be.
        polish: how many of them may be made once nothing is folded.
    """
    n = u.size
    matrix, gradient = np.empty((system.columns.size, 4)), np.empty(n, np.complex128)
    factor = np.empty(system.fronts.room)
    still, kinds, trial = (
        np.zeros(border, np.complex128),
        np.zeros(border, np.int64),
        np.empty(n, np.complex128),
    )
    if harmonic:
        for v in range(border, n):
            u[v] = 0j
        _stiffness(system, gradients, areas, u, matrix, gradient)
        for v in range(border):
            gradient[v] = 0j
        restrict(system, kinds, still, matrix)
        if factorise(system, matrix, factor):
            move(u, downhill(system, factor, gradient), 1.0, u)
    epsilon, shrink, kept, best = -1.0, 1.0, u.copy(), 0.0
    for _ in range(steps):
        least = least_determinant(system.corners, gradients, u)
        if least > best:  # the smoothed energy lets thin triangles fold again
            best, kept = least, u.copy()
        if least > ENOUGH:
            if polish == 0 or least > POLISHED:
                return least
            polish -= 1
        epsilon = _epsilon(least, epsilon, shrink)
        energy = assemble(system, gradients, areas, u, 1.0, 1.0, 0.5, epsilon, matrix, gradient)
        for v in range(border):
            gradient[v] = 0j
        restrict(system, kinds, still, matrix)
        regularise(system, matrix, REGULAR)
        if not factorise(system, matrix, factor):
            break
        step = downhill(system, factor, gradient)
        decrease = 0.0
        for v in range(n):
            decrease += dot(gradient[v], step[v])
        t, new_energy = 1.0, np.inf
        while t > SHORTEST_STEP:
            move(u, step, t, trial)
            new_energy = total(system.corners, gradients, areas, trial, 1.0, 1.0, 0.5, epsilon)
            if new_energy <= energy + ARMIJO * t * decrease:
                break
            t *= 0.5
        if t <= SHORTEST_STEP:
            break
        move(u, step, t, u)
        shrink = SHRINK if new_energy > (1 - SLOW) * energy else 1.0
    least = least_determinant(system.corners, gradients, u)
    if least >= best or best == 0:
        return least
    for v in range(n):
        u[v] = kept[v]
    return best
