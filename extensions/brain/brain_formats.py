"""Cortical surfaces: GIFTI, and the surfaces and patches of FreeSurfer, read by nibabel."""

import math
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError, naming
from ...io import files, limits
from ...io.isolated import process
from ...io.meshes.mesh_format import MeshContent, MeshFile, MeshFormat, Overlay
from ...meshes.mesh import Mesh
from ...saved import archive
from . import EXTRA, brain_readers

MOST_DIGITS = 12  # of a size
POINTSET, TRIANGLE = 1008, 1009
"""GIFTI's intents of arrays of points and of triangles."""
ARRAY = re.compile(rb"<DataArray\b[^>]*>")
LABEL_INTENT = 1002
"""GIFTI's intent of an array of labels."""
TRIANGLE_MAGIC, QUAD_MAGICS = 0xFFFFFE, (0xFFFFFF, 0xFFFFFD)
"""The first three bytes of a FreeSurfer surface."""
CURVATURE_MAGIC = b"\xff\xff\xff"
"""The first three bytes of a file of numbers at the vertices."""
MGH_HEADER_BYTES = 284
MGH_BYTES = {0: 1, 1: 4, 3: 4, 4: 2}
"""Bytes of a number in an MGH file, by its codes."""
WHOLE_SURFACES = ("fiducial", "midthickness", "white", "smoothwm", "pial", "orig", "inflated")
"""Surfaces beside a patch from which its triangles and, for a patch in space, its shape are taken: the first one that
exists. Distances are measured on the folded surface, not on the inflated one on which cuts are drawn."""


class GiftiFormat(MeshFormat):
    """GIFTI surfaces (.gii, .surf.gii, also compressed as .gii.gz)."""

    def count_faces(self, most: int) -> int:
        """Return the number of triangles that the file declares."""
        with files.opened(self.path) as file:
            if not file.read(1):
                return 0
        triangle_tags = [tag[0] for tag in ARRAY.finditer(gifti_bytes(self.path)) if b"TRIANGLE" in tag[0]]
        rows = re.search(rb'Dim0\s*=\s*"(\d{1,18})"', triangle_tags[0]) if triangle_tags else None
        return int(rows[1]) if rows else 0

    def read(self) -> dict[str, MeshFile]:
        """Read the first set of points and triangles."""
        data = gifti(self.path)
        points, faces = (
            [array for array, kind in zip(data["arrays"], data["intents"]) if kind == intent]
            for intent in (POINTSET, TRIANGLE)
        )
        if not (points and faces):
            raise InputError(
                f"{self.path}: has no surface, but other data of GIFTI; name a surface (.surf.gii), and this file "
                "with --overlay"
            )
        return _one(self.path, points[0], faces[0])

    def overlay(self, name: str | None) -> Overlay | None:
        """Read the first array of numbers or labels, which have no names."""
        if name:
            return None
        data = gifti(self.path)
        arrays = [
            (array, intent)
            for array, intent in zip(data["arrays"], data["intents"])
            if array.ndim and array.size == len(array)
        ]
        if not arrays:
            raise InputError(f"{self.path}: has no values at vertices")
        values, intent = arrays[0][0].astype(float).ravel(), arrays[0][1]
        if intent != LABEL_INTENT:
            return Overlay(values)
        return Overlay(values, {int(key): np.array(color) for key, *color in data["labels"]})


