"""A shape's own file as a picture, which the browser shows under or over the carried texture."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from .. import formats, limits
from ..pictures import image_files
from ..shapes.shape import Shape
from ..svg.document import drawing_bytes, root
from .scene import png

SIDE_PIXELS = 2048
"""Pixels of the longer side of a drawing in the browser."""


def own_drawing(shape: Shape) -> tuple[bytes, str] | None:
    """Return content and media type of a picture of the canvas, `Shape.box`; None for meshes and other files without
    one.
    """
    suffix = formats.suffix_of(shape.path)
    if shape.is_mesh or shape.is_layout:
        return None
    if suffix in (".svg", ".svgz"):
        return _drawing(shape), "image/svg+xml"
    if suffix in formats.holding("picture"):
        return png(image_files.read(shape.path), limits.PAGE_TEXELS), "image/png"
    return None


def _drawing(shape: Shape) -> bytes:
    """Return the SVG file with the shape's canvas as its `viewBox`.

    A browser that shows it as an image loads nothing from other files and runs no scripts.
    """
    drawn, corners = root(drawing_bytes(shape.path)), shape.to_file(np.array(shape.box))
    (x, y), (width, height) = corners.min(axis=0), np.ptp(corners, axis=0)
    scale = SIDE_PIXELS / max(width, height)
    drawn.attrib |= {
        "viewBox": f"{x} {y} {width} {height}",
        "width": f"{scale * width:.0f}",
        "height": f"{scale * height:.0f}",
        "preserveAspectRatio": "none",
    }
    return ElementTree.tostring(drawn)
