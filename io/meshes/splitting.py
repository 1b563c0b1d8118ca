"""Add vertices to meshes.

These are copies at seams, for formats with one texture coordinate per vertex, and vertices of triangles that replace
polygons.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Flags, Index, Real, distinct_rows
from ...meshes.mesh import Mesh
from ...surfaces.subdivided import Subdivision


@dataclass(frozen=True, eq=False)
class Split:
    """The vertices of a file, followed by copies of those whose corners have several texture coordinates.

    Attributes:
        count: number of vertices in the file.
        order: (n,) the file's vertex behind each.
        coordinate: (n,) the coordinate of each, -1 if no corner gives one.
        number: (c,) the vertex of each corner.
    """

    count: int
    order: Index
    coordinate: Index
    number: Index

    @classmethod
    def of(cls, vertices: Index, coordinates: Index, count: int) -> "Split":
        """Split vertices, given the vertex and coordinate (c,) of each corner; existing vertices keep their indices."""
        pairs = np.stack([vertices, coordinates], axis=1)
        first, place = distinct_rows(pairs)
        pairs = pairs[first]
        further = np.append(False, pairs[1:, 0] == pairs[:-1, 0])[: len(pairs)]
        number = np.where(further, count + np.cumsum(further) - 1, pairs[:, 0])
        order = np.concatenate([np.arange(count), pairs[further, 0]])
        coordinate = np.full(order.size, -1)
        coordinate[number] = pairs[:, 1]
        return cls(count, order, coordinate, number[place])

    @property
    def copies(self) -> Index:
        """The file's vertices behind the added copies; shape (k,)."""
        return self.order[self.count :]

    def values(self, new: Real, old: Real) -> Real:
        """Return (n, 2) coordinates: new ones (t, 2), or the file's old ones for vertices without a corner."""
        return np.where((self.coordinate >= 0)[:, None], new[self.coordinate], old[self.order])


def with_triangles(
    starts: Index, values: np.ndarray, plan: Subdivision, new: np.ndarray
) -> tuple[np.ndarray, Index]:
    """Replace polygons by triangles in a per-corner array.

    Args:
        starts: (f + 1,) where polygons begin.
        values: (c,) values at their corners.
        plan: the triangles.
        new: (k, 3) values at the triangles' corners.

    Returns:
        The new values, and where the new polygons begin.
    """
    sizes, times = np.diff(starts), plan.sizes(np.diff(starts))
    is_unchanged = ~replaced(plan, sizes.size)
    length = np.repeat(np.where(is_unchanged, sizes, 3), times)
    old = np.repeat(is_unchanged, times)
    out = np.empty((int(length.sum()), *values.shape[1:]), np.result_type(values, new))
    out[np.repeat(old, length)] = values[np.repeat(is_unchanged, sizes)]
    out[np.repeat(~old, length)] = new.reshape(-1, *values.shape[1:])
    return out, np.concatenate([[0], np.cumsum(length)])


def replaced(plan: Subdivision, count: int) -> Flags:
    """Mark (count,) the polygons that triangles replace."""
    marked = np.zeros(count, bool)
    marked[plan.faces] = True
    return marked


def subdivided(mesh: Mesh, plan: Subdivision) -> Mesh:
    """Replace some polygons of a mesh by triangles; positions, texture coordinates and normals are interpolated."""
    points, corners, starts = _subdivided(mesh, plan, mesh.points, mesh.corners)
    uv, uv_corners, normals, normal_corners = mesh.uv, mesh.uv_corners, mesh.normals, mesh.normal_corners
    if uv is not None and uv_corners is not None:
        uv, uv_corners, _ = _subdivided(mesh, plan, uv, uv_corners)
    if normals is not None and normal_corners is not None:
        normals, normal_corners, _ = _subdivided(mesh, plan, normals, normal_corners)
        with np.errstate(invalid="ignore", divide="ignore"):  # zero vectors become NaN
            normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(
        mesh,
        points=points,
        corners=corners,
        starts=starts,
        uv=uv,
        uv_corners=uv_corners,
        normals=normals,
        normal_corners=normal_corners,
        lines=None,
    )


def _subdivided(mesh: Mesh, plan: Subdivision, values: Real, indices: Index) -> tuple[Real, Index, Index]:
    """Append interpolated values to `values` (n, k); return also corner indices and polygon starts."""
    mixed = plan.mixtures(indices, len(values))
    corners, starts = with_triangles(mesh.starts, indices, plan, mixed.number)
    return np.concatenate([values, mixed.of(values)]), corners, starts
