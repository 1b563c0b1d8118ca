"""Pictures in files: read as stored (straight alpha, own depth), written with colour space and metadata."""

import re
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ...errors import InputError
from ...memory import Memory
from ...pixels.pyramid import strip_rows
from .. import extras, formats, limits
from ..files import as_text, open_input, opened, scratch
from ..quiet_stderr import silence
from . import icc, pillow, rasters
from .image import Image, error_of, prepare, text_of, transfer_of, usual_of
from .png import PngOutput

__all__ = ["Image", "check", "read", "transfer_of", "write", "write_bands"]

KEPT = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32}
WIDE = {"uint", "int", "uint64", "int64"}  # integers that floats cannot represent exactly
DECODERS = {
    *(
        "bmp",
        "cineon",
        "dds",
        "dpx",
        "fits",
        "gif",
        "hdr",
        "ico",
        "iff",
        "jpeg",
        "jpeg2000",
        "jpegxl",
        "openexr",
    ),
    *("png", "pnm", "psd", "rla", "sgi", "softimage", "targa", "tiff", "webp", "zfile"),
}
"""OpenImageIO's names of supported formats. Plug-ins not listed may read other files that a file refers to."""
BEGINNING_BYTES = 4096  # of a file that is not a picture, to name its kind
STRAIGHT = {"bmp", "dds", "jpeg2000", "jpegxl"}
# Brands of files in the ISO base media file format.
UNREAD = {b"avif": "AVIF", b"avis": "AVIF", b"heic": "HEIC", b"heix": "HEIC", b"mif1": "HEIF"}
ENCODERS = {"jpeg:subsampling": "4:4:4"}
# Metadata about the old file's storage rather than the picture.
FORGOTTEN: tuple[str, ...] = (
    "oiio:",
    "compression",
    "planarconfig",
    "tiff:",
    "openexr:",
    "png:",
    "jpeg:",
    "webp:",
    "ICCProfile:",
)
FORGOTTEN += ("Orientation", "textureformat", "Exif:PixelXDimension", "Exif:PixelYDimension", "thumbnail")
TIFFFILE_SHAPE = re.compile(r'\{("axes": "\w+", )?"shape": \[')
"""Begins the description by which tifffile and scikit-image state a picture's size, which older ones write second."""
KTX2_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"  # the first bytes of such a file


def read(
    path: str | Path,
    *,
    max_pixels: int = limits.READ_PIXELS,
    colorspace: str | None = None,
    room: Memory | None = None,
) -> Image:
    """Read the first picture of a file as it is stored, in upright orientation.

    Args:
        path: a file in any format that OpenImageIO reads.
        max_pixels: largest width × height that is accepted.
        colorspace: overrides the file's colour space.
        room: where to allocate the pixels.

    Raises:
        InputError: the file is missing, not a flat picture, damaged, or too large; the colour space is unknown.
    """
    several = False
    with open_input(path).open("rb") as content:
        beginning = content.read(len(formats.PNG))
        if beginning == formats.PNG:
            several = _check_png(path, content)
        elif beginning[4:] == b"ftyp" and (form := UNREAD.get(content.read(4))):
            if not colorspace:
                return _by_pillow(path, max_pixels, form)
            raise InputError(
                f"{path}: {form} is not supported with --colorspace; convert the picture first, for instance to .png "
                "or .jxl"
            )
    with silence():
        image = _read(path, max_pixels, colorspace, room or Memory(), several)
    is_tiff = formats.suffix_of(path) in formats.TIFF_SUFFIXES
    return _with_mask(image, path) if is_tiff and image.alpha < 0 else image


def _with_mask(image: Image, path: str | Path) -> Image:
    """Return a picture with the mask that GDAL wrote into its file, if any, as its alpha channel."""
    several = _several(path)
    mask = rasters.mask_of(Path(path)) if several in image.notes else None
    if mask is None or mask.shape != image.pixels.shape[:2]:
        return image
    opaque = 1 if image.pixels.dtype.kind == "f" else np.iinfo(image.pixels.dtype).max
    alpha = (mask * opaque).astype(image.pixels.dtype)[..., None]
    notes = tuple(note for note in image.notes if note != several)
    pixels = np.concatenate([np.where(mask[..., None], image.pixels, 0).astype(alpha.dtype), alpha], axis=2)
    return replace(image, pixels=pixels, alpha=pixels.shape[2] - 1, notes=notes)