class FreeSurferFormat(MeshFormat):
    """FreeSurfer's surfaces (lh.white, rh.inflated, …) and patches (lh.cortex.patch.3d, lh.cortex.patch.flat)."""

    def count_faces(self, most: int) -> int:
        """Return the number of faces in the header; for a patch that of the surface that it is a part of."""
        path = _surface_of(self.path) if is_patch(self.path) else self.path
        with files.opened(path) as file:
            head = file.read(limits.MESH_HEADER_BYTES)
        magic = int.from_bytes(head[:3], "big")
        if magic == TRIANGLE_MAGIC:
            start = head.find(b"\n", head.find(b"\n", 3) + 1) + 1
            counts = struct.unpack_from(">ii", head, start) if 0 < start <= len(head) - 8 else (0, 0)
            least = 12 * (counts[0] + counts[1])
        elif magic in QUAD_MAGICS:
            counts = int.from_bytes(head[3:6], "big"), 2 * int.from_bytes(head[6:9], "big")
            least = 6 * (counts[0] + counts[1])
        else:
            return 0
        if min(counts) < 0 or least > path.stat().st_size:
            return 0
        return counts[1]

    def files_named(self) -> list[str]:
        """Return the surface that a patch is a part of."""
        return [str(_surface_of(self.path))] if is_patch(self.path) else []

    def read(self) -> dict[str, MeshFile]:
        """Read a surface, or a patch with the triangles of its surface."""
        if not self.count_faces(-1):
            raise InputError(f"{self.path}: is not a surface of FreeSurfer, or is damaged")
        if not is_patch(self.path):
            return _one(self.path, *_surface(self.path))
        whole = _surface_of(self.path)
        points, faces = _surface(whole)
        vertices, positions = _patch(self.path, len(points))
        inside = np.zeros(len(points), bool)
        inside[vertices] = True
        note = f"triangles of {whole.name}"
        if self.path.name.endswith("flat"):
            points = np.zeros_like(points)
            points[vertices] = positions
        else:
            note = f"triangles and positions of {whole.name}"
        return _one(self.path, points, faces[inside[faces].all(axis=1)], note)

    def overlay(self, name: str | None) -> Overlay | None:
        """Read numbers (curv, thickness, .mgh) or labels (.annot), which have no names."""
        if name:
            return None
        is_volume = self.path.suffix.lower() in (".mgh", ".mgz")
        kind = "mgh" if is_volume else "annot" if self.path.name.endswith(".annot") else "morph"
        data = freesurfer(self.path, kind)
        if kind != "annot":
            return Overlay(data["values"])
        colors = np.column_stack([data["colors"][:, :3] / 255, np.ones(len(data["colors"]))])
        return Overlay(data["values"], dict(enumerate(colors)))


def freesurfer(path: Path, kind: str) -> dict[str, Any]:
    """Read a file of FreeSurfer in a separate process, see `brain_readers.freesurfer`.

    Raises:
        InputError: nibabel is not installed, or the file cannot be read.
    """
    EXTRA.require(f"{path}: reading it", "nibabel")
    if kind != "surface" and _promised(path, kind) > path.stat().st_size:
        raise InputError(f"{path}: damaged: its header promises more values than the file contains")
    return process.read(path, brain_readers.freesurfer, kind=kind)


def _promised(path: Path, kind: str) -> int:
    """Return the least number of bytes of a file with as many values as its header promises.

    Raises:
        InputError: the header is damaged.
    """
    with files.opened(path, max_bytes=limits.MESH_BYTES) as file:
        head = file.read(MGH_HEADER_BYTES)
        ratio = 1
        if head.startswith(b"\x1f\x8b"):
            ratio = limits.DEFLATE_RATIO
            file.seek(0)
            try:
                head = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS).decompress(
                    file.read(1 << 16), MGH_HEADER_BYTES
                )
            except zlib.error as error:
                raise InputError(f"{path}: damaged: {error}") from None
    try:
        if kind == "mgh":
            version, *sides, code = struct.unpack_from(">6i", head)
            if version != 1 or min(sides) < 1 or code not in MGH_BYTES:
                raise InputError(f"{path}: is not an MGH file with values, or is damaged")
            return math.prod(sides) * MGH_BYTES[code] // ratio
        if kind == "annot":
            count = struct.unpack_from(">i", head)[0]
            least = 4 + 8 * count
        elif head.startswith(CURVATURE_MAGIC):
            count = struct.unpack_from(">i", head, 3)[0]
            least = 15 + 4 * count
        else:  # two numbers of three bytes, and two bytes for each value
            count = int.from_bytes(head[:3], "big")
            least = 6 + 2 * count
    except struct.error:
        raise InputError(f"{path}: damaged: it is too short") from None
    if count < 1:
        raise InputError(f"{path}: has no values, or is damaged")
    return least


