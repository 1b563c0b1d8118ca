"""Soft pins as given, with radii and tolerances chosen, and in unit coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...pins import FREE_TOLERANCE_SHARE, TOLERANCE_SHARE, Softness, choose_radii
from ...plane import Similarity
from ..minimise.soft_pins import SoftPins
from .validate import Pins

COST_AT_TOLERANCE = 0.05
"""Of the energy of a map without distortion: what a pin costs that misses its place by its tolerance."""
DERIVATIVE_TOLERANCE = 0.1
"""How far the derivative of a patch may be from the rotation and size asked for, at the same cost: a tenth, or 6°."""
STIFFNESS = 8.0
"""Times as much as elsewhere that distortion costs at a pin: enough that a face keeps its look, and little enough that
what is around it gives way smoothly."""


@dataclass(frozen=True, eq=False)
class PinnedPatches:
    """Soft pins of two shapes, in the user's coordinates.

    Attributes:
        points: (k, 2) points of the source, and their places.
        softness: with all radii and tolerances.
    """

    points: Complex
    softness: Softness

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
            COST_AT_TOLERANCE / DERIVATIVE_TOLERANCE**2,
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
) -> PinnedPatches:
    """Return the soft ones among pins (k, 2), as checked in `given`.

    Pins of radius 0 are exact, and so are those on the outlines and at the ends of strokes. Without a target the shape
    is deformed, and the size of the result is that of the source.
    """
    soft = np.isin(pins[:, 0], given.inner[:, 0]) & (softness.radii != 0)
    if not soft.any():
        return NO_PATCHES
    chosen = choose_radii(source, target, holes, pins)[soft]
    kept = softness.of_pins(soft)
    radii = np.where(np.isnan(kept.radii), chosen, kept.radii)
    if target is None:
        tolerance = FREE_TOLERANCE_SHARE * np.sqrt(abs(source.area))
    else:
        tolerance = TOLERANCE_SHARE * np.sqrt(abs(target.area))
    tolerances = np.where(np.isnan(kept.tolerances), tolerance, kept.tolerances)
    return PinnedPatches(pins[soft], Softness(radii, tolerances, kept.rotations, kept.scales))
