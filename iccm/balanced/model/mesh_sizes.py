"""Sizes of triangles, smaller where the map magnifies."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Complex, Index, Real
from ...curve import Curve, inside_any
from ...plane import bounding_box, longer_side
from ..meshing.mesh import Sizes
from .measures import stretches

MOST_MAGNIFIED = 6.0
"""Ratio of areas up to which triangles shrink in proportion. It lowers the energy by 0.6 % for 17 % more
triangles.
"""
AREA_FACTOR_IN_BAYS = 4.0  # ratio of areas: triangles of twice the edge length
TRIANGLES_A_RADIUS = 5.0  # of the patch of a soft pin; with 3, maps on different meshes differ twice as much
MOST_FINER_AT_PINS = 9.0  # ratio of areas: around small patches, triangles of a third of the edge length
MOST_MORE_AT_PINS = 0.5  # relative to the number of triangles without pins
GRID_CELLS_ACROSS = 40  # along the longer side


def graded(z: Complex, u: Complex, faces: Index, area: float) -> Sizes:
    """Return the area limit divided by the local magnification of the map z -> u.

    The magnification is clipped to between 1 and MOST_MAGNIFIED.
    """
    _, _, magnified = stretches(z, u, faces)
    middle = z[faces].mean(1)
    low, high = bounding_box(z)
    side = longer_side(low, high) / GRID_CELLS_ACROSS
    cell = ((middle - low).real // side).astype(int), ((middle - low).imag // side).astype(int)
    grid = np.ones((max(cell[0]) + 1, max(cell[1]) + 1))
    np.maximum.at(grid, cell, np.clip(magnified, 1, MOST_MAGNIFIED))
    for axis in (0, 1):  # the largest of each cell and its eight neighbours
        edge = [(int(axis == k),) * 2 for k in (0, 1)]
        grid = np.lib.stride_tricks.sliding_window_view(np.pad(grid, edge, "edge"), 3, axis).max(axis=-1)
    return Sizes(low, float(side), area / grid)


def finer_at_pins(sizes: Sizes, outline: Complex, pins: Complex, radii: Real) -> Sizes:
    """Return smaller limits around soft pins, with about TRIANGLES_A_RADIUS triangles along each radius.

    The limits are relaxed where there are so many patches that the mesh would grow by more than
    MOST_MORE_AT_PINS.

    Args:
        sizes: limits without pins.
        outline: (n,) outline of the mesh.
        pins: (k,) positions.
        radii: (k,) radii of the patches.
    """
    sizes = _on_cells(sizes, outline)
    middles = _middles(sizes)
    limits = np.full(middles.shape, np.inf)
    for pin, radius in zip(pins, radii):
        in_patch = np.abs(middles - pin) < radius + sizes.side
        limits[in_patch] = np.minimum(limits[in_patch], 0.5 * (radius / TRIANGLES_A_RADIUS) ** 2)
    limits = np.clip(limits, sizes.areas / MOST_FINER_AT_PINS, sizes.areas)
    inside = Curve(outline).contains(middles.ravel()).reshape(middles.shape)
    added_share = float((sizes.areas[inside] / limits[inside]).mean()) - 1 if inside.any() else 0.0
    # the number of triangles is the integral of 1 / area; the part that the pins add to it is reduced
    share = min(1.0, MOST_MORE_AT_PINS / added_share) if added_share > 0 else 1.0
    return sizes._replace(areas=1 / (1 / sizes.areas + share * (1 / limits - 1 / sizes.areas)))


def _on_cells(sizes: Sizes, outline: Complex) -> Sizes:
    """Return the same limits on a grid of cells."""
    if sizes.areas.size > 1:
        return sizes
    low, high = bounding_box(outline)
    side = longer_side(low, high) / GRID_CELLS_ACROSS
    return Sizes(low, side, np.full((GRID_CELLS_ACROSS, GRID_CELLS_ACROSS), sizes.areas[0, 0]))


def _middles(sizes: Sizes) -> Complex:
    columns, rows = np.indices(sizes.areas.shape)
    return np.asarray(sizes.corner + sizes.side * (columns + 0.5 + 1j * (rows + 0.5)))


def coarser_in_bays(sizes: Sizes, outline: Complex, bays: Sequence[Complex]) -> Sizes:
    """Return limits that are AREA_FACTOR_IN_BAYS times as large in filled concavities, which shrink in the image.

    Args:
        sizes: limits elsewhere.
        outline: (n,) outline of the mesh.
        bays: polygons of the concavities.
    """
    sizes = _on_cells(sizes, outline)
    middles = _middles(sizes)
    inside = inside_any(map(Curve, bays), middles.ravel()).reshape(middles.shape)
    return sizes._replace(areas=np.where(inside, AREA_FACTOR_IN_BAYS, 1.0) * sizes.areas)
