"""GLB files keep all their contents, checked with pygltflib."""

import dataclasses
import io
import json
import sys

import DracoPy
import numpy as np
import pygltflib as gl
import pytest
from PIL import Image

from iccm.io.meshes import gltf, gltf_compressed, gltf_materials, gltf_write, mesh_files
from iccm.io.shapes import mesh_reading
from iccm.surfaces.subdivided import Mixtures
from tests import rich_glb

pytestmark = pytest.mark.usefixtures("solve_once")

SAME = ("asset", "scene", "scenes", "nodes", "skins", "animations", "samplers", "cameras", "extensionsUsed")


@pytest.fixture
def rich(shapes):
    """A folder with rich.glb, a sheet with all attributes that a vertex may have, and square.svg."""
    (shapes / "rich.glb").write_bytes(rich_glb.rich(*rich_glb.sheet()))
    return shapes


@pytest.fixture
def ball(shapes):
    """A folder with ball.glb, a closed mesh with the same contents."""
    import trimesh

    sphere = trimesh.creation.icosphere(1)
    points, faces = np.asarray(sphere.vertices), np.asarray(sphere.faces)
    (shapes / "ball.glb").write_bytes(rich_glb.rich(points, points, 0.5 + 0.4 * points[:, :2], faces))
    return shapes


def body(file):
    return file.meshes[0].primitives[0]


def corners(file, primitive):
    """All attributes of the corners by name."""
    vertex = rich_glb.values(file, primitive.indices).ravel().astype(int)
    numbers = {k: v for k, v in vars(primitive.attributes).items() if v is not None}
    numbers |= {
        f"target {k}": v for target in primitive.targets for k, v in dict(target).items() if v is not None
    }
    return {name: rich_glb.values(file, number)[vertex] for name, number in numbers.items()}


def whole(old, new):
    """Check that everything except the mesh is unchanged."""
    for key in SAME:
        assert getattr(old, key) == getattr(new, key), key
    assert old.meshes[0].extras == new.meshes[0].extras and old.meshes[0].weights == new.meshes[0].weights
    assert repr(old.meshes[1:]) == repr(new.meshes[1:])
    named = [accessor for skin in old.skins for accessor in [skin.inverseBindMatrices]]
    named += [number for a in old.animations for s in a.samplers for number in (s.input, s.output)]
    named += [old.meshes[1].primitives[0].indices, old.meshes[1].primitives[0].attributes.POSITION]
    for number in named:
        assert (rich_glb.values(old, number) == rich_glb.values(new, number)).all()
        a, b = (dataclasses.replace(f.accessors[number], bufferView=0, byteOffset=0) for f in (old, new))
        assert a == b


def test_a_flattening_changes_coordinates_alone(rich, iccm):
    result = iccm("flatten", "rich.glb#body", "--uv", "out.glb")
    assert result.code == 0, result.err
    old, new = rich_glb.read("rich.glb"), rich_glb.read("out.glb")
    whole(old, new)
    before, after = corners(old, body(old)), corners(new, body(new))
    assert set(after) == {*before, "TEXCOORD_1"}
    assert (after.pop("TEXCOORD_1") == before.pop("TEXCOORD_0")).all()
    flat = after.pop("TEXCOORD_0")
    for name, values in before.items():
        assert (values == after[name]).all(), name
    shape = mesh_reading.read("rich.glb#body")
    own_layout = shape.flattening.flat[shape.flattening.patch.faces].ravel()
    ratio = np.ptp(own_layout.real) / np.ptp(flat[:, 0]), np.ptp(own_layout.imag) / np.ptp(flat[:, 1])
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-5)
    # every texture is unchanged: it uses the old coordinates
    look, was = new.materials[0], old.materials[0]
    assert look.normalTexture.texCoord == look.pbrMetallicRoughness.baseColorTexture.texCoord == 1
    assert look.normalTexture.scale == 0.7 and look.name == was.name
    assert new.materials[1] == old.materials[1]
    for k in range(3):
        assert rich_glb.picture(new, k) == rich_glb.picture(old, k)
    (note,) = [line for line in result.lines if "old coordinates" in line]
    for word in ("out.glb", "baseColorTexture", "metallicRoughnessTexture", "normalTexture", "TEXCOORD_1"):
        assert word in note


