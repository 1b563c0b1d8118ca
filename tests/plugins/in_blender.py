"""The start of each test of the add-on in Blender: it is enabled, and meshes and pictures are made."""

import json
import os
from pathlib import Path

import bpy
import numpy as np

import bmesh  # isort: skip (included in the module bpy)

results = {}
QUARTERS = {
    (0.25, 0.25): (1, 0, 0, 1),
    (0.75, 0.25): (0, 1, 0, 1),
    (0.25, 0.75): (0, 0, 1, 1),
    (0.75, 0.75): (1, 1, 1, 1),
}
GREYS = {place: (0.2 * k, 0.2 * k, 0.2 * k, 1) for k, place in enumerate(QUARTERS)}
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(
    filepath=os.path.abspath("addon.zip"), repo="user_default", enable_on_install=True
)


def preferences():
    return bpy.context.preferences.addons["bl_ext.user_default.iccm"].preferences


def operator(name, **options):
    return sorted(getattr(bpy.ops.iccm, name)(**options))


def refused(name, **options):
    try:
        return f"not refused: {operator(name, **options)}"
    except RuntimeError as error:
        return str(error)


def undo_point(name):
    bpy.ops.ed.undo_push(message=name)


def turned(angle, x, y, size):
    c, s = size * np.cos(angle), size * np.sin(angle)
    return lambda a, b: (x + c * a - s * b, y + s * a + c * b)


def grid(name, n, *layouts, maps=None):
    """Return an object of curved n by n grids, one for each layout of the unit square; further UV maps by name."""
    bm = bmesh.new()
    layers = {key: bm.loops.layers.uv.new(key) for key in ["UVMap", *(maps or {})]}
    for k, layout in enumerate(layouts):
        z = lambda i, j: (i / n + 2 * k, j / n, 0.1 * np.sin(3 * i / n) * np.cos(2 * j / n))  # noqa: B023, E731
        points = [[bm.verts.new(z(i, j)) for j in range(n + 1)] for i in range(n + 1)]
        for i in range(n):
            for j in range(n):
                corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                face = bm.faces.new([points[a][b] for a, b in corners])
                for loop, (a, b) in zip(face.loops, corners):
                    for key, layer in layers.items():
                        loop[layer].uv = (maps[key] if key in (maps or {}) else layout)(a / n, b / n)
    mesh = bpy.data.meshes.new(name)
    bm.to_mesh(mesh)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing


def select(chosen, active=None, synced=True):
    """Enter Edit Mode with those faces selected for which `chosen` is true; if not synced, in the UV editor only."""
    bpy.context.tool_settings.use_uv_select_sync = synced
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.tool_settings.mesh_select_mode = (False, False, True)
    bpy.ops.mesh.select_all(action="DESELECT")
    bm = bmesh.from_edit_mesh(bpy.context.object.data)
    bm.faces.ensure_lookup_table()
    bm.faces.active = bm.faces[active] if active is not None else None
    for face in bm.faces:
        face.select_set(not synced or bool(chosen(face)))
    if not synced:
        uv = bm.loops.layers.uv.active
        for face in bm.faces:
            if hasattr(face, "uv_select_set"):
                face.uv_select_set(bool(chosen(face)))
            for loop in face.loops if not hasattr(face, "uv_select_set") else ():
                loop[uv].select = bool(chosen(face))
    bmesh.update_edit_mesh(bpy.context.object.data)


def coordinates(layer=None):
    """The texture coordinates of all corners of all faces."""
    thing = bpy.context.object
    bm = bmesh.from_edit_mesh(thing.data) if thing.mode == "EDIT" else bmesh.new()
    if thing.mode != "EDIT":
        bm.from_mesh(thing.data)
    uv = bm.loops.layers.uv[layer] if layer else bm.loops.layers.uv.active
    return [[list(loop[uv].uv) for loop in face.loops] for face in bm.faces]


def picture(name, width, height, quarters, data=False):
    """A picture of four colours."""
    image = bpy.data.images.new(name, width, height, alpha=True, is_data=data)
    pixels = np.zeros((height, width, 4), np.float32)
    for (x, y), colour in quarters.items():
        rows, columns = (
            slice(int(t > 0.5) * n // 2, (int(t > 0.5) + 1) * n // 2) for t, n in ((y, height), (x, width))
        )
        pixels[rows, columns] = colour
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def material(colour, rough=None, normals=None):
    """Return a material that shows a picture, and others as its roughness and normals."""
    new = bpy.data.materials.new(colour.name)
    if new.node_tree is None:
        new.use_nodes = True
    tree = new.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    for image, socket in ((colour, "Base Color"), (rough, "Roughness")):
        if image:
            node = tree.nodes.new("ShaderNodeTexImage")
            node.image = image
            tree.links.new(node.outputs["Color"], shader.inputs[socket])
            if image == colour:
                tree.nodes.active = node
    if normals:
        node, bent = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
        node.image = normals
        tree.links.new(node.outputs["Color"], bent.inputs["Color"])
        tree.links.new(bent.outputs["Normal"], shader.inputs["Normal"])
    bpy.context.object.data.materials.append(new)


def nodes():
    """Return the nodes with pictures in the active object's materials."""
    slots = bpy.context.object.material_slots
    return [node for slot in slots for node in slot.material.node_tree.nodes if node.type == "TEX_IMAGE"]


def pixel_at(image, u, v):
    """A picture's texel."""
    width, height = image.size
    k = 4 * (int(v * height) * width + int(u * width))
    return tuple(image.pixels[k : k + 4])


def middle(face):
    return np.mean(face, axis=0)


def inner(face):
    """Return whether a face is inside a quarter."""
    return (np.abs(middle(face) - 0.5) > 0.13).all()


def write(results):
    Path("results.json").write_text(json.dumps(results))
