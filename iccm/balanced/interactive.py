"""A coarse balanced map that follows its pins and strokes while they are moved, each time from the map before.

Where only the targets of pins inside have moved their goals move, and Newton's method follows; where only the sources
have, so does that of the inverse. Everything else (a pin more or less, one on the outline, a stroke) takes a new mesh,
to which the map is carried.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Complex
from ..curve import Curve
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import bulges
from ..plane import triangle_areas
from ..result import Fit
from .constraints.validate import Pins, check
from .errors import NoMapError, Stuck
from .holes.filled import without_filled
from .holes.given import Holes, named_partners
from .method import sketch_of
from .model.discrete_map import DiscreteMap
from .model.frames import UnitFrame, frames_of
from .model.settings import Settings
from .model.sketch import Sketch
from .search.final_mesh import FINE_EXACTNESS
from .search.homotopy import brought
from .search.levels import POWER, Level, refine
from .search.multilevel import STEEPEST, cost_of_turning, with_constraints
from .search.pin_continuation import move_on_new_meshes

SIZE = 0.06
"""Mesh size h of domains of area one, 1200 triangles: 4 ms follow a pin, 25 ms carry to a new mesh."""
FORWARD, BACKWARD, DECREASE = 8, 3, 1e-3  # Newton steps on the map, then on its inverse
SQUEEZED = 0.01
"""Of the smallest area on the mesh when it was new: smaller triangles are between corners of source and target that
want to pass each other on the outline, which they can on a new mesh only."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two domains, their holes, and the frames of their unit coordinates."""

    source: Curve
    target: Curve
    holes: Holes
    frames: tuple[UnitFrame, UnitFrame]

    def checked(self, pins: Complex, strokes: Sequence[tuple[Curve, Curve]]) -> Pins:
        """Pins and strokes in unit coordinates; pins in holes only say which go together.

        Raises:
            InputError: those that no one-to-one map meets.
        """
        _, pins, numbers = named_partners(self.holes, self.source, self.target, pins, strokes)
        return check(self.source, self.target, pins, strokes, numbers).unit(self.frames)

    def carried(self, state: DiscreteMap | Sketch, given: Pins, settings: Settings) -> DiscreteMap:
        """A map on a new coarse mesh, brought to constraints.

        Raises:
            NoMapError: it folds there.
        """
        source, target = self.frames[0].curve(self.source), self.frames[1].curve(self.target)
        upright = cost_of_turning(given, settings)
        problem = with_constraints(source, target, self.holes.unit(self.frames), given, settings, upright)
        if isinstance(state, DiscreteMap):  # its constraints are others, of other vertices
            state = Sketch(state.z, state.u, state.faces, state.border, loops=state.loops)
        try:
            level = Level.of(problem, SIZE, *FINE_EXACTNESS, STEEPEST)
            new = brought(refine(level, state), settings.theta)
            if new.miss > 0 and not given.strokes:  # other triangles may let the pins pass
                anew = move_on_new_meshes(level, new.held(), new.inside.goals, settings.theta)
                new = min(anew, new, key=lambda each: each.miss)
            return _relax(new, settings.theta)
        except Stuck as error:
            raise NoMapError(f"the map cannot follow: {error}") from error