def test_vertices_are_split_with_all_that_they_have(ball, iccm):
    result = iccm("flatten", "ball.glb#body", "--cut", "--uv", "out.glb")
    assert result.code == 0, result.err
    old, new = rich_glb.read("ball.glb"), rich_glb.read("out.glb")
    whole(old, new)
    before, after = corners(old, body(old)), corners(new, body(new))
    count = new.accessors[body(new).attributes.POSITION].count
    assert count > old.accessors[body(old).attributes.POSITION].count
    for number in [*vars(body(new).attributes).values(), body(new).targets[0]["POSITION"]]:
        assert number is None or new.accessors[number].count == count
    assert (after.pop("TEXCOORD_1") == before.pop("TEXCOORD_0")).all()
    after.pop("TEXCOORD_0")
    assert set(before) == set(after)
    for name, values in before.items():
        assert (values == after[name]).all(), name
    again = mesh_reading.read("out.glb#body", cutting=mesh_reading.Cutting(closed=True))
    assert again.has_uv


@pytest.mark.slow
def test_vertices_added_at_the_rim_have_interpolated_attributes(rich, iccm):
    path = '<path d="M0 0Q4 3 9 0Q6 4 9 9Q4 6 0 9Q3 4 0 0"/>'
    bent = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{path}</svg>'
    (rich / "bent.svg").write_text(bent)
    result = iccm("map", "bent.svg", "rich.glb#body", "-o", "out.glb", "--subdivide-rim")
    assert result.code == 0, result.err
    old, new = rich_glb.read("rich.glb"), rich_glb.read("out.glb")
    whole(old, new)
    before, after = corners(old, body(old)), corners(new, body(new))
    for attributes in (before, after):  # weights by joint, in any order
        joints, weights = attributes.pop("JOINTS_0").astype(int), attributes.pop("WEIGHTS_0")
        attributes["bound"] = np.stack([(weights * (joints == k)).sum(axis=1) for k in range(2)], axis=1)
        assert np.allclose(attributes["bound"].sum(axis=1), 1, atol=1e-6)
    assert len(after["POSITION"]) > len(before["POSITION"])
    mothers, flat = before["POSITION"].reshape(-1, 3, 3), after["POSITION"].reshape(-1, 3, 3)
    for k, triangle in enumerate(flat):
        fits = []
        for j, mother in enumerate(mothers):
            share = np.linalg.lstsq(
                np.vstack([mother.T, np.ones(3)]), np.vstack([triangle.T, np.ones(3)]), rcond=None
            )[0]
            fits.append((max(-share.min(), np.abs(mother.T @ share - triangle.T).max()), j, share))
        off, j, share = min(fits, key=lambda candidate: candidate[0])
        assert off < 1e-5
        for name in ("COLOR_0", "bound", "target POSITION", "NORMAL", "TANGENT"):
            expected = share.T @ before[name].reshape(-1, 3, before[name].shape[1])[j]
            if name in ("NORMAL", "TANGENT"):
                expected[:, :3] /= np.linalg.norm(expected[:, :3], axis=1, keepdims=True)
            assert np.abs(expected - after[name].reshape(-1, 3, expected.shape[1])[k]).max() < (
                0.51 if name == "COLOR_0" else 1e-4
            )


def test_a_texture_replaces_the_old_one(rich, iccm):
    Image.new("RGB", (8, 8), (10, 200, 30)).save("new.png")
    result = iccm("map", "square.svg", "rich.glb#body", "--texture", "new.png", "-o", "out.glb")
    assert result.code == 0, result.err
    old, new = rich_glb.read("rich.glb"), rich_glb.read("out.glb")
    whole(old, new)
    look = new.materials[body(new).material].pbrMetallicRoughness
    assert rich_glb.picture(new, look.baseColorTexture.index) == (rich / "new.png").read_bytes()
    assert new.textures[look.baseColorTexture.index].sampler == 0
    assert look.baseColorFactor == [1, 1, 1, 1.0] and "white" in result.err and "vertex colours" in result.err
    assert not look.baseColorTexture.texCoord and look.metallicRoughnessTexture.texCoord == 1
    assert rich_glb.picture(new, look.metallicRoughnessTexture.index) == rich_glb.picture(old, 2)
    assert rich_glb.picture(old, 0) not in (rich / "out.glb").read_bytes()
    (note,) = [line for line in result.lines if "old coordinates" in line]
    assert "baseColorTexture" not in note
    for word in ("out.glb", "metallicRoughnessTexture", "normalTexture", "TEXCOORD_1", "--carry-maps"):
        assert word in note


