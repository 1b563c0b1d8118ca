"""Projected Newton's method for a map without folds, whose outline slides on the target's.

Every accepted step keeps all triangles positive (Smith and Schaefer, *Bijective Parameterization with Free
Boundaries*, 2015, for the largest step) and the outline's vertices in order, and lowers the energy (Armijo).

Steps are those of Newton's method for log E: they have the same direction, but are longer by 1/(1 - λ²/E) with
λ² = gᵀH⁻¹g. If one squeezed triangle dominates the energy, as x⁻⁶ does, Newton's own step widens it by a
seventh only, whereas this one doubles it; otherwise the two are nearly the same.

Held vertices with a goal elsewhere move there: their whole displacement r is imposed on the step, the other
vertices take the step that is best with it (the gradient is g + H r), and the step ends before a triangle
folds. When they arrive, they are held at their goals.

For maps to a surface in space, steps are damped if they are cut short (Levenberg and Marquardt): between the
surface's triangles the energy is not smooth, which its derivatives do not show.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Complex, Index, Real
from ...linalg.cholesky import BlockPattern, Factor
from ...native import Record, function, record
from ..errors import check_time
from .energy import Objective, RestShapes
from .in_space import SurfaceMap
from .sliding import Constraints
from .terms import NO_TERMS, TermsOnMesh
from .upright import ANY_ROTATION, Upright

WorkspaceRecord = record(
    """struct Workspace {
        double *matrix; Factor factor; Complex *gradient; Complex *step; Complex *way; Complex *new_u;
        Complex *turning; Complex *answer; Complex *directions; double *new_tau; double *slope; double *curvature;
        double *slide; double *low; double *high; }"""
)
SystemRecord = record(
    """struct System {
        BlockPattern pattern; const int64_t *faces; int64_t m; RestShapes rest; Constraints constraints;
        Upright upright; Terms terms; Workspace workspace; }"""
)
_largest_step = function(
    """double iccm_minimise_largest_step(
        const int64_t *faces, const Complex *u, const Complex *step, int64_t m)"""
)
_descend = function(
    """int64_t iccm_minimise_descend(
        System *system, const Objective *objective, Complex *u, double *tau, bool factorised, int64_t steps,
        double tolerance, double reach, double *energy, int64_t *counts)"""
)
_quadratic_step = function("int64_t iccm_minimise_quadratic_step(System *system, Complex *u, double *tau)")
_descend_in_space = function(
    """int64_t iccm_minimise_descend_in_space(
        System *system, const Objective *objective, SurfaceMap *surface, Complex *u, double *tau, bool factorised,
        int64_t steps, double tolerance, double *energy, int64_t *counts)"""
)


@dataclass(frozen=True, eq=False)
class Workspace:
    """Work arrays of Newton's method, for all n vertices and for the c constrained ones.

    Attributes:
        matrix: (e, 4) the Hessian.
        factor: its Cholesky factor.
        gradient: (n,) of the energy.
        step: (n,) the step, which lowers the energy.
        to_goals: (n,) displacements of held vertices to their goals.
        new_u: (n,) trial positions.
        turning: (n,) the gradient of the mean rotation.
        answer: (n,) the solution of the linear system with it.
        directions: (c,) of constrained vertices.
        new_tau: (c,) trial arclengths.
        slope: (c,) first derivative of the curves' energy.
        curvature: (c,) second derivative of the curves' energy.
        slide: (c,) steps along the curves.
        low: (c,) lower limits of these.
        high: (c,) upper limits.
    """

    matrix: Real
    factor: Factor
    gradient: Complex
    step: Complex
    to_goals: Complex
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
        """Return the arrays for a mesh with a number of constrained vertices."""
        matrix, directions = np.empty((pattern.columns.size, 4)), np.empty(constrained, np.complex128)
        gradient, step, to_goals, new_u, turning, answer = np.empty((6, pattern.position.size), np.complex128)
        arrays = matrix, Factor.of(pattern), gradient, step, to_goals, new_u, turning, answer, directions
        return cls(*arrays, *np.empty((6, constrained)))

    @cached_property
    def record(self) -> Record:
        """The struct that is passed to the core."""
        return WorkspaceRecord(
            self.matrix,
            self.factor.record,
            self.gradient,
            self.step,
            self.to_goals,
            self.new_u,
            self.turning,
            self.answer,
            self.directions,
            self.new_tau,
            self.slope,
            self.curvature,
            self.slide,
            self.low,
            self.high,
        )


@dataclass(frozen=True, eq=False)
class System:
    """A mesh whose vertices move: its rest triangles and constraints.

    Attributes:
        pattern: of the Hessian.
        faces: (m, 3) triangles, counter-clockwise.
        rest: the rest triangles.
        constraints: the constraints on vertices.
        upright: the cost of rotation.
        terms: further terms of the energy.
        workspace: for the steps.
        factorised: whether to use the factor in the workspace for all steps; it changes little near the
            minimum.
    """

    pattern: BlockPattern
    faces: Index
    rest: RestShapes
    constraints: Constraints
    upright: Upright
    terms: TermsOnMesh
    workspace: Workspace
    factorised: bool = False

    @classmethod
    def of(
        cls,
        pattern: BlockPattern,
        faces: Index,
        rest: RestShapes,
        constraints: Constraints,
        upright: Upright = ANY_ROTATION,
        terms: TermsOnMesh = NO_TERMS,
    ) -> "System":
        """Return a system with a new workspace."""
        workspace = Workspace.of(pattern, constraints.kinds.size)
        return cls(pattern, faces, rest, constraints, upright, terms, workspace)

    @cached_property
    def record(self) -> Record:
        """The struct that is passed to the core."""
        return SystemRecord(
            self.pattern.record,
            self.faces,
            len(self.faces),
            self.rest.record(),
            self.constraints.record(),
            self.upright.record(),
            self.terms.record,
            self.workspace.record,
        )


def largest_step(faces: Index, u: Complex, step: Complex) -> float:
    """Return the smallest positive t at which a triangle (m, 3) of u + t · step is degenerate; 1e9 if there is none."""
    return float(_largest_step(faces, u, step, len(faces)))


def descend(
    system: System,
    objective: Objective,
    surface: SurfaceMap | None,
    u: Complex,
    tau: Real,
    steps: int,
    tolerance: float,
    reach: float = np.inf,
) -> tuple[float, int, int]:
    """Make Newton steps until two in succession gain less than `tolerance`, or held vertices get stuck.

    `u` and `tau` are changed in place.

    Args:
        system: the mesh and its constraints.
        objective: the objective.
        surface: the target in space (`in_space.SurfaceMap`); None for the plane.
        u: (n,) positions on the side that moves, without folds unless epsilon > 0; sliding vertices are on
            their rails at tau.
        tau: (c,) arclengths of the constrained vertices, increasing along each curve.
        steps: most steps.
        tolerance: relative decrease of the energy below which a step does not count.
        reach: how far vertices may move in the plane, as the sum over all steps of the root mean square of their
            displacements.

    Returns:
        The energy, the number of steps, and how many of the last ones gained less than the tolerance.

    Raises:
        OutOfTime: the time for the search is over.
    """
    check_time()
    energy, counts = np.empty(1), np.empty(2, np.int64)
    records = system.record, objective.record()
    how = system.factorised, steps, tolerance
    if surface is None:
        _descend(*records, u, tau, *how, reach, energy, counts)
    else:
        _descend_in_space(*records, surface.record(), u, tau, *how, energy, counts)
    system.terms.raise_error()
    return float(energy[0]), int(counts[0]), int(counts[1])


def quadratic_step(system: System, u: Complex, tau: Real) -> bool:
    """Move to the minimum of a quadratic energy in one step; `u` and `tau` are changed in place.

    Args:
        system: the mesh and its constraints; the energy's derivatives at u are in its workspace.
        u: (n,) positions.
        tau: (c,) arclengths of the constrained vertices.

    Returns:
        Whether it succeeded: False if the matrix is not positive definite.
    """
    return bool(_quadratic_step(system.record, u, tau))
