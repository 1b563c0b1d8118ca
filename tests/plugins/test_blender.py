"""The add-on in a real Blender (the module bpy, in a virtual environment). Skipped, with a warning, without one."""

import functools
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from shapely import Polygon, union_all

from iccm.io import plugins

BPY = Path(os.environ.get("BPY_PYTHON") or Path(__file__).parents[2] / "build" / "bpy" / "bin" / "python")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
HERE = Path(__file__).parent


@functools.cache
def lacking():
    """Why there is no Blender; empty if there is one."""
    if not BPY.is_file():
        return f"there is no Python {BPY}"
    result = subprocess.run([str(BPY), "-c", "import bpy"], capture_output=True, text=True)
    return result.stderr.strip().splitlines()[-1] if result.returncode else ""


@pytest.fixture
def blender(tmp_path, monkeypatch):
    """`blender(code)` runs code in Blender, with the add-on from its archive, and returns what the code puts in
    `results`.
    """
    if why := lacking():
        pytest.skip(f"NO BLENDER TESTS: pip install bpy in a virtual environment build/bpy: {why}")
    monkeypatch.setenv("BLENDER_USER_RESOURCES", str(tmp_path / "settings"))
    monkeypatch.chdir(tmp_path)
    plugins.install("blender", "addon.zip")
    Path("settings").mkdir()

    def run(code):
        Path("code.py").write_text(f"{(HERE / 'in_blender.py').read_text()}\n{code}\nwrite(results)\n")
        result = subprocess.run([str(BPY), "code.py"], capture_output=True, text=True, timeout=200)
        assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-4000:]
        return json.loads(Path("results.json").read_text())

    return run


