"""A mesh as one patch that can be flattened: joined, taken apart, oriented, opened, or refused with a reason."""

import numpy as np

from ..arrays import Index, Real
from ..errors import InputError
from .cut import opened, opened_through
from .mesh import Mesh, checked, face_areas, proper, triangulated
from .patch import Patch
from .topology import Triangles


def disk_patch(mesh: Mesh, *, cut: bool = False, piece: int = 1, through: Real | None = None) -> Patch:
    """One piece of the mesh, as a patch that can be flattened.

    Coinciding vertices are joined where that makes fewer pieces, edges with more than two faces are cut, vertices where
    the surface touches itself are split, faces turned the other way are turned, and with `cut` a closed surface or one
    with handles is opened.

    Args:
        mesh: any.
        cut: whether it may be cut open.
        piece: which of the pieces that no edge connects, 1 having the largest area.
        through: (k, 3) points, at least two, through whose nearest vertices a closed surface without handles is cut.

    Raises:
        InputError: naming the first element at fault (see `mesh.checked`); no such piece, or one without area; a
            one-sided surface, a closed one, a handle; no seam through the points.
    """
    notes: list[str] = []
    shape, corner, vertex = _joined(mesh, notes)
    shape, corner = _one_piece(mesh, shape, corner, vertex, piece, notes)
    shape, corner = _oriented(mesh, shape, corner, vertex, notes)
    shape, vertex = _taken_apart(shape, vertex, notes)
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
    if through is not None and not whole.genus:
        stops = [int(np.argmin(((whole.points - point) ** 2).sum(axis=1))) for point in through]
        if len(set(stops)) == len(stops):
            return opened_through(whole, stops)
    return opened(whole)


def pieces(mesh: Mesh) -> list[int]:
    """Numbers of triangles of the pieces that no edge connects, in the order of their areas.

    Raises:
        InputError: naming the first element at fault (see `mesh.checked`).
    """
    shape, _, vertex = _joined(mesh, [])
    label = shape.components()
    area = np.bincount(label, face_areas(mesh.points[vertex[shape.faces]]))
    return np.bincount(label)[np.argsort(-area, kind="stable")].tolist()


def _joined(mesh: Mesh, notes: list[str]) -> tuple[Triangles, Index, Index]:
    """The triangles, their corners and vertices; coinciding vertices are joined if that makes fewer pieces."""
    corner = triangulated(checked(mesh))
    vertex, faces = np.unique(mesh.corners[corner].ravel(), return_inverse=True)
    shape = Triangles(faces.reshape(-1, 3).astype(np.int64), vertex.size)
    unused = len(mesh.points) - np.unique(mesh.corners).size
    if unused and mesh.whole:
        notes.append(f"{unused} vertices that no face of it uses are left out")
    pieces = shape.components().max(initial=0)
    if not pieces:
        return shape, corner, vertex
    _, first, joined = np.unique(mesh.points[vertex], axis=0, return_index=True, return_inverse=True)
    faces = joined.ravel()[shape.faces]
    kept = proper(faces)
    welded = Triangles(faces[kept], first.size)
    if not kept.any() or welded.components().max() >= pieces:
        return shape, corner, vertex
    notes.append(f"{vertex.size - first.size} vertices that coincide with another are joined to it")
    return welded, corner[kept], vertex[first]


def _one_piece(mesh: Mesh, shape: Triangles, corner: Index, vertex: Index, piece: int, notes: list[str]):
    """The triangles of the piece that is the piece-th largest."""
    label = shape.components()
    area = np.bincount(label, face_areas(mesh.points[vertex[shape.faces]])) if label.size else np.zeros(0)
    if not 1 <= piece <= area.size:
        raise InputError(f"{mesh.name}: no piece {piece}; there are {area.size}, 1 is the largest")
    chosen = np.argsort(-area, kind="stable")[piece - 1]
    if not area[chosen] > 0:
        raise InputError(f"{mesh.name}: no face has an area; is this a mesh of lines?")
    own = label == chosen
    if area.size > 1:
        others = f"{area.size - 1} other piece{'s' if area.size > 2 else ''} of {(~own).sum()} triangles"
        notes.append(
            f"{others} that no edge connects to it left out; #piece-{2 if piece == 1 else 1} picks another"
        )
    return Triangles(shape.faces[own], shape.count), corner[own]


def _oriented(mesh, shape: Triangles, corner: Index, vertex: Index, notes) -> tuple[Triangles, Index]:
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


def _taken_apart(shape: Triangles, vertex: Index, notes: list[str]) -> tuple[Triangles, Index]:
    """A vertex for every fan of triangles: edges with more than two faces and bow ties come apart."""
    crowded = shape.crowded_edges
    fan = shape.fans()
    old = shape.tail[np.unique(fan, return_index=True)[1]]
    split = old.size - np.unique(old).size
    if crowded:
        notes.append(f"cut along {crowded} edge{'s' if crowded > 1 else ''} with more than two faces")
    elif split:
        notes.append(f"split at {split} vert{'ices' if split > 1 else 'ex'} where the surface touches itself")
    return Triangles(fan.reshape(-1, 3), old.size), vertex[old]
