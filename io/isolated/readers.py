"""Program that reads a file with a library in native code, and writes numbers and arrays to stdout.

A damaged file can crash these libraries, keep them busy for ever, or make them allocate all memory, and a call cannot
be interrupted. A process can be limited. It imports nothing of iccm, so that it starts in a few hundredths of a second
more than its library needs.

    python readers.py FUNCTION CPU_SECONDS MEMORY_BYTES ARGUMENTS_AS_JSON

stdout is a line of JSON, followed by the arrays that it describes. Its key `values` has the result, with arrays as
their numbers; or `error` says in a sentence what is wrong with the file.
"""

import json
import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np


class Damaged(Exception):
    """The file is wrong; the message is a sentence without its name."""


def limit(cpu_seconds: int, memory_bytes: int) -> None:
    """Limit the processor time and the address space of this process, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for kind, most in ((resource.RLIMIT_CPU, cpu_seconds), (resource.RLIMIT_AS, memory_bytes)):
        allowed = resource.getrlimit(kind)[1]
        least = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        try:
            resource.setrlimit(kind, (least, allowed))
        except (OSError, ValueError):  # macOS does not limit the address space
            continue


def vtk(path: str, suffix: str) -> dict[str, Any]:
    """Return the polygons of a VTK file, or of the surface of its volume, and the numbers at its points.

    Returns `points` (n, 3), `corners` and `starts` of the polygons, `uv` (n, 2) if there are texture coordinates,
    `names` of the arrays of numbers with `numbers` in the same order, `active`, and a `note`.
    """
    from vtkmodules import (
        vtkCommonCore,
        vtkCommonDataModel,
        vtkFiltersCore,
        vtkFiltersGeometry,
        vtkIOLegacy,
        vtkIOXML,
    )
    from vtkmodules.util.numpy_support import vtk_to_numpy

    messages = (
        vtkCommonCore.vtkStringOutputWindow()
    )  # where an incomplete array is reported, and nowhere else
    vtkCommonCore.vtkOutputWindow.SetInstance(messages)
    kinds: dict[str, Any] = {
        ".vtk": vtkIOLegacy.vtkGenericDataObjectReader,
        ".vtp": vtkIOXML.vtkXMLPolyDataReader,
        ".vtu": vtkIOXML.vtkXMLUnstructuredGridReader,
    }
    reader: Any = kinds[suffix]()
    reader.SetFileName(path)
    reader.Update()
    content = reader.GetOutput()
    if reader.GetErrorCode() or content is None or "ERR" in messages.GetOutput():
        raise Damaged("is not a VTK file, or is damaged")
    note = ""
    if isinstance(content, vtkCommonDataModel.vtkPolyData):
        check_cells(content.GetPolys(), content.GetNumberOfPoints(), vtk_to_numpy)
        if content.GetNumberOfStrips():
            check_cells(content.GetStrips(), content.GetNumberOfPoints(), vtk_to_numpy)
            triangles = vtkFiltersCore.vtkTriangleFilter()
            triangles.PassLinesOff()
            triangles.PassVertsOff()
            triangles.SetInputData(content)
            triangles.Update()
            content, note = (
                triangles.GetOutput(),
                "strips of triangles were taken apart, and polygons divided",
            )
    elif isinstance(content, vtkCommonDataModel.vtkDataSet):
        if isinstance(content, vtkCommonDataModel.vtkUnstructuredGrid):
            check_cells(content.GetCells(), content.GetNumberOfPoints(), vtk_to_numpy)
        note = f"took the surface of its {content.GetNumberOfCells()} cells"
        surface = vtkFiltersGeometry.vtkDataSetSurfaceFilter()
        surface.SetInputData(content)
        surface.Update()
        content = surface.GetOutput()
    else:
        raise Damaged(f"contains no geometry, but {content.GetClassName()}")
    if "ERR" in messages.GetOutput():
        raise Damaged("is damaged")
    polygons, data, positions = content.GetPolys(), content.GetPointData(), content.GetPoints()
    result: dict[str, Any] = {"note": note, "names": [], "numbers": [], "active": None, "uv": None}
    count = content.GetNumberOfPoints()
    result["points"] = vtk_to_numpy(positions.GetData()).astype(float) if count else np.empty((0, 3))
    result["corners"] = vtk_to_numpy(polygons.GetConnectivityArray()).astype(np.int64)
    result["starts"] = vtk_to_numpy(polygons.GetOffsetsArray()).astype(np.int64)
    coordinates = data.GetTCoords()
    if coordinates is not None and coordinates.GetNumberOfComponents() >= 2:
        result["uv"] = vtk_to_numpy(coordinates)[:, :2].astype(float)
    for index in range(data.GetNumberOfArrays()):
        array = data.GetArray(index)
        if array is not None and array.GetNumberOfComponents() == 1:
            result["names"].append(array.GetName())
            result["numbers"].append(vtk_to_numpy(array).astype(float))
    active = data.GetScalars()
    result["active"] = active.GetName() if active is not None else None
    return result


def check_cells(cells: Any, points: int, as_numpy: Callable[[Any], Any]) -> None:
    """Check that cells have the corners that they promise, and that these are points of the mesh: filters do not.

    Raises:
        Damaged: otherwise.
    """
    starts, corners = as_numpy(cells.GetOffsetsArray()), as_numpy(cells.GetConnectivityArray())
    if starts.size and (starts[0] != 0 or starts[-1] > corners.size or (np.diff(starts) < 0).any()):
        raise Damaged("is damaged: the lengths of its cells are wrong")
    if corners.size and not 0 <= corners.min() <= corners.max() < points:
        raise Damaged(f"is damaged: a cell uses a point that is not among the {points} of the file")


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


READERS: dict[str, Callable[..., Any]] = {
    function.__name__: function for function in (vtk, itk, usd, geotiff, layers, gifti, freesurfer)
}


def pack(value: Any, arrays: list[Any]) -> Any:
    """Return a value as JSON, with arrays appended to a list and replaced by {"array": number}."""
    if isinstance(value, np.ndarray):
        arrays.append(np.ascontiguousarray(value))
        return {"array": len(arrays) - 1}
    if isinstance(value, dict):
        return {key: pack(item, arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [pack(item, arrays) for item in value]
    return value


def main() -> None:
    """Read the file, and write the result to what stdout was when the program started."""
    name, seconds, memory, arguments = sys.argv[1:]
    with os.fdopen(os.dup(1), "wb") as out, open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)  # libraries may print
        os.dup2(nowhere.fileno(), 2)
        arrays: list[Any] = []
        try:
            limit(int(seconds), int(memory))
            message: dict[str, Any] = {"values": pack(READERS[name](**json.loads(arguments)), arrays)}
        except Damaged as error:
            message = {"error": str(error)}
        except ImportError as error:
            message = {"missing": str(error)}
        except MemoryError:
            message = {"error": "needs more memory than files of its size may take"}
        except Exception as error:  # whatever exception a parser raises, the file is at fault
            name = json.loads(arguments)["path"]
            reason = " ".join(str(error).replace(name, os.path.basename(name)).split())[:120]
            message = {"error": f"cannot be read ({reason or type(error).__name__})"}
        message["arrays"] = [{"dtype": array.dtype.str, "shape": array.shape} for array in arrays]
        out.write(json.dumps(message).encode() + b"\n")
        for array in arrays:
            # as bytes, because not all types have buffers
            out.write(array.reshape(-1).view(np.uint8).data if array.size else b"")
    os._exit(0)  # without what libraries do at the end, which may fail after all is written


if __name__ == "__main__":
    main()
