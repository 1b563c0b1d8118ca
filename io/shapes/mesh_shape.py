"""Meshes as planar shapes, by way of their flattening: its plane is the shape's, in the mesh's own units."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Complex, Index, Real
from ...curve import Curve
from ...errors import InputError
from ...flattening import flatten
from ...meshes.cut import vertex_path
from ...meshes.disk_patch import disk_patch
from ...meshes.flatten import Flattening
from ...meshes.locate import Locator
from ...meshes.patch import Patch
from ...meshes.surface import Surface
from ...pixels.texture import Placing, Texture
from ..meshes import mesh_files
from ..meshes.obj import Obj
from ..places import Place, vertex_of
from .shape import Shape


@dataclass(frozen=True, eq=False, kw_only=True)
class MeshShape(Shape):
    """A flattened mesh as a planar domain.

    Attributes:
        file: the mesh as its file holds it.
        flattening: its place in the plane.
        start: the vertex of the flattening at which the seam through pins begins; -1 where it runs elsewhere.
    """

    is_mesh = True
    file: mesh_files.MeshFile
    flattening: Flattening
    start: int = -1

    @property
    def domain(self) -> Flattening:
        """The mesh as it is laid out."""
        return self.flattening

    def to_core(self, xy: ArrayLike) -> Complex:
        """Flat positions of (..., 3) points in space, by the nearest vertex; (..., 2) points are flat already."""
        given = np.asarray(xy, dtype=float)
        if given.shape[-1] == 2:
            return super().to_core(given)
        points = self.flattening.patch.points
        from scipy.spatial import cKDTree

        nearest = cKDTree(points).query(given.reshape(-1, 3))[1]
        return self.flattening.flat[nearest].reshape(given.shape[:-1])

    def vertex(self, number: int) -> complex:
        """Flat position of a vertex by its number in the file (from 1 in OBJ, from 0 elsewhere).

        Raises:
            InputError: there is no such vertex on the patch.
        """
        mesh = self.file.mesh
        if not 0 <= number - mesh.base < len(mesh.points):
            raise InputError(
                f"{self.spec}: no vertex {number}; it has {len(mesh.points)}, the first is {mesh.base}"
            )
        return complex(self.flattening.flat[self.flattening.patch.flat_vertex(number - mesh.base)])

    def at(self, place: Place) -> complex:
        """A place that the user named: a vertex, a point in space, or one of the flattening's plane.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        return complex(self.to_core(place)) if number is None else self.vertex(number)

    def all_at(self, place: Place) -> list[complex]:
        """As `at`; each copy of a vertex on the seam that runs through pins, in the order around the outline from the
        first pin on.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        if self.start < 0 or (number is None and len(place) == 2):
            return [self.at(place)]
        patch, loop = self.flattening.patch, self.flattening.loop
        flat = int(np.flatnonzero(self.flattening.flat == self.at(place))[0])
        around = np.roll(loop, -int(np.flatnonzero(loop == self.start)[0]))
        copies = around[patch.vertex[around] == patch.vertex[flat]]
        return self.flattening.flat[copies if copies.size else [flat]].tolist()

    def along(self, places: Sequence[Place], name: str) -> Curve:
        """The stroke through places; vertices alone are joined along the mesh's edges.

        Raises:
            InputError: fewer than two different vertices, or one that is not on the patch.
        """
        numbers = [number for place in places if (number := vertex_of(place)) is not None]
        if len(numbers) < len(places):
            return super().along(places, name)
        for number in numbers:
            self.vertex(number)  # says what is wrong with it
        stops = [self.flattening.patch.flat_vertex(n - self.file.mesh.base) for n in numbers]
        if len(set(stops)) < 2:
            raise InputError(f"{self.spec}: a stroke needs at least 2 different vertices")
        way = vertex_path(self.flattening.patch, stops)
        return Curve.stroke(self.flattening.flat[way], f"{self.spec}: stroke")

    @cached_property
    def locator(self) -> Locator:
        """Finds the triangle under a point of the plane."""
        return Locator(self.flattening)

    @property
    def pictures(self) -> tuple[Path | bytes, ...]:
        """The textures that an OBJ's materials name, or the content of the one that another format holds."""
        return (self.file.picture,) if self.file.picture else tuple(mesh_files.textures_of(self.file))

    def placing(self, texture: Texture) -> Placing:
        """Where points of the flattening lie in a texture: by the mesh's own texture coordinates.

        Raises:
            InputError: it has none.
        """
        faces = self.uv_faces
        height, width = texture.pixels.shape[:2]
        return Surface.of(self.locator, self.uv[faces], (width, height))

    @property
    def corners(self) -> tuple[Index, Index]:
        """The vertex of the flattening at each corner of the file's polygons, and the corners of each triangle."""
        patch, vertices = self.flattening.patch, self.file.mesh.corners
        known = np.zeros(
            len(self.file.mesh.points), np.int64
        )  # for corners of what has no area and is no triangle
        known[patch.vertex] = np.arange(patch.vertex.size)
        found = known[vertices]
        found[patch.corner] = patch.faces
        return found, patch.corner

    @property
    def has_uv(self) -> bool:
        """Whether the file has texture coordinates."""
        return self.file.mesh.uv is not None

    @property
    def uv(self) -> Real:
        """(t, 2) the file's texture coordinates, v up.

        Raises:
            InputError: it has none.
        """
        if self.file.mesh.uv is None:
            raise InputError(
                f"{self.spec}: has no texture coordinates of its own; make them with iccm map … -o uv.obj"
            )
        return self.file.mesh.uv

    @property
    def uv_faces(self) -> Index:
        """(m, 3) texture coordinate of each triangle's corner, in the file's own layout.

        Raises:
            InputError: the mesh has no texture coordinates everywhere, or some that are not finite.
        """
        mesh, uv = self.file.mesh, self.uv
        assert mesh.uv_corners is not None
        faces = mesh.uv_corners[self.flattening.patch.corner]
        missing, broken = faces < 0, ~np.isfinite(uv[faces]).all(axis=-1)
        if (missing | broken).any():
            triangle, corner = np.argwhere(missing | broken)[0]
            face = np.searchsorted(mesh.starts, self.flattening.patch.corner[triangle, 0], side="right") - 1
            what = (
                "has no texture coordinates"
                if missing[triangle, corner]
                else "its coordinates are not finite"
            )
            raise InputError(f"{self.spec}: {mesh.face_name(int(face))}: {what}")
        return faces


