"""Algorithm 1 of the paper: alternate closest points and the map closest to them (§2, §3.4, §4.1)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .. import deadline, limits, progress
from ..arrays import Complex, Real
from ..blas import on_one_thread
from ..curve import Curve, boundary_samples, resampled_knots
from ..errors import InputError
from ..maps.harmonic import HarmonicMap
from ..options import Options
from ..problem import Problem
from ..result import Fit
from ..status import Status
from . import initial
from .energies import (
    Basis,
    EnergyTerm,
    Target,
    closeness,
    consistency,
    points,
    quasiconformal,
    smoothness,
    stroke,
)
from .least_squares import LeastSquares
from .normalised import NormalisedProblem, measure_of

PAPER_VERTICES = 200  # default number of evenly spaced vertices: enough for outlines that bend as letters do
LEAST_DECREASE = 1e-4
"""Relative decrease of the energy below which iteration stops: further steps are not visible."""
SAMPLES_PER_EDGE = 4  # default number of samples of each edge: the map between them is smooth
STROKE_SAMPLES = 50  # samples of each stroke: enough for a stroke that bends a few times
UNITS = {
    "quasiconformal": -2,
    "smoothness": -4,
}  # power of the source's length in each energy, relative to the square of the target's length
STEP_HALVINGS = 6  # of a first-order step that does not lower the energy


@on_one_thread
def solve(problem: Problem, settings: Options) -> Fit:
    """Solve for the map onto a target by Algorithm 1, starting from arclength or from the constraints."""
    normalised = NormalisedProblem.of(problem, as_begun=True)
    polygon, s, basis, system = _discretised(normalised, settings)
    targets = first_targets(normalised, settings, system, polygon, s, basis)
    x, energies, status = iterate(system, system.solve(targets), settings)
    return finish(problem, normalised.in_plane(basis.polygon, *basis.split(x)), energies, status)


@on_one_thread
def deform(problem: Problem, settings: Options) -> Fit:
    """Solve for the map without a target, from the constraints alone (§3.3)."""
    normalised = NormalisedProblem.of(problem, as_begun=True)
    polygon, _, basis, system = _discretised(normalised, settings)
    x, energies, status = iterate(system, initial.from_constraints(normalised, basis, polygon), settings)
    return finish(problem, normalised.in_plane(basis.polygon, *basis.split(x)), energies, status)


def _discretised(problem: NormalisedProblem, settings: Options) -> tuple[Curve, Real, Basis, LeastSquares]:
    """Return the polygon, the source's arclengths at its vertices, the basis functions, and the system of energies."""
    polygon, s = discretise(problem.source, "source" if settings.literal else settings.vertices)
    basis = Basis(polygon.z, settings.quasi is not None)
    terms = assemble(problem, settings, basis, polygon)
    tangential = settings.tangential if settings.order == 1 else 1.0
    return polygon, s, basis, LeastSquares(terms, tangential, 1.0 if settings.literal else 1 - tangential)


def discretise(source: Curve, vertices: int | str | None) -> tuple[Curve, Real]:
    """Return the map's polygon, and the source's arclengths (n,) at its vertices.

    Args:
        source: outline of the source.
        vertices: approximate number of vertices, spaced evenly between corners; or "source" for the source's own, as in
            the paper.

    Raises:
        InputError: the source has too many vertices.
    """
    if vertices != "source":
        s = resampled_knots(source, int(vertices or PAPER_VERTICES))
        return Curve(source.at(s)), s
    if source.z.size > limits.VERTICES:
        raise InputError(
            f"vertices: the source has {source.z.size} vertices, more than {limits.VERTICES}; pass how many to "
            "use, such as vertices=200"
        )
    return source, source.knots[:-1]


