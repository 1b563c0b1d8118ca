"""Georeferenced pictures: GeoTIFF by rasterio, which is an extra, and world files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ...errors import InputError, naming
from ...saved.georeference import Affine, Georeference
from .. import extras, files, formats, limits
from ..isolated import process, readers

GEOTIFF_TAGS = 33550, 33922, 34264, 34735
"""Of TIFF: pixel scale, tie points, transformation, and the directory of keys."""

AUTHORITY_CODE = re.compile(r"[A-Za-z]{2,9}:\w{1,16}(\+\w{1,16})?")  # such as EPSG:32633
NAMES_FILES = re.compile(r"""(?i)grids["',=\s]+(?!@null\b)|PARAMETERFILE|\b(?:init|file)\s*=""")
"""Parts of a description of a coordinate reference system in which PROJ reads other files."""


def read(path: Path) -> tuple[Georeference | None, str]:
    """Return where a picture lies on a map, and a note if it could not be read; None if it says nothing about it.

    The file's coordinates are pixels, y down, from the upper left corner.
    """
    if formats.suffix_of(path) in formats.TIFF_SUFFIXES and has_geotiff_tags(path):
        try:
            place = _of_geotiff(path, f"{path}: reading where it lies on a map")
        except InputError as error:
            return None, str(error)
        if place["transform"] is not None:
            a, b, c, d, e, f = place["transform"]
            if (
                not all(abs(number) < limits.MAP_COORDINATE for number in place["transform"])
                or a * e == b * d
            ):
                return None, f"{path}: its place on a map is ignored, because it does not place the picture"
            return Georeference((a, b, c, d, e, f), _text_of_wkt(place["crs"])), ""
    for name in world_files(path):
        if name.is_file():
            return _of_world_file(name, path)
    return None, ""


def gcps(path: Path) -> tuple[list[tuple[float, float]], list[tuple[float, float]], str]:
    """Return the ground control points of a GeoTIFF: pixels (x, y, from the upper left corner), places on the map, and
    its coordinate reference system.

    Raises:
        InputError: rasterio is missing, or the file has none.
    """
    try:
        place = _of_geotiff(path, "reading ground control points")
    except InputError as error:
        raise InputError(str(error).removeprefix(f"{path}: ")) from None
    if not place["pixels"]:
        raise InputError("has no ground control points; QGIS and gdal_translate -gcp write them")
    pixels, places = ([(x, y) for x, y in place[key]] for key in ("pixels", "places"))
    return pixels, places, _text_of_wkt(place["points_crs"])


def _of_geotiff(path: Path, purpose: str) -> dict[str, Any]:
    """Return where a GeoTIFF lies on a map, see `readers.geotiff`.

    Raises:
        InputError: rasterio is missing, or the file cannot be read.
    """
    extras.require(purpose, "rasterio")
    return process.read(path, readers.geotiff)


def _text_of_wkt(wkt: str) -> str:
    """Return a coordinate reference system as text on one line; empty if there is none, or if it refers to files."""
    if not wkt:
        return ""
    module = rasterio("reading a coordinate reference system")
    try:
        return _text(module, reference_system(module, wkt))
    except InputError:
        return ""


def write(path: Path, transform: Affine, crs: str) -> None:
    """Add a transform and a coordinate reference system to a TIFF.

    Raises:
        InputError: rasterio is missing, or does not know the system.
    """
    module = rasterio("writing where the picture lies on a map")
    with _opened(module, path, "r+") as file:
        file.transform = module.Affine(*transform)
        if crs:
            file.crs = reference_system(module, crs)


def world_file_text(transform: Affine) -> str:
    """Return the content of a world file. It gives the centre of the first pixel."""
    a, b, c, d, e, f = transform
    numbers = a, d, b, e, c + (a + b) / 2, f + (d + e) / 2
    return "".join(f"{number:.17g}\n" for number in numbers)


def projection_text(crs: str) -> str:
    """Return the content of a .prj file.

    Raises:
        InputError: rasterio is missing, or does not know the system, or it has no description of this kind.
    """
    module = rasterio("writing a coordinate reference system")
    system = reference_system(module, crs)
    try:
        return str(system.to_wkt(version="WKT1_ESRI")) + "\n"
    except (module.errors.RasterioError, module.errors.CRSError):
        raise InputError(f"the coordinate reference system {crs[:60]!r} cannot be written as .prj") from None


