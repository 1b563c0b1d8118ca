"""Text as outlines of its letters, where its font is found (by fontconfig, else by matplotlib) and it is set plainly.

Text that needs more than lines of letters, such as vertical text or bidirectional spans, is left as text.
"""

import re
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from ...curve import Curve
from ...errors import InputError
from .. import limits
from . import affine, fonts_in_css
from .affine import Affine
from .budget import Quota
from .directions import in_visual_order
from .document import length, local
from .fonts import Font, Spacing
from .path_data import subpaths

FONTCONFIG_SECONDS = 5  # timeout for fontconfig
INHERITED = (
    *("font", "font-family", "font-size", "font-style", "font-weight", "text-anchor", "direction"),
    *("letter-spacing", "word-spacing"),
)
_WEIGHTS = {"normal": 400, "bold": 700, "bolder": 700, "lighter": 300}
_FONTCONFIG = {100: 0, 200: 40, 300: 50, 400: 80, 500: 100, 600: 180, 700: 200, 800: 205, 900: 210}
_GENERIC = {"serif", "sans-serif", "monospace", "cursive", "fantasy", "system-ui"}
_ANCHORS = {"start": 0.0, "middle": 0.5, "end": 1.0}
# Properties that move letters in unsupported ways, with the values that are harmless.
_PLAIN = {
    **dict.fromkeys(("dominant-baseline", "alignment-baseline"), ("auto", "alphabetic", "baseline")),
    "writing-mode": ("lr", "lr-tb", "horizontal-tb"),
    "direction": ("ltr",),
    **dict.fromkeys(("font", "inline-size", "shape-inside"), ()),
}


class _NotPlainError(Exception):
    """Text that cannot be outlined."""


@lru_cache(maxsize=64)
def _matched(family: str, weight: int, slant: int) -> Font | None:
    """Return the font of a family; None where fontconfig would substitute another."""
    file = font_file(family, weight, slant)
    try:
        return Font(*file, weight) if file else None
    except Exception:  # treat a broken font file as missing
        return None


def font_file(family: str, weight: int = 400, slant: int = 0) -> tuple[str, int] | None:
    """Return the file of an installed font and its index in a collection; None where another would be substituted.

    Args:
        family: in lower case, such as `dejavu sans`.
        weight: as in CSS; 400 is regular, 700 bold.
        slant: 0 for upright, 100 for italic, 110 for oblique.
    """
    command = shutil.which("fc-match")
    if command is None:
        return _listed(family, weight, slant)
    pattern = re.sub(r"([\\\-:,])", r"\\\1", family)
    fontconfig_weight = _FONTCONFIG[min(900, max(100, round(weight, -2)))]
    query = f"{pattern}:weight={fontconfig_weight}:slant={slant}"
    arguments = [command, "-f", "%{family}\n%{file}\n%{index}", query]
    try:
        output = subprocess.run(
            arguments, capture_output=True, text=True, timeout=FONTCONFIG_SECONDS, check=True
        ).stdout
        names, path, number = output.split("\n")[:3]
        if family not in _GENERIC and family not in names.casefold().split(","):
            return None
        return path, int(number) & 0xFFFF if path.lower().endswith((".ttc", ".otc")) else 0
    except Exception:  # treat a broken fontconfig as a missing font
        return None


def _listed(family: str, weight: int, slant: int) -> tuple[str, int] | None:
    """Return the font of a family among those that matplotlib finds, for systems without fontconfig."""
    try:
        from matplotlib import font_manager

        styles: dict[int, Literal["normal", "italic", "oblique"]] = {
            0: "normal",
            100: "italic",
            110: "oblique",
        }
        style = styles[slant]
        properties = font_manager.FontProperties(family=[family], weight=weight, style=style)
        return str(font_manager.findfont(properties, fallback_to_default=False)), 0
    except Exception:  # a missing family
        return None


def finder() -> str:
    """Return a description of how fonts are found on this system."""
    command = shutil.which("fc-match")
    return (
        f"found by {command}"
        if command
        else "fc-match is missing; found by matplotlib, without font collections"
    )


