"""`iccm flatten -o`: a name that only fits a mesh receives the mesh with its flattening as coordinates."""

import json

import numpy as np
import pytest
import trimesh

from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image

GIVEN = "--method", "lscm"


@pytest.fixture
def half(shapes):
    """half.obj and half.glb, a hemisphere."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] > 0.1)], append=True)
    for name in ("half.obj", "half.glb"):
        half.export(name)
    return shapes


@pytest.mark.parametrize(("mesh", "suffix"), [("half.glb", ".glb"), ("half.obj", ".ply")])
def test_mesh_outputs_get_coordinates(half, iccm, mesh, suffix):
    result = iccm("flatten", mesh, *GIVEN, "-o", f"out{suffix}")
    assert result.code == 0 and f"wrote out{suffix}" in result.lines
    repeated = iccm("flatten", mesh, *GIVEN, "--uv", f"same{suffix}")
    assert (
        repeated.code == 0 and (half / f"out{suffix}").read_bytes() == (half / f"same{suffix}").read_bytes()
    )


def test_a_flat_mesh_is_still_one(half, iccm):
    assert iccm("flatten", "half.obj", *GIVEN, "-o", "flat.obj").code == 0
    heights = {
        line.split()[3] for line in (half / "flat.obj").read_text().splitlines() if line.startswith("v ")
    }
    assert len(heights) == 1


def test_a_drawing_is_named_after_its_mesh(shapes, iccm):
    (shapes / "sail.obj").write_text("v 0 0 0\nv 3 0 0\nv 3 2 1\nv 0 2 0\nf 1 2 3\nf 1 3 4\n")
    assert iccm("flatten", "sail.obj").code == 0
    assert [path.name for path in shapes.glob("*flat*")] == ["sail-flat.svg"]


def test_a_cube_becomes_a_cross_unless_one_chart_is_wanted_or_good_enough(shapes, iccm):
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    rows = ["v {} {} {}".format(*xyz) for xyz in corners]
    rows += ["f " + " ".join(str(k + 1) for k in quad) for quad in quads]
    (shapes / "cube.obj").write_text("\n".join(rows) + "\n")
    seams = {}
    for name, options in {"auto": (), "one": ("--charts", "one"), "loose": ("--max-distortion", "2")}.items():
        done = iccm("flatten", "cube.obj", *options, "--uv", f"{name}.obj", "--report", f"{name}.json")
        assert done.code == 0, done.err
        report = json.loads((shapes / f"{name}.json").read_text())
        seams[name] = report["seam_edges"], round(report["dilatation"]["p95"], 3)
    assert seams["auto"] == (7, 1.0)
    assert seams["one"] == seams["loose"] and seams["one"][0] < 7 and seams["one"][1] > 1.3
    assert iccm("flatten", "cube.obj", "--charts", "one", "--max-distortion", "2", "--uv", "x.obj").code == 2
    assert not (shapes / "x.obj").exists()


CUBE = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""
LID = "l 1 2 3 4 1\nl 5 6\nl 7 6\nl -2 -1\n"
"""Lines around the bottom of the cube, and to three sides of its top."""


def seams_of(iccm, folder, *words):
    done = iccm("flatten", *words, "--report", "r.json", "--force")
    assert done.code == 0, done.err
    report = json.loads((folder / "r.json").read_text())
    return report["charts"], report["seam_edges"]


def test_seams_come_from_lines_or_from_another_layout(shapes, iccm):
    (shapes / "cube.obj").write_text(CUBE)
    (shapes / "own.obj").write_text(CUBE + LID)
    points = "".join(line + "\n" for line in CUBE.splitlines() if line.startswith("v"))
    (shapes / "lines.obj").write_text(points + LID)
    assert seams_of(iccm, shapes, "own.obj", "--uv", "own-uv.obj") == (2, 7)
    assert seams_of(iccm, shapes, "cube.obj", "--seams", "lines.obj") == (2, 7)
    assert seams_of(iccm, shapes, "cube.obj", "--seams", "own-uv.obj") == (2, 7)


@pytest.mark.parametrize(
    ("lines", "words", "message"),
    [
        ("v 0 0 0\nv 1 2 3\nl 1 2\n", (), "1 of 1 lines"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", (), "neither lines"),
        (None, (), "no such file"),
        (CUBE + LID, ("--no-cut",), "--no-cut"),
        (CUBE + LID, ("--parts", "largest"), "--seams"),
    ],
)
def test_seams_that_cannot_be_used_are_refused(shapes, iccm, lines, words, message):
    (shapes / "cube.obj").write_text(CUBE)
    if lines:
        (shapes / "lines.obj").write_text(lines)
    result = iccm("flatten", "cube.obj", "--seams", "lines.obj", *words, "-o", "out.svg")
    assert result.code == 2 and message in result.lines[-1] and len(result.lines) == 1
    assert not (shapes / "out.svg").exists()


@pytest.mark.slow
def test_the_contact_sheet_shows_four_sides_that_differ(shapes, iccm):
    (shapes / "cube.obj").write_text(CUBE)
    done = iccm("flatten", "cube.obj", "--preview", "sheet.png")
    assert done.code == 0 and "wrote sheet.png" in done.lines
    pixels = image_files.read("sheet.png").pixels.astype(int)
    half = len(pixels) // 2
    views = [pixels[y : y + half, x : x + half] for y in (0, half) for x in (0, half)]
    assert all((view != pixels[0, 0]).any(axis=2).mean() > 0.3 for view in views)
    assert all(np.abs(a - b).mean() > 5 for k, a in enumerate(views) for b in views[:k])


@pytest.mark.slow
def test_the_contact_sheet_of_a_map_shows_the_picture_upright(half, iccm):
    """Of a hemisphere whose front is +z, the first view shows the top of the picture above its bottom."""
    rows = np.linspace(255, 0, 64).round().astype(np.uint8)
    image_files.write("ramp.png", Image(np.repeat(rows[:, None, None], 64, axis=1).repeat(3, axis=2)))
    done = iccm("map", "ramp.png", "half.obj", "--preview", "sheet.png")
    assert done.code == 0, done.err
    view = image_files.read("sheet.png").pixels.astype(int)[:512, :512, 0]
    y, _ = np.nonzero(view != view[0, 0])
    top, bottom = (np.median(view[y.min() + d : y.min() + d + 20, 200:312]) for d in (60, np.ptp(y) - 80))
    assert top > bottom + 60


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["flatten", "half.obj", "--preview", "sheet.jpg"], "use .png"),
        (["map", "square.svg", "disk.svg", "--preview", "sheet.png"], "--preview"),
    ],
)
def test_a_contact_sheet_that_cannot_be_made_is_refused(half, iccm, words, message):
    result = iccm(*words)
    assert result.code == 2 and message in result.lines[-1] and not list(half.glob("sheet*"))


def test_the_report_describes_each_chart(shapes, iccm):
    (shapes / "own.obj").write_text(CUBE + LID)
    assert iccm("flatten", "own.obj", "-o", "o.svg", "--report", "r.json").code == 0
    charts = json.loads((shapes / "r.json").read_text())["each_chart"]
    assert [chart["triangles"] for chart in charts] == [10, 2]
    assert [chart["area_share"] for chart in charts] == pytest.approx([5 / 6, 1 / 6])
    assert all(chart["density"] == pytest.approx(1) for chart in charts)
    assert charts[0]["dilatation"]["p95"] > 2 > charts[1]["dilatation"]["max"] == pytest.approx(1)


def test_gltf_is_written_with_its_buffer_and_read_again(half, iccm):
    for name in ("out.gltf", "out.glb"):
        assert iccm("flatten", "half.glb", "--uv", name).code == 0
    seen = [iccm("flatten", name, "-o", f"{name}.obj") for name in ("out.gltf", "out.glb")]
    assert [done.code for done in seen] == [0, 0]
    assert (half / "out.gltf.obj").read_bytes() == (half / "out.glb.obj").read_bytes()
    assert [path.name for path in half.glob("out*bin")] == []


@pytest.mark.parametrize("option", ["-o", "--uv"])
def test_formats_without_coordinates_are_refused_in_the_same_words(half, iccm, option):
    result = iccm("flatten", "half.obj", option, "out.stl")
    assert result.code == 2 and "cannot hold texture coordinates" in result.lines[-1]


def test_a_flat_mesh_is_announced(half, iccm):
    assert any("flat mesh" in line for line in iccm("flatten", "half.obj", "-o", "flat.obj").lines)
