"""Files with invalid numbers, shapes or types for their format are rejected in one line, or read."""

import json
import struct
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.lib import format as npy
from PIL import Image

import iccm as core
from iccm.io.pictures import image_files
from iccm.io.run import Job, run
from tests import fuzz
from tests.cases import slow

pytestmark = pytest.mark.usefixtures("solve_once")

SHEET = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}
    ],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "textures": [{"source": 0, "sampler": 0}],
    "samplers": [{}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 5, "type": "VEC2"},
        {"bufferView": 2, "componentType": 5123, "count": 12, "type": "SCALAR"},
    ],
}
POINTS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0.2], [0, 1, 0], [0.7, 0.4, 0.3]])
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.35, 0.4]])
FACES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


def glb(picture, tree=None, points=POINTS, uv=UV):
    """A sheet of four triangles with a picture, and with parts of its JSON replaced."""
    parts = [points.astype("<f4"), uv.astype("<f4"), FACES.astype("<u2")]
    parts = [part.tobytes() for part in parts] + [picture]
    views, length = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": length, "byteLength": len(part)})
        length += len(part) + -len(part) % 4
    data = b"".join(part + bytes(-len(part) % 4) for part in parts)
    image = {"bufferView": 3, "mimeType": "image/png"}
    scene = SHEET | {"buffers": [{"byteLength": len(data)}], "bufferViews": views, "images": [image]}
    text = json.dumps(scene | (tree or {})).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def sheet(shapes):
    """`sheet(tree, **arrays)` writes sheet.glb; there are also square.svg, t.png and plain.obj."""
    image_files.write("t.png", image_files.Image(core.checkerboard(32)[:24]))
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS.tolist()] + [f"vt {u} {v}" for u, v in UV.tolist()]
    lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in FACES.tolist()]
    (shapes / "plain.obj").write_text("\n".join(lines) + "\n")

    def write(tree=None, **arrays):
        (shapes / "sheet.glb").write_bytes(glb(Path("t.png").read_bytes(), tree, **arrays))

    return write


def with_transform(transform):
    """Materials whose texture a transform places."""
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    return {"materials": [{"pbrMetallicRoughness": {"baseColorTexture": info}}]}


COMMANDS = [
    ("info", "sheet.glb"),
    ("flatten", "sheet.glb", "--uv", "o.glb", "--carry-maps"),
    ("map", "square.svg", "sheet.glb", "-o", "o.glb", "--carry-maps"),
    ("map", "sheet.glb", "square.svg", "-o", "o.png", "--size", "32"),
    ("relayout", "sheet.glb", "plain.obj", "-o", "o.obj", "--size", "16"),
    ("relayout", "plain.obj", "sheet.glb", "--texture", "t.png", "-o", "o.png", "--size", "16"),
]


@pytest.mark.parametrize(
    "tree",
    [
        {"nodes": [{"mesh": 0, "scale": [1e300, 1, 1]}]},
        {"nodes": [{"mesh": 0, "matrix": [1e200] * 16}]},
        {"nodes": [{"mesh": 0, "translation": [float("nan"), 0, 0]}]},
        {"nodes": [{"children": [1], "scale": [1e50] * 3}, {"mesh": 0, "scale": [1e50] * 3}]},
        {"nodes": [{"mesh": 0, "skin": 7}]},
        {"scene": 3},
        {"samplers": [{"wrapS": [33071]}]},
        {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "mode": "4"}]}]},
        {"accessors": [{**SHEET["accessors"][0], "byteOffset": "0"}, *SHEET["accessors"][1:]]},
        with_transform({"rotation": 1e308}),
        with_transform({"offset": [float("inf"), 0]}),
    ],
)
def test_numbers_out_of_range_in_glb_files_are_refused(sheet, iccm, tree):
    sheet(tree)
    for command in COMMANDS:
        typed = iccm(*command, "--force") if command[0] != "info" else iccm(*command)
        assert typed.code == 2 and len(typed.lines) == 1 and "sheet.glb" in typed.err, typed.err


