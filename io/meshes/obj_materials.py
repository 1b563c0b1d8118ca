"""The materials of OBJ files: which of them faces have, the libraries they stand in, names for new ones."""

from collections.abc import Container, Mapping
from pathlib import Path

import numpy as np

from ...arrays import Flags, Index, Real
from ...pixels.texture import Wrap
from .. import files, formats
from . import material_library, obj_write
from .obj import Obj

NEW = "iccm"  # a material of ours
NORMALS = "norm"  # the statement that shows a normal map
Pictures = Mapping[str, Mapping[str, bytes]]
"""Picture files by material and slot: its name and MTL's statements in lower case, or its number and glTF's slots."""


def textures_of(whole: Obj, faces: Flags) -> dict[Path, Wrap]:
    """The different picture files that the materials of an OBJ's faces name, in the order of the faces, and what lies
    beyond each."""
    which, uses = whole.current("usemtl")
    library = library_of(whole)
    used = dict.fromkeys(which[np.flatnonzero(faces)].tolist())
    found = dict[Path, Wrap]()
    for k in used:
        if k >= 0 and (shown := library.texture(uses[k].text)):
            found.setdefault(*shown)
    return found


def staying(whole: Obj, faces: Flags, name: Path, but: Container[str]) -> list[str]:
    """A note on the pictures of materials that are shown by new coordinates, but were made for the old ones."""
    which, uses = whole.current("usemtl")
    library = library_of(whole)
    used = [uses[k].text for k in np.unique(which[faces]) if k >= 0]
    maps = dict.fromkeys(
        word for material in used for word in library.maps(material) if word.lower() not in but
    )
    said = ", ".join(maps)
    return (
        [f"{name}: {said} of its materials are for the old coordinates; --carry-maps carries them over"]
        if said
        else []
    )


def library_of(whole: Obj) -> material_library.Library:
    """The libraries that a file names."""
    names = [said.text for said in whole.statements if said.keyword == "mtllib"]
    return material_library.read(whole.path.parent, names)


def rename(whole: Obj, faces: Flags) -> tuple[dict[str | None, str], str]:
    """New material names of the faces that change: their own where no other face uses it. And one for faces without."""
    which, uses = whole.current("usemtl")
    names: list[str | None] = [s.text for s in uses] + [None]
    inside = {names[k] for k in np.unique(which[faces])}
    outside = {names[k] for k in np.unique(which[~faces])}
    taken = {n for n in names if n}

    def fresh(name: str) -> str:
        while name in taken:
            name += "_"
        taken.add(name)
        return name

    renames = {m: fresh(f"{m}_{NEW}" if m else NEW) if not m or m in outside else m for m in inside}
    return renames, fresh(f"{NEW}_plain") if None in outside else ""


def written_beside(name: Path, texture: Path | bytes | None, normals: Path | None = None) -> list[str]:
    """The files that `write` puts beside an output: an OBJ's material library, and a picture that is no file yet."""
    if (texture is None and normals is None) or name.suffix.lower() != ".obj":
        return []
    library = str(name.with_suffix(".mtl"))
    if not isinstance(texture, bytes):
        return [library]
    suffix = ".jpg" if formats.suffix_of_content(texture) == ".jpg" else ".png"
    return [library, str(name.with_name(f"{name.stem}-texture{suffix}"))]


def write(
    whole: Obj,
    faces: Flags,
    uv: Real,
    uv_corners: Index,
    out: Path,
    name: Path,
    texture: Path | bytes | None,
    normals: Path | None,
    pictures: Pictures,
    *,
    force: bool,
) -> tuple[list[str], list[str]]:
    """Write an OBJ with new texture coordinates; arguments as for `mesh_files.write`, whose answer this is."""
    words = {word for made in pictures.values() for word in made} | ({"map_kd"} if texture else set())
    words |= {NORMALS} if normals else set()
    notes = staying(whole, faces, name, words)
    if not words:
        out.write_bytes(obj_write.retexture(whole, faces, uv, uv_corners))
        return [], notes
    library, contents = name.with_suffix(".mtl"), dict[Path, bytes]()
    own = dict[str, Path]()
    if texture is not None:
        own["map_kd"] = texture if isinstance(texture, Path) else Path(written_beside(name, texture)[1])
        contents |= {own["map_kd"]: texture} if isinstance(texture, bytes) else {}
    own |= {NORMALS: normals} if normals is not None else {}
    renames, plain = rename(whole, faces)
    shown = dict[str | None, dict[str, str]]()
    for material in renames:
        made, several = pictures.get(material or "", {}), len(pictures) > 1
        paths = {
            word: material_library.picture_of(name, (material or "") if several else None, word)
            for word in made
        }
        contents |= {paths[word]: made[word] for word in made}
        shown[material] = {
            word: material_library.name_of(path, library.parent) for word, path in (own | paths).items()
        }
    materials = library_of(whole)
    text = material_library.bind(materials, renames, plain, shown, library)
    binding = obj_write.Binding(library.name, renames, plain)
    out.write_bytes(obj_write.retexture(whole, faces, uv, uv_corners, binding))
    contents = {library: text.encode("utf-8", "surrogateescape")} | contents
    for path, data in contents.items():
        files.write_bytes(path, data, force=force)
    return [str(path) for path in contents], [*materials.missing, *notes]