def _several(path: str | Path) -> str:
    return f"{path}: contains several pictures; the first one is used"


def _by_pillow(path: str | Path, max_pixels: int, form: str) -> Image:
    """Read an AVIF or HEIC picture, for which OpenImageIO needs a library that few installations have.

    Raises:
        InputError: it is damaged, too large, or there is no decoder.
    """
    from PIL import features

    if form == "AVIF" and not features.check("avif"):
        raise InputError(
            f"{path}: AVIF is not read by this Pillow; convert it first, to .png or .jxl for instance"
        )
    if form != "AVIF":
        convert = "convert the picture first, for instance to .png or .jxl"
        pi_heif = extras.load(f"{path}: reading {form}", "pi_heif", otherwise=convert)
        pi_heif.register_heif_opener(thumbnails=False)  # with Pillow, which opens the file
    with pillow.opened(Path(path), path, ("AVIF" if form == "AVIF" else "HEIF",)) as picture:
        width, height = picture.size
        if width * height > max_pixels:
            raise InputError(
                f"{path}: {width}x{height} exceeds the limit of {max_pixels} pixels; raise --max-pixels"
            )
        several = getattr(picture, "n_frames", 1) > 1
        picture.load()
        pixels, alpha = icc.as_srgb(picture, path)
    notes = (_several(path),) if several else ()
    return Image(pixels, alpha, notes=notes)


def read_held(picture: Path | bytes, where: str, **options: Any) -> Image:
    """Read a picture from a file or the content of one; messages call it `where`; further options as for `read`."""
    if isinstance(picture, Path):
        return read(picture, **options)
    if picture.startswith(KTX2_MAGIC):
        raise InputError(
            f"{where}: KTX2 (Basis Universal) pictures cannot be read; convert it to PNG or JPEG first"
        )
    with scratch() as folder:
        path = folder / f"a{formats.suffix_of_content(picture) or '.jpg'}"
        path.write_bytes(picture)
        try:
            image = read(path, **options)
        except InputError as error:
            reason = str(error).removeprefix(f"{path}: ").replace(str(path), "the picture")
            unread = "" if reason.startswith("cannot read this picture") else "cannot read this picture: "
            raise InputError(f"{where}: {unread}{reason}") from error
    return replace(image, notes=tuple(note.replace(str(path), where) for note in image.notes))


def proportions(picture: str | Path | bytes) -> float | None:
    """Return width / height of a picture file, or of the content of one, from its header; None if it is unreadable."""
    if isinstance(picture, bytes):
        with suppress(InputError), pillow.opened(picture, "") as image:
            width, height = image.size
            return width / height
        return None
    with silence():
        try:
            file = oiio.ImageInput.open(as_text(picture)) if Path(picture).is_file() else None
        except (OSError, ValueError, InputError):
            return None
        if file is None:
            error_of(oiio)
            return None
        spec = file.spec()
        file.close()
    is_sideways = spec.get_int_attribute("Orientation", 1) > 4
    width, height = spec.full_width, spec.full_height
    width, height = (height, width) if is_sideways else (width, height)
    return width / height if height else None


