"""Pictures in files: read as stored (straight alpha, own depth), written with colour space and metadata kept."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from .. import colour
from ..errors import InputError
from ..resample import Box, Texture
from .files import open_input

MAX_PIXELS = 1 << 29
KEPT = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32}
DISPLAY = {".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".gif"}  # hold encoded colours only
LINEAR = {".exr", ".hdr"}  # hold linear, associated floats only
COLOURED = {".webp", ".hdr", ".bmp", ".jxl"}  # hold no grey
OPAQUE = {".jpg", ".jpeg", ".hdr"}  # hold no alpha
QUALITY = {".jpg": "jpeg:95", ".jpeg": "jpeg:95", ".webp": "lossless", ".jxl": "jpegxl:100"}
INTEGERS = {".jpg": [np.uint8], ".webp": [np.uint8], ".bmp": [np.uint8], ".png": [np.uint8, np.uint16]}
# What describes the old file's storage rather than the picture.
FORGOTTEN = ("oiio:", "compression", "planarconfig", "tiff:", "openexr:", "png:", "jpeg:", "webp:")
FORGOTTEN += ("Orientation", "textureformat", "Exif:PixelXDimension", "Exif:PixelYDimension", "thumbnail")


@dataclass(frozen=True, eq=False)
class Image:
    """A picture as stored.

    Attributes:
        pixels: (h, w, c) uint8, uint16, float16 or float32, row 0 on top.
        alpha: index of the alpha channel, or -1.
        associated: whether colours are premultiplied by alpha.
        colorspace: a name that OpenColorIO knows, or "data" for numbers that are no colours.
        metadata: what else the file said, name -> (OpenImageIO type, value); `channels` -> the channels' names.
    """

    pixels: NDArray
    alpha: int = -1
    associated: bool = False
    colorspace: str = "sRGB"
    metadata: dict[str, Any] = field(default_factory=dict)

    def texture(self, box: Box, kind: str = "colour") -> Texture:
        """The picture placed in the plane, in sRGB or linear light. `kind` other than "colour" is taken as numbers."""
        transfer = "linear" if kind != "colour" else transfer_of(self.colorspace)
        if transfer is not None:
            return Texture(self.pixels, box, self.alpha, transfer, self.associated)
        linear = _converted(self, "lin_rec709", np.dtype(np.float32))
        return Texture(linear.pixels, box, self.alpha, "linear", self.associated)

    def with_pixels(self, pixels: NDArray, alpha: int) -> "Image":
        """The same kind of picture with other pixels, as `warp` made them from this picture's texture."""
        made = replace(self, pixels=pixels, alpha=alpha)
        if pixels.dtype != self.pixels.dtype:
            made = _converted(replace(made, colorspace="lin_rec709"), self.colorspace, self.pixels.dtype)
        return made


def transfer_of(colorspace: str) -> str | None:
    """ "srgb" or "linear" for the spaces that the filters decode themselves, None for the others."""
    config = oiio.ColorConfig()
    if config.equivalent(colorspace, "sRGB"):
        return "srgb"
    resolved = config.resolve(colorspace)
    if colorspace == "data" or resolved in ("Raw", "ACEScg", "ACES2065-1") or "Linear" in resolved:
        return "linear"
    return None


def read(path: str | Path, *, max_pixels: int = MAX_PIXELS, colorspace: str | None = None) -> Image:
    """Reads the first picture of a file as it is stored, upright.

    Args:
        path: any format that OpenImageIO reads.
        max_pixels: the largest width × height that is accepted.
        colorspace: overrules what the file says.

    Raises:
        InputError: the file is missing, not a picture, damaged, or too large; the colour space is unknown.
    """
    open_input(path)
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    file = oiio.ImageInput.open(str(path), config)
    if file is None:
        raise InputError(f"{path}: cannot be read as a picture: {_line(oiio.geterror())}")
    try:
        spec = file.spec()
        if spec.width * spec.height > max_pixels or spec.depth > 1:
            raise InputError(
                f"{path}: {spec.width}x{spec.height} is more than {max_pixels} pixels; raise --max-pixels"
            )
        kind = str(spec.format) if not spec.channelformats else "float"
        pixels = file.read_image(0, 0, 0, spec.nchannels, kind if kind in KEPT else "float")
        if pixels is None or file.has_error:
            raise InputError(f"{path}: the picture is damaged: {_line(file.geterror())}")
    finally:
        file.close()
    pixels = _upright(_displayed(np.asarray(pixels).reshape(spec.height, spec.width, -1), spec), spec)
    return Image(
        np.ascontiguousarray(pixels),
        spec.alpha_channel,
        _is_associated(spec, file.format_name()),
        _known(path, colorspace) if colorspace else _space(spec, pixels.dtype),
        _metadata(spec),
    )


