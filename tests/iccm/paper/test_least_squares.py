"""The weighted system: its solution is the minimum of the energy defined by the terms."""

import numpy as np
import pytest
import scipy.optimize

from iccm.curve import Curve
from iccm.options import Options
from iccm.paper.algorithm1 import assemble
from iccm.paper.energies import Basis, EnergyTerm, Target, closeness, fixed, points
from iccm.paper.least_squares import LeastSquares
from iccm.paper.normalised import NormalisedProblem, measure_of
from iccm.problem import Problem
from tests.shapes import arrow, blob, inside, pear, random_polygon

LAMBDA = 0.3


def everything(order, quasi, consistency=1e-3):
    """A system with every kind of term, and targets of a random map close to the shape."""
    inner = inside(pear(), 12)
    given = Problem.of(
        pear(24),
        blob(24),
        pins=np.column_stack([inner[:2], 0.3 * inner[:2]]),
        strokes=[(inner[2:5], [0.1, 0.4j])],
    )
    problem = NormalisedProblem.of(given, as_begun=True)
    options = Options(
        method="paper",
        order=order,
        quasi=0.1 if quasi else None,
        smoothness=1e-3,
        consistency=consistency,
        samples_per_edge=2,
    )
    polygon = problem.source.resample(24)
    basis = Basis(polygon.z, quasi)
    system = LeastSquares(assemble(problem, options, basis, polygon), LAMBDA if order else 1.0)
    rng = np.random.default_rng(7)
    n = polygon.z.size
    noise = 0.1 * (rng.normal(size=(2, n)) + 1j * rng.normal(size=(2, n)))
    return system, system.targets(basis.coefficients(polygon.z + noise[0], noise[1]))


def energy(system, targets, x):
    """The energy of §3.4 and §4.1 row by row: Eq. 13 weighted so that it is |error|² along normals."""
    total = 0.0
    for term, target in zip(system.terms, targets):
        miss = term.matrix @ x - target.points
        square = np.abs(miss) ** 2
        if target.normals is not None:
            square = (1 - LAMBDA) * (target.normals.conj() * miss).real ** 2 + LAMBDA * square
        total += term.weight * float(np.sum(term.measure * square))
    return total


@pytest.mark.parametrize("quasi", [False, True], ids=["conformal", "harmonic"])
@pytest.mark.parametrize("order", [0, 1])
def test_the_gradient_of_the_energy_vanishes_at_the_solution(order, quasi):
    """Central differences in each real and imaginary coefficient, which are exact because the energy is quadratic."""
    system, targets = everything(order, quasi)
    assert any(t.normals is not None for t in targets) == (order == 1)
    x = system.solve(targets)
    least = energy(system, targets, x)
    step, slopes, curvatures = 1e-3, [], []
    for k in range(x.size):
        for direction in (1, 1j):
            e = np.zeros(x.size, complex)
            e[k] = step * direction
            ahead, behind = energy(system, targets, x + e), energy(system, targets, x - e)
            slopes.append((ahead - behind) / (2 * step))
            curvatures.append((ahead + behind - 2 * least) / step**2)
    assert min(curvatures) > 0
    assert np.abs(slopes).max() < 1e-9 * max(curvatures)


@pytest.mark.parametrize("order", [0, 1])
def test_no_direction_lowers_the_energy(order):
    system, targets = everything(order, True)
    x = system.solve(targets)
    least = energy(system, targets, x)
    rng = np.random.default_rng(0)
    for size in (1e-4, 1e-2, 1):
        for _ in range(20):
            d = size * (rng.normal(size=x.size) + 1j * rng.normal(size=x.size))
            assert energy(system, targets, x + d) > least


def test_the_solution_is_that_of_a_general_minimiser():
    """The first-order energy as real least squares, solved by scipy's lsq_linear on explicit rows."""
    system, targets = everything(1, False)
    rows, right = [], []
    for term, target in zip(system.terms, targets):
        for m, w, p, j in zip(
            np.sqrt(term.weight * term.measure), term.matrix, target.points, range(term.measure.size)
        ):
            equations = [(w.real, -w.imag, p.real), (w.imag, w.real, p.imag)]
            if target.normals is not None:
                turned = np.sqrt(1 - LAMBDA) * target.normals[j].conj() * np.append(w, p)
                equations = [tuple(np.sqrt(LAMBDA) * part for part in parts) for parts in equations]
                equations.append((turned[:-1].real, -turned[:-1].imag, turned[-1].real))
            for a, b, c in equations:
                rows.append(m * np.concatenate([a, b]))
                right.append(m * c)
    best = scipy.optimize.lsq_linear(np.array(rows, float), np.array(right, float), tol=1e-15).x
    n = best.size // 2
    assert np.abs(system.solve(targets) - (best[:n] + 1j * best[n:])).max() < 1e-6


