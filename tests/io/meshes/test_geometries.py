"""GLB files with several geometries, with --parts all."""

import io
import json

import numpy as np
import pygltflib as gl
import pytest
from PIL import Image

from iccm.io.meshes import mesh_files
from iccm.io.pictures import image_files
from tests import rich_glb
from tests.cli.test_charts import ramp
from tests.io.meshes.test_gltf import corners

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">{}</svg>'
SQUARES = '<path id="{}" d="M10 10h80v80h-80z"/><path id="{}" d="M110 10h80v80h-80z"/>'
PLACES = {
    "left": (0.05, 0.1, 0.4),
    "right": (0.55, 0.2, 0.3),
}  # of each chart: its lower corner, v up, and its size


@pytest.fixture
def pair(shapes):
    """pair.glb: two square sheets, with a geometry, a material and a chart each; pair.svg: two squares with their
    names.
    """
    make = rich_glb.Builder()
    y, x = np.mgrid[0:5, 0:5] / 4
    k = np.arange(25).reshape(5, 5)
    a, b, c, d = k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    indices = make.accessor(faces.astype(np.uint16).reshape(-1, 1), "SCALAR")
    for number, (name, (u, v, size)) in enumerate(PLACES.items()):
        points = np.column_stack([x.ravel() + 1.5 * number, y.ravel(), 0 * x.ravel()])
        uv = np.column_stack([u + size * x.ravel(), 1 - v - size * y.ravel()])
        attributes = gl.Attributes(
            POSITION=make.accessor(points.astype(np.float32), "VEC3"),
            TEXCOORD_0=make.accessor(uv.astype(np.float32), "VEC2"),
        )
        texture = make.texture(rich_glb.png((200 * number, 50, 50)))
        look = gl.PbrMetallicRoughness(baseColorTexture=gl.TextureInfo(index=texture))
        make.file.materials.append(gl.Material(name=f"paint of {name}", pbrMetallicRoughness=look))
        primitive = gl.Primitive(attributes=attributes, indices=indices, material=number)
        make.file.meshes.append(gl.Mesh(name=name, primitives=[primitive]))
        make.file.nodes.append(gl.Node(name=name, mesh=number))
    make.file.scenes, make.file.scene = [gl.Scene(nodes=[0, 1])], 0
    (shapes / "pair.glb").write_bytes(make.bytes())
    (shapes / "pair.svg").write_text(SVG.format(SQUARES.format("right", "left")))
    image_files.write("ramp.png", ramp())
    return shapes


@pytest.mark.slow
def test_every_geometry_gets_its_partner_and_new_coordinates(pair, iccm):
    words = ["--parts", "all", "--texture", "ramp.png", "--texture-box", "viewbox"]
    result = iccm("map", "pair.svg", "pair.glb", *words, "-o", "out.glb", "--report", "r.json")
    assert result.code == 0, result.err
    parts = json.loads((pair / "r.json").read_text())["parts"]
    assert {part["target"] for part in parts} == {"left#piece-1", "right#piece-1"}
    old, new = rich_glb.read("pair.glb"), rich_glb.read("out.glb")
    for number, (name, low) in enumerate({"left": 110, "right": 10}.items()):
        primitive = new.meshes[number].primitives[0]
        assert new.meshes[number].name == name
        attributes = corners(new, primitive)
        assert (attributes["POSITION"] == corners(old, old.meshes[number].primitives[0])["POSITION"]).all()
        square = np.column_stack(
            [
                (low + 80 * (attributes["POSITION"][:, 0] - 1.5 * number)) / 200,
                0.9 - 0.8 * attributes["POSITION"][:, 1],
            ]
        )
        assert attributes["TEXCOORD_0"] == pytest.approx(square, abs=2e-3)
        look = new.materials[primitive.material]
        picture = rich_glb.picture(new, look.pbrMetallicRoughness.baseColorTexture.index)
        assert look.name == f"paint of {name}" and picture == (pair / "ramp.png").read_bytes()


@pytest.mark.parametrize("words", [["--bake"], ["--plane", "uv"]])
def test_the_layout_of_all_geometries_is_filled(pair, iccm, words):
    arguments = ["--texture", "ramp.png", "--size", "200", "--padding", "0"]
    result = iccm("map", "pair.svg", "pair.glb", "--parts", "all", *words, *arguments, "-o", "o.png")
    assert result.code == 0, result.err
    pixels = image_files.read("o.png").pixels.astype(int)
    for (u, v, size), low in zip(PLACES.values(), (110, 10)):
        for a, b in ((0.2, 0.3), (0.5, 0.5), (0.8, 0.6)):
            row, column = int((1 - v - size * b) * 200), int((u + size * a) * 200)
            expected = 255 * (low + 80 * a) / 200, 255 * (0.1 + 0.8 * b)
            assert pixels[row, column, :2] == pytest.approx(expected, abs=8)


def test_maps_of_every_material_are_carried(pair, iccm):
    result = iccm(
        "map", "pair.svg", "pair.glb", "--parts", "all", "--carry-maps", "-o", "out.glb", "--stmap", "m.exr"
    )
    assert result.code == 0, result.err
    new = rich_glb.read("out.glb")
    for number in (0, 1):
        primitive = new.meshes[number].primitives[0]
        centre = corners(new, primitive)["TEXCOORD_0"].mean(axis=0)
        info = new.materials[primitive.material].pbrMetallicRoughness.baseColorTexture
        pixels = np.asarray(Image.open(io.BytesIO(rich_glb.picture(new, info.index))))
        assert pixels[tuple((centre[::-1] * pixels.shape[:2]).astype(int))].tolist() == [200 * number, 50, 50]


