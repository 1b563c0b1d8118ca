"""Meshes from files of every format, and back with new texture coordinates.

OBJ (`obj`, `obj_write`, `material_library`), glTF (`gltf`, `gltf_write`, `gltf_materials`) and PLY (`ply`, `ply_write`)
are kept as they are but for what changes; OFF and STL, which hold no coordinates, are read by trimesh.
"""

import logging
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...errors import InputError
from ...meshes.mesh import Mesh, face_areas, merge
from ...pixels.texture import REPEAT, Wrap
from ...surfaces.subdivided import Subdivision
from .. import files, formats, limits, references
from ..spec import Spec
from . import (
    gltf,
    gltf_materials,
    gltf_write,
    material_library,
    obj,
    obj_materials,
    obj_write,
    odd_forms,
    ply,
    ply_write,
    splitting,
)
from .gltf import Primitive
from .obj import Obj
from .obj_materials import Pictures
from .ply import Ply

VIEW = re.compile(r"(?:piece[ -]?(?P<piece>\d{1,9})|uv(?:[ -]?(?P<chart>\d{1,9}))?)")


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh as a file holds it.

    Attributes:
        path: the file.
        mesh: its polygons, or those of the part picked.
        faces: (f,) which faces of the whole file that part is.
        obj: the file itself when it is an OBJ.
        primitives: what of the file it is when that is a GLB or glTF; `faces` are theirs, one after the other.
        ply: the file itself when it is a PLY.
        picture: the texture inside the file, as the PNG or JPEG file that it is there, when it has one.
        loop: number of the boundary loop picked, 1 being the longest.
        piece: number of the piece picked among those that no edge connects, 1 being the largest; 0: none was named.
        chart: number of the chart picked in its own texture coordinates, 1 being the largest; 0: none was named.
        part: the part picked, without piece, chart and loop.
        numbered: whether a piece, a chart or a loop was named by its number.
        total: faces of all that the file holds, 0 where these are all that `faces` are of.
        names: of the parts that `#` picks.
        notes: what was left out.
    """

    path: Path
    mesh: Mesh
    faces: NDArray[np.bool_]
    obj: Obj | None = None
    primitives: tuple[Primitive, ...] = ()
    ply: Ply | None = None
    picture: bytes | None = None
    loop: int = 1
    piece: int = 0
    chart: int = 0
    part: str | None = None
    numbered: bool = False
    total: int = 0
    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def called(self, name: str) -> NDArray[np.bool_]:
        """(f,) whether each face of the mesh belongs to the object, group or material of an OBJ, or to the geometry or
        material of a GLB, that is called so.

        Raises:
            InputError: nothing is called so, or the file is of another format.
        """
        if self.obj is not None:
            return self.obj.faces_of(name)[self.faces]
        if not self.primitives:
            raise InputError(
                f"names a part of an OBJ or a material of a GLB, and {self.path} is neither; give a mask"
            )
        names = [
            {called, part.material.get("name", called)}
            for called, part in gltf.primitives(self.primitives[0].document).items()
            if (part.mesh, part.number) in {(own.mesh, own.number) for own in self.primitives}
        ]
        if not any(name in each for each in names):
            there = ", ".join(f"'{each}'" for each in sorted(set().union(*names)))
            raise InputError(f"no geometry or material of the mesh is called '{name}'; there is {there}")
        counts = [len(part.faces) for part in self.primitives]
        return np.repeat([name in each for each in names], counts)[self.faces]


def read(text: str, whole: Obj | None = None, *, united: bool = False) -> MeshFile:
    """The mesh that `file`, `file#part`, `file#loop` or `file#part#loop` names.

    A part is an OBJ object, group or material, a GLB geometry, `piece-2`, the second largest of the pieces that
    nothing connects, or `uv-2`, the second largest chart of the texture coordinates (`uv`: the largest); a loop is a
    number, 1 for the longest boundary.
    `whole` is the content of the file, if it is an OBJ that was read. Of a GLB it is one primitive, or, `united`, all
    of the glTF mesh that it is of, as that has one for each material.

    Raises:
        InputError: the file cannot be read, or has no such part.
    """
    found, picked = _open(text, whole)
    return _united(found, picked) if united and found.primitives else found


def _united(found: MeshFile, picked: Callable[[str | None, int], MeshFile]) -> MeshFile:
    """All primitives of the glTF mesh that a part of a GLB is of."""
    (own,) = found.primitives
    known = gltf.primitives(own.document).items()
    parts = [picked(name, 1) for name, part in known if part.mesh == own.mesh]
    if len(parts) < 2:
        return found
    mesh = merge([part.mesh for part in parts], found.mesh.name)
    notes = [*parts[0].notes[:-1]]
    if left := len(known) - len(parts):
        notes.append(f"left out {left} geometr{'ies' if left > 1 else 'y'} of other meshes")
    if len({part.picture for part in parts}) > 1:
        notes.append(
            "its materials show different pictures, of which one counts; --texture names one for all"
        )
    return replace(
        found,
        mesh=mesh,
        faces=np.ones(mesh.sizes.size, bool),
        primitives=tuple(primitive for part in parts for primitive in part.primitives),
        picture=next((part.picture for part in parts if part.picture), None),
        notes=tuple(notes),
    )


def read_all(text: str, whole: Obj | None = None) -> list[MeshFile]:
    """As `read`; but of a file of several geometries of which none is named each, as parts of one mesh.

    Raises:
        InputError: as `read`.
    """
    found, picked = _open(text, whole)
    if found.obj or found.part or found.numbered or len(found.names) < 2:
        return [found]
    parts = [picked(name, 1) for name in found.names]
    mesh = merge([part.mesh for part in parts], str(found.path))
    owner = np.repeat(np.arange(len(parts)), [part.mesh.sizes.size for part in parts])
    primitives = tuple(primitive for part in parts for primitive in part.primitives)
    return [
        replace(
            found,
            mesh=mesh.part(owner == k, f"{found.path}#{name}"),
            faces=owner == k,
            primitives=primitives,
            picture=part.picture,
            part=name,
            notes=(),
        )
        for k, (name, part) in enumerate(zip(found.names, parts))
    ]


def _open(text: str, whole: Obj | None) -> tuple[MeshFile, Callable[[str | None, int], MeshFile]]:
    """What `read` finds, and what picks another part of the file."""
    spec = Spec.of(text)
    path, suffix = spec.path, formats.suffix_of(spec.path)
    if not formats.of(path).mesh:
        known = ", ".join(formats.holding("mesh"))
        raise InputError(f"{path}: no mesh is read from {suffix!r}; use one of {known}")
    picked, names = _of_obj(whole or obj.read(path)) if suffix == ".obj" else _read_other(path)
    spec = spec.among(names)
    rest, _, last = (spec.part or "").rpartition("#")
    view = None if spec.part in names else VIEW.fullmatch(last)
    part = spec.part if view is None else rest or None
    found = picked(part, 1 if spec.number is None else spec.number)
    piece, chart = _view(view)
    numbered = spec.number is not None or bool(view and view.lastgroup)
    found = replace(found, piece=piece, chart=chart, part=part, numbered=numbered, names=tuple(names))
    return found, picked


def _view(view: re.Match | None) -> tuple[int, int]:
    """Numbers of the piece and of the chart that `piece-2`, `uv` or `uv-2` names, 0 where it names none."""
    if view is None:
        return 0, 0
    return (int(view["piece"]), 0) if view["piece"] else (0, int(view["chart"] or 1))


def names_layout(text: str) -> bool:
    """Whether a spec names a chart by its form, whatever the file's parts are called."""
    part = Spec.of(text).part
    found = VIEW.fullmatch((part or "").rpartition("#")[2])
    return found is not None and found["piece"] is None


