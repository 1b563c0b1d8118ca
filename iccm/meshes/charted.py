"""Triangles with texture coordinates, and the tangents to which their normal maps are relative."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Flags, Index, Real, distinct_rows, unit_vectors
from ..errors import InputError
from .mesh import Mesh, check, triangulate
from .topology import Triangles


@dataclass(frozen=True, eq=False)
class Charted:
    """The triangles of a mesh with its texture coordinates.

    Attributes:
        name: name in messages.
        points: (n, 3) positions.
        faces: (m, 3) vertices of the triangles.
        uv: (t, 2) texture coordinates, v up.
        uv_faces: (m, 3) texture coordinates of their corners.
        normals: (k, 3) unit normals from the file, or None.
        normal_faces: (m, 3) normals of the corners, or None.
        stated: (m, 3, 4) tangents of the corners from the file, with the sign of the bitangent (±1); the
            direction is zero for corners without a tangent. None if the file has no tangents.
    """

    name: str
    points: Real
    faces: Index
    uv: Real
    uv_faces: Index
    normals: Real | None = None
    normal_faces: Index | None = None
    stated: Real | None = None

    @classmethod
    def of(cls, mesh: Mesh) -> "Charted":
        """Return all triangles of a mesh.

        Raises:
            InputError: an element, named in the message, is invalid, or there are no texture coordinates.
        """
        corner = triangulate(check(mesh))
        if mesh.uv is None or mesh.uv_corners is None:
            raise InputError(f"{mesh.name}: has no texture coordinates; create them with iccm flatten --uv")
        stated = mesh.normals is not None and mesh.normal_corners is not None
        normals = (mesh.normals, mesh.normal_corners[corner]) if stated else ()  # type: ignore[index]
        return cls(mesh.name, mesh.points, mesh.corners[corner], mesh.uv, mesh.uv_corners[corner], *normals)

    @cached_property
    def twin(self) -> Index:
        """(3m,) half-edges on the same edge; see `Triangles`."""
        return Triangles(self.faces, len(self.points)).twin

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box."""
        used = self.points[np.unique(self.faces)]
        return float(np.linalg.norm(np.ptp(used, axis=0)))

    @cached_property
    def mirrored(self) -> Index:
        """1 for triangles that the texture shows as seen from outside, -1 for mirrored ones; shape (m,)."""
        a, b, c = np.moveaxis(self.uv[self.uv_faces], 1, 0)
        p, q = b - a, c - a
        return np.where(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] < 0, -1, 1)

    @cached_property
    def hands(self) -> Index:
        """Sign of the triangles' upward bitangents relative to normal × tangent, 1 or -1; shape (m,)."""
        if self.stated is None:
            return self.mirrored
        return np.where(self._has_tangent, np.where(self.stated[..., 3] < 0, -1, 1), self.mirrored[:, None])[
            :, 0
        ]

    @property
    def _has_tangent(self) -> Flags:
        """Whether the file has a tangent for the corner; shape (m, 3)."""
        assert self.stated is not None
        return (self.stated[..., :3] != 0).any(axis=2)

    @cached_property
    def frames(self) -> tuple[Real, Real]:
        """Unit normals and tangents of the triangles' corners; shape (m, 3, 3).

        They follow MikkTSpace (Mikkelsen, *Simulation of Wrinkled Surfaces Revisited*, 2008): directions of
        growing u, made orthogonal to the normal, and averaged with the projected angle as weight over the
        triangles around a vertex that share its position, normal and texture coordinate, and are joined by
        edges with the same handedness. Normals and tangents from the mesh take precedence; other normals are
        averages, weighted by angle, over all triangles that share a position.
        """
        corners, uv = self.points[self.faces], self.uv[self.uv_faces]
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        along = unit_vectors((e1 * d2[:, 1:] - e2 * d1[:, 1:]) * self.mirrored[:, None])
        normal, group = self._normals, self._groups
        sums = _sum_over_groups(
            group, _angles(corners, normal)[..., None] * unit_vectors(_orthogonal(along[:, None], normal))
        )
        tangents = unit_vectors(_orthogonal(sums, normal))
        if self.stated is None:
            return normal, tangents
        return normal, np.where(
            self._has_tangent[..., None], unit_vectors(_orthogonal(self.stated[..., :3], normal)), tangents
        )

    @cached_property
    def _normals(self) -> Real:
        """Unit normals of the corners; shape (m, 3, 3)."""
        if self.normals is not None and self.normal_faces is not None:
            return unit_vectors(self.normals[self.normal_faces])
        corners = self.points[self.faces]
        across = unit_vectors(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        return unit_vectors(
            _sum_over_groups(_same(self.points)[self.faces], _angles(corners)[..., None] * across[:, None])
        )

    @cached_property
    def _groups(self) -> Index:
        """Number of the group of corners that share a tangent; shape (m, 3)."""
        places, texture_places = _same(self.points)[self.faces], _same(self.uv)[self.uv_faces]
        normals = places
        if self.normals is not None and self.normal_faces is not None:
            normals = _same(self.normals)[self.normal_faces]
        corners = _same(np.stack([places, normals, texture_places], axis=-1).reshape(-1, 3))
        shape = Triangles(corners.reshape(-1, 3), int(corners.max(initial=-1)) + 1)
        hand = np.repeat(self.mirrored, 3)
        return shape.fans(hand != hand[shape.twin]).reshape(-1, 3)


def _same(rows: np.ndarray) -> Index:
    """Return (n,) a number for each row; equal rows have equal numbers."""
    return distinct_rows(rows)[1]


def _orthogonal(vectors: Real, normal: Real) -> Real:
    """Return the components of vectors orthogonal to normals."""
    return vectors - normal * np.sum(vectors * normal, axis=-1, keepdims=True)


def _sum_over_groups(group: Index, values: Real) -> Real:
    """Return (m, 3, 3) sums of values (m, 3, 3) over corners of the same group (m, 3)."""
    flat = values.reshape(-1, 3)
    sums = np.stack([np.bincount(group.ravel(), flat[:, k]) for k in range(3)], axis=-1).astype(
        float, copy=False
    )
    return sums[group]


def _angles(corners: Real, normal: Real | None = None) -> Real:
    """Return (m, 3) angles at the corners of triangles (m, 3, 3), projected along normals of the corners if given."""
    a, b = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    if normal is not None:
        a, b = _orthogonal(a, normal), _orthogonal(b, normal)
    return np.arccos(np.clip(np.einsum("mki,mki->mk", unit_vectors(a), unit_vectors(b)), -1, 1))
