"""Lines of text as path data, shaped by HarfBuzz with kerning, ligatures and joined letters."""

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple
from unicodedata import bidirectional

import numpy as np

from ...arrays import Complex
from .affine import Affine, translation

# Blocks whose characters can be set in one line: Latin, Greek, Cyrillic; symbols; Chinese, Japanese, Korean.
_ANY = (
    (0x0000, 0x02FF), (0x0370, 0x058F), (0x1E00, 0x200A), (0x2010, 0x2027), (0x2030, 0x2BFF), (0x2E80, 0xD7AF),
    (0xFF00, 0xFFEF),
)  # fmt: skip
_LEFTWARD = {"R", "AL"}  # classes of Unicode's bidirectional algorithm
_EITHER_WAY = {"NSM", "WS", "ON", "CS", "ES", "ET"}
_SPACES = " \u00a0"
_FAMILY_NAME = 1
"""Number of the family in a font's table of names."""


class Spacing(NamedTuple):
    """Extra space after each letter, and after each word space, in ems."""

    letters: float = 0.0
    words: float = 0.0


NO_SPACING = Spacing()


class Glyph(NamedTuple):
    """A glyph of a line; lengths are in ems.

    Attributes:
        number: glyph id in the font.
        right, up: its origin.
        begin, advance: start and length of its part of the line.
        cluster: index in the text of the first letter that it represents.
    """

    number: int
    right: float
    up: float
    begin: float
    advance: float
    cluster: int