@pytest.mark.parametrize("order", [0, 1])
def test_of_equal_solutions_the_closest_to_the_last_is_used(order):
    """One pin determines only one direction of the coefficients: the others are unchanged."""
    basis = Basis(pear(20))
    z = inside(pear(20), 1)
    row = basis.positions(z)[0]
    system = LeastSquares([points(basis, z, np.array([1 + 2j]), 1.0)])
    x = np.random.default_rng(2).normal(size=20) + 1j
    moved = system.solve([Target(np.array([1 + 2j]))], x)
    assert abs(row @ moved - (1 + 2j)) < 1e-12
    expected = x + row.conj() * (1 + 2j - row @ x) / np.vdot(row, row).real
    assert np.abs(moved - expected).max() < 1e-12
    full, targets = everything(order, False)
    distant = 100 * np.random.default_rng(3).normal(size=full.back.shape[0]).astype(complex)
    assert np.abs(full.solve(targets, distant) - full.solve(targets)).max() < 1e-7


def test_energies_are_summed_by_name():
    system, targets = everything(0, False)
    doubled = LeastSquares([*system.terms, system.terms[1]])
    x = doubled.solve([*targets, targets[1]])
    energies = doubled.energies(x, [*targets, targets[1]])
    assert energies["pins"] == pytest.approx(2 * system.terms[1].energy(x, targets[1]))
    assert energies["total"] == pytest.approx(sum(v for k, v in energies.items() if k != "total"))


def test_only_right_hand_sides_change_between_solves():
    """Solving is linear in the targets of zeroth order: the matrix is factorised once."""
    system, a = everything(0, True)
    b = [Target(t.points * 1j + 0.3) for t in a]
    targets = [Target(s.points + t.points) for s, t in zip(a, b)]
    assert np.abs(system.solve(targets) - system.solve(a) - system.solve(b)).max() < 1e-10


def test_underdetermined_systems_get_the_smallest_coefficients():
    basis = Basis(arrow())
    z = inside(arrow(), 1)
    system = LeastSquares([points(basis, z, np.array([1 + 2j]), 1.0)])
    x = system.solve(system.targets(np.zeros(8, complex)))
    row = basis.positions(z)[0]
    assert abs(row @ x - (1 + 2j)) < 1e-12
    assert np.abs(x - row.conj() * (1 + 2j) / np.vdot(row, row).real).max() < 1e-12


def test_coincident_rows_do_not_spoil_the_solution():
    """Two hundred copies of one sample, and directions that the coordinates hardly determine: still finite and
    exact.
    """
    polygon = Curve(random_polygon(np.random.default_rng(1), 40))
    basis = Basis(polygon.z)
    z = np.concatenate([polygon.sample(4), np.repeat(polygon.sample(1)[:1], 200)])
    aim = 2j * z + 1
    term = EnergyTerm("all", 1.0, basis.positions(z), np.full(z.size, 1 / z.size), fixed(aim))
    x = LeastSquares([term]).solve([Target(aim)])
    assert np.abs(x - (2j * polygon.z + 1)).max() < 1e-9


def test_first_order_lets_the_boundary_slide_along_the_target():
    """Points on a line that moved along it: the zeroth order pulls them back, the first by its share λ."""
    polygon = Curve(arrow())
    basis = Basis(polygon.z)
    line = Curve(np.array([-10, 10], complex), closed=False)
    z = np.linspace(0.5, 2, 6) + 0.5j
    term = closeness(basis, z, np.full(6, 1 / 6), line, tangent=True)
    hold = EnergyTerm("hold", 1.0, basis.positions(z), np.full(6, 1 / 6), fixed(z + 1))
    system = LeastSquares([term, hold], tangential=0.25)
    feet = Target(z.real.astype(complex), np.full(6, 1j))
    image = term.matrix @ system.solve([feet, Target(z + 1)])
    assert np.allclose(image.imag, 0.25, atol=1e-9)  # y² + (y - 0.5)²
    assert np.allclose(image.real, z.real + 1 / 1.25, atol=1e-9)  # λ x² + (x - 1)²


def test_measures_of_a_curve_sum_to_one():
    measure = measure_of(Curve(arrow()), 3)
    assert measure.size == 24 and measure.sum() == pytest.approx(1)
