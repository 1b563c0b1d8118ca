"""Rendering of SVG by librsvg, a rasterizer that iccm does not use (pip install 'pyvips[binary]')."""

import re

import numpy as np
from numpy.typing import NDArray

Box = tuple[float, float, float, float]  # left, top, width and height in an SVG's units, y down
ROOT = re.compile(r"<svg\b(?:[^>\"']|\"[^\"]*\"|'[^']*')*>", re.DOTALL)
PLACING = re.compile(r"""\s(?:viewBox|width|height|x|y|preserveAspectRatio)\s*=\s*(?:"[^"]*"|'[^']*')""")


def rendered(svg: str, box: Box, pixels: int | tuple[int, int]) -> NDArray[np.uint8]:
    """Render a part of an SVG's plane.

    Args:
        svg: the text of an SVG file.
        box: the part of its plane to show.
        pixels: the longer side of the picture, or width and height.

    Returns:
        (height, width, 4) colours and straight alpha.
    """
    import pyvips

    width, height = fitted(box, pixels) if isinstance(pixels, int) else pixels
    view = " ".join(f"{value:.12g}" for value in box)
    placed = f' width="{width}" height="{height}" viewBox="{view}" preserveAspectRatio="none"'
    start = ROOT.search(svg)
    if start is None:
        raise ValueError("not an SVG file")
    opening = PLACING.sub("", start[0])
    cut = -2 if opening.endswith("/>") else -1
    text = svg[: start.start()] + opening[:cut] + placed + opening[cut:] + svg[start.end() :]
    return np.asarray(pyvips.Image.svgload_buffer(text.encode(), unlimited=True).numpy())


def fitted(box: Box, longer_side: int) -> tuple[int, int]:
    """Return width and height of a picture of a box, given the longer side."""
    scale = longer_side / max(box[2], box[3])
    return max(1, round(box[2] * scale)), max(1, round(box[3] * scale))
