"""Compute a map without folds for a given correspondence of the outlines.

First the inside is mapped harmonically with positive weights (mean values, Floater 2003: one-to-one onto a
convex target, and nearly so otherwise). Then folds are removed with the outline held, by Newton's method on an
energy that is finite for folded triangles.
"""

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...linalg.cholesky import BlockPattern, Factor, back_substitute, factorise, system_of
from .energy import Objective, RestShapes, geometry, least_determinant
from .newton import System, descend, quadratic_step
from .sliding import Constraints

LEAST_WEIGHT = 0.08  # of an edge: cotangents of obtuse angles are negative and would cause folds
ENOUGH = 1e-3  # determinant from which a triangle counts as unfolded
POLISHED = 0.2
"""Value of ε after nothing is folded: steps on a smooth energy widen thin triangles faster than steps on a
barrier.
"""
# Ε² = 1e-6 + DEEP · min(d, 0)², found by trial: with 0.04, the map from fish to hippo stays folded.
DEEP = 0.16
SLOW = 3e-3  # relative decrease below which ε shrinks
SHRINK = 0.6  # factor of ε if the energy hardly decreases: without it, a few folds lock up
LEAST_EPSILON = 1e-5
"""Regularisation below which rounding decides about the steps, so that remaining folds stay."""
STEPS = 40  # most steps, which bounds the time
PACE = 15
"""Steps over which the rate of the least determinant is measured; if it would not reach zero at that rate in
the remaining steps, they are skipped. On five slow pairs this misses 7 of 620 maps that would unfold, and takes
a fifth of the time.
"""
UNTANGLING = Objective(theta=1.0, q=1.0)  # angles and areas weighed equally, in the mean


def springs(gradients: Complex, areas: Real) -> Real:
    """Return (m, 3) weights of the edges opposite the corners of triangles: half the cotangents, bounded below."""
    a, b = gradients[:, (1, 2, 0)], gradients[:, (2, 0, 1)]
    return np.maximum(-4 * areas[:, None] * (a.real * b.real + a.imag * b.imag), LEAST_WEIGHT)


def _pull(pattern: BlockPattern, weights: Real, u: Complex, matrix: Real, gradient: Complex) -> None:
    """Fill in the derivatives of the energy ½ Σ w |u_i - u_j|² of springs with weights (m, 3)."""
    tails, heads = pattern.corners[:, (1, 2, 0)].ravel(), pattern.corners[:, (2, 0, 1)].ravel()
    pairs, weights = pattern.slots[:, (4, 2, 1)].ravel(), weights.ravel()
    stiffness = -np.bincount(pairs, weights, pattern.columns.size)
    stiffness[pattern.diagonal] = np.bincount(tails, weights, u.size) + np.bincount(heads, weights, u.size)
    matrix[:] = 0.0
    matrix[:, 0] = matrix[:, 3] = stiffness
    pull = weights * (u[tails] - u[heads])
    for part, filled in ((pull.real, gradient.real), (pull.imag, gradient.imag)):
        filled[:] = np.bincount(tails, part, u.size) - np.bincount(heads, part, u.size)


def harmonic(w: Complex, faces: Index, fixed: Flags, values: Complex) -> Complex:
    """Return (n,) the discrete harmonic function with given values at some vertices.

    Args:
        w: (n,) vertices.
        faces: (m, 3) triangles.
        fixed: (n,) vertices with given values.
        values: (n,) values, of which those at fixed vertices are used.
    """
    pattern = system_of(faces, np.arange(0), w.size)
    # The corners are in the order of elimination, which reverses some triangles.
    gradients, areas = geometry(w, pattern.corners)
    out = np.where(fixed, values, 0)
    matrix, gradient = np.zeros((pattern.columns.size, 4)), np.zeros(w.size, np.complex128)
    _pull(pattern, springs(gradients, np.abs(areas)), out, matrix, gradient)
    is_fixed_row = fixed[pattern.order]
    rows = np.repeat(np.arange(w.size), np.diff(pattern.starts))
    matrix[is_fixed_row[rows] | is_fixed_row[pattern.columns]] = 0
    matrix[pattern.diagonal[fixed]] = [1, 0, 0, 1]
    gradient[fixed] = 0
    factor, step = Factor.of(pattern), np.zeros(w.size, np.complex128)
    if not factorise(pattern, matrix, gradient, factor):
        raise ValueError("part of the mesh has no vertex with a given value")
    back_substitute(pattern, factor, step)
    return out + step


def _epsilon(least: float, previous: float, shrink: float) -> float:
    """Return the distance by which the smoothed determinant extends below zero."""
    if least > 0:
        return POLISHED
    epsilon = np.sqrt(1e-6 + DEEP * least * least)
    if previous > 0:
        epsilon = min(epsilon, previous * shrink)
    return max(epsilon, LEAST_EPSILON)


def untangle(
    pattern: BlockPattern,
    rest: RestShapes,
    u: Complex,
    fixed: Flags,
    harmonic: bool,
    steps: int,
    polish: int,
) -> float:
    """Move vertices until no triangle is folded, and return the least determinant.

    Args:
        pattern: of the mesh.
        rest: its triangles in the source.
        u: (n,) images; those that are not held are changed in place.
        fixed: (n,) vertices that do not move.
        harmonic: whether to start from the harmonic map instead of the given images.
        steps: most steps.
        polish: how many of the steps may be made after nothing is folded.
    """
    constraints = Constraints.of_fixed(u, fixed)
    system = System.of(pattern, rest.corners, rest, constraints)

    def stepped(objective: Objective) -> tuple[int, bool]:
        """Make a step with the held vertices fixed; return the number of steps made, and whether it gained little."""
        _, taken, slow = descend(system, objective, None, u, np.zeros(constraints.kinds.size), 1, SLOW)
        return taken, slow > 0

    if harmonic:
        u[~fixed] = 0
        matrix, gradient = system.workspace.matrix, system.workspace.gradient
        _pull(pattern, springs(rest.gradients, rest.weights), u, matrix, gradient)
        quadratic_step(system, u, np.zeros(constraints.kinds.size))
    epsilon, shrink, best_images, best = -1.0, 1.0, u.copy(), 0.0
    highest: list[float] = []  # least determinant so far
    for steps_left in range(steps, 0, -1):
        least = least_determinant(rest, u)
        highest.append(max([least, *highest[-1:]]))
        if len(highest) > PACE and highest[-1] + steps_left * (highest[-1] - highest[-1 - PACE]) / PACE < 0:
            break
        if least > best:  # with the smoothed energy, thin triangles can fold again
            best, best_images = least, u.copy()
        if least > ENOUGH:
            if polish == 0 or least > POLISHED:
                return least
            polish -= 1
        epsilon = _epsilon(least, epsilon, shrink)
        taken, slow = stepped(UNTANGLING._replace(epsilon=epsilon))
        if taken == 0:
            break
        shrink = SHRINK if slow else 1.0
    least = least_determinant(rest, u)
    if least >= best or best == 0:
        return least
    u[:] = best_images
    return best
