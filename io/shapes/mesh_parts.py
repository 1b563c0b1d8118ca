"""All charts or pieces of a mesh, each as a shape, and several of them as one."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

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
from ...plane import bounding_box
from ..meshes import mesh_files
from ..meshes.obj import Obj
from .mesh_shape import Aspect, MeshShape, aspect_of, flatten_patch, read, read_chart

GAP = 0.02  # of the larger side, between pieces that are laid side by side (by hand)


def read_all(
    spec: str,
    most: int,
    *,
    cut: bool = False,
    whole: Obj | None = None,
    layout: bool = False,
    aspect: Aspect | None = None,
    joins: bool = False,
) -> tuple[list[MeshShape], int]:
    """The charts, or the pieces, of a mesh, the largest first, and how many there are beyond `most`.

    Charts lie where their texture coordinates are, pieces side by side in one plane. Which of the two, and the other
    arguments, as for `mesh_shape.read`.

    Raises:
        InputError: there is none that is a domain, or as for `mesh_shape.read`.
    """
    parts = mesh_files.read_all(spec, whole)
    if parts[0].numbered:
        return [read(spec, cut=cut, whole=whole, layout=layout, aspect=aspect, joins=joins)], 0
    charts = bool(parts[0].chart) or layout
    found = _charts(spec, parts, aspect) if charts else _pieces(spec, parts, cut, joins)
    found = sorted(found, key=lambda each: -each.area)
    made, faults = _pick(found[:most])
    if not made:
        raise InputError(faults[0])
    shapes = [shape for _, shape in made] if charts else side_by_side([shape for _, shape in made])
    extent = bounding_box(np.array([reflected(shape.curve.box, shape.mirror) for shape in shapes]))
    notes = tuple(f"left out: {fault.removeprefix(f'{parts[0].path}: ')}" for fault in faults)
    box = shapes[0].box if charts else extent
    return [
        replace(
            shape,
            part=name,
            names=shape.around or tuple(filter(None, [shape.file.part])),
            extent=extent,
            box=box,
            notes=(*_common(shape), *notes),
        )
        for (name, _), shape in zip(made, shapes)
    ], max(len(found) - most, 0)


class _Found(NamedTuple):
    """A chart or a piece of a mesh.

    Attributes:
        area: in the layout, or in space.
        name: as `#` picks it.
        make: makes the shape.
    """

    area: float
    name: str
    make: Callable[[], MeshShape]


def _charts(spec: str, parts: Sequence[mesh_files.MeshFile], aspect: Aspect | None) -> list[_Found]:
    """The charts of all geometries.

    Raises:
        InputError: no geometry has any; of the first.
    """
    found, faults = list[_Found](), list[InputError]()
    for file in parts:
        try:
            atlas = Atlas.of(file.mesh)
        except InputError as error:
            faults.append(error)
            continue
        wide = aspect_of(file, aspect)
        found += [
            _Found(float(area), _named(file, "uv", k), partial(read_chart, spec, file, atlas, k, wide))
            for k, area in enumerate(atlas.areas, 1)
        ]
    if not found:
        raise faults[0]
    return found


def _pieces(spec: str, parts: Sequence[mesh_files.MeshFile], cut: bool, joins: bool) -> list[_Found]:
    """The pieces of all geometries; errors as for `_charts`."""

    def made(file: mesh_files.MeshFile, connected: Joined, number: int) -> MeshShape:
        return flatten_patch(
            spec, file, disk_patch(connected, cut=cut, piece=number), cut, "conformal", joins=joins
        )

    found = []
    for file in parts:
        connected = Joined.of(file.mesh)
        areas = connected.areas[connected.order]
        found += [
            _Found(float(area), _named(file, "piece", k), partial(made, file, connected, k))
            for k, area in enumerate(areas, 1)
        ]
    return found


def _named(file: mesh_files.MeshFile, word: str, number: int) -> str:
    return "#".join([*filter(None, [file.part]), f"{word}-{number}"])


def _pick(found: Sequence[_Found]) -> tuple[list[tuple[str, MeshShape]], list[str]]:
    """The shapes that can be made, with their names, and why the others cannot."""
    made, faults = [], []
    for each in found:
        try:
            made.append((each.name, each.make()))
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
        placed[k] = _move(shapes[k], complex(x, y - sizes[k].imag) - shapes[k].curve.box[0])
        x += sizes[k].real + gap
    return [placed[k] for k in range(len(shapes))]


def _move(shape: MeshShape, by: complex) -> MeshShape:
    flat = replace(shape.flattening, flat=shape.flattening.flat + by)
    holes = tuple(hole + by for hole in shape.holes)
    return replace(shape, flattening=flat, curve=flat.boundary, box=flat.boundary.box, holes=holes)


def join(shapes: Sequence[MeshShape]) -> MeshShape:
    """Several parts of one file as one shape, for what holds all of them; its outline is the first one's."""
    if len(shapes) == 1:
        return shapes[0]
    mesh, faces, corners = _unite([shape.file for shape in shapes])
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


def _unite(files: Sequence[mesh_files.MeshFile]) -> tuple[Mesh, Flags, list[Index]]:
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
