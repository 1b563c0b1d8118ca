"""Charts and pieces of meshes from the command line: #uv, --parts all, tiles (UDIM), STMaps of layouts, iccm info."""

import json
import re

import numpy as np
import pytest

from iccm.io.meshes import obj
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.shapes import shape

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">{}</svg>'
SQUARES = '<path id="{}" d="M10 10h80v80h-80z"/><path id="{}" d="M110 10h80v80h-80z"/>'
# lower corner and size of each sheet's chart: charts and sheets are squares, so that every map is a similarity
PAIR = {"left": ((0.05, 0.1), (0.25, 0.25)), "right": ((0.9, 0.4), (-0.5, 0.5))}
TILES = {
    "left": ((0.1, 0.1), (0.8, 0.8)),
    "right": ((1.9, 0.2), (-0.6, 0.6)),
    "top": ((0.2, 1.3), (0.5, 0.5)),
}
ONE = {
    "left": ((0.02, 0.02), (0.4, 0.4)),
    "right": ((0.52, 0.02), (0.4, 0.4)),
    "top": ((0.02, 0.52), (0.4, 0.4)),
}


def write_sheets(path, charts, n=5):
    """Write flat square sheets beside each other, with a group and a chart each."""
    y, x = np.mgrid[0:n, 0:n] / (n - 1)
    i = np.arange(n * n).reshape(n, n)
    quads = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]], axis=-1).reshape(-1, 4)
    lines = []
    for k, (name, (low, size)) in enumerate(charts.items()):
        lines += [f"v {a + 1.5 * k:.6f} {b:.6f} 0" for a, b in zip(x.ravel(), y.ravel())]
        lines += [
            f"vt {low[0] + size[0] * a:.6f} {low[1] + size[1] * b:.6f}" for a, b in zip(x.ravel(), y.ravel())
        ]
        lines += [f"g {name}"] + ["f " + " ".join(f"{v}/{v}" for v in quad + 1 + k * n * n) for quad in quads]
    path.write_text("\n".join(lines) + "\n")


def ramp(low=0.0, high=1.0, size=64):
    """A picture whose red increases to the right, and green upwards."""
    x = np.linspace(low, high, size)[None, :] + np.zeros((size, 1))
    return Image((255 * np.stack([x, 1 - x.T, 0 * x], axis=-1)).round().astype(np.uint8))


@pytest.fixture
def sheets(shapes):
    write_sheets(shapes / "pair.obj", PAIR)
    write_sheets(shapes / "tiles.obj", TILES)
    write_sheets(shapes / "one.obj", ONE)
    (shapes / "two.svg").write_text(SVG.format(SQUARES.format("right", "left")))
    (shapes / "places.svg").write_text(SVG.format(SQUARES.format("path1", "path2")))
    image_files.write("ramp.png", ramp())
    return shapes


def pixels(name):
    return image_files.read(name).pixels.astype(int)


def pixel_at(picture, u, v):
    """The pixel of a picture of the layout, or of its only tile, at given coordinates."""
    height, width = picture.shape[:2]
    return picture[int((1 - v) * height), int(u * width)]


@pytest.mark.slow
def test_a_picture_is_mapped_onto_a_chart_also_a_mirrored_one(sheets, iccm):
    """On the mirrored chart the picture of the layout is mirrored, so that it reads right on the surface."""
    words = ["--texture", "ramp.png", "--size", "200"]
    for spec, (low, size) in (("pair.obj#uv-2", PAIR["left"]), ("pair.obj#uv", PAIR["right"])):
        assert iccm("map", "square.svg", spec, *words, "--force", "-o", "o.png").code == 0
        picture = pixels("o.png")
        share = (picture[..., 3] == 255).mean()
        # of the whole layout, however little of it the chart takes up
        assert share == pytest.approx(size[1] ** 2, abs=0.01)
        for a, b in ((0.25, 0.25), (0.25, 0.75), (0.75, 0.5)):
            red, green = pixel_at(picture, low[0] + a * size[0], low[1] + b * size[1])[:2]
            expected = 255 * np.array([0.1 + 0.8 * a, 0.1 + 0.8 * b])  # square.svg leaves a margin
            assert (red, green) == pytest.approx(tuple(expected), abs=6)


