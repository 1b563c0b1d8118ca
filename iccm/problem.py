"""The domains and constraints of a solve, checked, and the frames in which they are solved for."""

import math
from collections.abc import Sequence, Sized
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Box, Complex, Real, as_complex
from .curve import Curve, boundary_samples
from .errors import InputError
from .maps.fields import Field
from .maps.harmonic import HarmonicMap
from .pins import Softness
from .plane import bounding_box

NEAR = 1e-6  # relative to the diagonal: rounding
ON_OUTLINE = 1e-3
"""Relative to the diagonal: what is this close to the outline is on it, where constraints are met."""
LEAST_IMPORTANCE, LEAST_SIZE = 0.1, 1e-2
"""Relative to the largest value of the field: smaller ones are raised, since energies are divided by them."""


@dataclass(frozen=True)
class Frame:
    """The similarity that takes the centroid of the boundary to 0 and the vertex farthest from it to 1.

    It turns with the shape, so that what is computed in it does not depend on how the shape lies in the plane.
    """

    centre: complex
    radius: complex

    @classmethod
    def of(cls, curve: Curve) -> "Frame":
        """The frame of a curve."""
        middle = 0.5 * (curve.z[: curve.edges.size] + np.roll(curve.z, -1)[: curve.edges.size])
        # measured from a vertex, so that a shape far from the origin keeps its digits
        centre = curve.z[0] + complex(np.average(middle - curve.z[0], weights=curve.lengths))
        return cls(centre, complex(curve.z[np.argmax(np.abs(curve.z - centre))] - centre))

    def unit(self, z: ArrayLike) -> Complex:
        """Points in the frame."""
        return (np.asarray(z, dtype=np.complex128) - self.centre) / self.radius

    def world(self, z: ArrayLike) -> Complex:
        """Points of the frame back in the plane."""
        return np.asarray(z, dtype=np.complex128) * self.radius + self.centre

    def curve(self, curve: Curve) -> Curve:
        """A curve in the frame."""
        return Curve(self.unit(curve.z), curve.closed)


@dataclass(frozen=True, eq=False)
class AsGiven:
    """What the user gave, bit for bit: a result shows these, not what came back from unit frames.

    Attributes:
        source: the source's outline, made a domain.
        target: the target's.
        pins: (k, 2) source and target of each pin.
        strokes: of each stroke.
    """

    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]


