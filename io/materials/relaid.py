"""Transfer another mesh's materials to a mesh's own texture coordinates: GLB and OBJ, in all combinations."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...arrays import Index
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.relayout import Conflicts, Origin, nearest, overlap_in_one_picture, partners
from ...surfaces.matching import matched
from .. import formats
from ..meshes import gltf_materials, mesh_files
from ..meshes.gltf_format import primitives_of
from ..meshes.mesh_format import MeshFile
from ..pictures.image import Image
from . import of_gltf, of_mtl
from .carried import BakeSettings, MaterialBaker
from .material_set import MaterialMap, MaterialSet, check_pictures, part

GIVEN = {
    "gltf": {"colour": gltf_materials.BASE, "normal": "normalTexture"},
    "mtl": {"colour": "map_kd", "normal": "norm"},
}


def material_set_of(meshes: Sequence[MeshFile], *, bare: bool = False, plain: bool = False) -> MaterialSet:
    """Return the material set of everything read from a file; `bare` and `plain` as for `of_gltf.material_set`.

    Raises:
        InputError: no coordinates, or a picture cannot be read.
    """
    if parts := primitives_of(meshes[0]):
        return of_gltf.material_set(_name(meshes), parts, bare=bare, plain=plain)
    return of_mtl.material_set(meshes[0], plain=plain)


def sheet_of(meshes: Sequence[MeshFile]) -> Charted:
    """Return the triangles of everything read from a file, with the coordinates of colour textures.

    Raises:
        InputError: as for `material_set_of`.
    """
    if parts := primitives_of(meshes[0]):
        return of_gltf.sheet(_name(meshes), of_gltf.with_layout(_name(meshes), parts), bare=False)
    return of_mtl.sheet_of(meshes[0])


def _name(meshes: Sequence[MeshFile]) -> str:
    return meshes[0].mesh.name if len(meshes) == 1 else str(meshes[0].path)


def given_maps(maps: Sequence[tuple[str, str]], dialect: str) -> dict[str, MaterialMap]:
    """Return pictures that the user names for the old coordinates, by slot, given their files and kinds.

    Raises:
        InputError: several of one kind, or a kind without a unique slot in materials.
    """
    by_slot = dict[str, MaterialMap]()
    for path, kind in maps:
        if (slot := GIVEN[dialect].get(kind)) is None:
            text = f"--{kind}: cannot be added to the materials of a mesh; use a picture's suffix for -o"
            raise InputError(f"{path}: {text}")
        if slot in by_slot:
            raise InputError(f"{path}: a material has one texture of each kind; name only one")
        by_slot[slot] = MaterialMap(Path(path), kind, path)
    return by_slot


@dataclass(eq=False)
class Relaid:
    """A mesh to be written with another mesh's materials.

    Attributes:
        before: material set of the old mesh.
        meshes: everything read from the new mesh's file.
        name: path of the output file.
        settings: for baking; `limit` is that of `meshes.relayout.carry`.
    """

    before: MaterialSet
    meshes: Sequence[MeshFile]
    name: Path
    settings: BakeSettings

    def __post_init__(self) -> None:
        self.notes: list[str] = [*self.before.notes, *self.after.notes]
        old, new = self.before.colours is not None, self.after.colours is not None
        if old and (not self.before.maps or not new):
            self.settings = replace(self.settings, vertex_colours=True)
            dropped = "; its own vertex colors are removed" if new else ""
            self.add_notes(
                [f"the vertex colors of {self.before.sheet.name} become part of the texture{dropped}"]
            )
        elif new and not old:
            self.add_notes([f"keeps its own vertex colors, which {self.before.sheet.name} does not have"])

    @cached_property
    def after(self) -> MaterialSet:
        """Material set of the new mesh, with texture coordinates as stored in its file."""
        return material_set_of(self.meshes, bare=True)

    @property
    def dialect(self) -> str:
        """Dialect of the output file's materials."""
        return mesh_files.format_of(self.name).dialect

    def check(self) -> None:
        """Refuse what cannot be written or transferred.

        Raises:
            InputError: a suffix without materials, or that would lose parts of the new mesh; no pictures.
        """
        check_pictures(self.before, self.before.sheet.name)
        new_dialect = self.meshes[0].content.dialect
        if new_dialect == "gltf" and self.dialect != new_dialect:
            raise InputError(f"{self.name}: would lose contents of {self.meshes[0].path}; use .glb")
        if not formats.of(self.name).uv or not self.dialect:
            able = " and ".join(mesh_files.suffixes_with_materials())
            raise InputError(f"{self.name}: this format cannot contain materials; use {able}")
        if self.dialect == "mtl" and new_dialect != "mtl":
            path = self.meshes[0].path
            raise InputError(
                f"{self.name}: an OBJ with materials can only be made from an OBJ, not from {path}; use .glb"
            )

    @cached_property
    def _pairs(self) -> tuple[Charted, Index, Index]:
        """The new triangles registered with the old ones, and `partners` of both."""
        sheet = matched(self.before.sheet, self.after.sheet, self.settings.match)
        return sheet, *partners(self.before.sheet, sheet)

    @cached_property
    def owner(self) -> Index:
        """The material of each triangle in the output file; shape (m,).

        In glTF, the new mesh's materials are split by the kinds of old materials that they show. In OBJ they are kept,
        since transparency is a separate picture there.
        """
        if self.dialect == "mtl":
            return self.after.owner
        by_tile = self._owner_by_tile
        names, kind = np.unique(self.before.kinds, return_inverse=True)
        if names.size == 1:
            return by_tile
        sheet, old, _ = self._pairs
        alone = np.flatnonzero(old < 0)
        old = old.copy()
        old[alone] = nearest(self.before.sheet, sheet.points[sheet.faces[alone]].mean(axis=1))[0]
        return np.unique(names.size * by_tile + kind[self.before.owner[old]], return_inverse=True)[1]

    @cached_property
    def _owner_by_tile(self) -> Index:
        """(m,) the material of each triangle, numbered by UDIM tile where charts would overlap in one picture."""
        sheet, owner = self.after.sheet, self.after.owner
        parted = owner
        tiles = np.unique(np.floor(sheet.uv[sheet.uv_faces].mean(axis=1)), axis=0, return_inverse=True)[1]
        for k in np.unique(owner):
            triangles = np.flatnonzero(owner == k)
            if np.unique(tiles[triangles]).size > 1 and overlap_in_one_picture(
                part(sheet, triangles), tiles[triangles]
            ):
                parted = np.where(owner == k, (int(parted.max()) + 1) + tiles, parted)
                self.add_notes(
                    [
                        f"gets a material for each of {np.unique(tiles[triangles]).size} tiles (UDIM) of its layout"
                    ]
                )
        return parted if parted is owner else np.unique(parted, return_inverse=True)[1]

    @cached_property
    def bakers(self) -> list[MaterialBaker]:
        """The bakers of the new mesh's materials, except those that show nothing of the old mesh."""
        sheet, first, order = self._pairs
        bakers, count = [], len(self.after.materials)
        if self.owner is not self.after.owner:
            count = int(self.owner.max(initial=-1)) + 1
            if count > np.unique(self._owner_by_tile).size:
                kinds = "transparency, sides, scales of normals or extensions"
                self.add_notes(
                    [f"has {count} materials, because those of {self.before.sheet.name} differ in {kinds}"]
                )
        for k in range(count):
            triangles = np.flatnonzero(self.owner == k)
            baker = MaterialBaker(
                self.before, part(sheet, triangles), (first[triangles], order[triangles]), self.settings
            )
            if self.before.dialect != self.dialect:  # pictures may be merged, so all need the same size
                baker.settings = replace(self.settings, size=baker.size, settled=self.dialect == "mtl")
            bakers.append(baker)
        return bakers

    @property
    def conflicts(self) -> list[Conflicts]:
        """For the largest picture of each material, the texels for which no value is right."""
        textures = self.before.owner
        if self.settings.vertex_colours:  # colours differ between any two triangles
            textures = np.arange(len(self.before.sheet.faces))
        return [baker.origin(baker.size).conflicts(textures) for baker in self.bakers]

    @property
    def origins(self) -> list[Origin]:
        """For the largest picture of each material, the origins of its texels, for reports."""
        return [baker.origin(baker.size) for baker in self.bakers]

    @cached_property
    def pictures(self) -> list[dict[str, Image]]:
        """For each material, its pictures by slot of the old materials."""
        pictures = []
        for baker in self.bakers:
            pictures.append({slot: baker.image(slot) for slot in baker.slots})
            self.add_notes(baker.notes)
            if len({self.before.kinds[k] for k in baker.materials}) > 1:
                self.add_notes(
                    [
                        "materials that differ in more than their textures are merged, because some "
                        "triangles show several of them"
                    ]
                )
        return pictures

    def add_notes(self, notes: Iterable[str]) -> None:
        """Add notes on the output file, each only once."""
        self.notes += [note for note in (f"{self.name}: {text}" for text in notes) if note not in self.notes]
