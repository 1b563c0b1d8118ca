"""Pictures of numbers instead of colours: rasters of maps, label pictures, and the channels of microscopes.

These keep what their programs mean: values that stand for no data, integers of any size, numbers of regions, all pages,
names of bands, and palettes. tifffile reads and writes their tags, OpenImageIO decodes their pixels.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, SubElement, tostring

import numpy as np
import OpenImageIO as oiio
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring
from numpy.typing import NDArray

from ...errors import InputError
from .. import formats, limits
from ..files import as_text, open_input
from ..quiet_stderr import silence
from .image import Image, error_of
from .raster import HALF, INTEGERS, Raster

NODATA_TAG, METADATA_TAG = 42113, 42112
"""Of GDAL: the value that stands for no data, and XML with names of bands."""
ROLES_OF_BANDS = ("description", "unittype", "scale", "offset")
"""Of GDAL's metadata: without scale and offset, the numbers would mean something else."""
TRANSPARENCY_MASK = 4  # of the tag NewSubfileType
MOST_PAGES_BEFORE_MASK = 16  # GDAL writes it right after the picture
SHOWN_BY_IMAGEJ = ("Labels", "Ranges", "LUTs")  # of its metadata: what does not depend on places
PALETTE = 3  # of the tag PhotometricInterpretation
EXACT_IN_SINGLE = 1 << 24  # whole numbers up to this one are exact in single precision
FEW_VALUES = 64
"""In a picture of 8 bits: labels are fewer than this. Its largest value is then as small, or it is a TIFF."""
FLAT_SHARE = 0.5
"""Share of a label's pixels that have the same value as their right and lower neighbours, at least of most labels."""
SMOOTH_STEP = 2
"""Values of neighbours that differ by at most this are those of heights rather than labels."""


def read(name: str | Path, *, max_pixels: int = limits.READ_PIXELS, nearest: bool = True) -> Image | None:
    """Read a picture of numbers; None for other pictures, which `image_files.read` reads.

    Args:
        name: the file.
        max_pixels: largest width × height × pages.
        nearest: whether numbers may be sampled without mixing them, so that labels stay what they are.

    Raises:
        InputError: it is too large, or damaged.
    """
    path = open_input(name)
    suffix = formats.suffix_of(path)
    if suffix in formats.TIFF_SUFFIXES:
        return _read_tiff(path, str(name), max_pixels, nearest)
    return _labels_of_png(path, str(name), max_pixels) if suffix == ".png" and nearest else None


def is_label(values: NDArray, *, of_file: bool) -> bool:
    """Return whether integers (h, w) number regions: nearly every value fills areas, and borders are steps.

    Args:
        values: the picture.
        of_file: whether the format is one for numbers, such as TIFF; else the values must be small, such as 0 to 20.
    """
    if values.dtype.kind not in INTEGERS or min(values.shape) < 3:
        return False
    distinct, place = np.unique(values, return_inverse=True)
    if distinct.size < 2:
        return False
    if values.dtype.itemsize == 1 and (
        distinct.size > FEW_VALUES or not (of_file or distinct[-1] <= FEW_VALUES)
    ):
        return False
    place = place.reshape(values.shape)
    across, down = values[:, 1:] == values[:, :-1], values[1:] == values[:-1]
    flat = across[:-1] & down[:, :-1]
    areas = np.bincount(place[:-1, :-1].ravel(), minlength=distinct.size)
    shares = np.bincount(place[:-1, :-1].ravel(), flat.ravel(), minlength=distinct.size) / np.maximum(
        areas, 1
    )
    if (shares[areas > 0] >= FLAT_SHARE).mean() < 0.9:
        return False
    if distinct.size <= FEW_VALUES:
        return True
    steps = np.abs(np.diff(values.astype(np.int64), axis=1))[~across]
    return bool((steps > SMOOTH_STEP).mean() > FLAT_SHARE)


