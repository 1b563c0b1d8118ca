"""A map in the making: a mesh of the source, its image, and the two outlines that their boundaries slide on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...curve import Curve
from ...jit import kernel
from ...linalg.cholesky import BlockPattern, system_of
from ...maps.triangulated.patches import NO_LINES
from ..errors import Tangled
from ..kernels import twice_area
from ..meshing.mesh import Sizes, closed_links, triangulate
from ..minimise import newton
from ..minimise.energy import BOTH_AREAS, geometry
from ..minimise.sliding import BETA, HELD, SLIDING, Border, Rail, Rails
from ..minimise.untangle import STEPS, springs, untangle
from .boundary_pairs import HoleMatch, Loop, Match, Pairs, apart
from .inner_constraints import InnerConstraints
from .measures import turn_of
from .metric import PLANES, Metrics, rest_geometry
from .outline import Outline

SMOOTHED_RINGS, SMOOTHINGS = 4, 20  # of inner vertices beside the outline on a new mesh, and sweeps over them


FILLED, SHRUNK = 2e-2, 0.1  # weight of triangles in a hole without a partner, and the size at which they rest
PASSED_OVER = 0.1  # weight of triangles in a hole of a surface that the map does not know of, by hand
ROUNDING = 1e-9  # of the root of the area: vertices this close to their goals are there
NONE_INSIDE = InnerConstraints.of_pins(np.empty((0, 2), np.complex128))


class MeshHoles(NamedTuple):
    """The holes of a map in the making.

    Attributes:
        outlines: those of each hole of the mesh, in the source and in the target.
        loops: their vertices.
        filled: the outlines of holes of the source that have no partner, as inner vertices of the mesh.
    """

    outlines: tuple[tuple[Outline, Outline], ...] = ()
    loops: tuple[Loop, ...] = ()
    filled: tuple[Loop, ...] = ()

    def inverse(self) -> "MeshHoles":
        """Those of the inverse map."""
        outlines = tuple((b, a) for a, b in self.outlines)
        return MeshHoles(outlines, tuple(loop.inverse() for loop in self.loops))


NO_HOLES = MeshHoles()


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
        inside: the constraints inside, whose vertices come after the outline's.
        bound: whether their vertices are held by them; if not, they are like any others.
        holes: the holes; vertices of filled ones come last of those that are given to the mesh.
        weights: (m,) 1, and FILLED or PASSED_OVER for triangles in holes; None where there are none.
        settled: whether the last descent ended before its steps did.
        metrics: of surfaces that the planes of source and target stand for.
    """

    source: Outline
    target: Outline
    faces: Index
    system: BlockPattern
    z: Complex
    u: Complex
    pairs: Pairs
    anchored: Flags
    axis: float = np.inf
    energy: float = np.inf
    inside: InnerConstraints = NONE_INSIDE
    bound: bool = False
    holes: MeshHoles = NO_HOLES
    weights: Real | None = None
    settled: bool = True
    metrics: Metrics = PLANES

    @classmethod
    def on(
        cls,
        source: Outline,
        target: Outline,
        pairs: Pairs,
        sizes: Sizes,
        anchors: Match | None,
        inside: InnerConstraints = NONE_INSIDE,
        axis: float = np.inf,
        holes: MeshHoles = NO_HOLES,
        filled: Sequence[Complex] = (),
        metrics: Metrics = PLANES,
    ) -> "DiscreteMap":
        """A mesh for boundary pairs; the image is given on the outline and zero inside. `filled` are the polygons of
        holes that are covered."""
        rims = rims_of(source, target, holes, pairs.s.size)
        outer, *inner = (rim.source.curve.at(pairs.s[rim.vertices]) for rim in rims)
        soft = closed_links([rim.size for rim in filled])
        links = np.append(inside.links, inside.z.size + soft)
        z, faces = triangulate(
            outer, sizes, np.concatenate([inside.z, *filled]), links, inner, inside.rays(outer)
        )
        given = np.arange(inside.z.size + soft.size)
        ends = np.where((links >= 0) & (given < inside.z.size), links, given)
        following = np.append(_following(rims), pairs.s.size + ends)
        u = np.zeros(z.size, np.complex128)
        for rim in rims:
            u[rim.vertices] = rim.target.curve.at(pairs.tau[rim.vertices])
        anchored = np.zeros(pairs.s.size, bool)
        if anchors is not None:
            first = rims[0].vertices
            anchored[first] = ~apart(pairs.s[first], anchors.s, source.length)
        system = system_of(faces, following, z.size)
        weights = weights_of(z, faces, filled) if filled else None
        return cls(
            *(source, target, faces, system, z, u, pairs, anchored, axis),
            inside=inside,
            holes=holes,
            weights=weights,
            metrics=metrics,
        )

    @property
    def border(self) -> int:
        """How many vertices are on the outline, those of holes included."""
        return self.pairs.s.size

    @property
    def rims(self) -> list["MatchedLoop"]:
        """The loops of the outline."""
        return rims_of(self.source, self.target, self.holes, self.border)

    @property
    def outer(self) -> slice:
        """The vertices of the outer loop."""
        return self.rims[0].vertices

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The outlines of holes."""
        return self.holes.loops

    @property
    def filled(self) -> tuple[Loop, ...]:
        """Those of holes without a partner."""
        return self.holes.filled

    @property
    def material(self) -> Index:
        """The triangles that are not in filled holes."""
        return self.faces if self.weights is None else self.faces[self.weights == 1]

    @property
    def constrained(self) -> int:
        """How many vertices are held, or slide on a curve: the outline's, and those inside if they are bound."""
        return self.border + (self.inside.z.size if self.bound else 0)

    @property
    def first_pin(self) -> int:
        """The vertex of the first pin inside."""
        return self.border + int(np.count_nonzero(self.inside.own >= 0))

    @property
    def lines(self) -> Index:
        """(l, 2) vertices of the edges of strokes that are met."""
        if not self.bound:
            return NO_LINES
        return self.inside.lines_with(self.z[: self.border])

    @property
    def miss(self) -> float:
        """The largest distance of a constrained vertex inside from its goal; 0 but for rounding counts as 0."""
        u = self.u[self.border : self.border + self.inside.z.size]
        away = float(np.abs(u - self.inside.goals).max(initial=0.0))
        return away if away > ROUNDING else 0.0

    @cached_property
    def turn(self) -> float:
        """Radians by which the picture is turned."""
        return turn_of(self.z, self.u, self.material, self.metrics)

    @property
    def match(self) -> Match:
        """The correspondence of the outlines."""
        outer, *holes = [self._match(rim) for rim in self.rims]
        numbers = ((loop.source, loop.target) for loop in self.holes.loops)
        return outer._replace(holes=tuple(HoleMatch(i, j, hole) for (i, j), hole in zip(numbers, holes)))

    def _match(self, rim: "MatchedLoop") -> Match:
        s, tau = self.pairs.s[rim.vertices], self.pairs.tau[rim.vertices]
        return Match(np.append(s, s[0] + rim.source.length), np.append(tau, tau[0] + rim.target.length))

    def inverse(self) -> "DiscreteMap":
        """The inverse map, of whose vertices and pins the roles are exchanged; not where holes are filled."""
        s, tau, at_source, at_target = self.pairs
        return replace(
            self,
            source=self.target,
            target=self.source,
            z=self.u,
            u=self.z,
            pairs=Pairs(tau, s, at_target, at_source),
            holes=self.holes.inverse(),
            metrics=self.metrics[::-1],
        )

    def moved_to_border(self, u: Complex) -> "DiscreteMap":
        """With images u, moved so that those of the outline lie where they belong: a harmonic displacement that fades
        within a few rings of triangles. Without it triangles beside the outline are squeezed, and a Newton step
        widens one by no more than half.
        """
        weights = springs(*geometry(self.z, self.faces)).ravel()
        tails, heads = np.roll(self.faces, -1, axis=1).ravel(), np.roll(self.faces, -2, axis=1).ravel()
        tails, heads, weights = np.append(tails, heads), np.append(heads, tails), np.tile(weights, 2)
        near = np.zeros(u.size, bool)
        near[: self.constrained] = True
        for _ in range(SMOOTHED_RINGS):
            near[heads[near[tails]]] = True
        near[: self.constrained] = False
        smoothed = near[tails]
        tails, heads, weights = tails[smoothed], heads[smoothed], weights[smoothed]
        weights = weights / np.bincount(tails, weights, u.size)[tails]
        displacement = np.zeros(u.size, np.complex128)
        displacement[: self.border] = self.u[: self.border] - u[: self.border]
        if self.bound:
            displacement[self.border : self.constrained] = (
                self.inside.goals - u[self.border : self.constrained]
            )
        for _ in range(SMOOTHINGS):
            carried, mean = weights * displacement[heads], np.empty_like(displacement)
            mean.real, mean.imag = (np.bincount(tails, part, u.size) for part in (carried.real, carried.imag))
            displacement[near] = mean[near]
        u = u + displacement
        u[: self.border] = self.u[: self.border]
        if self.bound:
            u[self.border : self.constrained] = self.inside.goals
        return replace(self, u=u)

    def unfolded(
        self, *, harmonic: bool = True, polish: int = 0, steps: int = STEPS, weighed: bool = False
    ) -> "DiscreteMap":
        """The inside moved so that no triangle is folded; bound vertices stay where they are. Those in holes count
        less if `weighed`.

        Raises:
            Tangled: folds remain.
        """
        gradients, areas = rest_geometry(self.z, self.u, self.system.corners, (self.metrics[0], None))
        if weighed and self.weights is not None:
            areas = areas * self.weights
        u = self.u.copy()
        u[self.border : self.constrained] = (
            self.inside.goals if self.bound else u[self.border : self.constrained]
        )
        least = untangle(self.system, gradients, areas, u, self.constrained, harmonic, steps, polish)
        if not least > 0 or folds(self.faces, u):
            raise Tangled(u)
        return replace(self, u=u)

    def forward(
        self, theta: float, q: float, steps: int, tolerance: float, *, corners: bool
    ) -> "DiscreteMap":
        """Newton steps on the image; target corners keep their vertices if `corners`.

        Bound vertices that are not at their goals go there, as far as no triangle folds.
        """
        held = self.anchored | self.pairs.at_target if corners else self.anchored
        inside = self.inside
        stay = inside.at_target if corners else inside.stuck
        if self.miss > 0:  # strokes slide once they are where they belong
            stay = np.ones(stay.size, bool)
        u, tau, energy, settled = self._descended(True, held, stay, theta, q, steps, tolerance)
        pairs = self.pairs._replace(tau=tau[: self.border], at_target=self.pairs.at_target & held)
        if self.bound and inside.strokes and self.miss == 0:
            inside = inside.slid(u[self.border : self.constrained], tau[self.border :], stay)
        return replace(self, u=u, pairs=pairs, energy=energy, inside=inside, settled=settled)

    def backward(self, theta: float, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Newton steps on the source, the images being kept: target corners slide along the source."""
        held = self.anchored | self.pairs.at_source
        z, s, energy, settled = self._descended(
            False, held, self.inside.at_source, theta, q, steps, tolerance
        )
        inside = self.inside
        if self.bound and inside.strokes:
            inside = inside._replace(
                s=s[self.border : self.constrained], z=z[self.border : self.constrained].copy()
            )
        elif not self.bound and inside.z.size:  # they are vertices like any others
            inside = inside._replace(z=z[self.border : self.border + inside.z.size].copy())
        pairs = self.pairs._replace(s=s[: self.border])
        return replace(self, z=z, pairs=pairs, energy=energy, inside=inside, settled=settled)

    def _descended(
        self,
        forward: bool,
        held: Flags,
        stay: Flags,
        theta: float,
        q: float,
        steps: int,
        tolerance: float,
    ) -> tuple[Complex, Real, float, bool]:
        """Newton on the map, or on its inverse: positions, arclengths of the constrained vertices, the energy, and
        whether it settled."""
        inside = self.inside
        kept, moving = (self.z, self.u) if forward else (self.u, self.z)
        tau, border = self.chains(forward)
        kinds = np.where(held, HELD, SLIDING)
        goals = moving[: self.border]
        if self.bound:
            kinds = np.append(kinds, np.where(stay, HELD, SLIDING))
            goals = np.append(goals, inside.goals if forward else inside.z)
        if not forward:  # outlines of filled holes stay where they are in the source
            kinds = np.append(kinds, np.full(tau.size - kinds.size, HELD))
            goals = np.append(goals, moving[goals.size : tau.size])
        metrics = self.metrics if forward else self.metrics[::-1]
        gradients, areas = rest_geometry(kept, moving, self.system.corners, metrics)
        if self.weights is not None:
            gradients, areas = _shrunk(gradients, areas, self.weights, forward)
        u = moving.copy()
        energy, done, _ = newton.descend(
            self.system,
            self.faces,
            gradients,
            areas,
            u,
            tau,
            self.rails(forward, tau.size),
            border,
            kinds,
            goals,
            float(theta),
            float(q),
            BOTH_AREAS,
            0.0,
            steps,
            tolerance,
            newton.Space.of(self.system, tau.size),
        )
        return u, tau, float(energy), bool(done < steps)

    def rails(self, forward: bool, count: int) -> Rails:
        """What the first `count` vertices slide on, on the side that moves; those that stay have any."""
        rims, own = self.rims, np.zeros(count, np.int64)
        found: list[Rail] = [(rim.target if forward else rim.source).rail for rim in rims]
        for k, rim in enumerate(rims):
            own[rim.vertices] = k
        if self.bound:
            found += [stroke[1 if forward else 0] for stroke in self.inside.strokes]
            own[self.border : self.constrained] = self.inside.own + len(rims)
        return Rails.of(found, own, len(rims))

    def chains(self, forward: bool) -> tuple[Real, Border]:
        """Arclengths of the constrained vertices on the side that moves, and the curves they lie on as chains."""
        moving, kept = (self.pairs.tau, self.pairs.s) if forward else (self.pairs.s, self.pairs.tau)
        spans, laps, rims = np.empty(kept.size), np.zeros(kept.size), self.rims
        spans[:-1] = kept[1:] - kept[:-1]
        for rim in rims:
            (length, lap), last = rim.lengths if forward else rim.lengths[::-1], rim.vertices.stop - 1
            spans[last] = kept[rim.vertices.start] + length - kept[last]
            laps[last] = lap
        stiffness = np.full(kept.size, BETA)
        if self.axis < np.inf:
            on_axis = np.mod(self.pairs.s, self.source.length) > self.axis - 1e-9 * self.source.length
            stiffness[on_axis] = 0.0
        border = Border(_following(rims), spans, stiffness, laps)
        if self.bound:
            tau, chains = self.inside.chains(forward, self.border)
            moving, border = np.append(moving, tau), border.then(chains)
        if forward or not self.holes.filled:
            return moving.copy(), border
        soft = self.constrained + np.arange(sum(loop.after - loop.first for loop in self.holes.filled))
        return np.append(moving, np.zeros(soft.size)), border.then(Border.still(soft))


class MatchedLoop(NamedTuple):
    """A loop of a map's outline.

    Attributes:
        source: what it is in the source.
        target: and in the target.
        vertices: those on it.
    """

    source: Outline
    target: Outline
    vertices: slice

    @property
    def lengths(self) -> tuple[float, float]:
        """Of both."""
        return self.source.length, self.target.length


def rims_of(source: Outline, target: Outline, holes: MeshHoles, border: int) -> list[MatchedLoop]:
    """The loops of an outline of `border` vertices, the outer one first."""
    outer = MatchedLoop(source, target, slice(0, holes.loops[0].first if holes.loops else border))
    return [outer, *(MatchedLoop(*pair, loop.vertices) for pair, loop in zip(holes.outlines, holes.loops))]


def weights_of(z: Complex, faces: Index, filled: Sequence[Complex]) -> Real:
    """(m,) weights of triangles: FILLED in the polygons `filled`, else 1."""
    middles, weights = z[faces].mean(axis=1), np.ones(len(faces))
    for polygon in filled:
        weights[Curve(polygon).contains(middles)] = FILLED
    return weights


def _shrunk(gradients: Complex, areas: Real, weights: Real, forward: bool) -> tuple[Complex, Real]:
    """Gradients (m, 3) and areas (m,) as if triangles in filled holes were small in the source: by themselves they are
    content as they are, and their images would stay as large."""
    size = np.where(weights == FILLED, SHRUNK, 1.0)
    if forward:
        return gradients / size[:, None], areas * size**2 * weights
    return gradients * size[:, None], areas * weights


def _following(rims: Sequence[MatchedLoop]) -> Index:
    return closed_links([rim.vertices.stop - rim.vertices.start for rim in rims])


@kernel
def folds(faces, u):
    """How many triangles have no positive area."""
    count = 0
    for t in range(faces.shape[0]):
        if not twice_area(u, faces[t, 0], faces[t, 1], faces[t, 2]) > 0:
            count += 1
    return count
