"""A coarse balanced map that follows its pins and strokes while they are moved, each time from the map before.

Where only the targets of pins inside have moved their goals move, and Newton's method follows; where only the sources
have, so does that of the inverse. Everything else (a pin more or less, one on the outline, a stroke) takes a new mesh,
to which the map is carried.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Complex, Index
from ..curve import Curve
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import bulges
from .constraints.given import Pins, checked, with_points
from .constraints.meeting import brought
from .discrete import DiscreteMap
from .failure import NoMapError, Stuck
from .frames import Frame, frames_of
from .levels import Level, Problem, Sketch, refined
from .outline import manageable
from .solution import Settings
from .stages import FINE_CORNERS, FINE_FINENESS, STEEPEST

SIZE = (
    0.06  # mesh size h of domains of area one, 1200 triangles: 4 ms follow a pin, 25 ms carry to a new mesh
)
FORWARD, BACKWARD, DECREASE = 8, 3, 1e-3  # Newton steps on the map, then on its inverse


@dataclass(frozen=True, eq=False)
class Live:
    """A coarse map with constraints in force.

    Attributes:
        source, target: the domains, as from `Curve.domain`.
        settings: what is asked of the map.
        frames: of the unit coordinates.
        given: pins and strokes in them.
        state: the map in them.
    """

    source: Curve
    target: Curve
    settings: Settings
    frames: tuple[Frame, Frame]
    given: Pins
    state: DiscreteMap

    @classmethod
    def of(
        cls,
        map: TriangulatedMap,
        domains: tuple[Curve, Curve],
        settings: Settings,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
    ) -> "Live":
        """Beginning with a map of the domains onto each other, pins (k, 2) and strokes as for `solve`.

        Raises:
            NoMapError: no coarse map without folds was found.
            InputError: pins or strokes that no one-to-one map meets.
        """
        frames = frames_of(*domains, settings.turn)
        given = checked(*domains, pins, strokes).unit(frames)
        sketch = _sketch(map, frames)
        return cls(*domains, settings, frames, given, _carried(sketch, domains, frames, given, settings))

    def moved(
        self, pins: Complex, strokes: Sequence[tuple[Curve, Curve]] = (), theta: float | None = None
    ) -> "Live":
        """The map continued to pins and strokes that have moved, or to another balance.

        Raises:
            NoMapError: the map cannot be carried there without folds.
            InputError: pins or strokes that no one-to-one map meets.
        """
        settings = self.settings if theta is None else replace(self.settings, theta=theta)
        given = checked(self.source, self.target, pins, strokes).unit(self.frames)
        state = self._pulled(given)
        if state is not None:
            state = _settled(
                state.forward(settings.theta, 1.0, FORWARD, DECREASE, corners=True), settings.theta
            )
        if state is None or state.miss > 0:
            domains = (self.source, self.target)
            state = _carried(state or self.state, domains, self.frames, given, settings)
        return replace(self, settings=settings, given=given, state=state)

    def _pulled(self, given: Pins) -> DiscreteMap | None:
        """The map with new goals for the same vertices; None where other vertices are needed."""
        before, now, inside = self.given, given, self.state.inside
        same = before.inner.shape == now.inner.shape and np.array_equal(before.outer, now.outer)
        if not same or before.strokes or now.strokes:
            return None
        sources, goals = np.ascontiguousarray(now.inner.T)
        if np.array_equal(sources, before.inner[:, 0]):
            return replace(self.state, inside=inside._replace(goals=goals))
        if self.state.miss > 0 or not np.array_equal(goals, before.inner[:, 1]):
            return None
        pulled = replace(self.state, inside=inside._replace(z=sources))
        pulled = pulled.backward(self.settings.theta, 1.0, FORWARD, DECREASE)
        near = np.abs(pulled.z[pulled.border : pulled.constrained] - sources)
        return pulled if near.max(initial=0.0) < 1e-9 else None

    @property
    def met(self) -> bool:
        """Whether pins and strokes are met; if not, the map is as close as it came."""
        return self.state.miss == 0

    @property
    def map(self) -> TriangulatedMap:
        """The map in the given coordinates."""
        state, mirrored = self.state, self.frames[0].mirrored
        z, u = self.frames[0].world(state.z), self.frames[1].world(state.u)
        faces = np.ascontiguousarray(state.faces[:, ::-1]) if mirrored else state.faces
        loop = np.arange(state.border)
        map = TriangulatedMap(z, u, faces, (loop[::-1].copy() if mirrored else loop,))
        return replace(map, bulge=bulges(faces, u, z, map.edges, state.lines))


def _sketch(map: TriangulatedMap, frames: tuple[Frame, Frame]) -> Sketch:
    """A map in unit coordinates, the vertices of its outline first."""
    loop, mirrored = map.loops[0], frames[0].mirrored
    first = loop[::-1] if mirrored else loop
    order = np.append(first, np.setdiff1d(np.arange(map.source.size), first))
    places = np.empty_like(order)
    places[order] = np.arange(order.size)
    faces: Index = places[map.faces[:, ::-1] if mirrored else map.faces]
    return Sketch(
        frames[0].unit(map.source[order]),
        frames[1].unit(map.image[order]),
        np.ascontiguousarray(faces),
        first.size,
    )


def _carried(
    state: DiscreteMap | Sketch,
    domains: tuple[Curve, Curve],
    frames: tuple[Frame, Frame],
    given: Pins,
    settings: Settings,
) -> DiscreteMap:
    """A map on a new coarse mesh, brought to constraints.

    Raises:
        NoMapError: it folds there.
    """
    anchors = tuple(tuple(side.tolist()) for side in given.outer.T)
    curves = [with_points(f.curve(c), side) for f, c, side in zip(frames, domains, given.outer.T)]
    curves = [manageable(c, settings.tolerance, a) for c, a in zip(curves, anchors)]
    problem = Problem(curves[0], curves[1], settings.theta, 0.0, (anchors[0], anchors[1]))
    problem = problem._replace(pins=given.inner, strokes=given.strokes)
    if isinstance(state, DiscreteMap):  # its constraints are others, of other vertices
        state = Sketch(state.z, state.u, state.faces, state.border)
    try:
        level = Level.of(problem, SIZE, FINE_FINENESS, FINE_CORNERS, STEEPEST)
        return _settled(brought(refined(level, state), settings.theta), settings.theta)
    except Stuck as error:
        raise NoMapError(f"the map cannot follow: {error}") from error


def _settled(state: DiscreteMap, theta: float) -> DiscreteMap:
    """The map after some Newton steps on its inverse, if it has reached its goals."""
    return state if state.miss > 0 else state.backward(theta, 1.0, BACKWARD, DECREASE)
