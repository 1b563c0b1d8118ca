"""Text as outlines of its letters, where it is set plainly; a font that is not installed is replaced as in browsers.

Text that needs more than lines of letters, such as spans in which letters run both ways, is left as text.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import groupby
from typing import Any
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
from .installed_fonts import font_file
from .path_data import subpaths

INHERITED = (
    *("font", "font-family", "font-size", "font-style", "font-weight", "text-anchor", "direction"),
    *("letter-spacing", "word-spacing", "font-variant", "font-variant-caps", "text-transform", "white-space"),
    *("text-decoration", "text-decoration-line", "dominant-baseline", "writing-mode", "text-orientation"),
)
_WEIGHTS = {"normal": 400, "bold": 700, "bolder": 700, "lighter": 300}
_ANCHORS = {"start": 0.0, "middle": 0.5, "end": 1.0}
_KEPT_SPACE = {"pre", "pre-wrap", "break-spaces"}  # values of `white-space`
_VERTICAL = {"tb", "tb-rl", "vertical-rl", "vertical-lr"}  # values of `writing-mode`
_HORIZONTAL = {"lr", "lr-tb", "rl", "rl-tb", "horizontal-tb"}
SMALL_CAPITAL_EMS = 0.7
"""Size of small capitals in fonts without glyphs for them, as in browsers."""
_SUBSTITUTE = "sans-serif"
"""Family for text whose fonts are not installed, or lack some of its letters."""
LINE_EMS = 0.1
"""Width of lines under, over or through text, as in Chromium."""
_LINES = ("underline", "overline", "line-through")
_BASELINES: dict[str, Callable[[Font], float]] = {
    **dict.fromkeys(("auto", "alphabetic", "baseline"), lambda font: 0.0),
    "middle": lambda font: font.x_height / 2,
    "central": lambda font: (font.ascent - font.descent) / 2,
    "hanging": lambda font: 0.8 * font.ascent,
    "mathematical": lambda font: 0.5 * font.ascent,
    **dict.fromkeys(("text-before-edge", "text-top", "before-edge"), lambda font: font.ascent),
    **dict.fromkeys(
        ("text-after-edge", "text-bottom", "after-edge", "ideographic"), lambda font: -font.descent
    ),
}
"""Heights of baselines in ems, as in Chromium."""


class _NotPlainError(Exception):
    """Text that cannot be outlined; the message says why, as a clause after the text's name."""


@lru_cache(maxsize=64)
def _matched(family: str, weight: int, slant: int) -> Font | None:
    """Return the font of a family; None where fontconfig would substitute another."""
    file = font_file(family, weight, slant)
    try:
        return Font(*file, weight) if file else None
    except Exception:  # treat a broken font file as missing
        return None


