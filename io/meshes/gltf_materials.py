"""The textures of a glTF material: their slots in the JSON, their coordinates and their pictures."""

from collections.abc import Iterator
from typing import Any

BASE = "pbrMetallicRoughness/baseColorTexture"
NORMALS = "normalTexture"
VERTEX_COLOURS = "COLOR_0"  # the attribute that multiplies the base colour of a material
DIFFUSE = "extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture"  # shown by programs that support it
DEFAULT_ALPHA_CUTOFF = 0.5  # default of a mask (Khronos, *glTF 2.0*, §3.9.4)
NEW = {"name": "iccm", "pbrMetallicRoughness": {"metallicFactor": 0.0}}
REPEATING = {"wrapS": 10497, "wrapT": 10497}  # a sampler that shows the texture again beyond its edges
COLOURS = ("basecolor", "diffuse", "emissive", "sheencolor", "specularcolor")


def slots(tree: dict[str, Any], above: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the path and the `textureInfo` of each texture.

    Paths look like `normalTexture` or `pbrMetallicRoughness/baseColorTexture`.
    """
    for key, value in tree.items():
        # glTF has no names with a slash, which separates paths
        if not isinstance(value, dict) or key == "extras" or "/" in key:
            continue
        if key.endswith("Texture") and "index" in value:
            yield above + key, value
        else:
            yield from slots(value, f"{above}{key}/")


def base(material: dict[str, Any]) -> dict[str, Any]:
    """Return the `textureInfo` of a material's base colour; empty without one."""
    textures = dict(slots(material))
    return textures.get(BASE, textures.get(DIFFUSE, {}))


def remove_tint(material: dict[str, Any]) -> bool:
    """Make the factors white that multiply a material's base colour textures; return whether one was not.

    Opacity is kept.
    """
    was_tinted = False
    for holder, key in (
        (material.get("pbrMetallicRoughness", {}), "baseColorFactor"),
        (material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {}), "diffuseFactor"),
    ):
        if key in holder:
            *colour, opacity = holder[key]
            was_tinted |= any(value != 1 for value in colour)
            holder[key] = [1, 1, 1, opacity]
    return was_tinted


def variants(primitive: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the alternative materials of a primitive (KHR_materials_variants)."""
    return primitive.get("extensions", {}).get("KHR_materials_variants", {}).get("mappings", [])


def kind_of(slot: str) -> str:
    """Return the kind of data in a slot's picture (see `pixels.sampler.KINDS`)."""
    name = slot.rpartition("/")[2].removesuffix("Texture").lower()
    if name.endswith("normal"):
        return "normal"
    return "colour" if name in COLOURS else "data"


def name_slots(slots: list[str]) -> str:
    """Return the names of slots for messages."""
    return ", ".join(dict.fromkeys(slot.rpartition("/")[2] for slot in slots))


def set_of(info: dict[str, Any]) -> int:
    """Return which set of texture coordinates a `textureInfo` uses."""
    transform = info.get("extensions", {}).get("KHR_texture_transform", {})
    return transform.get("texCoord", info.get("texCoord", 0))


def use_first_set(info: dict[str, Any]) -> None:
    """Make a texture use the first set of coordinates."""
    info.pop("texCoord", None)
    info.get("extensions", {}).get("KHR_texture_transform", {}).pop("texCoord", None)


def move_maps(material: dict[str, Any], to: int, but: set[str]) -> None:
    """Make all slots that use the first set of coordinates use another one, except the slots in `but`."""
    for slot, info in slots(material):
        if slot not in but and set_of(info) == 0:
            info["texCoord"] = to
            transform = info.get("extensions", {}).get("KHR_texture_transform", {})
            if "texCoord" in transform:
                transform["texCoord"] = to


def bare(material: dict[str, Any], but: set[str]) -> None:
    """Remove the textures from all slots except those in `but`, whose texture indices will be replaced."""
    for slot, _ in list(slots(material)):
        *above, key = slot.split("/")
        holder = material
        for word in above:
            holder = holder[word]
        if slot in but:
            holder[key]["index"] = -1
        else:
            del holder[key]


def set_texture(
    material: dict[str, Any], slot: str, texture: int, place: dict[str, Any] | None = None
) -> None:
    """Make a slot show a texture by the first coordinates, or by those of another `textureInfo`.

    Scale and strength are kept.
    """
    *above, key = slot.split("/")
    for word in above:
        material = material.setdefault(word, {})
    info = material.setdefault(key, {})
    info["index"] = texture
    transform, extensions = "KHR_texture_transform", info.pop("extensions", {})
    extensions.pop(transform, None)
    info.pop("texCoord", None)
    if place and place.get("texCoord"):
        info["texCoord"] = place["texCoord"]
    if place and transform in place.get("extensions", {}):
        extensions[transform] = place["extensions"][transform]
    if extensions:
        info["extensions"] = extensions
