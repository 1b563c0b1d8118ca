"""PLY files keep all their contents, ASCII or binary, and all kinds of faces are read."""

import numpy as np
import pytest

from iccm.io.meshes import mesh_files, ply, ply_write
from iccm.io.shapes import mesh_reading

HEADER = """ply
format {form} 1.0
comment made by hand
obj_info kept
element camera 1
property double focal
element vertex 9
property float x
property float y
property float z
property uchar red
property double weight
element face 5
property uchar material
property list uchar int vertex_indices
property float heat
element edge 1
property int vertex1
property int vertex2
end_header
"""
POINTS = [(x, y, 0.25 * x * y) for y in range(3) for x in range(3)]
FACES = [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7), (3, 7, 6), (4, 5, 8, 7)]


def content(form):
    """A grid of quads and triangles, with other elements that may occur."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    head = HEADER.format(form=form).encode()
    if not order:
        lines = ["0.1"]
        lines += [f"{x} {y} {z} {10 + k} 0.3333333333333333" for k, (x, y, z) in enumerate(POINTS)]
        lines += [f"{k} {len(f)} {' '.join(map(str, f))} {k / 8}" for k, f in enumerate(FACES)]
        return head + "\n".join([*lines, "0 8", ""]).encode()
    rows = [np.array([0.1], order + "f8")]
    for k, point in enumerate(POINTS):
        rows += [np.array(point, order + "f4"), np.uint8([10 + k]), np.array([1 / 3], order + "f8")]
    for k, face in enumerate(FACES):
        rows += [np.uint8([k, len(face)]), np.array(face, order + "i4"), np.array([k / 8], order + "f4")]
    return head + b"".join(row.tobytes() for row in [*rows, np.array([0, 8], order + "i4")])


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", FORMS)
def test_polygons_are_not_triangulated(tmp_path, form):
    (tmp_path / "a.ply").write_bytes(content(form))
    mesh = mesh_files.read(str(tmp_path / "a.ply")).mesh
    assert mesh.sizes.tolist() == [4, 4, 3, 3, 4]
    assert mesh.corners.tolist() == [v for face in FACES for v in face]
    assert mesh.points == pytest.approx(np.array(POINTS))


@pytest.mark.parametrize("form", FORMS)
def test_a_flattening_adds_two_properties_and_nothing_else(shapes, iccm, form):
    (shapes / "a.ply").write_bytes(content(form))
    result = iccm("flatten", "a.ply", "--uv", "out.ply")
    assert result.code == 0, result.err
    written = (shapes / "out.ply").read_bytes()
    head = HEADER.format(form=form).replace(
        "double weight\n", "double weight\nproperty float s\nproperty float t\n"
    )
    assert written.startswith(head.encode())
    old, new = ply.read(shapes / "a.ply"), ply.read(shapes / "out.ply")
    for name in ("camera", "face", "edge"):
        assert (old.tables[name].cells == new.tables[name].cells).all()
    for name in ("x", "y", "z", "red", "weight"):
        assert (old.tables["vertex"].column(name) == new.tables["vertex"].column(name)).all()
    shape = mesh_reading.read("a.ply", method="balanced", purpose="texture")
    flat, uv = shape.flattening.flat[np.argsort(shape.flattening.patch.vertex)], new.vertices(("s", "t"))
    assert uv == pytest.approx(_unit(flat), abs=1e-6)
    again = iccm("flatten", "out.ply", "--uv", "again.ply")
    assert again.code == 0 and (shapes / "again.ply").read_bytes() == written


def _unit(flat):
    low = flat.real.min() + 1j * flat.imag.min()
    scaled = (flat - low) / max(np.ptp(flat.real), np.ptp(flat.imag))
    return np.column_stack([scaled.real, scaled.imag])


@pytest.mark.parametrize("form", FORMS)
def test_vertices_are_split_where_coordinates_part(tmp_path, form):
    whole = ply.parse(content(form), tmp_path / "a.ply")
    corners = whole.polygons[0]
    uv = np.column_stack(
        [corners + 0.25, np.where(np.arange(18) < 8, 0.5, 0.75)]
    )  # the first two quads separately
    written, notes = ply_write.with_coordinates(whole, np.ones(5, bool), uv, np.arange(18), None)
    new = ply.parse(written, tmp_path / "b.ply")
    assert notes == [] and len(new.tables["vertex"].starts) - 1 > 9
    for name in ("x", "y", "z", "red", "weight"):
        before, after = (t.tables["vertex"].column(name)[t.polygons[0]] for t in (whole, new))
        assert (before == after).all()
    assert (new.vertices(("s", "t"))[new.polygons[0]] == uv).all()
    assert (new.faces.column("heat") == whole.faces.column("heat")).all()


def test_coordinates_of_corners_are_changed_in_place(shapes, iccm):
    lines = (
        content("ascii")
        .decode()
        .replace("property float heat", "property list uchar float texcoord")
        .split("\n")
    )
    first = lines.index("end_header") + 11
    for k, face in enumerate(FACES):
        row = lines[first + k].rsplit(" ", 1)[0]
        lines[first + k] = f"{row} {2 * len(face)} " + " ".join("0.5" for _ in range(2 * len(face)))
    (shapes / "a.ply").write_text("\n".join(lines))
    assert iccm("flatten", "a.ply", "--uv", "out.ply").code == 0
    written = (shapes / "out.ply").read_text().split("\n")
    assert written[:first] == lines[:first] and written[first + 5 :] == lines[first + 5 :]
    uv = mesh_files.read("out.ply").mesh
    assert np.ptp(uv.uv[uv.uv_corners], axis=0).max() == pytest.approx(1)


def test_the_texture_is_named_in_a_comment(shapes, iccm):
    from PIL import Image

    (shapes / "a.ply").write_bytes(content("ascii"))
    Image.new("RGB", (8, 8), (9, 200, 30)).save("new.png")
    assert iccm("map", "square.svg", "a.ply", "--texture", "new.png", "-o", "out.ply").code == 0
    assert "comment TextureFile new.png" in (shapes / "out.ply").read_text()
    assert mesh_reading.read("out.ply").pictures == ((shapes / "new.png").read_bytes(),)


@pytest.mark.parametrize("form", FORMS)
def test_truncated_files_are_refused_in_one_line(shapes, iccm, form):
    data = content(form)
    for end in (len(data) - 30, len(data) - 120, data.index(b"end_header") + 12, 60):
        (shapes / "a.ply").write_bytes(data[:end])
        result = iccm("flatten", "a.ply")
        assert result.code == 2 and len(result.lines) == 1 and "a.ply" in result.err


def test_strips_get_faces_when_their_vertices_are_split(tmp_path):
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n"
    )
    whole = ply.parse(text.encode(), tmp_path / "a.ply")
    uv = np.arange(12.0).reshape(6, 2)
    written, _ = ply_write.with_coordinates(whole, np.ones(2, bool), uv, np.arange(6), None)
    new = ply.parse(written, tmp_path / "b.ply")
    assert "element face 2" in written.decode() and "tristrips" not in written.decode()
    assert (new.vertices(("s", "t"))[new.polygons[0]] == uv).all()
