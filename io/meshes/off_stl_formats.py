"""The OFF and STL formats, which store no texture coordinates: read by trimesh, or by `odd_forms` where that fails."""

import re
import struct
import warnings
from io import BytesIO
from pathlib import Path

from ...meshes.mesh import Mesh
from .. import files, limits
from . import odd_forms
from .mesh_format import MeshContent, MeshFile, MeshFormat

STL_HEAD_BYTES, STL_FACE_BYTES = 84, 50
"""Bytes of a binary STL file before its faces, ending with their count, and bytes of each face; text needs more."""


class OffFormat(MeshFormat):
    """Geomview OFF, as text or binary."""

    def count_faces(self, most: int) -> int:
        """Read the number of faces from the header."""
        with files.opened(self.path) as file:
            text = re.sub(rb"#[^\n]*", b"", file.read(limits.MESH_HEADER_BYTES))
        match = re.match(rb"\s*[A-Za-z]*\s*\d+\s+(\d{1,18})\s", text)
        return int(match[1]) if match else 0

    def read(self) -> dict[str, MeshFile]:
        """Read the file; if line breaks do not separate its elements, it is read number by number."""
        data = files.read_bytes(self.path, max_bytes=limits.MESH_BYTES)
        if odd_forms.is_binary_off(data):
            return _one(Mesh(str(self.path), *odd_forms.binary_off(data)), self.path)
        data = _as_utf8(data)
        try:
            geometries = _by_trimesh(self.path, data)
        except Exception:
            free = odd_forms.free_off(data.decode())
            if free is None:
                raise
        else:
            free = None if geometries else odd_forms.free_off(data.decode())
        return geometries if free is None else _one(Mesh(str(self.path), *free), self.path)


class StlFormat(MeshFormat):
    """STL, as text or binary."""

    def count_faces(self, most: int) -> int:
        """Read the count of a binary file, or estimate it from the size of a text file, whose faces need more bytes."""
        with files.opened(self.path) as file:
            head = file.read(STL_HEAD_BYTES)
        size = self.path.stat().st_size
        if len(head) == STL_HEAD_BYTES:
            count = struct.unpack_from("<I", head, STL_HEAD_BYTES - 4)[0]
            if STL_HEAD_BYTES + STL_FACE_BYTES * count == size:
                return count
        return size // STL_FACE_BYTES

    def read(self) -> dict[str, MeshFile]:
        """Read the file."""
        data = files.read_bytes(self.path, max_bytes=limits.MESH_BYTES)
        binary = odd_forms.is_binary_stl(data)
        return _by_trimesh(self.path, data if binary else _as_utf8(data))


def _as_utf8(data: bytes) -> bytes:
    """Replace invalid bytes of text, for which trimesh would need another package to guess the encoding."""
    return data.decode("utf-8", "replace").encode()


def _by_trimesh(path: Path, data: bytes) -> dict[str, MeshFile]:
    """Return the geometries with faces that trimesh finds."""
    import trimesh

    with warnings.catch_warnings():
        # invalid numbers of a broken file are reported by later checks
        warnings.simplefilter("ignore")
        scene = trimesh.load_scene(BytesIO(data), file_type=path.suffix[1:].lower(), process=False)
    geometries = dict[str, MeshFile]()
    for geometry_name, piece in scene.geometry.items():
        if isinstance(piece, trimesh.Trimesh) and len(piece.faces):
            name = path.name if geometry_name == "geometry_0" else geometry_name
            up_axis = 2 if path.suffix.lower() == ".stl" else 1
            mesh = Mesh.triangles(str(path), piece.vertices, piece.faces, up_axis=up_axis)
            geometries[name] = MeshFile.whole(path, MeshContent(mesh))
    return geometries


def _one(mesh: Mesh, path: Path) -> dict[str, MeshFile]:
    return {path.name: MeshFile.whole(path, MeshContent(mesh))}
