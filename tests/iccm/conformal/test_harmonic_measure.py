"""Harmonic measure by finite elements, compared with Poisson's kernel, Fourier series and symmetry."""

import numpy as np
import pytest

from iccm.conformal.correspondence import Coarse, HarmonicView, Moebius
from iccm.conformal.harmonic_measure import Circle, HarmonicMeasure, corner_powers
from iccm.conformal.normalisation import distortion, search
from iccm.conformal.panels import corners, graded, thickness
from iccm.curve import Curve
from tests.shapes import arrow, circle, ell, inside, pear, refined, square


def on_vertices(polygon):
    curve = Curve(np.asarray(polygon, complex))
    return HarmonicMeasure(curve, curve.knots[:-1])


def measure(curve):
    """Panels of at most 0.05, graded towards corners."""
    return HarmonicMeasure(curve, graded(curve, 0.05, np.full(corners(curve).size, 1e-3)))


def place(h, mass):
    """The point from which the measure is seen, by the mean value property of z."""
    middles = h.curve.at(h.ends + 0.5 * h.lengths)
    return complex(mass @ middles)


def poisson(a, n):
    """Harmonic measure of the n equal arcs of the unit circle seen from a, by the disc's automorphism."""
    u = np.exp(2j * np.pi * np.arange(n + 1) / n)
    return np.diff(np.unwrap(np.angle((u - a) / (1 - np.conj(a) * u)))) / (2 * np.pi)


def test_the_disc_has_poissons_kernel():
    worst = []
    for n in (50, 200):
        h, wishes = on_vertices(circle(n)), np.array([0, 0.5 + 0.2j, -0.7j])
        errors = []
        for wish, mass in zip(wishes, h.masses(wishes)):
            a = place(h, mass)
            assert abs(a - wish) < 0.25  # the node of the triangulation closest to it
            assert mass.sum() == pytest.approx(1, abs=1e-12) and (mass > 0).all()
            errors.append(np.abs(np.cumsum(mass) - np.cumsum(poisson(a, n))).max())
        worst.append(max(errors))
    order = np.log(worst[0] / worst[1]) / np.log(4)
    assert worst[1] < 3e-4 and order > 1.5, (worst, order)


def test_several_views_at_once_are_those_one_by_one():
    h, a = on_vertices(pear()), inside(pear(), 3)
    together = h.masses(a)
    for row, centre in zip(together, a):
        assert np.allclose(h.masses(np.array([centre]))[0], row, rtol=1e-12)


def side_of_square(a):
    """Harmonic measure of the side y = -1 of the square from -1-i to 1+i, by its Fourier series."""
    x, y, k = (a.real + 1) / 2, (a.imag + 1) / 2, np.pi * np.arange(1, 200, 2)
    fall = (np.exp(-k * y) - np.exp(-k * (2 - y))) / (1 - np.exp(-2 * k))
    return float(np.sum(4 / k * np.sin(k * x) * fall))


@pytest.mark.parametrize("wish", [0, 0.4 - 0.5j, -0.3 + 0.1j])
def test_the_sides_of_a_square_have_their_fourier_series(wish):
    h = on_vertices(square(24))
    mass = h.masses(np.array([wish], complex))[0]
    a = place(h, mass)
    sides = mass.reshape(4, -1).sum(axis=1)
    expected = [side_of_square(a * turn) for turn in (1, -1j, -1, 1j)]
    assert np.abs(sides - expected).max() < 3e-4


def test_symmetric_shapes_have_symmetric_measures():
    h = measure(Curve(ell()))
    mass = h.masses(np.array([0.6 + 0.6j]))[0]
    on_edge = np.searchsorted(h.curve.knots, h.ends, side="right") - 1
    edges = np.bincount(on_edge, mass, minlength=6)
    assert np.allclose(edges, edges[[5, 4, 3, 2, 1, 0]], atol=2e-3)


@pytest.mark.parametrize("length", [4, 12, 20])
def test_the_end_of_a_long_corridor_is_resolved(length):
    """Seen from a distance d along a corridor of width 1, its end has the measure 4/π exp(-πd), to a relative error."""
    hall = np.array(
        [-2 - 2j, 2 - 2j, 2 - 0.5j, 2 + length - 0.5j, 2 + length + 0.5j, 2 + 0.5j, 2 + 2j, -2 + 2j]
    )
    h = measure(Curve(hall))
    mass = h.masses(np.array([0j]))[0]
    s, middle = h.curve.knots, h.ends + 0.5 * h.lengths
    # seen from the hall, the corridor's walls beyond depth d have a share that decreases by exp(-π) per unit
    beyond = [mass[(middle > s[2] + d) & (middle < s[5] - d)].sum() for d in (1.5, length - 0.5)]
    assert np.log(beyond[0] / beyond[1]) == pytest.approx(np.pi * (length - 2), rel=0.02, abs=0.1)
    assert (mass > 0).all()


def test_measures_grow_from_corners_with_the_angles_power():
    h = measure(Curve(ell()))
    power, falling = corner_powers(h)
    start = np.flatnonzero(np.abs(h.z - (1 + 1j)) < 1e-12)[0]
    assert power[start] == pytest.approx(2 / 3) and not falling[start]
    assert power[start - 1] == pytest.approx(2 / 3) and falling[start - 1]
    square_corner = np.flatnonzero(np.abs(h.z - 2) < 1e-12)[0]
    assert power[square_corner] == pytest.approx(2)
    mass = h.masses(np.array([0.5 + 0.5j]))[0]
    s = h.ends - h.ends[start]
    close = (s > 0.003) & (s < 0.1)
    growth = np.polyfit(
        np.log(s[close]),
        np.log(np.cumsum(np.roll(mass, -start))[: s.size])[np.flatnonzero(close) - start - 1],
        1,
    )[0]
    assert growth == pytest.approx(2 / 3, abs=0.03)


