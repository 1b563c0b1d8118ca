"""Material sets of OBJ files with their material libraries, and of formats that store at most one picture."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.mesh import triangulate
from ...pixels import colour
from .. import limits
from ..meshes import material_library
from ..meshes.mesh_format import MeshFile
from ..meshes.obj import Obj
from ..meshes.obj_format import obj_content
from ..meshes.ply import Ply
from ..meshes.ply_format import PlyContent
from ..pictures import image_files
from ..pictures.tiles import is_pattern
from .material_set import Material, MaterialMap, MaterialSet

COLOURS = ("map_ka", "map_kd", "map_ks", "map_ke", "decal")
NORMALS = ("norm", "map_norm")
BUMPS = ("bump", "map_bump")  # heights according to the format, but most programs write normals there
ELSEWHERE = ("refl", "map_refl")  # environment maps, which are not on the surface
LEAST_MEAN_BLUE, MOST_MEAN_LEAN = 0.7, 0.15
"""Mean color of a normal map: at least so blue, and red and green at most so far from grey: normals point outwards
on average."""


Kinds = dict[tuple[str, Path], str]
"""Kinds of data in pictures, by statement and file; cached, because telling heights from normals needs the pixels."""


def material_set(
    file: MeshFile,
    max_pixels: int = limits.READ_PIXELS,
    kinds: Kinds | None = None,
    *,
    plain: bool = False,
) -> MaterialSet:
    """Return the material set of an OBJ, or of another mesh with one picture.

    Args:
        file: the mesh.
        max_pixels: limit on pictures that are read.
        kinds: cache of kinds of pictures; new ones are added.
        plain: whether vertex colors of an OBJ count where its materials have no pictures; it then needs no texture
            coordinates.

    Raises:
        InputError: faces without coordinates, or a picture cannot be read.
    """
    content = obj_content(file)
    if plain and content is not None and (coloured := _coloured(file, content.obj)) is not None:
        return coloured
    sheet = sheet_of(file)
    if content is None:
        maps = (
            {"map_kd": MaterialMap(file.picture, "colour", f"{file.path}: its texture")}
            if file.picture
            else {}
        )
        colours = _vertex_colours(file.content.ply, sheet) if isinstance(file.content, PlyContent) else None
        owner = np.zeros(len(sheet.faces), np.int64)
        return MaterialSet(sheet, (Material("", "", maps),), owner, "mtl", colours=colours)
    first = triangulate(file.mesh)[:, 0]
    face = np.searchsorted(file.mesh.starts, first, side="right") - 1
    use_at, uses = content.obj.current("usemtl")
    names = [use.text for use in uses] + [""]
    used = list(dict.fromkeys(names[k] for k in use_at[file.faces]))
    places = {name: place for place, name in enumerate(used)}
    number = np.array([places.get(name, -1) for name in names])
    library, kinds = content.library, {} if kinds is None else kinds
    notes = [*library.missing, *(f"{file.path}: {note}" for note in library.outside)]
    materials = [_material(file.path, library, name, sheet, notes, max_pixels, kinds) for name in used]
    return MaterialSet(sheet, tuple(materials), number[use_at[file.faces]][face], "mtl", tuple(notes))


def _coloured(file: MeshFile, obj: Obj) -> MaterialSet | None:
    """Return the material set of an OBJ that has vertex colors and no pictures; None for others."""
    stored = obj.vertex_colours
    if stored is None or any(file.content.textures(file.faces)):
        return None
    vertices = obj.corners[np.repeat(file.faces, np.diff(obj.starts)), 0]
    linear = colour.linear_from_srgb(stored[vertices[triangulate(file.mesh)]])
    mesh = file.mesh
    if mesh.uv is None or mesh.uv_corners is None:  # not used, since there are no pictures
        mesh = replace(mesh, uv=np.zeros((1, 2)), uv_corners=np.zeros(mesh.corners.size, np.int64))
    sheet = Charted.of(mesh)
    corners = np.concatenate([linear, np.ones((*linear.shape[:2], 1))], axis=2)
    return MaterialSet(
        sheet, (Material("", "", {}),), np.zeros(len(sheet.faces), np.int64), "mtl", colours=corners
    )


def _vertex_colours(ply: Ply, sheet: Charted) -> Real | None:
    """Return (m, 3, 4) linear vertex colors of a PLY at the triangles' corners, or None; the file stores sRGB."""
    stored = ply.vertex_colours
    if stored is None:
        return None
    linear = colour.linear_from_srgb(stored)
    return np.column_stack([linear, np.ones(len(linear))])[sheet.faces]


def sheet_of(file: MeshFile) -> Charted:
    """Return the triangles with their texture coordinates; errors as for `material_set`."""
    sheet = Charted.of(file.mesh)
    if (sheet.uv_faces < 0).any():
        raise InputError(f"{sheet.name}: some faces have no texture coordinates; unwrap all of them")
    return sheet


def _material(
    path: Path,
    library: material_library.Library,
    name: str,
    sheet: Charted,
    notes: list[str],
    most: int,
    kinds: Kinds,
) -> Material:
    lines = library.materials.get(name, [])
    maps = dict[str, MaterialMap]()
    for line in lines:
        word, arguments = material_library.split(line)
        word, picture_name = word.lower(), material_library.file_name(arguments)
        if not word.startswith(material_library.MAPS) or not picture_name or word in ELSEWHERE:
            continue
        picture = library.folder / picture_name.replace("\\", "/")
        if not picture.is_file() or is_pattern(picture):
            notes.append(
                f"{path}: {word} of {name} is ignored, because its file {picture_name} does not exist"
            )
            continue
        if (word, picture) not in kinds:
            kinds[word, picture] = _kind(word, picture, most)
        wrap = material_library.wrap(arguments)
        maps[word] = MaterialMap(
            picture, kinds[word, picture], str(picture), _place(sheet.uv, arguments), wrap
        )
    return Material(name, name, maps, lines, kind=f"d {cover(lines):g}")


def cover(lines: Iterable[str]) -> float:
    """Return a material's opacity, 0 … 1, from its statements `d` and `Tr`."""
    opacity = 1.0
    for word, values in material_library.numbers(lines).items():
        if word in ("d", "tr") and len(values) == 1:
            opacity = values[0] if word == "d" else 1 - values[0]
    return opacity


def _place(uv: Real, arguments: str) -> Real | None:
    """Return texture coordinates transformed by the options of a statement; None if it has no such options."""
    scale, offset = material_library.placing(arguments)
    return None if (scale, offset) == ((1, 1), (0, 0)) else uv * scale + offset


def _kind(word: str, picture: Path, most: int) -> str:
    if word in NORMALS or (word in BUMPS and _shows_normals(picture, most)):
        return "normal"
    return "colour" if word in COLOURS else "data"


def _shows_normals(picture: Path, most: int) -> bool:
    """Return whether a picture is a normal map, that is, blue all over."""
    image = image_files.read(picture, max_pixels=most)
    if image.pixels.shape[2] < 3 or image.pixels.dtype.kind == "f":
        return False
    red, green, blue = image.pixels[..., :3].mean(axis=(0, 1)) / np.iinfo(image.pixels.dtype).max
    return bool(
        blue > LEAST_MEAN_BLUE and abs(red - 0.5) < MOST_MEAN_LEAN and abs(green - 0.5) < MOST_MEAN_LEAN
    )
