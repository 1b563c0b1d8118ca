"""Fonts: text set in a line, as HarfBuzz shapes it (kerned, with ligatures and letters that join), as path data."""

from functools import lru_cache
from unicodedata import bidirectional

# Blocks whose letters stand in any line beside each other: Latin, Greek, Cyrillic; signs; Chinese, Japanese, Korean.
_ANY = (
    (0x0000, 0x02FF), (0x0370, 0x058F), (0x1E00, 0x200A), (0x2010, 0x2027), (0x2030, 0x2BFF), (0x2E80, 0xD7AF),
    (0xFF00, 0xFFEF),
)  # fmt: skip
_LEFTWARD = {"R", "AL"}  # classes of Unicode's bidirectional algorithm
_EITHER_WAY = {"NSM", "WS"}


class Font:
    """A font file opened; lengths are in ems, y up.

    Args:
        path: of an OpenType or TrueType file.
        number: of the font in a collection.
        weight: of a variable font, 400 is regular.

    Raises:
        OSError, RuntimeError: the file is no font.
    """

    def __init__(self, path: str, number: int = 0, weight: int = 400):
        import uharfbuzz as hb

        self._font = hb.Font(hb.Face(hb.Blob.from_file_path(path), number))
        if any(axis.tag == "wght" for axis in self._font.face.axis_infos):
            self._font.set_variations({"wght": weight})
        self._em = self._font.face.upem
        self._shaped = lru_cache(maxsize=64)(self._shape)

    def _shape(self, text: str) -> tuple[list[tuple[int, float, float]], float, bool]:
        """Glyphs and where each begins, the width of all, and whether the font has every letter."""
        import uharfbuzz as hb

        buffer = hb.Buffer()
        buffer.add_str(text)
        buffer.guess_segment_properties()
        hb.shape(self._font, buffer)
        found, x = [], 0.0
        for info, place in zip(buffer.glyph_infos, buffer.glyph_positions):
            found.append((info.codepoint, (x + place.x_offset) / self._em, place.y_offset / self._em))
            x += place.x_advance
        return found, x / self._em, all(glyph for glyph, _, _ in found)

    def sets(self, text: str) -> bool:
        """Whether it has all of the letters, and they are of one script, and run one way."""
        ways = {bidirectional(letter) for letter in text}
        one_way = not ways & (_LEFTWARD | {"AN"}) or ways <= _LEFTWARD | _EITHER_WAY
        return one_way and self._shaped(text)[2] and _one_script(text)

    @staticmethod
    def runs_leftward(text: str) -> bool:
        """Whether the letters follow each other from right to left."""
        return any(bidirectional(letter) in _LEFTWARD for letter in text)

    def width(self, text: str) -> float:
        """Of a line."""
        return self._shaped(text)[1]

    def draw(self, text: str, x: float, y: float, size: float) -> str:
        """Path data of a line from a place on, y down."""
        import uharfbuzz as hb

        drawn: list[str] = []
        scale = size / self._em
        at = [0.0, 0.0]

        def to(letter: str, *places: float) -> None:
            pairs = zip(places[::2], places[1::2])
            drawn.append(letter + " ".join(f"{at[0] + scale * a!r} {at[1] - scale * b!r}" for a, b in pairs))

        pen = hb.DrawFuncs()
        pen.set_move_to_func(lambda a, b, _: to("M", a, b))
        pen.set_line_to_func(lambda a, b, _: to("L", a, b))
        pen.set_quadratic_to_func(lambda a, b, c, d, _: to("Q", a, b, c, d))
        pen.set_cubic_to_func(lambda a, b, c, d, e, f, _: to("C", a, b, c, d, e, f))
        pen.set_close_path_func(lambda _: drawn.append("Z"))
        for glyph, right, up in self._shaped(text)[0]:
            at[:] = x + size * right, y - size * up
            self._font.draw_glyph(glyph, pen, None)
        return "".join(drawn)


def _one_script(text: str) -> bool:
    """Whether one line of HarfBuzz's can hold them all."""
    import uharfbuzz as hb

    scripts = set()
    for letter in set(text):
        if any(low <= ord(letter) <= high for low, high in _ANY):
            scripts |= {"any"} if letter.isalpha() else set()
            continue
        buffer = hb.Buffer()
        buffer.add_str(letter)
        buffer.guess_segment_properties()
        scripts.add(buffer.script)
    return len(scripts - {None}) <= 1
