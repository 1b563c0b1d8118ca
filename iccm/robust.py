"""The robust method: a global start, boundary vertices where the map needs them, Newton's method, a measured gap.

What goes past the paper's limits (local minima, missed limbs, folds near the boundary):

1. harmonic measure of both domains gives the boundary correspondence of a conformal map, its three free parameters
   chosen for the least distortion or by the pins (`measure`, `align`);
2. vertices are placed so that the interpolation error is even, on the source's corners and at the preimages of the
   target's detail alike (`vertices`);
3. Newton's method makes the boundary values those of a holomorphic map (`riemann_hilbert`);
4. the gap is measured, the vertices placed anew from the better correspondence, until it is within the tolerance;
5. pins, strokes and quasi-conformal terms are then added by the first-order iteration of §3.4.
"""

from dataclasses import replace

import numpy as np
import shapely

from .align import Correspondence, search
from .curve import Curve, Real
from .harmonic import HarmonicMap
from .measure import HarmonicMeasure
from .panels import corners, graded
from .problem import Options, Problem
from .result import Fit, Status, boundary_samples, hausdorff
from .riemann_hilbert import newton, shares
from .solve import assemble, finish, iterate
from .start import constraint_points
from .system import System
from .terms import Basis
from .vertices import Allowance, around_corners, clean, fine_pairs, place, radius_along

PANEL = 0.05  # longest panel of the harmonic measure, in radii
AT_CORNERS = 1e-3  # panel length at corners, in radii
MANY = 300  # vertices of an outline before it is simplified
SIMPLIFY = 0.2  # by this share of the tolerance
FIRST_ERROR = (
    0.4  # of the interpolation between vertices, as a share of the tolerance; halved from round to round
)
LEAST_ERROR = 1e-8  # relative to the diagonal
ROUNDS = 4
STEPS = 8  # of Newton's method, a round
MOST_VERTICES = 1500
CONSISTENCY = 1e-3
CROWDED = 1e-14  # harmonic measure, below which the places on the source are not told apart


def solve(problem: Problem, settings: Options) -> Fit:
    """See `iccm.fit`."""
    source, notes = simplified(problem.source, settings.tolerance, "source")
    target, more = simplified(problem.target, settings.tolerance, "target")
    chosen = align(problem, source, target)
    notes += more + crowding(chosen)
    s, tau, energies, gap = correspond(chosen, settings)
    status = Status.REACHED if gap <= settings.tolerance else Status.GAP
    polygon, phi = Curve(source.at(s)), target.at(tau)
    basis = Basis(polygon.z, settings.quasi is not None)
    x = basis.coefficients(phi)
    if problem.pins.size or problem.strokes or settings.quasi is not None or settings.smoothness:
        weights = shares(source, s, target, tau)
        x, energies, status = improve(replace(problem, target=target), settings, basis, polygon, weights, x)
    return finish(problem, basis, x, energies, status, notes)


def simplified(curve: Curve, tolerance: float, name: str) -> tuple[Curve, list[str]]:
    """A long outline without the detail far below the tolerance, and a note that says so."""
    if curve.z.size <= MANY:
        return curve, []
    share = SIMPLIFY * tolerance
    ring = shapely.Polygon(np.column_stack([curve.z.real, curve.z.imag])).simplify(share * curve.diagonal)
    z = shapely.get_coordinates(ring.exterior)[:-1] @ np.array([1, 1j])
    if z.size == curve.z.size:
        return curve, []
    note = f"{name}: {curve.z.size} vertices simplified to {z.size}, by at most {share:.0e} of the diagonal"
    return Curve.domain(z, name), [note]


def align(problem: Problem, source: Curve, target: Curve) -> Correspondence:
    """The boundary correspondence of the conformal map to start from."""
    inside, wanted = constraint_points(problem)
    near = target.at(target.closest(wanted))
    pins = np.column_stack([source.pulled_in(inside), np.where(target.contains(wanted), wanted, near)])
    return search(measure(source), measure(target), pins, problem.upright)


def measure(curve: Curve) -> HarmonicMeasure:
    """The harmonic measure of a boundary on panels graded towards its corners."""
    sharp = corners(curve)
    beside = np.minimum(curve.lengths, np.roll(curve.lengths, 1))[sharp]
    return HarmonicMeasure(curve, graded(curve, PANEL, np.clip(0.1 * beside, 0.1 * AT_CORNERS, AT_CORNERS)))


def crowding(c: Correspondence) -> list[str]:
    """A note where parts of the target come from less of the source's boundary than double precision can tell apart."""
    ends = c.target.circle.knots
    gaps = np.diff(c.moebius.inverse(c.target.circle.turns))
    share = float(np.diff(ends)[gaps < CROWDED].sum() / c.target.circle.length)
    if share < 1e-3:
        return []
    return [
        f"crowding: {share:.1%} of the target's boundary has harmonic measure below {CROWDED:.0e} a panel"
    ]


def correspond(c: Correspondence, settings: Options) -> tuple[Real, Real, list[dict[str, float]], float]:
    """Vertices and their images: solve, measure, place anew, until the gap is within the tolerance.

    Returns:
        Arclengths on source and target, energies of each round, and the gap reached, relative to the diagonal.
    """
    source, target = c.source.measure.curve, c.target.measure.curve
    s, tau = first_pairs(c)
    error = FIRST_ERROR * settings.tolerance * target.diagonal
    radius = radius_along(source, PANEL)
    energies, best = [], None
    for _ in range(ROUNDS):
        allowed = Allowance(radius, error, LEAST_ERROR * target.diagonal)
        s, tau = place(s, tau, source, target, allowed, settings.vertices or MOST_VERTICES)
        tau, defect = newton(source, s, target, tau, STEPS, allowed)
        gap = gap_of(source.at(s), target.at(tau), target)
        energy = float(shares(source, s, target, tau) @ np.abs(defect) ** 2)
        energies.append({"consistency": energy, "total": energy})
        if best is None or gap < best[0]:
            best = (gap, s, tau)
        if gap <= settings.tolerance or settings.vertices:
            break
        s, tau = fine_pairs(s, tau, source, target)
        error /= 2
    assert best is not None
    return best[1], best[2], energies, best[0]


def first_pairs(c: Correspondence) -> tuple[Real, Real]:
    """The correspondence at the panels' ends of both shapes and around their corners."""
    source, target = c.source.measure, c.target.measure
    s = np.concatenate([source.ends, np.mod(around_corners(source.curve), source.curve.length)])
    tau = np.concatenate([target.ends, np.mod(around_corners(target.curve), target.curve.length)])
    pairs = np.concatenate([s, c.backward(tau)]), np.concatenate([c.forward(s), tau])
    return clean(*pairs, source.curve, target.curve)


def gap_of(polygon: np.ndarray, phi: np.ndarray, target: Curve) -> float:
    """Two-sided Hausdorff distance of the image of the boundary to the target, relative to its diagonal."""
    image = HarmonicMap(polygon, phi, np.zeros_like(phi))(boundary_samples(polygon, 2))
    return hausdorff(Curve(image), target) / target.diagonal


def improve(problem: Problem, settings: Options, basis: Basis, polygon: Curve, weights: Real, x: np.ndarray):
    """Constraints and quasi-conformal freedom, by first-order iteration from the conformal map."""
    order = 1 if settings.order is None else settings.order
    mu = CONSISTENCY if settings.consistency is None else settings.consistency
    settings = replace(settings, order=order, consistency=mu, samples_per_edge=2)
    system = System(
        assemble(problem, settings, basis, polygon, weights), settings.tangential if order else 1.0
    )
    return iterate(system, x, settings)