def assemble(
    problem: NormalisedProblem, settings: Options, basis: Basis, polygon: Curve, share: Real | None = None
) -> list[EnergyTerm]:
    """Return all energies of a problem (paper §4.1).

    `share` (n,) are the weights of the vertices, by default their shares of the boundary's length.
    """
    if share is None:
        share = (polygon.lengths + np.roll(polygon.lengths, 1)) / (2 * polygon.length)
    per_edge = samples_of_edge(settings).size
    z, measure = polygon.sample(per_edge), np.repeat(0.5 * (share + np.roll(share, -1)) / per_edge, per_edge)
    boundary = boundary_samples(polygon.z, per_edge) if settings.literal else z
    tangent = settings.order == 1
    terms: list[EnergyTerm] = []
    if problem.target is not None:
        terms.append(closeness(basis, boundary, measure, problem.target, tangent=tangent))
    if problem.pins.size:
        terms.append(
            points(basis, polygon.pulled_in(problem.pins[:, 0]), problem.pins[:, 1], settings.pin_weight)
        )
    for a, b in problem.strokes:
        samples = polygon.pulled_in(a.at(np.linspace(0, a.length, STROKE_SAMPLES)))
        terms.append(stroke(basis, samples, b, settings.stroke_weight, tangent=tangent))
    if settings.quasi is not None:
        terms.append(quasiconformal(basis, z, measure, settings.quasi))
    if settings.smoothness:
        terms.append(smoothness(basis, polygon.sample(1), measure_of(polygon, 1), settings.smoothness))
    if settings.consistency:
        terms.append(consistency(basis, share, settings.consistency))
    return literal(terms, 1 / abs(problem.source_frame.factor)) if settings.literal else terms


def samples_of_edge(settings: Options) -> Real:
    """Return (k,) positions of the boundary samples on each edge, as shares of the edge."""
    if settings.literal:
        count = settings.samples_per_edge or 1
        return np.arange(count) / count
    count = settings.samples_per_edge or SAMPLES_PER_EDGE
    return (np.arange(count) + 0.5) / count


def literal(terms: list[EnergyTerm], radius: float) -> list[EnergyTerm]:
    """Scale the energies as the paper defines them: sums over samples in the original coordinates.

    `radius` is the source's radius in these coordinates; that of the target is a common factor of all energies.
    """
    return [
        replace(t, weight=t.weight * radius ** UNITS.get(t.name, 0), measure=np.ones_like(t.measure))
        for t in terms
    ]


def first_targets(
    problem: NormalisedProblem, settings: Options, system: LeastSquares, polygon: Curve, s: Real, basis: Basis
) -> list[Target]:
    """Return ŵ⁰: by arclength, or closest points of the map from the constraints (§3.1); without normals."""
    if problem.pins.size or problem.strokes:
        guess = system.targets(initial.from_constraints(problem, basis, polygon))
    else:
        boundary = initial.arclength(problem, samples_of_edge(settings), s)
        other_targets = system.targets(basis.similarity(1, 0))[1:]
        guess = [Target(boundary), *other_targets]
    return [Target(t.points) for t in guess]


def iterate(
    system: LeastSquares, x: Complex, settings: Options
) -> tuple[Complex, list[dict[str, float]], Status]:
    """Run Algorithm 1 until the energy converges; return coefficients, energies of all iterations, and the status.

    Energies compare the map with its own closest points. No zeroth-order step increases them. A first-order step is
    halved until it lowers the energy, or taken unchanged (`literal`).
    """
    targets = system.targets(x)
    energies = [system.energies(x, targets)]
    decrease = LEAST_DECREASE if settings.decrease is None else settings.decrease
    for _ in progress.counted("steps", range(settings.max_iterations)):
        if energies[-1]["total"] <= settings.threshold:
            return x, energies, Status.THRESHOLD
        if deadline.ends_search():
            break
        most = np.inf if settings.literal else energies[-1]["total"]
        x, targets, energy = _descend(system, x, targets, most)
        energies.append(energy)
        if energies[-2]["total"] - energy["total"] <= decrease * energies[-2]["total"]:
            return x, energies, Status.DECREASE
    return x, energies, Status.LIMIT


def _descend(system: LeastSquares, x: Complex, targets: list[Target], most: float):
    """Take a global step, halved until the energy is at most `most`, and the local step after it.

    Returns the old state where no such step is found.
    """
    step = system.solve(targets, x) - x
    for halving in range(STEP_HALVINGS):
        trial = x + step * 0.5**halving
        trial_targets = system.targets(trial)
        energy = system.energies(trial, trial_targets)
        if energy["total"] <= most:
            return trial, trial_targets, energy
    return x, targets, system.energies(x, targets)


def finish(
    problem: Problem,
    map: HarmonicMap,
    energies: list[dict[str, float]],
    status: Status,
    notes: Sequence[str] = (),
) -> Fit:
    """Return the result of a problem, given its map in the user's plane."""
    return Fit(
        map, status, energies, problem.source, problem.target, problem.pins, problem.strokes, list(notes)
    )
