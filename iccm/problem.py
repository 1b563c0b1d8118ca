"""The domains and constraints of a solve, checked, in the user's coordinates."""

import math
from collections.abc import Sequence, Sized
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Box, Complex, Index, as_complex
from .curve import Curve
from .errors import InputError
from .maps.fields import Field
from .pins import Softness
from .plane import bounding_box, stretched

NEAR_SHARE = 1e-6  # relative to the diagonal: due to rounding
ON_OUTLINE_SHARE = 1e-3
"""Relative to the diagonal: points this close to the outline are on it, if constraints are hard."""
LEAST_IMPORTANCE, LEAST_SIZE = 0.1, 1e-2
"""Relative to the largest value of the field: smaller values are raised to this, since energies are divided by
them.
"""


class Holes(NamedTuple):
    """The holes of two domains.

    Attributes:
        source: outlines of the source's holes, clockwise.
        target: those of the target's.
        partners: (i, j) if hole i of the source is to be mapped to hole j of the target.
    """

    source: tuple[Curve, ...] = ()
    target: tuple[Curve, ...] = ()
    partners: tuple[tuple[int, int], ...] = ()

    @property
    def sides(self) -> tuple[tuple[Curve, ...], tuple[Curve, ...]]:
        """The holes of source and target."""
        return self.source, self.target

    def inverse(self) -> "Holes":
        """Return the holes for the inverse map."""
        return Holes(self.target, self.source, tuple((j, i) for i, j in self.partners))


NO_HOLES = Holes()


