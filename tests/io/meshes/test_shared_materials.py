"""Primitives of a GLB that share a material: it is changed once, and a layout beside the old one is found."""

import json
import struct
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from iccm.io.meshes import gltf, gltf_write

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], "<f4")
COUNT = 3


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """three.glb: three quads with one material, one picture and the same coordinates."""
    monkeypatch.chdir(tmp_path)
    picture = BytesIO()
    ramp = (np.indices((16, 16)).sum(axis=0)[..., None] * np.array([8, 4, 2])).astype(np.uint8)
    Image.fromarray(ramp).save(picture, "PNG")
    places = [POINTS + np.array([2 * k, 0, 0], "<f4") for k in range(COUNT)]
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")
    blobs = [*(p.tobytes() for p in places), uv.tobytes(), np.array([0, 1, 2, 0, 2, 3], "<u2").tobytes()]
    blobs.append(picture.getvalue())
    ends = np.cumsum([len(blob) + -len(blob) % 4 for blob in blobs]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(blob)} for start, blob in zip([0, *ends], blobs)
    ]
    accessors = [
        {"bufferView": k, "componentType": 5126, "count": 4, "type": "VEC3"}
        | {"min": p.min(axis=0).tolist(), "max": p.max(axis=0).tolist()}
        for k, p in enumerate(places)
    ]
    accessors += [
        {"bufferView": COUNT, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": COUNT + 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    primitives = [
        {"attributes": {"POSITION": k, "TEXCOORD_0": COUNT}, "indices": COUNT + 1, "material": 0}
        for k in range(COUNT)
    ]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": ends[-1]}],
        "images": [{"bufferView": COUNT + 2, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data = b"".join(blob + b"\0" * (-len(blob) % 4) for blob in blobs)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(data), len(text), 0x4E4F534A)
    (tmp_path / "three.glb").write_bytes(head + text + struct.pack("<II", len(data), 0x004E4942) + data)
    return tmp_path


def tree_of(folder, name):
    return gltf.read(folder / name).tree


@pytest.mark.parametrize(
    ("words", "images"),
    [
        (["flatten", "three.glb", "--uv", "o.glb"], 1),
        (["flatten", "three.glb", "--uv", "o.glb", "--carry-maps"], 1),
        (["map", "square.svg", "three.glb", "--texture", "checker", "-o", "o.glb"], 1),
    ],
)
def test_a_material_is_changed_once_for_all_of_its_primitives(folder, iccm, words, images):
    (folder / "square.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 0H9V9H0Z"/></svg>'
    )
    result = iccm(*words)
    assert result.code == 0, result.err
    tree = tree_of(folder, "o.glb")
    assert len(tree["materials"]) == len(tree["textures"]) == 1 and len(tree["images"]) == images
    assert {p["material"] for p in tree["meshes"][0]["primitives"]} == {0}
    sets = {tuple(sorted(p["attributes"])) for p in tree["meshes"][0]["primitives"]}
    assert len(sets) == 1


def test_a_picture_that_replaces_those_of_two_materials_is_embedded_once(folder, iccm):
    document = gltf.read(folder / "three.glb")
    tree = document.tree
    for key, number in (("images", {}), ("textures", {"source": 1}), ("materials", {})):
        tree[key].append({**tree[key][0], **number})
    tree["materials"][1] = {"name": "hair", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}
    tree["meshes"][0]["primitives"][2]["material"] = 1
    (folder / "two.glb").write_bytes(gltf_write.glb(tree, document.views))
    (folder / "square.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 0H9V9H0Z"/></svg>'
    )
    Image.fromarray(np.eye(8, dtype=np.uint8) * 200).save("rows.png")
    result = iccm("map", "square.svg", "two.glb", "--texture", "rows.png", "-o", "o.glb")
    assert result.code == 0, result.err
    changed = tree_of(folder, "o.glb")
    assert len(changed["images"]) == 1 and len(changed["materials"]) == 2
    assert [texture["source"] for texture in changed["textures"]] == [0, 0]


def test_primitives_that_do_not_change_keep_the_material(folder, iccm):
    tree = tree_of(folder, "three.glb")
    names = list(gltf.primitives(gltf.read(folder / "three.glb")))
    assert iccm("flatten", f"three.glb#{names[1]}", "--uv", "o.glb").code == 0
    changed = tree_of(folder, "o.glb")
    numbers = [p["material"] for p in changed["meshes"][0]["primitives"]]
    assert sorted(numbers) == [0, 0, 1] and changed["materials"][0] == tree["materials"][0]


def test_textures_are_carried_to_the_layout_that_flatten_wrote_beside_the_old_one(folder, iccm):
    assert iccm("flatten", "three.glb", "--uv", "new.glb").code == 0
    result = iccm("relayout", "three.glb", "new.glb", "-o", "o.glb", "--report", "r.json")
    assert result.code == 0, result.err
    layout = json.loads((folder / "r.json").read_text())["layout"]
    assert layout["overlapping_texels"] == 0
    (material,) = tree_of(folder, "o.glb")["materials"]
    assert material["pbrMetallicRoughness"]["baseColorTexture"].get("texCoord", 0) == 0
