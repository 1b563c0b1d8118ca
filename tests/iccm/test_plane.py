"""Identities for areas and similarities, and exact signs compared with fractions."""

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from iccm.arrays import complex_of, xy_of
from iccm.plane import (
    Similarity,
    bounding_box,
    cross,
    diagonal,
    distinct,
    distinct_each,
    longer_side,
    orientation,
    polygon_area,
    rotation,
    triangle_areas,
)
from tests.triangulations import exact_turn

COMPLEX = st.complex_numbers(max_magnitude=10)
POINTS = arrays.arrays(np.complex128, st.integers(3, 12), elements=COMPLEX)
LITTLE = st.floats(-1e-15, 1e-15)


@given(COMPLEX, COMPLEX, st.floats(-2, 2), st.builds(complex, LITTLE, LITTLE))
def test_orientation_is_exact_near_lines(a, b, part, off):
    c = a + part * (b - a) + off
    assert orientation(*(np.array([p]) for p in (a, b, c)))[0] == exact_turn(a, b, c)


@given(
    st.lists(st.integers(-3, 3), min_size=6, max_size=6), st.sampled_from([1e-200, 1e-160, 5e-324, 1, 1e100])
)
def test_orientation_is_exact_where_products_underflow(numbers, scale):
    a, b, c = (complex(x * scale, y * scale) for x, y in zip(numbers[::2], numbers[1::2]))
    assert orientation(*(np.array([p]) for p in (a, b, c)))[0] == exact_turn(a, b, c)


def test_orientation_sees_the_last_bit():
    z = np.array([0, 1 + 1j, 3 + 3j]) / 3 + 0.1
    nudged = z.copy()
    nudged[2] += np.spacing(z[2].imag) * 1j
    for w in (z, nudged):
        corners = np.stack([w, w[::-1]])
        assert orientation(*corners.T).tolist() == [exact_turn(*w), -exact_turn(*w)]


@given(POINTS)
def test_pairs_and_complex_numbers_are_each_others_inverses(z):
    assert np.array_equal(complex_of(xy_of(z)), z)
    assert np.array_equal(complex_of(xy_of(z[:, None]))[:, 0], z)


@given(POINTS, COMPLEX)
def test_a_polygon_has_the_area_of_its_fan_from_any_point(z, apex):
    fan = np.stack([np.full(z.size, apex), z, np.roll(z, -1)], axis=1)
    assert polygon_area(z) == pytest.approx(triangle_areas(fan).sum(), abs=1e-10)
    assert polygon_area(z[::-1]) == pytest.approx(-polygon_area(z), abs=1e-10)
    assert abs(polygon_area(z)) == pytest.approx(_area(z), abs=1e-10)


def _area(z):
    """GEOS's area, whose shoelace formula permits crossings."""
    return shapely.Polygon(xy_of(z)).area


def test_a_polygon_keeps_its_area_far_from_the_origin():
    square = np.array([0, 1, 1 + 1j, 1j])
    assert polygon_area(square + 1e9 * (1 + 1j)) == 1


@given(COMPLEX, COMPLEX, COMPLEX)
def test_the_cross_product_is_bilinear_and_antisymmetric(a, b, c):
    a, b, c = (np.array([x]) for x in (a, b, c))
    assert cross(a, b) == -cross(b, a) and cross(a, a) == 0
    assert cross(a, b + c) == pytest.approx(cross(a, b) + cross(a, c), abs=1e-11)
    assert cross(a, 1j * a) == pytest.approx(np.abs(a) ** 2, abs=1e-11)


@given(POINTS)
def test_the_box_is_shapelys(z):
    low, high = bounding_box(z)
    bounds = shapely.MultiPoint(xy_of(z)).bounds
    assert (low.real, low.imag, high.real, high.imag) == bounds
    assert diagonal(z) == pytest.approx(abs(high - low), rel=1e-15)
    assert longer_side(low, high) == max(bounds[2] - bounds[0], bounds[3] - bounds[1])


@given(POINTS, st.data())
def test_repeated_vertices_are_left_out(z, data):
    z = np.unique(np.round(z, 3))
    assume(z.size > 1)
    times = data.draw(st.lists(st.integers(1, 3), min_size=z.size, max_size=z.size))
    assert np.array_equal(distinct(np.repeat(z, times), closed=False), z)
    assert np.array_equal(distinct(np.append(np.repeat(z, times), z[:1])), np.roll(z, -1))


@given(st.lists(st.lists(st.sampled_from([0, 1, 1 + 1e-13, 3 - 2j, 1e9]), max_size=5), max_size=4))
def test_vertices_that_repeat_go_from_many_rings_at_once_as_from_each(rings):
    rings = [np.array(ring, dtype=complex) for ring in rings]
    for together, alone in zip(distinct_each(rings), map(distinct, rings), strict=True):
        assert np.array_equal(together, alone)


@given(POINTS, COMPLEX, COMPLEX, st.booleans())
def test_a_similarity_is_found_again(z, factor, shift, weighted):
    assume(np.ptp(z.real) > 1e-3)
    weights = np.arange(1.0, 1 + z.size) if weighted else None
    similarity = Similarity.fit(z, factor * z + shift, weights)
    assert similarity.factor == pytest.approx(factor, abs=1e-7)
    assert similarity(z) == pytest.approx(factor * z + shift, abs=1e-9)


@given(POINTS, POINTS)
def test_no_similarity_is_closer(z, w):
    w = np.resize(w, z.size)
    assume(np.ptp(z.real) > 1e-3)
    closest = Similarity.fit(z, w)
    best = np.sum(np.abs(closest(z) - w) ** 2)
    matrix = np.column_stack([z, np.ones(z.size)])
    factor, shift = np.linalg.lstsq(matrix, w, rcond=None)[0]
    assert best == pytest.approx(np.sum(np.abs(factor * z + shift - w) ** 2), rel=1e-6, abs=1e-9)


def test_a_single_point_is_translated():
    assert Similarity.fit(np.array([1 + 2j]), np.array([5j])) == Similarity(1, -1 + 3j)
    assert Similarity.fit(np.array([2j, 2j]), np.array([1.0, 3.0])) == Similarity(1, 2 - 2j)


@pytest.mark.parametrize("mirrored", [False, True])
def test_similarities_take_images_back(mirrored):
    z = np.array([1 + 2j, -3j, 0.3])
    similarity = Similarity(2 - 0.7j, 5 + 1j, -3 + 0.2j, mirrored)
    w = similarity(z)
    assert np.allclose(np.abs(w[1:] - w[0]), abs(2 - 0.7j) * np.abs(z[1:] - z[0]))
    assert np.allclose(similarity.pull_back(w), z) and np.allclose(similarity.inverse()(w), z)
    assert similarity(np.array([-3 + 0.2j])) == pytest.approx(5 + 1j)
    turned, conjugate = similarity.rotated(0.4), similarity.conjugate()
    sign = -1 if mirrored else 1
    assert np.allclose(turned(z) - similarity.shift, np.exp(sign * 0.4j) * (w - similarity.shift))
    assert np.allclose(conjugate(z.conj()), w.conj())


@given(POINTS, st.floats(-3, 3))
def test_a_rotation_is_found_again(z, angle):
    assume(np.abs(z).max() > 1e-3)
    assert rotation(z, 7 * np.exp(1j * angle) * z) == pytest.approx(np.exp(1j * angle), abs=1e-12)


def test_points_at_the_origin_are_not_rotated():
    assert rotation(np.zeros(3, complex), np.ones(3, complex)) == 1
