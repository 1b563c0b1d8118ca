"""Exchange of meshes, curves and pictures between Blender and files."""

import itertools
from contextlib import contextmanager
from pathlib import Path

import bmesh
import bpy
import numpy as np
from bpy_extras.bmesh_utils import bmesh_linked_uv_islands


class Unfit(Exception):
    """The selection or another input cannot be used; the message is for the user."""


@contextmanager
def edited(owner, change=False):
    """Yield a bmesh of an object's mesh, in Edit Mode the one being edited; with `change`, write changes back to the
    mesh.
    """
    in_edit_mode = owner.mode == "EDIT"
    made = bmesh.from_edit_mesh(owner.data) if in_edit_mode else bmesh.new()
    try:
        if not in_edit_mode:
            made.from_mesh(owner.data)
        made.faces.ensure_lookup_table()
        yield made
        if change and in_edit_mode:
            bmesh.update_edit_mesh(owner.data, loop_triangles=False, destructive=False)
        elif change:
            made.to_mesh(owner.data)
            owner.data.update()
    finally:
        if not in_edit_mode:
            made.free()


class Layout:
    """A mesh object's faces with the coordinates of one of its UV maps, by default the active one.

    Attributes:
        layer: the UV map's name.
        points: (c, 3) the position of each face corner.
        normals: (c, 3) the shading normal of each face corner.
        corners: (c,) the vertex of each face corner.
        coordinates: (c, 2) the texture coordinates of each face corner.
        starts: (f,) the first corner of each face.
        materials: (f,) the material slot of each face.
        islands: lists of faces that are connected in the UV map.
        selected: the selected faces, in Edit Mode those selected in the UV editor; all faces outside of Edit Mode.
        active: the active face; None if there is none, or outside of Edit Mode.
    """

    def __init__(self, owner, synced=True, layer=None):
        in_edit_mode = owner.mode == "EDIT"
        if in_edit_mode:
            owner.update_from_editmode()
        self.normals = np.array([each.vector for each in owner.data.corner_normals]).reshape(-1, 3)
        self.layer = layer or owner.data.uv_layers.active.name
        with edited(owner) as made:
            uv = made.loops.layers.uv[self.layer]
            loops = [loop for face in made.faces for loop in face.loops]
            self.points = np.array([loop.vert.co for loop in loops]).reshape(-1, 3)
            self.corners = np.array([loop.vert.index for loop in loops], int)
            self.coordinates = np.array([loop[uv].uv for loop in loops]).reshape(-1, 2)
            self.sides = np.array([len(face.loops) for face in made.faces], int)
            self.starts = np.cumsum(self.sides) - self.sides
            self.materials = np.array([face.material_index for face in made.faces], int)
            self.islands = [sorted(face.index for face in each) for each in bmesh_linked_uv_islands(made, uv)]
            chosen = (
                made.faces
                if not in_edit_mode
                else [face for face in made.faces if face.select and not face.hide]
            )
            if in_edit_mode and not synced:
                chosen = [face for face in chosen if _is_uv_selected(face, uv)]
            self.selected = [face.index for face in chosen]
            active = made.faces.active if in_edit_mode else None
            self.active = None if active is None else active.index

    def with_materials(self, slots):
        """Return the faces whose material is in one of these slots."""
        return np.flatnonzero(np.isin(self.materials, list(slots))).tolist()

    def corners_of(self, face):
        """Return the indices of a face's corners."""
        return range(self.starts[face], self.starts[face] + self.sides[face])

    def islands_of(self, faces):
        """Return all faces of the islands that contain any of these faces."""
        chosen = set(faces)
        return sorted(itertools.chain(*(each for each in self.islands if chosen.intersection(each))))

    def count(self, faces):
        """Return the number of islands that contain any of these faces."""
        chosen = set(faces)
        return sum(bool(chosen.intersection(each)) for each in self.islands)

    def mirrored(self):
        """Return the faces of islands that are mirrored in the UV map."""
        place = self.coordinates @ [1, 1j]
        areas = [
            np.vdot(place[each], np.roll(place[each], -1)).imag
            for each in map(self.corners_of, range(len(self.sides)))
        ]
        return {face for island in self.islands if sum(areas[each] for each in island) < 0 for face in island}

    def write(self, path, faces, turned=()):
        """Write faces as OBJ, with those in `turned` in reverse order. Corners of a vertex with the same coordinates
        share them.
        """
        corners = np.fromiter(
            itertools.chain(*(self.corners_of(face)[:: -1 if face in turned else 1] for face in faces)), int
        )
        _, first, of_vertex = np.unique(self.corners[corners], return_index=True, return_inverse=True)
        keyed = np.column_stack([self.corners[corners], self.coordinates[corners]])
        places, of_place = np.unique(keyed, axis=0, return_inverse=True)
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in self.points[corners[first]].tolist()]
        lines += [f"vt {u:.9g} {v:.9g}" for _, u, v in places.tolist()]
        lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in self.normals[corners].tolist()]
        numbers = zip((of_vertex + 1).tolist(), (of_place.ravel() + 1).tolist(), itertools.count(1))
        pairs = [f"{v}/{t}/{n}" for v, t, n in numbers]
        ends = np.cumsum(self.sides[list(faces)])
        lines += ["f " + " ".join(pairs[end - n : end]) for end, n in zip(ends, self.sides[list(faces)])]
        Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")

    def write_islands(self, path, faces):
        """Write the outlines of the islands that contain these faces as an SVG, one shape per island, on the unit
        square.
        """
        chosen = set(faces)
        shapes = []
        for island in self.islands:
            if chosen.intersection(island):
                loops = _borders(
                    [[tuple(self.coordinates[k].tolist()) for k in self.corners_of(f)] for f in island]
                )
                shapes.append(loops)
        write_shapes(path, shapes, 1, 1)

    def write_corners(self, path, faces):
        """Write the texture coordinates of the corners of faces as a table, in the units of `write_islands`."""
        rows = [
            f"{u:.9g},{1 - v:.9g}"
            for face in faces
            for u, v in self.coordinates[self.corners_of(face)].tolist()
        ]
        Path(path).write_text("\n".join(["x,y", *rows]) + "\n", encoding="ascii")


