"""Drawings of one area in one colour: frames of a morph in which parts and holes grow and shrink."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ...arrays import Complex
from ..lengths import svg_size
from ..shapes.shape import Shape
from .document import path_of
from .element import SVG


def write(rings: Sequence[Complex], colour: Sequence[int], canvas: Shape, path: Path) -> None:
    """Write an SVG of the area inside rings.

    Args:
        rings: in the core plane, filled by the even-odd rule.
        colour: red, green and blue, 8 bits.
        canvas: a shape with the canvas.
        path: the file.
    """
    low, high = canvas.box
    size = high - low
    top = Element(f"{SVG}svg", svg_size(size, canvas.millimetres, canvas.unit))
    top.set("viewBox", f"{low.real:.9g} {-high.imag:.9g} {size.real:.9g} {size.imag:.9g}")
    SubElement(
        top, f"{SVG}path", {"fill": "#" + bytes(colour).hex(), "fill-rule": "evenodd", "d": path_of(rings)}
    )
    ElementTree.ElementTree(top).write(path, encoding="utf-8", xml_declaration=True)