def write(path: Path, image: Image, blocks: Iterable[NDArray], alpha: int, *, same_grid: bool) -> None:
    """Write a picture of numbers as a TIFF with its tags.

    Args:
        path: the file.
        image: has the tags.
        blocks: consecutive rows of sampled pixels.
        alpha: index of their alpha channel.
        same_grid: whether pixels have the size of those of the original, so that its calibration is still true.
    """
    import tifffile

    raster = image.raster
    assert raster is not None
    values = np.concatenate([raster.restore(block, alpha) for block in blocks])
    extra = _gdal_tags(raster) if raster.nodata is not None or raster.bands else []
    description = _description(raster, values.shape, same_grid=same_grid)
    options: dict[str, Any] = {"metadata": None, "extratags": extra, "software": "iccm"}
    with tifffile.TiffWriter(path) as file:
        if raster.pages > 1 or raster.description:  # uncompressed, as ImageJ reads them
            if raster.resolution and same_grid:
                options |= {"resolution": raster.resolution, "resolutionunit": "NONE"}
            first: dict[str, Any] = {"description": description.encode()} if description else {}
            if raster.shown:
                first["extratags"] = [
                    *extra,
                    *tifffile.imagej_metadata_tag(dict(raster.shown), file.tiff.byteorder),
                ]
            for page in range(values.shape[2]):
                file.write(values[..., page], photometric="minisblack", contiguous=False, **(options | first))
                first = {}
            return
        if raster.colormap is not None and values.dtype.kind == "u" and values.dtype.itemsize <= 2:
            options |= {"photometric": "palette", "colormap": raster.colormap}
        else:
            is_rgb = values.shape[2] == 3 and values.dtype in (np.uint8, np.uint16)
            options |= {"photometric": "rgb" if is_rgb else "minisblack"}
        pixels = values[..., 0] if values.shape[2] == 1 else values
        more: dict[str, Any] = {"planarconfig": "contig"} if values.shape[2] > 1 else {}
        file.write(pixels, compression="zlib", **more, **options)


def _read_tiff(path: Path, name: str, max_pixels: int, nearest: bool) -> Image | None:
    tags = _tags(path)
    if tags is None:
        return None
    tiff, first = tags
    stored, mask = first["dtype"], first["mask"]
    tiff = _with_possible_nodata(tiff, stored)
    masked_floats = mask is not None and stored.kind == "f"  # GDAL ignores alpha channels of floats
    is_stated = tiff.nodata is not None or tiff.description or tiff.bands or masked_floats
    may_be_labels = nearest and first["channels"] == 1
    if _is_usual(stored) and stored.kind != "f" and not is_stated and not may_be_labels:
        return None  # `image_files.read` makes the mask an alpha channel
    values: NDArray | None
    if stored.kind in "iuc" and stored.itemsize >= 8:
        values = _narrowed(path, name, stored, max_pixels)
    else:
        values = _values(path, name, tiff, max_pixels)
    if values is None:
        return None
    dtype = values.dtype
    tiff = _with_possible_nodata(tiff, dtype)
    if dtype.kind == "f" and tiff.nodata is None and np.isnan(values).any():
        tiff, is_stated = replace(tiff, nodata=float("nan")), True
    if first.get("palette"):
        if tiff.colormap is None or not nearest or not is_label(values[..., 0], of_file=True):
            return None
        tiff = replace(tiff, labels=True)
    elif values.shape[2] == 1 and nearest and is_label(values[..., 0], of_file=True):
        tiff = replace(tiff, labels=True, colormap=None)
    if _is_usual(dtype) and not is_stated and not tiff.labels:
        return None
    if mask is not None and tiff.nodata is None and not tiff.labels:
        tiff = replace(tiff, nodata=float(np.iinfo(dtype).min) if dtype.kind in INTEGERS else float("nan"))
    return _image(values, replace(tiff, dtype=dtype), name, nearest, mask)


