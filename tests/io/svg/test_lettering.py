"""Text as outlines, compared with matplotlib's; unsupported text stays text."""

import re
import shutil
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from iccm import InputError
from iccm.io import limits
from iccm.io.artwork import rendering
from iccm.io.shapes import shape
from iccm.io.svg import directions, installed_fonts, lettering
from iccm.io.svg.fonts import Font

FONTS = Path(mpl.get_data_path(), "fonts", "ttf")
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">{}</svg>'
TEXT = '<text x="{x}" y="60" font-size="40" font-family="Nonesuch, DejaVu Sans" {more}>{text}</text>'


@pytest.fixture(autouse=True)
def fonts(tmp_path, monkeypatch):
    """Only matplotlib's fonts."""
    if shutil.which("fc-match") is None:
        pytest.skip("no fontconfig")
    config = f"<fontconfig><dir>{FONTS}</dir><cachedir>{tmp_path}/c</cachedir></fontconfig>"
    (tmp_path / "fonts.conf").write_text(config)
    monkeypatch.setenv("FONTCONFIG_FILE", str(tmp_path / "fonts.conf"))
    lettering._matched.cache_clear()
    yield
    lettering._matched.cache_clear()


def drawn(tmp_path, body):
    (tmp_path / "a.svg").write_text(SVG.format(body), encoding="utf-8")
    shapes = shape.read_all(str(tmp_path / "a.svg"))
    low, high = shapes[0].extent
    return shapes, [low.real, low.imag, high.real, high.imag]


def box_of(text, x, **more):
    box = TextPath((0, 0), text, size=40, prop=FontProperties(family="DejaVu Sans", **more)).get_extents()
    return np.array([box.x0 + x, box.y0 - 60, box.x1 + x, box.y1 - 60])


@pytest.mark.parametrize(
    "more, how",
    [
        ("", {}),
        ('font-weight="700"', {"weight": "bold"}),
        ('style="font-style:oblique"', {"style": "oblique"}),
    ],
)
def test_letters_are_where_matplotlib_has_them(tmp_path, more, how):
    shapes, box = drawn(tmp_path, TEXT.format(x=30, more=more, text="hong"))
    assert len(shapes) == 4 and box == pytest.approx(box_of("hong", 30, **how), abs=0.8)
    assert len(shapes[1].holes) + len(shapes[0].holes) + len(shapes[2].holes) + len(shapes[3].holes) == 2


def test_letters_are_kerned_as_matplotlib_kerns_them(tmp_path):
    _, box = drawn(tmp_path, TEXT.format(x=30, more="", text="AVAT"))
    apart = sum(drawn(tmp_path, TEXT.format(x=30, more="", text=letter))[1][2] - 30 for letter in "AVAT")
    assert box == pytest.approx(box_of("AVAT", 30), abs=0.8) and box[2] - 30 < apart - 5


def test_letters_that_join_are_one_shape(tmp_path):
    shapes, box = drawn(tmp_path, TEXT.format(x=30, more="", text="\u0633\u0644"))  # seen, lam
    alone, _ = drawn(tmp_path, TEXT.format(x=30, more="", text="\u0633"))
    assert len(shapes) == len(alone) == 1 and shapes[0].curve.area > 1.3 * alone[0].curve.area
    points = shapes[0].curve.z  # the lam, which rises, is read last: it is on the left
    assert points[np.argmin(points.imag if shapes[0].flip else -points.imag)].real < (box[0] + box[2]) / 2


def test_anchors_and_places_of_parts(tmp_path):
    _, left = drawn(tmp_path, TEXT.format(x=10, more="", text=" h<tspan>on</tspan>g\n"))
    _, middle = drawn(tmp_path, TEXT.format(x=100, more='text-anchor="middle"', text="hong"))
    _, end = drawn(tmp_path, TEXT.format(x=190, more='text-anchor="end"', text="hong"))
    assert middle[2] - middle[0] == pytest.approx(left[2] - left[0], abs=1e-6)
    assert 2 * (middle[0] - 100) == pytest.approx(left[0] - 10 + end[0] - 190, abs=1e-6)
    _, moved = drawn(tmp_path, TEXT.format(x=10, more="", text='<tspan x="50" y="80">h</tspan>'))
    assert moved[:2] == pytest.approx(box_of("h", 50)[:2] - (0, 20), abs=0.5)


