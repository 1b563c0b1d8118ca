"""A mesh with another mesh's materials, carried to its own texture coordinates: GLB and OBJ, each from either."""

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
    """Return the material set of all that was read of a file; `bare` and `plain` as for `of_gltf.material_set`.

    Raises:
        InputError: no coordinates, or a picture that cannot be read.
    """
    if parts := primitives_of(meshes[0]):
        return of_gltf.material_set(_name(meshes), parts, bare=bare, plain=plain)
    return of_mtl.material_set(meshes[0])


def sheet_of(meshes: Sequence[MeshFile]) -> Charted:
    """Return the triangles of all that was read of a file, with the coordinates that colours are shown by; errors in
    the same way.
    """
    if parts := primitives_of(meshes[0]):
        return of_gltf.sheet(_name(meshes), of_gltf.with_layout(_name(meshes), parts), bare=False)
    return of_mtl.sheet_of(meshes[0])


def _name(meshes: Sequence[MeshFile]) -> str:
    return meshes[0].mesh.name if len(meshes) == 1 else str(meshes[0].path)


def given_maps(maps: Sequence[tuple[str, str]], dialect: str) -> dict[str, MaterialMap]:
    """Pictures that the user names for the old coordinates, with what their channels are, by slot.

    Raises:
        InputError: several of a kind, or one that materials have no one place for.
    """
    found = dict[str, MaterialMap]()
    for path, kind in maps:
        if (slot := GIVEN[dialect].get(kind)) is None:
            text = f"--{kind}: cannot be added to the materials of a mesh; use a picture's suffix for -o"
            raise InputError(f"{path}: {text}")
        if slot in found:
            raise InputError(f"{path}: a material has one texture of each kind; name only one")
        found[slot] = MaterialMap(Path(path), kind, path)
    return found


@dataclass(eq=False)
class Relaid:
    """A mesh about to be written with another's materials.

    Attributes:
        before: what the old mesh shows.
        meshes: all that was read of the new mesh's file.
        name: what the new file will be called.
        settings: how pictures are carried; their limit is that of `meshes.relayout.carry`.
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
            self.told([f"the vertex colors of {self.before.sheet.name} become part of the texture{dropped}"])
        elif new and not old:
            self.told([f"keeps its own vertex colors, which {self.before.sheet.name} does not have"])

    @cached_property
    def after(self) -> MaterialSet:
        """The new mesh, with coordinates as they stand in its file."""
        return material_set_of(self.meshes, bare=True)

    @property
    def dialect(self) -> str:
        """Of the new file's materials."""
        return mesh_files.format_of(self.name).dialect

    def check(self) -> None:
        """Refuse what cannot be written or carried.

        Raises:
            InputError: a suffix that holds no materials, or not all of the new mesh; no pictures.
        """
        check_pictures(self.before, self.before.sheet.name)
        own = self.meshes[0].content.dialect
        if own == "gltf" and self.dialect != own:
            raise InputError(f"{self.name}: would lose contents of {self.meshes[0].path}; use .glb")
        if not formats.of(self.name).uv or not self.dialect:
            able = " and ".join(mesh_files.suffixes_with_materials())
            raise InputError(f"{self.name}: this format cannot contain materials; use {able}")
        if self.dialect == "mtl" and own != "mtl":
            path = self.meshes[0].path
            raise InputError(
                f"{self.name}: an OBJ with materials can only be made from an OBJ, not from {path}; use .glb"
            )

    @cached_property
    def _pairs(self) -> tuple[Charted, Index, Index]:
        """The new triangles brought to the old ones, and `partners` of both."""
        sheet = matched(self.before.sheet, self.after.sheet, self.settings.match)
        return sheet, *partners(self.before.sheet, sheet)

    @cached_property
    def owner(self) -> Index:
        """(m,) the material of each triangle in the new file: its own, and one more for each kind of old ones it shows.

        OBJ: its own. There transparency is a separate picture.
        """
        if self.dialect == "mtl":
            return self.after.owner
        own = self._owner_by_tile
        names, kind = np.unique(self.before.kinds, return_inverse=True)
        if names.size == 1:
            return own
        sheet, old, _ = self._pairs
        alone = np.flatnonzero(old < 0)
        old = old.copy()
        old[alone] = nearest(self.before.sheet, sheet.points[sheet.faces[alone]].mean(axis=1))[0]
        return np.unique(names.size * own + kind[self.before.owner[old]], return_inverse=True)[1]

    @cached_property
    def _owner_by_tile(self) -> Index:
        """(m,) the new mesh's materials, split by tiles (UDIM) where charts of several would overlap in one picture."""
        sheet, owner = self.after.sheet, self.after.owner
        parted = owner
        tiles = np.unique(np.floor(sheet.uv[sheet.uv_faces].mean(axis=1)), axis=0, return_inverse=True)[1]
        for k in np.unique(owner):
            own = np.flatnonzero(owner == k)
            if np.unique(tiles[own]).size > 1 and overlap_in_one_picture(part(sheet, own), tiles[own]):
                parted = np.where(owner == k, (int(parted.max()) + 1) + tiles, parted)
                self.told(
                    [f"gets a material for each of {np.unique(tiles[own]).size} tiles (UDIM) of its layout"]
                )
        return parted if parted is owner else np.unique(parted, return_inverse=True)[1]

    @cached_property
    def bakers(self) -> list[MaterialBaker]:
        """What makes the pictures of each material of the new mesh; of those that show nothing of the old one none."""
        sheet, first, order = self._pairs
        found, count = [], len(self.after.materials)
        if self.owner is not self.after.owner:
            count = int(self.owner.max(initial=-1)) + 1
            if count > np.unique(self._owner_by_tile).size:
                kinds = "transparency, sides, scales of normals or extensions"
                self.told(
                    [f"has {count} materials, because those of {self.before.sheet.name} differ in {kinds}"]
                )
        for k in range(count):
            own = np.flatnonzero(self.owner == k)
            baker = MaterialBaker(self.before, part(sheet, own), (first[own], order[own]), self.settings)
            if self.before.dialect != self.dialect:  # two pictures may become one: all are of one size
                baker.settings = replace(self.settings, size=baker.size, settled=self.dialect == "mtl")
            found.append(baker)
        return found

    @property
    def conflicts(self) -> list[Conflicts]:
        """Of each material's largest picture, texels of which it cannot be right."""
        textures = self.before.owner
        if self.settings.vertex_colours:  # no two triangles show the same
            textures = np.arange(len(self.before.sheet.faces))
        return [baker.origin(baker.size).conflicts(textures) for baker in self.bakers]

    @property
    def origins(self) -> list[Origin]:
        """Where texels came from, for reports: of each material's largest picture."""
        return [baker.origin(baker.size) for baker in self.bakers]

    @cached_property
    def pictures(self) -> list[dict[str, Image]]:
        """Of each material, by slots of the old materials."""
        found = []
        for baker in self.bakers:
            found.append({slot: baker.image(slot) for slot in baker.slots})
            self.told(baker.notes)
            if len({self.before.kinds[k] for k in baker.materials}) > 1:
                self.told(
                    [
                        "materials that differ in more than their textures are merged, because some "
                        "triangles show several of them"
                    ]
                )
        return found

    def told(self, notes: Iterable[str]) -> None:
        """Add remarks on the new file, each once."""
        self.notes += [note for note in (f"{self.name}: {each}" for each in notes) if note not in self.notes]
