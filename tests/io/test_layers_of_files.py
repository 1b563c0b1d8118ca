"""The forms of GeoJSON, and layers of GeoPackage, Shapefile and KML, carried through a map and read by pyogrio."""

import json

import numpy as np
import pytest
import shapely

FEATURES = [
    {
        "type": "Feature",
        "properties": {"name": "p", "n": 1},
        "geometry": {"type": "Point", "coordinates": [30, 20]},
    },
    {
        "type": "Feature",
        "properties": {"name": "away", "n": 4},
        "geometry": {"type": "Point", "coordinates": [900, 20]},
    },
    {
        "type": "Feature",
        "properties": {"name": "l", "n": 2},
        "geometry": {"type": "LineString", "coordinates": [[20, 20], [60, 20], [60, 50]]},
    },
    {
        "type": "Feature",
        "properties": {"name": "a", "n": 3},
        "geometry": {"type": "Polygon", "coordinates": [[[20, 20], [60, 20], [60, 50], [20, 20]]]},
    },
]


@pytest.fixture
def doubled(tmp_path, monkeypatch, iccm):
    """m.npz, which doubles coordinates and adds 10 to x."""
    monkeypatch.chdir(tmp_path)
    for name, ring in (("a", [[0, 0], [100, 0], [100, 80], [0, 80], [0, 0]]), ("b", None)):
        ring = ring or [[10, 0], [210, 0], [210, 160], [10, 160], [10, 0]]
        (tmp_path / f"{name}.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    assert iccm("map", "a.geojson", "b.geojson", "-o", "m.npz").code == 0
    return tmp_path


def image(z):
    return [[2 * x + 10, 2 * y] for x, y in z]


def check(features):
    """Whether features are the images of the three of FEATURES that lie inside."""
    by_name = {feature["properties"]["name"]: feature["geometry"] for feature in features}
    assert {*by_name} == {"p", "l", "a"}
    np.testing.assert_allclose(by_name["p"]["coordinates"], image([[30, 20]])[0], atol=1e-6)
    for name, at in (("l", 2), ("a", 3)):
        given = FEATURES[at]["geometry"]["coordinates"]
        given = given if name == "l" else given[0]
        line = np.array(by_name[name]["coordinates"] if name == "l" else by_name[name]["coordinates"][0])
        expected = shapely.LineString(image(given))
        assert shapely.hausdorff_distance(shapely.LineString(line), expected) < 0.05


@pytest.mark.parametrize(
    ("name", "text", "parse"),
    [
        (
            "c.geojson",
            json.dumps({"type": "FeatureCollection", "features": FEATURES}),
            lambda t: json.loads(t)["features"],
        ),
        ("l.geojson", json.dumps(FEATURES), json.loads),
        ("l.json", json.dumps(FEATURES), json.loads),
        ("f.geojsonl", "\n".join(map(json.dumps, FEATURES)), lambda t: [json.loads(s) for s in t.splitlines()]),
        (
            "s.geojsons",
            "".join(f"\x1e{json.dumps(f)}\n" for f in FEATURES),
            lambda t: [json.loads(s) for s in t.split("\x1e")[1:]],
        ),
    ],
)  # fmt: skip
@pytest.mark.keeps("geojson", "structure", "properties")
def test_every_form_of_geojson_stays_in_its_form(doubled, iccm, name, text, parse):
    (doubled / name).write_text(text)
    result = iccm("apply", "m.npz", name, "-o", f"out-{name}")
    assert result.code == 0 and "1 points, 1 lines, 1 polygons" in result.err
    check(parse((doubled / f"out-{name}").read_text()))


TOPOLOGY = {
    "type": "Topology",
    "objects": {
        "gone": {"type": "Point", "coordinates": [4000, 0], "properties": {"name": "away"}},
        "things": {
            "type": "GeometryCollection",
            "geometries": [
                {"type": "Point", "coordinates": [30, 20], "properties": {"name": "p"}},
                {"type": "LineString", "arcs": [0], "properties": {"name": "l"}},
                {"type": "Polygon", "arcs": [[0, 1]], "properties": {"name": "a"}},
            ],
        },
    },
    "arcs": [[[20, 20], [40, 0], [0, 30]], [[60, 50], [-40, -30]]],
    "transform": {"scale": [1, 1], "translate": [0, 0]},
}


@pytest.mark.keeps("geojson", "objects of TopoJSON")
@pytest.mark.loses("geojson", "shared arcs and quantization of TopoJSON, with a note")
def test_topologies_stay_topologies(doubled, iccm):
    from iccm.io.outlines import topology

    (doubled / "t.topojson").write_text(json.dumps(TOPOLOGY))
    result = iccm("apply", "m.npz", "t.topojson", "-o", "o.topojson")
    assert result.code == 0, result.err
    written = json.loads((doubled / "o.topojson").read_text())
    assert "without sharing" in result.err and "transform" not in written
    assert written["type"] == "Topology" and list(written["objects"]) == ["things"]
    (collection,) = topology.as_geojson(written)["features"]
    check(collection["features"])


@pytest.mark.keeps("geojson", "nuclei of QuPath's cells")
def test_nuclei_follow_their_cells(doubled, iccm):
    cell, nucleus = ([[[x, 10], [x + 20, 10], [x + 20, 30], [x, 10]]] for x in (10, 15))
    feature = {
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": cell},
        "nucleusGeometry": {"type": "Polygon", "coordinates": nucleus},
        "properties": {"objectType": "cell"},
    }
    (doubled / "cells.geojson").write_text(json.dumps([feature]))
    assert iccm("apply", "m.npz", "cells.geojson", "-o", "o.geojson").code == 0
    (written,) = json.loads((doubled / "o.geojson").read_text())
    for key, ring in (("geometry", cell[0]), ("nucleusGeometry", nucleus[0])):
        np.testing.assert_allclose(written[key]["coordinates"][0], image(ring), atol=1e-6)


@pytest.mark.large("pyogrio")
@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".kml", ".fgb"])
@pytest.mark.keeps("gis", "columns", "their types", "coordinate reference system")
def test_layers_are_carried_with_their_columns(doubled, iccm, suffix):
    import pyogrio

    polygons = shapely.to_wkb(
        np.array(
            [
                shapely.Polygon([(20, 20), (60, 20), (60, 50)]),
                shapely.box(2, 3, 9, 13),
                shapely.box(300, 0, 310, 9),
            ]
        )
    )
    names, counts = np.array(["a", "ü", "away"], dtype=object), np.array([7, 8, 9], dtype=np.int32)
    options = {".kml": {"driver": "KML"}, ".shp": {"encoding": "UTF-8"}}.get(suffix, {})
    pyogrio.raw.write(
        f"in{suffix}", polygons, [names, counts], ["Name", "count"], geometry_type="Polygon", layer="in",
        crs="EPSG:4326" if suffix == ".kml" else "EPSG:25832", **options,
    )  # fmt: skip
    result = iccm("apply", "m.npz", f"in{suffix}", "-o", f"out{suffix}")
    assert result.code == 0 and "2 polygons" in result.err, result.err
    meta, _, shapes, columns = pyogrio.raw.read(f"out{suffix}")
    fields = list(meta["fields"])
    assert list(columns[fields.index("Name")]) == ["a", "ü"]
    assert [int(value) for value in columns[fields.index("count")]] == [7, 8] or suffix == ".kml"
    assert meta["crs"] == ("EPSG:4326" if suffix == ".kml" else "EPSG:25832")
    first, second = shapely.from_wkb(shapes)
    expected = shapely.Polygon(image([(20, 20), (60, 20), (60, 50)]))
    assert shapely.symmetric_difference(first, expected).area < 2 and second.area == pytest.approx(
        280, rel=1e-3
    )
    assert iccm("map", f"in{suffix}", "b.geojson", "-o", "o.npz").code == 0
    again = iccm("apply", "m.npz", f"in{suffix}", "-o", f"out{suffix}")
    assert again.code == 2 and "--force" in again.err


