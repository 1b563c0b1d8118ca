"""Newton's method for the least distorted map of a mesh whose regions have prescribed areas.

The energy of a balanced map compares each triangle with its rest shape, which is scaled so that its region has the
prescribed area. Where the energy alone decides, regions grow less than they should. Here areas are constraints: each
step p solves

    H p + Bᵀ λ = -g,    B p = r

with the projected Hessian H and gradient g of the energy, the derivatives B of the areas, and the part r of the
missing areas that this step makes up (sequential quadratic programming). The multipliers λ come from B H⁻¹ Bᵀ by
conjugate gradients, so that one sparse factorisation per step is enough for any number of regions. Steps are cut short
before a triangle folds.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, cg

from ..arrays import Complex, Flags, Index, Real
from ..balanced.errors import check_time
from ..balanced.minimise.energy import Objective, RestShapes, assemble, geometry
from ..balanced.minimise.newton import largest_step
from ..linalg.cholesky import (
    BlockPattern,
    Factor,
    back_substitute,
    factorise,
    forward_substitute,
    system_of,
)
from ..plane import triangle_areas

OBJECTIVE = Objective(theta=0.1, q=2.0)
"""Little weight for a uniform scale inside of a region, since only its total area is prescribed; with more, borders of
regions that grow crumple. The power avoids stretched triangles beside them."""
BETWEEN_WEIGHT = 0.1  # of the energy of triangles outside of all regions, which may be distorted
STEP_RATIO = 2.0  # largest ratio of areas before and after a step
MULTIPLIER_TOLERANCE, MOST_MULTIPLIER_STEPS = 1e-3, 200  # of conjugate gradients
FOLD_MARGIN_SHARE = 0.8  # of the step at which a triangle would become degenerate
SHORTEST_STEP = 1e-4  # share of a Newton step below which the line search gives up
LEAST_GAIN_SHARE, PATIENCE_STEPS, ACCEPTABLE_SHARE = 0.1, 4, 5e-3
"""Once all areas are this close, only areas are corrected unless the largest difference decreases by the first share
within these steps."""
POLISHING_STEPS = 5  # most steps after the areas are met
SETTLED_SHARE = 1e-4  # relative decrease of the energy below which a map with the right areas is settled


@dataclass(frozen=True, eq=False)
class RegionMesh:
    """A mesh whose triangles belong to regions, and the system of Newton's method on it.

    Attributes:
        z: (n,) vertices; their unit is such that the mesh has area one.
        faces: (m, 3) triangles, counter-clockwise.
        region: (m,) the region of each triangle, -1 for none.
        target_areas: (r,) areas that the regions should have, in the unit of z squared.
        fixed: (n,) whether a vertex does not move.
    """

    z: Complex
    faces: Index
    region: Index
    target_areas: Real
    fixed: Flags

    @cached_property
    def source_areas(self) -> Real:
        """The areas of the regions in the mesh; shape (r,)."""
        return self.areas(self.z)

    def areas(self, u: Complex) -> Real:
        """Return (r,) the areas of the regions for images u of the vertices."""
        areas: Real = self._members @ triangle_areas(u[self.faces])
        return areas

    @cached_property
    def _members(self) -> csr_array:
        """(r, m) the incidence matrix of regions and triangles."""
        inside = np.flatnonzero(self.region >= 0)
        shape = self.target_areas.size, self.region.size
        return csr_array((np.ones(inside.size), (self.region[inside], inside)), shape=shape)

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of the Hessian."""
        return system_of(self.faces, np.empty(0, np.int64), self.z.size)

    @cached_property
    def rest_shapes(self) -> RestShapes:
        """The rest shapes: triangles of the mesh, scaled to the area that their region should have."""
        gradients, areas = geometry(self.z, self.faces)
        order = np.argsort(self.pattern.position[self.faces], axis=1)
        gradients = np.take_along_axis(gradients, order, axis=1)
        ratio = np.append(self.target_areas / self.source_areas, 1.0)[self.region]
        weights = areas * ratio * np.where(self.region >= 0, 1.0, BETWEEN_WEIGHT)
        scaled = np.ascontiguousarray(gradients / np.sqrt(ratio)[:, None])
        return RestShapes.of(self.pattern, scaled, weights / weights.sum())

    @cached_property
    def _fixed_entries(self) -> tuple[Flags, Index]:
        """Which entries of the matrix belong to fixed vertices, and those on its diagonal."""
        pattern = self.pattern
        is_fixed = self.fixed[pattern.order]
        rows = np.repeat(np.arange(is_fixed.size), np.diff(pattern.starts))
        return is_fixed[rows] | is_fixed[pattern.columns], pattern.diagonal[self.fixed]

    def gradients_of_areas(self, u: Complex) -> csr_array:
        """Return (r, n) derivatives ∂A/∂x + i ∂A/∂y of the areas with respect to the vertices."""
        corners = u[self.faces]
        # the derivative with respect to a corner is the opposite side, turned by -90°
        sides = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
        values = -0.5j * sides
        inside = self.region >= 0
        rows = np.repeat(self.region[inside], 3)
        columns, values = self.faces[inside].ravel(), values[inside].ravel()
        values = np.where(self.fixed[columns], 0, values)
        return csr_array((values, (rows, columns)), shape=(self.target_areas.size, u.size))


