"""Vertices at given points of a surface, in the midst of its faces."""

from typing import Any

import numpy as np

from ..arrays import Index, Real
from ..meshes.locate import barycentric
from ..meshes.mesh import Mesh
from ..meshes.patch import Patch
from .refined import RefinedSurface

NEAR = 0.03  # barycentric coordinate under which a point is taken to the edge opposite, by hand: no thin triangles


def with_vertices(whole: Patch, points: Real) -> Mesh:
    """The triangles of a patch, with vertices at those of its points that are nearest to given ones (k, 3).

    New vertices come after the mesh's own; texture coordinates lie between those of the corners around.
    """
    mesh, faces = whole.mesh, whole.vertex[whole.faces]
    refined = RefinedSurface.of(faces, len(mesh.points))
    for point in points:
        refined = refined.with_point(*_nearest(refined.carried(mesh.points), refined.faces, point))[0]
    space = refined.carried(mesh.points)
    more: dict[str, Any] = {"base": mesh.base, "whole": mesh.whole}
    if mesh.uv is None or mesh.uv_corners is None:
        return Mesh.triangles(mesh.name, space, refined.faces, **more)
    corners = mesh.uv_corners[whole.corner][refined.own]
    split = np.flatnonzero(np.any(refined.faces != faces[refined.own], axis=1))
    own = np.repeat(refined.own[split], 3)
    weights = barycentric(mesh.points[faces[own]], space[refined.faces[split]].reshape(-1, 3))
    uv = np.einsum("pk,pkc->pc", weights, mesh.uv[mesh.uv_corners[whole.corner]][own])
    known = corners[split].min(axis=1, keepdims=True) >= 0
    numbers = len(mesh.uv) + np.arange(len(uv)).reshape(-1, 3)
    corners[split] = np.where(known, numbers, -1)
    more |= {"uv": np.concatenate([mesh.uv, uv]), "uv_corners": corners.ravel()}
    return Mesh.triangles(mesh.name, space, refined.faces, **more)


def _nearest(points: Real, faces: Index, point: Real) -> tuple[int, Real]:
    """The triangle with the nearest point, and that one's barycentric coordinates (3,)."""
    import igl

    faces = np.ascontiguousarray(faces)
    _, face, foot = igl.point_mesh_squared_distance(point[None], np.ascontiguousarray(points), faces)
    face = int(np.ravel(face)[0])
    weights = barycentric(points[faces[face]][None], np.reshape(foot, (1, 3)))[0]
    weights = np.where(weights < NEAR, 0, weights)
    return face, weights / weights.sum()
