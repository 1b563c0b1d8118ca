"""Assign new materials to primitives of a glTF file that is otherwise unchanged; and make glTF files from sheets."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from ...arrays import Index
from ...meshes.charted import Charted
from ..meshes import gltf_materials
from ..meshes.gltf import Gltf, Primitive
from ..meshes.gltf_write import GltfEditor, plain


@dataclass(frozen=True, eq=False)
class MaterialAssignment:
    """A material for primitives.

    Attributes:
        primitives: of one file.
        material: its JSON; textures in it are replaced.
        pictures: PNG or JPEG files by slot (see `gltf_materials.slots`).
        samplers: JSON of the samplers for these, where there are any.
        coordinates: index of the set of texture coordinates.
        without_colours: whether to remove vertex colors from the primitives, because the pictures include them.
    """

    primitives: Sequence[Primitive]
    material: dict[str, Any]
    pictures: Mapping[str, bytes]
    samplers: Mapping[str, dict[str, Any]]
    coordinates: int = 0
    without_colours: bool = False


def assign_materials(
    document: Gltf, assignments: Sequence[MaterialAssignment], used: Sequence[str] = ()
) -> bytes:
    """Return the file as GLB with these materials; `used` lists the extensions that they need."""
    editor = GltfEditor(document)
    materials = editor.tree.setdefault("materials", [])
    numbers = [_exclusive_material(editor, assignment) for assignment in assignments]
    for number in numbers:
        materials[number] = {}
    for number, assignment in zip(numbers, assignments):
        materials[number] = deepcopy(assignment.material)
        _paint(editor, materials[number], assignment)
        for part in assignment.primitives:
            primitive = editor.tree["meshes"][part.mesh]["primitives"][part.number]
            primitive["material"] = number
            if assignment.without_colours:
                primitive["attributes"].pop(gltf_materials.VERTEX_COLOURS, None)
    if extensions := [name for name in used if name not in editor.tree.get("extensionsUsed", [])]:
        editor.tree.setdefault("extensionsUsed", []).extend(extensions)
    editor.forget()
    return editor.bytes()


def _exclusive_material(editor: GltfEditor, assignment: MaterialAssignment) -> int:
    """Return the index of the material that only these primitives use, or of a new one."""
    assigned = {(part.mesh, part.number) for part in assignment.primitives}
    number = assignment.primitives[0].tree.get("material")
    users = {
        (k, n)
        for k, mesh in enumerate(editor.tree["meshes"])
        for n, primitive in enumerate(mesh["primitives"])
        for variant in (primitive, *gltf_materials.variants(primitive))
        if variant.get("material") == number
    }
    if number is not None and users <= assigned:
        return number
    editor.tree["materials"].append({})
    return len(editor.tree["materials"]) - 1


def _paint(editor: GltfEditor, material: dict[str, Any], assignment: MaterialAssignment) -> None:
    """Make a material of the file show its new pictures and no others."""
    gltf_materials.bare(material, set(assignment.pictures))
    for slot, content in sorted(assignment.pictures.items()):
        name = (
            f"{material.get('name', '')} {gltf_materials.name_slots([slot]).removesuffix('Texture')}".strip()
        )
        texture = editor.new_texture(content, assignment.samplers.get(slot), name)
        gltf_materials.set_texture(material, slot, texture, {"texCoord": assignment.coordinates})


def sheets(name: str, whole: Charted, owner: Index) -> Gltf:
    """Return a file with one mesh, which has a primitive for each value of the triangles' owner (m,), in order."""
    stated = (
        None if whole.normals is None or whole.normal_faces is None else (whole.normals, whole.normal_faces)
    )
    return plain(name, (whole.points, whole.faces), stated, (whole.uv, whole.uv_faces), owner)
