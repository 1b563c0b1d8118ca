"""The glTF formats: .glb, and .gltf, which is written with its buffer inside."""

import base64
import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Flags, Real
from ...errors import InputError
from ...meshes.mesh import merge
from ...pixels.texture import Wrap
from ...surfaces.subdivided import Subdivision
from .. import files, formats, limits
from . import gltf, gltf_materials, gltf_write
from .embedding import picture_file
from .gltf import Primitive
from .gltf_schema import COMPONENTS, DTYPES
from .mesh_format import MeshContent, MeshFile, MeshFormat, NewCoordinates, Pictures, ShownPictures, Written

OLD_DIGITS = 5
"""Decimal places to which coordinates that were kept agree with the old ones."""


@dataclass(frozen=True, eq=False)
class GltfContent(MeshContent):
    """Primitives of a glTF file, with everything that belongs to them.

    Attributes:
        primitives: the parts of its meshes that are mapped; `polygons` holds their triangles, one after the other.
    """

    primitives: tuple[Primitive, ...]
    dialect = "gltf"

    @classmethod
    def of(cls, primitives: Sequence[Primitive]) -> "GltfContent":
        """Create the content of some primitives of one file."""
        meshes = [part.triangles() for part in primitives]
        mesh = meshes[0] if len(meshes) == 1 else merge(meshes, str(primitives[0].document.path))
        return cls(mesh, tuple(primitives))

    @classmethod
    def join(cls, contents: Sequence["GltfContent"], name: str) -> "GltfContent":
        """Join the primitives of several contents."""
        mesh = merge([content.polygons for content in contents], name)
        return cls(mesh, tuple(part for content in contents for part in content.primitives))

    def subdivide(self, plan: Subdivision) -> "GltfContent":
        """Replace some triangles by smaller ones, and interpolate all attributes of their vertices."""
        return GltfContent.of(gltf_write.subdivided(self.primitives, plan))

    def faces_called(self, name: str) -> Flags:
        """Mark the triangles (f,) of the geometry or material of this name."""
        mesh_primitives = {(part.mesh, part.number) for part in self.primitives}
        names = [
            {called, part.material.get("name", called)}
            for called, part in gltf.primitives(self.primitives[0].document).items()
            if (part.mesh, part.number) in mesh_primitives
        ]
        if not any(name in aliases for aliases in names):
            available = ", ".join(f"'{alias}'" for alias in sorted(set().union(*names)))
            raise InputError(f"the mesh has no geometry or material named '{name}'; it has {available}")
        counts = [len(part.faces) for part in self.primitives]
        return np.repeat([name in aliases for aliases in names], counts)

    def wrap(self, faces: Flags) -> Wrap:
        """Return the wrap mode of the first primitive's picture."""
        return self.primitives[0].wrap


def primitives_of(file: MeshFile) -> tuple[Primitive, ...]:
    """Return the primitives of a mesh; none if it comes from another format."""
    return file.content.primitives if isinstance(file.content, GltfContent) else ()