@pytest.mark.parametrize(
    "scale",
    [[0, 1], *(slow(scale) for scale in ([0, 0], [1e-9, 1], [-1, 0]))],
)
def test_textures_shrunk_to_a_line_or_point_are_shown(sheet, iccm, scale):
    sheet(with_transform({"scale": scale}))
    for command in COMMANDS:
        typed = iccm(*command, "--force") if command[0] != "info" else iccm(*command)
        assert typed.code in (0, 1), typed.err
    assert iccm(*COMMANDS[3], "--force").code == 0
    pixels = image_files.read("o.png").pixels
    assert (pixels[..., 3] > 0).any()
    if scale == [0, 0]:  # all of it is one point of the texture
        assert np.ptp(pixels[pixels[..., 3] == 255], axis=0).max() <= 1


@pytest.mark.parametrize("uv", [UV * 1e38, UV * [1, 1e7], np.where(UV == 1, np.nan, UV)])
def test_texture_coordinates_that_make_no_sense_are_refused_where_they_are_needed(sheet, iccm, uv):
    sheet(uv=uv)
    for command in (COMMANDS[1], COMMANDS[2], *COMMANDS[4:]):
        result = iccm(*command, "--force")
        assert result.code == 2 and "texture coordinates" in result.err, (command, result.err)


def test_positions_that_are_too_far_off_are_refused(sheet, iccm, shapes):
    text = (shapes / "plain.obj").read_text().replace("v 2.0 0.0", "v 1e200 0.0")
    (shapes / "far.obj").write_text(text)
    result = iccm("flatten", "far.obj", "-o", "o.svg")
    assert result.code == 2 and "vertex 2" in result.err


@pytest.fixture
def saved(shapes):
    """map.npz"""
    run(Job(source="square.svg", target="blob.svg", output=["map.npz"], method="paper", vertices=40))