def areas(faces):
    """Signed areas of polygons (f, n, 2)."""
    x, y = np.moveaxis(np.asarray(faces), -1, 0)
    return (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2


def border(faces):
    """The corners of a grid's faces that belong to only one or two of them: those at its border."""
    places, counts = np.unique(np.round(np.reshape(faces, (-1, 2)), 6), axis=0, return_counts=True)
    return places[counts < 4]


DISC = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><circle id="a" cx="50" cy="40" r="30"/></svg>'


def test_islands_are_fitted_into_a_drawing_and_undone(blender):
    Path("disc.svg").write_text(DISC)
    result = blender("""
grid("a", 12, turned(.4, .2, .1, .5)); select(lambda face: True)
undo_point("before")
results["before"] = coordinates()
results["messages"] = operator("fit_island", outline="file", filepath=os.path.abspath("disc.svg"))
results["after"] = coordinates()
undo_point("after")
bpy.ops.ed.undo()
results["undone"] = coordinates()
""")
    before, after = (np.array(result[name]) for name in ("before", "after"))
    assert result["messages"] == ["FINISHED"] and result["undone"] == result["before"]
    assert (areas(after) > 0).all()
    assert np.allclose(np.hypot(*(border(after) - [0.5, 0.6]).T), 0.3, atol=2e-3)
    turn = [np.angle((faces[-1].mean(0) - faces[0].mean(0)) @ [1, 1j]) for faces in (before, after)]
    assert abs(turn[1] - turn[0]) < 0.1


def test_what_is_missing_is_said_by_name(blender):
    result = blender("""
mesh = bpy.data.meshes.new("bare"); mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
thing = bpy.data.objects.new("bare", mesh); bpy.context.collection.objects.link(thing)
bpy.context.view_layer.objects.active = thing
results["bare"] = [refused(name) for name in ("fit_island", "transfer", "relayout")]
bpy.context.view_layer.objects.active = None
results["none"] = refused("fit_island")
""")
    assert all("bare has no texture coordinates; unwrap it first" in text for text in result["bare"])
    assert "Select a mesh first" in result["none"]


def test_mirrored_islands_stay_mirrored(blender):
    Path("disc.svg").write_text(DISC)
    result = blender("""
grid("a", 8, lambda x, y: (.9 - .4 * x, .1 + .4 * y), lambda x, y: (.1 + .3 * x, .6 + .3 * y))
select(lambda face: True)
results["messages"] = operator("fit_island", outline="file", filepath=os.path.abspath("disc.svg"))
results["after"] = coordinates()
""")
    mirrored, plain = np.split(np.array(result["after"]), 2)
    assert (areas(mirrored) < 0).all() and (areas(plain) > 0).all()
    assert mirrored[0].mean(axis=0)[0] > 0.6 and plain[0].mean(axis=0)[0] < 0.4


def test_several_islands_share_an_outline_side_by_side(blender):
    Path("disc.svg").write_text(DISC)
    result = blender("""
grid("a", 8, lambda x, y: (.1 + .3 * x, .1 + .4 * y), lambda x, y: (.5 + .4 * x, .6 + .3 * y))
select(lambda face: True)
results["messages"] = operator("fit_island", outline="file", filepath=os.path.abspath("disc.svg"))
results["after"] = coordinates()
import sys
addon = sys.modules["bl_ext.user_default.iccm"]
results["options"] = sorted(addon.ICCM_OT_fit_island.bl_options)
results["readable"] = addon.readable("islands.svg: folds; outline.obj#uv: is open")
""")
    assert ".svg" not in result["readable"] and ".obj" not in result["readable"]
    left, right = np.split(np.array(result["after"]), 2)
    assert result["messages"] == ["FINISHED"] and result["options"] == ["REGISTER", "UNDO"]
    assert (areas(left) > 0).all() and (areas(right) > 0).all()
    away = np.hypot(*(np.reshape([left, right], (-1, 2)) - [0.5, 0.6]).T)
    assert away.max() < 0.3 + 2e-3 and away.max() > 0.29
    a, b = (union_all([Polygon(face) for face in side.tolist()]) for side in (left, right))
    assert a.intersection(b).area < 1e-6 * min(a.area, b.area)


def test_an_island_is_fitted_into_a_like_one_by_the_similarity(blender):
    result = blender("""
grid("a", 6, lambda x, y: (.5 * x, .3 * y), lambda x, y: (.6 + .25 * x, .5 + .15 * y), lambda x, y: (.9 + .1 * x, y))
select(lambda face: face.index < 72, active=40)
results["messages"] = operator("fit_island", outline="island", fit="whole", parts="each")
results["after"] = coordinates()
""")
    faces = np.array(result["after"])
    assert result["messages"] == ["FINISHED"]
    assert np.allclose(faces[:36], faces[36:72], atol=1e-4)
    assert np.allclose(faces[36:72].reshape(-1, 2).min(axis=0), [0.6, 0.5])
    assert np.allclose(faces[72:].reshape(-1, 2).min(axis=0), [0.9, 0])


def test_islands_are_fitted_into_a_curve(blender):
    result = blender("""
bpy.ops.curve.primitive_bezier_circle_add(radius=3, location=(4, 5, 6)); bpy.context.object.name = "round"
grid("a", 8, lambda x, y: (.4 * x, .4 * y), lambda x, y: (.5 + .4 * x, .5 + .4 * y)); select(lambda face: True)
results["messages"] = operator("fit_island", outline="curve", curve="round", parts="each")
results["after"] = coordinates()
""")
    assert result["messages"] == ["FINISHED"]
    for faces in np.split(np.array(result["after"]), 2):
        assert (areas(faces) > 0).all()
        assert np.allclose(np.hypot(*(border(faces) - 0.5).T), 0.5, atol=4e-3)


QUARTERS = {(0.25, 0.25): "red", (0.75, 0.25): "green", (0.25, 0.75): "blue", (0.75, 0.75): "white"}


@pytest.mark.parametrize("base", [True, False])
def test_a_picture_is_carried_onto_selected_faces_and_undone(blender, base):
    result = blender(f"""
quarters = picture("quarters", 64, 64, QUARTERS)
grid("a", 8, lambda x, y: (.25 + .5 * x, .25 + .5 * y), lambda x, y: (.05 + .1 * x, .05 + .1 * y))
select(lambda face: face.index < 64, synced={base})
if {base}:
    material(picture("base", 128, 128, dict.fromkeys(QUARTERS, (0, .5, .5, 1))))
undo_point("before")
results["messages"] = operator("transfer", picture="quarters", size=128)
shown = nodes()[0].image
results["name"], results["packed"], results["size"] = shown.name, shown.packed_file is not None, list(shown.size)
results["at"] = [list(pixel_at(shown, .25 + .5 * x, .25 + .5 * y)) for x, y in QUARTERS]
results["aside"] = list(pixel_at(shown, .1, .1))
results["mode"] = bpy.context.object.mode
undo_point("after")
bpy.ops.ed.undo()
results["undone"] = [node.image.name for node in nodes()]
""")
    assert result["messages"] == ["FINISHED"] and result["packed"] and result["size"] == [128, 128]
    assert np.allclose(result["at"], [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1]], atol=0.01)
    assert np.allclose(result["aside"][3 - 3 * base :], [0, 0.5, 0.5, 1] if base else [0], atol=0.01)
    assert result["undone"] == (["base"] if base else [])