class Lettering:
    """Outlines the text of a document.

    Args:
        declared: returns an element's attributes and styles.
        linked: returns the element that another one links to.

    Attributes:
        reason: why the last text that was not outlined was not, as a clause.
        substitution: in which font the last text is set, and why, as a clause; empty where it is in its own.
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
        self.reason = self.substitution = ""

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
        self.substitution = ""
        try:
            if properties.get("baseline-shift", "0").strip() not in ("0", "0px", "baseline"):
                raise _NotPlainError
            spans = _Spans()
            if "shape-inside" in properties and not any("x" in child.attrib for child in element):
                raise _NotPlainError("its lines have no positions to show outside Inkscape")
            self._collect(element, properties, element.get(_SPACE) == "preserve", spans)
            parts = self._fitted(spans, properties)
        except _NotPlainError as error:
            self.reason = str(error) or "its layout is not supported"
            return None
        if len({key for key, _ in parts}) > 1 and any("url(" in value for key, _ in parts for value in key):
            self.reason = "its spans are filled with gradients, which refer to the box of the whole text"
            return None
        return [(dict(zip(PAINT, key)), data) for key, data in parts] or None

    @staticmethod
    def plain(properties: Mapping[str, str]) -> dict[str, str]:
        """Return the paint of letters that have only the properties of their <text>."""
        return {name: properties.get(name, default) for name, default in PAINT.items()} | {"opacity": "1"}

    def _collect(
        self, element: Element, properties: Mapping[str, str], keep_space: bool, spans: "_Spans"
    ) -> None:
        """Add the letters in an element, with the properties and listed positions that apply to each."""
        if "font" in properties:
            raise _NotPlainError("its property `font` is not supported")
        for name in ("dominant-baseline", "alignment-baseline"):
            if properties.get(name, "auto").strip() not in _BASELINES:
                raise _NotPlainError(f"{name}: {properties[name].strip()} is not supported")
        if properties.get("writing-mode", "lr").strip() not in _VERTICAL | _HORIZONTAL:
            raise _NotPlainError(f"writing-mode: {properties['writing-mode'].strip()} is not supported")
        keep_space = keep_space or properties.get("white-space", "").strip() in _KEPT_SPACE
        begin = spans.count
        inherited = _with_decoration({k: v for k, v in properties.items() if k not in _NOT_INHERITED})
        spans.add(element.text or "", inherited, keep_space)
        for child in element:
            if local(child) in ("title", "desc", "metadata"):
                continue
            declared = dict(self._declared(child))
            if declared.get("display") != "none":
                self._collect_child(child, declared, inherited, keep_space, spans)
            if local(child) == "textPath" and (child.tail or "").strip():
                raise _NotPlainError("letters follow a text on a path")
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
        elif local(child) not in ("tspan", "a"):
            raise _NotPlainError(f"a <{local(child)}> in it is not supported")
        if "opacity" in declared:
            inner[SEEN] = repr(_number(declared["opacity"]) * _number(outer.get(SEEN, "1")))
        raised = declared.get("baseline-shift", "baseline").strip()
        if raised not in ("0", "0px", "baseline"):
            inner[RAISED] = f"{outer.get(RAISED, '')} {raised}@{size!r}"
        if "textLength" in declared:
            if FITTED in outer:
                raise _NotPlainError("a span with a textLength contains another")
            inner[FITTED] = f"{spans.count}"
        self._collect(child, inner, keep_space or child.get(_SPACE) == "preserve", spans)

    def _path_along(self, element: Element) -> str:
        """Return the path data that a <textPath> refers to, in the text's units."""
        path = self._linked(element)
        declared = self._declared(path) if path is not None else {}
        if path is None or local(path) != "path" or element.get("side", "left") != "left":
            raise _NotPlainError("the path that it runs along is missing, or on its other side")
        return f"{declared.get('transform', '')}|{declared.get('d', '')}"

    def _fitted(self, spans: "_Spans", properties: Mapping[str, str]) -> "Painted":
        """Return the path data of a text, with spans stretched to their `textLength`."""
        runs = self._with_small_capitals(spans.runs())
        for span in dict.fromkeys(style[FITTED] for _, style in runs if FITTED in style):
            numbers = [k for k, (_, style) in enumerate(runs) if style.get(FITTED) == span]
            stretched = self._stretched([runs[k] for k in numbers], spans.lengths[int(span)])
            for k, run in zip(numbers, stretched):
                runs[k] = run
        if "textLength" in properties:
            if any(FITTED in style for _, style in runs):
                raise _NotPlainError("a text with a textLength contains another")
            runs = self._stretched(runs, properties)
        return self._set(runs)[0]

    def _stretched(self, runs: list["Run"], properties: Mapping[str, str]) -> list["Run"]:
        """Return runs stretched to a total length of `textLength`."""
        wanted_width = _place(properties["textLength"], "textLength")
        _, width, letters = self._set(runs)
        if any(set(_PLACES) & set(style) for _, style in runs[1:]) or width <= 0 or wanted_width <= 0:
            raise _NotPlainError("its textLength applies to several lines, or is not positive")
        if properties.get("lengthAdjust", "spacing").strip() == "spacingAndGlyphs":
            extra = {STRETCHED: repr(wanted_width / width)}
        else:
            extra = {APART: repr((wanted_width - width) / max(1, letters - 1))}
        return [(text, {**style, **extra}) for text, style in runs]

    def _set(self, runs: Sequence["Run"]) -> tuple["Painted", float, int]:
        """Return the path data of runs, their width, and their number of letters.

        Runs between two absolute positions are anchored together.
        """
        setting = _Setting()
        for text, style in runs:
            setting.add(text, style, *self._font(style, text))
        setting.end_line()
        return setting.parts, setting.width, setting.letters

    def _font(self, style: Mapping[str, str], text: str) -> tuple[Font, float]:
        self._letters.spend(len(text))
        try:
            size = length(style.get("font-size", "16"), None, "y", "font-size")
            weight = style.get("font-weight", "normal").strip()
            weight_number = _WEIGHTS.get(weight) or int(weight)
        except (InputError, ValueError):
            raise _NotPlainError("its font size or weight is not supported") from None
        slant = {"italic": 100, "oblique": 110}.get(style.get("font-style", "normal").strip(), 0)
        families = [name.strip().strip("'\"") for name in style.get("font-family", "").split(",")]
        lacking = ""
        for name in [*filter(None, families), _SUBSTITUTE]:
            key = (name.casefold(), weight_number, slant)
            self._families.add(key)
            font = _matched(*key) if len(self._families) <= limits.SVG_FONTS else None
            if font and all(map(font.sets, in_visual_order(text))) and size > 0:
                if font.is_coloured(text):
                    raise _NotPlainError(f"the font {name} has its own colors")
                if name not in families:
                    self.substitution = f"text in {font.family}, since {_missing(families, lacking)}"
                return font, size
            lacking = lacking or name * (font is not None)
        raise _NotPlainError(_missing(families, lacking))

    def _with_small_capitals(self, runs: list["Run"]) -> list["Run"]:
        """Return runs in which small capitals are set as capitals of a smaller size, as browsers do."""
        split: list[Run] = []
        for text, style in runs:
            if not _SMALL_CAPITALS & {
                *style.get("font-variant", "").split(),
                *style.get("font-variant-caps", "").split(),
            }:
                split.append((text, style))
                continue
            font, size = self._font(style, text.upper())
            if font.has_small_capitals:
                raise _NotPlainError("its font has glyphs for small capitals, which are not supported")
            small = {**style, "font-size": repr(SMALL_CAPITAL_EMS * size), FULL: repr(size)}
            for number, (is_small, letters) in enumerate(
                groupby(text, key=lambda letter: letter != letter.upper())
            ):
                part_style = small if is_small else style
                if number:
                    part_style = {k: v for k, v in part_style.items() if k not in _MOVES}
                split.append(("".join(letters).upper(), part_style))
        return split


