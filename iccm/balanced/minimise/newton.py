"""Projected Newton for a map without folds whose outline slides on the target's.

Every accepted step keeps all triangles positive (Smith and Schaefer, *Bijective Parameterization with Free
Boundaries*, 2015, for the largest step) and the outline's vertices in order, and lowers the energy (Armijo).

Steps are those of Newton's method for log E: the same direction, longer by 1/(1 - λ²/E) with λ² = gᵀH⁻¹g. Where one
squeezed triangle makes up the energy, as x⁻⁶ does, Newton's own step widens it by a seventh only, this one doubles it;
where none does the two are the same.

Held vertices with a goal elsewhere move there: their whole way is imposed on the step, the others take the step that
is best with it (the gradient is g + H r), and the step ends before a triangle folds; at its end they are held at their
goals.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Real
from ...jit import in_place
from ...linalg.cholesky import BlockPattern, Factor, downhill, factorise
from ..kernels import cross, dot, move
from .energy import assemble, total
from .sliding import (
    FREE,
    HELD,
    border_derivatives,
    border_energy,
    choose_directions,
    gap_ahead,
    point_at,
    rail_of,
    restrict,
    stiffen,
)

SHARE_OF_FLIP = 0.95  # of the largest step without a fold
SHARE_OF_GAP = 0.9  # by which two neighbours of the outline may approach in one step
ARMIJO = 1e-5  # share of the slope that a step must gain
SHORTEST_STEP = 1e-8  # below, rounding decides (by hand)
LONGEST = 0.5  # of the energy: a step is lengthened to at most 1 / (1 - LONGEST) of Newton's
SHARE_WHILE_MOVING = 0.9  # of the largest step without a fold: more leaves triangles too thin to go on
GROWTH = 1.5  # of the energy in one step while vertices move
CRAWL, CRAWLING = 0.03, 5  # vertices are stuck after so many steps of a smaller share of their way,
LONGER = 1.1  # none of which is longer than the one before by this: 9 of 60 drags beside a filled hole ended in vain
REGULAR = 1e-9  # of the mean diagonal, added to it: the projected Hessian may be singular (similarities)


@in_place
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


@in_place
def regularise(system, matrix, share):
    """Adds a share of the mean diagonal to it."""
    mean = 0.0
    for slot in system.diagonal:
        mean += 0.5 * (matrix[slot, 0] + matrix[slot, 3])
    little = share * mean / system.diagonal.size + 1e-12
    for slot in system.diagonal:
        matrix[slot, 0] += little
        matrix[slot, 3] += little


@in_place
def gap_limit(border, tau, slide, most):
    """The largest share of the step, at most `most`, that keeps the outline's vertices well in order."""
    for v in range(tau.size):
        closing = slide[v] - slide[border.following[v]]
        if closing > 0:
            most = min(most, SHARE_OF_GAP * gap_ahead(border, tau, v) / closing)
    return most


@in_place
def moved(rails, u, tau, step, slide, low, high, t, new_u, new_tau):
    """Fills in where a share t of the step leads."""
    move(u, step, t, new_u)
    for v in range(tau.size):
        s = min(max(t * slide[v], low[v]), high[v])
        new_tau[v] = tau[v] + s
        if s != 0:
            new_u[v] = point_at(rail_of(rails, v), new_tau[v])


@in_place
def _remaining(kinds, goals, u, way):
    """Fills in the way (n,) of held vertices to their goals; whether there is any."""
    moving = False
    for v in range(way.size):
        way[v] = 0j
    for v in range(goals.size):
        if kinds[v] == HELD and goals[v] != u[v]:
            way[v], moving = goals[v] - u[v], True
    return moving


@in_place
def add_product(system, matrix, way, gradient):
    """Adds the matrix times the way (n,) to the gradient (n,), both x + iy of each vertex."""
    for k in range(system.order.size):
        row = system.order[k]
        for p in range(system.starts[k], system.starts[k + 1]):
            column = system.order[system.columns[p]]
            if way[column] != 0:
                x, y = way[column].real, way[column].imag
                gradient[row] += complex(
                    matrix[p, 0] * x + matrix[p, 1] * y, matrix[p, 2] * x + matrix[p, 3] * y
                )
            if row != column and way[row] != 0:
                x, y = way[row].real, way[row].imag
                gradient[column] += complex(
                    matrix[p, 0] * x + matrix[p, 2] * y, matrix[p, 1] * x + matrix[p, 3] * y
                )


@in_place
def restrict_gradient(kinds, directions, slope, gradient):
    """Rewrites the gradient of constrained vertices along their directions, 0 where they are held."""
    for v in range(directions.size):
        if kinds[v] == FREE:
            continue
        along = gradient[v].real * directions[v].real + gradient[v].imag * directions[v].imag
        gradient[v] = complex(along + slope[v] if directions[v] != 0 else 0.0, 0.0)


