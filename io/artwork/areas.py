"""Drawings of a few areas of flat colours: frames of a morph in which parts and holes grow and shrink."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ...arrays import Complex
from ..lengths import svg_size
from ..shapes.shape import Shape
from .document import path_of
from .element import SVG

NOTHING = "M0 0"  # path data of an empty layer, which players accept, unlike an empty text

DIGITS = 5  # of a coordinate relative to the canvas, which has fewer pixels


class Area(NamedTuple):
    """An area of one colour that is painted over the areas before it.

    Attributes:
        colour: red, green, blue and alpha, 8 bits, straight.
        rings: its boundaries in the core plane, those of parts counter-clockwise, those of holes clockwise.
    """

    colour: tuple[int, int, int, int]
    rings: Sequence[Complex]


def write(layers: Iterable[Area], canvas: Shape, path: Path) -> None:
    """Write an SVG of areas, one path each.

    Args:
        layers: the areas, each painted over those before it.
        canvas: a shape with the canvas.
        path: the file.
    """
    low, high = canvas.box
    size = high - low
    top = Element(f"{SVG}svg", svg_size(size, canvas.millimetres, canvas.unit))
    top.set("viewBox", f"{low.real:.9g} {-high.imag:.9g} {size.real:.9g} {size.imag:.9g}")
    decimals = max(0, DIGITS - math.ceil(math.log10(max(size.real, size.imag))))
    for layer in layers:
        rings = [np.round(ring, decimals) for ring in layer.rings]
        fill = {"fill": "#" + bytes(layer.colour[:3]).hex(), "fill-rule": "evenodd"}
        if layer.colour[3] < 255:
            fill["fill-opacity"] = f"{layer.colour[3] / 255:.3g}"
        SubElement(top, f"{SVG}path", {**fill, "d": path_of(rings) or NOTHING})
    ElementTree.ElementTree(top).write(path, encoding="utf-8", xml_declaration=True)
