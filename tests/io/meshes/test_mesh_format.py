"""A custom format: a class and a row in the table are enough for all commands."""

import json
import sys
from types import ModuleType

import numpy as np
import pytest

from iccm.io import files, formats
from iccm.io.formats import Format
from iccm.io.meshes import mesh_files
from iccm.io.meshes.mesh_format import MeshContent, MeshFile, MeshFormat, Written
from iccm.meshes.mesh import Mesh

MOST_BYTES = 1 << 20


class JsonMesh(MeshFormat):
    """An invented format with points, faces, and coordinates of their corners."""

    def count_faces(self, most):
        return len(files.read_json(self.path, max_bytes=MOST_BYTES)["faces"])

    def read(self):
        tree = files.read_json(self.path, max_bytes=MOST_BYTES)
        starts = np.cumsum([0, *map(len, tree["faces"])])
        uv = np.array(tree["uv"], float) if "uv" in tree else None
        uv_corners = np.concatenate(tree["uv_faces"]) if "uv" in tree else None
        points = np.array(tree["points"], float)
        mesh = Mesh(str(self.path), points, np.concatenate(tree["faces"]), starts, uv, uv_corners)
        return {self.path.name: MeshFile.whole(self.path, MeshContent(mesh))}

    @classmethod
    def write(cls, file, new, shown, out, name, *, force):
        inner = file.mesh.starts[1:-1]
        tree = {
            "points": file.mesh.points.tolist(),
            "faces": [part.tolist() for part in np.split(file.mesh.corners, inner)],
            "uv": new.uv.tolist(),
            "uv_faces": [part.tolist() for part in np.split(new.corners, inner)],
        }
        out.write_text(json.dumps(tree), encoding="utf-8")
        return Written(notes=[f"{name}: shows no picture"] if shown.texture else [])

    @classmethod
    def split_uv(cls, path):
        tree = files.read_json(path, max_bytes=MOST_BYTES)
        return np.array(tree.pop("uv"), float), tree


@pytest.fixture
def folder(shapes, monkeypatch):
    """A folder with a sheet of quads, longer than wide, in a format that has just been registered."""
    module = ModuleType("iccm.io.meshes.json_mesh")
    module.JsonMesh = JsonMesh
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(formats.FORMATS, ".mjson", Format(mesh="json_mesh.JsonMesh", uv=True))
    across, along = 3, 5
    points = [[i, j, 0.2 * i * i - 0.1 * j] for i in range(across + 1) for j in range(along + 1)]
    row = along + 1
    faces = [
        [i * row + j, (i + 1) * row + j, (i + 1) * row + j + 1, i * row + j + 1]
        for i in range(across)
        for j in range(along)
    ]
    uv = [[x / 4, y / 7] for x, y, _ in points]
    tree = {"points": points, "faces": faces, "uv": uv, "uv_faces": faces}
    (shapes / "a.mjson").write_text(json.dumps(tree), encoding="utf-8")
    return shapes


def at_corners(name):
    """Positions (c, 3) and coordinates (c, 2) of the corners of a mesh."""
    mesh = mesh_files.read(name).mesh
    return mesh.points[mesh.corners], mesh.uv[mesh.uv_corners]


def test_a_mesh_is_read_mapped_and_written(folder, iccm):
    assert "faces: 15" in iccm("info", "a.mjson").out
    outputs = ("-o", "o.mjson", "-o", "o.obj", "--subdivide-rim")
    assert iccm("map", "square.svg", "a.mjson", *outputs).code == 0
    (points, uv), (same_points, same_uv) = at_corners("o.mjson"), at_corners("o.obj")
    assert len(points) > 60  # corners of 15 quads, and of the triangles at the boundary
    assert np.allclose(points, same_points, atol=1e-8) and np.allclose(uv, same_uv, atol=1e-8)
    assert iccm("flatten", "a.mjson", "--uv", "f.mjson").code == 0
    refused = iccm("map", "square.svg", "a.mjson", "--max-faces", "9")
    assert refused.code == 2 and "15 faces" in refused.err


def test_data_that_a_format_cannot_hold_are_refused_in_one_line(folder, iccm):
    given = {"--carry-maps": "materials", "--normal": "normal"}
    for option, why in given.items():
        words = ("map", "square.svg", "a.mjson", "-o", "o.mjson", option)
        result = iccm(*words, *(["a.mjson"] if option == "--normal" else []))
        assert result.code == 2 and why in result.err and len(result.lines) == 1


def test_triangles_in_the_place_of_polygons_keep_their_coordinates(folder):
    """A quad whose diagonal is split at its midpoint; coordinates are linear in the positions, before and after."""
    from iccm.surfaces.subdivided import Subdivision

    content = mesh_files.read("a.mjson").content
    a, b, c = np.eye(3)  # corners of a triangle, and the midpoint of the diagonal of each
    first, second = (a + c) / 2, (a + b) / 2
    weights = np.array([[a, b, first], [first, b, c], [a, second, c], [second, b, c]])
    corners = np.array([[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 2, 3]])
    polygons = content.subdivide(Subdivision(np.zeros(4, np.int64), corners, weights)).polygons
    assert polygons.sizes.tolist() == [3] * 4 + [4] * 14
    x, y, _ = polygons.points[polygons.corners].T
    assert np.allclose(polygons.uv[polygons.uv_corners], np.column_stack([x / 4, y / 7]))