@pytest.mark.slow
def test_the_texture_of_a_mirrored_chart_is_not_mirrored(sheets, iccm):
    """The layout and the flattening show the same, and so does the STMap."""
    words = ["square.svg", "--texture", "ramp.png", "--size", "64"]
    assert iccm("map", "pair.obj#uv", *words, "-o", "a.png", "--stmap", "m.exr").code == 0
    assert iccm("map", "pair.obj#piece-2", *words, "-o", "b.png").code == 0
    assert iccm("map", "pair.obj#right", *words, "--plane", "uv", "-o", "c.png").code == 0
    assert iccm("apply", "m.exr", "ramp.png", "-o", "d.png").code == 0
    a = pixels("a.png")
    for name in ("b.png", "c.png", "d.png"):
        assert np.abs(pixels(name)[2:-2, 2:-2] - a[2:-2, 2:-2]).max() <= 3, name
    assert pixel_at(a, 0.5, 0.5)[:2] == pytest.approx([255 * 0.65, 255 * 0.65], abs=6)
    assert pixel_at(a, 0.1, 0.5)[0] > pixel_at(a, 0.9, 0.5)[0] + 100  # u decreases to the right


def test_pins_on_a_chart_are_coordinates_or_vertices(sheets, iccm):
    pinned = [
        "--pin",
        "50,50:0.65,0.65",
        "--pin",
        "25,50:v39",
        "--exact-pins",
        "--size",
        "32",
        "--report",
        "r.json",
    ]
    result = iccm("map", "square.svg", "pair.obj#uv", "-o", "o.png", *pinned)
    assert result.code == 0, result.err
    data = json.loads((sheets / "r.json").read_text())
    assert [pin["error"] < 1e-6 for pin in data["pins"]] == [True, True]
    result = iccm("map", "square.svg", "pair.obj#uv", "-o", "p.png", "--pin", "50,50:0.1,0.1")
    assert result.code == 2 and "pair.obj#uv: pin 1: (0.1, 0.1) is " in result.lines[-1]


@pytest.mark.slow
def test_all_charts_by_name_into_one_picture_as_baking_them(sheets, iccm):
    words = ["--parts", "all", "--texture", "ramp.png", "--size", "200"]
    report = ["--report", "r.json"]
    assert iccm("map", "two.svg", "pair.obj#uv", *words, "-o", "a.png", *report).code == 0
    assert iccm("map", "two.svg", "pair.obj", *words, "--bake", "-o", "b.png").code == 0
    assert iccm("map", "two.svg", "pair.obj", *words, "-o", "n.obj").code == 0
    parts = json.loads((sheets / "r.json").read_text())["parts"]
    assert [(part["source"], part["target"]) for part in parts] == [("1", "uv-1"), ("2", "uv-2")]
    a, b = pixels("a.png"), pixels("b.png")
    inside = a[..., 3] == 255
    assert inside.mean() == pytest.approx(0.25 + 0.0625, abs=0.01)
    assert np.abs(a[..., :3] - b[..., :3])[inside].max() <= 6
    red = pixel_at(a, 0.05 + 0.125, 0.1 + 0.125)[0]
    assert red == pytest.approx(255 * 0.75, abs=6)  # "left" is on the right of the drawing
    mesh = obj.read("n.obj").mesh()
    middle = mesh.uv[mesh.uv_corners].reshape(2, -1, 2).mean(axis=1)
    assert np.allclose(middle, [[0.75, 0.5], [0.25, 0.5]], atol=0.01)


@pytest.mark.slow
def test_without_names_parts_go_by_place(sheets, iccm):
    words = ["--parts", "all", "--texture", "ramp.png", "--size", "200"]
    assert iccm("map", "places.svg", "pair.obj#uv", *words, "-o", "a.png").code == 0
    assert pixel_at(pixels("a.png"), 0.05 + 0.125, 0.1 + 0.125)[0] == pytest.approx(255 * 0.25, abs=6)
    assert iccm("map", "places.svg", "pair.obj", *words, "--bake", "-o", "b.png").code == 0
    assert pixel_at(pixels("b.png"), 0.65, 0.65)[0] == pytest.approx(255 * 0.75, abs=6)


