"""Convert a mesh to one patch that can be flattened: join, split, orient and open it, or reject it with a reason."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Flags, Index, Real, distinct_rows, unit_vectors
from ..errors import InputError
from ..sorting import grouped
from .cut import cut_through, open_to_disk
from .mesh import Mesh, check, face_areas, proper, triangulate
from .patch import Patch
from .topology import Triangles, firsts, labels

SAME_PLACE_SHARE = 1e-6
"""Relative to the diagonal: vertices this close coincide. Programs that write a vertex for each face compute their
positions in single precision, which rounds to a tenth of this."""

GENERIC_DIRECTION = unit_vectors(np.array([0.439, 0.617, 0.653]))
"""A unit vector that is perpendicular to no edge or face of models that people draw."""
MOST_COMPARED_POINTS = 32
"""Along this direction, with which each point is compared."""


@dataclass(frozen=True, eq=False)
class Joined:
    """The triangles of a mesh, with coinciding vertices joined if that makes fewer pieces.

    Attributes:
        mesh: the mesh.
        shape: the triangles.
        corner: (m, 3) corner of the mesh for each triangle's corner.
        vertex: (n,) vertex of the mesh for each of theirs.
        notes: messages about repairs.
        hidden: triangles that `shape` leaves out, but that are seen from another side: backs of sheets, and walls
            between cells.
    """

    mesh: Mesh
    shape: Triangles
    corner: Index
    vertex: Index
    notes: tuple[str, ...] = ()
    hidden: "Joined | None" = None

    @classmethod
    def of(cls, mesh: Mesh) -> "Joined":
        """Return all triangles; a mesh keeps the result, as pieces are counted first and read later.

        Raises:
            InputError: names the first invalid element (see `mesh.check`).
        """
        if "joined" not in mesh.__dict__:
            mesh.__dict__["joined"] = cls._of(mesh)
        joined: Joined = mesh.__dict__["joined"]
        return joined

    @classmethod
    def _of(cls, mesh: Mesh) -> "Joined":
        corner = triangulate(check(mesh))
        in_triangles, in_faces = (np.zeros(len(mesh.points), bool) for _ in range(2))
        in_triangles[mesh.corners[corner]] = in_faces[mesh.corners] = True
        vertex, number = np.flatnonzero(in_triangles), np.cumsum(in_triangles) - 1
        shape = Triangles(number[mesh.corners[corner]], vertex.size)
        unused = int((~in_faces).sum())
        notes = [f"ignored {unused} vertices that belong to no face"] if unused and mesh.whole else []
        return cls(mesh, shape, corner, vertex, tuple(notes))._collapsed()._welded()._single()._mended()

    def _collapsed(self) -> "Joined":
        """Collapse edges without length to a vertex, such as a pole that is written as a row of vertices."""
        points, faces = self.mesh.points[self.vertex], self.shape.faces
        tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        short = (points[tail] == points[head]).all(axis=1)
        if not short.any():
            return self
        joined = labels(tail[short], head[short], self.vertex.size)
        first = firsts(joined, joined.max() + 1)
        proper_faces = proper(joined[faces])
        if not proper_faces.any():
            return self
        note = f"collapsed {self.vertex.size - first.size} edges without length"
        shape = Triangles(joined[faces[proper_faces]], first.size)
        return Joined(self.mesh, shape, self.corner[proper_faces], self.vertex[first], (*self.notes, note))

    def _single(self) -> "Joined":
        """Keep one of several triangles with the same three vertices, if edges have more than two.

        Of a two-sided surface one side is kept. Triangles between two cells of a solid are removed if its
        surface is closed without them. Removed triangles are `hidden` if they are not copies of one that stays, and
        not backs in the midst of a surface, which are a fault of the file and seen by nobody: the back of a sheet
        begins at its rim.
        """
        if not self.shape.crowded_edges:
            return self
        first, group = distinct_rows(np.sort(self.shape.faces, axis=1))
        times = np.bincount(group)[group]
        if (times == 1).all():
            return self
        surface = Triangles(self.shape.faces[times == 1], self.shape.count)
        if (times == 1).any() and (surface.twin >= 0).all() and not surface.crowded_edges:
            single, reason = np.flatnonzero(times == 1), "between cells"
        else:
            single, reason = np.sort(first), "with the corners of another"
        note = f"ignored {times.size - single.size} triangles {reason}"
        # one for each set of corners and each side
        seen = distinct_rows(np.column_stack([group, _is_odd(self.shape.faces)]))[0]
        others = np.setdiff1d(seen, single)
        if reason != "between cells":
            others = others[_reach_rim(self.shape.faces[others], self.shape.faces[single], self.shape.count)]
        hidden = self._of_triangles(others, ())._single()._mended() if others.size else None
        return self._of_triangles(single, (*self.notes, note), hidden)

    def _of_triangles(
        self, triangles: Index, notes: tuple[str, ...], hidden: "Joined | None" = None
    ) -> "Joined":
        """Return some of the triangles, with the vertices that they use."""
        used, faces = np.unique(self.shape.faces[triangles], return_inverse=True)
        shape = Triangles(faces.reshape(-1, 3), used.size)
        return Joined(self.mesh, shape, self.corner[triangles], self.vertex[used], notes, hidden)

    def _mended(self) -> "Joined":
        """Cut edges with more than two faces, such that as much as possible stays one surface."""
        shape, old, count = self.shape.mended(self.mesh.points[self.vertex])
        if not count:
            return self
        note = f"cut along {count} edge{'s' if count > 1 else ''} with more than two faces"
        return replace(self, shape=shape, vertex=self.vertex[old], notes=(*self.notes, note))

    def _welded(self) -> "Joined":
        """Join coinciding vertices, if that makes fewer pieces."""
        pieces = self.shape.components().max(initial=0)
        if not pieces:
            return self
        first, joined = _places(self.mesh.points[self.vertex])
        faces = joined[self.shape.faces]
        proper_faces = proper(faces)
        welded = Triangles(faces[proper_faces], first.size)
        if not proper_faces.any() or welded.components().max() >= pieces:
            return self
        note = f"merged {self.vertex.size - first.size} vertices that coincide with others"
        return Joined(self.mesh, welded, self.corner[proper_faces], self.vertex[first], (*self.notes, note))

    @cached_property
    def areas(self) -> Real:
        """Areas of the connected pieces; shape (k,)."""
        label = self.shape.components()
        area = face_areas(self.mesh.points[self.vertex[self.shape.faces]])
        # Bincount returns integers if there are no triangles.
        return np.bincount(label, area).astype(float, copy=False)

    @cached_property
    def order(self) -> Index:
        """The pieces, largest first; shape (k,)."""
        return np.argsort(-self.areas, kind="stable")

    @cached_property
    def _by_piece(self) -> tuple[Index, Index]:
        """Triangles sorted by piece, and where those of each begin."""
        label = self.shape.components()
        return grouped(label, int(label.max(initial=-1)) + 1)

    def triangles_of(self, label: int) -> Index:
        """Return the triangles of a piece, given its number among the components."""
        order, starts = self._by_piece
        return order[starts[label] : starts[label + 1]]

    @property
    def sizes(self) -> list[int]:
        """Numbers of triangles of the pieces, largest area first."""
        return np.bincount(self.shape.components())[self.order].tolist()


def _is_odd(faces: Index) -> Flags:
    """Return (m,) whether the corners of triangles (m, 3) are an odd permutation of their sorted order."""
    a, b, c = faces.T
    return (a > b) ^ (b > c) ^ (a > c)


def _reach_rim(backs: Index, fronts: Index, count: int) -> Flags:
    """Return (m,) whether the connected piece of each back (m, 3) has an edge on the rim of the fronts (k, 3)."""
    front, back = Triangles(fronts, count), Triangles(backs, count)
    rim = np.flatnonzero(front.twin < 0)
    keys = front.edge_key(front.tail[rim], front.head[rim])
    on_rim = np.isin(back.edge_key(back.tail, back.head), keys).reshape(-1, 3).any(axis=1)
    piece = back.components()
    return np.bincount(piece, on_rim, minlength=1)[piece] > 0


def _places(points: Real) -> tuple[Index, Index]:
    """Return the first of the points (n, 3) at each place, and (n,) the number of each point's place."""
    first, place = distinct_rows(points)
    reach = SAME_PLACE_SHARE * float(np.linalg.norm(np.ptp(points, axis=0)))
    near = close_pairs(points[first], reach)
    if not len(near):
        return first, place
    joined = labels(near[:, 0], near[:, 1], first.size)
    return first[firsts(joined, joined.max() + 1)], joined[place]


