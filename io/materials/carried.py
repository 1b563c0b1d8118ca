"""Bake the pictures of a material set for new texture coordinates: for each new material, one picture per slot."""

from collections.abc import Callable, Container, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real
from ...meshes.charted import Charted
from ...meshes.relayout import (
    COLOUR_TEXELS_ACROSS,
    PROBED_TEXELS_ACROSS,
    Origin,
    carry,
    paint,
    picture_side,
)
from ...pixels import colour
from ...pixels.padding import FLAT_NORMAL, pad_charts
from ...pixels.sampler import Sampler
from ...pixels.texture import check_kind
from .. import formats, limits
from ..meshes.gltf_materials import BASE, DEFAULT_ALPHA_CUTOFF, DIFFUSE, kind_of
from ..pictures.image import Image, prepare
from .material_set import Material, MaterialMap, MaterialSet

Pictures = dict[str, Image]  # by slot
T = TypeVar("T")


@dataclass(frozen=True)
class BakeSettings:
    """Settings for baking pictures.

    Attributes:
        size: width and height of the new pictures; None for squares with about the resolution of the old ones
            (`meshes.relayout.texels_across`).
        filter: see `Sampler`.
        limit: the largest distance from the old surface, in the mesh's unit.
        match: how the meshes are registered; see `surfaces.matching`.
        padding: texels by which to extend colours beyond charts; see `pixels.padding.pad_charts`.
        max_pixels: limit on pictures that are read.
        threads: number of threads; it does not affect the result.
        settled: whether to replace the alpha of masks by their visible effect, 0 or 1.
        vertex_colours: whether to multiply colour pictures by vertex colors.
    """

    size: tuple[int, int] | None = None
    filter: str = "auto"
    limit: float = np.inf
    padding: int | None = None
    max_pixels: int = limits.READ_PIXELS
    match: str = "auto"
    threads: int | None = None
    settled: bool = False
    vertex_colours: bool = False


