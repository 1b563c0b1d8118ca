"""Pictures as they are stored, and their conversion for output formats: colour space, alpha association, depth."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box
from ...errors import InputError
from ...memory import Memory
from ...pixels import colour
from ...pixels.pyramid import strip_rows
from ...pixels.texture import Texture
from ..formats import PictureFormat
from .raster import Raster

if TYPE_CHECKING:
    import OpenImageIO as oiio

USUAL = {  # names of the two working spaces; reading OpenColorIO's built-in configuration takes 30 ms
    "sRGB": "sRGB",
    "srgb_rec709_scene": "sRGB",
    "lin_rec709": "lin_rec709",
    "lin_rec709_scene": "lin_rec709",
}
TRANSFERS = {"sRGB": "srgb", "lin_rec709": "linear"}


@dataclass(frozen=True, eq=False)
class Image:
    """A picture as stored.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 at the top.
        alpha: index of the alpha channel, or -1.
        associated: whether colours are premultiplied by alpha.
        colorspace: OpenColorIO name, or "data" for numbers that are not colours.
        metadata: further metadata of the file, name -> (OpenImageIO type, value); `channels` -> the channels' names.
        notes: what a user should know about how the file was read.
        holes: number of pixels that are not finite.
        raster: what a picture of numbers, such as heights or labels, has besides pixels.
    """

    pixels: NDArray
    alpha: int = -1
    associated: bool = False
    colorspace: str = "sRGB"
    metadata: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    holes: int = 0
    raster: Raster | None = None

    def texture(
        self, box: Box, kind: str = "colour", room: Memory | None = None, rotation: complex = 1
    ) -> Texture:
        """Return the picture placed in the plane, in sRGB or linear light; plain numbers unless `kind` is "colour"."""
        transfer = "linear" if kind != "colour" else transfer_of(self.colorspace)
        if transfer is not None:
            return Texture(self.pixels, box, self.alpha, transfer, self.associated, rotation)
        room = room or Memory()
        linear = room(self.pixels.shape, np.float32)
        step = strip_rows(*linear.shape[1:])
        for row in range(0, len(linear), step):
            part = replace(self, pixels=self.pixels[row : row + step])
            linear[row : row + step] = convert(part, "lin_rec709", np.dtype(np.float32)).pixels
            room.release()
        return Texture(linear, box, self.alpha, "linear", self.associated, rotation)

    def covered(self) -> Image:
        """Return a picture of one pixel with the channels of the result of `warp`: alpha is appended if missing."""
        channels = self.pixels.shape[2] + (self.alpha < 0)
        alpha = self.alpha if self.alpha >= 0 else channels - 1
        return replace(self, pixels=np.zeros((1, 1, channels), self.pixels.dtype), alpha=alpha)

    def with_pixels(self, pixels: NDArray, alpha: int) -> Image:
        """Return a picture of the same kind with other pixels, which `warp` made from this picture's texture."""
        image = replace(self, pixels=pixels, alpha=alpha)
        if pixels.dtype != self.pixels.dtype:
            image = convert(replace(image, colorspace="lin_rec709"), self.colorspace, self.pixels.dtype)
        return image


def own_configuration() -> bool:
    """Return whether the environment sets an OpenColorIO configuration, in which names may differ."""
    return bool(os.environ.get("OCIO"))


@cache
def transfer_of(colorspace: str) -> str | None:
    """Return "srgb" or "linear" for colour spaces that filters decode themselves, None for others."""
    if colorspace in USUAL and not own_configuration():
        return TRANSFERS[USUAL[colorspace]]
    import OpenImageIO as oiio

    config = oiio.ColorConfig()
    if config.equivalent(colorspace, "sRGB"):
        return "srgb"
    resolved = config.resolve(colorspace)
    if colorspace == "data" or resolved in ("Raw", "ACEScg", "ACES2065-1") or "Linear" in resolved:
        return "linear"
    return None


@cache
def usual_of(space: str) -> str | None:
    """Return the usual name of a colour space if it has one, else the given name; None if it is unknown."""
    if space in USUAL and not own_configuration():
        return USUAL[space]
    import OpenImageIO as oiio

    config = oiio.ColorConfig()
    if config.resolve(space) not in config.getColorSpaceNames():
        return None
    return next((name for name in TRANSFERS if config.equivalent(space, name)), space)