@pytest.mark.slow
def test_all_charts_of_a_mesh_onto_those_of_another(sheets, iccm):
    """Three tiles onto one picture, each chart onto its partner in space; a map onto itself changes nothing."""
    image_files.write("skin.1001.png", ramp(0, 0.5))
    image_files.write("skin.1002.png", ramp(0.5, 1))
    image_files.write("skin.1011.png", ramp(1, 1, 32))
    skin, words = ["--texture", "skin.<UDIM>.png"], ["--parts", "all", "--bake"]
    result = iccm(
        "map", "tiles.obj", "tiles.obj", *words, *skin, "-o", "same.<UDIM>.png", "--stmap", "m.<UDIM>.exr"
    )
    assert result.code == 0, result.err
    assert not any("outside 0..1" in line for line in result.lines)
    assert iccm("apply", "m.<UDIM>.exr", "skin.<UDIM>.png", "-o", "through.<UDIM>.png").code == 0
    for number, (low, size) in zip((1001, 1002, 1011), TILES.values()):
        u, v = (np.sort([a, a + b]) % 1 for a, b in zip(low, size))
        rows, columns = (slice(int(64 * a) + 2, int(64 * b) - 2) for a, b in ((1 - v[1], 1 - v[0]), u))
        expected = pixels(f"skin.{number}.png")
        expected = expected.repeat(64 // len(expected), axis=0).repeat(64 // len(expected), axis=1)[
            rows, columns
        ]
        for name in ("same", "through"):
            assert np.abs(pixels(f"{name}.{number}.png")[rows, columns, :3] - expected).max() <= 8, (
                name,
                number,
            )
    words = ["--parts", "all", "--plane", "uv"]
    assert iccm("map", "tiles.obj", "one.obj", *words, *skin, "-o", "one.png", "--size", "200").code == 0
    assert iccm("relayout", "tiles.obj", "one.obj", *skin, "-o", "re.png", "--size", "200").code == 0
    mapped, relaid = pixels("one.png"), pixels("re.png")
    inside = mapped[..., 3] == 255
    assert inside.mean() == pytest.approx(0.48, abs=0.01)
    assert np.abs(mapped[..., :3] - relaid)[inside].max() <= 6


def test_layouts_of_tiles_are_made_from_one_picture(sheets, iccm):
    result = iccm("relayout", "one.obj", "tiles.obj", "--texture", "ramp.png", "-o", "{stem}.<UDIM>.png")
    assert result.code == 0, result.err
    assert sorted(path.name for path in sheets.glob("ramp.1*.png")) == [
        "ramp.1001.png",
        "ramp.1002.png",
        "ramp.1011.png",
    ]
    red, green = pixel_at(pixels("ramp.1002.png"), 0.6, 0.5)[:2]  # the middle of "right"
    assert (red, green) == pytest.approx((255 * 0.72, 255 * 0.22), abs=6)


def test_a_missing_tile_is_reported(sheets, iccm):
    image_files.write("skin.1001.png", ramp())
    words = ["--texture", "skin.<UDIM>.png", "--parts", "all", "--size", "32", "-o", "o.png"]
    result = iccm("map", "tiles.obj#uv", "two.svg", *words)
    assert result.code == 0
    note = "note: skin.<UDIM>.png: no file for the tiles 1002; the mesh is black there"
    assert note in result.lines


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["square.svg", "pair.obj#uv-3"], "pair.obj: there is no chart 3; choose 1 (the largest) to 2"),
        (
            ["square.svg", "pair.obj#uv#2"],
            "pair.obj#uv#2: ",
        ),
        (
            ["square.svg", "bare.obj#uv"],
            "bare.obj: has no texture coordinates; create them with iccm flatten --uv",
        ),
        (
            ["square.svg", "wound.obj", "--plane", "uv"],
            "wound.obj: chart 1 of its texture coordinates overlaps itself",
        ),
        (
            ["square.svg", "pair.obj", "-o", "o.<UDIM>.png"],
            "o.<UDIM>.png: <UDIM> is for pictures of a mesh's",
        ),
        (
            ["square.svg", "pair.obj", "--texture", "r.<UDIM>.png"],
            "r.<UDIM>.png: <UDIM> tiles need a mesh with texture",
        ),
        (
            ["pair.obj#uv", "square.svg", "--texture", "r.<UDIM>.png"],
            "r.<UDIM>.png: no file for any tile",
        ),
    ],
)
def test_impossible_requests_are_refused_in_one_line(sheets, iccm, words, message):
    text = (sheets / "pair.obj").read_text()
    (sheets / "bare.obj").write_text(re.sub(r"/\d+|(?m:^vt.*\n)", "", text))
    lines = [f"v {k % 2} {k // 2} 0" for k in range(24)]
    t = np.arange(12) * 0.7
    lines += [f"vt {0.5 + r * np.cos(a)} {0.5 - r * np.sin(a)}" for a in t for r in (0.2, 0.4)]
    lines += [f"f {a}/{a} {a + 1}/{a + 1} {a + 3}/{a + 3} {a + 2}/{a + 2}" for a in range(1, 23, 2)]
    (sheets / "wound.obj").write_text("\n".join(lines) + "\n")
    before = set(sheets.iterdir())
    result = iccm("map", *words)
    assert result.code == 2 and message in result.lines[-1], result.err
    assert set(sheets.iterdir()) == before


def test_info_lists_the_charts_that_can_be_selected(sheets, iccm):
    facts = json.loads(iccm("info", "tiles.obj", "--json").out)
    assert facts["parts"] == ["left", "right", "top"]
    assert facts["uv_charts"] == facts["pieces_in_all"] == 3
    charts = [(chart["name"], chart["tile"], chart["mirrored"]) for chart in facts["charts"]]
    assert charts == [("uv-1", 1001, False), ("uv-2", 1002, True), ("uv-3", 1011, False)]
    assert [piece["name"] for piece in facts["pieces"]] == ["piece-1", "piece-2", "piece-3"]
    assert facts["loops"] == [{"name": "1", "vertices": 16, "around": "left"}]
    for chart in facts["charts"]:
        assert iccm("map", "square.svg", f"tiles.obj#{chart['name']}", "--report", "-").code == 0