@pytest.mark.parametrize(
    "body",
    [
        TEXT.format(x=9, more='writing-mode="sideways-lr"', text="ho"),
        TEXT.format(x=9, more="", text='h<tspan textLength="30">o<tspan textLength="9">u</tspan></tspan>'),
        TEXT.format(x=9, more="", text="\u0633\u0644<tspan>\u0633</tspan>"),
        TEXT.format(x=9, more="", text='h<tspan fill="url(#g)">o</tspan>'),
        TEXT.format(x=9, more="", text='<textPath href="#p">h</textPath>'),
    ],
)
def test_special_text_stays_text(tmp_path, body):
    with pytest.raises(InputError, match="convert text to paths"):
        drawn(tmp_path, body)


@pytest.mark.parametrize(
    ("families", "reason"),
    [
        ('font-family="Nonesuch, Other"', "its font Nonesuch, Other is not installed"),
        ("", "it names no font"),
        ('font-family="STIXSizeOneSym"', "the font STIXSizeOneSym lacks some of its letters"),
    ],
)
def test_text_without_its_font_is_set_in_another_as_in_browsers(tmp_path, families, reason):
    text = TEXT.format(x=9, more="", text="hong").replace('font-family="Nonesuch, DejaVu Sans"', families)
    shapes, box = drawn(tmp_path, text)
    assert len(shapes) == 4 and box == pytest.approx(box_of("hong", 9), abs=0.8)
    assert any(note.startswith(f"1 × text in DejaVu Sans, since {reason}") for note in shapes[0].notes)


def test_a_family_is_replaced_by_one_of_the_same_widths(tmp_path, monkeypatch):
    """As Arial is by Liberation Sans, where that is installed."""
    monkeypatch.setitem(installed_fonts._ALIKE, "arial", ("dejavu serif",))
    text = TEXT.format(x=9, more="", text="hong").replace("Nonesuch, DejaVu Sans", "Arial, DejaVu Sans")
    if "serif" not in installed_fonts.font_file("sans-serif")[0].casefold():
        monkeypatch.setattr(installed_fonts.shutil, "which", lambda name: None)
        monkeypatch.setattr(installed_fonts, "folders", lambda: (FONTS,))
    shapes, box = drawn(tmp_path, text)
    serif = TextPath((0, 0), "hong", size=40, prop=FontProperties(family="DejaVu Serif")).get_extents()
    assert box[2] - box[0] == pytest.approx(serif.x1 - serif.x0, abs=0.8)
    assert not any("DejaVu" in note for note in shapes[0].notes)


def test_letters_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "SVG_LETTERS", 5)
    with pytest.raises(InputError, match="more than 5 letters"):
        drawn(tmp_path, TEXT.format(x=9, more="", text="hhhhhh"))


def test_artwork_carries_letters(tmp_path, iccm):
    square = '<rect id="s" width="200" height="100" fill="#fff"/>'
    (tmp_path / "a.svg").write_text(
        SVG.format(square + TEXT.format(x=30, more="", text="h")).replace(", DejaVu Sans", "")
    )
    words = [f"{tmp_path}/a.svg#canvas"] * 2
    result = iccm("map", *words, "--background", "transparent", "-o", tmp_path / "o.svg")
    assert result.code == 0 and "omitted (convert it" not in result.err
    assert "1 × text in DejaVu Sans, since its font Nonesuch is not installed" in result.err
    low, high = shape.read(f"{tmp_path}/o.svg#2").curve.box
    assert [low.real, low.imag, high.real, high.imag] == pytest.approx(box_of("h", 30), abs=0.6)


