"""A balanced map that follows its pins and strokes while they are moved, each time from the map before.

Soft pins are terms of the energy: wherever they move, and where there are more or less of them, Newton's method
follows on the mesh of the converged map, and nothing is to be seen when it converges again. Where the targets of exact
pins inside have moved their goals move, and where their sources have, those of the inverse. Everything else (an exact
pin more or less, one on the outline, a stroke) takes a new mesh at each step, a coarse one.

While something is dragged each step has a budget of Newton steps, and the map may lag behind; what is left is done with
the next one, and after that on a new mesh. Once nothing is dragged there is no budget.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import bulges
from ..pins import Softness
from ..plane import Similarity, triangle_areas
from ..result import Fit
from .constraints.soft import NO_PATCHES, PinnedPatches, patches_of
from .constraints.validate import Pins, check
from .errors import NoMapError, Stuck
from .holes.filled import without_filled
from .holes.given import Holes, named_partners
from .method import sketch_of
from .model.discrete_map import DiscreteMap
from .model.frames import frames_of, unit_curve
from .model.mesh_map import MeshMap
from .model.mesh_sizes import graded
from .model.settings import Settings
from .search.final_mesh import FINE_EXACTNESS, MOST_STIFFENED, final_level
from .search.homotopy import satisfy_constraints
from .search.levels import FINE_POWER, Level, refine
from .search.multilevel import STEEPEST, energy_of, problem_of
from .search.pin_continuation import move_on_new_meshes
from .search.unit_problem import UnitProblem
from .search.warm_start import AT_REST_DECREASE, on_its_mesh

COARSE_MESH_SIZE = 0.06
"""Mesh size h of coarse meshes of domains of area one, 1200 triangles: 25 ms carry a map there."""
FORWARD, BACKWARD = 8, 3  # Newton steps on the map, then on its inverse
BUDGET_TRIANGLE_STEPS = 60_000
"""Newton steps in a step of a drag, times triangles: some 35 ms of the 60 that an update may take."""
SQUEEZED_AREA_RATIO = 0.01
"""Of the smallest area on the mesh when it was new: smaller triangles are between corners of source and target that
want to pass each other on the outline, which they can on a new mesh only."""
STEPS_A_MESH = 20
"""Steps of a drag from one new fine mesh to the next. Each costs as much as some ten other steps, a hitch: with 20 to
40 steps a second, there is one a second at most."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two domains, their holes, and the frames of their unit coordinates."""

    source: Curve
    target: Curve
    holes: Holes
    frames: tuple[Similarity, Similarity]

    @property
    def inverted(self) -> bool:
        """Whether it is the inverse map that follows: holes of the target that open are filled there."""
        return len(self.holes.source) < len(self.holes.target)

    def checked(
        self, pins: Complex, strokes: Sequence[tuple[Curve, Curve]], softness: Softness | None
    ) -> tuple[Pins, PinnedPatches]:
        """Exact pins and strokes of the map that follows, in unit coordinates, and soft pins in the user's; pins in
        holes only say which go together.

        Raises:
            InputError: those that no one-to-one map meets.
        """
        _, pins, numbers = named_partners(self.holes, self.source, self.target, pins, strokes)
        given = check(self.source, self.target, pins, strokes, numbers)
        patches = NO_PATCHES
        if softness is not None:
            own = softness.of_pins(numbers)
            patches = patches_of(self.source, self.target, self.holes.sides, pins, own, given, numbers)
            given = given.without(patches.points[:, 0])
        given = given.unit(self.frames)
        return (given.inverse() if self.inverted else given), patches

    def with_patches(self, settings: Settings, patches: PinnedPatches) -> Settings:
        """Return the settings with soft pins in the energy of the map from source to target."""
        soft = None if patches.are_none else patches.unit(self.frames)
        return replace(settings, energy=replace(settings.energy, pins=soft))

    def problem(self, given: Pins, settings: Settings, start: MeshMap | None = None) -> UnitProblem:
        """Return the problem of the map that follows; see `problem_of`, of whose source and target `start` is."""
        source, target = unit_curve(self.frames[0], self.source), unit_curve(self.frames[1], self.target)
        own = given.inverse() if self.inverted else given
        problem = problem_of(source, target, self.holes.unit(self.frames), own, settings, start)
        return problem.inverse() if self.inverted else problem

    def carried(self, state: MeshMap, given: Pins, settings: Settings, *, coarse: bool) -> DiscreteMap:
        """Return a map on a new mesh, a coarse one or one as fine as the last, brought to constraints.

        Raises:
            NoMapError: it folds there.
        """
        problem, sizes = self.problem(given, settings), None
        # without its constraints, which are others, of other vertices
        state = MeshMap.plain(state.z, state.u, state.faces, state.border, loops=state.loops)
        try:
            if coarse:
                level = Level.of(problem, COARSE_MESH_SIZE, *FINE_EXACTNESS, STEEPEST)
            else:
                level = final_level(problem, settings)
                sizes = graded(state.z, state.u, state.faces, 0.5 * level.size**2)
            new = satisfy_constraints(refine(level, state, sizes))
            if new.miss > 0 and not given.strokes:  # other triangles may let the pins pass
                anew = move_on_new_meshes(level, new.held(), new.inside.goals)
                new = min(anew, new, key=lambda each: each.miss)
            return _relax(new if coarse else _towards(new))
        except Stuck as error:
            raise NoMapError(f"the map cannot follow: {error}") from error

    def carried_anyhow(
        self, state: MeshMap, given: Pins, settings: Settings, *, coarse: bool
    ) -> tuple[DiscreteMap, bool]:
        """Return the same, and whether it is on a coarse mesh: where a fine one does not meet the constraints, too,
        since that takes long.

        Raises:
            NoMapError: it folds on either.
        """
        if not coarse:
            with suppress(NoMapError):
                new = self.carried(state, given, settings, coarse=False)
                return new, new.miss > 0
        return self.carried(state, given, settings, coarse=True), True


