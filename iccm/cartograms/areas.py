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
BETWEEN_WEIGHT = 0.1  # of triangles outside of all regions, which may be distorted
STEP_RATIO = 2.0  # of areas before and after a step at most
MULTIPLIER_TOLERANCE, MOST_MULTIPLIER_STEPS = 1e-3, 200  # of conjugate gradients
FOLD_MARGIN_SHARE = 0.8  # of the step at which a triangle would become degenerate
SHORTEST_STEP = 1e-4
LEAST_GAIN_SHARE, PATIENCE_STEPS, ACCEPTABLE_SHARE = 0.1, 4, 5e-3
"""Once all areas are this close, only areas are corrected unless the largest difference decreases by the first share
within these steps."""
POLISHING_STEPS = 5  # most steps after the areas are met
SETTLED_SHARE = 1e-4  # relative decrease of the energy below which a map with the right areas is settled


@dataclass(frozen=True, eq=False)
class Regions:
    """A mesh whose triangles belong to regions, and the system of Newton's method on it.

    Attributes:
        z: (n,) vertices; their unit is such that the mesh has area one.
        faces: (m, 3) triangles, counter-clockwise.
        region: (m,) the region of each triangle, -1 for none.
        wanted: (r,) the areas that regions should have.
        held: (n,) vertices that do not move.
    """

    z: Complex
    faces: Index
    region: Index
    wanted: Real
    held: Flags

    @cached_property
    def given(self) -> Real:
        """(r,) the areas of the regions in the mesh."""
        return self.areas(self.z)

    def areas(self, u: Complex) -> Real:
        """Return (r,) the areas of the regions for images u of the vertices."""
        areas: Real = self._members @ triangle_areas(u[self.faces])
        return areas

    @cached_property
    def _members(self) -> csr_array:
        """(r, m) which triangles are in a region."""
        inside = np.flatnonzero(self.region >= 0)
        shape = self.wanted.size, self.region.size
        return csr_array((np.ones(inside.size), (self.region[inside], inside)), shape=shape)

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of the Hessian."""
        return system_of(self.faces, np.empty(0, np.int64), self.z.size)

    @cached_property
    def rest(self) -> RestShapes:
        """The rest shapes: triangles of the mesh, scaled to the area that their region should have."""
        gradients, areas = geometry(self.z, self.faces)
        order = np.argsort(self.pattern.position[self.faces], axis=1)
        gradients = np.take_along_axis(gradients, order, axis=1)
        ratio = np.append(self.wanted / self.given, 1.0)[self.region]
        weights = areas * ratio * np.where(self.region >= 0, 1.0, BETWEEN_WEIGHT)
        scaled = np.ascontiguousarray(gradients / np.sqrt(ratio)[:, None])
        return RestShapes.of(self.pattern, scaled, weights / weights.sum())

    @cached_property
    def _fixed(self) -> tuple[Flags, Index]:
        """Which entries of the matrix belong to held vertices, and those on its diagonal."""
        pattern = self.pattern
        held = self.held[pattern.order]
        rows = np.repeat(np.arange(held.size), np.diff(pattern.starts))
        return held[rows] | held[pattern.columns], pattern.diagonal[self.held]

    def gradients_of_areas(self, u: Complex) -> csr_array:
        """Return (r, n) derivatives ∂A/∂x + i ∂A/∂y of the areas with respect to the vertices."""
        corners = u[self.faces]
        # the derivative with respect to a corner is the opposite side, turned by -90°
        sides = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
        values = -0.5j * sides
        inside = self.region >= 0
        rows = np.repeat(self.region[inside], 3)
        columns, values = self.faces[inside].ravel(), values[inside].ravel()
        values = np.where(self.held[columns], 0, values)
        return csr_array((values, (rows, columns)), shape=(self.wanted.size, u.size))


def match_areas(regions: Regions, u: Complex, steps: int, tolerance: float) -> tuple[Complex, int]:
    """Return images of the vertices for which regions have their areas, and the number of steps.

    Args:
        regions: the mesh.
        u: (n,) images without folds to start from.
        steps: most steps.
        tolerance: relative difference of areas that is small enough.
    """
    pattern, rest = regions.pattern, regions.rest
    matrix, gradient = np.empty((pattern.columns.size, 4)), np.empty(u.size, np.complex128)
    factor = Factor.of(pattern)
    entries, diagonal = regions._fixed
    barrier, before, polished, is_restoring = 0.0, np.inf, 0, False
    least, idle = np.inf, 0  # smallest difference so far, and the steps since then
    for step in range(steps):
        energy = assemble(rest, u, OBJECTIVE, matrix, gradient)
        matrix[entries] = 0.0
        matrix[diagonal] = (1.0, 0.0, 0.0, 1.0)
        gradient[regions.held] = 0.0
        areas = regions.areas(u)
        off = np.abs(areas / regions.wanted - 1).max()
        polished += off <= tolerance
        has_settled = is_restoring or energy > (1 - SETTLED_SHARE) * before
        if off <= tolerance and (has_settled or polished > POLISHING_STEPS):
            return u, step
        if off > (1 - LEAST_GAIN_SHARE) * least:
            idle += 1
        else:
            least, idle = off, 0
        is_restoring |= idle >= PATIENCE_STEPS and off <= ACCEPTABLE_SHARE
        before = energy
        check_time()
        if not factorise(pattern, matrix, gradient, factor):
            break
        way, multipliers = _constrained_step(regions, u, areas, factor, has_gradient=not is_restoring)
        # The merit function has its minimum where areas are met if missing areas weigh more than the multipliers.
        barrier = max(barrier, 2 * float(np.abs(multipliers * regions.wanted).max()))
        merit = (0.0, 1.0) if is_restoring else (1.0, barrier)
        u, share = _line_search(regions, u, way, energy, merit)
        if share < SHORTEST_STEP:
            if is_restoring:
                return u, step + 1
            # Areas are curved functions of the vertices: where they change a lot, no step along the tangent lowers the
            # energy without missing them by more. Then the energy is low enough, and only areas are corrected.
            is_restoring = True
    return u, steps


def _constrained_step(
    regions: Regions, u: Complex, areas: Real, factor: Factor, *, has_gradient: bool
) -> tuple[Complex, Real]:
    """Return the step (n,) and the multipliers (r,); `factor` has the factor of H, and L⁻¹ g.

    Without the gradient, the step only makes up for missing areas.
    """
    pattern = regions.pattern
    step, part = np.zeros(u.size, np.complex128), np.empty(u.size, np.complex128)
    if has_gradient:
        back_substitute(pattern, factor, step)
    # Areas grow by factors: constraints on their logarithms are closer to linear than those on areas. A region changes
    # by at most STEP_RATIO in a step, beyond which the linear model does not hold.
    scaled = csr_array(regions.gradients_of_areas(u) / areas[:, None])
    missing = np.clip(regions.wanted / areas, 1 / STEP_RATIO, STEP_RATIO) - 1

    def solve(values: Real) -> Complex:
        """Return -H⁻¹ Bᵀ λ for multipliers."""
        forward_substitute(pattern, scaled.T @ values, factor)
        back_substitute(pattern, factor, part)
        return part

    def rates(way: Complex) -> Real:
        """Return B p for a step."""
        return (scaled.conj() @ way).real

    shape = areas.size, areas.size
    schur = LinearOperator(shape, lambda values: -rates(solve(values)), dtype=np.float64)
    # Preconditioner: the entry of B H⁻¹ Bᵀ for a region decreases with its area, as small regions yield more easily.
    scale = diags_array(np.sqrt(regions.wanted))
    tolerances = {"rtol": MULTIPLIER_TOLERANCE, "maxiter": MOST_MULTIPLIER_STEPS}
    multipliers, _ = cg(schur, rates(step) - missing, M=scale, **tolerances)
    return step + solve(multipliers), multipliers / areas


def _line_search(
    regions: Regions, u: Complex, way: Complex, energy: float, weights: tuple[float, float]
) -> tuple[Complex, float]:
    """Return the images after a step that lowers the merit, and the step's share.

    The merit is the weighted sum of the energy and of the differences of areas.
    """

    def merit(energy: float, images: Complex) -> float:
        differences = np.abs(regions.areas(images) / regions.wanted - 1)
        return weights[0] * energy + weights[1] * float(differences.sum())

    here = merit(energy, u)
    share = min(1.0, FOLD_MARGIN_SHARE * largest_step(regions.faces, u, way))
    while share >= SHORTEST_STEP:
        new = u + share * way
        if merit(regions.rest.energy(new, OBJECTIVE), new) < here:
            return new, share
        share *= 0.5
    return u, 0.0
