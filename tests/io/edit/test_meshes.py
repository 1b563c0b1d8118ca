"""Meshes on the page: it shows what `iccm map` writes, and pins are points of the surface."""

import struct

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.edit import placing, saving
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.pictures import image_files
from iccm.io.run.job import make
from iccm.io.shapes import mesh_reading

pytestmark = pytest.mark.usefixtures("solve_once")


def hill(path, n=8, uv=False):
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 100, n + 1), np.linspace(0, 100, n + 1)))
    k = np.arange(1, (n + 1) ** 2 + 1).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], axis=-1).reshape(-1, 4)
    lines = [f"v {a} {b} {30 * np.sin(a / 32) * np.sin(b / 32):.6f}" for a, b in zip(x, y)]
    lines += [f"vt {a / 100} {b / 100}" for a, b in zip(x, y)] if uv else []
    lines += ["f " + " ".join(f"{c}/{c}" if uv else str(c) for c in quad) for quad in quads]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def onto(shapes):
    hill(shapes / "hill.obj")
    return Session(make({"source": "square.svg", "target": "hill.obj"}))


def scene(*ends):
    return Scene.model_validate({"pins": [{"source": a, "target": b} for a, b in ends]})


def test_the_triangles_come_as_they_are(onto):
    data, patch = onto.view.triangles("target"), onto.pair.target.flattening.patch
    n, m = struct.unpack("<II", data[:8])
    places = np.frombuffer(data, "<f4", 3 * n, 8).reshape(n, 3)
    faces = np.frombuffer(data, "<u4", 3 * m, 8 + 12 * n).reshape(m, 3)
    numbers = np.frombuffer(data, "<u4", n, 8 + 12 * (n + m))
    assert len(data) == 8 + 12 * (n + m) + 4 * n and (faces == patch.faces).all()
    side = onto.describe()["target"]
    assert np.allclose(np.array(side["origin"]) + side["scale"] * places, patch.points, atol=1e-4)
    assert np.allclose(onto.pair.target.file.mesh.points[numbers - 1], patch.points)
    assert side["mesh"] and np.abs(places).max() <= 0.5
    with pytest.raises(KeyError):
        onto.view.triangles("source")


@pytest.mark.slow
def test_what_is_drawn_is_what_is_written(onto, shapes):
    fit = onto.solve(scene())
    outcome = saving.export(onto, scene(), "hill-new.obj", 64, replace=False)
    assert outcome.ok and "hill-new.obj" in outcome.written
    written = mesh_reading.read("hill-new.obj")
    seen = _core(fit.drawn, onto.view.halves[0])
    low, high = onto.pair.source.box
    for corner, vertex in zip(written.uv_faces.ravel(), written.flattening.patch.faces.ravel()):
        at = written.flattening.patch.points[vertex]
        mine = np.argmin(np.linalg.norm(onto.pair.target.flattening.patch.points - at, axis=1))
        uv = (seen[mine] - low) / (high - low).real
        assert abs(complex(*written.uv[corner]) - uv) < 1e-5


def _core(points, view):
    return view.centre + view.scale * (points[..., 0].astype(float) - 1j * points[..., 1])


def test_pins_are_places_of_the_surface_and_vertices(onto):
    onto.solve(scene())
    [place] = placing.transfer(onto, "source", [[40, 45]])
    assert len(place) == 3
    [back] = placing.transfer(onto, "target", [place])
    assert np.allclose(back, [40, 45], atol=1e-3)
    [vertex] = placing.transfer(onto, "target", ["v41"])
    assert onto.solve(scene([vertex, "v41"], [[40, 45], place])).ok
    moved = [place[0] + 4, place[1] - 3, place[2]]
    coarse = onto.follow(scene([vertex, "v41"], [[40, 45], moved]))
    assert coarse.ok and coarse.kind == "coarse" and coarse.drawn.shape == (81, 2)
    with pytest.raises(InputError, match="no vertex 999"):
        placing.transfer(onto, "target", ["v999"])
    with pytest.raises(InputError, match="this is not a mesh"):
        placing.transfer(onto, "source", ["v5"])


