"""Textures onto and from meshes: a mesh as source or target of a map, by way of its flattening.

The plane of a mesh is its flattening, in the mesh's own units. What a mesh target gets is either new texture
coordinates (`new_uvs`: nothing is resampled) or a picture for the coordinates it has (`bake`). A mesh source gives
its own texture.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Box, Complex, Index, Real
from ...curve import Curve
from ...errors import InputError
from ...maps.extended_inverse import ExtendedInverse
from ...meshes import bake as baking
from ...meshes import layout
from ...meshes.cut import vertex_path
from ...meshes.disk_patch import disk_patch
from ...meshes.flatten import Flattening, flatten
from ...meshes.locate import Locator
from ...meshes.surface import Surface
from ...pixels.sampler import Sampler
from ...pixels.texture import Placing, Texture
from ..meshes import mesh_files
from ..pictures import image_files
from ..pictures.image_files import Image
from ..places import Place, vertex_of
from .shape import Shape

if TYPE_CHECKING:
    from ...maps.kinds import AnyMap


@dataclass(frozen=True, eq=False, kw_only=True)
class MeshShape(Shape):
    """A flattened mesh as a planar domain.

    Attributes:
        file: the mesh as its file holds it.
        flattening: its place in the plane.
    """

    file: mesh_files.MeshFile
    flattening: Flattening

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
    def uv_faces(self) -> Index:
        """(m, 3) texture coordinate of each triangle's corner, in the file's own layout.

        Raises:
            InputError: the mesh has no texture coordinates everywhere, or some that are not finite.
        """
        mesh = self.file.mesh
        if mesh.uv is None or mesh.uv_corners is None:
            raise InputError(
                f"{self.spec}: has no texture coordinates of its own; make them with iccm map … -o uv.obj"
            )
        faces = mesh.uv_corners[self.flattening.patch.corner]
        missing, broken = faces < 0, ~np.isfinite(mesh.uv[faces]).all(axis=-1)
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


def read(spec: str, *, cut: bool = False) -> MeshShape:
    """The flattened mesh that `file`, `file#part`, `file#loop` or `file#part#loop` names.

    Args:
        spec: a part is an OBJ object, group or material; a loop a number, 1 being the longest boundary.
        cut: whether a closed surface, or one with handles, may be cut open.

    Raises:
        InputError: in one line, naming the first element at fault.
    """
    file = mesh_files.read(spec)
    piece = disk_patch(file.mesh, cut=cut)
    flat = flatten(piece, loop=file.loop, grow=cut)
    notes = [*file.notes, *flat.patch.notes, *flat.notes]
    if len(flat.patch.seam):
        notes.append(f"cut open along {len(flat.patch.seam)} edges")
    if len(flat.patch.loops) > 1:
        holes = len(flat.patch.loops) - 1
        kept = f"{holes} hole{'s stay holes' if holes > 1 else ' stays a hole'}"
        notes.append(f"{kept}; boundary loop {file.loop} is the outline")
    return MeshShape(
        spec=spec,
        path=file.path,
        curve=flat.boundary,
        box=flat.boundary.box,
        flip=False,
        pins={},
        strokes={},
        notes=tuple(notes),
        file=file,
        flattening=flat,
    )


def own_texture(shape: MeshShape, **options: Any) -> Image:
    """The texture that a mesh file names or holds; of several the first.

    Args:
        shape: the mesh.
        options: as in `iccm.io.images.read`, for a texture in a file of its own.

    Raises:
        InputError: there is none.
    """
    if shape.file.picture is not None:
        pixels = _decoded(shape.spec, shape.file.picture)
        opaque = bool((pixels[..., 3] == 255).all())
        return Image(pixels[..., :3].copy() if opaque else pixels, alpha=-1 if opaque else 3)
    named = mesh_files.textures_of(shape.file)
    if not named:
        raise InputError(f"{shape.spec}: names no texture; give one with --texture")
    return image_files.read(named[0], **options)


def _decoded(spec: str, picture: bytes) -> NDArray[np.uint8]:
    from PIL import Image as Pillow

    try:
        return np.asarray(Pillow.open(BytesIO(picture)).convert("RGBA"))
    except (OSError, ValueError, SyntaxError, Pillow.DecompressionBombError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(f"{spec}: the texture in the file cannot be read: {reason}") from error


def texture_in(shape: MeshShape) -> Path | bytes | None:
    """The first texture file that an OBJ's materials name, or the content of the one that another format holds."""
    return shape.file.picture or next(iter(mesh_files.textures_of(shape.file)), None)


def several_textures(shape: MeshShape) -> list[str]:
    """A note where the faces of a mesh show several pictures, of which one is carried."""
    named = mesh_files.textures_of(shape.file)
    if len(named) < 2:
        return []
    return [
        f"{shape.spec}: {named[0]} is taken for all of its {len(named)} textures; file#material picks one"
    ]


