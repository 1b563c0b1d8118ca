"""Write new texture coordinates and pictures to a glTF file that is otherwise unchanged.

The JSON and the bytes are edited instead of written anew: nodes, skins, animations, other meshes, extensions and extras
are not touched. Indices of accessors and materials never change; new ones are added at the end. Textures, pictures and
views that nothing refers to any more are removed.
"""

import json
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Flags, Index, Real, distinct_rows
from ...errors import first_names
from ...meshes.charted import Charted
from ...surfaces.subdivided import Mixtures, Subdivision
from .. import formats
from . import gltf_materials
from .gltf import TRIANGLES_MODE, Gltf, Primitive, glb
from .gltf_materials import VERTEX_COLOURS, set_of
from .splitting import Split, with_triangles

ATTRIBUTE, INDEX = 34962, 34963  # targets of buffer views
COORDINATES = {"componentType": 5126, "type": "VEC2"}
POINTS = {"componentType": 5126, "type": "VEC3"}
TANGENTS = {"componentType": 5126, "type": "VEC4"}
WITHOUT_TEXTURES = {"KHR_lights_punctual", "KHR_materials_variants"}
"""Extensions of whole files that refer to no textures."""
NAMED_MATERIALS = 4  # in a note, before the number of the others
FEW_VIEWS = 256
"""A file with fewer views is searched for unused ones whenever a view is added."""
SEARCH_GROWTH_RATIO = 1.25
"""A larger file is searched again when it has so many times the views of the last search: each search visits the whole
file, so that one for each new view would take minutes with thousands of primitives."""
PLACED = ("values", "arrayOffsets", "stringOffsets")  # keys of EXT_structural_metadata that refer to views


