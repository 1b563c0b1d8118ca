"""Initial maps: by arclength (paper §2.2), and from the constraints alone (§3.1)."""

from dataclasses import replace

import numpy as np
import scipy.linalg

from ..arrays import Complex, Real
from ..curve import Curve
from ..plane import Similarity
from .energies import Basis, Target, Term, fixed, points, smoothness
from .least_squares import System
from .normalised import NormalisedProblem, measure_of

LEAST_SHRINKAGE_RATIO = 0.05
"""A fitted similarity that shrinks the shape below this share of its size says nothing."""
PIN_RANK_SHARE = 1e-6
"""Singular values of the pins' coordinates below this share of the largest: as good as one place."""


def arclength(problem: NormalisedProblem, t: Real, s: Real) -> Complex:
    """ŵ⁰: the target's points at the source samples' shares of the boundary, the first vertex of one outline to the
    first of the other; samples lie at shares t (k,) of each edge, and s (n,) are the source's arclengths at the
    polygon's vertices, of which none need be its first.
    """
    assert problem.target is not None
    ahead = np.diff(np.append(s, s[0] + problem.source.length))
    share = (s[:, None] + ahead[:, None] * t).ravel() / problem.source.length
    return problem.target.at(share * problem.target.length)


def from_constraints(problem: NormalisedProblem, basis: Basis, polygon: Curve) -> Complex:
    """Coefficients of the map that minimises the pins' energy (§3.1), which leaves most of it free: of those the one
    closest to a similarity, that is smooth and meets strokes by arclength."""
    source, target = constraint_points(problem)
    source = polygon.pulled_in(source)
    scale, shift = similarity(source, target, problem.upright)
    conformal, missing = Basis(basis.polygon), target - (scale * source + shift)
    z, measure, pins = polygon.sample(1), measure_of(polygon, 1), problem.pins.shape[0]
    rest = [
        smoothness(conformal, z, measure, 1e-4),
        Term("size", 1e-4, conformal.positions(z), measure, fixed(np.zeros_like(z))),
        points(conformal, source, missing, 1.0),
    ]
    x, free = least_norm(conformal.positions(source[:pins]), missing[:pins])
    among = System([replace(t, matrix=t.matrix @ free) for t in rest])
    wanted = [Target(t.follow(t.matrix @ x).points - t.matrix @ x) for t in rest]
    return basis.coefficients(x + free @ among.solve(wanted) + conformal.similarity(scale, shift))


def least_norm(matrix: Complex, right: Complex) -> tuple[Complex, Complex]:
    """Return the least x (n,) that minimises ‖M x - right‖ for M (k, n), k < n, and a basis (n, n - rank) of what M
    does not see.
    """
    if not right.size:
        return np.zeros(matrix.shape[1], complex), np.eye(matrix.shape[1], dtype=complex)
    u, s, vh = scipy.linalg.svd(matrix, lapack_driver="gesvd")
    rank = int(np.count_nonzero(s > PIN_RANK_SHARE * s[0]))
    x = vh[:rank].conj().T @ ((u[:, :rank].conj().T @ right) / s[:rank])
    return x, vh[rank:].conj().T


def constraint_points(problem: NormalisedProblem, count: int = 20) -> tuple[Complex, Complex]:
    """Pins first, then strokes as `count` pins each at equal shares of their lengths."""
    share = np.linspace(0, 1, count)
    source = [problem.pins[:, 0], *(a.at(share * a.length) for a, _ in problem.strokes)]
    target = [problem.pins[:, 1], *(b.at(share * b.length) for _, b in problem.strokes)]
    return np.concatenate(source), np.concatenate(target)


def similarity(source: Complex, target: Complex, least: complex) -> tuple[complex, complex]:
    """Least squares similarity z ↦ scale · z + shift; where the points do not fix one, the one of scale `least`."""
    if not source.size:
        return least, 0j
    apart = float(np.sum(np.abs(source - source.mean()) ** 2)) > 1e-12
    scale = Similarity.fit(source, target).factor if apart else 0j
    if abs(scale) < LEAST_SHRINKAGE_RATIO:
        scale = least
    return scale, complex(target.mean() - scale * source.mean())
