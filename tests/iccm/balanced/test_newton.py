"""Sliding, Newton and untangling on small maps."""

from dataclasses import replace

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes
from iccm.balanced.minimise.energy import RestShapes, geometry
from iccm.balanced.minimise.newton import largest_step
from iccm.balanced.minimise.sliding import (
    SLIDING,
    Border,
    Constraints,
    Rails,
    border_derivatives,
    border_energy,
    choose_directions,
    corners_beside,
    point_at,
)
from iccm.balanced.minimise.untangle import LEAST_WEIGHT, untangle
from iccm.balanced.model.boundary import MatchedBoundary
from iccm.balanced.model.boundary_mesh import mesh_boundary
from iccm.balanced.model.boundary_pairs import Match, boundary_pairs
from iccm.balanced.model.discrete_map import folds
from iccm.balanced.model.outline import Outline
from iccm.curve import Curve

SQUARE = Outline.of(Curve(np.array([-0.5 - 0.5j, 0.5 - 0.5j, 0.5 + 0.5j, -0.5 + 0.5j])), 0.0, 0.0)
WIDE = Outline.of(Curve(np.array([-1 - 0.25j, 1 - 0.25j, 1 + 0.25j, -1 + 0.25j])), 0.0, 0.0)
ELL = Outline.of(Curve(np.array([0, 2, 2 + 1j, 1 + 1j, 1 + 2j, 2j]) / np.sqrt(3)), 0.0, 0.0)


def begun(source, target, shift=0.0, size=0.12):
    match = Match(np.array([0.0, source.length]), shift + np.array([0.0, target.length]))
    pairs = boundary_pairs(source, target, match, 0.75 * size)
    return mesh_boundary(MatchedBoundary.of(source, target, pairs, None), Sizes.even(0.5 * size**2))


def test_the_outlines_energy_has_the_derivatives_that_are_used():
    rng = np.random.default_rng(0)
    tau = np.sort(rng.uniform(0, 5, 9))
    border = Border(
        (np.arange(9) + 1) % 9, rng.uniform(0.2, 1, 9), np.full(9, 0.3), np.append(np.zeros(8), 6.0)
    )
    slope, curvature = np.empty(9), np.empty(9)
    border_derivatives(border, tau, slope, curvature)
    for v in range(9):
        step = np.eye(9)[v] * 1e-6
        ends = [border_energy(border, tau + sign * step) for sign in (1, -1)]
        assert slope[v] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-8)
        second = (ends[0] + ends[1] - 2 * border_energy(border, tau)) / 1e-12
        assert curvature[v] + curvature[v - 1] == pytest.approx(second, rel=1e-2)
    assert border_energy(border, tau[::-1].copy()) == np.inf


def test_corners_ahead_and_behind():
    rail = SQUARE.rail
    assert corners_beside(rail, 1.25) == (False, pytest.approx(-0.25), pytest.approx(0.75))
    assert corners_beside(rail, 2.0 + 1e-10)[0] and corners_beside(rail, 4.0 - 1e-10)[0]
    assert corners_beside(rail, -0.25) == (False, pytest.approx(-0.75), pytest.approx(0.25))
    assert point_at(rail, 5.5) == pytest.approx(0.5 + 0j)


@pytest.mark.parametrize(
    ("pull", "expected"),
    [(-1 - 1j, 1j), (1 + 1j, 1), (-1 + 1j, 0), (1 - 1j, 1)],
    ids=["on", "back", "stay", "either"],
)
def test_a_vertex_on_a_corner_stays_while_both_slopes_hold_it(pull, expected):
    tau = np.array([1.0])  # the corner ½ - ½i, reached along +x and left along +y
    gradient, slope = np.array([pull + 0j]), np.zeros(1)
    ways, low, high = np.empty(1, complex), np.empty(1), np.empty(1)
    rails = Rails.of([SQUARE.rail], np.zeros(1, int))
    constraints = Constraints(
        np.array([SLIDING]), np.zeros(1, complex), rails, Border.still(np.zeros(1, int))
    )
    choose_directions(constraints, tau, gradient, slope, ways, low, high)
    if expected == 0:
        assert ways[0] == 0 and low[0] == high[0] == 0
    else:
        downhill = -np.sign((gradient[0].conj() * ways[0]).real)
        assert (high[0] > 0) == (downhill > 0) and (low[0] < 0) == (downhill < 0)


def test_the_largest_step_is_where_a_triangle_has_no_area():
    u = np.array([0, 1, 1j])
    step = np.array([0, 0, -0.5j])
    assert largest_step(np.array([[0, 1, 2]]), u, step) == pytest.approx(2)
    assert largest_step(np.array([[0, 1, 2]]), u, -step) == 1e9


