"""Find the quadratic patch that contains a point, and the point's parameters on it: buckets, then Newton's method.

The patches of a plane neither overlap nor leave gaps, so that a point has one patch, apart from rounding: the
one that contains it best is chosen. Straight triangles are patches without bulges, for which Newton's method
ends after one step.
"""

from functools import cached_property

import numpy as np

from ...arrays import Complex, Real
from ...buckets import BucketGrid
from ...native import function
from ...parallel import over_slices
from ...plane import diagonal
from .adjacency import Index

ROUNDING_SHARE = 1e-12  # relative to the diagonal: a point this close to a patch is on it

_locate = function(
    """int64_t iccm_maps_locate(
        const Complex *control, const double *boxes, double low_x, double low_y, double size, int64_t columns,
        int64_t rows_count, const int64_t *begin, const int64_t *touching, const Complex *points, int64_t p,
        double rounding, int64_t *patch, double *place)"""
)
_solve = function("int64_t iccm_maps_solve_patch(const Complex *patch, double x, double y, double *place)")


class PatchLocator:
    """Locates points in the patches of a plane, prepared for many queries.

    Args:
        corners: (m, 3) complex corners.
        bulge: (m, 3) of the sides opposite to them, or zeros for straight triangles.
    """

    def __init__(self, corners: Complex, bulge: Complex):
        self.control = np.ascontiguousarray(np.concatenate([corners, bulge], axis=1), np.complex128)

    @cached_property
    def boxes(self) -> Real:
        """(m, 4) least x, least y, greatest x and greatest y of the patches' control points, which enclose them."""
        a, b, c, d, e, f = self.control.T
        points = np.stack([a, b, c, 0.5 * (b + c) + d, 0.5 * (c + a) + e, 0.5 * (a + b) + f])
        low = points.real.min(axis=0), points.imag.min(axis=0)
        high = points.real.max(axis=0), points.imag.max(axis=0)
        return np.stack([*low, *high], axis=1) + self.rounding * np.array([-1, -1, 1, 1])

    @cached_property
    def rounding(self) -> float:
        """Largest distance of a point from its patch."""
        return ROUNDING_SHARE * diagonal(self.control[:, :3])

    @cached_property
    def grid(self) -> BucketGrid:
        """The buckets of the boxes."""
        return BucketGrid.of(self.boxes)

    def __call__(self, z: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Return (p,) the patch of each point (p,), -1 outside, and (p, 3) barycentric coordinates of its parameter."""
        return self._located(self.control, self.boxes, self.grid, z, threads)

    def locate_once(self, z: Complex) -> tuple[Index, Real]:
        """Return the same for few points (p,), without the preparation for further queries.

        All boxes are compared with each point, which for few points takes less time than to sort them into buckets.
        """
        x, y = z.real[:, None], z.imag[:, None]
        low_x, low_y, high_x, high_y = self.boxes.T
        over = (low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)
        candidates = np.flatnonzero(over.any(axis=0))
        if not candidates.size:
            return np.full(z.size, -1), np.full((z.size, 3), np.nan)
        boxes = self.boxes[candidates]
        patch, place = self._located(self.control[candidates], boxes, BucketGrid.of(boxes), z, 1)
        return np.where(patch < 0, -1, candidates[patch]), place

    def _located(
        self, control: Complex, boxes: Real, grid: BucketGrid, z: Complex, threads: int | None
    ) -> tuple[Index, Real]:
        """Locate points among patches with these boxes and their grid."""
        patch, place = np.full(z.size, -1), np.full((z.size, 3), np.nan)
        z = np.ascontiguousarray(z, np.complex128)
        buckets = grid.low.real, grid.low.imag, grid.size, grid.columns, grid.rows, grid.begin, grid.patches

        def locate(part: slice) -> None:
            points = z[part]
            _locate(control, boxes, *buckets, points, points.size, self.rounding, patch[part], place[part])

        over_slices(locate, z.size, threads)
        return patch, place


def solve(patch: Complex, z: complex) -> tuple[float, float, float]:
    """Return the parameters L_1 and L_2 of a point on a patch (6,), and the distance of the parameters outside of it.

    The distance is in units of the plane. Newton's method starts from the straight triangle's solution; the
    distance is infinite if it does not converge.
    """
    place = np.empty(3)
    _solve(np.ascontiguousarray(patch, np.complex128), z.real, z.imag, place)
    l1, l2, away = place.tolist()
    return l1, l2, away
