"""The discrete map that a solve works on: a mesh of the source, its image, constraints, and rest shapes.

Maps of planar domains, deformations and maps of surfaces differ in the constraints on the boundary (`boundary`)
and in the rest shapes of triangles (`metric`). Newton's method moves either side of the map.
"""

from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...arrays import Complex, Flags, Index, Real, distinct
from ...drawings.cost import LOST_POINT_ENERGY
from ...linalg.cholesky import BlockPattern, system_of
from ...plane import triangle_areas
from ..errors import Tangled
from ..minimise import newton
from ..minimise.energy import NO_AIMS, RestShapes, geometry
from ..minimise.in_space import Ground, SurfaceMap, separate
from ..minimise.sliding import HELD, SLIDING, Border, Constraints, Rails, border_energy
from ..minimise.soft_pins import CORE_MARGIN_RATIO
from ..minimise.terms import NO_TERMS, TermOnMesh, TermsOnMesh
from ..minimise.unfold import BARE, unfold
from ..minimise.untangle import STEPS, springs, untangle
from ..minimise.upright import ANY_ROTATION
from .boundary import HeldBoundary, MatchedBoundary, MatchedLoop
from .boundary_pairs import Match, Pairs
from .energy import WITHOUT_ROTATION, Energy
from .measures import mean_rotation, stretches
from .mesh_map import MeshMap
from .metric import PLANES, Metrics, rest_geometry

SMOOTHED_RINGS, SMOOTHINGS = (
    4,
    20,
)  # on a new mesh: rings of vertices at the outline, and sweeps


# Weights of virtual triangles during untangling: in holes without a partner, and in concavities.
FILLED, BAY = 2e-2, 1e-2
LOCAL = 0.5  # share of the inside; local unfolding hardly ever succeeds if more than this must move
PASSED_OVER = 0.1
"""Weight of triangles in a hole of a surface that the map ignores: little, but enough to keep them from
collapsing."""
FORWARD = 8  # Newton steps on the map before steps on its inverse
GOOD_ENOUGH = 5e-4  # a Newton step with a smaller relative decrease is the last
SETTLED = 1e-3  # a round of steps with a smaller relative decrease is the last
# Stretch from which a new mesh is relaxed; below, steps at q = 1 make as many bad triangles as they mend.
BADLY_STRETCHED = 25.0
EASING_STEPS, EASED = 10, 1e-2  # most steps on a new mesh, and the relative decrease that ends them
ROUNDING = 1e-9  # relative to the root of the area: vertices this close to their goals have reached them