def write(path: str | Path, image: Image) -> None:
    """Writes a picture in the format of the path's suffix, converted where the format demands it.

    Display formats get sRGB, EXR and HDR linear light; EXR associates alpha; where there is no alpha the picture is
    laid on white.

    Raises:
        InputError: the suffix is unknown or the file cannot be written.
    """
    write_bands(path, image, image.pixels.shape[0], image.pixels.shape[1], iter([image.pixels]))


def write_bands(path: str | Path, like: Image, height: int, width: int, blocks: Iterable[NDArray]) -> None:
    """Writes (rows, width, c) blocks that follow each other from the top, as `write`, without ever holding them all.

    Args:
        path: the file.
        like: what the blocks are: alpha, colour space, metadata and type (its own pixels are not used).
        height, width: of the whole picture.
        blocks: rows of `like`'s kind.
    """
    suffix = Path(path).suffix.lower()
    row = 0
    with _opened(path) as file:
        for block in blocks:
            ready = prepared(replace(like, pixels=block), suffix)
            if suffix in OPAQUE and ready.pixels.shape[2] not in (1, 3):
                raise InputError(
                    f"{path}: {suffix} holds 1 or 3 channels, not {ready.pixels.shape[2]}; use .tif or .exr"
                )
            if row == 0 and not file.open(str(path), _spec(ready, height, width, suffix)):
                raise InputError(f"{path}: cannot be written: {_line(file.geterror())}")
            rows = np.ascontiguousarray(ready.pixels)
            done = (
                file.write_image(rows)
                if len(rows) == height
                else file.write_scanlines(row, row + len(rows), 0, rows)
            )
            if not done:
                raise InputError(f"{path}: cannot be written: {_line(file.geterror())}")
            row += len(rows)


@contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    file = oiio.ImageOutput.create(str(path))
    if file is None:
        oiio.geterror()
        raise InputError(
            f"{path}: no picture format has the suffix {Path(path).suffix!r}; use .png, .tif or .exr"
        )
    try:
        yield file
    finally:
        closed = file.close()
    if not closed:
        raise InputError(f"{path}: cannot be written: {_line(file.geterror())}")


def prepared(image: Image, suffix: str) -> Image:
    """The picture as a format can hold it: encoding, association of alpha, channels and depth."""
    encoded = transfer_of(image.colorspace)
    if suffix in LINEAR and (encoded != "linear" or image.pixels.dtype.kind != "f"):
        space = "data" if image.colorspace == "data" else "lin_rec709"
        image = _converted(
            image, space, np.dtype(np.float16 if image.pixels.dtype == np.uint8 else np.float32)
        )
    elif suffix in DISPLAY and image.pixels.dtype.kind == "f":
        depth = np.uint8 if np.uint16 not in INTEGERS.get(suffix, []) else np.uint16
        image = _converted(image, "data" if image.colorspace == "data" else "sRGB", np.dtype(depth))
    if image.alpha >= 0 and (suffix in OPAQUE or suffix == ".exr"):
        image = _associated(image, keep=suffix == ".exr")
    if image.pixels.dtype == np.uint16 and INTEGERS.get(suffix) == [np.uint8]:
        image = replace(image, pixels=np.rint(image.pixels / 257.0).astype(np.uint8))
    if (
        suffix in COLOURED
        and image.pixels.shape[2] < 3
        and (image.alpha >= 0) == (image.pixels.shape[2] == 2)
    ):
        image = replace(
            image,
            pixels=image.pixels[..., [0, 0, 0, 1][: 3 + (image.alpha >= 0)]],
            alpha=3 if image.alpha >= 0 else -1,
            metadata=_nameless(image),
        )
    return image


def _associated(image: Image, *, keep: bool) -> Image:
    """Alpha multiplied in, and without `keep` removed, the picture being laid on white."""
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
    return replace(image, pixels=pixels, alpha=-1, associated=False, metadata=_nameless(image))


def _nameless(image: Image) -> dict[str, Any]:
    return {name: value for name, value in image.metadata.items() if name != "channels"}


def _converted(image: Image, space: str, dtype: np.dtype) -> Image:
    """The picture in another colour space and depth; alpha keeps its association."""
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
        top = np.iinfo(dtype).max
        values = np.rint(np.clip(values, 0, 1) * top)
    return replace(image, pixels=values.astype(dtype), colorspace=space)


