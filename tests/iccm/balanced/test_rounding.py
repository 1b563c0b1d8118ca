"""Outlines rounded to a grid during the search, and maps that are stable under noise."""

import numpy as np
import pytest

import iccm
from iccm.balanced.model.energy import Energy
from iccm.balanced.model.mesh_map import MeshMap
from iccm.balanced.search.rounding import GRID_SPACING, restore_outline, rounded, snap_to_coarse_grid
from iccm.balanced.search.unit_problem import UnitProblem
from iccm.curve import Curve
from iccm.problem import NO_HOLES, Holes
from tests.cases import slow
from tests.shapes import arrow, ell

RNG = np.random.default_rng(1)
SQUARE = np.array([0, 1, 1 + 1j, 1j])
PINS = np.array([[0.5 + 0.5j, 0.4 + 0.5j], [0.7 + 0.3j, 1.5 + 0.4j]])


def shaken(z, size=1e-9):
    return z + size * np.exp(2j * np.pi * RNG.random(np.shape(z)))


def unit(z, size=1.0):
    curve = Curve.domain(size * z)
    return Curve(curve.z / np.sqrt(curve.area))


def test_noise_is_rounded_away():
    domains = unit(shaken(arrow())), unit(shaken(ell()))
    first = rounded(UnitProblem(*domains, Energy()))
    again = rounded(UnitProblem(*(Curve(shaken(np.roll(c.z, 2))) for c in domains), Energy()))
    for curve, repeated in ((first.source, again.source), (first.target, again.target)):
        assert np.array_equal(curve.z, repeated.z) and np.array_equal(curve.z, snap_to_coarse_grid(curve.z))


def test_outlines_that_would_touch_stay_as_they_are():
    square = unit(SQUARE)
    holes = [Curve(0.5 + 0.5j + d + 0.2 * SQUARE[::-1]) for d in (0, 0.2 + 0.05 * GRID_SPACING)]
    problem = UnitProblem(square, square, Energy(), holes=Holes(tuple(holes)))
    assert rounded(problem) is problem
    pins = np.array([[0.2 + 0.3j, 0.1], [0.2 + 0.3j + 0.1 * GRID_SPACING, 0.3]])
    assert rounded(problem._replace(holes=NO_HOLES, pins=pins)).pins is pins  # both would be at one place


@pytest.mark.parametrize("pins", [slow(None), slow(PINS[:1]), PINS], ids=["free", "pin", "pins"])
def test_noise_does_not_move_a_map(pins):
    """Neither with pins, nor if the vertices of the drawing are rounded themselves: these are met exactly."""
    shapes = SQUARE, ell()
    before = iccm.fit(*shapes, exact_pins=True, pins=pins, fit="whole")
    shaken_pins = None if pins is None else shaken(pins)
    after = iccm.fit(*map(shaken, shapes), exact_pins=True, pins=shaken_pins, fit="whole")
    z = before.map.source[before.map.faces].mean(axis=1)
    assert np.abs(after.map(z) - before.map(z)).max() < 1e-7
    assert before.report()["boundary"]["hausdorff"] < 1e-9
    if pins is not None:
        assert np.abs(before.map(pins[:, 0]) - pins[:, 1]).max() < 1e-9


def strip(width):
    """Two triangles on the grid, with the middle of the long sides between given vertices."""
    z = snap_to_coarse_grid(np.array([0, 0.5, 1, 1 + 1j * width, 0.5 + 1j * width, 1j * width]))
    return z, np.array([[0, 1, 5], [1, 4, 5], [1, 2, 4], [2, 3, 4]])


def test_a_boundary_is_restored_vertex_by_vertex():
    z, faces = strip(0.25)
    corners = z[[0, 2, 3, 5]]
    given = corners + 0.4 * GRID_SPACING * np.array([1, 1j, -1, -1j])
    state = restore_outline(MeshMap.plain(z, z, faces, 6), [given], [corners])
    assert np.array_equal(state.z[[0, 2, 3, 5]], given) and np.array_equal(state.u, z)
    assert state.z[1] == pytest.approx(0.5 * (given[0] + given[1]), abs=1e-12)
    assert state.z[4] == pytest.approx(0.5 * (given[2] + given[3]), abs=1e-12)


@pytest.mark.parametrize(("height", "stay"), [(0.5, []), (0.3, [0, 1])])
def test_outlines_that_would_fold_are_kept_and_pins_restored(height, stay):
    """A vertex inside is closer to the boundary than this moves; pins do not matter."""
    z = np.append(SQUARE, [0.5 + height * GRID_SPACING * 1j, 0.5 + 0.5j])
    faces = np.array([[0, 1, 4], [1, 5, 4], [0, 4, 5], [1, 2, 5], [2, 3, 5], [3, 0, 5]])
    given, pin = SQUARE + 0.4 * GRID_SPACING * 1j, 0.5 + 0.5j + 0.3 * GRID_SPACING
    state = restore_outline(MeshMap.plain(z, z, faces, 4), [given, [pin]], [SQUARE, [pin]])
    expected = given.copy()
    expected[stay] = SQUARE[stay]
    assert np.array_equal(state.z[:4], expected) and state.z[5] == state.u[5] == pin
