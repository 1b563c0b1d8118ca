"""`iccm map --along`: drawings and texts that are bent along a line."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import iccm as library
from iccm.io.shapes import line_band, shape
from iccm.io.svg import reader, tree

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}">{}</svg>'
LINE = '<path id="{}" fill="none" stroke="#000" d="{}"/>'
STAFF = SVG.format(100, 10, '<path d="M0 0H100V2H0z"/><path d="M70 4h20v6H70z" fill="red"/>')
QUARTER = "M100 0A100 100 0 0 1 200 100"
"""Clockwise about (100, 100), from its top to the right."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a staff, and a file with several lines."""
    monkeypatch.chdir(tmp_path)
    Path("staff.svg").write_text(STAFF)
    lines = LINE.format("straight", "M20 50L170 50") + LINE.format("back", "M170 80L20 80")
    lines += LINE.format("quarter", QUARTER) + LINE.format("eight", "M20 20L90 90L90 20L20 90")
    ring = '<circle id="ring" cx="100" cy="100" r="60" fill="none"/>'
    Path("lines.svg").write_text(SVG.format(200, 200, lines + ring))
    return tmp_path


def points(map, *xy):
    """Images of points, both in the files' coordinates, with y down."""
    return [complex(w.real, -w.imag) for w in map(np.array([complex(x, -y) for x, y in xy]))]


@pytest.mark.parametrize("line", ["straight", "back"])
def test_along_a_straight_line_the_map_is_affine_and_upright(folder, iccm, line):
    result = iccm("map", "staff.svg", f"lines.svg#{line}", "--along", "30", "-o", "m.npz")
    assert result.code == 0, result.err
    height = 50 if line == "straight" else 80
    images = points(library.load("m.npz").map, (0.01, 5), (70, 4), (90, 9), (50, 1))
    expected = [
        complex(20 + 1.5 * x, height + 3 * (y - 5)) for x, y in ((0.01, 5), (70, 4), (90, 9), (50, 1))
    ]
    assert np.abs(np.subtract(images, expected)).max() < 0.05


def test_along_an_arc_heights_become_radii_and_lengths_angles(folder, iccm):
    result = iccm("map", "staff.svg", "lines.svg#quarter", "--along", "20", "-o", "m.npz")
    assert result.code == 0, result.err
    xy = [(x, y) for x in (10, 30, 55, 90) for y in (0.5, 3, 5, 8, 9.5)]
    images = np.array(points(library.load("m.npz").map, *xy)) - (100 + 100j)
    x, y = np.array(xy).T
    assert np.abs(np.abs(images) - (100 + 2 * (5 - y))).max() < 0.5
    assert np.abs(np.angle(images) - (x / 100 - 1) * np.pi / 2).max() < 0.01


@pytest.mark.slow
def test_the_lines_of_a_staff_follow_the_line(folder, iccm):
    lines = "".join(f'<path d="M0 {y}H100" stroke="#000" stroke-width=".3"/>' for y in (2, 5, 7))
    Path("lined.svg").write_text(SVG.format(100, 10, lines + '<circle cx="30" cy="5" r="1"/>'))
    result = iccm("map", "lined.svg#canvas", "lines.svg#quarter", "--along", "20", "-o", "o.svg")
    assert result.code == 0 and "hidden" not in result.err, result.err
    *bent, note = tree.parse(Path("o.svg").read_bytes()).shapes
    for shown, y in zip(bent, (2, 5, 7), strict=True):
        (run,) = reader.runs_of(shown, 1e-3)
        centred = run.z - (100 + 100j)
        assert np.abs(np.abs(centred) - (100 + 2 * (5 - y))).max() < 0.5
        assert np.ptp(np.angle(centred)) == pytest.approx(np.pi / 2, abs=0.02)
    (head,) = reader.runs_of(note, 1e-3)
    assert abs(head.z.mean() - (100 + 100j) - 100 * np.exp(-0.35j * np.pi)) < 1


def test_auto_keeps_the_proportions_on_the_whole_line(folder, iccm):
    result = iccm("map", "staff.svg", "lines.svg#quarter", "--along", "auto", "-o", "m.npz")
    assert result.code == 0, result.err
    fit = library.load("m.npz")
    length = 50 * np.pi
    assert fit.target.area == pytest.approx(length * length / 10, rel=1e-3)


