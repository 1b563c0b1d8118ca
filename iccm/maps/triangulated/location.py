"""The quadratic patch that a point of the plane belongs to, and its place there: buckets, then Newton's method.

The patches of a plane do not overlap and leave no gaps, so a point has one patch but for rounding: the one that holds
it best is taken. Straight triangles are patches without bulges, on which Newton's method ends with its first step.
"""

from functools import cached_property

import numpy as np

from ...arrays import Complex, Real
from ...buckets import BucketGrid
from ...jit import kernel
from ...parallel import over_slices
from ...plane import diagonal
from .adjacency import Index

STEPS = 12
"""Of Newton's method; 3 to 5 are usual, 6 was the most in millions of points of the most bent patches."""
BESIDE = 0.05
"""Barycentric: how far outside a step of it may start, so that rounding does not keep points out."""
ROUNDING = 1e-12  # of the diagonal: this little outside a patch counts as on it


class PatchLocator:
    """The patches of a plane, ready for many questions.

    Args:
        corners: (m, 3) complex corners.
        bulge: (m, 3) of the sides opposite to them, or zeros for straight triangles.
    """

    def __init__(self, corners: Complex, bulge: Complex):
        self.control = np.ascontiguousarray(np.concatenate([corners, bulge], axis=1))

    @cached_property
    def boxes(self) -> Real:
        """(m, 4) least x, least y, greatest x and greatest y of the patches' control points, which hold them."""
        a, b, c, d, e, f = self.control.T
        points = np.stack([a, b, c, 0.5 * (b + c) + d, 0.5 * (c + a) + e, 0.5 * (a + b) + f])
        low = points.real.min(axis=0), points.imag.min(axis=0)
        high = points.real.max(axis=0), points.imag.max(axis=0)
        return np.stack([*low, *high], axis=1) + self.rounding * np.array([-1, -1, 1, 1])

    @cached_property
    def rounding(self) -> float:
        """How far outside its patch a point may lie."""
        return ROUNDING * diagonal(self.control[:, :3])

    @cached_property
    def grid(self) -> BucketGrid:
        """The buckets."""
        return BucketGrid.of(self.boxes)

    def __call__(self, z: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """(p,) patch of each point (p,), -1 outside, and (p, 3) barycentric coordinates of its parameter."""
        patch, place = np.full(z.size, -1), np.full((z.size, 3), np.nan)
        given = self.control, self.boxes, self.grid
        rounding = self.rounding
        over_slices(
            lambda part: _locate(*given, z[part], rounding, patch[part], place[part]), z.size, threads
        )
        return patch, place


@kernel
def _locate(control, boxes, grid, z, rounding, patch, place):
    """Writes the patch and the place of each point that has one."""
    for i in range(z.size):
        x, y = z[i].real, z[i].imag
        column, row = _bucket(x - grid.low.real, grid.size), _bucket(y - grid.low.imag, grid.size)
        if not (0 <= column < grid.columns and 0 <= row < grid.rows):
            continue
        bucket = row * grid.columns + column
        least = rounding
        for k in range(grid.begin[bucket], grid.begin[bucket + 1]):
            t = grid.patches[k]
            if not (boxes[t, 0] <= x <= boxes[t, 2] and boxes[t, 1] <= y <= boxes[t, 3]):
                continue
            l1, l2, away = solve(control[t], z[i])
            if away <= least:
                least, patch[i] = away, t
                place[i, 0], place[i, 1], place[i, 2] = 1 - l1 - l2, l1, l2
                if away <= 0:
                    break


@kernel
def _bucket(x, size):
    """Number of a bucket; -1 for NaN."""
    n = np.floor(x / size)
    return np.int64(n) if abs(n) < 1e9 else np.int64(-1)


@kernel
def solve(c, z):
    """Parameters L_1 and L_2 of a point on a patch (6,), and how far outside they lie in units of the plane.

    Newton's method from the straight triangle's solution. Where a needle of a patch is bent by many times its width,
    the quadratic has a second solution outside, so steps start within BESIDE of the triangle; where the method does
    not end, the point is outside and the distance is infinite.
    """
    u, v, r0 = c[1] - c[0], c[2] - c[0], z - c[0]
    area = u.real * v.imag - u.imag * v.real
    l1 = (r0.real * v.imag - r0.imag * v.real) / area
    l2 = (u.real * r0.imag - u.imag * r0.real) / area
    if c[3] != 0 or c[4] != 0 or c[5] != 0:
        for _ in range(STEPS):
            l1, l2 = _pulled_in(l1, l2)
            h1, h2 = _step(c, u, v, r0, l1, l2)
            l1, l2 = l1 + h1, l2 + h2
            if abs(h1) + abs(h2) < 1e-8:  # the error after the step is about its square
                break
        else:
            return l1, l2, np.inf
    away = max(-(1 - l1 - l2) / abs(v - u), -l1 / abs(v), -l2 / abs(u)) * abs(area)
    return l1, l2, away


@kernel
def _pulled_in(l1, l2):
    """Parameters with no barycentric coordinate below -BESIDE."""
    l0 = max(1 - l1 - l2, -BESIDE)
    l1, l2 = max(l1, -BESIDE), max(l2, -BESIDE)
    total = l0 + l1 + l2
    return l1 / total, l2 / total


@kernel
def _step(c, u, v, r0, l1, l2):
    """The step of Newton's method from given parameters."""
    l0 = 1 - l1 - l2
    r = r0 - (l1 * u + l2 * v + 2 * (l1 * l2 * c[3] + l2 * l0 * c[4] + l0 * l1 * c[5]))
    a = u + 2 * ((l0 - l1) * c[5] + l2 * (c[3] - c[4]))
    b = v + 2 * ((l0 - l2) * c[4] + l1 * (c[3] - c[5]))
    area = a.real * b.imag - a.imag * b.real
    return (r.real * b.imag - r.imag * b.real) / area, (a.real * r.imag - a.imag * r.real) / area
