"""A map in the making: a mesh of the source, its image, what holds its vertices, and what it stands for in space.

Planes, deformations and surfaces differ in what holds the boundary (`boundary`), and in the triangles' shapes in the
rest shape (`metric`); Newton's method moves either side of the map.
"""

from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...drawings.cost import LOST
from ...linalg.cholesky import BlockPattern, system_of
from ...plane import triangle_areas
from ..errors import Tangled
from ..minimise import newton
from ..minimise.energy import NO_AIMS, NO_SLOTS, RestShapes, geometry
from ..minimise.in_space import Ground, SurfaceMap, separate
from ..minimise.sliding import HELD, SLIDING, Border, Constraints, Rails, border_energy
from ..minimise.soft_pins import CORE_MARGIN
from ..minimise.terms import NO_TERMS, TermOnMesh, TermsOnMesh
from ..minimise.unfold import BARE, unfold
from ..minimise.untangle import STEPS, springs, untangle
from ..minimise.upright import ANY_ROTATION
from .boundary import HeldBoundary, MatchedBoundary, MatchedLoop
from .boundary_pairs import Match, Pairs
from .energy import WITHOUT_ROTATION, Energy
from .measures import stretches, turn_of
from .mesh_map import MeshMap
from .metric import PLANES, Metrics, rest_geometry

SMOOTHED_RINGS, SMOOTHINGS = 4, 20  # of inner vertices beside the outline on a new mesh, and sweeps over them


# Weights of virtual triangles while they are untangled: of triangles in holes without a partner, and in concavities.
FILLED, BAY = 2e-2, 1e-2
LOCAL = 0.5  # of the inside: unfolding where folds are hardly ever succeeds if more than that must move
PASSED_OVER = 0.1  # weight of triangles in a hole of a surface that the map does not know of, by hand
FORWARD = 8  # Newton steps on the map, before those on its inverse
GOOD_ENOUGH = 5e-4  # relative decrease of a Newton step that counts as none
SETTLED = 1e-3  # relative decrease of a round of steps that ends them
BADLY_STRETCHED = 25.0  # on a new mesh; below, q = 1 makes as many bad triangles as it mends
EASING_STEPS, EASED = 10, 1e-2  # on a new mesh, and the relative decrease that ends them
ROUNDING = 1e-9  # of the root of the area: vertices this close to their goals are there