@pytest.mark.parametrize("null", [[3, None], slow([None, 3]), slow([None, None])])
@pytest.mark.parametrize("kind", ["LineString", "MultiLineString", "Polygon", "MultiPolygon"])
def test_lines_with_positions_that_are_null_are_refused(saved, iccm, kind, null):
    ring = [[20, 20], [60, 20], null, [20, 70], [20, 20]]
    depth = kind.startswith("Multi") + kind.endswith("Polygon")
    coordinates = [ring] if depth == 1 else [[ring]] if depth == 2 else ring
    Path("a.geojson").write_text(json.dumps({"type": kind, "coordinates": coordinates}))
    result = iccm("apply", "map.npz", "a.geojson", "-o", "b.geojson")
    assert result.code == 2 and "a.geojson" in result.err and not Path("b.geojson").exists()


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": "LineString", "coordinates": [[30, 30], {"y": 2}]},
        {"type": "Point"},
        {"type": "Point", "coordinates": {"x": 30}},
    ],
)
def test_geometries_without_coordinates_end_in_a_line(saved, iccm, geometry):
    whole = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [50, 50]}}
    broken = {"type": "Feature", "properties": {}, "geometry": geometry}
    Path("a.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [whole, broken]}))
    result = iccm("apply", "map.npz", "a.geojson", "-o", "b.geojson")
    assert result.code in (0, 2) and (result.code == 2 or Path("b.geojson").exists()), result.err


@pytest.mark.parametrize("position", [[10], [], [[1, 2], 3], 7, None, "1,2", {"x": 1}, [1e101, 0]])
@pytest.mark.parametrize(
    "around",
    [
        lambda p: {"type": "Polygon", "coordinates": [[[0, 0], [50, 0], p, [0, 0]]]},
        lambda p: {"type": "MultiPolygon", "coordinates": [[[[0, 0], [50, 0], p, [0, 0]]]]},
        lambda p: {"shapes": [{"label": "a", "points": [[0, 0], [50, 0], p]}]},
        lambda p: {"shapes": [{"label": "a", "points": [[0, 0], p], "shape_type": "circle"}]},
        lambda p: {"annotations": [{"id": 1, "segmentation": [[0, 0, 50, 0, p, [p]]]}]},
    ],
)
def test_positions_that_are_none_are_refused_in_polygons(shapes, iccm, around, position):
    (shapes / "a.json").write_text(json.dumps(around(position)))
    result = iccm("map", "a.json", "square.svg", "-o", "o.png", "--size", "16")
    assert result.code == 2 and len(result.lines) == 1 and "a.json" in result.err, result.err


def test_geometries_whose_text_cannot_be_written_are_refused(saved, iccm):
    feature = {"type": "Feature", "id": "\ud800", "properties": {}}
    Path("a.geojson").write_text(
        json.dumps(feature | {"geometry": {"type": "Point", "coordinates": [50, 40]}})
    )
    result = iccm("apply", "map.npz", "a.geojson", "-o", "b.geojson")
    assert result.code == 2 and "a.geojson" in result.err and not Path("b.geojson").exists()


@pytest.mark.slow
def test_positions_at_the_end_of_single_precision_are_baked(sheet, iccm):
    data = bytearray(fuzz.shown_glb())
    (size,) = struct.unpack_from("<I", data, 12)
    struct.pack_into("<f", data, 28 + size + 4 * 1, -1.0)  # y of the first vertex
    struct.pack_into("<f", data, 28 + size + 4 * 4, 3e38)  # and of the second
    Path("far.glb").write_bytes(data)
    Path("near.obj").write_bytes(fuzz.SHEET.replace(b"mtllib m.mtl\n", b""))
    result = iccm("relayout", "far.glb", "near.obj", "-o", "o.obj")
    assert result.code in (0, 1, 2) and "internal" not in result.err, result.err


@pytest.mark.parametrize("shape", [(10**9, 10**3), (2**40, 2**40), (-1, 4), (3, 5)])
def test_arrays_for_remap_whose_headers_are_wrong_are_refused(tmp_path, monkeypatch, iccm, shape):
    monkeypatch.chdir(tmp_path)
    header = BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile("remap.npz", "w") as archive:
        for name in ("map_x", "map_y"):
            archive.writestr(f"{name}.npy", header.getvalue() + bytes(64))
    Image.new("RGB", (7, 4)).save("a.png")
    result = iccm("apply", "remap.npz", "a.png", "-o", "o.png")
    assert result.code == 2 and len(result.lines) == 1 and "remap.npz" in result.err
    assert not Path("o.png").exists()


def nested(depth):
    """JSON text of lists in lists."""
    return "[" * depth + "1" + "]" * depth


FEATURE = '{{"type": "Feature", "properties": {0}, "geometry": {{"type": "Polygon", "coordinates": {1}}}}}'
RING_TEXT = "[[[20, 20], [70, 20], [60, 70], [20, 20]]]"
COLLECTION = '{"type": "FeatureCollection", "features": [%s]}'
DEEP = {
    "a.geojson": (COLLECTION, ("apply", "map.npz", "a.geojson", "-o", "o.geojson")),
    "b.geojson": (COLLECTION, ("cartogram", "b.geojson", "--by", "x", "-o", "o.geojson")),
    "c.geojson": ("%s", ("map", "c.geojson", "square.svg", "-o", "o.png", "--size", "16")),
    "d.json": ('{"pins": %s}', ("map", "square.svg", "square.svg", "--constraints", "d.json", "-o", "o.png")),
    "e.json": ('{"shapes": [{"label": "a", "points": %s}]}', ("apply", "map.npz", "e.json", "-o", "o.json")),
}  # fmt: skip


@pytest.mark.parametrize("depth", [150, 400, 900, 100_000])
@pytest.mark.parametrize("name", DEEP)
def test_json_nested_too_deeply_is_refused_however_deep_its_readers_can_go(saved, iccm, name, depth):
    text, command = DEEP[name]
    deep = nested(depth)
    inner = FEATURE.format(f'{{"x": 1, "y": {deep}}}', RING_TEXT) if name.endswith(".geojson") else deep
    Path(name).write_text(text % inner)
    result = iccm(*command)
    if depth > 200:
        assert result.code == 2 and len(result.lines) == 1 and f"{name}: is nested" in result.err, result.err
        assert not list(Path.cwd().glob("o.*"))
    else:
        assert result.code in (0, 1, 2), result.err


@pytest.mark.parametrize("side", ["run", "base"])
def test_reports_and_tolerances_nested_too_deeply_are_refused(tmp_path, monkeypatch, iccm, side):
    monkeypatch.chdir(tmp_path)
    for folder in ("run", "base"):
        Path(folder).mkdir()
        Path(folder, "r.json").write_text(nested(900) if folder == side else "{}")
    assert iccm("check", "run", "base").code in (1, 2)
    Path("run/r.json").write_text("{}")
    Path("base/r.json").write_text("{}")
    Path("t.toml").write_text(f"x = {nested(5000)}")
    result = iccm("check", "run", "base", "--tolerances", "t.toml")
    assert result.code == 2 and len(result.lines) == 1 and "t.toml" in result.err


TOPOLOGIES = [
    {"arcs": 7},
    {"arcs": [[1, 2]]},
    {"arcs": [[[0, 0], ["a", 1]]]},
    {"objects": []},
    {"objects": {"a": {"type": "Polygon", "arcs": [[[0]]]}}},
    {"objects": {"a": {"type": "Polygon", "arcs": [["0"]]}}},
    {"objects": {"a": {"type": "GeometryCollection"}}},
    {"objects": {"a": {"type": ["Polygon"], "arcs": [[0]]}}},
    {"transform": {"scale": [1]}},
    {"transform": 3},
]


@pytest.mark.parametrize("wrong", TOPOLOGIES, ids=str)
@pytest.mark.parametrize(
    "command",
    [
        ("map", "a.topojson", "square.svg", "-o", "o.png", "--size", "16"),
        ("apply", "map.npz", "a.topojson", "-o", "o.topojson"),
        ("cartogram", "a.topojson", "--by", "x", "-o", "o.geojson"),
    ],
    ids=lambda command: command[0],
)
def test_topologies_of_another_structure_are_refused(saved, iccm, command, wrong):
    arcs = [[[20, 20], [70, 20], [60, 70], [20, 20]]]
    objects = {"a": {"type": "Polygon", "arcs": [[0]], "properties": {"x": 1}}}
    Path("a.topojson").write_text(json.dumps({"type": "Topology", "arcs": arcs, "objects": objects} | wrong))
    result = iccm(*command)
    errors = [line for line in result.lines if line.startswith("error: ")]
    assert result.code == 2 and len(errors) == 1 and "a.topojson" in errors[0], result.err
    assert not list(Path.cwd().glob("o.*"))


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": ["Polygon"]},
        {"type": {"a": 1}},
        {"type": "Polygon", "coordinates": 5},
        {"type": "MultiPolygon", "coordinates": {"0": 1}},
        {"type": "MultiPolygon", "coordinates": "abc"},
    ],
    ids=str,
)
def test_regions_of_cartograms_without_polygons_are_refused(tmp_path, monkeypatch, iccm, geometry):
    monkeypatch.chdir(tmp_path)
    feature = {"type": "Feature", "properties": {"x": 1}, "geometry": geometry}
    Path("a.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    result = iccm("cartogram", "a.geojson", "--by", "x", "-o", "o.geojson")
    assert result.code == 2 and len(result.lines) == 1 and "a.geojson" in result.err, result.err


def test_a_table_of_values_that_is_no_table_is_refused(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    feature = FEATURE.format('{"name": "a"}', RING_TEXT)
    Path("a.geojson").write_text(f'{{"type": "FeatureCollection", "features": [{feature}]}}')
    Path("v.csv").write_text(f"name,x\na,{'9' * 200_000}\n")  # more than the csv module takes
    result = iccm("cartogram", "a.geojson", "--by", "x", "--values", "v.csv", "-o", "o.geojson")
    assert result.code == 2 and len(result.lines) == 1 and "v.csv" in result.err, result.err


@pytest.mark.parametrize(("start", "suffix"), [("", ".geojsonl"), ("\x1e", ".geojsons")])
def test_features_of_lines_are_written_in_the_form_that_the_name_of_the_output_states(
    saved, iccm, start, suffix
):
    features = [
        {
            "type": "Feature",
            "properties": {"n": n},
            "geometry": {"type": "Point", "coordinates": [40, 50 + n]},
        }
        for n in range(3)
    ]
    Path(f"a{suffix}").write_text("".join(f"{start}{json.dumps(feature)}\n" for feature in features))
    for name in ("o.geojson", "o.geojsonl", "o.geojsons"):
        assert iccm("apply", "map.npz", f"a{suffix}", "-o", name).code == 0
    collection = json.loads(Path("o.geojson").read_text())
    assert collection["type"] == "FeatureCollection"
    for name, mark in (("o.geojsonl", ""), ("o.geojsons", "\x1e")):
        lines = Path(name).read_text().rstrip("\n").split("\n")
        assert all(line.startswith(mark + "{") for line in lines)
        assert [json.loads(line.removeprefix("\x1e")) for line in lines] == collection["features"]
    Path("b.geojson").write_text(json.dumps(collection))
    assert iccm("apply", "map.npz", "b.geojson", "--inverse", "-o", "back.geojsonl").code == 0
    assert len(Path("back.geojsonl").read_text().splitlines()) == 3
    result = iccm("apply", "map.npz", "b.geojson", "-o", "o.topojson")
    assert result.code == 2 and "TopoJSON" in result.err and not Path("o.topojson").exists()


@pytest.mark.parametrize("value", ["-9999", "256", "1.5", "1e300"])
def test_values_for_no_data_that_no_pixel_can_have_are_ignored(saved, iccm, value):
    pixels = np.arange(60 * 40, dtype=np.uint8).reshape(40, 60)
    tags = [(42113, "s", 0, value, True)]
    tifffile.imwrite("a.tif", pixels, extratags=tags)
    tifffile.imwrite("plain.tif", pixels)
    for name in ("a", "plain"):
        assert iccm("apply", "map.npz", f"{name}.tif", "-o", f"{name}-out.tif").code == 0
    assert np.array_equal(tifffile.imread("a-out.tif"), tifffile.imread("plain-out.tif"))


def test_numbers_of_thousands_of_digits_are_no_error_of_ours(shapes, iccm, monkeypatch):
    digits = "9" * 5000
    result = iccm("map", "square.svg", f"square.svg#{digits}", "-o", "o.png")
    assert result.code == 2 and len(result.lines) == 1 and "square.svg#" in result.err
    monkeypatch.setenv("OMP_NUM_THREADS", digits)
    assert iccm("map", "square.svg", "square.svg", "-o", "o.npz").code == 0


def test_landmarks_in_another_encoding_are_refused(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    for name in ("a.png", "b.png"):
        Image.new("RGB", (9, 7)).save(name)
    Path("lm.tps").write_bytes("LM=1\n1 2\nIMAGE=a.png\nLM=1\n1 2\nIMAGE=b.png\n".encode("utf-16"))
    result = iccm("standardize", "a.png", "b.png", "--landmarks", "lm.tps", "-o", "OUT")
    assert result.code == 2 and len(result.lines) == 1 and "lm.tps: not a UTF-8" in result.err
    assert not Path("OUT").exists()


@pytest.mark.parametrize("length", [12, 300])
def test_a_nifti_that_ends_in_its_header_is_refused(iccm, shapes, length):
    pytest.importorskip("SimpleITK", reason="SimpleITK belongs to an extra")
    image_files.write("t.png", image_files.Image(core.checkerboard(32)[:24]))
    Path("a.nii").write_bytes((struct.pack("<i", 540) + b"n+2\0\r\n\x1a\n" + bytes(540))[:length])
    result = iccm("apply", "a.nii", "t.png", "-o", "o.png")
    assert result.code == 2 and "a.nii: ends before its header" in result.err and len(result.lines) == 1
