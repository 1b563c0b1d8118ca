"""A test picture that tells where a texel came from: numbered cells whose hue and lightness say the place."""

import colorsys

import cv2
import numpy as np
from numpy.typing import NDArray


def checkerboard(size: int = 1024, cells: int = 8) -> NDArray[np.uint8]:
    """(size, size, 3) sRGB picture of cells × cells numbered squares, 0 at the top left, row by row.

    Digits show a mirror or a turn at once; hue runs along x and lightness along y, so that a place is known by colour.
    """
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
    """Writes text centred at (x, y), dark on light cells and light on dark ones."""
    font, scale = cv2.FONT_HERSHEY_DUPLEX, cell / 64
    thick = max(1, round(cell / 40))
    (w, h), _ = cv2.getTextSize(text, font, scale, thick)
    ink = (60, 50, 45) if light else (255, 252, 245)
    cv2.putText(out, text, (round(x - w / 2), round(y + h / 2)), font, scale, ink, thick, cv2.LINE_AA)
