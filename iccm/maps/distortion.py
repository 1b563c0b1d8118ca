"""Distortion of a map over the target's area: figures of the report from samples of any kind of map.

A sample stands for a piece of the target: it consists of its area, and f_z and f_z̄ there. Points spread over
the source are weighted by |J| times their share of the source's area; samples with area 0 only count for
maxima. Lengths are relative to the mean scale, the root of the target's area over the source's, so that a
similarity has stretch 1.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..arrays import Complex, Index, Real
from .approximation import AnyMap
from .inverse import extended_inverse
from .triangulated.map import TriangulatedMap, inverted
from .triangulated.patches import cross

STRETCHED_P95, DILATED_P95 = (
    5.0,
    10.0,
)  # if exceeded on 5 % of the target, pictures look stretched into stripes
SQUEEZED_DILATATION = 100.0
"""Dilatation from which a triangle counts as nearly folded: a circle becomes a line."""


@dataclass(frozen=True, eq=False)
class Distortion:
    """Samples of a map.

    Attributes:
        area: (p,) areas of the target for which they stand, not negative, some positive.
        f_z, f_zbar: (p,) the derivatives there.
        scale: the mean scale; positive.
        z: (p,) positions of the samples in the source, and
        w: (p,) in the target; empty if not needed.
    """

    area: Real
    f_z: Complex
    f_zbar: Complex
    scale: float
    z: Complex = field(default_factory=lambda: np.empty(0, np.complex128))
    w: Complex = field(default_factory=lambda: np.empty(0, np.complex128))

    @cached_property
    def stretches(self) -> Real:
        """(p,) the larger of stretch and shrinkage relative to the mean scale, max(s₁, 1 / s₂); inf where folded."""
        major, minor = np.abs(self.f_z) + np.abs(self.f_zbar), np.abs(self.f_z) - np.abs(self.f_zbar)
        return np.maximum(major / self.scale, _ratio(np.full_like(minor, self.scale), minor))

    @cached_property
    def dilatations(self) -> Real:
        """Dilatation s₁ / s₂; inf where folded, 1 where nothing is shown; shape (p,)."""
        larger, smaller = np.abs(self.f_z), np.abs(self.f_zbar)
        return np.where(larger + smaller > 0, _ratio(larger + smaller, larger - smaller), 1.0)

    @cached_property
    def scales(self) -> Real:
        """Scale √|J| relative to the mean scale; shape (p,)."""
        return np.sqrt(np.abs(np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2)) / self.scale

    def energies(self, balance: float = 1.0) -> dict[str, Real]:
        """Return the parts of the balanced energy, (p,) each.

        They are `angle`, (s₁/s₂ + s₂/s₁) / 2; `area`, (d + 1/d) / 2, where d is the area scale relative to the
        mean; and `total`, angle · area^θ, where θ is the balance. They are 1 for a similarity, and inf where
        folded.
        """
        # The solver's density is in core/include/iccm/density.h; it does not return the parts, which the report
        # lists separately.
        d = (np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2) / self.scale**2
        angle = _ratio((np.abs(self.f_z) ** 2 + np.abs(self.f_zbar) ** 2) / self.scale**2, d)
        area = 0.5 * (d + _ratio(np.ones_like(d), d))
        return {"angle": angle, "area": area, "total": angle * area**balance}

    def within(self, factor: float) -> float:
        """Return the share of the target whose scale is within a factor of the mean."""
        is_within = (self.scales <= factor) & (self.scales >= 1 / factor)
        return min(1.0, float(self.area @ is_within / self.area.sum()))

    @cached_property
    def stretch_p95(self) -> float:
        """The stretch that is exceeded on 5 % of the target."""
        return self.quantile(self.stretches, 0.95)

    @cached_property
    def dilatation_p95(self) -> float:
        """The dilatation that is exceeded on 5 % of the target."""
        return self.quantile(self.dilatations, 0.95)

    @cached_property
    def strain(self) -> tuple[float, float] | None:
        """Stretch and dilatation that are exceeded on 5 % of the target, if one of them is large; else None."""
        stretch, dilatation = self.stretch_p95, self.dilatation_p95
        return (stretch, dilatation) if stretch > STRETCHED_P95 or dilatation > DILATED_P95 else None

    @property
    def squeezed(self) -> float:
        """The share on which the map nearly folds, with a dilatation over SQUEEZED_DILATATION.

        It is the larger of the shares of source and target.
        """
        source_area = self.area / np.maximum(np.abs(np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2), 1e-300)
        on = self.dilatations > SQUEEZED_DILATATION
        return max(float(area @ on / area.sum()) for area in (self.area, source_area))

    @property
    def turn(self) -> float:
        """Mean rotation of the picture in degrees, counter-clockwise, in (-180, 180].

        It is that of the mean of f_z / |f_z|.
        """
        size = np.abs(self.f_z)
        mean = self.area @ np.divide(self.f_z, size, out=np.zeros_like(self.f_z), where=size > 0)
        return float(np.degrees(np.angle(mean)))

    def quantile(self, values: Real, share: float) -> float:
        """Return the smallest of values (p,) that is not exceeded on a share of the target."""
        return weighted_quantile(values, self.area, share)

    def report(self) -> dict:
        """Return the figures as in the JSON report."""
        return {
            "stretch": {"p50": self.quantile(self.stretches, 0.5), "p95": self.stretch_p95}
            | {"max": float(self.stretches.max())},
            "dilatation": {"median": self.quantile(self.dilatations, 0.5), "p95": self.dilatation_p95}
            | {"max": float(self.dilatations.max())},
            "scale": {"within2": self.within(2), "within4": self.within(4)},
            "turn": self.turn,
        }


def weighted_quantile(values: Real, weights: Real, share: float) -> float:
    """Return the smallest of values (p,) that is not exceeded by values with a share of the total weight."""
    order = np.argsort(values)
    summed = np.cumsum(weights[order])
    return float(values[order][min(np.searchsorted(summed, share * summed[-1]), values.size - 1)])


def _ratio(a: Real | float, b: Real) -> Real:
    """Return a / b; inf where b is not positive."""
    return np.where(b > 0, a / np.where(b > 0, b, 1), np.inf)


# Barycentric coordinates in a triangle: three points that integrate quadratics exactly (Strang & Fix), and its corners.
_INNER = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
_POINTS = np.concatenate([_INNER, np.eye(3)])


def of_triangles(
    map: TriangulatedMap, triangles: Index | None = None, shares: Real | None = None
) -> Distortion:
    """Return samples in each triangle, or in the chosen ones.

    Three samples share the triangle's area in the image, or a share of it; its corners are samples with area 0,
    for maxima. The mean scale is that of these parts.

    Args:
        map: the map.
        triangles: (k,) triangles; all by default.
        shares: (k,) shares of their areas; one by default.
    """
    triangles = np.arange(len(map.faces)) if triangles is None else triangles
    a, b, c = map.corners[triangles].T
    d, e, f = map.source[map.faces[triangles]].T
    area, source_area = (0.5 * np.abs(turn) for turn in (cross(b - a, c - a), cross(e - d, f - d)))
    if shares is not None:
        area, source_area = area * shares, source_area * shares
    triangle = np.repeat(triangles, len(_POINTS))
    weight = np.outer(area, np.repeat([1 / 3, 0.0], 3)).ravel()
    place = np.tile(_POINTS, (triangles.size, 1))
    f_z, f_zbar = map.derivatives_at(triangle, place)
    return Distortion(weight, f_z, f_zbar, float(np.sqrt(area.sum() / source_area.sum())))


def in_middles(map: TriangulatedMap) -> Distortion:
    """Return one sample at the centroid of each triangle, in order, with its position."""
    a, b, c = map.corners.T
    d, e, f = map.source[map.faces].T
    area, source_area = (0.5 * np.abs(turn) for turn in (cross(b - a, c - a), cross(e - d, f - d)))
    triangle, place = np.arange(len(map.faces)), np.full((len(map.faces), 3), 1 / 3)
    z, p, q = map.jet_at(triangle, place)
    scale = float(np.sqrt(area.sum() / source_area.sum()))
    return Distortion(area, *inverted(p, q), scale, z, (a + b + c) / 3)


def inside_triangles(map: TriangulatedMap) -> Distortion:
    """Return three samples in each triangle, with their positions, and without the corners, where surfaces bend."""
    a, b, c = map.corners.T
    area = 0.5 * np.abs(cross(b - a, c - a))
    triangle = np.repeat(np.arange(len(map.faces)), len(_INNER))
    place = np.tile(_INNER, (len(map.faces), 1))
    w = np.einsum("pk,pk->p", place, map.corners[triangle])
    z, p, q = map.jet_at(triangle, place)
    return Distortion(np.repeat(area / len(_INNER), len(_INNER)), *inverted(p, q), 1.0, z, w)


def of_inverse(map: AnyMap, w: Complex, scale: float) -> Distortion:
    """Return samples at points w (p,) spread evenly over the target, through the inverse of a map.

    At points without a preimage nothing is shown: scale 0 and infinite stretch.

    Args:
        map: source → target.
        w: points inside the target.
        scale: the mean scale.
    """
    z, away = map.extended_inverse(w) if isinstance(map, TriangulatedMap) else extended_inverse(map, w)
    _, f_z, f_zbar = map.jet(z)
    is_outside = (away > 0) | ~np.isfinite(f_z) | ~np.isfinite(f_zbar)
    return Distortion(
        np.ones(w.size), np.where(is_outside, 0, f_z), np.where(is_outside, 0, f_zbar), scale, z, w
    )


def dilatation(f_z: Complex, f_zbar: Complex) -> np.ndarray:
    """Return the quasi-conformal dilatation K = (|f_z| + |f_z̄|) / (|f_z| - |f_z̄|) (paper Eq. 9).

    It is 1 where the map is conformal, and inf where it folds.
    """
    major, minor = np.abs(f_z) + np.abs(f_zbar), np.abs(f_z) - np.abs(f_zbar)
    return np.where(minor > 0, major / np.where(minor > 0, minor, 1.0), np.inf)


def area_scale(f_z: Complex, f_zbar: Complex) -> np.ndarray:
    """Return the signed area scale |f_z|² - |f_z̄|² (paper §3.2), the Jacobian of f as a map of the plane."""
    return np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
