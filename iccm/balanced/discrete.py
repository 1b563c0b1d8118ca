"""A map in the making: a mesh of the source, its image, and the two outlines that their boundaries slide on."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from ..arrays import Complex, Flags, Index, Real
from .failure import Stuck
from .kernels import kernel, twice_area
from .meshing.mesh import Sizes, triangulate
from .minimise import newton
from .minimise.energy import geometry
from .minimise.ldl import System, system_of
from .minimise.measures import turn_of
from .minimise.sliding import Border
from .minimise.untangle import LEAST_WEIGHT, STEPS, untangle
from .outline import Outline
from .pairs import Match, Pairs

BETA = 0.02  # weight of the outline's term; without it outline edges cut across the tips of limbs

SMOOTHED_RINGS, SMOOTHINGS = 4, 20  # of inner vertices beside the outline on a new mesh, and sweeps over them


@dataclass(frozen=True, eq=False)
class DiscreteMap:
    """A piecewise linear map, outline vertices first.

    Attributes:
        source: outline of the source at this level.
        target: outline of the target.
        faces: (m, 3) counter-clockwise triangles.
        system: pattern of the Newton matrices.
        z: (n,) vertices in the source.
        u: (n,) their images.
        pairs: arclengths of the outline vertices, and which are corners.
        anchored: (b,) outline vertices that never move.
        axis: arclength on the source from which the outline is a mirror axis and has no energy of its own.
        energy: at the last step, with the outline's term.
    """

    source: Outline
    target: Outline
    faces: Index
    system: System
    z: Complex
    u: Complex
    pairs: Pairs
    anchored: Flags
    axis: float = np.inf
    energy: float = np.inf

    @classmethod
    def on(
        cls, source: Outline, target: Outline, pairs: Pairs, sizes: Sizes, anchors: Match | None
    ) -> "DiscreteMap":
        """A mesh for boundary pairs; the image is given on the outline and zero inside."""
        z, faces = triangulate(source.curve.at(pairs.s), sizes)
        following = (np.arange(pairs.s.size) + 1) % pairs.s.size
        u = np.zeros(z.size, np.complex128)
        u[: pairs.s.size] = target.curve.at(pairs.tau)
        anchored, axis = np.zeros(pairs.s.size, bool), np.inf
        if anchors is not None:
            gap = np.mod(pairs.s[:, None] - anchors.s + 0.5 * source.length, source.length)
            anchored = np.any(np.abs(gap - 0.5 * source.length) < 1e-9 * source.length, axis=1)
            axis = anchors.s[-1]
        return cls(source, target, faces, system_of(faces, following, z.size), z, u, pairs, anchored, axis)

    @property
    def border(self) -> int:
        """How many vertices are on the outline."""
        return self.pairs.s.size

    @property
    def turn(self) -> float:
        """Radians by which the picture is turned."""
        return turn_of(self.z, self.u, self.faces)

    @property
    def match(self) -> Match:
        """The correspondence of the outlines."""
        s, tau = self.pairs.s, self.pairs.tau
        return Match(np.append(s, s[0] + self.source.length), np.append(tau, tau[0] + self.target.length))

    def moved_to_border(self, u: Complex) -> "DiscreteMap":
        """With images u, moved so that those of the outline lie where they belong: a harmonic displacement that fades
        within a few rings of triangles. Without it triangles beside the outline are squeezed, and a Newton step
        widens one by no more than half.
        """
        gradients, areas = geometry(self.z, self.faces)
        a, b = np.roll(gradients, -1, axis=1), np.roll(gradients, -2, axis=1)
        weights = np.maximum(-4 * areas[:, None] * (a * b.conj()).real, LEAST_WEIGHT).ravel()
        tails, heads = np.roll(self.faces, -1, axis=1).ravel(), np.roll(self.faces, -2, axis=1).ravel()
        ends = np.concatenate([tails, heads]), np.concatenate([heads, tails])
        graph = scipy.sparse.csr_array((np.tile(weights, 2), ends), (u.size, u.size))
        near = np.zeros(u.size, bool)
        near[: self.border] = True
        for _ in range(SMOOTHED_RINGS):
            near[graph[near].indices] = True
        near[: self.border] = False
        rows = graph[near]
        rows = scipy.sparse.diags_array(1 / np.asarray(rows.sum(axis=1)).ravel()) @ rows
        displacement = np.zeros(u.size, np.complex128)
        displacement[: self.border] = self.u[: self.border] - u[: self.border]
        for _ in range(SMOOTHINGS):
            displacement[near] = rows @ displacement
        u = u + displacement
        u[: self.border] = self.u[: self.border]
        return replace(self, u=u)

    def unfolded(self, *, harmonic: bool = True, polish: int = 0) -> "DiscreteMap":
        """The inside moved so that no triangle is folded.

        Raises:
            Stuck: folds remain.
        """
        gradients, areas = geometry(self.z, self.system.corners)
        u = self.u.copy()
        least = untangle(self.system, gradients, areas, u, self.border, harmonic, STEPS, polish)
        if not least > 0 or folds(self.faces, u):
            raise Stuck("no map without folds was found for this correspondence of the outlines")
        return replace(self, u=u)

    def forward(
        self, theta: float, q: float, steps: int, tolerance: float, *, corners: bool
    ) -> "DiscreteMap":
        """Newton steps on the image; target corners keep their vertices if `corners`."""
        held = self.anchored | self.pairs.at_target if corners else self.anchored
        border = self._border(self.pairs.s, self.source.length)
        u, tau, energy = _descended(
            self, self.z, self.u, self.pairs.tau, self.target, border, held, theta, q, steps, tolerance
        )
        at_target = self.pairs.at_target & held
        return replace(self, u=u, pairs=self.pairs._replace(tau=tau, at_target=at_target), energy=energy)

    def backward(self, theta: float, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Newton steps on the source, the images being kept: target corners slide along the source."""
        held = self.anchored | self.pairs.at_source
        border = self._border(self.pairs.tau, self.target.length)
        z, s, energy = _descended(
            self, self.u, self.z, self.pairs.s, self.source, border, held, theta, q, steps, tolerance
        )
        return replace(self, z=z, pairs=self.pairs._replace(s=s), energy=energy)

    def _border(self, kept: Real, length: float) -> Border:
        following = (np.arange(kept.size) + 1) % kept.size
        on_axis = np.mod(self.pairs.s, self.source.length) > self.axis - 1e-9 * self.source.length
        return Border(following, np.diff(kept, append=kept[0] + length), np.where(on_axis, 0.0, BETA))


def _descended(
    state: DiscreteMap,
    kept: Complex,
    moving: Complex,
    arclengths: Real,
    outline: Outline,
    border: Border,
    held: Flags,
    theta: float,
    q: float,
    steps: int,
    tolerance: float,
) -> tuple[Complex, Real, float]:
    """Newton on the map kept -> moving whose outline slides on `outline`."""
    gradients, areas = geometry(kept, state.system.corners)
    u, s = moving.copy(), arclengths.copy()
    energy, _ = newton.descend(
        state.system,
        state.faces,
        gradients,
        areas,
        u,
        s,
        outline.rail,
        border,
        held,
        float(theta),
        float(q),
        steps,
        tolerance,
    )
    return u, s, float(energy)


@kernel
def folds(faces, u):
    """How many triangles have no positive area."""
    count = 0
    for t in range(faces.shape[0]):
        if not twice_area(u, faces[t, 0], faces[t, 1], faces[t, 2]) > 0:
            count += 1
    return count
