"""The problem to be solved, in coordinates where both shapes have radius one about their centroids."""

import math
from collections.abc import Iterable, Sequence, Sized
from dataclasses import dataclass, fields
from typing import Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Box, Complex, Real, as_complex
from .curve import Curve, boundary_samples
from .errors import InputError
from .fits import FITS
from .maps.fields import Field
from .maps.harmonic import HarmonicMap
from .plane import bounding_box

MOST_EFFORT = 16  # times as many as usual
MOST_VERTICES = 4000  # of a map's polygon: its equations are a dense matrix
METHODS = ("balanced", "conformal", "paper")
NEAR = 1e-6  # of the diagonal: rounding
IMPORTANCE, SIZES = ("importance", 0.1), ("size_map", 1e-2)
"""Fields, and the least number of theirs by the largest."""
ON_OUTLINE = 1e-3  # of the diagonal: what is this close to the outline is on it, where constraints are met
OTHERS = dict.fromkeys(
    (
        *(
            "order",
            "quasi",
            "smoothness",
            "vertices",
            "samples_per_edge",
            "max_iterations",
            "decrease",
        ),
        *("pin_weight", "stroke_weight"),
    ),
    "conformal or paper",
)
"""Options that the balanced method does not have, and whose they are."""
TOLERANCE = 1e-3
"""Of the diagonal: how far the image of the boundary may be from the target, unless another number is given."""
FREE = ("vertices", "consistency")  # that `literal` does not leave
OWN = (
    "balance",
    "turn",
    "fit",
    "place",
    "holes",
    "max_left_out",
    "max_uncovered",
    "effort",
    "max_dilatation",
    "max_stretch",
    "rigid_size",
    "terms",
)
"""Options that it alone has."""
PLACES = ("fill", "inside", "slice")
HOLES = ("auto", "keep")


class OptionValues(TypedDict, total=False):
    """The attributes of `Options` as keyword arguments, for type checkers."""

    method: str | None
    balance: float
    turn: float | Literal["any"] | None
    fit: str
    place: str
    holes: str
    max_left_out: float
    max_uncovered: float
    effort: int
    max_dilatation: float | None
    max_stretch: float | None
    rigid_size: float | Literal["free"] | None
    terms: Sequence[object]
    order: int | None
    quasi: float | None
    pin_weight: float
    stroke_weight: float
    smoothness: float
    consistency: float | None
    tangential: float
    literal: bool
    vertices: int | str | None
    samples_per_edge: int | None
    max_iterations: int
    decrease: float | None
    threshold: float
    tolerance: float


