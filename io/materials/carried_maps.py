"""The other maps of a mesh's materials, carried from the coordinates that they have to new ones (--carry-maps)."""

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
from . import of_gltf, of_mtl
from .carried import BakeSettings, MaterialBaker, as_png_files
from .material_set import MaterialSet, part

TEXTURE_SLOTS = (gltf_materials.BASE, gltf_materials.DIFFUSE, "map_kd")  # where a texture that is mapped goes


class CarriedPictures(NamedTuple):
    """Pictures of materials for new coordinates.

    Attributes:
        pictures: the content of their files, see `mesh_format.Pictures`.
        notes: for the user, such as that detail is lost.
    """

    pictures: dict[str, dict[str, bytes]]
    notes: list[str]


@dataclass(frozen=True, eq=False)
class CarriedMaps:
    """The maps of a mesh's materials, read once for all that a job asks of them.

    Attributes:
        file: the mesh as it was read.
        kinds: see `of_mtl.Kinds`.
    """

    file: MeshFile
    kinds: of_mtl.Kinds = field(default_factory=dict)

    def check(self, name: str | Path) -> None:
        """Refuse a mesh without maps to carry, and an output that cannot hold them.

        Raises:
            InputError: the mesh has no materials, or the output holds none of their kind; a picture that cannot be
                read, coordinates that are missing.
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
        """What the triangles of the mesh show.

        Raises:
            InputError: they have no coordinates, or a picture cannot be read.
        """
        return _material_set(self.file, self.kinds)

    def companions(self, name: str | Path, *, shown: bool) -> list[str]:
        """List the pictures that come beside an OBJ, and its library; `shown` as for `carry`."""
        if primitives_of(self.file):
            return []
        materials = self.material_set.materials
        found = {
            str(material_library.picture_of(Path(name), material.name if len(materials) > 1 else None, word))
            for material in materials
            for word in material.maps
            if not (shown and word in TEXTURE_SLOTS)
        }
        return [str(Path(name).with_suffix(".mtl")), *sorted(found)] if found else []

    def carry(
        self, file: MeshFile, new: NewCoordinates, *, shown: bool = False, threads: int | None = None
    ) -> CarriedPictures:
        """Make the pictures of materials for new coordinates, as PNG files, those of normals turned.

        Args:
            file: the mesh, perhaps with smaller triangles than when it was read.
            new: its new coordinates.
            shown: whether a new texture takes the place of the colours.
            threads: never change the result.

        Raises:
            InputError: a picture that cannot be read.
        """
        same_file = file.content is self.file.content
        material_set = self.material_set if same_file else _material_set(file, self.kinds)
        sheet = replace(material_set.sheet, uv=new.uv, uv_faces=new.corners[_corners(file)], stated=None)
        made, notes = dict[str, dict[str, bytes]](), list[str]()
        for k, material in enumerate(material_set.materials):
            own = np.flatnonzero(material_set.owner == k)
            same = own, np.tile(np.arange(3), (own.size, 1))
            baker = MaterialBaker(material_set, part(sheet, own), same, BakeSettings(threads=threads))
            slots = [slot for slot in material.maps if own.size and not (shown and slot in TEXTURE_SLOTS)]
            made[material.key] = as_png_files({slot: baker.image(slot) for slot in slots})
            notes += [note for note in baker.notes if note not in notes]
        return CarriedPictures(made, notes)


def _corners(file: MeshFile) -> Index:
    """Return (m, 3) the corners of the mesh that its set's triangles have."""
    if not primitives_of(file):
        return triangulate(file.mesh)
    return np.arange(file.mesh.corners.size).reshape(-1, 3)[_shows(file)[file.faces]]


def _shows(file: MeshFile) -> Flags:
    """Return (f,) which triangles of a glTF file's primitives have coordinates."""
    parts = primitives_of(file)
    counts = [len(part.faces) for part in parts]
    return np.repeat([of_gltf.has_layout(part) for part in parts], counts)


def _material_set(file: MeshFile, kinds: of_mtl.Kinds) -> MaterialSet:
    if not primitives_of(file):
        return of_mtl.material_set(file, kinds=kinds)
    whole = of_gltf.material_set(str(file.path), primitives_of(file))
    own = np.flatnonzero(file.faces[_shows(file)])
    colours = None if whole.colours is None else whole.colours[own]
    return replace(whole, sheet=part(whole.sheet, own), owner=whole.owner[own], colours=colours)
