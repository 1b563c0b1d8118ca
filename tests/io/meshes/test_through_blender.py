"""Skins, morph targets and instances with new coordinates, as a real Blender (bpy) reads, poses and writes them."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pygltflib as gl
import pytest

from tests import rich_glb
from tests.plugins.test_blender import BPY, lacking

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

POSED = """
import json, sys
import bpy

def posed(path):
    '''Corners of all faces in the world, posed and morphed, and the users of each mesh.'''
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    for rig in (each for each in bpy.data.objects if each.type == "ARMATURE"):
        rig.animation_data_clear()
        for bone in rig.pose.bones:
            bone.rotation_mode, bone.rotation_euler = "XYZ", (0.3, 0.2 * len(bone.name), -0.4)
    for keys in bpy.data.shape_keys:
        keys.animation_data_clear()
        for block in keys.key_blocks[1:]:
            block.value = 0.7
    graph = bpy.context.evaluated_depsgraph_get()
    found = {}
    for each in bpy.data.objects:
        if each.type != "MESH" or each.name.startswith("Icosphere"):
            continue
        mesh = each.evaluated_get(graph).to_mesh()
        corners = [list(each.matrix_world @ mesh.vertices[v].co) for face in mesh.polygons for v in face.vertices]
        uv = mesh.uv_layers.active
        shown = [] if uv is None else [list(uv.data[k].uv) for face in mesh.polygons for k in face.loop_indices]
        found[each.name] = {"corners": corners, "uv": shown, "users": each.data.users}
    return found

result = {}
for name in sys.argv[1:-1]:
    result[name] = posed(name)
    bpy.ops.export_scene.gltf(filepath=name.replace(".glb", "-back.glb"), export_format="GLB")
json.dump(result, open(sys.argv[-1], "w"))
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with old.glb: a body with a skin and a morph target, and a hat that two nodes show."""
    if why := lacking():
        pytest.skip(f"NO BLENDER TESTS: pip install bpy in a virtual environment build/bpy: {why}")
    monkeypatch.chdir(tmp_path)
    points, normals, uv, faces = rich_glb.sheet(6)
    file = rich_glb.read_bytes(rich_glb.rich(points, normals, uv, faces))
    file.nodes.append(gl.Node(name="beside", mesh=1, translation=[3, -1, 0.5], scale=[1, 2, 1]))
    file.scenes[0].nodes.append(len(file.nodes) - 1)
    file.save_binary("old.glb")
    return tmp_path


def through_blender(*names):
    Path("posed.py").write_text(POSED)
    result = subprocess.run(
        [BPY, "posed.py", *names, "posed.json"], capture_output=True, text=True, timeout=250
    )
    assert result.returncode == 0, result.stderr[-3000:]
    return json.loads(Path("posed.json").read_text())


def in_order(corners):
    """Corners (n, 3) in an order that does not depend on that of faces."""
    rounded = np.round(np.asarray(corners), 4) + 0.0
    return rounded[np.lexsort(rounded.T)]


def test_skins_morph_targets_and_instances_survive_new_coordinates(folder, iccm):
    for words in (("flatten", "old.glb#body", "--uv", "new.glb"),):
        done = iccm(*words)
        assert done.code == 0, done.err
    result = through_blender("old.glb", "new.glb")
    old, new = result["old.glb"], result["new.glb"]
    assert set(old) == set(new) == {"person", "on top", "beside"}
    for name in old:
        assert np.abs(in_order(old[name]["corners"]) - in_order(new[name]["corners"])).max() < 2e-4
        assert old[name]["users"] == new[name]["users"]
    assert new["beside"]["users"] == 2
    assert not np.allclose(old["person"]["uv"], new["person"]["uv"])
    # the pose counts: what is compared is not the rest shape
    rest_pose = rich_glb.sheet(6)[0]
    assert np.abs(np.asarray(new["person"]["corners"]).max(axis=0) - rest_pose.max(axis=0)).max() > 0.1


def test_files_rewritten_by_blender_get_the_materials_of_the_old_file(folder, iccm):
    assert iccm("flatten", "old.glb#body", "--uv", "new.glb").code == 0
    through_blender("new.glb")
    done = iccm("relayout", "old.glb", "new-back.glb", "-o", "out.glb", "--size", 128, "--report", "r.json")
    assert done.code == 0, done.err
    report = json.loads(Path("r.json").read_text())
    assert report["same_triangles"] == report["triangles"] > 0
    result = through_blender("new-back.glb", "out.glb")
    back, out = result["new-back.glb"], result["out.glb"]
    for name in back:
        assert np.abs(in_order(back[name]["corners"]) - in_order(out[name]["corners"])).max() < 2e-4
    file = rich_glb.read("out.glb")
    assert len(file.skins) == 1 and any(p.targets for mesh in file.meshes for p in mesh.primitives)
    assert sum(node.mesh is not None for node in file.nodes) == 3 and len(file.meshes) == 2
