"""A test picture of numbered cells, whose hue and lightness encode the position."""

import colorsys
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError


def checkerboard(size: int = 1024, cells: int = 8) -> NDArray[np.uint8]:
    """Return an sRGB picture of cells × cells squares, numbered row by row from 0 at the top left.

    Digits make reflections and rotations visible. Hue varies with x and lightness with y, so that colours identify
    positions.

    Args:
        size: Width and height in pixels.
        cells: Number of squares in each direction.

    Returns:
        (size, size, 3) uint8 pixels, row 0 at the top.

    Raises:
        InputError: There is no pixel or no cell.

    Examples:
        >>> import iccm
        >>> iccm.checkerboard(64, cells=4).shape
        (64, 64, 3)
    """
    if size < 1 or cells < 1:
        raise InputError(f"checkerboard: cannot divide {size} pixels into {cells} cells")
    edges = np.round(np.linspace(0, size, cells + 1)).astype(int)
    out = np.empty((size, size, 3), dtype=np.uint8)
    for i in range(cells):
        for j in range(cells):
            out[edges[i] : edges[i + 1], edges[j] : edges[j + 1]] = _cell(i, j, cells)
    for i in range(cells):
        for j in range(cells):
            x, y = (edges[j] + edges[j + 1]) / 2, (edges[i] + edges[i + 1]) / 2
            _number(out, str(i * cells + j), x, y, size / cells, (i + j) % 2)
    return out


def _cell(i: int, j: int, cells: int) -> list[int]:
    hue = 0.55 + 0.75 * (j + 0.35 * i) / cells
    if (i + j) % 2:
        rgb = colorsys.hls_to_rgb(hue % 1, 0.90 - 0.10 * i / cells, 0.75)
    else:
        rgb = colorsys.hls_to_rgb(hue % 1, 0.52 - 0.16 * i / cells, 0.55)
    return [round(255 * v) for v in rgb]


def _number(out: NDArray[np.uint8], text: str, x: float, y: float, cell: float, light: int) -> None:
    """Write text centred at (x, y), dark on light cells and light on dark ones, in place."""
    digits = [_drawn(digit, DIGIT_HEIGHT_CELLS * cell) for digit in text]
    mask = np.concatenate(digits, axis=1)
    top, left = round(y - mask.shape[0] / 2), round(x - mask.shape[1] / 2)
    place = out[max(0, top) : top + mask.shape[0], max(0, left) : left + mask.shape[1]]
    ink = np.array((60, 50, 45) if light else (255, 252, 245))
    share = mask[: place.shape[0], : place.shape[1], None]
    place[:] = np.round(place + share * (ink - place))


def _arc(x: float, y: float, width: float, height: float, start: int, end: int) -> list[tuple[float, float]]:
    """Return points on an elliptical arc about (x, y), given half axes; degrees run clockwise from the right."""
    angles = np.radians(np.linspace(start, end, 1 + (end - start) // 15))
    return list(zip(x + width * np.cos(angles), y + height * np.sin(angles)))


DIGIT_HEIGHT_CELLS, DIGIT_WIDTH_HEIGHTS = 0.27, 0.68
"""Height of digits relative to the cell, and their width relative to the height."""
STROKE_WIDTH_HEIGHTS, GAP_HEIGHTS = 0.22, 0.24
"""Thickness of strokes and gap between digits, relative to the height."""
STROKES: tuple[Sequence[Sequence[tuple[float, float]]], ...] = (
    [_arc(0.5, 0.5, 0.5, 0.5, 0, 360)],
    [[(0.1, 0.2), (0.55, 0), (0.55, 1)], [(0.1, 1), (1, 1)]],
    [[*_arc(0.47, 0.28, 0.45, 0.28, 190, 400), (0, 1), (1, 1)]],
    [_arc(0.45, 0.25, 0.45, 0.25, 200, 450), _arc(0.45, 0.75, 0.53, 0.25, 270, 520)],
    [[(0.75, 1), (0.75, 0), (0, 0.7), (1, 0.7)]],
    [[(0.95, 0), (0.12, 0), (0.1, 0.46), *_arc(0.45, 0.68, 0.53, 0.32, 235, 510)]],
    [_arc(0.5, 0.68, 0.5, 0.32, 0, 360), _arc(0.9, 0.68, 0.9, 0.68, 180, 270)],
    [[(0, 0), (1, 0), (0.4, 1)]],
    [_arc(0.5, 0.23, 0.44, 0.23, 0, 360), _arc(0.5, 0.74, 0.53, 0.26, 0, 360)],
    [_arc(0.5, 0.32, 0.5, 0.32, 0, 360), _arc(0.1, 0.32, 0.9, 0.68, 0, 90)],
)
"""The digits as polylines in the unit square, y down."""


@cache
def _drawn(digit: str, height: float) -> NDArray[np.float32]:
    """Return (rows, columns) coverage of pixels by a digit, including the gap to its neighbours."""
    rows, columns = (
        round((1 + 2 * STROKE_WIDTH_HEIGHTS) * height),
        round((DIGIT_WIDTH_HEIGHTS + STROKE_WIDTH_HEIGHTS + GAP_HEIGHTS) * height),
    )
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    z, nearest = x + 1j * y, np.full((rows, columns), np.inf)
    for stroke in STROKES[int(digit)]:
        points = [height * complex(DIGIT_WIDTH_HEIGHTS * (u - 0.5), v - 0.5) for u, v in stroke]
        for a, b in pairwise(points):
            along = np.clip(((z - a) * (b - a).conjugate()).real / abs(b - a) ** 2, 0, 1)
            nearest = np.minimum(nearest, np.abs(z - a - along * (b - a)))
    return np.clip(STROKE_WIDTH_HEIGHTS / 2 * height + 0.5 - nearest, 0, 1).astype(np.float32)
