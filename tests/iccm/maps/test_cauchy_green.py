"""Cauchy-Green coordinates: identities, limits, derivatives, convergence, memory."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.maps import cauchy_green
from iccm.maps.distortion import area_scale, dilatation
from iccm.maps.harmonic import HarmonicMap
from tests.shapes import CauchyIntegral, circle, ell, inside, radial, random_polygon, refined, star

EXACT = 1e-13
NUMBER = {"allow_nan": False, "allow_infinity": False}


@st.composite
def polygons(draw):
    """Simple polygons around 0 with 3 to 14 convex and reflex vertices."""
    n = draw(st.integers(3, 14))
    radii = draw(st.lists(st.floats(0.15, 1.0, **NUMBER), min_size=n, max_size=n))
    jitter = draw(st.lists(st.floats(-0.2, 0.2, **NUMBER), min_size=n, max_size=n))
    return radial(radii, jitter)


def places(polygon, t):
    """Vertices, points of the edges, and points inside a polygon that is star-shaped around 0."""
    on_edges = polygon + t * (np.roll(polygon, -1) - polygon)
    return np.concatenate([polygon, on_edges, 0.9 * on_edges, t * polygon])


def check_identities(polygon, z, slack=1.0):
    c = cauchy_green.coordinates(polygon, z)
    assert np.abs(c.sum(axis=1) - 1).max() < EXACT * slack
    assert np.abs(c @ polygon - z).max() < EXACT * slack * max(1.0, np.abs(polygon).max())


@given(polygons(), st.floats(0.01, 0.99))
@settings(max_examples=150, deadline=None)
def test_identities_inside_on_edges_and_on_vertices(polygon, t):
    check_identities(polygon, places(polygon, t))


@given(polygons(), st.floats(0.1, 0.9), st.floats(0, 6.28))
@settings(max_examples=60, deadline=None)
def test_identities_far_from_the_origin(polygon, t, direction):
    shift = 1e6 * np.exp(1j * direction)
    check_identities(polygon + shift, places(polygon, t) + shift)


@given(polygons(), st.floats(0.05, 0.95), st.floats(0, 6.28))
@settings(max_examples=60, deadline=None)
def test_identities_with_a_tiny_edge(polygon, t, direction):
    """A vertex is doubled at a distance of 1e-9; points are on the tiny edge, at its ends and beside it."""
    along = polygon[1] - polygon[0]
    tiny = np.insert(polygon, 1, polygon[0] + 1e-9 * along / abs(along))
    on_edge = tiny[0] + (tiny[1] - tiny[0]) * t
    z = np.concatenate([places(tiny, t), [on_edge, on_edge * (1 - 1e-7), on_edge * (1 - 1e-3)]])
    check_identities(tiny, z)


def test_reflex_and_convex_vertices_both_occur_and_hold():
    polygon = np.array([0, 2, 2 + 2j, 1 + 0.1j, 2j])
    turn = np.angle((np.roll(polygon, -1) - polygon) / (polygon - np.roll(polygon, 1)))
    assert (turn > 0).any() and (turn < 0).any()
    check_identities(polygon, polygon)


def test_coordinates_at_the_boundary_are_the_limit_from_inside():
    polygon = ell()
    inward = 1j * (np.roll(polygon, -1) - polygon) / 2
    corner = (np.roll(polygon, -1) - polygon) + (np.roll(polygon, 1) - polygon)
    corner[3] *= -1  # reflex: the bisector of the edges points out of the domain
    for z, step in ((0.7 * polygon + 0.3 * np.roll(polygon, -1), inward), (polygon, corner)):
        inside = cauchy_green.coordinates(polygon, z + 1e-9 * step)
        assert np.abs(inside - cauchy_green.coordinates(polygon, z)).max() < 1e-7


def test_coordinates_are_the_cauchy_integral_of_hat_functions():
    polygon = random_polygon(np.random.default_rng(1))
    z = inside(polygon, 5)
    c, d, d2 = (
        f(polygon, z)
        for f in (cauchy_green.coordinates, cauchy_green.derivatives, cauchy_green.second_derivatives)
    )
    for j in range(polygon.size):
        hat = CauchyIntegral(polygon, np.eye(polygon.size)[j].astype(complex))
        f, first, second = np.array([hat.at(p) for p in z]).T
        assert np.abs(f - c[:, j]).max() < 1e-11
        assert np.abs(first - d[:, j]).max() < 1e-11
        assert np.abs(second - d2[:, j]).max() < 1e-9


@pytest.mark.parametrize("direction", [1, 1j])
def test_derivatives_are_those_of_finite_differences(direction):
    polygon = random_polygon(np.random.default_rng(2))
    z, h = inside(polygon, 30, 0.08), 1e-3 * direction
    for whole, part in (
        (cauchy_green.coordinates, cauchy_green.derivatives),
        (cauchy_green.derivatives, cauchy_green.second_derivatives),
    ):
        a, b = (
            whole(polygon, z + h) - whole(polygon, z - h),
            whole(polygon, z + 2 * h) - whole(polygon, z - 2 * h),
        )
        slope = (8 * a - b) / (12 * h)
        assert np.abs(slope - part(polygon, z)).max() < 1e-7 * np.abs(slope).max()


def test_derivatives_on_edges_are_the_limit_from_inside():
    polygon = ell()
    z = 0.7 * polygon + 0.3 * np.roll(polygon, -1)
    inward = 1j * (np.roll(polygon, -1) - polygon)
    inside = cauchy_green.derivatives(polygon, z + 1e-9 * inward)
    assert np.abs(inside - cauchy_green.derivatives(polygon, z)).max() < 1e-7


FUNCTIONS = {
    "square": lambda z: z**2,
    "exp": np.exp,
    "moebius": lambda z: (z + 0.2) / (z - 3 - 1j),
}


@pytest.mark.parametrize("shape", [ell, lambda n: refined(star(16), n)], ids=["ell", "star"])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_analytic_functions_are_reproduced_with_second_order(name, shape):
    """Linear interpolation on edges of length h has an error of O(h²): halving h quarters the error at points
    inside.
    """
    f, z = FUNCTIONS[name], inside(shape(1))
    errors = []
    for per_edge in (8, 16, 32):
        polygon = shape(per_edge)
        errors.append(np.abs(cauchy_green.coordinates(polygon, z) @ f(polygon) - f(z)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.05), (errors, orders)


def peak_memory(work):
    """The largest number of bytes allocated while `work` runs."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def spiral(n):
    return 0.9 * np.sqrt(np.linspace(0, 1, n)) * np.exp(1j * np.arange(n))


