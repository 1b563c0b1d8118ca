"""Soft pins as given, with radii and tolerances chosen, and in unit coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Complex, Index
from ...curve import Curve
from ...errors import ConstraintError
from ...pins import FREE_TOLERANCE_SHARE, TOLERANCE_SHARE, Softness, choose_radii
from ...plane import Similarity
from ..minimise.soft_pins import SoftPins
from .validate import Pins

COST_AT_TOLERANCE = 0.05
"""Of the energy of a map without distortion: what a pin costs that misses its place by its tolerance."""
DERIVATIVE_TOLERANCE = 0.1
"""How far the derivative of a patch may be from the rotation and size asked for, at the same cost: a tenth, or 6°."""
FREE_DERIVATIVE_TOLERANCE = 0.02
"""The same where a shape is deformed without a target, and nothing else says how its parts are rotated: 1°."""
STIFFNESS = 8.0
"""Times as much as elsewhere that distortion costs at a pin: enough that a face keeps its look, and little enough that
what is around it gives way smoothly."""


@dataclass(frozen=True, eq=False)
class PinnedPatches:
    """Soft pins of two shapes, in the user's coordinates.

    Attributes:
        points: (k, 2) points of the source, and their places.
        softness: with all radii and tolerances.
        derivative_tolerance: how far the derivatives of patches may be from the rotations and sizes asked for.
    """

    points: Complex
    softness: Softness
    derivative_tolerance: float = DERIVATIVE_TOLERANCE

    def unit(self, frames: tuple[Similarity, Similarity]) -> SoftPins:
        """Return the pins in unit coordinates."""
        sizes = [abs(frame.factor) for frame in frames]
        softness, mirror = self.softness, -1.0 if frames[0].mirrored else 1.0
        turned = np.angle(frames[1].factor / frames[0].factor)
        return SoftPins(
            frames[0](self.points[:, 0]),
            frames[1](self.points[:, 1]),
            sizes[0] * softness.radii,
            sizes[1] * softness.tolerances,
            COST_AT_TOLERANCE / (sizes[1] * softness.tolerances) ** 2,
            COST_AT_TOLERANCE / self.derivative_tolerance**2,
            STIFFNESS,
            mirror * (softness.rotations + turned),
            softness.scales.copy(),
        )


NO_PATCHES = PinnedPatches(np.empty((0, 2), np.complex128), Softness.free(0))


def patches_of(
    source: Curve,
    target: Curve | None,
    holes: tuple[Sequence[Curve], Sequence[Curve]],
    pins: Complex,
    softness: Softness,
    given: Pins,
    numbers: Index | None = None,
) -> PinnedPatches:
    """Return the soft ones among pins (k, 2), as checked in `given`; `numbers` (k,) are theirs among those given.

    Pins of radius 0 are exact, and so are those on the outlines and at the ends of strokes. Without a target the shape
    is deformed, and the size of the result is that of the source.

    Raises:
        ConstraintError: an exact pin has a rotation or a size.
    """
    soft = np.isin(pins[:, 0], given.inner[:, 0]) & (softness.radii != 0)
    turned = np.flatnonzero(~soft & ~(np.isnan(softness.rotations) & np.isnan(softness.scales)))
    if turned.size:
        k = int(turned[0] if numbers is None else numbers[turned[0]])
        raise ConstraintError(
            f"pin {k + 1}: only a pin inside the shape, with a radius above 0, can have a rotation or a size (turn, "
            "scale); move it away from the outline, or leave them out",
            [k],
        )
    if not soft.any():
        return NO_PATCHES
    chosen = choose_radii(source, target, holes, pins)[soft]
    kept = softness.of_pins(soft)
    radii = np.where(np.isnan(kept.radii), chosen, kept.radii)
    derivative_tolerance = DERIVATIVE_TOLERANCE if target else FREE_DERIVATIVE_TOLERANCE
    if target is None:
        tolerance = FREE_TOLERANCE_SHARE * np.sqrt(abs(source.area))
    else:
        tolerance = TOLERANCE_SHARE * np.sqrt(abs(target.area))
    tolerances = np.where(np.isnan(kept.tolerances), tolerance, kept.tolerances)
    found = Softness(radii, tolerances, kept.rotations, kept.scales)
    return PinnedPatches(pins[soft], found, derivative_tolerance)


def softness_of(pins: Complex, soft: Complex, softness: Softness) -> Softness:
    """Return how pins (k, 2) hold what is around them: the soft ones (j, 2) as given, the others exactly."""
    numbers = np.array([np.flatnonzero(pins[:, 0] == here)[0] for here, _ in soft], np.int64)
    return Softness.exact(len(pins)).with_pins(numbers, softness)