Reader = tuple[Callable[[str | None, int], MeshFile], list[str]]


def _of_obj(whole: Obj) -> Reader:
    def picked(part: str | None, loop: int) -> MeshFile:
        faces = whole.faces_of(part) if part else np.ones(len(whole.face_at), bool)
        return MeshFile(
            whole.path,
            whole.mesh(part),
            faces,
            whole,
            loop=loop,
            notes=obj_materials.library_of(whole).outside,
        )

    return picked, whole.parts()


def _read_other(path: Path) -> Reader:
    files.open_input(path, max_bytes=limits.MESH_BYTES)
    kind = {".glb": _of_gltf, ".gltf": _of_gltf, ".ply": _of_ply}.get(formats.suffix_of(path), _of_scene)
    try:
        with np.errstate(all="ignore"):  # what numbers of a broken file come to is told by what checks them
            pieces = kind(path)
    except InputError:
        raise
    except Exception as error:  # whatever a parser stumbles over: the file is at fault
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: is no readable {path.suffix[1:].upper()} file: {reason}") from error

    total = sum(piece.faces.size for piece in pieces.values())
    areas = {name: _area(piece.mesh) for name, piece in pieces.items()} if len(pieces) > 1 else {}

    def picked(part: str | None, loop: int) -> MeshFile:
        if part is not None and part not in pieces:
            raise InputError(
                f"{path}#{part}: no geometry is called '{part}'; there is {', '.join(pieces) or 'none'}"
            )
        chosen = part or (max(pieces, key=areas.__getitem__) if len(pieces) > 1 else next(iter(pieces), None))
        if chosen is None:
            raise InputError(f"{path}: no faces; a point cloud has no surface to map")
        found = pieces[chosen]
        mesh = replace(found.mesh, name=str(path) + (f"#{part}" if part else ""))
        left = len(pieces) - 1
        others = f"left out {left} other geometr{'ies' if left > 1 else 'y'}"
        cure = f": {chosen!r} is the largest; {path}#name picks one, --parts all or each takes all of them"
        notes = (others + ("" if part else cure),) if left else ()
        return replace(found, mesh=mesh, loop=loop, notes=(*found.notes, *notes), total=total)

    return picked, list(pieces)