def _read(path: str | Path, max_pixels: int, colorspace: str | None, room: Memory, several: bool) -> Image:
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    file = oiio.ImageInput.open(as_text(path), config)
    if file is None:
        reason = error_of(oiio)
        form = formats.of(path)
        if form.drawing and not form.mesh:
            raise InputError(
                f"{path}: is a drawing, not a picture; export it as a picture, or write -o out.svg to "
                "map the source drawing itself"
            )
        if not form.picture:
            cure = formats.remedy(path, "picture", formats.holding("picture"))
            raise InputError(f"{path}: not an image; {cure}")
        with opened(path) as content:
            beginning = content.read(BEGINNING_BYTES)
        if not beginning:
            raise InputError(f"{path}: the file is empty")
        if formats.is_svg(beginning):
            raise InputError(f"{path}: is an SVG drawing, not a picture; rename it to .svg")
        raise InputError(f"{path}: cannot read this picture: {reason}")
    try:
        if file.format_name() not in DECODERS:
            raise InputError(
                f"{path}: pictures in the format {file.format_name()!r} are not supported; "
                "convert the picture to .png or .tif"
            )
        spec = file.spec()
        for width, height in ((spec.width, spec.height), (spec.full_width, spec.full_height)):
            if width * height > max_pixels:
                raise InputError(
                    f"{path}: {width}x{height} exceeds the limit of {max_pixels} pixels; raise --max-pixels"
                )
        if spec.deep or spec.depth > 1:
            raise InputError(
                f"{path}: a {'deep picture' if spec.deep else 'volume'}, which is not supported; flatten it first"
            )
        kind = str(spec.format) if not spec.channelformats else "float"
        if not colorspace and icc.needed(spec):
            pixels: NDArray | None = icc.read(path, spec)
        else:
            pixels = _pixels(file, spec, kind if kind in KEPT else "float", room)
        if pixels is None or file.has_error:
            raise InputError(f"{path}: cannot read its pixels: {error_of(file)}")
        several = several or file.seek_subimage(1, 0)
    finally:
        file.close()
    pixels = _turn_upright(_as_displayed(pixels, spec, room), spec)
    metadata, is_complete = _metadata(spec)
    holes = _holes(pixels, room) if pixels.dtype.kind == "f" else 0
    return Image(
        pixels if pixels.flags.c_contiguous else _copy(pixels, room(pixels.shape, pixels.dtype), room),
        _alpha(spec),
        _is_associated(spec, file.format_name()),
        _checked_space(path, colorspace) if colorspace else _space(spec, pixels.dtype),
        metadata,
        _notes(path, spec, several, holes, is_complete),
        holes,
    )


def check(path: str | Path, like: Image, height: int, width: int) -> None:
    """Refuse what `write` would refuse, before pixels are computed, by writing one row of the longer side.

    Args:
        path: the file to write; only its suffix matters.
        like: has the picture's alpha, colour space, metadata, type and channels; its size is ignored.
        height, width: size of the picture.

    Raises:
        InputError: an unknown suffix, or a format that does not support the size, channels or colour space.
    """
    if formats.of(path).picture is None or formats.suffix_of(path) in formats.READ_ONLY:
        raise _unknown(path)
    raster, suffix = like.raster, formats.suffix_of(path)
    is_tiff = suffix in formats.TIFF_SUFFIXES
    if raster and not is_tiff and (raster.halves or (raster.dtype.kind == "i" and not raster.labels)):
        raise InputError(f"{path}: {suffix} cannot hold the {raster.dtype} numbers of the texture; use .tif")
    side, channels, dtype = max(height, width), like.pixels.shape[2], like.pixels.dtype
    kind = (Path(path).suffix, side, channels, dtype, like.alpha, like.associated, like.colorspace)
    if any(metadata is like.metadata and kind == checked for metadata, checked in _passed):
        return
    row = np.zeros((1, side, channels), dtype)
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / f"trial{Path(path).suffix}"
        try:
            write(trial, replace(like, pixels=row))
        except InputError as error:
            text = str(error).replace(str(trial), str(path)).replace(f"{side}x1", f"{width}x{height}")
            raise InputError(text) from error
    _passed[:] = [(like.metadata, kind)]


_passed: list[tuple[dict[str, Any], Any]] = []
"""The last picture that passed the check; in a batch, the next one is often of the same kind."""


