"""Shapes from where they are: GeoJSON, annotations, fonts, DXF."""

import json
import os
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.describe import describe
from iccm.io.shapes import shape

FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def ring(x, y, side):
    return [[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]


def feature(geometry, **said):
    return {"type": "Feature", **said, "geometry": geometry}


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
    assert [each.curve.area for each in shape.read_all(str(path))] == [100, 25, 9]
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
    assert "left out 1 mask by runs (RLE); polygons are read" in shape.read(f"{path}#11").notes
    with pytest.raises(InputError, match=r"annotations of 2 pictures; name one, #1\.jpg"):
        shape.read(f"{path}#dog")


def test_words_of_a_font_are_kerned_letters_with_counters():
    letters = shape.read_all(f"{FONT}#text=bo")
    assert [len(each.holes) for each in letters] == [1, 1] and letters[0].flip
    alone = {letter: shape.read(f"{FONT}#text={letter}") for letter in "AV"}
    pair = shape.read_all(f"{FONT}#text=AV")
    widths = {letter: float(np.ptp(each.curve.z.real)) for letter, each in alone.items()}
    apart = max(each.curve.z.real.max() for each in pair) - min(each.curve.z.real.min() for each in pair)
    assert apart < widths["A"] + widths["V"]  # kerned: V reaches over A
    assert len(shape.read_all(f"{FONT}#text=ij")) == 4
    low, high = shape.read(f"{FONT}#text=H").curve.box
    assert (
        low.imag == pytest.approx(-80) and -30 < high.imag < 0
    )  # on a baseline at 80, y down, of 100 to the em
    assert shape.read(f"{FONT}#text=H").box[0].imag == -100
    for said, why in (
        ("", "say what is to be set"),
        ("#text=", "say what is to be set"),
        ("#text=\u4e00", "lacks letters"),
    ):
        with pytest.raises(InputError, match=why):
            shape.read(f"{FONT}{said}")


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
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=os.environ | folders, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == str(home) and not list(home.rglob("*"))


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
