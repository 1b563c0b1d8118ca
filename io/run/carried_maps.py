"""The other maps of a glTF material, carried from the coordinates that they have to new ones (--carry-maps)."""

from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Index, Real
from ...errors import InputError
from ...meshes.charted import Charted
from ...meshes.relayout import Origin, carry
from ...pixels.sampler import Sampler
from .. import files
from ..meshes import gltf_materials
from ..meshes.mesh_files import MeshFile
from ..pictures import image_files

PNG = b"\x89PNG\r\n\x1a\n"  # how such a file begins


def check(file: MeshFile, name: str | Path) -> None:
    """Refuse what has no maps to carry, or cannot hold them.

    Raises:
        InputError: the mesh, or the output, is no glTF file.
    """
    if file.primitive is None:
        raise InputError(
            f"{file.path}: --carry-maps is for materials of GLB and glTF files; iccm relayout carries others"
        )
    if Path(name).suffix.lower() != ".glb":
        raise InputError(f"{name}: --carry-maps puts pictures into a file; use .glb")


def carried(
    file: MeshFile, uv: Real, uv_corners: Index, *, but: tuple[str, ...] = (), threads: int | None = None
) -> dict[str, bytes]:
    """The pictures of the material's slots for new coordinates, as PNG files, those of normals turned.

    Args:
        file: a mesh from a glTF file.
        uv: (t, 2) new coordinates, v up.
        uv_corners: (c,) coordinate of each corner of the mesh.
        but: slots that are not wanted.
        threads: never change the result.

    Raises:
        InputError: a picture that cannot be read, or old coordinates that are none.
    """
    part = file.primitive
    assert part is not None
    made, pictures = dict[tuple, bytes](), dict[str, bytes]()
    for slot, info in gltf_materials.slots(part.material):
        source, old = part.document.source_of(info["index"]), part.uv(info)
        if slot in but or source is None or old is None:
            continue
        key = source, gltf_materials.kind_of(slot), repr(info.get("extensions")), info.get("texCoord", 0)
        if key not in made:
            content = part.document.image(source)
            assert content is not None
            where = f"{file.path}: {gltf_materials.named([slot])}"
            made[key] = _carried(where, content, key[1], *_charted(file, old, uv, uv_corners), threads)
        pictures[slot] = made[key]
    return pictures


def _charted(file: MeshFile, old: Real, uv: Real, uv_corners: Index) -> tuple[Charted, Charted]:
    """The triangles with the coordinates that they have, and with the new ones."""
    mesh = file.mesh
    faces = mesh.corners.reshape(-1, 3)
    same: Any = (mesh.normals, None if mesh.normals is None else faces)
    before = Charted(mesh.name, mesh.points, faces, old, faces, *same)
    return before, Charted(mesh.name, mesh.points, faces, uv, uv_corners.reshape(-1, 3), *same)


def _carried(where: str, content: bytes, kind: str, old: Charted, new: Charted, threads: int | None) -> bytes:
    with files.scratch() as folder:
        path = folder / ("a.png" if content.startswith(PNG) else "a.jpg")
        path.write_bytes(content)
        try:
            image = image_files.read(path)
        except InputError as error:
            raise InputError(f"{where} cannot be read: {str(error).partition(': ')[2]}") from error
        height, width = image.pixels.shape[:2]
        origin = Origin.of(old, new, width, height)
        sampler = Sampler(image.texture((0j, 1 + 1j), kind), "auto", kind, threads=threads)
        pixels = carry(origin, sampler, np.inf, threads=threads)
        out = folder / "b.png"
        image_files.write(out, image.with_pixels(pixels, image.alpha))
        return out.read_bytes()
