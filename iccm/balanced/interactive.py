"""A balanced map that follows its pins and strokes while they are dragged, each update starting from the map before.

Soft pins are terms of the energy: if they move, or their number changes, Newton's method continues on the mesh
of the converged map, and nothing visible changes when it converges again. If the targets of exact pins inside
moved, their goals move; if their sources moved, the goals of the inverse map do. Everything else (adding or
removing an exact pin, pins on the outline, strokes) requires a new mesh at each step, which is a coarse one.

A fine mesh is never exchanged for a coarse one, on which the map could not be kept when the pin is released.

While something is dragged, each step has a budget of Newton steps, and the map may lag behind; the rest is done
in the next step, and then on a new mesh. When nothing is dragged, there is no budget.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import bulges
from ..options import Options
from ..pins import Softness
from ..plane import Similarity, triangle_areas
from ..problem import Holes
from ..result import Fit
from .constraints.soft import NO_PATCHES, PinnedPatches, patches_of
from .constraints.validate import Pins, check
from .errors import NoMapError, Stuck
from .holes.filled import without_filled
from .holes.given import named_partners, unit_holes
from .method import holes_of, sketch_of
from .model.discrete_map import DiscreteMap
from .model.energy import Energy
from .model.mesh_map import MeshMap
from .model.mesh_sizes import graded
from .model.unit_coordinates import unit_curve, unit_similarities
from .search.final_mesh import (
    FINE_EXACTNESS,
    LAST_DECREASE_WITH_PINS,
    MOST_STIFFENED,
    NARROW_AIM,
    STIFFEST,
    final_level,
    with_present_springs,
)
from .search.homotopy import satisfy_constraints
from .search.levels import FINE_POWER, Level, refine
from .search.multilevel import STEEPEST, simplified
from .search.pin_continuation import move_on_new_meshes
from .search.unit_problem import UnitProblem, energy_with
from .search.warm_start import AT_REST_DECREASE, on_its_mesh

COARSE_MESH_SIZE = 0.06
"""Edge length of coarse meshes of domains of area one: 1200 triangles, on which a map is updated in 25 ms."""
FORWARD_STEPS, BACKWARD_STEPS = 8, 3  # Newton steps on the map, then on its inverse
BUDGET_TRIANGLE_STEPS = 60_000
"""Newton steps in one step of a drag, times the number of triangles: some 35 of the 60 ms that an update may take."""
SQUEEZED_AREA_RATIO = 0.01
"""Relative to the smallest area on the mesh when it was new. Smaller triangles are between corners of source
and target that would pass each other on the outline, which is possible on a new mesh only.
"""
STEPS_PER_MESH = 20
"""Steps of a drag between two new fine meshes. A new mesh costs as much as some ten other steps, which is a
noticeable delay; with 20 to 40 steps per second, there is at most one per second.
"""
EASED_SHARE = 0.005
"""Displacement in the first step of a drag beyond that of the hand, relative to the diagonal; 95 % of the points move
less. In each later step it may be larger by as much. A map that was released before it had converged, or to which a pin
was added, thus relaxes in several pictures, rather than in a jump at the first one.
"""
REACHED_SHARE = 0.99  # of the reach of a step: if vertices moved farther than this, the reach ended the step
RMS_RATIO = 0.5
"""Root mean square of the displacements in a step, roughly, relative to the distance that 95 % of them stay below."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two domains, their holes, the similarities to their unit coordinates, and the options of the map."""

    source: Curve
    target: Curve
    holes: Holes
    to_unit: tuple[Similarity, Similarity]
    options: Options

    @property
    def inverted(self) -> bool:
        """Whether the inverse map is the one that is updated.

        In that case the target's holes that open from slits are filled there.
        """
        return len(self.holes.source) < len(self.holes.target)

    def checked(
        self, pins: Complex, strokes: Sequence[tuple[Curve, Curve]], softness: Softness | None
    ) -> tuple[Pins, PinnedPatches]:
        """Return the checked pins and strokes of the updated map.

        Exact pins and strokes are in unit coordinates, soft pins in the user's coordinates. Pins in holes only
        state which holes correspond.

        Raises:
            InputError: no one-to-one map meets the constraints.
        """
        _, pins, numbers = named_partners(self.holes, self.source, self.target, pins, strokes)
        exact = check(self.source, self.target, pins, strokes, numbers)
        patches = NO_PATCHES
        if softness is not None:
            numbered_softness = softness.of_pins(numbers)
            patches = patches_of(
                self.source, self.target, self.holes.sides, pins, numbered_softness, exact, numbers
            )
            exact = exact.without(patches.points[:, 0])
        exact = exact.unit(self.to_unit)
        return (exact.inverse() if self.inverted else exact), patches

    def with_patches(self, energy: Energy, patches: PinnedPatches) -> Energy:
        """Return an energy in unit coordinates with other soft pins, of the map from source to target."""
        return replace(energy, pins=None if patches.are_none else patches.unit(self.to_unit))

    def problem(self, exact: Pins, energy: Energy, start: MeshMap | None = None) -> UnitProblem:
        """Return the problem that an update solves, with outlines simplified as in `simplified`.

        Args:
            exact: exact pins and strokes, from source to target.
            energy: the energy in unit coordinates.
            start: a map from source to target that is continued.
        """
        outlines = unit_curve(self.to_unit[0], self.source), unit_curve(self.to_unit[1], self.target)
        own_side = exact.inverse() if self.inverted else exact
        given = UnitProblem.of(outlines, unit_holes(self.to_unit, self.holes), own_side, energy, self.options)
        problem = simplified(given, start)
        return problem.inverse() if self.inverted else problem

    def carried(self, state: MeshMap, exact: Pins, energy: Energy, *, coarse: bool) -> DiscreteMap:
        """Transfer a map to a new mesh, and make it meet constraints.

        Args:
            state: the map.
            exact: exact pins and strokes, in unit coordinates.
            energy: in unit coordinates, with the soft pins.
            coarse: whether the mesh is coarse, rather than as fine as the final one.

        Raises:
            NoMapError: the map folds on the new mesh.
        """
        problem, sizes = self.problem(exact, energy), None
        # without its constraints, which belong to other vertices
        state = MeshMap.plain(state.z, state.u, state.faces, state.border, loops=state.loops)
        try:
            if coarse:
                level = Level.of(problem, COARSE_MESH_SIZE, *FINE_EXACTNESS, STEEPEST)
            else:
                level = final_level(problem)
                sizes = graded(state.z, state.u, state.faces, 0.5 * level.size**2)
            new = satisfy_constraints(refine(level, state, sizes))
            if new.miss > 0 and not exact.strokes:  # other triangles may be less in the way of the pins
                anew = move_on_new_meshes(level, new.hold_in_place(), new.inside.goals)
                new = min(anew, new, key=lambda candidate: candidate.miss)
            return _relax(new if coarse else _towards(new))
        except Stuck as error:
            raise NoMapError(f"the map cannot follow: {error}") from error

    def carried_anyhow(
        self, state: MeshMap, exact: Pins, energy: Energy, *, coarse: bool
    ) -> tuple[DiscreteMap, bool]:
        """Transfer a map to a fine mesh, or to a coarse one if `coarse` or if the fine one fails.

        If constraints cannot be met on the fine mesh, the next meshes are coarse too, since that takes long.

        Returns:
            The map, and whether the next mesh is to be coarse.

        Raises:
            NoMapError: the map folds on both meshes.
        """
        if not coarse:
            with suppress(NoMapError):
                new = self.carried(state, exact, energy, coarse=False)
                return new, new.miss > 0
        return self.carried(state, exact, energy, coarse=True), True


