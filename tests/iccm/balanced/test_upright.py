"""The additional cost of a map that rotates the picture."""

from dataclasses import replace

import numpy as np
import pytest

import iccm
from iccm.balanced.minimise.energy import NO_SLOTS, RestShapes, geometry
from iccm.balanced.minimise.upright import Upright, rotation_cost, rotation_derivatives, rotation_factor
from iccm.balanced.model.boundary_pairs import Match
from iccm.balanced.model.energy import WITHOUT_ROTATION, Energy
from iccm.balanced.model.measures import mean_rotation
from iccm.balanced.search.levels import Level
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from iccm.linalg.cholesky import Factor, back_substitute, factorise, forward_substitute, system_of
from tests.triangulations import irregular


def unit(z):
    curve = Curve(z)
    return Curve(z / np.sqrt(curve.area))


SQUARE = np.array([0, 1, 1 + 1j, 1j])
T = 2 * np.pi * np.arange(120) / 120
PEAR = unit(np.exp(1j * T) * (1 + 0.25 * np.cos(T - 1) + 0.12 * np.cos(2 * T)))
BLOB = unit(np.exp(1j * T) * (1 + 0.12 * np.cos(3 * T + 0.7) + 0.1 * np.cos(2 * T - 1)))


def mesh():
    z, faces, _ = irregular(SQUARE, 0.2)
    return z, faces, RestShapes(faces, NO_SLOTS, *geometry(z, faces))


def test_a_similarity_costs_as_much_as_its_rotation():
    z, faces, rest_shapes = mesh()
    for turn in (0.0, 0.4, np.pi):
        u = 1.7 * np.exp(1j * turn) * z + 2
        assert mean_rotation(z, u, faces) == pytest.approx(turn, abs=1e-12)
        cost = rotation_factor(Upright.of(rest_shapes, z.size, 3.0), u, 2.0)
        assert cost == pytest.approx((1 + 1.5 * (1 - np.cos(turn))) ** 2)
        assert rotation_cost(3.0, np.cos(turn)) ** 2 == pytest.approx(cost)


def test_the_inverse_map_rotates_in_the_opposite_direction():
    z, faces, _ = mesh()
    u = np.exp(0.3j) * (z + 0.1 * z.conj() ** 2)
    assert mean_rotation(u, z, faces) == pytest.approx(-mean_rotation(z, u, faces), abs=1e-12)


def test_derivatives_by_differences():
    z, _, rest_shapes = mesh()
    upright, q = Upright.of(rest_shapes, z.size, 3.0), 3.0
    u = np.exp(0.5j) * z + 0.05 * z.conj()
    step = 1e-6 * (np.cos(7 * z.real) + 1j * np.sin(5 * z.imag))
    gradient = np.empty(z.size, np.complex128)
    slope, _ = rotation_derivatives(upright, u, q, gradient)
    change = np.log(rotation_factor(upright, u + step, q) / rotation_factor(upright, u - step, q))
    assert 2 * slope * (gradient.conj() * step).real.sum() == pytest.approx(change, rel=1e-6)


@pytest.mark.slow
def test_forward_substitution_works_for_another_gradient():
    _, faces, _ = mesh()
    n, rng = faces.max() + 1, np.random.default_rng(1)
    pattern = system_of(faces, np.empty(0, np.int64), n)
    matrix = rng.normal(size=(pattern.columns.size, 4))
    matrix[pattern.diagonal] = [40.0, 0.5, 0.5, 40.0]
    first, second = rng.normal(size=(2, n, 2)) @ [1, 1j]
    steps = np.empty((2, n), np.complex128)
    factor = Factor.of(pattern)
    assert factorise(pattern, matrix, second, factor)
    back_substitute(pattern, factor, steps[0])
    assert factorise(pattern, matrix, first, factor)
    forward_substitute(pattern, second, factor)
    back_substitute(pattern, factor, steps[1])
    assert np.abs(steps[0] - steps[1]).max() < 1e-13


def test_newton_lowers_the_cost_of_the_rotation():
    """Two blobs between which every rotation costs nearly the same energy: the map rotates back."""
    turned = []
    for upright in (0.0, 3.0):
        level = Level.of(UnitProblem(PEAR, BLOB, Energy(upright=upright)), 0.1, 0.0, 6e-4, 20.0, smooth=True)
        even = np.linspace(0, 1, 9)
        match = Match(even * level.source.length, (even + 0.1) * level.target.length)
        state = level.started(match).forward(1.0, 60, 1e-9)
        turned.append(
            (abs(state.rotation), replace(state, energy=WITHOUT_ROTATION).forward(1.0, 1, 1e-9).value)
        )
    assert turned[1][0] < np.radians(3) < np.radians(20) < turned[0][0]
    assert turned[0][1] < turned[1][1]


def test_smooth_shapes_stay_upright():
    assert abs(iccm.fit(PEAR, BLOB).report()["turn"]) < 5