class GltfEditor:
    """An editable copy of a file; views that are no longer referred to are reused."""

    def __init__(self, source: Gltf) -> None:
        self.source, self.tree, self.views = source, deepcopy(source.tree), list(source.views)
        self._textures: dict[tuple[bytes, int | None], int] = {}
        self._new_textures: dict[tuple[bytes, str], int] = {}
        self._new_images: dict[bytes, int] = {}
        self._own_materials: dict[tuple, int] = {}
        self._changing: Counter[int | None] = Counter()
        self._free: list[int] = []
        self._searched_again_at = 0

    def view(self, data: bytes, **properties: Any) -> int:
        """Add a buffer view with these bytes; return its index."""
        views = self.tree.setdefault("bufferViews", [])
        if not self._free and len(views) >= self._searched_again_at:
            self._free = sorted(set(range(len(views))) - set(_named(self.tree, "bufferView", *PLACED)))
            self._searched_again_at = 0 if len(views) < FEW_VIEWS else int(SEARCH_GROWTH_RATIO * len(views))
        number = self._free.pop(0) if self._free else len(views)
        views[number : number + 1] = [{"buffer": 0, "byteLength": len(data), **properties}]
        self.views[number : number + 1] = [data]
        return number

    def accessor(self, values: NDArray, like: dict, target: int, instead: int | None = None) -> int:
        """Add an accessor of values (n, k), or overwrite `instead` if it has a single user; return its index."""
        accessors = self.tree.setdefault("accessors", [])
        if instead is None or list(_accessors_named(self.tree)).count(instead) > 1:
            instead = len(accessors)
        copied = {key: like[key] for key in like if key not in ("bufferView", "byteOffset", "sparse")}
        accessors[instead : instead + 1] = [copied | {"count": len(values)}]
        row = values.shape[1] * values.itemsize
        wide = row + -row % 4 if target == ATTRIBUTE else row
        data = np.zeros((len(values), wide), np.uint8)
        data[:, :row] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), row)
        stride = {"byteStride": wide} if wide != row else {}
        accessors[instead]["bufferView"] = self.view(data.tobytes(), target=target, **stride)
        return instead

    def will_change(self, materials: Iterable[int | None]) -> None:
        """Announce the materials that `own_material` will be asked for: those with no other user are changed."""
        self._changing.update(materials)

    def own_material(self, number: int | None, change: Hashable) -> tuple[int, bool]:
        """Return the index of a material for a change that it does not have yet, and whether it is made already.

        The same change of the same material is made once. The material itself is changed if that concerns all of its
        users, otherwise a copy.
        """
        if (number, change) in self._own_materials:
            return self._own_materials[number, change], True
        materials = self.tree.setdefault("materials", [])
        users = sum(number == user for user in _named(self.tree["meshes"], "material"))
        taken = any(number == key for key, _ in self._own_materials)
        own = number
        if number is None or taken or users > self._changing[number]:
            original = gltf_materials.NEW if number is None else self.source.tree["materials"][number]
            materials.append(deepcopy(original))
            own = len(materials) - 1
        assert own is not None
        self._own_materials[number, change] = own
        return own, False

    def texture(self, content: bytes, like: int | None, uses: int = 1) -> int:
        """Return the index of a texture that shows a PNG or JPEG file, with the sampler of the texture `like`.

        It replaces that texture if all slots that show it, `uses` in number, get the new file. Textures with the same
        file share an image.
        """
        existing = self._textures.get((content, like))
        if existing is not None:
            return existing
        textures, images = (self.tree.setdefault(key, []) for key in ("textures", "images"))
        old = {} if like is None else textures[like]
        alone = like is not None and list(_textures_named(self.tree)).count(like) == uses
        number = like if like is not None and alone else len(textures)
        previous_image = self.source.source_of(like) if like is not None and alone else None
        textures[number : number + 1] = [{k: old[k] for k in ("name", "sampler", "extras") if k in old}]
        self._textures[content, like] = number
        if content in self._new_images:
            textures[number]["source"] = self._new_images[content]
            return number
        sources = list(_named(textures, "source"))
        place = (
            previous_image if previous_image is not None and previous_image not in sources else len(images)
        )
        name = {"name": images[place]["name"]} if place < len(images) and "name" in images[place] else {}
        self._new_images[content] = place
        return self._put(number, place, content, name)

    def new_texture(self, content: bytes, sampler: dict[str, Any] | None, name: str) -> int:
        """Return the index of a texture that shows a PNG or JPEG file, reusing an unused one if possible.

        Slots with the same file and sampler share a texture; textures with the same file share an image.
        """
        key = content, json.dumps(sampler, sort_keys=True)
        if key in self._new_textures:
            return self._new_textures[key]
        textures, images = (self.tree.setdefault(key, []) for key in ("textures", "images"))
        free = set(_textures_named(self.source.tree)) - set(_textures_named(self.tree))
        number = min(free, default=len(textures))
        textures[number : number + 1] = [{} if sampler is None else {"sampler": self._sampler(sampler)}]
        self._new_textures[key] = number
        if content in self._new_images:
            textures[number]["source"] = self._new_images[content]
            return number
        place = self._new_images[content] = min(self._free_images(), default=len(images))
        return self._put(number, place, content, {"name": name})

    def _put(self, texture: int, image: int, content: bytes, properties: dict[str, Any]) -> int:
        """Make a texture show a PNG or JPEG file as the image of this index; return the texture's index."""
        self.tree["images"][image : image + 1] = [{**properties, "mimeType": _type_of(content)}]
        self.tree["images"][image]["bufferView"] = self.view(content)
        self.tree["textures"][texture]["source"] = image
        return texture

    def _sampler(self, sampler: dict[str, Any]) -> int:
        samplers = self.tree.setdefault("samplers", [])
        if sampler not in samplers:
            samplers.append(sampler)
        return samplers.index(sampler)

    def _free_images(self) -> set[int]:
        """Return the images that textures used in the original file, and no longer use."""
        used_before, used_now = (
            set(_named(tree.get("textures", []), "source")) for tree in (self.source.tree, self.tree)
        )
        return used_before - used_now

    def forget(self) -> None:
        """Remove textures, images and views that were used in the original file and no longer are.

        Later ones move up. Nothing is removed if an extension of the file may refer to them by their indices.
        """
        if set(self.tree.get("extensions", {})) - WITHOUT_TEXTURES:
            return
        old, new = self.source.tree, self.tree
        number = self._without("textures", set(_textures_named(old)) - set(_textures_named(new)))
        for material in new.get("materials", []):
            for _, info in gltf_materials.slots(material):
                info["index"] = number[info["index"]]
        _renumber(new.get("textures", []), self._without("images", self._free_images()), "source")
        free = {n for n in _named(old, "bufferView") if n < len(self.views)} - set(_named(new, "bufferView"))
        self.views = [view for n, view in enumerate(self.views) if n not in free]
        _renumber(new, self._without("bufferViews", free), "bufferView")

    def _without(self, key: str, free: set[int]) -> dict[int, int]:
        """Remove items of a list of the file; return the new index of each other one by its old one."""
        items = self.tree.get(key, [])
        kept = [n for n in range(len(items)) if n not in free]
        items[:] = [items[n] for n in kept]
        if not items:
            self.tree.pop(key, None)
        return {old: new for new, old in enumerate(kept)}

    def bytes(self) -> bytes:
        """Return the file as GLB; pictures beside a .gltf are included.

        Raises:
            InputError: one of these is missing.
        """
        _make_roots(self.tree)
        for number, image in enumerate(self.tree.get("images", [])):
            if "uri" in image and not image["uri"].startswith("data:"):
                content = self.source.image(number)
                assert content is not None
                del image["uri"]
                image |= {"mimeType": image.get("mimeType", _type_of(content))}
                image["bufferView"] = self.view(content)
        return glb(self.tree, self.views)


