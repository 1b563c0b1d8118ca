"""Register two meshes with the same triangles but different shapes or positions, to transfer their textures.

Triangles correspond by the order of the faces, by connectivity, or by the similarity that maps one mesh's vertices to
the other's.
"""

from dataclasses import replace

import numpy as np

from ..arrays import Index, Real, distinct_rows
from ..errors import InputError
from ..meshes.charted import Charted
from ..meshes.mesh import Mesh
from ..meshes.relayout import SAME_PLACE_SHARE, partners
from .isomorphism import Polygons, isomorphism


def matched(old: Charted, new: Charted, match: str = "auto") -> Charted:
    """Return the new mesh, moved so that its triangles lie on the old mesh's.

    Args:
        old, new: the meshes.
        match: "index": face by face, in order. "topology": by connectivity, in any order. "position": where it is, or
            where the best similarity moves it if no triangle coincides. "auto": where it is if at least half of the
            triangles coincide, else by index, by topology, or by similarity; also by index if some triangles
            differ while all that coincide have the same numbers.

    Raises:
        InputError: by index, the faces are not the same in the same order; by topology, the connectivity differs.
    """
    partner = partners(old, new)[0] if match in ("auto", "position") else np.full(len(new.faces), -1)
    coinciding = np.flatnonzero(partner >= 0)
    coinciding_share, is_ordered = (
        coinciding.size / max(partner.size, 1),
        np.array_equal(partner[coinciding], coinciding),
    )
    if match != "position" and (coinciding_share < 0.5 or (coinciding_share < 1 and is_ordered)):
        corner = None
        if match != "topology" and _by_index(old.points, old.faces.ravel(), new.points, new.faces.ravel()):
            corner = np.arange(new.faces.size)
        elif match != "index" and coinciding_share < 0.5:
            corner = isomorphism(
                Polygons.triangles(old.points, old.faces), Polygons.triangles(new.points, new.faces)
            )
        if corner is not None:
            return _laid_on(old, new, corner)
        if match == "index":
            raise InputError(
                f"{new.name}: its faces differ in number or order from those of {old.name}; --match index "
                "needs the same faces"
            )
        if match == "topology":
            raise InputError(
                f"{new.name}: its faces are connected differently from those of {old.name}; --match "
                "topology needs the same connectivity"
            )
    if coinciding_share == 0 and (aligned := _by_similarity(old, new)) is not None:
        return aligned
    return new


def _laid_on(old: Charted, new: Charted, corner: Index) -> Charted:
    """Return the new mesh on the old mesh's surface, given the old corner (3m,) for each of its corners."""
    normal_faces = None if old.normal_faces is None else old.normal_faces.ravel()[corner].reshape(-1, 3)
    points = _moved(old.points, old.faces.ravel()[corner], new.points, new.faces.ravel())
    return replace(new, points=points, normals=old.normals, normal_faces=normal_faces, stated=None)


def _moved(points: Real, corners: Index, new_points: Real, new_corners: Index) -> Real:
    """Return (n, 3) positions of the new mesh's vertices: those of the old corners that correspond to their corners."""
    positions = np.zeros_like(new_points)
    positions[new_corners] = points[corners]
    return positions


def cut_alike(old: Mesh, new: Mesh) -> Mesh:
    """Return the new mesh with its polygons triangulated like the old mesh's.

    This needs the same polygons in the same order, or the same connectivity; otherwise the mesh is returned as it is.
    """
    if (np.diff(new.starts) == 3).all() or old.corners.size != new.corners.size:
        return new
    corners = old.corners
    ordered = np.array_equal(old.starts, new.starts)
    if not (ordered and _by_index(old.points, corners, new.points, new.corners)):
        corner = isomorphism(
            Polygons(old.points, old.corners, old.starts), Polygons(new.points, new.corners, new.starts)
        )
        if corner is None:
            return new
        corners = corners[corner]
    return replace(new, cut_like=_moved(old.points, corners, new.points, new.corners))


def _by_index(points: Real, corners: Index, new_points: Real, new_corners: Index) -> bool:
    """Return whether corners correspond in their order without tearing or joining vertices.

    Vertices at the same position count as one.
    """
    if corners.size != new_corners.size or min(corners.min(), new_corners.min()) < 0:
        return False
    place = distinct_rows(points)[1][corners]
    new_place = distinct_rows(new_points)[1][new_corners]
    for first, second in ((place, new_place), (new_place, place)):
        partner = np.zeros(int(first.max()) + 1, np.int64)
        partner[first] = second
        if (partner[first] != second).any():
            return False
    return True


def _by_similarity(old: Charted, new: Charted) -> Charted | None:
    """Return the new mesh moved by the similarity that maps its vertices to the old ones; None if there is none."""
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
            (ours - middles[1]) @ turn * scale + middles[0],
            distance_upper_bound=SAME_PLACE_SHARE * old.diagonal,
        )[0]
        if np.isfinite(away).mean() > 0.5:
            normals = None if new.normals is None else new.normals @ turn
            stated = new.stated
            if stated is not None:
                stated = np.concatenate([stated[..., :3] @ turn, stated[..., 3:]], axis=-1)
            points = (new.points - middles[1]) @ turn * scale + middles[0]
            return replace(new, points=points, normals=normals, stated=stated)
    return None