class Space(NamedTuple):
    """Room for Newton's steps; (n,) of the vertices, (c,) of the constrained ones.

    Attributes:
        matrix: (e, 4) the Hessian.
        factor: of it.
        gradient: (n,) of the energy.
        step: (n,) towards lower energy.
        way: (n,) of held vertices to their goals.
        new_u: (n,) positions that are tried.
        directions: (c,) of constrained vertices.
        new_tau: (c,) arclengths that are tried.
        slope: (c,) of the curves' energy.
        curvature: (c,) of the curves' energy.
        slide: (c,) steps along the curves.
        low: (c,) the least of them.
        high: (c,) the largest.
    """

    matrix: Real
    factor: Factor
    gradient: Complex
    step: Complex
    way: Complex
    new_u: Complex
    directions: Complex
    new_tau: Real
    slope: Real
    curvature: Real
    slide: Real
    low: Real
    high: Real

    @classmethod
    def of(cls, system: BlockPattern, constrained: int) -> "Space":
        """For a mesh with so many constrained vertices."""
        gradient, step, way, new_u = np.empty((4, system.position.size), np.complex128)
        matrix, directions = np.empty((system.columns.size, 4)), np.empty(constrained, np.complex128)
        given = matrix, Factor.of(system), gradient, step, way, new_u, directions
        return cls(*given, *np.empty((6, constrained)))


@in_place
def descend(
    system,
    faces,
    gradients,
    weights,
    u,
    tau,
    rails,
    border,
    kinds,
    goals,
    theta,
    q,
    share,
    epsilon,
    steps,
    tolerance,
    space,
):
    """Newton steps until two of them gain less than `tolerance` of the energy each, or held vertices are stuck on
    the way to their goals; changes u and tau in place.

    Args:
        system: pattern of the mesh.
        faces: (m, 3) triangles.
        gradients: (m, 3) of the hat functions on the side that is kept, corners as in the system.
        weights: (m,) areas on that side, times weights.
        u: (n,) positions on the side that moves, without folds unless epsilon > 0, sliding vertices on their rails at
            tau.
        tau: (c,) arclengths of the constrained vertices, increasing along each curve.
        rails: the polylines they slide on.
        border: the curves as chains.
        kinds: (c,) HELD, SLIDING or FREE.
        goals: (c,) where held vertices are to be; elsewhere of no account.
        theta: weight of the area part.
        q: power that raises the worst.
        share: of the image's area in the measure.
        epsilon: 0, or how far untangling reaches below zero: steps fold what they like. Infinite: one step to the
            least of a quadratic energy, whose derivatives are given in `space`.
        steps: the most there may be.
        tolerance: relative decrease that counts as none.
        space: room for them.

    Returns:
        The energy, the number of steps, and how many of the last ones gained less than the tolerance.
    """
    matrix, gradient, step = space.matrix, space.gradient, space.step
    slope, slide, directions, low, high = space.slope, space.slide, space.directions, space.low, space.high
    new_u, new_tau, way = space.new_u, space.new_tau, space.way
    energy, small, crawling, before = np.inf, 0, 0, np.inf
    for done in range(steps):
        if epsilon < np.inf:
            energy = assemble(system, gradients, weights, u, theta, q, share, epsilon, matrix, gradient)
            energy += border_energy(border, tau)
        border_derivatives(border, tau, slope, space.curvature)
        choose_directions(rails, tau, kinds, gradient, slope, directions, low, high)
        moving = _remaining(kinds, goals, u, way)
        if moving:
            add_product(system, matrix, way, gradient)
        restrict(system, kinds, directions, matrix)
        stiffen(system, border, directions, space.curvature, matrix)
        regularise(system, matrix, REGULAR)
        restrict_gradient(kinds, directions, slope, gradient)
        if not factorise(system, matrix, gradient, space.factor):
            return energy, done, small
        downhill(system, space.factor, step)
        decrease = 0.0
        for v in range(u.size):
            decrease += dot(gradient[v], step[v])
        for v in range(tau.size):
            if kinds[v] == FREE:
                slide[v] = 0.0
                continue
            slide[v] = step[v].real
            if low[v] == 0:
                slide[v] = max(slide[v], 0.0)
            if high[v] == 0:
                slide[v] = min(slide[v], 0.0)
            step[v] = slide[v] * directions[v] + way[v]
        t = 1.0
        if epsilon == 0:
            if not moving:
                t = 1 / (1 + max(decrease / energy, -LONGEST))  # decrease < 0: Newton's for log E
            most = SHARE_WHILE_MOVING if moving else SHARE_OF_FLIP
            t = min(gap_limit(border, tau, slide, t), most * largest_step(faces, u, step))
        gained, accepted = 0.0, False
        while t > SHORTEST_STEP:
            moved(rails, u, tau, step, slide, low, high, t, new_u, new_tau)
            if moving and t == 1.0:
                for v in range(tau.size):
                    if kinds[v] == HELD:
                        new_u[v] = goals[v]
            new_energy = border_energy(border, new_tau)
            if new_energy < np.inf:
                new_energy += total(system.corners, gradients, weights, new_u, theta, q, share, epsilon)
            most = GROWTH * energy if moving else energy + ARMIJO * t * decrease
            if new_energy <= most or epsilon == np.inf:
                gained, accepted = energy - new_energy, True
                break
            t *= 0.5
        if not accepted:
            return energy, done, small
        for v in range(u.size):
            u[v] = new_u[v]
        for v in range(tau.size):
            tau[v] = new_tau[v]
        energy -= gained
        if moving:
            crawling = crawling + 1 if t < min(CRAWL, LONGER * before) else 0
            before = t
            if crawling == CRAWLING:
                return energy, done + 1, small
            continue
        small = small + 1 if gained < tolerance * (energy + gained) else 0
        if small == 2:
            return energy, done + 1, small
    return energy, steps, small
