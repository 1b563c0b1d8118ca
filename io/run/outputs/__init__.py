"""The outputs of a run, with a module for each kind that is imported only when needed.

output         the interface of all kinds of output
checks         checks shared by several kinds
effects        options without effect
picture        the texture on the target's canvas
artwork        the drawing as SVG
dxf_drawing    the drawing as DXF
textured_mesh  the mesh with new texture coordinates
new_uvs        computing these coordinates
baked          the texture in the mesh's own layout
baked_mesh     the mesh with its own layout, and the texture in it
stmap          the map as a picture
world_file     where the picture lies on a map of the earth
saved_map      the map itself, without loss
handles        the map with a lattice of pins, to edit it
plot           the figure
preview        the contact sheet of a textured mesh
compared       the contact sheet of all fits
"""

from copy import copy
from importlib import import_module

from ....errors import InputError
from ... import files, formats
from ...pictures.tiles import MARK, name_at
from ...point_syntax import vertex_of
from ...shapes.silhouette import PHOTOGRAPH
from ...spec import Spec
from ..inputs import Inputs
from ..job import Job, is_mesh, is_picture
from ..state import Run
from ..texture import shows_itself
from . import checks, effects
from .output import Output


def of(job: Job, inputs: Inputs) -> list[Output]:
    """Return all outputs of a job except its report.

    Raises:
        InputError: a suffix is unknown, or an output cannot be made from these shapes.
    """
    onto_mesh = job.target is not None and inputs.is_mesh(job.target)
    if job.bake and not onto_mesh:
        raise InputError(f"{job.target or job.source}: --bake needs a mesh as the target")
    if job.bake and not (job.stmap or any(is_picture(name) or is_mesh(name) for name in job.output)):
        raise InputError("--bake: only affects pictures and meshes; write one with -o FILE.png or FILE.glb")
    outputs = [_load(_kind(name, job), name) for name in job.output]
    if job.max_line_error and not any(
        formats.of(name).drawing and not formats.of(name).mesh for name in job.output
    ):
        raise InputError("--max-line-error: only affects drawings; write one with -o FILE (.svg, .dxf)")
    if job.handles and not any(formats.of(name).constraints for name in job.output):
        raise InputError("--handles: name a file for them, such as -o handles.json")
    if job.subdivide and not onto_mesh:
        raise InputError(f"{job.target or job.source}: --subdivide needs a mesh as the target")
    if job.subdivide and any(vertex_of(pin[1]) is not None for pin in job.pin):
        raise InputError(
            "--subdivide: vertices get other numbers; give --pin the positions of points instead"
        )
    for output, map in zip((picture for picture in outputs if is_picture(picture.name)), job.maps):
        output.map = map
    outputs += [_load("plot.Plot", job.plot)] if job.plot else []
    outputs += [_load("preview.Preview", job.preview)] if job.preview else []
    outputs += [_load("compared.Compared", job.compare)] if job.compare else []
    outputs += [_load("stmap.STMap", job.stmap)] if job.stmap else []
    for output in outputs:
        output.suit(job, onto_mesh)
    return outputs


def check(run: Run, requested: list[Output]) -> list[Output]:
    """Return the outputs, with names that contain `<UDIM>` expanded to one output per tile.

    Checks, before solving, everything that could fail afterwards, and notes problems of the inputs.

    Raises:
        InputError: from one of the outputs, or because the texture cannot be transferred.
    """
    from ...shapes.holes import about

    outputs = [
        expanded
        for output in requested
        for expanded in (_tiles_of(run, output) if MARK in output.name else [output])
    ]
    names = {output.name for output in requested}
    _check_others(run, [output.name for output in outputs if output.name not in names])
    for output in outputs:
        output.check(run.with_texture(output.map))
    checks.source(run)
    if run.job.texture:
        checks.texture(run)
        if not any(output.shows for output in outputs):
            run.note(
                f"{run.job.texture}: none of the outputs shows this texture; write a picture with -o FILE.png"
            )
    run.idle = effects.refuse(run, outputs)
    _check_others(run, [name for output in outputs for name in output.companion_files(run)])
    run.note(*notes_on_shapes(run))
    run.note(*about(run.pairs, keep=run.job.holes != "fill", mapped=run.job.holed))
    return outputs


def notes_on_shapes(run: Run) -> list[str]:
    """Return what was noted while the shapes were read.

    That the whole of a photo is used is expected of a source that shows itself, so only other photos are noted.
    """
    return [
        f"{shape.spec}: {note}"
        for source, target in run.pairs
        for shape in (source, target)
        for note in shape.notes
        if note != PHOTOGRAPH or shape is not source or not shows_itself(run.job, source)
    ]


def tell_share(run: Run) -> None:
    """Report the share of a mesh file's faces that is mapped, and note if it is not all and no part was selected."""
    if run.job.target is None or not run.target.is_mesh:
        return
    from ...shapes.mesh_shape import as_mesh

    file = as_mesh(run.whole(1)).file
    mapped, total = int(file.faces.sum()), file.total or file.faces.size
    run.figures["mapped"] = mapped / total
    if mapped < total and not Spec.of(run.job.target).selection:
        whole = run.job.several or as_mesh(run.target).packed
        cure = "" if whole else "; --parts each maps the source onto every part"
        run.note(f"{run.target.spec}: {mapped} of {total} faces are mapped ({mapped / total:.0%}){cure}")


def _check_others(run: Run, names: list[str]) -> None:
    """Check files that are written in addition to those named by the job."""
    if names:
        files.check_outputs(names, run.inputs.named, force=run.job.force, taken=run.job.outputs)


def _tiles_of(run: Run, output: Output) -> list[Output]:
    """Return the output for each tile of the target's layout.

    Raises:
        InputError: the output cannot be written by tile, or faces lie outside of numbered tiles.
    """
    if not (output.tiles and run.target.has_uv and (run.job.bake or run.target.is_layout)):
        cure = f"use --bake, or {run.target.spec}#uv as the target"
        raise InputError(f"{output.name}: <UDIM> is for pictures of a mesh's texture coordinates; {cure}")
    from ...shapes.mesh_shape import as_mesh

    outputs = []
    for tile in sorted(
        set().union(*(as_mesh(target).tiles for _, target in run.pairs)), key=lambda z: (z.imag, z.real)
    ):
        tile_output = copy(output)
        tile_output.name, tile_output.tile = name_at(output.name, tile, run.target.spec), tile
        outputs.append(tile_output)
    return outputs


def _kind(name: str, job: Job) -> str:
    """Return the module and class for a file name given by -o."""
    format = formats.of(name)
    if format.mesh:
        return "baked_mesh.BakedMesh" if job.bake else "textured_mesh.TexturedMesh"
    if format.world:
        return "world_file.WorldFile"
    if format.map:
        return "saved_map.SavedMap"
    if format.constraints:
        return "handles.Handles"
    if formats.suffix_of(name) == ".dxf":
        return "dxf_drawing.DxfDrawing"
    if format.drawing:
        return "artwork.Artwork"
    return "baked.Baked" if job.bake else "picture.Picture"


def _load(kind: str, name: str) -> Output:
    module, _, class_name = kind.partition(".")
    return getattr(import_module(f".{module}", __name__), class_name)(name)