def test_a_power_stroke_is_read_as_inkscape_drew_it(tmp_path):
    names = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    path = f'<path {names} fill="#000" inkscape:path-effect="#e" inkscape:original-d="M10 10H90" d="M10 10L90 5V15Z"/>'
    (shape,), _ = drawn(tmp_path, path)
    assert shape.curve.area == pytest.approx(400)


def test_fonts_are_found_without_fontconfig(tmp_path, monkeypatch):
    """In the folders of the system: the same file of the family, in the same weight."""
    text = TEXT.format(x=9, more='font-weight="bold"', text="Rag")
    before = drawn(tmp_path, text)
    monkeypatch.setattr(installed_fonts.shutil, "which", lambda name: None)
    monkeypatch.setattr(installed_fonts, "folders", lambda: (FONTS,))
    lettering._matched.cache_clear()
    try:
        after = drawn(tmp_path, text)
        unknown = drawn(
            tmp_path, '<rect width="9" height="9"/>' + text.replace("DejaVu Sans", "Nonesuch Sans")
        )
    finally:
        lettering._matched.cache_clear()
    assert "missing" in installed_fonts.finder()
    assert after[1] == pytest.approx(before[1]) and len(after[0]) == len(before[0]) == 3
    assert after[0][0].curve.area == pytest.approx(before[0][0].curve.area)
    assert len(unknown[0]) == 4 and any("1 × text in DejaVu Sans" in note for note in unknown[0][0].notes)


@pytest.mark.parametrize(
    "family, weight, slant, file",
    [
        ("dejavu sans", 400, 0, "DejaVuSans.ttf"),
        ("dejavu sans", 600, 0, "DejaVuSans-Bold.ttf"),
        ("dejavu sans", 300, 110, "DejaVuSans-Oblique.ttf"),
        ("dejavu serif", 700, 100, "DejaVuSerif-BoldItalic.ttf"),
        ("monospace", 700, 0, "DejaVuSansMono-Bold.ttf"),
    ],
)
def test_the_nearest_style_of_a_family_is_chosen(monkeypatch, family, weight, slant, file):
    monkeypatch.setattr(installed_fonts.shutil, "which", lambda name: None)
    monkeypatch.setattr(installed_fonts, "folders", lambda: (FONTS,))
    path, number = installed_fonts.font_file(family, weight, slant)
    assert Path(path) == FONTS / file and number == 0
    assert installed_fonts.font_file("nonesuch", weight, slant) is None


def boxes(tmp_path, body):
    """The boxes of all letters from left to right, in the file's directions."""
    shapes, _ = drawn(tmp_path, body)
    z = [letter.to_file(letter.curve.z) for letter in shapes]
    return sorted((round(p[:, 0].min(), 2), round(p[:, 1].min(), 2), round(p[:, 0].max(), 2)) for p in z)


def test_letters_have_places_of_their_own(tmp_path):
    (h, o, _), word = boxes(tmp_path, TEXT.format(x="9 70 120", more='dy="0 5"', text="hou")), "hou"
    alone = [boxes(tmp_path, TEXT.format(x=x, more="", text=letter))[0] for x, letter in zip((9, 70), word)]
    assert h == alone[0] and o == pytest.approx((alone[1][0], alone[1][1] + 5, alone[1][2]), abs=0.02)


def test_offsets_of_spans_accumulate(tmp_path):
    plain = boxes(tmp_path, TEXT.format(x=9, more="", text="h ou"))
    moved = boxes(tmp_path, TEXT.format(x=9, more="", text='h<tspan dx="1 2 3" dy="-7"> ou</tspan>'))
    away = [(b[0] - a[0], b[1] - a[1]) for a, b in zip(plain, moved)]
    assert np.allclose(away, [(0, 0), (3, -7), (6, -7)], atol=0.02)


@pytest.mark.parametrize("more, ems", [('letter-spacing="4"', 0.1), ('letter-spacing=".1em"', 0.1)])
def test_letters_are_set_apart(tmp_path, more, ems):
    plain = boxes(tmp_path, TEXT.format(x=9, more="", text="hou"))
    apart = boxes(tmp_path, TEXT.format(x=9, more=more, text="hou"))
    assert np.allclose([b[0] - a[0] for a, b in zip(plain, apart)], [0, 40 * ems, 80 * ems], atol=0.02)