def _make_roots(tree: dict[str, Any]) -> None:
    """Make the nodes of scenes roots, as the format demands (Khronos, *glTF 2.0*, §3.5.1).

    A node whose parent the scene does not show leaves that parent, so that the scene looks the same. One whose parent
    it shows is in the scene anyway.
    """
    nodes = tree.get("nodes", [])
    for scene in tree.get("scenes", []):
        scene_nodes = scene.get("nodes", [])
        children = {child for node in nodes for child in node.get("children", [])}
        reachable, waiting = set[int](), [number for number in scene_nodes if number not in children]
        while waiting:
            number = waiting.pop()
            if number not in reachable:
                reachable.add(number)
                waiting += nodes[number].get("children", [])
        detached = [number for number in scene_nodes if number in children and number not in reachable]
        if not children.intersection(scene_nodes):
            continue
        scene["nodes"] = [number for number in scene_nodes if number not in children or number in detached]
        for node in nodes:
            if set(node.get("children", [])) & set(detached):
                node["children"] = [child for child in node["children"] if child not in detached]
                if not node["children"]:
                    del node["children"]


@dataclass
class _SideEffects:
    """Changes of the materials of a file that follow from new texture coordinates.

    Attributes:
        staying_slots: slots that keep using the old coordinates, by the set that these are now.
        whitened: names of materials whose colour became white, in order.
        tinted_by_vertices: whether colours of vertices tint a new picture.
    """

    staying_slots: dict[int, list[str]] = field(default_factory=dict)
    whitened: dict[str, None] = field(default_factory=dict)
    tinted_by_vertices: bool = False

    @property
    def notes(self) -> list[str]:
        """Notes for the user, once for all materials."""
        notes = [
            f"still with the old coordinates, now TEXCOORD_{kept_set}: {gltf_materials.name_slots(slots)}; "
            "--carry-maps transfers them"
            for kept_set, slots in self.staying_slots.items()
        ]
        if self.whitened:
            names = first_names(list(self.whitened), NAMED_MATERIALS)
            notes.append(
                f"the colours of {names} are white now, so that they do not tint the picture"
                if len(self.whitened) > 1
                else f"the colour of {names} is white now, so that it does not tint the picture"
            )
        if self.tinted_by_vertices:
            notes.append("its vertex colours tint the picture in programs that show them")
        return notes