def test_a_material_that_others_show_too_is_copied(rich, iccm):
    file = rich_glb.read("rich.glb")
    file.meshes[1].primitives[0].material = 0
    file.save_binary("rich.glb")
    Image.new("RGB", (8, 8), (10, 200, 30)).save("new.png")
    assert iccm("map", "square.svg", "rich.glb#body", "--texture", "new.png", "-o", "out.glb").code == 0
    old, new = rich_glb.read("rich.glb"), rich_glb.read("out.glb")
    assert new.materials[:2] == old.materials
    assert body(new).material == 2 and new.meshes[1].primitives[0].material == 0
    assert rich_glb.picture(new, 0) == rich_glb.picture(old, 0)


def test_other_pieces_of_a_primitive_stay_a_primitive_of_their_own(shapes, iccm):
    points, normal, uv, faces = rich_glb.sheet()
    two = np.concatenate([points, 0.5 * points + 3])
    content = rich_glb.rich(
        two, np.tile(normal, (2, 1)), np.tile(uv, (2, 1)), np.concatenate([faces, faces + len(points)])
    )
    (shapes / "two.glb").write_bytes(content)
    result = iccm("flatten", "two.glb#body#piece-2", "--uv", "out.glb")
    assert result.code == 0, result.err
    old, new = rich_glb.read("two.glb"), rich_glb.read("out.glb")
    whole(old, new)
    large, small = new.meshes[0].primitives
    before = corners(old, body(old))
    for primitive, part in ((large, slice(0, faces.size)), (small, slice(faces.size, None))):
        after = corners(new, primitive)
        for name in set(before) - {"TEXCOORD_0"}:
            assert (after[name] == before[name][part]).all()
    assert (corners(new, large)["TEXCOORD_0"] == before["TEXCOORD_0"][: faces.size]).all()
    assert new.materials[large.material] == old.materials[0]


def test_gltf_with_separate_files_becomes_one_glb(rich, iccm):
    from pygltflib import BufferFormat, ImageFormat

    file = rich_glb.read("rich.glb")
    file.convert_images(ImageFormat.FILE)
    file.convert_buffers(BufferFormat.BINFILE)
    file.save_json("parted.gltf")
    assert len(list(rich.glob("*.png"))) == 3 and list(rich.glob("*.bin"))
    assert iccm("flatten", "parted.gltf#body", "--uv", "out.glb").code == 0
    old, new = rich_glb.read("rich.glb"), rich_glb.read("out.glb")
    assert {rich_glb.picture(new, k) for k in range(3)} == {rich_glb.picture(old, k) for k in range(3)}
    assert not [image.uri for image in new.images if image.uri]


