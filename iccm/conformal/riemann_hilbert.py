"""Newton's method for the boundary correspondence of a conformal map.

Let τ_j be the target arclength of source vertex j. The values T(τ_j) are the boundary values of a holomorphic
map if D T(τ) = 0, where D = (C - ½I)(I + P) - ½I corrects the paper's C - I for linear interpolation
(`consistency`). This is the consistency energy with the closeness held at zero. It has n real unknowns instead
of the 2n of Eq. 13, and the target's tangents take the place of its normals (a Riemann-Hilbert problem; R.
Wegmann, *Methods for numerical conformal mapping*, Handbook of Complex Analysis 2, 2005).
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg

from ..arrays import Complex, Real
from ..curve import Curve
from ..maps import cauchy_green
from .panels import CORNER
from .vertices import Allowance

# Values were chosen by hand unless a comment gives a reason.
LEAST_DAMPING = 1e-6  # relative; selects the least change in the three free real parameters
MOST_DAMPING = 1e2  # damping above which a step is given up
STALLED_RESIDUAL_SHARE = 0.98  # stop when a step leaves more than this share of the residual
# Relative to the largest diagonal entry: smaller columns are rounding errors.
ROUNDING_DIAGONAL_SHARE = 1e-13
RAISE = 1 / 6  # derived: see `interpolate_means`
DEPENDENT_SHARE = 1e-9  # relative singular value below which conditions on fixed points depend on each other
NO_POINTS = np.empty(0)
SHORTEST_GAP_SHARE = 1e-15  # least gap, relative to the length of the boundary


def cyclic_gaps(s: Real, length: float) -> Real:
    """Return (n,) the steps from each arclength to the next; the last one to the first, one lap later."""
    return np.diff(np.append(s, s[0] + length))


def shares(source: Curve, s: Real, target: Curve, tau: Real) -> Real:
    """Return (n,) quadrature weights ½(ds/|S| + dτ/|T|) from both sides.

    A protrusion counts even if its preimage is tiny.
    """
    parts = [cyclic_gaps(s, source.length) / source.length, cyclic_gaps(tau, target.length) / target.length]
    gaps = 0.5 * (parts[0] + parts[1])
    return 0.5 * (gaps + np.roll(gaps, 1))


def stretches(s: Real, source: Curve, tau: Real, target: Curve) -> Real:
    """Return (n,) the scale of lengths at the vertices, dτ/ds."""
    ds, dtau = cyclic_gaps(s, source.length), cyclic_gaps(tau, target.length)
    return (dtau + np.roll(dtau, 1)) / (ds + np.roll(ds, 1))


def interpolate_means(w: Complex, z: Complex) -> Complex:
    """Return values φ whose linear interpolation has the means of a holomorphic function on the edges.

    The holomorphic function has the values w at the vertices. The mean error of linear interpolation is w''
    Δz²/12. Raising vertices by a sixth of their distance from the linear function through their neighbours
    compensates it, so that the error for smooth boundaries is O(h³), not O(h²).

    Args:
        w: (n,) values at the vertices.
        z: (n,) vertices.
    """
    previous, following = _neighbours(z)
    return w + (previous + following) * w - previous * np.roll(w, 1) - following * np.roll(w, -1)


def consistency(z: Complex) -> Complex:
    """Return the (n, n) matrix D = (C - ½I)(I + P) - ½I, with D w = 0 for the boundary values w of holomorphic maps.

    C contains the Cauchy coordinates of the vertices z, and φ = (I + P) w are the values of
    `interpolate_means`. The error of their linear interpolation oscillates with mean zero, and half of it is
    holomorphic: at vertices the coordinates give C φ = ½ (w + φ), to third order. The paper's (C - I) w = 0
    would hold to second order.
    """
    matrix = cauchy_green.coordinates(z, z)
    matrix[np.diag_indices_from(matrix)] -= 0.5
    previous, following = _neighbours(z)
    matrix += (
        matrix * (previous + following)
        - np.roll(matrix * previous, -1, axis=1)
        - np.roll(matrix * following, 1, axis=1)
    )
    matrix[np.diag_indices_from(matrix)] -= 0.5
    return matrix


def _neighbours(z: Complex) -> tuple[Complex, Complex]:
    """Return a sixth of the weights of the previous and the next vertex in linear interpolation.

    They are zero at corners, where w is not smooth.
    """
    ahead = np.roll(z, -1) - z
    back = np.roll(ahead, 1)
    share = np.where(np.abs(np.angle(ahead / back)) < CORNER, RAISE, 0.0) / (ahead + back)
    return ahead * share, back * share


def newton(
    source: Curve,
    s: Real,
    target: Curve,
    tau: Real,
    iterations: int,
    allowed: Allowance,
    fixed: Real = NO_POINTS,
) -> tuple[Real, Complex]:
    """Move τ along the target until its values are consistent.

    Args:
        source: the source boundary.
        s: (n,) increasing arclengths of the polygon's vertices.
        target: the target boundary.
        tau: (n,) increasing arclengths of their images, lifted.
        iterations: most steps; fewer if the residual stops decreasing.
        allowed: allowed error at each place, by which residuals are divided.
        fixed: (k,) arclengths of the source, at most three of them independent, whose images do not move.

    Returns:
        τ, and the defect D T(τ) at the vertices.
    """
    defect = consistency(source.at(s))
    tau, residual = tau.copy(), defect @ target.at(tau)
    damping = LEAST_DAMPING
    for _ in range(iterations):
        q = np.sqrt(shares(source, s, target, tau)) / allowed(s, stretches(s, source, tau, target))
        norm = float(np.linalg.norm(q * residual))
        steps = _steps(defect, residual, target, tau, q, interpolation(s, source.length, fixed))
        trials: list[tuple[float, float, Real, Complex]] = []
        while damping <= MOST_DAMPING:
            trial = keep_order(tau, steps(damping), target.length)
            trial_residual = defect @ target.at(trial)
            trials.append((float(np.linalg.norm(q * trial_residual)), damping, trial, trial_residual))
            if len(trials) > 1 and trials[-2][0] < min(norm, trials[-1][0]):
                # The first damping that helps may hardly help, since restoring the order changes the step.
                break
            damping *= 10
        trial_norm, damping, trial, trial_residual = min(trials, key=lambda t: t[0])
        if trial_norm >= norm:
            break
        tau, residual, damping = trial, trial_residual, max(damping / 10, LEAST_DAMPING)
        if trial_norm > STALLED_RESIDUAL_SHARE * norm:
            break
    return tau, residual


def interpolation(s: Real, length: float, points: Real) -> Real:
    """Return the matrix (k, n) of linear interpolation at points (k,) between increasing arclengths (n,), one lap."""
    weights = np.zeros((points.size, s.size))
    ends = np.append(s, s[0] + length)
    place = s[0] + np.mod(points - s[0], length)
    k = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, s.size - 1)
    share = (place - ends[k]) / (ends[k + 1] - ends[k])
    rows = np.arange(points.size)
    weights[rows, k] += 1 - share
    weights[rows, (k + 1) % s.size] += share
    return weights


def _steps(
    defect: Complex, residual: Complex, target: Curve, tau: Real, q: Real, fixed: Real
) -> Callable[[float], Real]:
    """Return the Levenberg-Marquardt step of ‖q D T(τ)‖² in τ as a function of the damping.

    It is scaled by the local spacing, and zero at points given by their weights (k, n) of τ.
    """
    edge, _ = target.locate(tau)
    gaps = cyclic_gaps(tau, target.length)
    scale = 0.5 * (gaps + np.roll(gaps, 1))
    tangent = target.edges[edge] / target.lengths[edge] * scale
    a = q[:, None] * defect * tangent
    gram = a.real.T @ a.real + a.imag.T @ a.imag
    load = a.real.T @ (q * residual).real + a.imag.T @ (q * residual).imag
    diagonal = gram.diagonal()

    def step(damping: float) -> Real:
        damped = gram + np.diag(damping * diagonal + ROUNDING_DIAGONAL_SHARE * diagonal.max())
        factor = scipy.linalg.cho_factor(damped, check_finite=False)
        x = -scipy.linalg.cho_solve(factor, load)
        if len(fixed):  # the constrained minimum
            conditions = fixed * scale
            across = scipy.linalg.cho_solve(factor, conditions.T)
            x -= across @ np.linalg.lstsq(conditions @ across, conditions @ x, rcond=DEPENDENT_SHARE)[0]
        return scale * x

    return step


def keep_order(tau: Real, step: Real, length: float) -> Real:
    """Return τ + step with positive gaps: where a gap would become negative, it shrinks exponentially instead."""
    gaps = np.maximum(cyclic_gaps(tau, length), SHORTEST_GAP_SHARE * length)
    change = (np.roll(step, -1) - step) / gaps
    gaps = gaps * np.where(change > -0.5, 1 + change, 0.5 * np.exp(np.clip(2 * change + 1, -5, 0)))
    gaps = np.maximum(gaps, SHORTEST_GAP_SHARE * length)
    gaps *= length / gaps.sum()
    positions = np.concatenate([[0.0], np.cumsum(gaps[:-1])])
    return positions + np.mean(tau + step - positions)
