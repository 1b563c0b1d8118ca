"""Newton on the balanced energy of a surface whose boundary is free, from one layout without folds to another.

The energy is that of `balanced.minimise.energy` over the surface's own area: at θ = 1 it is half the symmetric
Dirichlet energy (Smith and Schaefer, *Bijective Parameterization with Free Boundaries*, 2015); as θ falls towards 0
what is left is conformal.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.minimise import newton
from ..balanced.minimise.energy import geometry, total
from ..balanced.minimise.sliding import HELD, NO_RAIL, Border, Rails
from ..linalg.cholesky import BlockPattern, system_of
from ..meshes.stretch import laid_flat
from ..plane import triangle_areas

FEW, LARGE = 8, 20_000  # steps at a time, and vertices from which there are two: one takes seconds then
SURFACE_ALONE = 0.0  # share of the image's area in the measure: with ½ a free boundary shrinks


@dataclass(frozen=True, eq=False)
class Elastic:
    """Triangles with rest shapes, all of whose vertices move but for the first few.

    Attributes:
        faces: (m, 3) triangles.
        rest: (m, 3) their rest shapes.
        system: pattern of the Newton matrices.
        gradients: (m, 3) of the hat functions on the rest shapes.
        weights: (m,) of the triangles.
        held: how many of the first vertices stay.
    """

    faces: Index
    rest: Complex
    system: BlockPattern
    gradients: Complex
    weights: Real
    held: int = 0

    @classmethod
    def of(cls, faces: Index, rest: Complex, weights: Real | None = None, held: int = 0) -> "Elastic":
        """From (m, 3) rest shapes, which weigh as much as their areas unless weights are given."""
        system = system_of(faces, np.arange(held), int(faces.max()) + 1)
        order = np.argsort(system.position[faces], axis=1)
        corners = np.ascontiguousarray(np.take_along_axis(rest, order, axis=1)).ravel()
        gradients, areas = geometry(corners, np.arange(corners.size).reshape(-1, 3))
        return cls(faces, rest, system, gradients, areas if weights is None else weights, held)

    def relaxed(self, u: Complex, theta: float, steps: int, tolerance: float) -> Complex:
        """(n,) positions of less energy, from some without folds; see `newton.descend`.

        A few steps at a time, so that a signal is heard in between.
        """
        at_once = FEW if u.size < LARGE else 2
        energy = np.inf
        for _ in range(-(-steps // at_once)):
            u, below, made = self._descended(u, theta, min(at_once, steps), tolerance)
            if made < min(at_once, steps) or energy - below < at_once * tolerance * below:
                break
            energy = below
        return u

    def _descended(
        self, u: Complex, theta: float, steps: int, tolerance: float
    ) -> tuple[Complex, float, int]:
        """Positions, energy and number of steps."""
        u, still = u.copy(), np.arange(self.held)
        energy, made, _ = newton.descend(
            self.system,
            self.faces,
            self.gradients,
            self.weights,
            u,
            np.zeros(self.held),
            Rails.of([NO_RAIL], 0 * still),
            Border.still(still),
            np.full(self.held, HELD),
            u[: self.held].copy(),
            float(theta),
            1.0,
            SURFACE_ALONE,
            0.0,
            steps,
            tolerance,
            newton.Space.of(self.system, self.held),
        )
        return u, float(energy), int(made)

    def energy(self, u: Complex, theta: float) -> float:
        """Of positions (n,); infinite with folds."""
        corners = self.system.corners
        return float(total(corners, self.gradients, self.weights, u, float(theta), 1.0, SURFACE_ALONE, 0.0))


def surface(points: Real, faces: Index) -> Elastic:
    """The triangles (m, 3) of a surface in space, its area taken as one."""
    rest = laid_flat(points[faces])
    areas = triangle_areas(rest)
    return Elastic.of(faces, rest / np.sqrt(areas.sum()))