@dataclass(frozen=True, eq=False, kw_only=True)
class DiscreteMap(MeshMap):
    """A map that Newton's method moves, vertices of the boundary first.

    Attributes:
        boundary: what holds the boundary's vertices.
        pattern: of the Newton matrices.
        value: of the energy at the last step, with the outline's term, and more for a rotation.
        multipliers: (m,) by which triangles count more, for the sake of bounds; None where all count alike.
        spared: how many of its steps the last descent did without.
        energy: what steps minimise.
        ground: the target in space, whose metric changes as vertices move; None for the one that `metrics` has.
        rigid: (m,) the rigid region that each triangle is in, -1 for none; None where there are none.
        aims: (k,) complex, the derivative that each region is to have.
        stiffness: weight of the regions' triangles.
        flat: (n,) where the vertices of regions of a surface lie, each flattened on its own; None in the plane.
        cores: of each soft pin the vertices at its core, which have places in the pattern.
    """

    boundary: HeldBoundary
    pattern: BlockPattern
    value: float = np.inf
    multipliers: Real | None = None
    spared: int = 1
    energy: Energy = WITHOUT_ROTATION
    ground: Ground | None = None
    rigid: Index | None = None
    aims: Complex = field(default_factory=lambda: NO_AIMS)
    stiffness: float = 1.0
    flat: Complex | None = None
    cores: tuple[Index, ...] = ()

    @property
    def settled(self) -> bool:
        """Whether the last descent ended before its steps did."""
        return self.spared > 0

    @property
    def matched(self) -> MatchedBoundary:
        """The boundary of a map onto a target."""
        assert isinstance(self.boundary, MatchedBoundary)
        return self.boundary

    @property
    def pairs(self) -> Pairs:
        """Arclengths of the outlines' vertices."""
        return self.matched.pairs

    @property
    def rims(self) -> list[MatchedLoop]:
        """The loops of the outline."""
        return self.matched.loops

    @property
    def match(self) -> Match:
        """The correspondence of the outlines."""
        return self.matched.match

    @property
    def inner(self) -> slice:
        """The vertices of constraints inside."""
        return slice(self.border, self.border + self.inside.z.size)

    @property
    def constrained(self) -> int:
        """How many vertices are held, or slide on a curve: the outline's, and those inside if they are bound."""
        return self.inner.stop if self.bound else self.border

    @property
    def following(self) -> Index:
        """(c,) the next vertex on the same loop, stroke or outline of a filled hole, or the vertex itself, for the
        first c."""
        inside = np.append(self.boundary.following, self.border + self.inside.following)
        soft = sum(loop.after - loop.first for loop in self.filled)
        return np.append(inside, inside.size + np.arange(soft))

    def with_pattern(self) -> "DiscreteMap":
        """With the pattern of its triangles, which are new, and of the energy's terms."""
        stencils = self.energy.stencils(self.faces)
        stencils = [*stencils, *(core[None] for core in self.cores)]
        return replace(self, pattern=system_of(self.faces, self.following, self.z.size, stencils))

    def with_cores(self) -> "DiscreteMap":
        """With places in the pattern for the vertices at the cores of soft pins, which change as vertices move."""
        pins = self.energy.pins
        if pins is None:
            return self
        needed = pins.cores(self.z, self.u, self.material)
        if self.cores and all(np.isin(core, known).all() for core, known in zip(needed, self.cores)):
            return self
        cores = tuple(pins.cores(self.z, self.u, self.material, CORE_MARGIN))
        return replace(self, cores=cores).with_pattern()

    def with_energy(self, energy: Energy) -> "DiscreteMap":
        """With another energy, whose terms have their places in the pattern."""
        changed = replace(self, energy=energy)
        if energy.terms == self.energy.terms and energy.pin_count == self.energy.pin_count:
            return changed  # `with_cores` sees to pins that have moved
        return replace(changed, cores=()).with_pattern()

    @property
    def aimed(self) -> Index:
        """(k,) the vertices that have goals, on the boundary and inside."""
        return np.append(self.boundary.pinned, self.border + np.arange(self.inside.z.size))

    @property
    def goals(self) -> Complex:
        """(k,) where these are to be."""
        return np.append(self.boundary.goals, self.inside.goals)

    def with_goals(self, goals: Complex) -> "DiscreteMap":
        """Return the map with other goals (k,)."""
        p = self.boundary.pinned.size
        inside = self.inside._replace(goals=goals[p:])
        return replace(self, boundary=self.boundary.with_goals(goals[:p]), inside=inside)

    def held(self) -> "DiscreteMap":
        """Return the map with its constraints in force, asking for no more than is."""
        return replace(self.with_goals(self.u[self.aimed]), bound=True)

    @property
    def miss(self) -> float:
        """The largest distance of a constrained vertex from its goal; 0 but for rounding counts as 0."""
        away = float(np.abs(self.u[self.aimed] - self.goals).max(initial=0.0))
        return away if away > ROUNDING else 0.0

    @property
    def form(self) -> Complex:
        """(n,) the vertices as rigid regions are to keep them."""
        return self.z if self.flat is None else self.flat

    @property
    def kept(self) -> Index:
        """(k,) the vertices of rigid regions that have aims."""
        if self.rigid is None or not self.aims.size:
            return np.empty(0, np.int64)
        return np.unique(self.faces[self.rigid >= 0])

    @cached_property
    def turn(self) -> float:
        """Radians by which the picture is turned."""
        return turn_of(self.z, self.u, self.material, self.metrics)

    def swap_sides(self) -> "DiscreteMap":
        """Return the inverse map with its boundary's places on the outlines, to be moved on; not where holes are
        filled, whose outlines are held in the source."""
        return replace(
            self,
            z=self.u,
            u=self.z,
            boundary=self.matched.inverse(),
            metrics=self.metrics[::-1],
            energy=self.energy.inverse(),
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
            displacement[self.inner] = self.inside.goals - u[self.inner]
        for _ in range(SMOOTHINGS):
            carried, mean = weights * displacement[heads], np.empty_like(displacement)
            mean.real, mean.imag = (np.bincount(tails, part, u.size) for part in (carried.real, carried.imag))
            displacement[near] = mean[near]
        u = u + displacement
        u[: self.border] = self.u[: self.border]
        if self.bound:
            u[self.inner] = self.inside.goals
        return replace(self, u=u)

    def unfolded(
        self,
        *,
        harmonic: bool = True,
        polish: int = 0,
        steps: int = STEPS,
        weighed: bool = False,
        still: Index | None = None,
        thin: float = BARE,
        most: float = LOCAL,
    ) -> "DiscreteMap":
        """Return the inside moved so that no triangle is folded; bound vertices, and those of `still` (k,), stay where
        they are. Unless it begins as the `harmonic` one it moves beside folds alone, if that undoes them.

        Args:
            harmonic: see above.
            polish: steps of all the inside that may be made once nothing is folded.
            steps: the most of these there may be.
            weighed: whether triangles in holes and concavities count less.
            still: see above.
            thin: ratio of areas, of the mean, from which down a triangle counts as folded.
            most: share of the inside that still counts as what is beside the folds.

        Raises:
            Tangled: folds remain.
        """
        gradients, areas = rest_geometry(self.z, self.u, self.faces, (self.metrics[0], None))
        weights = self.weights if weighed and self.weights is not None else np.ones(len(areas))
        u = self.u.copy()
        if self.bound:
            u[self.inner] = self.inside.goals
        held = np.arange(u.size) < self.constrained
        if still is not None:
            held[still] = True
        if not harmonic:
            image = triangle_areas(u[self.faces])
            folded = image * (areas @ weights) < thin * areas * weights * image.sum()
            with suppress(Tangled):
                return replace(self, u=unfold(u, self.faces, held, folded, gradients, areas, weights, most))
        gradients, areas = rest_geometry(self.z, self.u, self.pattern.corners, (self.metrics[0], None))
        rest = RestShapes.of(self.pattern, gradients, areas * weights)
        least = untangle(self.pattern, rest, u, held, harmonic, steps, polish)
        if not least > 0 or folds(self.faces, u):
            raise Tangled(u)
        return replace(self, u=u)

    def forward(self, q: float, steps: int, tolerance: float, *, corners: bool = True) -> "DiscreteMap":
        """Newton steps on the image; target corners keep their vertices if `corners`.

        Bound vertices that are not at their goals go there, as far as no triangle folds.
        """
        inside, met = self.inside, self.miss == 0
        stay = inside.at_target if corners else inside.stuck
        if not met:  # strokes slide once they are where they belong
            stay = np.ones(stay.size, bool)
        u, tau, end = self._descended(True, corners, stay, q, steps, tolerance)
        if self.bound and inside.strokes and met:
            inside = inside.slid(u[self.inner], tau[self.inner], stay)
        boundary = self.boundary.slid(True, tau[: self.border], corners)
        return replace(self, u=u, boundary=boundary, inside=inside, **end)

    def with_firm_regions(self, q: float, strain: float) -> "DiscreteMap":
        """Return the map with regions so stiff that a descent strains none that keeps to its aim by more than this
        (root mean square, relative to the aim): that would cost more than all that it can gain elsewhere.
        """
        assert self.rigid is not None
        rest = self._rest_shapes(True, q)
        elsewhere = rest._replace(weights=np.where(rest.aims != 0, 0, rest.weights))
        tau, constraints = self.constraints(True, True, self.inside.at_target)
        gain = elsewhere.energy(self.u, self.energy.objective(q, self.boundary.area_share(True)))
        gain += border_energy(constraints.border, tau) + self._terms(True, q).total(self.u)
        gain *= self.energy.rotation_cost(self.turn) ** q
        inside = self.rigid >= 0
        areas = np.bincount(self.rigid[inside], np.abs(triangle_areas(self.form[self.faces[inside]])))
        return replace(self, stiffness=float(gain / (strain**2 * (np.abs(self.aims) ** 2 * areas).min())))

    def inside_moved(self, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Newton steps on the image with the outline where it is."""
        held = replace(self.matched, anchored=np.ones(self.border, bool))
        moved = replace(self, boundary=held).forward(q, steps, tolerance)
        return replace(moved, boundary=self.boundary)

    def relaxed(self) -> "DiscreteMap":
        """Return a few steps at q = 1 where a triangle is badly stretched, of the inside and then of all: Newton at q
        widens it slowly.
        """
        _, stretch, _ = stretches(self.z, self.u, self.material, self.metrics)
        if stretch.max() < BADLY_STRETCHED:
            return self
        return self.inside_moved(1.0, EASING_STEPS, EASED).forward(1.0, EASING_STEPS, EASED)

    def alternated(self, q: float, rounds: int, backward: int) -> "DiscreteMap":
        """Newton steps on the map and on its inverse in turn, so that neither shape's corners are privileged."""
        state, before = self, np.inf  # the energy so far may be another one, of q = 1
        for _ in range(rounds):
            state = state.forward(q, FORWARD, 0.5 * GOOD_ENOUGH)
            state = state.backward(q, backward, 0.5 * GOOD_ENOUGH)
            if before - state.value < SETTLED * state.value:
                break
            before = state.value
        return state

    def backward(self, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Newton steps on the source, the images being kept: target corners slide along the source."""
        inside = self.inside
        z, s, end = self._descended(False, True, inside.at_source, q, steps, tolerance)
        if self.bound and inside.strokes:
            inside = inside._replace(s=s[self.inner], z=z[self.inner].copy())
        elif not self.bound and inside.z.size:  # they are vertices like any others
            inside = inside._replace(z=z[self.inner].copy())
        return replace(
            self, z=z, boundary=self.boundary.slid(False, s[: self.border], True), inside=inside, **end
        )

    def _descended(
        self, forward: bool, corners: bool, stay: Flags, q: float, steps: int, tolerance: float
    ) -> tuple[Complex, Real, dict[str, Any]]:
        """Newton on the map, or on its inverse: positions, arclengths of the constrained vertices, and how it ended;
        `stay` (k,) are those inside that do."""
        self = self.with_cores()
        moving = self.u if forward else self.z
        objective = self.energy.objective(q, self.boundary.area_share(forward), forward=forward)
        rest, surface = self._rest_shapes(forward, q), None
        if forward and self.ground is not None:
            rest, surface = self._in_space(self.ground)
        u, (tau, constraints) = moving.copy(), self.constraints(forward, corners, stay)
        upright = ANY_ROTATION
        if surface is None:  # what is moved lies in a plane
            upright = self.energy.rotation_term(self._counted(rest), u.size)
        system = newton.System.of(
            self.pattern, self.faces, rest, constraints, upright, self._terms(forward, q)
        )
        value, done, _ = newton.descend(system, objective, surface, u, tau, steps, tolerance)
        return (
            u,
            tau,
            {
                "value": float(value),
                "spared": int(steps - done),
                "pattern": self.pattern,
                "cores": self.cores,
            },
        )

    def _terms(self, forward: bool, q: float) -> TermsOnMesh:
        """Return the energy's further terms on the side that moves."""
        springs: list[TermOnMesh] = []
        if self.energy.pins is not None:
            springs = self.energy.pins.springs_on_mesh(
                self.z, self.u, self.material, self.cores, q, forward=forward
            )
        if not self.energy.terms:
            return TermsOnMesh(springs, self.pattern) if springs else NO_TERMS
        kept, moving, metrics = self._sides(forward)
        rest = RestShapes(self.material, NO_SLOTS, *rest_geometry(kept, moving, self.material, metrics))
        found = self.energy.terms_on_mesh(rest, self.pattern)
        return TermsOnMesh([*found.terms, *springs], self.pattern) if springs else found

    def _sides(self, forward: bool) -> tuple[Complex, Complex, Metrics]:
        """Vertices of the side that is kept and of the one that moves, and their metrics, in this order."""
        if forward:
            return self.z, self.u, self.metrics
        return self.u, self.z, (self.metrics[1], self.metrics[0])

    def _rest_shapes(self, forward: bool, q: float) -> RestShapes:
        """Return the rest triangles on the side that is kept, with what each counts for a power q."""
        kept, moving, metrics = self._sides(forward)
        gradients, areas = rest_geometry(kept, moving, self.pattern.corners, metrics)
        areas = self._weighed(areas, q)
        if self.rigid is None or not forward or not self.aims.size:
            return RestShapes.of(self.pattern, gradients, areas)
        # Triangles of rigid regions follow a similarity instead: of the plane, or of the region flattened, which other
        # metrics than the plane's know nothing of.
        inside = self.rigid >= 0
        if self.metrics != PLANES:
            flat_gradients, flat_areas = geometry(self.form, self.pattern.corners)
            gradients = np.where(inside[:, None], flat_gradients, gradients)
            areas = np.where(inside, flat_areas, areas)
        areas = np.where(inside, self.stiffness, 1.0) * areas
        return RestShapes.of(self.pattern, gradients, areas, np.where(inside, self.aims[self.rigid], 0))

    def _weighed(self, areas: Real, q: float) -> Real:
        """Return areas in the rest shape (m,), each times what the triangle counts.

        What is relative to the density is raised to q where it multiplies distortion, as the density itself is.
        """
        if self.multipliers is not None:  # bounds that the triangle is over
            areas = areas * self.multipliers
        if self.weights is not None:
            # Of virtual triangles the area of the image alone counts (a negative weight in the kernels): each point
            # of the target there has no partner, which costs LOST. Half of it, since the measure counts source and
            # target half each.
            areas = np.where(self.weights <= FILLED, -0.5 * LOST**q, self.weights) * areas
        if self.energy.pins is not None:  # what is around soft pins is stiffer
            areas = areas * self.energy.pins.multipliers(self.z, self.u, self.pattern.corners)
        for metric, w in zip(self.metrics, (self.z, self.u)):
            if metric is not None:
                areas = areas * metric.importance(w[self.pattern.corners]) ** q
        return areas

    def _counted(self, rest: RestShapes) -> RestShapes:
        """Return the same with rigid regions weighing no more in the turn than others."""
        if not rest.aims.size:
            return rest
        return rest._replace(weights=np.where(rest.aims != 0, 1 / self.stiffness, 1.0) * rest.weights)

    def _in_space(self, ground: Ground) -> tuple[RestShapes, SurfaceMap]:
        """Return the rest triangles, each on its own, and what their energy on the ground needs."""
        corners = self.pattern.corners
        gradients, areas = rest_geometry(self.z, self.u, corners, (self.metrics[0], None))
        if self.multipliers is not None:
            areas = areas * self.multipliers
        if self.energy.pins is not None:
            areas = areas * self.energy.pins.multipliers(self.z, self.u, corners)
        flat, flat_areas = geometry(self.z, corners)
        open = np.zeros(len(corners), bool)
        if self.weights is not None:
            open, areas = self.weights != 1, areas * self.weights
        flat, flat_areas = np.where(open[:, None], gradients, flat), np.where(open, areas, flat_areas)
        turns = np.sign(triangle_areas(self.z[corners]))
        layout = RestShapes.of(self.pattern, flat, flat_areas)
        return separate(gradients, areas), SurfaceMap.of(ground, layout, self.energy.balance, open, turns)

    def constraints(self, forward: bool, corners: bool, stay: Flags) -> tuple[Real, Constraints]:
        """Arclengths of the constrained vertices on the side that moves, and what holds them there."""
        moving = self.u if forward else self.z
        tau, border, kinds, goals, rails, own = self.boundary.support(forward, moving[: self.border], corners)
        closed = len(rails)
        if self.bound:
            inside = self.inside
            rails = [*rails, *(stroke[1 if forward else 0] for stroke in inside.strokes)]
            own = np.append(own, inside.own + closed)
            kinds = np.append(kinds, np.where(stay, HELD, SLIDING))
            goals = np.append(goals, inside.goals if forward else inside.z)
            s, chains = inside.chains(forward, self.border)
            tau, border = np.append(tau, s), border.then(chains)
        if self.filled and not forward:  # outlines of filled holes stay where they are in the source
            soft = self.constrained + np.arange(sum(loop.after - loop.first for loop in self.filled))
            own, kinds = np.append(own, 0 * soft), np.append(kinds, np.full(soft.size, HELD))
            goals = np.append(goals, moving[soft])
            tau, border = np.append(tau, np.zeros(soft.size)), border.then(Border.still(soft))
        return tau.copy(), Constraints(kinds, goals, Rails.of(rails, own, closed), border)


def folds(faces: Index, u: Complex) -> int:
    """Return how many triangles have no positive area."""
    return int(np.count_nonzero(~(triangle_areas(u[faces]) > 0)))
