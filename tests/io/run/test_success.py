"""Success is only reported over success: results that show little or nothing have a status and exit code 1."""

import json
from pathlib import Path

import numpy as np
import pytest

from iccm.deadline import TimeUp
from iccm.io.pictures import image_files
from iccm.io.run import execute
from iccm.meshes.mesh import Mesh, face_areas, polygon_areas

CHEVRON = "M0 0L50 49.99L100 0L50 50Z"  # .01 thick
THIN_SVG = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="{CHEVRON}"/></svg>'


@pytest.fixture
def report(shapes, iccm):
    """`report(*arguments)` returns the exit code of `iccm map` and its report."""

    def run(*arguments):
        typed = iccm("map", *arguments, "--report", "r.json", "--force")
        found = json.loads(Path("r.json").read_text())
        assert (typed.code == 0) == (not typed.err.count("error:"))
        return typed.code, found

    return run


def write_pieces(name, *sides):
    """Write an OBJ of flat squares of these sides, side by side."""
    lines, corner = [], 1
    for number, side in enumerate(sides):
        x = 20 * number
        corners = (x, 0), (x + side, 0), (x + side, side), (x, side)
        lines += [f"v {a} {b} 0" for a, b in corners]
        lines.append(f"f {corner} {corner + 1} {corner + 2}\nf {corner} {corner + 2} {corner + 3}")
        corner += 4
    Path(name).write_text("\n".join(lines) + "\n")


@pytest.mark.slow
@pytest.mark.parametrize("pair", [("thin.svg", "square.svg"), ("square.svg", "thin.svg")])
def test_a_map_that_shows_nothing_of_a_drawing_is_no_success(report, shapes, pair):
    Path("thin.svg").write_text(THIN_SVG)
    code, found = report(*pair, "-o", "o.png", "--size", "32")
    assert code == 1 and found["status"] in ("hidden", "bare", "empty") and found["shown"] == 0


@pytest.mark.slow
def test_an_open_line_shows_too_little_unless_that_is_allowed_or_the_source_runs_along_it(report, shapes):
    line = '<path d="M10 10H90V90" fill="none" stroke="#000" stroke-width="{}"/>'
    for name, width in (("line.svg", 1), ("wide.svg", 40)):
        Path(name).write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{line.format(width)}</svg>'
        )
    outputs = "-o", "o.png", "--size", "32"
    code, found = report("square.svg", "line.svg", *outputs)
    assert (code, found["status"]) == (1, "lines") and "--along" in found["message"]
    assert report("square.svg", "line.svg", "--max-left-out", "0.99", *outputs)[0] == 0
    assert report("square.svg", "line.svg", "--along", "5", *outputs)[0] == 0
    assert report("square.svg", "wide.svg", *outputs)[0] == 0


@pytest.mark.slow
def test_less_than_half_of_a_mesh_is_no_success_unless_it_was_named(report, shapes):
    write_pieces("scan.obj", 5, 4, 4, 4)
    outputs = "-o", "o.png", "--size", "32"
    code, found = report("scan.obj", "square.svg", *outputs)
    assert (code, found["status"]) == (1, "partial") and Path("o.png").exists()
    for arguments in (("scan.obj#piece-1", "square.svg"), ("scan.obj", "square.svg", "--parts", "largest")):
        code, found = report(*arguments, *outputs)
        assert (code, found["status"] == "partial") == (0, False), arguments
    write_pieces("most.obj", 9, 4, 4)  # 81 of 113
    assert report("most.obj", "square.svg", *outputs)[0] == 0


def test_the_areas_of_polygons_are_those_of_their_triangles():
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.normal(size=(12, 2)), np.zeros(12)])
    triangles = np.array([[0, 1, 2], [3, 4, 5], [9, 10, 11]])
    mesh = Mesh.triangles("m", points, triangles)
    assert np.allclose(polygon_areas(mesh), face_areas(points[triangles]))
    turn = np.exp(2j * np.pi * np.arange(7) / 7) + 5
    heptagon = np.column_stack([turn.real, turn.real * 0.3, turn.imag])
    mesh = Mesh("m", heptagon, np.arange(7), np.array([0, 7]))
    plane_factor = np.hypot(1, 0.3)
    assert polygon_areas(mesh) == pytest.approx(plane_factor * 3.5 * np.sin(2 * np.pi / 7))


def test_an_empty_picture_is_no_success(report, shapes):
    Path("far.svg").write_text(
        THIN_SVG.replace("0 0 100 100", "900 900 10 10").replace(CHEVRON, "M0 0H9V8L4 7Z")
    )
    code, found = report("square.svg", "far.svg", "-o", "o.png", "--target-box", "viewbox", "--size", "16")
    assert (code, found["status"], found["empty"]) == (1, "empty", True)
    assert not image_files.read("o.png").pixels[..., 3].any()
    code, found = report("square.svg", "blob.svg", "-o", "o.npz")
    assert code == 0 and "empty" not in found


