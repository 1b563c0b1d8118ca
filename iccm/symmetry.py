"""Mirror symmetry of outlines: how far an outline is from its mirror image, and its axes of symmetry."""

import numpy as np

from .arrays import Complex
from .curve import Curve

MOST_ASYMMETRY_SHARE = 5e-3
"""Largest distance of a mirrored outline from the outline, relative to the diagonal; 115 of 250 icons are
within it.
"""
ASYMMETRY_SAMPLES = 1000  # points of an outline at which that is measured
MOST_AXES = 12  # of an outline; one with more counts as a disc, whose axes have all directions
LEAST_MOMENT_SHARE = 1e-3
"""Moment of an outline, relative to the largest possible one, below which it is zero."""


def asymmetry(curve: Curve, point: complex, direction: complex) -> float:
    """Return the largest distance of an outline from its mirror image about a line, relative to the diagonal.

    Args:
        curve: the outline.
        point: on the line.
        direction: of the line, of modulus one.
    """
    z = curve.at(curve.length * np.arange(ASYMMETRY_SAMPLES) / ASYMMETRY_SAMPLES)
    mirrored = point + direction**2 * (z - point).conj()
    return float(curve.distances(mirrored).max()) / curve.diagonal


def centre_of(curve: Curve) -> complex:
    """Return the centroid of a closed outline as a curve, which all of its axes of symmetry contain."""
    return complex(curve.lengths @ curve.sample(1)) / curve.length


def axes_of(curve: Curve) -> Complex | None:
    """Return the directions (k,) of a closed outline's axes of symmetry, of modulus one.

    The result is None for a disc, of which all directions are axes.

    If the outline is mirrored about a line through its centroid at an angle φ, the argument of each moment
    ∫ r² exp(i k θ) ds changes from α to 2 k φ - α. So the first moment that is not zero leaves k angles, which are
    checked.
    """
    centre = centre_of(curve)
    per_edge = 1 + ASYMMETRY_SAMPLES // curve.z.size
    z, weights = curve.sample(per_edge) - centre, np.repeat(curve.lengths, per_edge)
    for k in range(1, MOST_AXES + 1):
        moment = complex(weights @ (np.abs(z) ** 2 * np.exp(1j * k * np.angle(z))))
        if abs(moment) > LEAST_MOMENT_SHARE * (weights @ np.abs(z) ** 2):
            directions = np.exp(1j * (np.angle(moment) + np.pi * np.arange(k)) / k)
            is_axis = [asymmetry(curve, centre, axis) <= MOST_ASYMMETRY_SHARE for axis in directions.tolist()]
            return directions[np.array(is_axis)]
    return None
