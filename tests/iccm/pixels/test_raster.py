"""Operations on whole rasters, compared with brute force and other libraries."""

import cv2
import numpy as np
import pytest

from iccm.pixels import raster


def mask(seed, shape, share):
    return np.random.default_rng(seed).random(shape) < share


@pytest.mark.parametrize(
    ("shape", "share"), [((13, 29), 0.1), ((29, 13), 0.5), ((1, 17), 0.2), ((17, 1), 0.2)]
)
def test_the_nearest_pixel_is_the_nearest(shape, share):
    marked = mask(3, shape, share)
    nearest_pixels = raster.nearest(marked)
    rows, columns = np.nonzero(marked)
    y, x = np.mgrid[: shape[0], : shape[1]]
    away = np.hypot(y[..., None] - rows, x[..., None] - columns)
    np.testing.assert_allclose(nearest_pixels.distances, away.min(axis=-1), rtol=1e-6)
    indices = np.divmod(nearest_pixels.numbers, shape[1])
    np.testing.assert_allclose(np.hypot(indices[0] - y, indices[1] - x), away.min(axis=-1), rtol=1e-12)
    assert marked[indices].all()


def test_an_empty_mask_has_no_nearest_pixels():
    nearest_pixels = raster.nearest(np.zeros((5, 7), bool))
    assert (nearest_pixels.numbers == -1).all() and np.isinf(nearest_pixels.distances).all()
    assert np.isinf(raster.depths(np.ones((5, 7), bool))).all()


def test_the_depth_of_a_mask_is_that_of_opencv():
    inside = mask(4, (211, 307), 0.995)
    expected = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    np.testing.assert_allclose(raster.depths(inside), expected, atol=1e-5)


@pytest.mark.parametrize("reach", [1, 2, 9])
def test_extremes_in_squares_are_those_of_opencv(reach):
    values = np.random.default_rng(5).random((7, 23)).astype(np.float32)
    square = np.ones((2 * reach + 1,) * 2, np.uint8)
    np.testing.assert_array_equal(raster.dilated(values, reach), cv2.dilate(values, square))
    np.testing.assert_array_equal(raster.eroded(values, reach), cv2.erode(values, square))
    flags = values > 0.9
    np.testing.assert_array_equal(
        raster.dilated(flags, reach), cv2.dilate(flags.astype(np.uint8), square) > 0
    )


@pytest.mark.parametrize("size", [(20, 31), (57, 19), (19, 57), (1, 1), (38, 57)])
def test_means_over_areas_are_exact(size):
    pixels = np.random.default_rng(6).random((57, 38, 3))
    resized = raster.resized_by_area(pixels, size)
    fine = pixels.repeat(size[1], axis=0).repeat(size[0], axis=1)
    expected = fine.reshape(size[1], 57, size[0], 38, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(resized, expected, atol=1e-6)
    assert raster.resized_by_area((255 * pixels).astype(np.uint8), size).dtype == np.uint8


def test_means_do_not_depend_on_the_bands_they_are_computed_in(monkeypatch):
    pixels = np.random.default_rng(7).random((57, 38)).astype(np.float32)
    whole = raster.resized_by_area(pixels, (20, 31))
    monkeypatch.setattr(raster, "BAND_ROWS", 4)
    np.testing.assert_allclose(raster.resized_by_area(pixels, (20, 31)), whole, atol=1e-6)


def test_a_linear_ramp_stays_one_at_a_higher_resolution():
    pixels = np.add.outer(np.arange(8.0), 3 * np.arange(5.0))
    resized = raster.resized_linearly(pixels, (15, 32))
    y, x = (np.arange(32) + 0.5) / 4 - 0.5, (np.arange(15) + 0.5) / 3 - 0.5
    expected = np.add.outer(np.clip(y, 0, 7), 3 * np.clip(x, 0, 4))
    np.testing.assert_allclose(resized, expected, atol=1e-5)


def test_doubling_interpolates_linearly():
    pixels = np.random.default_rng(10).random((9, 14)).astype(np.float32)
    np.testing.assert_allclose(raster.doubled(pixels), raster.resized_linearly(pixels, (28, 18)), atol=1e-6)
    assert raster.doubled(pixels[:1, :1]).tolist() == [[pixels[0, 0]] * 2] * 2


@pytest.mark.parametrize(("sigma", "most"), [(1, 1e-6), (3.3, 1e-6), (20, 0.01)])
def test_gaussians_are_those_of_opencv(sigma, most):
    pixels = np.random.default_rng(8).random((150, 210, 3)).astype(np.float32)
    blurred = raster.blurred(pixels, sigma)
    assert np.abs(blurred - cv2.GaussianBlur(pixels, (0, 0), sigma)).max() < most
    assert raster.blurred(pixels[..., 0] > 0.5, sigma).shape == (150, 210)


@pytest.mark.parametrize("diagonally", [False, True])
def test_pieces_are_those_of_opencv(diagonally):
    inside = mask(9, (40, 61), 0.35)
    pieces = raster.pieces(inside, diagonally=diagonally)
    connectivity = 8 if diagonally else 4
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(
        inside.astype(np.uint8), connectivity=connectivity
    )
    assert pieces.count == count - 1 > 20
    for k in range(pieces.count):
        piece = pieces.labels == k + 1
        (label,) = set(labels[piece].tolist())
        left, top, width, height, area = boxes[label]
        assert area == pieces.sizes[k] == piece.sum()
        assert pieces.boxes[k].tolist() == [top, left, top + height, left + width]
        assert pieces.extents[k].tolist() == [height, width]
    large = pieces.sizes > 5
    np.testing.assert_array_equal(pieces.where(large), np.isin(pieces.labels, 1 + np.flatnonzero(large)))


def test_a_mask_without_pieces_has_none():
    pieces = raster.pieces(np.zeros((4, 6), bool), diagonally=True)
    assert pieces.count == 0 and pieces.boxes.shape == (0, 4) and not pieces.where(np.zeros(0, bool)).any()
