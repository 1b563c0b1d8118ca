"""VTK: surfaces with their texture coordinates, read (in a process apart) and written by the package vtk.

Legacy files (.vtk) and those in XML (.vtp, .vtu), as ParaView saves them, as text or binary. Of volume meshes and
grids, the outer surface is read. Only the file itself is read: parallel files (.pvtp), which name others, are not.
"""

from __future__ import annotations

import re
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from ...io import files, formats, limits
from ...io.isolated import process
from ...io.meshes.mesh_format import (
    MeshContent,
    MeshFile,
    MeshFormat,
    NewCoordinates,
    Overlay,
    ShownPictures,
    Written,
)
from ...meshes.mesh import Mesh
from . import EXTRA, vtk_reader

XML_COUNT = re.compile(rb'NumberOf(Polys|Strips|Cells|Points)\s*=\s*"\s*(\d{1,18})\s*"')
LEGACY_COUNT = re.compile(
    rb"^\s*(POLYGONS|TRIANGLE_STRIPS|CELLS|POINTS|DIMENSIONS)\s+(\d{1,18})(?:\s+(\d{1,18})\s+(\d{1,18}))?",
    re.MULTILINE | re.IGNORECASE,
)
XML_ARRAY_SIZE = re.compile(rb'NumberOf(?:Components|Tuples)\s*=\s*["\']\s*(\d{1,18})')
LEGACY_ARRAY = re.compile(
    rb"^\s*\S+\s+(\d{1,18})\s+(\d{1,18})\s+(?:bit|(?:unsigned_)?(?:char|short|int|long)|float|double|vtk\w+)\s*$",
    re.MULTILINE | re.IGNORECASE,
)
"""Array of a legacy file: its name, numbers of components and of tuples, and type."""
NUMBERS_PER_BYTE = 8  # bits are the smallest
OFFSETS_VERSION = re.compile(rb"# vtk DataFile Version (?:[5-9]|\d\d)")
"""Of legacy files that declare the number of offsets of their cells, which is one more than that of the cells."""
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
        faces, points, is_grid = 0, 0, False
        densest = 1  # numbers for each byte: two bytes or more each as text, one or more as binary
        if formats.suffix_of(self.path) == ".vtk":
            extra = 1 if OFFSETS_VERSION.match(data) else 0
            for keyword, *numbers in LEGACY_COUNT.findall(data):
                counts = [int(number) for number in numbers if number]
                if keyword.upper() == b"POINTS":
                    points += counts[0]
                elif keyword.upper() == b"DIMENSIONS":
                    is_grid = True  # its points and cells are not listed
                    faces += int(np.prod(np.maximum(np.array(counts, object) - 1, 1)))
                else:
                    faces += max(counts[0] - extra, 0)
            for components, tuples in LEGACY_ARRAY.findall(data):
                if int(components) * int(tuples) > NUMBERS_PER_BYTE * len(data):
                    raise InputError(
                        f"{self.path}: damaged: an array promises more numbers than the file contains"
                    )
        else:
            densest = limits.DEFLATE_RATIO
            for kind, number in XML_COUNT.findall(data):
                if kind == b"Points":
                    points += int(number)
                else:
                    faces += int(number)
            sizes = [int(size) for size in XML_ARRAY_SIZE.findall(data)]
            if sizes and max(sizes) * max(points, 1) > NUMBERS_PER_BYTE * densest * len(data):
                raise InputError(
                    f"{self.path}: damaged: an array promises more numbers than the file contains"
                )
        if not is_grid and max(3 * points, faces) > densest * len(data):
            raise InputError(f"{self.path}: damaged: declares more points or faces than it has room for")
        if most >= 0 and points > limits.VTK_POINTS_PER_FACE * max(most, 1000):
            raise InputError(
                f"{self.path}: declares {points} points, too many for {most} faces (--max-faces)"
            )
        return faces

    def read(self) -> dict[str, MeshFile]:
        """Read the surface, or that of a volume."""
        surface = self._surface
        if not len(surface["points"]) or surface["starts"].size < 2:
            return {}
        corners, uv = surface["corners"], surface["uv"]
        uv_corners = None if uv is None else corners
        mesh = Mesh(str(self.path), surface["points"], corners, surface["starts"], uv, uv_corners)
        notes = [surface["note"]] if surface["note"] else []
        return {self.path.name: MeshFile.whole(self.path, MeshContent(mesh), None, *notes)}

    def overlay(self, name: str | None) -> Overlay:
        """Return the numbers at the points of the surface in the array of this name.

        Without a name it is the active array (SCALARS), or the only one.

        Raises:
            InputError: there is no such array, or there are several and none is named.
        """
        by_name = dict(zip(self._surface["names"], self._surface["numbers"]))
        if name is None and self._surface["active"] in by_name:
            name = self._surface["active"]
        elif name is None and len(by_name) == 1:
            name = next(iter(by_name))
        if name not in by_name:
            names = ", ".join(f"#{array}" for array in by_name) or "none"
            problem = (
                "name one of its arrays" if name is None else f"has no array {name!r} of numbers at points"
            )
            raise InputError(f"{self.path}: {problem}; it has {names}")
        return Overlay(by_name[name])

    @cached_property
    def _surface(self) -> dict[str, Any]:
        """The file's polygons, see `vtk_reader`.

        Raises:
            InputError: the file cannot be read, or contains no geometry.
        """
        _require(self.path)
        return process.read(self.path, vtk_reader.read, suffix=formats.suffix_of(self.path))

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


def _require(path: Path) -> None:
    """Refuse a file if VTK is not installed, without importing it.

    Raises:
        InputError: it is not.
    """
    EXTRA.require(f"{path}: reading VTK", "vtkmodules")


def _as_vtk(vtk: Any, values: Real | Index) -> Any:
    """Return numbers as an array of VTK, which has its copy of them."""
    kind = vtk.vtkCommonCore.VTK_ID_TYPE if values.dtype.kind == "i" else None
    return vtk.util.numpy_support.numpy_to_vtk(np.ascontiguousarray(values), deep=True, array_type=kind)


def _vtk(path: Path | str) -> Any:
    """Return the package vtkmodules, to write, with the modules used here, without its messages on standard error.

    Raises:
        InputError: it is not installed.
    """
    vtk = EXTRA.load(f"{path}: reading VTK", "vtkmodules", *MODULES)
    vtk.vtkCommonCore.vtkObject.GlobalWarningDisplayOff()
    return vtk