def _area(mesh: Mesh) -> float:
    """Of its sound triangles."""
    corners = mesh.corners[mesh.starts[:-1][mesh.sizes == 3, None] + np.arange(3)]
    corners = corners[((corners >= 0) & (corners < len(mesh.points))).all(axis=1)]
    return float(np.nan_to_num(face_areas(mesh.points[corners])).sum())


def _of_gltf(path: Path) -> dict[str, MeshFile]:
    document = gltf.read(path)
    return {name: _of_primitive(part) for name, part in gltf.primitives(document).items()}


def _of_primitive(part: Primitive) -> MeshFile:
    mesh = part.triangles()
    return MeshFile(
        part.document.path, mesh, np.ones(mesh.sizes.size, bool), primitives=(part,), picture=part.picture
    )


def _of_ply(path: Path) -> dict[str, MeshFile]:
    whole = ply.read(path)
    texture, picture, notes = whole.texture, None, tuple[str, ...]()
    if texture is not None and not references.may_be_read(texture, path.parent):
        notes = (f"names {material_library.relative(texture, path.parent)}, {references.OUTSIDE}",)
    elif texture is not None:
        picture = files.read_bytes(texture, max_bytes=limits.MESH_BYTES)
    mesh, every = whole.mesh, np.ones(whole.mesh.sizes.size, bool)
    return (
        {path.name: MeshFile(path, mesh, every, ply=whole, picture=picture, notes=notes)}
        if every.size
        else {}
    )


def _of_scene(path: Path) -> dict[str, MeshFile]:
    """What trimesh reads, and the faces that it leaves out."""
    import trimesh

    data, suffix = files.read_bytes(path, max_bytes=limits.MESH_BYTES), formats.suffix_of(path)
    odd = odd_forms.free_off if suffix == ".off" else None
    if suffix == ".off" and odd_forms.is_binary_off(data):
        return {path.name: _whole(path, *odd_forms.binary_off(data))}
    if suffix == ".off" or not odd_forms.is_binary_stl(data):  # trimesh would need a further package to guess
        data = data.decode("utf-8", "replace").encode()
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    try:
        with warnings.catch_warnings():
            # what numbers of a broken file come to is told by what checks them
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(BytesIO(data), file_type=suffix[1:], process=False)
    except Exception:
        if odd is None or (found := odd(data.decode())) is None:
            raise
        return {path.name: _whole(path, *found)}
    pieces = dict[str, MeshFile]()
    for given, piece in scene.geometry.items():
        name = path.name if given == "geometry_0" else given
        if isinstance(piece, trimesh.Trimesh) and len(piece.faces):
            mesh = Mesh.triangles(str(path), piece.vertices, piece.faces)
            pieces[name] = MeshFile(path, mesh, np.ones(len(piece.faces), bool))
        elif odd is not None and (found := odd(data.decode())) is not None:
            pieces[name] = _whole(path, *found)
    return pieces


