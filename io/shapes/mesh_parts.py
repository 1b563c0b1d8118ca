"""Several parts of a mesh: side by side in one plane, and as one shape."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Box, Flags, Index
from ...meshes.flatten import Flattening
from ...meshes.mesh import Mesh
from ...meshes.patch import Patch
from ...plane import longer_side
from ..meshes.mesh_format import MeshFile
from .mesh_shape import MeshShape

GAP_SIDE_SHARE = 0.02
"""Of the larger side: gap between pieces placed side by side: visible, and little of the area."""


def side_by_side(shapes: list[MeshShape]) -> list[MeshShape]:
    """Place pieces side by side in rows, at the scale of the surface; a single one stays where it is."""
    if len(shapes) == 1:
        return shapes
    sizes = [shape.curve.box[1] - shape.curve.box[0] for shape in shapes]
    gap = GAP_SIDE_SHARE * max(max(size.real, size.imag) for size in sizes)
    width = max(
        max(size.real for size in sizes), np.sqrt(sum((s.real + gap) * (s.imag + gap) for s in sizes))
    )
    placed: dict[int, MeshShape] = {}
    x = y = tallest = 0.0
    for k in sorted(range(len(shapes)), key=lambda k: -sizes[k].imag):
        if x > 0 and x + sizes[k].real > width:
            x, y, tallest = 0.0, y - tallest - gap, 0.0
        tallest = max(tallest, sizes[k].imag)
        placed[k] = _move(shapes[k], complex(x, y - sizes[k].imag) - shapes[k].curve.box[0])
        x += sizes[k].real + gap
    return [placed[k] for k in range(len(shapes))]


def move_beside(shape: MeshShape, boxes: Sequence[Box]) -> MeshShape:
    """Move a piece to the right of the boxes of others in its plane."""
    low, high = shape.curve.box
    gap = GAP_SIDE_SHARE * longer_side(low, high)
    return _move(shape, complex(max(corner.real for _, corner in boxes) + gap, boxes[0][0].imag) - low)


def _move(shape: MeshShape, by: complex) -> MeshShape:
    flat = replace(shape.flattening, flat=shape.flattening.flat + by)
    holes = tuple(hole + by for hole in shape.holes)
    return replace(shape, flattening=flat, curve=flat.boundary, box=flat.boundary.box, holes=holes)


def join(shapes: Sequence[MeshShape]) -> MeshShape:
    """Join several parts of one file to one shape, for output files; its outline is that of the first part."""
    if len(shapes) == 1:
        return shapes[0]
    mesh, faces, corners = _unite([shape.file for shape in shapes])
    patches = [shape.flattening.patch for shape in shapes]
    united = Patch.of_pieces(mesh, patches, [number[patch.corner] for number, patch in zip(corners, patches)])
    united = replace(united, notes=tuple(dict.fromkeys(note for patch in patches for note in patch.notes)))
    flat = np.concatenate([shape.flattening.flat for shape in shapes])
    first = shapes[0]
    flattening = Flattening(united, flat, first.flattening.loop, first.flattening.method)
    return replace(first, file=replace(first.file, mesh=mesh, faces=faces), flattening=flattening)


def _unite(files: Sequence[MeshFile]) -> tuple[Mesh, Flags, list[Index]]:
    """Return the faces of several parts of a file as one mesh, marks of these faces, and new numbers of all corners."""
    faces_of_files = [np.flatnonzero(file.faces) for file in files]
    faces, first = np.unique(np.concatenate(faces_of_files), return_index=True)
    sizes = np.concatenate([file.mesh.sizes for file in files])[first]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    numbers = [
        _numbered(file.mesh, starts[np.searchsorted(faces, ids)]) for file, ids in zip(files, faces_of_files)
    ]
    mesh = files[0].mesh

    def all_of(name: str, positions: list[Index], count: int) -> Any:
        values = [getattr(file.mesh, name) for file in files]
        if values[0] is None:
            return None
        out = np.empty(count, values[0].dtype)
        for place, own_values in zip(positions, values):
            out[place] = own_values
        return out

    rows = [np.searchsorted(faces, ids) for ids in faces_of_files]
    names = ("corners", "uv_corners", "normal_corners")
    corners, uv, normals = (all_of(name, numbers, int(starts[-1])) for name in names)
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
    """Return new numbers of a mesh's corners if its faces begin at `starts`."""
    return np.arange(mesh.corners.size) + np.repeat(starts - mesh.starts[:-1], mesh.sizes)