def as_mesh(shape: Shape) -> MeshShape:
    """The shape as the mesh that it is.

    Raises:
        InputError: it is none.
    """
    if not isinstance(shape, MeshShape):
        raise InputError(f"{shape.spec}: is no mesh")
    return shape


def read(
    spec: str,
    *,
    cut: bool = False,
    whole: Obj | None = None,
    method: str = "conformal",
    pins: Sequence[Place] = (),
) -> MeshShape:
    """The flattened mesh that `file`, `file#part`, `file#loop` or `file#part#loop` names.

    Args:
        spec: a part is an OBJ object, group or material; a loop a number, 1 being the longest boundary.
        cut: whether a closed surface, or one with handles, may be cut open.
        whole: the content of the file, if it is an OBJ that was read.
        method: of flattening; see `flattening.flatten`.
        pins: vertices and points in space through which a closed surface is to be cut, in this order; none, or at
            least two.

    Raises:
        InputError: in one line, naming the first element at fault.
    """
    file = mesh_files.read(spec, whole)
    through = np.array([_point(file, spec, place) for place in pins]) if pins else None
    file, piece = _of_piece(file, cut, through)
    start = _start_of(piece, through)
    flat = flatten(piece, loop=file.loop, grow=cut and start < 0, method=method)
    curve = (
        Curve(flat.flat[flat.loop]) if method == "lscm" else flat.boundary
    )  # may cross itself, as it comes
    notes = [*file.notes, *flat.patch.notes, *flat.notes]
    if len(flat.patch.seam):
        notes.append(f"cut open along {len(flat.patch.seam)} edges")
    if len(flat.patch.loops) > 1:
        holes = len(flat.patch.loops) - 1
        notes.append(f"boundary loop {file.loop} of {holes + 1} is the outline, the others are holes")
    return MeshShape(
        spec=spec,
        path=file.path,
        curve=curve,
        box=curve.box,
        flip=False,
        pins={},
        strokes={},
        notes=tuple(notes),
        file=file,
        flattening=flat,
        start=start,
        **_holes(file, flat),
    )


def _point(file: mesh_files.MeshFile, spec: str, place: Place) -> Real:
    """A vertex, or a point in space.

    Raises:
        InputError: there is no such vertex.
    """
    number, mesh = vertex_of(place), file.mesh
    if number is None:
        return np.array(place)
    if not 0 <= number - mesh.base < len(mesh.points):
        raise InputError(f"{spec}: no vertex {number}; it has {len(mesh.points)}, the first is {mesh.base}")
    return mesh.points[number - mesh.base]


def _start_of(piece: Patch, through: Real | None) -> int:
    """The vertex of a patch at the end of the seam through points (k, 3); -1 where there is no such seam."""
    if through is None or not len(piece.seam):
        return -1
    outline = piece.loops[0]
    first = outline[np.argmin(((piece.points[outline] - through[0]) ** 2).sum(axis=1))]
    alone = np.count_nonzero(piece.vertex == piece.vertex[first]) == 1
    near = np.argmin(((piece.points - through[0]) ** 2).sum(axis=1))
    return int(first) if alone and piece.vertex[near] == piece.vertex[first] else -1


def _of_piece(
    file: mesh_files.MeshFile, cut: bool, through: Real | None
) -> tuple[mesh_files.MeshFile, Patch]:
    """The patch, and the file with no other faces than its own: those of other pieces stay as they are."""
    mesh, patch = file.mesh, disk_patch(file.mesh, cut=cut, piece=file.piece, through=through)
    own = np.zeros(mesh.sizes.size, bool)
    own[np.searchsorted(mesh.starts, patch.corner[:, 0], side="right") - 1] = True
    if own.all():
        return file, patch
    part, faces = mesh.part(own, mesh.name), file.faces.copy()
    faces[np.flatnonzero(faces)[~own]] = False
    number = np.cumsum(np.repeat(own, mesh.sizes)) - 1
    return replace(file, mesh=part, faces=faces), replace(patch, mesh=part, corner=number[patch.corner])


def _holes(file: mesh_files.MeshFile, flat: Flattening) -> dict[str, Any]:
    """The outlines of holes in the plane, and the objects, groups and materials around each."""
    loops = [loop for loop in flat.patch.loops if not np.array_equal(loop, flat.loop)]
    names = [_around(file, flat, loop) for loop in loops]
    return {"holes": tuple(flat.flat[loop] for loop in loops), "hole_names": tuple(names)}


def _around(file: mesh_files.MeshFile, flat: Flattening, loop: Index) -> tuple[str, ...]:
    if file.obj is None:
        return ()
    touching = np.isin(flat.patch.faces, loop).any(axis=1)
    face = np.searchsorted(file.mesh.starts, flat.patch.corner[touching, 0], side="right") - 1
    return tuple(sorted(file.obj.names_at(np.flatnonzero(file.faces)[np.unique(face)])))