class GltfFormat(MeshFormat):
    """Khronos glTF 2.0."""

    dialect = "gltf"
    shows_normals = True

    def count_faces(self, most: int) -> int:
        """Count the triangles of all primitives; 0 where the JSON is invalid, which `read` reports.

        Raises:
            InputError: an accessor has more elements than the file has data, for which readers would allocate memory;
                or the file has too many primitives, or draws the same triangles too often.
        """
        try:
            scene: Any = json.loads(_json_of(self.path))
            excessive = next(_unbacked(scene, most), None)
            primitives = [p for mesh in scene.get("meshes", []) for p in mesh["primitives"]]
            corners = [
                (p["indices"] if "indices" in p else p["attributes"]["POSITION"], p.get("mode"))
                for p in primitives
            ]
            counts = [scene["accessors"][accessor]["count"] // 3 for accessor, _ in corners]
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return 0
        if excessive:
            number, items = excessive
            raise InputError(f"{self.path}: accessor {number} has {items} items, more than its data")
        if len(primitives) > limits.PRIMITIVES:
            raise InputError(
                f"{self.path}: has {len(primitives)} primitives, more than {limits.PRIMITIVES}; join some of them"
            )
        once = sum(dict(zip(corners, counts)).values())
        if (repeated := sum(counts) - once) > limits.REPEATED_FACES:
            raise InputError(
                f"{self.path}: its primitives repeat {repeated} triangles, more than {limits.REPEATED_FACES}; "
                "remove the copies"
            )
        return sum(counts)

    def files_named(self) -> list[str]:
        """List the buffers and pictures that a .gltf file refers to."""
        if formats.suffix_of(self.path) != ".gltf" or self.path.stat().st_size > limits.SCENE_BYTES:
            return []
        try:
            scene = json.loads(self.path.read_bytes())
            items = [item for key in ("buffers", "images") for item in scene.get(key, [])]
            names = [item["uri"] for item in items if "uri" in item]
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return []
        file_names = [name for name in names if isinstance(name, str) and not name.startswith("data:")]
        return [str(self.path.parent / name) for name in file_names]

    def read(self) -> dict[str, MeshFile]:
        """Read each primitive that has triangles."""
        parts = gltf.primitives(gltf.read(self.path))
        if self.halvings and parts:  # all at once, since they share one document
            divided = GltfContent.of([*parts.values()]).divide(self.halvings)
            assert isinstance(divided, GltfContent)
            parts = dict(zip(parts, divided.primitives))
        return {
            name: MeshFile.whole(self.path, GltfContent.of([part]), part.picture)
            for name, part in parts.items()
        }

    def millimetres(self) -> float:
        """Return the length of a metre, the unit of all glTF files."""
        return 1000.0

    def _divided(self, geometries: dict[str, MeshFile]) -> dict[str, MeshFile]:
        """Return the geometries unchanged: `read` has divided them."""
        return geometries

    def same_mesh(self, file: MeshFile) -> list[str]:
        """Return the names of all primitives of the mesh to which a primitive belongs, one per material."""
        primitive = primitives_of(file)[0]
        return [
            name for name, part in gltf.primitives(primitive.document).items() if part.mesh == primitive.mesh
        ]

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
        """Write a mesh with other texture coordinates; if it was read from a glTF file, all else is kept."""
        by_slot = {gltf_materials.BASE: pictures.texture, gltf_materials.NORMALS: pictures.normals}
        common = {slot: picture_file(picture) for slot, picture in by_slot.items() if picture is not None}
        keys = {part.key for part in primitives_of(file)} or {""}
        pictures_by_key = {key: common | dict(pictures.pictures.get(key, {})) for key in keys}
        glb, notes = _with_coordinates(file, new, pictures_by_key, untinted=pictures.texture is not None)
        out.write_bytes(as_named(glb, name))
        return Written(notes=[f"{name}: {note}" for note in notes])

    @classmethod
    def round_uv(cls, uv: Real) -> Real:
        """Round texture coordinates (t, 2) to single precision, with v down."""
        single = np.column_stack([uv[:, 0], 1 - uv[:, 1]]).astype(np.float32)
        return np.column_stack([single[:, 0], 1.0 - single[:, 1].astype(float)])

    @classmethod
    def check_texture(cls, name: Path, texture: Path | bytes | None) -> None:
        """Refuse a picture that cannot be embedded."""
        if texture is not None:
            picture_file(texture)

    @classmethod
    def split_uv(cls, path: Path) -> tuple[Real, Any]:
        """Return the values of accessors of texture coordinates, and separately the JSON and all other bytes."""
        try:
            file = gltf.read(path)
        except InputError:
            raise
        except Exception as error:  # whatever exception a parser raises, the file is at fault
            raise InputError(f"{path}: cannot read this GLB file: {error}") from None
        attribute_sets = [p["attributes"] for mesh in file.tree.get("meshes", []) for p in mesh["primitives"]]
        uv_accessors = {
            number
            for attributes in attribute_sets
            for name, number in attributes.items()
            if name.startswith("TEXCOORD_")
        }
        accessors, views = file.tree.get("accessors", []), list(file.views)
        shared = {
            accessor.get("bufferView") for n, accessor in enumerate(accessors) if n not in uv_accessors
        } | {None}
        alone = [n for n in sorted(uv_accessors) if accessors[n].get("bufferView") not in shared]
        uv = np.concatenate([file.floats(n)[:, :2] for n in alone] or [np.zeros((0, 2))])
        for number in alone:
            views[accessors[number]["bufferView"]] = b""
            new_accessor = {
                key: value for key, value in accessors[number].items() if key not in ("min", "max")
            }
            accessors[number] = new_accessor
        return uv, (file.tree, views)


def with_new_layout(file: MeshFile, old: Sequence[MeshFile]) -> MeshFile:
    """Return the mesh with its first set of texture coordinates as its layout, where materials use an older set.

    `iccm flatten` keeps the old coordinates as another set, for the pictures that are still on them. They are
    recognised by their values, which are those of the mesh `old`.
    """
    parts, known = primitives_of(file), [of.mesh.uv for of in old if of.mesh.uv is not None]
    if not parts or not known:
        return file
    rows = np.unique(np.round(np.concatenate(known), OLD_DIGITS), axis=0)
    document, changed = parts[0].document, False
    for part in parts:
        for _, info in gltf_materials.slots(part.material):
            kept = gltf_materials.set_of(info)
            if not kept or not {"TEXCOORD_0", f"TEXCOORD_{kept}"} <= set(part.attributes):
                continue
            uv = document.floats(part.attributes[f"TEXCOORD_{kept}"])[:, :2].astype(float)
            own = np.unique(np.round(np.column_stack([uv[:, 0], 1 - uv[:, 1]]), OLD_DIGITS), axis=0)
            if len(np.unique(np.concatenate([rows, own]), axis=0)) == len(rows):
                gltf_materials.use_first_set(info)
                changed = True
    if not changed:
        return file
    content = GltfContent.of([Primitive(document, part.mesh, part.number) for part in parts])
    return file.part_of(content, file.faces)


def _with_coordinates(
    file: MeshFile, new: NewCoordinates, pictures: Pictures, *, untinted: bool
) -> tuple[bytes, list[str]]:
    """Return the bytes of a GLB file, and notes; see `gltf_write.with_coordinates`."""
    if parts := primitives_of(file):
        return gltf_write.with_coordinates(
            parts, file.faces, new.uv, new.corners, pictures, untinted=untinted, kept=new.kept
        )
    mesh, triangles = file.mesh, new.triangles
    normals = None
    if mesh.normals is not None and mesh.normal_corners is not None:
        normals = mesh.normals, mesh.normal_corners[triangles]
    whole = gltf_write.plain(file.path.stem, (mesh.points, mesh.corners[triangles]), normals)
    every = np.ones(len(triangles), bool)
    part = Primitive(whole, 0, 0)
    return gltf_write.with_coordinates([part], every, new.uv, new.corners[triangles].ravel(), pictures)


def as_named(glb: bytes, name: str | Path) -> bytes:
    """Return a GLB file in the form of its name's suffix: as it is, or as .gltf, with its buffer inside the JSON."""
    if formats.suffix_of(name) != ".gltf":
        return glb
    length = struct.unpack_from("<I", glb, 12)[0]
    scene = json.loads(glb[20 : 20 + length])
    if scene.get("buffers"):
        size = int(scene["buffers"][0]["byteLength"])
        data = base64.b64encode(glb[28 + length : 28 + length + size]).decode()
        scene["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
    return json.dumps(scene, separators=(",", ":")).encode()


def _json_of(path: Path) -> bytes:
    """Return the JSON of a glTF file, either separate or in a GLB."""
    with files.opened(path) as file:
        if formats.suffix_of(path) == ".gltf":
            return file.read(limits.SCENE_BYTES)
        start = file.read(20)
        if len(start) < 20 or start[:4] != b"glTF":
            return b""
        return file.read(min(struct.unpack_from("<I", start, 12)[0], limits.SCENE_BYTES))


def _unbacked(scene: Any, most: int) -> Iterator[tuple[int, int]]:
    """Yield index and count of each accessor that has more elements than data."""
    views = scene.get("bufferViews", [])
    for number, accessor in enumerate(scene.get("accessors", [])):
        count, view = accessor.get("count", 0), accessor.get("bufferView")
        available, size = limits.ITEMS_PER_FACE * most, 0
        if view is not None:
            size = views[view]["byteLength"]
            item_bytes = int(DTYPES[accessor["componentType"]][2]) * COMPONENTS[accessor["type"]]
            available = size // item_bytes
        if not 0 <= count <= available or size > limits.BUFFER_BYTES:
            yield number, count