def prepare(image: Image, format: PictureFormat) -> Image:
    """Convert the picture to what a format can store: encoding, alpha association, channels and depth."""
    original, encoded = image.colorspace, transfer_of(image.colorspace)
    not_stated = not format.named and encoded != "srgb" and image.colorspace != "data"
    display, linear = format.light == "display", format.light == "linear"
    if display:
        image = unassociate(image)
    if linear and (encoded != "linear" or image.pixels.dtype.kind != "f"):
        space = "data" if image.colorspace == "data" else "lin_rec709"
        image = convert(image, space, np.dtype(np.float16 if image.pixels.dtype == np.uint8 else np.float32))
    elif display and (not_stated or image.pixels.dtype.kind == "f"):
        depth = np.uint16 if 16 in format.bits else np.uint8
        image = convert(image, "data" if image.colorspace == "data" else "sRGB", np.dtype(depth))
    elif not_stated and format.light == "any" and image.colorspace != "lin_rec709":
        # readers of such formats assume sRGB for integers, and linear light for floats
        deep = image.pixels.dtype.kind == "f"
        image = convert(image, "lin_rec709" if deep else "sRGB", np.dtype(np.float32 if deep else np.uint16))
    elif not_stated and format.light == "any" and image.pixels.dtype.kind != "f":
        image = convert(image, "sRGB", np.dtype(np.uint16))
    if image.colorspace != original:
        image = replace(image, metadata=_without(image, "ICCProfile", "CICP"))
    if image.alpha >= 0 and (linear or not format.alpha):
        image = _associate(image, keep=format.alpha)
    if image.pixels.dtype == np.uint16 and 16 not in format.bits:
        image = replace(image, pixels=np.rint(image.pixels / 257.0).astype(np.uint8))
    channels = image.pixels.shape[2]
    if not format.grey and channels < 3 and (image.alpha >= 0) == (channels == 2):
        image = replace(
            image,
            pixels=image.pixels[..., [0, 0, 0, 1][: 3 + (image.alpha >= 0)]],
            alpha=3 if image.alpha >= 0 else -1,
            metadata=_without(image, "channels"),
        )
    return image


def unassociate(image: Image) -> Image:
    """Return the picture with straight alpha."""
    if not image.associated:
        return image
    srgb = transfer_of(image.colorspace) == "srgb"
    values = colour.decode(image.pixels, image.alpha, srgb=srgb, associated=True, premultiply=False)
    pixels = colour.encode(values, image.pixels.dtype, image.alpha, srgb=srgb)
    return replace(image, pixels=pixels, associated=False)


def _associate(image: Image, *, keep: bool) -> Image:
    """Multiply colours by alpha; without `keep`, composite the picture on white and remove alpha."""
    srgb = transfer_of(image.colorspace) == "srgb"
    values = colour.decode(
        image.pixels, image.alpha, srgb=srgb, associated=image.associated, premultiply=True
    )
    if keep:
        pixels = colour.encode(values, image.pixels.dtype, image.alpha, srgb=srgb, associated=True)
        return replace(image, pixels=pixels, associated=True)
    alpha = values[..., image.alpha : image.alpha + 1]
    values = np.delete(values + (1 - alpha), image.alpha, axis=2)
    pixels = colour.encode(values, image.pixels.dtype, -1, srgb=srgb)
    return replace(image, pixels=pixels, alpha=-1, associated=False, metadata=_without(image, "channels"))


def _without(image: Image, *names: str) -> dict[str, Any]:
    return {name: value for name, value in image.metadata.items() if name not in names}


def convert(image: Image, space: str, dtype: np.dtype) -> Image:
    """Convert the picture to another colour space and depth; alpha keeps its association."""
    old = image.pixels.dtype
    values = image.pixels.astype(np.float32)
    if old.kind != "f":
        values /= np.iinfo(old).max
    if "data" not in (image.colorspace, space) and image.colorspace != space:
        colours = [k for k in range(values.shape[2]) if k != image.alpha]
        for first in range(0, len(colours), 3):
            part = colours[first : first + 3]
            values[..., part] = _ocio(values, part, image, space)
    if dtype.kind != "f":
        values = np.rint(np.nan_to_num(np.clip(values, 0, 1), copy=False) * np.iinfo(dtype).max)
    return replace(image, pixels=values.astype(dtype), colorspace=space)


def _ocio(values: NDArray, part: list[int], image: Image, space: str) -> NDArray:
    """Convert up to three channels by OpenColorIO, with straight alpha; fewer than three are treated as grey."""
    import OpenImageIO as oiio

    rgb = values[..., [*part, *[part[0]] * (3 - len(part))]] if len(part) < 3 else values[..., part]
    alpha = values[..., image.alpha : image.alpha + 1] if image.associated and image.alpha >= 0 else None
    if alpha is not None:
        rgb = rgb / np.where(alpha != 0, alpha, 1)
    source = oiio.ImageBuf(np.ascontiguousarray(rgb))
    converted = oiio.ImageBufAlgo.colorconvert(source, image.colorspace, space)
    if converted.has_error or not converted.initialized:
        raise InputError(f"colour space {image.colorspace!r} to {space!r}: {error_of(converted)}")
    out = np.asarray(converted.get_pixels(oiio.FLOAT))[..., : len(part)]
    return out if alpha is None else out * alpha


_UNSUPPORTED = re.compile(r"(\w+) compression support is not configured")


def error_of(library: Any) -> str:
    """Return the first line of the last error of OpenImageIO, or of one of its files or buffers, and clear it."""
    try:
        lines = library.geterror().strip().splitlines()
    except UnicodeDecodeError:  # the message quotes the file
        return "its header contains bytes that are not UTF-8"
    if lines and (compression := _UNSUPPORTED.search(lines[0])):
        return f"its compression {compression[1]} is not supported; use gdal_translate -co COMPRESS=DEFLATE"
    return lines[0] if lines else "unknown reason"


def text_of(spec: oiio.ImageSpec, name: str) -> str:
    """Return an attribute of a header as text; empty if it is missing, not a text, or not UTF-8."""
    try:
        value = spec.getattribute(name)
    except UnicodeDecodeError:
        return ""
    return value if isinstance(value, str) else ""
