"""Mesh formats: `MeshFormat`, of which each format is a subclass, and the values that it reads and writes.

The table of `io.formats` names the class of each suffix; `mesh_files` finds it there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh, face_areas, merge
from ...pixels.texture import REPEAT, Wrap
from ...surfaces.subdivided import Subdivision
from .. import files, limits
from . import splitting

Pictures = Mapping[str, Mapping[str, bytes]]
"""Picture files by material and slot: its name and MTL's statements in lower case, or its number and glTF's slots."""
REASON_LENGTH = 120  # characters of a parser's message: it must fit a line


@dataclass(frozen=True, eq=False)
class MeshContent:
    """All that a mesh file holds: the polygons that are mapped, and the rest.

    A format that writes files back as they were has a subclass, which keeps names, materials and bytes. This class
    keeps polygons alone.

    Attributes:
        polygons: all polygons, which `MeshFile.faces` are flags of.
    """

    polygons: Mesh
    dialect: ClassVar[str] = (
        ""  # how its materials name their pictures: "gltf", "mtl", or "" without materials
    )

    @classmethod
    def join(cls, contents: Sequence[Any], name: str) -> MeshContent:
        """Join the contents of several geometries of one file, their polygons one after the other."""
        return cls(merge([content.polygons for content in contents], name))

    def part(self, faces: Flags, name: str) -> Mesh:
        """Return the polygons marked in (f,) as a mesh of this name."""
        return self.polygons.part(faces, name)

    def subdivide(self, plan: Subdivision) -> MeshContent:
        """Put triangles in the place of some polygons, and interpolate what vertices and corners have.

        Raises:
            InputError: the file has vertices that cannot be split.
        """
        return MeshContent(splitting.subdivided(self.polygons, plan))

    def faces_called(self, name: str) -> Flags:
        """Mark the polygons (f,) of an object, group, geometry or material.

        Raises:
            InputError: nothing has this name, or the format has no names.
        """
        path = self.polygons.name
        raise InputError(f"names a part of an OBJ or a material of a GLB, and {path} has neither; use a mask")

    def names_at(self, faces: Index) -> set[str]:
        """Collect the objects, groups and materials that polygons (k,) belong to."""
        return set()

    def textures(self, faces: Flags) -> dict[Path, Wrap]:
        """List the picture files that the materials of polygons (f,) name, in order, each with what lies beyond it."""
        return {}

    def wrap(self, faces: Flags) -> Wrap:
        """Tell what lies beyond the first picture that polygons (f,) show."""
        return next(iter(self.textures(faces).values()), REPEAT)


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh as a file holds it, or a part of one.

    Attributes:
        path: the file.
        mesh: its polygons, or those of the part picked.
        faces: (f,) which of all polygons of `content` these are.
        content: all that the file holds.
        picture: the texture inside the file, as the PNG or JPEG file that it is there, when it has one.
        loop: number of the boundary loop picked, 1 being the longest.
        piece: number of the piece picked among those that no edge connects, 1 being the largest; 0: none was named.
        chart: number of the chart picked in its own texture coordinates, 1 being the largest; 0: none was named.
        part: the part picked, without piece, chart and loop.
        numbered: whether a piece, a chart or a loop was named by its number.
        total: faces of all that the file holds, 0 where these are all that `faces` are of.
        names: of the parts that `#` picks.
        notes: what was left out.
    """

    path: Path
    mesh: Mesh
    faces: NDArray[np.bool_]
    content: MeshContent
    picture: bytes | None = None
    loop: int = 1
    piece: int = 0
    chart: int = 0
    part: str | None = None
    numbered: bool = False
    total: int = 0
    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def whole(cls, path: Path, content: MeshContent, picture: bytes | None = None, *notes: str) -> MeshFile:
        """Make a mesh of all polygons of a content."""
        mesh = content.polygons
        return cls(path, mesh, np.ones(mesh.sizes.size, bool), content, picture, notes=notes)

    def faces_called(self, name: str) -> Flags:
        """Mark the polygons (f,) of the mesh that belong to an object, group, geometry or material of this name.

        Raises:
            InputError: nothing has this name, or the format has no names.
        """
        return self.content.faces_called(name)[self.faces]

    def textures(self) -> list[Path]:
        """List the different picture files that its materials name, in the order of the faces."""
        return list(self.content.textures(self.faces))

    @property
    def wrap(self) -> Wrap:
        """What lies beyond the first picture that it shows."""
        return self.content.wrap(self.faces)

    def part_of(self, content: MeshContent, faces: Flags) -> MeshFile:
        """Return the same part after its file's content was changed: the polygons marked in (f,)."""
        return replace(self, mesh=content.part(faces, self.mesh.name), faces=faces, content=content)


