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
MIDDLE = 0.5  # parameter at which a fit is compared with the curve first: most of those that are too far off are here
INNER = np.array([0.15, 0.35, 0.65, 0.85])  # further parameters
INTERVALS_AT_ONCE = 1 << 15
"""Intervals that are fitted at a time: maps take some hundred bytes for each of their points."""

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
        fit: (curve (p,), lo (p,), hi (p,)) -> control points (…, p, k) of the pieces on intervals of curves, and their
            distances (p,) from the curves.
        curves: number of curves.
        tolerance: largest distance.

    Returns:
        For each curve the control points (…, pieces, k) in order.
    """
    curve = np.arange(curves)
    lo, hi = np.zeros(curves), np.ones(curves)
    finished: list[tuple[NDArray, NDArray, Complex]] = []
    for round_number in range(HALVING_ROUNDS):
        blocks = [slice(k, k + INTERVALS_AT_ONCE) for k in range(0, curve.size, INTERVALS_AT_ONCE)]
        fits = [fit(curve[block], lo[block], hi[block]) for block in blocks or [slice(0)]]
        control = np.concatenate([controls for controls, _ in fits], axis=-2)
        error = np.concatenate([errors for _, errors in fits])
        keep = (error <= tolerance) | (round_number == HALVING_ROUNDS - 1)
        finished.append((curve[keep], lo[keep], control[..., keep, :]))
        if keep.all():
            break
        middle = 0.5 * (lo[~keep] + hi[~keep])
        curve, lo, hi = np.repeat(curve[~keep], 2), np.repeat(lo[~keep], 2), np.repeat(hi[~keep], 2)
        hi[0::2] = lo[1::2] = middle  # first and second halves alternate
    curve, lo = (np.concatenate([part[k] for part in finished]) for k in (0, 1))
    control = np.concatenate([part[2] for part in finished], axis=-2)
    finished.clear()  # a hundred bytes for each piece
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
    last = image(curve, hi)
    first = np.roll(last, 1)  # of an interval that begins where the one before ends
    alone = np.flatnonzero((curve != np.roll(curve, 1)) | (lo != np.roll(hi, 1)))
    first[alone] = image(curve[alone], lo[alone])
    u = np.array([DIFFERENCE_STEP, MIDDLE, 1 - DIFFERENCE_STEP])
    after, middle, before = _at(image, curve, lo, hi, u).T
    start, end = (after - first) / DIFFERENCE_STEP, (last - before) / DIFFERENCE_STEP
    least = 3 * np.minimum(tolerance, STILL_SPEED_SHARE * np.abs(last - first))
    start[np.abs(start) < least], end[np.abs(end) < least] = 0, 0
    control = np.stack([first, first + start / 3, last - end / 3, last], axis=1)
    error = np.abs(control @ _basis(np.array([MIDDLE])) - middle[:, None])[:, 0]
    near = np.flatnonzero(error <= tolerance)
    inner = _at(image, curve[near], lo[near], hi[near], INNER)
    error[near] = np.maximum(error[near], np.abs(control[near] @ _basis(INNER) - inner).max(axis=1))
    return control, error


def _at(image: Image, curve: NDArray[np.intp], lo: Real, hi: Real, u: Real) -> Complex:
    """Return (p, k) images at parameters u (k,) of intervals (p,)."""
    t = lo[:, None] + (hi - lo)[:, None] * u
    return image(np.repeat(curve, u.size), t.ravel()).reshape(t.shape)


def _basis(s: Real) -> Real:
    """Return (4, k) cubic Bernstein polynomials at parameters (k,)."""
    return np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
