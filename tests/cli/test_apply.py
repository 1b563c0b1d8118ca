"""`iccm apply` with saved maps: files of every kind, in both directions."""

import functools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import roifile

import iccm as core
from iccm.io import limits
from iccm.io.apply import PICTURE_OPTIONS
from iccm.io.options import options_of
from iccm.io.pictures import image_files
from iccm.io.run import Job, run

pytestmark = pytest.mark.usefixtures("solve_once")

QUICK = ("--method", "paper", "--order", "0", "--vertices", "60")


@functools.cache
def content():
    """The content of the file of a map from a square onto a blob, both in files with y down."""
    run(Job(source="square.svg", target="blob.svg", output=["map.npz"]))
    return Path("map.npz").read_bytes()


@pytest.fixture
def saved(shapes):
    """map.npz"""
    result = content()
    (shapes / "map.npz").write_bytes(result)


@pytest.mark.slow
def test_info_describes_a_map(saved, iccm):
    facts = json.loads(iccm("info", "map.npz", "--json").out)
    assert facts["kind"] == "map" and facts["status"] == "reached" and facts["left_out"] == 0
    assert facts["source"]["vertices"] >= 4 and facts["triangles"] == len(core.load("map.npz").map.faces)
    assert iccm("map", "square.svg", "blob.svg", *QUICK, "-o", "paper.npz").code == 0
    assert json.loads(iccm("info", "paper.npz", "--json").out)["triangles"] is None
    Path("map.npz").write_bytes(b"PK")
    assert iccm("info", "map.npz").code == 2


def planted(name, **job):
    """Write the file of a map with other options in its job."""
    with np.load(name) as archive:
        arrays = dict(archive)
    about = json.loads(str(arrays["about"]))
    about["job"] |= job
    np.savez(name, **arrays | {"about": np.array(json.dumps(about))})


def test_a_map_names_no_files_and_raises_no_limits(saved, shapes, iccm):
    image_files.write("t.png", image_files.Image(core.checkerboard(64)))
    assert iccm("apply", "map.npz", "t.png", "-o", "a.png", "--size", "64").code == 0
    (shapes / "evil.svg").write_text("precious")
    paths = [
        name for name, (hint, _) in options_of().items() if name not in PICTURE_OPTIONS and "str" in str(hint)
    ]
    hostile = dict.fromkeys(paths, "../evil.svg") | dict.fromkeys(("plot", "report", "stmap"), "evil.svg")
    hostile |= {"force": True, "outside": True, "max_pixels": 1 << 40, "memory": 1 << 50, "padding": 9}
    hostile |= {"source": "evil.svg", "output": ["evil.svg"], "normal": ["evil.svg"]}
    planted("map.npz", **hostile)
    before = {path: path.read_bytes() for folder in (shapes, shapes.parent) for path in folder.glob("*.*")}
    result = iccm("apply", "map.npz", "t.png", "-o", "b.png", "--size", "64")
    assert result.code == 0, result.err
    assert (shapes / "b.png").read_bytes() == (shapes / "a.png").read_bytes()
    after = {path: path.read_bytes() for folder in (shapes, shapes.parent) for path in folder.glob("*.*")}
    assert after.pop(shapes / "b.png") and after == before
    result = iccm("apply", "map.npz", "t.png", "-o", "c.png", "--size", "64", "--max-pixels", "1000")
    assert result.code == 2 and "1000" in result.err


def test_a_saved_map_records_which_box_its_pictures_show(saved, iccm):
    image_files.write("t.png", image_files.Image(core.checkerboard(64)))
    pictures = []
    for box in ("viewbox", "bbox"):
        planted("map.npz", target_box=box)
        assert iccm("apply", "map.npz", "t.png", "-o", f"{box}.png", "--size", "96").code == 0
        pictures.append(image_files.read(f"{box}.png").pixels)
    margins = [int((pixels[0, :, 3] > 0).sum()) for pixels in pictures]
    assert margins[0] == 0 < margins[1]  # the canvas has a margin, the bounding box has none
    planted("map.npz", target_box="everything")
    result = iccm("apply", "map.npz", "t.png", "-o", "x.png")
    assert result.code == 2 and "map.npz" in result.err and "target_box" in result.err


