"""Iterative closest conformal maps: the entry points and Algorithm 1 of the paper."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import start
from .cauchy import Complex
from .curve import Curve, Real
from .errors import InputError
from .problem import Options, Problem, measure_of
from .result import Fit, Status
from .system import System
from .terms import Basis, Target, Term, closeness, consistency, points, quasiconformal, smoothness, stroke

PAPER_VERTICES = 200
DECREASE = 1e-4
STROKE_SAMPLES = 50
HALVINGS = 6  # of a first-order step that does not lower the energy

__all__ = ["Fit", "Status", "deform", "fit"]


def fit(
    source: ArrayLike | Curve,
    target: ArrayLike | Curve,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    **options: Any,
) -> Fit:
    """A conformal, or with `quasi` a harmonic, map of the source domain onto the target domain.

    Args:
        source: (n,) complex vertices of the source's boundary, x + iy, y up, either way round.
        target: (m,) complex vertices of the target's boundary.
        pins: (k, 2) complex, a point inside the source and the point it should go to.
        strokes: pairs of open polylines, (p,) inside the source and (q,) where it should go.
        **options: see `iccm.problem.Options`.

    Returns:
        The map, how the solver ended, and the figures that judge it. Failure to converge is a status, not an exception.

    Raises:
        InputError: a boundary that is no simple polygon, a constraint outside the source, an option out of range.
    """
    settings = Options(**options)
    problem = Problem.of(source, target, pins, strokes)
    if settings.method == "robust":
        from .robust import solve

        return solve(problem, settings)
    polygon = problem.source.resample(settings.vertices or PAPER_VERTICES)
    basis = Basis(polygon.z, settings.quasi is not None)
    terms = assemble(problem, settings, basis, polygon)
    system = System(terms, settings.tangential if settings.order == 1 else 1.0)
    targets = first_targets(problem, settings, system, polygon, basis)
    x, energies, status = iterate(system, system.solve(targets), settings)
    return finish(problem, basis.polygon, *basis.split(x), energies, status)


def deform(
    source: ArrayLike | Curve,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    **options: Any,
) -> Fit:
    """Move a shape by pins and strokes alone, without a target boundary (paper §3.3).

    The smoothness energy makes the problem well posed; arguments and errors as for `fit`.
    """
    settings = Options(**{"smoothness": 1e-4, "order": 0, "max_iterations": 100, **options})
    problem = Problem.of(source, None, pins, strokes)
    if not problem.pins.size and not problem.strokes:
        raise InputError("deform: no pins and no strokes; give at least one")
    polygon = problem.source.resample(settings.vertices or PAPER_VERTICES)
    basis = Basis(polygon.z, settings.quasi is not None)
    system = System(
        assemble(problem, settings, basis, polygon), settings.tangential if settings.order == 1 else 1.0
    )
    x, energies, status = iterate(system, start.from_constraints(problem, basis, polygon), settings)
    return finish(problem, basis.polygon, *basis.split(x), energies, status)


def assemble(
    problem: Problem, settings: Options, basis: Basis, polygon: Curve, share: Real | None = None
) -> list[Term]:
    """All energies of a problem (paper §4.1); `share` weighs the vertices, by their part of the source's
    length if None."""
    if share is None:
        share = (polygon.lengths + np.roll(polygon.lengths, 1)) / (2 * polygon.length)
    per_edge = settings.samples_per_edge
    z, measure = polygon.sample(per_edge), np.repeat(0.5 * (share + np.roll(share, -1)) / per_edge, per_edge)
    tangent = settings.order == 1
    terms: list[Term] = []
    if problem.target is not None:
        terms.append(closeness(basis, z, measure, problem.target, tangent=tangent))
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
    return terms


def first_targets(
    problem: Problem, settings: Options, system: System, polygon: Curve, basis: Basis
) -> list[Target]:
    """ŵ⁰: by arclength, or closest points to the image under the constraints alone (§3.1); never with normals."""
    if problem.pins.size or problem.strokes:
        guess = system.targets(start.from_constraints(problem, basis, polygon))
    else:
        boundary = start.arclength(problem, settings.samples_per_edge, polygon)
        rest = system.targets(basis.similarity(1, 0))[1:]
        guess = [Target(boundary), *rest]
    return [Target(t.points) for t in guess]


def iterate(system: System, x: Complex, settings: Options) -> tuple[Complex, list[dict[str, float]], Status]:
    """Algorithm 1: closest points, then the map closest to them, until the energy settles.

    Energies are those of the map against its own closest points, which no step of zeroth order increases; a step of
    first order is halved until it lowers the energy.
    """
    targets = system.targets(x)
    energies = [system.energies(x, targets)]
    decrease = DECREASE if settings.decrease is None else settings.decrease
    for _ in range(settings.max_iterations):
        if energies[-1]["total"] <= settings.threshold:
            return x, energies, Status.THRESHOLD
        x, targets, energy = _descend(system, x, targets, energies[-1]["total"])
        energies.append(energy)
        if energies[-2]["total"] - energy["total"] <= decrease * energies[-2]["total"]:
            return x, energies, Status.DECREASE
    return x, energies, Status.LIMIT


def _descend(system: System, x: Complex, targets: list[Target], before: float):
    """One global step and the local step after it; the old state where no part of the step lowers the energy."""
    step = system.solve(targets, x) - x
    for halving in range(HALVINGS):
        trial = x + step * 0.5**halving
        found = system.targets(trial)
        energy = system.energies(trial, found)
        if energy["total"] <= before:
            return trial, found, energy
    return x, targets, system.energies(x, targets)


def finish(
    problem: Problem,
    polygon: Complex,
    phi: Complex,
    psi: Complex,
    energies: list[dict[str, float]],
    status: Status,
    notes: Sequence[str] = (),
) -> Fit:
    """The result in the user's coordinates."""
    s, t = problem.source_frame, problem.target_frame
    target = problem.target and Curve(t.world(problem.target.z))
    pins = np.column_stack([s.world(problem.pins[:, 0]), t.world(problem.pins[:, 1])])
    strokes = [(Curve(s.world(a.z), False), Curve(t.world(b.z), False)) for a, b in problem.strokes]
    source = Curve(s.world(problem.source.z))
    world = problem.world(polygon, phi, psi)
    return Fit(world, status, energies, source, target, pins, strokes, list(notes))
