"""VTK: surfaces with their texture coordinates, read and written by the package vtk.

Legacy files (.vtk) and those in XML (.vtp, .vtu), as ParaView saves them, as text or binary. Of volume meshes and
grids, the outer surface is read. Only the file itself is read: parallel files (.pvtp), which name others, are not.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from .. import extras, files, formats, limits
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written

XML_COUNT = re.compile(rb'NumberOf(Polys|Strips|Cells|Points)\s*=\s*"\s*(\d{1,18})\s*"')
LEGACY_COUNT = re.compile(
    rb"^\s*(POLYGONS|TRIANGLE_STRIPS|CELLS|POINTS|DIMENSIONS)\s+(\d{1,18})(?:\s+(\d{1,18})\s+(\d{1,18}))?",
    re.MULTILINE | re.IGNORECASE,
)
OFFSETS_VERSION = re.compile(rb"# vtk DataFile Version (?:[5-9]|\d\d)")
"""Of legacy files that declare the number of offsets of their cells, which is one more than that of the cells."""
MOST_POINTS_PER_FACE = 8
"""A file with more points than this for each face that may be read is refused before memory is allocated for them."""
MODULES = (
    "vtkCommonCore",
    "vtkCommonDataModel",
    "vtkFiltersCore",
    "vtkFiltersGeometry",
    "vtkIOLegacy",
    "vtkIOXML",
    "util.numpy_support",
)


class VtkFormat(MeshFormat):
    """VTK's surfaces and unstructured grids (.vtk, .vtp, .vtu)."""

    def count_faces(self, most: int) -> int:
        """Return the number of polygons, strips and cells that the file declares."""
        with files.opened(self.path) as file:
            if not file.read(1):
                return 0
        data = files.read_bytes(self.path, max_bytes=limits.MESH_BYTES)
        faces = points = 0
        if formats.suffix_of(self.path) == ".vtk":
            extra = 1 if OFFSETS_VERSION.match(data) else 0
            for keyword, *numbers in LEGACY_COUNT.findall(data):
                counts = [int(number) for number in numbers if number]
                if keyword.upper() == b"POINTS":
                    points += counts[0]
                elif keyword.upper() == b"DIMENSIONS":
                    faces += int(np.prod(np.maximum(np.array(counts, object) - 1, 1)))
                else:
                    faces += max(counts[0] - extra, 0)
        else:
            for kind, number in XML_COUNT.findall(data):
                if kind == b"Points":
                    points += int(number)
                else:
                    faces += int(number)
        if most >= 0 and points > MOST_POINTS_PER_FACE * max(most, 1000):
            raise InputError(
                f"{self.path}: declares {points} points, too many for {most} faces (--max-faces)"
            )
        return faces

    def read(self) -> dict[str, MeshFile]:
        """Read the surface, or that of a volume."""
        vtk = _vtk(self.path)
        surface, note = self._surface(vtk)
        if not surface.GetNumberOfPoints():
            return {}
        as_array = vtk.util.numpy_support.vtk_to_numpy
        points = as_array(surface.GetPoints().GetData()).astype(float)
        polygons = surface.GetPolys()
        corners = as_array(polygons.GetConnectivityArray()).astype(np.int64)
        starts = as_array(polygons.GetOffsetsArray()).astype(np.int64)
        if starts.size < 2:
            return {}
        uv, uv_corners = None, None
        coordinates = surface.GetPointData().GetTCoords()
        if coordinates is not None and coordinates.GetNumberOfComponents() >= 2:
            uv, uv_corners = as_array(coordinates)[:, :2].astype(float), corners
        content = MeshContent(Mesh(str(self.path), points, corners, starts, uv, uv_corners))
        return {self.path.name: MeshFile.whole(self.path, content, None, *note)}

    def numbers_at_points(self, name: str | None) -> Real:
        """Return the numbers (n,) at the points of the surface in the array of this name.

        Without a name it is the active array (SCALARS), or the only one.

        Raises:
            InputError: there is no such array, or there are several and none is named.
        """
        vtk = _vtk(self.path)
        data = self._surface(vtk)[0].GetPointData()
        arrays = [data.GetArray(index) for index in range(data.GetNumberOfArrays())]
        by_name = {
            array.GetName(): array
            for array in arrays
            if array is not None and array.GetNumberOfComponents() == 1
        }
        active = data.GetScalars()
        if name is None and active is not None and active.GetName() in by_name:
            name = active.GetName()
        elif name is None and len(by_name) == 1:
            name = next(iter(by_name))
        if name not in by_name:
            names = ", ".join(f"#{array}" for array in by_name) or "none"
            problem = (
                "name one of its arrays" if name is None else f"has no array {name!r} of numbers at points"
            )
            raise InputError(f"{self.path}: {problem}; it has {names}")
        return vtk.util.numpy_support.vtk_to_numpy(by_name[name]).astype(float)

    def _surface(self, vtk: Any) -> tuple[Any, list[str]]:
        """Return the file's polygons as VTK's PolyData, and a note if they are the surface of a volume or grid.

        Raises:
            InputError: the file cannot be read, or contains no geometry.
        """
        reader = {
            ".vtk": vtk.vtkIOLegacy.vtkGenericDataObjectReader,
            ".vtp": vtk.vtkIOXML.vtkXMLPolyDataReader,
            ".vtu": vtk.vtkIOXML.vtkXMLUnstructuredGridReader,
        }[formats.suffix_of(self.path)]()
        reader.SetFileName(str(self.path))
        reader.Update()
        content, model = reader.GetOutput(), vtk.vtkCommonDataModel
        if reader.GetErrorCode() or content is None:
            raise InputError(f"{self.path}: is not a VTK file, or is damaged")
        if isinstance(content, model.vtkPolyData):
            if not content.GetNumberOfStrips():
                return content, []
            triangles = vtk.vtkFiltersCore.vtkTriangleFilter()
            triangles.PassLinesOff()
            triangles.PassVertsOff()
            triangles.SetInputData(content)
            triangles.Update()
            return triangles.GetOutput(), ["strips of triangles were taken apart, and polygons divided"]
        if not isinstance(content, model.vtkDataSet):
            raise InputError(f"{self.path}: contains no geometry, but {content.GetClassName()}")
        surface = vtk.vtkFiltersGeometry.vtkDataSetSurfaceFilter()
        surface.SetInputData(content)
        surface.Update()
        return surface.GetOutput(), [f"took the surface of its {content.GetNumberOfCells()} cells"]

    @classmethod
    def write(
        cls,
        file: MeshFile,
        new: NewCoordinates,
        pictures: ShownPictures,
        out: Path,
        name: Path,
        *,
        force: bool,
    ) -> Written:
        """Write the polygons with their coordinates as TCoords of points, which are split where a chart ends; nothing
        else is kept.
        """
        vtk, polygons = _vtk(name), file.mesh
        pairs, corners = np.unique(np.stack([polygons.corners, new.corners], 1), axis=0, return_inverse=True)
        surface = vtk.vtkCommonDataModel.vtkPolyData()
        points = vtk.vtkCommonCore.vtkPoints()
        points.SetData(_as_vtk(vtk, polygons.points[pairs[:, 0]]))
        surface.SetPoints(points)
        cells = vtk.vtkCommonDataModel.vtkCellArray()
        cells.SetData(_as_vtk(vtk, polygons.starts), _as_vtk(vtk, corners.ravel()))
        surface.SetPolys(cells)
        coordinates = _as_vtk(vtk, cls.round_uv(new.uv)[pairs[:, 1]])
        coordinates.SetName("TextureCoordinates")
        surface.GetPointData().SetTCoords(coordinates)
        if formats.suffix_of(name) == ".vtk":
            writer = vtk.vtkIOLegacy.vtkPolyDataWriter()
            writer.SetFileTypeToBinary()
        else:
            writer = vtk.vtkIOXML.vtkXMLPolyDataWriter()
            writer.SetDataModeToBinary()
        writer.SetFileName(str(out))
        writer.SetInputData(surface)
        if not writer.Write() or writer.GetErrorCode():
            raise OSError(f"{name}: cannot be written")
        note = f"{name}: shows no picture; VTK gets texture coordinates only"
        return Written(notes=[note] if pictures.texture else [])

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round to single precision."""
        return uv.astype(np.float32).astype(float)


def _as_vtk(vtk: Any, values: Real | Index) -> Any:
    """Return numbers as an array of VTK, which has its copy of them."""
    kind = vtk.vtkCommonCore.VTK_ID_TYPE if values.dtype.kind == "i" else None
    return vtk.util.numpy_support.numpy_to_vtk(np.ascontiguousarray(values), deep=True, array_type=kind)


def _vtk(path: Path | str) -> Any:
    """Return the package vtkmodules with the modules used here, without its messages on standard error.

    Raises:
        InputError: it is not installed.
    """
    vtk = extras.load(f"{path}: reading VTK", "vtkmodules", *MODULES)
    vtk.vtkCommonCore.vtkObject.GlobalWarningDisplayOff()
    return vtk