def with_coordinates(
    parts: Sequence[Primitive],
    faces: Flags,
    uv: Real,
    uv_corners: Index,
    pictures: Mapping[str, Mapping[str, bytes]],
    *,
    untinted: bool = False,
    kept: bool = False,
) -> tuple[bytes, list[str]]:
    """Return the file with new first texture coordinates for some triangles of primitives.

    Textures that use the old coordinates continue to do so: the old ones are kept as another set. Vertices are split
    with all their attributes where new coordinates differ. Where only some triangles of a primitive change, these
    become a separate primitive.

    Args:
        parts: the primitives, of one file.
        faces: (m,) marks the triangles that change, of all primitives one after the other.
        uv: (t, 2) coordinates, v up.
        uv_corners: (c,) index into `uv` for each corner of the marked triangles.
        pictures: PNG or JPEG files for the new coordinates, by material (`Primitive.key`) and slot (see
            `gltf_materials.slots`).
        untinted: whether new base colours are to be seen as they are: the colour factors of their materials, which
            multiply them, become white.
        kept: whether the coordinates are those of the base colours already, so that only pictures change.

    Returns:
        The bytes of a GLB file, and notes on textures that stay on the old coordinates, and on colours that tinted or
        still tint the new ones.
    """
    editor, effects = GltfEditor(parts[0].document), _SideEffects()
    faces_by_part = np.split(faces, np.cumsum([len(part.faces) for part in parts])[:-1])
    corners = np.split(uv_corners, 3 * np.cumsum([part_faces.sum() for part_faces in faces_by_part])[:-1])
    editor.will_change(
        holder.get("material")
        for part, part_faces in zip(parts, faces_by_part)
        if part_faces.all()
        for holder in (part.tree, *gltf_materials.variants(part.tree))
    )
    for part, part_faces, part_corners in zip(parts, faces_by_part, corners):
        if part_faces.any():
            shown = pictures.get(part.key, {})
            if kept:
                primitive = _alone(editor, part, part_faces)
                _rebind(editor, primitive, shown, None, kept=True)
                if untinted:
                    _untint(editor, primitive, part, effects)
                continue
            _change(editor, part, part_faces, uv, part_corners, shown, effects, untinted=untinted)
    editor.forget()
    return editor.bytes(), effects.notes


def _change(
    editor: GltfEditor,
    part: Primitive,
    faces: Flags,
    uv: Real,
    uv_corners: Index,
    pictures: Mapping[str, bytes],
    effects: _SideEffects,
    *,
    untinted: bool,
) -> None:
    """Give triangles (m,) of a primitive new coordinates. Arguments as for `with_coordinates`."""
    primitive = _alone(editor, part, faces)
    attributes, old_attributes = primitive["attributes"], dict(part.attributes)
    count = editor.tree["accessors"][attributes["POSITION"]]["count"]
    split = Split.of(part.faces[faces].ravel(), uv_corners, count)
    staying = _staying(editor, primitive, set(pictures)) if "TEXCOORD_0" in old_attributes else []
    kept_set = (
        next(k for k in range(len(old_attributes) + 2) if f"TEXCOORD_{k}" not in old_attributes)
        if staying
        else None
    )
    if kept_set is not None:
        attributes[f"TEXCOORD_{kept_set}"] = attributes.pop("TEXCOORD_0")
    _copy(editor, primitive, split, {"TEXCOORD_0"})
    old = (
        part.document.floats(old_attributes["TEXCOORD_0"])
        if "TEXCOORD_0" in old_attributes
        else np.zeros((count, 2))
    )
    values = split.values(np.column_stack([uv[:, 0], 1 - uv[:, 1]]), old).astype("<f4")
    attributes["TEXCOORD_0"] = editor.accessor(values, COORDINATES, ATTRIBUTE, attributes.get("TEXCOORD_0"))
    if split.copies.size or not faces.all() or primitive.get("mode", TRIANGLES_MODE) != TRIANGLES_MODE:
        _index(editor, primitive, split.number, primitive.get("indices"), split.order.size)
    _rebind(editor, primitive, pictures, kept_set)
    if kept_set is not None:
        effects.staying_slots.setdefault(kept_set, []).extend(staying)
    if untinted and gltf_materials.BASE in pictures:
        _untint(editor, primitive, part, effects)
    if "TANGENT" in attributes and "normalTexture" in pictures:
        _with_tangents(editor, primitive, part, split, uv, uv_corners, faces)


