"""The layout of a closed mesh inside a picture, where its outline would stretch the picture."""

import json

import numpy as np
import pytest

from iccm.balanced.errors import NoMapError
from iccm.io.meshes import mesh_files
from iccm.io.run import execute
from iccm.io.shapes import shape

SHAPE = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 40C10 10 40 5 60 12S98 40 90 60 60 95 '
    '40 90 10 70 10 40Z"/></svg>'
)
SIDES, HEIGHT, TAPER = 18, 0.5, 0.8


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a shape, and a flat can that is narrower above."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shape.svg").write_text(SHAPE)
    rings = [
        (0.0, 0.5),
        *((k / 4 * HEIGHT, 1 - (1 - TAPER) * k / 4) for k in range(5)),
        (HEIGHT, 0.5 * TAPER),
    ]
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    points = [(r * np.cos(a), 1.1 * r * np.sin(a), z) for z, r in rings for a in angles]
    below, above = len(points) + 1, len(points) + 2
    rows = ["v {} {} {}".format(*p) for p in [*points, (0, 0, 0), (0, 0, HEIGHT)]]
    top = SIDES * (len(rings) - 1)
    for k in range(1, SIDES + 1):
        after = k % SIDES + 1
        rows += [
            f"f {first + k} {first + after} {first + SIDES + after} {first + SIDES + k}"
            for first in range(0, top, SIDES)
        ]
        rows += [f"f {below} {after} {k}", f"f {above} {top + k} {top + after}"]
    (tmp_path / "can.obj").write_text("\n".join(rows) + "\n")
    return tmp_path


def mapped(iccm, *words):
    result = iccm("map", "shape.svg", "can.obj", "-o", "o.glb", "--report", "r.json", "--force", *words)
    assert result.code < 2, result.err
    return json.loads(open("r.json").read()), result.err


@pytest.mark.parametrize("words", [(), ("--parts", "largest")])
def test_charts_are_packed_where_no_map_of_the_outline_is_found(folder, iccm, monkeypatch, words):
    solve, failed = execute.solve_pairs, []

    def solve_all_but_the_first(run):
        if not failed:
            failed.append(run)
            raise NoMapError("no map without folds was found")
        solve(run)

    monkeypatch.setattr(execute, "solve_pairs", solve_all_but_the_first)
    if words:
        assert iccm("map", "shape.svg", "can.obj", "-o", "o.glb", *words).code == 2
        assert not (folder / "o.glb").exists()
    else:
        report, _ = mapped(iccm)
        assert report["stretch"]["p95"] < 1.05 and report["mapped"] == 1


@pytest.mark.slow
def test_a_can_is_packed_inside_the_picture_at_one_scale(folder, iccm):
    outline, _ = mapped(iccm, "--parts", "largest")
    laid_out, notes = mapped(iccm)
    assert "can.obj" in notes and "inside the picture" in notes
    assert outline["stretch"]["p95"] > 1.5 > 1.05 > laid_out["stretch"]["p95"]
    assert laid_out["mapped"] == outline["mapped"] == 1
    assert laid_out["uv"] == {"flipped": 0, "degenerate": 0}
    layout = iccm("flatten", "can.obj", "-o", "flat.obj", "--report", "flat.json")
    assert layout.code == 0, layout.err
    flattened = json.loads((folder / "flat.json").read_text())
    assert laid_out["dilatation"]["p95"] <= 1.1 * flattened["dilatation"]["p95"]
    uv = mesh_files.read("o.glb").mesh.uv
    places = 100 * uv[:, 0] + 100j * (uv[:, 1] - 1)  # in the view box, whose y is down
    assert shape.read("shape.svg").curve.contains(places).all()


@pytest.mark.slow
@pytest.mark.parametrize("options", [["--pin", "50,50:-0.7,0.3,0.5"], ["--parts", "largest"]])
def test_with_landmarks_or_on_request_the_outline_is_mapped(folder, iccm, options):
    report, notes = mapped(iccm, *options)
    assert "inside the picture" not in notes
    assert report["boundary"]["hausdorff"] < 0.1


def write_bowl(folder):
    """An open bowl, deeper than half a ball, whose rim is not where its area is."""
    n, rows = 24, 8
    angle = 2 * np.pi * np.arange(n) / n
    points = [(0.0, 0.0, 0.0)]
    for steep in np.arange(1, rows + 1) / rows * 0.66 * np.pi:
        x, y = np.sin(steep) * np.cos(angle), 1.1 * np.sin(steep) * np.sin(angle)
        points += zip(x.tolist(), y.tolist(), [1 - np.cos(steep)] * n)
    faces = [(1, 2 + k, 2 + (k + 1) % n) for k in range(n)]
    for first in range(2, 2 + n * (rows - 1), n):
        faces += [(first + k, first + n + k, first + n + (k + 1) % n, first + (k + 1) % n) for k in range(n)]
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in points] + [
        "f " + " ".join(map(str, f)) for f in faces
    ]
    (folder / "bowl.obj").write_text("\n".join(lines) + "\n")


def bowl_stretch(iccm, source, *words):
    result = iccm("map", source, "bowl.obj", "-o", "o.glb", "--report", "r.json", "--force", *words)
    assert result.code < 2, result.err
    return json.loads(open("r.json").read())["stretch"]["p95"]


@pytest.mark.slow
def test_a_photo_is_no_more_stretched_on_an_open_mesh_than_its_layout(folder, iccm):
    write_bowl(folder)
    (folder / "photo.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 60"><path d="M0 0H90V60H0Z"/></svg>'
    )
    assert bowl_stretch(iccm, "photo.svg", "--parts", "largest") > 1.5 > 1.4 > bowl_stretch(iccm, "photo.svg")


@pytest.mark.slow
def test_a_drawing_still_takes_the_outline_of_an_open_mesh_unless_it_is_sliced(folder, iccm):
    write_bowl(folder)
    whole, sliced = bowl_stretch(iccm, "shape.svg"), bowl_stretch(iccm, "shape.svg", "--place", "slice")
    assert whole > 1.5 > 1.4 > sliced


def test_a_picture_inside_a_mesh_is_refused_with_what_to_do(folder, iccm):
    result = iccm("map", "shape.svg", "can.obj", "-o", "o.glb", "--place", "inside")
    assert result.code == 2 and "--place slice" in result.lines[-1] and not (folder / "o.glb").exists()
