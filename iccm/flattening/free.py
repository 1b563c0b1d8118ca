"""Newton on the balanced energy of a surface whose boundary is free, from one layout without folds to another.

The energy is that of `balanced.minimise.energy` over the surface's own area: at θ = 1 it is half the symmetric
Dirichlet energy (Smith and Schaefer, *Bijective Parameterization with Free Boundaries*, 2015); as θ falls towards 0
what is left is conformal.
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

STEPS_AT_ONCE, LARGE_VERTEX_COUNT = (
    8,
    20_000,
)  # steps at a time, and vertices from which there is one, which takes seconds then

SMALL_GAIN_SHARE = (
    0.01  # of the energy: gain of a step after which second derivatives have hardly changed (by hand)
)


@dataclass(frozen=True, eq=False)
class Elastic:
    """Triangles with rest shapes, all of whose vertices move but for the first few.

    Attributes:
        faces: (m, 3) triangles.
        shapes: (m, 3) their rest shapes.
        pattern: of the Newton matrices.
        rest: the rest triangles.
        held: how many of the first vertices stay.
    """

    faces: Index
    shapes: Complex
    pattern: BlockPattern
    rest: RestShapes
    held: int = 0

    @classmethod
    def of(cls, faces: Index, shapes: Complex, weights: Real | None = None, held: int = 0) -> "Elastic":
        """From (m, 3) rest shapes, which weigh as much as their areas unless weights are given."""
        return cls._on(system_of(faces, np.arange(held), int(faces.max()) + 1), faces, shapes, weights, held)

    def with_shapes(self, shapes: Complex) -> "Elastic":
        """Return the same triangles with other rest shapes (m, 3), which weigh as much as their areas."""
        return self._on(self.pattern, self.faces, shapes, None, self.held)

    @classmethod
    def _on(
        cls, pattern: BlockPattern, faces: Index, shapes: Complex, weights: Real | None, held: int
    ) -> "Elastic":
        order = np.argsort(pattern.position[faces], axis=1)
        corners = np.ascontiguousarray(np.take_along_axis(shapes, order, axis=1)).ravel()
        gradients, areas = geometry(corners, np.arange(corners.size).reshape(-1, 3))
        rest = RestShapes.of(pattern, gradients, areas if weights is None else weights)
        return cls(faces, shapes, pattern, rest, held)

    def relaxed(self, u: Complex, theta: float, steps: int, tolerance: float) -> Complex:
        """Return (n,) positions of less energy, from some without folds, until a step gains less than `tolerance` of
        it; see `newton.descend`.

        A few steps at a time, so that a signal is heard in between. A large surface's factor serves for the steps after
        one of SMALL_GAIN_SHARE gain, too, as long as each gains at most half of what the one before did.
        """
        u, tau, energy, before = u.copy(), np.zeros(self.held), self.energy(u, theta), 0.0
        system = System.of(
            self.pattern, self.faces, self.rest, Constraints.held(u, np.arange(u.size) < self.held)
        )
        at_once = min(STEPS_AT_ONCE if u.size < LARGE_VERTEX_COUNT else 1, steps)
        for _ in range(-(-steps // at_once)):
            below, made, _ = descend(system, _objective(theta), None, u, tau, at_once, tolerance)
            gain = energy - below
            slowing = gain / before if 0 < before < np.inf and not system.factorised else 1.0
            left = gain * min(1, slowing)  # to be gained yet, if gains continue to fall as fast
            again, short = system.factorised, made < at_once
            if not (short and again) and (short or left < at_once * tolerance * below):
                break
            settled = not short and gain < SMALL_GAIN_SHARE * energy and not (again and gain > 0.5 * before)
            system = replace(system, factorised=at_once == 1 and settled)
            energy, before = below, gain
        return u

    def energy(self, u: Complex, theta: float) -> float:
        """Of positions (n,); infinite with folds."""
        return self.rest.energy(u, _objective(theta))


def _objective(theta: float) -> Objective:
    """Over the surface's area alone: with half the image's a free boundary shrinks."""
    return Objective.of(theta, 1.0, SOURCE_AREA)


def surface(points: Real, faces: Index) -> Elastic:
    """Return the triangles (m, 3) of a surface in space, its area taken as one."""
    rest = laid_flat(points[faces])
    areas = triangle_areas(rest)
    return Elastic.of(faces, rest / np.sqrt(areas.sum()))
