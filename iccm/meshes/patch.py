"""A part of a mesh that can be flattened: one valid, oriented disk, with or without holes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Flags, Index, Real
from ..errors import InputError
from .borders import GENERIC_DIRECTIONS, preferred_edges, seam_lengths
from .mesh import Mesh, face_areas, fans
from .topology import Triangles, firsts


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of a mesh with their own vertex numbers; a vertex on a cut occurs once for each side.

    Attributes:
        mesh: the mesh to which they belong.
        points: (p, 3) positions.
        triangles: the (m, 3) faces over these, with consistent orientation.
        vertex: (p,) vertex of the mesh for each point.
        corner: (m, 3) corner of the mesh for each triangle's corner.
        seam: (s, 2) vertices of the mesh at the ends of the edges that were cut.
        notes: messages about repairs.
        follows_borders: whether further cuts prefer edges where the file has a border.
    """

    mesh: Mesh
    points: Real
    triangles: Triangles
    vertex: Index
    corner: Index
    seam: Index = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    notes: tuple[str, ...] = ()
    follows_borders: bool = False

    @classmethod
    def of_pieces(cls, mesh: Mesh, pieces: "Sequence[Patch]", corners: Sequence[Index]) -> "Patch":
        """Join several patches into one, with vertices and triangles in order, and without their notes.

        Args:
            mesh: the mesh to which they all belong.
            pieces: the patches.
            corners: for each patch (m, 3), the corners of that mesh for those of its triangles.
        """
        firsts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
        faces = np.concatenate([piece.faces + first for piece, first in zip(pieces, firsts)])
        return cls(
            mesh,
            np.concatenate([piece.points for piece in pieces]),
            Triangles(faces, int(firsts[-1])),
            np.concatenate([piece.vertex for piece in pieces]),
            np.concatenate(list(corners)),
            np.concatenate([piece.seam for piece in pieces]),
        )

    @property
    def faces(self) -> Index:
        """Vertices of the triangles; shape (m, 3)."""
        return self.triangles.faces

    @cached_property
    def loops(self) -> list[Index]:
        """Boundary loops, the longest in space first, each with the surface on its left."""
        return sorted(self.triangles.loops(), key=lambda loop: -self._length(loop))

    def _length(self, loop: Index) -> float:
        return float(np.linalg.norm(self.points[loop] - self.points[np.roll(loop, -1)], axis=1).sum())

    def loop_of(self, original: "Patch", loop: Index) -> Index:
        """Return the boundary loop that contains a loop of the patch from which this one was cut."""
        half = np.flatnonzero((original.triangles.twin < 0) & (original.triangles.tail == loop[0]))[0]
        vertex = self.triangles.tail[half]
        return next(candidate for candidate in self.loops if vertex in candidate)

    @property
    def seam_length(self) -> float:
        """Length of the edges that were cut, relative to the square root of the patch's area."""
        ends = self.mesh.points[self.seam]
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
        return float(length / np.sqrt(self.areas.sum()))

    @cached_property
    def areas(self) -> Real:
        """Areas of the triangles; shape (m,)."""
        return face_areas(self.points[self.faces])

    @cached_property
    def drawn(self) -> NDArray[np.bool_]:
        """(3m,) whether a half-edge is on an edge of the file's polygons, rather than a diagonal.

        Cuts follow only these.
        """
        face = self.polygon
        twin = self.triangles.twin
        half_edge_face = np.repeat(face, 3)
        return (twin < 0) | (half_edge_face != half_edge_face[twin])

    @cached_property
    def preferred(self) -> Flags:
        """(3m,) whether a half-edge is a border in the file, where a seam is preferred."""
        if not self.follows_borders:
            return np.zeros(self.triangles.twin.size, bool)
        return preferred_edges(self.mesh, self.triangles, self.corner)

    @cached_property
    def seam_lengths(self) -> Real:
        """(3m,) lengths of half-edges for shortest seams, see `borders.seam_lengths`."""
        return seam_lengths(self.points, self.triangles, self.preferred)

    def paths(self, sources: Index, *, rims: bool = True) -> tuple[Real, Index]:
        """Return the shortest seams from vertices, along edges of polygons; see `Triangles.paths`."""
        return self.triangles.paths(self.points, sources, self.drawn, lengths=self.seam_lengths, rims=rims)

    @property
    def first_vertex(self) -> int:
        """The vertex at which searches start: the lowest in a generic direction, whatever the order of vertices."""
        return int(np.argmin(self.points @ GENERIC_DIRECTIONS[0]))

    @cached_property
    def fans(self) -> tuple[Index, Index]:
        """(k, 3) vertices of the triangles of all fans of its polygons (see `mesh.fans`), and (k,) the face of each."""
        corners, face = fans(self.mesh)
        vertex = np.full(self.mesh.corners.size, -1)
        vertex[self.corner] = self.faces
        is_reversed = np.zeros(self.mesh.sizes.size, bool)  # faces with opposite orientation in the patch
        is_reversed[self.polygon] = (np.roll(self.corner, -1, axis=1) < self.corner).sum(axis=1) == 2
        triangles = vertex[corners]
        triangles = np.where(is_reversed[face][:, None], triangles[:, ::-1], triangles)
        complete = (triangles >= 0).all(axis=1)
        return triangles[complete], face[complete]

    @property
    def polygon(self) -> Index:
        """The face of the mesh to which each triangle belongs; shape (m,)."""
        return np.searchsorted(self.mesh.starts, self.corner[:, 0], side="right") - 1

    @property
    def genus(self) -> int:
        """Number of handles."""
        euler = self.triangles.count - self.triangles.edge_count + len(self.faces)
        return (2 - euler - len(self.loops)) // 2

    def flat_vertex(self, vertex: int) -> int:
        """Return the first of the patch's vertices for a vertex of the mesh.

        Raises:
            InputError: the patch does not use that vertex.
        """
        vertices = np.flatnonzero(self.vertex == vertex)
        if not vertices.size:
            raise InputError(
                f"{self.mesh.name}: {self.mesh.vertex_name(vertex)}: no face of the patch uses it"
            )
        return int(vertices[0])

    def cut(self, half_edges: NDArray[np.bool_]) -> "Patch":
        """Return the patch cut open along the edges of the marked half-edges (3m,)."""
        fan = self.triangles.fans(half_edges)
        first = firsts(fan, int(fan.max()) + 1)
        old = self.triangles.tail[first]
        inner = np.flatnonzero(half_edges & (self.triangles.twin > np.arange(half_edges.size)))
        edges = np.column_stack(
            [self.vertex[self.triangles.tail[inner]], self.vertex[self.triangles.head[inner]]]
        )
        return Patch(
            self.mesh,
            self.points[old],
            Triangles(fan.reshape(-1, 3), first.size),
            self.vertex[old],
            self.corner,
            np.concatenate([self.seam, edges]),
            self.notes,
            self.follows_borders,
        )


def patch_of(name: str, points: Real, faces: Index) -> Patch:
    """Return triangles (m, 3) between points (n, 3), a valid surface, as a separate patch."""
    mesh = Mesh.triangles(name, points, faces)
    return Patch(
        mesh,
        mesh.points,
        Triangles(faces, len(points)),
        np.arange(len(points)),
        np.arange(faces.size).reshape(-1, 3),
    )