def _whole(path: Path, points: Real, corners: Index, starts: Index) -> MeshFile:
    return MeshFile(path, Mesh(str(path), points, corners, starts), np.ones(len(starts) - 1, bool))


def held(file: MeshFile) -> Mesh:
    """All polygons that `faces` of a file are among; of what is kept as no file, those of the part."""
    if file.obj:
        return file.obj.mesh()
    if file.primitives:
        return merge([part.triangles() for part in file.primitives], str(file.path))
    return file.ply.mesh if file.ply else file.mesh


def marked(file: MeshFile, united: MeshFile) -> NDArray[np.bool_]:
    """(f,) which of the polygons `held` of several parts are those of one of them."""
    kept = bool(file.obj or file.primitives or file.ply)
    return file.faces if kept else file.faces[united.faces]


def subdivided(file: MeshFile, plan: Subdivision) -> MeshFile:
    """All of a file with triangles in the place of some of the polygons that it `held`.

    What corners and vertices have is interpolated: positions, normals, colours, coordinates, joints.
    """
    if file.obj:
        file = replace(file, obj=obj.parse(obj_write.subdivided(file.obj, plan), file.path))
    elif file.primitives:
        file = replace(file, primitives=gltf_write.subdivided(file.primitives, plan))
    elif file.ply:
        file = replace(file, ply=ply_write.subdivided(file.ply, plan))
    else:
        file = replace(file, mesh=splitting.subdivided(file.mesh, plan))
    mesh = held(file)
    return replace(file, mesh=mesh, faces=np.ones(mesh.sizes.size, bool))


def part_of(whole: MeshFile, faces: NDArray[np.bool_], before: MeshFile) -> MeshFile:
    """The part of a file whose polygons are marked in (f,), in all else as one `before` it was changed."""
    name = before.mesh.name
    mesh = whole.obj.mesh_of(faces, name) if whole.obj else whole.mesh.part(faces, name)
    return replace(before, mesh=mesh, faces=faces, obj=whole.obj, primitives=whole.primitives, ply=whole.ply)


def textures_of(file: MeshFile) -> list[Path]:
    """The different picture files that the materials of an OBJ's faces name, in the order of the faces."""
    return [] if file.obj is None else list(obj_materials.textures_of(file.obj, file.faces))


def wrap_of(file: MeshFile) -> Wrap:
    """What lies beyond the first picture that a mesh shows."""
    if file.obj is not None:
        return next(iter(obj_materials.textures_of(file.obj, file.faces).values()), REPEAT)
    return file.primitives[0].wrap if file.primitives else REPEAT


def check_texture(name: Path, texture: Path | bytes | None) -> None:
    """Refuse a texture that the mesh to be written cannot show.

    Args:
        name: of the mesh.
        texture: the picture, or its content; None is never refused.

    Raises:
        InputError: GLB cannot hold the picture, or a material library cannot name its file.
    """
    suffix = name.suffix.lower()
    if suffix == ".glb" and texture is not None:
        _embeddable(texture)
    elif suffix == ".obj" and isinstance(texture, Path):
        material_library.name_of(texture, name.parent)


def write(
    file: MeshFile,
    uv: Real,
    uv_corners: Index,
    triangles: Index,
    out: Path,
    *,
    name: Path,
    texture: Path | bytes | None = None,
    normals: Path | None = None,
    pictures: Pictures | None = None,
    force: bool = False,
) -> tuple[list[str], list[str]]:
    """Write the mesh with new texture coordinates.

    Args:
        file: as read; from OBJ to OBJ everything else stays as it is.
        uv: (t, 2) coordinates, v up.
        uv_corners: (c,) coordinate of each corner of file.mesh.
        triangles: (m, 3) corners of its triangles, for formats of triangles.
        out: where to write now, a temporary file beside `name`.
        name: what it will be called.
        texture: the picture to show, or its content; None to leave materials alone.
        normals: a normal map to show, y up; not in PLY.
        pictures: further ones for the new coordinates, PNG or JPEG files by material and slot.
        force: whether what is `written_beside` it may be replaced.

    Returns:
        The other files written, and notes on what could not be kept.
    """
    formats.check(name, "uv", "cannot hold texture coordinates")
    if name.suffix.lower() != ".obj":
        if name.suffix.lower() == ".ply":
            made, said = _ply(file, uv, uv_corners, name, texture)
        else:
            given = {gltf_materials.BASE: texture, gltf_materials.NORMALS: normals}
            held = {slot: _embeddable(picture) for slot, picture in given.items() if picture is not None}
            keys = {part.key for part in file.primitives} or {""}
            every = {key: held | dict((pictures or {}).get(key, {})) for key in keys}
            made, said = _glb(file, uv, uv_corners, triangles, every)
        out.write_bytes(made)
        return [], [f"{name}: {remark}" for remark in said]
    whole = file.obj or obj.parse(_as_obj(file.mesh), name)
    faces = file.faces if file.obj else np.ones(len(whole.face_at), bool)
    shown = _embeddable(texture) if isinstance(texture, bytes) else texture
    return obj_materials.write(
        whole, faces, uv, uv_corners, out, name, shown, normals, pictures or {}, force=force
    )


