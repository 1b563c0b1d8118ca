"""The OBJ format: files that keep their bytes, with material libraries and pictures beside them."""

import hashlib
import os
import re
from dataclasses import dataclass, replace
from functools import cached_property
from io import BufferedReader
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh
from ...pixels.texture import Wrap
from ...surfaces.subdivided import Subdivision
from .. import files, limits, references
from . import material_library, obj, obj_materials, obj_write
from .embedding import picture_file
from .material_library import Library
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written
from .obj import Obj

BLOCK_BYTES = 1 << 20  # read at a time when faces are counted
LONGEST_LINE = 1 << 16  # bytes of a line that are examined, so that a file without line ends needs no memory
_INDENTED_FACE = re.compile(rb"^[ \t]+f[ \t]", re.MULTILINE)
_LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.MULTILINE)


@dataclass(frozen=True, eq=False)
class ObjContent(MeshContent):
    """An OBJ file. Its objects, groups and materials overlap, so parts are given by marking faces.

    Attributes:
        obj: its bytes and their content.
        library: the material libraries that it refers to.
    """

    obj: Obj
    library: Library
    dialect = "mtl"

    @classmethod
    def of(cls, whole: Obj, library: Library | None = None) -> "ObjContent":
        """Create the content of a file; its libraries are read unless they are given."""
        return cls(whole.mesh(), whole, library or obj_materials.library_of(whole))

    def part(self, faces: Flags, name: str) -> Mesh:
        """Return the polygons marked in `faces` (f,) as a mesh of this name, with normals if all of these have some."""
        return self.obj.mesh_of(faces, name)

    def subdivide(self, plan: Subdivision) -> "ObjContent":
        """Replace some faces by triangles; every other line is kept."""
        return ObjContent.of(obj.parse(obj_write.subdivided(self.obj, plan), self.obj.path), self.library)

    def faces_called(self, name: str) -> Flags:
        """Mark the faces (f,) of the object, group or material of this name."""
        return self.obj.faces_of(name)

    def names_at(self, faces: Index) -> set[str]:
        """Collect the objects, groups and materials that faces (k,) belong to."""
        return self.obj.names_at(faces)

    def textures(self, faces: Flags) -> dict[Path, Wrap]:
        """List the colour textures of the materials of faces (f,), each with its wrap mode."""
        return obj_materials.textures_of(self.obj, self.library, faces)


def obj_content(file: MeshFile) -> ObjContent | None:
    """Return the OBJ content of a mesh; None if it comes from another format."""
    return file.content if isinstance(file.content, ObjContent) else None


class ObjFormat(MeshFormat):
    """Wavefront OBJ; size, kind, referenced files and hash are all found by scanning the file once.

    A file with a single face, or only lines, is an outline, as drawing programs write them.
    """

    dialect = "mtl"
    shows_normals = True

    def count_faces(self, most: int) -> int:
        """Count the `f` lines."""
        return self._scan.faces

    def is_mesh(self, *, gets_uv: bool = False) -> bool:
        """Return whether it has several faces, or one that will be given texture coordinates."""
        return self._scan.faces > (0 if gets_uv else 1)

    def files_named(self) -> list[str]:
        """List the material libraries that may be read, and the pictures that these refer to."""
        folder = self.path.parent
        files = list[str]()
        for line in self._scan.libraries:
            name = line.strip().replace(b"\0", b"").decode("utf-8", "surrogateescape")
            if references.may_be_read(folder / name, folder):
                files += [str(folder / name), *_pictures_named(folder / name)]
        return files

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the content as it was read."""
        content = self._scan.content
        return files.sha256(self.path) if content is None else hashlib.sha256(content).hexdigest()

    def read(self) -> dict[str, MeshFile]:
        """Read the whole file."""
        return {self.path.name: self.pick()}

    @property
    def names(self) -> list[str]:
        """Names of objects, groups and materials, in file order."""
        return self.content.obj.parts()

    @property
    def geometries(self) -> list[str]:
        """Always empty, since parts of an OBJ may share faces."""
        return []

    def pick(self, part: str | None = None) -> MeshFile:
        """Return the faces of an object, group or material, or all."""
        whole = self.content.obj
        faces = whole.faces_of(part) if part else np.ones(len(whole.face_at), bool)
        mesh = whole.mesh(part) if part else self.content.polygons
        return MeshFile(self.path, mesh, faces, self.content, notes=self.content.library.outside)

    @cached_property
    def content(self) -> ObjContent:
        """The parsed content.

        Raises:
            InputError: the file is empty, or as `obj.parse`.
        """
        if self._keep < 0:
            return self._divided_content(obj.read(self.path))
        if not self._scan.content:
            raise InputError(f"{self.path}: the file is empty")
        return self._divided_content(obj.parse(self._scan.content, self.path))

    def _divided_content(self, whole: obj.Obj) -> ObjContent:
        content = ObjContent.of(whole).divide(self.halvings)
        assert isinstance(content, ObjContent)
        return content

    @cached_property
    def _scan(self) -> "_Scan":
        return _scan(self.path, self._keep)

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
        """Write a mesh with other texture coordinates; if it was read from an OBJ file, all other lines are kept."""
        content, faces = obj_content(file), file.faces
        if content is None:
            content = ObjContent.of(obj.parse(_as_obj(file.mesh), name))
            faces, new = np.ones(file.mesh.sizes.size, bool), replace(new, kept=False)
        texture = picture_file(pictures.texture) if isinstance(pictures.texture, bytes) else pictures.texture
        pictures = ShownPictures(texture, pictures.normals, pictures.pictures)
        return obj_materials.write(content.obj, content.library, faces, new, pictures, out, name, force=force)

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round texture coordinates (t, 2) to the digits of `vt` lines."""
        return np.array(obj_write.vt_text(uv, "\n").replace("vt", "").split(), float).reshape(-1, 2)

    @classmethod
    def check_texture(cls, name: Path, texture: Path | bytes | None) -> None:
        """Refuse a file whose name a material library cannot represent."""
        if isinstance(texture, Path):
            material_library.name_of(texture, name.parent)

    @classmethod
    def companions(cls, name: Path, pictures: ShownPictures) -> list[str]:
        """Return the material library, and a picture that is not a file yet."""
        return obj_materials.companions(name, pictures)

    @classmethod
    def split_uv(cls, path: Path) -> tuple[Real, Any]:
        """Return the numbers of `vt` lines, and the other lines."""
        lines = files.read_bytes(path, max_bytes=limits.COMPARED_BYTES).splitlines()
        try:
            uv = np.array([line.split()[1:3] for line in lines if line.startswith(b"vt ")], float)
        except ValueError:
            return np.zeros((0, 2)), lines
        return uv, [line for line in lines if not line.startswith(b"vt ")]


