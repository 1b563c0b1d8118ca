"""glTF primitives that are compressed by Draco, as plain ones.

Khronos, *KHR_draco_mesh_compression*, 2018: a primitive names a buffer view, and for each
attribute its number in there.
"""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .gltf_schema import DTYPES, TRIANGLES

NAME = "KHR_draco_mesh_compression"
NEEDS = f"is compressed ({NAME}); pip install 'iccm[draco]' reads it, or save it without compression"


def expanded(path: Path, tree: dict[str, Any], views: list[bytes]) -> tuple[dict[str, Any], list[bytes]]:
    """A file's JSON and the bytes of its buffer views, primitives by Draco made plain ones; the same without any.

    Raises:
        InputError: DracoPy is not installed.
        ValueError: what is compressed is not what the file says.
    """
    if not any(NAME in primitive.get("extensions", {}) for primitive in _primitives(tree)):
        return tree, views
    try:
        import DracoPy
    except ImportError:
        raise InputError(f"{path}: {NEEDS}") from None
    tree, views = deepcopy(tree), list(views)
    decoded = dict[int, Any]()

    def put(accessor: int, values: np.ndarray) -> None:
        """What an accessor holds becomes a view of its own."""
        said = tree["accessors"][accessor]
        values = np.ascontiguousarray(values, DTYPES[said["componentType"]])
        if len(values) != said["count"]:
            raise ValueError(f"accessors/{accessor}: {said['count']} items, and {len(values)} are compressed")
        tree.setdefault("bufferViews", []).append({"buffer": 0, "byteLength": values.nbytes})
        views.append(values.tobytes())
        said["bufferView"] = len(views) - 1
        said.pop("byteOffset", None)

    for primitive in _primitives(tree):
        said = primitive.get("extensions", {}).pop(NAME, None)
        if said is None:
            continue
        at = said["bufferView"]
        if at not in decoded:
            try:
                decoded[at] = DracoPy.decode(views[at])
            except Exception as error:  # DracoPy's own, which have no base of their own
                raise ValueError(f"bufferViews/{at}: {error}") from None
        found = decoded[at]
        if "indices" not in primitive or not hasattr(found, "faces"):
            raise ValueError(f"bufferViews/{at}: no triangles are compressed")
        primitive["mode"] = TRIANGLES
        put(primitive["indices"], found.faces.reshape(-1, 1))
        for name, number in said["attributes"].items():
            attribute = found.get_attribute_by_unique_id(number)
            if attribute is None:
                raise ValueError(f"bufferViews/{at}: has no attribute {number} for {name}")
            put(primitive["attributes"][name], attribute["data"])
    for key in ("extensionsUsed", "extensionsRequired"):
        if NAME in tree.get(key, []):
            tree[key] = [name for name in tree[key] if name != NAME]
            if not tree[key]:
                del tree[key]
    return tree, views


def _primitives(tree: dict[str, Any]) -> list[dict[str, Any]]:
    return [primitive for mesh in tree.get("meshes", []) for primitive in mesh["primitives"]]