@dataclass(frozen=True, eq=False)
class Problem:
    """The domains and constraints of a solve, with the exact coordinates that were given.

    Each method normalises the coordinates (`paper.normalised`,
    `balanced.model.unit_coordinates`).

    Attributes:
        source: outline of the source, a domain.
        target: outline of the target; None for a deformation.
        pins: (k, 2) points of the source and their images.
        strokes: polylines in the source and their images.
        holes: of both domains.
        rigid: outlines of rigid regions of the source.
        rigid_target: those of the target.
        importance: weight of distortion, over the source.
        size_map: desired scale of the source's parts, relative to each other.
        softness: of the pins.
        stroke_widths: for each stroke, the width of the band around it that keeps its shape; 0 for none.
        pin_numbers: (k,) numbers of the pins for messages; None for consecutive ones.
    """

    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    holes: Holes = NO_HOLES
    rigid: tuple[Complex, ...] = ()
    rigid_target: tuple[Complex, ...] = ()
    importance: Field | None = None
    size_map: Field | None = None
    softness: Softness = field(default_factory=lambda: Softness.free(0))
    stroke_widths: Sequence[float] = ()
    pin_numbers: Index | None = None

    @classmethod
    def of(
        cls,
        source,
        target,
        pins=None,
        strokes=None,
        *,
        holes=((), ()),
        partners=(),
        rigid=(),
        rigid_target=(),
        importance=None,
        size_map=None,
        softness: Softness | None = None,
        stroke_widths: Sequence[float] = (),
    ) -> "Problem":
        """Check the user's input (see `iccm.fit`) and return the problem.

        Args:
            source, target, pins, strokes: see `iccm.fit`.
            holes: of the source and of the target.
            partners: of these holes, see `Holes`.
            rigid, rigid_target, importance, size_map: see `iccm.fit`.
            softness: of the pins; None leaves it to the method.
            stroke_widths: for each stroke; empty for none.

        Raises:
            InputError: an outline is not a simple polygon, or a constraint is not valid. Whether constraints are inside
                the shapes is checked by `refuse_outside`.
        """
        source = as_domain(source, "source")
        target = None if target is None else as_domain(target, "target")
        pins = as_pins(pins)
        pairs = [as_strokes(k, pair) for k, pair in enumerate(strokes or [])]
        return cls(
            source,
            target,
            pins,
            pairs,
            holes=Holes(
                as_holes(source, holes[0], "source"),
                as_holes(target, holes[1], "target"),
                tuple((int(i), int(j)) for i, j in partners),
            ),
            rigid=_regions(rigid),
            rigid_target=_regions(rigid_target),
            importance=_field(importance, source.box, "importance", LEAST_IMPORTANCE),
            size_map=_field(size_map, source.box, "size_map", LEAST_SIZE),
            softness=Softness.free(len(pins)) if softness is None else softness,
            stroke_widths=tuple(stroke_widths) or (0.0,) * len(pairs),
        )

    def refuse_outside(self, reach: float, *, pins_inside: bool = False) -> None:
        """Raise an error for constraints outside the source.

        Args:
            reach: how far outside constraints may be, relative to the diagonal.
            pins_inside: whether to reject pins whose target is outside the shape; methods that weight pins
                would not notice.

        Raises:
            InputError: a constraint is not inside the shapes.
        """
        _refuse_outside(self.source, self.pins[:, 0], "pin", reach)
        if self.target is not None and pins_inside:
            _refuse_outside(self.target, self.pins[:, 1], "target of pin", reach, "target")
        for stroke, _ in self.strokes:
            _refuse_outside(self.source, stroke.z, "source stroke vertex", reach)

    def between(
        self,
        outlines: tuple[Curve, Curve] | None = None,
        holes: tuple[Sequence[Complex | Curve], Sequence[Complex | Curve]] = ((), ()),
    ) -> "Problem":
        """Return the problem between other outlines of the same shapes, such as frames around them, with holes.

        Args:
            outlines: of source and target; those that the problem has by default.
            holes: outlines of holes of both. Without any, no partners are prescribed.

        Raises:
            InputError: a hole does not lie inside its outline, or partners are not holes.
        """
        source, target = outlines or (self.source, self.target)
        assert target is not None
        source, target = as_domain(source, "source"), as_domain(target, "target")
        sides = as_holes(source, holes[0], "source"), as_holes(target, holes[1], "target")
        partners = _partners(self.holes.partners, sides) if any(sides) else ()
        return replace(self, source=source, target=target, holes=Holes(*sides, partners))

    def inverse(self) -> "Problem":
        """Return the problem of the inverse map, without the fields, which are given over the source.

        There has to be a target.
        """
        assert self.target is not None
        return replace(
            self,
            source=self.target,
            target=self.source,
            pins=np.ascontiguousarray(self.pins[:, ::-1]),
            strokes=[(image, stroke) for stroke, image in self.strokes],
            holes=self.holes.inverse(),
            rigid=self.rigid_target,
            rigid_target=self.rigid,
            importance=None,
            size_map=None,
        )

    def stretched(self, ratio: float) -> "Problem":
        """Return the problem of a source whose width is stretched by a ratio relative to its height, areas kept.

        It may have pins, but no constraint that is given for the outlines (see `refers_to_outlines`), and no holes.
        """
        source = Curve(stretched(self.source.z, ratio))
        pins = np.stack([stretched(self.pins[:, 0], ratio), self.pins[:, 1]], axis=1)
        return replace(self, source=source, pins=pins)

    def without_pins(self) -> "Problem":
        """Return the problem without its pins."""
        return replace(self, pins=as_pins(None), softness=Softness.free(0))

    @property
    def ends(self) -> Complex:
        """Points and their images: the pins, and the ends of strokes; shape (k, 2)."""
        ends = [(a.z[k], b.z[k]) for a, b in self.strokes for k in (0, -1)]
        return np.concatenate([self.pins, np.reshape(np.array(ends, complex), (-1, 2))])

    @property
    def refers_to_outlines(self) -> bool:
        """Whether there are constraints that are given for the outlines of the shapes: all but pins."""
        fields = self.importance is not None or self.size_map is not None
        return fields or any(map(len, (self.strokes, self.rigid, self.rigid_target, self.holes.partners)))

    @property
    def outlines(self) -> tuple[Curve, Curve]:
        """Source and target started at canonical vertices, so that results do not depend on the first one.

        There has to be a target.
        """
        assert self.target is not None
        return from_known(self.source), from_known(self.target)


def as_domain(shape: "Curve | ArrayLike", name: str) -> Curve:
    """Return a validated domain from a Curve or an array of vertices."""
    return Curve.domain(shape.z if isinstance(shape, Curve) else shape, name)


def from_known(curve: Curve) -> Curve:
    """Return the closed curve started at a canonical vertex, which does not depend on the given first one.

    It is the vertex closest to the vertices' mean; ties go to the leftmost, then the lowest.
    """
    base = bounding_box(curve.z)[0]
    away = curve.z - base
    mean = complex(math.fsum(away.real), math.fsum(away.imag)) / away.size
    distance = np.abs(away - mean)
    ties = np.flatnonzero(distance < distance.min() + 1e-9 * distance.max())
    first = ties[np.lexsort((curve.z.imag[ties], curve.z.real[ties]))[0]]
    return Curve(np.roll(curve.z, -int(first)))


