"""Meshes with references to missing data: one line and exit code 2, for every command."""

import json
import struct
import warnings

import numpy as np
import pytest
from PIL import Image

from iccm.io.meshes import mesh_files

LIBRARY = "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd a.png\nmap_Bump n.png\n"
OBJ = """mtllib in.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v .5 .5 .3
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vt .5 .5
usemtl a
f 1/1 2/2 5/5
f 2/2 3/3 5/5
usemtl b
f 3/3 4/4 5/5
f 4/4 1/1 5/5
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder, made current, with good.obj, which has two materials, and good.glb made from it."""
    monkeypatch.chdir(tmp_path)
    for name, colour in (("a.png", (200, 90, 9)), ("n.png", (128, 128, 255))):
        Image.new("RGB", (8, 8), colour).save(name)
    (tmp_path / "in.mtl").write_text(LIBRARY)
    (tmp_path / "good.obj").write_text(OBJ)
    return tmp_path


@pytest.fixture
def gltf(folder, iccm):
    """good.glb, and `changed(tree)`, which writes bad.glb with another tree."""
    assert iccm("relayout", "good.obj", "good.obj", "-o", "good.glb").code == 0
    data = (folder / "good.glb").read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]

    def changed(tree):
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, len(data) - size + len(text))
        (folder / "bad.glb").write_bytes(
            head + struct.pack("<I4s", len(text), b"JSON") + text + data[20 + size :]
        )

    return json.loads(data[20 : 20 + size]), changed


def refused(typed, word):
    assert typed.code == 2 and len(typed.lines) == 1 and word in typed.err, typed.err


@pytest.mark.parametrize("number", [6, 760, 540_028_465, 999_999_999])
@pytest.mark.parametrize("corner", ["{0}/1", "1/{0}"])
def test_an_obj_with_an_index_out_of_range_is_refused(folder, iccm, number, corner):
    (folder / "bad.obj").write_text(OBJ.replace("f 4/4 1/1", "f 4/4 " + corner.format(number)))
    for old, new in (("bad.obj", "good.obj"), ("good.obj", "bad.obj")):
        refused(iccm("relayout", old, new, "-o", "o.obj"), "face 4")
        refused(iccm("relayout", old, new, "-o", "o.glb"), "face 4")
        refused(iccm("relayout", old, new, "--texture", "a.png", "-o", "o.png"), "face 4")


def test_a_map_of_one_of_two_materials_is_merged(folder, iccm):
    (folder / "one.obj").write_text(OBJ.replace("usemtl b\n", ""))
    assert iccm("relayout", "good.obj", "one.obj", "-o", "o.glb").code == 0
    data = (folder / "o.glb").read_bytes()
    tree = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    assert len(tree["materials"]) == 1 and "normalTexture" in tree["materials"][0]


