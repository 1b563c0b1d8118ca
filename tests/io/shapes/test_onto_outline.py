"""Meshes onto outlines and onto meshes, with files as input and output."""

import json

import numpy as np
import pytest

from iccm.cli import run
from iccm.errors import InputError
from iccm.io.meshes import mesh_files
from iccm.io.run.inputs import Inputs
from iccm.io.run.job import Job
from iccm.io.shapes import constraints, listing, mesh_reading
from iccm.meshes.layout import turned_over
from tests.triangulations import hull, spiral_points

pytestmark = pytest.mark.usefixtures("solve_once")

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="{}">'
CURVES = "M50 30C60 5 100 10 95 45C90 70 50 95 50 95C50 95 10 70 5 45C0 10 40 5 50 30Z"
HEART = HEAD.format("0 0 100 100") + f'<path d="{CURVES}"/></svg>'
SQUARE = HEAD.format("0 0 9 9") + '<path d="M1 1H8V8H1Z"/></svg>'


def write(path, points, faces):
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in points]
    path.write_text("\n".join([*lines, *("f {} {} {}".format(*(np.array(f) + 1)) for f in faces)]) + "\n")


def sheet(n=12):
    """An open hill whose corners are triangles with two sides on the boundary."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, d), (b, c, d))])
    z = 0.8 * np.exp(-8 * ((x - 0.6) ** 2 + (y - 0.5) ** 2))
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces


def ball(n):
    """A closed ellipsoid with three different axes, finer or coarser."""
    unit = spiral_points(n)
    return unit * (1.0, 0.8, 1.4), hull(unit)


def command(*words):
    return run([str(word) for word in words])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "heart.svg").write_text(HEART)
    (tmp_path / "square.svg").write_text(SQUARE)
    write(tmp_path / "sheet.obj", *sheet())
    return tmp_path


@pytest.mark.parametrize("outline", ["heart.svg", "square.svg"])
def test_a_mesh_is_laid_out_onto_an_outline(folder, outline):
    code = command(
        "flatten", "sheet.obj", "--onto", outline, "--uv", "uv.obj", "-o", "flat.obj", "--report", "r.json"
    )
    report = json.loads((folder / "r.json").read_text())
    assert code == 0 and report["status"] == "done" and report["overlap"] is None
    assert report["uv"] == {"flipped": 0, "degenerate": 0}
    assert report["boundary"]["given"] < 1e-3  # at the vertices; edges between them cut off curves
    assert [item["path"] for item in report["inputs"]] == ["sheet.obj", outline]
    low, high = (complex(*item) if isinstance(item, list) else complex(item) for item in report["box"])
    if outline == "square.svg":  # in the outline's own coordinates, y up
        np.testing.assert_allclose([low.real, low.imag, high.real, high.imag], [1, -8, 8, -1], atol=0.01)
    written = mesh_files.read("uv.obj").mesh
    corners = written.uv[written.uv_corners].reshape(-1, 3, 2)
    assert turned_over(corners) == {"flipped": 0, "degenerate": 0}
    assert corners.min() > -1e-3 and corners.max() < 1 + 1e-3


def test_files_that_are_not_outlines_are_refused(folder, capsys):
    assert command("flatten", "sheet.obj", "--onto", "none.svg") == 2
    assert "--onto none.svg: no such file" in capsys.readouterr().err
    assert command("flatten", "sheet.obj", "--onto", "sheet.obj") == 2
    assert "is a mesh" in capsys.readouterr().err
    assert not (folder / "sheet-flat.svg").exists()


def test_new_texture_coordinates_of_ears_are_sound(folder):
    code = command("map", "square.svg", "sheet.obj", "-o", "new.obj", "--report", "r.json")
    report = json.loads((folder / "r.json").read_text())
    assert code == 0 and report["uv"] == {"flipped": 0, "degenerate": 0}


@pytest.mark.slow
def test_landmarks_cut_closed_meshes_consistently(folder):
    fine, coarse = ball(900), ball(500)
    write(folder / "fine.obj", *fine)
    write(folder / "coarse.obj", *coarse)
    spots = np.array([[0, 0, 1.4], [0, 0.8, 0], [1, 0, 0], [0, -0.8, 0], [-1, 0, 0], [0, 0, -1.4]])
    marks = {f"m{k}": spot.tolist() for k, spot in enumerate(spots)}
    (folder / "marks.json").write_text(json.dumps({"landmarks": {"source": marks, "target": marks}}))
    listed = listing.read(folder / "marks.json")
    places = [pin.source for pin in listed.all_pins]
    source, target = (
        mesh_reading.read(f"{name}.obj", cutting=mesh_reading.Cutting(closed=True, pins=places))
        for name in ("coarse", "fine")
    )
    collected = constraints.collect(source, target, listed)
    assert len(collected.pins) == 10  # both ends of the cut once, the others on both of its sides
    assert collected.names[0] == ["m0", *np.repeat(["m1", "m2", "m3", "m4"], 2), "m5"]
    for shape, pins in ((source, collected.pins[:, 0]), (target, collected.pins[:, 1])):
        assert shape.curve.distances(pins).max() < 1e-9
    import iccm

    fit = iccm.fit(source.domain, target.domain, pins=collected.pins)
    assert fit.status.ok
    flat, patch = target.flattening.flat, target.flattening.patch
    face, weight = source.locator(fit.inverse(flat), 1)
    came = np.einsum(
        "pk,pkc->pc", weight, source.flattening.patch.points[source.flattening.patch.faces[face]]
    )
    away = np.linalg.norm(came - patch.points, axis=1) / np.linalg.norm(np.ptp(patch.points, axis=0))
    assert np.median(away) < 0.02  # the edges of the coarse one are 0.04 long
    assert away.max() < 0.15


@pytest.mark.slow
def test_landmarks_in_any_order_are_met_in_the_midst_of_faces(folder):
    write(folder / "fine.obj", *ball(900))
    points, faces = ball(300)
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in points]
    lines += ["vt {:.6f} {:.6f}".format(*p) for p in points[:, ::2] / 3 + 0.5]
    lines += ["f {0}/{0} {1}/{1} {2}/{2}".format(*(face + 1)) for face in faces]
    (folder / "coarse.obj").write_text("\n".join(lines))
    spots = np.array([[0, 0, 1.4], [0.1, 0.75, 0.3], [0, -0.8, 0], [0.9, 0.1, 0.4], [0, 0, -1.4], [-1, 0, 0]])
    target = mesh_files.read("fine.obj").mesh.points
    named = {f"m{k}": f"v{1 + np.argmin(((target - spot) ** 2).sum(axis=1))}" for k, spot in enumerate(spots)}
    exact = {name: target[int(number[1:]) - 1].tolist() for name, number in named.items()}
    (folder / "marks.json").write_text(json.dumps({"landmarks": {"source": exact, "target": named}}))
    job = Job(source="coarse.obj", target="fine.obj", constraints="marks.json", cut=True)
    inputs = Inputs(job)
    source_shape, target_shape = inputs.shape(job.source), inputs.shape(job.target, target=True)
    collected = constraints.collect(source_shape, target_shape, inputs.listed)
    assert len(collected.pins) == 10
    for source_point, target_point in zip(
        source_shape.to_space(collected.pins[:, 0]), target_shape.to_space(collected.pins[:, 1])
    ):
        assert (
            np.linalg.norm(source_point - target_point) < 0.03
        )  # the coarse one is that far inside, and its edges are 0.25 long
    words = ["--constraints", "marks.json", "-o", "new.obj", "--report", "r.json"]
    code = command("map", "coarse.obj", "fine.obj", "--cut", *words)
    report = json.loads((folder / "r.json").read_text())
    assert code == 0 and report["status"] == "reached"
    assert report["apart"]["median"] < 0.01
    assert report["apart"]["p95"] < 0.03
    new = mesh_files.read("new.obj").mesh
    away = np.linalg.norm(new.uv[new.uv_corners] - (new.points[new.corners][:, ::2] / 3 + 0.5), axis=1)
    assert np.median(away) < 0.015


def test_a_landmark_of_one_side_is_refused(folder):
    (folder / "marks.json").write_text(
        json.dumps({"landmarks": {"source": {"nose": "v1", "ear": "v2"}, "target": {"ear": "v3"}}})
    )
    sheet_shape = mesh_reading.read("sheet.obj")
    with pytest.raises(InputError, match=r"landmarks: nose: .*given for the source"):
        constraints.collect(sheet_shape, sheet_shape, listing.read(folder / "marks.json"))
