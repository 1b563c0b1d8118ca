"""The conformal method: a global start, boundary vertices where they are needed, Newton's method, a measured gap.

It overcomes limits of the paper's algorithm (local minima, missed protrusions, folds near the boundary):

1. The harmonic measures of both domains give the boundary correspondence of a conformal map; its three free
   parameters are determined by least distortion or by pins (`measure`, `normalise`).
2. Vertices are placed with an even interpolation error, both at the source's corners and at the preimages of
   the target's detail (`vertices`).
3. Newton's method makes the boundary values those of a holomorphic map (`riemann_hilbert`).
4. The gap is measured, and vertices are placed anew from the improved correspondence, until the gap is within
   the tolerance.
5. Pins, strokes and quasi-conformal terms are then added by the first-order iteration of §3.4.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely

from .. import progress
from ..arrays import Complex, Real, complex_of
from ..blas import on_one_thread
from ..curve import Curve, boundary_samples, hausdorff
from ..maps.harmonic import HarmonicMap
from ..options import Options
from ..paper import (
    Basis,
    LeastSquares,
    NormalisedProblem,
    assemble,
    constraint_points,
    discretise,
    finish,
    iterate,
)
from ..problem import Problem
from ..result import Fit
from ..status import Status
from .correspondence import CircleMap, Correspondence, HarmonicView
from .harmonic_measure import HarmonicMeasure
from .normalisation import search
from .panels import corners, graded
from .relaxation import State, follow, relax
from .riemann_hilbert import newton, shares
from .triangulation import TooThinError
from .vertices import Allowance, around_corners, clean, radius_along

# Values were chosen by hand unless a comment gives a reason.
LONGEST_PANEL_RADII = 0.05  # longest panel of the harmonic measure, in radii, at COARSEST_SHARE
CORNER_PANEL_RADII = 1e-3  # panel length at corners, in radii, at COARSEST_SHARE
COARSEST_SHARE, FINEST_SHARE = 1e-3, 1e-6
"""Tolerances between which panels shrink with the fourth root of the tolerance, at corners with its power 2/3."""
# Shortest panel at a corner, relative to the radius, however much the correspondence enlarges it.
LEAST_CORNER_PANEL_SHARE = 1e-6
# Largest image of a panel at a corner, relative to the diagonal of the other shape.
LARGEST_IMAGE_SHARE = 0.01
MOST_DEEPENINGS = 3  # most times that panels at corners are made smaller
SIMPLIFIED_FROM_VERTICES = 1000  # outlines with more vertices are simplified
HAIR_WIDTH_SHARE, HAIR_AREA_SHARE = 1e-7, 1e-4
"""Half the width of a hair relative to the diagonal, and the largest relative change of the area by removing
hairs.
"""
SIMPLIFIED_TOLERANCE_SHARE = 0.2  # tolerance of that simplification, relative to the tolerance
FIRST_ERROR_TOLERANCES = 0.6
"""Allowed interpolation error relative to the tolerance in the first round; it is halved in each round."""
LEAST_ERROR_SHARE = 1e-7  # relative to the diagonal
POLYGON_ROUNDS = 4  # most rounds of relaxation and Newton steps
RELAXATION_STEPS = 8  # most relaxation steps in a round
MOST_SLIDES = 3  # most Newton steps of the correspondence in a round
WORTHWHILE_GAP_RATIO = 0.8  # a round that leaves more than this share of the gap is the last
FOLD_POWER = 0.25
"""A residual above the allowed error is a sign of folds: the gap of such maps is multiplied by this power of it."""
MOST_VERTICES = 1500  # of the polygon
MOST_PANELS = 20_000  # of a boundary: these take 1.5 GB and half a minute; hundreds are usual
CONSISTENCY_SHARE = 1e-3  # default weight of the consistency term
SETTLED_DECREASE = 2e-3  # relative decrease of the energy at which constraints have converged
LEAST_DISTANCE_ULPS = 16  # least distance of vertices in the user's coordinates, in units of the last place
CROWDED_MEASURE = 1e-14  # harmonic measure below which places on the source cannot be distinguished


@on_one_thread
def solve(problem: Problem, settings: Options) -> Fit:
    """Solve a problem by the conformal method, see `iccm.fit`.

    It is solved from a canonical vertex and orientation, so that the result does not depend on those of the
    input.
    """
    normalised = NormalisedProblem.of(problem)
    if normalised.handedness < 0:
        polygon, phi, psi, *details = _solve(normalised.mirrored(), settings)
        polygon, phi, psi = polygon.conj()[::-1], phi.conj()[::-1], psi.conj()[::-1]
    else:
        polygon, phi, psi, *details = _solve(normalised, settings)
    fit = finish(problem, normalised.in_plane(polygon, phi, psi), *details)
    # judge the map as it is reported: in the user's coordinates, against the given target
    if fit._ended in (Status.GAP, Status.CROWDED) and fit._boundary["hausdorff"] <= settings.tolerance:
        return replace(fit, _ended=Status.REACHED)
    return fit


def _solve(problem: NormalisedProblem, settings: Options):
    """Return the polygon, φ, ψ, energies, status and notes, in the unit frames."""
    assert problem.target is not None
    source, notes = from_farthest(problem.source), list[str]()
    if settings.vertices == "source":
        discretise(source, "source")  # raises if there are too many
    else:
        source, notes = simplify(source, settings.tolerance, "source")
    target, target_notes = simplify(from_farthest(problem.target), settings.tolerance, "target")
    fineness = float(np.clip(settings.tolerance / COARSEST_SHARE, FINEST_SHARE / COARSEST_SHARE, 1.0))
    try:
        normalised = normalise(problem, source, target, fineness)
    except TooThinError:
        (source, first), (target, second) = without_hairs(source, "source"), without_hairs(target, "target")
        notes += first + second
        normalised = normalise(problem, source, target, fineness)
    crowding_notes = crowding(normalised)
    notes += target_notes + list(crowding_notes.values())
    state, energies = correspond(normalised, settings)
    keep = distinct_vertices(problem.source_frame.pull_back(source.at(state.s)))
    state = replace(state, s=state.s[keep], tau=state.tau[keep])
    polygon = Curve(source.at(state.s))
    basis = Basis(polygon.z, settings.quasi is not None)
    x = basis.coefficients(state.phi)
    status = Status.CROWDED if "target" in crowding_notes else Status.GAP
    if problem.pins.size or problem.strokes or settings.quasi is not None or settings.smoothness:
        weights = shares(source, state.s, target, state.tau)
        x, energies, status = improve(replace(problem, target=target), settings, basis, polygon, weights, x)
    return polygon.z, *basis.split(x), energies, status, notes


def distinct_vertices(z: Complex) -> list[int]:
    """Return the indices of vertices that remain distinct after rounding in the user's coordinates."""
    least = LEAST_DISTANCE_ULPS * np.spacing(np.abs(z).max())
    keep = [0]
    for k in range(1, z.size):
        if abs(z[k] - z[keep[-1]]) > least and abs(z[k] - z[0]) > least:
            keep.append(k)
    return keep


