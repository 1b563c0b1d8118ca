"""All pieces of a mesh: flattened and packed side by side, and mapped as one."""

import json
from itertools import combinations

import numpy as np
import pytest
import shapely
import trimesh

from iccm import deadline
from iccm.io.meshes import mesh_files
from iccm.io.shapes import mesh_reading
from iccm.meshes.flatten import overlap
from iccm.meshes.stretch import stretches

pytestmark = pytest.mark.usefixtures("solve_once")


@pytest.fixture
def machine(shapes):
    """A ball, a box with a smaller copy that was rotated, a sheet, and a bag with a small opening."""
    ball = trimesh.creation.icosphere(2, radius=0.8)
    box = trimesh.creation.box((1, 2, 0.5)).subdivide()
    copy = box.copy().apply_transform(trimesh.transformations.rotation_matrix(1, (1, 2, 0), (0, 0, 0)))
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 0.4, 0], [0, 0.5, 0]], [[0, 1, 2], [0, 2, 3]])
    bag = trimesh.creation.icosphere(3, radius=1).slice_plane((0, 0, 0.93), (0, 0, -1))
    parts = [ball, box, copy.apply_translation((4, 0, 0)), sheet.apply_translation((0, 4, 0))]
    parts.append(bag.apply_translation((0, 8, 0)))
    trimesh.util.concatenate(parts).export(shapes / "machine.obj")
    return "machine.obj"


def test_every_piece_is_flattened_without_overlap_at_one_scale(machine):
    whole = mesh_reading.read_whole(machine, cut=True)
    layout = whole.flattening
    assert len(layout.outlines) == 5 and overlap(layout) is None
    assert whole.file.faces.all() and not layout.flipped.size
    piece = layout.patch.triangles.components()
    flat = np.abs(stretches(layout.patch.points[layout.patch.faces], layout.flat[layout.patch.faces])).prod(0)
    scales = np.bincount(piece, flat * layout.patch.areas) / np.bincount(piece, layout.patch.areas)
    assert scales == pytest.approx(np.full(5, scales[0]), rel=1e-6)
    low, high = whole.box
    inside = (layout.flat.real >= low.real) & (layout.flat.real <= high.real)
    assert (inside & (layout.flat.imag >= low.imag) & (layout.flat.imag <= high.imag)).all()


def test_copies_get_the_same_layout(machine):
    layout = mesh_reading.read_whole(machine, cut=True).flattening
    piece = layout.patch.triangles.components()
    sizes = np.bincount(piece)
    twins = [k for k in range(5) if sizes[k] == 48]
    lengths = []
    for k in twins:
        corners = layout.flat[layout.patch.faces[piece == k]]
        lengths.append(np.sort(np.abs(corners - np.roll(corners, 1, axis=1)).ravel()))
    assert len(twins) == 2 and lengths[0] == pytest.approx(lengths[1], rel=1e-3)


@pytest.mark.slow
def test_flatten_and_map_take_all_faces_in_one_command(machine, shapes, iccm):
    flat = iccm("flatten", machine, "--uv", "flat.obj", "-o", "flat.svg", "--report", "flat.json")
    assert flat.code == 0, flat.err
    data = json.loads((shapes / "flat.json").read_text())
    assert data["charts"] == 5 and data["holes"] == 0 and data["overlap"] is None
    spread = data["log10_area"]["p95"] - data["log10_area"]["p05"]
    # the bag alone would span decades if it were not cut
    assert spread < 0.5 and data["dilatation"]["p95"] < 3
    assert (shapes / "flat.svg").read_text().count("<path") == 5
    result = iccm("map", "square.svg", machine, "-o", "out.obj", "--report", "r.json")
    assert result.code == 0, result.err
    report = json.loads((shapes / "r.json").read_text())
    assert report["mapped"] == 1 and report["uv"] == {"flipped": 0, "degenerate": 0}
    assert report["injective"]["certified"] and report["scale"]["within2"] > 0.95
    uv = mesh_files.read("out.obj").mesh.uv
    assert uv.min() >= 0 and uv.max() <= 1


