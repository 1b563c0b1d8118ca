"""Render a part of an SVG drawing's plane as a picture, by resvg.

The document is rendered as the reader understands it: pins and strokes that are constraints are not shown, texts whose
fonts are found have the same outlines as in the shape, and nothing outside the file is read.
"""

import copy
import math
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ...arrays import Box
from ...errors import InputError, naming
from .. import limits
from ..pictures.image import Image
from ..pictures.pillow import opened
from ..svg import affine, css, css_functions, reader, tree
from ..svg.document import drawing_bytes, local
from ..svg.lettering import Lettering
from . import attributes, rasterize
from .element import SVG, restyle
from .references import confine, typed

ROUNDING_SHARE = 1e-9  # relative margin, so that rounding does not lose a pixel of a whole number
_CONSTRAINTS = (reader.PIN, reader.STROKE)
_GEOMETRY = {"x", "y", "width", "height", "cx", "cy", "r", "rx", "ry"}
_OF_TEXT = ("x", "y", "dx", "dy", "rotate", "textLength", "lengthAdjust")


def render(path: Path, box: Box, size: tuple[int, int], *, max_bytes: int = limits.SVG_BYTES) -> Image:
    """Render a part of a drawing's plane, including what it paints beyond its canvas.

    Args:
        path: the drawing.
        box: lower left and upper right corner of the part, in the core plane (user units, y up).
        size: width and height of the picture in pixels.
        max_bytes: largest size of the file.

    Returns:
        Straight (not premultiplied) sRGB with alpha, 8 bits per channel.

    Raises:
        InputError: it cannot be read or rendered.
    """
    with naming(path):
        data = drawing_bytes(path, max_bytes)
    return render_data(data, path, box, size)


def render_data(data: bytes, path: Path, box: Box, size: tuple[int, int]) -> Image:
    """Render a drawing that was made from a file, as `render` does."""
    with opened(_png(data, path, box, size), path, formats=("PNG",)) as picture:
        return Image(np.array(picture.convert("RGBA")), alpha=3)


def render_png(path: Path, box: Box, size: tuple[int, int], *, max_bytes: int = limits.SVG_BYTES) -> bytes:
    """Render as `render` does, and return the content of a PNG file."""
    with naming(path):
        data = drawing_bytes(path, max_bytes)
    return _png(data, path, box, size)


def _png(data: bytes, path: Path, box: Box, size: tuple[int, int]) -> bytes:
    with naming(path):
        cleaned = _cleaned(data)
        (low, high), (width, height) = box, size
        view = [low.real, -high.imag, (high - low).real, (high - low).imag]
        frame = f'viewBox="{" ".join(map(repr, view))}" width="{width}" height="{height}"'
        space = attributes.SPACES[""]
        document = f'<svg xmlns="{space}" {frame} preserveAspectRatio="none">{cleaned.text}</svg>'
        return _rasterized(document, cleaned.needs_fonts)


def drawn(data: bytes) -> Element:
    """Return a drawing as `render_data` shows it, as an `<svg>` to be shown in another document."""
    return ElementTree.fromstring(_cleaned(data).text)


def canvas_of(path: Path, *, max_bytes: int = limits.SVG_BYTES) -> Box:
    """Return the canvas of a drawing in the core plane: its viewBox or size, or else the box of its painted area.

    Raises:
        InputError: it cannot be read, or it paints nothing.
    """
    drawing = reader.read(path, max_bytes=max_bytes)
    if drawing.rectangle is not None:
        x, y, width, height = drawing.rectangle
        return complex(x, -y - height), complex(x + width, -y)
    if drawing.painted.is_empty:
        raise InputError(f"{path}: paints nothing and has neither a viewBox nor a size")
    left, top, right, bottom = drawing.painted.bounds
    return complex(left, -bottom), complex(right, -top)


def pixels_across(box: Box, density: float, most: int) -> tuple[int, int]:
    """Return width and height in pixels of a box at a density per unit, with at most `most` pixels in all."""
    extent = box[1] - box[0]
    density = min(density, math.sqrt(most / (extent.real * extent.imag)))
    longest = min(limits.SIDE, most)
    width, height = (
        max(1, min(longest, math.floor(side * density * (1 + ROUNDING_SHARE))))
        for side in (extent.real, extent.imag)
    )
    return width, height


