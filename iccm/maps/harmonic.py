"""Harmonic maps in Cauchy-Green coordinates: f = Φ + Ψ, holomorphic plus antiholomorphic (paper §3.2, Eq. 8)."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload

import numpy as np

from ..arrays import Complex, Numbers, Pairs, Real, as_points
from ..axes import UP, is_pairs, on_pairs
from ..curve import Curve
from ..plane import bounding_box
from . import cauchy_green

ROUNDING_SHARE = 1e-9  # relative to the polygon's diagonal, and
AT_VERTEX_SHARE = 1e-12
"""Relative to the diagonal: points this close to a vertex see its edges at an uncertain angle, and are moved to
it.
"""
ON_BOUNDARY_SHARE = 1e-15  # relative to the coordinates: points that are outside by less are on the boundary


@dataclass(frozen=True, eq=False)
class HarmonicMap:
    """The map f(z) = C(z) φ + conj(C(z)) ψ, planar harmonic, on the inside of a polygon.

    Points outside by at most `slack` are mapped like the closest point of the polygon; farther out the map is
    NaN.

    Attributes:
        polygon: (n,) vertices of the source domain, counter-clockwise.
        phi: (n,) coefficients of the holomorphic part Φ = C φ.
        psi: (n,) coefficients of the antiholomorphic part Ψ = conj(C) ψ: the *conjugated* ψ̂ of Eq. 8 in the
            paper; this is the only place where that convention is decided. All zero exactly if the map is
            conformal.
        slack: how far the outline that the polygon stands for may be outside of it.
        axes: meaning of pairs of real numbers on either side, see `iccm.axes`.
    """

    polygon: Complex
    phi: Complex
    psi: Complex
    slack: float = 0.0
    axes: tuple[str, str] = UP

    @property
    def conformal(self) -> bool:
        """Whether Ψ is zero."""
        return not self.psi.any()

    @overload
    def __call__(self, z: Pairs) -> Real: ...

    @overload
    def __call__(self, z: complex) -> complex: ...

    @overload
    def __call__(self, z: Numbers) -> Complex: ...

    def __call__(self, z: Pairs | complex | Numbers) -> Complex | Real | complex:
        """Evaluate f at complex points of any shape, or at pairs (…, 2), in the same form; NaN outside."""
        if is_pairs(z):
            return on_pairs(self.__call__, z, self.axes)
        z = as_points(z)
        points = self.placed(z.ravel())
        c = self._blocks(cauchy_green.coordinates, points)
        out = np.concatenate([m @ self.phi + (m.conj() @ self.psi) for m in c])
        out[np.isnan(points)] = complex(np.nan, np.nan)
        return out.reshape(z.shape)[()]

    def jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f, f_z and f_z̄ at points of any shape at once; NaN outside, the derivatives also at vertices."""
        z = as_points(z)
        jet = self.jet_inside(self.placed(z.ravel()), threads)
        return tuple(values.reshape(z.shape) for values in jet)  # type: ignore[return-value]

    def jet_inside(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f, f_z and f_z̄ at points (p,) that are inside or on the boundary, or are NaN."""
        if self.conformal:
            (value,), (rate,) = cauchy_green.jets(self.polygon, self.phi[None], z, threads)
            return value, rate, np.where(np.isnan(rate), rate, 0)
        coefficients = np.stack([self.phi, self.psi.conj()])
        values, rates = cauchy_green.jets(self.polygon, coefficients, z, threads)
        return values[0] + values[1].conj(), rates[0], rates[1].conj()

    def centred(self) -> "tuple[HarmonicMap, complex, complex]":
        """Return the map relative to the centres of source and image, and these centres.

        Far from the origin, precision is lost. The coordinates sum up to 1, so that shifting the coefficients
        shifts the map.
        """
        source, image = (0.5 * sum(bounding_box(plane)) for plane in (self.polygon, self.phi + self.psi))
        return replace(self, polygon=self.polygon - source, phi=self.phi - image), source, image

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the polygon's bounding box."""
        return self.outline.diagonal

    @property
    def rims(self) -> list[Complex]:
        """The boundaries of the source, as in `TriangulatedMap`: the polygon."""
        return [self.polygon]

    @cached_property
    def outline(self) -> Curve:
        """The polygon as a curve."""
        return Curve(self.polygon)

    def placed(self, z: Complex) -> Complex:
        """Return (p,) points, those outside moved to the closest point of the polygon.

        Points that are too far outside become NaN.
        """
        out = z.copy()
        beyond = np.flatnonzero(~self.outline.contains(z))
        finite = beyond[np.isfinite(z[beyond])]
        out[beyond] = complex(np.nan, np.nan)
        if finite.size:
            edge, t = self.outline.locate(self.outline.closest(z[finite]))
            end = np.roll(self.polygon, -1)[edge]
            corner, foot = np.where(t < 0.5, self.polygon[edge], end), self.polygon[edge] * (1 - t) + end * t
            gap, digits = np.abs(foot - z[finite]), ON_BOUNDARY_SHARE * float(np.abs(self.polygon).max())
            reach = max(self.slack, ROUNDING_SHARE * self.outline.diagonal, digits)
            moved_points = np.where(gap <= digits, z[finite], foot)
            moved_points = np.where(
                np.abs(moved_points - corner) <= max(AT_VERTEX_SHARE * self.outline.diagonal, 4 * digits),
                corner,
                moved_points,
            )
            out[finite] = np.where(gap <= reach, moved_points, complex(np.nan, np.nan))
        return out

    def derivatives(self, z: Complex) -> tuple[Complex, Complex]:
        """Return the Wirtinger derivatives f_z = ½(∂_x - i∂_y) f and f_z̄ = ½(∂_x + i∂_y) f.

        They are NaN outside and at vertices. The paper swaps the two operators under Eq. 9 and drops the ½.
        """
        z = as_points(z)
        points = self.placed(z.ravel())
        pairs = [(m @ self.phi, m.conj() @ self.psi) for m in self._blocks(cauchy_green.derivatives, points)]
        f_z, f_zbar = (np.concatenate(part) for part in zip(*pairs))
        f_z[np.isnan(points)] = f_zbar[np.isnan(points)] = complex(np.nan, np.nan)
        return f_z.reshape(z.shape), f_zbar.reshape(z.shape)

    def _blocks(self, coordinates, z: Complex):
        """Yield the coordinate matrix of z in blocks of bounded memory, at least one."""
        for rows in cauchy_green.blocks(z.size, self.polygon.size) or [slice(0, 0)]:
            yield coordinates(self.polygon, z[rows])
