"""--subdivide: a target of few triangles gets more of the same shape, which stretch the picture less."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from iccm.io.meshes import mesh_files

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 40C10 10 40 5 60 12S98 40 90 60 60 '
    '95 40 90 10 70 10 40Z"/></svg>'
)
SIZE = 1.0, 2.0, 0.5
QUADS = ("1 4 3 2", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8")


@pytest.fixture
def box(tmp_path, monkeypatch):
    """A box of six quads with normals, and a triangle in another object before it."""
    monkeypatch.chdir(tmp_path)
    Path("drawing.svg").write_text(SVG)
    x, y, z = SIZE
    corners = [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0), (0, 0, z), (x, 0, z), (x, y, z), (0, y, z)]
    lines = ["o box", *(f"v {a} {b} {c}" for a, b, c in corners)]
    lines += [f"vn {a} {b} {c}" for a, b, c in np.array(corners) / SIZE - 0.5]
    lines += ["f " + " ".join(f"{k}//{k}" for k in quad.split()) for quad in QUADS]
    Path("box.obj").write_text("\n".join(lines) + "\n")


def mapped(iccm, target: str, *more: str) -> dict:
    """The report of a map onto a mesh."""
    result = iccm(
        "map",
        "drawing.svg",
        target,
        "-o",
        f"out{Path(target).suffix}",
        "--report",
        "r.json",
        "--force",
        *more,
    )
    assert result.code == 0, result.err
    return json.loads(Path("r.json").read_text())


def is_closed(mesh: trimesh.Trimesh) -> bool:
    """Whether every edge has two triangles, with vertices at the same place merged: nothing ends inside an edge."""
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return mesh.is_watertight


@pytest.mark.slow
def test_a_box_of_smaller_triangles_is_the_same_box_and_stretches_less(iccm, box):
    """The surface, its normals and its sharp edges stay; the written picture is stretched less."""
    before = mapped(iccm, "box.obj", "--parts", "largest")
    after = mapped(iccm, "box.obj", "--parts", "largest", "--subdivide", "2")
    assert after["dilatation"]["p95"] < 0.8 * before["dilatation"]["p95"]
    assert after["boundary"]["hausdorff"] < 0.5 * before["boundary"]["hausdorff"]
    assert after["uv"] == {"flipped": 0, "degenerate": 0}
    mesh = mesh_files.read("out.obj").mesh
    assert (mesh.sizes == 3).all() and mesh.sizes.size == 6 * 2 * 4**2
    corners = mesh.points[mesh.corners.reshape(-1, 3)]
    sides = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    x, y, z = SIZE
    assert np.linalg.norm(sides, axis=1).sum() == pytest.approx(2 * (x * y + y * z + z * x))
    assert np.einsum("mi,mi->", corners[:, 0], sides) / 3 == pytest.approx(x * y * z)
    assert is_closed(trimesh.Trimesh(mesh.points, mesh.corners.reshape(-1, 3)))
    normals = mesh.normals[mesh.normal_corners]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-6)
    outward = mesh.points[mesh.corners] / SIZE - 0.5
    assert (np.einsum("ci,ci->c", normals, outward) > 0).all()


def test_all_geometries_of_a_glb_are_divided_in_one_document(iccm, box):
    """Two geometries with places of their own: both are divided, and the nodes stay."""
    scene = trimesh.Scene()
    scene.add_geometry(
        trimesh.creation.box((1, 2, 3)), "a", transform=trimesh.transformations.translation_matrix((5, 0, 0))
    )
    scene.add_geometry(trimesh.creation.box((2, 1, 1)), "b")
    Path("two.glb").write_bytes(scene.export(file_type="glb"))
    report = mapped(iccm, "two.glb", "--subdivide", "1")
    assert report["mapped"] == 1 and report["uv"] == {"flipped": 0, "degenerate": 0}
    divided = trimesh.load_scene("out.glb")
    assert len(divided.geometry) == 2
    assert all(len(value.faces) == 48 and is_closed(value) for value in divided.geometry.values())
    assert np.allclose(divided.bounds, scene.bounds)
    assert divided.area == pytest.approx(scene.area)


@pytest.mark.parametrize(
    ("target", "more", "message"),
    [
        ("drawing.svg", (), ["--subdivide", "mesh"]),
        ("box.obj", ("--pin", "50,50:v3"), ["--subdivide", "--pin", "position"]),
        ("box.obj", ("--max-faces", "100"), ["--subdivide", "--max-faces"]),
    ],
)
def test_meshes_that_cannot_be_subdivided_are_refused(iccm, box, target, more, message):
    """The message names the option and the cure."""
    out = "o.obj" if target == "box.obj" else "o.svg"
    result = iccm("map", "drawing.svg", target, "-o", out, "--subdivide", "3", *more)
    assert result.code == 2 and all(word in result.err for word in message), result.err
    assert not Path(out).exists()
