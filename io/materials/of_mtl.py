"""Looks of OBJ files with their material libraries, and of what holds no more than one picture."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.mesh import triangulate
from .. import limits
from ..meshes import material_library, obj_materials
from ..meshes.mesh_files import MeshFile
from ..pictures import image_files
from ..pictures.tiles import is_pattern
from .material_set import Material, MaterialMap, MaterialSet

COLOURS = ("map_ka", "map_kd", "map_ks", "map_ke", "decal")
NORMALS = ("norm", "map_norm")
BUMPS = ("bump", "map_bump")  # heights as the format has it, but most programs write normals there
ELSEWHERE = ("refl", "map_refl")  # what is around, not on the surface
BLUE, LEAN = 0.7, 0.15
"""Of the mean of a normal map: at least so blue, so far from grey in red and green (by hand)."""


def material_set(file: MeshFile, max_pixels: int = limits.READ_PIXELS) -> MaterialSet:
    """The material set of an OBJ, or of another mesh with one picture.

    Raises:
        InputError: faces without coordinates, or a picture that cannot be read.
    """
    sheet = sheet_of(file)
    if file.obj is None:
        maps = (
            {"map_kd": MaterialMap(file.picture, "colour", f"{file.path}: its texture")}
            if file.picture
            else {}
        )
        return MaterialSet(sheet, (Material("", "", maps),), np.zeros(len(sheet.faces), np.int64), "mtl")
    first = triangulate(file.mesh)[:, 0]
    face = np.searchsorted(file.mesh.starts, first, side="right") - 1
    which, uses = file.obj.current("usemtl")
    names = [use.text for use in uses] + [""]
    used = list(dict.fromkeys(names[k] for k in which[file.faces]))
    number = np.array([used.index(name) if name in used else -1 for name in names])
    library = obj_materials.library_of(file.obj)
    notes = [*library.missing, *(f"{file.path}: {note}" for note in library.outside)]
    materials = [_material(file.path, library, name, sheet, notes, max_pixels) for name in used]
    return MaterialSet(sheet, tuple(materials), number[which[file.faces]][face], "mtl", tuple(notes))


def sheet_of(file: MeshFile) -> Charted:
    """The triangles with their coordinates; errors as for `material_set`."""
    sheet = Charted.of(file.mesh)
    if (sheet.uv_faces < 0).any():
        raise InputError(f"{sheet.name}: some faces have no texture coordinates; give all of them some")
    return sheet


def _material(
    path: Path, library: material_library.Library, name: str, sheet: Charted, notes: list[str], most: int
) -> Material:
    lines = library.materials().get(name, [])
    maps = dict[str, MaterialMap]()
    for line in lines:
        word, rest = material_library.split(line)
        word, named = word.lower(), material_library.file_name(rest)
        if not word.startswith(material_library.MAPS) or not named or word in ELSEWHERE:
            continue
        picture = library.folder / named.replace("\\", "/")
        if not picture.is_file() or is_pattern(picture):
            notes.append(f"{path}: {word} of {name} names {named}, which is no file; left out")
            continue
        kind = _kind(word, picture, most)
        wrap = material_library.wrap(rest)
        maps[word] = MaterialMap(picture, kind, str(picture), _place(sheet.uv, rest), wrap)
    return Material(name, name, maps, lines, kind=f"d {cover(lines):g}")


def cover(lines: Iterable[str]) -> float:
    """How opaque a material is by its numbers, `d` and `Tr`: 0 … 1."""
    found = 1.0
    for word, values in material_library.numbers(lines).items():
        if word in ("d", "tr") and len(values) == 1:
            found = values[0] if word == "d" else 1 - values[0]
    return found


def _place(uv: Real, rest: str) -> Real | None:
    """Texture coordinates as the options of a statement move them; None where they don't."""
    scale, offset = material_library.placing(rest)
    return None if (scale, offset) == ((1, 1), (0, 0)) else uv * scale + offset


def _kind(word: str, picture: Path, most: int) -> str:
    if word in NORMALS or (word in BUMPS and _shows_normals(picture, most)):
        return "normal"
    return "colour" if word in COLOURS else "data"


def _shows_normals(picture: Path, most: int) -> bool:
    """Whether a picture is one of normals: blue all over."""
    image = image_files.read(picture, max_pixels=most)
    if image.pixels.shape[2] < 3 or image.pixels.dtype.kind == "f":
        return False
    red, green, blue = image.pixels[..., :3].mean(axis=(0, 1)) / np.iinfo(image.pixels.dtype).max
    return bool(blue > BLUE and abs(red - 0.5) < LEAN and abs(green - 0.5) < LEAN)