def _surface(path: Path) -> tuple[Real, Index]:
    """Return the points and triangles of a surface of FreeSurfer."""
    data = freesurfer(path, "surface")
    return data["points"], data["faces"]


def gifti(path: Path) -> dict[str, Any]:
    """Read a GIFTI file in a separate process, see `brain_readers.gifti`.

    Raises:
        InputError: nibabel is not installed, or the file is too large, refers to other files, or promises more than it
            contains.
    """
    EXTRA.require(f"{path}: reading it", "nibabel")
    data = gifti_bytes(path)
    if b"ExternalFileBinary" in data:
        raise InputError(f"{path}: its data are in another file; save it with its data")
    for tag in ARRAY.finditer(data):
        count = re.search(rb'Dimensionality\s*=\s*["\']\s*(\d+)', tag[0])
        sides = [int(side[:MOST_DIGITS]) for side in re.findall(rb'Dim\d+\s*=\s*["\']\s*(\d+)', tag[0])]
        if (count and int(count[1][:MOST_DIGITS]) > limits.GIFTI_DIMENSIONS) or math.prod(
            sides
        ) > limits.DEFLATE_RATIO * len(data):
            raise InputError(f"{path}: damaged: an array promises more numbers than the file contains")
    return process.read(path, brain_readers.gifti)


def gifti_bytes(path: Path) -> bytes:
    """Return the content of a GIFTI file; a compressed one is unpacked up to the limit.

    Raises:
        InputError: it cannot be read, is damaged or too large.
    """
    data = files.read_bytes(path, max_bytes=limits.MESH_BYTES)
    if not data.startswith(b"\x1f\x8b"):
        return data
    with naming(path):
        return archive.gunzip(data, limits.MESH_BYTES)


def is_patch(path: Path) -> bool:
    """Return whether a file of FreeSurfer is a patch, by its name."""
    return ".patch" in path.name or path.name.endswith(".flat")


def _surface_of(patch: Path) -> Path:
    """Return the surface that a patch is a part of.

    Raises:
        InputError: there is none beside it.
    """
    side = patch.name.partition(".")[0]
    for name in WHOLE_SURFACES:
        if (surface := patch.with_name(f"{side}.{name}")).is_file():
            return surface
    raise InputError(
        f"{patch}: a patch has no triangles, and the surface that it is a part of is not beside it; put {side}.white "
        "there"
    )


def _patch(path: Path, count: int) -> tuple[Index, Real]:
    """Return the vertices (k,) of a surface that a patch has, and their positions (k, 3)."""
    data = files.read_bytes(path, max_bytes=limits.MESH_BYTES)
    row = np.dtype([("vertex", ">i4"), ("place", ">f4", 3)])
    head = struct.unpack_from(">ii", data) if len(data) >= 8 else (0, 0)
    if head[0] != -1 or head[1] < 0 or len(data) < 8 + head[1] * row.itemsize:
        raise InputError(f"{path}: is not a patch of FreeSurfer, or is damaged")
    rows = np.frombuffer(data, row, head[1], 8)
    vertices = np.abs(rows["vertex"].astype(np.int64)) - 1  # from 1, and negative on the boundary
    if vertices.size and not 0 <= vertices.min() <= vertices.max() < count:
        raise InputError(
            f"{path}: is a patch of another surface: it has a vertex beyond the {count} of this one"
        )
    return vertices, rows["place"].astype(float)


def _one(path: Path, points: Any, faces: Any, *notes: str) -> dict[str, MeshFile]:
    mesh = Mesh.triangles(str(path), np.asarray(points, float), np.asarray(faces, np.int64))
    return {path.name: MeshFile.whole(path, MeshContent(mesh), None, *notes)}
