"""--parts all: every shape of a drawing is mapped to its partner, in one picture, one STMap, one artwork."""

import json
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from PIL import Image

from iccm.io.pictures import image_files
from iccm.io.shapes import shape

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
FACE = (
    '<circle id="head" cx="50" cy="50" r="45" fill="#fc0"/><circle id="left" cx="30" cy="40" r="8"/>'
    '<circle id="right" cx="70" cy="40" r="8"/><circle cx="30" cy="40" r="3" fill="#fff"/>'
    '<path d="M2 2h5v5h-5z" fill="#00f"/>'
)
MASK = (
    '<path id="head" d="M5 20H95V90H5z"/><path id="left" d="M60 40h15v9h-15z"/>'
    '<path id="right" d="M25 40h15v9h-15z"/>'
)
ALL = ("map", "face.svg", "mask.svg", "--parts", "all", "--size", "200")


@pytest.fixture
def drawings(shapes):
    (shapes / "face.svg").write_text(SVG.format(FACE))
    (shapes / "mask.svg").write_text(SVG.format(MASK))
    return shapes


@pytest.mark.slow
def test_each_part_has_its_map_in_one_picture_stmap_and_report(drawings, iccm):
    result = iccm(*ALL, "-o", "o.png", "-o", "o.svg", "--stmap", "o.tif", "--report", "r.json")
    assert result.code == 0
    assert "note: face.svg: no matching part in mask.svg for #4, #5" in result.lines
    report = json.loads((drawings / "r.json").read_text())
    assert [(part["source"], part["target"]) for part in report["parts"]] == [
        ("1", "1"),
        ("2", "2"),
        ("3", "3"),
    ]
    assert report["boundary"] == report["parts"][0]["boundary"]
    assert all(
        part["injective"]["certified"] and part["boundary"]["hausdorff"] < 1e-3 for part in report["parts"]
    )
    st = image_files.read("o.tif").pixels
    assert np.allclose(st[89, 135, :2], (0.3, 0.6), atol=0.01)  # "left" is on the right of the mask
    assert np.allclose(st[89, 65, :2], (0.7, 0.6), atol=0.01)
    assert (image_files.read("o.png").pixels[..., 3] == 255).mean() == pytest.approx(0.63, abs=0.01)


def test_empty_parts_of_the_target_are_reported_even_when_quiet(drawings, iccm):
    (drawings / "word.svg").write_text(
        SVG.format(
            '<path id="g" d="M5 20h40v50h-40z"/><path id="i" d="M55 20h10v50h-10z"/><path d="M75 20h10v50h-10z"/>'
        )
    )
    (drawings / "tile.svg").write_text(SVG.format('<rect x="10" y="10" width="80" height="80"/>'))
    result = iccm("map", "tile.svg", "word.svg", "--parts", "all", "-o", "w.png", "--report", "r.json", "-q")
    assert result.code == 0
    assert (
        "word.svg: no matching part in tile.svg for #2 (i), #3: they stay empty, 33% of the total area"
        in result.err
    )
    unpaired = json.loads((drawings / "r.json").read_text())["unpaired"]
    assert unpaired == {"source": [], "target": ["2", "3"], "empty": pytest.approx(1 / 3)}


@pytest.mark.slow
def test_overlapping_targets_are_reported_even_when_quiet_and_the_smaller_lies_on_top(drawings, iccm):
    two = '<path id="head" d="M5 20H65V80H5z"/><path id="left" d="M45 40h40v40h-40z"/>'
    (drawings / "two.svg").write_text(SVG.format(two))
    (drawings / "both.svg").write_text(SVG.format(two.replace("M45", "M70").replace("h40v40h-40", "h9v9h-9")))
    result = iccm(
        "map", "both.svg", "two.svg", "--parts", "all", "-o", "o.png", "--stmap", "o.tif", "--size", "100",
        "--report", "r.json", "-q",
    )  # fmt: skip
    assert result.code == 0
    assert (
        "two.svg: parts overlap, such as #1 (head) and #2 (left); the smaller one lies on top" in result.err
    )
    assert json.loads((drawings / "r.json").read_text())["overlap"] == pytest.approx(800 / 5200, rel=1e-6)
    st = image_files.read("o.tif").pixels
    assert (
        st[60, 55, 0] > 0.69 and st[60, 75, 0] > 0.69 and st[60, 30, 0] < 0.66
    )  # of `left`, twice, and of `head`
    assert "cover each other" not in iccm(*ALL, "-o", "p.png").err  # a part inside another is meant to be