@dataclass(frozen=True, eq=False)
class Live:
    """A map with constraints in force.

    Attributes:
        pair: the two domains.
        energy: of the map, in unit coordinates, with the soft pins.
        exact: exact pins and strokes in unit coordinates.
        patches: soft pins in the user's coordinates.
        pins: (k, 2) all pins as they were given.
        state: the map in unit coordinates.
        least: the smallest area of a triangle, or of its image, when the mesh was new.
        coarse: whether the mesh is coarse.
        age: steps since the mesh was new, or since a new one was last tried.
        behind: whether the map belongs to earlier constraints, because the current ones were not reached.
        eased: steps since the drag began; see `EASED_SHARE`.
        stiffening: (k,) factors for the stiffness of soft pins' springs, above 1 for pins that would exceed
            their limits.
    """

    pair: "_Pair"
    energy: Energy
    exact: Pins
    patches: PinnedPatches
    pins: Complex
    state: DiscreteMap
    least: float
    coarse: bool
    age: int = STEPS_PER_MESH
    behind: bool = False
    eased: int = 0
    stiffening: Real = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(
        cls,
        fit: Fit,
        options: Options,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
        softness: Softness | None = None,
        *,
        covering_map: TriangulatedMap | None = None,
        springs: Mapping[complex, float] | None = None,
        dragged: bool = False,
    ) -> "Live":
        """Start from a balanced map, with pins (k, 2) and strokes as in `solve`; see `moved` for the other arguments.

        Args:
            fit: the map.
            options: options of the solver.
            pins: (k, 2) points of the source and their places.
            strokes: polylines of the source, and of the target.
            softness: of the pins; None if all are exact.
            covering_map: the map with the triangles that fill holes of the target, as returned by `start`; None for
                those of the solution.
            springs: factors of the springs of the map's soft pins, as returned by `springs`, as far as they are known.
            dragged: whether pins are moving.

        Raises:
            NoMapError: no map without folds was found.
            InputError: no one-to-one map meets the pins or strokes.
        """
        assert fit.target is not None and isinstance(fit.map, TriangulatedMap)
        mapped_holes = [
            (loop + 1, i, j) for loop, (i, j) in enumerate(fit.details.hole_partners) if min(i, j) >= 0
        ]
        partners = tuple((i, j) for _, i, j in mapped_holes)
        holes = Holes(tuple(fit.source_holes), tuple(fit.target_holes), partners)
        to_unit = unit_similarities(fit.source, fit.target, options.rotation, holes.sides)
        pair = _Pair(fit.source, fit.target, holes, to_unit, options)
        map, covering_map = fit.map, covering_map or fit._covering_map
        if pair.inverted and covering_map is not None:
            map, mapped_holes = covering_map, holes_of(covering_map, holes)
        sketch = sketch_of(map, to_unit, mapped_holes)
        own_pins, patches = pair.checked(fit.pins, fit.strokes, fit.details.softness)
        energy = pair.with_patches(Energy.of(options).in_unit(to_unit), patches)
        level = final_level(pair.problem(own_pins, energy, sketch))
        sketch = sketch.inverse() if pair.inverted else sketch
        state = on_its_mesh(level, sketch)
        if state is not None and not state.fills_holes:  # they would fold
            state = None
        exact, coarse, stiffening = own_pins, False, np.empty(0)
        if state is not None:
            saved_pins = None if springs is None else _factors_at(patches, springs)
            state, stiffening = with_present_springs(state, saved_pins)
        else:
            exact, patches = pair.checked(pins, strokes, softness)
            energy = pair.with_patches(energy, patches)
            coarse = bool(len(exact.outer) or exact.strokes)
            stiffening = _factors_at(patches, springs or {})
            stiff = _stiffened(energy, stiffening)
            state, coarse = pair.carried_anyhow(sketch, exact, stiff, coarse=coarse)
        # of the default age: another mesh may be made at once, because pins are sometimes blocked on this one
        live = cls(
            pair, energy, exact, patches, fit.pins, state, _least_area(state), coarse, stiffening=stiffening
        )
        return live if exact is not own_pins else live.follow(pins, strokes, softness, dragged=dragged)

    def follow(
        self,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
        softness: Softness | None = None,
        balance: float | None = None,
        *,
        dragged: bool = False,
    ) -> "Live":
        """Return the map updated to pins and strokes that moved, or to another balance.

        Args:
            pins: (k, 2) points of the source and their places.
            strokes: polylines of the source, and of the target.
            softness: of the pins; None if all are exact.
            balance: of angles and areas; None to keep it.
            dragged: whether they are still moving, so that the update has a budget of steps.

        Raises:
            NoMapError: the map cannot follow without folds.
            InputError: no one-to-one map meets the pins or strokes.
        """
        if balance is not None:
            begun = replace(self.state, energy=replace(self.state.energy, balance=balance))
            live = replace(self, energy=replace(self.energy, balance=balance), state=begun)
            return live.follow(pins, strokes, softness, dragged=dragged)
        exact, patches = self.pair.checked(pins, strokes, softness)
        reach = self._reach(pins) if dragged else np.inf
        moved = replace(self._with_patches(patches, exact), pins=pins, eased=self.eased + 1)
        followed = moved._follow(exact, reach, dragged=dragged)
        # if the reach ended the step, pins are not yet where springs of this stiffness take them
        return followed if _has_reached(self.state, followed.state, reach) else followed._stiffened()

    @property
    def released(self) -> "Live":
        """The map as a later drag continues it."""
        return replace(self, eased=0)

    def _reach(self, pins: Complex) -> float:
        """Return how far vertices may move in a step of a drag in which pins moved to (k, 2), in unit coordinates.

        This is the root mean square of their displacements. The hand counts with its distance in the shape in which it
        moves: the map may magnify it, and follows less closely there until the drag is a few steps old.
        """
        diagonals = self.pair.source.diagonal, self.pair.target.diagonal
        if pins.shape == self.pins.shape:
            hand = (pins - self.pins) / diagonals
        else:  # pins are placed where the map takes them
            new_pins = pins[~np.isin(pins, self.pins).any(axis=1)]
            hand = (self.map(new_pins[:, 0]) - new_pins[:, 1]) / diagonals[1]
        # not a number for a new pin where there is no map
        hand_share = float(np.nan_to_num(np.abs(hand)).max(initial=0.0))
        share = hand_share + EASED_SHARE * (self.eased + 1)
        side = 0 if self.pair.inverted else 1
        return RMS_RATIO * share * diagonals[side] * abs(self.pair.to_unit[side].factor)

    def _follow(self, exact: Pins, reach: float, *, dragged: bool) -> "Live":
        """Return the map updated to exact pins and strokes, and to the soft pins of its energy.

        As long as it stays on its mesh, vertices move no farther than `reach`; see `newton.descend`.
        """
        changes_vertices = self._changes_vertices(exact)
        coarse = self.coarse or changes_vertices
        waits = dragged and not changes_vertices and self.age + 1 < STEPS_PER_MESH
        steps = max(2, BUDGET_TRIANGLE_STEPS // len(self.state.faces)) if dragged else 2 * FORWARD_STEPS
        state, least, age = self._pulled(exact, steps), self.least, self.age + 1
        behind = state is None or not _at_sources(state)
        if state is not None and (dragged or not behind):
            state = _within(state, reach) if dragged else _towards(state)
            state = _relax(state) if coarse and not behind else state
        # the next step may reach the goals
        goes_on = dragged and state is not None and (self.met or _has_reached(self.state, state, reach))
        stiff = _stiffened(self.energy, self.stiffening)
        if not waits and not goes_on and (state is None or behind or state.miss > 0):
            age = 0
            try:
                anew = self.pair.carried(state or self.state, exact, stiff, coarse=coarse)
                is_closer = state is not None and not behind and anew.miss < state.miss
                # else the map that is seen stays behind, and the pin stops short
                if coarse or anew.miss == 0 or is_closer:
                    state, least, behind = anew, _least_area(anew), False
            except NoMapError:
                if not dragged or changes_vertices:
                    raise
        area = _least_area(state or self.state)
        if waits and area < SQUEEZED_AREA_RATIO**2 * least:  # the triangle would soon be degenerate
            state = None
        if state is None or behind:
            return replace(self, state=state or self.state, age=age, behind=True)
        if not waits and not area >= SQUEEZED_AREA_RATIO * least:
            age, free = 0, state.forward(FINE_POWER, FORWARD_STEPS, AT_REST_DECREASE, corners=False)
            with suppress(NoMapError):
                anew = self.pair.carried(free, exact, stiff, coarse=coarse)
                state = min(anew, state, key=lambda candidate: candidate.miss)
                least = _least_area(state)
        return replace(self, exact=exact, state=state, least=least, coarse=coarse, age=age, behind=False)

    def _with_patches(self, patches: PinnedPatches, exact: Pins) -> "Live":
        """Return the map with other soft pins in its energy; `exact` are the exact ones."""
        if not len(patches.points) and not len(self.patches.points):
            return self
        plain, factors = self.pair.with_patches(self.energy, patches), self.stiffening
        if len(factors) != len(patches.points):  # else a pin whose place in the source moves keeps its factor
            factors = _factors_at(patches, self.springs)
        energy = _stiffened(energy_with(exact, plain), factors)
        oriented = energy.inverse() if self.pair.inverted else energy
        state = self.state.with_energy(oriented)
        return replace(self, energy=plain, patches=patches, state=state, stiffening=factors)

    @property
    def springs(self) -> dict[complex, float]:
        """The factors of the springs of soft pins, by the pins' points of the source."""
        return dict(zip(self.patches.points[:, 0].tolist(), self.stiffening.tolist()))

    @property
    def springs_in_force(self) -> dict[complex, float]:
        """The factors of the springs that pull in this map; those of `springs` pull in the next step."""
        pins, plain_pins = self.state.energy.pins, self.energy.pins
        if pins is None or plain_pins is None:
            return {}
        return dict(zip(self.patches.points[:, 0].tolist(), (pins.springs / plain_pins.springs).tolist()))

    def _stiffened(self) -> "Live":
        """Return the map with the springs' stiffness for the next step, according to how far their pins miss."""
        pins = self.state.energy.pins
        if pins is None or self.stiffening.size != self.state.energy.pin_count:
            return self
        missed = pins.misses(self.state.z, self.state.u, self.state.material) / (NARROW_AIM * pins.limits)
        # as in `follow_pins` where they are too soft; where too stiff, slowly, so that they do not swing
        missed = np.where(missed > 1, missed**2, missed)
        factors = self.stiffening * np.clip(missed, 1 / MOST_STIFFENED, MOST_STIFFENED)
        # without a limit, a pin far behind the hand would have a spring so stiff that softening it takes as many steps
        # pins that stopped short may have stiffer ones already
        return replace(self, stiffening=np.clip(factors, 1, np.maximum(self.stiffening, STIFFEST)))

    def _changes_vertices(self, exact: Pins) -> bool:
        """Return whether the constraints need other vertices than the mesh has; with strokes, each step may."""
        old = self.exact
        is_same = old.inner.shape == exact.inner.shape and np.array_equal(old.outer, exact.outer)
        return not is_same or bool(old.strokes or exact.strokes)

    def _pulled(self, exact: Pins, steps: int) -> DiscreteMap | None:
        """Return the map with new goals for its constrained vertices, or with these moved towards their new sources.

        Moving sources takes up to half of the given steps. The steps left are in `spared`.

        Returns:
            The map; None if other vertices are needed.
        """
        old, new, inside = self.exact, exact, self.state.inside
        if self._changes_vertices(exact):
            return None
        sources, goals = np.ascontiguousarray(new.inner.T)
        if np.array_equal(sources, old.inner[:, 0]) and not self.behind:
            return replace(self.state.with_goals(goals), spared=steps)
        if self.state.miss > 0 or not np.array_equal(goals, old.inner[:, 1]):
            return None
        pulled = replace(self.state, inside=inside._replace(z=sources))
        stepped = pulled.backward(FINE_POWER, steps // 2, AT_REST_DECREASE)
        return replace(stepped, spared=steps - steps // 2 + stepped.spared)

    @property
    def met(self) -> bool:
        """Whether strokes and exact pins are met; if not, the map is as close to them as it came."""
        return self.state.miss == 0 and not self.behind

    @property
    def exact_pins(self) -> Complex:
        """The vertices of exact pins inside and their images, as far as the map has followed; shape (k, 2)."""
        state, inner = self.state, self.state.inner
        sides = (state.u, state.z) if self.pair.inverted else (state.z, state.u)
        return np.column_stack(
            [similarity.pull_back(w[inner]) for similarity, w in zip(self.pair.to_unit, sides)]
        )

    def limit(self, source: complex) -> float:
        """Return how far from its place the soft pin at a point of the source may be."""
        return float(self.patches.softness.limits[self.patches.points[:, 0] == source][0])

    def is_soft(self, source: complex) -> bool:
        """Return whether the pin at a point of the source is soft."""
        return bool((self.patches.points[:, 0] == source).any())

    @cached_property
    def map(self) -> TriangulatedMap:
        """The map in the given coordinates."""
        return self._world(self.state.inverse() if self.pair.inverted else self.state)

    @property
    def maps(self) -> list[TriangulatedMap]:
        """The same as a list, as maps of several parts have it."""
        return [self.map]

    @property
    def start(self) -> TriangulatedMap:
        """The map from which a solve can continue, including the triangles that fill holes of the target."""
        if not self.pair.inverted:
            return self.map
        inverse = self.state.inverse()
        covered = MeshMap.plain(inverse.z, inverse.u, inverse.faces, inverse.border, loops=inverse.loops)
        return self._world(covered)

    def _world(self, state: MeshMap) -> TriangulatedMap:
        to_unit = self.pair.to_unit
        cut = without_filled(state, mirrored=to_unit[0].mirrored)
        z, u = (f.pull_back(w[cut.vertices]) for f, w in zip(to_unit, (state.z, state.u)))
        map = TriangulatedMap(z, u, cut.faces, cut.loops)
        if not len(cut.lines):
            return map
        return replace(map, bulge=bulges(cut.faces, u, z, map.edges, cut.lines))


def _factors_at(patches: PinnedPatches, springs: Mapping[complex, float]) -> Real:
    """Return the factors (k,) of the springs of soft pins, by their points of the source; 1 for those not known."""
    return np.array([springs.get(point, 1.0) for point in patches.points[:, 0].tolist()])


def _stiffened(energy: Energy, factors: Real) -> Energy:
    """Return the energy with the springs of soft pins stiffer by factors (k,)."""
    return energy if energy.pins is None else replace(energy, pins=energy.pins.stiffer(factors))


def _least_area(state: DiscreteMap) -> float:
    """Return the smallest area of a triangle or of its image."""
    return float(min(triangle_areas(w[state.material]).min() for w in (state.z, state.u)))


def _at_sources(state: DiscreteMap) -> bool:
    """Return whether the vertices of pins are at the pins' places in the source."""
    away = state.z[state.border : state.constrained] - state.inside.z[: state.constrained - state.border]
    return float(np.abs(away).max(initial=0.0)) < 1e-9


def _towards(state: DiscreteMap) -> DiscreteMap:
    """Return the map after some Newton steps at FINE_POWER, which bring it close to the converged map.

    If these do not reach the goals, steps at power 1 are taken instead.
    """
    reached = state.forward(FINE_POWER, FORWARD_STEPS, AT_REST_DECREASE, corners=True)
    return reached if reached.miss == 0 else state.forward(1.0, FORWARD_STEPS, AT_REST_DECREASE, corners=True)


def _within(state: DiscreteMap, reach: float) -> DiscreteMap:
    """Return the map after the steps left in the budget, at FINE_POWER and then, if goals are not reached, at 1.

    Vertices move no farther than `reach`; see `newton.descend`.
    """
    begun = state.u
    for power in (FINE_POWER, 1.0):
        left = reach - _root_mean_square(state.u - begun)
        if state.spared > 0 and left > 0 and (power == FINE_POWER or state.miss > 0):
            state = state.forward(power, state.spared, _rest_decrease(state), corners=True, reach=left)
    return state


def _rest_decrease(state: DiscreteMap) -> float:
    """Return the relative decrease of a Newton step below which the map counts as converged: with soft pins that of the
    final map, which would move visibly otherwise.
    """
    return AT_REST_DECREASE if state.energy.pins is None else LAST_DECREASE_WITH_PINS


def _relax(state: DiscreteMap) -> DiscreteMap:
    """Return the map after some Newton steps on its inverse, if it has reached its goals."""
    return state if state.miss > 0 else state.backward(FINE_POWER, BACKWARD_STEPS, AT_REST_DECREASE)


def _has_reached(before: DiscreteMap, after: DiscreteMap, reach: float) -> bool:
    """Return whether vertices moved as far as they might, so that the step is unfinished."""
    return after.faces is before.faces and _root_mean_square(after.u - before.u) > REACHED_SHARE * reach


def _root_mean_square(displacements: Complex) -> float:
    """Return the root of the mean square of displacements (n,)."""
    return float(np.sqrt(np.mean(np.abs(displacements) ** 2)))