def bumps(size=256):
    """A normal map, y up."""
    x, y = np.meshgrid(np.linspace(0, 9, size), np.linspace(0, 7, size))
    n = np.stack([0.5 * np.sin(x), 0.4 * np.cos(y), 1 + 0 * x], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    png = io.BytesIO()
    Image.fromarray((128 + 127 * n).round().astype(np.uint8)).save(png, "PNG")
    return png.getvalue()


def lit(file, weights):
    """Normals (m, 3) in space at points of the triangles, by the formulas in §3.7.2.1 and §3.9.3 of glTF."""
    primitive = body(file)
    attributes = {
        name: np.einsum("k,mkc->mc", weights, v.reshape(-1, 3, v.shape[1]))
        for name, v in corners(file, primitive).items()
    }
    info = file.materials[primitive.material].normalTexture
    uv = attributes[f"TEXCOORD_{info.texCoord or 0}"]
    pixels = np.asarray(Image.open(io.BytesIO(rich_glb.picture(file, info.index))).convert("RGB")).astype(
        float
    )
    place = np.clip((uv * pixels.shape[1::-1]).astype(int), 0, pixels.shape[0] - 1)
    n = (pixels[place[:, 1], place[:, 0]] - 128) / 127
    normal, tangent, hand = attributes["NORMAL"], attributes["TANGENT"][:, :3], attributes["TANGENT"][:, 3:]
    normals = n[:, :1] * tangent + n[:, 1:2] * hand * np.cross(normal, tangent) + n[:, 2:] * normal
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_carried_maps_look_the_same_in_space(rich, iccm):
    content = rich_glb.rich(*rich_glb.sheet(16), bump=bumps())
    (rich / "bumpy.glb").write_bytes(content)
    result = iccm("flatten", "bumpy.glb#body", "--uv", "out.glb", "--carry-maps")
    assert result.code == 0, result.err
    old, new = rich_glb.read("bumpy.glb"), rich_glb.read("out.glb")
    whole(old, new)
    assert "old coordinates" not in result.err and body(new).attributes.TEXCOORD_1 is None
    look = new.materials[0]
    assert not look.normalTexture.texCoord and look.normalTexture.scale == 0.7
    turned = np.abs(corners(new, body(new))["TANGENT"] - corners(old, body(old))["TANGENT"]).max()
    assert turned > 0.5  # the new layout is different
    for weights in ([0.6, 0.3, 0.1], [1 / 3, 1 / 3, 1 / 3]):
        cosine = np.einsum("mi,mi->m", lit(old, weights), lit(new, weights))
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        assert np.median(angle) < 1.5 and np.quantile(angle, 0.95) < 4
    assert rich_glb.picture(new, look.pbrMetallicRoughness.baseColorTexture.index) != rich_glb.picture(old, 0)


def test_maps_are_carried_beside_a_new_texture(rich, iccm):
    Image.new("RGB", (8, 8), (10, 200, 30)).save("new.png")
    words = ("map", "square.svg", "rich.glb#body", "--texture", "new.png", "-o")
    result = iccm(*words, "out.glb", "--carry-maps")
    assert result.code == 0, result.err
    new = rich_glb.read("out.glb")
    look = new.materials[0]
    assert (
        rich_glb.picture(new, look.pbrMetallicRoughness.baseColorTexture.index)
        == (rich / "new.png").read_bytes()
    )
    rough = rich_glb.picture(new, look.pbrMetallicRoughness.metallicRoughnessTexture.index)
    pixels = np.asarray(Image.open(io.BytesIO(rough)))
    assert (pixels[4:12, 4:12] == (0, 180, 20)).all()
    refused = iccm(*words, "out.obj", "--carry-maps")
    assert (
        refused.code == 2
        and "out.obj: cannot contain the materials of rich.glb (--carry-maps); use .glb" in refused.err
    )


def quantized(tmp_path, **options):
    """A file whose coordinates are normalised 16-bit integers, some of them in a sparse accessor."""
    make = rich_glb.Builder()
    points, _, uv, faces = rich_glb.sheet(2)
    import pygltflib as gl

    attributes = gl.Attributes(
        POSITION=make.accessor(points.astype(np.float32), "VEC3"),
        TEXCOORD_0=make.accessor((65535 * uv).round().astype(np.uint16), "VEC2", True),
    )
    indices = make.accessor(faces.astype(np.uint16).reshape(-1, 1), "SCALAR")
    rows = make.view(np.array([4], np.uint8).tobytes())
    moved = make.view(np.array([[0.5, 0.5, 9.0]], np.float32).tobytes())
    make.file.accessors[0].sparse = gl.Sparse(
        count=1,
        indices=gl.AccessorSparseIndices(bufferView=rows, componentType=5121),
        values=gl.AccessorSparseValues(bufferView=moved),
    )
    transform = {
        "KHR_texture_transform": {"offset": [0.25, 0.5], "scale": [0.5, 0.25], "rotation": np.pi / 2}
    }
    texture = make.texture(rich_glb.png((1, 2, 3)))
    info = gl.TextureInfo(index=texture, extensions=transform if options.get("transform") else {})
    make.file.materials.append(
        gl.Material(pbrMetallicRoughness=gl.PbrMetallicRoughness(baseColorTexture=info))
    )
    primitive = gl.Primitive(attributes=attributes, indices=indices, material=0)
    make.file.meshes.append(gl.Mesh(primitives=[primitive]))
    make.file.nodes.append(gl.Node(mesh=0, translation=[1, 2, 3]))
    make.file.scenes.append(gl.Scene(nodes=[0]))
    (tmp_path / "q.glb").write_bytes(make.bytes())
    return points, uv


def test_sparse_and_normalised_accessors_and_placed_textures(tmp_path):
    points, uv = quantized(tmp_path, transform=True)
    part = gltf.primitives(gltf.read(tmp_path / "q.glb"))["GLTF"]
    expected = points + np.array([1, 2, 3])
    expected[4] = [1.5, 2.5, 12]
    assert part.points == pytest.approx(expected, abs=1e-6)
    # by hand: shrunk, turned counter-clockwise as v points down, moved
    placed = part.triangles().uv
    u, v = 0.5 * uv[:, 0], 0.25 * uv[:, 1]
    assert placed[:, 0] == pytest.approx(v + 0.25, abs=1e-4)
    assert 1 - placed[:, 1] == pytest.approx(-u + 0.5, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"buffers": [{"uri": "../secret.bin", "byteLength": 4}]}, "which is outside its folder"),
        ({"buffers": [{"uri": "https://x.org/a.bin", "byteLength": 4}]}, "which is outside its folder"),
        ({"buffers": [{"uri": "gone.bin", "byteLength": 4}]}, "gone.bin: no such file"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 9}}]}]}, "cannot read this GLTF file"),
    ],
)
def test_unreadable_files_are_refused_in_one_line(shapes, iccm, change, message):
    tree = {"asset": {"version": "2.0"}, **change}
    (shapes / "a.gltf").write_text(json.dumps(tree))
    result = iccm("flatten", "a.gltf")
    assert result.code == 2 and len(result.lines) == 1 and message in result.err


