"""Unusable meshes: one line with the first invalid element, for every format. And repairs."""

import struct
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.io.meshes import mesh_files, obj
from iccm.io.run import Job, flat_files
from iccm.io.run.inputs import Inputs
from iccm.io.shapes import mesh_reading
from iccm.io.spec import Spec
from iccm.meshes.disk_patch import Joined, close_pairs, disk_patch, sound_piece
from iccm.meshes.flatten import overlap
from iccm.meshes.mesh import Mesh, check, triangulate

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
TWO = SQUARE + "f 1 2 3\nf 1 3 4\n"
BINARY_OFF = (
    b"OFF BINARY\n" + struct.pack(">3i12f", 4, 2, 5, *(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0))
    + struct.pack(">5i", 3, 0, 1, 2, 0) + struct.pack(">5i4f", 3, 0, 2, 3, 4, 1, 0, 0, 1)
)  # fmt: skip

LITTLE_OFF = b"OFF BINARY\n" + struct.pack(
    "<3i12f8i", 4, 2, 0, *(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0), *(3, 0, 1, 2, 3, 0, 2, 3)
)


def moebius(n=12):
    t = 2 * np.pi * np.arange(n) / n
    points = []
    for s in (-0.3, 0.3):
        r = 1 + s * np.cos(t / 2)
        points.append(np.column_stack([r * np.cos(t), r * np.sin(t), s * np.sin(t / 2)]))
    lines = ["v {} {} {}".format(*p) for p in np.concatenate(points)]
    for k in range(n):
        a, b = k + 1, (k + 1) % n + 1
        c, d = a + n, b + n
        if k == n - 1:
            b, d = d, b
        lines += [f"f {a} {b} {d}", f"f {a} {d} {c}"]
    return "\n".join(lines)


def grid_text(n):
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    k = np.arange(n * n).reshape(n, n) + 1
    faces = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    v = ("v %.6f %.6f 0.125\n" * (n * n)) % tuple(np.column_stack([x.ravel(), y.ravel()]).ravel().tolist())
    return v + ("f %d %d %d %d\n" * len(faces)) % tuple(faces.ravel().tolist())


