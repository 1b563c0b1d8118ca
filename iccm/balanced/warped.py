"""A map that is kept, and follows pins by a deformation of its target.

A map that leaves parts out cannot move its pins as other balanced maps do: the parts that it hides are barriers, or
come into view. Here it stays as it is, and is composed with a map of the target onto itself, which moves what is seen.
That map does not know of hidden parts. As long as pins are where the first map takes them, it is the identity, and
nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Complex, Index
from ..curve import Curve
from ..errors import ConstraintError
from ..maps.approximation import triangulated
from ..maps.composition import composed
from ..maps.joined import joined
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..pins import FREE_TOLERANCE_SHARE, Softness
from ..plane import triangle_areas
from ..problem import Problem
from ..result import Fit
from .constraints.soft import PinnedPatches
from .fit import solve
from .interactive import Live

RIM_DEPTH_SHARE = 5e-3
"""Of the target's diagonal: pins stop at this distance from the rim, since pins on it must be on the source's rim."""


@dataclass(frozen=True, eq=False)
class PartWarp:
    """The map of a part, and the deformation of its target after it.

    Attributes:
        base: the map that is kept.
        after: the map of its target onto itself, with its pins; None for the identity.
    """

    base: Fit
    after: Fit | None = None

    @property
    def map(self) -> TriangulatedMap:
        """The map as it is without pins."""
        return triangulated(self.base.map)

    @property
    def without_pins(self) -> PartWarp:
        """The same part with its map before any pin was moved."""
        return PartWarp(self.base)

    def started(self, balance: float) -> Fit:
        """Return the map of the target onto itself, with which a deformation begins.

        Raises:
            InputError: the target has no map onto itself.
        """
        if self.after is not None:
            return self.after
        target, holes = self.base.target, self.base.target_holes
        assert target is not None
        problem = Problem.of(target, target, None, ()).between(holes=(holes, holes))
        return solve(problem, Options(balance=balance, fit="whole"))


@dataclass(frozen=True, eq=False)
class _PartLive:
    """The map of a part with a deformation of its target in force, with the interface of `Live`.

    Attributes:
        base: the map that is kept.
        first: its deformation when the drag began.
        live: the deformation that follows.
        pins: (k, 2) points of the source and their places.
        begun: the images of the kept map's vertices as long as nothing has moved.
        is_new: whether there was no deformation before the drag.
    """

    base: Fit
    first: Fit
    live: Live
    pins: Complex
    begun: Complex
    is_new: bool

    @classmethod
    def of(
        cls,
        warp: PartWarp,
        options: Options,
        pins: Complex,
        softness: Softness,
        *,
        springs: Mapping[complex, float] | None = None,
        dragged: bool = False,
    ) -> _PartLive:
        """Start a deformation; see `Live.of` for the arguments.

        Raises:
            NoMapError: no map without folds was found.
            InputError: a pin is in a part of the source that the map leaves out.
        """
        carried = _carried(warp.base, pins)
        if springs is not None:
            springs = {
                end: springs.get(start, 1.0)
                for start, end in zip(pins[:, 0].tolist(), carried[:, 0].tolist())
            }
        first = warp.started(options.balance)
        softness = _carried_softness(warp.base, softness)
        live = Live.of(first, options, carried, (), softness, springs=springs, dragged=dragged)
        begun = triangulated(first.map)(triangulated(warp.base.map).image)
        return cls(warp.base, first, live, pins, begun, is_new=warp.after is None)

    def follow(
        self,
        pins: Complex,
        softness: Softness,
        balance: float | None = None,
        *,
        dragged: bool = False,
    ) -> _PartLive:
        """Return the map with its deformation updated to pins that moved; see `Live.follow`.

        Raises:
            NoMapError: the map cannot follow without folds.
            InputError: a pin is in a part of the source that the map leaves out.
        """
        carried, softness = _carried(self.base, pins), _carried_softness(self.base, softness)
        live = self.live.follow(carried, (), softness, balance, dragged=dragged)
        return replace(self, live=live, pins=pins)

    @property
    def released(self) -> _PartLive:
        """The map as a later drag continues it."""
        return replace(self, live=self.live.released)

    @property
    def coarse(self) -> bool:
        """Whether the deformation's mesh is coarse."""
        return self.live.coarse

    @property
    def met(self) -> bool:
        """Whether the deformation has followed as far as its steps went; soft pins are measured separately."""
        return self.live.met

    @property
    def without_pins(self) -> PartWarp:
        """The part as it is without pins."""
        return PartWarp(self.base)

    @property
    def patches(self) -> PinnedPatches:
        """The soft pins; their radii are those in the source."""
        return self._at_sources(self.live.patches)

    @property
    def springs(self) -> dict[complex, float]:
        """The factors of the springs of pins, by the pins' points of the source."""
        return self._by_source(self.live.springs)

    @property
    def springs_in_force(self) -> dict[complex, float]:
        """The factors of the springs that pull in this map, in the same form."""
        return self._by_source(self.live.springs_in_force)

    @cached_property
    def map(self) -> TriangulatedMap:
        """The composed map on the triangles of the one that is kept, or on finer ones where a triangle would fold.

        Raises:
            InputError: no composition without folds was found.
        """
        base = triangulated(self.base.map)
        image = self.live.map(base.image)
        if self.is_new and np.array_equal(image, self.begun):
            return base
        if (triangle_areas(image[base.faces]) > 0).all():
            return replace(base, image=image, bulge=None)
        return composed(base.image, base.faces, base.inverse, self.live.map).map

    @property
    def warp(self) -> PartWarp:
        """The kept map and the deformation, from which a later drag continues."""
        pins, softness = self.live.patches.points, self.live.patches.softness
        details = replace(self.first.details, softness=softness)
        return PartWarp(self.base, replace(self.first, map=self.live.map, pins=pins, details=details))

    def _by_source(self, values: dict[complex, float]) -> dict[complex, float]:
        carried = _carried(self.base, self.pins)[:, 0].tolist()
        return {
            source: values[end] for source, end in zip(self.pins[:, 0].tolist(), carried) if end in values
        }

    def _at_sources(self, patches: PinnedPatches) -> PinnedPatches:
        carried = _carried(self.base, self.pins)[:, 0]
        order = [int(np.flatnonzero(carried == end)[0]) for end in patches.points[:, 0]]
        radii = patches.softness.radii / _scale(self.base)
        return replace(patches, points=self.pins[order], softness=replace(patches.softness, radii=radii))


