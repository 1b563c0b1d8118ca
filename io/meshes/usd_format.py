"""USD: meshes with their texture coordinates, read and written by the package usd-core.

Only the file itself is read: layers, references and payloads in other files are refused, so that a file cannot name
files of this computer.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from .. import extras, files, limits
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written

MAGICS = (b"#usda", b"PXR-USDC")
UV_NAMES = ("st", "st0", "UVMap", "map1", "uv")
"""Names of texture coordinates, that of the specification first; else any pair of numbers for each corner is used."""


class UsdFormat(MeshFormat):
    """USD as text or binary (.usd, .usda, .usdc)."""

    def count_faces(self, most: int) -> int:
        """Return the number of faces of all meshes; the values of a binary file are read only when they are needed."""
        with files.opened(self.path) as file:
            head = file.read(8)
        if not head.startswith(MAGICS):
            return 0
        return sum(len(mesh.GetFaceVertexCountsAttr().Get() or ()) for _, mesh in self._meshes())

    def read(self) -> dict[str, MeshFile]:
        """Read each mesh, in the coordinates of the scene."""
        package, geometries = _usd(self.path), dict[str, MeshFile]()
        for name, mesh in self._meshes():
            points = np.array(mesh.GetPointsAttr().Get() or np.empty((0, 3)), float).reshape(-1, 3)
            counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or (), np.int64)
            corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or (), np.int64)
            if not counts.size:
                continue
            if counts.min() < 3 or counts.sum() != corners.size:
                raise InputError(f"{self.path}: the numbers of corners of the faces of {name} are wrong")
            matrix = np.array(package.UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(0.0))
            points = points @ matrix[:3, :3] + matrix[3, :3]
            starts = np.concatenate([[0], np.cumsum(counts)])
            uv, uv_corners = _coordinates(package, mesh, corners)
            geometries[name] = MeshFile.whole(
                self.path, MeshContent(Mesh(str(self.path), points, corners, starts, uv, uv_corners))
            )
        return geometries

    def _meshes(self) -> list[tuple[str, Any]]:
        """Return the meshes of the file by their paths in it.

        Raises:
            InputError: the file cannot be read, or refers to other files.
        """
        package = _usd(self.path)
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        try:
            layer = package.Sdf.Layer.OpenAsAnonymous(str(self.path))
        except Exception:
            layer = None
        if layer is None:
            raise InputError(f"{self.path}: is not a USD file, or is damaged")
        if layer.GetCompositionAssetDependencies():
            raise InputError(
                f"{self.path}: refers to other USD files; flatten it to one file (usdcat --flatten)"
            )
        self._stage = package.Usd.Stage.Open(layer)  # prims are valid as long as their stage exists
        prims = [prim for prim in self._stage.Traverse() if prim.IsA(package.UsdGeom.Mesh)]
        return [(str(prim.GetPath()).strip("/"), package.UsdGeom.Mesh(prim)) for prim in prims]

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


def _coordinates(package: Any, mesh: Any, corners: Any) -> tuple[Any, Any]:
    """Return texture coordinates (t, 2) and the index of each corner; None for both if the mesh has none."""
    api = package.UsdGeom.PrimvarsAPI(mesh)
    primvars = {primvar.GetPrimvarName(): primvar for primvar in api.GetPrimvars() if primvar.HasValue()}
    pairs = [
        name
        for name, primvar in primvars.items()
        if re.fullmatch(r"(texCoord|float|double|half)2\w*\[\]", str(primvar.GetTypeName()))
    ]
    for name in (*(name for name in UV_NAMES if name in pairs), *pairs):
        primvar = primvars[name]
        uv = np.array(primvar.Get(), float).reshape(-1, 2)
        indices = np.array(primvar.GetIndices() or np.arange(len(uv)), np.int64)
        if primvar.GetInterpolation() in ("vertex", "varying"):
            indices = indices[corners] if corners.size and corners.max() < indices.size else indices[:0]
        if indices.size == corners.size and (
            not indices.size or 0 <= indices.min() <= indices.max() < len(uv)
        ):
            return uv, indices
    return None, None


def _usd(path: Path | str) -> Any:
    """Return the package pxr with the modules used here.

    Raises:
        InputError: it is not installed.
    """
    return extras.load(f"{path}: reading USD", "pxr", "Sdf", "Usd", "UsdGeom", "Vt")
