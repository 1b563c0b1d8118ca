"""The interface of mesh formats, `MeshFormat`, and the data that formats read and write.

Subclasses are found by suffix in the table of `io.formats`; see `mesh_files`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh, check, face_areas, merge
from ...pixels.texture import REPEAT, Wrap
from ...surfaces.subdivided import Subdivision
from .. import files, formats, limits
from . import splitting

Pictures = Mapping[str, Mapping[str, bytes]]
"""Picture files by material and slot: material name and MTL statement in lower case, or material index and slot."""
REASON_LENGTH = 120  # characters of a parser's message, so that it fits in a line


@dataclass(frozen=True, eq=False)
class MeshContent:
    """Everything in a mesh file: the polygons that are mapped, and the rest.

    Formats that preserve files have subclasses, which keep names, materials and bytes. This class keeps only polygons.

    Attributes:
        polygons: all polygons; `MeshFile.faces` marks some of them.
    """

    polygons: Mesh
    dialect: ClassVar[str] = ""  # how materials refer to pictures: "gltf", "mtl", or "" without materials

    @classmethod
    def join(cls, contents: Sequence[Any], name: str) -> MeshContent:
        """Join the contents of several geometries of one file, with their polygons one after the other."""
        return cls(merge([content.polygons for content in contents], name))

    def part(self, faces: Flags, name: str) -> Mesh:
        """Return the polygons marked in `faces` (f,) as a mesh of this name."""
        return self.polygons.part(faces, name)

    def subdivide(self, plan: Subdivision) -> MeshContent:
        """Replace some polygons by triangles, interpolating the attributes of vertices and corners.

        Raises:
            InputError: the file has vertices that cannot be split.
        """
        return MeshContent(splitting.subdivided(self.polygons, plan))

    def divide(self, halvings: int) -> MeshContent:
        """Divide every triangle into 4 to the power of `halvings` ones; polygons are divided into triangles first.

        Raises:
            InputError: an element of the mesh is invalid, or the file has vertices that cannot be split.
        """
        return self.subdivide(Subdivision.even(check(self.polygons), halvings)) if halvings else self

    def faces_called(self, name: str) -> Flags:
        """Mark the polygons (f,) of the object, group, geometry or material of this name.

        Raises:
            InputError: there is none, or the format has no names.
        """
        path = self.polygons.name
        raise InputError(f"names a part of an OBJ or a material of a GLB, and {path} has neither; use a mask")

    def names_at(self, faces: Index) -> set[str]:
        """Collect the objects, groups and materials that polygons (k,) belong to."""
        return set()

    def textures(self, faces: Flags) -> dict[Path, Wrap]:
        """List the picture files of the materials of polygons (f,) in order, each with its wrap mode."""
        return {}

    def wrap(self, faces: Flags) -> Wrap:
        """Return the wrap mode of the first picture on polygons (f,)."""
        return next(iter(self.textures(faces).values()), REPEAT)


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh from a file, or a part of one.

    Attributes:
        path: the file.
        mesh: its polygons, or those of the selected part.
        faces: (f,) marks these among all polygons of `content`.
        content: everything in the file.
        picture: the texture inside the file, as the content of a PNG or JPEG file, if it has one.
        loop: number of the selected boundary loop, 1 being the longest.
        piece: number of the selected connected component, 1 being the largest; 0 if none is named.
        chart: number of the selected chart of the mesh's texture coordinates, 1 being the largest; 0 if none is named.
        part: name of the selected part, without piece, chart and loop.
        numbered: whether a piece, chart or loop was selected by its number.
        total: number of faces in the whole file; 0 if `content` has all of them.
        names: names of the parts that can be selected by `#`.
        notes: what was ignored.
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
        """Create a mesh with all polygons of a content."""
        mesh = content.polygons
        return cls(path, mesh, np.ones(mesh.sizes.size, bool), content, picture, notes=notes)

    def faces_called(self, name: str) -> Flags:
        """Mark the polygons (f,) of the mesh in the object, group, geometry or material of this name.

        Raises:
            InputError: there is none, or the format has no names.
        """
        return self.content.faces_called(name)[self.faces]

    def textures(self) -> list[Path]:
        """List the distinct picture files of its materials, in the order of the faces."""
        return list(self.content.textures(self.faces))

    @property
    def wrap(self) -> Wrap:
        """Wrap mode of the first picture that it shows."""
        return self.content.wrap(self.faces)

    def part_of(self, content: MeshContent, faces: Flags) -> MeshFile:
        """Return the same part of changed content; `faces` (f,) marks the polygons that belong to it."""
        return replace(self, mesh=content.part(faces, self.mesh.name), faces=faces, content=content)


@dataclass(frozen=True, eq=False)
class Overlay:
    """Values at the vertices of a surface.

    Attributes:
        values: (n,) numbers, NaN where there are none; or keys of labels.
        colors: colours (4,) from 0 to 1 by key, if the values are keys of labels.
    """

    values: Real
    colors: dict[int, NDArray[np.float64]] | None = None


@dataclass(frozen=True, eq=False)
class NewCoordinates:
    """Texture coordinates for a mesh to be written.

    Attributes:
        uv: (t, 2) coordinates, v up.
        corners: (c,) index into `uv` for each corner of the mesh's polygons.
        triangles: (m, 3) corners of the triangles of all its polygons, in any order but with their orientation, for
            formats that store only triangles. Files all of whose faces are triangles keep their own if they are written
            by `corners` instead.
        kept: whether they are the mesh's own, so that only pictures change.
    """

    uv: Real
    corners: Index
    triangles: Index
    kept: bool = False


@dataclass(frozen=True, eq=False)
class ShownPictures:
    """Pictures for a mesh to be written.

    Attributes:
        texture: file or content of a colour texture; None to leave materials unchanged.
        normals: file or content of a normal map, y up.
        pictures: further PNG or JPEG files, by material and slot.
    """

    texture: Path | bytes | None = None
    normals: Path | bytes | None = None
    pictures: Pictures = field(default_factory=dict)


@dataclass(frozen=True)
class Written:
    """Results of writing a mesh.

    Attributes:
        files: names of further files that were written.
        notes: what could not be kept.
    """

    files: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class MeshFormat(ABC):
    """A mesh format: an instance is a file to be read, class methods write files.

    To add a format, write a subclass in a module of this folder, and add it to the table of `io.formats`. `read` and
    `count_faces` read it; `write` and `round_uv` write texture coordinates, if the table lists `uv`. The defaults of
    the other methods fit a format without names, materials and companion files.

    Attributes:
        path: the file.
        halvings: how often the edges of all triangles are halved when the file is read (--subdivide).
        dialect: how materials that it writes refer to pictures: "gltf", "mtl", or "" without materials.
        shows_normals: whether a normal map can be written.
    """

    dialect: ClassVar[str] = ""
    shows_normals: ClassVar[bool] = False

    def __init__(self, path: Path, keep: int = -1) -> None:
        """Do not open the file yet; meshes of more than `keep` faces will not be read, -1 if the limit is unknown."""
        self.path, self._keep = path, keep
        self.halvings = 0

    @abstractmethod
    def count_faces(self, most: int) -> int:
        """Count the faces that the file declares, before memory is allocated for them.

        Formats that cannot be counted without parsing may parse a file of at most the bytes that `most` faces need. The
        count of an invalid or empty file is 0: `read` reports what is wrong with it.

        Args:
            most: largest number of faces; a file that claims more memory than these need may be refused.

        Raises:
            InputError: the file cannot be opened, or claims more than it contains.
        """

    @abstractmethod
    def read(self) -> dict[str, MeshFile]:
        """Read the geometries of the file by name.

        Raises:
            Exception: any exception if the file is invalid; `pick` converts it to a one-line message.
        """

    def millimetres(self) -> float | None:
        """Return the length of a unit of the file; None if neither the file nor its format states it."""
        return None

    def check_size(self, most: int) -> None:
        """Refuse a mesh with too many faces.

        Raises:
            InputError: the file declares more than `most`, or cannot be opened.
        """
        with self._naming_errors():
            count = self.count_faces(most)
        if count > most:
            raise InputError(
                f"{self.path}: has {count} faces, more than the limit of {most}; raise --max-faces"
            )
        if (divided := count * 4**self.halvings) > most:
            raise InputError(
                f"{self.path}: --subdivide {self.halvings} makes {divided} faces, more than the limit of {most}; "
                "subdivide less, or raise --max-faces"
            )

    def overlay(self, name: str | None) -> Overlay | None:
        """Read numbers or labels at the vertices; None if the format has none.

        Args:
            name: of an array, for formats that name them.

        Raises:
            InputError: the file cannot be read, or has no such array.
        """
        return None

    def is_mesh(self, *, gets_uv: bool = False) -> bool:
        """Return whether the file is a mesh and not an outline; `gets_uv` if it will be given texture coordinates."""
        return True

    def files_named(self) -> list[str]:
        """List the files that this one refers to (material libraries, pictures, buffers), existing or not."""
        return []

    @property
    def sha256(self) -> str:
        """SHA-256 of the content as it was read."""
        return files.sha256(self.path)

    @property
    def names(self) -> list[str]:
        """Names of the parts that can be selected by `#`.

        Raises:
            InputError: the file cannot be read.
        """
        return list(self._geometries)

    @property
    def geometries(self) -> list[str]:
        """Names of parts that share no polygon, if the file has several such parts."""
        return self.names if len(self.names) > 1 else []

    def same_mesh(self, file: MeshFile) -> list[str]:
        """Return the names of the geometries that form one mesh with the selected one."""
        return []

    def pick(self, part: str | None = None) -> MeshFile:
        """Return a part of the file; without a name, the largest geometry or the whole file.

        Raises:
            InputError: the file cannot be read, or has no such part.
        """
        geometries, path = self._geometries, self.path
        if part is not None and part not in geometries:
            available = ", ".join(geometries) or "none"
            raise InputError(f"{path}#{part}: there is no geometry '{part}'; the file has {available}")
        if not geometries:
            raise InputError(f"{path}: contains no faces; a point cloud cannot be mapped")
        name = part or max(geometries, key=self._areas.__getitem__)
        file, notes = geometries[name], list[str]()
        if other_count := len(geometries) - 1:
            note = f"ignored {other_count} other geometr{'ies' if other_count > 1 else 'y'}"
            cure = f": {name!r} is the largest; {path}#name selects one, --parts all or each uses all of them"
            notes.append(note + ("" if part else cure))
        mesh = replace(file.mesh, name=str(path) + (f"#{part}" if part else ""))
        total = sum(geometry.faces.size for geometry in geometries.values())
        return replace(file, mesh=mesh, notes=(*file.notes, *notes), total=total)

    @cached_property
    def _geometries(self) -> dict[str, MeshFile]:
        """Read as `read` does, with any error as a one-line message."""
        files.open_input(self.path, max_bytes=limits.MESH_BYTES)
        with self._naming_errors(), np.errstate(all="ignore"):  # later checks report invalid numbers
            return self._divided(self.read())

    @contextmanager
    def _naming_errors(self) -> Iterator[None]:
        """Convert any error of a parser in the block to a one-line message."""
        try:
            yield
        except InputError:
            raise
        except Exception as error:  # whatever exception a parser raises, the file is at fault
            reason = reason_of(error)
            kind = formats.suffix_of(self.path).strip(".").upper()
            raise InputError(f"{self.path}: cannot read this {kind} file: {reason}") from error

    def _divided(self, geometries: dict[str, MeshFile]) -> dict[str, MeshFile]:
        """Return the geometries with their triangles divided as `halvings` requests."""
        if not self.halvings:
            return geometries
        return {
            name: MeshFile.whole(self.path, file.content.divide(self.halvings), file.picture, *file.notes)
            for name, file in geometries.items()
        }

    @cached_property
    def _areas(self) -> dict[str, float]:
        if len(self._geometries) == 1:
            return dict.fromkeys(self._geometries, 0.0)
        return {name: _area(file.mesh) for name, file in self._geometries.items()}

    @classmethod
    def write(
        cls,
        file: MeshFile,
        new: NewCoordinates,
        pictures: ShownPictures,
        out: Path,
        name: Path,
        *,
        force: bool,
    ) -> Written:
        """Write a mesh, of any format, with new texture coordinates.

        Args:
            file: the mesh; if it was read from the same format, everything else is kept.
            new: its coordinates.
            pictures: the pictures that it shows by them.
            out: where to write, a temporary file beside `name`.
            name: the final path.
            force: whether its `companions` may be overwritten.

        Raises:
            InputError: the format cannot store the mesh or a picture.
        """
        raise NotImplementedError(cls.__name__)

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round texture coordinates (t, 2) as a file of the format stores them."""
        return uv

    @classmethod  # noqa: B027
    def check_texture(cls, name: Path, texture: Path | bytes | None) -> None:
        """Refuse a texture, given as a file or its content, that the mesh to be written cannot show.

        Raises:
            InputError: it cannot be embedded, or its name cannot be stored.
        """

    @classmethod
    def companions(cls, name: Path, pictures: ShownPictures) -> list[str]:
        """List the files that `write` creates beside a mesh, except those of `pictures.pictures`."""
        return []

    @classmethod
    def split_uv(cls, path: Path) -> tuple[Real, Any] | None:
        """Read the texture coordinates (t, 2) of a written file and all its other content, to compare them separately.

        Returns None if the format does not support this.

        Raises:
            InputError: it cannot be read.
        """
        return None


def _area(mesh: Mesh) -> float:
    """Return the total area of the triangles with valid vertices."""
    corners = mesh.corners[mesh.starts[:-1][mesh.sizes == 3, None] + np.arange(3)]
    corners = corners[((corners >= 0) & (corners < len(mesh.points))).all(axis=1)]
    return float(np.nan_to_num(face_areas(mesh.points[corners])).sum())


def reason_of(error: Exception) -> str:
    """Return the message of a parser's exception in one short line."""
    return " ".join(str(error).split())[:REASON_LENGTH] or type(error).__name__