def test_spacing_that_is_inherited_from_nothing_is_none(tmp_path):
    plain, inherited = (
        boxes(tmp_path, TEXT.format(x=9, more=more, text="h ou")) for more in ("", 'word-spacing="inherit"')
    )
    assert inherited == plain


def test_a_text_has_its_specified_length(tmp_path):
    plain = boxes(tmp_path, TEXT.format(x=9, more="", text="hou"))
    natural = TextPath((0, 0), "hou", size=40, prop=FontProperties(family="DejaVu Sans")).get_extents().width
    spaced = boxes(tmp_path, TEXT.format(x=9, more='textLength="150"', text="hou"))
    assert spaced[1][0] - plain[1][0] == pytest.approx((spaced[2][0] - plain[2][0]) / 2, abs=0.02)
    assert spaced[2][2] - spaced[0][0] == pytest.approx(150 - 5.5, abs=3) and natural < 80
    widened = boxes(
        tmp_path, TEXT.format(x=9, more='textLength="150" lengthAdjust="spacingAndGlyphs"', text="hou")
    )
    ratios = [(b[2] - b[0]) / (a[2] - a[0]) for a, b in zip(plain, widened)]
    assert np.ptp(ratios) < 0.02 and ratios[0] > 1.8


@pytest.mark.parametrize("offset, start", [("0", 0), ("25%", 40), ("16", 16)])
def test_a_text_follows_a_path(tmp_path, offset, start):
    """Along a descending line, letters are rotated by its angle; those beyond its end are not drawn."""
    path = '<defs><path id="p" transform="translate(10 0)" d="M0 20 L128 116"/></defs>'
    text = f'<textPath href="#p" startOffset="{offset}">hou</textPath>'
    shapes, _ = drawn(tmp_path, path + TEXT.format(x=0, more="", text=text))
    turned = (
        f'<g transform="translate(10 20) rotate({np.degrees(np.arctan2(96, 128))}) translate({start} -60)">'
    )
    expected, _ = drawn(tmp_path, turned + TEXT.format(x=0, more="", text="hou") + "</g>")
    middles = [sorted(complex(letter.curve.z.mean()).real for letter in side) for side in (shapes, expected)]
    assert len(shapes) == 3 and np.allclose(*middles, atol=0.1)
    beyond_end, _ = drawn(
        tmp_path, path + TEXT.format(x=0, more="", text=text.replace(f'"{offset}"', '"70%"', 1))
    )
    assert len(beyond_end) < 3


def test_repeated_letters_are_drawn_from_their_font_once():
    font = Font(str(FONTS / "DejaVuSans.ttf"))
    drawn = ["".join(data for _, data, _ in font.set_at(text, 3, 4, 10)) for text in ("AAAA", "AVA")]
    assert font._template.cache_info().misses == 2
    assert [path.count("Z") for path in drawn] == [8, 5] and len(set(re.findall("M[^L]*", drawn[0]))) == 8


# a text, and the positions of its letters in Chromium 156, in DejaVu Sans of 30 px starting at (10, 100)
PLACED = [
    ('a<tspan baseline-shift="super" font-size="15">b</tspan>c<tspan baseline-shift="sub">d</tspan>'
     '<tspan baseline-shift="30%">e</tspan><tspan baseline-shift="6">g</tspan>', "",
     "a 10 100, b 28.39 91 15, c 37.92 100, d 54.42 117.5, e 73.47 91, g 91.94 94"),
    ('h<tspan textLength="80">ou</tspan>n', "", "h 10 100, o 29.02 100, u 90 100, n 151.64 100"),
    ('ab<tspan x="100" dy="5">cd</tspan>ef', 'X="10 40 80 120 150"',
     "a 10 100, b 40 100, c 100 105, d 120 105, e 150 105, f 168.47 105"),
    ('foo<tspan x="80"> bar</tspan><tspan dx="1em" font-size="50%">h</tspan>  n <tspan> o</tspan>', "",
     "f 10 100, o 20.55 100, o 38.91 100, b 89.53 100, a 108.58 100, r 126.95 100, h 154.3 100 15, n 173.34 100, "
     "o 201.91 100"),
    ('a<tspan>b<tspan display="none">x</tspan></tspan><tspan visibility="hidden">d</tspan>e', "",
     "a 10 100, b 28.39 100, e 66.48 100"),
    ("ab \u05d0\u05d1\u05d2 cd", "",
     "a 10 100, b 28.38 100, \u05d2 56.97 100, \u05d1 69.34 100, \u05d0 86.69 100, c 116.27 100, d 132.75 100"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "more", "expected"), PLACED)