def image_of(points):
    """Points of a file with y down, as images of the saved map."""
    w = core.load("map.npz").map(np.array(points) @ [1, -1j])
    return np.column_stack([w.real, -w.imag])


@pytest.mark.slow
def test_pictures_and_drawings_are_those_of_the_map_itself(shapes, iccm):
    texture = core.checkerboard(64)
    image_files.write("t.png", image_files.Image(texture))
    arguments = ("--texture", "t.png", "--size", "64")
    (shapes / "ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path fill-rule="evenodd" '
        'd="M10 10H90V90H10ZM40 40H60V60H40Z"/></svg>'
    )
    for source, target, options in (
        ("square.svg", "blob.svg", ()),
        ("square.svg", "blob.svg", QUICK),
        ("ring.svg", "ring.svg", ("--holes", "cut")),
        ("square.svg", None, ("--pin", "30,30:30,30", "--pin", "70,70:80,70")),
    ):
        command = ("map", source, target) if target else ("deform", source)
        result = iccm(
            *command, *arguments, *options, "-o", "map.npz", "-o", "a.png", "-o", "a.svg", "--force"
        )
        assert result.code == 0, result.err
        typed = iccm("apply", "map.npz", "t.png", "-o", "b.png", "--size", "64", "--force")
        assert typed.code == 0, typed.err
        assert iccm("apply", "map.npz", source, "-o", "b.svg", "--force").code == 0
        for suffix in ("png", "svg"):
            assert (shapes / f"a.{suffix}").read_bytes() == (shapes / f"b.{suffix}").read_bytes(), (
                options,
                suffix,
            )


def test_pictures_come_back_through_the_inverse(saved, shapes, iccm):
    x = np.linspace(0, 255, 128)
    smooth = np.stack(
        [np.broadcast_to(x, (128, 128)), np.broadcast_to(x[:, None], (128, 128))]
        + 2 * [np.full((128, 128), 255)]
    )
    image_files.write("t.png", image_files.Image(np.moveaxis(smooth, 0, 2).astype(np.uint8), 3))
    assert iccm("apply", "map.npz", "t.png", "-o", "there.png", "--size", "256").code == 0
    assert iccm("apply", "map.npz", "there.png", "--inverse", "-o", "back.png", "--size", "128").code == 0
    first, back = (
        image_files.read(name).pixels[20:-20, 20:-20].astype(int) for name in ("t.png", "back.png")
    )
    assert np.abs(first - back).max() <= 3


def test_tables_go_there_and_back(saved, shapes, iccm):
    rng = np.random.default_rng(1)
    points = rng.uniform(12, 88, (500, 2))
    rows = "".join(f'"cell, {k}",{x!r},{y!r}\r\n' for k, (x, y) in enumerate(points.tolist()))
    (shapes / "p.csv").write_text(f"name,X,Y\r\n{rows}out,1,1\r\nnone,,\r\n", newline="")
    typed = iccm("apply", "map.npz", "p.csv", "-o", "q.csv", "--report", "q.json")
    assert typed.code == 0 and "note: p.csv: 1 points outside" in typed.lines
    lines = (shapes / "q.csv").read_bytes().decode().split("\r\n")
    assert lines[0] == "name,X,Y" and len(lines) == 502 and lines[8].startswith('"cell, 7",')
    result = np.array([line.rsplit(",", 2)[1:] for line in lines[1:-1]], float)
    assert np.array_equal(result, image_of(points))
    report = json.loads((shapes / "q.json").read_text())
    assert report["points"] == 502 and report["points_outside"] == 1
    assert iccm("apply", "map.npz", "q.csv", "--inverse", "-o", "r.csv").code == 0
    back = np.array(
        [line.rsplit(",", 2)[1:] for line in (shapes / "r.csv").read_text().splitlines()[1:]], float
    )
    assert np.abs(back - points).max() < 1e-9 * 113
    assert iccm("apply", "map.npz", "p.csv", "-o", "k.csv", "--unmapped", "keep").code == 0
    assert (shapes / "k.csv").read_text().splitlines()[-2:] == ["out,,", "none,,"]
    typed = iccm("apply", "map.npz", "p.csv", "-o", "no.csv", "--unmapped", "refuse")
    assert typed.code == 2 and "1 points outside of the map's domain" in typed.lines[-1]
    assert not (shapes / "no.csv").exists()


