"""glTF buffer views that meshopt compressed, as plain ones.

Khronos, *EXT_meshopt_compression*, 2020, and *KHR_meshopt_compression*, 2025: a buffer view names bytes of a buffer,
and how many items of how many bytes they stand for.
"""

from pathlib import Path
from typing import Any

from ...errors import InputError
from .. import limits

NAMES = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def unpacked(path: Path, tree: dict[str, Any], buffers: list[bytes]) -> dict[int, bytes]:
    """The bytes of buffer views that are compressed, by their numbers; their JSON names no compression any more.

    Raises:
        InputError: meshopt is not installed.
        ValueError: what is compressed is not what the file says.
    """
    needed, found = set(NAMES) & set(tree.get("extensionsRequired", [])), dict[int, bytes]()
    for number, view in enumerate(tree.get("bufferViews", [])):
        said = {name: view["extensions"].pop(name) for name in NAMES if name in view.get("extensions", {})}
        for name in needed & said.keys():
            found[number] = _decoded(path, name, f"bufferViews/{number}", said[name], buffers)
            if len(found[number]) != view["byteLength"]:
                raise ValueError(
                    f"bufferViews/{number}: is of {view['byteLength']} bytes, not {len(found[number])}"
                )
    for buffer in tree.get("buffers", []):  # what holds nothing but room for what is decoded
        if set(NAMES) & set(buffer.get("extensions", {})):
            del buffer["extensions"]
    for key in ("extensionsUsed", "extensionsRequired"):
        if left := set(NAMES) & set(tree.get(key, [])):
            tree[key] = [name for name in tree[key] if name not in left]
            if not tree[key]:
                del tree[key]
    return found


def _decoded(path: Path, name: str, place: str, said: dict[str, Any], buffers: list[bytes]) -> bytes:
    try:
        import meshopt
    except ImportError:
        cure = "pip install 'iccm[meshopt]' reads it, or save it without compression"
        raise InputError(f"{path}: is compressed ({name}); {cure}") from None
    start, count, stride = said.get("byteOffset", 0), said["count"], said["byteStride"]
    data = buffers[said["buffer"]][start : start + said["byteLength"]]
    if not 0 <= count * stride <= limits.MESH_BYTES:
        raise ValueError(f"{place}: {count} items of {stride} bytes")
    try:
        rows = meshopt.decode_gltf_buffer(data, count, stride, said["mode"], said.get("filter"))
    except Exception as error:  # meshopt's own, which have no base of their own
        raise ValueError(f"{place}: {error}") from None
    return rows.tobytes()