def close_pairs(points: Real, reach: float) -> Index:
    """Return (k, 2) pairs of points (n, 3) that are at most `reach` apart.

    Close points are close along any direction: those that follow each other there are compared, which takes a tenth of
    the time in which SciPy's trees are imported. Trees are used where many points have the same place along it.
    """
    along = points @ GENERIC_DIRECTION
    order = np.argsort(along)
    along = along[order]
    found = list[Index]()
    for step in range(1, MOST_COMPARED_POINTS):
        (close,) = np.nonzero(along[step:] - along[:-step] <= reach)
        if not close.size:
            return np.concatenate([np.empty((0, 2), np.int64), *found])
        pairs = np.column_stack([order[close], order[close + step]])
        apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        found.append(pairs[apart <= reach])
    from scipy.spatial import cKDTree

    return cKDTree(points).query_pairs(reach, output_type="ndarray")


def disk_patch(
    mesh: Mesh | Joined, *, cut: bool = False, piece: int = 1, through: Real | None = None
) -> Patch:
    """Return one piece of the mesh as a patch that can be flattened.

    Edges without length are collapsed, coinciding vertices are joined if that makes fewer pieces, edges with
    more than two faces are cut, vertices where the surface touches itself are split, and faces with the wrong
    orientation are flipped. With `cut`, a closed surface or one with handles is opened.

    Args:
        mesh: any mesh.
        cut: whether it may be cut open.
        piece: number of the connected piece, 1 having the largest area.
        through: (k, 3) points, at least two; a closed surface without handles is cut through their nearest
            vertices.

    Raises:
        InputError: names the first invalid element (see `mesh.check`); there is no such piece, or it has no
            area; the surface is one-sided, closed, or has a handle; or there is no seam through the points.
    """
    return open_piece(sound_piece(mesh, piece), cut=cut, through=through)