def test_nothing_inside_the_map_is_no_success(saved, shapes, iccm):
    (shapes / "far.csv").write_text("x,y\n5000,5000\n")
    result = iccm("apply", "map.npz", "far.csv", "-o", "o.csv")
    assert result.code == 1 and result.lines[-1].endswith(
        "all of it lies outside of the map, so the result is empty"
    )
    assert (shapes / "o.csv").read_text() == "x,y\n" and "carried" not in result.err


def test_columns_are_named_or_numbered(saved, shapes, iccm):
    (shapes / "t.tsv").write_text("50\ta\t40\n60\tb\t30\n")
    (shapes / "n.csv").write_text("u;v;x;y\n50;40;0;0\n60;30;0;0\n")
    assert iccm("apply", "map.npz", "t.tsv", "-o", "t2.tsv", "--columns", "1,3").code == 0
    assert iccm("apply", "map.npz", "n.csv", "-o", "n2.csv", "--columns", "u,v").code == 0
    expected = image_of([(50, 40), (60, 30)])
    rows = [line.split("\t") for line in (shapes / "t2.tsv").read_text().splitlines()]
    assert np.array_equal(np.array([[row[0], row[2]] for row in rows], float), expected) and rows[1][1] == "b"
    rows = [line.split(";") for line in (shapes / "n2.csv").read_text().splitlines()[1:]]
    assert np.array_equal(np.array([row[:2] for row in rows], float), expected)


def test_geojson_keeps_its_properties(saved, shapes, iccm):
    square = [[30, 30], [70, 30], [70, 70], [30, 70], [30, 30]]
    hole = [[45, 45], [45, 55], [55, 55], [45, 45]]
    geometries = [
        {"type": "Point", "coordinates": [50, 40, 7]},
        {"type": "Polygon", "coordinates": [square, hole]},
        {"type": "LineString", "coordinates": [[50, 50], [50, 200]]},
        {"type": "Point", "coordinates": [1, 1]},
        {
            "type": "GeometryCollection",
            "geometries": [{"type": "MultiPoint", "coordinates": [[50, 40], [2, 2]]}],
        },
        None,
    ]
    features = [{"type": "Feature", "properties": {"n": k}, "geometry": g} for k, g in enumerate(geometries)]
    given = {"type": "FeatureCollection", "bbox": [1, 2, 3, 4], "name": "Grüße", "features": features}
    (shapes / "g.geojson").write_text(json.dumps(given))
    for outside, numbers in (("drop", [0, 1, 2, 4, 5]), ("keep", range(6))):
        result = iccm("apply", "map.npz", "g.geojson", "-o", "h.geojson", "--unmapped", outside, "--force")
        assert result.code == 0, result.err
        assert (
            "note: g.geojson: 2 points outside" in result.lines
            and "note: g.geojson: 1 lines cut" in result.lines
        )
        data = json.loads((shapes / "h.geojson").read_text(encoding="utf-8"))
        assert data["name"] == "Grüße" and "bbox" not in data
        assert [feature["properties"]["n"] for feature in data["features"]] == list(numbers)
    point, polygon, line, lost = (feature["geometry"] for feature in data["features"][:4])
    assert point == {"type": "Point", "coordinates": [*image_of([(50, 40)])[0].tolist(), 7]}
    rings = polygon["coordinates"]
    assert len(rings) == 2 and all(ring[0] == ring[-1] for ring in rings) and len(rings[0]) > 8
    assert line["type"] == "LineString" and lost == {"type": "Point", "coordinates": []}
    assert data["features"][4]["geometry"]["geometries"][0]["coordinates"] == image_of([(50, 40)]).tolist()


