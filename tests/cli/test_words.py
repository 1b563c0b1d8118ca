"""`iccm map --text`, `--target-text` and `--font`, `#bbox`, and words as artwork."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib import get_data_path

from iccm.io.shapes import shape
from iccm.io.svg import reader

FONT = Path(get_data_path(), "fonts/ttf/DejaVuSans-Bold.ttf")
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 200">{}</svg>'
SERIF = Path(get_data_path(), "fonts/ttf/DejaVuSerif.ttf")


def box_of(spec):
    """The box of a shape in the units of its file: left, top, width, height."""
    corners = shape.read(spec, whole=True).curve.z.conjugate()
    left, top = corners.real.min(), corners.imag.min()
    return left, top, np.ptp(corners.real), np.ptp(corners.imag)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a slanted shape."""
    monkeypatch.chdir(tmp_path)
    Path("flag.svg").write_text(SVG.format('<path id="flag" d="M20 30 L250 60 L270 170 L40 150 Z"/>'))
    return tmp_path


def test_a_word_in_its_own_box_twice_as_large_keeps_its_letters(folder, iccm):
    left, top, width, height = box_of(f"{FONT}#text=Rg#bbox")
    Path("twice.svg").write_text(
        SVG.format(f'<rect x="7" y="11" width="{2 * width}" height="{2 * height}"/>')
    )
    result = iccm(
        "map",
        "--text",
        "Rg#bbox",
        "--font",
        str(FONT),
        "twice.svg",
        "-o",
        "out.svg",
        "--background",
        "transparent",
    )
    assert result.code == 0, result.err
    drawing = reader.read(Path("out.svg"))
    word = shape.read(f"{FONT}#text=Rg", whole=True).ink.painted
    word = shapely.transform(word, lambda xy: (xy * [1, -1] - [left, top]) * 2 + [7, 11])
    away = shapely.area(shapely.symmetric_difference(drawing.painted, word))
    assert away < 2e-3 * word.area
    assert drawing.painted.area == pytest.approx(word.area, rel=1e-3)
    assert Path("out.svg").read_text().count("<path ") == 2 and "<text" not in Path("out.svg").read_text()


@pytest.mark.slow
def test_a_word_fills_the_target_and_stays_inside(folder, iccm):
    bare = "--detail", "0", "--background", "transparent"
    result = iccm("map", "--text", "HE", "flag.svg", "-o", "out.svg", "--report", "r.json", *bare)
    assert result.code == 0, result.err
    drawn = reader.read(Path("out.svg")).painted
    flag = reader.read(Path("flag.svg")).painted
    assert drawn.difference(flag.buffer(0.5)).area == 0
    covered = json.loads(Path("r.json").read_text())["covered"]
    assert drawn.area == pytest.approx(covered * flag.area, rel=0.02)
    assert [round(side) for side in drawn.bounds] == pytest.approx(flag.bounds, abs=2)


@pytest.mark.slow
def test_a_word_is_a_target(folder, iccm):
    result = iccm("map", "flag.svg", "--target-text", "T", "--font", str(SERIF), "-o", "out.svg")
    assert result.code == 0, result.err
    drawing, word = (
        reader.read(Path("out.svg")).painted,
        shape.read(f"{SERIF}#text=T", whole=True).ink.painted,
    )
    word = shapely.transform(word, lambda xy: xy * [1, -1])
    assert shapely.area(shapely.symmetric_difference(drawing, word)) < 0.01 * word.area


@pytest.mark.slow
def test_fonts_are_files_or_names(folder, iccm):
    assert iccm("map", "--text", "T", "--font", str(SERIF), "flag.svg", "-o", "file.svg").code == 0
    assert iccm("map", "--text", "T", "--font", "DejaVu Serif", "flag.svg", "-o", "name.svg").code == 0
    assert iccm("map", "--text", "T", "flag.svg", "-o", "bold.svg").code == 0
    drawn = [Path(f"{name}.svg").read_text() for name in ("file", "name", "bold")]
    assert drawn[0] == drawn[1] != drawn[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--text", "A"), "TARGET"),
        (("flag.svg",), "TARGET"),
        ((), "SOURCE"),
        (("--text", "A", "flag.svg", "flag.svg"), "--text"),
        (("--text", "A", "--target-text", "B", "flag.svg"), "--target-text"),
        (("--text", " ", "flag.svg"), "--text"),
        (("--text", "A", "--font", "No Such Font", "flag.svg"), "--font No Such Font"),
        (("--text", "A", "--font", "missing.ttf", "flag.svg"), "missing.ttf"),
        (("--text", "A", "--font", "flag.svg", "flag.svg"), "flag.svg"),
        (("--font", "x.ttf", "flag.svg", "flag.svg"), "--font"),
    ],
)
def test_wrong_fonts_and_words_are_refused_in_one_line(folder, iccm, arguments, message):
    refused = iccm("map", *arguments, "-o", "out.svg")
    assert refused.code == 2 and message in refused.err and len(refused.err.splitlines()) == 1
    assert not Path("out.svg").exists()


def test_the_box_of_a_drawing_and_of_its_parts(folder):
    body = '<g id="both"><rect id="a" x="10" y="20" width="30" height="40"/><circle cx="100" cy="90" r="20"/></g>'
    Path("logo.svg").write_text(SVG.format(body))
    assert box_of("logo.svg#bbox") == pytest.approx((10, 20, 110, 90), abs=0.1)
    assert box_of("logo.svg#a#bbox") == pytest.approx((10, 20, 30, 40))
    assert box_of("logo.svg#2#bbox") == pytest.approx((10, 20, 30, 40), abs=30)
    Path("named.svg").write_text(SVG.format(body.replace('"a"', '"bbox"')))
    assert box_of("named.svg#bbox") == pytest.approx((10, 20, 30, 40))


def test_the_box_of_a_feature_has_y_up(folder):
    ring = [[3, 1], [9, 2], [5, 8], [3, 1]]
    Path("a.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    low, high = shape.read("a.geojson#bbox", whole=True).box
    assert (low, high) == (3 + 1j, 9 + 8j)


def test_the_canvas_of_a_word_is_its_line(folder):
    left, top, width, height = box_of(f"{FONT}#text=x#canvas")
    assert (left, top, height) == (0, 0, 100) and width > box_of(f"{FONT}#text=x#bbox")[2]
