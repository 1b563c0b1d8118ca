"""Georeferenced pictures: GeoTIFF by rasterio, which is an extra, and world files."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...saved.georeference import Affine, Georeference
from .. import extras, files, formats
from . import pillow

TIFF_SUFFIXES = (".tif", ".tiff")
GEOTIFF_TAGS = 33550, 33922, 34264, 34735
"""Of TIFF: pixel scale, tie points, transformation, and the directory of keys."""
MOST_WORLD_FILE_BYTES = 4096  # a world file has six numbers
MOST_PROJECTION_BYTES = 1 << 16  # of a description of a coordinate reference system (.prj)


def read(path: Path) -> tuple[Georeference | None, str]:
    """Return where a picture lies on a map, and a note if it could not be read; None if it says nothing about it.

    The file's coordinates are pixels, y down, from the upper left corner.
    """
    if formats.suffix_of(path) in TIFF_SUFFIXES and has_geotiff_tags(path):
        try:
            module = rasterio(f"{path}: reading where it lies on a map")
        except InputError as error:
            return None, str(error)
        with suppress(module.errors.RasterioError), _opened(module, path) as file:
            if not file.transform.is_identity:
                a, b, c, d, e, f = tuple(file.transform)[:6]
                return Georeference((a, b, c, d, e, f), _text(file.crs)), ""
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
    module = rasterio("reading ground control points")
    try:
        with _opened(module, path) as file:
            points, crs = file.gcps
    except module.errors.RasterioError:
        raise InputError("cannot be read as a GeoTIFF") from None
    if not points:
        raise InputError("has no ground control points; QGIS and gdal_translate -gcp write them")
    pixels = [(float(point.col), float(point.row)) for point in points]
    return pixels, [(float(point.x), float(point.y)) for point in points], _text(crs)


def write(path: Path, transform: Affine, crs: str) -> None:
    """Add a transform and a coordinate reference system to a TIFF.

    Raises:
        InputError: rasterio is missing.
    """
    module = rasterio("writing where the picture lies on a map")
    with _opened(module, path, "r+") as file:
        file.transform = module.Affine(*transform)
        if crs:
            file.crs = module.crs.CRS.from_string(crs)


def world_file_text(transform: Affine) -> str:
    """Return the content of a world file. It gives the centre of the first pixel."""
    a, b, c, d, e, f = transform
    numbers = a, d, b, e, c + (a + b) / 2, f + (d + e) / 2
    return "".join(f"{number:.17g}\n" for number in numbers)


def projection_text(crs: str) -> str:
    """Return the content of a .prj file.

    Raises:
        InputError: rasterio is missing.
    """
    module = rasterio("writing a coordinate reference system")
    return str(module.crs.CRS.from_string(crs).to_wkt(version="WKT1_ESRI")) + "\n"


def world_files(picture: Path) -> list[Path]:
    """Return the names that a picture's world file may have, the usual one first: .pgw for .png."""
    suffix = picture.suffix
    short = f".{suffix[1:2]}{suffix[-1:]}w" if len(suffix) > 3 else f"{suffix}w"
    return [picture.with_suffix(ending) for ending in (short, f"{suffix}w", ".wld")]


def has_geotiff_tags(path: Path) -> bool:
    """Return whether a TIFF has the tags of a GeoTIFF; False for any other file."""
    with suppress(InputError), pillow.opened(path, path, ("TIFF",)) as picture:
        tags = picture.tag_v2  # type: ignore[attr-defined]
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


def _text(crs: Any) -> str:
    """Return a coordinate reference system as text on one line."""
    if not crs:
        return ""
    code = crs.to_epsg()
    return f"EPSG:{code}" if code else " ".join(crs.to_wkt().split())


def _of_world_file(path: Path, picture: Path) -> tuple[Georeference | None, str]:
    try:
        numbers = [
            float(word) for word in files.read_bytes(path, max_bytes=MOST_WORLD_FILE_BYTES).decode().split()
        ]
        a, d, b, e, x, y = numbers
    except (InputError, ValueError):
        return None, f"{path}: ignored, because it is not a world file of six numbers"
    if not all(abs(number) < 1e15 for number in numbers) or a * e == b * d:
        return None, f"{path}: ignored, because it does not place the picture"
    crs, projection = "", picture.with_suffix(".prj")
    if projection.is_file():
        with suppress(InputError, UnicodeDecodeError):  # the transform holds without it
            crs = _of_projection_file(projection)
    return Georeference((a, b, x - (a + b) / 2, d, e, y - (d + e) / 2), crs), ""


def _of_projection_file(path: Path) -> str:
    """Return the coordinate reference system in a .prj file.

    Raises:
        InputError: rasterio is missing, or does not know the system.
        UnicodeDecodeError: the file is not text.
    """
    module = rasterio(f"{path}: reading it")
    text = files.read_bytes(path, max_bytes=MOST_PROJECTION_BYTES).decode()
    try:
        return _text(module.crs.CRS.from_wkt(text))
    except module.errors.RasterioError:
        raise InputError(f"{path}: cannot be read as a coordinate reference system") from None