@dataclass(frozen=True, eq=False)
class Problem:
    """Source, target and constraints in their unit frames; `target` is None for a deformation.

    Holes run clockwise, in the user's coordinates; in these are rigid regions of either side, too.
    """

    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    source_frame: Frame
    target_frame: Frame
    source_holes: tuple[Curve, ...] = ()
    target_holes: tuple[Curve, ...] = ()
    hole_partners: tuple[tuple[int, int], ...] = ()
    rigid: tuple[Complex, ...] = ()
    rigid_target: tuple[Complex, ...] = ()
    importance: Field | None = None
    size_map: Field | None = None
    as_given: "AsGiven | None" = None
    softness: Softness = field(default_factory=lambda: Softness.free(0))

    @classmethod
    def of(
        cls, source, target, pins=None, strokes=None, *, first: bool = True, holes=((), ()), partners=(),
        reach: float = NEAR, rigid=(), rigid_target=(), importance=None, size_map=None, pins_inside: bool = False,
        softness=None,
    ) -> "Problem":  # fmt: skip
        """Check and normalise what the user gave (see `iccm.fit`).

        `first` says whether it matters which vertices are the first, as for a start by arclength; `reach`, relative to
        the diagonal, how far outside constraints may be; `pins_inside` whether pins that lead out of the target are
        refused here, since the method that solves weighs them and would not notice.
        """
        source = as_domain(source, "source")
        target = None if target is None else as_domain(target, "target")
        outlines = source, target
        inner = [
            _holes(c, given, name) for c, given, name in zip((source, target), holes, ("source", "target"))
        ]
        if not first:
            source, target = from_known(source), target and from_known(target)
        s, t = Frame.of(source), Frame.of(target or source)
        pins = as_pins(pins)
        _inside(source, pins[:, 0], "pin", reach)
        if target is not None and pins_inside:
            _inside(target, pins[:, 1], "target of pin", reach, "target")
        pairs = [as_strokes(k, pair) for k, pair in enumerate(strokes or [])]
        for a, _ in pairs:
            _inside(source, a.z, "source stroke vertex", reach)
        unit_pins = np.column_stack([s.unit(pins[:, 0]), t.unit(pins[:, 1])])
        unit_strokes = [(s.curve(a), t.curve(b)) for a, b in pairs]
        unit, goal = s.curve(source), target and t.curve(target)
        known = _partners(partners, inner)
        kept, kept_there = (
            tuple(as_domain(region, f"rigid region {k + 1}").z for k, region in enumerate(side))
            for side in (rigid, rigid_target)
        )
        given = inner[0], inner[1], known, kept, kept_there
        kept_as_given = AsGiven(outlines[0], outlines[1], pins, pairs)
        importance_field = _field(importance, source.box, "importance", LEAST_IMPORTANCE)
        size_field = _field(size_map, source.box, "size_map", LEAST_SIZE)
        return cls(
            unit,
            goal,
            unit_pins,
            unit_strokes,
            s,
            t,
            *given,
            importance=importance_field,
            size_map=size_field,
            as_given=kept_as_given,
            softness=Softness.free(len(pins)) if softness is None else softness,
        )

    def mirrored(self) -> "Problem":
        """The same problem seen in a mirror."""
        strokes = [(Curve(a.z.conj(), False), Curve(b.z.conj(), False)) for a, b in self.strokes]
        frames = [
            Frame(f.centre.conjugate(), f.radius.conjugate()) for f in (self.source_frame, self.target_frame)
        ]
        target = self.target and _mirror(self.target)
        return Problem(_mirror(self.source), target, self.pins.conj(), strokes, frames[0], frames[1])

    @property
    def given_source(self) -> Curve:
        """The source in the user's coordinates."""
        return Curve(self.source_frame.world(self.source.z))

    @property
    def given(self) -> tuple[Curve, Curve]:
        """Source and target in the user's coordinates; there must be a target."""
        assert self.target is not None
        return self.given_source, Curve(self.target_frame.world(self.target.z))

    @property
    def given_pins(self) -> Complex:
        """(k, 2) pins in the user's coordinates."""
        frames = (self.source_frame, self.target_frame)
        return np.column_stack([f.world(side) for f, side in zip(frames, self.pins.T)])

    @property
    def given_strokes(self) -> list[tuple[Curve, Curve]]:
        """Strokes in the user's coordinates."""
        s, t = self.source_frame, self.target_frame
        return [(Curve(s.world(a.z), False), Curve(t.world(b.z), False)) for a, b in self.strokes]

    @property
    def handedness(self) -> float:
        """A number that changes sign in a mirror: the third moment of the source's boundary across its axis,
        or the target's."""
        moments = [
            float(c.lengths @ (c.z + 0.5 * c.edges).imag ** 3) for c in (self.source, self.target) if c
        ]
        return next((m for m in moments if abs(m) > 1e-6), 1.0)

    @property
    def upright(self) -> complex:
        """The factor by which unit frames are multiplied in a similarity that does not turn the user's picture."""
        turn = self.source_frame.radius / self.target_frame.radius
        return turn / abs(turn)

    def world(self, polygon: Complex, phi: Complex, psi: Complex) -> HarmonicMap:
        """The map of unit frames as a map of the user's plane: constants go to φ alone, since Σ C = 1."""
        s, t = self.source_frame, self.target_frame
        z = s.world(polygon)
        return HarmonicMap(z, t.world(phi), psi * t.radius, overhang(Curve(z), s.world(self.source.z)))


def overhang(polygon: Curve, outline: Complex) -> float:
    """How far the outline that a polygon stands for lies outside of it, at its vertices and three places between."""
    z = boundary_samples(outline)
    return float(np.abs(polygon.pulled_in(z) - z).max()) * (1 + 1e-9)


def as_domain(shape: "Curve | ArrayLike", name: str) -> Curve:
    """A validated domain from a Curve or an array of vertices."""
    return Curve.domain(shape.z if isinstance(shape, Curve) else shape, name)


def from_farthest(curve: Curve) -> Curve:
    """The closed curve of a unit frame, started at its vertex farthest from 0."""
    return Curve(np.roll(curve.z, -int(np.argmax(np.abs(curve.z)))))


