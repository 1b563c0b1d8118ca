"""Boundary vertices chosen such that the error of linear interpolation between them is even.

Cauchy-Green coordinates interpolate the map linearly on every edge of the source polygon. If w(s) is the image
of the boundary, the error on an edge of length ℓ is |w''| ℓ²/8, so that vertices of density √(|w''| / 8ε) keep
it near ε everywhere: at corners, in thin places, and at the preimages of the target's detail.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from .panels import corners, thickness

# Values were chosen by hand unless a comment gives a reason.
ERROR_THICKNESS_SHARE = 0.05  # allowed error, relative to the image of the local thickness
CLOSEST_LENGTH_SHARE = 1e-14  # least distance of arclengths, relative to the length of the boundary
OFFSETS = np.geomspace(
    1e-6, 0.03, 22
)  # offsets of the points around a corner, relative to the length of the boundary


def clean(s: Real, tau: Real, source: Curve, target: Curve) -> tuple[Real, Real]:
    """Return pairs in increasing order of both arclengths, within one lap.

    Pairs that coincide in double precision are omitted.
    """
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
    """Return the arclengths of a curve's vertices, and of points that accumulate at its corners."""
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
    """The allowed error at places of the source: an absolute error, limited to a share of the local size of the image.

    Where the map shrinks the source a lot (the end of a protrusion, a sharp corner), an absolute error alone
    would permit folds.
    """

    radius: Callable[[Real], Real]
    error: float
    least: float

    def __call__(self, s: Real, stretch: Real) -> Real:
        """Return the allowed error at arclengths s, where lengths are scaled by `stretch`."""
        return np.clip(ERROR_THICKNESS_SHARE * stretch * self.radius(s), self.least, self.error)


def place(
    s: Real, tau: Real, source: Curve, target: Curve, allowed: Allowance, most: int
) -> tuple[Real, Real]:
    """Place vertices with an interpolation error of about the allowed size; the source's own vertices are kept.

    Args:
        s: (p,) increasing arclengths of the source.
        tau: (p,) arclengths of their images.
        source: the source boundary.
        target: the target boundary.
        allowed: error in the target's units.
        most: approximate limit on the number of vertices; the error is larger if more would be needed.

    Returns:
        (n,) arclengths on both.
    """
    laps = np.array([-1, 0, 1])[:, None]
    x, y = (s + laps * source.length).ravel(), (tau + laps * target.length).ravel()
    work = _work(x, target.at(y), allowed)
    spent = np.interp(source.length, x, work) - np.interp(0.0, x, work)
    work *= min(1.0, max(most - source.z.size, 1) / spent)
    ends = np.append(source.knots[:-1], source.length)
    work_at_ends = np.interp(ends, x, work)
    out = []
    for a, b, first in zip(work_at_ends[:-1], work_at_ends[1:], ends[:-1]):
        count = max(1, int(np.ceil(b - a)))
        inner = np.interp(a + (b - a) * np.arange(1, count) / count, work, x)
        out.append(np.concatenate([[first], inner]))
    placed = np.concatenate(out)
    # the source's vertices are kept even if their images coincide: without them it would be another domain
    placed = placed[np.diff(placed, prepend=-np.inf) > CLOSEST_LENGTH_SHARE * source.length]
    return placed, np.interp(placed, x, y)


def _work(x: Real, w: Complex, allowed: Allowance) -> Real:
    """Return the cumulative density of vertices along x, √(|w''| / 8ε), at most one vertex per given point."""
    slope = np.diff(w) / np.diff(x)
    middle = 0.5 * (x[1:] + x[:-1])
    stretch = np.abs(slope)
    error = allowed(x[1:-1], np.maximum(stretch[1:], stretch[:-1]))
    density = np.zeros(x.size)
    density[1:-1] = np.sqrt(np.abs(np.diff(slope)) / np.diff(middle) / (8 * error))
    density = np.maximum(density, 0.5 * np.maximum(np.roll(density, 1), np.roll(density, -1)))
    steps = np.minimum(np.diff(x) * 0.5 * (density[1:] + density[:-1]), 1.0)
    return np.concatenate([[0.0], np.cumsum(steps)])
