"""What a picture loses in a format is noted: every kind of picture is written with every suffix, and read again."""

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import ImageCms

from iccm.errors import InputError
from iccm.io import formats
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image

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
