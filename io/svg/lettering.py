"""Text as the outlines of its letters, where the font that it asks for is found (by fontconfig, or by matplotlib where
that is missing) and it is set plainly.

What needs more than lines of letters, such as scripts that run both ways, stays text.
"""

import re
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from ...curve import Curve
from ...errors import InputError
from .. import limits
from . import affine
from .affine import Affine
from .budget import Quota
from .document import length, local
from .fonts import Font, Spacing
from .path_data import subpaths

SECONDS = 5  # that fontconfig may take
INHERITED = (
    *("font", "font-family", "font-size", "font-style", "font-weight", "text-anchor", "direction"),
    *("letter-spacing", "word-spacing"),
)
_WEIGHTS = {"normal": 400, "bold": 700, "bolder": 700, "lighter": 300}
_FONTCONFIG = {100: 0, 200: 40, 300: 50, 400: 80, 500: 100, 600: 180, 700: 200, 800: 205, 900: 210}
_GENERIC = {"serif", "sans-serif", "monospace", "cursive", "fantasy", "system-ui"}
_ANCHORS = {"start": 0.0, "middle": 0.5, "end": 1.0}
# What moves letters in ways that are not known here, unless it has one of these values.
_PLAIN = {
    **dict.fromkeys(("dominant-baseline", "alignment-baseline"), ("auto", "alphabetic", "baseline")),
    "baseline-shift": ("0", "0px", "baseline"),
    "writing-mode": ("lr", "lr-tb", "horizontal-tb"),
    "direction": ("ltr",),
    **dict.fromkeys(("font", "inline-size", "shape-inside"), ()),
}


class _NotPlainError(Exception):
    """Text that is not outlined."""


@lru_cache(maxsize=64)
def _matched(family: str, weight: int, slant: int) -> Font | None:
    """The font of a family; None where fontconfig would put another in its place."""
    command = shutil.which("fc-match")
    if command is None:
        return _listed(family, weight, slant)
    asked = re.sub(r"([\\\-:,])", r"\\\1", family)
    near = _FONTCONFIG[min(900, max(100, round(weight, -2)))]
    line = [command, "-f", "%{family}\n%{file}\n%{index}", f"{asked}:weight={near}:slant={slant}"]
    try:
        said = subprocess.run(line, capture_output=True, text=True, timeout=SECONDS, check=True).stdout
        names, path, number = said.split("\n")[:3]
        if family not in _GENERIC and family not in names.casefold().split(","):
            return None
        return Font(path, int(number) & 0xFFFF if path.lower().endswith((".ttc", ".otc")) else 0, weight)
    except Exception:  # fontconfig or a font file that is broken is one that is not there
        return None


def _listed(family: str, weight: int, slant: int) -> Font | None:
    """The font of a family among those that matplotlib finds in the system's folders, where there is no fontconfig."""
    try:
        from matplotlib import font_manager

        styles: dict[int, Literal["normal", "italic", "oblique"]] = {
            0: "normal",
            100: "italic",
            110: "oblique",
        }
        style = styles[slant]
        asked = font_manager.FontProperties(family=[family], weight=weight, style=style)
        path = font_manager.findfont(asked, fallback_to_default=False)
        return Font(str(path), 0, weight)
    except Exception:  # a family that is not there, or a font file that is broken
        return None


def finder() -> str:
    """What finds the fonts of drawings on this system."""
    command = shutil.which("fc-match")
    return (
        f"found by {command}"
        if command
        else "fc-match is missing; found by matplotlib, without font collections"
    )


