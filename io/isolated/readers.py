"""Readers of files for the separate process: a function for each library, which is imported in it."""

import sys
from typing import Any

import numpy as np

from iccm.io.isolated.program import Damaged


def itk(path: str, reader: str) -> dict[str, Any]:
    """Return `pixels` of a picture or field of ITK, and its `size`, `origin`, `spacing` and `direction`."""
    import SimpleITK

    SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)
    SimpleITK.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    file = SimpleITK.ImageFileReader()
    file.SetImageIO(reader)
    file.SetFileName(path)
    try:
        image = file.Execute()
        pixels = SimpleITK.GetArrayFromImage(image)
    except RuntimeError:
        raise Damaged("cannot be read as a picture or field of ITK") from None
    place = {
        name: list(getattr(image, f"Get{name.title()}")())
        for name in ("size", "origin", "spacing", "direction")
    }
    return {"pixels": pixels, "components": image.GetNumberOfComponentsPerPixel(), **place}


def geotiff(path: str) -> dict[str, Any]:
    """Return where a GeoTIFF lies: its `transform`, `crs` as WKT, and `pixels` and `places` of control points."""
    import warnings

    import rasterio
    from rasterio.errors import CRSError, NotGeoreferencedWarning, RasterioError

    warnings.simplefilter("ignore", NotGeoreferencedWarning)
    try:
        with (
            rasterio.Env(GDAL_DISABLE_READDIR_ON_OPEN="EMPTY_DIR", GDAL_PAM_ENABLED="NO"),
            rasterio.open(path, driver="GTiff") as file,
        ):
            points, points_crs = file.gcps
            return {
                "transform": None
                if file.transform.is_identity
                else [float(x) for x in tuple(file.transform)[:6]],
                "crs": file.crs.to_wkt() if file.crs else "",
                "pixels": [[float(point.col), float(point.row)] for point in points],
                "places": [[float(point.x), float(point.y)] for point in points],
                "points_crs": points_crs.to_wkt() if points_crs else "",
            }
    except (RasterioError, CRSError):
        raise Damaged("cannot be read as a GeoTIFF") from None


DRIVERS = {"GPKG", "ESRI Shapefile", "KML", "LIBKML", "FlatGeobuf"}
"""Drivers of GDAL that may read layers: it would also take a file for one that refers to other files, or addresses."""


def layers(path: str, layer: str | None) -> dict[str, Any]:
    """Return `names` of the layers of a file of GDAL that have geometries, and what one of them holds.

    That is the layer called `layer`, or the only one; its `name` is None if there is none. The layer has `geometries`,
    the bytes of all of them as WKB, with their `starts` (n + 1,); names of `fields` and their `columns`, which are
    arrays or lists; `crs` as text; and `kind`, the type of the geometries.
    """
    import warnings

    # pyogrio imports these if they are installed; they are not used here
    for package in ("shapely", "geopandas", "pandas", "pyarrow"):
        sys.modules[package] = None  # type: ignore[assignment]
    import pyogrio.raw

    warnings.simplefilter("ignore")
    unused = [name for name in pyogrio.list_drivers() if name not in DRIVERS]
    pyogrio.set_gdal_config_options({"OGR_SKIP": ",".join(unused)})
    pyogrio.core._register_drivers()  # again, which drops these
    if any(name not in DRIVERS for name in pyogrio.list_drivers()):
        raise Damaged("cannot be read, because this version of pyogrio does not restrict GDAL to its format")
    names = [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]
    name = layer if layer in names else names[0] if len(names) == 1 else None
    if name is None:
        return {"names": names, "name": None}
    about, _, shapes, columns = pyogrio.raw.read(path, layer=name)
    parts = [shape or b"" for shape in shapes]
    return {
        "names": names,
        "name": name,
        "geometries": np.frombuffer(b"".join(parts), np.uint8),
        "starts": np.cumsum([0, *map(len, parts)], dtype=np.int64),
        "fields": [str(field) for field in about["fields"]],
        "columns": [
            [None if value is None else str(value) for value in column] if column.dtype == object else column
            for column in columns
        ],
        "crs": about["crs"] or "",
        "kind": about["geometry_type"] or "Unknown",
    }