def as_holes(outer: Curve | None, holes, name: str) -> tuple[Curve, ...]:
    """Return the outlines of holes, clockwise, started at canonical vertices.

    Raises:
        InputError: a hole is not a simple polygon, not inside the outline, or not disjoint from the others.
    """
    outlines: list[Curve] = []
    rings = [outer.polygon] if outer else []
    for k, hole in enumerate(holes):
        curve = from_known(as_domain(hole, f"{name} hole {k + 1}"))
        ring = curve.polygon
        if not rings[0].contains_properly(ring):
            raise InputError(f"{name} hole {k + 1}: crosses or touches the outline, or lies outside it")
        touched = [j for j, other in enumerate(rings[1:]) if ring.intersects(other)]
        if touched:
            raise InputError(f"{name} hole {k + 1}: crosses, touches or contains hole {touched[0] + 1}")
        rings.append(ring)
        outlines.append(curve.reversed())
    return tuple(outlines)


def _field(numbers, box: Box, name: str, least: float) -> Field | None:
    """Return the field of a picture (h, w) over the source's bounding box, or of a picture with a given box."""
    if numbers is None or isinstance(numbers, Field):
        return numbers
    if isinstance(numbers, tuple) and len(numbers) == 2 and np.ndim(numbers[0]) == 2:
        numbers, corners = numbers
        low, high = as_complex(corners, name)
        box = complex(low), complex(high)
        if not (np.isfinite(corners).all() and high.real > low.real and high.imag > low.imag):
            raise InputError(
                f"{name}: {corners!r} is not a box; give its lower left and upper right corner as x + iy"
            )
    return Field.of(numbers, box, least, name)


def _regions(regions) -> tuple[Complex, ...]:
    """Check and return the outlines of rigid regions."""
    return tuple(as_domain(region, f"rigid region {k + 1}").z for k, region in enumerate(regions))


def _partners(partners, holes: Sequence[tuple[Curve, ...]]) -> tuple[tuple[int, int], ...]:
    pairs = tuple((int(i), int(j)) for i, j in partners)
    for k, (side, name) in enumerate(zip(zip(*pairs), ("source", "target"))):
        if len(set(side)) < len(side) or not all(0 <= i < len(holes[k]) for i in side):
            raise InputError(f"hole_partners: {list(side)} are not different holes of the {name}")
    return pairs


def as_strokes(k: int, pair) -> tuple[Curve, Curve]:
    """Return pair number k of strokes, source and target, as curves.

    Raises:
        InputError: it is not a pair of polylines.
    """
    if not hasattr(pair, "__len__") or len(pair) != 2:
        raise InputError(f"strokes: item {k + 1} is not a pair of polylines, source and target")
    return _stroke(pair[0], "source stroke"), _stroke(pair[1], "target stroke")


def _stroke(shape, name: str) -> Curve:
    return Curve.stroke(shape.z if isinstance(shape, Curve) else shape, name)


def as_pins(pins: ArrayLike | Sequence | None) -> Complex:
    """Return pins as (k, 2) complex numbers, source and target.

    Raises:
        InputError: they are not pairs of finite points.
    """
    if pins is None or (isinstance(pins, Sized) and not len(pins)):
        return np.empty((0, 2), dtype=np.complex128)
    array = as_complex(pins, "pins", 2)
    if not np.isfinite(array).all():
        raise InputError("pins: some coordinates are not finite numbers")
    return array


def _refuse_outside(shape: Curve, z: Complex, kind: str, reach: float, side: str = "source") -> None:
    """Raise an InputError unless every point is inside a shape or on its boundary."""
    if not z.size:
        return
    gap = shape.distances(z)
    outside = np.flatnonzero(~shape.contains(z) & (gap > reach * shape.diagonal))
    if outside.size:
        k = outside[0]
        raise InputError(
            f"{kind} {k + 1}: ({z[k].real:g}, {z[k].imag:g}) is {gap[k]:.3g} outside the {side} shape; "
            "move it inside"
        )
