"""Reader of VTK files for the separate process, in which the library is imported."""

from collections.abc import Callable
from typing import Any

import numpy as np

from iccm.io.isolated.program import Damaged


def read(path: str, suffix: str) -> dict[str, Any]:
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