def test_features_that_are_null_are_dropped(saved, shapes, iccm):
    point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [50, 40]}}
    given = {"type": "FeatureCollection", "features": [point, None]}
    (shapes / "g.geojson").write_text(json.dumps(given))
    typed = iccm("apply", "map.npz", "g.geojson", "-o", "h.geojson")
    assert typed.code == 0, typed.err
    (result,) = json.loads((shapes / "h.geojson").read_text(encoding="utf-8"))["features"]
    assert result["geometry"]["coordinates"] == image_of([(50, 40)])[0].tolist()


def test_landmarks_in_json_tps_and_obj(saved, shapes, iccm):
    expected = image_of([(50, 40), (60, 30)])
    for content in (
        [[50, 40], [60, 30]],
        {"left": [50, 40], "right": [60, 30]},
        {"image": "a.png", "landmarks": [{"x": 50, "y": 40, "name": "a"}, {"x": 60, "y": 30}]},
    ):
        (shapes / "l.json").write_text(json.dumps(content))
        assert iccm("apply", "map.npz", "l.json", "-o", "m.json", "--force").code == 0
        numbers = json.loads((shapes / "m.json").read_text())
        numbers = numbers.get("landmarks", numbers) if isinstance(numbers, dict) else numbers
        values = [
            list(v.values())[:2] if isinstance(v, dict) else v
            for v in (numbers.values() if isinstance(numbers, dict) else numbers)
        ]
        assert np.array_equal(values, expected)
    # y up from the canvas' lower edge, which is at 100
    (shapes / "l.tps").write_text(
        "LM=3\n50 60\n60 70\n1 1\nIMAGE=a.jpg\nID=5\nSCALE=0.1\nLM=1\nNA NA\nID=6\n"
    )
    assert iccm("apply", "map.npz", "l.tps", "-o", "m.tps").code == 0
    lines = (shapes / "m.tps").read_text().splitlines()
    result = np.array([line.split() for line in lines[1:3]], float)
    assert np.abs(result - [[x, 100 - y] for x, y in expected]).max() < 1e-12
    assert lines[0] == "LM=3" and lines[3:] == ["NA NA", "IMAGE=blob.svg", "ID=5", "LM=1", "NA NA", "ID=6"]
    (shapes / "l.obj").write_text("o path\nv 50 40 2\nv 60 30 2\nv 300 30 2\nl 1 2\nl 2 3\np 1 3\n")
    assert iccm("apply", "map.npz", "l.obj", "-o", "m.obj").code == 0
    lines = (shapes / "m.obj").read_text().splitlines()
    v = np.array([line.split()[1:] for line in lines if line[0] == "v"], float)
    assert lines[0] == "o path" and [line[0] for line in lines].count("l") == 2 and (v[:, 2] == 2).all()
    assert (
        np.array_equal(v[0, :2], expected[0])
        and np.array_equal(v[-1, :2], expected[0])
        and lines[-1] == f"p {len(v)}"
    )
    (shapes / "n.obj").write_text("o path\nv 50 40 2\nv 60 30 2\nl -2 -1\nv 300 30 2\nl -2 -1\np 1 -1\n")
    assert iccm("apply", "map.npz", "n.obj", "-o", "o.obj").code == 0  # counted back from there
    assert (shapes / "o.obj").read_text() == (shapes / "m.obj").read_text()


