"""The energy that balanced maps minimise, and by which they are compared, as one value.

It is the mean density of angles and areas (`minimise.energy`), times the cost of rotating the picture
(`minimise.upright`), plus further terms if there are any (`minimise.terms`). Problems and maps hold the same
value, and everything that compares maps uses it.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index
from ...drawings.cost import Cost
from ...errors import InputError
from ...linalg.cholesky import BlockPattern
from ...options import Options
from ...plane import Similarity, triangle_areas
from ..minimise.energy import BOTH_AREAS, NO_SLOTS, Objective, RestShapes, energy_of
from ..minimise.soft_pins import SoftPins
from ..minimise.terms import NO_TERMS, MapSides, Term, TermsOnMesh
from ..minimise.upright import ANY_ROTATION, Upright, rotation_cost
from .measures import mean_rotation
from .metric import PLANES, Metrics, rest_geometry

UPRIGHT = 2.0  # a rotation by 90° doubles the cost, by 180° trebles it


@dataclass(frozen=True)
class Energy:
    """Weights of the energy of a balanced map.

    Attributes:
        balance: θ, the weight of areas against angles: 0 preserves angles only, 1 weighs both equally, larger
            values preserve areas.
        upright: w, the weight of rotations: a map that is upside down costs 1 + w times as much; with 0 all
            rotations cost the same.
        terms: further terms, added to the mean density before the factor for rotation.
        pins: soft pins, whose springs are added in the same way; None if there are none.
    """

    balance: float = 1.0
    upright: float = UPRIGHT
    terms: tuple[Term, ...] = ()
    pins: SoftPins | None = None

    @classmethod
    def of(cls, options: Options) -> "Energy":
        """Return the energy that options request, in the given coordinates.

        Raises:
            InputError: an item of `terms` is not a `Term`.
        """
        for number, term in enumerate(options.terms, 1):
            if not isinstance(term, Term):
                raise InputError(
                    f"terms: item {number} is a {type(term).__name__}, not an iccm.balanced.Term"
                )
        return cls(options.balance, 0.0 if options.rotation is None else UPRIGHT, tuple(options.terms))

    def without_rotation(self) -> "Energy":
        """Return the energy with which all rotations of the picture cost the same."""
        return replace(self, upright=0.0)

    @property
    def pin_count(self) -> int:
        """Number of soft pins."""
        return 0 if self.pins is None else len(self.pins.source)

    def without_pins(self) -> "Energy":
        """Return the energy without soft pins, for other domains than those in which they lie."""
        return replace(self, pins=None)

    def of_part(self, share: float) -> "Energy":
        """Return the energy for a part with the given share of the domain's area, scaled to area one."""
        return replace(self, terms=tuple(term.of_part(share) for term in self.terms))

    def objective(self, q: float, share: float = BOTH_AREAS, *, forward: bool = True) -> Objective:
        """Return the objective of Newton's method for a power q; see `minimise.energy.Objective`."""
        return Objective.of(self.balance, q, share, forward=forward)

    def rotation_term(self, rest: RestShapes, count: int) -> Upright:
        """Return the cost of rotations as a term on rest triangles with `count` vertices."""
        return Upright.of(rest, count, self.upright) if self.upright > 0 else ANY_ROTATION

    def stencils(self, faces: Index) -> list[Index]:
        """Return the vertex stencils of the further terms, a (k, s) array for each."""
        return [term.stencils(faces) for term in self.terms]

    def inverse(self) -> "Energy":
        """Return the energy of the inverse map."""
        pins = None if self.pins is None else self.pins.inverse()
        return replace(self, pins=pins, terms=tuple(term.inverse() for term in self.terms))

    def in_unit(self, to_unit: tuple[Similarity, Similarity], pins: SoftPins | None = None) -> "Energy":
        """Return the energy in unit coordinates of source and target, with the given soft pins.

        Terms are rotated and mirrored with the shapes.
        """
        source, target = (complex(similarity.factor / abs(similarity.factor)) for similarity in to_unit)
        terms = [term.rotated(source, target) for term in self.terms]
        if to_unit[0].mirrored:
            terms = [term.mirrored() for term in terms]
        return replace(self, terms=tuple(terms), pins=pins)

    @property
    def is_mirror_symmetric(self) -> bool:
        """Whether maps of shapes with a vertical axis of symmetry cost as much as their mirror images."""
        return self.pins is None and all(
            term.mirrored().rotated(-1.0, -1.0) == term  # mirrored about the imaginary axis
            for term in self.terms
        )

    def terms_on_mesh(
        self, z: Complex, u: Complex, faces: Index, metrics: Metrics, pattern: BlockPattern | None = None
    ) -> TermsOnMesh:
        """Return the further terms of a map z -> u whose images u move; derivatives need the Hessian's pattern."""
        if not self.terms:
            return NO_TERMS
        back = (metrics[1], metrics[0])
        sides = MapSides(
            *(z, u),
            RestShapes(faces, NO_SLOTS, *rest_geometry(z, u, faces, metrics)),
            RestShapes(faces, NO_SLOTS, *rest_geometry(u, z, faces, back)),
        )
        return TermsOnMesh([term.on_sides(sides) for term in self.terms], pattern)

    def rotation_cost(self, angle: float) -> float:
        """Return the factor by which a rotation of the picture, by an angle in radians, raises a map's cost."""
        return rotation_cost(self.upright, np.cos(angle))

    def between(self, z: Complex, u: Complex, faces: Index, metrics: Metrics = PLANES) -> float:
        """Return the energy of a map z -> u at q = 1.

        The costs of rotation and of the outline's parametrization are not included. Both domains are scaled to
        area one, so that a similarity has energy 1, and a map the same energy as its inverse.

        Args:
            z: (n,) vertices.
            u: (n,) their images.
            faces: (m, 3) triangles.
            metrics: of the surfaces that both planes stand for.
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
        return density + self.terms_on_mesh(z, u, faces, metrics).total(u)

    def sum_of_terms(self, z: Complex, u: Complex, faces: Index) -> float:
        """Return the sum of the further terms of a map z -> u on triangles (m, 3), with both areas scaled to one."""
        if not self.terms:
            return 0.0
        z, u = (w / np.sqrt(np.abs(triangle_areas(w[faces])).sum()) for w in (z, u))
        return self.terms_on_mesh(z, u, faces, PLANES).total(u)

    def cost(
        self,
        z: Complex,
        u: Complex,
        faces: Index,
        lost_shares: tuple[float, float],
        metrics: Metrics = PLANES,
        rotation: float | None = None,
    ) -> float:
        """Return the cost of a map z -> u that covers only a part of the source and of the target.

        Args:
            z: (n,) vertices.
            u: (n,) their images.
            faces: (m, 3) triangles of the covered part.
            lost_shares: shares of the source and of the target that are not covered; see `drawings.cost`.
            metrics: of the surfaces that both planes stand for.
            rotation: radians by which the picture is rotated relative to the requested rotation; None to
                measure it on z -> u.
        """
        angle = mean_rotation(z, u, faces, metrics) if rotation is None else rotation
        return Cost(self.between(z, u, faces, metrics), *lost_shares, self.rotation_cost(angle)).total


WITHOUT_ROTATION = Energy(upright=0.0)
"""Angles and areas weighed equally, and all rotations at the same cost."""
