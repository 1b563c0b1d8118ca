"""Two meshes with the same triangles, but of other shapes or in other places, brought together for their textures.

By the order of their faces, or by the similarity that takes the vertices of one to those of the other.
"""

from dataclasses import replace

import numpy as np

from ..arrays import Index, Real, distinct_rows
from ..errors import InputError
from ..meshes.charted import Charted
from ..meshes.mesh import Mesh
from ..meshes.relayout import SAME, partners

MATCHES = ("auto", "index", "position")


def matched(old: Charted, new: Charted, match: str = "auto") -> Charted:
    """The new mesh where its triangles lie on the old one's.

    Args:
        old, new: the meshes.
        match: "index": face by face, in their order; "position": where it is, or the best similarity takes it if no
            triangle is the same there; "auto": where it is if half of the triangles are the same there, else by index,
            else by similarity.

    Raises:
        InputError: by index, and their faces are not the same in the same order.
    """
    same = float((partners(old, new)[0] >= 0).mean()) if match != "index" else 0.0
    if match != "position" and same < 0.5:
        vertex = _by_index(old.points, old.faces.ravel(), new.points, new.faces.ravel())
        if vertex is not None:
            normals = old.normals, old.normal_faces
            shape = replace(new, points=old.points[vertex], normals=normals[0], normal_faces=normals[1])
            return replace(shape, stated=None)
        if match == "index":
            raise InputError(
                f"{new.name}: its faces are not those of {old.name} in the same order (--match index)"
            )
    if same == 0 and (moved := _by_similarity(old, new)) is not None:
        return moved
    return new


def cut_alike(old: Mesh, new: Mesh) -> Mesh:
    """The new mesh, its polygons cut into triangles as the old one's are where they are the same in the same order."""
    if not np.array_equal(old.starts, new.starts):
        return new
    vertex = _by_index(old.points, old.corners, new.points, new.corners)
    return new if vertex is None else replace(new, cut_like=old.points[vertex])


def _by_index(points: Real, corners: Index, new_points: Real, new_corners: Index) -> Index | None:
    """(n,) the old vertex for each new one where corners go to each other in their order; None where that would tear or
    join any. Vertices of the same place count as one."""
    if corners.size != new_corners.size or min(corners.min(), new_corners.min()) < 0:
        return None
    place, new_place = (
        distinct_rows(each)[1][at] for each, at in ((points, corners), (new_points, new_corners))
    )
    there = np.zeros(len(new_points), np.int64)
    there[new_corners] = corners
    for one, other in ((place, new_place), (new_place, place)):
        partner = np.zeros(int(one.max()) + 1, np.int64)
        partner[one] = other
        if (partner[one] != other).any():
            return None
    return there


def _by_similarity(old: Charted, new: Charted) -> Charted | None:
    """The new mesh by the similarity that takes its vertices to those of the old one; None where there is none."""
    from scipy.spatial import cKDTree

    a, b = (distinct_rows(mesh.points[np.unique(mesh.faces)])[0] for mesh in (old, new))
    ours, theirs = new.points[np.unique(new.faces)][b], old.points[np.unique(old.faces)][a]
    if len(ours) != len(theirs):
        return None
    frames, middles, sizes = [], [], []
    for points in (theirs, ours):
        middles.append(points.mean(axis=0))
        sizes.append(np.sqrt(np.mean((points - middles[-1]) ** 2)))
        frames.append(np.linalg.svd(points - middles[-1], full_matrices=False)[2])
    tree, scale = cKDTree(theirs), sizes[0] / max(sizes[1], 1e-300)
    upright = np.linalg.det(frames[0]) * np.linalg.det(frames[1])
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        turn = frames[1].T @ np.diag(np.multiply(signs, (1, 1, upright))) @ frames[0]
        away = tree.query(
            (ours - middles[1]) @ turn * scale + middles[0], distance_upper_bound=SAME * old.diagonal
        )[0]
        if np.isfinite(away).mean() > 0.5:
            normals = None if new.normals is None else new.normals @ turn
            stated = new.stated
            if stated is not None:
                stated = np.concatenate([stated[..., :3] @ turn, stated[..., 3:]], axis=-1)
            points = (new.points - middles[1]) @ turn * scale + middles[0]
            return replace(new, points=points, normals=normals, stated=stated)
    return None
