"""Initial maps: by arclength (paper §2.2), or from the constraints alone (§3.1)."""

from dataclasses import replace

import numpy as np
import scipy.linalg

from ..arrays import Complex, Real
from ..curve import Curve
from ..plane import Similarity
from .energies import Basis, EnergyTerm, Target, fixed, points, smoothness
from .least_squares import LeastSquares
from .normalised import NormalisedProblem, measure_of

LEAST_SHRINKAGE_RATIO = 0.05  # a fitted similarity with a smaller scale is not meaningful
PIN_RANK_SHARE = 1e-6
"""Relative to the largest singular value of the pins' coordinates: smaller ones mean that pins coincide."""


def arclength(problem: NormalisedProblem, t: Real, s: Real) -> Complex:
    """Return ŵ⁰: points of the target at the same shares of the boundary's length as the samples of the source.

    The first vertex of the source's outline corresponds to that of the target's.

    Args:
        problem: the problem, with a target.
        t: (k,) positions of the samples on each edge, as shares of the edge.
        s: (n,) the source's arclengths at the polygon's vertices, which may start anywhere.
    """
    assert problem.target is not None
    ahead = np.diff(np.append(s, s[0] + problem.source.length))
    share = (s[:, None] + ahead[:, None] * t).ravel() / problem.source.length
    return problem.target.at(share * problem.target.length)


def from_constraints(problem: NormalisedProblem, basis: Basis, polygon: Curve) -> Complex:
    """Return the coefficients of the map that minimizes the pins' energy (§3.1).

    The energy does not determine the map. Among its minima, this is the one closest to a similarity, smooth, and
    mapping strokes by arclength.
    """
    source, target = constraint_points(problem)
    source = polygon.pulled_in(source)
    scale, shift = similarity(source, target, problem.upright)
    conformal, missing = Basis(basis.polygon), target - (scale * source + shift)
    z, measure, pins = polygon.sample(1), measure_of(polygon, 1), problem.pins.shape[0]
    terms = [
        smoothness(conformal, z, measure, 1e-4),
        EnergyTerm("size", 1e-4, conformal.positions(z), measure, fixed(np.zeros_like(z))),
        points(conformal, source, missing, 1.0),
    ]
    x, free = least_norm(conformal.positions(source[:pins]), missing[:pins])
    reduced = LeastSquares([replace(t, matrix=t.matrix @ free) for t in terms])
    goals = [Target(t.follow(t.matrix @ x).points - t.matrix @ x) for t in terms]
    return basis.coefficients(x + free @ reduced.solve(goals) + conformal.similarity(scale, shift))


def least_norm(matrix: Complex, right: Complex) -> tuple[Complex, Complex]:
    """Return the least-norm minimum (n,) of ‖M x - right‖, and a basis (n, n - rank) of the kernel of M (k, n)."""
    if not right.size:
        return np.zeros(matrix.shape[1], complex), np.eye(matrix.shape[1], dtype=complex)
    u, s, vh = scipy.linalg.svd(matrix, lapack_driver="gesvd")
    rank = int(np.count_nonzero(s > PIN_RANK_SHARE * s[0]))
    x = vh[:rank].conj().T @ ((u[:, :rank].conj().T @ right) / s[:rank])
    return x, vh[rank:].conj().T


def constraint_points(problem: NormalisedProblem, count: int = 20) -> tuple[Complex, Complex]:
    """Return pins and their images, followed by `count` points at equal shares of the length of each stroke."""
    share = np.linspace(0, 1, count)
    source = [problem.pins[:, 0], *(a.at(share * a.length) for a, _ in problem.strokes)]
    target = [problem.pins[:, 1], *(b.at(share * b.length) for _, b in problem.strokes)]
    return np.concatenate(source), np.concatenate(target)


def similarity(source: Complex, target: Complex, least: complex) -> tuple[complex, complex]:
    """Return scale and shift of the least squares similarity; its scale is `least` if points do not determine it."""
    if not source.size:
        return least, 0j
    apart = float(np.sum(np.abs(source - source.mean()) ** 2)) > 1e-12
    scale = Similarity.fit(source, target).factor if apart else 0j
    if abs(scale) < LEAST_SHRINKAGE_RATIO:
        scale = least
    return scale, complex(target.mean() - scale * source.mean())