def _borders(faces):
    """Return the closed boundaries of faces given as lists of points: the edges that belong to only one face."""
    edges = {(a, b) for face in faces for a, b in zip(face, [*face[1:], face[0]]) if a != b}
    following = {}
    for a, b in edges:
        if (b, a) not in edges:
            following.setdefault(a, []).append(b)
    loops = []
    while following:
        first = here = next(iter(following))
        loop = []
        while here in following:
            loop.append(here)
            onward = following[here].pop()
            if not following[here]:
                del following[here]
            here = onward
            if here == first:
                break
        if len(loop) > 2:
            loops.append(loop)
    return loops


def _is_uv_selected(face, layer):
    """Return whether all corners of a face are selected in the UV editor."""
    if hasattr(face, "uv_select"):  # Blender 5
        return face.uv_select
    return all(loop[layer].select for loop in face.loops)


def read_coordinates(path):
    """Return the texture coordinates of each face's corners in an OBJ file."""
    places, faces = [], []
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["vt"]:
            places.append([float(word) for word in words[1:3]])
        elif words[:1] == ["f"]:
            faces.append([int(word.split("/")[1]) - 1 for word in words[1:]])
    return [[places[corner] for corner in face] for face in faces]


def set_coordinates(owner, layer, faces, turned, path):
    """Set coordinates of an object's faces from an OBJ file whose faces are those written by `Layout.write`."""
    found = read_coordinates(path)
    if len(found) != len(faces):
        raise Unfit(f"iccm wrote {len(found)} faces of {len(faces)}")
    with edited(owner, change=True) as made:
        uv = made.loops.layers.uv[layer]
        for face, places in zip(faces, found):
            for loop, place in zip(
                made.faces[face].loops, places[:: -1 if face in turned else 1], strict=True
            ):
                loop[uv].uv = place


def set_corners(owner, layer, faces, folder):
    """Set the coordinates of faces' corners from iccm's images of the points written by `Layout.write_corners`,
    relative to the canvas of the outline.
    """
    rows = (folder / "placed.csv").read_text(encoding="utf-8").splitlines()[1:]
    with np.load(folder / "map.npz") as saved:
        (low, high), upward = saved["target_box"], int(saved["target_y"])
    places = []
    for row in rows:
        x, y = (float(cell) if cell else np.nan for cell in row.split(","))
        places.append(((x - low.real) / (high - low).real, (upward * y - low.imag) / (high - low).imag))
    if not np.isfinite(places).all():
        raise Unfit("some corners lie outside the outlines of their islands; do faces overlap in the UV map?")
    with edited(owner, change=True) as made:
        uv = made.loops.layers.uv[layer]
        loops = [loop for face in faces for loop in made.faces[face].loops]
        for loop, place in zip(loops, places, strict=True):
            loop[uv].uv = place


