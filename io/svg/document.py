"""The bytes of a drawing (compressed as .svgz or not), its XML, parsed safely, and the attributes that set its size."""

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml import DefusedXmlException, EntitiesForbidden
from defusedxml.ElementTree import XMLParser

from ...errors import InputError, naming
from ...saved import archive
from .. import files, formats, limits
from ..lengths import CSS_PIXELS
from .drawing_content import Rectangle
from .path_data import numbers

SUFFIXES = (".svg", ".svgz")
GZIP = b"\x1f\x8b"
SHAPES = frozenset(["path", "rect", "circle", "ellipse", "line", "polyline", "polygon"])
_SPACES = ("", "http://www.w3.org/2000/svg")
_UNITS = CSS_PIXELS | {"": 1.0, "em": 16.0, "rem": 16.0, "ex": 8.0}  # relative to the default font size
_LENGTH = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(%|[A-Za-z]*)\s*")


def drawing_bytes(path: Path, max_bytes: int = limits.SVG_BYTES) -> bytes:
    """Return the XML of a drawing; a compressed file is unpacked only up to `max_bytes`.

    Raises:
        InputError: the file cannot be read, is damaged or too large.
    """
    data = files.read_bytes(path, max_bytes=max_bytes)
    if not data.startswith(GZIP):
        return data
    with naming(path):
        return archive.gunzip(data, max_bytes)


def length(text: str, size: tuple[float, float] | None, axis: str, name: str = "length") -> float:
    """Return a length in user units (px at 96 dpi).

    Raises:
        InputError: it is malformed, has an unknown unit, or is a percentage of an unknown size.
    """
    match = _LENGTH.fullmatch(text[:100])
    if (
        not match
        or (match[2] != "%" and match[2].lower() not in _UNITS)
        or not abs(float(match[1])) <= limits.SVG_NUMBER
    ):
        raise InputError(f"{name} {text[:24]!r} is not a length")
    if match[2] != "%":
        return float(match[1]) * _UNITS[match[2].lower()]
    if size is None:
        raise InputError(f"{name} {text[:24]!r}: a percentage needs a viewBox to refer to")
    reference = {"x": size[0], "y": size[1], "r": ((size[0] ** 2 + size[1] ** 2) / 2) ** 0.5}[axis]
    return float(match[1]) / 100 * reference


class _Builder(TreeBuilder):
    """Counts elements while building the tree, so that an element bomb is stopped before memory runs out."""

    depth = count = shapes = 0

    def start(self, tag, attrs):
        self.depth += 1
        self.count += 1
        if self.depth > limits.SVG_DEPTH:
            raise InputError(f"elements are nested more than {limits.SVG_DEPTH} deep")
        if self.count > limits.SVG_ELEMENTS:
            raise InputError(f"more than {limits.SVG_ELEMENTS} elements; split the drawing")
        self.shapes += tag.rpartition("}")[2] in SHAPES
        if self.shapes > limits.SVG_SHAPES:
            raise InputError(
                f"more than {limits.SVG_SHAPES} shapes; split the drawing, or combine shapes into paths"
            )
        return super().start(tag, attrs)

    def end(self, tag):
        self.depth -= 1
        return super().end(tag)


class _Parser(XMLParser):
    """Refuses anything that could expand a document beyond its bytes, or refer to other files.

    Entities that stand for a few plain characters are allowed, since Illustrator writes namespaces that way.
    """

    def __init__(self, data: bytes):
        super().__init__(target=_Builder())
        self.references = data.count(b"&")

    def defused_entity_decl(self, name, is_parameter_entity, value, base, sysid, pubid, notation_name):
        """Count or refuse an entity that the document declares.

        Raises:
            EntitiesForbidden: it is not plain text, or too long for the number of references.
        """
        plain = value is not None and not is_parameter_entity and not set("&<%") & set(value)
        if not plain or len(value) * self.references > limits.STYLE_CHARACTERS:
            super().defused_entity_decl(name, is_parameter_entity, value, base, sysid, pubid, notation_name)


def root(data: bytes) -> Element:
    """Return the document's <svg> element.

    Only entities that are plain text are expanded, and nothing outside the given bytes is read.

    Raises:
        InputError: it is not XML, not SVG, has other entities, is nested too deeply or has too many elements.
    """
    parser = _Parser(data)
    try:
        parser.feed(data)
        top = parser.close()
    except EntitiesForbidden as error:
        raise InputError(
            f"declares the XML entity {error.name!r}; save it as plain SVG without entities"
        ) from error
    except DefusedXmlException as error:
        raise InputError("refers to another file in its XML; save it as plain SVG") from error
    except ParseError as error:
        picture_format = formats.picture_kind(data)  # images sometimes have the suffix of a drawing
        if picture_format:
            raise InputError(
                f"is a {picture_format} picture, not an SVG; rename it to .{picture_format.lower()}"
            ) from None
        raise InputError(f"not well-formed XML: {error}") from error
    except (ValueError, LookupError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"invalid XML: {str(error).splitlines()[0]}") from error
    if local(top) != "svg":
        raise InputError(f"the root element is <{str(top.tag)[:40]}>, not <svg>")
    return top


def local(element: Element) -> str:
    """Return an element's tag without namespace if that is SVG's or missing, otherwise an empty string."""
    space, _, name = str(element.tag).rpartition("}")
    return name if space.lstrip("{") in _SPACES else ""


def canvas(element: Element) -> Rectangle | None:
    """Return the root's viewBox, else its width and height in px, else None.

    Raises:
        InputError: they are malformed, or have no area.
    """
    if "viewBox" in element.attrib:
        return view_box(element.attrib)
    width, height = (element.get(name, "100%").strip() for name in ("width", "height"))
    if width.endswith("%") or height.endswith("%") or "auto" in (width, height):
        return None
    size = length(width, None, "x", "width"), length(height, None, "y", "height")
    if min(size) <= 0:
        raise InputError(f"width and height are {size[0]:g} and {size[1]:g}; they must be positive")
    return 0.0, 0.0, *size


def unit_of_length(element: Element) -> tuple[float | None, str]:
    """Return the length of the root's user unit in millimetres, and the unit in which its size is stated.

    A pixel is 1/96 of an inch. Without an absolute size, the length is None and the unit empty.
    """
    box = canvas(element)
    sides, unit = [], ""
    for name, side in zip(("width", "height"), box[2:] if box else ()):
        text = element.get(name, "100%").strip()
        if not (text.endswith("%") or text == "auto"):
            with suppress(InputError):  # the viewBox alone is needed
                sides.append(length(text, None, "x", name) / side)
                match = _LENGTH.fullmatch(text[:100])
                unit = (match[2].lower() if match else "") or "px"
    if not sides or min(sides) <= 0:
        return None, ""
    # by default, the view is fitted into the size without distortion
    fitted = max if "slice" in element.get("preserveAspectRatio", "") else min
    return fitted(sides) * 25.4 / 96, unit


def view_box(attributes: Mapping[str, str]) -> Rectangle:
    """Return x, y, width and height of a viewBox attribute.

    Raises:
        InputError: it is not four numbers, or has no area.
    """
    text = attributes["viewBox"]
    try:
        x, y, width, height = numbers(text)
    except ValueError as error:
        raise InputError(f"viewBox {text[:48]!r} is not four numbers") from error
    if width <= 0 or height <= 0:
        raise InputError(f"viewBox {text[:48]!r} has no area")
    return x, y, width, height
