"""Text as the outlines of its letters, where the font that it asks for is found (by fontconfig, or by matplotlib where
that is missing) and it is set plainly.

What needs more than a line of letters, such as text along a path or scripts that run both ways, stays text.
"""

import re
import shutil
import subprocess
from collections.abc import Callable, Mapping
from functools import lru_cache
from xml.etree.ElementTree import Element

from ...errors import InputError
from .. import limits
from .budget import Quota
from .document import length, local
from .fonts import Font

SECONDS = 5  # that fontconfig may take
INHERITED = ("font", "font-family", "font-size", "font-style", "font-weight", "text-anchor", "direction")
_WEIGHTS = {"normal": 400, "bold": 700, "bolder": 700, "lighter": 300}
_FONTCONFIG = {100: 0, 200: 40, 300: 50, 400: 80, 500: 100, 600: 180, 700: 200, 800: 205, 900: 210}
_GENERIC = {"serif", "sans-serif", "monospace", "cursive", "fantasy", "system-ui"}
_ANCHORS = {"start": 0.0, "middle": 0.5, "end": 1.0}
# What moves letters in ways that are not known here, unless it has one of these values.
_PLAIN = {
    **dict.fromkeys(("letter-spacing", "word-spacing"), ("normal", "0", "0px")),
    **dict.fromkeys(("dominant-baseline", "alignment-baseline"), ("auto", "alphabetic", "baseline")),
    "baseline-shift": ("0", "baseline"),
    "writing-mode": ("lr", "lr-tb", "horizontal-tb"),
    "direction": ("ltr",),
    **dict.fromkeys(("font", "rotate", "textLength", "inline-size", "shape-inside"), ()),
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

        style = {0: "normal", 100: "italic", 110: "oblique"}[slant]
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
    """

    def __init__(self, own: Callable[[Element], Mapping[str, str]]):
        self._own = own
        most = limits.SVG_LETTERS
        self._letters = Quota(most, f"it draws more than {most} letters; turn text into paths")
        self._families: set[tuple[str, int, int]] = set()

    def path_data(self, element: Element, properties: Mapping[str, str]) -> str | None:
        """A <text>, of which what applies to it is known, as path data in its own units; None where it stays text.

        Raises:
            InputError: there are too many letters.
        """
        try:
            runs = self._runs(element, properties, element.get(_SPACE) == "preserve")
            return self._set(runs) or None
        except _NotPlainError:
            return None

    def _runs(
        self, element: Element, said: Mapping[str, str], kept: bool
    ) -> list[tuple[str, Mapping[str, str]]]:
        """Texts and what applies to each; of all that follow the first in an element places are taken out."""
        if any(name in said and said[name].strip() not in plain for name, plain in _PLAIN.items()):
            raise _NotPlainError
        found, later = [(element.text or "", said)], {k: v for k, v in said.items() if k not in _PLACES}
        for child in element:
            if local(child) in ("title", "desc", "metadata"):
                continue
            own = dict(self._own(child))
            painted = any(own.get(name, said.get(name)) != said.get(name) for name in _PAINT)
            if local(child) != "tspan" or own.get("display") == "none" or painted:
                raise _NotPlainError
            spaced = kept or child.get(_SPACE) == "preserve"
            found += self._runs(child, later | {k: v for k, v in own.items() if v != "inherit"}, spaced)
            found.append((child.tail or "", later))
        if kept:
            return [(re.sub(r"[\n\t\r]", " ", text), said) for text, said in found]
        return [(re.sub(r"[\n\t\r ]+", " ", text), said) for text, said in found]

    def _set(self, runs: list[tuple[str, Mapping[str, str]]]) -> str:
        """Path data of runs, those between two places that are said anchored together."""
        drawn, x, y, before = "", 0.0, 0.0, " "
        line: list[tuple[str, Font, float, float, float]] = []
        anchor = 0.0

        def end() -> str:
            shift = anchor * (x - line[0][3]) if line else 0.0
            return "".join(font.draw(text, at - shift, base, size) for text, font, size, at, base in line)

        texts = [text for text, _ in runs]
        last = max((k for k, text in enumerate(texts) if text.strip()), default=-1)
        for k, (text, said) in enumerate(runs):
            text = text.rstrip() if k == last else text if k < last else ""
            if before.endswith(" ") or any(name in said for name in "xy"):
                text = text.lstrip()
            place = {name: _place(said[name], name) for name in _PLACES if name in said}
            if "x" in place or "y" in place:
                drawn, line = drawn + end(), []
                x, y = place.get("x", x), place.get("y", y)
            x, y = x + place.get("dx", 0.0), y + place.get("dy", 0.0)
            if not line:
                anchor = _ANCHORS.get(said.get("text-anchor", "start").strip(), 0.0)
            if not text:
                continue
            font, size = self._font(said, text)
            line.append((text, font, size, x, y))
            if len(line) > 1 and any(font.runs_leftward(part[0]) for part in line):
                raise _NotPlainError
            x, before = x + size * font.width(text), text
        return drawn + end()

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


_PLACES = ("x", "y", "dx", "dy")
_PAINT = ("fill", "stroke", "stroke-width", "opacity", "fill-opacity", "stroke-opacity", "visibility")
"""What is one for all letters of a text."""
_SPACE = "{http://www.w3.org/XML/1998/namespace}space"


def _place(text: str, axis: str) -> float:
    """A single length; letters that each have a place are not set plainly."""
    try:
        return length(text, None, axis[-1])
    except InputError:
        raise _NotPlainError from None