def test_gltf_arrays_that_are_shorter_than_its_positions_are_refused(gltf, iccm):
    tree, changed = gltf
    accessor = tree["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    tree["accessors"][accessor]["count"] -= 1
    changed(tree)
    for line in (("relayout", "bad.glb", "good.obj", "-o", "o.obj"), ("flatten", "bad.glb", "--uv", "o.glb")):
        refused(iccm(*line), "TEXCOORD_0")


def test_a_gltf_whose_positions_are_not_points_is_refused(gltf, iccm):
    tree, changed = gltf
    accessor = tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    tree["accessors"][accessor]["type"] = "VEC2"
    changed(tree)
    result = iccm("relayout", "bad.glb", "good.obj", "-o", "o.obj")
    for word in ("bad.glb", "meshes/0/primitives/0", "POSITION", "VEC2", "VEC3"):
        refused(result, word)


@pytest.mark.parametrize("pair", [("bad.obj", "good.obj"), ("good.obj", "bad.obj")])
def test_texture_coordinates_that_are_not_numbers_are_refused(folder, iccm, pair):
    (folder / "bad.obj").write_text(OBJ.replace("vt 1 1", "vt nan 1"))
    refused(
        iccm("relayout", *pair, "-o", "o.obj"), "bad.obj: texture coordinates of a triangle are not finite"
    )


def test_a_material_without_a_name_or_without_area_is_written_with_the_others(folder, iccm):
    (folder / "unnamed.obj").write_text(OBJ.replace("usemtl b\n", "usemtl \n"))
    assert iccm("relayout", "good.obj", "unnamed.obj", "-o", "o.obj").code == 0
    assert (
        "usemtl iccm\n" in (folder / "o.obj").read_text()
        and "newmtl iccm\n" in (folder / "o.mtl").read_text()
    )
    (folder / "flat.obj").write_text(OBJ.replace("f 3/3 4/4 5/5\nf 4/4 1/1 5/5", "f 4/3 4/4 5/5"))
    assert iccm("relayout", "good.obj", "flat.obj", "-o", "flat.glb").code == 0


def test_a_material_name_that_looks_like_a_path_is_ignored(gltf, iccm):
    tree, changed = gltf
    tree["materials"][0]["a/b"] = {"someTexture": {"index": 0}}
    changed(tree)
    assert iccm("relayout", "bad.glb", "good.obj", "-o", "o.glb").code == 0


PLACES = {
    "materials/0/pbrMetallicRoughness/baseColorTexture/index": [7, -1, None, "0", 0.5, True],
    "materials/0/pbrMetallicRoughness/metallicFactor": [None, "1", {}],
    "materials/0/pbrMetallicRoughness": [True, [], None],
    "textures/0/source": [7, None],
    "textures/0": [None, 3],
    "images/0/bufferView": [99],
    "images/0": [None, []],
    "meshes/0/primitives/0/material": [9, None],
    "meshes/0/primitives/0/attributes/TEXCOORD_0": [99, "x"],
    "meshes/0/primitives/0/indices": [99, -1],
    "accessors/0/bufferView": [99],
    "bufferViews/0/buffer": [1],
    "nodes/0/mesh": [1, "a"],
    "nodes/0": [{"mesh": 0, "rotation": [1, 0, 0]}],
    "scenes/0/nodes/0": [1],
}


@pytest.mark.parametrize("place", PLACES)
def test_a_gltf_with_dangling_indices_is_refused(gltf, iccm, place):
    tree, changed = gltf
    *above, last = [int(word) if word.isdecimal() else word for word in place.split("/")]
    for value in PLACES[place]:
        broken = json.loads(json.dumps(tree))
        holder = broken
        for key in above:
            holder = holder[key]
        holder[last] = value
        changed(broken)
        refused(iccm("relayout", "bad.glb", "good.obj", "-o", "o.obj", "--force"), place)
        refused(iccm("relayout", "good.obj", "bad.glb", "-o", "o.glb", "--force"), place)


def test_lists_of_another_length_are_refused(gltf, iccm):
    tree, changed = gltf
    for given in ([], [1, 1], [1, 1, "x", 1], np.ones(5).tolist()):
        tree["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = given
        changed(tree)
        refused(iccm("relayout", "bad.glb", "good.obj", "-o", "o.obj"), "baseColorFactor")


def test_an_stl_with_broken_numbers_warns_nobody(folder):
    cell = np.zeros(6, [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    cell["v"] = np.random.default_rng(0).random((6, 3, 3))
    for bits in (
        0x7FA00001,
        0x7F800000,
        0xFF800000,
        0x7F7FFFFF,
    ):  # signalling NaN, infinities, the largest number
        data = bytearray(bytes(80) + struct.pack("<I", 6) + cell.tobytes())
        struct.pack_into("<I", data, 84 + 50 + 12, bits)
        (folder / "x.stl").write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert mesh_files.read("x.stl").mesh.sizes.tolist() == [3] * 6
