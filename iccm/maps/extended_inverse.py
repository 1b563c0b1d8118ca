"""Preimages of points of the target, including points just outside the image of the source."""

from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Flags, Real
from ..native import function
from ..parallel import over_slices
from .approximation import AnyMap, triangulated
from .triangulated.map import inverted

SLICE_TRIANGLES = 1 << 15  # triangles that a thread takes at a time: milliseconds of work

_bends = function(
    """int64_t iccm_maps_bends(
        const int64_t *faces, int64_t m, const Complex *w, const Complex *z_w, const Complex *z_wbar, double *out)"""
)


@dataclass(eq=False)
class ExtendedInverse:
    """The inverse of a map, extended beyond the image of the boundary by the nearest point.

    A map meets the target's outline only within a tolerance, so that points on that outline may have no
    preimage; they get that of the nearest point of the boundary's image. Their number and largest distance are
    recorded.

    Attributes:
        map: source to target.
        threads: number of threads; by default one per processor.
        outside: number of points so far without a preimage.
        away: largest distance of these from the image.
    """

    map: AnyMap
    threads: int | None = None
    outside: int = field(default=0, init=False)
    away: float = field(default=0.0, init=False)
    _counting: Lock = field(default_factory=Lock, init=False, repr=False)

    def __post_init__(self) -> None:
        self._map = triangulated(self.map)

    def __call__(self, w: Complex) -> Complex:
        """Return (p,) preimages of (p,) points, never NaN for a finite point."""
        z, away = self._map.extended_inverse(w, self.threads)
        self._count(away)
        return z

    def reached(self, w: Complex) -> tuple[Complex, Flags]:
        """Return (p,) preimages, and which of the points have one, within the tolerance of the map's outline."""
        z, away = self._map.extended_inverse(w, self.threads)
        is_near = away <= self._map.near * self._map.image_diagonal
        self._count(away[is_near])
        return z, is_near

    def _count(self, away: Real) -> None:
        with self._counting:
            self.outside += int(np.count_nonzero(away))
            self.away = max(self.away, float(away.max(initial=0.0)))

    def slopes(self, z: Complex) -> tuple[Complex, Complex]:
        """Return z_w and z_w̄ of the inverse at points z of the source.

        They are NaN where the map has no derivative or folds.
        """
        _, a, b = self._map.jet(z, self.threads)
        z_w, z_wbar = inverted(a, b)
        bad = ~(np.abs(a) > np.abs(b)) | ~np.isfinite(z_w + z_wbar)
        z_w[bad] = z_wbar[bad] = complex(np.nan, np.nan)
        return z_w, z_wbar


def bends(faces: NDArray, w: Complex, z_w: Complex, z_wbar: Complex, threads: int | None = None) -> Real:
    """Estimate (m,) the distance of the inverse from its linear interpolation in each triangle (m, 3).

    Along an edge e, a smooth function differs from its chord by about |slope(b) e - slope(a) e| / 8. Unknown
    slopes give inf.
    """
    out = np.empty(len(faces))
    faces = np.ascontiguousarray(faces, np.int64)
    w, z_w, z_wbar = (np.ascontiguousarray(array, np.complex128) for array in (w, z_w, z_wbar))

    def estimate(part: slice) -> None:
        _bends(faces[part], len(faces[part]), w, z_w, z_wbar, out[part])

    over_slices(estimate, len(out), threads, SLICE_TRIANGLES)
    return out
