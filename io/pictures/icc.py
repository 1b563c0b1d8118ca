"""Convert CMYK and Lab pictures to sRGB by their ICC profile, which OpenImageIO does not do."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ...errors import InputError
from . import pillow
from .image import text_of

if TYPE_CHECKING:
    from PIL.Image import Image as PictureFile

LAB = "CIELAB", "ICCLAB"


def needed(spec: oiio.ImageSpec) -> bool:
    """Return whether a picture's header says that it is in Lab, or in CMYK with a profile."""
    kinds = {text_of(spec, f"{format}:ColorSpace") for format in ("jpeg", "tiff")}
    if kinds.intersection(LAB):
        return True
    return "CMYK" in kinds and text_of(spec, "ICCProfile:color_space") == "CMYK"


def read(path: str | Path, spec: oiio.ImageSpec) -> NDArray[np.uint8]:
    """Return (h, w, 3) sRGB bytes of a picture in Lab or CMYK, in stored orientation.

    The conversion is media-relative with black point compensation.

    Raises:
        InputError: more than 8 bits per channel, or an invalid profile or invalid pixels.
    """
    from PIL import ImageCms

    if str(spec.format) != "uint8":
        raise InputError(
            f"{path}: CMYK with an ICC profile and Lab are only read with 8 bits per channel; convert the "
            "picture to RGB first"
        )
    with pillow.opened(Path(path), path, ("JPEG", "TIFF")) as picture:
        try:
            if picture.mode == "LAB":
                profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB"))
            elif picture.mode == "CMYK":
                profile = ImageCms.ImageCmsProfile(BytesIO(picture.info["icc_profile"]))
            else:
                raise InputError(
                    f"{path}: CMYK or Lab with additional channels is not supported; convert "
                    "the picture to RGB first"
                )
            converted = ImageCms.profileToProfile(
                picture,
                profile,
                ImageCms.createProfile("sRGB"),
                ImageCms.Intent.RELATIVE_COLORIMETRIC,
                "RGB",
                flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
            )
        except (OSError, KeyError, ImageCms.PyCMSError) as error:
            reason = (str(error) or "unknown reason").splitlines()[0]
            raise InputError(f"{path}: cannot convert its colours with its ICC profile: {reason}") from error
    assert converted is not None
    return np.asarray(converted)


def as_srgb(picture: "PictureFile", path: str | Path) -> tuple[NDArray[np.uint8], int]:
    """Return sRGB bytes of a picture opened by Pillow, converted by its profile if any, and the index of alpha.

    Raises:
        InputError: the profile is invalid.
    """
    from PIL import ImageCms

    alpha = 3 if picture.has_transparency_data else -1
    converted = picture.convert("RGBA" if alpha >= 0 else "RGB")
    if profile := picture.info.get("icc_profile"):
        try:
            source_profile = ImageCms.ImageCmsProfile(BytesIO(profile))
            ImageCms.profileToProfile(converted, source_profile, ImageCms.createProfile("sRGB"), inPlace=True)
        except (OSError, ImageCms.PyCMSError) as error:
            reason = (str(error) or "unknown reason").splitlines()[0]
            raise InputError(f"{path}: cannot be converted by its ICC profile: {reason}") from error
    return np.asarray(converted), alpha