class Lettering:
    """Outlines the text of a document.

    Args:
        declared: returns an element's attributes and styles.
        linked: returns the element that another one links to.
    """

    def __init__(
        self,
        declared: Callable[[Element], Mapping[str, str]],
        linked: Callable[[Element], Element | None] = lambda _: None,
    ):
        self._declared, self._linked = declared, linked
        most = limits.SVG_LETTERS
        self._letters = Quota(most, f"it contains more than {most} letters; convert text to paths")
        self._families: set[tuple[str, int, int]] = set()

    def path_data(self, element: Element, properties: Mapping[str, str]) -> str | None:
        """Return a <text> as path data in its own units; None where it stays text.

        Args:
            element: the <text>.
            properties: those that apply to it, inherited ones included.

        Raises:
            InputError: there are too many letters.
        """
        parts = self.painted(element, properties)
        return None if parts is None else "".join(data for _, data in parts)

    def painted(
        self, element: Element, properties: Mapping[str, str]
    ) -> list[tuple[Mapping[str, str], str]] | None:
        """Return a <text> in parts with the same paint, in painting order: all paint properties, and path data.

        Raises:
            InputError: there are too many letters.
        """
        try:
            if properties.get("baseline-shift", "0").strip() not in ("0", "0px", "baseline"):
                raise _NotPlainError
            spans = _Spans()
            self._collect(element, properties, element.get(_SPACE) == "preserve", spans)
            parts = self._fitted(spans, properties)
        except _NotPlainError:
            return None
        if len({key for key, _ in parts}) > 1 and any("url(" in value for key, _ in parts for value in key):
            return None  # gradients and patterns refer to the box of the whole text
        return [(dict(zip(PAINT, key)), data) for key, data in parts] or None

    @staticmethod
    def plain(properties: Mapping[str, str]) -> dict[str, str]:
        """Return the paint of letters that have only the properties of their <text>."""
        return {name: properties.get(name, default) for name, default in PAINT.items()} | {"opacity": "1"}

    def _collect(
        self, element: Element, properties: Mapping[str, str], keep_space: bool, spans: "_Spans"
    ) -> None:
        """Add the letters in an element, with the properties and listed positions that apply to each."""
        for name, plain in _PLAIN.items():
            if name in properties and properties[name].strip() not in plain:
                raise _NotPlainError
        begin = spans.count
        inherited = {k: v for k, v in properties.items() if k not in _NOT_INHERITED}
        spans.add(element.text or "", inherited, keep_space)
        for child in element:
            if local(child) in ("title", "desc", "metadata"):
                continue
            declared = dict(self._declared(child))
            if declared.get("display") != "none":
                self._collect_child(child, declared, inherited, keep_space, spans)
            if local(child) == "textPath" and (child.tail or "").strip():
                raise _NotPlainError
            spans.add(child.tail or "", inherited, keep_space)
        spans.place(begin, properties)

    def _collect_child(
        self,
        child: Element,
        declared: dict[str, str],
        outer: Mapping[str, str],
        keep_space: bool,
        spans: "_Spans",
    ) -> None:
        """Add the letters of a <tspan> or <textPath> in a text."""
        inner = dict(outer) | {k: v for k, v in declared.items() if v != "inherit"}
        try:
            if "font-size" in declared:
                around = fonts_in_css.px(outer.get("font-size", ""))
                inner["font-size"] = repr(
                    fonts_in_css.size(declared["font-size"], around, fonts_in_css.MEDIUM_PIXELS)
                )
        except InputError:
            raise _NotPlainError from None
        size = fonts_in_css.px(inner.get("font-size", ""))
        for name in fonts_in_css.LENGTHS.intersection(declared):
            inner[name] = fonts_in_css.without_ems(inner[name], size, fonts_in_css.MEDIUM_PIXELS)
        if local(child) == "textPath" and ALONG not in outer:
            inner[ALONG] = self._path_along(child)
        elif local(child) != "tspan":
            raise _NotPlainError
        if "opacity" in declared:
            inner[SEEN] = repr(_number(declared["opacity"]) * _number(outer.get(SEEN, "1")))
        raised = declared.get("baseline-shift", "baseline").strip()
        if raised not in ("0", "0px", "baseline"):
            inner[RAISED] = f"{outer.get(RAISED, '')} {raised}@{size!r}"
        if "textLength" in declared:
            if FITTED in outer:
                raise _NotPlainError
            inner[FITTED] = f"{spans.count}"
        self._collect(child, inner, keep_space or child.get(_SPACE) == "preserve", spans)

    def _path_along(self, element: Element) -> str:
        """Return the path data that a <textPath> refers to, in the text's units."""
        path = self._linked(element)
        declared = self._declared(path) if path is not None else {}
        if path is None or local(path) != "path" or element.get("side", "left") != "left":
            raise _NotPlainError
        return f"{declared.get('transform', '')}|{declared.get('d', '')}"

    def _fitted(self, spans: "_Spans", properties: Mapping[str, str]) -> "Painted":
        """Return the path data of a text, with spans stretched to their `textLength`."""
        runs = spans.runs()
        for span in dict.fromkeys(style[FITTED] for _, style in runs if FITTED in style):
            numbers = [k for k, (_, style) in enumerate(runs) if style.get(FITTED) == span]
            stretched = self._stretched([runs[k] for k in numbers], spans.lengths[int(span)])
            for k, run in zip(numbers, stretched):
                runs[k] = run
        if "textLength" in properties:
            if any(FITTED in style for _, style in runs):
                raise _NotPlainError
            runs = self._stretched(runs, properties)
        return self._set(runs)[0]

    def _stretched(self, runs: list["Run"], properties: Mapping[str, str]) -> list["Run"]:
        """Return runs stretched to a total length of `textLength`."""
        wanted_width = _place(properties["textLength"], "textLength")
        _, width, letters = self._set(runs)
        if any(set(_PLACES) & set(style) for _, style in runs[1:]) or width <= 0 or wanted_width <= 0:
            raise _NotPlainError
        if properties.get("lengthAdjust", "spacing").strip() == "spacingAndGlyphs":
            extra = {STRETCHED: repr(wanted_width / width)}
        else:
            extra = {APART: repr((wanted_width - width) / max(1, letters - 1))}
        return [(text, {**style, **extra}) for text, style in runs]

    def _set(self, runs: Sequence["Run"]) -> tuple["Painted", float, int]:
        """Return the path data of runs, their width, and their number of letters.

        Runs between two absolute positions are anchored together.
        """
        parts: list[tuple[tuple[str, ...], str]] = []
        x, y = 0.0, 0.0
        line: list[Piece] = []
        anchor, runs_in_line = 0.0, 0
        count, width = 0, 0.0
        path: str | None = None

        def end() -> None:
            shift = anchor * (x - line[0].x) if line else 0.0
            for piece in line:
                if parts and parts[-1][0] == piece.paint:
                    parts[-1] = piece.paint, parts[-1][1] + piece.draw(shift)
                else:
                    parts.append((piece.paint, piece.draw(shift)))
            line.clear()

        for text, style in runs:
            if style.get(ALONG) != path:  # on a path, x of the text counts and y does not
                path, has_letters = style.get(ALONG), bool(line)
                end()
                x, y = 0.0 if has_letters else x, 0.0
            place = {name: _place(style[name], name) for name in _MOVES if name in style}
            if ALONG in style:
                place.pop("y", None)
            if "x" in place or "y" in place:
                end()
                x, y = place.get("x", x), place.get("y", y)
            x, y = x + place.get("dx", 0.0), y + place.get("dy", 0.0)
            if not line:
                anchor, runs_in_line = _ANCHORS.get(style.get("text-anchor", "start").strip(), 0.0), 0
            runs_in_line += 1
            font, size = self._font(style, text)
            extra_spacing, stretch = float(style.get(APART, "0")), float(style.get(STRETCHED, "1"))
            spacing = Spacing(
                (_spacing(style, "letter-spacing") + extra_spacing) / size,
                _spacing(style, "word-spacing") / size,
            )
            track = _Track(style[ALONG], style.get("startOffset", "0")) if ALONG in style else None
            rotation = _degrees(style.get("rotate", "0"))
            raised = sum(_raised(shift, font) for shift in style.get(RAISED, "").split())
            paint = tuple(
                style.get({"opacity": SEEN}.get(name, name), default) for name, default in PAINT.items()
            )
            for part in in_visual_order(text):
                line.append(Piece(part, font, size, x, y - raised, spacing, stretch, track, rotation, paint))
                advance = size * font.width(part, spacing) * stretch
                x, width = x + advance, width + advance
            if runs_in_line > 1 and any(font.runs_leftward(piece.text) for piece in line):
                raise _NotPlainError
            count += len(text)
        end()
        return parts, width, count

    def _font(self, style: Mapping[str, str], text: str) -> tuple[Font, float]:
        self._letters.spend(len(text))
        try:
            size = length(style.get("font-size", "16"), None, "y", "font-size")
            weight = style.get("font-weight", "normal").strip()
            weight_number = _WEIGHTS.get(weight) or int(weight)
        except (InputError, ValueError):
            raise _NotPlainError from None
        slant = {"italic": 100, "oblique": 110}.get(style.get("font-style", "normal").strip(), 0)
        for name in style.get("font-family", "").split(","):
            key = (name.strip().strip("'\"").casefold(), weight_number, slant)
            self._families.add(key)
            font = _matched(*key) if key[0] and len(self._families) <= limits.SVG_FONTS else None
            if font and all(map(font.sets, in_visual_order(text))) and size > 0:
                return font, size
            if font:
                break
        raise _NotPlainError


