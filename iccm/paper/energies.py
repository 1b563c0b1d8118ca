"""The energies of the paper, each a matrix, a weight and a target that may follow the image.

Every term reads  E(x) = weight · Σ_j measure_j |(M x)_j - target_j|²  in the coefficients x = φ, or x = (φ, ψ) for a
harmonic map. Lengths are relative to the radius of the normalised shapes, and measures of curves sum to one,
so the weights
do not depend on the scale of the input or on the number of samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from ..maps import cauchy_green


class Target(NamedTuple):
    """What a term pulls its points to: positions and, for the first order, unit normals there."""

    points: Complex
    normals: Complex | None = None


@dataclass(frozen=True, eq=False)
class Basis:
    """The functions a map is made of: C for a conformal map, C and conj(C) for a harmonic one (paper Eq. 8)."""

    polygon: Complex
    harmonic: bool = False

    def positions(self, z: Complex) -> Complex:
        """Return (p, k) matrix of f at z."""
        return self._both(cauchy_green.coordinates(self.polygon, z))

    def second_derivatives(self, z: Complex) -> Complex:
        """Return ((1 or 2)·p, k) matrix of Φ″ at z, off the vertices, and below it of Ψ's second derivative by z̄: D2 φ
        and conj(D2) ψ, each in separate rows, for their phases turn against each other with the plane.
        """
        return self._apart(cauchy_green.second_derivatives(self.polygon, z))

    def antiholomorphic(self, z: Complex) -> Complex:
        """Return (p, k) matrix of f_z̄ = conj(D) ψ at z, off the vertices."""
        d = cauchy_green.derivatives(self.polygon, z).conj()
        return np.hstack([np.zeros_like(d), d])

    def inconsistency(self) -> Complex:
        """Return ((1 or 2)·n, k) matrix of boundary values that the coordinates do not reproduce, (C_v - I) φ and its
        twin for ψ.
        """
        defect = cauchy_green.coordinates(self.polygon, self.polygon) - np.eye(self.polygon.size)
        return self._apart(defect)

    def similarity(self, scale: complex, shift: complex) -> Complex:
        """Coefficients of z ↦ scale · z + shift."""
        return self.coefficients(scale * self.polygon + shift)

    def coefficients(self, phi: Complex, psi: Complex | None = None) -> Complex:
        """Coefficients of a map from its φ and ψ."""
        if not self.harmonic:
            return phi
        return np.concatenate([phi, np.zeros_like(phi) if psi is None else psi])

    def split(self, x: Complex) -> tuple[Complex, Complex]:
        """φ and ψ of coefficients x."""
        n = self.polygon.size
        return x[:n], x[n:] if self.harmonic else np.zeros(n, dtype=np.complex128)

    def _both(self, matrix: Complex) -> Complex:
        return np.hstack([matrix, matrix.conj()]) if self.harmonic else matrix

    def _apart(self, matrix: Complex) -> Complex:
        """[[M, 0], [0, conj M]], which acts on φ and ψ apart."""
        if not self.harmonic:
            return matrix
        zero = np.zeros_like(matrix)
        return np.block([[matrix, zero], [zero, matrix.conj()]])


@dataclass(frozen=True, eq=False)
class Term:
    """One energy.

    Attributes:
        name: its key in reports.
        weight: its factor in the total.
        matrix: (r, k) complex.
        measure: (r,) weights of the rows.
        follow: from the image M x (r,) to the Target: the local step. Constant for pins, zero for regularisers.
        tangent: whether its targets carry normals (first order, §3.4).
    """

    name: str
    weight: float
    matrix: Complex
    measure: Real
    follow: Callable[[Complex], Target]
    tangent: bool = False

    @property
    def scale(self) -> Real:
        """(r,) square roots of weight · measure: what a row is multiplied by in the least squares."""
        return np.sqrt(self.weight * self.measure)

    def energy(self, x: Complex, target: Target) -> float:
        """E(x) for a given target."""
        return float(self.weight * np.sum(self.measure * np.abs(self.matrix @ x - target.points) ** 2))


def closest(curve: Curve, *, tangent: bool) -> Callable[[Complex], Target]:
    """Return the local step of Algorithm 1: closest points of a curve, with normals for the first-order distance (Eq.
    13).
    """

    def follow(image: Complex) -> Target:
        edge, t = curve.locate(np.minimum(curve.closest(image), np.nextafter(curve.length, 0)))
        foot = curve.z[edge] + t * curve.edges[edge]
        return Target(foot, _normals(curve, image, foot, edge) if tangent else None)

    return follow


def _normals(curve: Curve, image: Complex, foot: Complex, edge) -> Complex:
    """Return unit normals of the squared distance at its foot: the offset where there is one (corners), else the
    edge's.
    """
    offset = image - foot
    away = np.abs(offset)
    far = away > 1e-12 * curve.diagonal
    return np.where(far, offset / np.where(far, away, 1.0), curve.normals[edge])


def fixed(points: Complex) -> Callable[[Complex], Target]:
    """Return a target that does not follow the image."""
    target = Target(points)
    return lambda image: target


def closeness(basis: Basis, z: Complex, measure: Real, curve: Curve, *, tangent: bool = False) -> Term:
    """E_c = ‖C f̂ - ŵ‖² on boundary samples z (§2.2), or its first-order form (§3.4)."""
    return Term("closeness", 1.0, basis.positions(z), measure, closest(curve, tangent=tangent), tangent)


def points(basis: Basis, source: Complex, target: Complex, weight: float) -> Term:
    """E_p = β‖C_P f̂ - v̂‖² (§3.1), the mean over the pins."""
    return Term("pins", weight, basis.positions(source), _even(source.size), fixed(target))


def stroke(basis: Basis, source: Complex, target: Curve, weight: float, *, tangent: bool = False) -> Term:
    """E_s2s = γ‖C_sk f̂ - t̂‖² (§3.3), the mean over the samples of one stroke."""
    follow = closest(target, tangent=tangent)
    return Term("strokes", weight, basis.positions(source), _even(source.size), follow, tangent)


def quasiconformal(basis: Basis, z: Complex, measure: Real, weight: float) -> Term:
    """E_q = ‖conj(D) ψ‖² (§3.2, Eq. 10)."""
    return Term("quasiconformal", weight, basis.antiholomorphic(z), measure, fixed(np.zeros_like(z)))


def smoothness(basis: Basis, z: Complex, measure: Real, weight: float) -> Term:
    """E_s = α‖D2 f̂‖² (§3.3): |Φ″|² + |Ψ″|² at z, in two rows a sample where the map is harmonic."""
    return _vanishing("smoothness", weight, basis.second_derivatives(z), measure)


def consistency(basis: Basis, measure: Real, weight: float) -> Term:
    """μ‖(C_v - I) f̂‖²: boundary values that the coordinates reproduce. Not in the paper.

    Half of the span of C is not self-consistent; the least squares would use it to fit noise, which folds the map.
    """
    return _vanishing("consistency", weight, basis.inconsistency(), measure)


def _vanishing(name: str, weight: float, matrix: Complex, measure: Real) -> Term:
    """Return a term that pulls to zero; of a matrix with rows for φ and for ψ, both are measured alike."""
    rows = matrix.shape[0]
    return Term(name, weight, matrix, np.tile(measure, rows // measure.size), fixed(np.zeros(rows, complex)))


def _even(count: int) -> Real:
    return np.full(count, 1.0 / count)