def test_pieces_lie_inside_the_outline_of_the_source_and_upright(machine, shapes, iccm):
    (shapes / "tri.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 90"><path d="M5 85H88L40 4Z"/></svg>'
    )
    assert iccm("map", "tri.svg", machine, "-o", "out.obj").code == 0
    uv = mesh_files.read("out.obj").mesh.uv
    x, y = 90 * uv[:, 0], 90 * (1 - uv[:, 1])
    corners = np.array([(5, 85), (88, 85), (40, 4)], float)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0)):
        assert ((bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 0).all()


def test_pieces_lie_in_what_a_line_encloses_unless_its_inside_is_a_hole(shapes, iccm):
    (shapes / "ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 90">'
        '<circle cx="40" cy="45" r="35" fill="none" stroke="black" stroke-width="4"/></svg>'
    )
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 0.4, 0], [0, 0.5, 0]], [[0, 1, 2], [0, 2, 3]])
    trimesh.util.concatenate([sheet, sheet.copy().apply_translation((0, 4, 0))]).export(shapes / "two.obj")
    widths = {}
    for holes in ("auto", "keep"):
        done = iccm("map", "ring.svg", "two.obj", "--holes", holes, "-o", f"{holes}.obj")
        assert done.code == 0, done.err
        x, y = 90 * (mesh_files.read(f"{holes}.obj").mesh.uv * (1, -1) + (0, 1)).T
        widths[holes] = np.ptp(x)
        radii = np.hypot(x - 40, y - 45)
        assert radii.max() <= 37.01 and (holes == "auto" or radii.min() >= 32.99)
    assert widths["auto"] > 40 > 20 > widths["keep"]


@pytest.mark.slow
def test_one_piece_is_used_on_request_or_where_pins_need_it(machine, shapes, iccm):
    # of the area, it is less than half; only --parts says that this is meant
    for words, code in ((["--parts", "largest"], 0), (["--pin", "50,50:v300"], 1)):
        result = iccm("map", "square.svg", machine, *words, "-o", "o.obj", "--report", "r.json", "--force")
        assert result.code == code, result.err
        report = json.loads((shapes / "r.json").read_text())
        assert report["mapped"] < 0.8 and (report["status"] == "partial") == bool(code)
        assert "faces are mapped" in result.err


def test_no_cut_refuses_closed_pieces(machine, iccm):
    for words in (["flatten", machine, "--uv", "o.obj"], ["map", "square.svg", machine, "-o", "o.obj"]):
        result = iccm(*words, "--no-cut")
        assert result.code == 2 and "is closed" in result.err and "--no-cut" in result.err


