"""Seams that a file marks: lines of an OBJ file along the edges of a mesh, or the borders of another layout."""

from dataclasses import replace

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from ...meshes.borders import preferred_edges
from ...meshes.disk_patch import Joined
from ...meshes.mesh import Mesh
from ...meshes.topology import walk
from ..meshes import mesh_files
from ..meshes.mesh_format import MeshFile
from ..meshes.obj_format import obj_content
from . import planar_obj

SAME_PLACE_SHARE = 1e-4
"""Of a mesh's diagonal: distance of an end of a line from a vertex that counts as none, as files are rounded."""
MOST_MARKED_SHARE = 0.5
"""Share of the edges from which lines in a mesh's own file are a wire frame, and no seams."""


def with_seams(parts: list[MeshFile], seams: str | None) -> list[MeshFile]:
    """Return the geometries of a file with their seams marked: those of `seams`, or lines of an OBJ file itself.

    Args:
        parts: the geometries.
        seams: an OBJ file with lines (`l`), or a mesh with texture coordinates, whose borders are the seams. Lines may
            leave out vertices: the seam is then the shortest path along edges.

    Raises:
        InputError: the file cannot be read, has no seams, or lines that end at no vertex of the mesh.
    """
    if seams is None:
        content = obj_content(parts[0])
        lines = planar_obj.polylines(content.obj) if content and b"\nl" in content.obj.data else []
        if not content or not lines:
            return parts
        ends = np.concatenate([edges for _, edges in lines])
        marked = [_marked(part.mesh, content.obj.v[ends])[0] for part in parts]
        return [
            replace(part, mesh=replace(part.mesh, seams=pairs))
            if len(pairs) < MOST_MARKED_SHARE * Joined.of(part.mesh).shape.edge_count
            else part
            for part, pairs in zip(parts, marked)
        ]
    ends_in_space = _ends(seams)
    found = [_marked(part.mesh, ends_in_space) for part in parts]
    missed = np.logical_and.reduce([lost for _, lost in found])
    if missed.any():
        raise InputError(
            f"--seams {seams}: {int(missed.sum())} of {missed.size} lines do not end at vertices of "
            f"{parts[0].path}; the first ends at ({', '.join(f'{x:.6g}' for x in ends_in_space[missed][0, 0])})"
        )
    return [
        replace(part, mesh=replace(part.mesh, seams=pairs)) if len(pairs) else part
        for part, (pairs, _) in zip(parts, found)
    ]


def _ends(seams: str) -> Real:
    """Return (k, 2, 3) the ends of the lines of a file, or of the borders of its texture coordinates."""
    parts = mesh_files.read_all(seams)
    own = obj_content(parts[0])
    if own and (lines := planar_obj.polylines(own.obj)):
        return own.obj.v[np.concatenate([edges for _, edges in lines])]
    ends = list[Real]()
    for part in parts:
        mesh = replace(part.mesh, normals=None, normal_corners=None, materials=None)
        joined = Joined.of(mesh)
        border = np.flatnonzero(preferred_edges(mesh, joined.shape, joined.corner))
        vertices = joined.vertex[np.column_stack([joined.shape.tail[border], joined.shape.head[border]])]
        ends.append(mesh.points[vertices])
    whole = np.concatenate(ends) if ends else np.zeros((0, 2, 3))
    if not len(whole):
        raise InputError(f"--seams {seams}: has neither lines (l) nor texture coordinates with seams")
    return whole


def _marked(mesh: Mesh, ends: Real) -> tuple[Index, np.ndarray]:
    """Return (s, 2) vertices at the ends of the edges along lines (k, 2, 3), and (k,) which lines end at none."""
    from scipy.spatial import cKDTree

    joined = Joined.of(mesh)
    points = mesh.points[joined.vertex]
    away, nearest = cKDTree(points).query(ends)
    lost = (away > SAME_PLACE_SHARE * np.linalg.norm(np.ptp(points, axis=0))).any(axis=1)
    pairs = nearest[~lost]
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    shape = joined.shape
    is_edge = np.isin(shape.edge_key(*pairs.T), shape.edge_key(shape.tail, shape.head))
    edges = [pairs[is_edge]]
    every = np.ones(shape.twin.size, bool)
    for start, end in pairs[~is_edge].tolist():
        path = walk(shape.paths(points, np.array([start]), every)[1], end)
        if path[-1] == start:
            edges.append(np.column_stack([path[:-1], path[1:]]))
    return joined.vertex[np.concatenate(edges)], lost
