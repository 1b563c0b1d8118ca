"""The energies of the paper, each a matrix, a weight and a target that may follow the image.

Every term is E(x) = weight · Σ_j measure_j |(M x)_j - target_j|² with coefficients x = φ, or x = (φ, ψ) for a harmonic
map. Lengths are relative to the radius of the normalised shapes, and measures of curves sum to one. So weights depend
neither on the scale of the input nor on the number of samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Real
from ..curve import Curve
from ..maps import cauchy_green


class Target(NamedTuple):
    """Target of a term: positions and, for the first-order distance, unit normals there."""

    points: Complex
    normals: Complex | None = None


@dataclass(frozen=True, eq=False)
class Basis:
    """The basis functions of a map: C for a conformal map, C and conj(C) for a harmonic one (paper Eq. 8)."""

    polygon: Complex
    harmonic: bool = False

    def positions(self, z: Complex) -> Complex:
        """Return the (p, k) matrix of f at z."""
        return self._both(cauchy_green.coordinates(self.polygon, z))

    def second_derivatives(self, z: Complex) -> Complex:
        """Return the ((1 or 2)·p, k) matrix of second derivatives at z, which must not be vertices.

        The rows of Φ″ = D2 φ are followed by those of Ψ's second derivative by z̄, conj(D2) ψ. They are separate since
        their phases change in opposite directions when the plane is rotated.
        """
        return self._apart(cauchy_green.second_derivatives(self.polygon, z))

    def antiholomorphic(self, z: Complex) -> Complex:
        """Return the (p, k) matrix of f_z̄ = conj(D) ψ at z, which must not be vertices."""
        d = cauchy_green.derivatives(self.polygon, z).conj()
        return np.hstack([np.zeros_like(d), d])

    def inconsistency(self) -> Complex:
        """Return the ((1 or 2)·n, k) matrix of the boundary values that the coordinates do not reproduce.

        That is (C_v - I) φ, and below it the same for ψ.
        """
        defect = cauchy_green.coordinates(self.polygon, self.polygon) - np.eye(self.polygon.size)
        return self._apart(defect)

    def similarity(self, scale: complex, shift: complex) -> Complex:
        """Return the coefficients of z ↦ scale · z + shift."""
        return self.coefficients(scale * self.polygon + shift)

    def coefficients(self, phi: Complex, psi: Complex | None = None) -> Complex:
        """Return the coefficients of a map, given φ and ψ."""
        if not self.harmonic:
            return phi
        return np.concatenate([phi, np.zeros_like(phi) if psi is None else psi])

    def split(self, x: Complex) -> tuple[Complex, Complex]:
        """Return φ and ψ, given coefficients x."""
        n = self.polygon.size
        return x[:n], x[n:] if self.harmonic else np.zeros(n, dtype=np.complex128)

    def _both(self, matrix: Complex) -> Complex:
        return np.hstack([matrix, matrix.conj()]) if self.harmonic else matrix

    def _apart(self, matrix: Complex) -> Complex:
        """Return [[M, 0], [0, conj M]], which acts on φ and ψ separately."""
        if not self.harmonic:
            return matrix
        zero = np.zeros_like(matrix)
        return np.block([[matrix, zero], [zero, matrix.conj()]])


@dataclass(frozen=True, eq=False)
class EnergyTerm:
    """One energy.

    Attributes:
        name: its key in reports.
        weight: its factor in the total.
        matrix: (r, k) complex.
        measure: (r,) weights of the rows.
        follow: the local step: from the image M x (r,) to the Target. Constant for pins, zero for regularizers.
        tangent: whether its targets have normals (first order, §3.4).
    """

    name: str
    weight: float
    matrix: Complex
    measure: Real
    follow: Callable[[Complex], Target]
    tangent: bool = False

    @property
    def scale(self) -> Real:
        """Factors of the rows in the least squares system: square roots of weight · measure; shape (r,)."""
        return np.sqrt(self.weight * self.measure)

    def energy(self, x: Complex, target: Target) -> float:
        """Return E(x) for a given target."""
        return float(self.weight * np.sum(self.measure * np.abs(self.matrix @ x - target.points) ** 2))


def closest(curve: Curve, *, tangent: bool) -> Callable[[Complex], Target]:
    """Return the local step of Algorithm 1: closest points of a curve.

    With `tangent`, the targets have normals for the first-order distance (Eq. 13).
    """

    def follow(image: Complex) -> Target:
        edge, t = curve.locate(np.minimum(curve.closest(image), np.nextafter(curve.length, 0)))
        foot = curve.z[edge] + t * curve.edges[edge]
        return Target(foot, _normals(curve, image, foot, edge) if tangent else None)

    return follow


def _normals(curve: Curve, image: Complex, foot: Complex, edge) -> Complex:
    """Return unit normals of the squared distance at closest points.

    They have the direction of the offset if that is not zero (at corners), else that of the edge's normal.
    """
    offset = image - foot
    away = np.abs(offset)
    is_apart = away > 1e-12 * curve.diagonal
    return np.where(is_apart, offset / np.where(is_apart, away, 1.0), curve.normals[edge])


def fixed(points: Complex) -> Callable[[Complex], Target]:
    """Return a local step with a constant target."""
    target = Target(points)
    return lambda image: target


def closeness(basis: Basis, z: Complex, measure: Real, curve: Curve, *, tangent: bool = False) -> EnergyTerm:
    """Return E_c = ‖C f̂ - ŵ‖² on boundary samples z (§2.2), or its first-order form (§3.4)."""
    return EnergyTerm("closeness", 1.0, basis.positions(z), measure, closest(curve, tangent=tangent), tangent)


def points(basis: Basis, source: Complex, target: Complex, weight: float) -> EnergyTerm:
    """Return E_p = β‖C_P f̂ - v̂‖² (§3.1), the mean over the pins."""
    return EnergyTerm("pins", weight, basis.positions(source), _even(source.size), fixed(target))


def stroke(
    basis: Basis, source: Complex, target: Curve, weight: float, *, tangent: bool = False
) -> EnergyTerm:
    """Return E_s2s = γ‖C_sk f̂ - t̂‖² (§3.3), the mean over the samples of one stroke."""
    follow = closest(target, tangent=tangent)
    return EnergyTerm("strokes", weight, basis.positions(source), _even(source.size), follow, tangent)


def quasiconformal(basis: Basis, z: Complex, measure: Real, weight: float) -> EnergyTerm:
    """Return E_q = ‖conj(D) ψ‖² (§3.2, Eq. 10)."""
    return EnergyTerm("quasiconformal", weight, basis.antiholomorphic(z), measure, fixed(np.zeros_like(z)))


def smoothness(basis: Basis, z: Complex, measure: Real, weight: float) -> EnergyTerm:
    """Return E_s = α‖D2 f̂‖² (§3.3): |Φ″|² + |Ψ″|² at z, in two rows per sample if the map is harmonic."""
    return _vanishing("smoothness", weight, basis.second_derivatives(z), measure)


def consistency(basis: Basis, measure: Real, weight: float) -> EnergyTerm:
    """Return μ‖(C_v - I) f̂‖², which is zero for boundary values that the coordinates reproduce. Not in the paper.

    Half of the span of C is not consistent in this way; least squares would use it to fit noise, which folds the map.
    """
    return _vanishing("consistency", weight, basis.inconsistency(), measure)


def _vanishing(name: str, weight: float, matrix: Complex, measure: Real) -> EnergyTerm:
    """Return a term with target zero; if the matrix has rows for φ and for ψ, both get the same measure."""
    rows = matrix.shape[0]
    return EnergyTerm(
        name, weight, matrix, np.tile(measure, rows // measure.size), fixed(np.zeros(rows, complex))
    )


def _even(count: int) -> Real:
    return np.full(count, 1.0 / count)
