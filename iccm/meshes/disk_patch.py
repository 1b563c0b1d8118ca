"""A mesh as one patch that can be flattened: joined, oriented, opened, or refused by the element at fault."""

import numpy as np

from ..arrays import Index
from ..errors import InputError
from .cut import opened
from .mesh import Mesh, checked, triangulated
from .patch import Patch
from .topology import Triangles


def disk_patch(mesh: Mesh, *, cut: bool = False) -> Patch:
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
        "name one of them (file#group, or 'file#piece 1', the largest)"
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
