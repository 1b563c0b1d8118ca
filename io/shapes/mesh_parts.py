"""All charts or pieces of a mesh, each as a shape, and several of them as one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Flags, Index
from ...errors import InputError
from ...flattening.charts import Atlas
from ...meshes.disk_patch import Joined, disk_patch
from ...meshes.flatten import Flattening
from ...meshes.mesh import Mesh
from ...meshes.patch import Patch
from ...meshes.topology import Triangles
from ...pixels.composed import reflected
from ..meshes import mesh_files
from ..meshes.obj import Obj
from .mesh_shape import Aspect, MeshShape, aspect_of, charted, flattened, read
from .shape import around

GAP = 0.02  # of the larger side, between pieces that are laid side by side (by hand)


def read_all(
    spec: str,
    most: int,
    *,
    cut: bool = False,
    whole: Obj | None = None,
    layout: bool = False,
    aspect: Aspect | None = None,
) -> tuple[list[MeshShape], int]:
    """The charts, or the pieces, of a mesh, the largest first, and how many there are beyond `most`.

    Charts lie where their texture coordinates are, pieces side by side in one plane. Which of the two, and the other
    arguments, as for `mesh_shape.read`.

    Raises:
        InputError: there is none that is a domain, or as for `mesh_shape.read`.
    """
    file = mesh_files.read(spec, whole)
    if file.numbered:
        return [read(spec, cut=cut, whole=whole, layout=layout, aspect=aspect)], 0
    if file.chart or layout:
        atlas, wide = Atlas.of(file.mesh), aspect_of(file, aspect)
        count, word = atlas.count, "uv"
        made, faults = _made(min(count, most), lambda k: charted(spec, file, atlas, k, wide))
    else:
        joined = Joined.of(file.mesh)
        count, word = len(joined.sizes), "piece"
        made, faults = _made(
            min(count, most),
            lambda k: flattened(spec, file, disk_patch(joined, cut=cut, piece=k), cut, "conformal"),
        )
    if not made:
        raise InputError(faults[0])
    shapes = list(made.values()) if word == "uv" else side_by_side(list(made.values()))
    prefix = "".join(f"{part}#" for part in (file.part,) if part)
    extent = around([reflected(shape.curve.box, shape.mirror) for shape in shapes])
    notes = tuple(f"left out: {fault.removeprefix(f'{file.mesh.name}: ')}" for fault in faults)
    box = shapes[0].box if word == "uv" else extent
    return [
        replace(
            shape,
            part=f"{prefix}{word}-{k}",
            names=shape.around,
            extent=extent,
            box=box,
            notes=(*_common(shape), *notes),
        )
        for k, shape in zip(made, shapes)
    ], max(count - most, 0)


def _made(count: int, make: Any) -> tuple[dict[int, MeshShape], list[str]]:
    """The shapes that can be made, by number, and why the others cannot."""
    made, faults = {}, []
    for number in range(1, count + 1):
        try:
            made[number] = make(number)
        except InputError as error:
            faults.append(str(error))
    return made, faults


def _common(shape: MeshShape) -> tuple[str, ...]:
    """The notes that are not about what is left out for the sake of one part."""
    return tuple(note for note in shape.notes if "picks another" not in note and "is the outline" not in note)


def side_by_side(shapes: list[MeshShape]) -> list[MeshShape]:
    """Pieces in one plane, in rows, at the scale of the surface; one alone stays where it is."""
    if len(shapes) == 1:
        return shapes
    sizes = [shape.curve.box[1] - shape.curve.box[0] for shape in shapes]
    gap = GAP * max(max(size.real, size.imag) for size in sizes)
    width = max(
        max(size.real for size in sizes), np.sqrt(sum((s.real + gap) * (s.imag + gap) for s in sizes))
    )
    placed: dict[int, MeshShape] = {}
    x = y = tallest = 0.0
    for k in sorted(range(len(shapes)), key=lambda k: -sizes[k].imag):
        if x > 0 and x + sizes[k].real > width:
            x, y, tallest = 0.0, y - tallest - gap, 0.0
        tallest = max(tallest, sizes[k].imag)
        placed[k] = _moved(shapes[k], complex(x, y - sizes[k].imag) - shapes[k].curve.box[0])
        x += sizes[k].real + gap
    return [placed[k] for k in range(len(shapes))]


def _moved(shape: MeshShape, by: complex) -> MeshShape:
    flat = replace(shape.flattening, flat=shape.flattening.flat + by)
    holes = tuple(hole + by for hole in shape.holes)
    return replace(shape, flattening=flat, curve=flat.boundary, box=flat.boundary.box, holes=holes)


def joined(shapes: Sequence[MeshShape]) -> MeshShape:
    """Several parts of one file as one shape, for what holds all of them; its outline is the first one's."""
    if len(shapes) == 1:
        return shapes[0]
    mesh, faces, corners = _united([shape.file for shape in shapes])
    patches = [shape.flattening.patch for shape in shapes]
    firsts = np.cumsum([0, *(len(patch.points) for patch in patches)])
    whole = Patch(
        mesh,
        np.concatenate([patch.points for patch in patches]),
        Triangles(
            np.concatenate([patch.faces + first for patch, first in zip(patches, firsts)]), int(firsts[-1])
        ),
        np.concatenate([patch.vertex for patch in patches]),
        np.concatenate([number[patch.corner] for number, patch in zip(corners, patches)]),
        np.concatenate([patch.seam for patch in patches]),
        tuple(dict.fromkeys(note for patch in patches for note in patch.notes)),
    )
    flat = np.concatenate([shape.flattening.flat for shape in shapes])
    first = shapes[0]
    laid = Flattening(whole, flat, first.flattening.loop, first.flattening.method)
    return replace(first, file=replace(first.file, mesh=mesh, faces=faces), flattening=laid)


def _united(files: Sequence[mesh_files.MeshFile]) -> tuple[Mesh, Flags, list[Index]]:
    """The faces of several parts of a file as one mesh, which these are, and the numbers of each part's corners."""
    own = [np.flatnonzero(file.faces) for file in files]
    faces, first = np.unique(np.concatenate(own), return_index=True)
    sizes = np.concatenate([file.mesh.sizes for file in files])[first]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    numbers = [_numbered(file.mesh, starts[np.searchsorted(faces, ids)]) for file, ids in zip(files, own)]
    mesh = files[0].mesh

    def all_of(name: str, at: list[Index], count: int) -> Any:
        values = [getattr(file.mesh, name) for file in files]
        if values[0] is None:
            return None
        out = np.empty(count, values[0].dtype)
        for place, own_values in zip(at, values):
            out[place] = own_values
        return out

    rows = [np.searchsorted(faces, ids) for ids in own]
    named = ("corners", "uv_corners", "normal_corners")
    corners, uv, normals = (all_of(name, numbers, int(starts[-1])) for name in named)
    lines = all_of("lines", rows, faces.size)
    marked = np.logical_or.reduce([file.faces for file in files])
    return (
        replace(
            mesh,
            corners=corners,
            starts=starts,
            uv_corners=uv,
            normal_corners=normals,
            lines=lines,
            whole=False,
        ),
        marked,
        numbers,
    )


def _numbered(mesh: Mesh, starts: Index) -> Index:
    """The number of each corner of a mesh whose faces begin at other places."""
    return np.arange(mesh.corners.size) + np.repeat(starts - mesh.starts[:-1], mesh.sizes)