@dataclass(eq=False)
class MaterialBaker:
    """Bakes the pictures of one material of a new layout.

    Attributes:
        material_set: the old materials.
        sheet: the triangles of the new layout with the material.
        pairs: `meshes.relayout.partners` of the old triangles and these.
        settings: for baking.
    """

    material_set: MaterialSet
    sheet: Charted
    pairs: tuple[Index, Index]
    settings: BakeSettings = field(default_factory=BakeSettings)

    def __post_init__(self) -> None:
        self.origins: dict[tuple[int, int], Origin] = {}
        self._sides: dict[int, int] = {}
        self._images: dict[tuple[Path | bytes, bool], Image] = {}
        self._pictures: dict[Hashable, Image] = {}
        self.notes: list[str] = []

    @cached_property
    def materials(self) -> list[int]:
        """The old materials that are visible in the new layout, the one with most texels first."""
        origin = self.origin(self.size)
        owner = self.material_set.owner[origin.triangles[origin.reached(self.settings.limit)]]
        counts = np.bincount(owner, minlength=len(self.material_set.materials))
        return [int(k) for k in np.argsort(-counts, kind="stable") if counts[k]]

    @property
    def material(self) -> Material | None:
        """The old material with most texels."""
        return self.material_set.materials[self.materials[0]] if self.materials else None

    @cached_property
    def multiplied(self) -> set[str]:
        """The slots whose pictures include the factors of materials, since several materials are merged into one."""
        return set() if len(self.materials) < 2 else {slot for slot in self.slots if slot in self._differing}

    @property
    def _differing(self) -> set[str]:
        materials = [self.material_set.materials[k] for k in self.materials]
        slots = {slot for material in materials for slot in material.factors}
        return {slot for slot in slots if len({material.factors.get(slot) for material in materials}) > 1}

    @cached_property
    def slots(self) -> list[str]:
        """The slots that will have a picture."""
        mapped = (slot for k in self.materials for slot in self.material_set.materials[k].maps)
        coloured = [slot for slot in (self._coloured_slot,) if slot is not None and self.materials]
        return list(dict.fromkeys([*mapped, *sorted(self._differing), *coloured]))

    @property
    def _coloured_slot(self) -> str | None:
        """The slot whose picture is multiplied by vertex colors."""
        if not self.settings.vertex_colours or self.material_set.colours is None:
            return None
        if self.material_set.dialect == "mtl":
            return "map_kd"
        material_maps = (self.material_set.materials[k].maps for k in self.materials)
        return DIFFUSE if any(DIFFUSE in maps for maps in material_maps) else BASE

    @property
    def kinds(self) -> dict[str, str]:
        """The kind of data of each slot's picture, from the first material that has one."""
        materials = [self.material_set.materials[k] for k in reversed(self.materials)]
        kinds = {slot: map.kind for material in materials for slot, map in material.maps.items()}
        return kinds if self._coloured_slot is None else {self._coloured_slot: "colour"} | kinds

    def image(self, slot: str) -> Image:
        """Return the picture for a slot; slots with equal content share one, such as occlusion and roughness."""
        key = self._content_of(slot)
        if key not in self._pictures:
            self._pictures[key] = self._bake(slot)
        return self._pictures[key]

    def _content_of(self, slot: str) -> Hashable:
        """Return a key that determines the content of a slot's picture."""
        materials = [self.material_set.materials[k] for k in self.materials]
        maps = [material.maps.get(slot) for material in materials]
        contents = [map and (map.picture, map.kind, map.wrap, map.opaque, id(map.uv)) for map in maps]
        factors = [material.factors.get(slot) for material in materials] if slot in self.multiplied else []
        # The alpha of masks is changed only in colour slots.
        colour_slot = slot if slot in (BASE, DIFFUSE, self._coloured_slot) else None
        return kind_of(slot), tuple(contents), tuple(factors), colour_slot

    def _bake(self, slot: str) -> Image:
        maps = [self.material_set.materials[k].maps.get(slot) for k in self.materials]
        origin = self.origin(self._size(*self.materials, slots=[slot]))
        if len(maps) > 1 or slot == self._coloured_slot:
            return self._together(slot, maps, origin)
        assert maps[0] is not None
        image, sampler = self._ready(maps[0])
        origin, settings = self._shown(origin, maps[0]), self.settings
        pixels = carry(
            origin,
            sampler,
            settings.limit,
            wrap=maps[0].wrap,
            padding=settings.padding,
            threads=settings.threads,
        )
        image = image.with_pixels(pixels, image.alpha)
        if self.settings.settled:
            self._settle(slot, image, np.ones(pixels.shape[:2], bool), self.materials[0])
        return image

    def origin(self, size: tuple[int, int]) -> Origin:
        """Return the origins of the texels of a picture of this width and height."""
        if size not in self.origins:
            self.origins[size] = Origin.of(self.material_set.sheet, self.sheet, *size, pairs=self.pairs)
        return self.origins[size]

    def _shown(self, origin: Origin, map: MaterialMap) -> Origin:
        return origin.over(self.material_set.shown_by(map))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the largest picture."""
        return self._size(*range(len(self.material_set.materials)))

    def _size(self, *materials: int, slots: Container[str] | None = None) -> tuple[int, int]:
        """Return width and height of a picture for the given old materials, in some slots or in all of them."""
        if self.settings.size:
            return self.settings.size
        sides = [
            self._across(k, map)
            for k in materials
            for slot, map in self.material_set.materials[k].maps.items()
            if slots is None or slot in slots
        ]
        return (max(sides, default=0) or COLOUR_TEXELS_ACROSS,) * 2

    def _across(self, material: int, map: MaterialMap) -> int:
        """Return the width in texels of a picture that preserves the resolution of an old material's picture."""
        if id(map) not in self._sides:
            probe = self.origin((PROBED_TEXELS_ACROSS, PROBED_TEXELS_ACROSS))
            used = probe.reached(self.settings.limit) & (self.material_set.owner[probe.triangles] == material)
            size = self._read(map).pixels.shape[1::-1] if used.any() else (1, 1)
            self._sides[id(map)], note = picture_side(self._shown(probe, map), used, size, wrap=map.wrap)
            self.notes += [note] if note else []
        return self._sides[id(map)]

    def _read(self, map: MaterialMap) -> Image:
        key = (map.picture, map.opaque)
        if key not in self._images:
            self._images[key] = map.image(self.settings.max_pixels)
        return self._images[key]

    def _ready(self, map: MaterialMap, like: Image | None = None) -> tuple[Image, Sampler]:
        image = like or self._read(map)
        check_kind(map.kind, image.pixels.shape[2], map.where)
        texture = image.texture((0j, 1 + 1j), map.kind)
        return image, Sampler(texture, self.settings.filter, map.kind, threads=self.settings.threads)

    def _together(self, slot: str, maps: list[MaterialMap | None], origin: Origin) -> Image:
        """Return one picture of several materials, with or without pictures; differing factors are multiplied in."""
        read = [None if map is None else without_profile(self._read(map)) for map in maps]
        materials = [self.material_set.materials[k] for k in self.materials]
        coloured = slot == self._coloured_slot
        kind = "colour" if coloured else kind_of(slot)
        kind = next((map.kind for map in maps if map is not None), kind)
        factors = [
            material.factors.get(slot, ()) if slot in self.multiplied else () for material in materials
        ]
        deep = any(image is not None and image.pixels.dtype == np.uint16 for image in read)
        clear = any(image is not None and image.alpha >= 0 for image in read) or any(
            factor[3] < 1 for factor in factors if len(factor) > 3
        )
        clear = clear or (coloured and self._shows_clear_vertices(materials))
        dtype, top, channels = (np.uint16, 65535, 4) if deep else (np.uint8, 255, 4)
        channels -= int(not clear)
        reached = origin.reached(self.settings.limit)
        owner = np.where(reached, self.material_set.owner[origin.triangles], -1)
        out = np.zeros((*reached.shape, channels), dtype)
        for k, map, image, factor in zip(self.materials, maps, read, factors):
            mask = owner == k
            if map is None or image is None:
                level = FLAT_NORMAL if kind == "normal" else (1.0, 1.0, 1.0)
                out[mask] = np.rint(np.array((*level, 1.0)[:channels]) * top)
            else:
                _, sampler = self._ready(map, _widen(image, np.dtype(dtype), clear))
                paint(
                    out,
                    self._shown(origin, map),
                    sampler,
                    mask,
                    wrap=map.wrap,
                    threads=self.settings.threads,
                )
            if factor:
                _multiply(out, mask, np.array(factor), srgb=kind == "colour")
            if coloured and self.material_set.colours is not None:
                colours = origin.interpolate(self.material_set.colours, mask)
                _multiply(out, mask, colours if clear else colours[:, :3], srgb=True)
            if (
                self.settings.settled
                or len({self.material_set.kinds[number] for number in self.materials}) > 1
            ):
                self._settle(slot, Image(out, alpha=3 if clear else -1), mask, k)
        pad_charts(out, reached, self.settings.padding, kind)
        return Image(out, alpha=3 if clear else -1)

    def _shows_clear_vertices(self, materials: Sequence[Material]) -> bool:
        """Return whether vertex colors have an alpha below 1 that is visible in the materials."""
        colours = self.material_set.colours
        modes = {
            material.source.get("alphaMode") for material in materials if isinstance(material.source, dict)
        }
        return bool(colours is not None and modes - {None, "OPAQUE"} and (colours[..., 3] < 1).any())

    def _settle(self, slot: str, image: Image, mask: Flags, material: int) -> None:
        """Replace the alpha of a mask by its visible effect, all or nothing (Khronos, *glTF 2.0*, §3.9.4)."""
        source = self.material_set.materials[material].source
        factor = (
            () if slot in self.multiplied else self.material_set.materials[material].factors.get(slot, ())
        )
        if image.alpha < 0 or slot not in (BASE, DIFFUSE) or not isinstance(source, dict):
            return
        if source.get("alphaMode") == "MASK":
            top = np.iinfo(image.pixels.dtype).max
            by = factor[3] if len(factor) > 3 else 1.0
            is_visible = (
                by * image.pixels[mask, image.alpha] >= source.get("alphaCutoff", DEFAULT_ALPHA_CUTOFF) * top
            )
            image.pixels[mask, image.alpha] = np.where(is_visible, top, 0)