def write(path: str | Path, image: Image) -> None:
    """Write a picture in the format of the path's suffix, converted as the format requires.

    Display formats get sRGB, EXR and HDR linear light; EXR gets associated alpha; for formats without alpha the picture
    is composited on white.

    Raises:
        InputError: the suffix is unknown or the file cannot be written.
    """
    write_bands(path, image, image.pixels.shape[0], image.pixels.shape[1], iter([image.pixels]))


def as_png(image: Image) -> bytes:
    """Return the picture as a PNG file."""
    with scratch() as folder:
        path = folder / "a.png"
        write(path, image)
        return path.read_bytes()


def as_jpeg(image: Image) -> bytes:
    """Return the picture as a JPEG file."""
    with scratch() as folder:
        path = folder / "a.jpg"
        write(path, image)
        return path.read_bytes()


def write_bands(path: str | Path, like: Image, height: int, width: int, blocks: Iterable[NDArray]) -> None:
    """Write (rows, width, c) blocks from top to bottom as `write` does, without holding the whole picture.

    Args:
        path: the file.
        like: has the blocks' alpha, colour space, metadata and type; its own pixels are ignored.
        height, width: size of the whole picture.
        blocks: consecutive rows of pixels.
    """
    if like.raster and formats.suffix_of(path) in formats.TIFF_SUFFIXES:
        rasters.write(Path(path), like, blocks, like.alpha, same_grid=False)
        return
    row, format = 0, formats.picture(path)
    with _open(path) as file:
        for block in blocks:
            ready = prepare(replace(like, pixels=block), format)
            if row == 0:
                _check_channels(path, ready, file.supports("nchannels"))
                with silence():
                    begun = file.open(str(path), _spec(ready, height, width, format.encoder))
                if not begun:
                    raise InputError(f"{path}: cannot write this picture: {error_of(file)}")
            rows = np.ascontiguousarray(ready.pixels)
            written = (
                file.write_image(rows)
                if len(rows) == height
                else file.write_scanlines(row, row + len(rows), 0, rows)
            )
            if not written:
                raise InputError(f"{path}: cannot write this picture: {error_of(file)}")
            row += len(rows)


def _check_channels(path: str | Path, image: Image, any_number: bool) -> None:
    """Refuse channels that would be read back differently: the last of 2 or 4 as alpha, 2 and alpha as colours."""
    format, colours = formats.picture(path), image.pixels.shape[2] - (image.alpha >= 0)
    if colours in (1, 3) or (any_number and (colours > 3 or format.light == "linear")):
        return
    suffix = formats.suffix_of(path)
    supported = (
        f"1{', 3 or more' if any_number else ' or 3'} channels{' beside alpha' if format.alpha else ''}"
    )
    formats_for_all = ".exr" if any_number or colours == 2 else ".exr or .tif"
    raise InputError(f"{path}: {suffix} can store {supported}, not {colours}; use {formats_for_all}")


def _unknown(path: str | Path) -> InputError:
    return InputError(f"{path}: unknown picture format {Path(path).suffix!r}; use .png, .tif or .exr")


@contextmanager
def _open(path: str | Path) -> Iterator[Any]:
    file: Any = oiio.ImageOutput.create(str(path))
    if file is None:
        error_of(oiio)
        raise _unknown(path)
    if file.format_name() == "png":
        file = PngOutput(file)
    try:
        yield file
    finally:
        closed = file.close()
    if not closed:
        raise InputError(f"{path}: cannot write this picture: {error_of(file)}")