def parted(parts: Sequence[Primitive], owner: Index) -> tuple[Gltf, list[list[Primitive]]]:
    """Partition primitives of one file by the owner (m,) of each triangle, counted over all primitives.

    A primitive whose triangles have several owners is divided; the parts share its vertices. Returns the edited file,
    and for each owner its primitives.
    """
    editor = GltfEditor(parts[0].document)
    places: list[list[tuple[int, int]]] = [[] for _ in range(int(owner.max()) + 1)]
    for part, part_owner in zip(parts, np.split(owner, np.cumsum([len(part.faces) for part in parts])[:-1])):
        faces, inside = part.faces, editor.tree["meshes"][part.mesh]["primitives"]
        numbers = np.unique(part_owner)
        for number in numbers[1:]:
            count = part.document.tree["accessors"][part.attributes["POSITION"]]["count"]
            inside.append(deepcopy(inside[part.number]))
            _index(editor, inside[-1], faces[part_owner == number].ravel(), part.tree.get("indices"), count)
            places[number].append((part.mesh, len(inside) - 1))
        if numbers.size > 1:
            _index(
                editor,
                inside[part.number],
                faces[part_owner == numbers[0]].ravel(),
                part.tree.get("indices"),
                count,
            )
        if numbers.size:
            places[numbers[0]].append((part.mesh, part.number))
    edited = Gltf(parts[0].document.path, editor.tree, editor.views)
    return edited, [[Primitive(edited, *place) for place in group] for group in places]


def subdivided(parts: Sequence[Primitive], plan: Subdivision) -> tuple[Primitive, ...]:
    """Replace some triangles of primitives of one file, counted over all of them, by smaller ones."""
    source = parts[0].document
    editor = GltfEditor(source)
    first = 0
    for part in parts:
        in_part = (plan.faces >= first) & (plan.faces < first + len(part.faces))
        if in_part.any():
            smaller = Subdivision(
                plan.faces[in_part] - first, plan.corners[in_part] - 3 * first, plan.weights[in_part]
            )
            _subdivide(editor, part, smaller)
        first += len(part.faces)
    edited = Gltf(source.path, editor.tree, editor.views)
    return tuple(Primitive(edited, part.mesh, part.number) for part in parts)


def _subdivide(editor: GltfEditor, part: Primitive, plan: Subdivision) -> None:
    primitive = editor.tree["meshes"][part.mesh]["primitives"][part.number]
    faces, count = part.faces, editor.source.tree["accessors"][part.attributes["POSITION"]]["count"]
    mixed = plan.mixtures(faces.ravel(), count)
    corners, _ = with_triangles(3 * np.arange(len(faces) + 1), faces.ravel(), plan, mixed.number)
    for attributes in (primitive["attributes"], *primitive.get("targets", [])):
        old_attributes = dict(attributes)
        for name, number in old_attributes.items():
            values = _mixed(
                editor.source, old_attributes, name, mixed, target=attributes is not primitive["attributes"]
            )
            stored = np.concatenate([editor.source.values(number), values])
            attributes[name] = editor.accessor(
                stored, editor.source.tree["accessors"][number], ATTRIBUTE, number
            )
    _index(editor, primitive, corners, primitive.get("indices"), count + len(mixed.parents))


