"""What a picture loses in a format is noted: every kind of picture is written with every suffix, and read again."""

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import ImageCms

from iccm.errors import InputError
from iccm.io import formats
from iccm.io.pictures import image_files, rasters, stmap_files, tiles
from iccm.io.pictures.image import Image
from iccm.io.pictures.rasters import NODATA_TAG

SUFFIXES = formats.holding("picture", written=True)
RAMP = np.linspace(0.013, 0.97, 12 * 10 * 3).reshape(12, 10, 3)
"""Numbers that 8 bits do not hold."""
OPACITY = np.linspace(0.4, 1, 12 * 10).reshape(12, 10, 1)
PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def stored(values, dtype):
    dtype = np.dtype(dtype)
    return values.astype(dtype) if dtype.kind == "f" else np.rint(values * np.iinfo(dtype).max).astype(dtype)


def picture(dtype, *, grey=False, alpha=False, profile=False, colorspace="sRGB"):
    values = RAMP[..., :1] if grey else RAMP
    channels = values.shape[2]
    values = np.concatenate([values, OPACITY], axis=2) if alpha else values
    kind = oiio.TypeDesc(f"uint8[{len(PROFILE)}]")
    metadata = {"ICCProfile": (kind, np.frombuffer(PROFILE, np.uint8))} if profile else {}
    return Image(stored(values, dtype), channels if alpha else -1, colorspace=colorspace, metadata=metadata)


KINDS = {
    "8 bits": picture("uint8"),
    "16 bits": picture("uint16"),
    "grey, 16 bits": picture("uint16", grey=True),
    "8 bits with alpha": picture("uint8", alpha=True),
    "16 bits with alpha": picture("uint16", alpha=True),
    "grey with alpha": picture("uint16", grey=True, alpha=True),
    "half": picture("float16", colorspace="lin_rec709"),
    "float": picture("float32", colorspace="lin_rec709"),
    "float with alpha": picture("float32", alpha=True, colorspace="lin_rec709"),
    "profile": picture("uint8", profile=True),
    "profile, 16 bits": picture("uint16", profile=True),
}


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kind", KINDS)
def test_every_loss_is_noted(tmp_path, kind, suffix):
    image, path = KINDS[kind], tmp_path / f"a{suffix}"
    notes = " ".join(image_files.losses(path, image))
    try:
        image_files.write(path, image)
    except InputError:
        return  # refused, so nothing is lost
    again = image_files.read(path)
    bits = 8 * image.pixels.itemsize
    if 8 * again.pixels.itemsize < bits:
        assert "bits per channel" in notes and f"has {bits}" in notes
    if again.alpha < 0 <= image.alpha:
        assert "alpha" in notes
    if "ICCProfile" in image.metadata and "ICCProfile" not in again.metadata:
        assert "profile" in notes
    assert kind != "8 bits" or not notes


@pytest.mark.parametrize(("dtype", "missing"), [("int16", -9999), ("float32", -9999), ("uint8", 0)])
def test_numbers_and_missing_data_pass_through_an_stmap(tmp_path, dtype, missing):
    """No number without data is mixed with others, and none is scaled."""
    values = np.tile(np.arange(1, 33), (24, 1)).astype(dtype)
    values[:4] = missing
    tifffile.imwrite(tmp_path / "a.tif", values, extratags=[(NODATA_TAG, "s", 0, str(missing), True)])
    x, y = np.meshgrid((np.arange(32) + 0.5) / 32, 1 - (np.arange(24) + 0.3) / 24)
    places = Image(np.stack([x, y, 0 * x], axis=2).astype(np.float32), -1, colorspace="data")
    image_files.write(tmp_path / "st.exr", places)
    st = stmap_files.read(tmp_path / "st.exr", max_pixels=1000)
    image, _ = tiles.read_any(str(tmp_path / "a.tif"), lambda: None, max_pixels=1000)
    stmap_files.apply(st, image, tmp_path / "o.tif")
    again = tifffile.imread(tmp_path / "o.tif")
    assert again.dtype == dtype and (again[:4] == missing).all()
    assert again[5:].min() >= 1 and np.abs(again[5:].astype(float) - values[5:]).max() < 0.5
    assert rasters.read(tmp_path / "o.tif").raster.nodata == missing
    assert "without data" in image_files.losses("o.png", image)[0]
    if dtype == "int16":
        with pytest.raises(InputError, match="cannot hold the int16 numbers"):
            stmap_files.apply(st, image, tmp_path / "o.png")