def convert_each(pictures: Mapping[str, Image], convert: Callable[[Image], T]) -> dict[str, T]:
    """Return converted pictures by slot; a picture that several slots share is converted once, and stays shared."""
    distinct = {id(image): image for image in pictures.values()}
    converted = {key: convert(image) for key, image in distinct.items()}
    return {slot: converted[id(image)] for slot, image in pictures.items()}


def without_profile(image: Image) -> Image:
    """Convert the picture to sRGB with integers of 8 or 16 bits and straight alpha."""
    return prepare(image, formats.picture("a.png"))


def _widen(image: Image, dtype: np.dtype, clear: bool) -> Image:
    """Convert an sRGB picture to three colours, with alpha if `clear`, and this type."""
    pixels = image.pixels if image.pixels.dtype == dtype else image.pixels.astype(dtype) * 257
    has = image.alpha >= 0
    colours = pixels[..., : pixels.shape[2] - has][..., [0, 0, 0] if pixels.shape[2] - has < 3 else [0, 1, 2]]
    if not clear:
        return Image(np.ascontiguousarray(colours))
    alpha = pixels[..., image.alpha, None] if has else np.full_like(pixels[..., :1], np.iinfo(dtype).max)
    return Image(np.concatenate([colours, alpha], axis=2), alpha=3)


def _multiply(out: NDArray, mask: Flags, factor: Real, *, srgb: bool) -> None:
    """Multiply some pixels by linear factors (k,) per channel, or (p, k) per pixel; further channels are unchanged."""
    channels = out.shape[2]
    by = np.ones((*factor.shape[:-1], channels), np.float32)
    by[..., : min(factor.shape[-1], channels)] = factor[..., :channels]
    if (by == 1).all():
        return
    alpha = 3 if channels == 4 else -1
    encoding = {"srgb": srgb, "associated": False}
    values = colour.decode(out[mask][None], alpha, premultiply=False, **encoding) * by
    out[mask] = colour.encode(values, out.dtype, alpha, **encoding)[0]
