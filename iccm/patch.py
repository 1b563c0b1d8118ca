"""A piece of a mesh that can be flattened: one sound, oriented disk, with or without holes."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .curve import Real
from .errors import InputError
from .mesh import Index, Mesh, checked, triangulated
from .topology import Triangles


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of a mesh with numbers of their own; a vertex on a cut appears once for each side.

    Attributes:
        mesh: where they come from.
        points: (p, 3) positions.
        triangles: the (m, 3) faces over them, oriented alike.
        vertex: (p,) vertex of the mesh behind each.
        corner: (m, 3) corner of the mesh behind each triangle's corner.
        seam: (s, 2) vertices of the mesh joined by the edges that were cut.
        notes: what was set right on the way.
    """

    mesh: Mesh
    points: Real
    triangles: Triangles
    vertex: Index
    corner: Index
    seam: Index = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    notes: tuple[str, ...] = ()

    @property
    def faces(self) -> Index:
        """(m, 3) vertices of the triangles."""
        return self.triangles.faces

    @cached_property
    def loops(self) -> list[Index]:
        """Boundary loops, the longest in space first, each with the surface on its left."""
        return sorted(self.triangles.loops(), key=lambda loop: -self._length(loop))

    def _length(self, loop: Index) -> float:
        return float(np.linalg.norm(self.points[loop] - self.points[np.roll(loop, -1)], axis=1).sum())

    @cached_property
    def drawn(self) -> NDArray[np.bool_]:
        """(3m,) which half-edges are edges of the file's polygons, not diagonals: only along these may a cut run."""
        face = np.searchsorted(self.mesh.starts, self.corner[:, 0], side="right")
        twin = self.triangles.twin
        own = np.repeat(face, 3)
        return (twin < 0) | (own != own[twin])

    @property
    def genus(self) -> int:
        """Number of handles."""
        euler = self.triangles.count - self.triangles.edge_count + len(self.faces)
        return (2 - euler - len(self.loops)) // 2

    def flat_vertex(self, vertex: int) -> int:
        """The first of the patch's vertices that stands for a vertex of the mesh.

        Raises:
            InputError: the patch does not use that vertex.
        """
        found = np.flatnonzero(self.vertex == vertex)
        if not found.size:
            raise InputError(
                f"{self.mesh.name}: {self.mesh.vertex_name(vertex)}: no face of the patch uses it"
            )
        return int(found[0])

    def cut(self, half_edges: NDArray[np.bool_]) -> "Patch":
        """The patch opened along the edges under the marked half-edges (3m,)."""
        fan = self.triangles.fans(half_edges)
        first = np.unique(fan, return_index=True)[1]
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
        )


def patch(mesh: Mesh, *, cut: bool = False) -> Patch:
    """The mesh as one piece that can be flattened.

    Coinciding vertices are joined when only that makes the mesh one piece, faces turned the other way are turned, and
    with `cut` a closed surface or one with handles is opened.

    Raises:
        InputError: naming the first element at fault (see `mesh.checked`), or an edge with more than two faces, a
            second piece, a one-sided surface, a vertex where the surface touches itself, a closed surface, a handle.
    """
    corner = triangulated(checked(mesh))
    vertex, faces = np.unique(mesh.corners[corner].ravel(), return_inverse=True)
    shape = Triangles(faces.reshape(-1, 3).astype(np.int64), vertex.size)
    notes: list[str] = []
    unused = len(mesh.points) - vertex.size
    if unused and mesh.whole:
        notes.append(f"{unused} vertices that no face of it uses are left out")
    shape, vertex = _in_one_piece(mesh, shape, vertex, notes)
    shape, corner = _one_sided_refused(mesh, shape, corner, vertex, notes)
    _touching_refused(mesh, shape, vertex)
    whole = Patch(mesh, mesh.points[vertex], shape, vertex, corner, notes=tuple(notes))
    if whole.loops and whole.genus == 0:
        return whole
    if not cut:
        handles = f"has {whole.genus} handle{'s' if whole.genus > 1 else ''}"
        what = handles if whole.genus else "is closed"
        raise InputError(
            f"{mesh.name}: the surface {what}, so it cannot be flattened whole; "
            "name a part of it (file#group) or open it with --cut"
        )
    from .seam import opened

    return opened(whole)


def _in_one_piece(mesh: Mesh, shape: Triangles, vertex: Index, notes: list[str]) -> tuple[Triangles, Index]:
    """The triangles, with coinciding vertices joined if that is what it takes to connect them."""
    _crowded_refused(mesh, shape, vertex)
    piece = shape.components()
    if not piece.any():
        return shape, vertex
    _, first, joined = np.unique(mesh.points[vertex], axis=0, return_index=True, return_inverse=True)
    welded = Triangles(joined.ravel()[shape.faces], first.size)
    distinct = (welded.faces != np.roll(welded.faces, 1, axis=1)).all()
    if distinct and welded.crowded_edge() is None and not welded.components().any():
        notes.append(f"{vertex.size - first.size} vertices that coincide with another are joined to it")
        return welded, vertex[first]
    v = vertex[shape.faces[np.flatnonzero(piece)[0], 0]]
    where = mesh.vertex_name(int(v))
    raise InputError(
        f"{mesh.name}: {piece.max() + 1} pieces that no edge connects; the second one begins at {where}; "
        "name one of them (file#group)"
    )


def _crowded_refused(mesh: Mesh, shape: Triangles, vertex: Index) -> None:
    crowded = shape.crowded_edge()
    if crowded is not None:
        a, b = (mesh.vertex_name(int(vertex[v])) for v in crowded)
        raise InputError(
            f"{mesh.name}: the edge from {a} to {b} has more than two faces; remove the extra ones"
        )


def _one_sided_refused(
    mesh, shape: Triangles, corner: Index, vertex: Index, notes
) -> tuple[Triangles, Index]:
    result = shape.oriented()
    if result is None:
        same = np.flatnonzero((shape.twin >= 0) & (shape.tail == shape.tail[shape.twin]))[0]
        a, b = (mesh.vertex_name(int(vertex[v[same]])) for v in (shape.tail, shape.head))
        raise InputError(
            f"{mesh.name}: the surface is one-sided, like a Möbius strip: no orientation of the faces agrees "
            f"across the edge from {a} to {b}; cut it there"
        )
    turned, number = result
    if number:
        notes.append(f"{number} triangles turned the other way are turned to agree with the rest")
        flip = (turned.faces != shape.faces).any(axis=1)
        corner = np.where(flip[:, None], corner[:, ::-1], corner)
    return turned, corner


def _touching_refused(mesh: Mesh, shape: Triangles, vertex: Index) -> None:
    fan = shape.fans()
    pairs = np.unique(shape.tail * (fan.max() + 1) + fan) // (fan.max() + 1)
    touching = np.flatnonzero(np.diff(pairs) == 0)
    if touching.size:
        v = mesh.vertex_name(int(vertex[pairs[touching[0]]]))
        raise InputError(f"{mesh.name}: {v}: the surface touches itself there (a bow tie); split the vertex")