def test_textures_follow_to_the_active_uv_map(blender):
    result = blender("""
grid("a", 8, lambda x, y: (x, y), maps={"new": turned(1.2, .5, .1, .4)})
quarters, rough = picture("quarters", 64, 64, QUARTERS), picture("rough", 64, 64, GREYS, data=True)
bent = picture("bent", 64, 64, dict.fromkeys(QUARTERS, (.7, .5, .9582576, 1)), data=True)
material(quarters, rough, bent); material(picture("other", 64, 64, {place: QUARTERS[.25, .25] for place in QUARTERS}))
mesh = bpy.context.object.data
for face in mesh.polygons: face.material_index = int(face.index >= 48)
mesh.uv_layers.active = mesh.uv_layers["new"]
twin = bpy.data.objects.new("twin", mesh.copy()); bpy.context.collection.objects.link(twin)
undo_point("before")
results["messages"] = operator("relayout")
results["rendered"] = [layer.name for layer in mesh.uv_layers if layer.active_render]
images = [node.image for node in nodes()]
results["names"] = [image.name for image in images]
results["spaces"] = [image.colorspace_settings.name for image in images]
old, new = coordinates("UVMap"), coordinates("new")
pairs = [(0, quarters), (1, rough)]
results["far"] = 0.0
for number, face in enumerate(new):
    if mesh.polygons[number].material_index == 0 and inner(old[number]):
        for k, before in pairs:
            a, b = pixel_at(images[k], *middle(face)), pixel_at(before, *middle(old[number]))
            results["far"] = max(results["far"], float(np.abs(np.subtract(a, b)).max()))
results["other"] = [list(pixel_at(images[3], *middle(new[60])))]
results["normals"] = [list(pixel_at(images[2], *middle(new[k]))) for k in range(48) if inner(old[k])]
results["twin"] = [node.image.name for slot in twin.material_slots for node in slot.material.node_tree.nodes
                 if node.type == "TEX_IMAGE"]
undo_point("after")
bpy.ops.ed.undo()
results["undone"] = [node.image.name for node in nodes()]
results["again"] = operator("relayout")
""")
    assert result["messages"] == ["FINISHED"] and result["rendered"] == ["new"]
    assert result["names"] == ["quarters new", "rough new", "bent new", "other new"]
    assert result["spaces"] == ["sRGB", "Non-Color", "Non-Color", "sRGB"]
    assert result["far"] < 0.02 and np.allclose(result["other"], [[1, 0, 0, 1]], atol=0.01)
    turned = (
        np.mean(result["normals"], axis=0)[:2] * 2 - 1
    )  # by as much as the layout is, on a nearly flat grid
    assert np.allclose(turned, 0.4 * np.array([np.cos(1.2), np.sin(1.2)]), atol=0.03)
    assert result["twin"] == result["undone"] == ["quarters", "rough", "bent", "other"]
    assert result["again"] == ["FINISHED"]


def test_impossible_requests_are_reported_and_change_nothing(blender):
    result = blender("""
grid("a", 4, lambda x, y: (x, y)); select(lambda face: True)
picture("quarters", 64, 64, QUARTERS)
before = coordinates()
results["messages"] = [
    refused("fit_island", outline="file", filepath="/nowhere/disc.svg"),
    refused("fit_island", outline="file", filepath=os.path.abspath("settings")),
    refused("fit_island", outline="file"),
    refused("fit_island", outline="island"),
    refused("fit_island", outline="curve", curve="none"),
    refused("transfer", picture="none"),
    refused("transfer", picture="quarters", turn="left"),
    refused("relayout"),
]
bpy.ops.mesh.select_all(action="DESELECT")
results["messages"] += [refused("transfer", picture="quarters")]
preferences().python = "/nowhere/python"
select(lambda face: True)
results["messages"] += [refused("transfer", picture="quarters")]
results["same"] = before == coordinates() and len(bpy.data.images) == 1
""")
    parts = [
        "/nowhere/disc.svg",
        "settings is a folder",
        "file of the outline",
        "no face is active",
        "choose a curve object",
        "choose a picture",
        "'left' is not an angle",
        "is already the rendered UV map",
        "select faces",
        "/nowhere/python",
    ]
    assert result["same"] and len(result["messages"]) == len(parts)
    for message, part in zip(result["messages"], parts):
        assert part in message and "Traceback" not in message, message