def test_faces_of_both_sides_and_without_area_get_coordinates_too(shapes, iccm):
    """A sheet whose faces occur twice, once reversed, and a face without area."""
    lines = [f"v {x} {y} {0.1 * x * y}" for y in range(3) for x in range(4)]
    faces = [(1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (5, 6, 10), (5, 10, 9)]
    behind = [face[::-1] for face in faces]
    unused = [f"v {x} {y} 5" for x, y in ((0, 0), (1, 0), (0, 1))]
    every = [*faces, *behind, (1, 2, 2), (13, 14, 15)]
    (shapes / "a.obj").write_text(
        "\n".join([*lines, *unused, *("f {} {} {}".format(*face) for face in every)])
    )
    result = iccm("map", "square.svg", "a.obj", "-o", "o.obj", "--report", "r.json")
    assert result.code == 0, result.err
    assert json.loads((shapes / "r.json").read_text())["mapped"] == 1
    mesh = mesh_files.read("o.obj").mesh
    uv = mesh.uv[mesh.uv_corners]
    assert uv[18:36].reshape(6, 3, 2)[:, ::-1] == pytest.approx(uv[:18].reshape(6, 3, 2))


def test_backs_of_a_sheet_have_their_own_places(shapes, iccm):
    """A bent sheet whose back is partly there, and a face that is written twice: that shares one place."""
    points = ["0 0 0", "2 0 0", "2 1 0", "0 1.5 0", "2 0.2 1", "2 1.1 1"]
    fronts = ["1 2 3", "1 3 4", "2 5 6", "2 6 3"]
    rows = [
        *(f"v {point}" for point in points),
        *(f"f {face}" for face in [*fronts, "3 2 1", "4 3 1", "1 2 3"]),
    ]
    (shapes / "flag.obj").write_text("\n".join(rows) + "\n")
    flat = iccm("flatten", "flag.obj", "--uv", "flat.obj")
    assert flat.code == 0, flat.err
    written = mesh_files.read("flat.obj").mesh
    faces = [shapely.Polygon(written.uv[corners]) for corners in written.uv_corners.reshape(-1, 3)]
    assert faces[6].equals(faces[0])
    assert all(face.exterior.is_ccw for face in faces)
    shared = [a.intersection(b).area for a, b in combinations(faces[:6], 2)]
    assert max(shared) < 1e-9


def test_backs_in_the_midst_of_a_surface_share_the_places_of_their_fronts(shapes, iccm):
    """Faces of a ball that are written a second time, turned over, are a fault of the file: they get no charts."""
    ball = trimesh.creation.icosphere(1)
    faces = np.concatenate([ball.faces, ball.faces[:4, ::-1], ball.faces[30:31, ::-1]])
    rows = [f"v {x} {y} {z}" for x, y, z in ball.vertices] + [f"f {i} {j} {k}" for i, j, k in faces + 1]
    (shapes / "ball.obj").write_text("\n".join(rows) + "\n")
    flat = iccm("flatten", "ball.obj", "--uv", "flat.obj")
    assert flat.code == 0, flat.err
    written = mesh_files.read("flat.obj").mesh
    corners = written.uv[written.uv_corners].reshape(-1, 3, 2)
    centres = corners.mean(axis=1)
    assert centres[80:] == pytest.approx(centres[[0, 1, 2, 3, 30]])


def holey(path):
    """A ball with random missing and doubled faces, a third of them flipped, and a fin on one of its edges."""
    ball, draw = trimesh.creation.icosphere(3), np.random.default_rng(5)
    faces = ball.faces[draw.random(len(ball.faces)) > 0.1]
    flipped = draw.random(len(faces)) < 0.3
    faces[flipped] = faces[flipped][:, ::-1]
    a, b = faces[7][:2]
    faces = np.concatenate([faces, faces[:20], faces[40:60, ::-1], [[a, b, len(ball.vertices)]]])
    points = np.append(ball.vertices, [1.5 * (ball.vertices[a] + ball.vertices[b])], axis=0)
    rows = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {i} {j} {k}" for i, j, k in faces + 1]
    path.write_text("\n".join(rows) + "\n")
    return len(faces)


@pytest.mark.slow
def test_all_faces_of_a_scan_are_mapped(shapes, iccm):
    count = holey(shapes / "scan.obj")
    flat = iccm("flatten", "scan.obj", "--uv", "flat.obj")
    assert flat.code == 0, flat.err
    written = mesh_files.read("flat.obj").mesh
    assert written.sizes.size == count and (written.uv_corners >= 0).all()
    bent = iccm("map", "square.svg", "scan.obj", "-o", "textured.obj", "--size", "32")
    assert bent.code == 0, bent.err
    written = mesh_files.read("textured.obj").mesh
    assert written.sizes.size == count and (written.uv_corners >= 0).all()


def test_flatten_ends_with_what_it_reached_and_exit_code_1(shapes, iccm, monkeypatch):
    holey(shapes / "scan.obj")
    monkeypatch.setattr(deadline, "SEARCH_TIME_SHARE", 0.0)
    flat = iccm("flatten", "scan.obj", "--uv", "flat.obj")
    assert flat.code == 1 and "--time-limit" in flat.lines[-1]
    assert (mesh_files.read("flat.obj").mesh.uv_corners >= 0).all()


def test_pieces_of_a_target_have_the_charts_of_flatten(shapes, iccm):
    box, plank = trimesh.creation.box((2, 1, 0.7)), trimesh.creation.box((3, 1, 0.2))
    trimesh.util.concatenate([box, plank.apply_translation((0, 5, 0))]).export(shapes / "boxes.obj")
    result = iccm("map", "square.svg", "boxes.obj", "-o", "out.obj", "--report", "r.json")
    assert result.code == 0, result.err
    report = json.loads((shapes / "r.json").read_text())
    assert report["dilatation"]["p95"] < 1.01 and report["mapped"] == 1
    placed = mesh_files.read("out.obj").mesh
    points = placed.points[placed.corners].reshape(-1, 3, 3)
    flat = (placed.uv @ [1, 1j])[placed.uv_corners].reshape(-1, 3)
    edges = np.linalg.norm(points - np.roll(points, 1, axis=1), axis=2)
    scale = np.abs(flat - np.roll(flat, 1, axis=1)) / edges
    assert np.ptp(scale) < 1e-3 * scale.mean()  # the same on all charts