BAD = {
    "out of range": (SQUARE + "f 1 2 3\nf 1 3 5\n", "face 2 (line 6): uses vertex 5, but the file has 4"),
    "far out of range": (SQUARE + "f 1 2 99999999999\n", "face 1 (line 5): uses vertex 99999999999"),
    "before the first": (SQUARE + "f 1 2 -5\n", "face 1 (line 5): uses a vertex before the first one"),
    "not a number": (TWO.replace("v 1 1 0", "v 1 nan 0"), "vertex 3: is not finite"),
    "infinite": (TWO.replace("v 1 1 0", "v 1 -inf 0"), "vertex 3: is not finite"),
    "far off": (TWO.replace("v 1 1 0", "v 1 1e61 0"), "vertex 3: is not finite"),
    "no area at all": ("v 1 1 1\n" * 3 + "f 1 2 3\n", "no face has an area"),
    "no vertex thrice": (SQUARE + "f 1 2 2\nf 3 3 4\n", "no face has an area"),
    "one-sided": (moebius(), "the surface is one-sided"),
    "empty file": (" \n", "no vertices"),
    "point cloud": (SQUARE, "4 vertices but no faces; a point cloud"),
    "faces alone": ("f 1 2 3\nf 1 3 4\nf 2 3 4\n", "no vertices"),
    "two corners": (SQUARE + "f 1 2\nf 1 2 3\n", "line 5: a face needs at least 3 corners"),
    "uv out of range": (
        SQUARE + "vt 0 0\nf 1/1 2/1 3/2\nf 1 3 4\n",
        "face 1 (line 6): uses a texture coordinate",
    ),
    "no such part": (TWO, "there is no part 'hat' with faces; the file has no named part"),
    "cut in the middle": (grid_text(80)[: len(grid_text(80)) // 2], "no faces"),
    "cut in the faces": (grid_text(80)[:-11], "line 12641: a face needs at least 3 corners"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_mesh_is_one_line_that_names_the_place(case, tmp_path):
    text, message = BAD[case]
    path = tmp_path / "m.obj"
    path.write_text(text)
    spec = f"{path}#hat" if case == "no such part" else str(path)
    with pytest.raises(InputError) as error:
        mesh_reading.read(spec)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def bow_tie():
    """Two fans around vertex 0, joined far away by a ring: one piece that touches itself at a point."""
    ring = np.exp(2j * np.pi * np.arange(8) / 8)
    inner, outer = ring, 2 * ring
    points = np.concatenate([[0], inner, outer])
    faces = [[1 + k, 9 + k, 9 + (k + 1) % 8] for k in range(8)]
    faces += [[1 + k, 9 + (k + 1) % 8, 1 + (k + 1) % 8] for k in range(8)]
    faces += [[0, 1, 2], [0, 5, 6]]
    return Mesh.triangles("tie", np.column_stack([points.real, points.imag, 0 * points.real]), faces)


def test_a_vertex_where_the_surface_touches_itself_is_split():
    patch = disk_patch(bow_tie())
    assert patch.notes == ("split at 1 vertex where the surface touches itself",)
    assert (patch.vertex == 0).sum() == 2
    assert len(patch.loops) == 2  # the inside and the outside of the bow tie have a common boundary now


def sheet(n, height):
    """2 n² triangles over the unit square, and the vertices of the grid (n + 1, n + 1)."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    faces = np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    return np.column_stack([x.ravel(), y.ravel(), height(x, y).ravel()]), faces, k


def with_wall(points, faces, seam, top):
    """A strip from vertices of a mesh up to other points, one for each of them."""
    upper = len(points) + np.arange(len(seam))
    strip = np.concatenate(
        [np.stack([seam[:-1], seam[1:], upper[1:]], -1), np.stack([seam[:-1], upper[1:], upper[:-1]], -1)]
    )
    return np.concatenate([points, top]), np.concatenate([faces, strip])


def test_a_surface_with_a_fin_stays_whole():
    """It is bent at the fin, so that its halves continue into each other less smoothly than into the fin."""
    points, faces, k = sheet(8, lambda x, y: 0.4 * np.abs(x - 0.5))
    seam = k[4]
    joined = Joined.of(Mesh.triangles("fin", *with_wall(points, faces, seam, points[seam] + [0, 0, 0.3])))
    assert joined.sizes == [len(faces), 16]
    patch = disk_patch(joined)
    assert "cut along 8 edges with more than two faces" in patch.notes
    assert len(patch.loops) == 1 and patch.genus == 0 and len(patch.faces) == len(faces)
    fin = disk_patch(joined, piece=2)
    assert len(fin.faces) == 16 and set(fin.vertex[: len(fin.points)]) >= set(seam)


def ball(n=8):
    """A sphere of quadrilaterals, cut in two, and its poles; vertices lie on the equator."""
    t, p = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * n, False), np.linspace(-1, 1, n + 1)[1:-1] * np.pi / 2)
    points = np.stack([np.cos(p) * np.cos(t), np.cos(p) * np.sin(t), np.sin(p)], -1).reshape(-1, 3)
    k = np.arange(len(points)).reshape(t.shape)
    a, b, c, d = k[:-1], np.roll(k[:-1], -1, 1), np.roll(k[1:], -1, 1), k[1:]
    low, high = (np.full(2 * n, len(points) + side) for side in (0, 1))
    faces = [(a, b, c), (a, c, d), (np.roll(k[0], -1), k[0], low), (k[-1], np.roll(k[-1], -1), high)]
    faces = np.concatenate([np.stack(face, -1).reshape(-1, 3) for face in faces])
    return np.concatenate([points, [[0, 0, -1], [0, 0, 1]]]), faces


def test_pieces_that_cannot_be_flattened_together_stay_apart():
    """A ball with a wall inside: its halves can be flattened separately, but together they are closed."""
    points, faces = ball()
    edge = np.flatnonzero(np.abs(points[:, 2]) < 1e-9)
    edge = edge[np.argsort(np.arctan2(points[edge, 1], points[edge, 0]))]
    middle = len(points)
    wall = np.stack([edge, np.roll(edge, -1), np.full(edge.size, middle)], -1)
    mesh = Mesh.triangles("ball", np.concatenate([points, [[0, 0, 0]]]), np.concatenate([faces, wall]))
    joined = Joined.of(mesh)
    assert sorted(joined.sizes) == sorted([len(faces) // 2, len(faces) // 2, len(wall)])
    for piece in (1, 2, 3):
        assert len(disk_patch(joined, piece=piece).loops) == 1
    alone = Joined.of(Mesh.triangles("ball", points, faces))
    assert alone.sizes == [len(faces)] and not alone.notes


@pytest.mark.slow
def test_boxes_that_share_an_edge_are_separate_pieces():
    import trimesh

    box = trimesh.creation.box()
    boxes = trimesh.util.concatenate([box, box.copy().apply_translation([1, 1, 0])])
    boxes.merge_vertices()
    assert len(boxes.vertices) == 14
    joined = Joined.of(Mesh.triangles("boxes", boxes.vertices, boxes.faces))
    assert joined.sizes == [12, 12] and joined.notes == ("cut along 1 edge with more than two faces",)
    for piece in (1, 2):
        with pytest.raises(InputError, match="is closed"):
            disk_patch(joined, piece=piece)
        assert len(disk_patch(joined, piece=piece, cut=True).loops) == 1


FLAWED = {  # the message, and how many triangles are flattened
    "repeated index": (SQUARE + "f 1 2 3\nf 1 3 3\n", None, 1),
    "a quad that is a triangle": (SQUARE + "f 1 2 3 3\nf 1 3 4\n", None, 2),
    "no area": (SQUARE.replace("1 1 0", "2 0 0") + "f 1 2 4\nf 2 3 4\nf 1 3 2\n", None, 3),
    "all on one place": (SQUARE + "v 1 1 0\nv 1 1 0\nf 1 2 3\nf 1 3 4\nf 3 5 6\n", None, 2),
    "three faces on an edge": (
        TWO + "v 2 2 2\nf 1 3 5\n",
        "ignored 1 other piece of 2 triangles that are not connected to it; #piece-2 selects another",
        1,
    ),
    "two pieces": (
        TWO + "v 5 0 0\nv 6 0 0\nv 5 1 0\nf 5 6 7\n",
        "ignored 1 other piece of 1 triangles that are not connected to it; #piece-2 selects another",
        2,
    ),
}


@pytest.mark.parametrize("case", FLAWED)
def test_common_flaws_are_repaired_with_a_note(case, tmp_path):
    text, note, triangles = FLAWED[case]
    path = tmp_path / "m.obj"
    path.write_text(text)
    shape = mesh_reading.read(str(path))
    assert len(shape.flattening.patch.faces) == triangles
    assert overlap(shape.flattening) is None
    assert note is None or note in shape.notes


def test_a_piece_is_selected_by_its_number_and_the_others_are_unchanged(tmp_path):
    path = tmp_path / "m.obj"
    text = TWO.replace("f 1 2 3\nf 1 3 4\n", "") + "vt .1 .1\nvt .2 .1\nvt .1 .2\nv 5 0 0\nv 6 0 0\nv 5 1 0\n"
    path.write_text(text + "f 1 2 3\nf 1 3 4\nf 5/1 6/2 7/3\n")
    small, large = (mesh_reading.read(f"{path}#piece-{k}") for k in (2, 1))
    assert (len(small.flattening.patch.faces), len(large.flattening.patch.faces)) == (1, 2)
    with pytest.raises(InputError, match=r"m\.obj: .*no piece 3.*\b2$"):
        mesh_reading.read(f"{path}#piece-3")
    flat_files.write_uvs(large, tmp_path / "o.obj", tmp_path / "o.obj")
    content = obj.read(tmp_path / "o.obj")
    assert content.vt[content.corners[-3:, 1]].tolist() == [[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]]
    assert (content.corners[:, 1] >= 0).all()


def test_reversed_faces_are_flipped_with_a_note():
    mesh = Mesh.triangles(
        "m", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 3, 2], [1, 4, 2]]
    )
    piece = disk_patch(mesh)
    assert piece.notes == ("flipped 1 triangles to the orientation of the rest",)
    normal = np.cross(*(piece.points[piece.faces[:, k]] - piece.points[piece.faces[:, 0]] for k in (1, 2)))
    assert (normal[:, 2] > 0).all()
    assert (mesh.corners[piece.corner] == piece.vertex[piece.faces]).all()


def test_unused_vertices_are_omitted_with_a_note():
    mesh = Mesh.triangles("m", [[9, 9, 9], [0, 0, 0], [np.e, 0, 0], [0, 1, 0]], [[1, 2, 3]])
    piece = disk_patch(mesh)
    assert piece.vertex.tolist() == [1, 2, 3]
    assert "1 vertices that belong to no face" in piece.notes[0]


def test_a_soup_of_triangles_is_joined_where_vertices_coincide():
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    piece = disk_patch(Mesh.triangles("soup", corners, [[0, 1, 2], [3, 4, 5]]))
    assert piece.triangles.count == 4
    assert "2 vertices that coincide" in piece.notes[0]


def test_a_seam_of_coinciding_vertices_stays_open_in_one_piece():
    t = np.linspace(0, 2 * np.pi, 13)  # the first and the last column coincide
    ring = np.column_stack([np.cos(t), 0 * t, np.sin(t)])
    k = np.arange(12)
    faces = np.column_stack([k, k + 13, k + 1, k + 1, k + 13, k + 14]).reshape(-1, 3)
    piece = disk_patch(Mesh.triangles("tube", np.vstack([ring, ring + np.array([0, 1, 0])]), faces))
    assert len(piece.loops) == 1
    assert piece.notes == ()


def test_one_side_of_a_double_sided_surface_is_used():
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    piece = disk_patch(Mesh.triangles("sheet", corners, [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]]))
    assert piece.areas.sum() == pytest.approx(1)
    assert piece.notes == ("ignored 2 triangles with the corners of another",)


def test_the_surface_of_cells_is_used():
    k = np.arange(18).reshape(2, 3, 3)  # 1 x 2 x 2 cubes, each written with all of its faces
    steps = np.array(
        [[0, 1, 4, 3], [9, 12, 13, 10], [0, 9, 10, 1], [3, 4, 13, 12], [0, 3, 12, 9], [1, 10, 13, 4]]
    )
    quads = (k[0, :2, :2].ravel()[:, None, None] + steps).reshape(-1)
    points = np.stack(np.meshgrid(range(2), range(3), range(3), indexing="ij"), axis=-1).reshape(-1, 3)
    piece = sound_piece(Mesh("cells", points.astype(float), quads, 4 * np.arange(25)))
    assert piece.notes[0] == "ignored 16 triangles between cells"
    assert piece.areas.sum() == pytest.approx(2 * (4 + 2 + 2))
    assert not piece.loops and piece.genus == 0


def globe(rows, columns):
    """Quads; each pole is a row of vertices, and the date line consists of two columns."""
    v, u = (
        np.pi * np.arange(rows + 1)[:, None] / rows,
        2 * np.pi * (np.arange(columns + 1) % columns) / columns,
    )
    high, wide = np.broadcast_to(np.cos(v), (rows + 1, columns + 1)), np.sin(v)
    wide[[0, -1]] = 0
    points = np.stack([wide * np.cos(u), wide * np.sin(u), high], axis=2).reshape(-1, 3)
    k = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=2).ravel()
    return points, quads.reshape(-1, 4)


def test_a_pole_that_is_a_row_of_vertices_is_one_vertex():
    rows, columns = 6, 12
    points, quads = globe(rows, columns)
    piece = disk_patch(Mesh("globe", points, quads.ravel(), 4 * np.arange(rows * columns + 1)))
    assert len(piece.faces) == 2 * (rows - 1) * columns
    assert [len(loop) for loop in piece.loops] == [
        2 * rows
    ]  # down one side of the date line and up the other
    assert piece.notes == (f"collapsed {2 * columns} edges without length",)
    assert overlap(flatten(piece)) is None


def test_corners_at_a_pole_are_all_where_it_is(tmp_path):
    rows, columns = 6, 12
    points, quads = globe(rows, columns)
    lines = ["v {} {} {}".format(*point) for point in points] + [
        "f {} {} {} {}".format(*q) for q in quads + 1
    ]
    (tmp_path / "globe.obj").write_text("\n".join(lines))
    shape = mesh_reading.read(str(tmp_path / "globe.obj"))
    corners = shape.flattening.flat[shape.corners[0]].reshape(rows, columns, 4)
    north, south = corners[0][:, [0, 3]], corners[-1][:, [1, 2]]
    assert (north == north[0, 0]).all() and (south == south[0, 0]).all() and north[0, 0] != south[0, 0]


def polygon_mesh(z):
    points = np.column_stack([np.real(z), np.imag(z), 0 * np.real(z)])
    return Mesh("p", points, np.arange(len(z)), np.array([0, len(z)]))


@pytest.mark.parametrize(
    "z",
    [
        [0, 2, 2 + 2j, 0.2 + 1.8j],
        [0, 2, 0.5 + 0.5j, 2j],  # a dart: only one diagonal is inside
        [2, 0.5 + 0.5j, 2j, 0],
        np.exp(2j * np.pi * np.arange(7) / 7),
        [0, 4, 4 + 3j, 3 + 3j, 3 + 1j, 1 + 1j, 1 + 3j, 3j],  # a U
        [0, 1, 2, 3, 3 + 1j, 2 + 1j, 1 + 1j, 1j],  # straight corners
    ],
)
def test_polygons_become_triangles_inside_them(z):
    z = np.array(z, complex)
    corners = triangulate(check(polygon_mesh(z)))
    p = z[corners]
    area = 0.5 * ((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag
    assert len(corners) == len(z) - 2
    assert (area > 0).all()
    assert area.sum() == pytest.approx(0.5 * (z.conj() * np.roll(z, -1)).imag.sum())


def ply(path, faces="3 0 1 2\n3 0 2 3\n", vertices="0 0 0\n1 0 0\n1 1 0\n0 1 0\n"):
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {vertices.count(chr(10))}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {faces.count(chr(10))}\nproperty list uchar int vertex_indices\nend_header\n"
        f"{vertices}{faces}"
    )


def stl(path):
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], "<f4")
    body = b"".join(struct.pack("<3f", 0, 0, 1) + t.tobytes() + b"\0\0" for t in triangles)
    path.write_bytes(b" " * 80 + struct.pack("<I", 2) + body)


def test_other_formats_give_the_same_square(tmp_path):
    ply(tmp_path / "m.ply")
    stl(tmp_path / "m.stl")
    (tmp_path / "m.off").write_text("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    for name in ("m.ply", "m.stl", "m.off"):
        shape = mesh_reading.read(str(tmp_path / name))
        assert shape.curve.area == pytest.approx(1)
        assert shape.curve.z.size == 4


GARBAGE = {
    "m.ply": b"ply\nformat binary_little_endian 1.0\nelement ver",
    "m.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n",
}
GARBAGE |= {"m.glb": b"glTF\2\0\0\0\xff\0\0\0\x40\0\0\0JSON{", "m.stl": b"nothing", "m.gltf": b"{}"}


def test_binary_off_is_read_in_either_order_of_bytes(tmp_path):
    for name, content in (("big.off", BINARY_OFF), ("little.off", LITTLE_OFF)):
        (tmp_path / name).write_bytes(content)
        mesh = mesh_files.read(str(tmp_path / name)).mesh
        assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
        assert mesh.corners.tolist() == [0, 1, 2, 0, 2, 3]


SHORT = {
    "no points": BINARY_OFF[:25],
    "no faces": BINARY_OFF[:-40],
    "a colour too many": BINARY_OFF + bytes(4),
    "not binary": b"OFF BINARY\n\xff\xfe4 2 0\n",
    "an index out of range": BINARY_OFF[:75] + b"\0\0\0\x09" + BINARY_OFF[79:],
}


@pytest.mark.parametrize("case", SHORT)
def test_a_broken_binary_off_is_one_line(case, tmp_path, capfd):
    (tmp_path / "m.off").write_bytes(SHORT[case])
    with pytest.raises(InputError, match=r"m\.off") as error:
        mesh_reading.read(str(tmp_path / "m.off"))
    assert "No module" not in str(error.value) and "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


BROKEN = {
    "m.off": b"OFF\n3 1 0\n0 0 0\n1e999 nan 0\n0 1 0\n3 0 1 2\n",
    "header.stl": b"\xff" * 80 + struct.pack("<I12fH", 1, *([float("nan")] * 12), 0),
    "m.stl": b"solid \xff\nfacet normal 0 0 1\nouter loop\nvertex 1e39 0 0\nvertex nan 0 0\n",
    "empty.stl": b"solid a\nendsolid a\n",
}


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_libraries_print_nothing_about_broken_files(tmp_path):
    """In a separate process, in which nothing has silenced them."""
    for name, content in BROKEN.items():
        (tmp_path / name).write_bytes(content)
    program = (
        "import sys\nfrom iccm.io.shapes import mesh_reading\nfrom iccm.errors import InputError\n"
        "for name in sys.argv[1:]:\n"
        "    try: mesh_reading.read(name, cutting=mesh_reading.Cutting(closed=True))\n"
        "    except InputError as error: print(error)"
    )
    result = subprocess.run(
        [sys.executable, "-W", "default::RuntimeWarning", "-c", program, *map(str, tmp_path.iterdir())],
        capture_output=True,
        text=True,
    )
    lines = result.stdout.splitlines()
    assert not result.stderr and len(lines) == len(BROKEN)
    assert all(any(line.startswith(f"{tmp_path / name}:") for line in lines) for name in BROKEN)


@pytest.mark.parametrize("name", GARBAGE)
def test_garbage_in_other_formats_is_one_line(name, tmp_path):
    (tmp_path / name).write_bytes(GARBAGE[name])
    with pytest.raises(InputError) as error:
        mesh_reading.read(str(tmp_path / name))
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def test_a_ply_with_an_index_out_of_range_or_no_faces_is_refused(tmp_path):
    ply(tmp_path / "far.ply", faces="3 0 1 2\n3 0 2 9\n")
    with pytest.raises(InputError, match="face 1: uses vertex 9, but the file has 4"):
        mesh_reading.read(str(tmp_path / "far.ply"))
    ply(tmp_path / "cloud.ply", faces="")
    with pytest.raises(InputError, match="point cloud"):
        mesh_reading.read(str(tmp_path / "cloud.ply"))


def test_names_with_hashes_parts_and_loops(tmp_path):
    path = tmp_path / "a#b.obj"
    path.write_text("g top\n" + TWO + "g 7\nf 1 4 2\n")
    assert Spec.of(str(path)) == Spec(path)
    assert Spec.of(f"{path}#top#2") == Spec(path, "top", 2)
    top = mesh_files.read(f"{path}#top#2")
    assert (top.loop, top.mesh.sizes.size) == (2, 2)
    assert mesh_files.read(f"{path}#2").loop == 2
    assert (mesh_files.read(f"{path}#7").loop, mesh_files.read(f"{path}#7").mesh.sizes.size) == (1, 1)


def test_an_obj_without_faces_is_a_drawing_not_a_mesh(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(SQUARE + "l 1 2 3 4 1\n")
    assert not Inputs(Job(source=str(path))).is_mesh(str(path))
    path.write_text(TWO)
    assert Inputs(Job(source=str(path))).is_mesh(f"{path}#x")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "message"), [(0.3, "too few numbers"), (0.7, "a face needs at least 3 corners")]
)
def test_a_file_of_200_megabytes_cut_in_the_middle(share, message, tmp_path):
    text = grid_text(1800).encode()
    assert len(text) > 200_000_000
    path = tmp_path / "big.obj"
    path.write_bytes(text[: text.index(b"\n", int(share * len(text))) + 9])
    with pytest.raises(InputError) as error:
        mesh_reading.read(str(path))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def gear(count):
    """A polygon of many corners for which no fan is a valid triangulation."""
    t = 2 * np.pi * np.arange(count) / count
    z = (1 + 0.2 * np.sign(np.sin(40 * t + 0.01))) * np.exp(1j * t)
    return np.column_stack([z.real, z.imag, 0.1 * z.real])


@pytest.mark.parametrize("count", [1000, 20_000])
def test_a_polygon_of_many_corners_is_triangulated_at_once(count):
    points = gear(count)
    mesh = Mesh("gear", points, np.arange(count), np.array([0, count]))
    corners = triangulate(mesh)
    assert len(corners) == count - 2
    triangle = points[mesh.corners[corners]]
    across = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    whole = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    assert (across @ whole > 0).all() and np.allclose(across.sum(axis=0), whole)


def test_a_polygon_in_no_plane_is_divided_without_a_warning():
    """Corners that are visited forwards and backwards have no normal."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 1]])
    with np.errstate(all="raise"):
        corners = triangulate(Mesh("line", points, np.array([0, 1, 2, 0, 2, 1]), np.array([0, 6])))
    assert corners.tolist() == [[0, 1, 2], [0, 4, 5]]


def test_a_polygon_of_many_corners_that_crosses_itself_is_refused():
    points = gear(1000)
    points[[3, 700]] = points[[700, 3]]
    with pytest.raises(InputError, match="face 0: has 1000 corners and crosses or touches itself"):
        triangulate(Mesh("gear", points, np.arange(1000), np.array([0, 1000])))


ODD = {
    "binary": ("a.off", BINARY_OFF),
    "a comment in another encoding": (
        "a.off",
        b"OFF # K\xf6rper\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3",
    ),
    "lines end with a return": ("a.obj", TWO.replace("\n", "\r")),
    "numbers on any line": ("a.off", "OFF 4 2 0 0 0 0 1 0 0\n1 1 0 0 1 0 # four\n3 0 1 2 3\n0 2 3"),
    "a polygon, numbers on any line": ("a.off", "OFF\n4 1\n0 0 0 0 1 0 0 1 1\n0 0 1 0 4 0 1 2 3"),
    "triangle strips": (
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n",
    ),
}


@pytest.mark.parametrize("case", ODD)
def test_an_odd_form_of_a_format_is_read(case, tmp_path):
    name, text = ODD[case]
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    shape = mesh_reading.read(str(tmp_path / name))
    assert shape.curve.area == pytest.approx(1)
    assert len(shape.flattening.patch.faces) == 2
    assert not [note for note in shape.notes if "turned" in note]


@pytest.mark.parametrize("joined", [True, False])
def test_two_quads_take_no_diagonal_twice(joined):
    """Two quads around a vertex that only they have: the shorter diagonals of both are the same edge."""
    points = np.array([[0, 0, 0.5], [0, -1, 0], [0, 1, 0], [3, 0, 0], [-3, 0, 0]])
    corners = np.array([0, 1, 3, 2, 4, 1, 0, 2])
    mesh = Mesh("ridge", points, corners, np.array([0, 4, 8]))
    if not joined:  # each quad has its own vertices, which coincide
        mesh = Mesh("ridge", points[corners], np.arange(8), np.array([0, 4, 8]))
    faces = corners[triangulate(mesh)]
    sides = np.sort(np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    assert len(faces) == 4 and np.unique(sides, axis=0, return_counts=True)[1].max() == 2


def test_flipped_faces_do_not_tear_a_surface_with_a_fin():
    """Edges with three faces are mended before faces are oriented."""
    ball = trimesh.creation.icosphere(2)
    faces = np.array(ball.faces)
    faces[::3] = faces[::3, ::-1]
    points = np.append(ball.vertices, [2 * ball.vertices[faces[5, 0]]], axis=0)
    fin = [*faces[5, :2], len(points) - 1]
    joined = Joined.of(Mesh.triangles("fin", points, np.append(faces, [fin], axis=0)))
    assert joined.sizes == [320, 1]
    assert sound_piece(joined).loops == []


@pytest.mark.parametrize("reach", [1e-6, 0.03, 0.2])
def test_close_pairs_are_those_of_all_pairs(reach):
    """Also where many points have the same place along a direction, so that a tree is needed."""
    draw = np.random.default_rng(7)
    points = draw.random((150, 3))
    points = np.concatenate([points, points[:40] + 3e-7 * draw.normal(size=(40, 3))])
    a, b = np.triu_indices(len(points), 1)
    near = np.linalg.norm(points[a] - points[b], axis=1) <= reach
    assert {*map(frozenset, close_pairs(points, reach).tolist())} == {*map(frozenset, zip(a[near], b[near]))}
