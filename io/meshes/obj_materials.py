"""The materials of OBJ files: which of them faces have, the libraries they stand in, names for new ones."""

from pathlib import Path

import numpy as np

from ...arrays import Flags
from . import material_library
from .obj import Obj

NEW = "iccm"  # a material of ours


def textures_of(whole: Obj, faces: Flags) -> list[Path]:
    """The different picture files that the materials of an OBJ's faces name, in the order of the faces."""
    which, uses = whole.current("usemtl")
    library = library_of(whole)[0]
    used = dict.fromkeys(which[np.flatnonzero(faces)].tolist())
    found = (library.texture(uses[k].text) for k in used if k >= 0)
    return list(dict.fromkeys(picture for picture in found if picture is not None))


def staying(whole: Obj, faces: Flags, name: Path, but: tuple[str, ...]) -> list[str]:
    """A note on the pictures of materials that are shown by new coordinates, but were made for the old ones."""
    which, uses = whole.current("usemtl")
    library = library_of(whole)[0]
    used = [uses[k].text for k in np.unique(which[faces]) if k >= 0]
    maps = dict.fromkeys(
        word for material in used for word in library.maps(material) if word.lower() not in but
    )
    said = ", ".join(maps)
    return (
        [f"{name}: {said} of its materials are for the old coordinates; iccm relayout carries them"]
        if said
        else []
    )


def library_of(whole: Obj) -> tuple[material_library.Library, list[str]]:
    """The libraries that a file names, in one, and notes on those that are missing."""
    return material_library.read(
        whole.path.parent, [s.text for s in whole.statements if s.keyword == "mtllib"]
    )


def renamed(whole: Obj, faces: Flags) -> tuple[dict[str | None, str], str]:
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

    rename = {
        m: fresh(NEW if m is None else f"{m}_{NEW}") if m is None or m in outside else m for m in inside
    }
    return rename, fresh(f"{NEW}_plain") if None in outside else ""
