"""Sizes in real units: drawings that are written measure what their target, or the unit of their mesh, says."""

import json
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests import chromium

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is an extra")

MARKED = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 60 40">'
    '<path d="M5 5H55V35H5Z" fill="#ccc"/>'
    '<g xmlns:i="http://www.inkscape.org/namespaces/inkscape" i:groupmode="layer" i:label="cut" id="g7">'
    '<path id="rule" d="M10 12H50" fill="none" stroke="#f00" stroke-width=".2"/></g></svg>'
)
SIZES = [
    ("120mm", "80mm", 2.0),
    ("6in", "4in", 2.54),
    ("18cm", "12cm", 3.0),
    ("60", "40", 25.4 / 96),
    ("36pt", "24pt", 0.6 * 25.4 / 72),
    ("240Q", "160Q", 1.0),
]
"""Width, height, and millimetres in a unit of the 60 by 40 units."""


def size_of(path):
    top = ET.parse(path).getroot()
    return top.get("width"), top.get("height")


@pytest.fixture
def marked(shapes):
    """A function that writes marked.svg, a drawing with a line of 40 units, in a size."""

    def write(width, height):
        (shapes / "marked.svg").write_text(MARKED.format(width, height))
        return shapes

    return write


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height", "_"), SIZES)
@pytest.mark.keeps("svg", "width and height in their unit")
def test_drawings_have_the_size_of_their_target_in_its_unit(marked, iccm, width, height, _):
    marked(width, height)
    assert iccm("map", "square.svg", "marked.svg#bbox", "-o", "o.svg", "-o", "m.npz").code == 0
    assert size_of("o.svg") == (width, height)
    assert iccm("apply", "m.npz", "square.svg", "-o", "a.svg").code == 0
    assert size_of("a.svg") == (width, height)
    assert iccm("deform", "marked.svg", "--pin", "30,20:31,21", "-o", "d.svg").code == 0
    assert size_of("d.svg") == (width, height)


@pytest.mark.slow
def test_a_morph_has_the_size_of_its_target(marked, iccm):
    marked("120mm", "80mm")
    assert iccm("morph", "square.svg", "marked.svg", "--frames", "2", "-o", "m-{number}.svg").code == 0
    top = ET.parse("m-2.svg").getroot()
    _, _, width, height = map(float, top.get("viewBox").split())
    assert [float(top.get(name).removesuffix("mm")) for name in ("width", "height")] == pytest.approx(
        [2 * width, 2 * height]
    )


def test_a_target_without_a_size_gives_none(shapes, iccm):
    assert iccm("map", "square.svg", "blob.svg", "-o", "o.svg").code == 0
    assert size_of("o.svg") == (None, None)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height", "millimetres"), SIZES)
@pytest.mark.keeps("dxf", "layers", "colours", "lengths in millimetres")
def test_lines_of_svg_become_dxf_and_come_back(marked, iccm, width, height, millimetres):
    marked(width, height)
    result = iccm("map", "marked.svg#canvas", "marked.svg#canvas", "-o", "o.dxf")
    assert result.code == 0 and "mm" in result.err
    document = ezdxf.readfile("o.dxf")
    plate, rule = document.modelspace()
    assert document.header["$INSUNITS"] == 4
    points = np.array(rule.get_points("xy"))
    assert np.ptp(points, axis=0) == pytest.approx([40 * millimetres, 0], abs=1e-6 * millimetres)
    assert points[0] == pytest.approx([10 * millimetres, 28 * millimetres])  # y up from the lower edge
    assert rule.dxf.layer == "cut" and rule.rgb == (255, 0, 0) and plate.closed
    assert iccm("map", "o.dxf#bbox", "marked.svg#bbox", "-o", "back.svg").code == 0
    assert size_of("back.svg") == (width, height)
    assert "#ff0000" in Path("back.svg").read_text()
    assert iccm("map", "o.dxf#bbox", "o.dxf#bbox", "-o", "same.svg").code == 0
    assert size_of("same.svg") == (f"{50 * millimetres:.9g}mm", f"{30 * millimetres:.9g}mm")


def half_pipe(path, length, radius):
    """Write half of a pipe, whose flattening is length times pi radius."""
    angles = np.linspace(0, np.pi, 33)
    ring = np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])
    points = [(x, y, z) for z in np.linspace(0, length, 9) for x, y in ring]
    faces = [
        face
        for row in range(8)
        for k in range(row * 33, row * 33 + 32)
        for face in ((k, k + 1, k + 33), (k + 1, k + 34, k + 33))
    ]
    trimesh.Trimesh(points, faces, process=False).export(path)


def extent_of_dxf(path):
    points = [p for line in ezdxf.readfile(path).modelspace() for p in line.get_points("xy")]
    return sorted(np.ptp(np.array(points), axis=0))