def _missing(families: Sequence[str], lacking: str) -> str:
    """Return why text cannot be set in its fonts, as a clause; `lacking` is the first of them that is installed."""
    if lacking:
        return f"the font {lacking} lacks some of its letters, or they cannot be joined"
    names = ", ".join(filter(None, families))
    return f"its font {names} is not installed" if names else "it names no font"


_SMALL_CAPITALS = {"small-caps", "all-small-caps"}
_TURNED = {"x": "y", "y": "x", "dx": "dy", "dy": "dx"}
_TURNED_SIGN = {"x": -1.0, "y": 1.0, "dx": -1.0, "dy": 1.0}
_UPRIGHT_LETTERS = ((0x1100, 0x11FF), (0x2E80, 0xA4CF), (0xAC00, 0xD7FF), (0xF900, 0xFAFF), (0xFE30, 0xFE4F))
"""Blocks of letters that stand upright in vertical text: Chinese, Japanese, Korean."""
# Internal properties
ALONG = "iccm-along"  # the path that a text runs along
FITTED = "iccm-fitted"  # the enclosing span with a textLength, given by its first letter
APART, STRETCHED = (
    "iccm-apart",
    "iccm-stretched",
)  # extra letter spacing in user units, and horizontal stretch
RAISED = "iccm-raised"  # all baseline shifts, each with its font size
SEEN = "iccm-seen"  # product of the opacities of all enclosing spans
FULL = "iccm-full"  # font size of capitals around small capitals
LINED = "iccm-lined"  # lines under, over or through the text, with font size and paint, as JSON
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
class _Setting:
    """Runs of text that are set one after another.

    A line is what lies between two absolute positions; it is anchored, and then drawn, as a whole.

    Attributes:
        parts: what has been drawn.
        width: the sum of the advances of all runs, in the text's units.
        letters: their number.
    """

    parts: "Painted" = field(default_factory=list)
    width: float = 0.0
    letters: int = 0
    _x: float = 0.0  # where the next run begins
    _y: float = 0.0
    _path: str | None = None  # that the line runs along
    _line: list["TextRun"] = field(default_factory=list)  # pieces of the line, not drawn yet
    _runs_in_line: int = 0
    _anchor: float = 0.0  # share of the line that lies before its position

    def add(self, text: str, style: Mapping[str, str], font: Font, size: float) -> None:
        """Set a run, with a font and its size."""
        leftward = style.get("direction", "ltr").strip() == "rtl"
        vertical = style.get("writing-mode", "lr").strip() in _VERTICAL
        self._move(style, vertical=vertical)
        if not self._line:
            anchor = _ANCHORS.get(style.get("text-anchor", "start").strip(), 0.0)
            self._anchor, self._runs_in_line = 1 - anchor if leftward else anchor, 0
        self._runs_in_line += 1
        extra_spacing, stretch = float(style.get(APART, "0")), float(style.get(STRETCHED, "1"))
        spacing = Spacing(
            (_spacing(style, "letter-spacing") + extra_spacing) / size,
            _spacing(style, "word-spacing") / size,
        )
        track = _Track(style[ALONG], style.get("startOffset", "0")) if ALONG in style else None
        rotation = _degrees(style.get("rotate", "0"))
        y = self._y - _baseline_height(style, font, size, vertical)
        paint, lines = _paint(style), tuple(json.loads(style.get(LINED, "[]")))
        for part in _upright_apart(text, style) if vertical else in_visual_order(text, leftward=leftward):
            upright = vertical and _is_upright(part, style)
            ems = font.line_height + spacing.letters if upright else font.width(part, spacing)
            advance = size * ems * stretch
            self._line.append(
                TextRun(
                    *(part, font, size, self._x, y, spacing, stretch, track, rotation, paint),
                    *(advance, lines, vertical, upright),
                )
            )
            self._x += advance
            self.width += advance
        if self._runs_in_line > 1 and (
            leftward or any(font.runs_leftward(piece.text) for piece in self._line)
        ):
            raise _NotPlainError("letters run both ways in several spans of a line")
        self.letters += len(text)

    def _move(self, style: Mapping[str, str], *, vertical: bool) -> None:
        """Go to the position that a run's style gives; an absolute one begins another line."""
        if style.get(ALONG) != self._path:  # on a path, x of the text counts and y does not
            self._path, has_letters = style.get(ALONG), bool(self._line)
            self.end_line()
            self._x, self._y = 0.0 if has_letters else self._x, 0.0
        place = {name: _place(style[name], name) for name in _MOVES if name in style}
        if vertical:  # in a plane whose x points down and whose y points to the left
            if ALONG in style:
                raise _NotPlainError("vertical text on a path is not supported")
            place = {_TURNED[name]: _TURNED_SIGN[name] * value for name, value in place.items()}
        if ALONG in style:
            place.pop("y", None)
        if "x" in place or "y" in place:
            self.end_line()
            self._x, self._y = place.get("x", self._x), place.get("y", self._y)
        self._x += place.get("dx", 0.0)
        self._y += place.get("dy", 0.0)

    def end_line(self) -> None:
        """Draw the line; neighbouring parts of the same paint become one."""
        shift = self._anchor * (self._x - self._line[0].x) if self._line else 0.0
        for paint, data in (part for piece in self._line for part in piece.draw(shift)):
            if self.parts and self.parts[-1][0] == paint:
                self.parts[-1] = paint, self.parts[-1][1] + data
            else:
                self.parts.append((paint, data))
        self._line.clear()


