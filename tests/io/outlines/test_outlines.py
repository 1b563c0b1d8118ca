"""Shapes from other sources: GeoJSON, annotations, fonts, DXF."""

import json
import os
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.describe import describe, lines
from iccm.io.shapes import shape

FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def ring(x, y, side):
    return [[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]


def feature(geometry, **members):
    return {"type": "Feature", **members, "geometry": geometry}


COUNTRIES = {
    "type": "FeatureCollection",
    "features": [
        feature(
            {"type": "Polygon", "coordinates": [ring(0, 0, 10), ring(4, 4, 2)[::-1]]},
            id=7,
            properties={"ADMIN_NAME": "Big", "pop": 3},
        ),
        feature(
            {"type": "MultiPolygon", "coordinates": [[ring(20, 0, 3)], [ring(20, 8, 5)]]},
            properties={"name": "Two"},
        ),
        feature({"type": "Point", "coordinates": [0, 0]}, properties={"name": "dot"}),
        feature(None, properties=None),
    ],
}


def test_features_of_geojson_by_name_with_holes_and_parts(tmp_path):
    path = tmp_path / "c.geojson"
    path.write_text(json.dumps(COUNTRIES))
    big = shape.read(f"{path}#Big")
    assert big.curve.area == 100 and len(big.holes) == 1 and not big.flip
    assert shape.read(f"{path}#7").curve.area == 100 and shape.read(str(path)).curve.area == 100
    assert shape.read(f"{path}#Two").curve.area == 25 and shape.read(f"{path}#Two#2").curve.area == 9
    assert [outline.curve.area for outline in shape.read_all(str(path))] == [100, 25, 9]
    assert describe(path)["ids"] == ["7", "Big", "Two"]
    with pytest.raises(InputError, match="no 'None' in the file; it has 7, Big, Two"):
        shape.read(f"{path}#None")


def test_annotations_of_pictures_lie_on_their_canvas(tmp_path):
    labelme = {
        "shapes": [
            {"label": "cat", "points": [[10, 10], [90, 10], [50, 80]], "shape_type": "polygon"},
            {"label": "eye", "points": [[60, 20], [70, 20]], "shape_type": "circle"},
            {"label": "box", "points": [[5, 6], [15, 36]], "shape_type": "rectangle"},
            {"label": "line", "points": [[5, 6], [15, 36]], "shape_type": "line"},
        ],
        "imageWidth": 100,
        "imageHeight": 90,
    }
    path = tmp_path / "l.json"
    path.write_text(json.dumps(labelme))
    cat = shape.read(f"{path}#cat")
    assert cat.flip and cat.box == (-90j, 100) and cat.curve.area == 2800
    assert abs(shape.read(f"{path}#eye").curve.area - 100 * np.pi) < 0.1
    assert shape.read(f"{path}#box").curve.box == (5 - 36j, 15 - 6j)
    assert describe(path)["kind"] == "shapes"

    pictures = [{"id": k, "file_name": f"{k}.jpg", "width": 100, "height": 80} for k in (1, 2)]
    notes = [
        {"id": 11, "image_id": 1, "category_id": 3, "segmentation": [[10, 10, 90, 10, 90, 70, 10, 70]]},
        {"id": 12, "image_id": 1, "category_id": 3, "segmentation": {"counts": [1], "size": [1, 1]}},
        {"id": 13, "image_id": 2, "category_id": 3, "segmentation": [[0, 0, 9, 0, 9, 9, 0, 9]]},
    ]
    coco = {"images": pictures, "categories": [{"id": 3, "name": "dog"}], "annotations": notes}
    path.write_text(json.dumps(coco))
    assert shape.read(f"{path}#11").curve.area == 4800 and shape.read(f"{path}#2.jpg").curve.area == 81
    assert shape.read(f"{path}#11").box == (-80j, 100)
    assert "ignored 1 run-length encoded mask (RLE); only polygons are read" in shape.read(f"{path}#11").notes
    with pytest.raises(InputError, match=r"annotations of 2 pictures.*#1\.jpg"):
        shape.read(f"{path}#dog")


def test_words_of_a_font_are_kerned_letters_with_counters():
    letters = shape.read_all(f"{FONT}#text=bo")
    assert [len(glyph.holes) for glyph in letters] == [1, 1] and letters[0].flip
    alone = {letter: shape.read(f"{FONT}#text={letter}") for letter in "AV"}
    pair = shape.read_all(f"{FONT}#text=AV")
    widths = {letter: float(np.ptp(glyph.curve.z.real)) for letter, glyph in alone.items()}
    apart = max(glyph.curve.z.real.max() for glyph in pair) - min(glyph.curve.z.real.min() for glyph in pair)
    assert apart < widths["A"] + widths["V"]  # kerned: V reaches over A
    assert len(shape.read_all(f"{FONT}#text=ij")) == 4
    low, high = shape.read(f"{FONT}#text=H").curve.box
    assert (
        low.imag == pytest.approx(-80) and -30 < high.imag < 0
    )  # on a baseline at 80, y down, of 100 to the em
    assert shape.read(f"{FONT}#text=H").box[0].imag == -100
    for text, why in (
        ("", "a font needs a text"),
        ("#text=", "a font needs a text"),
        ("#text=\u4e00", "lacks letters"),
    ):
        with pytest.raises(InputError, match=why):
            shape.read(f"{FONT}{text}")


def test_closed_lines_of_dxf_by_layer(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is an extra")
    document = ezdxf.new()
    space = document.modelspace()
    space.add_lwpolyline(
        [(0, 0, 0, 0, 1), (10, 0), (10, 10), (0, 10)], close=True, dxfattribs={"layer": "part"}
    )
    space.add_circle((5, 5), 2, dxfattribs={"layer": "part"})
    lines = {"layer": "lines"}
    for begin, end in (((20, 0), (30, 0)), ((30, 0), (30, 5)), ((20, 5), (20, 0)), ((20, 15), (22, 10))):
        space.add_line(begin, end, dxfattribs=lines)
    space.add_arc((25, 5), 5, 0, 180, dxfattribs=lines)
    block = document.blocks.new("leaf")
    block.add_ellipse((0, 0), (2, 0), 0.5, dxfattribs={"layer": "leaves"})
    space.add_blockref("leaf", (50, 50), dxfattribs={"xscale": 2, "yscale": 2})
    path = tmp_path / "d.dxf"
    document.saveas(path)
    part = shape.read(f"{path}#part")
    assert abs(part.curve.area - (100 + 12.5 * np.pi)) < 0.05 and len(part.holes) == 1 and not part.flip
    space.add_lwpolyline([(5, 1), (4, 2), (5, 2)], close=True, dxfattribs={"layer": "part"})  # clockwise
    space.add_lwpolyline([(8, 1), (9, 1), (9, 2)], close=True, dxfattribs={"layer": "part"})
    document.saveas(path)
    assert len(shape.read(f"{path}#part").holes) == 3
    joined = shape.read(f"{path}#lines")
    assert abs(joined.curve.area - (50 + 12.5 * np.pi)) < 0.05
    assert any("1 open lines of layer 'lines'" in note for note in joined.notes)
    leaf = shape.read(f"{path}#leaves").curve
    assert abs(leaf.area - 8 * np.pi) < 0.05 and abs(leaf.z.mean() - (50 + 50j)) < 0.5


@pytest.mark.slow
def test_reading_dxf_leaves_nothing_in_the_home(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is an extra")
    document = ezdxf.new()
    document.modelspace().add_circle((5, 5), 2)
    document.saveas(tmp_path / "d.dxf")
    home = tmp_path / "home"
    home.mkdir()
    folders = {name: str(home) for name in ("HOME", "USERPROFILE", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")}
    code = "from iccm.io.outlines import dxf; from pathlib import Path; dxf.read(Path('d.dxf')); import os; "
    code += "print(os.environ['XDG_CACHE_HOME'])"
    result = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=os.environ | folders, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert result.stdout.strip() == str(home) and not list(home.rglob("*"))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.geojson", "{"),
        ("a.geojson", "[1]"),
        ("a.geojson", '{"type": "FeatureCollection"}'),
        ("a.geojson", '{"type": "Polygon", "coordinates": 3}'),
        ("a.geojson", '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0]]]}'),
        ("a.geojson", '{"type": "Polygon", "coordinates": [[[0, 0], [1e999, 0], [1, 1]]]}'),
        ("a.geojson", '{"type": "Point", "coordinates": [0, 0]}'),
        ("a.json", '{"shapes": [3]}'),
        ("a.json", '{"shapes": [{"label": "a", "points": [[0, 0]], "shape_type": "circle"}]}'),
        ("a.json", '{"annotations": [{"segmentation": [["a", "b"]]}]}'),
        ("a.json", '{"pins": []}'),
        ("a.dxf", "hello"),
        ("a.ttf", "hello"),
    ],
)
def test_bad_files_get_one_line(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=f"{name}") as error:
        shape.read(f"{path}#text=a" if name == "a.ttf" else str(path))
    assert "\n" not in str(error.value)


def box(west, south, east, north):
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


ACROSS = {
    "cut": {"type": "MultiPolygon", "coordinates": [[box(177, -19, 180, -16)], [box(-180, -19, -178, -16)]]},
    "wrapped": {"type": "Polygon", "coordinates": [box(177, -19, -178, -16)]},
    "with points on it": {
        "type": "Polygon",
        "coordinates": [
            [[177, -19], [180, -19], [-178, -19], [-178, -16], [180, -16], [177, -16], [177, -19]]
        ],
    },
}


@pytest.mark.parametrize("kind", ACROSS)
def test_polygons_across_the_antimeridian_are_in_one_piece(tmp_path, kind):
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps(feature(ACROSS[kind], properties={"name": "Fiji"})))
    (outline,) = shape.read_all(str(path))
    assert outline.curve.box == (177 - 19j, 182 - 16j) and outline.curve.area == pytest.approx(15)
    assert any("Fiji" in note and "180°" in note for note in outline.notes)


def test_islands_on_both_sides_of_the_antimeridian_lie_beside_each_other(tmp_path):
    """A hole moves with its island; what spans the world or is not in degrees is not moved."""
    path = tmp_path / "a.geojson"
    parts = [[box(-170, 50, -100, 70), box(-150, 55, -140, 60)], [box(172, 51, 176, 53)]]
    path.write_text(json.dumps(feature({"type": "MultiPolygon", "coordinates": parts})))
    mainland, island = shape.read_all(str(path))
    low, high = (
        min(a.curve.box[0].real for a in (mainland, island)),
        max(a.curve.box[1].real for a in (mainland, island)),
    )
    assert high - low == pytest.approx(88) and len(mainland.holes) == 1
    assert mainland.holes[0].real.min() - mainland.curve.box[0].real == pytest.approx(20)
    for still in (box(-180, -90, 180, -70), box(-2000, 0, 2000, 40)):
        path.write_text(json.dumps({"type": "Polygon", "coordinates": [still]}))
        assert shape.read(str(path)).curve.box[0].real == still[0][0]


TOPOLOGY = {
    "type": "Topology",
    "transform": {"scale": [0.5, 2], "translate": [100, 10]},
    "arcs": [[[0, 0], [0, 4]], [[0, 0], [-6, 0], [0, 4], [6, 0]], [[0, 4], [8, 0], [0, -4], [-8, 0]]],
    "objects": {
        "lands": {
            "type": "GeometryCollection",
            "geometries": [
                {"type": "Polygon", "arcs": [[1, -1]], "properties": {"name": "West"}},
                {"type": "MultiPolygon", "arcs": [[[0, 2]]], "id": "East"},
            ],
        }
    },
}


def test_topojson_has_the_polygons_that_its_arcs_make(tmp_path):
    """Both polygons share an arc, one of them in reverse; points are stored as differences of whole numbers."""
    path = tmp_path / "t.topojson"
    path.write_text(json.dumps(TOPOLOGY))
    west, east = shape.read(f"{path}#West"), shape.read(f"{path}#East")
    assert west.curve.box == (97 + 10j, 100 + 18j) and west.curve.area == 24
    assert east.curve.box == (100 + 10j, 104 + 18j) and east.curve.area == 32
    wrong = TOPOLOGY | {"objects": {"a": {"type": "Polygon", "arcs": [[7]]}}}
    path.write_text(json.dumps(wrong))
    with pytest.raises(InputError, match=r"arc 7.* 3 arcs"):
        shape.read(str(path))


def test_features_in_a_bare_list_and_on_lines(tmp_path):
    listed = tmp_path / "q.geojson"
    listed.write_text(json.dumps(COUNTRIES["features"]))
    by_line = tmp_path / "l.geojsonl"
    by_line.write_text("\n".join("\x1e" + json.dumps(outline) for outline in COUNTRIES["features"]) + "\n\n")
    for path in (listed, by_line):
        assert [outline.curve.area for outline in shape.read_all(str(path))] == [100, 25, 9]


def test_the_error_for_geojson_without_polygons_lists_its_geometries(tmp_path):
    path = tmp_path / "a.geojson"
    tracks = [feature({"type": "LineString", "coordinates": [[0, 0], [1, 1]]})] * 3
    empty = [
        feature({"type": "MultiPolygon", "coordinates": []}),
        feature({"type": "Polygon", "coordinates": []}),
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": tracks + empty}))
    with pytest.raises(InputError, match=r"no polygons.*3 LineString.*empty MultiPolygon"):
        shape.read(str(path))
    square = feature({"type": "Polygon", "coordinates": [ring(0, 0, 4)]})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [*empty, square]}))
    assert shape.read(str(path)).curve.area == 16


def test_a_word_in_a_font_is_described_and_web_fonts_are_named():
    description = describe(f"{FONT}#text=On")
    assert description["outlines_in_all"] == 2 and description["ids"] == ["text=On"]


def test_web_fonts_are_refused_by_name(tmp_path):
    (tmp_path / "a.woff2").write_bytes(b"wOF2")
    with pytest.raises(InputError, match=r"a\.woff2: web fonts.*\.ttf"):
        shape.read(f"{tmp_path}/a.woff2#text=A")


def test_boxes_far_from_the_origin_are_listed_with_the_digits_of_their_size(tmp_path):
    path = tmp_path / "utm.geojson"
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [ring(550123.25, 4200456.5, 80)]}))
    line = next(line for line in lines(describe(path)) if "number 1" in line)
    assert "box 550123.25 4200456.5 550203.25 4200536.5" in line