class Font:
    """An open font file; lengths are in ems, y up.

    Attributes:
        ascent, descent: heights of the ascenders, and depth of the descenders.
        line_height: from the descenders to the ascenders.
        family: its name.

    Args:
        path: of an OpenType or TrueType file.
        number: index of the font in a collection.
        weight: for a variable font; 400 is regular.

    Raises:
        OSError, RuntimeError: the file is not a font.
    """

    def __init__(self, path: str, number: int = 0, weight: int = 400):
        import uharfbuzz as hb

        self._font = hb.Font(hb.Face(hb.Blob.from_file_path(path), number))
        if any(axis.tag == "wght" for axis in self._font.face.axis_infos):
            self._font.set_variations({"wght": weight})
        self._em = self._font.face.upem
        self.family = self._font.face.get_name(_FAMILY_NAME) or Path(path).stem
        extents = self._font.get_font_extents("ltr")
        self.ascent, self.descent = extents.ascender / self._em, -extents.descender / self._em
        self.line_height = self.ascent + self.descent  # without a gap between lines
        self._shaped = lru_cache(maxsize=64)(self._shape)
        self._template = lru_cache(maxsize=1024)(self._draw_glyph)

    def _shape(self, text: str, spacing: Spacing = NO_SPACING) -> tuple[list[Glyph], float, bool]:
        """Return the glyphs of a line, their total width, and whether the font has every letter."""
        import uharfbuzz as hb

        buffer = hb.Buffer()
        buffer.add_str(text)
        buffer.guess_segment_properties()
        # with letter spacing, ligatures are off
        hb.shape(self._font, buffer, {"liga": False, "clig": False} if spacing.letters else {})
        glyphs, x, last = [], 0.0, -1
        for info, place in zip(buffer.glyph_infos, buffer.glyph_positions):
            if last not in (-1, info.cluster):
                x += spacing.letters + spacing.words * (text[last] in _SPACES)
            last = info.cluster
            advance = place.x_advance / self._em
            glyphs.append(
                Glyph(
                    info.codepoint,
                    x + place.x_offset / self._em,
                    place.y_offset / self._em,
                    x,
                    advance,
                    info.cluster,
                )
            )
            x += advance
        if glyphs:
            x += spacing.letters + spacing.words * (text[last] in _SPACES)
        return glyphs, x, all(glyph.number for glyph in glyphs)

    def _draw_glyph(self, number: int) -> tuple[str, Complex]:
        """Return a glyph's path data with %r for each number, and the points of all commands, in ems with y down."""
        import uharfbuzz as hb

        commands: list[str] = []
        points: list[complex] = []

        def add(command: str, *places: float) -> None:
            commands.append(command + " ".join(["%r"] * len(places)))
            points.extend(complex(x, -y) / self._em for x, y in zip(places[::2], places[1::2]))

        pen = hb.DrawFuncs()
        pen.set_move_to_func(lambda a, b, _: add("M", a, b))
        pen.set_line_to_func(lambda a, b, _: add("L", a, b))
        pen.set_quadratic_to_func(lambda a, b, c, d, _: add("Q", a, b, c, d))
        pen.set_cubic_to_func(lambda a, b, c, d, e, f, _: add("C", a, b, c, d, e, f))
        pen.set_close_path_func(lambda _: add("Z"))
        self._font.draw_glyph(number, pen, None)
        return "".join(commands), np.array(points, dtype=np.complex128)

    @cached_property
    def x_height(self) -> float:
        """The height of lower-case letters."""
        import uharfbuzz as hb

        return self._font.get_metric_position_with_fallback(hb.OTMetricsTag.X_HEIGHT) / self._em

    @cached_property
    def has_small_capitals(self) -> bool:
        """Whether the font has its own glyphs for small capitals."""
        face = self._font.face
        scripts = enumerate(face.get_table_script_tags("GSUB"))
        return any("smcp" in face.get_language_feature_tags("GSUB", number) for number, _ in scripts)

    @cached_property
    def is_clockwise(self) -> bool:
        """Whether outer contours run clockwise on the page, as in TrueType's outlines."""
        template, points = self._template(self._font.get_nominal_glyph(ord("H")) or 1)
        first = points[: max(1, template.find("Z") and template[: template.find("Z")].count("%r") // 2)]
        return float(np.imag(np.conj(first) * np.roll(first, -1)).sum()) > 0

    def sets(self, text: str) -> bool:
        """Return whether the font has all letters, and they are of one script and direction."""
        ways = {bidirectional(letter) for letter in text}
        one_way = not ways & (_LEFTWARD | {"AN"}) or ways <= _LEFTWARD | _EITHER_WAY
        return one_way and self._shaped(text)[2] and _one_script(text)

    @staticmethod
    def runs_leftward(text: str) -> bool:
        """Return whether the text runs from right to left."""
        return any(bidirectional(letter) in _LEFTWARD for letter in text)

    def width(self, text: str, spacing: Spacing = NO_SPACING) -> float:
        """Return the width of a line in ems."""
        return self._shaped(text, spacing)[1]

    def draw(
        self, text: str, place: Callable[[float, float], Affine | None], spacing: Spacing = NO_SPACING
    ) -> str:
        """Return the path data of a line, y down.

        Args:
            text: the line.
            place: given the start and width of a glyph in ems, returns the map from the glyph's plane, in ems from its
                start on the line with y down; None if it is not drawn.
            spacing: extra space between letters.
        """
        return "".join(data for _, data, _ in self.draw_letters(text, place, spacing))

    def draw_letters(
        self, text: str, place: Callable[[float, float], Affine | None], spacing: Spacing = NO_SPACING
    ) -> Iterator[tuple[int, str, str]]:
        """Yield the path data of each glyph, or of each layer of a colour font's glyph, and its colour.

        First comes the index in the text of the first letter that the glyph represents; the colour is #rrggbb or
        #rrggbbaa, or empty for the colour of the text.
        """
        for glyph in self._shaped(text, spacing)[0]:
            if (frame := place(glyph.begin, glyph.advance)) is None:
                continue
            glyph_affine = frame @ translation(glyph.right - glyph.begin, -glyph.up)
            for number, colour in self._layers(glyph.number):
                template, points = self._template(number)
                yield glyph.cluster, template % tuple(glyph_affine(points).view(np.float64).tolist()), colour

    @property
    def axes(self) -> dict[str, tuple[float, float]]:
        """The least and largest value of each axis of a variable font, by its tag."""
        return {axis.tag: (axis.min_value, axis.max_value) for axis in self._font.face.axis_infos}

    def vary(self, values: Mapping[str, float]) -> None:
        """Set axes of a variable font, before anything is set in it."""
        self._font.set_variations(dict(values))

    def is_coloured(self, text: str) -> bool:
        """Return whether the font has its own colours for a letter of a text."""
        glyphs = self._shaped(text)[0] if self._font.face.has_color_layers else []
        layered = any(self._layers(glyph.number) != [(glyph.number, "")] for glyph in glyphs)
        return layered or bool(self.undrawn(text))

    def undrawn(self, text: str) -> str:
        """Return why a letter of a text has no outlines, as a clause; empty if all have, except spaces."""
        face = self._font.face
        kinds = {
            "gradients (COLR version 1)": face.has_color_paint and not face.has_color_layers,
            "pictures (CBDT or sbix)": face.has_color_png,
            "drawings (SVG)": face.has_color_svg,
        }
        kind = next((kind for kind, has in kinds.items() if has), "")
        if not kind:
            return ""
        letters = [glyph for glyph in self._shaped(text)[0] if text[glyph.cluster] not in _SPACES]
        empty = [glyph for glyph in letters if not self._template(glyph.number)[1].size]
        return f"its letters are {kind}, not outlines" if empty else ""

    def _layers(self, number: int) -> list[tuple[int, str]]:
        """Return the layers of a glyph (COLR version 0), each a glyph and its colour in the first palette."""
        face = self._font.face
        if not (face.has_color_layers and (layers := face.get_glyph_color_layers(number))):
            return [(number, "")]
        palette = face.color_palettes[0].colors
        colours = []
        for layer in layers:
            colour = ""
            if layer.color_index < len(palette):  # 0xFFFF is the colour of the text
                c = palette[layer.color_index]
                colour = f"#{c.red:02x}{c.green:02x}{c.blue:02x}" + (
                    f"{c.alpha:02x}" if c.alpha < 255 else ""
                )
            colours.append((layer.glyph, colour))
        return colours

    def set_at(self, text: str, x: float, y: float, size: float) -> list[tuple[int, str, str]]:
        """Return path data of a line's glyphs at a position and font size, as `draw_letters` yields it."""
        return list(self.draw_letters(text, lambda begin, _: Affine(size, 0, complex(x + size * begin, y))))


def _one_script(text: str) -> bool:
    """Return whether HarfBuzz can shape all letters as one run.

    Letters of `_ANY` belong together, whatever script HarfBuzz guesses; characters without a script fit any.
    """
    import uharfbuzz as hb

    scripts = set()
    for letter in set(text):
        if any(low <= ord(letter) <= high for low, high in _ANY):
            if letter.isalpha():
                scripts.add("any")
            continue
        buffer = hb.Buffer()
        buffer.add_str(letter)
        buffer.guess_segment_properties()
        scripts.add(buffer.script)
    return len(scripts - {None}) <= 1
