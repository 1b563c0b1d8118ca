"""A deformation in the making: a mesh of the shape, its image, and the vertices that constraints hold or guide."""

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...linalg.cholesky import BlockPattern, system_of
from ..errors import Stuck
from ..minimise import newton
from ..minimise.energy import geometry
from ..minimise.sliding import FREE, HELD, NO_RAIL, SLIDING, Border, Rails
from ..minimise.untangle import STEPS, untangle
from ..model.discrete_map import ROUNDING, folds
from ..model.inner_constraints import InnerConstraints

SHARE_FORWARD, SHARE_BACKWARD = 0.0, 1.0
"""The source's area alone counts: else a bar shrinks to 74 % as it bends."""


@dataclass(frozen=True, eq=False)
class Deformed:
    """A piecewise linear map, vertices of the outlines first, then those that are constrained inside.

    Attributes:
        faces: (m, 3) counter-clockwise triangles.
        system: pattern of the Newton matrices.
        z: (n,) vertices in the shape.
        u: (n,) their images.
        rims: how many vertices are on each of the outlines, the outer one and those of holes.
        pinned: (p,) those of them that are pins.
        goals: (p,) where these are to be.
        inside: the constraints inside.
        energy: at the last step.
    """

    faces: Index
    system: BlockPattern
    z: Complex
    u: Complex
    rims: tuple[int, ...]
    pinned: Index
    goals: Complex
    inside: InnerConstraints
    energy: float = np.inf

    @classmethod
    def on(
        cls, z: Complex, faces: Index, rims: tuple[int, ...], pinned: Index, goals: Complex,
        inside: InnerConstraints,
    ) -> "Deformed":  # fmt: skip
        """The mesh with every vertex where it is in the shape."""
        border = sum(rims)
        following = np.append(np.arange(border), border + inside.following)
        system = system_of(faces, following, z.size)
        return cls(faces, system, z, z.copy(), rims, pinned, goals, inside)

    @property
    def border(self) -> int:
        """How many vertices are on the outlines."""
        return sum(self.rims)

    @property
    def loops(self) -> list[Index]:
        """The vertices of each outline."""
        return np.split(np.arange(self.border), np.cumsum(self.rims)[:-1])

    @property
    def constrained(self) -> Index:
        """The vertices that have goals: of pins on the outline, then those inside."""
        return np.append(self.pinned, self.border + np.arange(self.inside.z.size))

    @property
    def aims(self) -> Complex:
        """Where these are to be."""
        return np.append(self.goals, self.inside.goals)

    @property
    def miss(self) -> float:
        """The largest distance of a constrained vertex from its goal; 0 but for rounding counts as 0."""
        away = float(np.abs(self.u[self.constrained] - self.aims).max(initial=0.0))
        return away if away > ROUNDING else 0.0

    @property
    def first_pin(self) -> int:
        """The vertex of the first pin inside."""
        return self.border + int(np.count_nonzero(self.inside.own >= 0))

    @property
    def lines(self) -> Index:
        """(l, 2) vertices of the edges of strokes."""
        return self.inside.lines_with(self.z[: self.border])

    def aimed(self, aims: Complex) -> "Deformed":
        """The same map with other goals."""
        p = self.pinned.size
        return replace(self, goals=aims[:p], inside=self.inside._replace(goals=aims[p:]))

    def unfolded(self) -> "Deformed":
        """The inside moved so that no triangle is folded; the outline and what is constrained stay.

        Raises:
            Stuck: folds remain.
        """
        if not folds(self.faces, self.u):
            return self
        gradients, areas = geometry(self.z, self.system.corners)
        u = self.u.copy()
        least = untangle(self.system, gradients, areas, u, self.border + self.inside.z.size, False, STEPS, 0)
        if not least > 0 or folds(self.faces, u):
            raise Stuck("the map folds on another mesh")
        return replace(self, u=u)

    def forward(
        self, theta: float, q: float, steps: int, tolerance: float, *, corners: bool = True
    ) -> "Deformed":
        """Newton steps on the image; what is not at its goal goes there, as far as no triangle folds.

        Corners of target strokes keep their vertices if `corners`.
        """
        inside = self.inside
        stay = inside.at_target if corners else inside.stuck
        if self.miss > 0:
            stay = np.ones(stay.size, bool)
        pinned = np.zeros(self.border, bool)
        pinned[self.pinned] = True
        goals = np.zeros(self.border, np.complex128)
        goals[self.pinned] = self.goals
        u, tau, energy = self._descended(
            True, pinned, np.append(goals, inside.goals), stay, theta, q, steps, tolerance
        )
        if inside.strokes and self.miss == 0:
            inside = inside.slid(u[self.inner], tau, stay)
        return replace(self, u=u, energy=energy, inside=inside)

    def backward(self, theta: float, q: float, steps: int, tolerance: float) -> "Deformed":
        """Newton steps on the vertices in the shape, their images kept: corners of target strokes slide."""
        inside = self.inside
        held = np.ones(self.border, bool)
        goals = np.append(self.z[: self.border], inside.z)
        z, s, energy = self._descended(False, held, goals, inside.at_source, theta, q, steps, tolerance)
        return replace(self, z=z, energy=energy, inside=inside._replace(s=s, z=z[self.inner].copy()))

    @property
    def inner(self) -> slice:
        """The vertices that are constrained inside."""
        return slice(self.border, self.border + self.inside.z.size)

    def _descended(
        self, forward: bool, pinned: Flags, goals: Complex, stay: Flags, theta: float, q: float, steps: int,
        tolerance: float,
    ) -> tuple[Complex, Real, float]:  # fmt: skip
        """Newton on the map, or on its inverse: positions, arclengths of the vertices inside, and the energy."""
        kept, moving = (self.z, self.u) if forward else (self.u, self.z)
        inside = self.inside
        kinds = np.append(np.where(pinned, HELD, FREE), np.where(stay, HELD, SLIDING))
        rails = [NO_RAIL, *(stroke[1 if forward else 0] for stroke in inside.strokes)]
        tau, chains = inside.chains(forward, self.border)
        border = Border.still(np.arange(self.border)).then(chains)
        gradients, areas = geometry(kept, self.system.corners)
        u, tau = moving.copy(), np.append(np.zeros(self.border), tau)
        energy, *_ = newton.descend(
            self.system, self.faces, gradients, areas, u, tau,
            Rails.of(rails, np.append(np.zeros(self.border, np.int64), inside.own + 1)),
            border, kinds, goals, float(theta), float(q),
            SHARE_FORWARD if forward else SHARE_BACKWARD, 0.0, steps, tolerance,
            newton.Space.of(self.system, tau.size),
        )  # fmt: skip
        return u, tau[self.border :], float(energy)
