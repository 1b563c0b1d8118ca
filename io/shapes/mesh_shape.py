"""Flattened meshes as planar shapes: the plane is that of the flattening, in the mesh's units."""

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
from ...meshes.mesh import face_areas, polygon_areas
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
        file: the mesh and its file.
        flattening: its layout in the plane.
        start: vertex of the flattening at which the seam through pins begins; -1 if there is no such seam.
        chart: its chart, if the plane is that of the mesh's texture coordinates.
        also: corners of faces that the flattening does not have, and the vertices at their positions.
        packed: whether it consists of several pieces side by side; `curve` is then the outline of the largest.
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
        """The flattened mesh; or its outline, if the plane is that of the texture coordinates."""
        return self.flattening if self.chart is None else self.curve

    @property
    def is_layout(self) -> bool:
        """Whether the plane is that of the mesh's texture coordinates."""
        return self.chart is not None

    @property
    def share(self) -> float:
        """Share of the area of the file's geometry that belongs to the shape."""
        areas = polygon_areas(self.file.content.polygons)
        return float(areas[self.file.faces].sum() / max(areas.sum(), 1e-300))

    @property
    def mirror(self) -> float | None:
        """Abscissa of the line about which a mirrored chart's plane is reflected to show the outside; else None."""
        return self.chart.mirror if self.chart else None

    def to_core(self, xy: ArrayLike) -> Complex:
        """Return positions in the plane of (..., 3) points in space, by the nearest points of the surface.

        (..., 2) points are positions in the plane already, or texture coordinates.
        """
        positions = np.asarray(xy, dtype=float)
        if positions.shape[-1] == 2:
            return self._reflect(super().to_core(positions * (self.aspect, 1)))
        points, faces = self._surface
        _, triangle, closest = self._tree.squared_distance(points, faces, positions.reshape(-1, 3))
        triangle = np.atleast_1d(triangle)
        weights = barycentric(points[faces[triangle]], np.reshape(closest, (-1, 3)))
        flat = np.einsum("pk,pk->p", weights, self.flattening.flat[faces[triangle]])
        return flat.reshape(positions.shape[:-1])

    def to_space(self, z: ArrayLike) -> Real:
        """Return (..., 3) points of the surface for complex points (...) of the plane."""
        flat = np.asarray(z, np.complex128)
        triangle, weights = self.locator(flat.ravel(), 1)
        points, faces = self._surface
        points_in_space = np.einsum("pk,pkc->pc", np.clip(weights, 0, 1), points[faces[triangle]])
        return points_in_space.reshape(*flat.shape, 3)

    def unit_at(self, z: complex) -> float:
        """Return the length in the plane of one unit of the file near a point; 1 for texture coordinates."""
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
        """libigl's bounding volume tree for the nearest triangle."""
        import igl

        tree = igl.AABB()
        tree.init(*self._surface)
        return tree

    def to_file(self, z: ArrayLike) -> NDArray[np.float64]:
        """Convert complex points of the plane to (..., 2) flat positions, or to texture coordinates."""
        return super().to_file(self._reflect(np.asarray(z, dtype=complex))) / (self.aspect, 1)

    def _reflect(self, z: Complex) -> Complex:
        """Convert points between the layout and its reflected plane, in either direction."""
        return z if self.mirror is None else 2 * self.mirror - z.conj()

    def vertex(self, number: int) -> complex:
        """Return the position in the plane of a vertex, given its number in the file (from 1 in OBJ, else from 0).

        Raises:
            InputError: there is no such vertex on the patch.
        """
        row = row_of(self.file, self.spec, number)
        return complex(self.flattening.flat[self.flattening.patch.flat_vertex(row)])

    def at(self, place: Place) -> complex:
        """Return the position of a vertex, a point in space, or a point of the plane, as given by the user.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        return complex(self.to_core(place)) if number is None else self.vertex(number)

    def all_at(self, place: Place) -> list[complex]:
        """Return the position, as `at`, or the positions of all copies of a vertex on the seam through pins.

        Copies are in order around the outline, from the first pin.

        Raises:
            InputError: there is no such vertex on the patch.
        """
        number = vertex_of(place)
        if self.start < 0 or (number is None and len(place) == 2):
            return [self.at(place)]
        patch, loop = self.flattening.patch, self.flattening.loop
        point = self.at(place)
        if number is None:
            distances = np.linalg.norm(patch.points - np.array(place), axis=1)
        else:
            distances = np.abs(self.flattening.flat - point)
        nearest = int(distances.argmin())
        around = np.roll(loop, -int(np.flatnonzero(loop == self.start)[0]))
        copies = around[patch.vertex[around] == patch.vertex[nearest]]
        return self.flattening.flat[copies].tolist() if copies.size else [point]

    def along(self, places: Sequence[Place], name: str) -> Curve:
        """Return the stroke through places; if all are vertices, they are joined along the mesh's edges.

        Raises:
            InputError: fewer than two different vertices, or one that is not on the patch.
        """
        numbers = [number for place in places if (number := vertex_of(place)) is not None]
        if len(numbers) < len(places):
            return super().along(places, name)
        for number in numbers:
            self.vertex(number)  # raises if it is invalid
        stops = [self.flattening.patch.flat_vertex(n - self.file.mesh.base) for n in numbers]
        if len(set(stops)) < 2:
            raise InputError(f"{self.spec}: a stroke needs at least 2 different vertices")
        path = vertex_path(self.flattening.patch, stops)
        return Curve.stroke(self.flattening.flat[path], f"{self.spec}: stroke")

    @property
    def around(self) -> tuple[str, ...]:
        """The objects, groups and materials of its faces, if the format has names."""
        return tuple(sorted(self.file.content.names_at(np.flatnonzero(self.file.faces))))

    def spread(self, spatial: bool) -> tuple[Real, Real, Real]:
        """Return extents in space, seen from the front (x right, y up), or in the plane of texture coordinates."""
        if self.is_layout and not spatial:
            middle, low, high = super().spread(False)
            middle[0] = self._reflect(np.array(complex(middle[0]))).real
            return middle, low, high
        points = self.flattening.patch.points
        corners = points[self.flattening.patch.faces]
        middle = np.average(corners.mean(axis=1), axis=0, weights=face_areas(corners) + 1e-300)
        return middle, points.min(axis=0), points.max(axis=0)

    @cached_property
    def locator(self) -> Locator:
        """Locator of triangles under points of the plane."""
        return Locator.of(self.flattening)

    @property
    def pictures(self) -> tuple[Path | bytes, ...]:
        """The textures that an OBJ's materials refer to, or the content of the one inside another format."""
        return (self.file.picture,) if self.file.picture else tuple(self.file.textures())

    def placing(self, texture: Texture, tiles: Box | None = None) -> Placing:
        """Return how points of the flattening are placed in a texture: by the mesh's texture coordinates.

        Raises:
            InputError: it has none.
        """
        faces = self.uv_faces
        height, width = texture.pixels.shape[:2]
        return Surface.of(self.locator, self.uv[faces], (width, height), tiles, self.wrap)

    @property
    def wrap(self) -> Wrap:
        """The wrap mode of its material."""
        return self.file.wrap

    @property
    def tiles(self) -> set[complex]:
        """Lower left corners of the unit squares of the layout that contain centroids of its triangles.

        Raises:
            InputError: as for `uv_faces`.
        """
        middle = np.floor(self.uv[self.uv_faces].mean(axis=1))
        return {complex(u, v) for u, v in np.unique(middle, axis=0)}

    @property
    def corners(self) -> tuple[Index, Index]:
        """The vertex of the flattening at each corner of the file's polygons, and the corners of each triangle.

        A corner that is in no triangle, for example at an edge without length, gets the nearest one of its polygon.
        """
        patch, mesh = self.flattening.patch, self.file.mesh
        vertex_at = np.zeros(len(mesh.points), np.int64)  # for corners of polygons without area
        vertex_at[patch.vertex] = np.arange(patch.vertex.size)
        vertex_at_corner = vertex_at[mesh.corners]
        vertex_at_corner[patch.corner] = patch.faces
        is_in_triangle = np.zeros(vertex_at_corner.size, bool)
        is_in_triangle[patch.corner] = True
        partly = np.add.reduceat(is_in_triangle, mesh.starts[:-1], dtype=np.int64)
        for face in np.flatnonzero((partly > 0) & (partly < mesh.sizes)):
            face_corners = np.arange(*mesh.starts[face : face + 2])
            corner_points = mesh.points[mesh.corners[face_corners]]
            usable = is_in_triangle[face_corners]
            away = np.linalg.norm(corner_points[:, None] - corner_points[usable], axis=2)
            vertex_at_corner[face_corners] = vertex_at_corner[face_corners[usable][np.argmin(away, axis=1)]]
        if self.also is not None:
            vertex_at_corner[self.also[0]] = self.also[1]
        return vertex_at_corner, patch.corner

    @property
    def has_uv(self) -> bool:
        """Whether the file has texture coordinates."""
        return self.file.mesh.uv is not None

    @property
    def uv(self) -> Real:
        """The file's texture coordinates, v up; shape (t, 2).

        Raises:
            InputError: it has none.
        """
        if self.file.mesh.uv is None:
            raise InputError(f"{self.spec}: has no texture coordinates; create them with iccm flatten --uv")
        return self.file.mesh.uv

    @property
    def uv_faces(self) -> Index:
        """Index of the texture coordinate at each triangle's corner, in the file's layout; shape (m, 3).

        Raises:
            InputError: texture coordinates are missing, not finite or too large.
        """
        mesh, uv = self.file.mesh, self.uv
        assert mesh.uv_corners is not None
        faces = mesh.uv_corners[self.flattening.patch.corner]
        missing, broken = faces < 0, ~(np.abs(uv[faces]) <= layout.MOST_COORDINATE).all(axis=-1)
        if (missing | broken).any():
            triangle, corner = np.argwhere(missing | broken)[0]
            face = np.searchsorted(mesh.starts, self.flattening.patch.corner[triangle, 0], side="right") - 1
            fault = (
                "has no texture coordinates"
                if missing[triangle, corner]
                else f"its texture coordinates are not finite, or larger than {layout.MOST_COORDINATE:g}"
            )
            raise InputError(f"{self.spec}: {mesh.face_name(int(face))}: {fault}")
        return faces

    @property
    def beyond_unit(self) -> int:
        """Number of triangles with texture coordinates outside 0..1.

        Raises:
            InputError: as for `uv_faces`.
        """
        return int(layout.outside(self.uv[self.uv_faces]).sum())


def as_mesh(shape: Shape) -> MeshShape:
    """Return the shape as a `MeshShape`.

    Raises:
        InputError: it is not a mesh.
    """
    if not isinstance(shape, MeshShape):
        raise InputError(f"{shape.spec}: not a mesh")
    return shape


def row_of(file: MeshFile, spec: str, number: int) -> int:
    """Return the index of a vertex, given its number in the file (from 1 in OBJ, else from 0).

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
