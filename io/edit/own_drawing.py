"""What a shape's own file shows, as the browser lays it under or over what is carried."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from .. import formats, limits
from ..pictures import image_files
from ..shapes.shape import Shape
from ..svg.document import drawing_bytes, root
from .scene import png

SIDE = 2048
"""Pixels of the longer side of a drawing, as a browser paints it."""


def own_drawing(shape: Shape) -> tuple[bytes, str] | None:
    """Content and type of a picture of the shape's canvas, `Shape.box`; None for what shows none, such as a mesh."""
    suffix = formats.suffix_of(shape.path)
    if shape.is_mesh or shape.is_layout:
        return None
    if suffix in (".svg", ".svgz"):
        return _drawing(shape), "image/svg+xml"
    if suffix in formats.holding("picture"):
        return png(image_files.read(shape.path), limits.PAGE_TEXELS), "image/png"
    return None


def _drawing(shape: Shape) -> bytes:
    """Return the file with the canvas as its view, whatever its own is. As an image of a page it loads nothing, and
    nothing in it runs.
    """
    drawn, corners = root(drawing_bytes(shape.path)), shape.to_file(np.array(shape.box))
    (x, y), (width, height) = corners.min(axis=0), np.ptp(corners, axis=0)
    scale = SIDE / max(width, height)
    drawn.attrib |= {
        "viewBox": f"{x} {y} {width} {height}",
        "width": f"{scale * width:.0f}",
        "height": f"{scale * height:.0f}",
        "preserveAspectRatio": "none",
    }
    return ElementTree.tostring(drawn)
