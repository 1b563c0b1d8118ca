"""The textures of a glTF material: where they stand in its tree, and which coordinates and pictures they take."""

from collections.abc import Iterator
from typing import Any

BASE = "pbrMetallicRoughness/baseColorTexture"
NORMALS = "normalTexture"
DIFFUSE = "extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture"  # what programs show that know it
CUTOFF = 0.5  # of a mask that names none (Khronos, *glTF 2.0*, §3.9.4)
NEW = {"name": "iccm", "pbrMetallicRoughness": {"metallicFactor": 0.0}}
REPEATING = {"wrapS": 10497, "wrapT": 10497}  # a sampler that shows the texture again beyond its edges
COLOURS = ("basecolor", "diffuse", "emissive", "sheencolor", "specularcolor")


def slots(tree: dict[str, Any], above: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the path, `normalTexture` or `pbrMetallicRoughness/baseColorTexture`, and the `textureInfo` of each
    texture.
    """
    for key, value in tree.items():
        # glTF has no such name, and paths are cut there
        if not isinstance(value, dict) or key == "extras" or "/" in key:
            continue
        if key.endswith("Texture") and "index" in value:
            yield above + key, value
        else:
            yield from slots(value, f"{above}{key}/")


def base(material: dict[str, Any]) -> dict[str, Any]:
    """Return the `textureInfo` of a material's colours; empty without one."""
    found = dict(slots(material))
    return found.get(BASE, found.get(DIFFUSE, {}))


def variants(primitive: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the materials that a primitive may have instead (KHR_materials_variants)."""
    return primitive.get("extensions", {}).get("KHR_materials_variants", {}).get("mappings", [])


def kind_of(slot: str) -> str:
    """Return what the channels of a slot's picture are (see `pixels.sampler.KINDS`)."""
    name = slot.rpartition("/")[2].removesuffix("Texture").lower()
    if name.endswith("normal"):
        return "normal"
    return "colour" if name in COLOURS else "data"


def name_slots(slots: list[str]) -> str:
    """Slots for messages."""
    return ", ".join(dict.fromkeys(slot.rpartition("/")[2] for slot in slots))


def set_of(info: dict[str, Any]) -> int:
    """Return which set of texture coordinates a `textureInfo` reads."""
    transform = info.get("extensions", {}).get("KHR_texture_transform", {})
    return transform.get("texCoord", info.get("texCoord", 0))


def move_maps(material: dict[str, Any], to: int, but: set[str]) -> None:
    """Have all that reads the first set of coordinates read another one, but for some slots."""
    for slot, info in slots(material):
        if slot not in but and set_of(info) == 0:
            info["texCoord"] = to
            transform = info.get("extensions", {}).get("KHR_texture_transform", {})
            if "texCoord" in transform:
                transform["texCoord"] = to


def bare(material: dict[str, Any], but: set[str]) -> None:
    """Take the textures out of all slots but some, whose old numbers are to be replaced."""
    for slot, _ in list(slots(material)):
        *above, key = slot.split("/")
        holder = material
        for word in above:
            holder = holder[word]
        if slot in but:
            holder[key]["index"] = -1
        else:
            del holder[key]


def shown_picture(material: dict[str, Any], slot: str, texture: int, coordinates: int = 0) -> None:
    """Have a slot show a texture by a set of coordinates; scale and strength stay."""
    *above, key = slot.split("/")
    for word in above:
        material = material.setdefault(word, {})
    info = material.setdefault(key, {})
    info["index"] = texture
    info.pop("texCoord", None)
    if coordinates:
        info["texCoord"] = coordinates
    extensions = info.get("extensions", {})
    extensions.pop("KHR_texture_transform", None)
    if not extensions:
        info.pop("extensions", None)
