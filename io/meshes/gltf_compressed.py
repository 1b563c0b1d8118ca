"""Decompress glTF files that are compressed by Draco or meshopt.

Khronos, *KHR_draco_mesh_compression*, 2018: a primitive refers to a buffer view, and lists the id of each attribute
there. *EXT_meshopt_compression*, 2020, and *KHR_meshopt_compression*, 2025: a buffer view refers to bytes of a buffer,
and gives the number and size of the elements that they encode.
"""

from collections.abc import Collection
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from .. import extras, limits
from .gltf_schema import DTYPES, TRIANGLES_MODE

DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
UNCOMPRESSED = "save it without compression"


def meshopt_views(path: Path, tree: dict[str, Any], buffers: list[bytes]) -> dict[int, bytes]:
    """Decode buffer views compressed by meshopt; return their bytes by index, and remove the extension from the JSON.

    Raises:
        InputError: meshopt is not installed.
        ValueError: the compressed data do not match the JSON.
    """
    needed, decoded = set(MESHOPT) & set(tree.get("extensionsRequired", [])), dict[int, bytes]()
    for number, view in enumerate(tree.get("bufferViews", [])):
        compressions = {
            name: view["extensions"].pop(name) for name in MESHOPT if name in view.get("extensions", {})
        }
        for name in needed & compressions.keys():
            decoded[number] = _decoded(path, name, f"bufferViews/{number}", compressions[name], buffers)
            if len(decoded[number]) != view["byteLength"]:
                raise ValueError(f"bufferViews/{number}: does not have {view['byteLength']} bytes")
    for buffer in tree.get("buffers", []):  # placeholders for decoded data
        if set(MESHOPT) & set(buffer.get("extensions", {})):
            del buffer["extensions"]
    _forget(tree, MESHOPT)
    return decoded


def _decoded(path: Path, name: str, place: str, compression: dict[str, Any], buffers: list[bytes]) -> bytes:
    meshopt = extras.load(f"{path}: reading {name}", "meshopt", otherwise=UNCOMPRESSED)
    start, count, stride = compression.get("byteOffset", 0), compression["count"], compression["byteStride"]
    data = buffers[compression["buffer"]][start : start + compression["byteLength"]]
    if not 0 <= count * stride <= limits.MESH_BYTES:
        raise ValueError(f"{place}: {count} items of {stride} bytes")
    try:
        rows = meshopt.decode_gltf_buffer(data, count, stride, compression["mode"], compression.get("filter"))
    except Exception as error:  # meshopt's exceptions have no common base class
        raise ValueError(f"{place}: {error}") from None
    return rows.tobytes()


def _forget(tree: dict[str, Any], names: Collection[str]) -> None:
    """Remove extensions from the lists `extensionsUsed` and `extensionsRequired`."""
    for key in ("extensionsUsed", "extensionsRequired"):
        if set(names) & set(tree.get(key, [])):
            tree[key] = [name for name in tree[key] if name not in names]
            if not tree[key]:
                del tree[key]


def without_draco(path: Path, tree: dict[str, Any], views: list[bytes]) -> tuple[dict[str, Any], list[bytes]]:
    """Return a file's JSON and the bytes of its buffer views with Draco primitives decompressed.

    Files without any are returned as they are.

    Raises:
        InputError: DracoPy is not installed.
        ValueError: the compressed data do not match the JSON.
    """
    if not any(DRACO in primitive.get("extensions", {}) for primitive in _primitives(tree)):
        return tree, views
    draco = extras.load(f"{path}: reading {DRACO}", "DracoPy", otherwise=UNCOMPRESSED)
    tree, views = deepcopy(tree), list(views)
    decoded = dict[int, Any]()

    def put(accessor: int, values: np.ndarray) -> None:
        """Store the values of an accessor in a new view."""
        declared = tree["accessors"][accessor]
        values = np.ascontiguousarray(values, DTYPES[declared["componentType"]])
        if len(values) != declared["count"]:
            raise ValueError(
                f"accessors/{accessor}: {declared['count']} items, but {len(values)} are compressed"
            )
        tree.setdefault("bufferViews", []).append({"buffer": 0, "byteLength": values.nbytes})
        views.append(values.tobytes())
        declared["bufferView"] = len(views) - 1
        declared.pop("byteOffset", None)
        for name, extreme in (
            ("min", np.min),
            ("max", np.max),
        ):  # the values before compression differ by its rounding
            if name in declared:
                declared[name] = extreme(values, axis=0).tolist()

    for primitive in _primitives(tree):
        compression = primitive.get("extensions", {}).pop(DRACO, None)
        if compression is None:
            continue
        view_index = compression["bufferView"]
        if view_index not in decoded:
            try:
                decoded[view_index] = draco.decode(views[view_index])
            except Exception as error:  # DracoPy's exceptions have no common base class
                raise ValueError(f"bufferViews/{view_index}: {error}") from None
        mesh = decoded[view_index]
        if "indices" not in primitive or not hasattr(mesh, "faces"):
            raise ValueError(f"bufferViews/{view_index}: contains no triangles")
        primitive["mode"] = TRIANGLES_MODE
        put(primitive["indices"], mesh.faces.reshape(-1, 1))
        for name, number in compression["attributes"].items():
            attribute = mesh.get_attribute_by_unique_id(number)
            if attribute is None:
                raise ValueError(f"bufferViews/{view_index}: has no attribute {number} for {name}")
            put(primitive["attributes"][name], attribute["data"])
    _forget(tree, [DRACO])
    return tree, views


def _primitives(tree: dict[str, Any]) -> list[dict[str, Any]]:
    return [primitive for mesh in tree.get("meshes", []) for primitive in mesh["primitives"]]
