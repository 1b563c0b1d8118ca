"""The domains and constraints of a solve, checked, in the user's coordinates."""

import math
from collections.abc import Sequence, Sized
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Box, Complex, as_complex
from .curve import Curve
from .errors import InputError
from .maps.fields import Field
from .pins import Softness
from .plane import bounding_box

NEAR_SHARE = 1e-6  # relative to the diagonal: due to rounding
ON_OUTLINE_SHARE = 1e-3
"""Relative to the diagonal: points this close to the outline are on it, if constraints are hard."""
LEAST_IMPORTANCE, LEAST_SIZE = 0.1, 1e-2
"""Relative to the largest value of the field: smaller values are raised to this, since energies are divided by
them.
"""


@dataclass(frozen=True, eq=False)
class Problem:
    """The domains and constraints of a solve, with the exact coordinates that were given.

    Each method normalises the coordinates once, in a separate frame (`paper.normalised`,
    `balanced.model.frames`).

    Attributes:
        source: outline of the source, a domain.
        target: outline of the target; None for a deformation.
        pins: (k, 2) points of the source and their images.
        strokes: polylines in the source and their images.
        source_holes: outlines of the source's holes, clockwise.
        target_holes: those of the target's.
        hole_partners: (i, j) if hole i of the source is to be mapped to hole j of the target.
        rigid: outlines of rigid regions of the source.
        rigid_target: those of the target.
        importance: weight of distortion, over the source.
        size_map: desired scale of the source's parts, relative to each other.
        softness: of the pins.
        stroke_widths: for each stroke, the width of the band around it that keeps its shape; 0 for none.
    """

    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    source_holes: tuple[Curve, ...] = ()
    target_holes: tuple[Curve, ...] = ()
    hole_partners: tuple[tuple[int, int], ...] = ()
    rigid: tuple[Complex, ...] = ()
    rigid_target: tuple[Complex, ...] = ()
    importance: Field | None = None
    size_map: Field | None = None
    softness: Softness = field(default_factory=lambda: Softness.free(0))
    stroke_widths: Sequence[float] = ()

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
        reach: float = NEAR_SHARE,
        rigid=(),
        rigid_target=(),
        importance=None,
        size_map=None,
        pins_inside: bool = False,
        softness: Softness | None = None,
        stroke_widths: Sequence[float] = (),
    ) -> "Problem":
        """Check the user's input (see `iccm.fit`) and return the problem.

        Args:
            source, target, pins, strokes: see `iccm.fit`.
            holes: of the source and of the target.
            partners: see `hole_partners`.
            reach: how far outside constraints may be, relative to the diagonal.
            rigid, rigid_target, importance, size_map: see `iccm.fit`.
            pins_inside: whether to reject pins whose target is outside the shape; methods that weight pins
                would not notice.
            softness: of the pins; None leaves it to the method.
            stroke_widths: for each stroke; empty for none.

        Raises:
            InputError: an outline is not a simple polygon, or a constraint is not inside the shapes.
        """
        source = as_domain(source, "source")
        target = None if target is None else as_domain(target, "target")
        source_holes = _holes(source, holes[0], "source")
        target_holes = _holes(target, holes[1], "target")
        pins = as_pins(pins)
        _refuse_outside(source, pins[:, 0], "pin", reach)
        if target is not None and pins_inside:
            _refuse_outside(target, pins[:, 1], "target of pin", reach, "target")
        pairs = [as_strokes(k, pair) for k, pair in enumerate(strokes or [])]
        for stroke, _ in pairs:
            _refuse_outside(source, stroke.z, "source stroke vertex", reach)
        return cls(
            source,
            target,
            pins,
            pairs,
            source_holes=source_holes,
            target_holes=target_holes,
            hole_partners=_partners(partners, (source_holes, target_holes)),
            rigid=_regions(rigid),
            rigid_target=_regions(rigid_target),
            importance=_field(importance, source.box, "importance", LEAST_IMPORTANCE),
            size_map=_field(size_map, source.box, "size_map", LEAST_SIZE),
            softness=Softness.free(len(pins)) if softness is None else softness,
            stroke_widths=tuple(stroke_widths) or (0.0,) * len(pairs),
        )

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


def _holes(outer: Curve | None, holes, name: str) -> tuple[Curve, ...]:
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
