"""Triangulated approximations of harmonic maps: the guaranteed error, compared with the exact map and its inverse."""

import numpy as np
import pytest

import iccm
from iccm.maps import approximation
from iccm.maps.approximation import triangulated
from iccm.maps.harmonic import HarmonicMap
from iccm.maps.inverse import inverse
from iccm.maps.refinement import THIN_RATIO, Triangulation
from tests.cases import slow
from tests.shapes import blob, circle, ell, inside, pear, random_polygon, square, star

MOST, USUAL = 0.05, 0.02  # texels of 1024², for all points and for 99 %
THIN_BAR = np.array([-1 - 0.04j, 1 - 0.04j, 1 + 0.04j, -1 + 0.04j])
BENT_BAR = np.array([0, 2, 2 + 0.1j, 0.1 + 0.1j, 0.1 + 2j, 2j])


def wild(seed):
    return random_polygon(np.random.default_rng(seed), 14)


FITS = {
    "pear to blob": (pear(), blob(), "conformal"),
    "square to ell": (square(1), ell(1), "conformal"),
    "star to thin bar": (star(120), THIN_BAR, "conformal"),
    "random, conformal": (wild(1), wild(2), "conformal"),
    "random, paper": (wild(1), wild(2), "paper"),
    "folded: square to ell": (square(1), ell(1), "paper"),
    "folded: square to thin bar": (square(1), THIN_BAR, "paper"),
    "folded: star to bent bar": (star(120), BENT_BAR, "paper"),
}


LONG = {"star to thin bar", "random, paper", "folded: star to bent bar"}  # seconds, also to solve


@pytest.fixture(
    scope="module",
    params=[slow(name) if name in LONG else name for name in FITS],
)
def map(request):
    source, target, method = FITS[request.param]
    return iccm.fit(source, target, method=method, max_iterations=40).map


def texels(z):
    return max(np.ptp(z.real), np.ptp(z.imag)) / 1024


def newton(map, w, z):
    """Exact preimages close to z, on any sheet."""
    for _ in range(4):
        f, f_z, f_zbar = map.jet(z)
        off, size = w - f, np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
        z = z + (f_z.conj() * off - f_zbar * off.conj()) / size
    return z


def within(error):
    assert np.quantile(error, 0.99) <= USUAL and error.max() <= MOST


@pytest.mark.slow
def test_preimages_of_random_points_are_within_the_error(map):
    drawn = triangulated(map)
    rng, low, high = np.random.default_rng(0), *iccm.Curve(drawn.image).box
    w = rng.uniform(low.real, high.real, 5_000) + 1j * rng.uniform(low.imag, high.imag, 5_000)
    z, away = drawn.extended_inverse(w)
    w, z = w[away == 0], z[away == 0]
    exact = newton(map, w, z)
    finite = np.isfinite(exact)
    assert finite.mean() > 0.999 and w.size > 200
    within(np.abs(exact - z)[finite] / texels(map.polygon))


def test_images_of_random_points_are_within_the_error(map):
    rng, (low, high) = np.random.default_rng(1), map.outline.box
    z = rng.uniform(low.real, high.real, 5_000) + 1j * rng.uniform(low.imag, high.imag, 5_000)
    z = z[map.outline.contains(z)]
    drawn = triangulated(map)
    within(np.abs(drawn(z) - map(z)) / texels(drawn.image))


def test_exact_preimages_lie_on_the_sheet_that_is_drawn(map):
    drawn = triangulated(map)
    w = drawn(inside(map.polygon, 400))
    z = inverse(map, w)
    finite = np.isfinite(z)
    assert np.abs(map(z[finite]) - w[finite]).max() < 1e-8 * drawn.image_diagonal
    close = np.abs(drawn.extended_inverse(w[finite])[0] - z[finite]) <= MOST * texels(map.polygon)
    assert close.mean() > 0.99


def test_a_map_without_folds_is_certain_to_be_one_to_one():
    p = pear()
    approximation = triangulated(HarmonicMap(p, np.exp(0.3 * p), 0.02 * p.conj()))
    assert approximation.seen is None and approximation.injectivity.certified


def test_one_approximation_is_cached_per_error_independent_of_earlier_requests():
    p = pear()
    map, again = (HarmonicMap(p, p + 0.1 * p**2, 0 * p) for _ in range(2))
    fine = triangulated(map, 1e-6, 1e-6)
    assert triangulated(map, 1e-6, 1e-6) is fine and triangulated(fine) is fine
    assert np.array_equal(triangulated(map, 1e-5, 1e-5).source, triangulated(again, 1e-5, 1e-5).source)
    assert len(triangulated(map, 1e-7, 1e-7).faces) > len(fine.faces)