def _mixed(
    source: Gltf, attributes: Mapping[str, int], name: str, mixed: Mixtures, *, target: bool
) -> NDArray:
    """Interpolate an attribute at new vertices; return (n, k) values as stored.

    Feature ids are taken from the nearest old vertex.
    """
    kind, _, number = name.partition("_")
    if kind in ("JOINTS", "WEIGHTS"):
        return _bound(source, attributes, number, mixed)[kind]
    stored = source.values(attributes[name])
    nearest = stored[np.take_along_axis(mixed.parents, mixed.weights.argmax(axis=1)[:, None], 1)[:, 0]]
    if name.startswith("_FEATURE_ID"):
        return nearest
    values = mixed.of(stored)
    if name in ("NORMAL", "TANGENT") and not target:
        most = 1.0 if stored.dtype.kind == "f" else np.iinfo(stored.dtype).max
        values[:, :3] *= most / np.maximum(np.linalg.norm(values[:, :3], axis=1, keepdims=True), 1e-300)
        values[:, 3:] = nearest[:, 3:]
    return (values if stored.dtype.kind == "f" else np.round(values)).astype(stored.dtype)


def _bound(source: Gltf, attributes: Mapping[str, int], number: str, mixed: Mixtures) -> dict[str, NDArray]:
    """Return joints and weights of new vertices: the strongest among those of the old vertices."""
    joints, weights = (source.values(attributes[f"{kind}_{number}"]) for kind in ("JOINTS", "WEIGHTS"))
    contributions = mixed.weights[:, :, None] * weights[mixed.parents]
    # One row for each new vertex, with the joints of all its parents. The width is computed, because NumPy cannot infer
    # it where there are no new vertices.
    shape = len(contributions), contributions.shape[1] * contributions.shape[2]
    contributions, names = contributions.reshape(shape), joints[mixed.parents].reshape(shape)
    alike = names[:, :, None] == names[:, None, :]
    total = np.einsum("nij,nj->ni", alike, contributions)
    total[np.tril(alike, -1).any(axis=2)] = 0.0  # count each joint once
    order = np.argsort(-total, axis=1, kind="stable")[:, : joints.shape[1]]
    names, total = np.take_along_axis(names, order, 1), np.take_along_axis(total, order, 1)
    sums = contributions.sum(axis=1, keepdims=True)
    total *= sums / np.maximum(total.sum(axis=1, keepdims=True), 1e-300)
    names[total <= 0] = 0
    stored = total if weights.dtype.kind == "f" else np.round(total)
    return {"JOINTS": names.astype(joints.dtype), "WEIGHTS": stored.astype(weights.dtype)}


Cornerwise = tuple[Real, Index]
"""Values (n, k), and the indices of values at the corners of triangles (m, 3)."""


