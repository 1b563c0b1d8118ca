"""Thumbnails of a batch's page, for every bit depth."""

import base64
from io import BytesIO

import numpy as np
import pytest
from PIL import Image as Pillow

from iccm.io.batch import overview
from iccm.io.pictures import image_files
from iccm.io.pictures.image_files import Image


def thumbnail_of(pixels, path, **more):
    image_files.write(path, Image(pixels, **more))
    address = overview.thumbnail(str(path))
    with Pillow.open(BytesIO(base64.b64decode(address.partition(",")[2]))) as picture:
        return np.asarray(picture)


@pytest.mark.parametrize(
    ("dtype", "suffix", "space"),
    [(np.uint8, ".png", "sRGB"), (np.uint16, ".png", "sRGB"), (np.float32, ".tif", "lin_rec709")],
)
def test_black_grey_and_white_are_unchanged(tmp_path, dtype, suffix, space):
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    pixels = np.repeat(
        (np.array([[0, 0.21, 0.63, 1], [1, 0.63, 0.21, 0]]) * top).astype(dtype)[..., None], 3, axis=2
    )
    thumbnail = thumbnail_of(pixels, tmp_path / f"a{suffix}", colorspace=space)
    assert thumbnail[..., 0] == pytest.approx(np.array([[0, 53.5, 160.6, 255], [255, 160.6, 53.5, 0]]), abs=1)


def test_oblong_pictures_keep_their_proportions(tmp_path):
    thumbnail = thumbnail_of(np.full((64, 640, 4), 200, np.uint8), tmp_path / "a.png", alpha=3)
    assert thumbnail.shape[1] == overview.THUMBNAIL_PIXELS and thumbnail.shape[0] == pytest.approx(
        overview.THUMBNAIL_PIXELS / 10, abs=1
    )