def _baseline_height(style: Mapping[str, str], font: Font, size: float, vertical: bool) -> float:
    """Return how far the baseline of a run lies above that of its line."""
    raised = sum(_raised(shift, font) for shift in style.get(RAISED, "").split())
    baseline = style.get("alignment-baseline", style.get("dominant-baseline", "auto")).strip()
    if vertical and baseline == "auto":
        baseline = "central"
    return raised - float(style.get(FULL, size)) * _BASELINES[baseline](font)


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
        for letter in _transformed(text, style) if "text-transform" in style else text:
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
class TextRun:
    """Letters that are set one after the other.

    Attributes:
        text: the letters.
        font, size: their font and its size.
        x, y: position of the first one; on a path, offset along it and across it.
        spacing, stretch: extra spacing and horizontal stretch.
        track: the path that they follow, if any.
        rotation: rotation of each letter in degrees.
        paint: the values of all of PAINT.
        advance: length along the line.
        lines: kind, font size and paint of each line under, over or through it.
        vertical: whether x and y are in a plane whose x points down and whose y points to the left.
        upright: whether the letter stands upright in a vertical line.
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
    advance: float
    lines: tuple[Any, ...]
    vertical: bool
    upright: bool

    def draw(self, shift: float) -> "Painted":
        """Return paints and path data of the letters and their lines, moved to the left by `shift`."""
        lines = [(tuple(paint), self._line(kind, size, shift)) for kind, size, paint in self.lines]
        through = [line for line, (kind, _, _) in zip(lines, self.lines) if kind == "line-through"]
        below = [line for line in lines if line not in through]
        return [*below, (self.paint, self._draw_letters(shift)), *through]

    def _line(self, kind: str, size: float, shift: float) -> str:
        """Return the path data of a line; it runs around like the letters' contours.

        As in Chromium it is below the baseline by half its width, or above the ascenders, or at a third of these.
        """
        if self.track is not None:
            raise _NotPlainError("lines under text on a path are not supported")
        width = LINE_EMS * size
        down = {
            "underline": width / 2,
            "overline": -self.font.ascent * size - width,
            "line-through": -self.font.ascent * size / 3 - width / 2,
        }[kind]
        start = complex(self.x - shift, self.y + down)
        corners = start + np.array([0, self.advance, self.advance + 1j * width, 1j * width])
        if not self.font.is_clockwise:
            corners = corners[::-1]
        points = affine.rotation(90 if self.vertical else 0)(corners).tolist()
        return "M" + "L".join(f"{point.real!r} {point.imag!r}" for point in points) + "Z"

    def _draw_letters(self, shift: float) -> str:
        linear = affine.rotation(self.rotation) @ Affine.matrix(
            self.size * self.stretch, 0, 0, self.size, 0, 0
        )

        def place(begin: float, advance: float) -> Affine | None:
            offset = self.x - shift + self.size * self.stretch * begin
            if self.upright:  # in the middle of the line, from its ascenders on
                middle = -(self.y - self.size * (self.font.ascent - self.font.descent) / 2)
                left = middle - self.size * self.font.width(self.text) / 2
                return affine.translation(left, offset + self.size * self.font.ascent) @ linear
            if self.vertical:
                return affine.rotation(90) @ affine.translation(offset, self.y) @ linear
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


def _paint(style: Mapping[str, str]) -> tuple[str, ...]:
    """Return the values of all of PAINT."""
    return tuple(style.get({"opacity": SEEN}.get(name, name), default) for name, default in PAINT.items())


def _with_decoration(properties: dict[str, str]) -> dict[str, str]:
    """Return an element's properties with its `text-decoration` added to what it inherits, as LINED has it.

    These are lines under, over or through the text, in the size and paint of the element that draws them.
    """
    decorated = dict(properties)
    words = f"{decorated.pop('text-decoration', '')} {decorated.pop('text-decoration-line', '')}".split()
    size = fonts_in_css.px(decorated.get("font-size", ""))
    decorations = [[line, size, _paint(decorated)] for line in _LINES if line in words]
    if decorations:
        decorated[LINED] = json.dumps(json.loads(decorated.get(LINED, "[]")) + decorations)
    return decorated


def _is_upright(text: str, style: Mapping[str, str]) -> bool:
    """Return whether a letter stands upright in vertical text."""
    if style.get("text-orientation", "mixed").strip() != "mixed":
        return style["text-orientation"].strip() == "upright"
    return any(low <= ord(text[0]) <= high for low, high in _UPRIGHT_LETTERS)


def _upright_apart(text: str, style: Mapping[str, str]) -> list[str]:
    """Split text into letters that stand upright, and runs of the others."""
    parts: list[str] = []
    for upright, letters in groupby(text, key=lambda letter: _is_upright(letter, style)):
        run = list(letters)
        parts += run if upright else ["".join(run)]
    return parts


def _transformed(text: str, style: Mapping[str, str]) -> str:
    """Return text with CSS's `text-transform` applied to letters that stay single letters."""
    kind = style.get("text-transform", "none").strip()
    letters = []
    for before, letter in zip(" " + text, text):
        raised = kind == "uppercase" or (kind == "capitalize" and not before.isalnum())
        changed = letter.upper() if raised else letter.lower() if kind == "lowercase" else letter
        letters.append(changed if len(changed) == 1 else letter)
    return "".join(letters)


def _raised(shift: str, font: Font) -> float:
    """Return how far a `baseline-shift` raises text, in user units; it is given with its font size as "value@size"."""
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
