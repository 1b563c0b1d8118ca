"""Kernels of Newton's method, against the same in plain Python: equal to the last bit, since no sum is reordered."""

from dataclasses import replace

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise import energy, newton, sliding, upright
from iccm.balanced.minimise.energy import Objective, RestShapes
from iccm.balanced.minimise.newton import System
from iccm.balanced.minimise.sliding import Border, Constraints, Rail, Rails
from iccm.balanced.minimise.upright import ANY_ROTATION, Upright
from iccm.linalg import cholesky
from iccm.plane import triangle_areas
from tests.core.line_search import line_search
from tests.core.reference import minimise as reference

COUNT = 14  # vertices of the outline
SHAPE = (
    np.exp(2j * np.pi * np.arange(COUNT) / COUNT)
    * (1 + 0.3 * np.cos(np.arange(COUNT) + 0.4))
    / np.sqrt(np.pi)
)
Z, FACES = triangulate(SHAPE, Sizes.even(0.1))
PATTERN = cholesky.system_of(FACES, (np.arange(COUNT) + 1) % COUNT, Z.size)
GRADIENTS, AREAS = energy.geometry(Z, PATTERN.corners)
RNG = np.random.default_rng(7)
BENT = Z + 0.12 * Z**2 + 0.08 * Z.conj() + 0.01 * (RNG.normal(size=Z.size) + 1j * RNG.normal(size=Z.size))
FOLDED = BENT + np.where(np.arange(Z.size) == Z.size - 1, 0.9, 0)
NO_HOLD = Constraints.of_fixed(BENT, np.zeros(Z.size, bool))


def rest_shapes(kind="plain"):
    weights, aims = AREAS, np.empty(0, complex)
    if kind == "voids":
        weights = np.where(np.arange(AREAS.size) % 5 == 2, -0.3, 1.0) * AREAS
    if kind == "rigid":
        aims = np.where(np.arange(AREAS.size) % 4 == 1, 0.9 + 0.1j, 0)
    return RestShapes.of(PATTERN, GRADIENTS, weights, aims)


def outline():
    """Rails, chains and arclengths of an outline that slides, two of whose vertices are held away from their goals."""
    knots = np.append(0, np.cumsum(np.abs(np.roll(BENT[:COUNT], -1) - BENT[:COUNT])))
    rail = Rail(knots, BENT[:COUNT].copy(), knots[[2, 9]].copy())
    following = (np.arange(COUNT) + 1) % COUNT
    laps = np.append(np.zeros(COUNT - 1), knots[-1])
    border = Border(following, np.diff(knots) * (1 + 0.2 * RNG.random(COUNT)), np.full(COUNT, 0.02), laps)
    kinds = np.full(COUNT, sliding.SLIDING)
    return knots[:-1].copy(), Rails.of([rail], np.zeros(COUNT, np.int64)), border, kinds


def constrained(goals):
    tau, rails, border, kinds = outline()
    places = BENT[:COUNT].copy()
    if goals:
        kinds[[4, 11]] = sliding.HELD
        places[4] += 0.05 - 0.03j
    kinds[12] = sliding.FREE
    return tau, Constraints(kinds, places, rails, border)


def matrix_and_gradient(kind="plain", objective=None, u=BENT):
    objective = objective or Objective.of(1.0, 3.0)
    matrix, gradient = np.empty((PATTERN.columns.size, 4)), np.empty(Z.size, complex)
    value = energy.assemble(rest_shapes(kind), u, objective, matrix, gradient)
    return value, matrix, gradient


OBJECTIVES = {
    "plain": Objective.of(1.0, 3.0),
    "voids": Objective.of(0.7, 2.5),
    "rigid": Objective.of(1.0, 1.0, 0.0),
    "inverse voids": Objective.of(1.3, 4.0, 1.0, forward=False),
    "untangling": Objective(1.0, 1.0, 0.5, 0.2),
}


@pytest.mark.parametrize("name", OBJECTIVES)
def test_energy_and_derivatives(name):
    objective, shapes = OBJECTIVES[name], rest_shapes(name.split()[-1])
    u = FOLDED if name == "untangling" else BENT
    matrix, gradient = np.empty((PATTERN.columns.size, 4)), np.empty(Z.size, complex)
    plain_matrix, plain_gradient = np.full_like(matrix, 3), np.full_like(gradient, 3)
    value = energy.assemble(shapes, u, objective, matrix, gradient)
    assert value == reference.assemble(shapes, u, objective, plain_matrix, plain_gradient)
    assert np.array_equal(matrix, plain_matrix) and np.array_equal(gradient, plain_gradient)
    assert energy.total(shapes, u, objective) == reference.total(shapes, u, objective)