@dataclass(frozen=True, eq=False)
class Live:
    """A map with constraints in force.

    Attributes:
        pair: the two domains.
        settings: what is asked of the map, by soft pins, too.
        given: exact pins and strokes in unit coordinates.
        patches: soft pins in the user's.
        state: the map in them.
        least: the smallest area of a triangle, or of its image, when its mesh was new.
        coarse: whether its mesh is.
        age: steps since its mesh was new, or one was last tried for.
        behind: whether it is that of constraints before, since those in force were not reached.
        stiffening: (k,) times as stiff as usual are the springs of soft pins, which would miss their places by more
            than they may.
    """

    pair: "_Pair"
    settings: Settings
    given: Pins
    patches: PinnedPatches
    state: DiscreteMap
    least: float
    coarse: bool
    age: int = STEPS_A_MESH
    behind: bool = False
    stiffening: Real = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(
        cls,
        fit: Fit,
        settings: Settings,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
        softness: Softness | None = None,
        *,
        dragged: bool = False,
    ) -> "Live":
        """Beginning with a balanced map, pins (k, 2) and strokes as for `solve`; for the others see `moved`.

        Raises:
            NoMapError: no map without folds was found.
            InputError: pins or strokes that no one-to-one map meets.
        """
        assert fit.target is not None and isinstance(fit.map, TriangulatedMap)
        met = [(loop + 1, i, j) for loop, (i, j) in enumerate(fit.hole_partners) if min(i, j) >= 0]
        partners = tuple((i, j) for _, i, j in met)
        holes = Holes(tuple(fit.source_holes), tuple(fit.target_holes), partners)
        frames = frames_of(fit.source, fit.target, settings.turn, holes.sides)
        pair = _Pair(fit.source, fit.target, holes, frames)
        before = sketch_of(fit.map, frames, met)
        own_pins, patches = pair.checked(fit.pins, fit.strokes, fit.softness)
        settings = pair.with_patches(settings, patches)
        level = final_level(pair.problem(own_pins, settings, before), settings)
        before = before.inverse() if pair.inverted else before
        state = on_its_mesh(level, before)
        given, coarse = own_pins, False
        if state is None:
            given, patches = pair.checked(pins, strokes, softness)
            settings = pair.with_patches(settings, patches)
            coarse = bool(len(given.outer) or given.strokes)
            state, coarse = pair.carried_anyhow(before, given, settings, coarse=coarse)
        age = STEPS_A_MESH if given is own_pins else 0
        live = cls(pair, settings, given, patches, state, _least_area(state), coarse, age)
        return live if given is not own_pins else live.moved(pins, strokes, softness, dragged=dragged)

    def moved(
        self,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
        softness: Softness | None = None,
        balance: float | None = None,
        *,
        dragged: bool = False,
    ) -> "Live":
        """Return the map continued to pins and strokes that have moved, or to another balance.

        Args:
            pins: (k, 2) points of the source and their places.
            strokes: polylines of the source, and of the target.
            softness: of the pins; None where all are exact.
            balance: of angles and areas; None for the one before.
            dragged: whether they are still moving: then as far as a step has time for.

        Raises:
            NoMapError: the map cannot be carried there without folds.
            InputError: pins or strokes that no one-to-one map meets.
        """
        if balance is not None:
            settings = replace(self.settings, energy=replace(self.settings.energy, balance=balance))
            begun = replace(self.state, energy=replace(self.state.energy, balance=balance))
            live = replace(self, settings=settings, state=begun)
            return live.moved(pins, strokes, softness, dragged=dragged)
        given, patches = self.pair.checked(pins, strokes, softness)
        return self._with_patches(patches, given)._moved(given, dragged=dragged)._stiffened()

    def _moved(self, given: Pins, *, dragged: bool) -> "Live":
        """Return the map continued to exact pins and strokes, and to the soft pins of its energy."""
        others = self._changes_vertices(given)
        coarse = self.coarse or others
        waits = dragged and not others and self.age + 1 < STEPS_A_MESH
        steps = max(2, BUDGET_TRIANGLE_STEPS // len(self.state.faces)) if dragged else 2 * FORWARD
        state, least, age = self._pulled(given, steps), self.least, self.age + 1
        behind = state is None or not _at_sources(state)
        if state is not None and (dragged or not behind):
            state = _within(state) if dragged else _towards(state)
            state = _relax(state) if coarse and not behind else state
        goes_on = dragged and self.met and state is not None  # the next step may reach what this one has not
        if not waits and not goes_on and (state is None or behind or state.miss > 0):
            age = 0
            try:
                state, coarse = self.pair.carried_anyhow(
                    state or self.state, given, self.settings, coarse=coarse
                )
                least, behind = _least_area(state), False
            except NoMapError:
                if not dragged or others:
                    raise
        area = _least_area(state or self.state)
        if waits and area < SQUEEZED_AREA_RATIO**2 * least:  # it would soon be flat
            state = None
        if state is None or behind:
            return replace(self, state=state or self.state, age=age, behind=True)
        if not waits and not area >= SQUEEZED_AREA_RATIO * least:
            age, free = 0, state.forward(FINE_POWER, FORWARD, AT_REST_DECREASE, corners=False)
            with suppress(NoMapError):
                anew = self.pair.carried(free, given, self.settings, coarse=coarse)
                state = min(anew, state, key=lambda each: each.miss)
                least = _least_area(state)
        return replace(self, given=given, state=state, least=least, coarse=coarse, age=age, behind=False)

    def _with_patches(self, patches: PinnedPatches, given: Pins) -> "Live":
        """Return the same with other soft pins in its energy, beside the exact ones."""
        if not len(patches.points) and not len(self.patches.points):
            return self
        settings, factors = self.pair.with_patches(self.settings, patches), self.stiffening
        if len(factors) != len(patches.points):
            factors = np.ones(len(patches.points))
        energy = energy_of(settings, given)
        if energy.pins is not None:
            energy = replace(energy, pins=energy.pins.stiffer(factors))
        oriented = energy.inverse() if self.pair.inverted else energy
        state = self.state.with_energy(oriented)
        return replace(self, settings=settings, patches=patches, state=state, stiffening=factors)

    def _stiffened(self) -> "Live":
        """Return the same with the stiffness of springs that the next step is to use, by how far their pins miss."""
        pins = self.state.energy.pins
        if pins is None or self.stiffening.size != self.state.energy.pin_count:
            return self
        missed = pins.misses(self.state.z, self.state.u, self.state.material) / pins.limits
        factors = self.stiffening * np.clip(missed, 1 / MOST_STIFFENED, MOST_STIFFENED)
        return replace(self, stiffening=np.maximum(factors, 1))

    def _changes_vertices(self, given: Pins) -> bool:
        """Return whether constraints need other vertices than those that the mesh has, which each step may do again."""
        before = self.given
        same = before.inner.shape == given.inner.shape and np.array_equal(before.outer, given.outer)
        return not same or bool(before.strokes or given.strokes)

    def _pulled(self, given: Pins, steps: int) -> DiscreteMap | None:
        """Return the map with new goals for the same vertices, or with these on their way to their new sources by half
        of so many steps, and how many are `spared`; None where other vertices are needed.
        """
        before, now, inside = self.given, given, self.state.inside
        if self._changes_vertices(given):
            return None
        sources, goals = np.ascontiguousarray(now.inner.T)
        if np.array_equal(sources, before.inner[:, 0]) and not self.behind:
            return replace(self.state.with_goals(goals), spared=steps)
        if self.state.miss > 0 or not np.array_equal(goals, before.inner[:, 1]):
            return None
        pulled = replace(self.state, inside=inside._replace(z=sources))
        near = pulled.backward(FINE_POWER, steps // 2, AT_REST_DECREASE)
        return replace(near, spared=steps - steps // 2 + near.spared)

    @property
    def met(self) -> bool:
        """Whether strokes and exact pins are met; if not, the map is as close as it came."""
        return self.state.miss == 0 and not self.behind

    @property
    def map(self) -> TriangulatedMap:
        """The map in the given coordinates."""
        return self._world(self.state.inverse() if self.pair.inverted else self.state)

    @property
    def start(self) -> TriangulatedMap:
        """The same to continue from: with the triangles that fill holes of the target."""
        if not self.pair.inverted:
            return self.map
        inverse = self.state.inverse()
        covered = MeshMap.plain(inverse.z, inverse.u, inverse.faces, inverse.border, loops=inverse.loops)
        return self._world(covered)

    def _world(self, state: MeshMap) -> TriangulatedMap:
        frames = self.pair.frames
        cut = without_filled(state, mirrored=frames[0].mirrored)
        z, u = (f.pull_back(w[cut.vertices]) for f, w in zip(frames, (state.z, state.u)))
        map = TriangulatedMap(z, u, cut.faces, cut.loops)
        if not len(cut.lines):
            return map
        return replace(map, bulge=bulges(cut.faces, u, z, map.edges, cut.lines))


def _least_area(state: DiscreteMap) -> float:
    """Of a triangle or its image."""
    return float(min(triangle_areas(w[state.material]).min() for w in (state.z, state.u)))


def _at_sources(state: DiscreteMap) -> bool:
    """Return whether the vertices of pins are where these are in the source."""
    away = state.z[state.border : state.constrained] - state.inside.z[: state.constrained - state.border]
    return float(np.abs(away).max(initial=0.0)) < 1e-9


def _towards(state: DiscreteMap) -> DiscreteMap:
    """Return the map after some Newton steps, at FINE_POWER as the converged map; at 1 where that does not reach the
    goals.
    """
    found = state.forward(FINE_POWER, FORWARD, AT_REST_DECREASE, corners=True)
    return found if found.miss == 0 else state.forward(1.0, FORWARD, AT_REST_DECREASE, corners=True)


def _within(state: DiscreteMap) -> DiscreteMap:
    """Return the same with the steps of a budget that are left, going on at 1 from where it came to at FINE_POWER."""
    for power in (FINE_POWER, 1.0):
        if state.spared > 0 and (power == FINE_POWER or state.miss > 0):
            state = state.forward(power, state.spared, AT_REST_DECREASE, corners=True)
    return state


def _relax(state: DiscreteMap) -> DiscreteMap:
    """Return the map after some Newton steps on its inverse, if it has reached its goals."""
    return state if state.miss > 0 else state.backward(FINE_POWER, BACKWARD, AT_REST_DECREASE)