@pytest.mark.parametrize("fill", [np.nan, 0.0, 0.25])
def test_a_map_that_shows_one_place_or_none_is_no_success(shapes, iccm, fill):
    st = np.full((8, 8, 3), fill, np.float32)
    image_files.write("st.exr", image_files.Image(st, colorspace="data"))
    image_files.write("t.png", image_files.Image(np.full((8, 8, 3), 9, np.uint8)))
    typed = iccm("apply", "st.exr", "t.png", "-o", "o.png")
    assert typed.code == 1 and "st.exr" in typed.lines[-1] and Path("o.png").exists()
    st[2, 3, :2] = 0.75
    st[2, 4, :2] = 0.5
    image_files.write("st.exr", image_files.Image(st, colorspace="data"))
    assert iccm("apply", "st.exr", "t.png", "-o", "o.png", "--force").code == 0


def test_bake_is_refused_where_it_has_no_effect(shapes, iccm):
    write_pieces("a.obj", 5)
    typed = iccm("map", "square.svg", "a.obj", "--bake", "-o", "o.npz")
    assert typed.code == 2 and "--bake" in typed.err and not Path("o.npz").exists()


def test_a_time_limit_is_not_a_wrong_input(shapes, iccm, monkeypatch):
    def run(*arguments, **options):
        raise TimeUp("the search for a map: took longer than 1 s; set a longer --time-limit")

    monkeypatch.setattr(execute, "run", run)
    typed = iccm("map", "square.svg", "blob.svg", "-o", "o.png")
    assert typed.code == 1 and len(typed.lines) == 1 and not Path("o.png").exists()


def texture(name, kind, *, alpha=False, profile=False):
    """Write a picture of a depth, with transparency, or with a colour profile."""
    space = "sRGB" if np.dtype(kind).kind == "u" else "lin_rec709"
    white = np.iinfo(kind).max if np.dtype(kind).kind == "u" else 1
    pixels = np.full((8, 8, 3 + alpha), white, kind)
    pixels[:, :4, 0] = 0
    pixels[2:, 2:, -1] = 0
    if profile:
        from PIL import Image, ImageCms

        data = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
        return Image.fromarray(pixels).save(name, icc_profile=data)
    return image_files.write(name, image_files.Image(pixels, 3 if alpha else -1, colorspace=space))


@pytest.mark.parametrize(
    ("made", "output", "lost"),
    [
        (("t.png", "uint16"), "o.webp", ["8 bits"]),
        (("t.png", "uint16"), "o.jpg", ["8 bits"]),
        (("t.png", "uint16"), "o.tif", []),
        (("t.png", "uint16"), "o.png", []),
        (("t.png", "uint8"), "o.webp", []),
        (("t.exr", "float32"), "o.png", ["16 bits"]),
        (("t.exr", "float32"), "o.tga", ["8 bits"]),
        (("t.exr", "float32"), "o.exr", []),
    ],
)
@pytest.mark.parametrize("command", ["map", "apply"])
def test_a_lost_depth_has_a_note(shapes, iccm, made, output, lost, command):
    texture(*made)
    if command == "map":
        arguments = ["map", "square.svg", "blob.svg", "--texture", made[0], "--size", "16"]
    else:
        st = np.dstack([*np.meshgrid(np.linspace(0.1, 0.9, 8), np.linspace(0.1, 0.9, 8)), np.zeros((8, 8))])
        image_files.write("st.exr", image_files.Image(st.astype(np.float32), colorspace="data"))
        arguments = ["apply", "st.exr", made[0]]
    typed = iccm(*arguments, "-o", output)
    notes = [line for line in typed.lines if line.startswith(f"note: {output}")]
    assert typed.code == 0 and len(notes) == len(lost)
    assert all(word in note for word, note in zip(lost, notes))


@pytest.mark.slow
def test_lost_transparency_and_profiles_have_a_note(shapes, iccm):
    texture("a.png", "uint8", alpha=True)
    texture("p.png", "uint8", profile=True)
    for name, output, word in (
        ("a.png", "o.jpg", "alpha"),
        ("p.png", "o.bmp", "profile"),
        ("p.png", "o.jpg", ""),
    ):
        typed = iccm(
            "map", "square.svg", "blob.svg", "--texture", name, "-o", output, "--size", "16", "--force"
        )
        notes = [line for line in typed.lines if line.startswith(f"note: {output}")]
        assert typed.code == 0 and (len(notes), all(word in note for note in notes)) == (bool(word), True), (
            notes
        )
