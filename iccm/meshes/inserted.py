"""Vertices at given points of a surface, in the midst of its faces."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Index, Real
from .locate import barycentric
from .mesh import Mesh
from .patch import Patch

NEAR = 0.03  # barycentric coordinate under which a point is taken to the edge opposite, by hand: no thin triangles


def with_vertices(whole: Patch, points: Real) -> Mesh:
    """The triangles of a patch, with vertices at those of its points that are nearest to given ones (k, 3).

    New vertices come after the mesh's own; texture coordinates lie between those of the corners around.
    """
    mesh = whole.mesh
    layers = [_Layer(mesh.points, whole.vertex[whole.faces])]
    if mesh.uv is not None and mesh.uv_corners is not None:
        layers.append(_Layer(mesh.uv, mesh.uv_corners[whole.corner]))
    for point in points:
        face, weights = _nearest(layers[0], point)
        if np.count_nonzero(weights) > 1:
            faces = layers[0].faces
            ends = faces[face][weights > 0]
            hit = np.flatnonzero(np.isin(faces, ends).sum(axis=1) == ends.size)
            shares = np.array([[weights[faces[face] == v].sum() for v in faces[t]] for t in hit])
            layers = [layer.split(hit, shares, joined=layer is layers[0]) for layer in layers]
    space, *others = layers
    more = {"uv": others[0].values, "uv_corners": others[0].faces.ravel()} if others else {}
    return Mesh.triangles(mesh.name, space.values, space.faces, base=mesh.base, whole=mesh.whole, **more)


@dataclass(frozen=True, eq=False)
class _Layer:
    """Values (n, …) and which of them are at the corners (m, 3) of triangles."""

    values: Real
    faces: Index

    def split(self, hit: Index, shares: Real, *, joined: bool) -> "_Layer":
        """With the triangles hit split at new values, the shares (h, 3) of their corners'; one for all if `joined`."""
        new = np.einsum("hk,hkc->hc", shares, self.values[self.faces[hit]])
        number = len(self.values) + np.arange(len(hit)) * (not joined)
        parts = [
            np.where(np.arange(3) == k, at, self.faces[t])
            for t, share, at in zip(hit, shares, number)
            for k in np.flatnonzero(share)
        ]
        kept = np.delete(self.faces, hit, axis=0)
        values = np.concatenate([self.values, new[:1] if joined else new])
        return _Layer(values, np.concatenate([kept, np.array(parts).reshape(-1, 3)]))


def _nearest(surface: _Layer, point: Real) -> tuple[int, Real]:
    """The triangle with the nearest point, and that one's barycentric coordinates (3,)."""
    import igl

    faces = np.ascontiguousarray(surface.faces)
    _, face, foot = igl.point_mesh_squared_distance(point[None], np.ascontiguousarray(surface.values), faces)
    face = int(np.ravel(face)[0])
    weights = barycentric(surface.values[faces[face]][None], np.reshape(foot, (1, 3)))[0]
    weights = np.where(weights < NEAR, 0, weights)
    return face, weights / weights.sum()