def beyond_unit(shape: MeshShape) -> list[str]:
    """A note where a mesh's texture coordinates leave 0..1."""
    uv = shape.file.mesh.uv
    assert uv is not None
    outside = int(layout.outside(uv[shape.uv_faces]).sum())
    if not outside:
        return []
    return [
        f"{shape.spec}: {outside} triangles have texture coordinates outside 0..1, where the texture repeats; "
        "tiles (UDIM) are not told apart"
    ]


def new_uvs(
    target: MeshShape,
    map: "AnyMap",
    source: Shape,
    box: Box,
    out: Path,
    *,
    name: Path,
    texture: Path | bytes | None = None,
    force: bool = False,
    threads: int | None = None,
) -> dict[str, Any]:
    """Write the target with texture coordinates that show the source's texture: nothing is resampled.

    Args:
        target: the mesh.
        map: from the source's plane to the target's.
        source: its shape; a mesh gives its own texture coordinates.
        box: where the texture lies in the source's plane (not used with a mesh).
        out: temporary file to write.
        name: its final name: .obj, .glb or .ply.
        texture: picture file to bind to the mesh, or its content; None writes coordinates only.
        force: whether the files beside it may be replaced (see `meshes.companions`).
        threads: as many as there are processors by default.

    Returns:
        Figures for the report.

    Raises:
        InputError: the format holds no texture coordinates, or the source has none.
    """
    mesh_files.check_output(str(name))
    pull = ExtendedInverse(map, threads)
    z = pull(target.flattening.flat)
    uv, figures = _uv_of(source, box, z, target, threads)
    piece, mesh = target.flattening.patch, target.file.mesh
    corners = np.zeros(mesh.corners.size, np.int64)
    corners[piece.corner] = piece.faces
    written, missing = mesh_files.write(
        target.file, uv, corners, piece.corner, out, name=name, texture=texture, force=force
    )
    return figures | {
        "flattening": target.flattening.report(),
        "outside_points": pull.outside,
        "outside_distance": pull.away / target.curve.diagonal,
        "also_written": written,
        "material_notes": missing,
    }


def _uv_of(source: Shape, box: Box, z: Complex, target: MeshShape, threads: int | None) -> tuple[Real, dict]:
    if not isinstance(source, MeshShape):
        size = box[1] - box[0]
        at = z - box[0]
        return np.column_stack([at.real / size.real, at.imag / size.imag]), {}
    faces = source.uv_faces
    triangle, weights = source.locator(z, threads)
    assert source.file.mesh.uv is not None
    uv = np.einsum("pk,pkc->pc", weights, source.file.mesh.uv[faces[triangle]])
    chart = layout.charts(faces, len(source.file.mesh.uv))[faces[triangle, 0]][target.flattening.patch.faces]
    torn = int((chart != chart[:, :1]).any(axis=1).sum())
    return uv, {"torn_triangles": torn}


def check_layout(target: MeshShape) -> None:
    """Refuse a layout that cannot be filled.

    Raises:
        InputError: texture coordinates that are missing, not finite or absurdly far off.
    """
    faces = target.uv_faces
    assert target.file.mesh.uv is not None
    layout.check_layout(target.spec, target.file.mesh.uv, faces)


def bake(
    target: MeshShape,
    map: "AnyMap",
    source: Shape,
    sampler: Sampler,
    size: tuple[int, int],
    *,
    threads: int | None = None,
    **options: Any,
) -> tuple[NDArray, dict[str, Any]]:
    """The texture resampled into the target's own UV layout: its pixels, and figures for the report.

    Args:
        target, map, source, threads: as in `new_uvs`.
        sampler: the texture, which lies in the source's plane or is that of a mesh source.
        size: width and height of the picture to make.
        options: padding, max_error of `iccm.meshes.bake.bake`.

    Raises:
        InputError: the target, or a mesh source, has no texture coordinates.
    """
    mesh, faces = target.file.mesh, target.uv_faces
    assert mesh.uv is not None
    grid = layout.layout(target.spec, mesh.uv, faces, target.flattening.patch.triangles.twin, *size)
    inverse, place = ExtendedInverse(map, threads), placing(source, sampler.texture)
    pixels, figures = baking.bake(
        target.flattening, grid, inverse, sampler, place, threads=threads, **options
    )
    return pixels, figures | {"flattening": target.flattening.report()}


def placing(source: Shape, texture: Texture) -> Placing:
    """Where points of the source's plane lie in the texture.

    Raises:
        InputError: a mesh source without texture coordinates.
    """
    if not isinstance(source, MeshShape):
        return texture
    uv, faces = source.file.mesh.uv, source.uv_faces
    assert uv is not None
    height, width = texture.pixels.shape[:2]
    return Surface.of(source.locator, uv[faces], (width, height))
