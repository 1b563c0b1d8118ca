"""The PLY format: files that keep every property of every element, and may name one picture."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import Real
from ...surfaces.subdivided import Subdivision
from .. import files, limits, references
from . import material_library, ply, ply_write
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written
from .ply import Ply


@dataclass(frozen=True, eq=False)
class PlyContent(MeshContent):
    """A PLY file.

    Attributes:
        ply: its header and tables.
    """

    ply: Ply

    def subdivide(self, plan: Subdivision) -> "PlyContent":
        """Replace some faces by triangles, which inherit their properties."""
        subdivided = ply_write.subdivided(self.ply, plan)
        return PlyContent(subdivided.mesh, subdivided)


class PlyFormat(MeshFormat):
    """Stanford PLY, ASCII or binary."""

    def count_faces(self, most: int) -> int:
        """Read the number of faces from the header."""
        with files.opened(self.path) as file:
            match = re.search(rb"element[ \t]+face[ \t]+(\d{1,18})", file.read(limits.MESH_HEADER_BYTES))
        return int(match[1]) if match else 0

    def read(self) -> dict[str, MeshFile]:
        """Read the file, and the picture that a comment names."""
        whole = ply.read(self.path)
        content = PlyContent(whole.mesh, whole)
        texture, picture, notes = whole.texture, None, list[str]()
        if texture is not None and not references.may_be_read(texture, self.path.parent):
            picture_name = material_library.relative(texture, self.path.parent)
            notes.append(f"refers to {picture_name}, {references.OUTSIDE}")
        elif texture is not None:
            picture = files.read_bytes(texture, max_bytes=limits.MESH_BYTES)
        if not content.polygons.sizes.size:
            return {}
        return {self.path.name: MeshFile.whole(self.path, content, picture, *notes)}

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
        """Write a mesh with other texture coordinates; if it was read from a PLY file, all else is kept."""
        original = file.content.ply if isinstance(file.content, PlyContent) else None
        whole = original or ply_write.plain(file.mesh, name)
        faces = file.faces if original else np.ones(file.mesh.sizes.size, bool)
        texture, copied = pictures.texture, cls.companions(name, pictures)
        picture = None
        if isinstance(texture, Path):
            picture = material_library.relative(Path(copied[0]) if copied else texture, name.parent)
        encoded, notes = ply_write.with_coordinates(whole, faces, new.uv, new.corners, picture)
        if isinstance(texture, bytes):
            notes.append("a PLY file contains no texture, only texture coordinates for it")
        elif texture is None and whole.texture is not None:
            notes.append(f"its texture {whole.texture.name} still belongs to the old coordinates")
        out.write_bytes(encoded)
        for path in copied:
            assert isinstance(texture, Path)  # see companions
            files.write_bytes(path, files.read_bytes(texture, max_bytes=limits.MESH_BYTES), force=force)
        return Written(copied, [f"{name}: {note}" for note in notes])

    @classmethod
    def companions(cls, name: Path, pictures: ShownPictures) -> list[str]:
        """Return a copy of a picture outside the mesh's folder, since a reference to it would be refused later."""
        texture = pictures.texture
        if not isinstance(texture, Path) or references.may_be_read(texture, name.parent):
            return []
        return [str(name.with_name(f"{name.stem}-texture{texture.suffix.lower()}"))]

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round texture coordinates (t, 2) to single precision."""
        return uv.astype(np.float32)
