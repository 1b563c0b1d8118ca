"""Maps as transforms: with scikit-image, inverted, composed, as STMaps; their distortion and their figure."""

import numpy as np
import pytest
import skimage.io
import skimage.transform

import iccm
from iccm.arrays import xy_of
from tests.shapes import arrow, blob, inside, pear, square

METHODS = ["balanced", "conformal", "paper"]


@pytest.fixture(scope="module", params=METHODS)
def fit(request):
    return iccm.fit(pear(), arrow(), method=request.param)


@pytest.fixture(scope="module")
def balanced():
    return iccm.fit(pear(), arrow())


@pytest.mark.slow
def test_a_transform_returns_points_in_the_given_form(fit):
    z = inside(pear())
    w = fit.transform(z)
    assert np.array_equal(w, fit.map(z)) and np.array_equal(fit.transform(xy_of(z)), xy_of(w))
    assert np.abs(fit.transform.inverse(w) - z).max() < 1e-6 and np.array_equal(
        fit.transform.inverse.inverse(z), w
    )
    assert fit.transform(z[:6].reshape(2, 3)).shape == (2, 3)
    for wrong in ([1.0, 2, 3], np.zeros((4, 3))):
        with pytest.raises(ValueError, match=r"points: .*shape"):
            fit.transform(wrong)


def test_pairs_on_either_side_of_the_inverse_are_in_that_side_s_axes():
    """From pixels, with y down, to a plane with y up: the map of complex numbers doubles and moves them."""
    transform = iccm.Transform(lambda z: 2 * z + 1j, lambda w: (w - 1j) / 2, ("screen", "xy"))
    pixels = np.array([[3.0, -5.0], [0.5, 2.0]])  # 3 + 5i, .5 - 2i
    places = np.array([[6.0, 11.0], [1.0, -3.0]])
    assert np.array_equal(transform(pixels), places)
    assert np.array_equal(transform.inverse(places), pixels)
    assert np.array_equal(transform.inverse.inverse(pixels), places)


@pytest.mark.slow
def test_maps_one_after_the_other(fit):
    onward = iccm.fit(arrow(), blob(), method="balanced")
    z = inside(pear(), 30)
    composed = fit.then(onward)
    assert np.array_equal(composed(z), onward.map(fit.map(z)), equal_nan=True)
    finite = np.isfinite(composed(z))
    assert finite.mean() > 0.8 and np.abs(composed.inverse(composed(z)) - z)[finite].max() < 1e-5
    there_and_back = fit.then(fit.transform.inverse)
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
    assert min(value.min() for value in terms.values()) >= 1 - 1e-12
    energies = iccm.fit(pear(), 3 * pear(), method="paper").triangles.energies()["total"]
    assert np.median(energies) == pytest.approx(1, abs=1e-5)


def test_pairs_are_not_mistaken_for_points_of_the_real_axis(fit):
    z = inside(pear(), 20)
    w = fit.map(z)
    assert np.array_equal(fit.map(xy_of(z)), xy_of(w)) and np.array_equal(
        fit.inverse(xy_of(w)), xy_of(fit.inverse(w))
    )
    with pytest.raises(iccm.InputError, match=r"points: .*\(4, 2\).*complex"):
        fit.map.derivatives(np.zeros((4, 2)))


@pytest.mark.slow
def test_an_stmap_and_back(balanced):
    """Between pixel centres the map of an STMap is off by the square of a pixel, at the outline by less than one."""
    st = iccm.stmap(balanced, size=256)
    back = iccm.from_stmap(st, texture_box=balanced.source.box, target_box=balanced.target.box)
    z = inside(pear(), 500)
    w = balanced.map(z)
    z, w = z[np.isfinite(w)], w[np.isfinite(w)]
    pixel = (balanced.target.box[1] - balanced.target.box[0]).real / st.shape[1]
    off = np.abs(back(z) - w)
    assert np.isfinite(off).all() and np.median(off) < 0.01 * pixel and off.max() < pixel
    images = back(z)
    assert np.abs(back.inverse(images) - z).max() < 0.01 and np.isnan(back(2 * balanced.source.box[1]))


def test_a_mirrored_stmap_and_one_with_a_seam():
    t, s = np.mgrid[0:16, 0:32] / [[[15]], [[31]]]
    mirrored = iccm.from_stmap(np.stack([1 - s, 1 - t], axis=-1)[:, 1:-1])
    assert mirrored(0.25 + 0.5j) == pytest.approx(22.75 + 8j) and mirrored.inverse(
        22.75 + 8j
    ) == pytest.approx(0.25 + 0.5j)
    two = np.concatenate([s[:, 1:], s[:, 1:]], axis=1), np.concatenate([1 - t[:, 1:], 1 - t[:, 1:]], axis=1)
    halves = iccm.from_stmap(np.stack(two, axis=-1))
    at_seam = halves.inverse(np.array([10.25, 41.25, 30.6, 31.4]) + 8j)
    assert np.allclose(at_seam, np.array([10.75, 10.75, 31, 1]) / 31 + 0.5j)


@pytest.mark.parametrize("wrong", [np.zeros((4, 4)), np.zeros((4, 4, 2), int), np.full((4, 4, 2), np.nan)])
def test_invalid_stmaps_are_refused(wrong):
    with pytest.raises(iccm.InputError, match="stmap: "):
        iccm.from_stmap(wrong)


@pytest.mark.slow
def test_the_figure_of_a_map(balanced, tmp_path):
    figure = balanced.plot(names=("pear", "arrow"))
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:2] == ["pear", "arrow"] and titles[3:5] == [
        "log10 area scale, relative to its median",
        "dilatation (1 = conformal)",
    ]
    (image,) = figure.axes[2].images
    assert image.get_array().shape[2] == 4 and len(np.unique(image.get_array()[..., 0])) > 100
    words = " ".join(figure.axes[5].texts[0].get_text().split())
    assert balanced.status.value in words and all(f"note: {note}" in words for note in balanced.notes)
    figure.savefig(tmp_path / "fit.png")
    assert skimage.io.imread(tmp_path / "fit.png").std() > 10
