"""Transfer the other maps of a mesh's materials from their coordinates to new ones (--carry-maps)."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...arrays import Flags, Index
from ...errors import InputError
from ...meshes.mesh import triangulate
from .. import formats
from ..meshes import gltf_materials, material_library, mesh_files
from ..meshes.gltf_format import primitives_of
from ..meshes.mesh_format import MeshFile, NewCoordinates
from ..pictures.image_files import as_png
from . import of_gltf, of_mtl
from .carried import BakeSettings, MaterialBaker, convert_each
from .material_set import MaterialSet, part

TEXTURE_SLOTS = (gltf_materials.BASE, gltf_materials.DIFFUSE, "map_kd")  # slots of a mapped texture


class CarriedPictures(NamedTuple):
    """Pictures of materials for new coordinates.

    Attributes:
        pictures: contents of their files, see `mesh_format.Pictures`.
        notes: for the user, for example on lost detail.
    """

    pictures: dict[str, dict[str, bytes]]
    notes: list[str]


@dataclass(frozen=True, eq=False)
class CarriedMaps:
    """The maps of a mesh's materials, read once per job.

    Attributes:
        file: the mesh as it was read.
        kinds: see `of_mtl.Kinds`.
    """

    file: MeshFile
    kinds: of_mtl.Kinds = field(default_factory=dict)

    def check(self, name: str | Path) -> None:
        """Refuse a mesh without maps, and an output that cannot store them.

        Raises:
            InputError: the mesh has no materials, the output does not support materials of their kind, a picture
                cannot be read, or coordinates are missing.
        """
        dialect, path = self.file.content.dialect, self.file.path
        if not dialect:
            raise InputError(
                f"{path}: --carry-maps needs materials of a GLB, glTF or OBJ file, and this file has none"
            )
        able = mesh_files.suffixes_with_materials(dialect)
        if formats.suffix_of(name) not in able:
            raise InputError(
                f"{name}: cannot contain the materials of {path} (--carry-maps); use {' or '.join(able)}"
            )
        _ = self.material_set

    @cached_property
    def material_set(self) -> MaterialSet:
        """The materials of the mesh's triangles.

        Raises:
            InputError: coordinates are missing, or a picture cannot be read.
        """
        return _material_set(self.file, self.kinds)

    def companions(self, name: str | Path, *, retextured: bool) -> list[str]:
        """List the pictures that will be written beside an OBJ, and its library; `retextured` as for `carry`."""
        if primitives_of(self.file):
            return []
        materials = self.material_set.materials
        pictures = {
            str(material_library.picture_of(Path(name), material.name if len(materials) > 1 else None, word))
            for material in materials
            for word in material.maps
            if not (retextured and word in TEXTURE_SLOTS)
        }
        return [str(Path(name).with_suffix(".mtl")), *sorted(pictures)] if pictures else []

    def carry(
        self,
        file: MeshFile,
        new: NewCoordinates,
        *,
        retextured: bool = False,
        padding: int | None = None,
        threads: int | None = None,
    ) -> CarriedPictures:
        """Bake the pictures of materials for new coordinates as PNG files; normals are rotated.

        Args:
            file: the mesh, possibly with triangles subdivided since it was read.
            new: its new coordinates.
            retextured: whether a new texture replaces the colours.
            padding: texels by which colours extend beyond charts; see `BakeSettings`.
            threads: number of threads; it does not affect the result.

        Raises:
            InputError: a picture cannot be read.
        """
        same_file = file.content is self.file.content
        material_set = self.material_set if same_file else _material_set(file, self.kinds)
        sheet = replace(material_set.sheet, uv=new.uv, uv_faces=new.corners[_corners(file)], stated=None)
        pictures, notes = dict[str, dict[str, bytes]](), list[str]()
        for k, material in enumerate(material_set.materials):
            triangles = np.flatnonzero(material_set.owner == k)
            corners = triangles, np.tile(np.arange(3), (triangles.size, 1))
            settings = BakeSettings(padding=padding, threads=threads)
            baker = MaterialBaker(material_set, part(sheet, triangles), corners, settings)
            slots = [
                slot
                for slot in material.maps
                if triangles.size and not (retextured and slot in TEXTURE_SLOTS)
            ]
            pictures[material.key] = convert_each({slot: baker.image(slot) for slot in slots}, as_png)
            notes += [note for note in baker.notes if note not in notes]
        return CarriedPictures(pictures, notes)


def _corners(file: MeshFile) -> Index:
    """Return (m, 3) the mesh's corners behind the triangles of its material set."""
    if not primitives_of(file):
        return triangulate(file.mesh)
    return np.arange(file.mesh.corners.size).reshape(-1, 3)[_shows(file)[file.faces]]


def _shows(file: MeshFile) -> Flags:
    """Mark (f,) the triangles of a glTF file's primitives that have coordinates."""
    parts = primitives_of(file)
    counts = [len(part.faces) for part in parts]
    return np.repeat([of_gltf.has_layout(part) for part in parts], counts)


def _material_set(file: MeshFile, kinds: of_mtl.Kinds) -> MaterialSet:
    if not primitives_of(file):
        return of_mtl.material_set(file, kinds=kinds)
    whole = of_gltf.material_set(str(file.path), primitives_of(file))
    triangles = np.flatnonzero(file.faces[_shows(file)])
    colours = None if whole.colours is None else whole.colours[triangles]
    return replace(whole, sheet=part(whole.sheet, triangles), owner=whole.owner[triangles], colours=colours)