def test_newton_finds_the_identity():
    start = begun(SQUARE, SQUARE)
    u = start.z.copy()
    u[start.border :] += 0.02 * np.random.default_rng(1).standard_normal(u.size - start.border)
    end = replace(start, u=u).forward(1.0, 30, 1e-14, corners=True)
    assert np.abs(end.u - end.z).max() < 1e-6
    assert end.value == pytest.approx(1 + 0.02 * 4, abs=1e-9)


def test_newton_decreases_the_energy_and_never_folds():
    state = begun(SQUARE, ELL, 0.3).unfold_from_harmonic()
    energies = []
    for _ in range(12):
        state = state.forward(1.0, 1, 1e-9, corners=False)
        energies.append(state.value)
        assert folds(state.faces, state.u) == 0
        assert (np.diff(state.pairs.tau) > 0).all()
        assert np.abs(state.u[: state.border] - ELL.curve.at(state.pairs.tau)).max() < 1e-9
    gains = -np.diff(energies)
    # quadratic convergence at the end
    assert (gains >= -1e-12).all() and gains[0] > 0.01 and gains[-1] < 1e-6


def test_a_wide_box_is_not_worse_than_the_affine_map():
    state = begun(SQUARE, WIDE, 0.0).unfold_from_harmonic().forward(1.0, 40, 1e-10, corners=False)
    affine = 0.5 * (4**2 + 1) / 4 * 1.0  # p/d of the singular values 2 and 1/2
    outline = 0.02 * 0.5 * 2 * (2 + 0.5 + 0.5 + 2)
    assert state.value <= affine + outline + 1e-9


def test_the_inverse_is_minimised_by_the_same_steps():
    state = begun(SQUARE, ELL, 0.3).unfold_from_harmonic().forward(1.0, 20, 1e-8, corners=False)
    better = state.backward(1.0, 8, 1e-9)
    assert better.value <= state.value + 1e-12
    assert np.array_equal(better.u, state.u) and folds(better.faces, better.z) == 0


def test_folds_are_undone_with_the_outline_held():
    start = begun(SQUARE, ELL, 0.8)
    end = start.unfold_from_harmonic()
    assert folds(start.faces, start.u) > 0 and folds(end.faces, end.u) == 0
    assert np.array_equal(end.u[: end.border], start.u[: start.border])


def test_the_harmonic_start_is_the_mean_of_its_neighbours_by_half_cotangents():
    start = begun(SQUARE, ELL, 0.3)
    corners, u = start.pattern.corners, start.u.copy()
    rest_shapes = RestShapes.of(start.pattern, *geometry(start.z, corners))
    untangle(start.pattern, rest_shapes, u, np.arange(u.size) < start.border, True, 0, 0)
    pull = np.zeros_like(u)
    for triangle in corners:
        for i, j, k in (np.roll(triangle, -shift) for shift in range(3)):
            corner = (start.z[j] - start.z[i]) * (
                start.z[k] - start.z[i]
            ).conj()  # at i, opposite the edge jk
            weight = max(0.5 * corner.real / abs(corner.imag), LEAST_WEIGHT)
            pull[j] += weight * (u[k] - u[j])
            pull[k] += weight * (u[j] - u[k])
    assert np.abs(pull[start.border :]).max() < 1e-7 * np.abs(pull[: start.border]).max()
    assert np.array_equal(u[: start.border], start.u[: start.border])


def test_images_are_moved_to_the_outline_with_little_change_inside():
    start = begun(SQUARE, SQUARE)
    pushed = start.z * 1.02
    moved = start.move_to_border(pushed)
    assert np.array_equal(moved.u[: moved.border], start.u[: start.border])
    middle = np.argmin(np.abs(start.z))
    assert moved.u[middle] == pytest.approx(pushed[middle], abs=1e-3) and folds(moved.faces, moved.u) == 0


def test_a_fold_is_undone_where_it_is():
    state = begun(SQUARE, ELL, 0.3, size=0.05).unfold_from_harmonic()
    middle = state.border + int(np.argmin(np.abs(state.z[state.border :])))
    u = state.u.copy()
    u[middle] += 0.2
    bad = replace(state, u=u)
    unfolded = bad.unfold_locally()
    assert folds(bad.faces, bad.u) > 0 and folds(unfolded.faces, unfolded.u) == 0
    moved = np.abs(unfolded.z[unfolded.u != bad.u] - unfolded.z[middle])
    assert moved.size > 0 and moved.max() < 0.4
