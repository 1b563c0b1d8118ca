"""`iccm cartogram`: GeoJSON in, GeoJSON out."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from iccm.io.projections import EqualArea
from tests.conftest import validator

AFRICA = Path(__file__).parents[2] / "docs" / "files" / "africa.geojson"


def feature(name, box, **properties):
    geometry = shapely.geometry.mapping(shapely.box(*box))
    return {"type": "Feature", "id": name, "properties": {"name": name, **properties}, "geometry": geometry}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a file of three regions in metres."""
    monkeypatch.chdir(tmp_path)
    write("three.geojson", pop=(30, 10, 20))
    return tmp_path


def write(name, crs="EPSG:3035", **values):
    boxes = (400000, 0, 402000, 1000), (402000, 0, 403000, 1000), (400000, 1000, 403000, 2500)
    features = [
        feature("ABC"[k], box, **{by: row[k] for by, row in values.items()}) for k, box in enumerate(boxes)
    ]
    content = {"type": "FeatureCollection", "features": features}
    if crs:
        content["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{crs.replace(':', '::')}"}}
    Path(name).write_text(json.dumps(content))


def read(name):
    features = json.loads(Path(name).read_text())["features"]
    return features, np.array([shapely.from_geojson(json.dumps(feature["geometry"])) for feature in features])


def test_areas_properties_and_the_coordinate_system(folder, iccm):
    result = iccm("cartogram", "three.geojson", "--by", "pop", "-o", "out.geojson", "--report", "out.json")
    assert result.code == 0, result.err
    features, regions = read("out.geojson")
    assert [feature["properties"] for feature in features] == [
        {"name": "A", "pop": 30},
        {"name": "B", "pop": 10},
        {"name": "C", "pop": 20},
    ]
    assert shapely.area(regions) / 7.5e6 == pytest.approx([1 / 2, 1 / 6, 1 / 3], rel=2e-3)
    assert shapely.is_valid(regions).all() and shapely.coverage_is_valid(regions)
    assert json.loads(Path("out.geojson").read_text())["crs"]["properties"]["name"].endswith("3035")
    report = json.loads(Path("out.json").read_text())
    validator("cartogram-1").validate(report)
    assert set(report) == set(validator("cartogram-1").schema["properties"])
    assert report["folds"] == 0 and report["certified"] and report["area_error"]["max"] < 2e-3


def test_the_saved_map_carries_other_layers(folder, iccm):
    assert (
        iccm("cartogram", "three.geojson", "--by", "pop", "-o", "out.geojson", "--save", "map.npz").code == 0
    )
    town = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [402500, 500]}}
    Path("towns.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [town]}))
    result = iccm("apply", "map.npz", "towns.geojson", "-o", "moved.geojson")
    assert result.code == 0, result.err
    moved = json.loads(Path("moved.geojson").read_text())["features"][0]["geometry"]["coordinates"]
    assert read("out.geojson")[1][1].contains(shapely.Point(moved))


def test_values_from_a_table(folder, iccm):
    Path("votes.csv").write_text('name,votes\nC,"1,000"\nA,3000\nX,7\nB,\n', encoding="utf-8-sig")
    result = iccm("cartogram", "three.geojson", "--values", "votes.csv", "--by", "votes", "-o", "out.geojson")
    assert result.code == 0 and "B" in result.err
    features, regions = read("out.geojson")
    assert [feature["properties"]["votes"] for feature in features] == [3000, None, 1000]
    assert regions[0].area / regions[2].area == pytest.approx(3, rel=4e-3)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((1, "many", 2), "many"),
        ((1, -2, 2), "B"),
        ((0, 0, None), "pop"),
        ((1, True, 2), "True"),
    ],
)
def test_values_that_no_area_can_have(folder, iccm, values, expected):
    write("bad.geojson", pop=values, other=(1, 2, 3))
    result = iccm("cartogram", "bad.geojson", "--by", "pop", "-o", "out.geojson")
    assert result.code == 2 and expected in result.err
    assert not Path("out.geojson").exists()


def test_unknown_properties_are_answered_with_those_of_numbers(folder, iccm):
    write("more.geojson", pop=(1, 2, 3), kind=("a", "b", "c"))
    result = iccm("cartogram", "more.geojson", "--by", "popp", "-o", "out.geojson")
    assert result.code == 2 and "pop" in result.err and "kind" not in result.err


@pytest.mark.parametrize(
    "text",
    [
        "{}",
        "[]",
        "hello",
        '{"type": "FeatureCollection", "features": []}',
        '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"pop": 1}, "geometry": '
        '{"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}}]}',
        '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"pop": 1}, "geometry": '
        '{"type": "Polygon", "coordinates": [[[0, 0], [1, null], [1, 1], [0, 0]]]}}]}',
        '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"pop": 1}, "geometry": '
        '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [2, 0], [0, 0]]]}}]}',
    ],
)
def test_files_without_regions(folder, iccm, text):
    Path("bad.geojson").write_text(text)
    result = iccm("cartogram", "bad.geojson", "--by", "pop", "-o", "out.geojson")
    assert result.code == 2 and "Traceback" not in result.err
    assert not Path("out.geojson").exists()


@pytest.mark.slow
def test_countries_in_degrees_are_read_by_gdal(folder, iccm):
    pyogrio = pytest.importorskip("pyogrio")
    result = iccm("cartogram", str(AFRICA), "--by", "population", "-o", "africa.geojson")
    assert result.code == 0, result.err
    about = pyogrio.read_info("africa.geojson")
    assert about["features"] == 51 and "Lambert_Azimuthal_Equal_Area" in about["crs"]
    _, _, shapes, columns = pyogrio.raw.read("africa.geojson")
    regions, people = shapely.from_wkb(shapes), columns[list(about["fields"]).index("population")]
    assert shapely.is_valid(regions).all() and shapely.coverage_is_valid(regions)
    share = np.maximum(people / people.sum(), 1e-4)
    assert shapely.area(regions) / shapely.area(regions).sum() == pytest.approx(share / share.sum(), rel=0.01)


def test_areas_are_those_on_the_sphere():
    cell = shapely.box(10, 40, 11, 41).segmentize(0.01)
    area = 6371007.181**2 * np.radians(1) * (np.sin(np.radians(41)) - np.sin(np.radians(40)))
    for projection in (EqualArea(3.0, 52.0), EqualArea(0.0, None)):
        assert projection.project(cell).area == pytest.approx(area, rel=1e-4)


def test_countries_across_180_degrees_are_joined():
    halves = shapely.MultiPolygon([shapely.box(177, -18, 180, -16), shapely.box(-180, -18, -179, -16)])
    projection = EqualArea.of([halves])
    assert projection.longitude == pytest.approx(179)
    joined = projection.project(halves)
    assert joined.geom_type == "Polygon" and np.ptp(joined.bounds[::2]) < 5e5
    world = [shapely.box(-180, -80, 180, 80).segmentize(5)]
    assert EqualArea.of(world).latitude is None
