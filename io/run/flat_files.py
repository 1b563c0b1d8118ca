"""Files of a flattening: outline (SVG, DXF), flat mesh (OBJ), or the mesh with flat positions as coordinates."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Complex, Index, Real, xy_of
from ...errors import InputError
from ...plane import longer_side
from .. import formats
from ..lengths import svg_size
from ..meshes import mesh_files
from ..meshes.mesh_format import NewCoordinates, ShownPictures, Written
from ..shapes.mesh_shape import MeshShape
from ..svg.curves import Bezier, Piece
from ..svg.path_data import PenPath

if TYPE_CHECKING:
    from ..artwork.new_dxf import WrittenPath
    from ..materials.carried_maps import CarriedMaps

POINTS_PER_LINE = 8  # so that lines stay below 200 characters
DXF_TOLERANCE_MILLIMETRES = 1e-6  # all sides are straight, so nothing is approximated


def check(name: str, *, overlay: bool = False) -> None:
    """Check that an output has a suffix for flattenings, or for pictures if there is an overlay to show.

    Raises:
        InputError: it does not; the message lists the suffixes.
    """
    if overlay and is_picture(name):
        return
    if is_picture(name):
        raise InputError(f"{name}: a picture of a flattening shows an overlay; name one with --overlay FILE")
    if formats.of(name).mesh and not formats.of(name).flat:
        formats.check(name, "uv", formats.why_no_coordinates(name))
    if not formats.of(name).flat:
        raise InputError(
            f"{name}: a flattening is written as .svg or .dxf (outline) or .obj (flat mesh); use --uv for meshes "
            "with texture coordinates"
        )


def is_picture(name: str) -> bool:
    """Return whether an output is a picture, which shows an overlay."""
    return formats.of(name).picture is not None


def is_flat_mesh(name: str) -> bool:
    """Return whether an output is a flat mesh, and not the mesh with texture coordinates or a drawing."""
    return formats.suffix_of(name) == ".obj"


def write(shape: MeshShape, out: Path, millimetres: float | None) -> None:
    """Write the flattening in the format of the suffix of `out`.

    Args:
        shape: the mesh.
        out: the file.
        millimetres: length of a unit of the plane; None if it has no length.
    """
    suffix = formats.suffix_of(out)
    if suffix == ".dxf":
        from ..artwork import new_dxf

        new_dxf.write(dxf_lines(shape, millimetres or 1.0), out, DXF_TOLERANCE_MILLIMETRES)
        return
    out.write_text(svg(shape, millimetres) if suffix == ".svg" else flat_obj(shape), encoding="utf-8")


def dxf_lines(shape: MeshShape, millimetres: float) -> list[WrittenPath]:
    """Return the outlines and the holes in millimetres, on layers of these names."""
    from ..artwork.new_dxf import WrittenPath  # slow to import, and not needed for meshes

    outlines, holes = _loops(shape)
    rings = [(z, "outline") for z in outlines] + [(z, "holes") for z in holes]
    lines = list[WrittenPath]()
    for z, layer in rings:
        points = (millimetres * np.append(z, z[:1])).tolist()
        pieces = list[Piece](Bezier(side) for side in pairwise(points))
        lines.append(WrittenPath(PenPath(points[0], pieces, True), layer))
    return lines


def _loops(shape: MeshShape) -> tuple[list[Complex], list[Complex]]:
    """Return the outlines of all pieces, and the holes."""
    flat, patch = shape.flattening.flat, shape.flattening.patch
    outer = {int(loop[0]) for loop in shape.flattening.outer_loops}
    holes = [flat[loop] for loop in patch.loops if int(loop[0]) not in outer]
    return [flat[loop] for loop in shape.flattening.outer_loops] if shape.packed else [shape.curve.z], holes


def svg(shape: MeshShape, millimetres: float | None = None) -> str:
    """Return the outline and the holes as SVG paths in the units of the mesh, with y down, and its size in millimetres.

    Args:
        shape: the mesh.
        millimetres: length of a unit of the plane; None if it has no length.
    """
    low, high = shape.box
    margin = 0.02 * abs(high - low)
    size = high - low + 2 * margin * (1 + 1j)
    view = f"{low.real - margin:.9g} {-high.imag - margin:.9g} {size.real:.9g} {size.imag:.9g}"
    thin = f'fill="none" stroke="#8a929b" stroke-width="{0.002 * abs(high - low):.3g}"'
    outlines, holes = _loops(shape)
    names = [f"outline-{k + 1}" for k in range(len(outlines))] if shape.packed else ["outline"]
    lines = [
        f'<path id="{name}" fill="#22262b" d="{closed_path(z.conj())}"/>' for name, z in zip(names, outlines)
    ]
    lines += [f'<path id="hole-{k + 1}" {thin} d="{closed_path(z.conj())}"/>' for k, z in enumerate(holes)]
    sides = "".join(f' {name}="{text}"' for name, text in svg_size(size, millimetres).items())
    head = f'<svg xmlns="http://www.w3.org/2000/svg"{sides} viewBox="{view}">'
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', head, *lines, "</svg>", ""])


def flat_obj(shape: MeshShape) -> str:
    """Return the polygons at their flat positions (z = 0) as OBJ, with texture coordinates if the mesh has any."""
    mesh, flat = shape.file.mesh, shape.flattening.flat
    corner, _ = shape.corners
    xyz = np.column_stack([flat.real, flat.imag, np.zeros(flat.size)])
    text = ["# flattened by iccm\n", ("v %.10g %.10g %.10g\n" * flat.size) % tuple(xyz.ravel().tolist())]
    uv = mesh.uv_corners
    if mesh.uv is not None and uv is not None and (uv >= 0).all():
        text.append(("vt %.10g %.10g\n" * len(mesh.uv)) % tuple(mesh.uv.ravel().tolist()))
    else:
        uv = None
    sizes = [int(size) for size in np.unique(mesh.sizes)]
    text += [_faces(corner, uv, mesh.starts[:-1][mesh.sizes == size], size) for size in sizes]
    return "".join(text)


def unit_uvs(shape: MeshShape) -> Real:
    """Return (p, 2) flat positions, scaled uniformly into 0..1."""
    return xy_of((shape.flattening.flat - shape.box[0]) / longer_side(*shape.box))


def write_uvs(
    shape: MeshShape, out: Path, name: Path, maps: CarriedMaps | None = None, *, force: bool = False
) -> Written:
    """Write the mesh with its flattening as texture coordinates.

    Args:
        shape: the mesh.
        out: the path to write now.
        name: the final name of the file.
        maps: textures of its materials to carry to the new coordinates.
        force: whether files beside it may be replaced.

    Raises:
        InputError: the format cannot hold texture coordinates.
    """
    new = NewCoordinates(unit_uvs(shape), *shape.corners)
    if maps is None:
        return mesh_files.write(shape.file, new, ShownPictures(), out, name, force=force)
    carried = maps.carry(shape.file, new)
    written = mesh_files.write(
        shape.file, new, ShownPictures(pictures=carried.pictures), out, name, force=force
    )
    return replace(written, notes=[*(f"{name}: {note}" for note in carried.notes), *written.notes])


def closed_path(w: Complex) -> str:
    """Return SVG path data through points (n,) x + iy, y down, a few per line, for tools that read line by line."""
    words = [f"{p.real:.9g},{p.imag:.9g}" for p in w.tolist()]
    rows = [" ".join(words[k : k + POINTS_PER_LINE]) for k in range(0, len(words), POINTS_PER_LINE)]
    return "M" + "\n".join(rows) + "Z"


def _faces(corner: Index, uv: Index | None, starts: Index, size: int) -> str:
    rows = starts[:, None] + np.arange(size)
    if uv is None:
        return (("f" + " %d" * size + "\n") * len(starts)) % tuple((corner[rows] + 1).ravel().tolist())
    pairs = np.stack([corner[rows] + 1, uv[rows] + 1], axis=-1)
    return (("f" + " %d/%d" * size + "\n") * len(starts)) % tuple(pairs.ravel().tolist())