def test_repeated_triangles_are_limited(rich, monkeypatch):
    """A few bytes of JSON draw the same triangles again."""
    from iccm import InputError
    from iccm.io import limits

    path = rich / "rich.glb"
    content = gl.GLTF2().load(str(path))
    content.meshes[0].primitives *= 5
    content.save(str(path))
    assert mesh_files.open_mesh(path).count_faces(-1) > 0
    monkeypatch.setattr(limits, "REPEATED_FACES", 3)
    with pytest.raises(InputError, match="repeat"):
        mesh_files.open_mesh(path).count_faces(-1)
    monkeypatch.setattr(limits, "PRIMITIVES", 4)
    with pytest.raises(InputError, match="primitives, more than 4"):
        mesh_files.open_mesh(path).count_faces(-1)


def squeezed(folder, *, damage=lambda data: data, number=1):
    """The same sheet uncompressed and compressed by Draco, as plain.glb and draco.glb; returns its points."""
    points, normal, uv, faces = rich_glb.sheet(4)
    make = rich_glb.Builder()
    import pygltflib as gl

    kinds = {"POSITION": (points, "VEC3"), "NORMAL": (normal, "VEC3"), "TEXCOORD_0": (uv, "VEC2")}
    accessors = {name: make.accessor(array.astype(np.float32), kind) for name, (array, kind) in kinds.items()}
    indices = make.accessor(faces.astype(np.uint16).reshape(-1, 1), "SCALAR")
    primitive = gl.Primitive(attributes=gl.Attributes(**accessors), indices=indices)
    make.file.meshes.append(gl.Mesh(name="sheet", primitives=[primitive]))
    make.file.nodes.append(gl.Node(mesh=0))
    make.file.scenes.append(gl.Scene(nodes=[0]))
    plain = make.bytes()
    (folder / "plain.glb").write_bytes(plain)
    data = DracoPy.encode(
        points.astype(np.float32), faces.astype(np.uint32), quantization_bits=16,
        generic_attributes={1: normal.astype(np.float32), 2: uv.astype(np.float32)},
    )  # fmt: skip
    position = next(a["unique_id"] for a in DracoPy.decode(data).attributes if a["attribute_type"] == 0)
    tree = json.loads(plain[20 : 20 + int.from_bytes(plain[12:16], "little")])
    numbers = {"POSITION": position, "NORMAL": number, "TEXCOORD_0": 2}
    extension = {"bufferView": 0, "attributes": numbers}
    tree["meshes"][0]["primitives"][0]["extensions"] = {gltf_compressed.DRACO: extension}
    tree |= {"extensionsUsed": [gltf_compressed.DRACO], "extensionsRequired": [gltf_compressed.DRACO]}
    for accessor in tree["accessors"]:
        del accessor["bufferView"]
    tree["bufferViews"] = [{"buffer": 0}]
    (folder / "draco.glb").write_bytes(gltf.glb(tree, [damage(data)]))


