"""--subdivide-rim: edges between written coordinates follow the outline, and nothing else of a mesh changes."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh

from iccm.io.meshes import mesh_files
from tests.cases import slow

pytestmark = pytest.mark.usefixtures("solve_once")

N = 5
ROUND = "M50 5C80 5 95 25 95 50C95 80 75 95 50 95C20 95 5 75 5 50C5 25 20 5 50 5Z"
SVG = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="{ROUND}"/></svg>'
EXTRA = "# another part\no other\nv 9 0 0 .1 .2 .3\nv 10 0 0 .1 .2 .3\nv 9 1 0 .1 .2 .3\nf -3 -2 -1\n"


@pytest.fixture
def bowl(tmp_path, monkeypatch):
    """A bowl of quads with normals and coordinates, and a triangle beside it."""
    monkeypatch.chdir(tmp_path)
    Path("round.svg").write_text(SVG)
    x, y = (
        coordinates.ravel()
        for coordinates in np.meshgrid(np.linspace(-1, 1, N + 1), np.linspace(-1, 1, N + 1))
    )
    normals = np.column_stack([-0.6 * x, -0.6 * y, np.ones(x.size)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lines = ["o bowl"]
    for px, py, normal in zip(x, y, normals):
        lines.append(f"v {px} {py} {0.3 * (px**2 + py**2)} {abs(px)} {abs(py)} 0")
        lines += [f"vt {px / 2 + 0.5} {py / 2 + 0.5}", "vn {} {} {}".format(*normal)]
    for k in (y * (N + 1) + x + 1 for y in range(N) for x in range(N)):
        lines.append("f " + " ".join(f"{j}/{j}/{j}" for j in (k, k + 1, k + N + 2, k + N + 1)))
    Path("bowl.obj").write_text("\n".join(lines) + "\n" + EXTRA)


def drawn() -> shapely.Polygon:
    """The outline as in its file, y up in a unit square."""
    t = np.linspace(0, 1, 401)[:, None]
    numbers = ROUND.replace("C", " ").replace("M", "").replace("Z", "").split()
    points = np.array(numbers, float).reshape(-1, 2)
    curves = []
    for k in range(0, len(points) - 1, 3):
        a, b, c, d = points[k : k + 4]
        curves.append((1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d)
    return shapely.Polygon(np.concatenate(curves) * [0.01, -0.01] + [0, 1])


def laid_out(path: str) -> tuple[shapely.Geometry, np.ndarray]:
    """The union of a file's triangles in its coordinates, and their signed areas, computed by shapely; only the reader
    is ours.
    """
    mesh = mesh_files.read(path).mesh
    uv = mesh.uv[mesh.uv_corners]
    rings = [uv[a:b] for a, b in zip(mesh.starts, mesh.starts[1:])]
    areas = np.array(
        [0.5 * np.sum(r[:, 0] * np.roll(r[:, 1], -1) - r[:, 1] * np.roll(r[:, 0], -1)) for r in rings]
    )
    return shapely.union_all([shapely.Polygon(ring) for ring in rings], grid_size=1e-9), areas


@pytest.mark.slow
def test_subdividing_the_rim_brings_conformal_maps_closer(bowl, iccm):
    gaps = []
    for more in ((), ("--subdivide-rim",)):
        words = ("map", "round.svg", "bowl.obj#bowl", "--method", "conformal", "-o", "o.obj", "--force")
        result = iccm(*words, "--report", "r.json", *more)
        assert result.code == 0, result.err
        gaps.append(json.loads(Path("r.json").read_text())["boundary"]["hausdorff"])
    assert gaps[0] > 3e-3 and gaps[1] <= 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["obj", "glb", "ply"])
def test_chords_follow_the_outline_and_the_surface_stays(bowl, iccm, suffix):
    gaps, holds = [], []
    for name, more in (("as-it-is", ()), ("split", ("--subdivide-rim",))):
        out = f"{name}.{suffix}"
        result = iccm("map", "round.svg", "bowl.obj#bowl", "-o", out, "--report", "r.json", "--force", *more)
        assert result.code == 0, result.err
        report = json.loads(Path("r.json").read_text())
        gaps.append(report["boundary"]["hausdorff"])
        assert report["uv"] == {"flipped": 0, "degenerate": 0}
        holds.append(("--subdivide-rim" in result.err, report.get("rim_vertices")))
    assert gaps[0] > 3e-3 and gaps[1] <= 1e-3
    assert holds[1][1] > 20 and holds[0][1] is None
    union, areas = laid_out(f"split.{suffix}" + ("#bowl" if suffix == "obj" else ""))
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(union.area, rel=1e-5)  # no triangle lies on another
    outline = drawn()
    diagonal = np.hypot(*np.ptp(shapely.get_coordinates(outline), axis=0))
    away = shapely.hausdorff_distance(union.exterior, outline.exterior, 0.05) / diagonal
    assert away == pytest.approx(gaps[1], rel=0.1, abs=5e-5)


def test_vertex_attributes_are_interpolated_and_other_parts_stay(bowl, iccm):
    result = iccm("map", "round.svg", "bowl.obj#bowl", "-o", "out.obj", "--subdivide-rim")
    assert result.code == 0, result.err
    before, after = (trimesh.load(name, process=False, force="mesh") for name in ("bowl.obj", "out.obj"))
    assert after.area == pytest.approx(before.area, rel=1e-9)
    assert after.volume == pytest.approx(before.volume, rel=1e-6)
    mesh = mesh_files.read("out.obj#bowl").mesh
    x, y, z = mesh.points[np.unique(mesh.corners)].T
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-6
    assert z.max() <= 0.6 + 1e-9 and (z >= 0.3 * (x**2 + y**2) - 1e-9).all()  # edges of a bowl lie above it
    lines = Path("out.obj").read_text().splitlines()
    colours = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
    part_colours = colours[colours[:, 0] < 5]
    assert len(part_colours) > (N + 1) ** 2 and np.allclose(part_colours[:, 5], 0)
    rim = np.isclose(np.abs(part_colours[:, 0]), 1) & (
        part_colours[:, 1] > 0.6
    )  # where |y| is linear between old vertices
    assert np.allclose(part_colours[rim, 3:5], np.abs(part_colours[rim, :2]))
    triangle = mesh_files.read("out.obj#other").mesh
    assert np.array_equal(triangle.points[triangle.corners], [[9, 0, 0], [10, 0, 0], [9, 1, 0]])


@pytest.mark.slow
def test_both_sides_of_a_seam_are_split_alike(tmp_path, monkeypatch, iccm):
    monkeypatch.chdir(tmp_path)
    Path("round.svg").write_text(SVG)
    trimesh.creation.icosphere(1).export("ball.obj")
    result = iccm(
        "map", "round.svg", "ball.obj", "--cut", "-o", "out.obj", "--subdivide-rim", "--report", "r.json"
    )
    assert result.code in (0, 1), result.err
    assert json.loads(Path("r.json").read_text())["rim_vertices"] > 0
    mesh = trimesh.load("out.obj", process=False, force="mesh")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    assert mesh.is_watertight


@pytest.mark.slow
def test_layouts_onto_an_outline_have_their_rims_split(bowl, iccm):
    missed, outline = [], drawn()
    low, high = np.reshape(outline.bounds, (2, 2))
    unit = shapely.transform(outline, lambda xy: (xy - low) / (high - low).max())
    for more in ((), ("--subdivide-rim",)):
        arguments = ("flatten", "bowl.obj#bowl", "--onto", "round.svg", "--uv", "out.obj", "--force", *more)
        result = iccm(*arguments, "--report", "r.json")
        assert result.code == 0, result.err
        union, areas = laid_out("out.obj#bowl")
        assert (areas > 0).all()
        missed.append(shapely.hausdorff_distance(union.exterior, unit.exterior, 0.05))
    report = json.loads(Path("r.json").read_text())
    assert report["rim_vertices"] > 20 and report["uv"]["flipped"] == 0
    assert missed[0] > 5e-3 and missed[1] < 2e-3


COMB = "M5 5H95V95H80V20H70V95H55V20H45V95H30V20H20V95H5Z"


@pytest.mark.parametrize("command", [slow("map"), "flatten"])
def test_subdivisions_that_flip_triangles_are_undone_and_reported(bowl, iccm, command):
    Path("comb.svg").write_text(SVG.replace(ROUND, COMB))
    words = ("map", "comb.svg", "bowl.obj#bowl", "-o")
    if command == "flatten":
        words = ("flatten", "bowl.obj#bowl", "--onto", "comb.svg", "--uv")
    result = iccm(*words, "o.obj", "--report", "r.json", "--force", "--subdivide-rim")
    assert result.code == 0, result.err
    report = json.loads(Path("r.json").read_text())
    assert report["uv"] == {"flipped": 0, "degenerate": 0}
    assert report["boundary"]["hausdorff"] > 0.01
    assert "the mesh is too coarse (boundary)" in result.err
    assert report["rim_edges_left"] > 0 and report["rim_vertices"] > 0
    assert f"{report['rim_edges_left']} edges at the boundary" in result.err
    assert sum("rim_edges_left" in note for note in report["notes"]) == 1
    union, areas = laid_out("o.obj#bowl")
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(union.area, rel=1e-5)


def test_subdivide_rim_is_refused_without_an_outline_or_a_mesh(bowl, iccm):
    result = iccm("map", "round.svg", "bowl.obj#bowl", "--bake", "-o", "o.png", "--subdivide-rim")
    assert result.code == 2 and "--subdivide-rim" in result.err
    result = iccm("flatten", "bowl.obj#bowl", "--uv", "o.obj", "--subdivide-rim")
    assert result.code == 2 and "--subdivide-rim" in result.err and not Path("o.obj").exists()
