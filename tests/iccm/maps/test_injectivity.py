"""The certificate accepts maps known to be injective and rejects maps known to fold."""

from pathlib import Path

import numpy as np
import pytest
import shapely

from iccm.maps.enclosure import Encloser
from iccm.maps.harmonic import HarmonicMap
from iccm.maps.injectivity import DEPTHS, at_depth, certify
from tests.shapes import circle, ell, inside, pear, random_polygon, refined, square, star


def map_of(polygon, phi, psi=None):
    zero = np.zeros(polygon.size, complex)
    return HarmonicMap(polygon, phi(polygon), zero if psi is None else psi(polygon))


INJECTIVE = {
    "identity": (ell(8), lambda z: z, None),
    "similarity far away": (ell(8), lambda z: (2 - 1j) * z + 1e4, None),
    "moebius": (circle(200), lambda z: (z - 0.5) / (1 - 0.5 * z), None),
    "mild quadratic": (circle(200), lambda z: z + 0.4 * z**2, None),
    "exp": (star(200), np.exp, None),
    "z² away from its zero": (square(20) + 1.5, lambda z: z**2, None),
    "stretch": (star(200), lambda z: z, lambda z: 0.6 * z.conj()),
    "harmonic": (circle(200), lambda z: z + 0.1 * z**2, lambda z: (0.2 * z + 0.1 * z**2).conj()),
}

FOLDED = {
    "z² around 0": (circle(100), lambda z: z**2, None),
    "z³ around 0": (pear(100), lambda z: z**3, None),
    "cusp passed": (circle(400), lambda z: z + 0.7 * z**2, None),
    "figure eight": (circle(100), lambda z: z / 2 + z**2 / 4, lambda z: (z / 2 - z**2 / 4).conj()),
    "covered twice, no zero": (refined(np.array([-1 - 7j, 1 - 7j, 1 + 7j, -1 + 7j]), 60), np.exp, None),
    "reflection": (star(100), lambda z: 0 * z, lambda z: z.conj()),
    "antiholomorphic part wins": (star(100), lambda z: 0.5 * z, lambda z: 0.7 * z.conj()),
    "wins on one side only": (circle(200), lambda z: z, lambda z: (0.3 * z + 0.5 * z**2).conj()),
    "constant": (square(5), lambda z: 0 * z + 1, None),
}


@pytest.mark.parametrize("name", INJECTIVE)
def test_maps_known_to_be_injective_are_accepted(name):
    certificate = certify(map_of(*INJECTIVE[name]))
    assert (
        certificate.certified and certificate.simple and certificate.zeros == 0 and certificate.beltrami < 1
    )
    assert certificate.depth <= 3e-4 and certificate.share > 0.999


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDED)
def test_maps_known_to_fold_are_rejected(name):
    f = map_of(*FOLDED[name])
    for depth in DEPTHS[::2]:
        if depth <= 0.13:
            assert not at_depth(f, depth).certified, depth
    assert certify(f, DEPTHS[DEPTHS < 0.13]).report()["certified"] is False


@pytest.mark.parametrize("power", [2, 3, 5])
def test_zeros_of_the_derivative_are_counted(power):
    certificate = at_depth(map_of(circle(200), lambda z: z**power), 0.01)
    assert certificate.zeros == power - 1 and not certificate.simple


@pytest.mark.slow
def test_zeros_close_to_the_boundary_are_counted_where_they_are():
    """f' = 1 + 1.04 z has its zero at -0.96, 0.04 inside: it is counted at a depth of 0.03 of the inradius, but not at
    0.15.
    """
    f = map_of(circle(800), lambda z: z + 0.52 * z**2)
    assert at_depth(f, 0.03).zeros == 1 and at_depth(f, 0.15).zeros == 0
    assert not at_depth(f, 0.03).certified and at_depth(f, 0.15).certified
    certificate = certify(f)
    assert certificate.certified and 0.03 < certificate.depth < 0.05
    assert certificate.share == pytest.approx((1 - certificate.depth) ** 2, abs=1e-3)


def test_a_fold_between_coarse_samples_is_detected():
    """With a zero of f' close to the middle of a long edge, where the polygon has no vertex: samples are added
    there.
    """
    zero = -0.98j
    f = map_of(square(40), lambda z: (z - zero) ** 2)
    coarse = at_depth(HarmonicMap(f.polygon, f.phi, f.psi), 1e-3)
    assert coarse.zeros == 1 and not coarse.certified


def test_beltrami_is_the_largest_quotient():
    f = map_of(circle(400), lambda z: z, lambda z: (0.2 * z + 0.2 * z**2).conj())
    expected = 0.2 + 0.4 * (1 - 3e-3)  # |f_z̄| = |0.2 + 0.4 z| is largest at the boundary
    assert at_depth(f, 3e-3).beltrami == pytest.approx(expected, abs=3e-3)


def test_without_an_inside_nothing_is_certified():
    certificate = at_depth(map_of(square(4), lambda z: z), 1.1)
    assert (
        not certificate.certified
        and certificate.obstacle == "at depth 1.1e+00: no part of the source lies deeper"
    )
    thin = map_of(np.array([0, 1, 1 + 1e-3j, 1e-3j]), lambda z: z)
    assert certify(thin).share > 0.999  # depths are relative to the inradius, whatever the proportions


