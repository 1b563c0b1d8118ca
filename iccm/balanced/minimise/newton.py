"""Projected Newton for a map without folds whose outline slides on the target's.

Every accepted step keeps all triangles positive (Smith and Schaefer, *Bijective Parameterization with Free
Boundaries*, 2015, for the largest step) and the outline's vertices in order, and lowers the energy (Armijo).

Steps are those of Newton's method for log E: the same direction, longer by 1/(1 - λ²/E) with λ² = gᵀH⁻¹g. Where one
squeezed triangle makes up the energy, as x⁻⁶ does, Newton's own step widens it by a seventh only, this one doubles it;
where none does the two are the same.

Held vertices with a goal elsewhere move there: their whole way is imposed on the step, the others take the step that
is best with it (the gradient is g + H r), and the step ends before a triangle folds; at its end they are held at their
goals.

Onto a surface in space steps are damped where they are cut short (Levenberg and Marquardt): between its triangles the
energy has kinks, of which its derivatives know nothing.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...jit import in_place
from ...linalg.cholesky import BlockPattern, Factor, downhill, eliminate_again, factorise
from ..kernels import cross, dot
from .energy import RestShapes, assemble, total
from .in_space import assemble_in_space, total_in_space
from .sliding import Constraints, along_directions, border_energy, constrain, gap_limit, moved, release
from .upright import ANY_TURN, Upright, bend_step, turn_derivatives, turn_factor

SHARE_OF_FLIP = 0.95  # of the largest step without a fold
ARMIJO = 1e-5  # share of the slope that a step must gain
SHORTEST_STEP = 1e-8  # below, rounding decides (by hand)
LONGEST = 0.5  # of the energy: a step is lengthened to at most 1 / (1 - LONGEST) of Newton's
SHARE_WHILE_MOVING = 0.9  # of the largest step without a fold: more leaves triangles too thin to go on
GROWTH = 1.5  # of the energy in one step while vertices move
CRAWL, CRAWLING = 0.03, 5  # vertices are stuck after so many steps of a smaller share of their way,
LONGER = 1.1  # none of which is longer than the one before by this: 9 of 60 drags beside a filled hole ended in vain
REGULAR = 1e-9  # of the mean diagonal, added to it: the projected Hessian may be singular (similarities)
SHORT, LONG = (
    0.1,
    0.5,
)  # of a step in space: after a shorter share the next is damped more, after a longer one less
DAMPED = 1e-4  # of the mean diagonal: the first damping. Without it one squeezed triangle ends the descent


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


class Workspace(NamedTuple):
    """Arrays that Newton's steps write; (n,) of the vertices, (c,) of the constrained ones.

    Attributes:
        matrix: (e, 4) the Hessian.
        factor: of it.
        gradient: (n,) of the energy.
        step: (n,) towards lower energy.
        way: (n,) of held vertices to their goals.
        new_u: (n,) positions that are tried.
        turning: (n,) the gradient of the turn.
        answer: (n,) to it, of the factor.
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
    turning: Complex
    answer: Complex
    directions: Complex
    new_tau: Real
    slope: Real
    curvature: Real
    slide: Real
    low: Real
    high: Real

    @classmethod
    def of(cls, pattern: BlockPattern, constrained: int) -> "Workspace":
        """For a mesh with so many constrained vertices."""
        matrix, directions = np.empty((pattern.columns.size, 4)), np.empty(constrained, np.complex128)
        gradient, step, way, new_u, turning, answer = np.empty((6, pattern.position.size), np.complex128)
        given = matrix, Factor.of(pattern), gradient, step, way, new_u, turning, answer, directions
        return cls(*given, *np.empty((6, constrained)))


class System(NamedTuple):
    """A mesh whose vertices move: its triangles at rest, and what holds its vertices.

    Attributes:
        pattern: of the Hessian.
        faces: (m, 3) triangles, counter-clockwise.
        rest: what their images are compared with.
        constraints: what holds vertices.
        upright: what a turn costs.
        workspace: for the steps.
        factorised: whether the factor that is in it serves for all of them: near the end little changes.
    """

    pattern: BlockPattern
    faces: Index
    rest: RestShapes
    constraints: Constraints
    upright: Upright
    workspace: Workspace
    factorised: bool = False

    @classmethod
    def of(
        cls,
        pattern: BlockPattern,
        faces: Index,
        rest: RestShapes,
        constraints: Constraints,
        upright: Upright = ANY_TURN,
    ) -> "System":
        """With a workspace."""
        workspace = Workspace.of(pattern, constraints.kinds.size)
        return cls(pattern, faces, rest, constraints, upright, workspace)


