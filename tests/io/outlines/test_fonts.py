"""Variable and color fonts, made by fontTools: sizes of letters and colors are those of their design."""

import shutil

import numpy as np
import pytest
from fontTools.colorLib.builder import buildCOLR, buildCPAL
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib.tables.TupleVariation import TupleVariation

from iccm import InputError
from iccm.io.outlines import lettering
from iccm.io.shapes import shape as shapes


def box(left, low, right, high):
    pen = TTGlyphPen(None)
    pen.moveTo((left, low))
    for corner in ((left, high), (right, high), (right, low)):
        pen.lineTo(corner)
    pen.closePath()
    return pen.glyph()


def built(path, *, variable=False, layers=None):
    """A font with a letter H, a box 200 wide and 500 high; its heaviest weight is 600 wide."""
    builder = FontBuilder(1000, isTTF=True)
    glyphs = {".notdef": box(0, 0, 9, 9), "H": box(100, 0, 300, 500), "left": box(100, 0, 220, 500)}
    glyphs["right"] = box(200, 0, 300, 500)
    builder.setupGlyphOrder(list(glyphs))
    builder.setupCharacterMap({ord("H"): "H"})
    builder.setupGlyf(glyphs)
    builder.setupHorizontalMetrics({name: (800, getattr(glyph, "xMin", 0)) for name, glyph in glyphs.items()})
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": "Boxes", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    if variable:
        builder.setupFvar([("wght", 100, 100, 900, "Weight")], [])
        wider = [(0, 0), (0, 0), (400, 0), (400, 0), (0, 0), (0, 0), (0, 0), (0, 0)]
        builder.setupGvar({"H": [TupleVariation({"wght": (0, 1, 1)}, wider)]})
    if layers:
        builder.font["COLR"] = buildCOLR({"H": layers}, version=0)
        builder.font["CPAL"] = buildCPAL([[(1, 0, 0, 1), (0, 0, 1, 0.5)]])
    builder.save(path)
    return path


@pytest.mark.parametrize(("weight", "width"), [(100, 20), (500, 40), (900, 60)])
def test_the_axes_of_a_variable_font_set_its_letters(tmp_path, weight, width):
    font = built(tmp_path / "v.ttf", variable=True)
    spec = lettering.spec("H", str(font), f"wght={weight}")
    outline = shapes.read(spec).curve.z
    assert np.ptp(outline.real) == pytest.approx(width) and np.ptp(outline.imag) == pytest.approx(50)
    assert shapes.read(f"{font}#wght={weight}&text=H").curve.area == pytest.approx(width * 50)


@pytest.mark.parametrize(
    ("variation", "message"),
    [
        ("wght=901", "100 to 900"),
        ("slnt=5", "no axis 'slnt'"),
        ("wght", "not an axis and a number"),
        ("wght=bold", "not an axis and a number"),
        ("wght=500,,", "not an axis and a number"),
    ],
)
def test_wrong_axes_are_refused_with_those_of_the_font(tmp_path, variation, message):
    font = built(tmp_path / "v.ttf", variable=True)
    with pytest.raises(InputError, match=message):
        shapes.read(lettering.spec("H", str(font), variation))


def test_axes_of_a_font_without_any_are_refused(tmp_path):
    font = built(tmp_path / "f.ttf")
    with pytest.raises(InputError, match="not a variable font"):
        shapes.read(f"{font}#wght=500&text=H")


def test_a_color_font_keeps_the_colors_of_its_palette(tmp_path):
    font = built(tmp_path / "c.ttf", layers=[("left", 0), ("right", 1)])
    shape = shapes.read(f"{font}#text=H")
    assert shape.coloured and shape.curve.area == pytest.approx(1000)
    svg = lettering.svg(font, "text=H").decode()
    assert svg.index('fill="#ff0000"') < svg.index('fill="#0000ff80"')
    assert not shapes.read(f"{built(tmp_path / 'f.ttf')}#text=H").coloured


def test_a_layer_in_the_color_of_the_text_has_none_of_its_own(tmp_path):
    font = built(tmp_path / "c.ttf", layers=[("left", 0), ("right", 0xFFFF)])
    assert lettering.svg(font, "text=H").decode().count("fill=") == 1


def test_a_web_font_is_named_as_what_it_is(tmp_path):
    font = shutil.copy(built(tmp_path / "f.ttf"), tmp_path / "f.woff2")
    with pytest.raises(InputError, match="web font"):
        shapes.read(f"{font}#text=H")
    with pytest.raises(InputError, match=r"--font .*f\.woff2: web font"):
        lettering.spec("H", font)
    (tmp_path / "renamed.ttf").write_bytes(b"wOF2" + bytes(60))
    with pytest.raises(InputError, match=r"renamed\.ttf: web font"):
        shapes.read(f"{tmp_path}/renamed.ttf#text=H")


def test_a_color_font_of_pictures_is_refused_with_its_reason(tmp_path):
    path = built(tmp_path / "p.ttf")
    from fontTools.ttLib import TTFont, newTable

    font = TTFont(path)
    pen = TTGlyphPen(None)
    font["glyf"]["H"] = pen.glyph()
    table = newTable("SVG ")
    table.docList = [('<svg xmlns="http://www.w3.org/2000/svg" id="glyph1"/>', 1, 1)]
    font["SVG "] = table
    font.save(path)
    with pytest.raises(InputError, match="SVG"):
        shapes.read(f"{path}#text=H")