def test_escape_ends_the_process_and_changes_nothing(blender):
    result = blender(
        """
import sys, time, types
addon = sys.modules["bl_ext.user_default.iccm"]
grid("a", 40, lambda x, y: (x, y)); select(lambda face: True)
Path("disc.svg").write_text(DISC)
before = coordinates()


class Job(addon.Run):
    bl_label, told = "Fit", []
    outline, filepath, parts, fit, turn, balance = "file", os.path.abspath("disc.svg"), "each", "whole", "", 1
    prepare, take = addon.ICCM_OT_fit_island.prepare, addon.ICCM_OT_fit_island.take
    waits = lambda self: False
    report = lambda self, kind, text: self.told.append(text)


texts = []
manager = types.SimpleNamespace(event_timer_add=lambda *_, **__: "timer", event_timer_remove=texts.append,
                                modal_handler_add=lambda _: None)
context = types.SimpleNamespace(window_manager=manager, window=None, object=bpy.context.object,
    preferences=bpy.context.preferences, tool_settings=bpy.context.tool_settings,
    workspace=types.SimpleNamespace(status_text_set=texts.append))
event = lambda kind: types.SimpleNamespace(type=kind)
job = Job()
results["begun"] = list(job.execute(context))
results["waiting"] = list(job.modal(context, event("TIMER")))
results["text"] = texts[-1]
folder = Path(job._folder.name)
results["there"] = folder.is_dir()
results["ended"] = list(job.modal(context, event("ESC")))
results["left"] = [folder.exists(), job._process.poll() is None, texts[-2:], job.told]
results["same"] = before == coordinates()
job = Job()
job.execute(context)
while (state := job.modal(context, event("TIMER"))) == {"RUNNING_MODAL"}:
    time.sleep(.05)
results["finished"], results["moved"] = list(state), before != coordinates()
""".replace("DISC", repr(DISC))
    )
    assert result["begun"] == result["waiting"] == ["RUNNING_MODAL"] and result["there"]
    assert result["text"].startswith("iccm: Fit, ") and result["text"].endswith("Esc to cancel")
    assert result["ended"] == ["CANCELLED"] and result["same"]
    assert result["left"] == [False, False, ["timer", None], ["iccm was cancelled; the scene is unchanged"]]
    assert result["finished"] == ["FINISHED"] and result["moved"]


def test_panels_and_dialogs_show_every_property(blender):
    result = blender("""
import sys, types
addon = sys.modules["bl_ext.user_default.iccm"]


def shown(cls, **values):
    names = []
    layout = types.SimpleNamespace(operator=names.append, prop=lambda _, name: names.append(name))
    layout.prop_search = lambda _, name, data, members: names.append(name if hasattr(data, members) else members)
    cls.draw(types.SimpleNamespace(layout=layout, **values), bpy.context)
    return sorted(names)


results["panel"] = shown(addon.ICCM_PT_texture)
for cls, field, values in ((addon.ICCM_OT_fit_island, "outline", ("island", "file", "curve")),
                           (addon.ICCM_OT_transfer, "source", ("canvas", "shape", "file"))):
    names = set().union(*(shown(cls, **{field: value}) for value in values))
    results[cls.__name__] = sorted(names ^ set(cls.__annotations__))
results["preferences"] = shown(addon.Preferences)
results["poll"] = [bpy.ops.iccm.fit_island.poll()]
grid("a", 2, lambda x, y: (x, y))
results["poll"] += [bpy.ops.iccm.fit_island.poll()]
""")
    assert result["panel"] == ["iccm.fit_island", "iccm.relayout", "iccm.transfer"]
    assert result["ICCM_OT_fit_island"] == result["ICCM_OT_transfer"] == []
    assert result["preferences"] == ["python"] and result["poll"] == [False, True]


def test_an_installed_folder_is_switched_on(blender):
    """As written by `iccm plugins install blender`, beside the add-on installed from the archive."""
    plugins.uninstall("blender")
    assert [path.name for path in plugins.install("blender")] == ["iccm"]
    result = blender("""
import addon_utils
results["on"] = addon_utils.enable("bl_ext.user_default.iccm") is not None and hasattr(bpy.types, "ICCM_PT_texture")
""")
    assert result["on"]