@dataclass(frozen=True, eq=False)
class TargetWarp:
    """A map, or the maps of several parts, each with the deformation of its target after it."""

    parts: tuple[PartWarp, ...]

    @classmethod
    def of(cls, fits: Sequence[Fit]) -> TargetWarp:
        """Return maps before any deformation."""
        return cls(tuple(PartWarp(fit) for fit in fits))


@dataclass(frozen=True, eq=False)
class WarpedLive:
    """A map, or the maps of several parts, with deformations of their targets in force, with the interface of `Live`.

    A pin deforms the target of the part that it is in.

    Attributes:
        parts: the parts, with a deformation in force where they have pins.
        options: of the solver.
    """

    parts: tuple[PartWarp | _PartLive, ...]
    options: Options

    @classmethod
    def of(
        cls,
        warp: TargetWarp,
        options: Options,
        pins: Complex,
        softness: Softness,
        *,
        springs: Mapping[complex, float] | None = None,
        dragged: bool = False,
    ) -> WarpedLive:
        """Start deformations; see `Live.of` for the arguments.

        Raises:
            NoMapError: no map without folds was found.
            InputError: a pin is in a part of the source that the map leaves out.
        """
        parts = list[PartWarp | _PartLive]()
        for part, own in zip(warp.parts, _pins_of_parts([part.base for part in warp.parts], pins)):
            parts.append(
                _PartLive.of(
                    part, options, pins[own], softness.of_pins(own), springs=springs, dragged=dragged
                )
                if own.size
                else part.without_pins
            )
        return cls(tuple(parts), options)

    def follow(
        self,
        pins: Complex,
        strokes: Sequence[tuple[Curve, Curve]] = (),
        softness: Softness | None = None,
        balance: float | None = None,
        *,
        dragged: bool = False,
    ) -> WarpedLive:
        """Return the map with its deformations updated to pins that moved; see `Live.follow`.

        Raises:
            NoMapError: the map cannot follow without folds.
            InputError: a pin is in a part of the source that the map leaves out.
        """
        assert softness is not None and not strokes
        parts = list[PartWarp | _PartLive]()
        for part, own in zip(self.parts, _pins_of_parts([part.base for part in self.parts], pins)):
            if not own.size:
                parts.append(part.without_pins)
            elif isinstance(part, PartWarp):
                parts.append(
                    _PartLive.of(part, self.options, pins[own], softness.of_pins(own), dragged=dragged)
                )
            else:
                parts.append(part.follow(pins[own], softness.of_pins(own), balance, dragged=dragged))
        return replace(self, parts=tuple(parts))

    @property
    def _pinned(self) -> list[_PartLive]:
        return [part for part in self.parts if isinstance(part, _PartLive)]

    @property
    def released(self) -> WarpedLive:
        """The map as a later drag continues it."""
        parts = [part.released if isinstance(part, _PartLive) else part for part in self.parts]
        return replace(self, parts=tuple(parts))

    @property
    def coarse(self) -> bool:
        """Whether the mesh of a deformation is coarse."""
        return any(part.coarse for part in self._pinned)

    @property
    def met(self) -> bool:
        """Whether all deformations have followed as far as their steps went; soft pins are measured separately."""
        return all(part.met for part in self._pinned)

    @cached_property
    def patches(self) -> PinnedPatches:
        """The soft pins; their radii are those in the source."""
        patches = [part.patches for part in self._pinned]
        points = np.concatenate([each.points for each in patches])
        softness = Softness.joined([each.softness for each in patches])
        return replace(patches[0], points=points, softness=softness)

    @property
    def springs(self) -> dict[complex, float]:
        """The factors of the springs of pins, by the pins' points of the source."""
        return {point: factor for part in self._pinned for point, factor in part.springs.items()}

    @property
    def springs_in_force(self) -> dict[complex, float]:
        """The factors of the springs that pull in this map, in the same form."""
        return {point: factor for part in self._pinned for point, factor in part.springs_in_force.items()}

    @property
    def exact_pins(self) -> Complex:
        """(0, 2): all pins are soft."""
        return np.empty((0, 2), complex)

    def is_soft(self, source: complex) -> bool:
        """Return whether the pin at a point of the source is soft."""
        return bool((self.patches.points[:, 0] == source).any())

    def limit(self, source: complex) -> float:
        """Return how far from its place the pin at a point of the source may be."""
        return float(self.patches.softness.limits[self.patches.points[:, 0] == source][0])

    @property
    def maps(self) -> list[TriangulatedMap]:
        """The composed map of each part.

        Raises:
            InputError: no composition without folds was found.
        """
        return [part.map for part in self.parts]

    @cached_property
    def map(self) -> TriangulatedMap:
        """The composed maps of all parts as one.

        Raises:
            InputError: no composition without folds was found.
        """
        return joined(self.maps)

    @property
    def start(self) -> TriangulatedMap:
        """The same, with the name that it has in `Live`: warped maps have no triangles that fill holes."""
        return self.map

    @property
    def warp(self) -> TargetWarp:
        """The kept maps and their deformations, from which a later drag continues."""
        return TargetWarp(tuple(part.warp if isinstance(part, _PartLive) else part for part in self.parts))