def world_files(picture: Path) -> list[Path]:
    """Return the names that a picture's world file may have, the usual one first: .pgw for .png."""
    suffix = picture.suffix
    short = f".{suffix[1:2]}{suffix[-1:]}w" if len(suffix) > 3 else f"{suffix}w"
    return [picture.with_suffix(ending) for ending in (short, f"{suffix}w", ".wld")]


def has_geotiff_tags(path: Path) -> bool:
    """Return whether a TIFF has the tags of a GeoTIFF; False for any other file."""
    import tifffile

    with suppress(Exception), tifffile.TiffFile(path) as file:  # damaged files have errors of many kinds
        tags = file.pages.first.tags
        return any(tag in tags for tag in GEOTIFF_TAGS)
    return False


def rasterio(purpose: str) -> Any:
    """Return the module rasterio. `purpose` is what needs it, with which the message begins.

    Raises:
        InputError: it is not installed.
    """
    return extras.load(purpose, "rasterio", "crs", "errors")


@contextmanager
def _opened(module: Any, path: Path, mode: str = "r") -> Iterator[Any]:
    """Open a TIFF by rasterio, without files beside it, and without warnings of pictures that are not georeferenced."""
    with (
        warnings.catch_warnings(),
        module.Env(GDAL_DISABLE_READDIR_ON_OPEN="EMPTY_DIR", GDAL_PAM_ENABLED="NO"),
    ):
        warnings.simplefilter("ignore", module.errors.NotGeoreferencedWarning)
        with module.open(path, mode, driver="GTiff") as file:
            yield file


def reference_system(module: Any, text: str) -> Any:
    """Return the coordinate reference system (rasterio's CRS) that a text describes.

    The text can be a code (EPSG:4326), a string of PROJ (+proj=utm +zone=33) or WKT. GDAL also takes the addresses and
    names of files that contain one; those are refused, because the text may be a stranger's.

    Raises:
        InputError: rasterio does not know it, or it refers to files.
    """
    text = text.strip()
    shown = " ".join(text.split())[:60]
    if NAMES_FILES.search(text):
        raise InputError(
            f"the coordinate reference system {shown!r} refers to other files, which are not read"
        )
    kind = module.crs.CRS
    is_known_form = AUTHORITY_CODE.fullmatch(text) or text.startswith("+proj=")
    try:
        with module.Env():  # which keeps GDAL from writing to stderr
            return kind.from_string(text) if is_known_form else kind.from_wkt(text)
    except (module.errors.RasterioError, ValueError):
        raise InputError(
            f"{shown!r} is not a known coordinate reference system; use WKT, a code such as EPSG:4326, or a string of "
            "PROJ"
        ) from None


def _text(module: Any, crs: Any) -> str:
    """Return a coordinate reference system as text on one line; empty if there is none, or if it refers to files."""
    if not crs:
        return ""
    try:
        with module.Env():
            text = " ".join(crs.to_wkt().split())
            code = None if NAMES_FILES.search(text) else crs.to_epsg()
    except (module.errors.RasterioError, module.errors.CRSError):
        return ""
    return f"EPSG:{code}" if code else "" if NAMES_FILES.search(text) else text


def _of_world_file(path: Path, picture: Path) -> tuple[Georeference | None, str]:
    try:
        numbers = [
            float(word) for word in files.read_bytes(path, max_bytes=limits.WORLD_FILE_BYTES).decode().split()
        ]
        a, d, b, e, x, y = numbers
    except (InputError, ValueError):
        return None, f"{path}: ignored, because it is not a world file of six numbers"
    if not all(abs(number) < limits.MAP_COORDINATE for number in numbers) or a * e == b * d:
        return None, f"{path}: ignored, because it does not place the picture"
    crs, note, projection = "", "", picture.with_suffix(".prj")
    if projection.is_file():
        try:
            crs = _of_projection_file(projection)
        except InputError as error:  # the transform holds without it
            note = str(error)
    return Georeference((a, b, x - (a + b) / 2, d, e, y - (d + e) / 2), crs), note


def _of_projection_file(path: Path) -> str:
    """Return the coordinate reference system in a .prj file.

    Raises:
        InputError: rasterio is missing, or does not know the system, or the file is not text.
    """
    module, data = rasterio(f"{path}: reading it"), files.read_bytes(path, max_bytes=limits.PROJECTION_BYTES)
    with naming(f"{path}: ignored"):
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            raise InputError("it is not text") from None
        return _text(module, reference_system(module, text))
