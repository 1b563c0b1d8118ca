"""Flatten all pieces of a mesh into one plane, packed at one scale."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ..arrays import Index
from ..meshes.flatten import Flattening, stand_upright, upright
from ..meshes.mesh import Mesh
from ..meshes.packing import pack
from ..meshes.patch import Patch
from .segmentation import Chart, Charts, charts_of

SAME_LENGTH_SHARE = 1e-5
"""Share of a piece's longest edge; pieces whose edge lengths differ by less, which files of six digits make, are
copies."""


def flatten_each(
    pieces: Sequence[Patch],
    *,
    grow: bool,
    method: str,
    charts: Charts = "auto",
    max_distortion: float | None = None,
    standing: bool = False,
) -> list[list[Flattening]]:
    """Flatten pieces one by one into one or more charts; copies of a piece are flattened alike.

    Args:
        pieces: valid pieces, see `meshes.disk_patch.sound_piece`.
        grow: whether pieces that are closed, or nearly so, may be cut.
        method: see `flattening.flatten`.
        charts, max_distortion, standing: see `segmentation.charts_of`.

    Returns:
        For each piece its charts, which contain all of its triangles.

    Raises:
        InputError: a piece is closed or has handles, and may not be cut.
    """
    originals: dict[bytes, tuple[Patch, list[Chart]]] = {}
    layouts = list[list[Flattening]]()
    for piece in pieces:
        key = _key(piece)
        if key in originals:
            original, parts = originals[key]
            layouts.append([_of_copy(piece, original, part) for part in parts])
            continue
        parts = charts_of(
            piece,
            grow=grow,
            method=method,
            charts=charts,
            max_distortion=max_distortion,
            standing=standing,
        )
        originals[key] = piece, parts
        layouts.append([part.layout for part in parts])
    if not standing:
        return layouts
    return [[stand_upright(layout) for layout in of_piece] for of_piece in layouts]


def _of_copy(copy: Patch, piece: Patch, chart: Chart) -> Flattening:
    """Return a chart of a piece transferred to a copy of it, which is cut in the same way."""
    flat = chart.layout
    originals = np.empty(flat.flat.size, np.int64)  # the piece's vertex behind each vertex of the chart
    originals[flat.patch.faces] = piece.faces[chart.triangles]
    number = np.zeros(int(piece.vertex.max()) + 1, np.int64)
    number[piece.vertex] = copy.vertex
    patch = replace(
        flat.patch,
        mesh=copy.mesh,
        points=copy.points[originals],
        vertex=copy.vertex[originals],
        corner=copy.corner[chart.triangles],
        seam=number[flat.patch.seam],
        notes=copy.notes,
    )
    return replace(flat, patch=patch, flat=upright(patch, flat.flat), even=None)


def _key(piece: Patch) -> bytes:
    """Return a key that is equal for copies of a piece at other positions: triangles and edge lengths."""
    corners = piece.points[piece.faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    unit = SAME_LENGTH_SHARE * max(float(lengths.max()), 1e-300)
    polygon_edges = np.packbits(piece.drawn).tobytes()
    return piece.faces.tobytes() + np.rint(lengths / unit).astype(np.int64).tobytes() + polygon_edges


def pack_all(
    mesh: Mesh,
    layouts: Sequence[Flattening],
    corners: Sequence[Index],
    region: shapely.Geometry | None = None,
    *,
    rotates: bool = True,
    margin: int,
) -> tuple[Flattening, float]:
    """Pack several pieces into one layout; return it and the side of the square that contains it.

    Args:
        mesh: the mesh of the pieces.
        layouts: of each piece, at the scale of its surface.
        corners: for each piece (m, 3) mesh corners behind its triangles' corners.
        region: where to pack them, scaled to fit; None for a square, at their own scale.
        rotates: whether pieces may be rotated.
        margin: distance between pieces, in texels of a texture of 1024.

    Raises:
        InputError: the pieces do not fit.
    """
    square = shapely.box(0, 0, 1, 1)
    packing = pack(
        [(layout.flat, layout.patch.faces) for layout in layouts],
        region or square,
        rotates=rotates,
        margin=margin,
    )
    flat = [packing.of(layout.flat, k) for k, layout in enumerate(layouts)]
    side = 1.0
    if region is None:
        side = 1 / float(np.abs(packing.factor).max())
        flat = [z * side for z in flat]
    firsts = np.cumsum([0, *(layout.flat.size for layout in layouts)])
    whole = Patch.of_pieces(mesh, [layout.patch for layout in layouts], corners)
    outlines = tuple(layout.loop + first for layout, first in zip(layouts, firsts))
    largest = int(np.argmax([layout.patch.areas.sum() for layout in layouts]))
    packed = Flattening(
        whole, np.concatenate(flat), outlines[largest], layouts[largest].method, outlines=outlines
    )
    return packed, side