@dataclass(frozen=True, eq=False, kw_only=True)
class DiscreteMap(MeshMap):
    """A map that Newton's method moves; vertices of the boundary come first.

    Attributes:
        boundary: the constraints on boundary vertices.
        pattern: of the Newton matrices.
        value: energy after the last step, with the outline's term and the cost of rotation.
        multipliers: (m,) additional weights of triangles that exceed bounds on the distortion; None if all are
            1.
        spared: number of permitted steps that the last descent did not need.
        energy: the energy that steps minimise.
        ground: the target in space, whose metric changes as vertices move; None if `metrics` has the target's
            metric.
        rigid: (m,) index of the rigid region that each triangle is in, -1 for none; None if there are no
            regions.
        aims: (k,) complex, the derivative that each region should have.
        stiffness: weight of the regions' triangles.
        flat: (n,) positions of the vertices of a surface's regions, each region flattened separately; None in
            the plane.
        cores: for each soft pin, the vertices at its core, which have entries in the pattern.
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
        """Whether the last descent converged before its steps were used up."""
        return self.spared > 0

    @property
    def matched(self) -> MatchedBoundary:
        """The boundary of a map onto a target."""
        assert isinstance(self.boundary, MatchedBoundary)
        return self.boundary

    @property
    def pairs(self) -> Pairs:
        """Arclengths of the vertices on the outlines."""
        return self.matched.pairs

    @property
    def rims(self) -> list[MatchedLoop]:
        """The loops of the boundary."""
        return self.matched.loops

    @property
    def match(self) -> Match:
        """The correspondence of the outlines."""
        return self.matched.match

    @property
    def inner(self) -> slice:
        """The range of vertices of constraints inside."""
        return slice(self.border, self.border + self.inside.z.size)

    @property
    def constrained(self) -> int:
        """Number of vertices that are held or slide on a curve.

        They are those of the outline, and those of constraints in force.
        """
        return self.inner.stop if self.bound else self.border

    @property
    def following(self) -> Index:
        """The next vertex on the same loop, stroke or outline of a filled hole, or the vertex itself; shape (c,).

        It covers the first c vertices, those of the boundary, of constraints and of filled holes.
        """
        inside = np.append(self.boundary.following, self.border + self.inside.following)
        soft = sum(loop.after - loop.first for loop in self.filled)
        return np.append(inside, inside.size + np.arange(soft))

    def with_pattern(self) -> "DiscreteMap":
        """Return the map with the matrix pattern of its (new) triangles and of the energy's terms."""
        stencils = self.energy.stencils(self.faces)
        stencils = [*stencils, *(core[None] for core in self.cores)]
        return replace(self, pattern=system_of(self.faces, self.following, self.z.size, stencils))

    def with_cores(self) -> "DiscreteMap":
        """Return the map with entries in the pattern for the vertices at the cores of soft pins.

        These change as vertices move.
        """
        pins = self.energy.pins
        if pins is None:
            return self
        needed = pins.cores(self.z, self.u, self.material)
        if self.cores and all(np.isin(core, present).all() for core, present in zip(needed, self.cores)):
            return self
        cores = tuple(pins.cores(self.z, self.u, self.material, CORE_MARGIN_RATIO))
        return replace(self, cores=cores).with_pattern()

    def with_energy(self, energy: Energy) -> "DiscreteMap":
        """Return the map with another energy, whose terms have their entries in the pattern."""
        changed = replace(self, energy=energy)
        if energy.terms == self.energy.terms and energy.pin_count == self.energy.pin_count:
            return changed  # `with_cores` handles pins that moved
        return replace(changed, cores=()).with_pattern()

    @property
    def aimed(self) -> Index:
        """The vertices that have goals, on the boundary and inside; shape (k,)."""
        return np.append(self.boundary.pinned, self.border + np.arange(self.inside.z.size))

    @property
    def goals(self) -> Complex:
        """Their goal positions; shape (k,)."""
        return np.append(self.boundary.goals, self.inside.goals)

    def with_goals(self, goals: Complex) -> "DiscreteMap":
        """Return the map with other goals (k,)."""
        p = self.boundary.pinned.size
        inside = self.inside._replace(goals=goals[p:])
        return replace(self, boundary=self.boundary.with_goals(goals[:p]), inside=inside)

    def hold_in_place(self) -> "DiscreteMap":
        """Return the map with its constraints in force, and with the current images as goals."""
        return replace(self.with_goals(self.u[self.aimed]), bound=True)

    @property
    def miss(self) -> float:
        """The largest distance of a constrained vertex from its goal; 0 if it is within rounding errors."""
        distance = float(np.abs(self.u[self.aimed] - self.goals).max(initial=0.0))
        return distance if distance > ROUNDING else 0.0

    @property
    def form(self) -> Complex:
        """The positions whose shape rigid regions preserve; shape (n,)."""
        return self.z if self.flat is None else self.flat

    @property
    def rigid_vertices(self) -> Index:
        """The vertices of rigid regions with aims; shape (k,)."""
        if self.rigid is None or not self.aims.size:
            return np.empty(0, np.int64)
        return distinct(self.faces[self.rigid >= 0])

    @cached_property
    def rotation(self) -> float:
        """Mean rotation of the picture in radians."""
        return mean_rotation(self.z, self.u, self.material, self.metrics)

    def swap_sides(self) -> "DiscreteMap":
        """Return the inverse map, whose boundary can be moved by Newton's method.

        It is not valid if holes are filled: their outlines are held in the source.
        """
        return replace(
            self,
            z=self.u,
            u=self.z,
            boundary=self.matched.inverse(),
            metrics=self.metrics[::-1],
            energy=self.energy.inverse(),
        )

    def move_to_border(self, u: Complex) -> "DiscreteMap":
        """Return the map with images u (n,), changed so that boundary vertices are where they belong.

        The displacement of the boundary is extended harmonically and fades within a few rings of triangles.
        Without it, triangles at the outline would be squeezed, and a Newton step widens a triangle by no more
        than half.
        """
        weights = springs(*geometry(self.z, self.faces)).ravel()
        tails, heads = np.roll(self.faces, -1, axis=1).ravel(), np.roll(self.faces, -2, axis=1).ravel()
        tails, heads, weights = np.append(tails, heads), np.append(heads, tails), np.tile(weights, 2)
        is_near = np.zeros(u.size, bool)
        is_near[: self.constrained] = True
        for _ in range(SMOOTHED_RINGS):
            is_near[heads[is_near[tails]]] = True
        is_near[: self.constrained] = False
        smoothed = is_near[tails]
        tails, heads, weights = tails[smoothed], heads[smoothed], weights[smoothed]
        weights = weights / np.bincount(tails, weights, u.size)[tails]
        displacement = np.zeros(u.size, np.complex128)
        displacement[: self.border] = self.u[: self.border] - u[: self.border]
        if self.bound:
            displacement[self.inner] = self.inside.goals - u[self.inner]
        for _ in range(SMOOTHINGS):
            carried, mean = weights * displacement[heads], np.empty_like(displacement)
            mean.real, mean.imag = (np.bincount(tails, part, u.size) for part in (carried.real, carried.imag))
            displacement[is_near] = mean[is_near]
        u = u + displacement
        u[: self.border] = self.u[: self.border]
        if self.bound:
            u[self.inner] = self.inside.goals
        return replace(self, u=u)

    def unfold_from_harmonic(
        self, *, further: Index | None = None, weighed: bool = False, steps: int = STEPS, polish: int = 0
    ) -> "DiscreteMap":
        """Return the map with inner vertices moved from those of the harmonic map until no triangle is folded.

        Vertices of constraints in force do not move.

        Args:
            further: (k,) further vertices that do not move.
            weighed: whether triangles in holes and concavities count less.
            steps: most steps.
            polish: most steps on all of the inside after nothing is folded.

        Raises:
            Tangled: folds remain.
        """
        u, fixed = self._fixed(further)
        return self._untangle(u, fixed, self._weights(weighed), harmonic=True, steps=steps, polish=polish)

    def unfold_locally(
        self,
        *,
        further: Index | None = None,
        weighed: bool = False,
        steps: int = STEPS,
        polish: int = 0,
        thin: float = BARE,
        most: float = LOCAL,
    ) -> "DiscreteMap":
        """Return the map with vertices near folds moved, or all of the inside if that does not suffice.

        Args:
            further, weighed, steps, polish: as for `unfold_from_harmonic`.
            thin: area relative to the mean below which a triangle counts as folded.
            most: largest share of the inside that may be moved locally.

        Raises:
            Tangled: folds remain.
        """
        u, fixed = self._fixed(further)
        weights = self._weights(weighed)
        gradients, areas = rest_geometry(self.z, self.u, self.faces, (self.metrics[0], None))
        image = triangle_areas(u[self.faces])
        folded = image * (areas * weights).sum() < thin * areas * weights * image.sum()
        with suppress(Tangled):
            return replace(self, u=unfold(u, self.faces, fixed, folded, gradients, areas, weights, most))
        return self._untangle(u, fixed, weights, harmonic=False, steps=steps, polish=polish)

    def _fixed(self, further: Index | None) -> tuple[Complex, Flags]:
        """Return images with constraints in force at their goals, and (n,) whether a vertex does not move."""
        u = self.u.copy()
        if self.bound:
            u[self.inner] = self.inside.goals
        fixed = np.arange(u.size) < self.constrained
        if further is not None:
            fixed[further] = True
        return u, fixed

    def _weights(self, weighed: bool) -> Real:
        """Return (m,) the weights of triangles, which are all 1 unless `weighed`."""
        return self.weights if weighed and self.weights is not None else np.ones(len(self.faces))

    def _untangle(
        self, u: Complex, fixed: Flags, weights: Real, *, harmonic: bool, steps: int, polish: int
    ) -> "DiscreteMap":
        """Return the map with images u (n,), changed by Newton's method until no triangle is folded."""
        # The corners of each triangle come in the order of elimination, as the matrix has them.
        gradients, areas = rest_geometry(self.z, self.u, self.pattern.corners, (self.metrics[0], None))
        rest = RestShapes.of(self.pattern, gradients, areas * weights)
        least = untangle(self.pattern, rest, u, fixed, harmonic, steps, polish)
        if not least > 0 or folds(self.faces, u):
            raise Tangled(u)
        return replace(self, u=u)

    def forward(
        self, q: float, steps: int, tolerance: float, *, corners: bool = True, reach: float = np.inf
    ) -> "DiscreteMap":
        """Make Newton steps on the image.

        Constrained vertices that are not at their goals move there, as far as no triangle folds.

        Args:
            q: power of the density.
            steps: most steps.
            tolerance: relative decrease below which steps end.
            corners: whether corners of the target hold their vertices.
            reach: how far vertices may move; see `newton.descend`.
        """
        inside, at_goals = self.inside, self.miss == 0
        stay = inside.at_target if corners else inside.stuck
        if not at_goals:  # strokes do not slide before they have reached their goals
            stay = np.ones(stay.size, bool)
        u, tau, end = self._descend(True, corners, stay, q, steps, tolerance, reach)
        if self.bound and inside.strokes and at_goals:
            inside = inside.slid(u[self.inner], tau[self.inner], stay)
        boundary = self.boundary.slid(True, tau[: self.border], corners)
        return replace(self, u=u, boundary=boundary, inside=inside, **end)

    def with_firm_regions(self, q: float, strain: float) -> "DiscreteMap":
        """Return the map with rigid regions made so stiff that no descent strains them by more than `strain`.

        The strain is the root mean square deviation of a region's derivative from its aim, relative to the aim.
        The stiffness is such that more strain would cost more than all energy that could be gained elsewhere.
        """
        assert self.rigid is not None
        rest = self._rest_shapes(True, q)
        elsewhere = rest._replace(weights=np.where(rest.aims != 0, 0, rest.weights))
        tau, constraints = self.constraints(True, True, self.inside.at_target)
        gain = elsewhere.energy(self.u, self.energy.objective(q, self.boundary.area_share(True)))
        gain += border_energy(constraints.border, tau) + self._terms(True, q).total(self.u)
        gain *= self.energy.rotation_cost(self.rotation) ** q
        inside = self.rigid >= 0
        areas = np.bincount(self.rigid[inside], np.abs(triangle_areas(self.form[self.faces[inside]])))
        return replace(self, stiffness=float(gain / (strain**2 * (np.abs(self.aims) ** 2 * areas).min())))

    def move_inside(self, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Make Newton steps on the image with the outline fixed."""
        fixed_boundary = replace(self.matched, anchored=np.ones(self.border, bool))
        state = replace(self, boundary=fixed_boundary).forward(q, steps, tolerance)
        return replace(state, boundary=self.boundary)

    def relax(self) -> "DiscreteMap":
        """Make a few steps at q = 1 if a triangle is badly stretched, first on the inside, then on all vertices.

        With higher powers q, Newton's method widens such triangles slowly.
        """
        _, stretch, _ = stretches(self.z, self.u, self.material, self.metrics)
        if stretch.max() < BADLY_STRETCHED:
            return self
        return self.move_inside(1.0, EASING_STEPS, EASED).forward(1.0, EASING_STEPS, EASED)

    def alternate(self, q: float, rounds: int, backward: int) -> "DiscreteMap":
        """Alternate Newton steps on the map and on its inverse, so that neither shape's corners are privileged.

        Args:
            q: power of the density.
            rounds: most rounds.
            backward: most steps on the inverse per round.
        """
        state, previous_value = self, np.inf  # `value` may be from another q
        for _ in range(rounds):
            state = state.forward(q, FORWARD, 0.5 * GOOD_ENOUGH)
            state = state.backward(q, backward, 0.5 * GOOD_ENOUGH)
            if previous_value - state.value < SETTLED * state.value:
                break
            previous_value = state.value
        return state

    def backward(self, q: float, steps: int, tolerance: float) -> "DiscreteMap":
        """Make Newton steps on the source with the images fixed; target corners slide along the source."""
        inside = self.inside
        z, s, end = self._descend(False, True, inside.at_source, q, steps, tolerance)
        if self.bound and inside.strokes:
            inside = inside._replace(s=s[self.inner], z=z[self.inner].copy())
        elif not self.bound and inside.z.size:  # their vertices move freely
            inside = inside._replace(z=z[self.inner].copy())
        return replace(
            self, z=z, boundary=self.boundary.slid(False, s[: self.border], True), inside=inside, **end
        )

    def _descend(
        self,
        forward: bool,
        corners: bool,
        stay: Flags,
        q: float,
        steps: int,
        tolerance: float,
        reach: float = np.inf,
    ) -> tuple[Complex, Real, dict[str, Any]]:
        """Run Newton's method on the map or on its inverse.

        Args:
            forward: whether the image moves, rather than the source.
            corners: whether corners of the target hold their vertices.
            stay: (k,) vertices of inner constraints that do not move.
            q: power of the density.
            steps: most steps.
            tolerance: relative decrease below which steps end.
            reach: how far vertices may move; see `newton.descend`.

        Returns:
            Positions (n,), arclengths (c,) of the constrained vertices, and the fields to update in the map.
        """
        self = self.with_cores()
        moving = self.u if forward else self.z
        objective = self.energy.objective(q, self.boundary.area_share(forward), forward=forward)
        rest, surface = self._rest_shapes(forward, q), None
        if forward and self.ground is not None:
            rest, surface = self._in_space(self.ground)
        u, (tau, constraints) = moving.copy(), self.constraints(forward, corners, stay)
        upright = ANY_ROTATION
        if surface is None:  # the moving side lies in a plane
            upright = self.energy.rotation_term(self._counted(rest), u.size)
        system = newton.System.of(
            self.pattern, self.faces, rest, constraints, upright, self._terms(forward, q)
        )
        value, steps_made, _ = newton.descend(system, objective, surface, u, tau, steps, tolerance, reach)
        return (
            u,
            tau,
            {
                "value": float(value),
                "spared": int(steps - steps_made),
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
        fixed_side, moving, metrics = self._sides(forward)
        energy = self.energy if forward else self.energy.inverse()
        terms = energy.terms_on_mesh(fixed_side, moving, self.material, metrics, self.pattern)
        return TermsOnMesh([*terms.terms, *springs], self.pattern) if springs else terms

    def _sides(self, forward: bool) -> tuple[Complex, Complex, Metrics]:
        """Return the vertices of the fixed side, those of the moving side, and their metrics in this order."""
        if forward:
            return self.z, self.u, self.metrics
        return self.u, self.z, (self.metrics[1], self.metrics[0])

    def _rest_shapes(self, forward: bool, q: float) -> RestShapes:
        """Return the rest triangles on the fixed side, with their weights for a power q."""
        fixed_side, moving, metrics = self._sides(forward)
        gradients, areas = rest_geometry(fixed_side, moving, self.pattern.corners, metrics)
        areas = self._weighed(areas, q)
        if self.rigid is None or not forward or not self.aims.size:
            return RestShapes.of(self.pattern, gradients, areas)
        # Triangles of rigid regions follow a similarity instead: of the plane or, for surfaces, of the region
        # flattened separately, for which the metric does not matter.
        inside = self.rigid >= 0
        if self.metrics != PLANES:
            flat_gradients, flat_areas = geometry(self.form, self.pattern.corners)
            gradients = np.where(inside[:, None], flat_gradients, gradients)
            areas = np.where(inside, flat_areas, areas)
        areas = np.where(inside, self.stiffness, 1.0) * areas
        return RestShapes.of(self.pattern, gradients, areas, np.where(inside, self.aims[self.rigid], 0))

    def rest_energy(self, u: Complex, q: float) -> float:
        """Return the energy of images (n,) for a power q, without rotation, outline and further terms."""
        return self._rest_shapes(True, q).energy(u, self.energy.objective(q, self.boundary.area_share(True)))

    def with_value(self, q: float) -> "DiscreteMap":
        """Return the map with the energy that Newton's method would find for it, without rotation and further terms."""
        tau, constraints = self.constraints(True, True, self.inside.at_target)
        return replace(self, value=self.rest_energy(self.u, q) + border_energy(constraints.border, tau))

    def _weighed(self, areas: Real, q: float) -> Real:
        """Return rest areas (m,) times the weights of the triangles.

        Weights that are relative to the density are raised to q if they multiply distortion, as the density
        itself is.
        """
        if self.multipliers is not None:  # triangles that exceed bounds
            areas = areas * self.multipliers
        if self.weights is not None:
            # For virtual triangles only the area of the image counts (a negative weight in the kernels): each
            # point of the target there has no partner, which costs LOST_POINT_ENERGY; half of that, since source and
            # target count half each.
            areas = np.where(self.weights <= FILLED, -0.5 * LOST_POINT_ENERGY**q, self.weights) * areas
        if self.energy.pins is not None:  # triangles around soft pins are stiffer
            areas = areas * self.energy.pins.multipliers(self.z, self.u, self.pattern.corners)
        for metric, w in zip(self.metrics, (self.z, self.u)):
            if metric is not None:
                areas = areas * metric.importance(w[self.pattern.corners]) ** q
        return areas

    def _counted(self, rest: RestShapes) -> RestShapes:
        """Return the rest shapes with rigid regions weighing as much as others in the mean rotation."""
        if not rest.aims.size:
            return rest
        return rest._replace(weights=np.where(rest.aims != 0, 1 / self.stiffness, 1.0) * rest.weights)

    def _in_space(self, ground: Ground) -> tuple[RestShapes, SurfaceMap]:
        """Return the rest triangles with separate vertices, and the data for their energy on the target in space."""
        corners = self.pattern.corners
        gradients, areas = rest_geometry(self.z, self.u, corners, (self.metrics[0], None))
        if self.multipliers is not None:
            areas = areas * self.multipliers
        if self.energy.pins is not None:
            areas = areas * self.energy.pins.multipliers(self.z, self.u, corners)
        is_in_hole = np.zeros(len(corners), bool)
        if self.weights is not None:
            is_in_hole = self.weights != 1
            areas = areas * self.weights
        # A barrier in the layout keeps triangles from folding there. Those in holes, where there is no surface, have
        # their energy in the layout instead.
        layout_gradients, layout_areas = geometry(self.z, corners)
        layout_gradients = np.where(is_in_hole[:, None], gradients, layout_gradients)
        layout_areas = np.where(is_in_hole, areas, layout_areas)
        layout = RestShapes.of(self.pattern, layout_gradients, layout_areas)
        orientations = np.sign(triangle_areas(self.z[corners]))
        return separate(gradients, areas), SurfaceMap.of(
            ground, layout, self.energy.balance, is_in_hole, orientations
        )

    def constraints(self, forward: bool, corners: bool, stay: Flags) -> tuple[Real, Constraints]:
        """Return the arclengths of constrained vertices on the moving side, and their constraints.

        Args:
            forward: whether the image moves, rather than the source.
            corners: whether corners of the target hold their vertices.
            stay: (k,) vertices of inner constraints that do not move.
        """
        moving = self.u if forward else self.z
        tau, border, kinds, goals, rails, rail_index = self.boundary.support(
            forward, moving[: self.border], corners
        )
        closed = len(rails)
        if self.bound:
            inside = self.inside
            rails = [*rails, *(stroke[1 if forward else 0] for stroke in inside.strokes)]
            rail_index = np.append(rail_index, inside.stroke_index + closed)
            kinds = np.append(kinds, np.where(stay, HELD, SLIDING))
            goals = np.append(goals, inside.goals if forward else inside.z)
            s, chains = inside.chains(forward, self.border)
            tau, border = np.append(tau, s), border.then(chains)
        if self.filled and not forward:  # outlines of filled holes are fixed in the source
            soft = self.constrained + np.arange(sum(loop.after - loop.first for loop in self.filled))
            rail_index, kinds = np.append(rail_index, 0 * soft), np.append(kinds, np.full(soft.size, HELD))
            goals = np.append(goals, moving[soft])
            tau, border = np.append(tau, np.zeros(soft.size)), border.then(Border.still(soft))
        return tau.copy(), Constraints(kinds, goals, Rails.of(rails, rail_index, closed), border)


def folds(faces: Index, u: Complex) -> int:
    """Return the number of triangles without positive area."""
    return int(np.count_nonzero(~(triangle_areas(u[faces]) > 0)))
