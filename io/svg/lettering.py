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
    found = font_file(family, weight, slant)
    try:
        return Font(*found, weight) if found else None
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
    asked = re.sub(r"([\\\-:,])", r"\\\1", family)
    near = _FONTCONFIG[min(900, max(100, round(weight, -2)))]
    line = [command, "-f", "%{family}\n%{file}\n%{index}", f"{asked}:weight={near}:slant={slant}"]
    try:
        said = subprocess.run(
            line, capture_output=True, text=True, timeout=FONTCONFIG_SECONDS, check=True
        ).stdout
        names, path, number = said.split("\n")[:3]
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
        asked = font_manager.FontProperties(family=[family], weight=weight, style=style)
        return str(font_manager.findfont(asked, fallback_to_default=False)), 0
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
        own: returns an element's attributes and styles.
        linked: returns the element that another one links to.
    """

    def __init__(
        self,
        own: Callable[[Element], Mapping[str, str]],
        linked: Callable[[Element], Element | None] = lambda _: None,
    ):
        self._own, self._linked = own, linked
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
        found = self.painted(element, properties)
        return None if found is None else "".join(data for _, data in found)

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
            drawn = self._fitted(spans, properties)
        except _NotPlainError:
            return None
        if len({key for key, _ in drawn}) > 1 and any("url(" in value for key, _ in drawn for value in key):
            return None  # gradients and patterns refer to the box of the whole text
        return [(dict(zip(PAINT, key)), data) for key, data in drawn] or None

    @staticmethod
    def plain(properties: Mapping[str, str]) -> dict[str, str]:
        """Return the paint of letters that have only the properties of their <text>."""
        return {name: properties.get(name, default) for name, default in PAINT.items()} | {"opacity": "1"}

    def _collect(self, element: Element, said: Mapping[str, str], kept: bool, spans: "_Spans") -> None:
        """Add the letters in an element, with the properties and listed positions that apply to each."""
        if any(name in said and said[name].strip() not in plain for name, plain in _PLAIN.items()):
            raise _NotPlainError
        begin = spans.count
        later = {k: v for k, v in said.items() if k not in _OWN}
        spans.add(element.text or "", later, kept)
        for child in element:
            if local(child) in ("title", "desc", "metadata"):
                continue
            own = dict(self._own(child))
            if own.get("display") != "none":
                self._collect_child(child, own, later, kept, spans)
            if local(child) == "textPath" and (child.tail or "").strip():
                raise _NotPlainError
            spans.add(child.tail or "", later, kept)
        spans.place(begin, said)

    def _collect_child(
        self, child: Element, own: dict[str, str], outer: Mapping[str, str], kept: bool, spans: "_Spans"
    ) -> None:
        """Add the letters of a <tspan> or <textPath> in a text."""
        inner = dict(outer) | {k: v for k, v in own.items() if v != "inherit"}
        try:
            if "font-size" in own:
                around = fonts_in_css.px(outer.get("font-size", ""))
                inner["font-size"] = repr(
                    fonts_in_css.size(own["font-size"], around, fonts_in_css.MEDIUM_PIXELS)
                )
        except InputError:
            raise _NotPlainError from None
        size = fonts_in_css.px(inner.get("font-size", ""))
        for name in fonts_in_css.LENGTHS.intersection(own):
            inner[name] = fonts_in_css.without_ems(inner[name], size, fonts_in_css.MEDIUM_PIXELS)
        if local(child) == "textPath" and ALONG not in outer:
            inner[ALONG] = self._along(child)
        elif local(child) != "tspan":
            raise _NotPlainError
        if "opacity" in own:
            inner[SEEN] = repr(_number(own["opacity"]) * _number(outer.get(SEEN, "1")))
        raised = own.get("baseline-shift", "baseline").strip()
        if raised not in ("0", "0px", "baseline"):
            inner[RAISED] = f"{outer.get(RAISED, '')} {raised}@{size!r}"
        if "textLength" in own:
            if FITTED in outer:
                raise _NotPlainError
            inner[FITTED] = f"{spans.count}"
        self._collect(child, inner, kept or child.get(_SPACE) == "preserve", spans)

    def _along(self, element: Element) -> str:
        """Return the path data that a <textPath> refers to, in the text's units."""
        found = self._linked(element)
        own = self._own(found) if found is not None else {}
        if found is None or local(found) != "path" or element.get("side", "left") != "left":
            raise _NotPlainError
        return f"{own.get('transform', '')}|{own.get('d', '')}"

    def _fitted(self, spans: "_Spans", said: Mapping[str, str]) -> "Painted":
        """Return the path data of a text, with spans stretched to their `textLength`."""
        runs = spans.runs()
        for span in dict.fromkeys(own[FITTED] for _, own in runs if FITTED in own):
            chosen = [k for k, (_, own) in enumerate(runs) if own.get(FITTED) == span]
            some = self._stretched([runs[k] for k in chosen], spans.lengths[int(span)])
            for k, run in zip(chosen, some):
                runs[k] = run
        if "textLength" in said:
            if any(FITTED in own for _, own in runs):
                raise _NotPlainError
            runs = self._stretched(runs, said)
        return self._set(runs)[0]

    def _stretched(self, runs: list["Run"], said: Mapping[str, str]) -> list["Run"]:
        """Return runs stretched to a total length of `textLength`."""
        wanted = _place(said["textLength"], "textLength")
        _, natural, letters = self._set(runs)
        if any(set(_PLACES) & set(own) for _, own in runs[1:]) or natural <= 0 or wanted <= 0:
            raise _NotPlainError
        if said.get("lengthAdjust", "spacing").strip() == "spacingAndGlyphs":
            more = {STRETCHED: repr(wanted / natural)}
        else:
            more = {APART: repr((wanted - natural) / max(1, letters - 1))}
        return [(text, {**own, **more}) for text, own in runs]

    def _set(self, runs: Sequence["Run"]) -> tuple["Painted", float, int]:
        """Return the path data of runs, their width, and their number of letters.

        Runs between two absolute positions are anchored together.
        """
        drawn: list[tuple[tuple[str, ...], str]] = []
        x, y = 0.0, 0.0
        line: list[Piece] = []
        anchor, runs_in_line = 0.0, 0
        count, width = 0, 0.0
        path: str | None = None

        def end() -> None:
            shift = anchor * (x - line[0].x) if line else 0.0
            for piece in line:
                if drawn and drawn[-1][0] == piece.paint:
                    drawn[-1] = piece.paint, drawn[-1][1] + piece.draw(shift)
                else:
                    drawn.append((piece.paint, piece.draw(shift)))
            line.clear()

        for text, said in runs:
            if said.get(ALONG) != path:  # on a path, x of the text counts and y does not
                path, moved = said.get(ALONG), bool(line)
                end()
                x, y = 0.0 if moved else x, 0.0
            place = {name: _place(said[name], name) for name in _MOVES if name in said}
            if ALONG in said:
                place.pop("y", None)
            if "x" in place or "y" in place:
                end()
                x, y = place.get("x", x), place.get("y", y)
            x, y = x + place.get("dx", 0.0), y + place.get("dy", 0.0)
            if not line:
                anchor, runs_in_line = _ANCHORS.get(said.get("text-anchor", "start").strip(), 0.0), 0
            runs_in_line += 1
            font, size = self._font(said, text)
            apart, stretch = float(said.get(APART, "0")), float(said.get(STRETCHED, "1"))
            spacing = Spacing(
                (_spacing(said, "letter-spacing") + apart) / size, _spacing(said, "word-spacing") / size
            )
            along = _Track(said[ALONG], said.get("startOffset", "0")) if ALONG in said else None
            turn = _degrees(said.get("rotate", "0"))
            raised = sum(_raised(shift, font) for shift in said.get(RAISED, "").split())
            paint = tuple(
                said.get({"opacity": SEEN}.get(name, name), default) for name, default in PAINT.items()
            )
            for part in in_visual_order(text):
                line.append(Piece(part, font, size, x, y - raised, spacing, stretch, along, turn, paint))
                advance = size * font.width(part, spacing) * stretch
                x, width = x + advance, width + advance
            if runs_in_line > 1 and any(font.runs_leftward(piece.text) for piece in line):
                raise _NotPlainError
            count += len(text)
        end()
        return drawn, width, count

    def _font(self, said: Mapping[str, str], text: str) -> tuple[Font, float]:
        self._letters.spend(len(text))
        try:
            size = length(said.get("font-size", "16"), None, "y", "font-size")
            weight = said.get("font-weight", "normal").strip()
            heavy = _WEIGHTS.get(weight) or int(weight)
        except (InputError, ValueError):
            raise _NotPlainError from None
        slant = {"italic": 100, "oblique": 110}.get(said.get("font-style", "normal").strip(), 0)
        for name in said.get("font-family", "").split(","):
            key = (name.strip().strip("'\"").casefold(), heavy, slant)
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
_OWN = (*_PLACES, "baseline-shift", "opacity")
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
        said: properties of each letter, except its position.
        places: position attributes of each letter, by name.
        lengths: attributes of spans with a textLength, by their first letter.
    """

    letters: list[str] = field(default_factory=list)
    said: list[Mapping[str, str]] = field(default_factory=list)
    places: list[dict[str, str]] = field(default_factory=list)
    lengths: dict[int, Mapping[str, str]] = field(default_factory=dict)
    _kept: list[bool] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of letters."""
        return len(self.letters)

    def add(self, text: str, said: Mapping[str, str], kept: bool) -> None:
        """Add a text; white space is kept, or collapsed with that before it."""
        for letter in text:
            space = letter in " \n\t\r"
            if space and not kept and (not self.letters or self.letters[-1] == " "):
                continue
            self.letters.append(" " if space else letter)
            self.said.append(said)
            self.places.append({})
            self._kept.append(kept)

    def place(self, begin: int, said: Mapping[str, str]) -> None:
        """Assign the positions that an element lists to letters from `begin` on; those of inner elements are kept."""
        end = self.count
        for name in (*_MOVES, "rotate"):
            values = re.split(r"[\s,]+", said[name].strip()) if name in said else []
            if name == "rotate" and values:
                values += values[-1:] * (end - begin - len(values))
            for own, value in zip(self.places[begin:end], values):
                own.setdefault(name, value)
        if "textLength" in said:
            self.lengths[begin] = said

    def runs(self) -> list[Run]:
        """Return runs of consecutive letters without separate positions and with the same properties."""
        end = self.count
        while end and self.letters[end - 1] == " " and not self._kept[end - 1]:
            end -= 1
        found: list[tuple[str, dict[str, str], Mapping[str, str]]] = []
        for letter, said, place in zip(self.letters[:end], self.said, self.places):
            turn = place.get("rotate", "0")
            alike = found and found[-1][2] is said and found[-1][1].get("rotate", "0") == turn
            if alike and not set(_MOVES) & set(place):
                found[-1] = found[-1][0] + letter, *found[-1][1:]
            else:
                found.append((letter, place, said))
        return [(text, {**said, **place}) for text, place, said in found]