@dataclass(frozen=True)
class Options:
    """Options of the solver. Weights are relative to the closeness of the boundary, lengths to the radius of a shape.

    Attributes:
        method: "balanced" (default: uniform scale, no folds, the outline is met), "conformal" (angles are kept exactly)
            or "paper" (Algorithm 1 as published).
        balance: θ of the balanced method: 0 keeps only angles (the conformal method), 1 balances angles and areas,
            larger values keep areas.
        turn: desired rotation in degrees counter-clockwise (balanced); "any" leaves it to the shapes; None is 0, or the
            rotation given by two pins or strokes. A note reports a contradiction between them.
        fit: "whole", outline onto outline with all concavities; "contain", all of the source is shown, and the target
            may stay bare where concavities of the source open; "cover", the target is covered, and parts of the source
            beyond its concavities are hidden; "frame", for whole drawings, a region around all parts of one onto a
            region around the other; "auto", the cheapest of these (whole with pins, strokes, bounds, surfaces and a
            balance above 1).
        place: "fill", the source takes the form of the target; "inside", it keeps its proportions and is as large as
            fits inside the target; "slice", it keeps its proportions and covers the target, and the rest is cut off.
        holes: "keep", all are mapped onto each other or shrink to slits; "auto", partial maps may ignore some, if that
            costs less.
        max_left_out: largest share of the source's area that may be hidden.
        max_uncovered: largest share of the target's area that may stay bare.
        effort: factor for the number of correspondences of the outlines that are tried, 1 to 16.
        max_dilatation: upper bound for s1/s2 (balanced).
        max_stretch: upper bound for max(s1, 1/s2), relative to the mean scale (balanced).
        rigid_size: size of rigid regions relative to the mean scale; "free" for the size that distorts the rest least;
            None for the mean scale, or as large as there is room.
        terms: additional terms of the balanced energy, instances of subclasses of `iccm.balanced.Term`.
        order: 0 for the distance to closest points, 1 for the first-order distance of §3.4.
        quasi: None for a conformal map, else the weight of E_q.
        pin_weight: β of §3.1.
        stroke_weight: γ of §3.3.
        smoothness: α of §3.3.
        consistency: μ of the consistency energy.
        tangential: λ of §3.4, with order 1.
        literal: follow the paper exactly: the source's own vertices, samples there (with samples_per_edge also between
            them, the vertex being the first of its edge), energies as sums over samples in the given coordinates,
            Eq. 13 as written, full steps. Otherwise vertices are evenly spaced, and energies are means over the
            boundary, so that weights depend neither on the number of samples nor on the size of the shapes; a step of
            first order is halved until the energy decreases.
        vertices: number of vertices of the source polygon; "source" for exactly those of the outline; None chooses.
        samples_per_edge: number of boundary samples per source edge, at the middles of equal parts; None is 4.
        max_iterations: largest number of local and global steps.
        decrease: stop when a step lowers the energy by less than this share; None is 1e-4, and 2e-3 for the constraints
            of the conformal method.
        threshold: stop when the energy is below this value.
        tolerance: boundary gap to reach, relative to the diagonal of the target (conformal).
    """

    method: str | None = None
    balance: float = 1.0
    turn: float | Literal["any"] | None = None
    fit: str = "auto"
    place: str = "fill"
    holes: str = "auto"
    max_left_out: float = 1.0
    max_uncovered: float = 1.0
    effort: int = 1
    max_dilatation: float | None = None
    max_stretch: float | None = None
    rigid_size: float | Literal["free"] | None = None
    terms: Sequence[object] = ()
    order: int | None = None
    quasi: float | None = None
    pin_weight: float = 1.0
    stroke_weight: float = 1.0
    smoothness: float = 0.0
    consistency: float | None = None
    tangential: float = 0.05
    literal: bool = False
    vertices: int | str | None = None
    samples_per_edge: int | None = None
    max_iterations: int = 300
    decrease: float | None = None
    threshold: float = 1e-16
    tolerance: float = TOLERANCE

    def __post_init__(self):
        """Reject values outside their range."""
        if self.method not in (None, *METHODS):
            raise InputError(f"method: {self.method!r} is not one of {', '.join(METHODS)}")
        if isinstance(self.turn, str) and self.turn != "any":
            raise InputError(f"turn: {self.turn!r} is no angle in degrees, nor any")
        if self.order not in (None, 0, 1):
            raise InputError(f"order: {self.order!r} is not 0 or 1")
        for f in fields(self):
            value = getattr(self, f.name)
            least = -np.inf if f.name == "turn" else 0
            if isinstance(value, float | int) and not (np.isfinite(value) and value >= least):
                raise InputError(f"{f.name}: {value} is not a finite number of at least 0")
        if self.literal and self.method != "paper":
            raise InputError("literal: an option of --method paper")
        if self.literal and (free := self._given(FREE)):
            raise InputError(f"{free[0]}: literal takes it as the paper has it; leave one of the two out")
        for name, words in (("fit", tuple(FITS)), ("place", PLACES), ("holes", HOLES)):
            if getattr(self, name) not in words:
                raise InputError(f"{name}: {getattr(self, name)!r} is not one of {', '.join(words)}")
        if self.place != "fill" and (
            others := self._given(("fit", "holes", "max_left_out", "max_uncovered"))
        ):
            raise InputError(
                f"{others[0]}: place {self.place} keeps the drawing's proportions, so no fits are compared; "
                "leave one of the two out"
            )
        if max(self.max_left_out, self.max_uncovered) > 1:
            raise InputError("max_left_out, max_uncovered: are shares of the area, at most 1")
        if not 1 <= self.effort <= MOST_EFFORT:
            raise InputError(f"effort: {self.effort} is not between 1 and {MOST_EFFORT}")
        if isinstance(self.rigid_size, str) and self.rigid_size != "free":
            raise InputError(f"rigid_size: {self.rigid_size!r} is no factor, nor free")
        if self.rigid_size == 0:
            raise InputError("rigid_size: is a factor above 0")
        if isinstance(self.vertices, str):
            if self.vertices != "source":
                raise InputError(f"vertices: {self.vertices!r} is neither a number nor 'source'")
        elif self.vertices is not None and not 3 <= self.vertices <= MOST_VERTICES:
            raise InputError(f"vertices: {self.vertices} is not between 3 and {MOST_VERTICES}")
        for name in ("max_dilatation", "max_stretch"):
            bound = getattr(self, name)
            if bound is not None and bound < 1:
                raise InputError(f"{name}: {bound:g} is below 1, which no map can have")
        self._refuse_others()
        if self.tolerance == 0:
            raise InputError("tolerance: 0 cannot be reached; give a number above")
        if not (self.samples_per_edge != 0 and self.max_iterations >= 1 and 0 < self.tangential <= 1):
            raise InputError(
                "samples_per_edge and max_iterations must be at least 1, tangential above 0 and at most 1"
            )

    @property
    def is_balanced(self) -> bool:
        """Whether the balanced method solves, which meets pins and strokes instead of weighing them."""
        balanced = self.method == "balanced" or not (self.method or self._given(OTHERS))
        return balanced and self.balance != 0

    @property
    def switched_by(self) -> str:
        """The option that makes another method than the default one solve, where none was named; else nothing."""
        others = self._given(OTHERS)
        return others[0] if others and self.method is None else ""

    def _given(self, names: Iterable[str]) -> list[str]:
        """Those of the options that are not as they are by default."""
        return [name for name in names if getattr(self, name) != getattr(Options, name)]

    def _refuse_others(self) -> None:
        """Reject options that the method does not have, so that none is without effect."""
        others = self._given(OTHERS)
        if self.method == "balanced" and others:
            raise InputError(f"{others[0]}: an option of --method {OTHERS[others[0]]}, not of balanced")
        own = [name for name in self._given(OWN) if self.balance or name != "balance"]
        if own and not self.is_balanced:
            asked = others[0] if others else "balance 0"
            other = (
                self.method
                if self.method != "balanced" and self.method
                else f"conformal, which {asked} asks for"
            )
            raise InputError(f"{own[0]}: an option of --method balanced, not of {other}")


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

    @classmethod
    def of(
        cls, source, target, pins=None, strokes=None, *, first: bool = True, holes=((), ()), partners=(),
        reach: float = NEAR, rigid=(), rigid_target=(), importance=None, size_map=None, pins_inside: bool = False
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
        fields = [
            _field(given, source.box, *of) for given, of in ((importance, IMPORTANCE), (size_map, SIZES))
        ]
        given = inner[0], inner[1], known, kept, kept_there
        kept_as_given = AsGiven(outlines[0], outlines[1], pins, pairs)
        importance_field, size_field = fields
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