def _pixels(file: Any, spec: oiio.ImageSpec, kind: str, room: Memory) -> NDArray | None:
    """Return the (h, w, c) pixels, read some rows at a time, since the library's function needs twice the memory."""
    c, tall = spec.nchannels, max(1, spec.tile_height)
    step = -(-strip_rows(spec.width, c) // tall) * tall
    out = room((spec.height, spec.width, c), KEPT[kind])
    for row in range(0, spec.height, step):
        top, end = spec.y + row, spec.y + min(row + step, spec.height)
        if spec.tile_width:
            rows = file.read_tiles(spec.x, spec.x + spec.width, top, end, 0, 1, 0, c, kind)
        else:
            rows = file.read_scanlines(top, end, 0, 0, c, kind)
        if rows is None:
            return None
        out[row : row + step] = np.asarray(rows).reshape(end - top, spec.width, c)
        room.release()
    return out


def _check_png(path: str | Path, content: BinaryIO) -> bool:
    """Return whether a PNG file is animated; refuse a damaged one, for which libpng would print messages.

    Args:
        path: for messages.
        content: the file, read up to its first chunk.
    """
    name, frames = b"", 1
    while name != b"IEND":
        head = content.read(8)
        remaining, name = int.from_bytes(head[:4]), head[4:]
        checksum = zlib.crc32(name)
        if name == b"acTL" and remaining >= 4 and (count := content.read(4)):
            remaining, checksum = remaining - len(count), zlib.crc32(count, checksum)
            frames = int.from_bytes(count)
        while remaining and (block := content.read(min(remaining, 1 << 20))):
            remaining, checksum = remaining - len(block), zlib.crc32(block, checksum)
        stored = content.read(4)
        if remaining or len(stored) < 4:
            raise InputError(f"{path}: the picture is damaged: the file is truncated")
        if name[:1].isupper() and stored != checksum.to_bytes(4):  # readers ignore other chunks
            label = name.decode() if name.isalnum() else repr(name)
            raise InputError(f"{path}: the picture is damaged: wrong checksum of {label}")
    return frames > 1


def _holes(pixels: NDArray, room: Memory) -> int:
    """Count the texels that are not finite in some channel."""
    count, step = 0, strip_rows(*pixels.shape[1:])
    for row in range(0, len(pixels), step):
        finite = np.isfinite(pixels[row : row + step])
        if not finite.all():
            count += int((~finite).any(axis=2).sum())
        room.release()
    return count


def losses(path: str | Path, image: Image) -> list[str]:
    """Return notes on what a picture loses in a format: range, depth, transparency, marks of no data, and colour
    profile.

    Args:
        path: the file; only its suffix matters.
        image: the picture as it was read.
    """
    format, suffix, raster = formats.picture(path), formats.suffix_of(path), image.raster
    if raster and suffix in formats.TIFF_SUFFIXES:
        return []
    notes = list[str]()
    if raster and raster.nodata is not None and image.alpha >= 0:
        notes.append(
            f"{suffix} does not mark pixels without data, which become "
            f"{'transparent' if format.alpha else 'white'}; use .tif to keep the number {raster.nodata:g}"
        )
    stored = prepare(replace(image, pixels=image.pixels[:1, :1]), format)
    notes += [note] if (note := _clipping_note(path, image)) else []
    bits, bits_left = (8 * kind.itemsize for kind in (image.pixels.dtype, stored.pixels.dtype))
    if bits_left < bits and bits_left == 8:
        notes.append(
            f"{suffix} stores 8 bits per channel, and the texture has {bits}; use .png or .tif to keep 16"
        )
    elif bits_left < bits:
        notes.append(
            f"{suffix} stores {bits_left} bits per channel, and the texture has {bits}; use .exr or .tif"
        )
    if suffix == ".hdr" and bits > 8 and not _fits_rgbe(image):
        notes.append(
            f"{suffix} stores 8 bits per channel with a common exponent; use .exr or .tif to keep {bits}"
        )
    if image.alpha >= 0 > stored.alpha and _has_transparency(image):
        notes.append(f"{suffix} has no alpha channel, so transparent parts become white; use .png or .tif")
    if "ICCProfile" in image.metadata and not format.profile:
        notes.append(f"{suffix} does not store the texture's colour profile; use .png or .tif to keep it")
    return notes


def _fits_rgbe(image: Image) -> bool:
    """Return whether colours are multiples of a 256th of the power of two above the largest of their channels."""
    channels = [channel for channel in range(image.pixels.shape[2]) if channel != image.alpha]
    for row in image.pixels:
        colours = row[:, channels].astype(float)
        scaled = np.ldexp(colours, 8 - np.frexp(colours.max(axis=1, keepdims=True))[1])
        if (scaled != np.round(scaled)).any():
            return False
    return True


def _has_transparency(image: Image) -> bool:
    """Return whether a pixel is not opaque."""
    alpha = image.pixels[..., image.alpha]
    opaque = np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1.0
    return bool((alpha < opaque).any())


def _clipping_note(path: str | Path, image: Image) -> str | None:
    """Return a note on the values that a picture loses in a file that stores only 0 to 1, or None."""
    format, pixels = formats.picture(path), image.pixels
    if format.light != "display" or pixels.dtype.kind != "f":
        return None
    count, highest, step = 0, 0.0, strip_rows(*pixels.shape[1:])
    for row in range(0, len(pixels), step):
        part = pixels[row : row + step]
        outside = ((part > 1) | (part < 0)) & np.isfinite(part)
        count += int(outside.any(axis=2).sum())
        highest = max(highest, float(part[outside].max(initial=0)))
    if not count:
        return None
    top = f", up to {highest:.3g}," if highest > 1 else ""
    return (
        f"{formats.suffix_of(path)} stores values from 0 to 1; {count / pixels[..., 0].size:.1%} of the "
        f"texels lie outside{top} and are clipped; use .exr, .hdr or .tif to keep them"
    )


def _notes(
    path: str | Path, spec: oiio.ImageSpec, several: bool, holes: int, header_is_complete: bool
) -> tuple[str, ...]:
    notes = []
    if not header_is_complete:
        notes.append(f"{path}: invalid parts of its header are ignored")
    if several:
        notes.append(_several(path))
    if WIDE.intersection(map(str, spec.channelformats or [spec.format])):
        notes.append(
            f"{path}: contains 32-bit integers; they are converted to floats between 0 and 1, exact to 24 bits"
        )
    if holes:
        notes.append(
            f"{path}: {holes} texels are not finite and are ignored by filters; use --filter nearest to keep them"
        )
    return tuple(notes)


def description(path: str | Path) -> str:
    """Return the description in a picture's metadata; empty without one, or if the file cannot be read."""
    file = oiio.ImageInput.open(as_text(path))
    if file is None:
        error_of(oiio)  # the next error is then reported alone
        return ""
    text = text_of(file.spec(), "ImageDescription")
    file.close()
    return text


def _copy(pixels: NDArray, out: NDArray, room: Memory) -> NDArray:
    """Copy pixels to `out`, some rows at a time; return `out`."""
    step = strip_rows(*pixels.shape[1:])
    for row in range(0, len(pixels), step):
        out[row : row + step] = pixels[row : row + step]
        room.release()
    return out


def _alpha(spec: oiio.ImageSpec) -> int:
    """Return the index of the alpha channel, -1 if it is the only channel; the GIF plug-in counts from 1."""
    return min(spec.alpha_channel, spec.nchannels - 1) if spec.nchannels > 1 else -1


def _is_associated(spec: oiio.ImageSpec, format: str) -> bool:
    """Return whether colours are premultiplied; some plug-ins return straight ones without an attribute."""
    straight = spec.get_int_attribute("oiio:UnassociatedAlpha") or format in STRAIGHT
    return _alpha(spec) >= 0 and not straight


def _checked_space(path: str | Path, colorspace: str) -> str:
    config = oiio.ColorConfig()
    names = [*config.getColorSpaceNames(), *config.getAliases(colorspace)]
    if colorspace != "data" and config.resolve(colorspace) not in names:
        raise InputError(
            f"{path}: unknown colour space {colorspace!r}; use sRGB, lin_rec709, data, or another name of OpenColorIO"
        )
    return colorspace


def _space(spec: oiio.ImageSpec, dtype: np.dtype) -> str:
    """Return the file's colour space; by default sRGB for integers and linear for floats."""
    stated = text_of(spec, "oiio:ColorSpace")
    return (stated and stated.isprintable() and usual_of(stated)) or (
        "lin_rec709" if dtype.kind == "f" else "sRGB"
    )


def _metadata(spec: oiio.ImageSpec) -> tuple[dict[str, Any], bool]:
    """Return the metadata of the picture itself, and whether it is complete: entries that are not UTF-8 are ignored."""
    entries: dict[str, Any] = {}
    is_complete = True
    for entry in spec.extra_attribs:
        try:
            states_size = entry.name == "ImageDescription" and TIFFFILE_SHAPE.match(str(entry.value))
            if not (entry.name.startswith(FORGOTTEN) or states_size):
                # skip values that cannot be written back
                oiio.ImageSpec().attribute(entry.name, entry.type, entry.value)
                entries[entry.name] = (entry.type, entry.value)
        except (UnicodeDecodeError, TypeError, RuntimeError):
            is_complete = False
    try:
        names = tuple(spec.channelnames)
        oiio.ImageSpec(1, 1, len(names), "float").channelnames = names
    except (UnicodeDecodeError, TypeError, RuntimeError):
        return entries, False
    return entries | {"channels": ("Y",) if names == ("A",) else names}, is_complete


def _spec(image: Image, height: int, width: int, encoder: str) -> oiio.ImageSpec:
    channels = image.pixels.shape[2]
    names = {np.dtype(dtype): name for name, dtype in KEPT.items()}
    spec = oiio.ImageSpec(width, height, channels, names[image.pixels.dtype])
    for name, value in image.metadata.items():
        if name != "channels" and (name != "ICCProfile" or _fits(value[1], channels - (image.alpha >= 0))):
            spec.attribute(name, *value)
    channel_names = image.metadata.get("channels", ())
    if len(channel_names) == channels:
        spec.channelnames = channel_names
    elif len(channel_names) == channels - 1 and image.alpha == channels - 1:
        spec.channelnames = (*channel_names, "A")
    elif image.alpha < 0 and channels > 3:  # otherwise the fourth would be named alpha
        spec.channelnames = tuple(f"channel{k}" for k in range(channels))
    elif channels == 2 and image.alpha == 1:
        spec.channelnames = ("Y", "A")
    spec.alpha_channel = image.alpha
    if image.alpha >= 0 and not image.associated:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if encoder:
        spec.attribute("Compression", encoder)
    for name, value in ENCODERS.items():
        spec.attribute(name, value)
    if "DateTime" not in image.metadata:
        spec.attribute("DateTime", "")  # EXR would store the time, and the same job would give other bytes
    if image.colorspace != "data":
        spec.attribute("oiio:ColorSpace", image.colorspace)
    return spec


def _fits(profile: Any, colours: int) -> bool:
    """Return whether an ICC profile is for this number of colours; that of a CMYK file is not, after conversion."""
    header = bytes(np.asarray(profile, np.uint8)[:40])
    return header[36:] == b"acsp" and header[16:20] == {1: b"GRAY", 3: b"RGB "}.get(colours)


def _as_displayed(pixels: NDArray, spec: oiio.ImageSpec, room: Memory) -> NDArray:
    """Return the pixels of the display window; an EXR may store more or fewer."""
    full = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if full == (spec.x, spec.y, spec.width, spec.height) or min(full[2:]) <= 0:
        return pixels
    shape = (spec.full_height, spec.full_width, pixels.shape[2])
    out = _copy(np.broadcast_to(pixels.dtype.type(0), shape), room(shape, pixels.dtype), room)
    dx, dy = spec.x - spec.full_x, spec.y - spec.full_y
    x0, y0 = max(dx, 0), max(dy, 0)
    x1, y1 = min(dx + spec.width, spec.full_width), min(dy + spec.height, spec.full_height)
    if x1 > x0 and y1 > y0:
        _copy(pixels[y0 - dy : y1 - dy, x0 - dx : x1 - dx], out[y0:y1, x0:x1], room)
    return out


def _turn_upright(pixels: NDArray, spec: oiio.ImageSpec) -> NDArray:
    """Return the pixels in upright orientation, for EXIF orientations 1 to 8."""
    turn = spec.get_int_attribute("Orientation", 1)
    if turn in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if turn in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if turn in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels
