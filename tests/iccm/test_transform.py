"""Maps as transforms: with scikit-image, turned round, composed; their distortion by terms, by triangle."""

import numpy as np
import pytest
import skimage.transform

import iccm
from iccm.arrays import xy_of
from tests.shapes import arrow, blob, inside, pear, square

METHODS = ["balanced", "conformal", "paper"]


@pytest.fixture(scope="module", params=METHODS)
def fit(request):
    return iccm.fit(pear(), arrow(), method=request.param)


def test_a_transform_takes_what_it_gives(fit):
    z = inside(pear())
    w = fit.transform(z)
    assert np.array_equal(w, fit.map(z)) and np.array_equal(fit.transform(xy_of(z)), xy_of(w))
    assert np.abs(fit.inverted()(w) - z).max() < 1e-6 and np.array_equal(fit.inverted().inverse(z), w)
    assert fit.transform(z[:6].reshape(2, 3)).shape == (2, 3)
    for wrong in ([1.0, 2, 3], np.zeros((4, 3))):
        with pytest.raises(ValueError, match="points of shape"):
            fit.transform(wrong)


def test_maps_one_after_the_other(fit):
    onward = iccm.fit(arrow(), blob(), method="balanced")
    z = inside(pear(), 30)
    both = fit.then(onward)
    assert np.array_equal(both(z), onward.map(fit.map(z)), equal_nan=True)
    known = np.isfinite(both(z))
    assert known.mean() > 0.8 and np.abs(both.inverse(both(z)) - z)[known].max() < 1e-5
    there_and_back = fit.then(fit.inverted())
    assert np.abs(there_and_back(z) - z).max() < 1e-6


def test_scikit_image_warps_by_it():
    """Pixels, x right and y down: a square onto one twice as large, by a similarity."""
    small, large = 16 + 10 * square(), 32 + 20 * square()
    fit = iccm.fit(small * 1 + 16j, large * 1 + 32j)
    picture = np.random.default_rng(0).random((33, 33))
    warped = skimage.transform.warp(picture, fit.transform.inverse, output_shape=(65, 65))
    y, x = np.mgrid[20:45, 20:45]
    expected = skimage.transform.warp(
        picture, skimage.transform.AffineTransform(scale=0.5), output_shape=(65, 65)
    )
    assert np.abs(warped - expected)[y, x].max() < 1e-6


def test_energies_by_term_of_each_triangle():
    fit = iccm.fit(np.array([0, 1, 1 + 1j, 1j]), np.array([0, 2, 2 + 1j, 1j]))
    sheet = fit.triangles
    assert sheet.z.size == len(fit.map.faces) and sheet.area.sum() == pytest.approx(2)
    _, f_z, f_zbar = fit.map.jet(sheet.z)
    assert np.allclose(sheet.f_z, f_z) and np.allclose(sheet.f_zbar, f_zbar)
    terms = sheet.energies(3.0)
    k = sheet.dilatations
    assert np.allclose(terms["angle"], (k + 1 / k) / 2)
    assert np.allclose(terms["area"], (sheet.scales**2 + sheet.scales**-2) / 2)
    assert np.allclose(terms["total"], terms["angle"] * terms["area"] ** 3)
    assert min(each.min() for each in terms.values()) >= 1 - 1e-12
    same = iccm.fit(pear(), 3 * pear(), method="paper").triangles.energies()["total"]
    assert np.median(same) == pytest.approx(1, abs=1e-5)
