"""USD: meshes with their texture coordinates, read (in a process apart) and written by the package usd-core.

Only the file itself is read: layers, references and payloads in other files are refused, so that a file cannot name
files of this computer.
"""

from __future__ import annotations

import struct
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from .. import extras, files, limits
from ..isolated import process
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written

MAGICS = (b"#usda", b"PXR-USDC")
COUNTED_SECTIONS = (b"TOKENS", b"STRINGS", b"FIELDS", b"FIELDSETS", b"PATHS", b"SPECS")
"""Sections of a binary file that begin with the number of their items."""
SECTION = struct.Struct("<16sqq")  # name, offset and size of a section
MOST_SECTIONS = 64
ITEMS_PER_BYTE = 1024
"""Most items that a byte can stand for: two bits each, compressed by LZ4, in which a byte stands for 255 at most."""


class UsdFormat(MeshFormat):
    """USD as text or binary (.usd, .usda, .usdc)."""

    _most = -1

    def count_faces(self, most: int) -> int:
        """Return the number of faces of all meshes; the values of a binary file are read only when they are needed."""
        with files.opened(self.path) as file:
            head = file.read(8)
        if not head.startswith(MAGICS):
            return 0
        if head == MAGICS[1]:
            self._check_sections()
        self._most = most
        return sum(mesh["counts"].size for mesh in self._stage["meshes"])

    def read(self) -> dict[str, MeshFile]:
        """Read each mesh, in the coordinates of the scene."""
        geometries = dict[str, MeshFile]()
        for mesh in self._stage["meshes"]:
            name, counts, corners = mesh["name"], mesh["counts"], mesh["corners"]
            if not counts.size:
                continue
            if counts.min() < 3 or counts.sum() != corners.size:
                raise InputError(f"{self.path}: the numbers of corners of the faces of {name} are wrong")
            starts = np.concatenate([[0], np.cumsum(counts)])
            content = Mesh(str(self.path), mesh["points"], corners, starts, mesh["uv"], mesh["uv_corners"])
            geometries[name] = MeshFile.whole(self.path, MeshContent(content))
        return geometries

    def _check_sections(self) -> None:
        """Check that the sections of a binary file lie in it, and have room for their items.

        Raises:
            InputError: otherwise.
        """
        data = files.read_bytes(self.path, max_bytes=limits.MESH_BYTES)
        fault = (
            f"{self.path}: is not a USD file, or is damaged: a section promises more than the file contains"
        )
        try:
            table = struct.unpack_from("<q", data, 16)[0]
            count = struct.unpack_from("<Q", data, table)[0] if table >= 0 else MOST_SECTIONS + 1
            if count > MOST_SECTIONS:
                raise InputError(fault)
            for number in range(count):
                name, start, size = SECTION.unpack_from(data, table + 8 + number * SECTION.size)
                if min(start, size) < 0 or start + size > len(data):
                    raise InputError(fault)
                if name.rstrip(b"\0") in COUNTED_SECTIONS:
                    items = struct.unpack_from("<Q", data, start)[0]
                    if items > ITEMS_PER_BYTE * size:
                        raise InputError(fault)
        except struct.error:
            raise InputError(fault) from None

    def millimetres(self) -> float | None:
        """Return the length of the stage's unit; None if it does not state `metersPerUnit`."""
        metres = self._stage["metres"]
        return None if metres is None else 1000.0 * float(metres)

    @cached_property
    def _stage(self) -> dict[str, Any]:
        """The meshes of the file and its unit, see `readers.usd`.

        Raises:
            InputError: the file cannot be read, refers to other files, or has too many faces.
        """
        extras.require(f"{self.path}: reading USD", "pxr")
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        return process.read(self.path, "usd", most=self._most)

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
        """Write the polygons with their coordinates as `primvars:st`, one for each corner; nothing else is kept."""
        package = _usd(name)
        stage = package.Usd.Stage.CreateInMemory()
        mesh = package.UsdGeom.Mesh.Define(stage, "/mesh")
        stage.SetDefaultPrim(mesh.GetPrim())
        polygons = file.mesh
        used, corners = np.unique(polygons.corners, return_inverse=True)
        mesh.CreatePointsAttr(package.Vt.Vec3fArray.FromNumpy(polygons.points[used].astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr(package.Vt.IntArray.FromNumpy(polygons.sizes.astype(np.int32)))
        mesh.CreateFaceVertexIndicesAttr(package.Vt.IntArray.FromNumpy(corners.astype(np.int32)))
        mesh.CreateSubdivisionSchemeAttr(package.UsdGeom.Tokens.none)
        kinds, varying = package.Sdf.ValueTypeNames.TexCoord2fArray, package.UsdGeom.Tokens.faceVarying
        coordinates = package.UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kinds, varying)
        coordinates.Set(package.Vt.Vec2fArray.FromNumpy(new.uv.astype(np.float32)))
        coordinates.SetIndices(package.Vt.IntArray.FromNumpy(new.corners.astype(np.int32)))
        stage.GetRootLayer().Export(str(out))
        return Written(
            notes=[f"{name}: shows no picture; USD gets texture coordinates only"] if pictures.texture else []
        )

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round to single precision."""
        return uv.astype(np.float32).astype(float)


def _usd(path: Path | str) -> Any:
    """Return the package pxr, to write, with the modules used here.

    Raises:
        InputError: it is not installed.
    """
    return extras.load(f"{path}: reading USD", "pxr", "Sdf", "Usd", "UsdGeom", "Vt")
