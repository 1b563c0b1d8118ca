"""Newton's method for the balanced energy of a surface with a free boundary, from a layout without folds.

The energy is that of `balanced.minimise.energy` over the surface's own area. At θ = 1 it is half the symmetric
Dirichlet energy (Smith and Schaefer, *Bijective Parameterization with Free Boundaries*, 2015); as θ tends to 0 the
layout becomes conformal.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.minimise.energy import SOURCE_AREA, Objective, RestShapes, geometry
from ..balanced.minimise.newton import System, descend
from ..balanced.minimise.sliding import Constraints
from ..linalg.cholesky import BlockPattern, system_of
from ..meshes.stretch import laid_flat
from ..plane import triangle_areas

STEPS_AT_ONCE, LARGE_VERTEX_COUNT = 8, 20_000
"""Newton steps between checks for signals; number of vertices from which each step is checked, as it takes seconds."""

SMALL_GAIN_SHARE = 0.01
"""Share of the energy; after a step that gains less, second derivatives have hardly changed, and are used once more."""


@dataclass(frozen=True, eq=False)
class Elastic:
    """Triangles with rest shapes; all vertices move except the first few.

    Attributes:
        faces: (m, 3) triangles.
        shapes: (m, 3) their rest shapes.
        pattern: sparsity pattern of the Newton matrices.
        rest: data of the rest shapes for the energy.
        fixed: number of vertices, the first ones, that do not move.
    """

    faces: Index
    shapes: Complex
    pattern: BlockPattern
    rest: RestShapes
    fixed: int = 0

    @classmethod
    def of(cls, faces: Index, shapes: Complex, weights: Real | None = None, fixed: int = 0) -> "Elastic":
        """Create it from rest shapes (m, 3), weighted by `weights` (m,) or by their areas."""
        return cls._on(
            system_of(faces, np.arange(fixed), int(faces.max()) + 1), faces, shapes, weights, fixed
        )

    def with_shapes(self, shapes: Complex, weights: Real | None = None) -> "Elastic":
        """Return the same triangles with other rest shapes (m, 3), weighted by `weights` (m,) or by their areas."""
        return self._on(self.pattern, self.faces, shapes, weights, self.fixed)

    @classmethod
    def _on(
        cls, pattern: BlockPattern, faces: Index, shapes: Complex, weights: Real | None, fixed: int
    ) -> "Elastic":
        order = np.argsort(pattern.position[faces], axis=1)
        corners = np.ascontiguousarray(np.take_along_axis(shapes, order, axis=1)).ravel()
        gradients, areas = geometry(corners, np.arange(corners.size).reshape(-1, 3))
        rest = RestShapes.of(pattern, gradients, areas if weights is None else weights)
        return cls(faces, shapes, pattern, rest, fixed)

    def relaxed(self, u: Complex, theta: float, steps: int, tolerance: float) -> Complex:
        """Return (n,) positions with less energy, from positions without folds; see `newton.descend`.

        Newton's method runs a few steps at a time, so that signals are handled in between, until a step gains less than
        `tolerance` of the energy. The Cholesky factor of a large surface is reused after a step that gains less than
        SMALL_GAIN_SHARE, as long as each step gains at most half as much as the one before.
        """
        u, tau, energy, before = u.copy(), np.zeros(self.fixed), self.energy(u, theta), 0.0
        system = System.of(
            self.pattern, self.faces, self.rest, Constraints.of_fixed(u, np.arange(u.size) < self.fixed)
        )
        at_once = min(STEPS_AT_ONCE if u.size < LARGE_VERTEX_COUNT else 1, steps)
        for _ in range(-(-steps // at_once)):
            below, taken, _ = descend(system, _objective(theta), None, u, tau, at_once, tolerance)
            gain = energy - below
            slowing = gain / before if 0 < before < np.inf and not system.factorised else 1.0
            left = gain * min(
                1, slowing
            )  # expected gain of further steps, if gains keep falling at this rate
            factorised, short = system.factorised, taken < at_once
            if not (short and factorised) and (short or left < at_once * tolerance * below):
                break
            settled = (
                not short and gain < SMALL_GAIN_SHARE * energy and not (factorised and gain > 0.5 * before)
            )
            system = replace(system, factorised=at_once == 1 and settled)
            energy, before = below, gain
        return u

    def energy(self, u: Complex, theta: float) -> float:
        """Return the energy of positions (n,); infinite with folds."""
        return self.rest.energy(u, _objective(theta))


def _objective(theta: float) -> Objective:
    """Return the energy over the surface's area alone: with half the image's area a free boundary would shrink."""
    return Objective.of(theta, 1.0, SOURCE_AREA)


def surface(points: Real, faces: Index) -> Elastic:
    """Return the triangles (m, 3) of a surface with their shapes in space as rest shapes, scaled to area one."""
    rest = laid_flat(points[faces])
    areas = triangle_areas(rest)
    return Elastic.of(faces, rest / np.sqrt(areas.sum()))
