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


def usd(path: str, most: int) -> dict[str, Any]:
    """Return the `meshes` of a USD file in the coordinates of the scene, its unit in `metres` or None, and `up` axis.

    Each mesh has its `name`, `points` (n, 3), `counts` of corners of the faces, `corners`, and `uv` (t, 2) with
    `uv_corners` or None, and the name of their `primvar`.
    """
    from pxr import Sdf, Usd, UsdGeom

    layer = Sdf.Layer.OpenAsAnonymous(path)
    if layer is None:
        raise Damaged("is not a USD file, or is damaged")
    if layer.GetCompositionAssetDependencies():
        raise Damaged("refers to other USD files; flatten it to one file (usdcat --flatten)")
    stage = Usd.Stage.Open(layer)
    meshes, faces = [], 0
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh = UsdGeom.Mesh(prim)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or (), np.int64)
        faces += counts.size
        if 0 <= most < faces:  # the numbers of faces are enough to refuse the file
            meshes.append({"name": "", "counts": counts})
            continue
        points = np.array(mesh.GetPointsAttr().Get() or np.empty((0, 3)), float).reshape(-1, 3)
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or (), np.int64)
        matrix = np.array(UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(0.0))
        uv, uv_corners, primvar = coordinates(UsdGeom.PrimvarsAPI(mesh), corners)
        meshes.append(
            {
                "name": str(prim.GetPath()).strip("/"),
                "points": points @ matrix[:3, :3] + matrix[3, :3],
                "counts": counts,
                "corners": corners,
                "uv": uv,
                "uv_corners": uv_corners,
                "primvar": primvar,
            }
        )
    is_stated = stage.HasAuthoredMetadata("metersPerUnit")
    metres = UsdGeom.GetStageMetersPerUnit(stage) if is_stated else None
    up = 2 if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else 1
    return {"meshes": meshes, "metres": metres, "up": up}


UV_NAMES = ("st", "st0", "UVMap", "map1", "uv")
"""Names of texture coordinates in USD, that of the specification first; else any pair of numbers for each corner is
used."""


def coordinates(api: Any, corners: Any) -> tuple[Any, Any, str]:
    """Return texture coordinates (t, 2), the index of each corner and their name; None and "" if the mesh has none."""
    primvars = {primvar.GetPrimvarName(): primvar for primvar in api.GetPrimvars() if primvar.HasValue()}
    kinds = ("texCoord2", "float2", "double2", "half2")
    pairs = [
        name
        for name, primvar in primvars.items()
        if str(primvar.GetTypeName()).startswith(kinds) and str(primvar.GetTypeName()).endswith("[]")
    ]
    for name in (*(name for name in UV_NAMES if name in pairs), *pairs):
        primvar = primvars[name]
        uv = np.array(primvar.Get(), float).reshape(-1, 2)
        indices = np.array(primvar.GetIndices() or np.arange(len(uv)), np.int64)
        if primvar.GetInterpolation() in ("vertex", "varying"):
            has_all = corners.size and 0 <= corners.min() <= corners.max() < indices.size
            indices = indices[corners] if has_all else indices[:0]
        if indices.size == corners.size and (
            not indices.size or 0 <= indices.min() <= indices.max() < len(uv)
        ):
            return uv, indices, name
    return None, None, ""


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


def gifti(path: str) -> dict[str, Any]:
    """Return the `arrays` of a GIFTI file with their `intents`, and its `labels` (key, red, green, blue, alpha)."""
    from nibabel.gifti import GiftiImage

    image = GiftiImage.from_filename(path)
    labels = [
        [label.key, label.red, label.green, label.blue, label.alpha] for label in image.labeltable.labels
    ]
    return {
        "arrays": [np.asarray(array.data) for array in image.darrays],
        "intents": [int(array.intent) for array in image.darrays],
        "labels": [[0.0 if part is None else float(part) for part in label[:4]]
                   + [1.0 if label[4] is None else float(label[4])] for label in labels],
    }  # fmt: skip


def freesurfer(path: str, kind: str) -> dict[str, Any]:
    """Return what a file of FreeSurfer holds: a "surface", an "annot", numbers ("morph"), or a volume ("mgh")."""
    import nibabel

    read = nibabel.freesurfer
    if kind == "surface":
        points, faces = read.read_geometry(path)[:2]
        return {"points": np.asarray(points, float), "faces": np.asarray(faces, np.int64)}
    if kind == "mgh":
        volume: Any = nibabel.load(path)
        return {"values": np.asarray(volume.dataobj, float).reshape(-1, order="F")}
    if kind == "annot":
        keys, table, _ = read.read_annot(path)
        return {"values": np.asarray(keys, float), "colors": np.asarray(table, float)}
    return {"values": np.asarray(read.read_morph_data(path), float)}