def _is_usual(dtype: np.dtype) -> bool:
    """Return whether pictures of colours have such numbers, too."""
    return (dtype.kind == "u" and dtype.itemsize <= 2) or dtype in (np.float16, np.float32)


def _image(values: NDArray, raster: Raster, name: str, nearest: bool, mask: NDArray | None = None) -> Image:
    """Return numbers as pixels that can be sampled: integers of 16 bits, or floats, with alpha where there are data."""
    notes = list[str]()
    if raster.labels:
        count = np.unique(values).size
        notes.append(
            f"{name}: a picture of {count} labels; nearest neighbours keep them (--filter chooses another filter)"
        )
    if raster.pages > 1:
        notes.append(f"{name}: all {raster.pages} channels are mapped")
    valid: NDArray | None = None
    if raster.nodata is not None and not raster.labels:
        missing = np.isnan(values) if np.isnan(raster.nodata) else values == raster.dtype.type(raster.nodata)
        valid = ~missing.all(axis=2)
        # a band that lacks data where others have some would be mixed with its neighbours otherwise
        if missing.any() and (missing.any(axis=2) != missing.all(axis=2)).any():
            notes.append(f"{name}: pixels without data in some bands count as without data in all of them")
            valid = ~missing.any(axis=2)
        valid = valid if mask is None else valid & mask
    pixels, halves = _sampled_type(values, raster, name, nearest, notes)
    alpha = -1
    if valid is not None:
        top = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
        full = np.where(valid[..., None], pixels.dtype.type(top), pixels.dtype.type(0))
        pixels = np.concatenate([np.where(valid[..., None], pixels, 0).astype(pixels.dtype), full], axis=2)
        alpha = pixels.shape[2] - 1
    return Image(
        np.ascontiguousarray(pixels),
        alpha,
        colorspace="data",
        notes=tuple(notes),
        raster=replace(raster, halves=halves),
    )


