"""Patterns as their tiles, which the map bends like everything else that is drawn."""

import copy
import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..svg import affine
from ..svg.document import local
from ..svg.drawing_content import Rectangle
from ..svg.tree import Document
from .element import SVG
from .paint_server import Space

MOST_TILES = 2_000  # of one shape; patterns of more follow the map's affine part
MOST_COPIED_ELEMENTS = 20_000  # in all tiles of one shape
_NOT_STYLES = {"id", "x", "y", "width", "height", "viewBox", "preserveAspectRatio", "href"}
_NOT_STYLES |= {"patternUnits", "patternContentUnits", "patternTransform"}


def tiled(
    document: Document, source: Element, attributes: Mapping[str, str], tile: Rectangle, space: Space
) -> Element | None:
    """Return a group that draws a pattern's tiles over the box of the shapes that it fills, in their user space.

    Args:
        document: the drawing.
        source: the pattern that has the content.
        attributes: the pattern's attributes, including those of other patterns that it refers to.
        tile: x, y, width and height of the tile at the origin.
        space: the shapes that it fills.

    Returns:
        None where there are too many tiles, or the pattern's transform has no inverse.
    """
    transform = affine.parse(attributes.get("patternTransform", ""))
    if not transform.determinant:
        return None
    x, y, width, height = space.box
    corners = transform.inverse(
        complex(x, y) + np.array([0, width, width + 1j * height, 1j * height], np.complex128)
    )
    left, right = ((side - tile[0]) / tile[2] for side in (corners.real.min(), corners.real.max()))
    top, bottom = ((side - tile[1]) / tile[3] for side in (corners.imag.min(), corners.imag.max()))
    if (right - left + 2) * (bottom - top + 2) > MOST_TILES:
        return None
    columns = range(math.floor(left + 1e-9), math.ceil(right - 1e-9))
    rows = range(math.floor(top + 1e-9), math.ceil(bottom - 1e-9))
    content = [child for child in source if local(child)]
    if len(columns) * len(rows) * sum(1 for _ in source.iter()) > MOST_COPIED_ELEMENTS:
        return None
    boxed = attributes.get("patternContentUnits") == "objectBoundingBox" and "viewBox" not in attributes
    view = (0.0, 0.0, tile[2] / width, tile[3] / height) if boxed else tile
    inside = {
        "viewBox": attributes.get("viewBox", " ".join(map(repr, view))),
        "preserveAspectRatio": attributes.get("preserveAspectRatio", "xMidYMid")
        if "viewBox" in attributes
        else "none",
    }
    styles = {k: v for k, v in document.declared(source).items() if k not in _NOT_STYLES and k[0] != "{"}
    group = Element(f"{SVG}g", styles | {"transform": attributes.get("patternTransform", "")})
    for row in rows:
        for column in columns:
            place = (tile[0] + column * tile[2], tile[1] + row * tile[3], tile[2], tile[3])
            sides = {name: repr(side) for name, side in zip(("x", "y", "width", "height"), place)}
            view_group = SubElement(group, f"{SVG}svg", sides | inside)
            view_group.extend(copy.copy(child) for child in content)
    return group
