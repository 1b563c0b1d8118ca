"""USD: meshes with their texture coordinates, read (in a process apart) and written by the package usd-core.

Only the file itself is read: layers, references and payloads in other files are refused, so that a file cannot name
files of this computer.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from ...io import files, limits
from ...io.isolated import process
from ...io.meshes.mesh_format import (
    MeshContent,
    MeshFile,
    MeshFormat,
    NewCoordinates,
    ShownPictures,
    Written,
)
from ...meshes.mesh import Mesh, merge
from . import EXTRA, usd_reader

MAGICS = (b"#usda", b"PXR-USDC")
COUNTED_SECTIONS = (b"TOKENS", b"STRINGS", b"FIELDS", b"FIELDSETS", b"PATHS", b"SPECS")
"""Sections of a binary file that begin with the number of their items."""
SECTION = struct.Struct("<16sqq")  # name, offset and size of a section
ITEMS_PER_BYTE = 1024
"""Most items that a byte can stand for: two bits each, compressed by LZ4, in which a byte stands for 255 at most."""


DEFAULT_PRIMVAR = "st"
"""Name of texture coordinates in the specification."""


class Prim(NamedTuple):
    """A mesh of a stage: its path, its numbers of faces and corners, and the name of its texture coordinates."""

    path: str
    faces: int
    corners: int
    primvar: str


@dataclass(frozen=True, eq=False)
class UsdContent(MeshContent):
    """Meshes of a stage, which is kept when their texture coordinates are written.

    Attributes:
        prims: the meshes, whose polygons lie one after the other in `polygons`.
    """

    prims: tuple[Prim, ...]

    @classmethod
    def join(cls, contents: Sequence[Any], name: str) -> UsdContent:
        """Join the contents of several meshes of one stage."""
        whole = merge([content.polygons for content in contents], name)
        return cls(whole, tuple(prim for content in contents for prim in content.prims))


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
            content = Mesh(
                str(self.path),
                mesh["points"],
                corners,
                starts,
                mesh["uv"],
                mesh["uv_corners"],
                up_axis=int(self._stage["up"]),
            )
            prim = Prim("/" + name, counts.size, corners.size, mesh["primvar"] or DEFAULT_PRIMVAR)
            geometries[name] = MeshFile.whole(self.path, UsdContent(content, (prim,)))
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
            count = struct.unpack_from("<Q", data, table)[0] if table >= 0 else limits.USD_SECTIONS + 1
            if count > limits.USD_SECTIONS:
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
        """The meshes of the file and its unit, see `usd_reader`.

        Raises:
            InputError: the file cannot be read, refers to other files, or has too many faces.
        """
        EXTRA.require(f"{self.path}: reading USD", "pxr")
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        return process.read(self.path, usd_reader.read, most=self._most)

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
        """Write the coordinates, one for each corner; of a mesh from USD, all else of its stage is kept."""
        package = _usd(name)
        content = file.content
        if isinstance(content, UsdContent):
            layer = package.Sdf.Layer.OpenAsAnonymous(str(file.path))
            stage = package.Usd.Stage.Open(layer)
            _set_coordinates(package, stage, file, content.prims, new)
        else:
            stage = _plain(package, file.mesh, new)
        stage.GetRootLayer().Export(str(out))
        return Written(
            notes=[f"{name}: shows no picture; USD gets texture coordinates only"] if pictures.texture else []
        )

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round to single precision."""
        return uv.astype(np.float32).astype(float)


def _set_coordinates(
    package: Any, stage: Any, file: MeshFile, prims: Sequence[Prim], new: NewCoordinates
) -> None:
    """Set the texture coordinates of the meshes of a stage that contain faces of a file; others keep theirs."""
    polygons = file.content.polygons
    number = np.full(polygons.corners.size, -1)
    number[np.repeat(file.faces, polygons.sizes)] = new.corners
    first = 0
    for prim in prims:
        corners = slice(first, first + prim.corners)
        first += prim.corners
        indices = number[corners]
        if (indices < 0).all():
            continue
        uv, lost = new.uv, indices < 0
        if lost.any():  # faces that were ignored keep their coordinates
            old = np.zeros((int(lost.sum()), 2))
            if polygons.uv is not None and polygons.uv_corners is not None:
                known = polygons.uv_corners[corners][lost]
                old[known >= 0] = polygons.uv[known[known >= 0]]
            indices = indices.copy()
            indices[lost] = len(uv) + np.arange(len(old))
            uv = np.concatenate([uv, old])
        mesh = package.UsdGeom.Mesh(stage.GetPrimAtPath(prim.path))
        _set_primvar(package, mesh, prim.primvar, uv, indices)


def _set_primvar(package: Any, mesh: Any, name: str, uv: Real, indices: Index) -> None:
    """Set the texture coordinates (t, 2) of a mesh, and the index of each corner."""
    used, local = np.unique(indices, return_inverse=True)
    kinds, varying = package.Sdf.ValueTypeNames.TexCoord2fArray, package.UsdGeom.Tokens.faceVarying
    coordinates = package.UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, kinds, varying)
    coordinates.Set(package.Vt.Vec2fArray.FromNumpy(uv[used].astype(np.float32)))
    coordinates.SetIndices(package.Vt.IntArray.FromNumpy(local.ravel().astype(np.int32)))


def _plain(package: Any, polygons: Mesh, new: NewCoordinates) -> Any:
    """Return a stage with one mesh."""
    stage = package.Usd.Stage.CreateInMemory()
    mesh = package.UsdGeom.Mesh.Define(stage, "/mesh")
    stage.SetDefaultPrim(mesh.GetPrim())
    package.UsdGeom.SetStageUpAxis(stage, "yz"[polygons.up_axis - 1].upper())
    used, corners = np.unique(polygons.corners, return_inverse=True)
    mesh.CreatePointsAttr(package.Vt.Vec3fArray.FromNumpy(polygons.points[used].astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(package.Vt.IntArray.FromNumpy(polygons.sizes.astype(np.int32)))
    mesh.CreateFaceVertexIndicesAttr(package.Vt.IntArray.FromNumpy(corners.astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(package.UsdGeom.Tokens.none)
    _set_primvar(package, mesh, DEFAULT_PRIMVAR, new.uv, new.corners)
    return stage


def _usd(path: Path | str) -> Any:
    """Return the package pxr, to write, with the modules used here.

    Raises:
        InputError: it is not installed.
    """
    return EXTRA.load(f"{path}: reading USD", "pxr", "Sdf", "Usd", "UsdGeom", "Vt")