@dataclass(frozen=True, eq=False)
class Piece:
    """Letters that are set one after the other.

    Attributes:
        text: the letters.
        font, size: their font and its size.
        x, y: position of the first one; on a path, offset along it and across it.
        spacing, stretch: extra spacing and horizontal stretch.
        along: the path that they follow, if any.
        turn: rotation of each letter in degrees.
        paint: the values of all of PAINT.
    """

    text: str
    font: Font
    size: float
    x: float
    y: float
    spacing: Spacing
    stretch: float
    along: "_Track | None"
    turn: float
    paint: tuple[str, ...]

    def draw(self, shift: float) -> str:
        """Return the path data, moved to the left by `shift`."""
        linear = affine.rotation(self.turn) @ Affine.matrix(self.size * self.stretch, 0, 0, self.size, 0, 0)

        def place(begin: float, advance: float) -> Affine | None:
            at = self.x - shift + self.size * self.stretch * begin
            if self.along is None:
                return affine.translation(at, self.y) @ linear
            half = self.size * self.stretch * advance / 2
            middle = self.along.at(at + half)
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
            whole = self.curve.length
            self.start = length(offset, (whole, whole), "x", "startOffset")
        except InputError:
            raise _NotPlainError from None

    def at(self, distance: float) -> Affine | None:
        """Return the frame at a distance from the start of the text; None beyond the ends of the path."""
        s = self.start + distance
        if not 0 <= s <= self.curve.length:
            return None
        near = 1e-4 * self.curve.length
        ends = self.curve.at(np.clip(np.array([s - near, s, s + near]), 0, self.curve.length))
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


def _spacing(said: Mapping[str, str], name: str) -> float:
    text = said.get(name, "normal").strip()
    return 0.0 if text == "normal" else _place(text, "x")


def _degrees(text: str) -> float:
    try:
        return float(text.removesuffix("deg"))
    except ValueError:
        raise _NotPlainError from None
