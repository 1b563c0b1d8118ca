"""Curves: validation, arclength, closest points, resampling."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.curve import Curve, hausdorff
from iccm.errors import InputError
from tests.shapes import arrow, circle, ell, inside, pear, square

BAD_DOMAINS = {
    "nan": ([0, 1, complex(0, np.nan)], "shape: vertex 2 is not a finite number"),
    "infinite": ([0, np.inf, 1j], "shape: vertex 1 is not a finite number"),
    "empty": ([], "0 distinct vertices; at least 3"),
    "point": ([1, 1, 1, 1], "1 distinct vertices"),
    "two": ([0, 1, 1, 0], "2 distinct vertices"),
    "line": ([0, 1, 2, 3], "encloses no area"),
    "symmetric bow": ([0, 1 + 1j, 1, 1j], "crosses itself at (0.5, 0.5); remove the crossing"),
    "touching": ([0, 4, 4 + 4j, 2, 4j], "touches itself at (2, 0)"),
    "bow": ([0, 2 + 2j, 2, 1j], "crosses itself at (0.666667, 0.666667)"),
}


@pytest.mark.parametrize("name", BAD_DOMAINS)
def test_invalid_domains_are_refused_in_one_line(name):
    z, message = BAD_DOMAINS[name]
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        Curve.domain(z)
    assert "\n" not in str(caught.value)


def test_the_error_names_the_bad_shape():
    with pytest.raises(InputError, match=r"^hand: vertex 0"):
        Curve.domain([np.nan, 1, 1j], "hand")
    with pytest.raises(InputError, match=r"^arm: a stroke needs at least 2 distinct points"):
        Curve.stroke([1, 1, 1], "arm")
    with pytest.raises(InputError, match=r"^arm: vertex 1 is not"):
        Curve.stroke([1, np.nan], "arm")


def test_a_domain_is_turned_counter_clockwise_and_keeps_its_first_vertex():
    z = arrow()
    clockwise = np.roll(z[::-1], 1)
    assert Curve(clockwise).area < 0
    for given_ in (z, clockwise):
        assert np.array_equal(Curve.domain(given_).z, z)


def test_repeated_vertices_are_dropped():
    z = square()
    assert np.array_equal(Curve.domain([*z, z[0]]).z, np.roll(z, -1)) or np.array_equal(
        Curve.domain([*z, z[0]]).z, z
    )
    assert Curve.domain(np.repeat(z, 3)).z.size == 4
    assert Curve.stroke([0, 0, 1, 1, 0]).z.tolist() == [0, 1, 0]


def test_area_length_box_and_normals():
    curve = Curve(ell() + 5)
    assert curve.area == pytest.approx(3) and curve.reversed().area == pytest.approx(-3)
    assert curve.length == 8 and curve.box == (5 + 0j, 7 + 2j) and curve.diagonal == pytest.approx(np.sqrt(8))
    assert np.allclose(curve.normals, [-1j, 1, 1j, 1, 1j, -1])


def test_area_keeps_its_digits_far_from_the_origin():
    z = pear() * 1e-3
    assert Curve(z + 1e6 * (1 + 1j)).area == pytest.approx(Curve(z).area, rel=1e-5)


def test_places_by_arclength_are_cyclic_when_closed_and_clamped_when_open():
    closed, path = Curve(square()), Curve(square(), closed=False)
    assert np.allclose(closed.at([0, 1, 2, 7, 8, 9, -1]), [-1 - 1j, -1j, 1 - 1j, -1, -1 - 1j, -1j, -1])
    assert np.allclose(path.at([-1, 0, 5, 6, 7]), [-1 - 1j, -1 - 1j, 1j, -1 + 1j, -1 + 1j])
    edge, t = closed.locate([0.5, 2, 7.5])
    assert edge.tolist() == [0, 1, 3] and np.allclose(t, [0.25, 0, 0.75])


def test_an_open_curve_has_one_edge_less_and_its_own_reversal():
    path = Curve(np.array([0, 1, 1 + 2j]), closed=False)
    assert path.edges.tolist() == [1, 2j] and path.length == 3
    assert path.reversed().z.tolist() == [1 + 2j, 1, 0]
    assert np.allclose(path.sample(2), [0.25, 0.75, 1 + 0.5j, 1 + 1.5j])


def brute_distance(curve, w):
    """Distances of points to the nearest of all edges, by projection."""
    a, e = curve.z[: curve.edges.size], curve.edges
    t = np.clip(((w[:, None] - a) * e.conj()).real / np.abs(e) ** 2, 0, 1)
    return np.abs(a + t * e - w[:, None]).min(axis=1)


@pytest.mark.parametrize("closed", [True, False])
@given(st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_closest_points_are_the_closest(closed, seed):
    rng = np.random.default_rng(seed)
    curve = Curve(arrow(), closed)
    w = rng.uniform(-2, 6, 50) + 1j * rng.uniform(-3, 4, 50)
    s = curve.closest(w)
    assert np.all((s >= 0) & (s <= curve.length * (1 + 1e-15)))
    assert np.allclose(np.abs(curve.at(s) - w), brute_distance(curve, w), atol=1e-12)


CLOUDS = st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=2, max_size=40)


@given(CLOUDS, st.floats(0, 7), st.booleans())
def test_the_diameter_is_the_largest_distance_of_two_vertices(points, turn, closed):
    z = np.exp(1j * turn) * (np.array(points) @ [1, 1j])
    assert Curve(z, closed).diameter == pytest.approx(np.abs(z[:, None] - z).max(), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("shape", [circle(41), circle(40), arrow(), ell(), pear(), np.repeat(square(), 2)])
def test_the_diameter_of_a_domain(shape):
    assert Curve(shape).diameter == np.abs(shape[:, None] - shape).max()


def test_the_distance_of_outlines_is_that_of_the_farthest_point_of_either():
    """The tip of a protrusion that only one of them has, in either order."""
    plain = Curve(ell())
    limb = Curve(np.insert(ell(), 1, [1.2, 1.2 - 0.7j, 1.3 - 0.7j, 1.3]))
    for a, b in ((plain, limb), (limb, plain)):
        assert hausdorff(a, b) == pytest.approx(0.7, rel=0.011)


def test_points_outside_are_pulled_to_the_boundary_and_others_stay():
    curve = Curve(square())
    w = np.array([0.3 + 0.2j, 2 + 0.5j, -3 - 3j])
    assert curve.contains(w).tolist() == [True, False, False]
    assert np.allclose(curve.pulled_in(w), [0.3 + 0.2j, 1 + 0.5j, -1 - 1j])
    assert curve.pulled_in(np.array([], complex)).size == 0


def test_samples_are_on_the_boundary_and_on_no_vertex():
    curve = Curve(arrow())
    z = curve.sample(4)
    assert z.size == 32
    assert brute_distance(curve, z).max() < 1e-14
    assert np.abs(z[:, None] - curve.z).min() > 0.1 * curve.lengths.min()


@pytest.mark.parametrize("count", [20, 100, 333])
def test_resampling_keeps_corners_and_makes_edges_about_even(count):
    curve = Curve(arrow())
    new = curve.resample(count)
    assert np.abs(new.z[:, None] - curve.z).min(axis=0).max() < 1e-12
    assert brute_distance(curve, new.z).max() < 1e-12
    assert abs(new.z.size - count) <= curve.z.size
    if count >= 100:
        assert new.lengths.max() < 2 * new.lengths.min()


def test_resampling_a_smooth_curve_is_even_and_near():
    new = Curve(circle(1000)).resample(50)
    assert new.z.size == 50
    assert new.lengths.max() == pytest.approx(new.lengths.min(), rel=1e-3)
    assert np.abs(np.abs(new.z) - 1).max() < 1e-5


def test_resampling_an_open_curve_keeps_both_ends():
    path = Curve(np.array([0, 1, 3 + 1j, 3 + 4j]), closed=False).resample(30)
    assert not path.closed
    assert path.z[0] == 0 and abs(path.z[-1] - (3 + 4j)) < 1e-12
    assert abs(path.z.size - 30) <= 3


def test_inside_points_of_the_tests_are_inside():
    z = inside(arrow(), 100, 0.05)
    assert z.size == 100 and Curve(arrow()).contains(z).all()
