"""The materials of OBJ files: materials of faces, their libraries, and names for new ones."""

import os
from collections.abc import Container
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...arrays import Flags
from ...pixels.texture import Wrap
from .. import files, formats, limits, references
from . import material_library, obj_write
from .material_library import Library
from .mesh_format import NewCoordinates, ShownPictures, Written
from .obj import Obj

NEW = "iccm"  # name of new materials
NORMALS = "norm"  # the statement that shows a normal map


def textures_of(whole: Obj, library: Library, faces: Flags) -> dict[Path, Wrap]:
    """Return the distinct colour textures of the materials of faces (f,), in face order, with their wrap modes."""
    use_at, uses = whole.current("usemtl")
    names = dict.fromkeys(uses[k].text for k in use_at[np.flatnonzero(faces)].tolist() if k >= 0)
    textures = dict[Path, Wrap]()
    for name in names:
        if texture := library.texture(name):
            textures.setdefault(*texture)
    return textures


def staying(whole: Obj, library: Library, faces: Flags, name: Path, but: Container[str]) -> list[str]:
    """Return a note on pictures that will be shown by new coordinates, but were made for the old ones."""
    use_at, uses = whole.current("usemtl")
    used = dict.fromkeys(uses[k].text for k in np.unique(use_at[faces]) if k >= 0)
    maps = dict.fromkeys(
        word for material in used for word in library.maps(material) if word.lower() not in but
    )
    listed = ", ".join(maps)
    return (
        [
            f"{name}: {listed} of its materials still belong to the old coordinates; use --carry-maps to transfer them"
        ]
        if listed
        else []
    )


def library_of(whole: Obj) -> Library:
    """Read the libraries that a file refers to."""
    names = [statement.text for statement in whole.statements if statement.keyword == "mtllib"]
    return material_library.read(whole.path.parent, names)


def rename(whole: Obj, faces: Flags) -> tuple[dict[str | None, str], str]:
    """Choose material names for the faces (f,) that change.

    A material keeps its name if no other face uses it. Returns new names by old ones, and a name for the other faces
    without a material, empty if there are none.
    """
    use_at, uses = whole.current("usemtl")
    names: list[str | None] = [s.text for s in uses] + [None]
    inside = dict.fromkeys(
        names[k] for k in np.unique(use_at[faces])
    )  # in the order in which they are written
    outside = {names[k] for k in np.unique(use_at[~faces])}
    used = {n for n in names if n}

    def fresh(name: str) -> str:
        while name in used:
            name += "_"
        used.add(name)
        return name

    renames = {m: fresh(f"{m}_{NEW}" if m else NEW) if not m or m in outside else m for m in inside}
    return renames, fresh(f"{NEW}_plain") if None in outside else ""


def companions(name: Path, pictures: ShownPictures) -> list[str]:
    """List the files that `write` creates beside an OBJ: its material library, and pictures that are not there yet."""
    shown = _shown(name, pictures)
    if not shown:
        return []
    written = [str(path) for path, picture in shown.values() if picture is not None]
    return [str(name.with_suffix(".mtl")), *written]


def _shown(name: Path, pictures: ShownPictures) -> dict[str, tuple[Path, Path | bytes | None]]:
    """Return the files of the texture and the normal map by statement, with the picture that is written there, if any.

    Pictures outside the mesh's folder are copied, since references to them would be refused when the mesh is read.
    """
    shown = dict[str, tuple[Path, Path | bytes | None]]()
    for word, stem, picture in (
        ("map_kd", "texture", pictures.texture),
        (NORMALS, "normal", pictures.normals),
    ):
        if isinstance(picture, bytes):
            suffix = ".jpg" if formats.suffix_of_content(picture) == ".jpg" else ".png"
            shown[word] = name.with_name(f"{name.stem}-{stem}{suffix}"), picture
        elif picture is not None:
            outside = not references.may_be_read(picture, name.parent)
            copy = name.with_name(f"{name.stem}-{stem}{picture.suffix.lower()}")
            shown[word] = (copy, picture) if outside else (picture, None)
    return shown


def _with_pictures_inside(library: Library, folder: Path) -> tuple[Library, dict[Path, bytes]]:
    """Return a library for a mesh in another folder, and the pictures to be written there because it refers to them.

    Pictures in or below the folder stay where they are, and so does a second picture of the same name.
    """
    lines, origins = list[str](), dict[Path, Path]()
    for line in library.lines:
        picture = material_library.picture_named(line)
        origin = library.folder / picture
        if picture and origin.is_file() and not references.may_be_read(origin, folder):
            copy = folder / origin.name
            if origins.setdefault(copy, origin) == origin:
                line = material_library.with_file(line, material_library.relative(copy, library.folder))
        lines.append(line)
    contents = {
        copy: files.read_bytes(origin, max_bytes=limits.MESH_BYTES) for copy, origin in origins.items()
    }
    return replace(library, lines=tuple(lines)), contents


def write(
    whole: Obj,
    materials: Library,
    faces: Flags,
    new: NewCoordinates,
    pictures: ShownPictures,
    out: Path,
    name: Path,
    *,
    force: bool,
) -> Written:
    """Write an OBJ with new texture coordinates for some faces (f,); other arguments as for `MeshFormat.write`."""
    by_material, shown = pictures.pictures, _shown(name, pictures)
    words = {word for material_pictures in by_material.values() for word in material_pictures} | set(shown)
    notes = [] if new.kept else staying(whole, materials, faces, name, words)
    is_moved = bool(materials.lines) and os.path.realpath(materials.folder) != os.path.realpath(name.parent)
    if not words and not is_moved:
        out.write_bytes(obj_write.retexture(whole, faces, new.uv, new.corners))
        return Written(notes=notes)
    library = name.with_suffix(".mtl")
    bound = {word: path for word, (path, _) in shown.items()}
    materials, contents = _with_pictures_inside(materials, name.parent)
    contents |= {
        path: picture
        if isinstance(picture, bytes)
        else files.read_bytes(picture, max_bytes=limits.MESH_BYTES)
        for path, picture in shown.values()
        if picture is not None
    }
    renames, plain = rename(whole, faces) if words else ({}, "")
    pictures_of_material = dict[str | None, dict[str, str]]()
    for material in renames:
        material_pictures, several = by_material.get(material or "", {}), len(by_material) > 1
        paths = {
            word: material_library.picture_of(name, (material or "") if several else None, word)
            for word in material_pictures
        }
        contents |= {paths[word]: material_pictures[word] for word in material_pictures}
        pictures_of_material[material] = {
            word: material_library.name_of(path, library.parent) for word, path in (bound | paths).items()
        }
    text = material_library.bind(
        materials, renames, plain, pictures_of_material, library, untinted="map_kd" in shown
    )
    binding = obj_write.Binding(library.name, renames, plain)
    if new.kept:
        out.write_bytes(obj_write.rebind(whole, faces, binding))
    else:
        out.write_bytes(obj_write.retexture(whole, faces, new.uv, new.corners, binding))
    contents = {library: text.encode("utf-8", "surrogateescape")} | contents
    for path, data in contents.items():
        files.write_bytes(path, data, force=force)
    return Written([str(path) for path in contents], [*materials.missing, *notes])
