"""Meshes as planar shapes, by way of their flattening: its plane is the shape's, in the mesh's own units."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Box, Complex, Index, Real
from ...curve import Curve
from ...errors import InputError
from ...flattening.charts import LaidOut
from ...meshes import layout
from ...meshes.cut import vertex_path
from ...meshes.flatten import Flattening
from ...meshes.locate import Locator, barycentric
from ...meshes.mesh import face_areas
from ...meshes.surface import Surface
from ...pixels.texture import Placing, Texture, Wrap
from ...plane import triangle_areas
from ..meshes.mesh_format import MeshFile
from ..point_syntax import Place, vertex_of
from .shape import Shape


@dataclass(frozen=True, eq=False, kw_only=True)
class MeshShape(Shape):
    """A flattened mesh as a planar domain.

    Attributes:
        file: the mesh as its file holds it.
        flattening: its place in the plane.
        start: the vertex of the flattening at which the seam through pins begins; -1 where it runs elsewhere.
        chart: where it lies in the mesh's own texture coordinates, if its plane is theirs.
        also: corners of faces that the flattening does not have, and its vertices that these are at.
        packed: whether it is several pieces side by side; `curve` is then the outline of the largest.
    """

    is_mesh = True
    file: MeshFile
    flattening: Flattening
    start: int = -1
    chart: LaidOut | None = None
    packed: bool = False
    also: tuple[Index, Index] | None = None

    @property
    def domain(self) -> Curve | Flattening:
        """The mesh as it is flattened; the outline in the plane of the texture coordinates, if that was chosen."""
        return self.flattening if self.chart is None else self.curve

    @property
    def is_layout(self) -> bool:
        """Whether the plane is that of the mesh's own texture coordinates."""
        return self.chart is not None

    @property
    def mirror(self) -> float | None:
        """Of a mirrored chart the line about which the plane is mirrored, so that it is seen from outside."""
        return self.chart.mirror if self.chart else None

    def to_core(self, xy: ArrayLike) -> Complex:
        """Flat positions of the points of the surface nearest to (..., 3) points in space; (..., 2) points are flat
        already, or texture coordinates."""
        given = np.asarray(xy, dtype=float)
        if given.shape[-1] == 2:
            return self._seen(super().to_core(given * (self.aspect, 1)))
        points, faces = self._surface
        _, triangle, closest = self._tree.squared_distance(points, faces, given.reshape(-1, 3))
        triangle = np.atleast_1d(triangle)
        weights = barycentric(points[faces[triangle]], np.reshape(closest, (-1, 3)))
        flat = np.einsum("pk,pk->p", weights, self.flattening.flat[faces[triangle]])
        return flat.reshape(given.shape[:-1])

    def to_space(self, z: ArrayLike) -> Real:
        """Return (..., 3) points of the surface from complex points (...) of the flattening's plane."""
        flat = np.asarray(z, np.complex128)
        triangle, weights = self.locator(flat.ravel(), 1)
        points, faces = self._surface
        at = np.einsum("pk,pkc->pc", np.clip(weights, 0, 1), points[faces[triangle]])
        return at.reshape(*flat.shape, 3)

    def unit_at(self, z: complex) -> float:
        """Return the length in the plane of one unit of the file, near a point of the plane; in texture coordinates
        these are the units themselves.
        """
        if self.is_layout:
            return 1.0
        triangle, _ = self.locator(np.array([z]), 1)
        points, faces = self._surface
        corners = faces[triangle]
        flat_area = np.abs(triangle_areas(self.flattening.flat[corners]))
        return float(np.sqrt(flat_area / face_areas(points[corners]))[0])

    @cached_property
    def _surface(self) -> tuple[Real, Index]:
        patch = self.flattening.patch
        return np.ascontiguousarray(patch.points), np.ascontiguousarray(patch.faces)

    @cached_property
    def _tree(self) -> Any:
        """Finds the nearest triangle: libigl's tree of boxes."""
        import igl

        tree = igl.AABB()
        tree.init(*self._surface)
        return tree

    def to_file(self, z: ArrayLike) -> NDArray[np.float64]:
        """Flat positions, or texture coordinates (..., 2)."""
        return super().to_file(self._seen(np.asarray(z, dtype=complex))) / (self.aspect, 1)

    def _seen(self, z: Complex) -> Complex:
        """Return points of the layout as they lie in a mirrored plane, and back."""
        return z if self.mirror is None else 2 * self.mirror - z.conj()

    def vertex(self, number: int) -> complex:
        """Flat position of a vertex by its number in the file (from 1 in OBJ, from 0 elsewhere).

        Raises:
            InputError: there is no such vertex on the patch.
        """
        row = row_of(self.file, self.spec, number)
        return complex(self.flattening.flat[self.flattening.patch.flat_vertex(row)])

    def at(self, place: Place) -> complex:
        """Return a place that the user named: a vertex, a point in space, or one of the flattening's plane.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        return complex(self.to_core(place)) if number is None else self.vertex(number)

    def all_at(self, place: Place) -> list[complex]:
        """Return as `at`; on the seam that runs through pins each copy of the vertex that it goes through for this
        place, in the order around the outline from the first pin on.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        if self.start < 0 or (number is None and len(place) == 2):
            return [self.at(place)]
        patch, loop = self.flattening.patch, self.flattening.loop
        point = self.at(place)
        away = np.abs(self.flattening.flat - point) if number is not None else patch.points - np.array(place)
        flat = int(np.linalg.norm(away.reshape(len(patch.points), -1), axis=1).argmin())
        around = np.roll(loop, -int(np.flatnonzero(loop == self.start)[0]))
        copies = around[patch.vertex[around] == patch.vertex[flat]]
        return self.flattening.flat[copies].tolist() if copies.size else [point]

    def along(self, places: Sequence[Place], name: str) -> Curve:
        """Return the stroke through places; vertices alone are joined along the mesh's edges.

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

    @property
    def around(self) -> tuple[str, ...]:
        """The objects, groups and materials that its faces belong to, where the format names any."""
        return tuple(sorted(self.file.content.names_at(np.flatnonzero(self.file.faces))))

    def spread(self, spatial: bool) -> tuple[Real, Real, Real]:
        """Return those in space, seen from the front (x right, y up), unless the plane is that of texture
        coordinates.
        """
        if self.is_layout and not spatial:
            middle, low, high = super().spread(False)
            middle[0] = self._seen(np.array(complex(middle[0]))).real
            return middle, low, high
        points = self.flattening.patch.points
        corners = points[self.flattening.patch.faces]
        middle = np.average(corners.mean(axis=1), axis=0, weights=face_areas(corners) + 1e-300)
        return middle, points.min(axis=0), points.max(axis=0)

    @cached_property
    def locator(self) -> Locator:
        """Finds the triangle under a point of the plane."""
        return Locator(self.flattening)

    @property
    def pictures(self) -> tuple[Path | bytes, ...]:
        """The textures that an OBJ's materials name, or the content of the one that another format holds."""
        return (self.file.picture,) if self.file.picture else tuple(self.file.textures())

    def placing(self, texture: Texture, tiles: Box | None = None) -> Placing:
        """Return where points of the flattening lie in a texture: by the mesh's own texture coordinates.

        Raises:
            InputError: it has none.
        """
        faces = self.uv_faces
        height, width = texture.pixels.shape[:2]
        return Surface.of(self.locator, self.uv[faces], (width, height), tiles, self.wrap)

    @property
    def wrap(self) -> Wrap:
        """What its material says."""
        return self.file.wrap

    @property
    def tiles(self) -> set[complex]:
        """Lower left corners of the unit squares of the layout that the middles of its triangles are in.

        Raises:
            InputError: as for `uv_faces`.
        """
        middle = np.floor(self.uv[self.uv_faces].mean(axis=1))
        return {complex(u, v) for u, v in np.unique(middle, axis=0)}

    @property
    def corners(self) -> tuple[Index, Index]:
        """The vertex of the flattening at each corner of the file's polygons, and the corners of each triangle.

        A corner that no triangle has, as at an edge without length, is where the nearest one of its polygon is.
        """
        patch, mesh = self.flattening.patch, self.file.mesh
        known = np.zeros(len(mesh.points), np.int64)  # for corners of what has no area and is not a triangle
        known[patch.vertex] = np.arange(patch.vertex.size)
        found = known[mesh.corners]
        found[patch.corner] = patch.faces
        shown = np.zeros(found.size, bool)
        shown[patch.corner] = True
        partly = np.add.reduceat(shown, mesh.starts[:-1], dtype=np.int64)
        for face in np.flatnonzero((partly > 0) & (partly < mesh.sizes)):
            own = np.arange(*mesh.starts[face : face + 2])
            at = mesh.points[mesh.corners[own]]
            away = np.linalg.norm(at[:, None] - at[shown[own]], axis=2)
            found[own] = found[own[shown[own]][np.argmin(away, axis=1)]]
        if self.also is not None:
            found[self.also[0]] = self.also[1]
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
            raise InputError(f"{self.spec}: has no texture coordinates; create them with iccm flatten --uv")
        return self.file.mesh.uv

    @property
    def uv_faces(self) -> Index:
        """(m, 3) texture coordinate of each triangle's corner, in the file's own layout.

        Raises:
            InputError: the mesh has no texture coordinates everywhere, or some that are not finite or too large.
        """
        mesh, uv = self.file.mesh, self.uv
        assert mesh.uv_corners is not None
        faces = mesh.uv_corners[self.flattening.patch.corner]
        missing, broken = faces < 0, ~(np.abs(uv[faces]) <= layout.MOST_COORDINATE).all(axis=-1)
        if (missing | broken).any():
            triangle, corner = np.argwhere(missing | broken)[0]
            face = np.searchsorted(mesh.starts, self.flattening.patch.corner[triangle, 0], side="right") - 1
            what = (
                "has no texture coordinates"
                if missing[triangle, corner]
                else f"its texture coordinates are not finite, or larger than {layout.MOST_COORDINATE:g}"
            )
            raise InputError(f"{self.spec}: {mesh.face_name(int(face))}: {what}")
        return faces

    @property
    def beyond_unit(self) -> int:
        """How many triangles have texture coordinates outside 0..1.

        Raises:
            InputError: as for `uv_faces`.
        """
        return int(layout.outside(self.uv[self.uv_faces]).sum())


def as_mesh(shape: Shape) -> MeshShape:
    """Return the shape as the mesh that it is.

    Raises:
        InputError: it is none.
    """
    if not isinstance(shape, MeshShape):
        raise InputError(f"{shape.spec}: not a mesh")
    return shape


def row_of(file: MeshFile, spec: str, number: int) -> int:
    """Return where a vertex stands in the mesh, by its number in the file (from 1 in OBJ, from 0 elsewhere).

    Raises:
        InputError: there is no such vertex.
    """
    mesh = file.mesh
    if not 0 <= number - mesh.base < len(mesh.points):
        raise InputError(
            f"{spec}: there is no vertex {number}; the mesh has {len(mesh.points)} vertices, "
            f"starting at {mesh.base}"
        )
    return number - mesh.base
