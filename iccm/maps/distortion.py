"""Distortion of a map over the target's area: the figures of the report, from samples of any kind of map.

A sample stands for a piece of the target: its area, and f_z and f_z̄ there. Points spread over the source count by
|J| times their share of the source's area; samples of area 0 count for the largest values alone. Lengths are relative
to the mean scale, the root of the target's area by the source's, so that a similarity has stretch 1.
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
)  # over 5 % of the target: from here pictures look stretched into stripes
SQUEEZED_DILATATION = 100.0  # dilatation from which a triangle counts as all but folded (by hand)


@dataclass(frozen=True, eq=False)
class Distortion:
    """Samples of a map.

    Attributes:
        area: (p,) areas of the target that they stand for, not negative, some positive.
        f_z, f_zbar: (p,) the derivatives there.
        scale: the mean scale; positive.
        z: (p,) where the samples are in the source, and
        w: (p,) in the target; empty where nobody asks.
    """

    area: Real
    f_z: Complex
    f_zbar: Complex
    scale: float
    z: Complex = field(default_factory=lambda: np.empty(0, np.complex128))
    w: Complex = field(default_factory=lambda: np.empty(0, np.complex128))

    @cached_property
    def stretches(self) -> Real:
        """(p,) max(s₁, 1 / s₂) of the singular values by the mean scale; inf where folded."""
        major, minor = np.abs(self.f_z) + np.abs(self.f_zbar), np.abs(self.f_z) - np.abs(self.f_zbar)
        return np.maximum(major / self.scale, _ratio(np.full_like(minor, self.scale), minor))

    @cached_property
    def dilatations(self) -> Real:
        """(p,) s₁ / s₂; inf where folded, 1 where nothing is painted."""
        size, other = np.abs(self.f_z), np.abs(self.f_zbar)
        return np.where(size + other > 0, _ratio(size + other, size - other), 1.0)

    @cached_property
    def scales(self) -> Real:
        """(p,) √|J| by the mean scale."""
        return np.sqrt(np.abs(np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2)) / self.scale

    def energies(self, balance: float = 1.0) -> dict[str, Real]:
        """Return (p,) what the balanced energy is made of: `angle` (s₁/s₂ + s₂/s₁) / 2, `area` (d + 1/d) / 2 with d the
        scale of areas by the mean, and `total` angle · area^θ, with θ the balance; 1 for a similarity, inf where
        folded.
        """
        # The solver's density is in core/include/iccm/density.h; it has no parts, which figures show one by one.
        d = (np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2) / self.scale**2
        angle = _ratio((np.abs(self.f_z) ** 2 + np.abs(self.f_zbar) ** 2) / self.scale**2, d)
        area = 0.5 * (d + _ratio(np.ones_like(d), d))
        return {"angle": angle, "area": area, "total": angle * area**balance}

    def within(self, factor: float) -> float:
        """Return the share of the target whose scale is within a factor of the mean."""
        near = (self.scales <= factor) & (self.scales >= 1 / factor)
        return min(1.0, float(self.area @ near / self.area.sum()))

    @cached_property
    def strain(self) -> tuple[float, float] | None:
        """Stretch and dilatation beyond which 5 % of the target are, where that is far; else None."""
        stretch, dilatation = (self.quantile(each, 0.95) for each in (self.stretches, self.dilatations))
        return (stretch, dilatation) if stretch > STRETCHED_P95 or dilatation > DILATED_P95 else None

    @property
    def squeezed(self) -> float:
        """The larger of the shares of source and target on which the map all but folds: dilatation over
        SQUEEZED_DILATATION."""
        before = self.area / np.maximum(np.abs(np.abs(self.f_z) ** 2 - np.abs(self.f_zbar) ** 2), 1e-300)
        on = self.dilatations > SQUEEZED_DILATATION
        return max(float(area @ on / area.sum()) for area in (self.area, before))

    @property
    def turn(self) -> float:
        """By how many degrees the picture is turned counter-clockwise, in (-180, 180]: of the mean of f_z / |f_z|."""
        size = np.abs(self.f_z)
        mean = self.area @ np.divide(self.f_z, size, out=np.zeros_like(self.f_z), where=size > 0)
        return float(np.degrees(np.angle(mean)))

    def quantile(self, values: Real, share: float) -> float:
        """Return the least of values (p,) that those of a share of the target do not exceed."""
        return weighted_quantile(values, self.area, share)

    def report(self) -> dict:
        """Return as in the JSON report."""
        return {
            "stretch": self._figures(self.stretches, ("p50", 0.5), ("p95", 0.95)),
            "dilatation": self._figures(self.dilatations, ("median", 0.5), ("p95", 0.95)),
            "scale": {"within2": self.within(2), "within4": self.within(4)},
            "turn": self.turn,
        }

    def _figures(self, values: Real, *names: tuple[str, float]) -> dict[str, float]:
        return {**{name: self.quantile(values, share) for name, share in names}, "max": float(values.max())}


def weighted_quantile(values: Real, weights: Real, share: float) -> float:
    """Return the least of values (p,) that those of a share of their weights (p,) do not exceed."""
    order = np.argsort(values)
    summed = np.cumsum(weights[order])
    return float(values[order][min(np.searchsorted(summed, share * summed[-1]), values.size - 1)])


def _ratio(a: Real | float, b: Real) -> Real:
    """Return a / b; inf where b is not positive."""
    return np.where(b > 0, a / np.where(b > 0, b, 1), np.inf)


# Barycentric coordinates in a triangle: three points that integrate quadratics exactly (Strang & Fix), and its corners.
_INNER = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
_POINTS = np.concatenate([_INNER, np.eye(3)])


def of_triangles(map: TriangulatedMap, chosen: Index | None = None, shares: Real | None = None) -> Distortion:
    """Three samples in each triangle, or each of those chosen, which share its area of the image, or a share of it,
    and its corners for the largest values. The mean scale is that of these parts."""
    chosen = np.arange(len(map.faces)) if chosen is None else chosen
    a, b, c = map.corners[chosen].T
    d, e, f = map.source[map.faces[chosen]].T
    area, before = (0.5 * np.abs(turn) for turn in (cross(b - a, c - a), cross(e - d, f - d)))
    if shares is not None:
        area, before = area * shares, before * shares
    triangle = np.repeat(chosen, len(_POINTS))
    weight = np.outer(area, np.repeat([1 / 3, 0.0], 3)).ravel()
    place = np.tile(_POINTS, (chosen.size, 1))
    f_z, f_zbar = map.derivatives_at(triangle, place)
    return Distortion(weight, f_z, f_zbar, float(np.sqrt(area.sum() / before.sum())))


def in_middles(map: TriangulatedMap) -> Distortion:
    """Return one sample in the middle of each triangle, in their order, with its place."""
    a, b, c = map.corners.T
    d, e, f = map.source[map.faces].T
    area, before = (0.5 * np.abs(turn) for turn in (cross(b - a, c - a), cross(e - d, f - d)))
    triangle, place = np.arange(len(map.faces)), np.full((len(map.faces), 3), 1 / 3)
    z, p, q = map.jet_at(triangle, place)
    scale = float(np.sqrt(area.sum() / before.sum()))
    return Distortion(area, *inverted(p, q), scale, z, (a + b + c) / 3)


def inside_triangles(map: TriangulatedMap) -> Distortion:
    """Return the same without the corners, where surfaces that the planes stand for bend; with the samples' places."""
    a, b, c = map.corners.T
    area = 0.5 * np.abs(cross(b - a, c - a))
    triangle = np.repeat(np.arange(len(map.faces)), len(_INNER))
    place = np.tile(_INNER, (len(map.faces), 1))
    w = np.einsum("pk,pk->p", place, map.corners[triangle])
    z, p, q = map.jet_at(triangle, place)
    return Distortion(np.repeat(area / len(_INNER), len(_INNER)), *inverted(p, q), 1.0, z, w)


def of_inverse(map: AnyMap, w: Complex, scale: float) -> Distortion:
    """Return points w (p,) spread evenly over the target, through the inverse of a map.

    Where no point of the source goes nothing is painted: scale 0 and infinite stretch.

    Args:
        map: source → target.
        w: points inside the target.
        scale: the mean scale.
    """
    z, away = map.extended_inverse(w) if isinstance(map, TriangulatedMap) else extended_inverse(map, w)
    _, f_z, f_zbar = map.jet(z)
    lost = (away > 0) | ~np.isfinite(f_z) | ~np.isfinite(f_zbar)
    return Distortion(np.ones(w.size), np.where(lost, 0, f_z), np.where(lost, 0, f_zbar), scale, z, w)