def _ocio(values: NDArray, part: list[int], image: Image, space: str) -> NDArray:
    """Up to three channels through OpenColorIO, alpha divided out meanwhile; fewer than three stand for grey."""
    rgb = values[..., [*part, *[part[0]] * (3 - len(part))]] if len(part) < 3 else values[..., part]
    alpha = values[..., image.alpha : image.alpha + 1] if image.associated and image.alpha >= 0 else None
    if alpha is not None:
        rgb = rgb / np.where(alpha != 0, alpha, 1)
    source = oiio.ImageBuf(np.ascontiguousarray(rgb))
    made = oiio.ImageBufAlgo.colorconvert(source, image.colorspace, space)
    if made.has_error:
        raise InputError(f"colour space {image.colorspace!r} to {space!r}: {_line(made.geterror())}")
    out = made.get_pixels(oiio.FLOAT)[..., : len(part)]
    return out if alpha is None else out * alpha


def _is_associated(spec: oiio.ImageSpec, format: str) -> bool:
    """Whether colours come premultiplied. JPEG XL's plug-in hands them on as stored without saying so: straight."""
    straight = spec.get_int_attribute("oiio:UnassociatedAlpha") or format == "jpegxl"
    return spec.alpha_channel >= 0 and not straight


def _known(path: str | Path, colorspace: str) -> str:
    config = oiio.ColorConfig()
    names = [*config.getColorSpaceNames(), *config.getAliases(colorspace)]
    if colorspace != "data" and config.resolve(colorspace) not in names:
        raise InputError(
            f"{path}: colour space {colorspace!r} is unknown; use sRGB, lin_rec709, data, or one of OpenColorIO's"
        )
    return colorspace


def _space(spec: oiio.ImageSpec, dtype: np.dtype) -> str:
    """The colour space that the file names; without one sRGB for integers, linear for floats."""
    said = spec.get_string_attribute("oiio:ColorSpace")
    config = oiio.ColorConfig()
    if said and config.resolve(said) in config.getColorSpaceNames():
        usual = [name for name in ("sRGB", "lin_rec709") if config.equivalent(said, name)]
        return usual[0] if usual else said
    return "lin_rec709" if dtype.kind == "f" else "sRGB"


def _metadata(spec: oiio.ImageSpec) -> dict[str, Any]:
    kept = {a.name: (a.type, a.value) for a in spec.extra_attribs if not a.name.startswith(FORGOTTEN)}
    return kept | {"channels": tuple(spec.channelnames)}


def _spec(image: Image, height: int, width: int, suffix: str) -> oiio.ImageSpec:
    channels = image.pixels.shape[2]
    names = {np.dtype(dtype): name for name, dtype in KEPT.items()}
    spec = oiio.ImageSpec(width, height, channels, names[image.pixels.dtype])
    for name, value in image.metadata.items():
        if name != "channels":
            spec.attribute(name, *value)
    said = image.metadata.get("channels", ())
    if len(said) == channels:
        spec.channelnames = said
    elif len(said) == channels - 1 and image.alpha == channels - 1:
        spec.channelnames = (*said, "A")
    elif image.alpha < 0 and channels > 3:  # else the fourth would be called alpha
        spec.channelnames = tuple(f"channel{k}" for k in range(channels))
    elif channels == 2 and image.alpha == 1:
        spec.channelnames = ("Y", "A")
    spec.alpha_channel = image.alpha
    if image.alpha >= 0 and not image.associated:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if suffix in QUALITY:
        spec.attribute("Compression", QUALITY[suffix])
    if image.colorspace != "data":
        spec.attribute("oiio:ColorSpace", image.colorspace)
    return spec


def _displayed(pixels: NDArray, spec: oiio.ImageSpec) -> NDArray:
    """The pixels of the display window: an EXR may store more or less than that."""
    full = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if full == (spec.x, spec.y, spec.width, spec.height) or min(full[2:]) <= 0:
        return pixels
    out = np.zeros((spec.full_height, spec.full_width, pixels.shape[2]), dtype=pixels.dtype)
    dx, dy = spec.x - spec.full_x, spec.y - spec.full_y
    x0, y0 = max(dx, 0), max(dy, 0)
    x1, y1 = min(dx + spec.width, spec.full_width), min(dy + spec.height, spec.full_height)
    if x1 > x0 and y1 > y0:
        out[y0:y1, x0:x1] = pixels[y0 - dy : y1 - dy, x0 - dx : x1 - dx]
    return out


def _upright(pixels: NDArray, spec: oiio.ImageSpec) -> NDArray:
    """The pixels as a viewer shows them: EXIF orientations 1 to 8."""
    turn = spec.get_int_attribute("Orientation", 1)
    if turn in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if turn in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if turn in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def _line(text: str) -> str:
    """The first line of a library's message."""
    return (text or "unknown reason").strip().splitlines()[0]