def test_artwork_follows_the_part_that_contains_it(drawings, iccm):
    assert iccm(*ALL[:-2], "-o", "o.svg").code == 0
    boxes = {name: shape.read(f"o.svg#{name}").curve.box for name in ("head", "left", "right")}
    for name in boxes:
        assert np.allclose(boxes[name], shape.read(f"mask.svg#{name}").curve.box, atol=0.05)
    pupil = shape.read_all("o.svg")[-1].curve
    assert np.allclose((pupil.box[0] + pupil.box[1]) / 2, 67.5 - 44.5j, atol=0.3)


def test_options_incompatible_with_parts_are_refused(drawings, iccm):
    result = iccm(*ALL, "--pin", "50,50:50,50")
    assert result.code == 2 and "--parts all: pins and strokes only work for one shape" in result.err


def test_ignored_outlines_are_reported_once(drawings, iccm):
    paper = ("--method", "paper", "--vertices", "60", "--parts", "largest")
    result = iccm("map", "face.svg", "mask.svg", "--report", "-", *paper)
    assert result.err.count("ignored 4 other outlines") == result.err.count("ignored 2 other outlines") == 1
    assert "--parts all" in result.err


WORD = '<path id="a" d="M5 20h40v50h-40z"/><path d="M55 20h40v50h-40z"/><circle cx="50" cy="85" r="10"/>'


@pytest.mark.slow
def test_one_source_is_mapped_onto_each_part(drawings, iccm):
    (drawings / "word.svg").write_text(SVG.format(WORD))
    command = (
        "map",
        "face.svg#head",
        "word.svg",
        "--parts",
        "each",
        "--background",
        "transparent",
        "--size",
        "100",
    )
    result = iccm(*command, "-o", "o.png", "-o", "o.svg", "--stmap", "o.tif", "--report", "r.json")
    assert result.code == 0
    report = json.loads((drawings / "r.json").read_text())
    assert [(part["source"], part["target"]) for part in report["parts"]] == [("", "1"), ("", "2"), ("", "3")]
    assert "unpaired" not in report and all(part["injective"]["certified"] for part in report["parts"])
    pixels, st = image_files.read("o.png").pixels, image_files.read("o.tif").pixels
    assert np.array_equal(pixels[20:70, 5:45], pixels[20:70, 55:95])
    assert np.allclose(st[45, [25, 75], :2], 0.5, atol=0.03) and np.allclose(st[85, 50, :2], 0.5, atol=0.03)
    alone = iccm(  # parts are mapped by their outlines, without --detail
        *("map", "face.svg#head", "word.svg#a", "--target-box", "viewbox", "--size", "100"),
        *("--detail", "0", "--background", "transparent", "-o", "alone.png"),
    )
    assert alone.code == 0
    assert np.array_equal(pixels[20:70, 5:45], image_files.read("alone.png").pixels[20:70, 5:45])
    curves = [part.curve for part in shape.read_all("o.svg")]
    assert len(curves) == 3 * 4  # head, two eyes and a pupil
    eyes = [curve for curve in curves if 0.01 < curve.area / 2000 < 0.1]  # those of the letters
    middles = np.sort_complex([sum(eye.box) / 2 for eye in eyes])
    assert np.allclose(middles[:2] + 50, middles[-2:], atol=0.1)


@pytest.mark.slow
def test_a_pattern_has_one_scale_on_all_parts(drawings, iccm):
    """A repeated texture has the same scale on the dot as on the letters; any other texture is whole on each."""
    (drawings / "word.svg").write_text(SVG.format(WORD))
    (drawings / "tile.svg").write_text(SVG.format('<rect x="10" y="20" width="80" height="60"/>'))
    image_files.write("tile.png", image_files.Image(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)))
    command = ("map", "tile.svg", "word.svg", "--parts", "each", "--size", "400", "--texture", "tile.png")
    spread = {}
    for edge in ("repeat", "clamp"):
        assert iccm(*command, "--edge", edge, "--stmap", "o.tif", "-o", "o.png", "--force").code == 0
        st = image_files.read("o.tif").pixels
        # area of texture per pixel in the middle of a letter and of the dot, by finite differences
        determinants = []
        for row, column in ((180, 100), (340, 200)):
            right = st[row, column + 4, :2] - st[row, column - 4, :2]
            down = st[row + 4, column, :2] - st[row - 4, column, :2]
            determinants.append(abs(right[0] * down[1] - right[1] * down[0]))
        spread[edge] = determinants[1] / determinants[0]
    assert spread["repeat"] == pytest.approx(1, abs=0.25)
    assert spread["clamp"] > 4  # the dot has a sixth of a letter's area


