"""Geometry of the plane with complex numbers as points: areas, boxes, similarities, and exact orientation."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from .arrays import Box, Complex, Real

Signs = NDArray[np.int8]
UNIT_ROUNDOFF = 2.0**-53  # unit roundoff
FILTER = (
    3 + 16 * UNIT_ROUNDOFF
) * UNIT_ROUNDOFF  # Shewchuk's bound for (a - c) × (b - c), relative to the sum of the two products
TINY = 1e-250  # below this, products may underflow, for which the bound does not hold


@overload
def cross(a: complex, b: complex) -> float: ...
@overload
def cross(a: Complex, b: Complex | complex) -> Real: ...
def cross(a: Any, b: Any) -> Any:
    """Return the determinants of vectors a and b, which are twice the signed areas of the triangles 0, a, b."""
    return a.real * b.imag - a.imag * b.real


def stretched(z: Complex, ratio: float) -> Complex:
    """Return points of a plane whose width is stretched by a ratio relative to its height, with areas kept.

    Examples
    --------
    >>> stretched(np.array([1 + 1j]), 4.0).tolist()
    [(2+0.5j)]
    """
    return np.sqrt(ratio) * z.real + 1j * z.imag / np.sqrt(ratio)


def triangle_areas(corners: Complex) -> Real:
    """Return (m,) signed areas of triangles (m, 3), positive if they are counter-clockwise."""
    a, b, c = corners.T
    return 0.5 * cross(b - a, c - a)


def triangle_heights(corners: Complex) -> Real:
    """Return (m,) heights of triangles (m, 3) over their longest sides, negative if they are clockwise."""
    longest = np.abs(corners - np.roll(corners, 1, axis=-1)).max(axis=-1)
    return 2 * triangle_areas(corners) / np.maximum(longest, 1e-300)


def polygon_area(z: Complex) -> float:
    """Return the signed area of a closed polyline (n,), positive if it is counter-clockwise."""
    w = z - z[0]  # avoids cancellation far from the origin
    return 0.5 * float(np.sum(cross(w, np.roll(w, -1))))


def bounding_box(z: Complex) -> Box:
    """Return the lower left and the upper right corner of the smallest box around points (n,)."""
    return complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())


def diagonal(z: Complex) -> float:
    """Return the length of the diagonal of the bounding box of points."""
    return float(np.hypot(np.ptp(z.real), np.ptp(z.imag)))


def longer_side(low: complex, high: complex) -> float:
    """Return the longer side of the box between two corners."""
    return max((high - low).real, (high - low).imag)


def distinct(z: Complex, closed: bool = True) -> Complex:
    """Return a polyline (n,) without vertices that repeat their predecessor, to within 1e-12 of its size."""
    if z.size < 2:
        return z
    tiny = 1e-12 * longer_side(*bounding_box(z))
    keep = np.abs(np.diff(z, prepend=z[-1:] if closed else np.inf)) > tiny
    return z[keep] if keep.any() else z[:1]


def distinct_each(rings: Sequence[Complex]) -> list[Complex]:
    """Apply `distinct` to each of several closed polylines; fast for many short ones."""
    sizes = np.array([ring.size for ring in rings], dtype=np.intp)
    if sizes.size < 2 or not sizes.all():
        return [distinct(ring) for ring in rings]
    z = np.concatenate(rings)
    starts = np.cumsum(sizes) - sizes
    low, high = (
        (extreme.reduceat(z.real, starts), extreme.reduceat(z.imag, starts))
        for extreme in (np.minimum, np.maximum)
    )
    tiny = 1e-12 * np.maximum(high[0] - low[0], high[1] - low[1])
    previous = np.roll(z, 1)
    previous[starts] = z[starts + sizes - 1]
    keep = np.abs(z - previous) > np.repeat(tiny, sizes)
    keep[starts] |= ~np.logical_or.reduceat(keep, starts)
    if keep.all():
        return list(rings)
    counts = np.add.reduceat(keep, starts, dtype=np.intp)
    return np.split(z[keep], np.cumsum(counts)[:-1])


def segment_distances(points: Complex, starts: Complex, steps: Complex) -> Real:
    """Return the distance of each point to its own segment, from a start to start + step."""
    position = np.clip(((points - starts) * steps.conj()).real / np.maximum(np.abs(steps) ** 2, 1e-300), 0, 1)
    return np.abs(points - starts - position * steps)


def rotation(z: Complex, w: Complex) -> complex:
    """Return the rotation (a number of modulus one) that takes points z (n,) closest to w; 1 if it is undefined."""
    product = complex(np.vdot(z, w))
    return product / abs(product) if abs(product) > 0 else 1.0


class Similarity(NamedTuple):
    """The similarity z ↦ factor (z - centre) + shift, with the product conjugated if it is `mirrored`.

    Attributes:
        factor: scale and rotation.
        shift: the image of the centre.
        centre: a point near the mapped ones, so that shapes far from the origin keep their precision.
        mirrored: whether orientation is reversed.
    """

    factor: complex
    shift: complex = 0j
    centre: complex = 0j
    mirrored: bool = False

    @classmethod
    def fit(cls, z: Complex, w: Complex, weights: Real | None = None) -> "Similarity":
        """Return the similarity that takes points z (n,) closest to w, by least squares.

        It is a translation if z is one point.

        Args:
            z: points.
            w: their images.
            weights: (n,) of the squares; by default one.
        """
        weights = np.ones(z.size) if weights is None else weights
        a, b = (np.average(points, weights=weights) for points in (z, w))
        spread = np.sum(weights * np.abs(z - a) ** 2)
        factor = complex(np.vdot(z - a, weights * (w - b)) / spread) if spread > 0 else 1.0
        return cls(factor, complex(b - factor * a))

    def __call__(self, z: Complex) -> Complex:
        """Return the images of points."""
        w = (z - self.centre) * self.factor
        return (np.conj(w) if self.mirrored else w) + self.shift

    def pull_back(self, w: Complex) -> Complex:
        """Return the points with images w."""
        w = w - self.shift
        return (np.conj(w) if self.mirrored else w) / self.factor + self.centre

    def inverse(self) -> "Similarity":
        """Return the inverse similarity."""
        factor = self.factor.conjugate() if self.mirrored else self.factor
        return Similarity(1 / factor, self.centre, self.shift, self.mirrored)

    def conjugate(self) -> "Similarity":
        """Return the similarity between the mirror images of both planes in their real axes."""
        return Similarity(
            self.factor.conjugate(), self.shift.conjugate(), self.centre.conjugate(), self.mirrored
        )

    def rotated(self, angle: float) -> "Similarity":
        """Return the similarity followed by a rotation about the centre's image.

        The angle is in radians, before mirroring.
        """
        return self._replace(factor=self.factor * complex(np.exp(1j * angle)))


def orientation(a: Complex, b: Complex, c: Complex) -> Signs:
    """Return whether points a, b, c (p,), all finite, turn left (1), right (-1) or are collinear (0), exactly.

    Floating point is used if its error bound proves the sign, and fractions otherwise: Shewchuk, *Adaptive
    Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates*, Discrete & Computational Geometry
    18, 1997, §4.3.
    """
    u, v = a - c, b - c
    left, right = u.real * v.imag, u.imag * v.real
    value, size = left - right, np.abs(left) + np.abs(right)
    sign = np.sign(value).astype(np.int8)
    for k in np.flatnonzero(~((np.abs(value) > FILTER * size) & (size > TINY))):
        sign[k] = _exact_orientation(a[k], b[k], c[k])
    return sign


def _exact_orientation(a: complex, b: complex, c: complex) -> int:
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(float(p.real)), Fraction(float(p.imag))) for p in (a, b, c))
    value = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (value > 0) - (value < 0)