@pytest.mark.slow
def test_after_a_drag_no_second_map_is_solved(onto, monkeypatch):
    onto.solve(scene())
    [place] = placing.transfer(onto, "source", [[40, 45]])
    onto.solve(scene([[40, 45], place]))
    last = scene([[40, 45], [place[0] + 4, place[1] - 3, place[2]]])
    onto.follow(last)
    assert onto.solve(last).ok and onto.start(last) is not None
    monkeypatch.setattr("iccm.io.edit.session.solve_scene", lambda *arguments: pytest.fail("solved again"))
    assert onto.compare(last) is None


@pytest.mark.slow
def test_pins_on_a_mesh_are_saved_and_repeat_the_map(onto, shapes, shell):
    onto.solve(scene())
    [place] = placing.transfer(onto, "source", [[40, 45]])
    [again] = placing.transfer(onto, "target", ["v61"])
    expected_scene = scene([[40, 45], [place[0] + 4, place[1] - 3, place[2]]], [again, "v61"])
    onto.solve(scene([[40, 45], place], [again, "v61"]))
    onto.follow(expected_scene)
    assert onto.solve(expected_scene).ok
    saving.save(onto, expected_scene, "square-hill.json", replace=False)
    saving.export(onto, expected_scene, "shown.obj", 64, replace=False)
    line = saving.command(onto, expected_scene)
    assert line.endswith("-o square-hill.obj")
    done = shell(line)
    assert done.returncode == 0, done.stderr
    rows = [[line for line in (shapes / name).read_text().splitlines() if line.startswith(("v", "f"))]
            for name in ("shown.obj", "square-hill.obj")]  # fmt: skip
    assert rows[0] == rows[1]
    opened = Session(make({"source": "square.svg", "target": "hill.obj", "constraints": "square-hill.json"}))
    assert opened.pair.first.pins == expected_scene.pins


def test_places_of_the_plane_become_places_of_the_surface(shapes):
    hill(shapes / "hill.obj")
    opened = Session(make({"source": "square.svg", "target": "hill.obj", "pin": ["50,50:3,-2", "30,30:v20"]}))
    flat, vertex = (pin.target for pin in opened.pair.first.pins)
    assert len(flat) == 3 and vertex == "v20"
    assert abs(opened.pair.target.at(flat) - (3 - 2j)) < 1e-4


def test_a_mesh_as_the_source_shows_its_own_texture(shapes):
    hill(shapes / "hill.obj", uv=True)
    t = (np.arange(64) + 0.5) / 64
    pixels = np.stack(np.broadcast_arrays(t, 1 - t[:, None], 0.5), axis=-1)
    image_files.write("c.png", image_files.Image((255 * pixels).round().astype(np.uint8)))
    edited = Session(make({"source": "hill.obj", "target": "blob.svg", "texture": "c.png"}))
    (shapes / "laid.png").write_bytes(edited.view.texture(2048))
    laid = image_files.read("laid.png").pixels.astype(float) / 255
    patch, view = edited.pair.source.flattening.patch, edited.view.halves[0]
    middle = edited.pair.source.flattening.flat[patch.faces].mean(axis=1)
    low, high = edited.view.boxes[0]
    at = (middle - low) / (high - low).real
    row = laid.shape[0] - np.array((at.imag * (high - low).real / (high - low).imag) * laid.shape[0])
    column = at.real * laid.shape[1]
    colour = laid[row.astype(int), column.astype(int)]
    want = patch.points[patch.faces].mean(axis=1)[:, :2] / 100
    assert np.abs(colour[:, 0] - want[:, 0]).max() < 0.03 and np.abs(colour[:, 1] - want[:, 1]).max() < 0.03
    data, count = edited.view.triangles("source"), len(patch.points)
    flat = np.frombuffer(data[-8 * count :], "<f4").reshape(-1, 2)
    assert np.allclose(_core(flat, view), edited.pair.source.flattening.flat, atol=1e-4)
    assert edited.solve(Scene()).drawn.shape[1] == 18
    assert len(placing.transfer(edited, "target", [[50, 50]])[0]) == 3
