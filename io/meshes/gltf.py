"""Read glTF files without loss: the JSON, the bytes of buffer views, the values of accessors; and write them as GLB.

Khronos, *glTF 2.0 Specification*, 2021: §3.6 describes accessors, §4.4 GLB. trimesh also reads such files, but does not
support sparse or normalized accessors, and drops the data that it does not use, so that they could not be written back.
"""

import base64
import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real, unit_vectors
from ...errors import InputError
from ...meshes.mesh import Mesh
from ...pixels.texture import REPEAT, Wrap
from .. import files, limits, references
from . import gltf_compressed, gltf_schema
from .gltf_materials import base, set_of
from .gltf_schema import COMPONENTS, DTYPES, TRIANGLES_MODE
from .odd_forms import strip

LINES_MODE, STRIP_MODE, FAN_MODE = 1, 5, 6
WRAPS = {33071: "clamp", 33648: "mirror"}
SAME_PLACE_SHARE = 1e-4
"""Of the largest number in several transforms: numbers closer than this are equal up to rounding."""
VIEW_ALIGNMENT_BYTES = 8  # bytes to which views are aligned, as required by the strictest extension


@dataclass(frozen=True, eq=False)
class Gltf:
    """A glTF file.

    Attributes:
        path: the file.
        tree: its JSON.
        views: the bytes of each buffer view.
    """

    path: Path
    tree: dict[str, Any]
    views: list[bytes]

    def values(self, accessor: int) -> NDArray:
        """Return (n, k) the elements of an accessor, as they are stored."""
        stored = self.tree["accessors"][accessor]
        dtype, width, count = (
            np.dtype(DTYPES[stored["componentType"]]),
            COMPONENTS[stored["type"]],
            stored["count"],
        )
        if "bufferView" in stored:
            view, offset = stored["bufferView"], stored.get("byteOffset", 0)
            stride = self.tree["bufferViews"][view].get("byteStride", width * dtype.itemsize)
            values = np.ndarray((count, width), dtype, self.views[view], offset, (stride, dtype.itemsize))
        else:
            values = np.zeros((count, width), dtype)
        return self._with_sparse(values, stored["sparse"]) if "sparse" in stored else values

    def _with_sparse(self, values: NDArray, sparse: dict) -> NDArray:
        count, indices, replacements = sparse["count"], sparse["indices"], sparse["values"]
        values = values.copy()
        rows = np.frombuffer(
            self.views[indices["bufferView"]],
            DTYPES[indices["componentType"]],
            count,
            indices.get("byteOffset", 0),
        )
        data = self.views[replacements["bufferView"]]
        values[rows] = np.ndarray(
            (count, values.shape[1]), values.dtype, data, replacements.get("byteOffset", 0), order="C"
        )
        return values

    def floats(self, accessor: int) -> Real:
        """Return (n, k) the elements of an accessor as floats; normalized integers become 0 … 1 or -1 … 1."""
        values = self.values(accessor)
        if not self.tree["accessors"][accessor].get("normalized") or values.dtype.kind == "f":
            return values.astype(float)
        return np.maximum(values / np.iinfo(values.dtype).max, -1.0)

    def source_of(self, texture: int) -> int | None:
        """Return the index of a texture's image, if necessary that of an extension; None without any."""
        entry = self.tree["textures"][texture]
        return entry.get("source", next(_sources(entry), None))

    def wrap_of(self, texture: int) -> Wrap:
        """Return a texture's horizontal and vertical wrap mode."""
        sampler = self.tree["textures"][texture].get("sampler")
        modes = {} if sampler is None else self.tree["samplers"][sampler]
        across, down = (WRAPS.get(modes.get(name, 0), "repeat") for name in ("wrapS", "wrapT"))
        return across, down

    def image(self, number: int) -> bytes | None:
        """Return the content of an image file; None if the image has no source.

        Raises:
            InputError: it refers to a file that is missing or in another folder.
        """
        entry = self.tree["images"][number]
        if "bufferView" in entry:
            return bytes(self.views[entry["bufferView"]])
        return _content(self.path, entry["uri"]) if "uri" in entry else None

    @cached_property
    def nodes(self) -> dict[int, Real]:
        """World transform of each node of the scene, by its index, in the order of the scene; shape (4, 4).

        Raises:
            ValueError: composed transforms have numbers that are not finite, or too large.
        """
        nodes, scenes = self.tree.get("nodes", []), self.tree.get("scenes", [])
        roots = scenes[self.tree.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
        waiting = [(node, np.eye(4)) for node in reversed(roots)]
        transforms = dict[int, Real]()
        while waiting:
            number, parent_transform = waiting.pop()
            if number not in transforms:
                transforms[number] = matrix = parent_transform @ _matrix(nodes[number])
                if not (np.abs(matrix) <= limits.MESH_COORDINATE).all():  # NaN included
                    raise ValueError(
                        f"nodes/{number}: its transform moves vertices beyond {limits.MESH_COORDINATE:g}"
                    )
                waiting += [(child, matrix) for child in reversed(nodes[number].get("children", []))]
        return transforms

    def pose(self, skin: int) -> Real:
        """Return (j, 4, 4) the transforms by which a skin's joints move the vertices bound to them."""
        entry = self.tree["skins"][skin]
        joints = np.array([self.nodes.get(joint, np.eye(4)) for joint in entry["joints"]])
        if "inverseBindMatrices" not in entry:
            return joints
        return joints @ self.floats(entry["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)


@dataclass(frozen=True, eq=False)
class Primitive:
    """One primitive of a mesh in a glTF file.

    Attributes:
        document: the file.
        mesh: index of the mesh.
        number: index of the primitive in the mesh.
    """

    document: Gltf
    mesh: int
    number: int

    @property
    def tree(self) -> dict[str, Any]:
        """Its JSON."""
        return self.document.tree["meshes"][self.mesh]["primitives"][self.number]

    @property
    def attributes(self) -> dict[str, int]:
        """The accessor index of each attribute."""
        return self.tree["attributes"]

    @property
    def material(self) -> dict[str, Any]:
        """The JSON of its material; empty without one."""
        number = self.tree.get("material")
        return {} if number is None else self.document.tree["materials"][number]

    @property
    def key(self) -> str:
        """The index of its material as text; empty without one."""
        return str(self.tree.get("material", ""))

    @property
    def faces(self) -> Index:
        """Vertices of its triangles; shape (m, 3)."""
        if "indices" in self.tree:
            flat = self.document.values(self.tree["indices"]).ravel().astype(np.int64)
        else:
            flat = np.arange(self.document.tree["accessors"][self.attributes["POSITION"]]["count"])
        mode = self.tree.get("mode", TRIANGLES_MODE)
        if mode == STRIP_MODE:
            return strip(flat)
        if mode == FAN_MODE:
            return np.column_stack([np.full(max(flat.size - 2, 0), flat[0]), flat[1:-1], flat[2:]])
        return flat.reshape(-1, 3)

    @cached_property
    def placed(self) -> Real:
        """World transform (4, 4), or (n, 4, 4) for skinned vertices, by one of the nodes that show the primitive.

        If several nodes do, it is the one with the least x, then y, then z: other programs may reorder nodes when they
        rewrite a file. The node's own transform is ignored if it has a skin (Khronos, *glTF 2.0*, §3.7.3.3).
        """
        document = self.document
        nodes = document.tree.get("nodes", [])
        instances = [
            (nodes[number], matrix)
            for number, matrix in document.nodes.items()
            if nodes[number].get("mesh") == self.mesh
        ]
        if not instances:
            return np.eye(4)
        instance = instances[_least([matrix for _, matrix in instances])]
        sets = range(sum(name.startswith("JOINTS_") for name in self.attributes))
        if "skin" not in instance[0] or not sets:
            return instance[1]
        joints = np.hstack([document.values(self.attributes[f"JOINTS_{k}"]) for k in sets])
        weights = np.hstack([document.floats(self.attributes[f"WEIGHTS_{k}"]) for k in sets])
        total = weights.sum(axis=1, keepdims=True)
        weights = np.where(total > 0, weights / np.maximum(total, 1e-300), 1 / weights.shape[1])
        return np.einsum("nk,nkij->nij", weights, document.pose(instance[0]["skin"])[joints])

    @property
    def points(self) -> Real:
        """Its vertices in scene coordinates; shape (n, 3)."""
        return self._turned(self.placed, "POSITION") + self.placed[..., :3, 3]

    @property
    def normals(self) -> Real | None:
        """Unit normals of its vertices in scene coordinates, or None; shape (n, 3)."""
        return (
            unit_vectors(self._turned(_cofactors(self.placed), "NORMAL"))
            if "NORMAL" in self.attributes
            else None
        )

    @property
    def tangents(self) -> Real | None:
        """Tangents of its vertices in scene coordinates with the sign of the bitangents, or None; shape (n, 4)."""
        if "TANGENT" not in self.attributes:
            return None
        side = self.document.floats(self.attributes["TANGENT"])[:, 3]
        mirrored = np.where(np.linalg.det(self.placed[..., :3, :3]) < 0, -1.0, 1.0)
        return np.column_stack([unit_vectors(self._turned(self.placed, "TANGENT")), side * mirrored])

    def _turned(self, matrices: Real, name: str) -> Real:
        """Return (n, 3) vectors of an attribute multiplied by matrices (…, 3, 3), or the same part of larger ones."""
        vectors = self.document.floats(self.attributes[name])[:, :3]
        return np.einsum("...ij,...j->...i", matrices[..., :3, :3], vectors)

    def uv(self, info: dict[str, Any]) -> Real | None:
        """Return (n, 2) texture coordinates for a `textureInfo`, v up, with its transform applied; or None."""
        name = f"TEXCOORD_{set_of(info)}"
        if name not in self.attributes:
            return None
        uv = self.document.floats(self.attributes[name])[:, :2]
        transform = info.get("extensions", {}).get("KHR_texture_transform", {})
        (a, b), angle = transform.get("scale", (1, 1)), transform.get("rotation", 0.0)
        c, s = np.cos(angle), np.sin(angle)
        uv = (uv * (a, b)) @ np.array([[c, -s], [s, c]]) + transform.get("offset", (0, 0))
        return np.column_stack([uv[:, 0], 1 - uv[:, 1]])

    @property
    def picture(self) -> bytes | None:
        """Content of the picture of its material's base colour, or None."""
        info = base(self.material)
        source = self.document.source_of(info["index"]) if info else None
        return None if source is None else self.document.image(source)

    @property
    def wrap(self) -> Wrap:
        """Wrap mode of that picture."""
        info = base(self.material)
        return self.document.wrap_of(info["index"]) if info else REPEAT

    def triangles(self) -> Mesh:
        """Return the triangles of the primitive, with the texture coordinates of its material's base colour."""
        path, faces = self.document.path, self.faces.ravel()
        uv, normals = self.uv(base(self.material)), self.normals
        return Mesh(
            str(path),
            self.points,
            faces,
            3 * np.arange(faces.size // 3 + 1),
            uv,
            None if uv is None else faces,
            normals=normals,
            normal_corners=None if normals is None else faces,
        )


def read(path: Path) -> Gltf:
    """Read a .glb or .gltf file, and the buffers that it refers to.

    Raises:
        InputError: a buffer is missing or in another folder, or data is compressed.
        ValueError, LookupError, TypeError, struct.error: the file does not have this format.
    """
    data = files.read_bytes(path, max_bytes=limits.MESH_BYTES)
    text, binary_chunk = _chunks(data) if data[:4] == b"glTF" else (data, b"")
    tree = json.loads(text)
    gltf_schema.check(tree)
    buffers = [
        _content(path, buffer["uri"]) if "uri" in buffer else binary_chunk
        for buffer in tree.get("buffers", [])
    ]
    decompressed = gltf_compressed.meshopt_views(path, tree, buffers)
    views = [
        decompressed.get(k) or _view(buffers, view) for k, view in enumerate(tree.get("bufferViews", []))
    ]
    return Gltf(path, *gltf_compressed.without_draco(path, tree, views))


def primitives(document: Gltf) -> dict[str, Primitive]:
    """Return the primitives with triangles by the names of their meshes; further ones are called `name_1`, …"""
    by_name: dict[str, Primitive | None] = {}
    for k, mesh in enumerate(document.tree.get("meshes", [])):
        for number, primitive in enumerate(mesh["primitives"]):
            mode = primitive.get("mode", TRIANGLES_MODE)
            if mode not in (0, LINES_MODE, TRIANGLES_MODE, STRIP_MODE, FAN_MODE):
                continue
            has_triangles = mode >= TRIANGLES_MODE
            name = _unique(mesh.get("name") or "GLTF", by_name)
            by_name[name] = Primitive(document, k, number) if has_triangles else None
    return {name: primitive for name, primitive in by_name.items() if primitive is not None}


def glb(tree: dict[str, Any], views: list[bytes]) -> bytes:
    """Return a GLB file of JSON and the bytes of its buffer views, which are put into one buffer."""
    tree, offset, chunks_of_buffer = dict(tree), 0, list[bytes]()
    places = []
    for view, data in zip(tree.get("bufferViews", []), views):
        places.append({**view, "buffer": 0, "byteOffset": offset, "byteLength": len(data)})
        chunks_of_buffer += [data, bytes(-len(data) % VIEW_ALIGNMENT_BYTES)]
        offset += len(data) + -len(data) % VIEW_ALIGNMENT_BYTES
    if places:
        first = {key: value for key, value in (tree.get("buffers") or [{}])[0].items() if key != "uri"}
        tree |= {"bufferViews": places, "buffers": [{**first, "byteLength": offset}]}
    text = json.dumps(tree, ensure_ascii=False, separators=(",", ":")).encode()
    chunks = [(b"JSON", text + b" " * (-len(text) % 4))] + (
        [(b"BIN\0", b"".join(chunks_of_buffer))] if places else []
    )
    size = 12 + sum(8 + len(data) for _, data in chunks)
    parts = [struct.pack("<4sII", b"glTF", 2, size)]
    for kind, data in chunks:
        parts += [struct.pack("<I4s", len(data), kind), data]
    return b"".join(parts)


def _unique(name: str, used: dict) -> str:
    """Return the name, or else the first of `name_1`, `name_2`, … that is not taken (like trimesh)."""
    number, candidate = 0, name
    while candidate in used:
        number += 1
        candidate = f"{name}_{number}"
    return candidate


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary chunk of a GLB file."""
    version, size = struct.unpack_from("<II", data, 4)
    if version != 2 or size > len(data):
        raise ValueError(f"version {version}, {len(data)} of {size} bytes; is the file truncated?")
    chunks, offset = dict[bytes, bytes](), 12
    while offset + 8 <= size:
        length, kind = struct.unpack_from("<I4s", data, offset)
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + length])
        offset += 8 + length
    return chunks[b"JSON"], chunks.get(b"BIN\0", b"")


def _view(buffers: list[bytes], view: dict) -> bytes:
    start, length = view.get("byteOffset", 0), view["byteLength"]
    content = buffers[view["buffer"]][start : start + length]
    if len(content) != length or start < 0:
        raise ValueError("a buffer is shorter than its views; is the file truncated?")
    return content


def _content(path: Path, uri: str) -> bytes:
    """Return the data that a URI contains, or the content of the file that it names; see `references`."""
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    name = path.parent / unquote(uri)
    if "://" in uri or not references.may_be_read(name, path.parent):
        raise InputError(f"{path}: refers to {uri!r}, {references.OUTSIDE}, or move it next to the mesh")
    return files.read_bytes(name, max_bytes=limits.MESH_BYTES)


def _sources(texture: dict) -> Iterator[int]:
    """Return the image indices that a texture's extensions name."""
    return (
        extension["source"] for extension in texture.get("extensions", {}).values() if "source" in extension
    )


def _matrix(node: dict) -> Real:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)), float)
    transform[:3, 3] = node.get("translation", (0, 0, 0))
    return transform


def _cofactors(matrices: Real) -> Real:
    """Return (…, 3, 3) the matrices that transform normals: the inverse transposes, up to a positive factor."""
    a, b, c = np.moveaxis(matrices[..., :3, :3], -1, 0)
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    return cofactors * np.where(np.linalg.det(matrices[..., :3, :3]) < 0, -1.0, 1.0)[..., None, None]


def _least(places: Sequence[Real]) -> int:
    """Return the index of the least of some transforms (4, 4), ordered by translation, then by the other entries.

    Differences by rounding are ignored.
    """
    rows = np.array([np.append(matrix[:3, 3], matrix[:3, :3]) for matrix in places])
    sizes = np.append(np.full(3, np.abs(rows[:, :3]).max()), np.full(9, np.abs(rows[:, 3:]).max()))
    rounded = np.rint(rows / (SAME_PLACE_SHARE * np.maximum(sizes, 1e-300)))
    return int(np.lexsort(rounded.T[::-1])[0])
