"""Clip paths and filters that CSS writes as functions, such as `circle(40%)` or `blur(2px)`, as elements of SVG."""

import math
from collections.abc import Callable, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import tinycss2

from ...errors import InputError
from . import css
from .document import length
from .drawing_content import Rectangle

BOXES = frozenset(
    ["fill-box", "stroke-box", "view-box", "content-box", "padding-box", "border-box", "margin-box"]
)
FILL_BOXES = frozenset(["fill-box", "content-box", "padding-box"])
"""Reference boxes without line widths; `border-box`, the default, and `margin-box` mean `stroke-box`."""
_SVG = "{http://www.w3.org/2000/svg}"
_SIDES = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}
_DEGREES = {"deg": 1.0, "grad": 0.9, "rad": 180 / math.pi, "turn": 360.0, "": 1.0}
_SIGMAS = 3  # standard deviations after which a blur has faded


def is_function(text: str) -> bool:
    """Return whether a value of `clip-path` or `filter` has functions other than `url()`."""
    return any(token.type == "function" and token.lower_name != "url" for token in _tokens(text))


def reference_box(text: str) -> str:
    """Return the reference box that a value of `clip-path` names; by default `stroke-box`."""
    words = [token.lower_value for token in _tokens(text) if token.type == "ident"]
    return next((word for word in words if word in BOXES), "stroke-box")


def clip_path(text: str, box: Rectangle) -> Element | None:
    """Return the <clipPath> of a basic shape of CSS; None if it is not one.

    Args:
        text: the value of `clip-path`.
        box: x, y, width and height that positions and percentages refer to.
    """
    function = next((token for token in _tokens(text) if token.type == "function"), None)
    make = _SHAPES.get(function.lower_name) if function is not None else None
    if function is None or make is None:
        return None
    try:
        attributes = make(_words(function.arguments), box)
    except (InputError, ValueError, IndexError):
        return None
    clip = Element(f"{_SVG}clipPath")
    SubElement(clip, f"{_SVG}path", attributes)
    return clip


def filter_element(text: str, box: Rectangle, color: str) -> Element | None:
    """Return the <filter> of a list of filter functions of CSS; None if one is not supported.

    Args:
        text: the value of `filter`.
        box: bounding box of what is filtered; the region reaches beyond it as far as blurs and shadows do.
        color: the current color, in which shadows are by default.
    """
    out = Element(f"{_SVG}filter", {"filterUnits": "userSpaceOnUse", "color-interpolation-filters": "sRGB"})
    margin = max(box[2:])  # for lines, which the box does not include
    for token in _tokens(text):
        make = _FILTERS.get(token.lower_name) if token.type == "function" else None
        if make is None:
            return None
        try:
            margin += make(out, _words(token.arguments), color)
        except (InputError, ValueError, IndexError):
            return None
    for primitive in out:
        primitive.set("color-interpolation-filters", "sRGB")  # resvg does not inherit it
    region = (box[0] - margin, box[1] - margin, box[2] + 2 * margin, box[3] + 2 * margin)
    out.attrib |= {name: repr(side) for name, side in zip(("x", "y", "width", "height"), region)}
    return out


def _tokens(text: str) -> list[Any]:
    try:
        return [token for token in tinycss2.parse_component_value_list(text) if token.type != "whitespace"]
    except (ValueError, RecursionError):  # numbers with thousands of digits, deep nesting
        return []


def _words(arguments: Sequence[Any]) -> list[str]:
    """Return arguments as words; commas are words, strings have no quotes."""
    words: list[str] = []
    for token in arguments:
        if token.type == "string":
            words.append(token.value)
        elif token.type not in ("whitespace", "comment"):
            words.append(css.serialize([token]))
    return words


def _length(text: str, side: float) -> float:
    """Return a length, or a percentage of a side."""
    return length(text, (side, side), "x")