def corners_of_accessor(file, number):
    """The single precision values (n, 3) of an accessor."""
    accessor = file.accessors[number]
    view = file.bufferViews[accessor.bufferView]
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    return np.frombuffer(file.binary_blob(), "<f4", 3 * accessor.count, start).reshape(-1, 3).astype(float)


def test_meshes_compressed_by_draco_are_unchanged(tmp_path, iccm):
    squeezed(tmp_path)
    parts = [gltf.primitives(gltf.read(tmp_path / f"{name}.glb"))["sheet"] for name in ("plain", "draco")]
    corners = []
    for part in parts:
        mesh = part.triangles()
        rows = np.hstack([mesh.points, mesh.normals, mesh.uv])[mesh.corners].reshape(-1, 3, 8)
        first = np.lexsort(np.moveaxis(rows[..., :3], -1, 0).round(3))[:, :1]
        order = (first + np.arange(3)) % 3  # a triangle may begin at any corner
        rows = np.take_along_axis(rows, order[..., None], axis=1).reshape(len(rows), -1)
        corners.append(rows[np.lexsort(rows.T[::-1].round(3))])
    assert corners[1] == pytest.approx(corners[0], abs=1e-4)
    result = iccm("flatten", tmp_path / "draco.glb", "--uv", tmp_path / "out.glb")
    assert result.code == 0, result.err
    new = rich_glb.read(tmp_path / "out.glb")
    assert not new.extensionsUsed and not new.extensionsRequired
    position = new.accessors[new.meshes[0].primitives[0].attributes.POSITION]
    assert position.count == 25
    points = corners_of_accessor(new, new.meshes[0].primitives[0].attributes.POSITION)
    assert position.min == points.min(axis=0).tolist() and position.max == points.max(axis=0).tolist()


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"damage": lambda data: data[: len(data) // 2]}, "cannot read this GLB file"),
        ({"damage": lambda data: b"DRACO" + bytes(40)}, "cannot read this GLB file"),
        ({"number": 9}, "has no attribute 9 for NORMAL"),
        (None, "pip install 'iccm[draco]'"),
    ],
)
def test_damaged_draco_is_refused_in_one_line(shapes, iccm, monkeypatch, how, message):
    squeezed(shapes, **(how or {}))
    if how is None:
        monkeypatch.setitem(sys.modules, "DracoPy", None)
    result = iccm("flatten", "draco.glb")
    assert result.code == 2 and len(result.lines) == 1 and message in result.err


