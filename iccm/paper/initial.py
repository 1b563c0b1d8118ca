"""Initial maps: by arclength (paper §2.2), and from the constraints alone (§3.1)."""

import numpy as np

from ..arrays import Complex
from ..curve import Curve
from ..problem import Problem, measure_of
from .energies import Basis, Term, fixed, points, smoothness
from .least_squares import System

PARALLEL = 0.05  # a fitted similarity that shrinks the shape below this share of its size says nothing


def arclength(problem: Problem, per_edge: int, polygon: Curve) -> Complex:
    """ŵ⁰: the target's points at the source samples' shares of the boundary, first vertex to first vertex."""
    assert problem.target is not None
    t = (np.arange(per_edge) + 0.5) / per_edge
    share = (polygon.knots[:-1, None] + polygon.lengths[:, None] * t).ravel() / polygon.length
    return problem.target.at(share * problem.target.length)


def from_constraints(problem: Problem, basis: Basis, polygon: Curve) -> Complex:
    """Coefficients of a smooth map that meets the pins, and strokes by arclength, with the least change of a
    similarity."""
    source, target = constraint_points(problem)
    source = polygon.pulled_in(source)
    scale, shift = similarity(source, target, problem.upright)
    conformal = Basis(basis.polygon)
    z, measure = polygon.sample(1), measure_of(polygon, 1)
    rest = System(
        [
            points(conformal, source, target - (scale * source + shift), 1.0),
            smoothness(conformal, z, measure, 1e-4),
            Term("size", 1e-4, conformal.positions(z), measure, fixed(np.zeros_like(z))),
        ]
    )
    x = rest.solve(rest.targets(np.zeros_like(polygon.z)))
    return basis.coefficients(x + conformal.similarity(scale, shift))


def constraint_points(problem: Problem, count: int = 20) -> tuple[Complex, Complex]:
    """Pins, and strokes as `count` pins each at equal shares of their lengths."""
    share = np.linspace(0, 1, count)
    source = [problem.pins[:, 0], *(a.at(share * a.length) for a, _ in problem.strokes)]
    target = [problem.pins[:, 1], *(b.at(share * b.length) for _, b in problem.strokes)]
    return np.concatenate(source), np.concatenate(target)


def similarity(source: Complex, target: Complex, least: complex) -> tuple[complex, complex]:
    """Least squares similarity z ↦ scale · z + shift; where the points do not fix one, the one of scale `least`."""
    if not source.size:
        return least, 0j
    p, v = source - source.mean(), target - target.mean()
    spread = float(np.sum(np.abs(p) ** 2))
    scale = complex(np.vdot(p, v) / spread) if spread > 1e-12 else 0j
    if abs(scale) < PARALLEL:
        scale = least
    return scale, complex(target.mean() - scale * source.mean())
