"""Pins: points of the source with their places in the target, soft or exact.

A soft pin pulls a patch around its point to its place: the patch keeps its shape, and may miss the place a
little if that saves distortion. An exact pin takes one point to its place, whatever distortion that causes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .arrays import Complex, Flags, Index, Real
from .curve import Curve
from .errors import InputError

RADIUS_SHARE = 0.15
"""Radius of a pin with enough room, relative to the square root of the shape's area; with it, a mouth keeps its
shape.
"""
MOST_TOLERANCES = 3.0
"""Distance from its place, in tolerances, up to which a pin with automatic tolerance counts as met. A smaller
limit would distort faces.
"""
RADIUS_PIN_DISTANCES = 0.8
"""Radius relative to the distance to the closest other pin, so that the cores of patches, with half the radius,
do not overlap.
"""
RADIUS_OUTLINE_DISTANCES = 1.2
"""Radius relative to the distance to the outline, so that cores do not reach it."""
TOLERANCE_SHARE, FREE_TOLERANCE_SHARE = 0.07, 0.01
"""Tolerance of a pin relative to the square root of the target's area, and to that of a shape that is deformed
without a target. It is smaller for the latter, where only pins determine the result.
"""


@dataclass(frozen=True)
class Pin:
    """A point of the source and its place in the target.

    Attributes:
        source: the point: complex x + iy with y up, or a pair by the `axes` of `iccm.fit`.
        target: its place, in the same form.
        radius: radius of the patch around it that keeps its shape, in the source's units; 0 for an exact pin;
            None chooses.
        tolerance: largest distance of the patch from its place, in the target's units; the patch misses it by
            this if that saves a twentieth of the distortion. None is 7 % of the target's size (the square root
            of its area), with at most three times as much; in `iccm.deform` 1 %.
        turn: rotation of the patch in degrees, counter-clockwise; None leaves it free.
        scale: scale of the patch, relative to the mean scale of the map; None leaves it free.

    Examples:
        >>> import numpy as np, iccm
        >>> square = np.array([[0, 0], [2, 0], [2, 1], [0, 1]])
        >>> eye = iccm.Pin(source=(0.5, 0.5), target=(0.7, 0.5), radius=0.1)
        >>> found = iccm.fit(square, square, pins=[eye])
        >>> bool(abs(found.map(0.5 + 0.5j) - (0.7 + 0.5j)) < 0.05)
        True
    """

    source: Any
    target: Any
    radius: float | None = None
    tolerance: float | None = None
    turn: float | None = None
    scale: float | None = None

    def __post_init__(self):
        """Reject values out of range."""
        for name, least_allowed in (("radius", True), ("tolerance", False), ("scale", False)):
            value = getattr(self, name)
            if value is not None and not (
                np.isfinite(value) and (value > 0 or (least_allowed and value == 0))
            ):
                raise InputError(
                    f"pin: {name} {value} is not a number {'of at least' if least_allowed else 'above'} 0"
                )
        if self.turn is not None and not np.isfinite(self.turn):
            raise InputError(f"pin: turn {self.turn} is not an angle in degrees")


@dataclass(frozen=True)
class Stroke:
    """A polyline of the source, and the one on which its image lies.

    Attributes:
        source: the polyline: complex points x + iy with y up, or pairs by the `axes` of `iccm.fit`.
        target: the target polyline, in the same form.
        width: width of the band around it that keeps its shape, in the source's units; 0 for none.

    Examples:
        >>> import numpy as np, iccm
        >>> square = np.array([[0, 0], [2, 0], [2, 1], [0, 1]])
        >>> mouth = iccm.Stroke([[0.5, 0.4], [1, 0.3], [1.5, 0.4]], [[0.6, 0.4], [1, 0.5], [1.4, 0.4]], width=0.2)
        >>> iccm.fit(square, square, strokes=[mouth]).status.ok
        True
    """

    source: Any
    target: Any
    width: float = 0.0

    def __post_init__(self):
        """Reject values out of range."""
        if not (np.isfinite(self.width) and self.width >= 0):
            raise InputError(f"stroke: width {self.width} is not a number of at least 0")


@dataclass(frozen=True, eq=False)
class Softness:
    """The softness of pins (k,): radii, tolerances, and requested rotations and scales; NaN where iccm chooses.

    Attributes:
        radii: (k,) radii in the source's units; 0 for exact pins.
        tolerances: (k,) in the target's units.
        rotations: (k,) radians.
        scales: (k,) factors relative to the mean scale.
        limits: (k,) distances from their places, in the target's units, beyond which pins count as not met.
    """

    radii: Real
    tolerances: Real
    rotations: Real
    scales: Real
    limits: Real

    @classmethod
    def of(cls, pins: Sequence[Pin]) -> "Softness":
        """Return the softness of pins."""

        def values(name: str) -> Real:
            values = [getattr(pin, name) for pin in pins]
            return np.array([np.nan if value is None else value for value in values], float)

        tolerances = values("tolerance")
        return cls(
            values("radius"), tolerances, np.radians(values("turn")), values("scale"), limits=tolerances
        )

    @classmethod
    def free(cls, count: int) -> "Softness":
        """Return the softness of pins for which iccm chooses everything."""
        return cls.of([Pin(0, 0)] * count)

    @classmethod
    def exact(cls, count: int) -> "Softness":
        """Return the softness of exact pins."""
        return cls.of([Pin(0, 0, radius=0)] * count)

    def of_pins(self, selection: Index | Flags) -> "Softness":
        """Return the softness of some of the pins."""
        return Softness(**{name: values[selection] for name, values in vars(self).items()})

    def with_pins(self, selection: Index, other: "Softness") -> "Softness":
        """Return the softness with the values of some of the pins (j,) replaced by those of `other` (j,)."""
        replaced = {name: values.copy() for name, values in vars(self).items()}
        for name, values in replaced.items():
            values[selection] = getattr(other, name)
        return Softness(**replaced)

    @classmethod
    def joined(cls, several: Sequence["Softness"]) -> "Softness":
        """Return the softness of the pins of several maps, one after another."""
        return cls(
            **{name: np.concatenate([vars(each)[name] for each in several]) for name in vars(several[0])}
        )

    def as_lists(self) -> dict[str, list[float | None]]:
        """Return the arrays as lists for JSON, with None for NaN."""
        return {
            name: [None if np.isnan(value) else float(value) for value in values]
            for name, values in vars(self).items()
        }

    @classmethod
    def from_lists(cls, lists: Any) -> "Softness | None":
        """Return the softness that `as_lists` wrote; None if it is something else."""
        names = {field.name for field in fields(cls)}
        if not isinstance(lists, dict) or set(lists) != names:
            return None
        try:
            arrays = {name: np.array(values, np.float64) for name, values in lists.items()}
        except (TypeError, ValueError):
            return None
        counts = {values.shape for values in arrays.values()}
        return cls(**arrays) if len(counts) == 1 and arrays["radii"].ndim == 1 else None

    @property
    def is_soft(self) -> Flags:
        """Whether a pin may miss its place; shape (k,)."""
        return self.radii != 0

    @property
    def is_given(self) -> Flags:
        """Whether any property other than exactness is given; shape (k,)."""
        return ~np.isnan(self.tolerances) | (self.radii > 0) | self.has_derivative

    @property
    def has_derivative(self) -> Flags:
        """Whether the rotation or the scale of a patch is given; shape (k,)."""
        return ~np.isnan(self.rotations) | ~np.isnan(self.scales)


def choose_radii(
    source: Curve,
    target: Curve | None,
    holes: tuple[Sequence[Curve], Sequence[Curve]],
    pins: Complex,
) -> Real:
    """Return radii (k,) for pins (k, 2), in the source's units.

    They are the largest that are at most RADIUS_SHARE of the size (the square root of the area),
    RADIUS_PIN_DISTANCES of the distance to the closest other pin, and RADIUS_OUTLINE_DISTANCES of the distance to the
    outlines, in the source and in the target relative to their sizes. Without a target the source is deformed;
    then its outlines are free, and places may coincide.
    """
    radii = np.full(len(pins), RADIUS_SHARE)
    sides = [(source, holes[0], pins[:, 0])]
    if target is not None:
        sides.append((target, holes[1], pins[:, 1]))
    for curve, rims, points in sides:
        size = size_of(curve, rims)
        if target is not None:
            for rim in (curve, *rims):
                radii = np.minimum(radii, RADIUS_OUTLINE_DISTANCES * rim.distances(points) / size)
        apart = np.abs(points[:, None] - points) / size
        np.fill_diagonal(apart, np.inf)
        radii = np.minimum(radii, RADIUS_PIN_DISTANCES * apart.min(axis=1, initial=np.inf))
    return radii * size_of(source, holes[0])


def size_of(outline: Curve, rims: Sequence[Curve]) -> float:
    """Return the square root of the area of a domain with holes."""
    return float(np.sqrt(abs(outline.area) - sum(abs(rim.area) for rim in rims)))
