"""Triangles with texture coordinates, and the tangents that their normal maps are relative to."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Index, Real
from ..errors import InputError
from .mesh import Mesh, checked, triangulated
from .topology import Triangles


@dataclass(frozen=True, eq=False)
class Charted:
    """The triangles of a mesh with its texture coordinates.

    Attributes:
        name: for messages.
        points: (n, 3) positions.
        faces: (m, 3) vertices of the triangles.
        uv: (t, 2) texture coordinates, v up.
        uv_faces: (m, 3) coordinates of their corners.
    """

    name: str
    points: Real
    faces: Index
    uv: Real
    uv_faces: Index

    @classmethod
    def of(cls, mesh: Mesh) -> "Charted":
        """All triangles of a mesh.

        Raises:
            InputError: an element at fault, or no texture coordinates; naming it.
        """
        corner = triangulated(checked(mesh))
        if mesh.uv is None or mesh.uv_corners is None:
            raise InputError(f"{mesh.name}: has no texture coordinates; make them with iccm flatten --uv")
        return cls(mesh.name, mesh.points, mesh.corners[corner], mesh.uv, mesh.uv_corners[corner])

    @cached_property
    def twin(self) -> Index:
        """(3m,) half-edges on the same edge; see `Triangles`."""
        return Triangles(self.faces, len(self.points)).twin

    @property
    def diagonal(self) -> float:
        """Of the bounding box."""
        used = self.points[np.unique(self.faces)]
        return float(np.linalg.norm(np.ptp(used, axis=0)))

    @cached_property
    def mirrored(self) -> Index:
        """(m,) 1 for triangles that the texture shows as they are seen from outside, -1 for mirrored ones."""
        a, b, c = np.moveaxis(self.uv[self.uv_faces], 1, 0)
        p, q = b - a, c - a
        return np.where(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] < 0, -1, 1)

    @cached_property
    def frames(self) -> tuple[Real, Real]:
        """(m, 3, 3) unit normals and tangents of the triangles' corners.

        As MikkTSpace (Mikkelsen, *Simulation of Wrinkled Surfaces Revisited*, 2008) has it: directions of growing u,
        made square to the normal, averaged by angle over the triangles that share a vertex, its coordinate and their
        handedness. Normals are averaged by angle over all that share a position.
        """
        at, uv = self.points[self.faces], self.uv[self.uv_faces]
        e1, e2 = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
        d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        across = _unit(np.cross(e1, e2))
        along = _unit((e1 * d2[:, 1:] - e2 * d1[:, 1:]) * self.mirrored[:, None])
        angle = _angles(at)[..., None]
        place = np.unique(self.points, axis=0, return_inverse=True)[1].ravel()[self.faces]
        normal = _unit(_gathered(place, angle * across[:, None]))
        side = along[:, None] - normal * np.einsum("mi,mki->mk", along, normal)[..., None]
        key = np.stack([place, self.uv_faces, np.broadcast_to(self.mirrored[:, None], place.shape)], axis=-1)
        group = np.unique(key.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(place.shape)
        return normal, _unit(_gathered(group, angle * _unit(side)))


def _gathered(group: Index, values: Real) -> Real:
    """(m, 3, 3) sums of values (m, 3, 3) over corners of the same group (m, 3)."""
    flat = values.reshape(-1, 3)
    sums = np.stack([np.bincount(group.ravel(), flat[:, k]) for k in range(3)], axis=-1).astype(
        float, copy=False
    )
    return sums[group]


def _unit(vectors: Real) -> Real:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def _angles(at: Real) -> Real:
    """(m, 3) angles at the corners of triangles (m, 3, 3)."""
    a, b = _unit(np.roll(at, -1, axis=1) - at), _unit(np.roll(at, 1, axis=1) - at)
    return np.arccos(np.clip(np.einsum("mki,mki->mk", a, b), -1, 1))
