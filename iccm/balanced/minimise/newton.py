"""Projected Newton for a map without folds whose outline slides on the target's.

Every accepted step keeps all triangles positive (Smith and Schaefer, *Bijective Parameterization with Free
Boundaries*, 2015, for the largest step) and the outline's vertices in order, and lowers the energy (Armijo).

Steps are those of Newton's method for log E: the same direction, longer by 1/(1 - λ²/E) with λ² = gᵀH⁻¹g. Where one
squeezed triangle makes up the energy, as x⁻⁶ does, Newton's own step widens it by a seventh only, this one doubles it;
where none does the two are the same.
"""

import numpy as np

from ..kernels import cross, kernel, move
from .energy import assemble, total
from .ldl import downhill, factorise
from .sliding import (
    border_derivatives,
    border_energy,
    choose_directions,
    gap_ahead,
    point_at,
    restrict,
    stiffen,
)

SHARE_OF_FLIP = 0.95  # of the largest step without a fold
SHARE_OF_GAP = 0.9  # by which two neighbours of the outline may approach in one step
ARMIJO = 1e-5  # share of the slope that a step must gain
SHORTEST_STEP = 1e-8
LONGEST = 0.5  # of the energy: a step is lengthened to at most 1 / (1 - LONGEST) of Newton's
REGULAR = 1e-9  # of the mean diagonal, added to it: the projected Hessian may be singular (similarities)


@kernel
def largest_step(faces, u, step):
    """The smallest positive t at which a triangle of u + t · step has no area; 1e9 if there is none."""
    best = 1e9
    for t in range(faces.shape[0]):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        e, f, de, df = u[b] - u[a], u[c] - u[a], step[b] - step[a], step[c] - step[a]
        quadratic, linear, area = cross(de, df), cross(e, df) + cross(de, f), cross(e, f)
        if quadratic >= 0 and linear >= 0:
            continue
        discriminant = linear * linear - 4 * quadratic * area
        if discriminant < 0:
            continue
        r = -0.5 * (linear + (np.sqrt(discriminant) if linear >= 0 else -np.sqrt(discriminant)))
        for root in (
            r / quadratic,
            area / r,
        ):  # infinite or NaN where a coefficient vanishes: no comparison holds
            if 0 < root < best:
                best = root
    return best


@kernel
def regularise(system, matrix):
    """Adds a little to the diagonal."""
    mean = 0.0
    for slot in system.diagonal:
        mean += 0.5 * (matrix[slot, 0] + matrix[slot, 3])
    little = REGULAR * mean / system.diagonal.size + 1e-12
    for slot in system.diagonal:
        matrix[slot, 0] += little
        matrix[slot, 3] += little


@kernel
def _gap_limit(border, tau, slide, length, most):
    """The largest share of the step, at most `most`, that keeps the outline's vertices well in order."""
    for v in range(tau.size):
        closing = slide[v] - slide[border.following[v]]
        if closing > 0:
            most = min(most, SHARE_OF_GAP * gap_ahead(border, tau, v, length) / closing)
    return most


@kernel
def _moved(rail, u, tau, step, slide, low, high, t, new_u, new_tau):
    """Fills in where a share t of the step leads."""
    move(u, step, t, new_u)
    for v in range(tau.size):
        s = min(max(t * slide[v], low[v]), high[v])
        new_tau[v] = tau[v] + s
        new_u[v] = point_at(rail, new_tau[v]) if s != 0 else u[v]


@kernel
def descend(system, faces, gradients, weights, u, tau, rail, border, held, theta, q, steps, tolerance):
    """Newton steps until two of them gain less than `tolerance` of the energy each; changes u and tau in place.

    Args:
        system: pattern of the mesh.
        faces: (m, 3) counter-clockwise triangles.
        gradients: (m, 3) of the hat functions on the side that is kept, corners as in the system.
        weights: (m,) areas on that side, times weights.
        u: (n,) positions on the side that moves, without folds, outline vertices on the rail at tau.
        tau: (b,) their arclengths, increasing.
        rail: the polyline they slide on.
        border: the outline as a chain.
        held: (b,) outline vertices that stay.
        theta: weight of the area part.
        q: power that raises the worst.
        steps: the most there may be.
        tolerance: relative decrease that counts as none.

    Returns:
        The energy and the number of steps.
    """
    n, b, length = u.size, tau.size, rail.knots[-1]
    matrix, gradient = np.empty((system.rows.size, 4)), np.empty(n, np.complex128)
    factor, pivots = np.empty((system.factor_rows.size, 4)), np.empty((n, 3))
    slope, curvature, slide = np.empty(b), np.empty(b), np.empty(b)
    directions, low, high = np.empty(b, np.complex128), np.empty(b), np.empty(b)
    new_u, new_tau = np.empty(n, np.complex128), np.empty(b)
    energy, small = np.inf, 0
    for done in range(steps):
        energy = assemble(system, gradients, weights, u, theta, q, 0.0, matrix, gradient)
        energy += border_energy(border, tau, length)
        border_derivatives(border, tau, length, slope, curvature)
        choose_directions(rail, tau, held, gradient, slope, directions, low, high)
        restrict(system, directions, matrix)
        stiffen(system, border, directions, curvature, matrix)
        regularise(system, matrix)
        for v in range(b):
            along = gradient[v].real * directions[v].real + gradient[v].imag * directions[v].imag
            gradient[v] = complex(along + slope[v] if directions[v] != 0 else 0.0, 0.0)
        if not factorise(system, matrix, factor, pivots):
            return energy, done
        step = downhill(system, factor, pivots, gradient)
        decrease = 0.0
        for v in range(n):
            decrease += gradient[v].real * step[v].real + gradient[v].imag * step[v].imag
        for v in range(b):
            slide[v] = step[v].real
            if low[v] == 0:
                slide[v] = max(slide[v], 0.0)
            if high[v] == 0:
                slide[v] = min(slide[v], 0.0)
            step[v] = slide[v] * directions[v]
        t = 1 / (1 + max(decrease / energy, -LONGEST))  # decrease < 0: Newton's step for log E
        t = min(_gap_limit(border, tau, slide, length, t), SHARE_OF_FLIP * largest_step(faces, u, step))
        gained = -1.0
        while t > SHORTEST_STEP:
            _moved(rail, u, tau, step, slide, low, high, t, new_u, new_tau)
            new_energy = border_energy(border, new_tau, length)
            if new_energy < np.inf:
                new_energy += total(system.corners, gradients, weights, new_u, theta, q, 0.0)
            if new_energy <= energy + ARMIJO * t * decrease:
                gained = energy - new_energy
                break
            t *= 0.5
        if gained < 0:
            return energy, done
        for v in range(n):
            u[v] = new_u[v]
        for v in range(b):
            tau[v] = new_tau[v]
        small = small + 1 if gained < tolerance * energy else 0
        energy -= gained
        if small == 2:
            return energy, done + 1
    return energy, steps