def test_parts_that_fall_apart_must_not_overlap():
    """A dumbbell loses its neck when moved inwards; halves with the same image are detected."""
    right = np.array([1 - 0.05j, 1 - 1j, 3 - 1j, 3 + 1j, 1 + 1j, 1 + 0.05j])
    dumbbell = refined(np.concatenate([right, -right]), 20)
    apart = map_of(dumbbell, lambda z: z)
    onto = map_of(dumbbell, lambda z: z**2)
    assert at_depth(apart, 0.13).certified
    certificate = at_depth(onto, 0.13)
    assert certificate.zeros == 0 and not certificate.simple and not certificate.certified


def test_an_accepted_map_has_no_two_points_with_one_image():
    """The certificate compared with its meaning: distances shrink by a bounded factor only."""
    f = map_of(*INJECTIVE["harmonic"])
    z = inside(f.polygon, 100, 0.02)
    w = f(z)
    pairs = np.triu_indices(w.size, 1)
    assert np.min(np.abs(w[pairs[0]] - w[pairs[1]]) / np.abs(z[pairs[0]] - z[pairs[1]])) > 0.1


def test_the_report_is_plain_data():
    report = certify(map_of(*INJECTIVE["identity"])).report()
    assert report["certified"] is True and report["simple_image"] is True
    assert {k: type(v) for k, v in report.items()} == {
        "certified": bool,
        "depth": float,
        "share": float,
        "zeros": int,
        "max_beltrami": float,
        "simple_image": bool,
        "obstacle": str,
    }


def test_obstacles_to_a_certificate_are_named():
    folded = certify(map_of(circle(100), lambda z: z**2)).report()
    assert folded["obstacle"] == "at depth 8.9e-01: f_z has 1 zero" and folded["share"] == 0
    fine = certify(map_of(circle(200), lambda z: z)).report()
    assert fine["obstacle"] == "" and fine["certified"]
    certificate = certify(map_of(circle(400), lambda z: z + 0.505 * z**2))
    assert certificate.certified and certificate.depth > 3e-4 and "f_z has 1 zero" in certificate.obstacle


def random_map(seed, n=24, strength=0.25):
    """A harmonic map of a random polygon, with random values at the vertices added to a similarity."""
    rng = np.random.default_rng(seed)
    polygon = random_polygon(rng, n)
    noise = rng.normal(size=(2, n)) + 1j * rng.normal(size=(2, n))
    return HarmonicMap(polygon, polygon + 0.5 * strength * noise[0], strength * noise[1])


def folds(f, depth):
    """Whether dense samples of the part at some depth include a reversed orientation, or two points with one image."""
    inner = inner_rings(f.polygon, depth)
    for ring in inner:
        f_z, f_zbar = f.derivatives(refined(ring, max(8, 3000 // ring.size)))
        if (np.abs(f_zbar) >= np.abs(f_z)).any():
            return True
    return False


def inner_rings(polygon, depth):
    outline = shapely.Polygon(np.column_stack([polygon.real, polygon.imag]))
    radius = shapely.maximum_inscribed_circle(outline, tolerance=1e-4).length
    parts = shapely.get_parts(outline.buffer(-depth * radius, join_style="mitre"))
    return [shapely.get_coordinates(part.exterior)[-2::-1] @ np.array([1, 1j]) for part in parts if part.area]


@pytest.mark.parametrize("seed", range(12))
def test_no_random_map_is_certified_where_dense_samples_find_a_fold(seed):
    f = random_map(seed, strength=0.02 + 0.004 * seed)
    certificate = certify(f)
    assert not certificate.certified or not folds(f, certificate.depth)


def test_a_fold_between_samples_of_a_harmonic_map_is_detected():
    """It was once certified: |f_z̄/f_z| is up to 1.27 between samples at which it is 0.9."""
    data = np.load(Path(__file__).parent / "folded-between.npz")
    f = HarmonicMap(data["P"], data["phi"], data["psi"])
    certificate = certify(f)
    assert folds(f, 0.005) and not at_depth(f, 0.005).certified
    assert certificate.certified and not folds(f, certificate.depth)


@pytest.mark.parametrize("name", ["harmonic", "exp", "moebius"])
def test_derivatives_and_images_stay_within_their_bounds(name):
    f = map_of(*INJECTIVE[name])
    encloser = Encloser(f)
    pieces = encloser.pieces([inner_rings(f.polygon, 0.02)[0][::-1]])
    end = pieces.start[pieces.following]
    along = (end - pieces.start) / np.abs(end - pieces.start)
    for t in np.linspace(0, 1, 9):
        w, f_z, f_zbar = f.jet(pieces.start + t * (end - pieces.start))
        tangent = f_z * along + f_zbar * along.conj()
        assert (np.abs(tangent - pieces.tangent) <= pieces.spread).all()
        chord = pieces.image + t * (pieces.image[pieces.following] - pieces.image)
        assert (np.abs(w - chord) <= pieces.bulge).all()
    assert np.median(pieces.spread / np.abs(pieces.tangent)) < 0.5  # and the bounds are useful
