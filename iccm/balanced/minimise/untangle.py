"""A map without folds for a given correspondence of the outlines.

First the inside is harmonic with positive weights (mean values, Floater 2003: one-to-one onto a convex target, and
close to it else); then folds are undone with the outline held, by Newton on an energy that is finite for them.
"""

import numpy as np

from ...arrays import Complex, Flags, Real
from ...linalg.cholesky import BlockPattern
from .energy import Objective, RestShapes, least_determinant
from .newton import System, Workspace, descend, quadratic_step
from .sliding import Constraints

LEAST_WEIGHT = 0.08  # of an edge: cotangents of obtuse angles are negative and would fold
ENOUGH = 1e-3  # determinant from which a triangle counts as unfolded
POLISHED = 0.2
"""Ε once nothing is folded: steps on a smooth energy widen thin triangles faster than on a barrier."""
DEEP = 0.16  # ε² = 1e-6 + DEEP · min(d, 0)²: with 0.04 fish onto hippo stays folded, found by trial
SLOW = 3e-3  # relative decrease below which ε shrinks
SHRINK = 0.6  # of ε where the energy hardly falls: without it a few folds lock up
LEAST_EPSILON = 1e-5  # below, what is folded stays so (by hand)
STEPS = 40  # at most (by hand)
PACE = 15
"""Steps over which it is seen how fast the least determinant rises: where it would not get to zero at that pace in the
steps that are left, they are not made. Of 620 maps that unfold on five slow pairs 7 do not; a fifth of the time."""
UNTANGLING = Objective(1.0, 1.0)


def springs(gradients: Complex, areas: Real) -> Real:
    """Return (m, 3) weights of the edges opposite the corners of triangles: half the cotangents, floored."""
    a, b = gradients[:, (1, 2, 0)], gradients[:, (2, 0, 1)]
    return np.maximum(-4 * areas[:, None] * (a.real * b.real + a.imag * b.imag), LEAST_WEIGHT)


def _pull(pattern: BlockPattern, weights: Real, u: Complex, space: Workspace) -> None:
    """Fill in the derivatives of the energy ½ Σ w |u_i - u_j|² of springs, weights (m, 3)."""
    tails, heads = pattern.corners[:, (1, 2, 0)].ravel(), pattern.corners[:, (2, 0, 1)].ravel()
    pairs, weights = pattern.slots[:, (4, 2, 1)].ravel(), weights.ravel()
    stiffness = -np.bincount(pairs, weights, pattern.columns.size)
    stiffness[pattern.diagonal] = np.bincount(tails, weights, u.size) + np.bincount(heads, weights, u.size)
    space.matrix[:] = 0.0
    space.matrix[:, 0] = space.matrix[:, 3] = stiffness
    pull = weights * (u[tails] - u[heads])
    for part, filled in ((pull.real, space.gradient.real), (pull.imag, space.gradient.imag)):
        filled[:] = np.bincount(tails, part, u.size) - np.bincount(heads, part, u.size)


def _epsilon(least: float, before: float, shrink: float) -> float:
    """Return how far below zero the smoothed determinant reaches."""
    if least > 0:
        return POLISHED
    epsilon = np.sqrt(1e-6 + DEEP * least * least)
    if before > 0:
        epsilon = min(epsilon, before * shrink)
    return max(epsilon, LEAST_EPSILON)


def untangle(
    pattern: BlockPattern,
    rest: RestShapes,
    u: Complex,
    held: Flags,
    harmonic: bool,
    steps: int,
    polish: int,
) -> float:
    """Fill in what is not held of u so that no triangle is folded; the least determinant.

    Args:
        pattern: of the mesh.
        rest: its triangles in the source.
        u: (n,) images, changed in place but for those that are held.
        held: (n,) vertices that stay where they are.
        harmonic: whether the inside begins as the harmonic one instead of as given.
        steps: the most there may be.
        polish: how many of them may be made once nothing is folded.
    """
    constraints = Constraints.held(u, held)
    system = System.of(pattern, rest.corners, rest, constraints)

    def stepped(objective: Objective) -> tuple[int, bool]:
        """Return a step with the held ones where they are: how many there were, and whether it gained little."""
        _, made, slow = descend(system, objective, None, u, np.zeros(constraints.kinds.size), 1, SLOW)
        return made, slow > 0

    if harmonic:
        u[~held] = 0
        _pull(pattern, springs(rest.gradients, rest.weights), u, system.workspace)
        quadratic_step(system, u, np.zeros(constraints.kinds.size))
    epsilon, shrink, kept, best = -1.0, 1.0, u.copy(), 0.0
    highest: list[float] = []  # least determinant so far
    for left in range(steps, 0, -1):
        least = least_determinant(rest, u)
        highest.append(max([least, *highest[-1:]]))
        if len(highest) > PACE and highest[-1] + left * (highest[-1] - highest[-1 - PACE]) / PACE < 0:
            break
        if least > best:  # the smoothed energy lets thin triangles fold again
            best, kept = least, u.copy()
        if least > ENOUGH:
            if polish == 0 or least > POLISHED:
                return least
            polish -= 1
        epsilon = _epsilon(least, epsilon, shrink)
        made, slow = stepped(UNTANGLING._replace(epsilon=epsilon))
        if made == 0:
            break
        shrink = SHRINK if slow else 1.0
    least = least_determinant(rest, u)
    if least >= best or best == 0:
        return least
    u[:] = kept
    return best