def from_known(curve: Curve) -> Curve:
    """The closed curve started at a vertex that does not depend on where it was: the one closest to the vertices'
    mean, and of several the leftmost, and the lowest of those."""
    base = bounding_box(curve.z)[0]
    away = curve.z - base
    mean = complex(math.fsum(away.real), math.fsum(away.imag)) / away.size
    distance = np.abs(away - mean)
    ties = np.flatnonzero(distance < distance.min() + 1e-9 * distance.max())
    first = ties[np.lexsort((curve.z.imag[ties], curve.z.real[ties]))[0]]
    return Curve(np.roll(curve.z, -int(first)))


def _holes(outer: Curve | None, holes, name: str) -> tuple[Curve, ...]:
    """The outlines of holes, clockwise, from known vertices on.

    Raises:
        InputError: one is no simple polygon, or not inside and apart from the outline and the others.
    """
    found: list[Curve] = []
    rings = [outer.polygon] if outer else []
    for k, hole in enumerate(holes):
        curve = from_known(as_domain(hole, f"{name} hole {k + 1}"))
        ring = curve.polygon
        if not rings[0].contains_properly(ring):
            raise InputError(f"{name} hole {k + 1}: crosses or touches the outline, or lies outside of it")
        touched = [j for j, other in enumerate(rings[1:]) if ring.intersects(other)]
        if touched:
            raise InputError(f"{name} hole {k + 1}: crosses, touches or holds hole {touched[0] + 1}")
        rings.append(ring)
        found.append(curve.reversed())
    return tuple(found)


def _field(given, box: Box, name: str, least: float) -> Field | None:
    """What a user gave, a picture (h, w) over the source's bounding box, or one with its box."""
    if given is None or isinstance(given, Field):
        return given
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 2:
        given, corners = given
        low, high = as_complex(corners, name)
        box = complex(low), complex(high)
        if not (np.isfinite(corners).all() and high.real > low.real and high.imag > low.imag):
            raise InputError(f"{name}: {corners!r} is no lower left and upper right corner, x + iy")
    return Field.of(given, box, least, name)


def _partners(partners, holes: Sequence[tuple[Curve, ...]]) -> tuple[tuple[int, int], ...]:
    found = tuple((int(i), int(j)) for i, j in partners)
    for k, (side, name) in enumerate(zip(zip(*found), ("source", "target"))):
        if len(set(side)) < len(side) or not all(0 <= i < len(holes[k]) for i in side):
            raise InputError(f"hole_partners: {list(side)} are no different holes of the {name}")
    return found


def _mirror(curve: Curve) -> Curve:
    return Curve(np.roll(curve.z.conj()[::-1], 1))


def as_strokes(k: int, pair) -> tuple[Curve, Curve]:
    """Return pair number k of strokes, source and target, as curves.

    Raises:
        InputError: it is not a pair of polylines.
    """
    if not hasattr(pair, "__len__") or len(pair) != 2:
        raise InputError(f"strokes: number {k + 1} is no pair of polylines, source and target")
    return _stroke(pair[0], "source stroke"), _stroke(pair[1], "target stroke")


def _stroke(shape, name: str) -> Curve:
    return Curve.stroke(shape.z if isinstance(shape, Curve) else shape, name)


def as_pins(pins: ArrayLike | Sequence | None) -> Complex:
    """Return pins as (k, 2) complex numbers, source and target of each.

    Raises:
        InputError: they are not pairs of finite points.
    """
    if pins is None or (isinstance(pins, Sized) and not len(pins)):
        return np.empty((0, 2), dtype=np.complex128)
    array = as_complex(pins, "pins", 2)
    if not np.isfinite(array).all():
        raise InputError("pins: not all coordinates are finite numbers")
    return array


def _inside(shape: Curve, z: Complex, what: str, reach: float, side: str = "source") -> None:
    """Raise unless every point is inside a shape or on its boundary."""
    if not z.size:
        return
    gap = shape.distances(z)
    outside = np.flatnonzero(~shape.contains(z) & (gap > reach * shape.diagonal))
    if outside.size:
        k = outside[0]
        raise InputError(
            f"{what} {k + 1}: ({z[k].real:g}, {z[k].imag:g}) is outside the {side} shape, "
            f"by {gap[k]:.3g}; move it inside"
        )


def measure_of(curve: Curve, per_edge: int) -> Real:
    """(e · per_edge,) share of the curve's length that each sample of `curve.sample(per_edge)` stands for."""
    return np.repeat(curve.lengths / (per_edge * curve.length), per_edge)