def simplify(curve: Curve, tolerance: float, name: str) -> tuple[Curve, list[str]]:
    """Return a long outline without details far below the tolerance, and a note about that."""
    if curve.z.size <= SIMPLIFIED_FROM_VERTICES:
        return curve, []
    for share in (
        SIMPLIFIED_TOLERANCE_SHARE * tolerance * 2.0 ** np.arange(24)
    ):  # until it is short enough: more vertices would take hours and all memory
        ring = curve.polygon.simplify(share * curve.diameter)
        z = complex_of(shapely.get_coordinates(ring.exterior)[:-1])
        if z.size <= MOST_VERTICES // 2:
            break
    if z.size == curve.z.size:
        return curve, []
    note = f"{name}: simplified from {curve.z.size} to {z.size} vertices, within {share:.1g} of the diagonal"
    return Curve.domain(z, name), [note]


def without_hairs(curve: Curve, name: str) -> tuple[Curve, list[str]]:
    """Remove slits and spikes without width from an outline, such as a path that goes forth and back.

    Returns:
        The outline, and a note if something was removed.

    Raises:
        TooThinError: more than hairs would be lost.
    """
    width, sharp = HAIR_WIDTH_SHARE * curve.diagonal, {"join_style": "mitre"}
    shape = curve.polygon
    parts = shapely.get_parts(shape.buffer(width, **sharp).buffer(-2 * width, **sharp).buffer(width, **sharp))
    whole = max(parts, key=shapely.area, default=shapely.Polygon())
    if abs(whole.area - shape.area) > HAIR_AREA_SHARE * shape.area:
        raise TooThinError
    z = complex_of(shapely.get_coordinates(whole.simplify(width).exterior)[:-1])
    shorter = 1 - Curve(z).length / curve.length
    if shorter < HAIR_WIDTH_SHARE:
        return curve, []
    return Curve.domain(z, name), [
        f"{name}: ignored slits and spikes without width, {shorter:.1%} of the outline's length"
    ]