def _pins_of_parts(bases: Sequence[Fit], pins: Complex) -> list[Index]:
    """Return the numbers of the pins (k, 2) in each part; where parts overlap, the last one covers the others.

    Raises:
        InputError: a pin is in a part of the source that no map shows.
    """
    numbers = np.full(len(pins), -1)
    for number, base in enumerate(bases):
        numbers[np.isfinite(triangulated(base.map)(pins[:, 0]))] = number
    lost = np.flatnonzero(numbers < 0)
    if lost.size:
        raise ConstraintError(
            f"pin {lost[0] + 1} is in a part of the source that is not shown", pins=lost.tolist()
        )
    return [np.flatnonzero(numbers == number) for number in range(len(bases))]


def _carried(base: Fit, pins: Complex) -> Complex:
    """Return pins (k, 2) of the deformation after a map: where that takes them, and their places.

    A pin that is dragged onto the rim of the target or out of it, such as out of its part, is pulled as far as possible
    towards its place inside; a pin that the map takes to the rim stays there.
    """
    assert base.target is not None
    images, places = triangulated(base.map)(pins[:, 0]), pins[:, 1].copy()
    outline, depth = base.target, RIM_DEPTH_SHARE * base.target.diagonal
    is_inner = outline.distances(images) > depth
    for k in np.flatnonzero(is_inner & (~outline.contains(places) | (outline.distances(places) < depth))):
        side = 1 if outline.contains(places[k : k + 1])[0] else -1
        rim = outline.nearest(places[k : k + 1])[0]
        inwards = side * (places[k] - rim) or images[k] - rim
        inner = rim + depth * inwards / abs(inwards)
        places[k] = inner if outline.contains(np.array([inner]))[0] else images[k]
    return np.column_stack([images, places])


def _scale(base: Fit) -> float:
    """Return the mean scale of a map."""
    map = triangulated(base.map)
    return float(np.sqrt(triangle_areas(map.corners).sum() / triangle_areas(map.source[map.faces]).sum()))


def _carried_softness(base: Fit, softness: Softness) -> Softness:
    """Return the softness of pins after a map. Automatic tolerances are those of deformations, since the map is right
    where no pin is.
    """
    assert base.target is not None
    tolerance = FREE_TOLERANCE_SHARE * np.sqrt(abs(base.target.area))
    tolerances = np.where(np.isnan(softness.tolerances), tolerance, softness.tolerances)
    return replace(softness, radii=softness.radii * _scale(base), tolerances=tolerances)