def test_folds_are_infinite():
    objective = Objective.of(1.0, 2.0)
    assert (
        energy.total(rest_shapes(), FOLDED, objective)
        == reference.total(rest_shapes(), FOLDED, objective)
        == np.inf
    )
    least = energy.least_determinant(rest_shapes(), FOLDED)
    assert least == reference.least_determinant(rest_shapes(), FOLDED) < 0


def test_geometry_of_triangles():
    gradients, areas = np.empty(FACES.shape, complex), np.empty(len(FACES))
    reference.hat_gradients(FACES, FOLDED, gradients, areas)
    result = energy.geometry(FOLDED, FACES)
    assert np.array_equal(result[0], gradients) and np.array_equal(result[1], areas)


def test_the_factor_and_both_substitutions():
    _, matrix, gradient = matrix_and_gradient()
    reference.regularise(PATTERN, matrix, 1e-3)
    factors = [cholesky.Factor.of(PATTERN) for _ in range(2)]
    for factor in factors:
        factor.values[:] = 0
    assert cholesky.factorise(PATTERN, matrix, gradient, factors[0])
    assert reference.factorise(PATTERN, matrix, gradient, factors[1])
    steps = np.empty((2, Z.size), complex)
    panels = PATTERN.fronts.panels[-1]
    for right in (gradient, gradient.conj() + 0.3):
        assert np.array_equal(factors[0].values[:panels], factors[1].values[:panels])
        cholesky.back_substitute(PATTERN, factors[0], steps[0])
        reference.back_substitute(PATTERN, factors[1], steps[1])
        assert np.array_equal(*steps)
        cholesky.forward_substitute(PATTERN, right, factors[0])
        reference.forward_substitute(PATTERN, right, factors[1])


def test_an_indefinite_matrix_is_refused():
    _, matrix, gradient = matrix_and_gradient()
    matrix[PATTERN.diagonal[3], 0] = -1
    assert not cholesky.factorise(PATTERN, matrix, gradient, cholesky.Factor.of(PATTERN))
    assert not reference.factorise(PATTERN, matrix, gradient, cholesky.Factor.of(PATTERN))


@pytest.mark.parametrize("s", [-0.3, 0.0, 0.4, 1.7, 2.2, 9.1])
def test_places_of_a_rail(s):
    _, rails, _, _ = outline()
    rail = reference.rail_of(rails, 0)
    assert sliding.point_at(rail, s) == reference.point_at(rail, s)
    for shift in (0.0, rail.corners[1] - s):
        assert sliding.corners_beside(rail, s + shift) == reference.way_to_corners(rail, s + shift)


def test_directions_of_sliding_vertices():
    tau, constraints = constrained(goals=True)
    tau[2] = constraints.rails.corners[0]
    gradient = RNG.normal(size=Z.size) + 1j * RNG.normal(size=Z.size)
    slopes, curvatures = np.empty((2, COUNT)), np.empty((2, COUNT))
    sliding.border_derivatives(constraints.border, tau, slopes[0], curvatures[0])
    reference.border_derivatives(constraints.border, tau, slopes[1], curvatures[1])
    assert np.array_equal(*slopes) and np.array_equal(*curvatures)
    ways, low, high = np.empty((2, COUNT), complex), np.empty((2, COUNT)), np.empty((2, COUNT))
    sliding.choose_directions(constraints, tau, gradient, slopes[0], ways[0], low[0], high[0])
    reference.choose_directions(
        constraints.rails, tau, constraints.kinds, gradient, slopes[0], ways[1], low[1], high[1]
    )
    assert np.array_equal(*ways) and np.array_equal(*low) and np.array_equal(*high)
    assert sliding.border_energy(constraints.border, tau) == reference.border_energy(constraints.border, tau)


def test_the_cost_of_a_rotation():
    cost, q = Upright.of(rest_shapes(), Z.size, 3.0), 2.0
    assert upright.rotation_factor(cost, BENT, q) == reference.rotation_factor(cost, BENT, q)
    turning = np.empty((2, Z.size), complex)
    assert upright.rotation_derivatives(cost, BENT, q, turning[0]) == reference.rotation_derivatives(
        cost, BENT, q, turning[1]
    )
    assert np.array_equal(*turning)


def test_the_largest_step():
    step = 0.3 * (RNG.normal(size=Z.size) + 1j * RNG.normal(size=Z.size))
    assert newton.largest_step(FACES, BENT, step) == reference.largest_step(FACES, BENT, step) < 1e9


