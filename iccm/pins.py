"""Pins: points of the source with their places in the target, soft or exact.

A soft pin draws a patch around its point to its place: the patch keeps its form, and may miss the place a little where
that saves distortion. An exact pin takes one point to its place, whatever that costs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .arrays import Complex, Flags, Index, Real
from .curve import Curve
from .errors import InputError

RADIUS_SHARE = 0.15
"""Of the square root of the shape's area: the radius of a pin that has room, so that a mouth keeps its form."""
MOST_TOLERANCES = 3.0
"""By which a pin may miss its place whose tolerance was chosen: closer to it, faces would lose their form."""
RADIUS_BETWEEN_PINS = 0.8
"""Of the distance to the closest other pin: the cores of patches, of half the radius, do not overlap."""
RADIUS_TO_OUTLINE = 1.2
"""Of the distance to the outline: cores do not reach it."""
TOLERANCE_SHARE, FREE_TOLERANCE_SHARE = 0.07, 0.01
"""Of the square root of the target's area, and of that of a shape that is deformed without a target: the tolerance of a
pin. Without a target nothing else says where a shape goes."""


@dataclass(frozen=True)
class Pin:
    """A point of the source and its place in the target.

    Attributes:
        source: the point: complex x + iy with y up, or a pair by the `axes` of `iccm.fit`.
        target: its place, in the same form.
        radius: of the patch around it that keeps its form, in the source's units; 0 for an exact pin; None chooses.
        tolerance: how far the patch may miss its place where that saves a twentieth of the distortion, in the target's
            units, and at most. None is 7 % of the target's size (the square root of its area), and at most three times
            as much; in `iccm.deform` 1 %.
        turn: degrees, counter-clockwise, by which the patch is rotated; None leaves it free.
        scale: factor by which the patch is enlarged, relative to the mean scale of the map; None leaves it free.

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
    """A polyline of the source and the one that its image lies on.

    Attributes:
        source: the polyline: complex points x + iy with y up, or pairs by the `axes` of `iccm.fit`.
        target: the other, in the same form.
        width: of the band around it that keeps its form, in the source's units; 0 for none.

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
    """How pins (k,) hold what is around them; NaN where that is left to iccm.

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
        """Return that of pins."""

        def values(name: str) -> Real:
            given = [getattr(pin, name) for pin in pins]
            return np.array([np.nan if value is None else value for value in given], float)

        tolerances = values("tolerance")
        return cls(
            values("radius"), tolerances, np.radians(values("turn")), values("scale"), limits=tolerances
        )

    @classmethod
    def free(cls, count: int) -> "Softness":
        """Return that of pins of which nothing is said."""
        return cls.of([Pin(0, 0)] * count)

    @classmethod
    def exact(cls, count: int) -> "Softness":
        """Return that of pins that are met exactly."""
        return cls.of([Pin(0, 0, radius=0)] * count)

    def of_pins(self, which: Index | Flags) -> "Softness":
        """Return that of some of the pins."""
        return Softness(**{name: values[which] for name, values in vars(self).items()})

    def with_pins(self, which: Index, other: "Softness") -> "Softness":
        """Return the same with some of the pins (j,) as in `other` (j,)."""
        found = {name: values.copy() for name, values in vars(self).items()}
        for name, values in found.items():
            values[which] = getattr(other, name)
        return Softness(**found)

    def as_lists(self) -> dict[str, list[float | None]]:
        """Return the arrays for JSON, which has no NaN."""
        return {
            name: [None if np.isnan(value) else float(value) for value in values]
            for name, values in vars(self).items()
        }

    @classmethod
    def from_lists(cls, lists: Any) -> "Softness | None":
        """Return what `as_lists` has written; None if it is something else."""
        names = {field.name for field in fields(cls)}
        if not isinstance(lists, dict) or set(lists) != names:
            return None
        try:
            found = {name: np.array(values, np.float64) for name, values in lists.items()}
        except (TypeError, ValueError):
            return None
        counts = {values.shape for values in found.values()}
        return cls(**found) if len(counts) == 1 and found["radii"].ndim == 1 else None

    @property
    def is_soft(self) -> Flags:
        """(k,) whether a pin may miss its place."""
        return self.radii != 0

    @property
    def is_given(self) -> Flags:
        """(k,) whether anything but exactness is said of a pin."""
        return ~np.isnan(self.tolerances) | (self.radii > 0) | self.has_derivative

    @property
    def has_derivative(self) -> Flags:
        """(k,) whether the rotation or the size of a patch is given."""
        return ~np.isnan(self.rotations) | ~np.isnan(self.scales)


def choose_radii(
    source: Curve,
    target: Curve | None,
    holes: tuple[Sequence[Curve], Sequence[Curve]],
    pins: Complex,
) -> Real:
    """Return radii (k,) for pins (k, 2), in the source's units.

    The largest that is at most RADIUS_SHARE of the size (the square root of the area), RADIUS_BETWEEN_PINS of the
    distance to the closest other pin, and RADIUS_TO_OUTLINE of that to the outlines: in the source and in the target,
    relative to their sizes. Without a target the source is deformed: its outlines are free, and places may coincide.
    """
    found = np.full(len(pins), RADIUS_SHARE)
    sides = [(source, holes[0], pins[:, 0])]
    if target is not None:
        sides.append((target, holes[1], pins[:, 1]))
    for curve, rims, points in sides:
        size = size_of(curve, rims)
        if target is not None:
            for rim in (curve, *rims):
                found = np.minimum(found, RADIUS_TO_OUTLINE * rim.distances(points) / size)
        apart = np.abs(points[:, None] - points) / size
        np.fill_diagonal(apart, np.inf)
        found = np.minimum(found, RADIUS_BETWEEN_PINS * apart.min(axis=1, initial=np.inf))
    return found * size_of(source, holes[0])


def size_of(outline: Curve, rims: Sequence[Curve]) -> float:
    """Return the square root of the area of a domain with holes."""
    return float(np.sqrt(abs(outline.area) - sum(abs(rim.area) for rim in rims)))
