"""Fit cubic Béziers to the images of curves under a map, within a tolerance."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Real

# Values were chosen by hand unless a comment gives a reason.
HALVING_ROUNDS = 14  # of halving intervals
DIFFERENCE_STEP = 1e-3
"""Relative to an interval: step of the one-sided differences for its end tangents. Their error, half the step times the
second derivative, moves the cubic by less than a hundredth of its distance from its chord.
"""
# Relative to the chord: shorter control arms do not determine a direction; those of a straight line are a
# third.
STILL_SPEED_SHARE = 0.15
INNER = np.array([0.15, 0.35, 0.5, 0.65, 0.85])  # parameters at which a fit is compared with the curve

Image = Callable[[NDArray[np.intp], NDArray[np.float64]], Complex]
Fit = Callable[[NDArray[np.intp], Real, Real], tuple[Complex, Real]]


def refit(image: Image, curves: int, tolerance: float) -> list[Complex]:
    """Fit cubic Béziers to many curves at once.

    An interval gets the cubic with the curve's ends and end tangents. If it is farther from the curve than the
    tolerance at equal parameters, the interval is halved.

    Args:
        image: (which (p,), t (p,)) -> (p,) points; curve number and parameter in [0, 1].
        curves: number of curves.
        tolerance: largest distance, in the image's units.

    Returns:
        For each curve its (k, 4) control points in order; each cubic begins where the one before ends.
    """
    return refit_together([image], curves, tolerance)[0]


def refit_together(images: Sequence[Image], curves: int, tolerance: float) -> list[list[Complex]]:
    """Fit cubic Béziers to several images of the same curves, with as many for a curve in each of the images.

    An interval is halved if it is not accurate in one of the images, so that the images can be interpolated.

    Args:
        images: as for `refit`.
        curves, tolerance: as for `refit`.

    Returns:
        For each image, the control points of its curves as `refit` returns them.
    """

    def fit(curve: NDArray[np.intp], lo: Real, hi: Real) -> tuple[Complex, Real]:
        fits = [_cubics(image, curve, lo, hi, tolerance) for image in images]
        return np.stack([control for control, _ in fits]), np.max([error for _, error in fits], axis=0)

    return [[*split] for split in zip(*halved(fit, curves, tolerance))]


def halved(fit: Fit, curves: int, tolerance: float) -> list[Complex]:
    """Fit pieces to intervals of curves, which are halved until every piece is accurate.

    Args:
        fit: (which (p,), lo (p,), hi (p,)) -> control points (…, p, k) of the pieces on intervals of curves, and their
            distances (p,) from the curves.
        curves: number of curves.
        tolerance: largest distance.

    Returns:
        For each curve the control points (…, pieces, k) in order.
    """
    curve = np.arange(curves)
    lo, hi = np.zeros(curves), np.ones(curves)
    finished: list[tuple[NDArray, NDArray, Complex]] = []
    for turn in range(HALVING_ROUNDS):
        control, error = fit(curve, lo, hi)
        keep = (error <= tolerance) | (turn == HALVING_ROUNDS - 1)
        finished.append((curve[keep], lo[keep], control[..., keep, :]))
        if keep.all():
            break
        curve, lo, hi = curve[~keep], lo[~keep], hi[~keep]
        middle = 0.5 * (lo + hi)
        curve, lo, hi = np.tile(curve, 2), np.concatenate([lo, middle]), np.concatenate([middle, hi])
    curve, lo = (np.concatenate([part[k] for part in finished]) for k in (0, 1))
    control = np.concatenate([part[2] for part in finished], axis=-2)
    order = np.lexsort([lo, curve])
    ends = np.searchsorted(curve[order], np.arange(1, curves))
    return np.split(control[..., order, :], ends, axis=-2)


def _cubics(
    image: Image,
    curve: NDArray[np.intp],
    lo: NDArray[np.float64],
    hi: NDArray[np.float64],
    tolerance: float,
) -> tuple[Complex, NDArray[np.float64]]:
    """Return (p, 4) control points on each interval, and their distances from the curve.

    Where the curve nearly stops at an end, as at a corner that the map smooths, its tangent is undefined. Then
    the inner control point is the end itself, and the direction of the cubic is determined by the other one.
    """
    u = np.concatenate([[0, DIFFERENCE_STEP], INNER, [1 - DIFFERENCE_STEP, 1]])
    t = lo[:, None] + (hi - lo)[:, None] * u
    w = image(np.repeat(curve, u.size), t.ravel()).reshape(t.shape)
    start, end = (w[:, 1] - w[:, 0]) / DIFFERENCE_STEP, (w[:, -1] - w[:, -2]) / DIFFERENCE_STEP
    least = 3 * np.minimum(tolerance, STILL_SPEED_SHARE * np.abs(w[:, -1] - w[:, 0]))
    start[np.abs(start) < least], end[np.abs(end) < least] = 0, 0
    control = np.stack([w[:, 0], w[:, 0] + start / 3, w[:, -1] - end / 3, w[:, -1]], axis=1)
    s = INNER
    basis = np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
    return control, np.abs(control @ basis - w[:, 2:-2]).max(axis=1)