@pytest.mark.parametrize(
    ("name", "more", "millimetres"),
    [
        ("pipe.obj", (), 1.0),
        ("pipe.obj", ("--unit", "cm"), 10.0),
        ("pipe.glb", (), 1000.0),
        ("pipe.glb", ("--unit", "in"), 25.4),
    ],
)
@pytest.mark.keeps("units", "lengths in millimetres, by the unit of the file")
@pytest.mark.keeps("plain", "lengths, with `--unit`")
@pytest.mark.loses("plain", "the unit, which the file does not state: 1 mm, with a note")
def test_a_flattening_is_in_millimetres(shapes, iccm, name, more, millimetres):
    half_pipe(name, 5.0, 1.0)
    names = ("-o", "f.svg", "-o", "f.dxf", "--report", "r.json")
    result = iccm("flatten", name, "--method", "conformal", *more, *names)
    assert result.code == 0 and ("--unit" in result.err) == (name == "pipe.obj" and not more)
    assert extent_of_dxf("f.dxf") == pytest.approx(millimetres * np.array([np.pi, 5]), rel=5e-3)
    assert json.loads((shapes / "r.json").read_text())["millimetres"] == millimetres
    top = ET.parse("f.svg").getroot()
    assert float(top.get("width").removesuffix("mm")) == pytest.approx(
        millimetres * float(top.get("viewBox").split()[2])
    )


def test_an_obj_states_no_unit(shapes):
    from iccm.io.meshes.mesh_files import open_mesh

    half_pipe("pipe.obj", 5.0, 1.0)
    assert open_mesh(shapes / "pipe.obj").millimetres() is None


def test_flattened_coordinates_without_a_length_have_no_size(shapes, iccm):
    (shapes / "uv.obj").write_text(
        "v 0 0 0\nv 3 0 0\nv 3 2 1\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 .5\nvt 0 .5\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    assert iccm("flatten", "uv.obj#uv", "-o", "f.svg").code == 0
    assert size_of("f.svg") == (None, None)
    result = iccm("flatten", "uv.obj", "--unit", "ell", "-o", "g.svg")
    assert result.code == 2 and len(result.err.splitlines()) == 1


INKSCAPE = shutil.which("inkscape")


def inkscape_width(path, name):
    """The width of an element in millimetres, as Inkscape measures it."""
    command = [INKSCAPE, f"--query-id={name}", "--query-width", str(path)]
    out = subprocess.run(command, check=True, timeout=100, capture_output=True, text=True).stdout
    return float(out) * 25.4 / 96


@pytest.mark.slow
@pytest.mark.skipif(not INKSCAPE, reason="NOT MEASURED WITH INKSCAPE: install it")
@pytest.mark.parametrize(
    ("width", "height", "millimetres"), SIZES[:-1]
)  # Inkscape reads quarters of a mm as pixels
def test_inkscape_measures_the_same_length(marked, iccm, width, height, millimetres):
    marked(width, height)
    assert iccm("map", "marked.svg#bbox", "marked.svg#bbox", "-o", "o.svg").code == 0
    line = 0.2 * millimetres  # Inkscape measures what is painted, which ends half a line beside the path
    assert inkscape_width("o.svg", "rule") == pytest.approx(40 * millimetres, rel=1e-3, abs=line)


@pytest.mark.slow
@chromium.needed
@pytest.mark.skipif(not INKSCAPE, reason="NOT MEASURED WITH INKSCAPE: install it")
def test_all_measure_the_same_flattening(shapes, iccm):
    """Half a pipe of radius 10 cm and length 50 cm: 10 pi cm by 50 cm."""
    half_pipe("pipe.obj", 50.0, 10.0)
    assert iccm("flatten", "pipe.obj", "--unit", "cm", "-o", "f.svg", "-o", "f.dxf").code == 0
    sides = extent_of_dxf("f.dxf")
    assert sides == pytest.approx([100 * np.pi, 500], rel=2e-3)
    drawing = Path("f.svg").read_text()
    drawing = drawing[drawing.index("<svg") :]
    expression = (
        "['width', 'height'].map(side => document.querySelector('path').getBoundingClientRect()[side])"
    )
    pixels = chromium.evaluate(drawing, expression)
    in_chromium = sorted(float(side) * 25.4 / 96 for side in pixels.split(","))
    assert in_chromium == pytest.approx(sides, rel=2e-3)
    (shapes / "named.svg").write_text(drawing.replace("<path", '<path id="rule"', 1))
    assert min(abs(inkscape_width("named.svg", "rule") - side) for side in sides) < 1


@pytest.mark.slow
@chromium.needed
@pytest.mark.parametrize(("width", "height", "millimetres"), SIZES)
def test_chromium_and_ezdxf_measure_the_same_length(marked, iccm, width, height, millimetres):
    marked(width, height)
    assert iccm("map", "marked.svg#bbox", "marked.svg#bbox", "-o", "o.svg", "-o", "o.dxf").code == 0
    drawing = Path("o.svg").read_text().partition("?>")[2]
    pixels = float(
        chromium.evaluate(drawing, "document.querySelector('#rule').getBoundingClientRect().width")
    )
    (length,) = (
        np.ptp([x for x, _ in line.get_points("xy")])
        for line in ezdxf.readfile("o.dxf").modelspace()
        if line.dxf.layer == "cut"
    )
    assert pixels * 25.4 / 96 == pytest.approx(40 * millimetres, rel=1e-3)
    assert length == pytest.approx(40 * millimetres, rel=1e-6)