def open_piece(whole: Patch, *, cut: bool, through: Real | None = None) -> Patch:
    """Return a valid piece, cut open to a disk if necessary; arguments and errors as for `disk_patch`."""
    if whole.loops and whole.genus == 0:
        return whole
    if not cut:
        handles = f"has {whole.genus} handle{'s' if whole.genus > 1 else ''}"
        obstacle = handles if whole.genus else "is closed"
        raise InputError(
            f"{whole.mesh.name}: the surface {obstacle} and cannot be flattened as a whole; choose a part of "
            "it (file#group), or allow it to be cut open (leave --no-cut out; in Python, cut_open=True)"
        )
    if through is not None and not whole.genus:
        stops = nearest(whole, through)
        if len(set(stops)) == len(stops):
            return cut_through(whole, stops)
    return open_to_disk(whole)


def sound_piece(mesh: Mesh | Joined, piece: int = 1) -> Patch:
    """Return one piece of the mesh, valid and oriented, but not cut open; arguments and errors as for `disk_patch`."""
    joined = mesh if isinstance(mesh, Joined) else Joined.of(mesh)
    mesh, vertex, notes = joined.mesh, joined.vertex, list(joined.notes)
    shape, corner = _one_piece(joined, piece, notes)
    used = np.zeros(shape.count, bool)
    used[shape.faces] = True
    if not used.all():
        number = np.cumsum(used) - 1
        shape, vertex = Triangles(number[shape.faces], int(used.sum())), vertex[used]
    shape, corner = _orient(mesh, shape, corner, vertex, notes)
    shape, vertex = split_non_manifold(shape, vertex, notes)
    return Patch(mesh, mesh.points[vertex], shape, vertex, corner, notes=tuple(notes))


def nearest(whole: Patch, points: Real) -> list[int]:
    """Return the vertices nearest to points (k, 3)."""
    return [int(np.argmin(((whole.points - point) ** 2).sum(axis=1))) for point in points]


def _one_piece(joined: Joined, piece: int, notes: list[str]) -> tuple[Triangles, Index]:
    """Return the triangles of the piece with the piece-th largest area."""
    shape, area, name = joined.shape, joined.areas, joined.mesh.name
    if area.size and not 1 <= piece <= area.size:
        raise InputError(f"{name}: there is no piece {piece}; choose 1 (the largest) to {area.size}")
    chosen_piece = joined.order[piece - 1] if area.size else 0
    if not area.size or not area[chosen_piece] > 0:
        raise InputError(f"{name}: no face has an area; does the file contain only lines?")
    if area.size == 1:
        return shape, joined.corner
    triangles = joined.triangles_of(int(chosen_piece))
    plural, ignored = "s" if area.size > 2 else "", len(shape.faces) - triangles.size
    others = f"{area.size - 1} other piece{plural} of {ignored} triangles"
    notes.append(
        f"ignored {others} that are not connected to it; #piece-{2 if piece == 1 else 1} selects another"
    )
    return Triangles(shape.faces[triangles], shape.count), joined.corner[triangles]


def _orient(mesh, shape: Triangles, corner: Index, vertex: Index, notes) -> tuple[Triangles, Index]:
    result = shape.oriented()
    if result is None:
        edge = np.flatnonzero((shape.twin >= 0) & (shape.tail == shape.tail[shape.twin]))[0]
        a, b = (mesh.vertex_name(int(vertex[v[edge]])) for v in (shape.tail, shape.head))
        raise InputError(
            f"{mesh.name}: the surface is one-sided, like a Möbius strip; cut it, for instance along the "
            f"edge from {a} to {b}"
        )
    oriented, number = result
    if number:
        notes.append(f"flipped {number} triangles to the orientation of the rest")
        flip = (oriented.faces != shape.faces).any(axis=1)
        corner = np.where(flip[:, None], corner[:, ::-1], corner)
    return oriented, corner


def split_non_manifold(shape: Triangles, vertex: Index, notes: list[str]) -> tuple[Triangles, Index]:
    """Split vertices so that there is one for every fan of triangles, which separates crowded edges and bow ties."""
    crowded = shape.crowded_edges
    fan = shape.fans()
    apart = shape.apart(fan)
    old = shape.tail[firsts(fan, apart.count)]
    split = int(old.size - np.count_nonzero(np.bincount(old)))
    if crowded:
        notes.append(f"cut along {crowded} edge{'s' if crowded > 1 else ''} with more than two faces")
    elif split:
        notes.append(f"split at {split} vert{'ices' if split > 1 else 'ex'} where the surface touches itself")
    return apart, vertex[old]
