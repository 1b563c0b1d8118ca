"""Write meshes with transferred materials: GLB, or OBJ with its library and pictures."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

from .. import files
from ..meshes import gltf, gltf_materials, gltf_write, material_library, obj_materials, obj_write
from ..meshes.gltf_format import as_named, primitives_of
from ..meshes.material_library import Library
from ..meshes.obj_format import obj_content
from ..pictures.image_files import as_png
from . import gltf_assignment, of_gltf, translate
from .carried import MaterialBaker, Pictures, convert_each, without_profile
from .gltf_assignment import MaterialAssignment
from .relaid import Relaid


def write(relaid: Relaid, out: Path, *, force: bool) -> list[str]:
    """Write the mesh to a temporary file; return the names of companion files.

    Raises:
        InputError: a picture cannot be read, or a companion file cannot be written.
    """
    if relaid.dialect == "mtl":
        return _obj(relaid, out, force)
    out.write_bytes(as_named(_glb(relaid), relaid.name))
    return []


def companion_files(relaid: Relaid) -> list[Path]:
    """Return all files that may be written beside the mesh."""
    if relaid.dialect == "gltf":
        return []
    words = {word for source_material in relaid.before.materials for word in source_material.maps}
    if relaid.before.dialect == "gltf":
        words = {*translate.TO_MTL.values(), *translate.GREYS, translate.COVER}
    names = [source_material.name for source_material in relaid.after.materials]
    return [
        relaid.name.with_suffix(".mtl"),
        *(_picture(relaid, name, word) for name in names for word in words),
    ]


def _glb(relaid: Relaid) -> bytes:
    primitives = primitives_of(relaid.meshes[0])
    if primitives:
        laid_out = [primitive for primitive in primitives if of_gltf.has_layout(primitive)]
        document, groups = gltf_write.parted(laid_out, relaid.owner)
    else:
        document = gltf_assignment.sheets(relaid.meshes[0].path.stem, relaid.after.sheet, relaid.owner)
        groups = [[gltf.Primitive(document, 0, k)] for k in range(len(relaid.bakers))]
    assignments = [
        _assignment(relaid, baker, images, group)
        for baker, images, group in zip(relaid.bakers, relaid.pictures, groups)
        if baker.material is not None
    ]
    used = dict.fromkeys(
        name for assignment in assignments for name in assignment.material.get("extensions", {})
    )
    return gltf_assignment.assign_materials(document, assignments, list(used))


def _assignment(
    relaid: Relaid, baker: MaterialBaker, images: Pictures, group: list[gltf.Primitive]
) -> MaterialAssignment:
    source_material, samplers = baker.material, {}
    assert source_material is not None
    if relaid.before.dialect == "gltf":
        material = deepcopy(source_material.source)
        of_gltf.multiplied_slots(material, baker.multiplied)
        samplers = {slot: map.options for slot, map in source_material.maps.items() if map.options}
    else:
        images, material, notes = translate.to_gltf(
            convert_each(images, without_profile), baker.kinds, source_material
        )
        relaid.add_notes(notes)
    if baker.origin(baker.size).grid.report["outside_triangles"]:
        samplers = {slot: sampler | gltf_materials.REPEATING for slot, sampler in samplers.items()}
    layout, pictures = of_gltf.layout_of(group[0]), convert_each(images, as_png)
    return MaterialAssignment(group, material, pictures, samplers, layout, relaid.settings.vertex_colours)


def _obj(relaid: Relaid, out: Path, force: bool) -> list[str]:
    content, faces, library = (
        obj_content(relaid.meshes[0]),
        relaid.meshes[0].faces,
        relaid.name.with_suffix(".mtl"),
    )
    assert content is not None  # see Relaid.check
    whole, materials = content.obj, content.library
    rename, plain = obj_materials.rename(whole, faces)
    relaid.notes += materials.missing
    statements, contents = dict[str, list[str]](), dict[Path, bytes]()
    for baker, images, old in zip(relaid.bakers, relaid.pictures, relaid.after.materials):
        if baker.material is None:
            continue
        images, lines = _statements(relaid, baker, images)
        first_word: dict[int, str] = {}  # statements with the same picture share its file
        for word, image in images.items():
            first_word.setdefault(id(image), word)
        paths = {word: _picture(relaid, old.name, first_word[id(image)]) for word, image in images.items()}
        contents |= {paths[word]: content for word, content in convert_each(images, as_png).items()}
        names = {word: material_library.name_of(path, library.parent) for word, path in paths.items()}
        new_name = rename[old.name if old.name in rename else None]  # a name may be empty
        body = [f"newmtl {new_name}", *(line for line in lines if _stays(line, set(images)))]
        statements[new_name] = material_library.with_maps(body, names)
    unchanged = [
        line for name, lines in materials.materials.items() if name not in statements for line in lines
    ]
    text = material_library.bind(Library(tuple(unchanged), materials.folder), {}, plain, {}, library)
    text += "".join(f"{line}\n" for lines in statements.values() for line in lines)
    contents[library] = text.lstrip("\n").encode("utf-8", "surrogateescape")
    binding = obj_write.Binding(library.name, rename, plain)
    out.write_bytes(obj_write.rebind(whole, faces, binding))
    for path, data in contents.items():
        files.write_bytes(path, data, force=force)
    return [str(path) for path in contents]


def _statements(relaid: Relaid, baker: MaterialBaker, images: Pictures) -> tuple[Pictures, list[str]]:
    """Return the pictures of a material by statement, and its other lines."""
    assert baker.material is not None
    if relaid.before.dialect == "mtl":
        return images, list(baker.material.source or translate.PLAIN)
    material = replace(baker.material, source=deepcopy(baker.material.source))
    of_gltf.multiplied_slots(material.source, baker.multiplied)
    images, lines, notes = translate.to_mtl(convert_each(images, without_profile), material)
    relaid.add_notes(notes)
    return images, lines


def _stays(line: str, words: set[str]) -> bool:
    """Return whether a line of an old material is kept: it refers to no picture, or to one that was transferred."""
    word = material_library.split(line)[0].lower()
    return word != "newmtl" and (word in words or not word.startswith(material_library.MAPS))


def _picture(relaid: Relaid, material: str, word: str) -> Path:
    """Return the path of a material's picture."""
    several = len(relaid.after.materials) > 1
    return material_library.picture_of(relaid.name, material if several else None, word)
