"""Triangle sizes, smaller where the map magnifies."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Index
from ...curve import Curve, inside_any
from ...plane import bounding_box, longer_side
from ..meshing.mesh import Sizes
from .measures import stretches

MOST_MAGNIFIED = 6.0
"""Ratio of areas up to which triangles shrink in proportion: energy -0.6 % for 17 % more triangles."""
IN_BAYS = 4.0  # times the area: triangles of twice the size
CELLS = 40  # of the grid along the longer side


def graded(z: Complex, u: Complex, faces: Index, area: float) -> Sizes:
    """The area limit, divided by how much the map z -> u magnifies, between 1 and MOST_MAGNIFIED."""
    _, _, magnified = stretches(z, u, faces)
    middle = z[faces].mean(1)
    low, high = bounding_box(z)
    side = longer_side(low, high) / CELLS
    cell = ((middle - low).real // side).astype(int), ((middle - low).imag // side).astype(int)
    grid = np.ones((max(cell[0]) + 1, max(cell[1]) + 1))
    np.maximum.at(grid, cell, np.clip(magnified, 1, MOST_MAGNIFIED))
    for axis in (0, 1):  # the largest of each cell and its eight neighbours
        edge = [(int(axis == k),) * 2 for k in (0, 1)]
        grid = np.lib.stride_tricks.sliding_window_view(np.pad(grid, edge, "edge"), 3, axis).max(axis=-1)
    return Sizes(low, float(side), area / grid)


def coarser_in_bays(sizes: Sizes, outline: Complex, bays: Sequence[Complex]) -> Sizes:
    """The limits for a mesh of an outline (n,), IN_BAYS times as large in bays, which shrink in the image."""
    low, high = bounding_box(outline)
    if sizes.areas.size == 1:
        side = longer_side(low, high) / CELLS
        sizes = Sizes(low, side, np.full((CELLS, CELLS), sizes.areas[0, 0]))
    columns, rows = np.indices(sizes.areas.shape)
    middles = np.asarray(sizes.corner + sizes.side * (columns + 0.5 + 1j * (rows + 0.5)))
    inside = inside_any(map(Curve, bays), middles.ravel()).reshape(middles.shape)
    return sizes._replace(areas=np.where(inside, IN_BAYS, 1.0) * sizes.areas)