def test_rotation_and_arclength_are_inverse_and_increasing():
    h = measure(Curve(arrow()))
    view = Circle(h, h.masses(np.array([1.5 + 0.6j]))[0])
    s = np.linspace(-1.3, 2.4, 999) * h.curve.length
    turn = view.turn(s)
    assert np.all(np.diff(turn) > 0)
    assert turn[-1] - turn[0] == pytest.approx(3.7, abs=0.5)
    assert np.abs(view.arclength(turn) - s).max() < 1e-8 * h.curve.length
    assert np.allclose(view.turn(s + h.curve.length), turn + 1, atol=1e-12)


def test_the_riemann_map_to_the_disc():
    """Between unit circles it is the identity, up to the point it is seen from and the rotation of its first vertex."""
    h = measure(Curve(circle(200)))
    view = HarmonicView.of(h, np.array([0.3 + 0.1j]))[0]
    z = inside(circle(), 30)
    u = view.disc(z)
    a = place(h, view.mass)
    expected = (z - a) / (1 - np.conj(a) * z)
    turn = np.vdot(expected, u) / abs(np.vdot(expected, u))
    assert np.abs(u - turn * expected).max() < 2e-3


@pytest.mark.parametrize("p", [(0.4, -0.3, 0.7), (0, 0, 2), (1.5, 0.2, -1)])
def test_moebius_maps_of_the_circle(p):
    m = Moebius.of(np.array(p))
    turn = np.linspace(-0.7, 1.6, 200)
    image = m(turn)
    assert np.all(np.diff(image) > 0) and np.allclose(m.inverse(image), turn, atol=1e-10)
    assert np.allclose(np.exp(2j * np.pi * image), m.inside(np.exp(2j * np.pi * turn)), atol=1e-12)


@pytest.mark.parametrize("p", [(0.4, -0.3, 0.7), (0, 0, 2), (-0.2, 0.9, -1)])
def test_the_distortion_is_the_variance_of_the_log_of_the_derivative(p):
    h = measure(Curve(circle(200)))
    disc = Coarse(h, h.lengths / h.curve.length)  # seen from its centre
    m = Moebius.of(np.array(p))
    turn, step = np.linspace(0, 1, 20_000, endpoint=False), 1e-6
    arclengths = m.inverse(turn)
    stretch = np.log([(m(x + step) - m(x - step)) / (2 * step) for x in (turn, arclengths)])
    value = distortion(disc, disc, m)
    assert value == pytest.approx(stretch.var(), rel=0.03, abs=1e-4)
    turned = distortion(disc, disc, Moebius(m.b, m.rho + np.array([[0.0], [1.0]])))
    assert turned[0] == pytest.approx(float(value), rel=1e-12)


def test_the_least_distortion_between_similar_shapes_is_the_similarity():
    h, rotated = measure(Curve(pear())), measure(Curve(pear() * np.exp(1j)))
    best = search(h, rotated)
    assert best.distortion < 1e-3
    s = np.linspace(0, 1, 50) * h.curve.length
    assert np.abs(rotated.curve.at(best.forward(s)) - h.curve.at(s) * np.exp(1j)).max() < 5e-3
    assert np.allclose(best.backward(best.forward(s)), s, atol=1e-6 * h.curve.length)


def test_pins_choose_among_the_conformal_maps():
    h = measure(Curve(circle(120)))
    b = 0.4 - 0.2j
    z = np.array([0, 0.5j, -0.3 + 0.1j])
    pins = np.column_stack([z, (z - b) / (1 - np.conj(b) * z)])
    best = search(h, h, pins)
    s = np.linspace(0, 1, 40) * h.curve.length
    u = h.curve.at(s)
    assert np.abs(h.curve.at(best.forward(s)) - (u - b) / (1 - np.conj(b) * u)).max() < 3e-2


def test_the_thickness_is_the_radius_of_the_largest_touching_disc():
    curve = Curve(refined(np.array([0, 10, 10 + 1j, 1j]), 1))
    edge, z, radius = thickness(curve, 0.25)
    long = (edge % 2 == 0) & (z.real > 1) & (z.real < 9)
    assert np.allclose(radius[long], 0.5, atol=1e-9)
    corner = (edge == 0) & (z.real < 0.4)
    assert np.allclose(radius[corner], np.minimum(z.real[corner], 0.5), atol=0.13)


def test_panels_shrink_towards_corners_and_where_it_is_thin():
    curve = Curve(arrow())
    assert corners(curve).size == 8
    ends = graded(curve, 0.2, np.full(8, 1e-3))
    assert np.all(np.diff(ends) > 0)
    assert np.abs(ends[:, None] - curve.knots[:-1]).min(axis=0).max() < 1e-12
    lengths = np.diff(np.append(ends, curve.length))
    assert lengths.max() < 0.25
    z = curve.at(ends)
    away = np.abs(z[:, None] - curve.z).min(axis=1)
    assert np.all(lengths <= 2e-3 + 1.0 * (away + lengths) * 0.5 + 1e-12)
    assert corners(Curve(circle(200))).size == 0


def test_the_division_does_not_depend_on_start_or_direction():
    z = arrow()
    whole = Curve(z).at(graded(Curve(z), 0.2, np.full(8, 1e-3)))
    for polygon in (np.roll(z, 3), z[::-1].conj()):
        curve = Curve(polygon)
        places = curve.at(graded(curve, 0.2, np.full(8, 1e-3)))
        places = places if polygon[0] != z[-1].conj() else places.conj()
        assert places.size == whole.size
        assert np.abs(places[:, None] - whole).min(axis=1).max() < 1e-9
