"""Newton's method for the balanced energy of a surface with a free boundary, from a layout without folds.

The energy is that of `balanced.minimise.energy` over the surface's own area. At θ = 1 it is half the symmetric
Dirichlet energy (Smith and Schaefer, *Bijective Parameterization with Free Boundaries*, 2015); as θ tends to 0 the
layout becomes conformal.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import deadline
from ..arrays import Complex, Index, Real
from ..balanced.minimise.energy import NO_SLOTS, SOURCE_AREA, Objective, RestShapes, geometry
from ..balanced.minimise.newton import System, descend
from ..balanced.minimise.sliding import Constraints
from ..balanced.minimise.terms import NO_TERMS, TermOnMesh, TermsOnMesh
from ..linalg.cholesky import BlockPattern, system_of
from ..meshes.stretch import laid_flat
from ..plane import triangle_areas

STEPS_AT_ONCE, LARGE_VERTEX_COUNT = 8, 20_000
"""Newton steps between checks for signals; number of vertices from which each step is checked, as it takes seconds."""

SMALL_GAIN_SHARE = 0.01
"""Share of the energy; after a step that gains less, second derivatives have hardly changed, and are used once more."""


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Triangles, all of whose vertices move except the first few.

    Attributes:
        faces: (m, 3) triangles.
        fixed: number of vertices, the first ones, that do not move.
    """

    faces: Index
    fixed: int = 0

    @cached_property
    def pattern(self) -> BlockPattern:
        """The sparsity pattern of the Newton matrices, which takes longer than a step, and much memory."""
        return system_of(self.faces, np.arange(self.fixed), int(self.faces.max()) + 1)


@dataclass(frozen=True, eq=False)
class Elastic:
    """Triangles with rest shapes.

    Attributes:
        connectivity: the triangles.
        shapes: (m, 3) their rest shapes.
        weights: (m,) their weights in the energy.
    """

    connectivity: Connectivity
    shapes: Complex
    weights: Real

    @classmethod
    def of(cls, faces: Index, shapes: Complex, weights: Real | None = None, fixed: int = 0) -> "Elastic":
        """Create it from rest shapes (m, 3), weighted by `weights` (m,) or by their areas."""
        return cls._on(Connectivity(faces, fixed), shapes, weights)

    def with_shapes(self, shapes: Complex, weights: Real | None = None) -> "Elastic":
        """Return the same triangles with other rest shapes (m, 3), weighted by `weights` (m,) or by their areas."""
        return self._on(self.connectivity, shapes, weights)

    @classmethod
    def _on(cls, connectivity: Connectivity, shapes: Complex, weights: Real | None) -> "Elastic":
        return cls(connectivity, shapes, triangle_areas(shapes) if weights is None else weights)

    @property
    def faces(self) -> Index:
        """The triangles; shape (m, 3)."""
        return self.connectivity.faces

    @cached_property
    def _rest(self) -> RestShapes:
        """The rest shapes for Newton's method, whose corners are in the pattern's order."""
        pattern = self.connectivity.pattern
        order = np.argsort(pattern.position[self.faces], axis=1)
        corners = np.ascontiguousarray(np.take_along_axis(self.shapes, order, axis=1)).ravel()
        gradients, _ = geometry(corners, np.arange(corners.size).reshape(-1, 3))
        return RestShapes.of(pattern, gradients, self.weights)

    def relaxed(
        self,
        u: Complex,
        theta: float,
        steps: int,
        tolerance: float,
        term: TermOnMesh | None = None,
    ) -> Complex:
        """Return (n,) positions with less energy, from positions without folds; see `newton.descend`.

        `term` is added to the energy; it has to be zero at `u`.

        Newton's method runs a few steps at a time, so that signals are handled in between, until a step gains less than
        `tolerance` of the energy, or the time for searches is over. The Cholesky factor of a large surface is reused
        after a step that gains less than SMALL_GAIN_SHARE, as long as each step gains at most half as much as the one
        before.
        """
        pattern, rest, fixed = self.connectivity.pattern, self._rest, self.connectivity.fixed
        u, tau, energy, previous_gain = u.copy(), np.zeros(fixed), rest.energy(u, _objective(theta)), 0.0
        constraints = Constraints.of_fixed(u, np.arange(u.size) < fixed)
        terms = NO_TERMS if term is None else TermsOnMesh([term], pattern)
        system = System.of(pattern, self.faces, rest, constraints, terms=terms)
        at_once = min(STEPS_AT_ONCE if u.size < LARGE_VERTEX_COUNT else 1, steps)
        for _ in range(-(-steps // at_once)):
            if deadline.ends_search():
                break
            below, steps_made, _ = descend(system, _objective(theta), None, u, tau, at_once, tolerance)
            gain = energy - below
            slowing = gain / previous_gain if 0 < previous_gain < np.inf and not system.factorised else 1.0
            # of further steps, if gains keep falling at this rate
            expected_gain = gain * min(1, slowing)
            factorised, short = system.factorised, steps_made < at_once
            if not (short and factorised) and (short or expected_gain < at_once * tolerance * below):
                break
            settled = (
                not short
                and gain < SMALL_GAIN_SHARE * energy
                and not (factorised and gain > 0.5 * previous_gain)
            )
            system = replace(system, factorised=at_once == 1 and settled)
            energy, previous_gain = below, gain
        return u

    def energy(self, u: Complex, theta: float) -> float:
        """Return the energy of positions (n,), infinite with folds; this does not need the matrices' pattern."""
        corners = np.ascontiguousarray(self.shapes).ravel()
        gradients, _ = geometry(corners, np.arange(corners.size).reshape(-1, 3))
        return RestShapes(self.faces, NO_SLOTS, gradients, self.weights).energy(u, _objective(theta))


def _objective(theta: float) -> Objective:
    """Return the energy over the surface's area alone: with half the image's area a free boundary would shrink."""
    return Objective.of(theta, 1.0, SOURCE_AREA)


def surface(points: Real, faces: Index) -> Elastic:
    """Return the triangles (m, 3) of a surface with their shapes in space as rest shapes, scaled to area one."""
    rest_corners = laid_flat(points[faces])
    areas = triangle_areas(rest_corners)
    return Elastic.of(faces, rest_corners / np.sqrt(areas.sum()))
