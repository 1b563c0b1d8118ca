"""Soft pins with all radii and tolerances chosen, in the user's coordinates and in unit coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index, is_among
from ...curve import Curve
from ...errors import ConstraintError
from ...pins import FREE_TOLERANCE_SHARE, MOST_TOLERANCES, TOLERANCE_SHARE, Softness, choose_radii, size_of
from ...plane import Similarity
from ..minimise.soft_pins import SoftPins, StrokeBand
from .validate import Pins

COST_AT_TOLERANCE = 0.05
"""Cost of a pin that misses its place by its tolerance, relative to the energy of a map without distortion."""
DERIVATIVE_TOLERANCE = 0.1
"""Deviation of a patch's derivative from the requested rotation and size that has the same cost: 10 %, or 6°."""
FREE_DERIVATIVE_TOLERANCE = 0.02
"""The same for deformations without a target, where nothing else determines the rotation of parts: 1°."""
MOST_LIMIT_RATIO = 1.05
"""Distance relative to its limit up to which a soft pin counts as met; the last steps still move it a little."""
STIFFNESS = 8.0
"""Weight of distortion at a pin relative to elsewhere: large enough to preserve a face, and small enough for a
smooth transition around it.
"""


@dataclass(frozen=True, eq=False)
class PinnedPatches:
    """Soft pins of two shapes, in the user's coordinates.

    Attributes:
        points: (k, 2) points of the source, and their places.
        softness: with all radii and tolerances.
        bands: strokes of the source, and the widths of the bands around them that keep their shape.
        derivative_tolerance: tolerated deviation of the patches' derivatives from the requested rotations and
            sizes.
    """

    points: Complex
    softness: Softness
    bands: tuple[tuple[Curve, float], ...] = ()
    derivative_tolerance: float = DERIVATIVE_TOLERANCE

    @property
    def are_none(self) -> bool:
        """Whether there are neither soft pins nor bands."""
        return not len(self.points) and not self.bands

    def unit(self, to_unit: tuple[Similarity, Similarity]) -> SoftPins:
        """Return the pins in unit coordinates."""
        sizes = [abs(similarity.factor) for similarity in to_unit]
        softness, mirror = self.softness, -1.0 if to_unit[0].mirrored else 1.0
        rotation = np.angle(to_unit[1].factor / to_unit[0].factor)
        return SoftPins(
            to_unit[0](self.points[:, 0]),
            to_unit[1](self.points[:, 1]),
            sizes[0] * softness.radii,
            sizes[1] * softness.limits,
            COST_AT_TOLERANCE / (sizes[1] * softness.tolerances) ** 2,
            COST_AT_TOLERANCE / self.derivative_tolerance**2,
            STIFFNESS,
            mirror * (softness.rotations + rotation),
            softness.scales.copy(),
            tuple(
                StrokeBand(Curve(to_unit[0](line.z), closed=False), 0.5 * sizes[0] * width)
                for line, width in self.bands
            ),
        )


NO_PATCHES = PinnedPatches(np.empty((0, 2), np.complex128), Softness.free(0))


def patches_of(
    source: Curve,
    target: Curve | None,
    holes: tuple[Sequence[Curve], Sequence[Curve]],
    pins: Complex,
    softness: Softness,
    checked_pins: Pins,
    numbers: Index | None = None,
    bands: tuple[tuple[Curve, float], ...] = (),
) -> PinnedPatches:
    """Return the soft pins among pins (k, 2), with the bands around strokes.

    Pins of radius 0 are exact, and so are those on the outlines and at the ends of strokes. Without a target
    the shape is deformed, and tolerances are relative to the size of the source.

    Args:
        source: outline of the source.
        target: outline of the target; None for a deformation.
        holes: of source and target.
        pins: (k, 2) points of the source, and their places.
        softness: as given.
        checked_pins: the checked pins.
        numbers: (k,) numbers of the pins for messages; consecutive by default.
        bands: of strokes; see `bands_of`.

    Raises:
        ConstraintError: an exact pin has a rotation or a size.
    """
    soft = is_among(pins[:, 0], checked_pins.inner[:, 0]) & (softness.radii != 0)
    exact_with_rotation = np.flatnonzero(~soft & ~(np.isnan(softness.rotations) & np.isnan(softness.scales)))
    if exact_with_rotation.size:
        k = int(exact_with_rotation[0] if numbers is None else numbers[exact_with_rotation[0]])
        raise ConstraintError(
            f"pin {k + 1}: only a pin inside the shape, with a radius above 0, can have a rotation or a size (turn, "
            "scale); move it away from the outline, or leave them out",
            [k],
        )
    if not soft.any():
        return replace(NO_PATCHES, bands=bands)
    default_radii = choose_radii(source, target, holes, pins)[soft]
    requested = softness.of_pins(soft)
    radii = np.where(np.isnan(requested.radii), default_radii, requested.radii)
    derivative_tolerance = DERIVATIVE_TOLERANCE if target else FREE_DERIVATIVE_TOLERANCE
    if target is None:
        tolerance = FREE_TOLERANCE_SHARE * size_of(source, holes[0])
    else:
        tolerance = TOLERANCE_SHARE * size_of(target, holes[1])
    tolerances = np.where(np.isnan(requested.tolerances), tolerance, requested.tolerances)
    most = 1.0 if target is None else MOST_TOLERANCES
    limits = np.where(np.isnan(requested.tolerances), most * tolerance, requested.tolerances)
    resolved = Softness(radii, tolerances, requested.rotations, requested.scales, limits)
    return PinnedPatches(pins[soft], resolved, bands, derivative_tolerance)


def bands_of(
    strokes: Sequence[tuple[Curve, Curve]], widths: Sequence[float]
) -> tuple[tuple[Curve, float], ...]:
    """Return the source's strokes with bands around them, and the widths of these; `widths` may be empty."""
    return tuple((source, float(width)) for (source, _), width in zip(strokes, widths) if width > 0)


def softness_of(pins: Complex, soft: Complex, softness: Softness) -> Softness:
    """Return the softness of all pins (k, 2): of the soft ones (j, 2) as given, the others are exact."""
    numbers = np.array([np.flatnonzero(pins[:, 0] == point)[0] for point, _ in soft], np.int64)
    return Softness.exact(len(pins)).with_pins(numbers, softness)