@pytest.mark.slow
def test_each_piece_of_a_mesh_gets_the_source(drawings, iccm):
    corners = [f"v {x} {y} {z}" for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = ["f 1 2 3", "f 1 3 4", "f 5 6 7", "f 5 7 8"]
    (drawings / "two.obj").write_text("\n".join([*corners, *faces]))
    result = iccm("map", "square.svg", "two.obj", "--parts", "each", "-o", "o.obj", "--report", "r.json")
    assert result.code == 0
    uv = [
        line.split()[1:] for line in (drawings / "o.obj").read_text().splitlines() if line.startswith("vt ")
    ]
    coordinates = np.unique(np.round(np.array(uv, float), 6), axis=0)
    assert np.allclose(coordinates, [(0.1, 0.1), (0.1, 0.9), (0.9, 0.1), (0.9, 0.9)])
    assert [part["target"] for part in json.loads((drawings / "r.json").read_text())["parts"]] == [
        "piece-1",
        "piece-2",
    ]


@pytest.mark.slow
def test_parts_each_works_in_batches_and_without_pins(drawings, iccm):
    (drawings / "word.svg").write_text(SVG.format(WORD))
    job = {
        "source": "square.svg",
        "target": "word.svg",
        "parts": "each",
        "output": "o.png",
        "report": "r.json",
    }
    (drawings / "jobs.jsonl").write_text(json.dumps(job))
    assert iccm("batch", "jobs.jsonl", "-j", "1").code == 0
    assert len(json.loads((drawings / "r.json").read_text())["parts"]) == 3
    refused = iccm("map", "square.svg", "word.svg", "--parts", "each", "--pin", "50,50:50,50")
    assert refused.code == 2 and "--parts each: pins and strokes only work for one shape" in refused.err


@pytest.mark.slow
def test_a_part_without_a_map_is_omitted_reported_and_counted(drawings, iccm):
    """A triangle whose height is 1e-5 of its width has no map; the figures of the other part are as if it were
    alone.
    """
    corners = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "v 3 0 0", "v 4 0 0", "v 3.4 1e-5 0"]
    (drawings / "two.obj").write_text("\n".join([*corners, "f 1 2 3", "f 1 3 4", "f 5 6 7"]))
    command = ("map", "square.svg", "two.obj", "--parts", "each")
    result = iccm(*command, "-o", "o.obj", "--report", "r.json", "-q")
    assert result.code == 1 and "1 of 2 parts are omitted" in result.err
    assert "#piece-2: omitted: " in result.err and "no map without folds" in result.err
    report = json.loads((drawings / "r.json").read_text())
    assert report["mapped"] == pytest.approx(2 / 3) and [part["target"] for part in report["parts"]] == [
        "piece-1"
    ]
    assert [(left["source"], left["target"]) for left in report["without_map"]] == [("", "piece-2")]
    faces = [line for line in (drawings / "o.obj").read_text().splitlines() if line.startswith("f ")]
    assert ["/" in face for face in faces] == [True, True, False]
    alone = iccm("map", "square.svg", "two.obj#piece-1", "-o", "alone.obj", "--report", "alone.json")
    assert alone.code == 0
    alone_report = json.loads((drawings / "alone.json").read_text())
    assert (
        alone_report["dilatation"] == report["dilatation"] and alone_report["boundary"] == report["boundary"]
    )


def test_where_no_part_has_a_map_nothing_is_written(drawings, iccm):
    thin = '<path d="M5 {0}H95L40 {0}.00001z"/>'
    (drawings / "thin.svg").write_text(SVG.format(thin.format(20) + thin.format(60)))
    result = iccm("map", "square.svg", "thin.svg", "--parts", "each", "-o", "o.png")
    assert result.code == 2 and "error: no map without folds" in result.err
    assert not (drawings / "o.png").exists()


ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g fill="none" stroke="teal" stroke-width="9">'
    '<path d="M15 44Q50 12 85 44"/><path d="M30 62Q50 42 70 62"/></g><circle cx="50" cy="80" r="8" fill="teal"/></svg>'
)
"""Two open lines and a disc."""


@pytest.mark.slow
def test_lines_next_to_fills_are_separate_parts(shapes, iccm):
    (shapes / "icon.svg").write_text(ICON)
    facts = json.loads(iccm("info", "icon.svg", "--json").out)
    assert [round(outline["area"], -2) for outline in facts["outlines"]] == [700, 400, 200]
    result = iccm("map", "square.svg", "icon.svg", "--parts", "each", "--size", "100", "-o", "each.png")
    assert result.code == 0, result.err
    alpha = np.asarray(Image.open("each.png"))[..., 3]
    assert alpha.sum() / 255 == pytest.approx(sum(outline["area"] for outline in facts["outlines"]), rel=0.03)
    assert iccm("map", "square.svg", "icon.svg#2", "--size", "100", "-o", "second.png").code == 0
    rows = np.flatnonzero(np.asarray(Image.open("second.png"))[..., 3].any(axis=1))
    assert rows.size and rows.min() > 0