def from_farthest(curve: Curve) -> Curve:
    """Return the closed curve started at the vertex farthest from 0."""
    return Curve(np.roll(curve.z, -int(np.argmax(np.abs(curve.z)))))


def normalise(problem: NormalisedProblem, source: Curve, target: Curve, fineness: float) -> Correspondence:
    """Return the boundary correspondence of the conformal map to start from.

    Args:
        problem: contains the pins and strokes.
        source, target: the boundaries, possibly simplified.
        fineness: the tolerance relative to COARSEST_SHARE, at most one.
    """
    spacing = LONGEST_PANEL_RADII * fineness**0.25
    inside, goals = constraint_points(problem)
    nearest = target.nearest(goals)
    pins = np.column_stack([source.pulled_in(inside), np.where(target.contains(goals), goals, nearest)])
    sharp = [at_corners(curve, CORNER_PANEL_RADII * fineness ** (2 / 3)) for curve in (source, target)]
    c = search(measure(source, sharp[0], spacing), measure(target, sharp[1], spacing), pins, problem.upright)
    for _ in range(MOST_DEEPENINGS):
        deeper = [
            grade_corners(source, sharp[0], c.forward, target),
            grade_corners(target, sharp[1], c.backward, source),
        ]
        if all((new == old).all() for new, old in zip(deeper, sharp)):
            break
        views = [
            old
            if (new == had).all()
            else HarmonicView.of(measure(curve, new, spacing), np.array([old.centre]))[0]
            for old, curve, new, had in zip((c.source, c.target), (source, target), deeper, sharp)
        ]
        c, sharp = replace(c, source=views[0], target=views[1]), deeper
    return c


def measure(curve: Curve, sharp: Real, spacing: float) -> HarmonicMeasure:
    """Return the harmonic measure of a boundary on panels graded towards its corners.

    Panels are longer if there are too many.
    """
    progress.tell("harmonic measure")
    ends = graded(curve, spacing, sharp)
    while ends.size > max(MOST_PANELS, 2 * curve.z.size):
        spacing, sharp = 2 * spacing, 2 * sharp
        ends = graded(curve, spacing, sharp)
    return HarmonicMeasure(curve, ends)


def at_corners(curve: Curve, most: float) -> Real:
    """Return (c,) panel lengths at the corners: at most `most`, less at short edges."""
    shorter_sides = np.minimum(curve.lengths, np.roll(curve.lengths, 1))[corners(curve)]
    share = np.clip(curve.z.size / 2000, 0.1, 0.5)  # a thousand corners cannot all be graded finely
    return np.minimum(share * shorter_sides, most)


def grade_corners(curve: Curve, sharp: Real, to: Callable[[Real], Real], partner: Curve) -> Real:
    """Return the panel lengths at corners, shortened where the correspondence enlarges a corner's panels too much."""
    s = curve.knots[:-1][corners(curve)]
    extent = np.maximum(to(s + sharp) - to(s), to(s) - to(s - sharp)) / partner.diagonal
    shrink = np.clip((LARGEST_IMAGE_SHARE / np.maximum(extent, 1e-9)) ** 1.5, 1e-2, 1.0)
    return np.where(extent > LARGEST_IMAGE_SHARE, np.maximum(sharp * shrink, LEAST_CORNER_PANEL_SHARE), sharp)


def crowding(c: Correspondence) -> dict[str, str]:
    """Return notes on parts of a boundary whose partners double precision cannot resolve.

    The keys are "source" and "target".
    """
    source_gaps = np.diff(c.between.inverse(c.target.circle.turns))
    target_gaps = np.diff(c.between(c.source.circle.turns))
    parts = [("target", c.target.circle, source_gaps), ("source", c.source.circle, target_gaps)]
    shares = {name: float(v.lengths[gaps < CROWDED_MEASURE].sum() / v.length) for name, v, gaps in parts}
    return {
        name: f"crowding: {share:.1%} of the {name}'s boundary has a harmonic measure below {CROWDED_MEASURE:.0e} "
        "per panel, so the map is inaccurate there"
        for name, share in shares.items()
        if share >= 1e-3
    }