class Lettering:
    """Outlines the text of a document.

    Args:
        own: gives an element's attributes and styles.
        linked: gives the element that another one's link names.
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
        """A <text>, of which what applies to it is known, as path data in its own units; None where it stays text.

        Raises:
            InputError: there are too many letters.
        """
        try:
            runs = self._runs(element, properties, element.get(_SPACE) == "preserve")
            return self._fitted(runs, properties) or None
        except _NotPlainError:
            return None

    def _runs(self, element: Element, said: Mapping[str, str], kept: bool) -> list["Run"]:
        """Texts and what applies to each; of all that follow the first in an element places are taken out."""
        if any(name in said and said[name].strip() not in plain for name, plain in _PLAIN.items()):
            raise _NotPlainError
        along = said.get(ALONG, "")
        later = {k: v for k, v in said.items() if k not in _PLACES}
        text = _spaced(element.text or "", kept)
        found = _by_letter(text.lstrip() if local(element) == "text" or "x" in said else text, said)
        for child in element:
            if local(child) in ("title", "desc", "metadata"):
                continue
            own = dict(self._own(child))
            painted = any(own.get(name, said.get(name)) != said.get(name) for name in _PAINT)
            inner = later | {k: v for k, v in own.items() if v != "inherit"}
            if local(child) == "textPath" and not along:
                inner[ALONG] = self._along(child)
            elif local(child) != "tspan" or "textLength" in own:
                raise _NotPlainError
            if own.get("display") == "none" or painted:
                raise _NotPlainError
            found += self._runs(child, inner, kept or child.get(_SPACE) == "preserve")
            if local(child) == "textPath" and (child.tail or "").strip():
                raise _NotPlainError
            found.append((_spaced(child.tail or "", kept), later))
        return found

    def _along(self, element: Element) -> str:
        """The path data that a <textPath> names, in the text's units."""
        found = self._linked(element)
        own = self._own(found) if found is not None else {}
        if found is None or local(found) != "path" or element.get("side", "left") != "left":
            raise _NotPlainError
        return f"{own.get('transform', '')}|{own.get('d', '')}"

    def _fitted(self, runs: Sequence["Run"], said: Mapping[str, str]) -> str:
        """Path data of runs, as long as the text asks for."""
        if "textLength" not in said:
            return self._set(runs)[0]
        wanted = _place(said["textLength"], "textLength")
        _, natural, letters = self._set(runs)
        if any(set(_PLACES) & set(own) for _, own in runs[1:]) or natural <= 0 or wanted <= 0:
            raise _NotPlainError
        if said.get("lengthAdjust", "spacing").strip() == "spacingAndGlyphs":
            return self._set(runs, stretch=wanted / natural)[0]
        return self._set(runs, apart=(wanted - natural) / max(1, letters - 1))[0]

    def _set(self, runs: Sequence["Run"], apart: float = 0.0, stretch: float = 1.0) -> tuple[str, float, int]:
        """Path data of runs, those between two places that are said anchored together, their width, and how many
        letters they have.

        Args:
            runs: texts and what applies to each.
            apart: user units more between letters.
            stretch: of letters and their distances.
        """
        drawn, x, y, before = "", 0.0, 0.0, " "
        line: list[Piece] = []
        anchor = 0.0
        count, width = 0, 0.0
        path: str | None = None

        def end() -> str:
            shift = anchor * (x - line[0].x) if line else 0.0
            return "".join(piece.draw(shift) for piece in line)

        texts = [text for text, _ in runs]
        last = max((k for k, text in enumerate(texts) if text.strip()), default=-1)
        for k, (text, said) in enumerate(runs):
            text = text.rstrip() if k == last else text if k < last else ""
            if before.endswith(" ") or any(name in said for name in "xy"):
                text = text.lstrip()
            if said.get(ALONG) != path:  # along a path x of the text counts, and y does not
                path = said.get(ALONG)
                drawn, line, x, y = drawn + end(), [], 0.0 if line else x, 0.0
            place = {name: _place(said[name], name) for name in _MOVES if name in said}
            if "x" in place or "y" in place:
                drawn, line = drawn + end(), []
                x, y = place.get("x", x), place.get("y", y)
            x, y = x + place.get("dx", 0.0), y + place.get("dy", 0.0)
            if not line:
                anchor = _ANCHORS.get(said.get("text-anchor", "start").strip(), 0.0)
            if not text:
                continue
            font, size = self._font(said, text)
            spacing = Spacing(
                (_spacing(said, "letter-spacing") + apart) / size, _spacing(said, "word-spacing") / size
            )
            along = _Track(said[ALONG], said.get("startOffset", "0")) if ALONG in said else None
            turn = _degrees(said.get("rotate", "0"))
            line.append(Piece(text, font, size, x, y, spacing, stretch, along, turn))
            if len(line) > 1 and any(font.runs_leftward(part.text) for part in line):
                raise _NotPlainError
            advance = size * font.width(text, spacing) * stretch
            x, before = x + advance, text
            count, width = count + len(text), width + advance
        return drawn + end(), width - apart, count

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
            if font and font.sets(text) and size > 0:
                return font, size
            if font:
                break
        raise _NotPlainError


ALONG = "iccm-along"  # a property of our own: the path that a text runs along
_MOVES = ("x", "y", "dx", "dy")
_PLACES = (*_MOVES, "rotate", "textLength", "lengthAdjust")
_PAINT = ("fill", "stroke", "stroke-width", "opacity", "fill-opacity", "stroke-opacity", "visibility")
"""What is one for all letters of a text."""
_SPACE = "{http://www.w3.org/XML/1998/namespace}space"
Run = tuple[str, Mapping[str, str]]


@dataclass(frozen=True, eq=False)
class Piece:
    """Letters that are set one after the other.

    Attributes:
        text: the letters.
        font, size: what they are set in.
        x, y: where the first one begins; along a path, by how much it is moved along and across.
        spacing, stretch: how they are set.
        along: the path that they are set along, if any.
        turn: degrees that each is rotated by.
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

    def draw(self, shift: float) -> str:
        """Path data, so much further to the left."""
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
    """A path that letters are set along.

    Args:
        path: its transform and data, between them a bar.
        offset: where the text begins on it, a length or a part.
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
        """The frame at a distance from where the text begins; None beyond the ends of the path."""
        s = self.start + distance
        if not 0 <= s <= self.curve.length:
            return None
        near = 1e-4 * self.curve.length
        ends = self.curve.at(np.clip(np.array([s - near, s, s + near]), 0, self.curve.length))
        tangent = complex(ends[2] - ends[0])
        return Affine(tangent / abs(tangent), 0, complex(ends[1])) if tangent else None


def _spaced(text: str, kept: bool) -> str:
    return re.sub(r"[\n\t\r]" if kept else r"[\n\t\r ]+", " ", text)


def _by_letter(text: str, said: Mapping[str, str]) -> list[Run]:
    """A text as the parts that have separate places; all that follow have those that are not said."""
    lists = {name: re.split(r"[\s,]+", said[name].strip()) for name in (*_MOVES, "rotate") if name in said}
    most = max(map(len, lists.values()), default=0)
    if most < 2:
        return [(text, said)]
    rest = {k: v for k, v in said.items() if k not in _PLACES}
    turn = {"rotate": said["rotate"]} if "rotate" in said else {}
    found: list[Run] = []
    for k, letter in enumerate(text[:most]):
        own = {name: values[k] for name, values in lists.items() if k < len(values) and name != "rotate"}
        if turn:
            own["rotate"] = lists["rotate"][min(k, len(lists["rotate"]) - 1)]
        kept = {k: v for k, v in said.items() if k in ("textLength", "lengthAdjust")} if not found else {}
        found.append((letter, rest | own | kept))
    if text[most:]:
        found.append((text[most:], rest | ({"rotate": lists["rotate"][-1]} if turn else {})))
    return found


def _place(text: str, axis: str) -> float:
    """A single length; more are not known here."""
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