@pytest.mark.slow
def test_artwork_shows_all_parts_that_are_mapped_one_by_one(shapes, iccm):
    mug = (
        '<path d="M20 50H70V90H20Z"/><path d="M30 10H38V40H30Z"/>'
        '<path fill-rule="evenodd" d="M75 20H95V44H75ZM80 25V39H90V25Z"/>'
    )
    disc = '<circle cx="45" cy="70" r="{}"/><circle cx="33" cy="26" r="8"/><circle cx="85" cy="30" r="10"/>'
    for name, drawn in (("mug", mug), ("discs", disc.format(18))):
        (shapes / f"{name}.svg").write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{drawn}</svg>'
        )
    result = iccm("map", "discs.svg", "mug.svg", "--texture", "checker", "-o", "a.svg")
    assert result.code == 0 and "3 parts" in result.err and "--parts joined" in result.err, result.err
    area = shape.read("a.svg", whole=True).drawing
    assert len(area.parts) == 3 and area.region.area == pytest.approx(
        50 * 40 + 8 * 30 + 20 * 24 - 10 * 14, rel=0.02
    )


def test_parts_that_lie_on_others_keep_their_own_colours(drawings, iccm):
    result = iccm(*ALL, "-o", "own.png")
    assert result.code == 0, result.err
    pixels = np.asarray(Image.open("own.png"))
    assert pixels[2 * 44, 2 * 32].tolist() == [0, 0, 0, 255]  # the right eye
    assert pixels[2 * 80, 2 * 50].tolist() == [255, 204, 0, 255]


TITTLES = (  # two letters of two parts each, and a bar
    '<path d="M5 30h15v50h-15zM7 8h11v12h-11z"/><path id="u" d="M40 30h30v50h-30zM42 10h8v8h-8zM60 10h8v8h-8z"/>'
    '<path d="M80 20h12v60h-12z"/>'
)


@pytest.mark.slow
def test_one_source_is_mapped_onto_each_element_with_all_of_its_parts(drawings, iccm):
    (drawings / "tile.svg").write_text(SVG.format('<path d="M0 0h100v90H0z"/>'))
    (drawings / "word.svg").write_text(SVG.format(TITTLES))
    ramp = np.zeros((90, 100, 3), np.uint8)
    ramp[..., 0], ramp[..., 1] = np.arange(100), 200 - 2 * np.arange(90)[:, None]
    image_files.write("ramp.png", image_files.Image(ramp))
    common = ("map", "tile.svg", "word.svg", "--texture", "ramp.png", "--size", "200", "--force")
    result = iccm(*common, "--parts", "elements", "-o", "o.png", "--report", "r.json")
    assert result.code == 0, result.err
    report = json.loads(Path("r.json").read_text())
    assert [part["target"] for part in report["parts"]] == ["1", "2", "3"] and report["covered"] > 0.99
    pixels = image_files.read("o.png").pixels.astype(int)
    # the texture continues from the tittle to the foot of the first letter: the tittle has only its upper part
    assert pixels[20:36, 20, 1].min() > 150 and pixels[150, 20, 1] < 60
    assert (np.diff(pixels[64:156, 20, 1]) <= 2).all() and pixels[64, 20, 1] < pixels[38, 20, 1]
    assert (
        pixels[28, 92, 0] + 15 < pixels[28, 128, 0]
    )  # both tittles of the second letter are parts of one texture
    assert iccm(*common, "--parts", "each", "-o", "each.png").code == 0
    alone = image_files.read("each.png").pixels.astype(int)
    assert np.ptp(alone[20:36, 20, 1]) > 100  # the whole texture
    drawn = iccm(
        *(
            "map",
            "tile.svg",
            "word.svg",
            "--parts",
            "elements",
            "--background",
            "transparent",
            "-o",
            "o.svg",
            "--force",
        )
    )
    areas = [part.curve.area for part in shape.read_all("o.svg")]
    assert drawn.code == 0 and sum(areas) == pytest.approx(3230, rel=0.02)


def test_letters_of_a_font_are_elements(drawings, iccm):
    font = Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
    (drawings / "tile.svg").write_text(SVG.format('<path d="M0 0h100v90H0z"/>'))
    whole = shape.read(f"{font}#text=i\u00e4!", whole=True)
    assert sorted(len(element.drawing.parts) for element in whole.by_element()) == [2, 2, 3]
    assert len(whole.drawing.parts) == 7
    (drawings / "two.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh = iccm("map", "tile.svg", "two.obj", "--parts", "elements", "-o", "o.obj")
    assert mesh.code == 2 and "--parts each" in mesh.err
