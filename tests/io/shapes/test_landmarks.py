"""Pairs of landmarks of other programs: read in their units and conventions, and written back unchanged."""

import json

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.shapes import listing, shape
from iccm.io.shapes.landmarks import landmarks_file
from iccm.io.shapes.landmarks.pairs import LandmarkPairs

BIGWARP = """\
"Pt-0","true","12.5","30.0","20.0","40.5"
"Pt-1","false","1","2","3","4"
"Pt-2","true","50","60","70","65"
"""
QGIS = """#CRS: EPSG:3857
mapX,mapY,sourceX,sourceY,enable,dX,dY,residual
20.0,-40.5,12.5,-30.0,1,0,0,0
3,-4,1,-2,0,0,0,0
70,-65,50,-60,1,0,0,0
"""
OLD_QGIS = QGIS.replace("sourceX,sourceY", "pixelX,pixelY")
TPS = """LM=3
12.5 70
NA NA
50 40
IMAGE=a.jpg
ID=0
LM=3
20 59.5
3 96
70 35
ID=1
"""
SOURCE, TARGET = [(12.5, 30), (50, 60)], [(20, 40.5), (70, 65)]


@pytest.fixture
def pair(tmp_path):
    """Two drawings of 100 units, with y down."""
    text = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="{}"/></svg>'
    for name, d in (("a", "M5 5H90V95H5Z"), ("b", "M2 8H95L80 90H10Z")):
        (tmp_path / f"{name}.svg").write_text(text.format(d))
    return shape.read(str(tmp_path / "a.svg")), shape.read(str(tmp_path / "b.svg"))


@pytest.mark.parametrize(
    ("name", "text"), [("l.csv", BIGWARP), ("gcp.points", QGIS), ("old.points", OLD_QGIS), ("two.tps", TPS)]
)
def test_landmarks_are_pins_in_the_units_of_the_files(pair, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    pins = listing.read(tmp_path / name).pins_of(*pair)
    assert np.allclose([pin.source for pin in pins], SOURCE) and np.allclose(
        [pin.target for pin in pins], TARGET
    )


def test_maps_in_files_with_y_up_keep_their_coordinates(pair, tmp_path):
    ring = [[-10, -50], [10, -50], [10, -20], [-10, -20], [-10, -50]]
    polygon = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    (tmp_path / "c.geojson").write_text(json.dumps(polygon))
    country = shape.read(str(tmp_path / "c.geojson"))
    text = QGIS.replace("20.0,-40.5", "2.5,-40.5").replace("70,-65", "-3,-25")
    pins = landmarks_file.file_of("gcp.points").parse(text.encode()).in_file_units(pair[0], country)
    assert np.allclose([source for _, source, _ in pins], SOURCE)
    assert np.allclose([target for *_, target in pins], [(2.5, -40.5), (-3, -25)])


@pytest.mark.parametrize("suffix", (".csv", ".points", ".tps"))
def test_written_landmarks_are_read_back(pair, suffix):
    pins = [
        listing.PinEntry(name=f"p{k}", source=a, target=b) for k, (a, b) in enumerate(zip(SOURCE, TARGET))
    ]
    file = landmarks_file.file_of(f"x{suffix}")
    text = file.text(LandmarkPairs.of_pins(pins, *pair, file.axes))
    again = file.parse(text.encode()).in_file_units(*pair)
    assert np.allclose([source for _, source, _ in again], SOURCE)
    assert np.allclose([target for *_, target in again], TARGET)


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.csv", "name,x,y\n1,2,3\n", "3 columns"),
        ("a.csv", '"p","true","1","2","3","4","5","6"\n', "in space"),
        ("a.csv", '"p","true","1","two","3","4"\n', "'two'"),
        ("a.csv", '"p","true","1","inf","3","4"\n', "'inf'"),
        ("a.csv", '"p","false","1","2","3","4"\n', "no landmarks"),
        ("a.points", "x,y\n1,2\n", "mapX"),
        ("a.points", "mapX,mapY,sourceX,sourceY\n1,2,3\n", "line 2"),
        ("a.tps", "LM=1\n1 2\n", "1 specimens"),
        ("a.tps", "LM=1\n1 2\nLM=2\n1 2\n3 4\n", "landmarks"),
        ("a.tps", "LM=" + "9" * 5000 + "\n1 2\n", "line 2"),
        ("a.tps", "no landmarks\n", "LM="),
    ],
)
def test_wrong_files_are_refused_with_the_reason(tmp_path, name, text, reason):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=reason) as error:
        listing.read(tmp_path / name)
    assert name in str(error.value)


@pytest.mark.slow
def test_the_command_accepts_landmarks_as_pins(pair, tmp_path, iccm, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "l.csv").write_text(BIGWARP)
    assert (
        iccm(
            "map", "a.svg", "b.svg", "--pins", "l.csv", "--size", "40", "-o", "o.png", "--report", "r.json"
        ).code
        == 0
    )
    report = json.loads((tmp_path / "r.json").read_text())
    assert len(report["pins"]) == 2