def _sampled_type(
    values: NDArray, raster: Raster, name: str, nearest: bool, notes: list[str]
) -> tuple[NDArray, bool]:
    """Return numbers in a type that can be sampled, and whether each was split into halves of 16 bits."""
    dtype = values.dtype
    if dtype in (np.uint8, np.uint16, np.float16, np.float32):
        return values, False
    if dtype.kind in INTEGERS and raster.labels:
        if values.min() >= 0 and values.max() < HALF:
            return values.astype(np.uint16), False
        if dtype.itemsize == 4:
            bits = np.ascontiguousarray(values).view(np.uint32)
            halves = np.stack([bits % HALF, bits // HALF], axis=3).astype(np.uint16)
            return halves.reshape(*values.shape[:2], 2 * values.shape[2]), True
    most = float(np.abs(values[np.isfinite(values)].astype(float)).max(initial=0))
    if dtype == np.float64 or most > EXACT_IN_SINGLE:
        notes.append(f"{name}: numbers are computed in single precision (24 bits)")
    return values.astype(np.float32), False


def _tags(path: Path) -> tuple[Raster, dict[str, Any]] | None:
    """Return the tags of the first page, without its type; None if the file cannot be read."""
    import tifffile

    with suppress(Exception), tifffile.TiffFile(path) as file:  # damaged files have errors of many kinds
        page = file.pages.first
        description = str(page.description or "")[: limits.TIFF_DESCRIPTION_BYTES]
        several = (file.is_imagej or file.is_ome) and len(file.pages) > 1 and page.samplesperpixel == 1
        colormap = page.colormap if page.photometric == PALETTE else None
        text = page.tags.valueof(NODATA_TAG)
        raster = Raster(
            np.dtype(np.uint8),
            _number(text),
            pages=len(file.pages) if several else 1,
            description=description if (file.is_imagej or file.is_ome) and page.samplesperpixel == 1 else "",
            shown={key: v for key, v in (file.imagej_metadata or {}).items() if key in SHOWN_BY_IMAGEJ},
            resolution=_resolution(page) if file.is_imagej else None,
            bands=_about_bands(page.tags.valueof(METADATA_TAG), page.samplesperpixel),
            colormap=None if colormap is None else np.asarray(colormap),
        )
        about = {
            "palette": page.photometric == PALETTE,
            "channels": page.samplesperpixel,
            "dtype": np.dtype(page.dtype),
            "mask": _mask(file),
        }
        return raster, about
    return None


def _resolution(page: Any) -> tuple[Any, Any] | None:
    """Return the numbers of pixels per unit in x and y, as fractions; None if they are not stated."""
    stated = [page.tags.valueof(name) for name in ("XResolution", "YResolution")]
    return (stated[0], stated[1]) if all(stated) else None


def mask_of(path: Path) -> NDArray | None:
    """Return where a TIFF has data (h, w), if GDAL wrote a mask into it."""
    tags = _tags(path)
    return None if tags is None else tags[1]["mask"]


def _mask(file: Any) -> NDArray | None:
    """Return the mask of the first page of an open TIFF (h, w)."""
    first = file.pages.first
    for number in range(1, min(len(file.pages), MOST_PAGES_BEFORE_MASK)):
        page = file.pages[number]
        if page.subfiletype == TRANSPARENCY_MASK and page.shape[:2] == first.shape[:2]:
            return np.asarray(page.asarray()).reshape(page.shape[:2]) > 0
    return None


def _narrowed(path: Path, name: str, dtype: np.dtype, max_pixels: int) -> NDArray:
    """Return integers of 64 bits as integers of 32.

    Raises:
        InputError: they are too large for that, complex, or too many.
    """
    convert = "convert it (gdal_translate -ot Float64)"
    if dtype.kind == "c":
        raise InputError(f"{name}: contains complex numbers; {convert}")
    values = _indices(path)
    if values is None or values.ndim not in (2, 3):
        raise InputError(f"{name}: cannot read its integers of 64 bits; {convert}")
    if values.shape[0] * values.shape[1] > max_pixels:
        raise InputError(f"{name}: exceeds the limit of {max_pixels} pixels; raise --max-pixels")
    for narrow in (np.int32, np.uint32):
        if np.iinfo(narrow).min <= values.min() and values.max() <= np.iinfo(narrow).max:
            return values.reshape(*values.shape[:2], -1).astype(narrow)
    raise InputError(f"{name}: contains integers that need 64 bits; {convert}")


def _number(text: Any) -> float | None:
    with suppress(TypeError, ValueError):
        return float(str(text).strip("\0 ")) if text is not None else None
    return None


def _with_possible_nodata(raster: Raster, dtype: np.dtype) -> Raster:
    """Return a raster without a value for no data that numbers of its type cannot have."""
    value = raster.nodata
    if value is None or dtype.kind not in INTEGERS:
        return raster
    is_possible = value.is_integer() and np.iinfo(dtype).min <= value <= np.iinfo(dtype).max
    return raster if is_possible else replace(raster, nodata=None)


def _about_bands(xml: Any, count: int) -> tuple[tuple[int, str, str, str], ...]:
    """Return what GDAL's metadata state about bands that stays true in another place."""
    about = list[tuple[int, str, str, str]]()
    with suppress(ParseError, DefusedXmlException, ValueError, TypeError):
        for item in fromstring(str(xml or "<GDALMetadata/>").strip("\0")).iter("Item"):
            band, role = int(item.get("sample", -1)), item.get("role", "")
            if role in ROLES_OF_BANDS and 0 <= band < count:
                about.append((band, item.get("name", ""), role, item.text or ""))
    return tuple(about)


def _gdal_tags(raster: Raster) -> list[tuple[Any, ...]]:
    """Return GDAL's tags: statistics of the original are left out, since they are no longer true."""
    tags = list[tuple[Any, ...]]()
    if raster.bands:
        top = Element("GDALMetadata")
        for band, name, role, text in raster.bands:
            SubElement(top, "Item", {"name": name, "sample": str(band), "role": role}).text = text
        tags.append((METADATA_TAG, "s", 0, tostring(top).decode(), True))
    if raster.nodata is not None:
        value = raster.nodata
        whole = np.isfinite(value) and value == int(value)
        tags.append((NODATA_TAG, "s", 0, str(int(value)) if whole else repr(value), True))
    return tags


def _values(path: Path, name: str, tiff: Raster, max_pixels: int) -> NDArray | None:
    """Return the numbers (h, w, bands) of all pages as stored; None if pages differ or have alpha."""
    bands = list[NDArray]()
    with silence():
        file = oiio.ImageInput.open(as_text(path))
        if file is None:
            oiio.geterror()
            return None
        try:
            for page in range(tiff.pages):
                if page and not file.seek_subimage(page, 0):
                    return None
                spec = file.spec()
                if page == 0:
                    first = (spec.width, spec.height, spec.nchannels, str(spec.format))
                    if spec.width * spec.height * tiff.pages > max_pixels:
                        raise InputError(
                            f"{name}: {spec.width}x{spec.height} in {tiff.pages} pages exceeds the limit of "
                            f"{max_pixels} pixels; raise --max-pixels"
                        )
                same = (spec.width, spec.height, spec.nchannels, str(spec.format)) == first
                if (
                    not same
                    or spec.deep
                    or spec.depth > 1
                    or (spec.alpha_channel >= 0 and tiff.nodata is None)
                ):
                    return None
                if spec.get_int_attribute("Orientation", 1) != 1:
                    return None
                pixels = _indices(path) if tiff.colormap is not None else file.read_image(spec.format)
                if pixels is None or file.has_error:
                    raise InputError(f"{name}: cannot read its pixels: {error_of(file)}")
                bands.append(np.asarray(pixels).reshape(spec.height, spec.width, -1))
        finally:
            file.close()
    return np.concatenate(bands, axis=2)


def _indices(path: Path) -> NDArray | None:
    """Return the numbers of the colours of a palette, which OpenImageIO replaces by the colours."""
    import tifffile

    with suppress(Exception):  # compressed in a way that tifffile does not know
        return np.asarray(tifffile.imread(path, key=0))
    return None


def _description(raster: Raster, shape: tuple[int, ...], *, same_grid: bool) -> str:
    """Return the description of ImageJ or OME for a picture of another size; its calibration only if still true."""
    text, (height, width) = raster.description, shape[:2]
    if text.startswith("ImageJ="):
        if same_grid:
            return text
        gone = ("unit=", "yunit=", "zunit=", "spacing=", "xorigin=", "yorigin=")
        return "\n".join(line for line in text.split("\n") if not line.startswith(gone))
    for key, value in (("SizeX", width), ("SizeY", height)):
        text = re.sub(rf'\b{key}="\d+"', f'{key}="{value}"', text)
    if not same_grid:
        text = re.sub(r'\s(?:PhysicalSize[XY](?:Unit)?)="[^"]*"', "", text)
    return text


def _labels_of_png(path: Path, name: str, max_pixels: int) -> Image | None:
    """Return a grey PNG of labels: a few small numbers, or numbers of 16 bits in areas."""
    with silence():
        file = oiio.ImageInput.open(as_text(path))
        if file is None:
            oiio.geterror()
            return None
        spec = file.spec()
        fits = spec.nchannels == 1 and str(spec.format) in ("uint8", "uint16")
        fits = fits and spec.width * spec.height <= max_pixels
        pixels = file.read_image(spec.format) if fits else None
        file.close()
    if pixels is None:
        return None
    values = np.asarray(pixels).reshape(spec.height, spec.width, 1)
    if not is_label(values[..., 0], of_file=False):
        return None
    return _image(values, Raster(values.dtype, labels=True), name, True)