def write_curve(context, name, path):
    """Write a curve object, seen from above, as an SVG, scaled to fit into the unit square."""
    owner = context.scene.objects.get(name)
    if owner is None or owner.type != "CURVE":
        raise Unfit("choose a curve object")
    evaluated = owner.evaluated_get(context.evaluated_depsgraph_get())
    made = bmesh.new()
    mesh = evaluated.to_mesh()
    made.from_mesh(mesh)
    evaluated.to_mesh_clear()
    try:
        loops = _outlines(made)
    finally:
        made.free()
    if not loops:
        raise Unfit(f"{name} has no closed outline")
    matrix = np.array(owner.matrix_world)
    loops = [(np.asarray(loop) @ matrix[:3, :3].T + matrix[:3, 3])[:, :2] for loop in loops]
    low = np.min([loop.min(axis=0) for loop in loops], axis=0)
    size = np.max([loop.max(axis=0) for loop in loops], axis=0) - low
    if not size.min() > 0:
        raise Unfit(f"{name} has no area seen from above")
    inset = (1 - size / size.max()) / 2
    loops = [(loop - low) / size.max() + inset for loop in loops]
    write_outlines(path, loops, 1, 1)


def _outlines(made):
    """Return the closed lines of a curve's mesh: its boundaries if it is filled, else its wires."""
    borders = [edge for edge in made.edges if len(edge.link_faces) < 2]
    following = {}
    for edge in borders:
        for a, b in (edge.verts, reversed(edge.verts)):
            following.setdefault(a, []).append(b)
    loops, left = [], set(following)
    while left:
        first = here = left.pop()
        before, loop = None, [tuple(first.co)]
        while True:
            onward = [each for each in following[here] if each is not before]
            if len(following[here]) != 2 or not onward:
                loop = []
                break
            before, here = here, onward[0]
            if here is first:
                break
            left.discard(here)
            loop.append(tuple(here.co))
        loops += [loop] if len(loop) > 2 else []
    return loops


def write_outlines(path, loops, width, height):
    """Write closed lines, with y up, as one shape on a canvas."""
    write_shapes(path, [loops], width, height)


def write_shapes(path, shapes, width, height):
    """Write shapes on a canvas, each given by closed lines with y up."""
    drawn = [
        "".join(
            "M" + " ".join(f"{x:.9g},{height - y:.9g}" for x, y in np.asarray(loop).tolist()) + "Z"
            for loop in loops
        )
        for loops in shapes
    ]
    paths = "".join(f'<path fill-rule="evenodd" d="{d}"/>' for d in drawn)
    Path(path).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">{paths}</svg>\n',
        encoding="ascii",
    )


def write_canvas(image, path):
    """Write a picture's rectangle as an SVG."""
    width, height = image.size
    write_outlines(path, [[(0, 0), (width, 0), (width, height), (0, height)]], width, height)


def save(image, stem):
    """Write the current state of a picture to a file beside `stem`; return the file's name."""
    if image.source == "TILED":
        raise Unfit(f"{image.name} has several tiles (UDIM); use `iccm relayout` or `iccm map` instead")
    if not all(image.size):
        raise Unfit(f"{image.name}: the picture file is missing")
    copy = image.copy()
    try:
        copy.file_format = "OPEN_EXR" if image.is_float else "PNG"
        path = Path(stem).with_suffix(".exr" if image.is_float else ".png")
        copy.pixels.foreach_set(_pixels(image).ravel())
        copy.update()
        copy.save(filepath=str(path))
    finally:
        bpy.data.images.remove(copy)
    return path.name


def _pixels(image):
    """Return the pixels (height, width, channels), with the lowest row first."""
    width, height = image.size
    found = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(height, width, image.channels)


def load(path, name, like=None):
    """Load a picture into the .blend file, with the colour space of another one."""
    if not Path(path).is_file():
        raise Unfit("iccm wrote no picture")
    image = bpy.data.images.load(str(path))
    image.name = name
    if like is not None:
        image.colorspace_settings.name = like.colorspace_settings.name
        image.alpha_mode = like.alpha_mode
    image.pack()
    image.filepath_raw = f"//{bpy.path.clean_name(name)}{Path(path).suffix}"
    return image