# Internal properties
ALONG = "iccm-along"  # the path that a text runs along
FITTED = "iccm-fitted"  # the enclosing span with a textLength, given by its first letter
APART, STRETCHED = (
    "iccm-apart",
    "iccm-stretched",
)  # extra letter spacing in user units, and horizontal stretch
RAISED = "iccm-raised"  # all baseline shifts, each with its font size
SEEN = "iccm-seen"  # product of the opacities of all enclosing spans
_MOVES = ("x", "y", "dx", "dy")
_PLACES = (*_MOVES, "rotate", "textLength", "lengthAdjust")
_NOT_INHERITED = (*_PLACES, "baseline-shift", "opacity")
"""Properties that are not inherited."""
PAINT = {
    **{"fill": "black", "stroke": "none", "fill-opacity": "1", "stroke-opacity": "1", "stroke-width": "1"},
    **{"stroke-linejoin": "miter", "stroke-linecap": "butt", "stroke-dasharray": "none"},
    **{"paint-order": "normal", "visibility": "visible", "opacity": "1"},
}
"""Paint properties of each letter, with their defaults."""
_SPACE = "{http://www.w3.org/XML/1998/namespace}space"
Run = tuple[str, Mapping[str, str]]
Painted = list[tuple[tuple[str, ...], str]]
"""Parts of a text: the values of all of PAINT, and path data."""