def plain(
    name: str,
    points: Cornerwise,
    normals: Cornerwise | None,
    uv: Cornerwise | None = None,
    owner: Index | None = None,
) -> Gltf:
    """Return a file with one mesh whose vertices are the distinct corners of triangles.

    Args:
        name: of the mesh and its node.
        points: positions.
        normals: unit normals, or None.
        uv: texture coordinates, v up; None if they will be added later.
        owner: (m,) index of each triangle's primitive; one primitive by default.
    """
    cornerwise = [pair for pair in (points, uv, normals) if pair is not None]
    first, number = distinct_rows(np.stack([corners.ravel() for _, corners in cornerwise], axis=1))
    faces, positions = number.reshape(-1, 3), points[0][points[1].ravel()[first]].astype("<f4")
    tree: dict[str, Any] = {"asset": {"version": "2.0", "generator": "iccm"}, "scene": 0}
    tree |= {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": name}]}
    attributes: dict[str, int] = {}
    primitives = tree.setdefault("meshes", [{"name": name, "primitives": [{"attributes": attributes}]}])[0]
    editor = GltfEditor(Gltf(None, {}, []))  # type: ignore[arg-type]
    editor.tree = tree
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    attributes["POSITION"] = editor.accessor(positions, POINTS | bounds, ATTRIBUTE)
    if normals is not None:
        values = normals[0][normals[1].ravel()[first]].astype("<f4")
        attributes["NORMAL"] = editor.accessor(values, POINTS, ATTRIBUTE)
    if uv is not None:
        u, v = uv[0][uv[1].ravel()[first]].T
        values = np.column_stack([u, 1 - v]).astype("<f4")
        attributes["TEXCOORD_0"] = editor.accessor(values, COORDINATES, ATTRIBUTE)
    owner = np.zeros(len(faces), np.int64) if owner is None else owner
    filled: list[dict[str, Any]] = []
    for k in range(int(owner.max()) + 1):
        filled.append({"attributes": dict(attributes), "mode": TRIANGLES_MODE})
        primitives["primitives"] = [*filled, {"attributes": attributes}]  # so that they count as used
        _index(editor, filled[-1], faces[owner == k].ravel(), None, len(positions))
    primitives["primitives"] = filled
    return Gltf(None, tree, editor.views)  # type: ignore[arg-type]


def _alone(editor: GltfEditor, part: Primitive, faces: Flags) -> dict[str, Any]:
    """Return a primitive with only the triangles that change; the others stay in the original primitive."""
    inside = editor.tree["meshes"][part.mesh]["primitives"]
    old = inside[part.number]
    if faces.all():
        return old
    new = deepcopy(old)
    count = editor.tree["accessors"][old["attributes"]["POSITION"]]["count"]
    _index(editor, old, part.faces[~faces].ravel(), old.get("indices"), count)
    if "indices" in new:
        new.pop("indices")
    inside.append(new)
    return new


def _index(editor: GltfEditor, primitive: dict, vertices: Index, instead: int | None, count: int) -> None:
    """Give a primitive its triangles as a list of vertex indices."""
    kind = next(k for k, most in ((5121, 255), (5123, 65535), (5125, 2**32 - 1)) if count <= most)
    kind = max(kind, editor.tree["accessors"][instead]["componentType"] if instead is not None else 5123)
    values = vertices.astype({5121: "<u1", 5123: "<u2", 5125: "<u4"}[kind])[:, None]
    accessor = {"componentType": kind, "type": "SCALAR"}
    primitive["indices"] = editor.accessor(values, accessor, INDEX, instead)
    if primitive.get("mode", TRIANGLES_MODE) != TRIANGLES_MODE:
        primitive["mode"] = TRIANGLES_MODE


def _copy(editor: GltfEditor, primitive: dict, split: Split, but: set[str]) -> None:
    """Copy all attributes of vertices that are split, including those of morph targets."""
    if not split.copies.size:
        return
    for attributes in (primitive["attributes"], *primitive.get("targets", [])):
        for name in attributes:
            if name not in but or attributes is not primitive["attributes"]:
                values = editor.source.values(attributes[name])[split.order]
                accessor = editor.source.tree["accessors"][attributes[name]]
                attributes[name] = editor.accessor(values, accessor, ATTRIBUTE, attributes[name])


def _staying(editor: GltfEditor, primitive: dict, pictures: set[str]) -> list[str]:
    """Return the slots of the material and its variants that keep using the old coordinates."""
    material_number = primitive.get("material")
    staying = list[str]()
    for number in [material_number, *(mapping["material"] for mapping in gltf_materials.variants(primitive))]:
        material = {} if number is None else editor.source.tree["materials"][number]
        repainted = _shown(material, pictures) if number == material_number else set()
        staying += [
            slot
            for slot, info in gltf_materials.slots(material)
            if set_of(info) == 0 and slot not in repainted
        ]
    return staying


def _shown(material: dict, pictures: set[str]) -> set[str]:
    """Return the slots that new pictures go into; the base colour may have two."""
    twice = gltf_materials.BASE in pictures and gltf_materials.DIFFUSE in dict(gltf_materials.slots(material))
    return pictures | ({gltf_materials.DIFFUSE} if twice else set())


def _rebind(
    editor: GltfEditor,
    primitive: dict,
    pictures: Mapping[str, bytes],
    kept_set: int | None,
    *,
    kept: bool = False,
) -> None:
    """Give the primitive its own materials if they change: new pictures, or other slots on the kept coordinates.

    If all coordinates are kept, new pictures lie where the base colour did.
    """
    if not pictures and kept_set is None:
        return
    material_number = primitive.get("material")
    for holder in [primitive, *gltf_materials.variants(primitive)]:
        new = pictures if holder is primitive else {}
        moved_to = kept_set if holder is primitive or material_number is not None else None
        change = tuple(sorted(new.items())), moved_to
        holder["material"], is_made = editor.own_material(holder.get("material"), change)
        if is_made:
            continue
        material = editor.tree["materials"][holder["material"]]
        slots = _shown(material, set(new))
        old_textures = {slot: info["index"] for slot, info in gltf_materials.slots(material)}
        contents = {
            slot: (new.get(slot, new.get(gltf_materials.BASE, b"")), old_textures.get(slot)) for slot in slots
        }
        uses = Counter(contents.values())
        place = deepcopy(gltf_materials.base(material)) if kept else {}
        for slot, (content, old) in sorted(contents.items()):
            texture = editor.texture(content, old, uses[content, old])
            gltf_materials.set_texture(material, slot, texture, place)
        if moved_to is not None:
            gltf_materials.move_maps(material, moved_to, slots)


def _untint(editor: GltfEditor, primitive: dict, part: Primitive, effects: _SideEffects) -> None:
    """Make the colour factor of a primitive's material white, so that it does not tint its texture.

    Vertex colours are kept, because programs use them for other purposes, too.
    """
    material = editor.tree["materials"][primitive["material"]]
    if gltf_materials.remove_tint(material):
        effects.whitened[material.get("name") or "a material"] = None
    if VERTEX_COLOURS in part.attributes:
        colours = part.document.floats(part.attributes[VERTEX_COLOURS])[:, :3]
        effects.tinted_by_vertices |= bool((colours != 1).any())


def _with_tangents(
    editor, primitive: dict, part: Primitive, split: Split, uv, uv_corners, faces: Flags
) -> None:
    """Recompute tangents for the new coordinates."""
    document, attributes = part.document, primitive["attributes"]
    corners = part.faces[faces]
    points = document.floats(part.attributes["POSITION"])
    normals = document.floats(part.attributes["NORMAL"]) if "NORMAL" in part.attributes else None
    sheet = Charted(
        "", points, corners, uv, uv_corners.reshape(-1, 3), normals, None if normals is None else corners
    )
    values = editor.source.floats(part.attributes["TANGENT"])[split.order]
    tangents = np.concatenate(
        [sheet.frames[1], np.broadcast_to(sheet.mirrored[:, None, None], (len(corners), 3, 1))], axis=2
    )
    values[split.number] = tangents.reshape(-1, 4)
    attributes["TANGENT"] = editor.accessor(values.astype("<f4"), TANGENTS, ATTRIBUTE, attributes["TANGENT"])


def _type_of(content: bytes) -> str:
    return {".webp": "image/webp", ".jpg": "image/jpeg"}.get(formats.suffix_of_content(content), "image/png")


def _references(tree: Any, *keys: str) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield each object anywhere in a tree that stores an integer under one of some keys, with the key."""
    if isinstance(tree, list):
        for value in tree:
            yield from _references(value, *keys)
    elif isinstance(tree, dict):
        for key, value in tree.items():
            if key in keys and isinstance(value, int):
                yield tree, key
            elif key != "extras":
                yield from _references(value, *keys)


def _named(tree: Any, *keys: str) -> Iterator[int]:
    """Yield the integers stored under some keys, anywhere in a tree."""
    return (holder[key] for holder, key in _references(tree, *keys))


def _renumber(tree: Any, number: Mapping[int, int], key: str) -> None:
    """Replace the integers stored under a key, anywhere in a tree."""
    for holder, _ in _references(tree, key):
        holder[key] = number[holder[key]]


def _textures_named(tree: dict) -> Iterator[int]:
    for material in tree.get("materials", []):
        yield from (info["index"] for _, info in gltf_materials.slots(material))


def _accessors_named(tree: dict) -> Iterator[int]:
    yield from _named(tree, "indices", "inverseBindMatrices", "input", "output")
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            for attributes in (primitive["attributes"], *primitive.get("targets", [])):
                yield from attributes.values()
    for node in tree.get("nodes", []):
        for extension in node.get("extensions", {}).values():
            yield from extension.get("attributes", {}).values()
