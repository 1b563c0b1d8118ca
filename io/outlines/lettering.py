"""Text set in a font file: `font.ttf#text=Word`, 100 units per em, y down, letters as parts, counters as holes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from ...arrays import Complex
from ...curve import polygon_of
from ...errors import InputError
from .. import files, limits
from ..svg.affine import Affine
from ..svg.drawing import Drawing
from ..svg.fill import FilledOutline, outlines
from ..svg.fonts import Font
from ..svg.path_data import subpaths

UNITS_PER_EM = 100.0
TEXT = "text="
LINE_EMS = 0.8, 1.0  # least height of the canvas above the baseline, and in all, in ems
SAY = "a font needs a text, such as {}#text=Word"


def read(
    path: Path, chosen: str | None = None, *, flatness: float = 1e-4, max_bytes: int = limits.DRAWING_BYTES
) -> Drawing:
    """Return the outlines of a line of text with kerning and ligatures.

    Raises:
        InputError: no text is given, the file is not a font, or lacks letters.
    """
    files.open_input(path, max_bytes=max_bytes)
    if not (chosen or "").startswith(TEXT) or not (text := (chosen or "")[len(TEXT) :].strip()):
        raise InputError(f"{path}: {SAY.format(path.name)}")
    if len(text) > limits.SVG_LETTERS:
        raise InputError(f"{path}: the text has more than {limits.SVG_LETTERS} letters; shorten it")
    try:
        font = Font(files.as_text(path))
        sets, width = font.sets(text), font.width(text) * UNITS_PER_EM
        glyphs = font.set_at(text, 0.0, LINE_EMS[0] * UNITS_PER_EM, UNITS_PER_EM) if sets else []
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: cannot read this font: {error}") from None
    if not sets:
        raise InputError(
            f"{path}: not a font, or it lacks letters of {text[:40]!r}, or the text mixes writing directions"
        )
    letters = [(letter, run.z) for letter, data in glyphs for run in subpaths(data, Affine(), flatness)]
    rings = [z for _, z in letters]
    if not rings:
        raise InputError(f"{path}: {text[:40]!r} draws nothing")
    found, refused = outlines(rings, "nonzero", repr(text[:40]))
    found = [
        replace(outline, names=(chosen or "",), element=letter)
        for outline, letter in zip(found, _letters_of(found, letters))
    ]
    every = np.concatenate([outline.z for outline in found])
    left, top = min(0.0, every.real.min()), min(0.0, every.imag.min())
    right, bottom = max(width, every.real.max()), max(LINE_EMS[1] * UNITS_PER_EM, every.imag.max())
    canvas = float(left), float(top), float(right - left), float(bottom - top)
    return Drawing(found, canvas, flip=True, refused=refused, ids={chosen or "": None})


def _letters_of(found: Sequence[FilledOutline], letters: Sequence[tuple[int, Complex]]) -> list[int]:
    """Return the letter that each outline belongs to; if it joins several, the one with the largest area in it.

    `letters` has the rings of all glyphs, each with the index of its letter in the text.
    """
    areas = shapely.make_valid([polygon_of(z) if z.size > 2 else shapely.Polygon() for _, z in letters])
    numbers = np.array([letter for letter, _ in letters])
    tree = shapely.STRtree(areas)
    chosen = []
    for outline in found:
        region = shapely.make_valid(polygon_of(outline.z))
        near = tree.query(region)
        common = np.bincount(numbers[near], shapely.area(shapely.intersection(areas[near], region)))
        chosen.append(int(common.argmax()))
    return chosen