@in_place
def _energy(rest, surface, u, objective):
    """The energy of images (n,), without the curves'."""
    if surface is None:
        return total(rest, u, objective)
    return total_in_space(rest, surface, u, objective)


@in_place
def _derivatives(rest, surface, u, objective, matrix, gradient):
    """The same; fills in its derivatives."""
    if surface is None:
        return assemble(rest, u, objective, matrix, gradient)
    return assemble_in_space(rest, surface, u, objective, matrix, gradient)


@in_place
def descend(system, objective, surface, u, tau, steps, tolerance):
    """Newton steps until two of them gain less than `tolerance` of the energy each, or held vertices are stuck on
    the way to their goals; changes u and tau in place.

    Args:
        system: the mesh and what holds it.
        objective: what is minimised.
        surface: in space, to which the map goes (`in_space.SurfaceMap`); None for the plane.
        u: (n,) positions on the side that moves, without folds unless epsilon > 0, sliding vertices on their rails at
            tau.
        tau: (c,) arclengths of the constrained vertices, increasing along each curve.
        steps: the most there may be.
        tolerance: relative decrease that counts as none.

    Returns:
        The energy, the number of steps, and how many of the last ones gained less than the tolerance.
    """
    pattern, rest, constraints, space = system.pattern, system.rest, system.constraints, system.workspace
    border, matrix, gradient, step = constraints.border, space.matrix, space.gradient, space.step
    upright, turning = system.upright, space.turning
    energy, small, crawling, before, damping = np.inf, 0, 0, np.inf, 0.0
    factor, curvature = 1.0, 0.0
    for done in range(steps):
        if not objective.quadratic:
            energy = _derivatives(rest, surface, u, objective, matrix, gradient)
            energy += border_energy(border, tau)
        if upright.weight > 0:  # energy and derivatives are those of the product by its second factor
            slope, curvature = turn_derivatives(upright, u, objective.q, turning)
            for v in range(u.size):
                gradient[v] += energy * slope * turning[v]
            factor = turn_factor(upright, u, objective.q)
        moving = constrain(pattern, constraints, u, tau, space)
        regularise(pattern, matrix, REGULAR + damping)
        if system.factorised:
            eliminate_again(pattern, gradient, space.factor)
        elif not factorise(pattern, matrix, gradient, space.factor):
            return factor * energy, done, small
        downhill(pattern, space.factor, step)
        if curvature > 0:
            along_directions(constraints.kinds, space.directions, turning)
            eliminate_again(pattern, turning, space.factor)
            downhill(pattern, space.factor, space.answer)
            bend_step(turning, space.answer, energy * curvature, step)
        decrease = 0.0
        for v in range(u.size):
            decrease += dot(gradient[v], step[v])
        release(constraints, space)
        t = 1.0
        if objective.epsilon == 0 and not objective.quadratic:
            if not moving:
                t = 1 / (1 + max(decrease / energy, -LONGEST))  # decrease < 0: Newton's for log E
            most = SHARE_WHILE_MOVING if moving else SHARE_OF_FLIP
            t = min(gap_limit(border, tau, space.slide, t), most * largest_step(system.faces, u, step))
        energy, decrease = factor * energy, factor * decrease
        # line search: halved until Armijo's condition holds, or, on the way to goals, the energy hardly grows
        gained, accepted = 0.0, False
        while t > SHORTEST_STEP:
            moved(constraints, u, tau, t, space)
            new_energy = border_energy(border, space.new_tau)
            if new_energy < np.inf and not objective.quadratic:
                new_energy += _energy(rest, surface, space.new_u, objective)
                new_energy *= turn_factor(upright, space.new_u, objective.q)
            most = GROWTH * energy if moving else energy + ARMIJO * t * decrease
            if new_energy <= most or objective.quadratic:
                gained, accepted = energy - new_energy, True
                break
            t *= 0.5
        if not accepted:
            return energy, done, small
        for v in range(u.size):
            u[v] = space.new_u[v]
        for v in range(tau.size):
            tau[v] = space.new_tau[v]
        energy -= gained
        if surface is not None:
            if t < SHORT:
                damping = max(10 * damping, DAMPED)
            elif t > LONG:
                damping *= 0.1
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
