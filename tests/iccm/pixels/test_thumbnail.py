"""Pictures as notebooks show them, read by another library."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from iccm.pixels.thumbnail import LARGEST_SIDE_PIXELS, png


def thumbnail_pixels(pixels):
    with Image.open(BytesIO(png(pixels))) as image:
        return np.asarray(image)


@pytest.mark.parametrize(
    ("pixels", "expected"),
    [
        (np.array([0, 257, 40 * 257, 65535], np.uint16), [0, 1, 40, 255]),
        (np.array([0, 1, 40, 255], np.uint8), [0, 1, 40, 255]),
        (np.array([0, 1.4 / 255, 1.6 / 255, 1, 7, -1, np.nan], np.float32), [0, 1, 2, 255, 255, 0, 0]),
    ],
)
def test_black_stays_black_and_white_stays_white_in_every_depth(pixels, expected):
    assert thumbnail_pixels(pixels.reshape(1, -1, 1)).ravel().tolist() == expected


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_channels_keep_their_meaning(channels):
    pixels = np.random.default_rng(channels).integers(0, 256, (3, 5, channels), np.uint8)
    assert np.array_equal(thumbnail_pixels(pixels).reshape(3, 5, channels), pixels)


@pytest.mark.parametrize("shape", [(2 * LARGEST_SIDE_PIXELS + 1, 3), (3, 2 * LARGEST_SIDE_PIXELS + 1)])
def test_large_pictures_are_thinned_out_whichever_side_is_longer(shape):
    pixels = np.arange(shape[0] * shape[1], dtype=np.uint32).astype(np.uint8).reshape(*shape, 1)
    thumbnail = thumbnail_pixels(pixels)
    assert LARGEST_SIDE_PIXELS / 2 < max(thumbnail.shape) <= LARGEST_SIDE_PIXELS
    assert np.array_equal(thumbnail, pixels[::3, ::3, 0])
