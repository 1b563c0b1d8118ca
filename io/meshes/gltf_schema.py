"""Validate the parts of glTF files on which readers rely: types, lengths of lists, and indices.

Khronos, *glTF 2.0 Specification*, 2021, §5. Other content is not checked.
"""

import math
from typing import Any

from .. import limits

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
TRIANGLES_MODE = 4
TRANSFORM = {"offset": (float, 2), "scale": (float, 2), "rotation": float, "texCoord": int}
INFO = {
    "index": "textures",
    "texCoord": int,
    "scale": float,
    "strength": float,
    "extensions": {"KHR_texture_transform": TRANSFORM},
}
TEXTURES = {"*Texture": INFO}
MATERIAL = TEXTURES | {
    "name": str,
    "pbrMetallicRoughness": TEXTURES
    | {"baseColorFactor": (float, 4), "roughnessFactor": float, "metallicFactor": float},
    "emissiveFactor": (float, 3),
    "extensions": {"*": TEXTURES},
}
TREE = {
    "materials": [MATERIAL],
    "textures": [{"source": "images", "sampler": "samplers", "extensions": {"*": {"source": "images"}}}],
    "images": [{"uri": str, "bufferView": "bufferViews", "mimeType": str, "name": str}],
    "samplers": [{"wrapS": int, "wrapT": int, "magFilter": int, "minFilter": int}],
    "scene": "scenes",
    "scenes": [{"nodes": ["nodes"]}],
    "skins": [{"joints": ["nodes"], "inverseBindMatrices": "accessors"}],
    "nodes": [
        {
            "mesh": "meshes",
            "skin": "skins",
            "children": ["nodes"],
            "matrix": (float, 16),
            "translation": (float, 3),
            "rotation": (float, 4),
            "scale": (float, 3),
        }
    ],
    "meshes": [
        {
            "primitives": [
                {
                    "attributes": {"*": "accessors"},
                    "indices": "accessors",
                    "material": "materials",
                    "mode": int,
                    "extensions": {
                        "KHR_draco_mesh_compression": {"bufferView": "bufferViews", "attributes": {"*": int}}
                    },
                }
            ]
        }
    ],
    "accessors": [
        {
            "count": int,
            "bufferView": "bufferViews",
            "byteOffset": int,
            "componentType": int,
            "type": str,
            "sparse": {
                "count": int,
                "indices": {"bufferView": "bufferViews", "byteOffset": int, "componentType": int},
                "values": {"bufferView": "bufferViews", "byteOffset": int},
            },
        }
    ],
    "bufferViews": [{"buffer": "buffers", "byteLength": int, "byteOffset": int, "byteStride": int}],
    "buffers": [{"byteLength": int, "uri": str}],
}
ITEMS = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4", "TEXCOORD": "VEC2"}
"""Element types of a primitive's attributes."""
WORDS = {int: "a whole number", float: "a number", str: "text", dict: "an object", list: "a list"}


def check(tree: dict[str, Any]) -> None:
    """Refuse a file whose structure readers cannot handle.

    Raises:
        ValueError: naming the first invalid place.
    """
    _check(tree, tree, TREE, "")
    for k, mesh in enumerate(tree.get("meshes", [])):
        for number, primitive in enumerate(mesh["primitives"]):
            accessors = {name: tree["accessors"][index] for name, index in primitive["attributes"].items()}
            points = accessors["POSITION"]["count"]
            for name, accessor in accessors.items():
                place = f"meshes/{k}/primitives/{number}"
                items = ITEMS.get(name.partition("_")[0], accessor["type"])
                if accessor["type"] != items:
                    raise ValueError(f"{place}: {name} has type {accessor['type']!r} instead of {items}")
                if accessor["count"] < points:
                    raise ValueError(
                        f"{place}: has {accessor['count']} values of {name}, but {points} positions"
                    )


def _check(value: Any, tree: dict[str, Any], shape: Any, place: str) -> None:
    if isinstance(shape, str):
        count = len(tree.get(shape, []))
        if not _is(value, int) or not 0 <= value < count:
            raise ValueError(f"{place} is {value!r}, but there are {count} {shape}")
    elif isinstance(shape, dict):
        _demand(_is(value, dict), place, WORDS[dict])
        for key, item in value.items():
            like = "*Texture" if key.endswith("Texture") else "*"
            if item_shape := shape.get(key, shape.get(like)):
                _check(item, tree, item_shape, f"{place}/{key}".lstrip("/"))
    elif isinstance(shape, list | tuple):
        right = _is(value, list) and (isinstance(shape, list) or len(value) == shape[1])
        _demand(right, place, WORDS[list] if isinstance(shape, list) else f"{shape[1]} numbers")
        for k, item in enumerate(value):
            _check(item, tree, shape[0], f"{place}/{k}")
    else:
        _demand(_is(value, shape), place, WORDS[shape])
        if shape is not str and not (math.isfinite(value) and abs(value) <= limits.COORDINATE):
            raise ValueError(f"{place} is not finite, or larger than {limits.COORDINATE:g}")


def _is(value: Any, kind: type) -> bool:
    return isinstance(value, int | float if kind is float else kind) and not isinstance(value, bool)


def _demand(right: bool, place: str, what: str) -> None:
    if not right:
        raise ValueError(f"{place or 'the file'} is not {what}")