@pytest.mark.parametrize(
    ("name", "content", "options", "message"),
    [
        ("a.csv", "x,y\n1,2\n3,four\n", (), "row 3: 'four' is not a coordinate"),
        ("a.csv", "x,y\n1,inf\n", (), "are not finite numbers"),
        ("a.csv", "x\n1\n", (), "--columns X,Y"),
        ("a.csv", "x,y\n1\n", (), "column 2 is needed"),
        ("a.csv", "", (), "the file is empty"),
        ("a.csv", "a,b\n1,2\n", ("--columns", "a,c"), "no column 'c'; the table has a, b"),
        ("a.csv", "\xff\xfe", (), "--columns X,Y"),
        ("a.geojson", "{", (), "not valid JSON"),
        (
            "a.geojson",
            '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 2]]]}',
            (),
            "a ring is not closed",
        ),
        ("a.geojson", '{"type": "LineString", "coordinates": [[0, 0]]}', (), "fewer than 2 positions"),
        ("a.geojson", '{"type": "FeatureCollection", "features": [3]}', (), "not valid GeoJSON"),
        ("a.geojson", '{"type": "FeatureCollection"}', (), "a FeatureCollection without members"),
        ("a.geojson", '{"type": "Feature", "geometry": {"type": []}}', (), "not valid GeoJSON"),
        ("a.geojson", '{"type": []}', (), "not GeoJSON, nor a list of points"),
        ("a.geojson", '{"type": "Point", "coordinates": ["a", 2]}', (), "is not a position"),
        ("a.json", '{"size": 3}', (), "not GeoJSON, nor a list of points"),
        ("a.tps", "LM=2\n1 2\nID=1\n", (), "line 3: 'ID=1' is not a position"),
        ("a.tps", "LM3=1\n1 2 3\n", (), "landmarks in space"),
        ("a.obj", "v 0 0 0\nl 1 2\n", (), "no vertex 2"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", (), "is a face"),
        ("a.obj", "v 0 0 0\nv 1 0 1\nl 1 2\n", (), "do not lie in a plane"),
        ("a.obj", "v 0 0 0\np 1\n", ("--unmapped", "keep"), "--unmapped keep"),
        ("a.json", "[[1, 2]]", ("--columns", "x,y"), "--columns: "),
        ("a.txt", "hello", (), "a.txt: "),
    ],
)
def test_bad_files_get_one_line(saved, shapes, iccm, name, content, options, message):
    (shapes / name).write_text(content, encoding="utf-8")
    result = iccm("apply", "map.npz", name, "-o", f"out{name[1:]}", *options)
    errors = [line for line in result.lines if line.startswith("error: ")]
    assert result.code == 2 and len(errors) == 1 and message in errors[0], result.err
    assert not (shapes / f"out{name[1:]}").exists()


def test_options_that_do_not_fit_are_refused(saved, shapes, iccm):
    image_files.write("t.png", image_files.Image(core.checkerboard(8)))
    (shapes / "a.csv").write_text("x,y\n50,50\n")
    for arguments, message in (
        (("map.npz", "a.csv", "-o", "a.json"), "choose a name that ends in .csv"),
        (
            ("map.npz", "t.png", "-o", "b.png", "--columns", "1,2"),
            "--columns: ",
        ),
        (("t.png", "t.png", "-o", "b.png", "--inverse"), "--inverse: "),
        (("map.npz", "square.svg", "-o", "square.svg", "--force"), "is also an input"),
        (("missing.npz", "a.csv", "-o", "b.csv"), "missing.npz: no such file"),
    ):
        result = iccm("apply", *arguments)
        assert result.code == 2 and message in result.lines[-1], result.err
    result = iccm("map", "square.svg", "blob.svg", "--parts", "all", "-o", "all.npz")
    assert result.code == 2 and "(file#id)" in result.lines[-1]


def test_a_drawing_becomes_a_picture_where_one_is_written(saved, shapes, iccm):
    (shapes / "two.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><rect width="100" height="100" fill="red"/>'
        '<rect width="50" height="100" fill="lime"/></svg>'
    )
    assert iccm("apply", "map.npz", "two.svg", "-o", "two.png", "--size", "64").code == 0
    pixels = image_files.read("two.png").pixels
    colours = {tuple(colour) for colour in pixels[pixels[..., 3] == 255][:, :3].tolist()}
    assert {(255, 0, 0), (0, 255, 0)} <= colours and not any(blue > 3 for _, _, blue in colours)


def farthest(points, images):
    """The largest distance of the images of points from the nearest of some positions."""
    return np.linalg.norm(image_of(points)[:, None] - images, axis=2).min(axis=1).max()


def test_a_damaged_name_of_a_region_is_not_reported_by_its_library(saved, shapes):
    """Python prints warnings of libraries to stderr where no program handles them."""
    data = roifile.ImagejRoi.frompoints(np.array([(20.0, 30), (60, 30), (40, 70)]), name="cell").tobytes()
    Path("damaged.roi").write_bytes(data[: data.index("cell".encode("utf-16-be")) + 3])
    command = [sys.executable, "-m", "iccm", "apply", "map.npz", "damaged.roi", "-o", "moved.roi"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0 and "exceeds" not in result.stderr


def test_regions_of_imagej_and_point_sets_of_elastix(saved, shapes, iccm):
    square, hole = [(20, 20), (20, 70), (75, 70), (75, 20)], [(30, 30), (40, 30), (40, 45)]
    path = [
        number
        for ring in (square, hole)
        for k, corner in enumerate(ring)
        for number in (float(k > 0), *corner)
    ]
    path = [*path[:12], 4.0, *path[12:], 4.0]
    regions = {
        "dots": (roifile.ROI_TYPE.POINT, square),
        "line": (roifile.ROI_TYPE.POLYLINE, hole),
        "cell": (roifile.ROI_TYPE.POLYGON, square),
        "ring": (roifile.ROI_TYPE.RECT, square),
    }
    rois = []
    for name, (kind, points) in regions.items():
        rois.append(roifile.ImagejRoi.frompoints(np.array(points, float), name=name, position=4))
        rois[-1].roitype = kind
    rois[-1].subpixel_coordinates = rois[-1].integer_coordinates = None
    rois[-1].n_coordinates, rois[-1].options = 0, roifile.ROI_OPTIONS(0)
    rois[-1].multi_coordinates, rois[-1].shape_roi_size = np.array(path, np.float32), len(path)
    roifile.roiwrite("rois.zip", rois)
    assert iccm("apply", "map.npz", "rois.zip", "-o", "there.zip").code == 0
    written = {roi.name: roi for roi in roifile.roiread("there.zip")}
    assert set(written) == set(regions) and {roi.position for roi in written.values()} == {5}
    for name, points in (("dots", square), ("line", hole), ("cell", square)):
        images = written[name].coordinates()
        assert written[name].roitype == regions[name][0]
        # lines get more vertices where they bend; those of the file are among them
        assert farthest(points, images) < 1e-3
    rings = written["ring"].coordinates(multi=True)
    assert len(rings) == 2 and farthest(hole, rings[1]) < 1e-3
    Path("cell.roi").write_bytes(rois[2].tobytes())
    assert iccm("apply", "map.npz", "cell.roi", "-o", "there.roi").code == 0
    assert farthest(square, roifile.roiread("there.roi").coordinates()) < 1e-3
    Path("in.pts").write_text("point\n2\n20 20\n75 30\n")
    assert iccm("apply", "map.npz", "in.pts", "-o", "out.pts").code == 0
    head, count, *rows = Path("out.pts").read_text().splitlines()
    places = np.array([row.split() for row in rows], float)
    assert (head, count) == ("point", "2") and np.allclose(places, image_of([(20, 20), (75, 30)]))


def test_without_an_output_the_option_is_named(saved, iccm):
    image_files.write("t.png", image_files.Image(core.checkerboard(16)))
    for names in (("map.npz", "square.svg"), ("t.png", "t.png")):
        answer = iccm("apply", *names)
        assert answer.code == 2 and "--output" in answer.err and len(answer.err.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a shell of POSIX")
def test_a_picture_is_carried_to_stdout(saved, shell):
    image_files.write("t.png", image_files.Image(core.checkerboard(16)))
    result = shell(
        "iccm apply map.npz t.png -o - --size 24 > out.png; iccm apply map.npz t.png -o to.png --size 24"
    )
    assert result.returncode == 0 and not result.stdout
    assert np.array_equal(image_files.read("out.png").pixels, image_files.read("to.png").pixels)


TRIANGLE = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 900">
<path fill="red" d="M{0} {0}h30v20Z"/></svg>"""


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", "x,y\n{0},{0}\n"),
        ("a.geojson", '{{"type": "LineString", "coordinates": [[{0}, {0}], [9999, {0}]]}}'),
        ("a.svg", TRIANGLE),
    ],
)
def test_files_outside_of_the_domain_are_no_success(saved, iccm, name, content):
    suffix = Path(name).suffix
    Path(name).write_text(content.format(700))
    result = iccm("apply", "map.npz", name, "-o", f"o{suffix}")
    assert result.code == 1 and "empty" in result.lines[-1] and Path(f"o{suffix}").exists()
    Path(name).write_text(content.format(50))
    assert iccm("apply", "map.npz", name, "-o", f"o{suffix}", "--force").code == 0
    if suffix == ".csv":
        Path(name).write_text(content.format(700))
        assert iccm("apply", "map.npz", name, "-o", "o.csv", "--unmapped", "keep", "--force").code == 0


@pytest.mark.parametrize(
    ("offset", "alpha", "more", "code"),
    [(0, 255, (), 0), (3, 255, (), 1), (-3, 255, (), 1), (3, 255, ("--edge", "repeat"), 0), (0, 0, (), 1)],
)
def test_an_stmap_that_shows_nothing_of_a_picture_is_no_success(
    tmp_path, monkeypatch, iccm, offset, alpha, more, code
):
    monkeypatch.chdir(tmp_path)
    y, x = np.mgrid[0:8, 0:8] / 8 + offset
    image_files.write(
        "m.exr", image_files.Image(np.stack([x, y, 0 * x, 1 + 0 * x], -1).astype(np.float32), 3)
    )
    opaque = core.checkerboard(16)
    pixels = np.concatenate([opaque, np.full_like(opaque[..., :1], alpha)], -1)
    image_files.write("t.png", image_files.Image(pixels, 3))
    result = iccm("apply", "m.exr", "t.png", "-o", "o.png", *more)
    assert result.code == code and Path("o.png").exists()
    assert not code or "shows nothing" in result.lines[-1]


@pytest.mark.parametrize(
    "typed",
    [
        ("apply", "m.npz", "t.png", "-o", "o.png", "--colorspace", ""),
        ("batch", "a.svg", "b.svg", "-o", "o/", "--dask", ""),
        ("standardize", "a.png", "b.png", "-o", ""),
    ],
)
def test_a_name_from_an_unset_variable_is_refused(iccm, typed):
    result = iccm(*typed)
    assert result.code == 2 and "the name is empty" in result.err


def test_polygons_that_together_cross_themselves_too_often_are_refused(saved, shapes, iccm, monkeypatch):
    """A star of five points crosses itself five times."""
    monkeypatch.setattr(limits, "CROSSINGS", 12)
    turns = 0.8 * np.pi * np.arange(5)
    stars = [[[30 + 20 * k + 8 * np.sin(t), 40 + 8 * np.cos(t)] for t in turns] for k in range(3)]
    for count, code in ((2, 0), (3, 2)):
        multiple = {"type": "MultiPolygon", "coordinates": [[[*star, star[0]]] for star in stars[:count]]}
        (shapes / "g.geojson").write_text(json.dumps(multiple))
        result = iccm("apply", "map.npz", "g.geojson", "-o", "h.geojson", "--force")
        assert result.code == code, result.err
    assert "cross each other too often" in result.err