@pytest.mark.slow
def test_a_text_stands_on_the_line_and_keeps_its_proportions_in_the_middle(folder, iccm):
    result = iccm("map", "--text", "Hxg", "lines.svg#straight", "--along", "20", "-o", "m.npz", "-o", "t.png")
    assert result.code == 0, result.err
    map = library.load("m.npz").map
    word = shape.read(f"{line_band.lettering.DEFAULT_FONT}#text=Hxg#bbox", whole=True)
    low, high = word.curve.box
    scale = 20 / (high - low).imag
    for share in (0.1, 0.5, 0.9):
        x = (1 - share) * low.real + share * high.real
        image = map(np.array([complex(x, -line_band.lettering.BASELINE)]))[0]
        assert abs(image - complex(95 + scale * (x - (low.real + high.real) / 2), -50)) < 0.1
    alpha = np.asarray(Image.open("t.png"))[..., 3]
    assert 0.2 < (alpha > 128).mean() < 0.7  # the letters, without paper


def test_a_text_around_a_circle_stands_outside_with_its_middle_on_top(folder, iccm):
    result = iccm("map", "--text", "HEH", "lines.svg#ring", "--along", "20", "-o", "m.npz")
    assert result.code == 0, result.err
    low, high = shape.read(f"{line_band.lettering.DEFAULT_FONT}#text=HEH#bbox", whole=True).curve.box
    middle = (low.real + high.real) / 2
    below, above = library.load("m.npz").map(
        np.array([complex(middle, low.imag + 1), complex(middle, high.imag - 1)])
    )
    assert below.real == pytest.approx(100, abs=0.5) and above.real == pytest.approx(100, abs=0.5)
    assert -41 < below.imag < above.imag < -19  # the top of the circle is at y = 40


@pytest.mark.slow
def test_a_picture_around_a_circle_closes(folder, iccm):
    result = iccm("map", "staff.svg", "lines.svg#ring", "--along", "20", "-o", "m.npz")
    assert result.code == 0, result.err
    first, middle, last = points(library.load("m.npz").map, (0.05, 5), (50, 5), (99.95, 5))
    assert abs(first - (100 + 160j)) < 1 and abs(last - (100 + 160j)) < 1 and abs(middle - (100 + 40j)) < 1


@pytest.mark.slow
def test_a_band_that_would_overlap_itself_is_narrower_with_a_note(folder, iccm):
    Path("tight.svg").write_text(SVG.format(100, 100, LINE.format("u", "M20 90V20A10 10 0 0 1 40 20V90")))
    Path("block.svg").write_text(
        SVG.format(10, 10, '<path d="M0 0H10V10H0z"/><path d="M2 2h3v2z" fill="red"/>')
    )
    result = iccm("map", "block.svg", "tight.svg", "--along", "auto", "-o", "x.png", "--size", "40")
    assert result.code == 0 and "overlap" in result.err
    refused = iccm("map", "block.svg", "tight.svg", "--along", "90", "-o", "y.png")
    assert refused.code == 2 and "overlaps itself" in refused.err
    assert not Path("y.png").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["staff.svg", "lines.svg#nothing", "--along", "5"], "'nothing'"),
        (["staff.svg", "lines.svg#eight", "--along", "auto"], "crosses"),
        (["staff.svg", "lines.svg#ring", "--along", "0"], "above 0"),
        (["staff.svg", "lines.svg#ring", "--along", "wide"], "'wide'"),
        (["staff.svg", "lines.svg#ring", "--along", "5", "--pin", "1,1:2,2"], "--pin"),
        (["staff.svg", "lines.svg#ring", "--along", "5", "--parts", "each"], "--parts"),
        (["staff.svg", "lines.svg#ring", "--along", "5", "--turn", "90"], "--turn"),
        (["staff.svg", "picture.png", "--along", "5"], "SVG"),
        (["staff.svg", "empty.svg", "--along", "5"], "no line"),
    ],
)
def test_what_cannot_be_bent_along_a_line_is_refused_in_one_line(folder, iccm, arguments, words):
    Image.new("RGB", (4, 4)).save("picture.png")
    Path("empty.svg").write_text(SVG.format(9, 9, ""))
    result = iccm("map", *arguments, "-o", "no.png")
    assert result.code == 2 and words in result.err
    assert len(result.err.strip().splitlines()) == 1 and not Path("no.png").exists()
