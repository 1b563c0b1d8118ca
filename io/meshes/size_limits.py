"""How large a mesh is, from its header or a scan of its bytes: refused before memory is taken for it."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any

from ...errors import InputError
from ..files import open_input
from .obj_source import ObjSource

HEADER = 1 << 16
MAX_JSON = 1 << 26


def faces(path: Path, most: int) -> int:
    """The number of faces that a mesh file declares.

    Raises:
        InputError: more than `most`, or the file is missing.
    """
    open_input(path)
    return refuse(path, COUNTS.get(path.suffix.lower(), _unknown)(path), most)


def refuse(path: Path, count: int, most: int) -> int:
    """The number of faces, if there are not more than `most`.

    Raises:
        InputError: there are.
    """
    if count > most:
        raise InputError(f"{path}: {count} faces are more than {most}; raise --max-faces")
    return count


def _unknown(path: Path) -> int:
    return 0


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


def _glb(path: Path) -> int:
    with path.open("rb") as file:
        start = file.read(20)
        if len(start) < 20 or start[:4] != b"glTF":
            return 0
        return _gltf_faces(file.read(min(struct.unpack_from("<I", start, 12)[0], MAX_JSON)))


def _gltf(path: Path) -> int:
    with path.open("rb") as file:
        return _gltf_faces(file.read(MAX_JSON))


def _gltf_faces(text: bytes) -> int:
    """Triangles over all primitives; 0 where the JSON makes no sense, which the reader will say."""
    try:
        scene: Any = json.loads(text)
        primitives = [p for mesh in scene.get("meshes", []) for p in mesh["primitives"]]
        return sum(scene["accessors"][p["indices"]]["count"] // 3 for p in primitives if "indices" in p)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return 0


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEADER)


COUNTS = {".obj": _obj, ".ply": _ply, ".off": _off, ".stl": _stl, ".glb": _glb, ".gltf": _gltf}
