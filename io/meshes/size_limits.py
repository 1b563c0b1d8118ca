"""Size limits of meshes: faces are counted from the header or a scan of the bytes, before memory is taken for them."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...errors import InputError
from .. import limits
from ..files import open_input
from .gltf_schema import DTYPES
from .obj_source import ObjSource

HEADER = 1 << 16
ITEMS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def faces(path: Path, most: int) -> int:
    """The number of faces that a mesh file declares.

    Raises:
        InputError: more than `most`, or the file is missing.
    """
    open_input(path)
    suffix = path.suffix.lower()
    count = _gltf(path, most) if suffix in (".glb", ".gltf") else COUNTS.get(suffix, lambda path: 0)(path)
    return refuse(path, count, most)


def refuse(path: Path, count: int, most: int) -> int:
    """The number of faces, if there are not more than `most`.

    Raises:
        InputError: there are.
    """
    if count > most:
        raise InputError(f"{path}: {count} faces are more than {most}; raise --max-faces")
    return count


def _obj(path: Path) -> int:
    return ObjSource(path).faces


def _ply(path: Path) -> int:
    found = re.search(rb"element[ \t]+face[ \t]+(\d{1,18})", _head(path))
    return int(found[1]) if found else 0


def _off(path: Path) -> int:
    text = re.sub(rb"#[^\n]*", b"", _head(path))
    found = re.match(rb"\s*[A-Za-z]*\s*\d+\s+(\d{1,18})\s", text)
    return int(found[1]) if found else 0


def _stl(path: Path) -> int:
    """Binary: a count after 80 bytes; as text every face has its own `facet`, of at least 50 bytes."""
    head, size = _head(path), path.stat().st_size
    if len(head) >= 84:
        count = struct.unpack_from("<I", head, 80)[0]
        if 84 + 50 * count == size:
            return count
    return size // 50


def _gltf(path: Path, most: int) -> int:
    """Triangles over all primitives; 0 where the JSON makes no sense, which the reader will say.

    Raises:
        InputError: an accessor claims more than the file has data for: readers take the memory before they look.
    """
    try:
        scene: Any = json.loads(_scene(path))
        found = next(_unbacked(scene, most), None)
        primitives = [p for mesh in scene.get("meshes", []) for p in mesh["primitives"]]
        count = sum(scene["accessors"][p["indices"]]["count"] // 3 for p in primitives if "indices" in p)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return 0
    if found:
        raise InputError(f"{path}: accessor {found[0]} claims {found[1]} items, more than there are data for")
    return count


def _scene(path: Path) -> bytes:
    """The JSON of a glTF file, by itself or in a GLB."""
    with path.open("rb") as file:
        if path.suffix.lower() == ".gltf":
            return file.read(limits.SCENE_BYTES)
        start = file.read(20)
        if len(start) < 20 or start[:4] != b"glTF":
            return b""
        return file.read(min(struct.unpack_from("<I", start, 12)[0], limits.SCENE_BYTES))


def _unbacked(scene: Any, most: int) -> Iterator[tuple[int, int]]:
    """Number and count of each accessor that claims more items than it has data for."""
    views = scene.get("bufferViews", [])
    for number, accessor in enumerate(scene.get("accessors", [])):
        count, view = accessor.get("count", 0), accessor.get("bufferView")
        held, size = limits.ITEMS_PER_FACE * most, 0
        if view is not None:
            size = views[view]["byteLength"]
            held = size // (int(DTYPES[accessor["componentType"]][2]) * ITEMS[accessor["type"]])
        if not 0 <= count <= held or size > limits.BUFFER_BYTES:
            yield number, count


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEADER)


COUNTS = {".obj": _obj, ".ply": _ply, ".off": _off, ".stl": _stl}