@pytest.mark.slow
def test_a_note_reports_that_one_texture_of_several_is_used(pair, iccm):
    result = iccm("map", "pair.glb", "pair.svg", "--parts", "all", "-o", "o.png")
    assert result.code == 0 and "replaces all of its 2 textures" in result.err, result.err
    named = iccm("map", "pair.glb#left", "pair.svg#left", "-o", "l.png")
    assert named.code == 0 and "2 textures" not in named.err


def test_all_geometries_are_mapped_without_overlap(pair, iccm):
    result = iccm("map", "square.svg", "pair.glb", "-o", "out.glb", "--report", "r.json")
    assert result.code == 0, result.err
    assert json.loads((pair / "r.json").read_text())["mapped"] == 1
    new = rich_glb.read("out.glb")
    boxes = [corners(new, new.meshes[k].primitives[0])["TEXCOORD_0"].reshape(-1, 2) for k in (0, 1)]
    low, high = (np.array([f(box, axis=0) for box in boxes]) for f in (np.min, np.max))
    assert (low >= 0).all() and (high <= 1).all()
    assert (low[0] > high[1]).any() or (low[1] > high[0]).any()
    sizes = high - low  # both sheets have the same size
    assert sizes[0].prod() == pytest.approx(sizes[1].prod(), rel=0.01)


def test_the_largest_geometry_is_used_and_its_share_of_the_file_reported(pair, iccm):
    file = gl.GLTF2().load("pair.glb")
    file.nodes[1].scale = [2, 2, 2]
    file.save("uneven.glb")
    result = iccm(
        "map", "square.svg", "uneven.glb", "--parts", "largest", "-o", "out.glb", "--report", "r.json"
    )
    assert result.code == 0, result.err
    old, new = rich_glb.read("uneven.glb"), rich_glb.read("out.glb")
    unchanged = [
        np.array_equal(*(corners(file, file.meshes[k].primitives[0])["TEXCOORD_0"] for file in (old, new)))
        for k in (0, 1)
    ]
    assert unchanged == [True, False]
    assert json.loads((pair / "r.json").read_text())["mapped"] == 0.5
    assert "'right' is the largest" in result.err
    assert "32 of 64 faces are mapped (50%)" in result.err


def test_vertices_of_a_skin_are_where_its_joints_put_them(tmp_path):
    """The position of the node that shows them is ignored."""
    path = tmp_path / "posed.glb"
    path.write_bytes(rich_glb.rich(*rich_glb.sheet()))
    file = gl.GLTF2().load(str(path))
    file.nodes[3].rotation = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # a rotation by 90 degrees about z
    file.nodes[1].translation = [7, 7, 7]
    file.save(str(path))
    attributes = file.meshes[0].primitives[0].attributes
    points, share = (
        rich_glb.values(file, attributes.POSITION),
        rich_glb.values(file, attributes.WEIGHTS_0)[:, :1],
    )
    turned = np.column_stack([1 - points[:, 1], points[:, 0] + 1, points[:, 2]])  # about the hip at (0, 1, 0)
    expected = share * points + (1 - share) * turned
    mesh = mesh_files.read(f"{path}#body").mesh
    assert mesh.points == pytest.approx(expected, abs=1e-6)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1)


def test_the_share_of_mappable_parts_is_reported(shapes, iccm):
    """A closed box beside a square is omitted with --no-cut."""
    import trimesh

    sheet = trimesh.Trimesh([[3, 0, 0], [4, 0, 0], [4, 1, 0], [3, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    trimesh.Scene({"box": trimesh.creation.box(), "sheet": sheet}).export("both.glb")
    result = iccm(
        "map", "square.svg", "both.glb", "--parts", "each", "--no-cut", "-o", "o.glb", "--report", "r.json"
    )
    report = json.loads((shapes / "r.json").read_text())
    assert (result.code, report["status"]) == (1, "partial")
    assert "2 of 14 faces are mapped (14%)" in result.err
    assert "ignored: both.glb#box" in result.err
    assert report["mapped"] == pytest.approx(1 / 7)


def test_instances_are_matched_in_any_order_of_nodes(pair, iccm):
    """As written by Blender: in another order, with rounded positions."""
    places = {"far": [3, 0.25, 0], "near": [-2, 5, 1], "beside": [-2, 1, 1]}
    for name, order in {"one.glb": ("far", "near", "beside"), "other.glb": ("beside", "far", "near")}.items():
        file = gl.GLTF2().load("pair.glb")
        file.nodes = [gl.Node(name="left", mesh=1)]
        for node in order:
            rounded = [value + 1e-6 * (name == "other.glb") for value in places[node]]
            file.nodes.append(gl.Node(name=node, mesh=0, translation=rounded))
        file.scenes[0].nodes = list(range(4))
        file.save(name)
    result = iccm("relayout", "one.glb", "other.glb", "-o", "out.glb", "--report", "r.json")
    assert result.code == 0, result.err
    data = json.loads((pair / "r.json").read_text())
    assert data["same_triangles"] == data["triangles"] == 64
