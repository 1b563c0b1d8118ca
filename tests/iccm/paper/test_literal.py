"""`--literal`: Algorithm 1 as published, compared with an independent implementation of its equations."""

from itertools import pairwise

import numpy as np
import pytest

import iccm
from iccm.errors import InputError
from iccm.paper.algorithm1 import STROKE_SAMPLES
from iccm.paper.normalised import NormalisedProblem
from iccm.problem import Problem
from tests.shapes import arrow, blob, ell, inside, pear, refined, square

LAMBDA, QUASI, STEPS = 0.05, 0.1, 6
PAIRS = {
    "smooth": (pear(24), 3 * blob(30) + 7),
    "corners": (arrow() / 5, square(3)),
    "more samples than corners": (square(4), arrow() * 1j),
}


def coordinates(polygon, points, power=0):
    """Return (p, n) C_j of Appendix A, or D_j.

    C has the limit from inside at vertices, where log(B_{j+1} / B_j) and log(B_j / B_{j-1}) add up to a logarithm with
    angle between 0 and 2π.
    """
    n, out = polygon.size, np.zeros((points.size, polygon.size), complex)
    for k, z in enumerate(points):
        b = polygon - z
        for j in range(n):
            last, following = (j - 1) % n, (j + 1) % n
            into, out_of = polygon[j] - polygon[last], polygon[following] - polygon[j]
            if b[j] == 0:
                angle = np.angle(b[following] / b[last]) % (2 * np.pi)
                out[k, j] = np.log(abs(b[following] / b[last])) + 1j * angle
                continue
            if b[following] != 0:
                along = inner_log(b[following] / b[j])
                out[k, j] += -along / out_of if power else b[following] / out_of * along
            if b[last] != 0:
                along = inner_log(b[j] / b[last])
                out[k, j] -= -along / into if power else b[last] / into * along
    return out / (2j * np.pi)


def inner_log(ratio):
    """Return the logarithm; on an edge, its limit from inside."""
    logarithm = np.log(ratio)
    return logarithm + 2j * np.pi if logarithm.imag < 1e-9 - np.pi else logarithm


def closest(polygon, w, closed=True):
    """Return closest points of a polygon to points w (p,), and unit vectors along the offsets, or perpendicular to the
    edge.
    """
    start, along = polygon, np.roll(polygon, -1) - polygon
    if not closed:
        start, along = start[:-1], along[:-1]
    t = np.clip(((w[:, None] - start) * along.conj()).real / np.abs(along) ** 2, 0, 1)
    foot = start + t * along
    edge = np.abs(w[:, None] - foot).argmin(axis=1)
    foot = foot[np.arange(w.size), edge]
    away = w - foot
    on_line = np.abs(away) < 1e-12 * np.ptp(polygon.real)
    across = along[edge] / np.abs(along[edge]) * 1j
    return foot, np.where(on_line, across, away / np.where(on_line, 1, np.abs(away)))


def by_arclength(source, samples, target):
    """Return ŵ⁰ (§2.2): the target's points at the samples' shares of the source's length, vertex 0 to vertex 0."""
    lengths = [np.append(0, np.cumsum(np.abs(np.roll(z, -1) - z))) for z in (samples, target)]
    share, knots = lengths[0][:-1] / lengths[0][-1], lengths[1] / lengths[1][-1]
    ring = np.append(target, target[0])
    return np.interp(share, knots, ring.real) + 1j * np.interp(share, knots, ring.imag)


def published(source, samples, target, order, quasi):
    """Return the coefficients of Algorithm 1 after each global step.

    Minimises ‖C f̂ - ŵ‖², or ‖Re(conj(N) (C f̂ - ŵ))‖² + λ‖C f̂ - ŵ‖² (Eq. 13), and ‖conj(D) ψ̂‖² (Eq. 10), as real
    least squares in Re φ̂, Im φ̂, Re ψ̂, Im ψ̂.
    """
    weights = values(source, samples, quasi)
    rows, right = [], []
    if quasi:
        parts = samples.size // source.size
        steps = np.repeat((np.roll(source, -1) - source) / parts, parts)
        d = coordinates(source, samples + 0.5 * steps, 1).conj() * np.sqrt(QUASI)
        rows = [np.hstack([np.zeros((2 * samples.size, 2 * source.size)), real_rows(d)])]
        right = [np.zeros(2 * samples.size)]
    w, normal, energies = by_arclength(source, samples, target), None, []
    for _ in range(STEPS + 1):
        system, aim = distance(weights, w, order, normal)
        energies.append(least([system, *rows], [aim, *right]))
        w, normal = closest(target, together(weights @ energies[-1]))
    return energies


def distance(matrix, w, order, normal):
    """Return the rows and the right side of ‖M x - w‖², or of Eq. 13; without normals of its second part."""
    share = np.sqrt(LAMBDA) if order else 1
    if not order or normal is None:
        return share * matrix, share * apart(w)
    onto = np.hstack([np.diag(normal.real), np.diag(normal.imag)])  # Re(conj(N) ·)
    return np.vstack([onto @ matrix, share * matrix]), np.append(onto @ apart(w), share * apart(w))


def least(system, aim):
    return np.linalg.lstsq(np.vstack(system), np.concatenate(aim), rcond=1e-13)[0]