def _position(words: Sequence[str], box: Rectangle) -> tuple[float, float]:
    """Return the point of a `<position>`: none for the middle, one or two values, or two keywords with offsets."""
    if len(words) == 4:
        offsets = {"left": 0, "right": 0, "top": 1, "bottom": 1}
        point = [0.0, 0.0]
        for side, offset in (words[:2], words[2:]):
            axis = offsets[side]
            distance = _length(offset, box[2 + axis])
            point[axis] = box[axis] + (box[2 + axis] - distance if side in ("right", "bottom") else distance)
        return point[0], point[1]
    pair = [*words, "center", "center"][:2]
    if pair[0] in ("top", "bottom") or pair[1] in ("left", "right"):
        pair.reverse()
    x, y = (_length(_SIDES.get(word, word), side) for word, side in zip(pair, box[2:]))
    return box[0] + x, box[1] + y


def _split_at(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words before and after `at`."""
    where = words.index("at") if "at" in words else len(words)
    return list(words[:where]), list(words[where + 1 :])


def _radius(word: str, distances: tuple[float, float], reference: float) -> float:
    """Return a radius: a length, a percentage of a reference, or to the closest or farthest of two sides."""
    choose = {"closest-side": min, "farthest-side": max}.get(word)
    return choose(distances) if choose else _length(word, reference)


def _round_path(x: float, y: float, rx: float, ry: float) -> dict[str, str]:
    return {
        "d": f"M{x + rx!r} {y!r}A{rx!r} {ry!r} 0 1 1 {x - rx!r} {y!r}A{rx!r} {ry!r} 0 1 1 {x + rx!r} {y!r}Z"
    }


def _circle(words: list[str], box: Rectangle) -> dict[str, str]:
    size, at = _split_at(words)
    x, y = _position(at, box)
    across = [abs(x - box[0]), abs(box[0] + box[2] - x)]
    down = [abs(y - box[1]), abs(box[1] + box[3] - y)]
    word = size[0] if size else "closest-side"
    ends = (min(*across, *down), max(*across, *down))
    radius = _radius(word, ends, math.hypot(*box[2:]) / math.sqrt(2))
    return _round_path(x, y, radius, radius)


def _ellipse(words: list[str], box: Rectangle) -> dict[str, str]:
    size, at = _split_at(words)
    x, y = _position(at, box)
    first, second = [*size, "closest-side", "closest-side"][:2] if len(size) != 1 else (size[0], size[0])
    across = abs(x - box[0]), abs(box[0] + box[2] - x)
    down = abs(y - box[1]), abs(box[1] + box[3] - y)
    return _round_path(x, y, _radius(first, across, box[2]), _radius(second, down, box[3]))


def _four(words: Sequence[str]) -> list[str]:
    """Return four values, of which the last ones may be omitted as in CSS."""
    top, *others = words
    right = others[0] if others else top
    bottom = others[1] if len(others) > 1 else top
    return [top, right, bottom, others[2] if len(others) > 2 else right]


def _rounded(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words before and after `round`."""
    where = words.index("round") if "round" in words else len(words)
    return list(words[:where]), list(words[where + 1 :])


def _inset(words: list[str], box: Rectangle) -> dict[str, str]:
    sides, radii = _rounded(words)
    x, y, width, height = box
    offsets = _four(sides)
    top, bottom = (_length(word, height) for word in offsets[::2])
    right, left = (_length(word, width) for word in offsets[1::2])
    return _rectangle((x + left, y + top, width - left - right, height - top - bottom), radii)


def _rect(words: list[str], box: Rectangle) -> dict[str, str]:
    edges, radii = _rounded(words)
    x, y, width, height = box
    ends = [("0%" if k in (0, 3) else "100%") if word == "auto" else word for k, word in enumerate(edges)]
    top, right, bottom, left = (
        _length(word, side) for word, side in zip(ends, (height, width, height, width), strict=True)
    )
    return _rectangle((x + left, y + top, max(0.0, right - left), max(0.0, bottom - top)), radii)


def _xywh(words: list[str], box: Rectangle) -> dict[str, str]:
    place, radii = _rounded(words)
    left, top, width, height = (_length(word, side) for word, side in zip(place, box[2:] * 2, strict=True))
    return _rectangle((box[0] + left, box[1] + top, width, height), radii)


def _rectangle(place: Rectangle, radii: Sequence[str]) -> dict[str, str]:
    """Return a rectangle with corners of given radii, first those across, and after `/` those down."""
    x, y, width, height = place
    if width <= 0 or height <= 0:
        return {"d": ""}
    if not radii:
        return {"d": f"M{x!r} {y!r}h{width!r}v{height!r}h{-width!r}Z"}
    slash = radii.index("/") if "/" in radii else len(radii)
    across = [_length(word, width) for word in _four(radii[:slash])]
    down = [_length(word, height) for word in _four(radii[slash + 1 :] or radii[:slash])]
    sums = (
        *((across[0] + across[1], width), (across[3] + across[2], width)),
        *((down[0] + down[3], height), (down[1] + down[2], height)),
    )
    fit = min(1.0, *(side / total for total, side in sums if total > 0))
    (a, b, c, d), (e, f, g, h) = [fit * r for r in across], [fit * r for r in down]
    right, bottom = x + width, y + height
    return {
        "d": f"M{x + a!r} {y!r}L{right - b!r} {y!r}A{b!r} {f!r} 0 0 1 {right!r} {y + f!r}"
        f"L{right!r} {bottom - g!r}A{c!r} {g!r} 0 0 1 {right - c!r} {bottom!r}"
        f"L{x + d!r} {bottom!r}A{d!r} {h!r} 0 0 1 {x!r} {bottom - h!r}"
        f"L{x!r} {y + e!r}A{a!r} {e!r} 0 0 1 {x + a!r} {y!r}Z"
    }


def _rule(words: list[str]) -> tuple[dict[str, str], list[str]]:
    """Return the fill rule that may come first, and the words after it and its comma."""
    if words[0] in ("nonzero", "evenodd"):
        return {"clip-rule": words[0]}, words[2:]
    return {}, words


def _polygon(words: list[str], box: Rectangle) -> dict[str, str]:
    rule, points = _rule(words)
    numbers = [word for word in points if word != ","]
    values = [_length(word, box[2 + k % 2]) + box[k % 2] for k, word in enumerate(numbers)]
    return {"d": "M" + " ".join(map(repr, values)) + "Z", **rule}


def _path(words: list[str], box: Rectangle) -> dict[str, str]:
    rule, (data,) = _rule(words)
    return {"d": data, "transform": f"translate({box[0]!r},{box[1]!r})", **rule}


_SHAPES: dict[str, Callable[[list[str], Rectangle], dict[str, str]]] = {
    "circle": _circle,
    "ellipse": _ellipse,
    "inset": _inset,
    "rect": _rect,
    "xywh": _xywh,
    "polygon": _polygon,
    "path": _path,
}


def _share(words: Sequence[str], most: float = math.inf) -> float:
    """Return a number or percentage that must not be negative; 1 if there is none."""
    word = words[0] if words else "1"
    value = float(word.removesuffix("%")) / (100 if word.endswith("%") else 1)
    if value < 0:
        raise ValueError("negative")
    return min(value, most)


def _blur(out: Element, words: Sequence[str], _color: str) -> float:
    deviation = _length(words[0] if words else "0", 0)
    SubElement(out, f"{_SVG}feGaussianBlur", {"stdDeviation": repr(deviation)})
    return _SIGMAS * deviation


def _drop_shadow(out: Element, words: Sequence[str], color: str) -> float:
    """Add the primitives of a shadow; return how far it reaches beyond the graphic.

    They are used in place of feDropShadow, which Inkscape does not know, and resvg colours otherwise.
    """
    lengths: list[float] = []
    for word in words:
        try:
            lengths.append(_length(word, 0))
        except InputError:  # the color may come before or after the lengths
            color = word if word.lower() != "currentcolor" else color
    dx, dy, deviation = [*lengths, 0.0][:3]
    graphic, shadow = "SourceGraphic", f"shadow-{len(out)}"
    if len(out):  # the result of the filter function before this one
        graphic = f"before-{len(out)}"
        out[-1].set("result", graphic)
    SubElement(out, f"{_SVG}feGaussianBlur", {"in": graphic, "stdDeviation": repr(deviation)})
    SubElement(out, f"{_SVG}feOffset", {"dx": repr(dx), "dy": repr(dy), "result": shadow})
    SubElement(out, f"{_SVG}feFlood", {"flood-color": color})
    SubElement(out, f"{_SVG}feComposite", {"in2": shadow, "operator": "in", "result": shadow})
    merge = SubElement(out, f"{_SVG}feMerge")
    for layer in (shadow, graphic):
        SubElement(merge, f"{_SVG}feMergeNode", {"in": layer})
    return _SIGMAS * deviation + max(abs(dx), abs(dy))


def _transfer(out: Element, channels: str, attributes: dict[str, str]) -> float:
    transfer = SubElement(out, f"{_SVG}feComponentTransfer")
    for channel in channels:
        SubElement(transfer, f"{_SVG}feFunc{channel}", attributes)
    return 0.0


def _linear(slope: float, intercept: float = 0.0) -> dict[str, str]:
    return {"type": "linear", "slope": repr(slope), "intercept": repr(intercept)}


def _table(first: float, last: float) -> dict[str, str]:
    return {"type": "table", "tableValues": f"{first!r} {last!r}"}


def _contrast(out: Element, words: Sequence[str], _color: str) -> float:
    share = _share(words)
    return _transfer(out, "RGB", _linear(share, 0.5 - 0.5 * share))


def _invert(out: Element, words: Sequence[str], _color: str) -> float:
    share = _share(words, 1)
    return _transfer(out, "RGB", _table(share, 1 - share))


def _matrix(out: Element, kind: str, values: str) -> float:
    SubElement(out, f"{_SVG}feColorMatrix", {"type": kind, "values": values})
    return 0.0


def _hue_rotate(out: Element, words: Sequence[str], _color: str) -> float:
    word = (words[0] if words else "0").lower()
    unit = next(unit for unit in ("grad", "deg", "rad", "turn", "") if word.endswith(unit))
    return _matrix(out, "hueRotate", repr(float(word.removesuffix(unit)) * _DEGREES[unit]))


def _sepia(out: Element, words: Sequence[str], _color: str) -> float:
    kept = 1 - _share(words, 1)
    full = ((0.393, 0.769, 0.189), (0.349, 0.686, 0.168), (0.272, 0.534, 0.131))
    rows = [
        " ".join(repr((1 - kept) * value + kept * (i == j)) for j, value in enumerate(row)) + " 0 0"
        for i, row in enumerate(full)
    ]
    return _matrix(out, "matrix", " ".join(rows) + " 0 0 0 1 0")


_FILTERS: dict[str, Callable[[Element, Sequence[str], str], float]] = {
    "blur": _blur,
    "drop-shadow": _drop_shadow,
    "brightness": lambda out, words, _: _transfer(out, "RGB", _linear(_share(words))),
    "contrast": _contrast,
    "invert": _invert,
    "opacity": lambda out, words, _: _transfer(out, "A", _table(0.0, _share(words, 1))),
    "grayscale": lambda out, words, _: _matrix(out, "saturate", repr(1 - _share(words, 1))),
    "saturate": lambda out, words, _: _matrix(out, "saturate", repr(_share(words))),
    "hue-rotate": _hue_rotate,
    "sepia": _sepia,
}
"""Each adds its primitives to a filter, and returns how far it reaches."""
