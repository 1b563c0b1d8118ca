"""`iccm flatten -o`: a name that only fits a mesh receives the mesh with its flattening as coordinates."""

import json

import numpy as np
import pytest
import trimesh

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