def test_spans_are_where_chromium_has_them(tmp_path, text, more, expected):
    body = '<text x="10" y="100" font-size="30" font-family="DejaVu Sans" {}>{}</text>'
    body = body.replace('x="10"', more.lower() or 'x="10"')
    whole = boxes(tmp_path, body.format("", text))
    alone = []
    for letter in expected.split(", "):
        letter, x, y, *size = letter.split()
        style = f'x="{x}" y="{y}" font-size="{(size or [30])[0]}" font-family="DejaVu Sans"'
        alone += boxes(tmp_path, f"<text {style}>{letter}</text>")
    assert len(whole) == len(alone)
    assert np.allclose(whole, sorted(alone), atol=0.5)


HEBREW = "\u05d0\u05d1"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("plain (text) 12", ["plain (text) 12"]),
        (f"ab {HEBREW} cd", ["ab ", HEBREW, " cd"]),
        (f"a {HEBREW} 12,5 {HEBREW}!", ["a ", f" {HEBREW}", "12,5", f"{HEBREW} ", "!"]),
        (f"{HEBREW} ({HEBREW}) x", [f"{HEBREW} ({HEBREW})", " x"]),
        (f"x ({HEBREW}) {HEBREW}", ["x (", HEBREW, ") ", HEBREW]),
        (f"{HEBREW} (ab) {HEBREW}", [HEBREW, " (ab) ", HEBREW]),
    ],
)
def test_bidirectional_text_follows_unicode(text, parts):
    assert directions.in_visual_order(text) == parts and "".join(sorted(text)) == "".join(
        sorted("".join(parts))
    )


SPANS = (
    '<g fill="#00f" opacity=".9">'
    + TEXT.format(
        x=9,
        more='style="stroke-width:3"',
        text='h<tspan fill="#f00">o<tspan fill-opacity=".5" opacity=".5">u</tspan></tspan>'
        '<tspan style="fill:none;stroke:#0c0">n</tspan>',
    )
    + "</g><style>path{fill:pink} .k{fill:#ff0}</style>"
)


def test_spans_have_paint_of_their_own(tmp_path, iccm):
    """In a picture and in artwork; and if rules refer to paths, which these are not."""
    (tmp_path / "a.svg").write_text(SVG.format(SPANS))
    shapes, _ = drawn(tmp_path, SPANS)
    assert len(shapes) == 4
    same = (tmp_path / "a.svg#canvas", tmp_path / "a.svg#canvas", "--background", "transparent")
    result = iccm("map", *same, "-o", tmp_path / "o.svg")
    assert result.code == 0 and "omitted" not in result.err
    for name in ("a.svg", "o.svg"):
        pixels = rendering.render(tmp_path / name, (-100j, 200 + 0j), (200, 100)).pixels
        seen = {tuple(int(v) for v in colour) for colour in pixels[pixels[..., 3] > 0].reshape(-1, 4)}
        full = {colour[:3] for colour in seen if colour[3] >= 225}
        assert (
            (0, 0, 255) in full
            and (255, 0, 0) in full
            and (0, 204, 0) in full
            and (255, 192, 203) not in full
        )
        faint = [c for c in seen if c[0] > 240 and c[1] < 10 and c[2] < 10 and 50 <= c[3] <= 62]
        assert faint, name  # .9 times .5 times .5
