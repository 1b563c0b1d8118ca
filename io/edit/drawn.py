"""Draw pins and strokes into a copy of an SVG file, replacing those it contains; all other bytes are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np

from ...errors import InputError
from ..shapes import shape
from ..shapes.constraints import MARK_SHARE
from ..shapes.shape import Shape
from ..svg.document import SHAPES, drawing_bytes, root
from ..svg.reader import PIN, STROKE

Point = tuple[float, float]
Pins = Sequence[tuple[str, Point]]
Strokes = Sequence[tuple[str, Sequence[Point]]]
LABEL = "inkscape:label"
PIN_RADIUS_SHARE = 0.008  # relative to the diagonal of the canvas: radius of the circles that show pins


def copy_with(of: Shape, pins: Pins, strokes: Strokes) -> bytes:
    """Return the drawing of a shape with these pins and strokes, in file units; names are given without their prefix.

    Raises:
        InputError: the file is not an SVG, or cannot be changed in this way.
    """
    path, (low, high) = of.path, of.box
    data = drawing_bytes(path)
    root(data)
    if data[:2] in (b"\xfe\xff", b"\xff\xfe"):
        raise InputError(
            f"{path}: pins can only be drawn into UTF-8 files; save the drawing as UTF-8, or "
            "save the pins as JSON"
        )
    cuts, end = _places(data)
    unchanged, start = [], 0
    for a, b in cuts:
        unchanged.append(data[start:a])
        start = b
    # larger circles would be read as the sizes of the pins' patches
    mark = 0.5 * MARK_SHARE * float(np.sqrt(abs(of.curve.area)))
    elements = "\n".join(_elements(pins, strokes, min(PIN_RADIUS_SHARE * abs(high - low), mark)))
    return b"".join(
        [*unchanged, data[start:end], elements.encode("ascii", "xmlcharrefreplace"), b"\n", data[end:]]
    )


def check(spec: str, like: Shape, pins: Pins, strokes: Strokes) -> None:
    """Read a copy again and compare it with the original shape and with the constraints that were drawn.

    Raises:
        InputError: they differ, for example because the root element is transformed.
    """
    read = shape.read(spec)
    places = {PIN + name: like.to_core(place) for name, place in pins}
    lines = {STROKE + name: like.to_core(line) for name, line in strokes}
    tolerance = 1e-9 * like.curve.diagonal
    is_same = (
        np.array_equal(read.curve.z, like.curve.z)
        and read.pins.keys() == places.keys()
        and all(abs(read.pins[name] - place) <= tolerance for name, place in places.items())
        and read.strokes.keys() == lines.keys()
        and all(
            np.allclose(read.strokes[name].z[[0, -1]], z[[0, -1]], atol=tolerance)
            for name, z in lines.items()
        )
    )
    if not is_same:
        raise InputError(f"{like.path}: pins cannot be drawn into this file; save them as JSON")


@dataclass
class _Cuts:
    """Byte ranges of the elements that are constraints, and the position of the root's end tag."""

    found: list[tuple[int, int]] = field(default_factory=list)
    end: int = 0
    depth: int = 0
    opened: tuple[int, int] | None = None
    closed: int | None = None


def _places(data: bytes) -> tuple[list[tuple[int, int]], int]:
    cuts, parser = _Cuts(), expat.ParserCreate()

    def token(*_: object) -> None:
        """Record where the last element ended, at the first token after it."""
        if cuts.closed is not None:
            cuts.found.append((cuts.closed, parser.CurrentByteIndex))
            cuts.closed = None

    def start(tag: str, attributes: dict[str, str]) -> None:
        token()
        cuts.depth += 1
        names = (attributes.get("id", ""), attributes.get(LABEL, ""))
        ours = tag.rpartition(":")[2] in SHAPES and any(name.startswith((PIN, STROKE)) for name in names)
        if ours and cuts.opened is None:
            cuts.opened = cuts.depth, parser.CurrentByteIndex

    def end(_: str) -> None:
        token()
        if cuts.opened and cuts.opened[0] == cuts.depth:
            cuts.closed, cuts.opened = cuts.opened[1], None
        cuts.depth -= 1
        if cuts.depth == 0:
            cuts.end = parser.CurrentByteIndex

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.DefaultHandler = token
    parser.Parse(data, True)
    if data[cuts.end : cuts.end + 2] != b"</":
        raise InputError("the drawing is empty")
    return cuts.found, cuts.end


def _elements(pins: Pins, strokes: Strokes, radius: float) -> list[str]:
    line = f'fill="none" stroke="#e0218a" stroke-width="{radius / 2:.4g}"'
    space = 'xmlns="http://www.w3.org/2000/svg"'
    elements = [
        f'<circle {space} id={quoteattr(PIN + name)} cx="{_text(x)}" cy="{_text(y)}" r="{radius:.4g}" {line}/>'
        for name, (x, y) in pins
    ]
    for name, points in strokes:
        d = "M" + "L".join(f"{_text(x)} {_text(y)}" for x, y in points)
        elements.append(f'<path {space} id={quoteattr(STROKE + name)} d="{d}" {line}/>')
    return elements


def _text(value: float) -> str:
    """Return a number with all its digits, without an exponent."""
    return np.format_float_positional(value, trim="-")