def packed(folder, name="EXT_meshopt_compression", **wrong):
    """The same sheet uncompressed and compressed by meshopt, as plain.glb and meshopt.gltf; `wrong` overrides fields of
    its first view.
    """
    meshopt = pytest.importorskip("meshopt")
    squeezed(folder)
    whole = gltf.read(folder / "plain.glb")
    tree, data = json.loads(json.dumps(whole.tree)), b""
    for k, view in enumerate(tree["bufferViews"]):
        accessor = next(entry for entry in tree["accessors"] if entry["bufferView"] == k)
        stride = len(whole.views[k]) // accessor["count"]
        mode = "TRIANGLES" if accessor["type"] == "SCALAR" else "ATTRIBUTES"
        values = np.frombuffer(whole.views[k], np.uint8 if mode == "ATTRIBUTES" else np.uint16)
        rows = values.reshape(accessor["count"], -1) if mode == "ATTRIBUTES" else values
        packed = meshopt.encode_gltf_buffer(rows, mode)
        extension = {"buffer": 0, "byteOffset": len(data), "byteLength": len(packed), "byteStride": stride}
        view |= {"buffer": 1, "extensions": {name: extension | {"count": accessor["count"], "mode": mode}}}
        data += packed
    tree["bufferViews"][0]["extensions"][name] |= wrong
    (folder / "packed.bin").write_bytes(data)
    tree["buffers"] = [
        {"uri": "packed.bin", "byteLength": len(data)},
        {"byteLength": 9999, "extensions": {name: {"fallback": True}}},
    ]
    (folder / "meshopt.gltf").write_text(
        json.dumps(tree | {"extensionsUsed": [name], "extensionsRequired": [name]})
    )


@pytest.mark.parametrize("name", gltf_compressed.MESHOPT)
def test_meshes_compressed_by_meshopt_are_unchanged(tmp_path, iccm, name):
    packed(tmp_path, name)
    plain, unpacked = (
        gltf.primitives(gltf.read(tmp_path / file))["sheet"].triangles()
        for file in ("plain.glb", "meshopt.gltf")
    )
    for values in ("points", "normals", "uv"):
        assert np.array_equal(getattr(plain, values), getattr(unpacked, values))
    faces = [mesh.corners.reshape(-1, 3) for mesh in (plain, unpacked)]  # a triangle may begin at any corner
    plain_faces, unpacked_faces = (
        np.take_along_axis(f, (f.argmin(1)[:, None] + np.arange(3)) % 3, 1) for f in faces
    )
    assert np.array_equal(plain_faces, unpacked_faces)
    assert iccm("flatten", tmp_path / "meshopt.gltf", "--uv", tmp_path / "out.glb").code == 0
    new = rich_glb.read(tmp_path / "out.glb")
    assert not new.extensionsUsed and not new.extensionsRequired and not new.buffers[0].extensions
    assert new.accessors[new.meshes[0].primitives[0].attributes.POSITION].count == 25


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"byteLength": 7}, "cannot read this GLTF file"),
        ({"mode": "PHOTONS"}, "cannot read this GLTF file"),
        ({"count": 12}, "cannot read this GLTF file"),
        ({"count": 10**12}, "items of 12 bytes"),
        (None, "pip install 'iccm[meshopt]'"),
    ],
)
def test_damaged_meshopt_is_refused_in_one_line(shapes, iccm, monkeypatch, wrong, message):
    packed(shapes, **(wrong or {}))
    if wrong is None:
        monkeypatch.setitem(sys.modules, "meshopt", None)
    result = iccm("flatten", "meshopt.gltf")
    assert result.code == 2 and len(result.lines) == 1 and message in result.err


def test_nodes_of_scenes_become_roots(tmp_path, monkeypatch, iccm):
    """A validator refuses a scene with a child of another node; one with a parent outside the scene keeps its place."""
    monkeypatch.chdir(tmp_path)
    points, normals, uv, faces = rich_glb.sheet(5)
    file = rich_glb.read_bytes(rich_glb.rich(points, normals, uv, faces))
    file.nodes[4].translation = [1, 2, 3]  # the hat, a child of the world
    file.nodes.append(gl.Node(name="beyond", children=[1], translation=[9, 9, 9]))
    file.scenes[0].nodes = [0, 1, 4]
    file.save_binary("old.glb")
    assert iccm("flatten", "old.glb#body", "--uv", "new.glb").code == 0
    new = rich_glb.read("new.glb")
    assert new.scenes[0].nodes == [0, 1]
    children = [child for node in new.nodes for child in node.children or []]
    assert sorted(children) == [2, 3, 4]  # the hat stays where its parent puts it, and is shown once
    assert new.nodes[4].translation == [1, 2, 3] and not new.nodes[-1].children