def correspond(c: Correspondence, settings: Options) -> tuple[State, list[dict[str, float]]]:
    """Compute vertices and their images, so that the gap is within the tolerance if possible.

    The ends of axes of symmetry move if the gap cannot be closed otherwise, as it may happen with crowding.

    Returns:
        The best state, and the energies of each step.
    """
    score, state, energies = refine(c, settings)
    if score > settings.tolerance and c.fixed.size:
        released = replace(c, fixed=np.empty(0), fixed_images=np.empty(0))
        released_score, released_state, released_energies = refine(released, settings)
        if released_score < score:
            return released_state, released_energies
    return state, energies


def refine(c: Correspondence, settings: Options) -> tuple[float, State, list[dict[str, float]]]:
    """Compute vertices and their images: relax, slide, measure, until the gap is within the tolerance.

    Returns:
        The gap of the best state, larger if there may be folds, the state, and the energies of each step.
    """
    source, target = c.source.measure.curve, c.target.measure.curve
    error = FIRST_ERROR_TOLERANCES * settings.tolerance * target.diameter
    requested = source.z.size if settings.vertices == "source" else settings.vertices
    radius, most = radius_along(source, LONGEST_PANEL_RADII), int(requested or MOST_VERTICES)
    c = replace(c, between=CircleMap.of(c))
    energies: list[dict[str, float]] = []
    best: tuple[float, float, State] | None = None  # score, gap, state
    for _ in progress.counted("rounds", range(POLYGON_ROUNDS)):
        allowed = Allowance(radius, error, LEAST_ERROR_SHARE * target.diameter)
        c, states = relax(c, pairs, allowed, most, RELAXATION_STEPS)
        state = states[-1]
        tau, residual = newton(source, state.s, target, state.tau, MOST_SLIDES, allowed, c.fixed)
        states.append(replace(state, tau=tau, residual=residual))
        energies += [{"consistency": e.energy, "total": e.energy} for e in states]
        previous_gap = best[1] if best else np.inf
        for candidate in (states[-1], states[-2], states[0]):
            gap = gap_of(candidate)
            score = gap * max(1.0, candidate.norm) ** FOLD_POWER
            if best is None or score < best[0]:
                best = (score, gap, candidate)
            if score <= settings.tolerance:
                break
        assert best is not None
        if (
            best[0] <= settings.tolerance
            or settings.vertices
            or best[1] > WORTHWHILE_GAP_RATIO * previous_gap
        ):
            break
        c, error = follow(c, states[-1]), error / 2
    assert best is not None
    return best[0], best[2], energies


def pairs(c: Correspondence) -> tuple[Real, Real]:
    """Return the correspondence at the panels' ends and midpoints of both shapes, and around their corners."""
    ends = [np.concatenate([m.ends, m.ends + 0.5 * m.lengths]) for m in (c.source.measure, c.target.measure)]
    source, target = c.source.measure.curve, c.target.measure.curve
    s = np.concatenate([ends[0], np.mod(around_corners(source), source.length)])
    tau = np.concatenate([ends[1], np.mod(around_corners(target), target.length)])
    return clean(np.concatenate([s, c.backward(tau)]), np.concatenate([c.forward(s), tau]), source, target)


def gap_of(state: State) -> float:
    """Return the Hausdorff distance of the boundary's image from the target, relative to its diameter.

    It is the two-sided distance.
    """
    polygon = state.source.at(state.s)
    image = HarmonicMap(polygon, state.phi, np.zeros_like(polygon))(boundary_samples(polygon, 2))
    return hausdorff(Curve(image), state.target) / state.target.diameter


def improve(
    problem: NormalisedProblem, settings: Options, basis: Basis, polygon: Curve, weights: Real, x: np.ndarray
):
    """Add constraints and quasi-conformal freedom, by local and global steps from the conformal map.

    Steps of first order need fewer iterations, but with ψ free they end in worse minima (measured), so that
    zeroth order is the default then.
    """
    order = settings.order if settings.order is not None else int(settings.quasi is None)
    mu = CONSISTENCY_SHARE if settings.consistency is None else settings.consistency
    decrease = SETTLED_DECREASE if settings.decrease is None else settings.decrease
    settings = replace(settings, order=order, consistency=mu, samples_per_edge=2, decrease=decrease)
    system = LeastSquares(
        assemble(problem, settings, basis, polygon, weights), settings.tangential if order else 1.0
    )
    return iterate(system, x, settings)
