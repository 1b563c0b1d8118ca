"""Text set in a font file: `font.ttf#text=Word`, 100 units per em, y down, letters as parts, counters as holes.

Axes of a variable font come before the text: `font.ttf#wght=700&wdth=85&text=Word`.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import shapely

from ...arrays import Complex
from ...curve import polygon_of
from ...errors import InputError
from .. import files, formats, limits
from ..svg.affine import Affine
from ..svg.drawing_content import DrawingContent, Rectangle
from ..svg.fill import FilledOutline, outlines
from ..svg.fonts import Font
from ..svg.installed_fonts import font_file
from ..svg.path_data import subpaths

UNITS_PER_EM = 100.0
TEXT = "text="
_SELECTION = re.compile(r"((?:[A-Za-z0-9]{4}=[-+.\d]+&)*)text=(.*)", re.DOTALL)
_VARIATION = re.compile(r"([A-Za-z0-9]{4})=([-+]?(?:\d+\.?\d*|\.\d+))")
LINE_EMS = 0.8, 1.0  # least height of the canvas above the baseline, and in all, in ems
BASELINE = LINE_EMS[0] * UNITS_PER_EM
"""Ordinate of the baseline."""
DEFAULT_FONT = Path(__file__).parent / "DejaVuSans-Bold.ttf"
"""A font that every installation has; its licence lies beside it."""
STYLES: dict[str, dict[str, int]] = {
    "light": {"weight": 300},
    "regular": {"weight": 400},
    "medium": {"weight": 500},
    "semibold": {"weight": 600},
    "bold": {"weight": 700},
    "black": {"weight": 900},
    "italic": {"slant": 100},
    "oblique": {"slant": 110},
}
"""Words at the end of a font's name: weights as in CSS, and slants of fontconfig."""
SVG_FLATNESS = 1e-4  # of the rings from which the canvas of an SVG follows, relative to the size of each
SVG_SPACE = "http://www.w3.org/2000/svg"
SAY = "a font needs a text, such as {}#text=Word"


def spec(text: str, font: str | None = None, variation: str | None = None) -> str:
    """Return the spec of a text in a font: `font.ttf#text=Word`, or `font.ttf#wght=700&text=Word`.

    Args:
        text: the text; `#bbox` or `#canvas` at its end selects its box.
        variation: values of a variable font's axes, such as `wght=700,wdth=85`.
        font: a font file, or the name of an installed font such as `DejaVu Serif Bold`; DejaVu Sans Bold, which comes
            with iccm, by default.

    Raises:
        InputError: there is no such font, or it is part of a collection; or the variation is malformed.
    """
    axes = ""
    if variation is not None:
        parts = [part.strip() for part in variation.split(",")]
        wrong = [part for part in parts if not _VARIATION.fullmatch(part)]
        if wrong:
            reason = f"{wrong[0]!r} is not an axis and a number"
            raise InputError(f"--font-variation {variation}: {reason}; write wght=700, or wght=700,wdth=85")
        axes = "".join(f"{part}&" for part in parts)
    file = _file(text, font)
    return f"{file}#{axes}{TEXT}{text}"


def _file(text: str, font: str | None) -> str:
    """Return the file of a font, given by a file or a name.

    Raises:
        InputError: there is no such font, or the text is empty.
    """
    if not text.strip():
        raise InputError("--text: is empty; write the text to set, such as --text Hello")
    if font is None:
        return str(DEFAULT_FONT)
    if formats.suffix_of(font) in formats.WEB_FONTS:
        raise InputError(f"--font {font}: {formats.WEB_FONT}")
    if formats.suffix_of(font) in formats.FONTS or Path(font).exists():
        return font
    family, weight, slant = _style(font)
    file = font_file(family, weight, slant)
    if file is None:
        raise InputError(
            f"--font {font}: there is no such font file, and no font with this name is installed; name a .ttf or "
            ".otf file"
        )
    if formats.suffix_of(file[0]) not in formats.FONTS:
        raise InputError(
            f"--font {font}: is stored in {file[0]}, which is not a .ttf or .otf file; name such a file"
        )
    return file[0]


def _style(name: str) -> tuple[str, int, int]:
    """Return family in lower case, weight and slant of a font's name, such as `DejaVu Serif Bold Italic`."""
    words = name.casefold().split()
    weight, slant = 400, 0
    while len(words) > 1 and words[-1] in STYLES:
        style = STYLES[words.pop()]
        weight, slant = style.get("weight", weight), style.get("slant", slant)
    return " ".join(words), weight, slant


@dataclass(frozen=True, eq=False)
class TextLine:
    """A line of text set in a font, y down, with its baseline below the top of the canvas.

    Attributes:
        name: the text as selected in the spec, `text=Word`.
        text: the text.
        glyphs: path data and colour of each glyph or layer of a glyph, with the index in the text of the first letter
            that it represents; the colour is empty for the colour of the text.
        canvas: x, y, width and height of a box around the line and all that it paints.
        letters: the rings of all glyphs, each with the index of its letter.
    """

    name: str
    text: str
    glyphs: list[tuple[int, str, str]]
    canvas: Rectangle
    letters: list[tuple[int, Complex]]