def values(source, z, quasi):
    """Return (2p, 2n or 4n) the real matrix of f at z, C φ̂ or C φ̂ + conj(C) ψ̂ (Eq. 8)."""
    c = coordinates(source, z)
    return np.hstack([real_rows(c), real_rows(c.conj())]) if quasi else real_rows(c)


def real_rows(matrix):
    return np.block([[matrix.real, -matrix.imag], [matrix.imag, matrix.real]])


def apart(w):
    return np.concatenate([w.real, w.imag])


def together(parts):
    return parts[: parts.size // 2] + 1j * parts[parts.size // 2 :]


@pytest.mark.slow
@pytest.mark.parametrize("quasi", [False, True])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("per_edge", [1, 3])
def test_each_step_is_that_of_the_equations(name, order, quasi, per_edge):
    source, target = PAIRS[name]
    samples = refined(source, per_edge)
    options = {"order": order, "samples_per_edge": per_edge} if per_edge > 1 else {"order": order}
    options |= {"quasi": QUASI} if quasi else {}
    expected = published(source, samples, target, order, quasi)
    z = inside(source)
    weights = values(source, np.append(samples, z), quasi)
    for steps in range(1, STEPS + 1):
        fit = iccm.fit(source, target, method="paper", literal=True, max_iterations=steps, **options)
        w = together(weights @ expected[fit.report()["iterations"]])
        assert np.abs(fit.map(np.append(samples, z)) - w).max() <= 1e-12 * np.ptp(target.real)
        away = np.abs(closest(target, w[: samples.size])[0] - w[: samples.size])
        radius = 1 / abs(NormalisedProblem.of(Problem.of(source, target)).target_frame.factor)
        assert fit.energies[-1]["closeness"] * radius**2 == pytest.approx(
            np.sum(away**2), rel=1e-9, abs=1e-20
        )
    assert per_edge == 1 or fit.report()["iterations"] == STEPS


@pytest.mark.parametrize("quasi", [False, True])
@pytest.mark.parametrize("order", [0, 1])
def test_pins_and_strokes_are_those_of_the_equations(order, quasi):
    """β‖C_P f̂ - v̂‖² (§3.1) and γ‖C_sk f̂ - t̂‖² (§3.3, the first order as Eq. 13): each step starts from the previous
    map.

    For the first step, by the constraints alone, the paper does not specify which of many solutions is used.
    """
    source, target = PAIRS["smooth"]
    pins = np.array([[0.3 + 0.2j, 7.9 + 0.5j], [-0.4j, 7 - 1j]])
    drawn = np.array([-0.6 + 0.1j, -0.2 + 0.3j]), np.array([5.2, 5.8 + 0.9j, 6.4 + 1j])
    options = {"pin_weight": 4.0, "stroke_weight": 0.5, "order": order, "quasi": QUASI if quasi else None}
    options |= {"method": "paper", "literal": True, "pins": pins, "strokes": [drawn]}
    along = np.linspace(*drawn[0], STROKE_SAMPLES)
    places = (source, along, pins[:, 0])
    boundary, stroke, points = (values(source, z, quasi) for z in places)
    constraints = [(2 * points, 2 * apart(pins[:, 1]))]  # the root of β
    if quasi:
        steps = np.roll(source, -1) - source
        d = coordinates(source, source + 0.5 * steps, 1).conj() * np.sqrt(QUASI)
        constraints.append(
            (
                np.hstack([np.zeros((2 * source.size, 2 * source.size)), real_rows(d)]),
                np.zeros(2 * source.size),
            )
        )
    z = inside(source)
    maps = [iccm.fit(source, target, max_iterations=k, **options).map for k in (1, 2, 3)]
    for before, after in pairwise(maps):
        w, t = closest(target, before(source)), closest(drawn[1], before(along), closed=False)
        rows, aim = distance(stroke, t[0], order, t[1])
        parts = [
            distance(boundary, w[0], order, w[1]),
            (np.sqrt(0.5) * rows, np.sqrt(0.5) * aim),
            *constraints,
        ]
        x = least(*zip(*parts))
        assert np.abs(together(values(source, z, quasi) @ x) - after(z)).max() <= 1e-12 * np.ptp(target.real)


def test_literal_solves_refuse_other_choices():
    for options in ({"vertices": 50}, {"consistency": 0.1}):
        with pytest.raises(InputError, match=f"^{next(iter(options))}: .*literal"):
            iccm.fit(square(), arrow(), method="paper", literal=True, **options)
    for method in (None, "conformal", "balanced"):
        with pytest.raises(InputError, match=r"^literal: .*method paper"):
            iccm.fit(square(), arrow(), method=method, literal=True)


def test_steps_are_whole():
    """A step that raises the energy is taken, and ends the run; without --literal, it is halved."""
    options = {"method": "paper", "order": 1, "vertices": "source", "samples_per_edge": 2}
    halved = [step["total"] for step in iccm.fit(square(3), ell(3), **options).energies]
    assert np.all(np.diff(halved) <= 0)
    del options["vertices"]
    fit = iccm.fit(square(3), ell(3), literal=True, **options)
    whole = [step["total"] for step in fit.energies]
    assert (
        whole[-1] > 1.1 * whole[-2] and np.all(np.diff(whole[:-1]) < 0) and fit._ended is iccm.Status.DECREASE
    )
