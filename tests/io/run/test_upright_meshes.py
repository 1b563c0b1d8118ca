"""Two meshes without landmarks: the source is upright on the target, or the result says that landmarks are missing."""

import json
from pathlib import Path

import numpy as np
import pytest

from iccm.io.run import by_position

COLUMNS, ROWS = 28, 8


def write_mask(path, width, height):
    """The front half of a head, with a nose below its middle."""
    steep, around = np.meshgrid(1.4 * np.arange(1, ROWS + 1) / ROWS, 2 * np.pi * np.arange(COLUMNS) / COLUMNS)
    u, v = (np.append(0, (steep * turn(around)).T.ravel() / 1.4) for turn in (np.cos, np.sin))
    r = 1.4 * np.hypot(u, v)
    shrunk = np.sin(r) / np.maximum(np.hypot(u, v), 1e-9)
    x, y, z = width * shrunk * u, height * shrunk * v, np.cos(r)
    z += 0.3 * np.exp(-25 * ((x / width) ** 2 + (y / height + 0.25) ** 2))
    k, after = np.arange(COLUMNS), (np.arange(COLUMNS) + 1) % COLUMNS
    faces = [(1, 2 + i, 2 + j) for i, j in zip(k.tolist(), after.tolist())]
    for first in range(2, 2 + COLUMNS * (ROWS - 1), COLUMNS):
        faces += [
            (first + i, first + COLUMNS + i, first + COLUMNS + j, first + j)
            for i, j in zip(k.tolist(), after.tolist())
        ]
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in zip(x, y, z)]
    lines += ["vt {:.6f} {:.6f}".format(*p) for p in zip((u + 1) / 2, (v + 1) / 2)]
    lines += ["f " + " ".join(f"{k}/{k}" for k in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def heads(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mask(tmp_path / "tall.obj", 0.6, 1.3)
    write_mask(tmp_path / "wide.obj", 1.3, 0.6)
    return tmp_path


@pytest.mark.slow
def test_a_tall_head_is_upright_on_a_wide_one(heads, iccm):
    result = iccm("map", "tall.obj", "wide.obj", "-o", "o.obj", "--report", "r.json")
    assert result.code == 0 and "on its side" in result.err, result.err
    assert json.loads((heads / "r.json").read_text())["apart"]["median"] < 0.2


@pytest.mark.slow
def test_a_head_on_its_side_asks_for_landmarks_unless_that_is_accepted(heads, iccm, monkeypatch):
    monkeypatch.setattr(by_position, "pins_by_up", lambda run, turn: [])
    result = iccm("map", "tall.obj", "wide.obj", "-o", "o.obj")
    assert result.code == 1 and "add landmarks" in result.err
    assert iccm("map", "tall.obj", "wide.obj", "-o", "p.obj", "--turn", "any").code == 0


@pytest.mark.slow
def test_a_mesh_turns_on_another_one(heads, iccm, monkeypatch):
    """The nose, which is below the middle of the source, comes to lie right of the middle of the target."""
    Path("t.obj").write_text(Path("tall.obj").read_text())
    report = {}
    for turn in (0, 90):
        result = iccm(
            "map", "t.obj", "tall.obj", "--turn", turn, "-o", f"o{turn}.obj", "--report", "r.json", "--force"
        )
        assert result.code == 0, result.err
        report[turn] = json.loads(Path("r.json").read_text())
    assert report[0]["apart"]["median"] < 0.02 < 0.2 < report[90]["apart"]["median"]
    assert "--turn 90" in " ".join(report[90]["notes"])
    monkeypatch.setattr(by_position, "pins_by_up", lambda run, turn: [])
    result = iccm("map", "t.obj", "tall.obj", "--turn", "90", "-o", "p.obj")
    assert result.code == 1 and "--turn" in result.err


def test_places_are_found_by_each_models_own_up_axis(heads):
    """A model that lies on its back, as in formats whose up is z, has the same landmarks."""
    from dataclasses import replace

    from iccm.io.meshes import mesh_files
    from iccm.meshes.disk_patch import disk_patch
    from iccm.meshes.views import views

    mesh = mesh_files.read("tall.obj").mesh
    x, y, z = mesh.points.T
    lying = replace(mesh, points=np.column_stack([x, -z, y]), up_axis=2)
    patches = [disk_patch(m) for m in (mesh, lying)]
    first, second = (
        by_position._landmarks(*patch_and_view) for patch_and_view in zip(patches, views(*patches))
    )
    assert first == second
    heights = mesh.points[first][:, 1]
    assert heights[0] > 0.3 and heights[1] < -0.3 and abs(heights[2:]).max() < 0.3


def write_terrain(path, corners, height, summit):
    """A hill with a summit at x + i z on a regular polygon, with y up."""
    radii, around = np.meshgrid(np.arange(1, 9) / 8, 2 * np.pi * np.arange(corners) / corners + 0.3)
    x, z = (np.append(0, (radii * turn(around)).ravel()) for turn in (np.cos, np.sin))
    y = height * np.exp(-6 * np.abs(x + 1j * z - summit) ** 2)
    after = np.roll(np.arange(corners), -1)
    faces = [(1, 2 + 8 * j, 2 + 8 * i) for i, j in enumerate(after.tolist())]
    for ring in range(7):
        faces += [
            (2 + 8 * i + ring, 2 + 8 * j + ring, 3 + 8 * j + ring, 3 + 8 * i + ring)
            for i, j in enumerate(after.tolist())
        ]
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in zip(x, y, z)]
    lines += ["vt {:.6f} {:.6f}".format(*p) for p in zip((1 + x) / 2, (1 - z) / 2)]
    lines += ["f " + " ".join(f"{k}/{k}" for k in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.slow
@pytest.mark.parametrize("turn", [None, 90])
def test_a_surface_that_faces_up_is_not_turned_on_another_one(tmp_path, monkeypatch, iccm, turn):
    """Also where turning it about the up axis, which is not seen from the front, would bring summits together."""
    monkeypatch.chdir(tmp_path)
    write_terrain(tmp_path / "low.obj", 24, 1, 0.5 - 0.2j)
    write_terrain(tmp_path / "high.obj", 15, 1.2, -0.5 + 0.2j)
    options = () if turn is None else ("--turn", turn)
    result = iccm("map", "low.obj", "high.obj", "-o", "o.obj", "--report", "r.json", *options)
    assert result.code == 0, result.err
    apart = json.loads(Path("r.json").read_text())["apart"]["median"]
    assert apart < 0.2 if turn is None else apart > 0.3


@pytest.mark.parametrize("sign, up, toward", [(1, (0, 0, -1), (0, 1, 0)), (-1, (0, 0, 1), (0, -1, 0))])
def test_surfaces_that_face_up_or_down_are_seen_from_there(tmp_path, sign, up, toward):
    from dataclasses import replace

    from iccm.io.meshes import mesh_files
    from iccm.meshes.disk_patch import disk_patch
    from iccm.meshes.views import views

    write_terrain(tmp_path / "low.obj", 24, 0.3, 0.3 - 0.2j)
    write_mask(tmp_path / "mask.obj", 0.6, 1.3)
    terrain, mask = (mesh_files.read(str(tmp_path / name)).mesh for name in ("low.obj", "mask.obj"))
    terrain = replace(terrain, points=terrain.points * (1, sign, sign))
    for view in views(disk_patch(terrain), disk_patch(terrain)):
        assert view.up.tolist() == list(up) and view.toward.tolist() == list(toward)
        assert np.cross((1, 0, 0), view.up).tolist() == list(toward)  # not mirrored
    for view in views(disk_patch(terrain), disk_patch(mask)):  # one of them has no side above
        assert view.up.tolist() == [0, 1, 0] and view.toward.tolist() == [0, 0, 1]
