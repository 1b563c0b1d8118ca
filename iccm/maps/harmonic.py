"""Harmonic maps in Cauchy-Green coordinates: f = Φ + Ψ, holomorphic plus antiholomorphic (paper §3.2, Eq. 8)."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Complex
from . import cauchy_green


@dataclass(frozen=True, eq=False)
class HarmonicMap:
    """f(z) = C(z) φ + conj(C(z)) ψ, planar harmonic, on the inside of a polygon.

    Attributes:
        polygon: (n,) vertices of the source domain, counter-clockwise.
        phi: (n,) coefficients of the holomorphic part Φ = C φ.
        psi: (n,) coefficients of the antiholomorphic part Ψ = conj(C) ψ: the *conjugated* ψ̂ of Eq. 8 in the paper,
            and the only place where that is decided. All zero exactly when the map is conformal.
    """

    polygon: Complex
    phi: Complex
    psi: Complex

    @property
    def conformal(self) -> bool:
        """Whether Ψ is absent."""
        return not self.psi.any()

    def __call__(self, z: Complex) -> Complex:
        """f at points inside or on the boundary; any shape in, the same shape out."""
        z = np.asarray(z, dtype=np.complex128)
        c = self._blocks(cauchy_green.coordinates, z.ravel())
        return np.concatenate([m @ self.phi + (m.conj() @ self.psi) for m in c]).reshape(z.shape)

    def derivatives(self, z: Complex) -> tuple[Complex, Complex]:
        """Wirtinger derivatives f_z = ½(∂_x - i∂_y) f and f_z̄ = ½(∂_x + i∂_y) f, off the vertices.

        The paper swaps the two operators under Eq. 9 and drops the ½.
        """
        z = np.asarray(z, dtype=np.complex128)
        pairs = [
            (m @ self.phi, m.conj() @ self.psi) for m in self._blocks(cauchy_green.derivatives, z.ravel())
        ]
        f_z, f_zbar = (np.concatenate(part).reshape(z.shape) for part in zip(*pairs))
        return f_z, f_zbar

    def _blocks(self, coordinates, z: Complex):
        """The coordinate matrix of z in blocks of bounded memory, at least one."""
        for rows in cauchy_green.blocks(z.size, self.polygon.size) or [slice(0, 0)]:
            yield coordinates(self.polygon, z[rows])


def dilatation(f_z: Complex, f_zbar: Complex) -> np.ndarray:
    """Quasi-conformal dilatation K = (|f_z| + |f_z̄|) / (|f_z| - |f_z̄|) (paper Eq. 9); 1 where conformal, inf
    where folded."""
    major, minor = np.abs(f_z) + np.abs(f_zbar), np.abs(f_z) - np.abs(f_zbar)
    return np.where(minor > 0, major / np.where(minor > 0, minor, 1.0), np.inf)


def area_scale(f_z: Complex, f_zbar: Complex) -> np.ndarray:
    """Signed area scale |f_z|² - |f_z̄|² (paper §3.2), the Jacobian of f as a map of the plane."""
    return np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