@dataclass(eq=False)
class _Spans:
    """The letters of a text in order, with the properties that apply to each.

    Attributes:
        letters: one by one, white space collapsed as in HTML.
        styles: properties of each letter, except its position.
        places: position attributes of each letter, by name.
        lengths: attributes of spans with a textLength, by their first letter.
    """

    letters: list[str] = field(default_factory=list)
    styles: list[Mapping[str, str]] = field(default_factory=list)
    places: list[dict[str, str]] = field(default_factory=list)
    lengths: dict[int, Mapping[str, str]] = field(default_factory=dict)
    _keep_space: list[bool] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of letters."""
        return len(self.letters)

    def add(self, text: str, style: Mapping[str, str], keep_space: bool) -> None:
        """Add a text; white space is kept, or collapsed with that before it."""
        for letter in text:
            space = letter in " \n\t\r"
            if space and not keep_space and (not self.letters or self.letters[-1] == " "):
                continue
            self.letters.append(" " if space else letter)
            self.styles.append(style)
            self.places.append({})
            self._keep_space.append(keep_space)

    def place(self, begin: int, declared: Mapping[str, str]) -> None:
        """Assign the positions that an element lists to letters from `begin` on; those of inner elements are kept."""
        end = self.count
        for name in (*_MOVES, "rotate"):
            values = re.split(r"[\s,]+", declared[name].strip()) if name in declared else []
            if name == "rotate" and values:
                values += values[-1:] * (end - begin - len(values))
            for positions, value in zip(self.places[begin:end], values):
                positions.setdefault(name, value)
        if "textLength" in declared:
            self.lengths[begin] = declared

    def runs(self) -> list[Run]:
        """Return runs of consecutive letters without separate positions and with the same properties."""
        end = self.count
        while end and self.letters[end - 1] == " " and not self._keep_space[end - 1]:
            end -= 1
        merged: list[tuple[str, dict[str, str], Mapping[str, str]]] = []
        for letter, style, place in zip(self.letters[:end], self.styles, self.places):
            turn = place.get("rotate", "0")
            alike = merged and merged[-1][2] is style and merged[-1][1].get("rotate", "0") == turn
            if alike and not set(_MOVES) & set(place):
                merged[-1] = merged[-1][0] + letter, *merged[-1][1:]
            else:
                merged.append((letter, place, style))
        return [(text, {**style, **place}) for text, place, style in merged]


@dataclass(frozen=True, eq=False)
class Piece:
    """Letters that are set one after the other.

    Attributes:
        text: the letters.
        font, size: their font and its size.
        x, y: position of the first one; on a path, offset along it and across it.
        spacing, stretch: extra spacing and horizontal stretch.
        track: the path that they follow, if any.
        rotation: rotation of each letter in degrees.
        paint: the values of all of PAINT.
    """

    text: str
    font: Font
    size: float
    x: float
    y: float
    spacing: Spacing
    stretch: float
    track: "_Track | None"
    rotation: float
    paint: tuple[str, ...]

    def draw(self, shift: float) -> str:
        """Return the path data, moved to the left by `shift`."""
        linear = affine.rotation(self.rotation) @ Affine.matrix(
            self.size * self.stretch, 0, 0, self.size, 0, 0
        )

        def place(begin: float, advance: float) -> Affine | None:
            offset = self.x - shift + self.size * self.stretch * begin
            if self.track is None:
                return affine.translation(offset, self.y) @ linear
            half = self.size * self.stretch * advance / 2
            middle = self.track.at(offset + half)
            return middle and middle @ affine.translation(-half, self.y) @ linear

        return self.font.draw(self.text, place, self.spacing)


class _Track:
    """A path that letters follow.

    Args:
        path: its transform and data, separated by a bar.
        offset: where the text begins on it, a length or a share.
    """

    def __init__(self, path: str, offset: str):
        transform, _, data = path.partition("|")
        try:
            runs = subpaths(data, affine.parse(transform), 1e-4)
            if len(runs) != 1 or runs[0].z.size < 2:
                raise _NotPlainError
            z = np.append(runs[0].z, runs[0].z[:1]) if runs[0].closed else runs[0].z
            self.curve = Curve(z, closed=False)
            total = self.curve.length
            self.start = length(offset, (total, total), "x", "startOffset")
        except InputError:
            raise _NotPlainError from None

    def at(self, distance: float) -> Affine | None:
        """Return the frame at a distance from the start of the text; None beyond the ends of the path."""
        s = self.start + distance
        if not 0 <= s <= self.curve.length:
            return None
        step = 1e-4 * self.curve.length
        ends = self.curve.at(np.clip(np.array([s - step, s, s + step]), 0, self.curve.length))
        tangent = complex(ends[2] - ends[0])
        return Affine(tangent / abs(tangent), 0, complex(ends[1])) if tangent else None


def _raised(shift: str, font: Font) -> float:
    """Return the height in user units of a `baseline-shift`, written with its font size as "value@size"."""
    value, _, size = shift.partition("@")
    if value in ("sub", "super"):  # half a line, as in browsers
        return (0.5 if value == "super" else -0.5) * font.line_height * float(size)
    if value.endswith("%"):
        return _degrees(value[:-1]) / 100 * float(size)
    return _place(value, "y")


def _number(text: str) -> float:
    """Return a number, or a percentage as a share."""
    return _degrees(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)


def _place(text: str, axis: str) -> float:
    """Return a single length in user units; lists are not supported."""
    try:
        return length(text, None, axis[-1])
    except InputError:
        raise _NotPlainError from None


def _spacing(style: Mapping[str, str], name: str) -> float:
    text = style.get(name, "normal").strip()
    return 0.0 if text == "normal" else _place(text, "x")


def _degrees(text: str) -> float:
    try:
        return float(text.removesuffix("deg"))
    except ValueError:
        raise _NotPlainError from None