@pytest.mark.large("pyogrio")
@pytest.mark.loses("gis", "other layers")
def test_layers_are_named(doubled, iccm):
    import pyogrio

    for layer, box in (("one", shapely.box(2, 3, 9, 13)), ("two", shapely.box(20, 3, 29, 33))):
        wkb = shapely.to_wkb(np.array([box]))
        pyogrio.raw.write(
            "in.gpkg", wkb, [np.array([layer], dtype=object)], ["name"], geometry_type="Polygon", layer=layer,
            crs="EPSG:25832", append=layer == "two",
        )  # fmt: skip
    assert iccm("apply", "m.npz", "in.gpkg#two", "-o", "o.gpkg").code == 0
    assert [str(name) for name, _ in pyogrio.list_layers("o.gpkg")] == ["two"]
    for words in (
        ("apply", "m.npz", "in.gpkg"),
        ("apply", "m.npz", "in.gpkg#three"),
        ("map", "in.gpkg", "b.geojson"),
    ):
        result = iccm(*words, "-o", "x.gpkg" if words[0] == "apply" else "x.npz")
        assert result.code == 2 and "one, two" in result.err and len(result.err.splitlines()) == 1
    assert iccm("map", "in.gpkg#two", "b.geojson", "-o", "y.npz").code == 0
    (doubled / "bad.gpkg").write_text("<OGRVRTDataSource/>")
    assert iccm("apply", "m.npz", "bad.gpkg", "-o", "z.gpkg").code == 2


@pytest.mark.large("pyogrio")
@pytest.mark.parametrize("before", ["", '<kml xmlns="http://www.opengis.net/kml/2.2"/>'])
def test_no_other_driver_of_gdal_reads_a_file(doubled, iccm, before):
    secret = doubled.parent / "secret.csv"
    secret.write_text('id,WKT\n1,"POLYGON((20 20,60 20,60 50,20 20))"\n')
    (doubled / "a.kml").write_text(
        f'{before}<OGRVRTDataSource><OGRVRTLayer name="secret"><SrcDataSource>{secret}</SrcDataSource>'
        '<GeometryField encoding="WKT" field="WKT"/></OGRVRTLayer></OGRVRTDataSource>'
    )
    result = iccm("apply", "m.npz", "a.kml", "-o", "o.kml")
    assert result.code == 2 and len(result.lines) == 1 and "a.kml" in result.err, result.err
    assert str(doubled) not in result.err