def test_a_fan_of_triangles_shows_its_front(tmp_path):
    """A pentagon that is counter-clockwise from above, as triangles around its first vertex."""
    points = np.array([[0, 0, 0], [3, 0, 0], [4, 2, 0], [1.5, 4, 0], [-1, 1, 0]], np.float32)
    tree = gl.GLTF2(
        scenes=[gl.Scene(nodes=[0])],
        nodes=[gl.Node(mesh=0)],
        meshes=[gl.Mesh(primitives=[gl.Primitive(attributes=gl.Attributes(POSITION=0), mode=6)])],
        accessors=[
            gl.Accessor(
                bufferView=0, componentType=gl.FLOAT, count=5, type="VEC3", min=[-1, 0, 0], max=[4, 4, 0]
            )
        ],
        bufferViews=[gl.BufferView(buffer=0, byteLength=points.nbytes)],
        buffers=[gl.Buffer(byteLength=points.nbytes)],
    )
    tree.set_binary_blob(points.tobytes())
    tree.save_binary(tmp_path / "fan.glb")
    mesh = mesh_files.read(str(tmp_path / "fan.glb")).mesh
    a, b, c = mesh.points[mesh.corners.reshape(-1, 3)].transpose(1, 0, 2)
    assert len(a) == 3 and (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_the_transform_of_a_texture_may_name_its_own_set_of_coordinates():
    transform = {"KHR_texture_transform": {"scale": [2, 1], "texCoord": 1}}
    assert gltf_materials.set_of({"index": 0, "extensions": transform}) == 1
    assert gltf_materials.set_of({"index": 0, "texCoord": 2}) == 2


@pytest.mark.parametrize(
    ("slot", "kind"),
    [
        ("pbrMetallicRoughness/baseColorTexture", "colour"),
        ("pbrMetallicRoughness/metallicRoughnessTexture", "data"),
        ("occlusionTexture", "data"),
        ("normalTexture", "normal"),
        ("extensions/KHR_materials_clearcoat/clearcoatNormalTexture", "normal"),
    ],
)
def test_pictures_are_averaged_according_to_their_slot(slot, kind):
    assert gltf_materials.kind_of(slot) == kind


def test_joints_and_weights_of_no_new_vertices_are_none(rich):
    source = gltf.read(rich / "rich.glb")
    primitive = source.tree["meshes"][0]["primitives"][0]
    nothing = Mixtures(np.empty((0, 3), int), np.empty((0, 3)), np.empty((0, 3), int))
    bound = gltf_write._bound(source, primitive["attributes"], "0", nothing)
    assert bound["JOINTS"].shape == bound["WEIGHTS"].shape == (0, 4)


def test_notes_on_several_materials_are_given_once(tmp_path):
    """All names are in one line, and what is the same everywhere is reported once."""
    import trimesh

    triangle, scene = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), trimesh.Scene()
    for number in range(6):
        material = trimesh.visual.material.PBRMaterial(
            name=f"Paint {number}",
            baseColorFactor=[90, 9 * number, 0, 255],
            normalTexture=Image.new("RGB", (2, 2)),
        )
        visual = trimesh.visual.TextureVisuals(uv=triangle[:, :2] / (number + 1), material=material)
        scene.add_geometry(trimesh.Trimesh(triangle + 2.0 * number, [[0, 1, 2]], visual=visual))
    scene.export(tmp_path / "six.glb")
    parts = [*gltf.primitives(gltf.read(tmp_path / "six.glb")).values()]
    pictures = {part.key: {gltf_materials.BASE: rich_glb.png((0, 0, 255))} for part in parts}
    _, notes = gltf_write.with_coordinates(
        parts, np.ones(6, bool), triangle[:, :2], np.tile([0, 1, 2], 6), pictures, untinted=True
    )
    staying, whitened = notes
    assert staying.count("normalTexture") == 1 and "Paint 0" in whitened and "2 more" in whitened
