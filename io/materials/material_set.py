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
    """A picture that a material shows.

    Attributes:
        picture: its file, or the content of one.
        kind: what its channels are (see `pixels.sampler.KINDS`).
        where: what messages call it.
        uv: (t, 2) the coordinates that it is shown by, v up, for the numbers of the set's own; None: these.
        wrap: what lies beyond its edges.
        options: what else the material says of it: glTF's sampler, `-bm 0.3` of an MTL statement.
        opaque: whether its alpha counts for nothing.
    """

    picture: Path | bytes
    kind: str
    where: str
    uv: Real | None = None
    wrap: Wrap = REPEAT
    options: Any = None
    opaque: bool = False

    def image(self, max_pixels: int) -> Image:
        """Return the picture.

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
        name: what the file calls it.
        key: what reports it from others, see `obj_materials.Pictures`.
        maps: its pictures by what they are for: slots of glTF (see `gltf_materials.slots`), or statements of MTL.
        source: all that the file says of it: glTF's JSON, or the lines of an MTL.
        factors: what its pictures of colours and numbers are multiplied by, and what is shown without one: linear
            red, green, blue and perhaps alpha, by slot.
        kind: what no picture holds of it, in some form.
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
        sheet: its triangles, with separate coordinates.
        materials: the materials.
        owner: (m,) the material of each triangle.
        dialect: the names of the materials' slots: those of "gltf" or "mtl".
        notes: what a user should know.
        colours: (m, 3, 4) vertex colors at the triangles' corners, linear with alpha, which multiply those of the
            materials; None: there are none.
    """

    sheet: Charted
    materials: tuple[Material, ...]
    owner: Index
    dialect: str
    notes: tuple[str, ...] = ()
    colours: Real | None = None

    @property
    def maps(self) -> list[MaterialMap]:
        """Of all materials that have triangles."""
        return [each for k in np.unique(self.owner) for each in self.materials[k].maps.values()]

    @cached_property
    def kinds(self) -> list[str]:
        """Of each material what no picture holds: two of one kind can become one."""
        return [material.kind for material in self.materials]

    def shown_by(self, map: MaterialMap) -> Charted:
        """Return the triangles with the coordinates that a picture is shown by."""
        return self.sheet if map.uv is None else self._sheets[id(map.uv)]

    @cached_property
    def _sheets(self) -> dict[int, Charted]:
        others = {id(each.uv): each.uv for each in self.maps if each.uv is not None}
        return {key: replace(self.sheet, uv=uv) for key, uv in others.items()}

    def instead(self, given: dict[str, MaterialMap]) -> "MaterialSet":
        """Return the same with these pictures in the place of the materials' own, wrapped as these."""

        def with_pictures(material: Material) -> Material:
            own = material.maps
            new = {slot: replace(each, wrap=own.get(slot, each).wrap) for slot, each in given.items()}
            return replace(material, maps=own | new)

        return replace(self, materials=tuple(with_pictures(material) for material in self.materials))


def part(sheet: Charted, triangles: Flags | Index) -> Charted:
    """Return some triangles of a sheet."""
    normals = None if sheet.normal_faces is None else sheet.normal_faces[triangles]
    stated = None if sheet.stated is None else sheet.stated[triangles]
    faces, uv_faces = sheet.faces[triangles], sheet.uv_faces[triangles]
    return replace(sheet, faces=faces, uv_faces=uv_faces, normal_faces=normals, stated=stated)


def check_pictures(material_set: MaterialSet, name: str) -> None:
    """Refuse a mesh whose materials show no picture and that has no vertex colors.

    Raises:
        InputError: there is none.
    """
    if not material_set.maps and material_set.colours is None:
        why = "".join(f" ({note})" for note in material_set.notes[:1])
        raise InputError(
            f"{name}: its materials have no textures; name pictures with --texture, --normal or --data{why}"
        )
