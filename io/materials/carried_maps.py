"""The other maps of a mesh's materials, carried from the coordinates that they have to new ones (--carry-maps)."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...arrays import Flags, Index, Real
from ...errors import InputError
from ...meshes.mesh import triangulate
from ..meshes import gltf_materials, material_library
from ..meshes.mesh_files import MeshFile
from ..pictures.image_files import as_png
from . import of_gltf, of_mtl
from .carried import Carrier, How
from .material_set import MaterialSet, part

SHOWN = (gltf_materials.BASE, gltf_materials.DIFFUSE, "map_kd")  # where a texture that is mapped goes


def check(file: MeshFile, name: str | Path) -> None:
    """Refuse what has no maps to carry, or cannot hold them.

    Raises:
        InputError: the mesh, or the output, is neither a glTF file nor an OBJ, or not of the other's kind.
    """
    if not file.primitives and file.obj is None:
        raise InputError(
            f"{file.path}: --carry-maps is for materials of GLB, glTF and OBJ files; it names none"
        )
    wanted = ".glb" if file.primitives else ".obj"
    if Path(name).suffix.lower() != wanted:
        raise InputError(f"{name}: --carry-maps keeps the materials of {file.path}; use {wanted}")


def beside(file: MeshFile, name: str | Path, *, shown: bool) -> list[str]:
    """The pictures that come beside an OBJ, and its library; `shown` as for `carry`.

    Raises:
        InputError: old coordinates that are none.
    """
    if file.primitives:
        return []
    material_set = _material_set(file)
    found = {
        str(
            material_library.picture_of(
                Path(name), material.name if len(material_set.materials) > 1 else None, word
            )
        )
        for material in material_set.materials
        for word in material.maps
        if not (shown and word in SHOWN)
    }
    return [str(Path(name).with_suffix(".mtl")), *sorted(found)] if found else []


def carry(
    file: MeshFile, uv: Real, uv_corners: Index, *, shown: bool = False, threads: int | None = None
) -> dict[str, dict[str, bytes]]:
    """The pictures of materials for new coordinates, as PNG files, those of normals turned.

    Args:
        file: a mesh from a glTF file or an OBJ.
        uv: (t, 2) new coordinates, v up.
        uv_corners: (c,) coordinate of each corner of the mesh.
        shown: whether a new texture takes the place of the colours.
        threads: never change the result.

    Returns:
        The content of the files, see `obj_materials.Pictures`.

    Raises:
        InputError: a picture that cannot be read, or old coordinates that are none.
    """
    material_set, corner = _material_set(file), _corners(file)
    new = replace(material_set.sheet, uv=uv, uv_faces=uv_corners[corner], stated=None)
    made = dict[str, dict[str, bytes]]()
    for k, material in enumerate(material_set.materials):
        own = np.flatnonzero(material_set.owner == k)
        same = own, np.tile(np.arange(3), (own.size, 1))
        carrier = Carrier(material_set, part(new, own), same, How(threads=threads))
        slots = [slot for slot in material.maps if own.size and not (shown and slot in SHOWN)]
        made[material.key] = {slot: as_png(carrier.image(slot)) for slot in slots}
    return made


def _corners(file: MeshFile) -> Index:
    """(m, 3) the corners of the mesh that its set's triangles have."""
    if not file.primitives:
        return triangulate(file.mesh)
    return np.arange(file.mesh.corners.size).reshape(-1, 3)[_shows(file)[file.faces]]


def _shows(file: MeshFile) -> Flags:
    """(f,) which triangles of a glTF file's primitives have coordinates."""
    counts = [len(part.faces) for part in file.primitives]
    return np.repeat([of_gltf.has_layout(part) for part in file.primitives], counts)


def _material_set(file: MeshFile) -> MaterialSet:
    """What the triangles of a mesh show.

    Raises:
        InputError: they have no coordinates.
    """
    if not file.primitives:
        return of_mtl.material_set(file)
    whole = of_gltf.material_set(str(file.path), file.primitives)
    own = np.flatnonzero(file.faces[_shows(file)])
    return replace(whole, sheet=part(whole.sheet, own), owner=whole.owner[own])
