"""Reader of USD files for the separate process, in which the library is imported."""

from typing import Any

import numpy as np

from iccm.io.isolated.program import Damaged


def read(path: str, most: int) -> dict[str, Any]:
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
