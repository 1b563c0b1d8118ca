"""Convert pictures of materials between glTF's slots and MTL's statements."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..meshes import gltf_materials, material_library
from ..pictures.image import Image
from . import of_mtl
from .carried import Pictures
from .material_set import Material
from .of_gltf import EMISSIVE, ROUGH

TO_MTL = {
    gltf_materials.BASE: "map_kd",
    gltf_materials.DIFFUSE: "map_kd",
    gltf_materials.NORMALS: "norm",
    EMISSIVE: "map_ke",
}
TO_GLTF = {"map_kd": gltf_materials.BASE, "map_ke": EMISSIVE}
GREYS = ("map_pr", "map_pm")  # roughness and metal: green and blue channel of glTF's combined picture
COVER = "map_d"  # opacity
PLAIN = ["Ka 1 1 1", "Kd 1 1 1", "Ks 0 0 0", "illum 2"]


def to_gltf(
    images: Pictures, kinds: dict[str, str], source_material: Material
) -> tuple[Pictures, dict[str, Any], list[str]]:
    """Convert pictures of MTL statements, all of one size; return glTF slots, the material, and what was dropped."""
    converted = {TO_GLTF[word]: image for word, image in images.items() if word in TO_GLTF}
    for word, image in images.items():
        if kinds[word] == "normal":
            converted[gltf_materials.NORMALS] = image
    numbers = material_library.numbers(source_material.source or [])
    rough: dict[str, Any] = {"metallicFactor": 1.0 if "map_pm" in images else numbers.get("pm", [0.0])[0]}
    if "map_pr" not in images:
        rough["roughnessFactor"] = numbers.get("pr", [1.0])[0]
    if any(word in images for word in GREYS):
        converted[ROUGH] = _rough(*(images.get(word) for word in GREYS))
    if "map_kd" not in images and len(colour := numbers.get("kd", [])[:3]) == 3:
        rough["baseColorFactor"] = [*colour, 1.0]
    material: dict[str, Any] = {"name": source_material.name or "iccm", "pbrMetallicRoughness": rough}
    if EMISSIVE in converted:
        material["emissiveFactor"] = [1.0, 1.0, 1.0]
    if COVER in images and gltf_materials.BASE in converted:
        converted[gltf_materials.BASE] = _clear(converted[gltf_materials.BASE], images[COVER])
        material["alphaMode"] = "BLEND"
    if (alpha := of_mtl.cover(source_material.source or [])) < 1:
        rough["baseColorFactor"] = [*rough.get("baseColorFactor", (1.0, 1.0, 1.0))[:3], alpha]
        material["alphaMode"] = "BLEND"
    supported = {*TO_GLTF, *GREYS, COVER}
    unsupported = [word for word in images if word not in supported and kinds[word] != "normal"]
    return converted, material, _left_out(unsupported)


def to_mtl(images: Pictures, source_material: Material) -> tuple[Pictures, list[str], list[str]]:
    """Convert pictures of glTF slots; return MTL statements, the material's lines, and what was dropped."""
    converted = {TO_MTL[slot]: image for slot, image in images.items() if slot in TO_MTL}
    if "map_kd" in converted and converted["map_kd"].alpha >= 0:
        converted |= _covered(converted["map_kd"])
    if ROUGH in images:
        for k, word in enumerate(GREYS, 1):
            converted[word] = Image(np.ascontiguousarray(images[ROUGH].pixels[..., k : k + 1]))
    base = (source_material.source or {}).get("pbrMetallicRoughness", {})
    lines = list(PLAIN)
    if "map_kd" not in converted:
        lines[1] = "Kd {:g} {:g} {:g}".format(*base.get("baseColorFactor", (1, 1, 1))[:3])
    if ROUGH not in images and base:
        lines += [f"Pr {base.get('roughnessFactor', 1):g}", f"Pm {base.get('metallicFactor', 1):g}"]
    source = source_material.source or {}
    if source.get("alphaMode") == "BLEND" and (alpha := base.get("baseColorFactor", (1, 1, 1, 1))[3]) < 1:
        lines.append(f"d {alpha:g}")
    unsupported = [slot for slot in images if slot not in TO_MTL and slot != ROUGH]
    return converted, lines, _left_out([gltf_materials.name_slots([slot]) for slot in unsupported])


def _left_out(names: Iterable[str]) -> list[str]:
    listed = ", ".join(names)
    return [f"{listed}: dropped, because the other format does not support it"] if listed else []


def _rough(rough: Image | None, metal: Image | None) -> Image:
    """Combine roughness in green and metal in blue; a missing one is white."""
    present = [image for image in (rough, metal) if image is not None]
    dtype = max((image.pixels.dtype for image in present), key=lambda d: d.itemsize)
    out = np.full((*present[0].pixels.shape[:2], 3), np.iinfo(dtype).max, dtype)
    for k, image in enumerate((rough, metal), 1):
        if image is not None:
            out[..., k] = _as(image.pixels[..., 0], dtype)
    return Image(out)


def _clear(base: Image, cover: Image) -> Image:
    """Return a colour picture with the grey values of another one as its alpha."""
    colours = base.pixels[..., :3]
    alpha = _as(cover.pixels[..., 0], colours.dtype)
    return Image(np.dstack([colours if colours.shape[2] == 3 else colours[..., [0, 0, 0]], alpha]), alpha=3)


def _covered(base: Image) -> Pictures:
    """Split a picture into colours and, if it is not opaque, its alpha as a separate picture."""
    pixels, alpha = base.pixels, base.pixels[..., base.alpha, None]
    colours = Image(np.ascontiguousarray(pixels[..., : base.alpha]))
    is_transparent = (alpha < np.iinfo(alpha.dtype).max).any()
    return {"map_kd": colours} | ({COVER: Image(np.ascontiguousarray(alpha))} if is_transparent else {})


def _as(pixels: NDArray, dtype: np.dtype) -> NDArray:
    if pixels.dtype == dtype:
        return pixels
    return pixels.astype(dtype) * 257 if dtype == np.uint16 else (pixels // 257).astype(dtype)
