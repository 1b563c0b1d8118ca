"""Boundary vertices where the map needs them: chosen so that linear interpolation between them errs evenly.

Cauchy-Green coordinates take the map as linear on every edge of the source polygon. With w(s) the image of the
boundary, an edge of
length ℓ errs by |w''| ℓ²/8, so vertices of density √(|w''| / 8ε) keep the error near ε everywhere: at corners,
in thin places
and at the preimages of the target's own detail alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from .panels import corners, thickness

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
ERROR_THICKNESS_SHARE = 0.05  # allowed error relative to the image of the local thickness
CLOSEST_LENGTH_SHARE = 1e-14  # closest arclengths, relative to the length of the boundary
OFFSETS = np.geomspace(
    1e-6, 0.03, 22
)  # of the points around a corner, relative to the length of the boundary


def clean(s: Real, tau: Real, source: Curve, target: Curve) -> tuple[Real, Real]:
    """Pairs in increasing order of both, modulo one lap, without those closer than double precision distinguishes."""
    lap = np.floor(s / source.length)
    s, tau = s - lap * source.length, tau - lap * target.length
    order = np.lexsort((tau, s))
    s, tau = s[order], tau[order]
    ahead = np.maximum.accumulate(tau)
    least_s, least_tau = CLOSEST_LENGTH_SHARE * source.length, CLOSEST_LENGTH_SHARE * target.length
    keep = [0]
    for k in range(1, s.size):
        if s[k] - s[keep[-1]] > least_s and tau[k] - tau[keep[-1]] > least_tau and tau[k] >= ahead[k]:
            keep.append(k)
    while (
        s[keep[0]] + source.length - s[keep[-1]] <= least_s
        or tau[keep[0]] + target.length - tau[keep[-1]] <= least_tau
    ):
        keep.pop()
    return s[keep], tau[keep]


def around_corners(curve: Curve) -> Real:
    """Arclengths of the vertices of a curve and of points ever closer to its corners."""
    sharp = curve.knots[:-1][corners(curve)]
    steps = curve.length * np.concatenate([-OFFSETS, OFFSETS])
    return np.concatenate([curve.knots[:-1], (sharp[:, None] + steps).ravel()])


def radius_along(curve: Curve, spacing: float) -> Callable[[Real], Real]:
    """Return the local thickness of a domain as a function of arclength."""
    edge, z, radius = thickness(curve, spacing)
    s = curve.knots[edge] + np.abs(z - curve.z[edge])
    return lambda x: np.interp(x, s, radius, period=curve.length)


@dataclass(frozen=True, eq=False)
class Allowance:
    """The error allowed at places of the source: an absolute one, and no more than a share of the local image size.

    Where the map shrinks the source a lot (the end of a protrusion, a sharp corner) an absolute error alone would
    fold it.
    """

    radius: Callable[[Real], Real]
    error: float
    least: float

    def __call__(self, s: Real, stretch: Real) -> Real:
        """Return allowed error at arclengths s, where lengths grow by `stretch`."""
        return np.clip(ERROR_THICKNESS_SHARE * stretch * self.radius(s), self.least, self.error)


def place(
    s: Real, tau: Real, source: Curve, target: Curve, allowed: Allowance, most: int
) -> tuple[Real, Real]:
    """Vertices for an interpolation error of about what is allowed, from a fine correspondence; the source's
    own are kept.

    Args:
        s: (p,) increasing arclengths of the source.
        tau: (p,) arclengths of their images.
        source: the source boundary.
        target: the target boundary.
        allowed: error in the target's units.
        most: about the most vertices; the error is larger where it would take more.

    Returns:
        (n,) arclengths on both.
    """
    laps = np.array([-1, 0, 1])[:, None]
    x, y = (s + laps * source.length).ravel(), (tau + laps * target.length).ravel()
    work = _work(x, target.at(y), allowed)
    spent = np.interp(source.length, x, work) - np.interp(0.0, x, work)
    work *= min(1.0, max(most - source.z.size, 1) / spent)
    ends = np.append(source.knots[:-1], source.length)
    at = np.interp(ends, x, work)
    out = []
    for a, b, first in zip(at[:-1], at[1:], ends[:-1]):
        count = max(1, int(np.ceil(b - a)))
        inner = np.interp(a + (b - a) * np.arange(1, count) / count, work, x)
        out.append(np.concatenate([[first], inner]))
    placed = np.concatenate(out)
    # the source's vertices stay where their images can't be distinguished: without them it would be another domain
    placed = placed[np.diff(placed, prepend=-np.inf) > CLOSEST_LENGTH_SHARE * source.length]
    return placed, np.interp(placed, x, y)


def _work(x: Real, w: Complex, allowed: Allowance) -> Real:
    """Cumulative density of vertices along x: √(|w''| / 8ε), no more than one vertex for each given point."""
    slope = np.diff(w) / np.diff(x)
    middle = 0.5 * (x[1:] + x[:-1])
    stretch = np.abs(slope)
    error = allowed(x[1:-1], np.maximum(stretch[1:], stretch[:-1]))
    density = np.zeros(x.size)
    density[1:-1] = np.sqrt(np.abs(np.diff(slope)) / np.diff(middle) / (8 * error))
    density = np.maximum(density, 0.5 * np.maximum(np.roll(density, 1), np.roll(density, -1)))
    steps = np.minimum(np.diff(x) * 0.5 * (density[1:] + density[:-1]), 1.0)
    return np.concatenate([[0.0], np.cumsum(steps)])