def test_a_part_called_like_a_chart_is_meant_before_it(sheets, iccm):
    text = (sheets / "pair.obj").read_text()
    (sheets / "named.obj").write_text(text.replace("g left", "g uv"))
    assert iccm("flatten", "named.obj#uv", "-o", "f.svg").code == 0
    assert shape.read("f.svg#outline").curve.area == pytest.approx(1)
    assert iccm("flatten", "named.obj#uv-2", "-o", "u.svg").code == 0
    assert shape.read("u.svg#outline").curve.area == pytest.approx(0.25**2)


def test_artwork_is_mapped_onto_a_chart(sheets, iccm):
    """The square of the drawing goes onto the square chart with all that is in it; the tile is the canvas."""
    (sheets / "art.svg").write_text(
        SVG.format('<path id="rim" d="M10 10h80v80h-80z"/><path id="dot" d="M30 50h20v10h-20z" fill="red"/>')
    )
    result = iccm("map", "art.svg#rim", "pair.obj#left", "--plane", "uv", "-o", "o.svg")
    assert result.code == 0, result.err
    (low, _), (size, _) = PAIR["left"][0], PAIR["left"][1]
    box = shape.read("o.svg#dot").curve.box
    left, bottom = low + size * 0.25, PAIR["left"][0][1] + size * (0.5 - 0.125)
    assert box[0] == pytest.approx(complex(left, bottom), abs=1e-3)
    assert box[1] == pytest.approx(complex(left + size * 0.25, bottom + size * 0.125), abs=1e-3)
    assert 'viewBox="0 -1 1 1"' in (sheets / "o.svg").read_text()
    mirrored = iccm("map", "art.svg#rim", "pair.obj#right#uv", "-o", "m.svg")
    assert mirrored.code == 2 and "mirrored" in mirrored.err and not (sheets / "m.svg").exists()
    flat = iccm("map", "art.svg#rim", "pair.obj#right", "-o", "m.svg")
    assert flat.code == 2 and "or a chart (mesh#uv)" in flat.err


def bounds_of(path):
    """Return the lower and upper corners of the texture coordinates of each group."""
    bounds, uv, name = {}, [], ""
    for line in path.read_text().splitlines():
        word, *arguments = line.split() or [""]
        if word == "vt":
            uv.append([float(number) for number in arguments[:2]])
        elif word == "g":
            name = arguments[0]
        elif word == "f":
            bounds.setdefault(name, []).extend(int(number.split("/")[1]) - 1 for number in arguments)
    return {
        name: np.round([np.min(corners, axis=0), np.max(corners, axis=0)], 3)
        for name, corners in ((name, np.array(uv)[numbers]) for name, numbers in bounds.items())
    }


@pytest.mark.slow
def test_all_pieces_of_two_meshes_are_mapped_in_pairs(sheets, shapes, iccm):
    """By their names, although they lie in the other order."""
    write_sheets(shapes / "other.obj", {"right": ((0, 0), (1, 1)), "left": ((0, 0), (1, 1))}, n=7)
    result = iccm("map", "pair.obj", "other.obj", "-o", "o.obj", "--report", "r.json")
    assert result.code == 0, result.err
    bounds = bounds_of(shapes / "o.obj")
    assert np.allclose(bounds["left"], [(0.05, 0.1), (0.3, 0.35)], atol=2e-3)
    assert np.allclose(bounds["right"], [(0.4, 0.4), (0.9, 0.9)], atol=2e-3)
    report = json.loads((shapes / "r.json").read_text())
    assert len(report["parts"]) == 2 and report["mapped"] == 1 and "unpaired" not in report


@pytest.mark.slow
def test_pieces_without_a_partner_have_a_status(sheets, shapes, iccm):
    write_sheets(shapes / "more.obj", {name: ((0, 0), (1, 1)) for name in ("left", "right", "hat")}, n=6)
    result = iccm("map", "pair.obj", "more.obj", "-o", "o.obj", "--report", "r.json")
    assert result.code == 1 and "hat" in result.err
    report = json.loads((shapes / "r.json").read_text())
    assert report["status"] == "unpaired" and report["unpaired"]["target"] == ["piece-3"]
    assert np.allclose(bounds_of(shapes / "o.obj")["right"], [(0.4, 0.4), (0.9, 0.9)], atol=2e-3)