@dataclass(frozen=True, eq=False)
class NewCoordinates:
    """Texture coordinates for a mesh that is to be written.

    Attributes:
        uv: (t, 2) coordinates, v up.
        corners: (c,) coordinate of each corner of the mesh's polygons.
        triangles: (m, 3) corners of its triangles, for formats of triangles.
    """

    uv: Real
    corners: Index
    triangles: Index


@dataclass(frozen=True, eq=False)
class ShownPictures:
    """What a mesh that is to be written shows.

    Attributes:
        texture: a picture of colours, or its content; None to leave materials alone.
        normals: a normal map, y up.
        pictures: further ones, PNG or JPEG files by material and slot.
    """

    texture: Path | bytes | None = None
    normals: Path | None = None
    pictures: Pictures = field(default_factory=dict)


@dataclass(frozen=True)
class Written:
    """What came of writing a mesh.

    Attributes:
        files: names of the other files that were written.
        notes: what could not be kept.
    """

    files: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class MeshFormat(ABC):
    """A mesh format: an instance is a file that is read, class methods write one.

    To add a format, make a subclass in a module of this folder, and name it in the table of `io.formats`. `read` and
    `count_faces` read it; `write` and `round_uv` write texture coordinates, where the table says `uv`. The other
    methods have answers that fit a format without names, materials and files beside it.

    Attributes:
        path: the file.
        dialect: how the materials that it is written with name their pictures: "gltf", "mtl", or "" without materials.
        shows_normals: whether a normal map can be written with it.
    """

    dialect: ClassVar[str] = ""
    shows_normals: ClassVar[bool] = False

    def __init__(self, path: Path, keep: int = -1) -> None:
        """Nothing is opened yet; `keep` is the most faces of a mesh that is going to be read, -1 if that is unknown."""
        self.path, self._keep = path, keep

    @abstractmethod
    def count_faces(self, most: int) -> int:
        """Count the faces that the file declares, before memory is taken for them; 0 where it makes no sense.

        Args:
            most: faces that are allowed; what claims more memory than so many take can be refused here.

        Raises:
            InputError: the file cannot be opened, or claims more than it holds.
        """

    @abstractmethod
    def read(self) -> dict[str, MeshFile]:
        """Read the geometries of the file by name.

        Raises:
            Exception: of any kind, if the file is at fault; `pick` makes one line of it.
        """

    def check_size(self, most: int) -> None:
        """Refuse a mesh of too many faces.

        Raises:
            InputError: the file declares more than `most`, or cannot be opened.
        """
        if (count := self.count_faces(most)) > most:
            raise InputError(
                f"{self.path}: has {count} faces, more than the limit of {most}; raise --max-faces"
            )

    def is_mesh(self, *, gets_uv: bool = False) -> bool:
        """Return whether the file is a mesh, and not an outline; `gets_uv`: it is to be given texture coordinates."""
        return True

    def files_named(self) -> list[str]:
        """List the files that this one names: material libraries, pictures, buffers; whether they exist or not."""
        return []

    @property
    def sha256(self) -> str:
        """The hash of the content as it was read."""
        return files.sha256(self.path)

    @property
    def names(self) -> list[str]:
        """Of the parts that `#` picks.

        Raises:
            InputError: the file cannot be read.
        """
        return list(self._geometries)

    @property
    def geometries(self) -> list[str]:
        """The names of parts that have no polygon in common, if the file has several such parts."""
        return self.names if len(self.names) > 1 else []

    def same_mesh(self, file: MeshFile) -> list[str]:
        """Return the names of the geometries that are one mesh together with the one that was picked."""
        return []

    def pick(self, part: str | None = None) -> MeshFile:
        """Return a part of the file; without a name the largest, or all of it.

        Raises:
            InputError: the file cannot be read, or has no such part.
        """
        geometries, path = self._geometries, self.path
        if part is not None and part not in geometries:
            there = ", ".join(geometries) or "none"
            raise InputError(f"{path}#{part}: there is no geometry '{part}'; the file has {there}")
        if not geometries:
            raise InputError(f"{path}: contains no faces; a point cloud cannot be mapped")
        chosen = part or max(geometries, key=self._areas.__getitem__)
        file, notes = geometries[chosen], list[str]()
        if left := len(geometries) - 1:
            others = f"ignored {left} other geometr{'ies' if left > 1 else 'y'}"
            cure = (
                f": {chosen!r} is the largest; {path}#name selects one, --parts all or each uses all of them"
            )
            notes.append(others + ("" if part else cure))
        mesh = replace(file.mesh, name=str(path) + (f"#{part}" if part else ""))
        total = sum(each.faces.size for each in geometries.values())
        return replace(file, mesh=mesh, notes=(*file.notes, *notes), total=total)

    @cached_property
    def _geometries(self) -> dict[str, MeshFile]:
        """As `read`, any error in one line."""
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        try:
            with np.errstate(
                all="ignore"
            ):  # what numbers of a broken file come to is reported by what checks them
                return self.read()
        except InputError:
            raise
        except Exception as error:  # whatever a parser stumbles over: the file is at fault
            reason = " ".join(str(error).split())[:REASON_LENGTH] or type(error).__name__
            kind = self.path.suffix[1:].upper()
            raise InputError(f"{self.path}: cannot read this {kind} file: {reason}") from error

    @cached_property
    def _areas(self) -> dict[str, float]:
        if len(self._geometries) == 1:
            return dict.fromkeys(self._geometries, 0.0)
        return {name: _area(file.mesh) for name, file in self._geometries.items()}

    @classmethod
    def write(
        cls, file: MeshFile, new: NewCoordinates, shown: ShownPictures, out: Path, name: Path, *, force: bool
    ) -> Written:
        """Write a mesh, of any format, with new texture coordinates.

        Args:
            file: the mesh; what was read from the same format stays as it is in all else.
            new: its coordinates.
            shown: the pictures that it shows by them.
            out: where to write now, a temporary file beside `name`.
            name: what it will be called.
            force: whether its `companions` may be replaced.

        Raises:
            InputError: the format cannot hold the mesh or a picture.
        """
        raise NotImplementedError(cls.__name__)

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round texture coordinates (t, 2) as a file of the format holds them."""
        return uv

    @classmethod  # noqa: B027
    def check_texture(cls, name: Path, texture: Path | bytes | None) -> None:
        """Refuse a texture, a file or its content, that the mesh to be written cannot show.

        Raises:
            InputError: it cannot be embedded, or named.
        """

    @classmethod
    def companions(cls, name: Path, shown: ShownPictures) -> list[str]:
        """List the files that `write` puts beside a mesh, but for those of `shown.pictures`."""
        return []

    @classmethod
    def split_uv(cls, path: Path) -> tuple[Real, Any] | None:
        """Read the texture coordinates (t, 2) of a written file, and all else that it holds, to be compared apart.

        None: they are not distinguished.

        Raises:
            InputError: it cannot be read.
        """
        return None


def _area(mesh: Mesh) -> float:
    """Return the area of the triangles whose vertices are there."""
    corners = mesh.corners[mesh.starts[:-1][mesh.sizes == 3, None] + np.arange(3)]
    corners = corners[((corners >= 0) & (corners < len(mesh.points))).all(axis=1)]
    return float(np.nan_to_num(face_areas(mesh.points[corners])).sum())