class _Scan(NamedTuple):
    """Results of scanning a file.

    Attributes:
        faces: number of faces.
        libraries: arguments of its `mtllib` lines.
        content: its bytes, if it has few enough faces to be read.
    """

    faces: int
    libraries: list[bytes]
    content: bytes | None


def _scan(path: Path, keep: int) -> _Scan:
    """Scan a file, and keep its content if it has at most `keep` faces.

    Raises:
        InputError: it is missing or cannot be read.
    """
    with files.opened(path, max_bytes=limits.MESH_BYTES) as file:
        faces, libraries = _scan_lines(file)
        file.seek(0)
        return _Scan(faces, libraries, file.read() if faces <= keep else None)


def _scan_lines(file: BufferedReader) -> tuple[int, list[bytes]]:
    """Count faces and list libraries, one block of whole lines at a time."""
    faces, libraries, remainder = 0, list[bytes](), b"\n"
    while block := file.read(BLOCK_BYTES):
        block = remainder + block.replace(b"\r", b"\n")  # line ends of old files
        end = block.rfind(b"\n")
        lines, remainder = block[:end], block[end:][:LONGEST_LINE]
        faces += _count_faces(lines)
        libraries += _libraries(lines)
    return faces + _count_faces(remainder), libraries + _libraries(remainder)


def _count_faces(lines: bytes) -> int:
    """Count `f` lines, each preceded by a line end; the slow search for indented ones runs only if needed."""
    count = lines.count(b"\nf ") + lines.count(b"\nf\t")
    return count + len(_INDENTED_FACE.findall(lines)) if b"\n " in lines or b"\n\t" in lines else count


def _libraries(lines: bytes) -> list[bytes]:
    return _LIBRARY.findall(lines) if b"mtllib" in lines else []


def _pictures_named(library: Path) -> list[str]:
    """Return the pictures that a material library refers to."""
    if not os.path.isfile(library) or library.stat().st_size > limits.LIBRARY_BYTES:
        return []
    lines = library.read_bytes().decode("utf-8", "surrogateescape").splitlines()
    return [str(library.parent / name) for name in map(material_library.picture_named, lines) if name]


def _as_obj(mesh: Mesh) -> bytes:
    """Return a mesh of another format as an OBJ file."""
    points = ("v %.10g %.10g %.10g\n" * len(mesh.points)) % tuple(mesh.points.ravel().tolist())
    lines = {int(size): "f" + " %d" * size + "\n" for size in np.unique(mesh.sizes)}
    faces = "".join([lines[size] for size in mesh.sizes.tolist()]) % tuple((mesh.corners + 1).tolist())
    return (points + faces).encode()