def read(
    path: Path, selection: str | None = None, *, flatness: float = 1e-4, max_bytes: int = limits.DRAWING_BYTES
) -> DrawingContent:
    """Return the outlines of a line of text with kerning and ligatures.

    Raises:
        InputError: no text is given, the file is not a font, or lacks letters.
    """
    line = _set(path, selection, flatness, max_bytes)
    letter_outlines, refused = outlines([z for _, z in line.letters], "nonzero", repr(line.text[:40]))
    letter_outlines = [
        replace(outline, names=(line.name,), element=letter)
        for outline, letter in zip(letter_outlines, _letters_of(letter_outlines, line.letters))
    ]
    return DrawingContent(
        letter_outlines,
        line.canvas,
        flip=True,
        refused=refused,
        ids={line.name: None},
        coloured=any(colour for _, _, colour in line.glyphs),
    )


def svg(path: Path, selection: str | None = None, *, max_bytes: int = limits.DRAWING_BYTES) -> bytes:
    """Return a line of text as an SVG file in the coordinates of `read`: a black path for each glyph.

    Raises:
        InputError: as for `read`.
    """
    line = _set(path, selection, SVG_FLATNESS, max_bytes)
    top = Element("svg", {"xmlns": SVG_SPACE, "viewBox": " ".join(f"{side:.9g}" for side in line.canvas)})
    group = SubElement(top, "g", {"aria-label": line.text})
    seen = set[int]()
    for letter, data, colour in line.glyphs:
        if data:
            name = {"id": f"letter-{letter + 1}"} if letter not in seen or not colour else {}
            SubElement(group, "path", {**name, "d": data, **({"fill": colour} if colour else {})})
            seen.add(letter)
    return tostring(top)


def _set(path: Path, selection: str | None, flatness: float, max_bytes: int) -> TextLine:
    """Return the line of text that a spec selects, with curves flattened for its rings and kept in its path data.

    Raises:
        InputError: as for `read`.
    """
    files.open_input(path, max_bytes=max_bytes)
    match = _SELECTION.fullmatch(selection or "")
    if match is None or not (text := match[2].strip()):
        raise InputError(f"{path}: {SAY.format(path.name)}")
    if len(text) > limits.SVG_LETTERS:
        raise InputError(f"{path}: the text has more than {limits.SVG_LETTERS} letters; shorten it")
    with path.open("rb") as content:
        if content.read(4) in formats.WEB_FONTS.values():
            raise InputError(f"{path}: {formats.WEB_FONT}")
    try:
        font = Font(files.as_text(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: cannot read this font: {error}") from None
    _vary(font, match[1], path)
    try:
        sets, width = font.sets(text), font.width(text) * UNITS_PER_EM
        reason = font.undrawn(text) if sets else ""
        glyphs = font.set_at(text, 0.0, BASELINE, UNITS_PER_EM) if sets else []
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: cannot read this font: {error}") from None
    if reason:
        raise InputError(f"{path}: {reason}; name a font with outlines")
    if not sets:
        raise InputError(
            f"{path}: not a font, or it lacks letters of {text[:40]!r}, or the text mixes writing directions"
        )
    letters = [(letter, run.z) for letter, data, _ in glyphs for run in subpaths(data, Affine(), flatness)]
    if not letters:
        raise InputError(f"{path}: {text[:40]!r} draws nothing")
    points = np.concatenate([z for _, z in letters])
    left, top = min(0.0, points.real.min()), min(0.0, points.imag.min())
    right, bottom = max(width, points.real.max()), max(LINE_EMS[1] * UNITS_PER_EM, points.imag.max())
    canvas = float(left), float(top), float(right - left), float(bottom - top)
    return TextLine(selection or "", text, glyphs, canvas, letters)


def _vary(font: Font, variation: str, path: Path) -> None:
    """Set the axes of a variable font, given as `wght=700&`.

    Raises:
        InputError: the font lacks an axis, or a value is out of its range.
    """
    values = dict[str, float]()
    for part in filter(None, variation.split("&")):
        if not (match := _VARIATION.fullmatch(part)):
            raise InputError(f"{path}: {part!r} is not an axis and a number, such as wght=700")
        values[match[1]] = float(match[2])
    axes = font.axes
    for name, value in values.items():
        if name not in axes:
            known = ", ".join(f"{axis} {low:g} to {high:g}" for axis, (low, high) in axes.items())
            raise InputError(
                f"{path}: has no axis {name!r}; {f'it has {known}' if known else 'it is not a variable font'}"
            )
        low, high = axes[name]
        if not low <= value <= high:
            raise InputError(
                f"{path}: {name}={value:g} is out of range; {name} goes from {low:g} to {high:g}"
            )
    if values:
        font.vary(values)


def _letters_of(outlines: Sequence[FilledOutline], letters: Sequence[tuple[int, Complex]]) -> list[int]:
    """Return the letter that each outline belongs to; if it joins several, the one with the largest area in it.

    `letters` has the rings of all glyphs, each with the index of its letter in the text.
    """
    areas = shapely.make_valid([polygon_of(z) if z.size > 2 else shapely.Polygon() for _, z in letters])
    numbers = np.array([letter for letter, _ in letters])
    tree = shapely.STRtree(areas)
    letters_of_outlines = []
    for outline in outlines:
        region = shapely.make_valid(polygon_of(outline.z))
        nearby = tree.query(region)
        common = np.bincount(numbers[nearby], shapely.area(shapely.intersection(areas[nearby], region)))
        letters_of_outlines.append(int(common.argmax()))
    return letters_of_outlines
