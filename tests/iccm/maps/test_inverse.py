"""Jets and the exact inverse, compared with the sums of the paper and with analytic maps."""

import numpy as np
import pytest

from iccm.maps.harmonic import HarmonicMap
from iccm.maps.inverse import inverse
from tests.shapes import arrow, conformal_fit, pear


def star(n=160):
    s = 2 * np.pi * np.arange(n) / n
    return (1 + 0.3 * np.cos(5 * s)) * np.exp(1j * s)


def graded(n=60):
    """A thin right angle whose edges shrink from 0.2 to 1e-8 towards the corner at 0."""
    t = np.concatenate([[0], np.geomspace(1e-8, 1, n)])
    return np.concatenate(
        [t, 1 + 0.3j + 0 * t[-1:], (0.3j + 0.3) + 0 * t[-1:], 0.3 + 1j + 0 * t[-1:], 1j * t[:0:-1]]
    )


MAPS = {
    "square": (star, lambda z: z + 0.1 * z**2, lambda z: 0 * z),
    "exp": (star, np.exp, lambda z: 0 * z),
    "moebius": (star, lambda z: z / (z - 1.4), lambda z: 0 * z),
    "harmonic": (star, lambda z: z + 0.1 * z**2, lambda z: 0.2 * z.conj() + 0.02 * z.conj() ** 2),
    "graded": (graded, lambda z: z + 0.2 * z**2, lambda z: 0.1 * z.conj()),
}


@pytest.fixture(params=MAPS)
def map(request):
    shape, phi, psi = MAPS[request.param]
    p = shape()
    return HarmonicMap(p, phi(p), psi(p))


def inside(map, count, seed=0):
    import shapely

    p, rng = map.polygon, np.random.default_rng(seed)
    z = rng.uniform(p.real.min(), p.real.max(), count) + 1j * rng.uniform(p.imag.min(), p.imag.max(), count)
    return z[shapely.contains_xy(shapely.Polygon(np.column_stack([p.real, p.imag])), z.real, z.imag)]


def test_jets_agree_with_the_sums_of_coordinates(map):
    z = inside(map, 2000)
    f, a, b = map.jet(z)
    assert np.abs(f - map(z)).max() < 1e-12
    dense_a, dense_b = map.derivatives(z)
    assert np.abs(a - dense_a).max() < 1e-9
    assert np.abs(b - dense_b).max() < 1e-9


def test_jets_take_the_limits_on_the_boundary(map):
    p = map.polygon
    assert np.abs(map.jet(p)[0] - map(p)).max() < 1e-12
    middles = 0.5 * (p + np.roll(p, -1))
    assert np.abs(map.jet(middles)[0] - map(middles)).max() < 1e-12
    assert np.isnan(map.jet(np.array([10 + 0j, p.mean() + 5j]))).all()
    assert np.isnan(map.jet(p)[1:]).all()


def test_jets_keep_the_shape_and_take_nothing():
    map = HarmonicMap(star(), star(), 0 * star())
    assert map.jet(np.zeros((3, 0), complex))[0].shape == (3, 0)
    assert map.jet(np.full((2, 3), 0.1 + 0j))[1].shape == (2, 3)


def test_inverse_undoes_the_map(map):
    z = inside(map, 4000)
    back = inverse(map, map(z))
    assert not np.isnan(back).any()
    assert np.abs(back - z).max() < 1e-9


def test_inverse_reaches_points_very_near_the_boundary(map):
    p = map.polygon
    z = 0.5 * (p + np.roll(p, -1)) + 1e-4j * (np.roll(p, -1) - p)
    back = inverse(map, map(z))
    assert not np.isnan(back).any()
    assert np.abs(back - z).max() < 1e-9


def test_points_outside_the_image_have_no_inverse(map):
    w = map(map.polygon)
    far = w.mean() + 3 * (np.abs(w - w.mean()).max()) * np.exp(1j * np.arange(7))
    assert np.isnan(inverse(map, far)).all()
    assert np.isnan(inverse(map, np.array([np.nan + 0j]))).all()


def test_crowded_limb_is_inverted():
    """log(1.0001 - z): half of the image's length comes from an arc of 1e-3."""
    p = np.exp(2j * np.pi * np.linspace(-0.5, 0.5, 401)[:-1] ** 3 * 4)
    map = HarmonicMap(p, np.log(1.0001 - p), 0 * p)
    z = 0.999999 - np.geomspace(1e-5, 1, 300) + 0j
    back = inverse(map, map(z))
    assert np.abs(back - z).max() < 1e-9


def test_threads_do_not_change_the_bytes(map):
    z = inside(map, 20000)
    one_thread, two_threads = (np.stack(map.jet(z, threads)) for threads in (1, 2))
    assert one_thread.tobytes() == two_threads.tobytes()


def test_where_the_map_is_nearly_flat_the_inverse_is_right_or_nan():
    """Near sharp corners, where f' decreases to 1e-6, and an error of 1e-9 in the image may be 1e-3 in the source."""
    fit = conformal_fit(arrow(), pear())
    p = fit.map.polygon
    z = np.concatenate(
        [p + 0.3 * t * (np.roll(p, 1) - p) + t * (p.mean() - p) for t in np.geomspace(1e-9, 1e-2, 40)]
    )
    w = fit.map(z[fit.source.contains(z)])
    preimages = inverse(fit.map, w)
    finite = np.isfinite(preimages)
    assert finite.mean() > 0.98
    f, slope, _ = fit.map.jet(preimages[finite])
    assert np.abs(slope).min() < 1e-4
    assert (np.abs(w[finite] - f) <= 1e-8 * fit.map.diagonal * np.abs(slope)).all()