def test_the_sheet_from_the_widest_place_is_visible_where_sheets_overlap():
    """z + c z² reverses where |1 + 2 c z| = 0: beyond one cusp, a loop of the outline lies over the inside."""
    p = circle(400)
    map = triangulated(HarmonicMap(p, p + 0.6 * p**2, 0 * p))
    z = 0.5 * np.exp(1j * np.linspace(0, 1, 20))
    assert map.seen is not None
    assert np.abs(map.extended_inverse(map(z))[0] - z).max() < 1e-3


@pytest.mark.parametrize("polygon", [square(1), THIN_BAR, BENT_BAR], ids=["square", "bar", "bent"])
def test_triangles_have_good_shapes_and_cover_the_inside(polygon):
    mesh = Triangulation.of(polygon)
    for _ in range(3):
        a, b, c = mesh.z[mesh.faces].T
        area = ((b - a).conj() * (c - a)).imag
        longest = np.maximum.reduce([np.abs(b - a), np.abs(c - b), np.abs(a - c)])
        assert (area / longest**2 >= THIN_RATIO).all()
        assert 0.5 * area.sum() == pytest.approx(iccm.Curve(polygon).area)
        mesh = mesh.refined(np.arange(len(mesh.edges.ends)) % 3 == 0)


def test_refinement_does_not_depend_on_the_distance_from_the_origin():
    p = pear()
    at_origin = HarmonicMap(p, p + 0.1 * p**2, 0 * p)
    far_away = HarmonicMap(p + 1e6, at_origin.phi - 1e6j, 0 * p)
    faces = [len(triangulated(map).faces) for map in (at_origin, far_away)]
    assert faces[1] == pytest.approx(faces[0], rel=0.05)


@pytest.mark.parametrize("factor", [0.01, 100])
def test_the_size_of_the_target_does_not_change_the_mesh(factor):
    p = pear()
    analytic, conjugate = np.exp(0.3 * p), 0.02 * p.conj()
    mesh = triangulated(HarmonicMap(p, analytic, conjugate))
    resized = triangulated(HarmonicMap(p, factor * analytic, factor * conjugate))
    np.testing.assert_array_equal(resized.faces, mesh.faces)


@pytest.mark.slow
def test_an_irregular_map_is_evaluated_up_to_a_budget_and_a_regular_one_is_not_affected(monkeypatch):
    """Files may contain any coefficients; refining a map that is irregular everywhere would not end."""
    counted = []
    jet = HarmonicMap.jet_inside
    monkeypatch.setattr(
        HarmonicMap, "jet_inside", lambda self, z, *more: counted.append(z.size) or jet(self, z, *more)
    )
    monkeypatch.setattr("iccm.maps.approximation.MOST_TERMS", 1e7)
    n = 300
    polygon, noise = circle(n), np.random.default_rng(3).normal(size=n)
    regular = triangulated(HarmonicMap(polygon, 2 * polygon, np.zeros(n, complex)))
    assert regular.seen is None and sum(counted) * n < 1e7
    counted.clear()
    map = triangulated(HarmonicMap(polygon, polygon + noise, np.zeros(n, complex)))
    assert map.seen is not None and 2e6 < sum(counted) * n < 1.5e7
    monkeypatch.setattr("iccm.maps.approximation.MOST_TERMS", 1e8)
    counted.clear()
    triangulated(HarmonicMap(polygon, polygon + noise, np.zeros(n, complex)))
    assert sum(counted) * n > 1.5e7


def test_a_map_that_is_irregular_everywhere_takes_bounded_work(monkeypatch):
    z = star(120)
    rng = np.random.default_rng(2)
    psi = 0.05 * (rng.normal(size=z.size) + 1j * rng.normal(size=z.size))
    counts = []
    refined = Triangulation.refined
    monkeypatch.setattr(
        Triangulation, "refined", lambda mesh, marked: counts.append(len(mesh.faces)) or refined(mesh, marked)
    )
    triangulated(HarmonicMap(z, z * np.exp(0.3j), psi))
    work = approximation.TERMS_OF_A_TRIANGLE * sum(counts)
    assert 0.2 * approximation.MOST_TERMS < work < approximation.MOST_TERMS
