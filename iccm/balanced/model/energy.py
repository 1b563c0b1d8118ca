"""The energy by which balanced maps are found and compared: one value that a solve carries whole.

Of a map it is the mean density of angles and areas (`minimise.energy`), times the cost of rotating the picture
(`minimise.upright`), and further terms if there are any (`minimise.terms`). Settings, problems and maps hold the same
value, and whatever compares maps asks it.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index
from ...drawings.cost import price
from ...linalg.cholesky import BlockPattern
from ...plane import triangle_areas
from ..minimise.energy import BOTH_AREAS, NO_SLOTS, Objective, RestShapes, energy_of
from ..minimise.soft_pins import SoftPins
from ..minimise.terms import NO_TERMS, Term, TermsOnMesh
from ..minimise.upright import ANY_ROTATION, Upright, rotation_cost
from .measures import turn_of
from .metric import PLANES, Metrics, rest_geometry

UPRIGHT = 2.0  # a quarter turn doubles the cost, upside down trebles it


@dataclass(frozen=True)
class Energy:
    """Weights of what a balanced map minimises.

    Attributes:
        balance: θ, the weight of the area part: 0 keeps angles only, 1 is even, more keeps areas.
        upright: w, the weight of rotations: upside down a map costs 1 + w times as much; 0 where any rotation is as
            good.
        terms: that are added to the mean density, before what rotations cost.
        pins: soft pins, whose springs are added in the same way; None without any.
    """

    balance: float = 1.0
    upright: float = UPRIGHT
    terms: tuple[Term, ...] = ()
    pins: SoftPins | None = None

    def without_rotation(self) -> "Energy":
        """Return the energy to which any rotation of the picture is as good."""
        return replace(self, upright=0.0)

    @property
    def pin_count(self) -> int:
        """How many soft pins there are."""
        return 0 if self.pins is None else len(self.pins.source)

    def without_pins(self) -> "Energy":
        """Return the energy for other domains than those that the pins are of."""
        return replace(self, pins=None)

    def of_part(self, share: float) -> "Energy":
        """Return the energy of a part with a share of the domain's area, scaled to area one."""
        return replace(self, terms=tuple(term.of_part(share) for term in self.terms))

    def objective(self, q: float, share: float = BOTH_AREAS, *, forward: bool = True) -> Objective:
        """Return what Newton's method minimises for a power q; see `minimise.energy.Objective`."""
        return Objective.of(self.balance, q, share, forward=forward)

    def rotation_term(self, rest: RestShapes, count: int) -> Upright:
        """Return the cost of rotations for `count` vertices of rest triangles."""
        return Upright.of(rest, count, self.upright) if self.upright > 0 else ANY_ROTATION

    def stencils(self, faces: Index) -> list[Index]:
        """Return the stencils (k, s) of each further term."""
        return [term.stencils(faces) for term in self.terms]

    def inverse(self) -> "Energy":
        """Return the energy of the inverse map."""
        return self if self.pins is None else replace(self, pins=self.pins.inverse())

    def terms_on_mesh(self, rest: RestShapes, pattern: BlockPattern | None = None) -> TermsOnMesh:
        """Return the further terms for rest triangles; derivatives need the Hessian's pattern."""
        return TermsOnMesh([term.on_mesh(rest) for term in self.terms], pattern) if self.terms else NO_TERMS

    def rotation_cost(self, angle: float) -> float:
        """Return the factor by which a map costs more that rotates the picture by an angle in radians."""
        return rotation_cost(self.upright, np.cos(angle))

    def between(self, z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> float:
        """Return the energy of a map z -> u (n,) at q = 1, without rotation and the outline's term.

        Both areas are taken as one: a similarity has energy 1, and a map has that of its inverse.
        """
        if metrics == PLANES and not self.terms and self.pins is None:
            return energy_of(z, u, faces, self.balance)
        if metrics == PLANES and self.pins is None:
            z, u = (w / np.sqrt(np.abs(triangle_areas(w[faces])).sum()) for w in (z, u))
        rest = RestShapes(faces, NO_SLOTS, *rest_geometry(z, u, faces, metrics))
        density = rest.energy(u, self.objective(1.0))
        if not np.isfinite(density):
            return density
        if self.pins is not None:
            cores = self.pins.cores(z, u, faces)
            for spring in self.pins.springs_on_mesh(z, u, faces, cores, 1.0, forward=True):
                density += float(spring.values(u).sum())
        return density + self.terms_on_mesh(rest).total(u)

    def cost(
        self,
        z: Complex,
        u: Complex,
        faces: Index,
        lost: tuple[float, float],
        metrics: Metrics = PLANES,
        rotation: float | None = None,
    ) -> float:
        """Return the cost of a map z -> u (n,), of which a share of the source and of the target is lost.

        Args:
            z: vertices.
            u: their images.
            faces: (m, 3) triangles of what is not lost.
            lost: as of `drawings.cost.price`.
            metrics: of the surfaces that both planes stand for.
            rotation: radians by which the picture is rotated beyond what is asked; None for those of z -> u.
        """
        angle = turn_of(z, u, faces, metrics) if rotation is None else rotation
        return price(self.between(z, u, faces, metrics), lost, self.rotation_cost(angle))


WITHOUT_ROTATION = Energy(upright=0.0)
"""Angles and areas alike, whatever the rotation."""
