"""Read meshes from files of any format, and write them with new texture coordinates.

Each format is a class (`mesh_format.MeshFormat`), found by suffix in the table of `io.formats`. This module has the
parts that are common to all formats.
"""

import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from ...arrays import Real
from ...errors import InputError
from .. import files, formats
from ..spec import Spec
from .mesh_format import MeshFile, MeshFormat, NewCoordinates, ShownPictures, Written

VIEW = re.compile(r"(?:piece[ -]?(?P<piece>\d{1,9})|uv(?:[ -]?(?P<chart>\d{1,9}))?)")


def format_of(name: str | Path) -> type[MeshFormat]:
    """Return the class of a mesh format by the suffix of a file.

    Raises:
        InputError: no mesh format has this suffix.
    """
    if not (place := formats.of(name).mesh):
        cure = formats.remedy(name, "mesh", formats.holding("mesh"))
        raise InputError(f"{name}: cannot read a mesh from {formats.suffix_of(name)!r}; {cure}")
    return class_at(place)


def class_at(place: str) -> type[MeshFormat]:
    """Return the class that the table of formats names."""
    if ":" in place:  # an extension
        module, _, kind = place.partition(":")
        return getattr(import_module(module), kind)
    module, _, kind = place.partition(".")
    return getattr(import_module(f".{module}", __package__), kind)


def demand_normal_maps(name: str) -> None:
    """Raise an error unless the format of a mesh's name can contain a normal map.

    Raises:
        InputError: it cannot.
    """
    if not format_of(name).shows_normals:
        suffix, able = formats.suffix_of(name), " or ".join(suffixes_with_materials())
        raise InputError(f"{name}: {suffix[1:].upper()} cannot contain a normal map; use {able}")


def suffixes_with_materials(dialect: str = "") -> list[str]:
    """List the suffixes of formats that store materials, or only those of one dialect."""
    dialects = {suffix: format_of(f"mesh{suffix}").dialect for suffix in formats.holding("uv")}
    return [
        suffix
        for suffix, material_dialect in dialects.items()
        if material_dialect and material_dialect == (dialect or material_dialect)
    ]


def open_mesh(path: Path, max_faces: int = -1) -> MeshFormat:
    """Return a mesh file for queries, without reading it; meshes of more than `max_faces` will not be read.

    Raises:
        InputError: no mesh format has this suffix. Whether the file exists is not checked.
    """
    return format_of(path)(path, max_faces)


def check_size(path: Path, max_faces: int) -> None:
    """Refuse a mesh with too many faces; for other files only check that they can be opened.

    Raises:
        InputError: it has more than `max_faces`, or cannot be opened.
    """
    if formats.of(path).mesh:
        open_mesh(path).check_size(max_faces)
    else:
        files.open_input(path)


def read(text: str, opened: MeshFormat | None = None, *, united: bool = False) -> MeshFile:
    """Read the mesh that `file`, `file#part`, `file#loop` or `file#part#loop` specifies.

    A part is an OBJ object, group or material; a GLB geometry; `piece-2`, the second largest connected component; or
    `uv-2`, the second largest chart of the texture coordinates (`uv`: the largest). A loop is a number, 1 for the
    longest boundary. For a GLB, one primitive is read; if `united`, all primitives of its glTF mesh, which has one for
    each material.

    Args:
        text: the file and part.
        opened: the file, if it was opened before.
        united: whether to read all geometries of the mesh.

    Raises:
        InputError: the file cannot be read, or has no such part.
    """
    opened = opened or open_mesh(Spec.of(text).path)
    file = _pick(text, opened)
    return _unite(file, opened) if united else file


def _unite(file: MeshFile, opened: MeshFormat) -> MeshFile:
    """Return all geometries of the mesh to which one of them belongs."""
    names = opened.same_mesh(file)
    if len(names) < 2:
        return file
    parts = [opened.pick(name) for name in names]
    content = type(file.content).join([part.content for part in parts], str(file.path))
    whole = MeshFile.whole(file.path, content)
    notes = [*parts[0].notes[:-1]]  # without the note on other geometries
    if ignored := len(opened.names) - len(parts):
        notes.append(f"ignored {ignored} geometr{'ies' if ignored > 1 else 'y'} of other meshes")
    if len({part.picture for part in parts}) > 1:
        notes.append("its materials have different textures; choose one with --texture")
    return replace(
        file,
        mesh=replace(whole.mesh, name=file.mesh.name),
        faces=whole.faces,
        content=content,
        picture=next((part.picture for part in parts if part.picture), None),
        notes=tuple(notes),
    )


def read_all(text: str, opened: MeshFormat | None = None) -> list[MeshFile]:
    """Read as `read` does, but if a file has several geometries and none is named, return each as a part of one mesh.

    Raises:
        InputError: as `read`.
    """
    opened = opened or open_mesh(Spec.of(text).path)
    file = _pick(text, opened)
    if file.part or file.numbered or not opened.geometries:
        return [file]
    names = opened.geometries
    parts = [opened.pick(name) for name in names]
    content = type(file.content).join([part.content for part in parts], str(file.path))
    owner = np.repeat(np.arange(len(parts)), [part.mesh.sizes.size for part in parts])
    return [
        replace(
            file,
            mesh=content.polygons.part(owner == k, f"{file.path}#{name}"),
            faces=owner == k,
            content=content,
            picture=part.picture,
            part=name,
            notes=(),
        )
        for k, (name, part) in enumerate(zip(names, parts))
    ]


def _pick(text: str, opened: MeshFormat) -> MeshFile:
    """Return the part of an opened file that a specification names."""
    names = opened.names
    spec = Spec.of(text).among(names)
    before_view, _, last = (spec.part or "").rpartition("#")
    view = None if spec.part in names else VIEW.fullmatch(last)
    part = spec.part if view is None else before_view or None
    piece, chart = _view(view)
    return replace(
        opened.pick(part),
        loop=1 if spec.number is None else spec.number,
        piece=piece,
        chart=chart,
        part=part,
        numbered=spec.number is not None or bool(view and view.lastgroup),
        names=tuple(names),
    )


def _view(view: re.Match | None) -> tuple[int, int]:
    """Return the numbers of the piece and chart that `piece-2`, `uv` or `uv-2` names; 0 for none."""
    if view is None:
        return 0, 0
    return (int(view["piece"]), 0) if view["piece"] else (0, int(view["chart"] or 1))


def names_layout(text: str) -> bool:
    """Return whether a specification has the form of a chart's name, whatever the file's parts are called."""
    part = Spec.of(text).part
    view = VIEW.fullmatch((part or "").rpartition("#")[2])
    return view is not None and view["piece"] is None


def write(
    file: MeshFile,
    new: NewCoordinates,
    pictures: ShownPictures,
    out: Path,
    name: Path,
    *,
    force: bool = False,
) -> Written:
    """Write a mesh with new texture coordinates in the format of its name; see `MeshFormat.write`.

    Raises:
        InputError: the format has no texture coordinates, or cannot store the mesh or a picture.
    """
    formats.check(name, "uv", formats.why_no_coordinates(name))
    return format_of(name).write(file, new, pictures, out, name, force=force)


def as_written(uv: Real, name: str | Path) -> Real:
    """Return texture coordinates (t, 2) rounded as in a file of this name."""
    return format_of(name).round_uv(uv)