def match_areas(regions: RegionMesh, u: Complex, steps: int, tolerance: float) -> tuple[Complex, int]:
    """Move the vertices until the regions have their target areas.

    Args:
        regions: the mesh.
        u: (n,) images without folds to start from.
        steps: largest number of steps.
        tolerance: relative difference of areas that is small enough.

    Returns:
        (n,) images of the vertices, and the number of steps.
    """
    pattern, rest_shapes = regions.pattern, regions.rest_shapes
    matrix, gradient = np.empty((pattern.columns.size, 4)), np.empty(u.size, np.complex128)
    factor = Factor.of(pattern)
    entries, diagonal = regions._fixed_entries
    barrier, previous_energy, polished, is_restoring = 0.0, np.inf, 0, False
    least, idle = np.inf, 0  # smallest difference so far, and the steps since then
    for step in range(steps):
        energy = assemble(rest_shapes, u, OBJECTIVE, matrix, gradient)
        matrix[entries] = 0.0
        matrix[diagonal] = (1.0, 0.0, 0.0, 1.0)
        gradient[regions.fixed] = 0.0
        areas = regions.areas(u)
        error = np.abs(areas / regions.target_areas - 1).max()
        polished += error <= tolerance
        has_settled = is_restoring or energy > (1 - SETTLED_SHARE) * previous_energy
        if error <= tolerance and (has_settled or polished > POLISHING_STEPS):
            return u, step
        if error > (1 - LEAST_GAIN_SHARE) * least:
            idle += 1
        else:
            least, idle = error, 0
        is_restoring |= idle >= PATIENCE_STEPS and error <= ACCEPTABLE_SHARE
        previous_energy = energy
        check_time()
        if not factorise(pattern, matrix, gradient, factor):
            break
        direction, multipliers = _constrained_step(regions, u, areas, factor, has_gradient=not is_restoring)
        # The merit function has its minimum where areas are met if missing areas weigh more than the multipliers.
        barrier = max(barrier, 2 * float(np.abs(multipliers * regions.target_areas).max()))
        merit = (0.0, 1.0) if is_restoring else (1.0, barrier)
        u, share = _line_search(regions, u, direction, energy, merit)
        if share < SHORTEST_STEP:
            if is_restoring:
                return u, step + 1
            # Areas are curved functions of the vertices: where they change a lot, no step along the tangent lowers the
            # energy without missing them by more. Then the energy is low enough, and only areas are corrected.
            is_restoring = True
    return u, steps


def _constrained_step(
    regions: RegionMesh, u: Complex, areas: Real, factor: Factor, *, has_gradient: bool
) -> tuple[Complex, Real]:
    """Return the step (n,) and the multipliers (r,); `factor` contains the factor L of H, and L⁻¹ g.

    Without the gradient, the step only makes up for missing areas.
    """
    pattern = regions.pattern
    step, part = np.zeros(u.size, np.complex128), np.empty(u.size, np.complex128)
    if has_gradient:
        back_substitute(pattern, factor, step)
    # Areas grow by factors: constraints on their logarithms are closer to linear than those on areas. A region changes
    # by at most STEP_RATIO in a step, beyond which the linear model does not hold.
    scaled = csr_array(regions.gradients_of_areas(u) / areas[:, None])
    missing = np.clip(regions.target_areas / areas, 1 / STEP_RATIO, STEP_RATIO) - 1

    def solve(values: Real) -> Complex:
        """Return -H⁻¹ Bᵀ λ for multipliers."""
        forward_substitute(pattern, scaled.T @ values, factor)
        back_substitute(pattern, factor, part)
        return part

    def rates(step: Complex) -> Real:
        """Return B p for a step."""
        return (scaled.conj() @ step).real

    shape = areas.size, areas.size
    schur = LinearOperator(shape, lambda values: -rates(solve(values)), dtype=np.float64)
    # Preconditioner: the entry of B H⁻¹ Bᵀ for a region decreases with its area, as small regions yield more easily.
    scale = diags_array(np.sqrt(regions.target_areas))
    tolerances = {"rtol": MULTIPLIER_TOLERANCE, "maxiter": MOST_MULTIPLIER_STEPS}
    multipliers, _ = cg(schur, rates(step) - missing, M=scale, **tolerances)
    return step + solve(multipliers), multipliers / areas


def _line_search(
    regions: RegionMesh, u: Complex, direction: Complex, energy: float, weights: tuple[float, float]
) -> tuple[Complex, float]:
    """Return the images after a step that lowers the merit, and the share of `direction` that was taken.

    The merit is the weighted sum of the energy and of the differences of areas.
    """

    def merit(energy: float, images: Complex) -> float:
        differences = np.abs(regions.areas(images) / regions.target_areas - 1)
        return weights[0] * energy + weights[1] * float(differences.sum())

    initial = merit(energy, u)
    share = min(1.0, FOLD_MARGIN_SHARE * largest_step(regions.faces, u, direction))
    while share >= SHORTEST_STEP:
        new = u + share * direction
        if merit(regions.rest_shapes.energy(new, OBJECTIVE), new) < initial:
            return new, share
        share *= 0.5
    return u, 0.0