@dataclass(frozen=True, eq=False)
class Live:
    """A coarse map with constraints in force.

    Attributes:
        pair: the two domains.
        settings: what is asked of the map.
        given: pins and strokes in unit coordinates.
        state: the map in them.
        least: the smallest area of a triangle, or of its image, when its mesh was new.
    """

    pair: "_Pair"
    settings: Settings
    given: Pins
    state: DiscreteMap
    least: float

    @classmethod
    def of(
        cls,
        fit: Fit,
        settings: Settings,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
    ) -> "Live":
        """Beginning with a balanced map, pins (k, 2) and strokes as for `solve`.

        Holes of the target that the source has not are passed over.

        Raises:
            NoMapError: no coarse map without folds was found.
            InputError: pins or strokes that no one-to-one map meets.
        """
        assert fit.target is not None and isinstance(fit.map, TriangulatedMap)
        met = [(loop + 1, i, j) for loop, (i, j) in enumerate(fit.hole_partners) if min(i, j) >= 0]
        own = [(loop, i, k) for k, (loop, i, _) in enumerate(met)]
        goals = tuple(fit.target_holes[j] for _, _, j in met)
        holes = Holes(tuple(fit.source_holes), goals, tuple((i, k) for _, i, k in own))
        frames = frames_of(fit.source, fit.target, settings.turn, holes.sides)
        pair = _Pair(fit.source, fit.target, holes, frames)
        given = pair.checked(pins, strokes)
        state = pair.carried(sketch_of(fit.map, frames, own), given, settings)
        return cls(pair, settings, given, state, _least_area(state))

    def moved(
        self, pins: Complex, strokes: Sequence[tuple[Curve, Curve]] = (), theta: float | None = None
    ) -> "Live":
        """The map continued to pins and strokes that have moved, or to another balance.

        Raises:
            NoMapError: the map cannot be carried there without folds.
            InputError: pins or strokes that no one-to-one map meets.
        """
        settings = self.settings if theta is None else replace(self.settings, theta=theta)
        given = self.pair.checked(pins, strokes)
        state, least = self._pulled(given), self.least
        if state is not None:
            state = _relax(_towards(state, settings.theta), settings.theta)
        if state is None or state.miss > 0:
            state = self.pair.carried(state or self.state, given, settings)
            least = _least_area(state)
        if not _least_area(state) >= SQUEEZED * least:
            free = state.forward(settings.theta, POWER, FORWARD, DECREASE, corners=False)
            with suppress(NoMapError):
                state = min(self.pair.carried(free, given, settings), state, key=lambda each: each.miss)
                least = _least_area(state)
        return replace(self, settings=settings, given=given, state=state, least=least)

    def _pulled(self, given: Pins) -> DiscreteMap | None:
        """The map with new goals for the same vertices; None where other vertices are needed."""
        before, now, inside = self.given, given, self.state.inside
        same = before.inner.shape == now.inner.shape and np.array_equal(before.outer, now.outer)
        if not same or before.strokes or now.strokes:
            return None
        sources, goals = np.ascontiguousarray(now.inner.T)
        if np.array_equal(sources, before.inner[:, 0]):
            return self.state.with_goals(goals)
        if self.state.miss > 0 or not np.array_equal(goals, before.inner[:, 1]):
            return None
        pulled = replace(self.state, inside=inside._replace(z=sources))
        pulled = pulled.backward(self.settings.theta, POWER, FORWARD, DECREASE)
        near = np.abs(pulled.z[pulled.border : pulled.constrained] - sources)
        return pulled if near.max(initial=0.0) < 1e-9 else None

    @property
    def met(self) -> bool:
        """Whether pins and strokes are met; if not, the map is as close as it came."""
        return self.state.miss == 0

    @property
    def map(self) -> TriangulatedMap:
        """The map in the given coordinates."""
        frames = self.pair.frames
        cut = without_filled(self.state, mirrored=frames[0].mirrored)
        z, u = (f.world(w[cut.vertices]) for f, w in zip(frames, (self.state.z, self.state.u)))
        map = TriangulatedMap(z, u, cut.faces, cut.loops)
        return replace(map, bulge=bulges(cut.faces, u, z, map.edges, cut.lines))


def _least_area(state: DiscreteMap) -> float:
    """Of a triangle or its image."""
    return float(min(triangle_areas(w[state.material]).min() for w in (state.z, state.u)))


def _towards(state: DiscreteMap, theta: float) -> DiscreteMap:
    """The map after some Newton steps, at POWER as the map at rest; where that does not reach the goals, at 1."""
    found = state.forward(theta, POWER, FORWARD, DECREASE, corners=True)
    return found if found.miss == 0 else state.forward(theta, 1.0, FORWARD, DECREASE, corners=True)


def _relax(state: DiscreteMap, theta: float) -> DiscreteMap:
    """The map after some Newton steps on its inverse, if it has reached its goals."""
    return state if state.miss > 0 else state.backward(theta, POWER, BACKWARD, DECREASE)