def test_memory_of_many_points_is_bounded():
    """10,000 points × 1,000 vertices: the matrix is 160 MB; in addition there are only a few blocks."""
    polygon, z = circle(1000), spiral(10_000)
    assert peak_memory(lambda: cauchy_green.coordinates(polygon, z)) < 700e6


def test_evaluation_never_holds_the_whole_matrix(monkeypatch):
    monkeypatch.setattr(cauchy_green, "BLOCK_ENTRIES", 1 << 14)
    polygon, z = circle(500), spiral(2000)
    whole = 16 * polygon.size * z.size
    assert peak_memory(lambda: HarmonicMap(polygon, polygon, 0 * polygon)(z)) < 0.25 * whole


@pytest.fixture
def harmonic():
    """z + 0.1 z² + conj(0.2 z + 0.05 z²), on a finely divided star."""
    polygon = star(800)
    return HarmonicMap(polygon, polygon + 0.1 * polygon**2, (0.2 * polygon + 0.05 * polygon**2).conj())


def test_psi_holds_the_conjugated_coefficients(harmonic):
    z = inside(harmonic.polygon)
    expected = z + 0.1 * z**2 + (0.2 * z + 0.05 * z**2).conj()
    assert np.abs(harmonic(z) - expected).max() < 1e-5
    assert not harmonic.conformal
    assert harmonic(z[:6].reshape(2, 3)).shape == (2, 3)
    assert harmonic(np.array([], complex)).size == 0


def test_wirtinger_derivatives_are_those_of_finite_differences_in_x_and_y(harmonic):
    z, h = inside(harmonic.polygon), 1e-5
    f_x = (harmonic(z + h) - harmonic(z - h)) / (2 * h)
    f_y = (harmonic(z + 1j * h) - harmonic(z - 1j * h)) / (2 * h)
    f_z, f_zbar = harmonic.derivatives(z)
    assert np.abs(f_z - 0.5 * (f_x - 1j * f_y)).max() < 1e-9
    assert np.abs(f_zbar - 0.5 * (f_x + 1j * f_y)).max() < 1e-9
    assert np.abs(f_zbar - (0.2 + 0.1 * z).conj()).max() < 1e-4


def test_dilatation_and_area_are_those_of_the_jacobian(harmonic):
    z = inside(harmonic.polygon)
    f_z, f_zbar = harmonic.derivatives(z)
    a, b = f_z + f_zbar, 1j * (f_z - f_zbar)  # f_x, f_y
    jacobian = np.moveaxis(np.array([[a.real, b.real], [a.imag, b.imag]]), 2, 0)
    major, minor = np.linalg.svd(jacobian, compute_uv=False).T
    assert np.allclose(dilatation(f_z, f_zbar), major / minor, rtol=1e-12)
    assert np.allclose(area_scale(f_z, f_zbar), np.linalg.det(jacobian), rtol=1e-12)


def test_dilatation_is_one_where_conformal_and_infinite_where_folded():
    assert np.array_equal(dilatation(np.array([2j, 1, 0.5]), np.array([0, 1, 1j])), [1, np.inf, np.inf])
    assert np.array_equal(area_scale(np.array([2j, 1, 0.5]), np.array([0, 1, 1j])), [4, 0, -0.75])


def test_a_short_edge_keeps_its_digits():
    """Two vertices that differ by rounding have very different values; the sum keeps its digits."""
    a, b = 80 + 3j, 80 + 3j + 64 * np.spacing(80.0) * (1 + 1j)
    polygon = np.array([a, b, 79 + 5j, 77 + 4j, 78 + 2j])
    values = np.array([0, 1, 1.5 + 2j, 2j, -1])
    z = inside(polygon, 20)
    start = (polygon - z[:, None]).astype(np.clongdouble)
    edge = (np.roll(polygon, -1) - polygon).astype(np.clongdouble)
    end = start + edge
    log = np.log(end / start)
    log[:, 0] = edge[0] / start[:, 0] - (edge[0] / start[:, 0]) ** 2 / 2  # exact to (1e-12)³
    weight = log / (2j * np.pi * edge)
    expected = np.sum(weight * (end * values - start * np.roll(values, -1)), axis=1)
    assert np.abs(cauchy_green.coordinates(polygon, z) @ values - expected).max() < 1e-13