@pytest.mark.parametrize("power", [2, 4, 8])
def test_the_line_search_accepts_the_energy_at_the_last_share_that_it_tried(power):
    """Convex functions with a minimum at 0.3 that are infinite beyond 0.8, and Armijo's condition."""
    tried = []

    def energy_at(share):
        tried.append(share)
        return 2 + (share / 0.3 - 1) ** power if share < 0.8 else np.inf

    def most(share):
        return 3 - 1e-5 * share * power / 0.3

    share, energy = line_search(1.0, energy_at, most)
    assert 0 < share == tried[-1] <= max(tried) <= 1
    assert energy == energy_at(share) <= most(share)


@pytest.mark.parametrize("largest", [1.0, 0.37, 3e-7, 1e-9])
def test_the_line_search_halves_the_step_until_it_is_accepted(largest):
    """Beside a search written out; steps below 1e-8, where rounding dominates, are not tried."""

    def energy_at(share):
        return 3 - share if share <= largest else np.inf

    shares = 0.9 * 0.5 ** np.arange(60)
    expected = next((s for s in shares[shares > 1e-8] if energy_at(s) <= 3), 0)
    assert line_search(0.9, energy_at, lambda share: 3)[0] == expected


def test_a_line_search_that_finds_no_lower_energy_accepts_no_share():
    assert line_search(1.0, lambda share: 3 + share, lambda share: 3 - share)[0] == 0


MODES = {
    "descending": (False, Objective.of(1.0, 3.0), ANY_ROTATION, False),
    "upright": (False, Objective.of(1.0, 1.0), Upright.of(rest_shapes(), Z.size, 3.0), False),
    "moving": (True, Objective.of(1.0, 1.0), ANY_ROTATION, False),
    "untangling": (False, Objective(1.0, 1.0, epsilon=0.3), ANY_ROTATION, False),
    "with one factor": (False, Objective.of(1.0, 1.0), ANY_ROTATION, True),
}


@pytest.mark.parametrize("mode", MODES)
@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def test_a_descent(mode):
    goals, objective, cost, factorised = MODES[mode]
    tau, constraints = constrained(goals)
    start = FOLDED if mode == "untangling" else BENT
    results = []
    for descend in (newton.descend, reference.descend):
        u, s = start.copy(), tau.copy()
        system = System.of(PATTERN, FACES, rest_shapes(), constraints, cost)
        result = descend(system, objective, None, u, s, 4, 1e-12)
        if factorised:
            result = descend(replace(system, factorised=True), objective, None, u, s, 2, 1e-12)
        results.append((u, s, result))
    (u, s, result), (plain_u, plain_s, plain_result) = results
    assert result == plain_result and result[1] > 1
    assert np.array_equal(u, plain_u) and np.array_equal(s, plain_s)
    assert not np.array_equal(u, start)


@pytest.mark.parametrize("mode", ["descending", "moving"])
@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def test_a_descent_ends_where_vertices_have_moved_as_far_as_they_may(mode):
    goals, objective, cost, _ = MODES[mode]
    tau, constraints = constrained(goals)

    def displacement(descend, reach):
        u, s = BENT.copy(), tau.copy()
        system = System.of(PATTERN, FACES, rest_shapes(), constraints, cost)
        results.append((*descend(system, objective, None, u, s, 30, 1e-12, reach), *u.tolist(), *s.tolist()))
        assert (triangle_areas(u[FACES]) > 0).all()
        return np.sqrt(np.mean(np.abs(u - BENT) ** 2))

    results = []
    far = displacement(newton.descend, np.inf)
    for share in (0.1, 0.6):
        results.clear()
        moved = [displacement(descend, share * far) for descend in (newton.descend, reference.descend)]
        assert results[0] == results[1]
        assert 0 < moved[0] <= share * far * (1 + 1e-9)
    assert moved[0] > 0.1 * far


def test_a_quadratic_energy_takes_one_step():
    """The derivatives are given: those of a positive matrix and a gradient."""
    _, matrix, gradient = matrix_and_gradient()
    results = []
    for step in (newton.quadratic_step, reference.quadratic_step):
        constraints = Constraints.of_fixed(BENT, np.arange(Z.size) < COUNT)
        system, u = System.of(PATTERN, FACES, rest_shapes(), constraints), BENT.copy()
        system.workspace.matrix[:], system.workspace.gradient[:] = matrix, gradient
        with np.errstate(invalid="ignore"):
            assert step(system, u, np.zeros(COUNT))
        results.append(u)
    assert np.array_equal(*results)
    assert np.array_equal(results[0][:COUNT], BENT[:COUNT]) and not np.array_equal(results[0], BENT)