def _rasterized(text: str, fonts: bool) -> bytes:
    """Return a PNG file of a document with a size; `fonts` is whether the system's fonts may be needed."""
    seconds = limits.RENDER_SECONDS
    ends_by_itself = str(math.ceil(seconds) + 1)  # in case this process is killed meanwhile
    command = [sys.executable, "-P", rasterize.__file__, ends_by_itself, *(["fonts"] if fonts else [])]
    try:
        process = subprocess.run(command, input=text.encode(), capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        reason = f"rendering takes longer than {seconds:g} s; simplify its filters, masks and patterns"
        raise InputError(f"{reason}, or use --texture checker, or --texture with a picture of it") from None
    if process.returncode or not process.stdout:
        errors = process.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise InputError(f"cannot render this drawing: {errors[0][:200] if errors else 'resvg ended early'}")
    return process.stdout


class _Cleaned(NamedTuple):
    """A drawing as resvg gets it.

    Attributes:
        text: its <svg> without constraints, scripts and references to other files.
        needs_fonts: whether there is text in it that is not outlined.
    """

    text: str
    needs_fonts: bool


@lru_cache(maxsize=1)  # a drawing is rendered again where the map needs it finer
def _cleaned(data: bytes) -> _Cleaned:
    document = attributes.settled(tree.parse(data))
    top, texts = document.top, _outlined_texts(document)
    _spell_out(document)
    defined = {id(e) for defs in top.iter() if local(defs) == "defs" for e in defs.iter()}  # for <use>
    for parent in list(top.iter()):
        for child in list(parent):
            if _is_constraint(child) and id(child) not in defined:
                parent.remove(child)
            elif child in texts:
                parent[list(parent).index(child)] = texts[child]
    for element in top.iter():
        for link in tree.LINKS:
            if link in element.attrib and local(element) == "image":
                element.set(link, typed(element.get(link, "")))
    confine(top)
    for name in ("transform", "viewBox", "preserveAspectRatio", "x", "y", "width", "height"):
        top.attrib.pop(name, None)
    if document.canvas:
        sides = dict(zip(("x", "y", "width", "height"), map(repr, document.canvas)))
        top.attrib |= sides | {"viewBox": " ".join(sides.values()), "preserveAspectRatio": "none"}
    restyle(top, {"overflow": "visible"})
    has_text = any(local(descendant) == "text" for descendant in top.iter())
    return _Cleaned(ElementTree.tostring(top, encoding="unicode"), has_text)


def _spell_out(document: tree.Document) -> None:
    """Replace what resvg does not know of CSS by attributes and elements, in place.

    That is most of style sheets, variables, functions for clip paths and filters, and path data, sizes and transforms
    in styles.
    """
    top, declared = document.top, {element: document.declared(element) for element in document.top.iter()}
    functional = {
        element
        for element, values in declared.items()
        if any(css_functions.is_function(values.get(name, "")) for name in ("clip-path", "filter"))
        or list(tree.separate_transforms(values))
    }
    styled = document.sheet is not None or document.has_variables

    def walk(node: tree.Node) -> None:
        values = declared[node.element] if node.element in functional else {}
        if list(tree.separate_transforms(values)):
            values.pop("transform-origin", None)
            values["transform"] = affine.to_svg(document.transform(node))
            node.element.set("transform", values["transform"])
        for name in {"clip-path", "filter"}.intersection(values):
            if not css_functions.is_function(values[name]):
                continue
            made = document.effect(node, name)
            if made is not None and made not in top[:]:
                top.append(made)
            values[name] = f"url(#{made.get('id')})" if made is not None else "none"
            restyle(node.element, {name: values[name]})
        functional.discard(node.element)
        if functional and not node.hidden and (node.tag in tree.GROUPS or node is document.root):
            for child in document.children(node):
                walk(child)

    walk(document.root)
    for element, values in declared.items():
        if local(element) == "style":
            element.text, element[:] = "", []
            continue
        if styled:
            own = {k: v for k, v in values.items() if k != "style" and element.get(k) != v and k[:2] != "--"}
            own |= {
                k: v for k, v in css.declarations(element.get("style", "")).items() if "var(" not in v
            } | own
            element.attrib |= {k: own.pop(k) for k in _GEOMETRY.intersection(own)}
            element.set("style", css.Style(own).text())
        if local(element) == "path" and (data := tree.path_data_in_css(values.get("d", ""))) is not None:
            element.set("d", data)


def _is_constraint(element: Element) -> bool:
    names = element.get("id"), element.get(tree.LABEL)
    return local(element) in tree.SHAPES and any(name and name.startswith(_CONSTRAINTS) for name in names)


def _outlined_texts(document: tree.Document) -> dict[Element, Element]:
    """Return paths that replace the texts which the reader outlines, with the same letters as in the shape."""
    replacements: dict[Element, Element] = {}
    for node in document.shapes:
        if local(node.element) == "text":
            element = _without_text(node.element, node, "path")
            element.set("d", node.properties["d"])
            paint = Lettering.plain(node.properties)  # style rules for paths must not apply to it
            restyle(element, {name: value for name, value in paint.items() if name != "opacity"})
            replacements[node.element] = element
    for text, node in document.painted_texts.items():
        replacements[text] = _without_text(text, node, "g")
        replacements[text].extend(copy.deepcopy(list(node.element)))
    return replacements


def _without_text(text: Element, node: tree.Node, tag: str) -> Element:
    """Return a <text> as another element, with the attributes that apply to it as a whole."""
    attributes = {name: value for name, value in text.attrib.items() if name not in _OF_TEXT}
    element = Element(f"{SVG}{tag}", attributes)
    restyle(
        element, {name: value for name, value in node.declared.items() if name in ("opacity", "transform")}
    )
    return element
