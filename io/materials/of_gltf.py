"""Material sets of glTF files, and edits of their materials."""

import json
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...meshes.charted import Charted
from ..meshes import gltf_materials
from ..meshes.gltf import Primitive
from ..meshes.gltf_materials import VERTEX_COLOURS
from .material_set import Material, MaterialMap, MaterialSet

EMISSIVE, ROUGH = "emissiveTexture", "pbrMetallicRoughness/metallicRoughnessTexture"
PICTURED = (
    "name",
    "extras",
    "pbrMetallicRoughness",
    "emissiveFactor",
)  # represented in pictures, or without effect


def material_set(
    name: str, parts: Sequence[Primitive], *, bare: bool = False, plain: bool = False
) -> MaterialSet:
    """Return the material set of primitives of one file.

    Args:
        name: of the file, for messages.
        parts: the primitives.
        bare: whether the sheet has the coordinates as stored, without the transform of colour textures.
        plain: whether to include primitives without coordinates, in the colours of their materials; otherwise they are
            ignored.

    Raises:
        InputError: none of them has coordinates.
    """
    coloured = plain and any(VERTEX_COLOURS in part.attributes for part in parts)
    laid_out, every = list(parts) if coloured else with_layout(name, parts), len(parts)
    parts = parts if plain else laid_out
    ignored = every - len(parts)
    notes = (
        f"{name}: {ignored} of its {every} geometries are ignored, because they have no texture coordinates",
    )
    alike: dict[tuple[str, bool], list[Primitive]] = {}
    for part in parts:
        alike.setdefault((part.key, has_layout(part)), []).append(part)
    keys, counts = list(alike), [len(part.faces) for part in parts]
    owner = np.repeat([keys.index((part.key, has_layout(part))) for part in parts], counts)
    materials = [_material(name, parts, group) for group in alike.values()]
    whole, colours = sheet(name, parts, bare), _vertex_colours(parts)
    corners = None if colours is None else colours[whole.faces]
    return MaterialSet(whole, tuple(materials), owner, "gltf", notes if ignored else (), corners)


def with_layout(name: str, parts: Sequence[Primitive]) -> list[Primitive]:
    """Return the primitives that have texture coordinates.

    Raises:
        InputError: none has any.
    """
    laid_out = [part for part in parts if has_layout(part)]
    if not laid_out:
        raise InputError(f"{name}: has no texture coordinates; create them with iccm flatten --uv")
    return laid_out


def sheet(name: str, parts: Sequence[Primitive], bare: bool) -> Charted:
    """Return the triangles of primitives with the coordinates of their colour textures; see `material_set`."""
    points = [part.points for part in parts]
    first = np.cumsum([0, *map(len, points)])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, first)])
    normals = [part.normals for part in parts]
    present = [values for values in normals if values is not None]
    stated = len(present) == len(parts)
    normal: Real | None = np.concatenate(present) if stated else None
    tangents = _join([part.tangents for part in parts], points, 4)
    uv = _join([_layout(part, bare) for part in parts], points, 2)
    if uv is None:  # there are only vertex colors
        uv = np.zeros((first[-1], 2))
    corners = None if tangents is None else tangents[faces]
    return Charted(name, np.concatenate(points), faces, uv, faces, normal, faces if stated else None, corners)


def _join(values: Sequence[Real | None], points: Sequence[Real], width: int) -> Real | None:
    """Concatenate vertex values of all parts, with zeros for parts without any; None if no part has any."""
    if all(part_values is None for part_values in values):
        return None
    zeros = (np.zeros((len(positions), width)) for positions in points)
    return np.concatenate(
        [zero if part_values is None else part_values for part_values, zero in zip(values, zeros)]
    )


def _vertex_colours(parts: Sequence[Primitive]) -> Real | None:
    """Return (n, 4) linear vertex colors of all parts, white for parts without any; None if no part has any."""
    if not any(VERTEX_COLOURS in part.attributes for part in parts):
        return None
    blocks = []
    for part in parts:
        colours = np.ones((len(part.points), 4))
        if VERTEX_COLOURS in part.attributes:
            stated = part.document.floats(part.attributes[VERTEX_COLOURS])
            colours[:, : stated.shape[1]] = stated
        blocks.append(colours)
    return np.concatenate(blocks)