def over(path, under):
    """Load a picture, composited over another one of its size if there is one."""
    image = load(path, f"{under.name} transferred" if under else "Transferred")
    if under is not None:
        layer, below = _pixels(image), _pixels(under)
        below = (
            np.concatenate([below, np.ones_like(below[..., :1])], axis=-1) if below.shape[-1] == 3 else below
        )
        alpha = layer[..., 3:]
        rest = below[..., 3:] * (1 - alpha)
        covered = alpha + rest
        mixed = (layer[..., :3] * alpha + below[..., :3] * rest) / np.maximum(covered, 1e-6)
        image.pixels.foreach_set(np.concatenate([mixed, covered], axis=-1).astype(np.float32).ravel())
        image.update()
        image.pack()
    return image


def shown_image(context, but=None):
    """Return the picture in the UV editor, else that of the active material's active node; never `but`."""
    space = context.space_data
    image = space.image if space is not None and space.type == "IMAGE_EDITOR" else None
    if image is None and (node := _active_node(context.object)):
        image = node.image
    known = image is not None and image is not but and image.type == "IMAGE" and image.source != "TILED"
    return image if known and all(image.size) and image.channels in (3, 4) else None


def _active_node(owner):
    material = owner.active_material
    node = material.node_tree.nodes.active if material and material.node_tree else None
    return node if node and node.type == "TEX_IMAGE" else None


def show(context, image, before):
    """Show a picture in the editor, and in the active material in place of the previous picture or of none."""
    space = context.space_data
    if space is not None and space.type == "IMAGE_EDITOR":
        space.image = image
    owner = context.object
    if owner.active_material is None:
        owner.data.materials.append(bpy.data.materials.new(image.name))
    material = owner.active_material
    if material.node_tree is None:  # always there in Blender 5
        material.use_nodes = True
    nodes = [node for node in material.node_tree.nodes if node.type == "TEX_IMAGE"]
    for node in nodes:
        if before is not None and node.image == before:
            node.image = image
    principled = next((node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"), None)
    if not nodes and principled:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.links.new(node.outputs["Color"], principled.inputs["Base Color"])


def leave_edit_mode(context):
    """Switch to Object Mode: in Edit Mode, Undo includes only the mesh."""
    if context.object.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def pictures(owner, layer):
    """Return the pictures that an object's materials show with a UV map, each with its kind in iccm's terms.

    They are grouped by the slots of the materials that show them, and sorted by kind in each group.
    """
    slots, kinds = {}, {}
    for slot, node in _image_nodes(owner):
        if _map_of(node, owner) == layer:
            slots.setdefault(node.image, set()).add(slot)
            kinds.setdefault(node.image, _kind(node))
    found = {}
    for image in sorted(slots, key=lambda each: ("texture", "normal", "data").index(kinds[each])):
        found.setdefault(frozenset(slots[image]), {})[image] = kinds[image]
    return found


def replace(owner, made, old, new):
    """Replace pictures by others with another UV map; materials shared with other objects are copied first."""
    for slot in owner.material_slots:
        if slot.material is not None and slot.material.users > 1:
            slot.material = slot.material.copy()
    shown = [node for _, node in _image_nodes(owner) if _map_of(node, owner) == old]
    for node in shown:
        node.image = made.get(node.image, node.image)
    for slot in owner.material_slots:
        for node in slot.material.node_tree.nodes if slot.material and slot.material.node_tree else ():
            if node.type in ("UVMAP", "NORMAL_MAP") and node.uv_map == old:
                node.uv_map = new
    owner.data.uv_layers[new].active_render = True


def _image_nodes(owner):
    """Yield slot number and node of each picture in an object's materials."""
    for number, slot in enumerate(owner.material_slots):
        tree = slot.material.node_tree if slot.material else None
        for node in tree.nodes if tree else ():
            if node.type == "TEX_IMAGE" and node.image is not None:
                yield number, node


def _map_of(node, owner):
    """Return the UV map that a picture is shown with; None if it uses other coordinates."""
    links = node.inputs["Vector"].links
    while links:
        before = links[0].from_node
        if before.type == "UVMAP":
            return before.uv_map or _rendered(owner)
        if before.type == "TEX_COORD":
            return _rendered(owner) if links[0].from_socket.name == "UV" else None
        if "Vector" not in before.inputs:
            return None
        links = before.inputs["Vector"].links
    return _rendered(owner)


def _rendered(owner):
    return next(layer.name for layer in owner.data.uv_layers if layer.active_render)


def _kind(node):
    """Return the kind of a picture, from the nodes that it is connected to and its colour space."""
    if any(link.to_node.type == "NORMAL_MAP" for link in node.outputs["Color"].links):
        return "normal"
    return "data" if node.image.colorspace_settings.name == "Non-Color" else "texture"
