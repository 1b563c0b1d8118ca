"""The material set of a mesh: its triangles, the material of each, and the pictures of materials."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.charted import Charted
from ...pixels.texture import REPEAT, Wrap
from ..pictures import image_files
from ..pictures.image import Image


@dataclass(frozen=True, eq=False)
class MaterialMap:
    """A picture in a material.

    Attributes:
        picture: its file, or the content of one.
        kind: kind of data in its channels (see `pixels.sampler.KINDS`).
        where: its name in messages.
        uv: (t, 2) its texture coordinates, v up, indexed like those of the set; None for those of the set.
        wrap: its wrap mode.
        options: further data: glTF's sampler, or options of an MTL statement such as `-bm 0.3`.
        opaque: whether its alpha is ignored.
    """

    picture: Path | bytes
    kind: str
    where: str
    uv: Real | None = None
    wrap: Wrap = REPEAT
    options: Any = None
    opaque: bool = False

    def image(self, max_pixels: int) -> Image:
        """Read the picture.

        Raises:
            InputError: it cannot be read, or has more pixels.
        """
        image = image_files.read_held(self.picture, self.where, max_pixels=max_pixels)
        if not self.opaque or image.alpha < 0:
            return image
        return replace(image, pixels=np.delete(image.pixels, image.alpha, axis=2), alpha=-1)


@dataclass(frozen=True, eq=False)
class Material:
    """A material.

    Attributes:
        name: its name in the file.
        key: its unique key, see `mesh_format.Pictures`.
        maps: its pictures by slot of glTF (see `gltf_materials.slots`), or statement of MTL.
        source: everything in the file about it: glTF's JSON, or the lines of an MTL.
        factors: by slot, factors of its pictures of colours and numbers, or the values without a picture: linear red,
            green, blue and optionally alpha.
        kind: a text that represents all properties which are not in pictures.
    """

    name: str
    key: str
    maps: dict[str, MaterialMap] = field(default_factory=dict)
    source: Any = None
    factors: dict[str, tuple[float, ...]] = field(default_factory=dict)
    kind: str = ""


@dataclass(frozen=True, eq=False)
class MaterialSet:
    """A mesh with its materials.

    Attributes:
        sheet: its triangles, with their texture coordinates.
        materials: the materials.
        owner: (m,) the material of each triangle.
        dialect: names of the materials' slots, those of "gltf" or "mtl".
        notes: what a user should know.
        colours: (m, 3, 4) vertex colors at the triangles' corners, linear with alpha, by which those of the materials
            are multiplied; None if there are none.
    """

    sheet: Charted
    materials: tuple[Material, ...]
    owner: Index
    dialect: str
    notes: tuple[str, ...] = ()
    colours: Real | None = None

    @property
    def maps(self) -> list[MaterialMap]:
        """The maps of all materials that have triangles."""
        return [map for k in np.unique(self.owner) for map in self.materials[k].maps.values()]

    @cached_property
    def kinds(self) -> list[str]:
        """For each material, its properties that are not in pictures: materials of one kind can be merged."""
        return [material.kind for material in self.materials]

    def shown_by(self, map: MaterialMap) -> Charted:
        """Return the triangles with the texture coordinates of a picture."""
        return self.sheet if map.uv is None else self._sheets[id(map.uv)]

    @cached_property
    def _sheets(self) -> dict[int, Charted]:
        layouts = {id(map.uv): map.uv for map in self.maps if map.uv is not None}
        return {key: replace(self.sheet, uv=uv) for key, uv in layouts.items()}

    def instead(self, replacements: dict[str, MaterialMap]) -> "MaterialSet":
        """Return the set with the given pictures in place of the materials' own, with the wrap modes of these."""

        def with_pictures(material: Material) -> Material:
            maps = material.maps
            new = {slot: replace(map, wrap=maps.get(slot, map).wrap) for slot, map in replacements.items()}
            return replace(material, maps=maps | new)

        return replace(self, materials=tuple(with_pictures(material) for material in self.materials))


def part(sheet: Charted, triangles: Flags | Index) -> Charted:
    """Return a subset of a sheet's triangles."""
    normals = None if sheet.normal_faces is None else sheet.normal_faces[triangles]
    stated = None if sheet.stated is None else sheet.stated[triangles]
    faces, uv_faces = sheet.faces[triangles], sheet.uv_faces[triangles]
    return replace(sheet, faces=faces, uv_faces=uv_faces, normal_faces=normals, stated=stated)


def check_pictures(material_set: MaterialSet, name: str) -> None:
    """Refuse a mesh whose materials have no pictures and that has no vertex colors.

    Raises:
        InputError: there are none.
    """
    if not material_set.maps and material_set.colours is None:
        why = "".join(f" ({note})" for note in material_set.notes[:1])
        raise InputError(
            f"{name}: its materials have no textures; name pictures with --texture, --normal or --data{why}"
        )
