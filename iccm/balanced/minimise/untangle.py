"""A map without folds for a given correspondence of the outlines.

First the inside is harmonic with positive weights (mean values, Floater 2003: one-to-one onto a convex target, and
close to it else); then folds are undone with the outline held, by Newton on an energy that is finite for them.
"""

import numpy as np

from ...arrays import Complex, Real
from ...linalg.cholesky import BlockPattern
from .energy import BOTH_AREAS, least_determinant
from .newton import Space, descend
from .sliding import HELD, NO_RAIL, Border, Rails

LEAST_WEIGHT = 0.08  # of an edge: cotangents of obtuse angles are negative and would fold
ENOUGH = 1e-3  # determinant from which a triangle counts as unfolded
POLISHED = 0.2
"""Ε once nothing is folded: steps on a smooth energy widen thin triangles faster than on a barrier."""
DEEP = 0.16  # ε² = 1e-6 + DEEP · min(d, 0)²: with 0.04 fish onto hippo stays folded, found by trial
SLOW = 3e-3  # relative decrease below which ε shrinks
SHRINK = 0.6  # of ε where the energy hardly falls: without it a few folds lock up
LEAST_EPSILON = 1e-5  # below, what is folded stays so (by hand)
STEPS = 40  # at most (by hand)


def springs(gradients: Complex, areas: Real) -> Real:
    """(m, 3) weights of the edges opposite the corners of triangles: half the cotangents, floored."""
    a, b = gradients[:, (1, 2, 0)], gradients[:, (2, 0, 1)]
    return np.maximum(-4 * areas[:, None] * (a.real * b.real + a.imag * b.imag), LEAST_WEIGHT)


def _pull(system: BlockPattern, weights: Real, u: Complex, space: Space) -> None:
    """Fills in the derivatives of the energy ½ Σ w |u_i - u_j|² of springs, weights (m, 3)."""
    tails, heads = system.corners[:, (1, 2, 0)].ravel(), system.corners[:, (2, 0, 1)].ravel()
    pairs, weights = system.slots[:, (4, 2, 1)].ravel(), weights.ravel()
    stiffness = -np.bincount(pairs, weights, system.columns.size)
    stiffness[system.diagonal] = np.bincount(tails, weights, u.size) + np.bincount(heads, weights, u.size)
    space.matrix[:] = 0.0
    space.matrix[:, 0] = space.matrix[:, 3] = stiffness
    pull = weights * (u[tails] - u[heads])
    for part, filled in ((pull.real, space.gradient.real), (pull.imag, space.gradient.imag)):
        filled[:] = np.bincount(tails, part, u.size) - np.bincount(heads, part, u.size)


def _epsilon(least: float, before: float, shrink: float) -> float:
    """How far below zero the smoothed determinant reaches."""
    if least > 0:
        return POLISHED
    epsilon = np.sqrt(1e-6 + DEEP * least * least)
    if before > 0:
        epsilon = min(epsilon, before * shrink)
    return max(epsilon, LEAST_EPSILON)


def untangle(
    system: BlockPattern,
    gradients: Complex,
    areas: Real,
    u: Complex,
    border: int,
    harmonic: bool,
    steps: int,
    polish: int,
) -> float:
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
    space, still = Space.of(system, border), np.arange(border)
    rails, chains, kinds = Rails.of([NO_RAIL], 0 * still), Border.still(still), np.full(border, HELD)

    def stepped(epsilon: float) -> tuple[int, bool]:
        """A step with the outline held: how many there were, and whether it gained little."""
        _, made, slow = descend(
            system, system.corners, gradients, areas, u, np.zeros(border), rails, chains, kinds, u[:border].copy(),
            1.0, 1.0, BOTH_AREAS, epsilon, 1, SLOW, space,
        )  # fmt: skip
        return made, slow > 0

    if harmonic:
        u[border:] = 0
        _pull(system, springs(gradients, areas), u, space)
        stepped(np.inf)
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
        made, slow = stepped(epsilon)
        if made == 0:
            break
        shrink = SHRINK if slow else 1.0
    least = least_determinant(system.corners, gradients, u)
    if least >= best or best == 0:
        return least
    u[:] = kept
    return best