def as_written(uv: Real, name: str | Path) -> Real:
    """Texture coordinates as the file of this name holds them, rounded as its format rounds."""
    suffix = formats.suffix_of(Path(name))
    if suffix == ".obj":
        return np.array(obj_write.vt_text(uv, "\n").replace("vt", "").split(), float).reshape(-1, 2)
    single = np.column_stack([uv[:, 0], 1 - uv[:, 1] if suffix == ".glb" else uv[:, 1]]).astype(np.float32)
    return np.column_stack(
        [single[:, 0], 1.0 - single[:, 1].astype(float) if suffix == ".glb" else single[:, 1]]
    )


def _as_obj(mesh: Mesh) -> bytes:
    """An OBJ file of a mesh from another format."""
    points = ("v %.10g %.10g %.10g\n" * len(mesh.points)) % tuple(mesh.points.ravel().tolist())
    lines = {int(size): "f" + " %d" * size + "\n" for size in np.unique(mesh.sizes)}
    faces = "".join([lines[size] for size in mesh.sizes.tolist()]) % tuple((mesh.corners + 1).tolist())
    return (points + faces).encode()


def _glb(
    file: MeshFile, uv: Real, uv_corners: Index, triangles: Index, pictures: Pictures
) -> tuple[bytes, list[str]]:
    if file.primitives:
        return gltf_write.with_coordinates(file.primitives, file.faces, uv, uv_corners, pictures)
    mesh = file.mesh
    stated = mesh.normals is not None and mesh.normal_corners is not None
    normals = (mesh.normals, mesh.normal_corners[triangles]) if stated else None  # type: ignore[index]
    whole = gltf_write.plain(file.path.stem, (mesh.points, mesh.corners[triangles]), normals)  # type: ignore[arg-type]
    part = Primitive(whole, 0, 0)
    every = np.ones(len(triangles), bool)
    return gltf_write.with_coordinates([part], every, uv, uv_corners[triangles].ravel(), pictures)


def _ply(
    file: MeshFile, uv: Real, uv_corners: Index, name: Path, texture: Path | bytes | None
) -> tuple[bytes, list[str]]:
    whole = file.ply or ply_write.plain(file.mesh, name)
    faces = file.faces if file.ply else np.ones(file.mesh.sizes.size, bool)
    shown = material_library.relative(texture, name.parent) if isinstance(texture, Path) else None
    found, notes = ply_write.with_coordinates(whole, faces, uv, uv_corners, shown)
    if isinstance(texture, bytes):
        notes.append("PLY holds no texture; its coordinates are for the one given")
    elif texture is None and whole.texture is not None:
        notes.append(f"{whole.texture.name}, which it names, is for the old coordinates")
    return found, notes


def _embeddable(texture: Path | bytes) -> bytes:
    """The content of a PNG or JPEG file, or another picture as PNG.

    Raises:
        InputError: it cannot be read.
    """
    content = texture if isinstance(texture, bytes) else files.open_input(texture).read_bytes()
    if formats.suffix_of_content(content) in (".png", ".jpg"):
        return content
    from ..pictures import image_files

    where = "a picture" if isinstance(texture, bytes) else str(texture)
    image = image_files.read_held(texture, where, max_pixels=limits.PIXELS)
    if image.pixels.dtype.kind == "f":
        raise InputError(f"{where}: holds floats, which a GLB file does not; use a PNG or JPEG texture")
    return image_files.as_png(image)
