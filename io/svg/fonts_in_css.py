"""Font sizes in CSS, lengths relative to them, and the shorthand property `font`."""

import re

from .document import length

MEDIUM_PIXELS = 16.0  # px
LENGTHS = frozenset([
    *("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2", "dx", "dy"),
    *("stroke-width", "stroke-dasharray", "stroke-dashoffset", "letter-spacing", "word-spacing"),
    *("textLength", "startOffset", "baseline-shift"),
])  # fmt: skip
"""Properties whose values are lengths."""
_SIZES = {
    "xx-small": 9 / 16,
    "x-small": 10 / 16,
    "small": 13 / 16,
    "medium": 1.0,
    "large": 18 / 16,
    "x-large": 1.5,
    "xx-large": 2.0,
    "xxx-large": 3.0,
}
_RATIOS = {"smaller": 1 / 1.2, "larger": 1.2}
_EX_EMS = 0.5  # in ems: height of an x, and about the width of a zero
_EM = re.compile(
    r"(?<![\w.#-])([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)(em|rem|ex|ch)\b", re.IGNORECASE
)
_SIZE = r"(?:\d++\.?\d*+|\.\d++)(?:%|px|pt|pc|mm|cm|in|em|rem|ex|ch)|" + "|".join([*_SIZES, *_RATIOS])
_SHORTHAND = re.compile(
    rf"(?P<before>(?:[\w-]+\s+)*?)(?P<size>{_SIZE})(?:\s*/\s*[\w.%]+)?\s+(?P<family>[^\s/].*)", re.DOTALL
)
_STYLES = {"italic", "oblique"}
_WEIGHTS = {"bold", "bolder", "lighter", *(str(100 * k) for k in range(1, 10))}
_OTHERS = {"normal", "small-caps"}


def px(text: str) -> float:
    """Return a font size given in px; the initial size if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return MEDIUM_PIXELS


def size(text: str, outer: float, root: float) -> float:
    """Return a value of `font-size` in px, given the sizes of the parent and of the root.

    Raises:
        InputError: the value is invalid.
    """
    word = text.strip().lower()
    if word in _SIZES:
        return MEDIUM_PIXELS * _SIZES[word]
    if word in _RATIOS:
        return outer * _RATIOS[word]
    return length(without_ems(word, outer, root), (outer, outer), "y", "font-size")


def without_ems(text: str, font: float, root: float) -> str:
    """Replace lengths relative to font sizes by numbers, given the sizes of the element's and the root's font."""
    if not _EM.search(text):
        return text
    units = {"em": font, "rem": root, "ex": _EX_EMS * font, "ch": _EX_EMS * font}
    return _EM.sub(lambda match: repr(float(match[1]) * units[match[2].lower()]), text)


def shorthand(text: str) -> dict[str, str]:
    """Return the properties that a value of `font` sets; empty where it is not supported."""
    match = _SHORTHAND.fullmatch(text.strip())
    words = match["before"].split() if match else []
    if not match or not set(words) <= _STYLES | _WEIGHTS | _OTHERS:
        return {}
    return {
        "font-style": next((word for word in words if word in _STYLES), "normal"),
        "font-weight": next((word for word in words if word in _WEIGHTS), "normal"),
        "font-size": match["size"],
        "font-family": match["family"],
    }