def layout_of(part: Primitive) -> int:
    """Return the index of the texture coordinates of a primitive's colour texture, or 0."""
    index = gltf_materials.set_of(gltf_materials.base(part.material))
    return index if f"TEXCOORD_{index}" in part.attributes else 0


def has_layout(part: Primitive) -> bool:
    """Return whether a primitive has the coordinates that its colour texture uses."""
    return part.uv(gltf_materials.base(part.material)) is not None


def _layout(part: Primitive, bare: bool) -> Real | None:
    return part.uv({"texCoord": layout_of(part)} if bare else gltf_materials.base(part.material))


def _material(name: str, parts: Sequence[Primitive], group: Sequence[Primitive]) -> Material:
    """Return the material that the primitives `group` have in common."""
    material, document = group[0].material, group[0].document
    maps, layouts = dict[str, MaterialMap](), dict[str, Real | None]()
    for slot, info in gltf_materials.slots(material):
        source = document.source_of(info["index"])
        content = None if source is None else document.image(source)
        if content is None or any(part.uv(info) is None for part in group):
            continue
        key = repr((gltf_materials.set_of(info), info.get("extensions", {}).get("KHR_texture_transform")))
        if key not in layouts:
            values = [part.uv(info) if part in group else None for part in parts]
            layouts[key] = _join(values, [part.points for part in parts], 2)
        where = f"{name}: {gltf_materials.name_slots([slot])}"
        sampler = document.tree["textures"][info["index"]].get("sampler")
        options = None if sampler is None else document.tree["samplers"][sampler]
        wrap = document.wrap_of(info["index"])
        opaque = _is_opaque(material) and slot in (gltf_materials.BASE, gltf_materials.DIFFUSE)
        maps[slot] = MaterialMap(
            content, gltf_materials.kind_of(slot), where, layouts[key], wrap, options, opaque
        )
    kind = json.dumps(unpictured(material), sort_keys=True)
    return Material(material.get("name", ""), group[0].key, maps, material, factors(material), kind)


def factors(material: dict[str, Any]) -> dict[str, tuple[float, ...]]:
    """Return the factors of a material's pictures of base colour, emission, and roughness and metal."""
    rough = material.get("pbrMetallicRoughness", {})
    colour = rough.get("baseColorFactor", (1, 1, 1, 1))
    return {
        gltf_materials.BASE: (*colour[:3], 1) if _is_opaque(material) else tuple(colour),
        ROUGH: (1.0, rough.get("roughnessFactor", 1), rough.get("metallicFactor", 1)),
        EMISSIVE: tuple(material.get("emissiveFactor", (0, 0, 0))),
    }


def _is_opaque(material: dict[str, Any]) -> bool:
    return material.get("alphaMode", "OPAQUE") == "OPAQUE"


def unpictured(material: dict[str, Any]) -> dict[str, Any]:
    """Return the properties of a material that no picture represents.

    These are transparency, sides, extensions and scales of normals. A baked material has a single value of each.
    """
    remaining = deepcopy(material)
    scales = {
        f"{slot} {key}": info[key]
        for slot, info in gltf_materials.slots(material)
        for key in ("scale", "strength")
        if info.get(key, 1) != 1
    }
    gltf_materials.bare(remaining, set())
    remaining = {
        key: value for key, value in remaining.items() if key not in PICTURED and value not in ({}, False)
    }
    mode, cutoff = (
        remaining.pop("alphaMode", "OPAQUE"),
        remaining.pop("alphaCutoff", gltf_materials.DEFAULT_ALPHA_CUTOFF),
    )
    return remaining | scales | {"alphaMode": mode} | ({"alphaCutoff": cutoff} if mode == "MASK" else {})


def multiplied_slots(material: dict[str, Any], slots: set[str]) -> None:
    """Set a material's factors for these slots to 1, since they are already in the pictures."""
    rough = material.setdefault("pbrMetallicRoughness", {})
    if gltf_materials.BASE in slots:
        rough["baseColorFactor"] = [1, 1, 1, 1]
    if ROUGH in slots:
        rough |= {"roughnessFactor": 1, "metallicFactor": 1}
    if EMISSIVE in slots:
        material["emissiveFactor"] = [1, 1, 1]
