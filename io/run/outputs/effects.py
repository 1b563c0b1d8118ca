"""What options of a map need in order to have an effect; see `requirements`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ... import formats
from .. import requirements
from ..requirements import Requirement
from ..texture import has_texture, is_rendered, on_paper, shows_itself
from .plot import Plot

if TYPE_CHECKING:
    from ..state import Run
    from .output import Output

Outputs = Sequence["Output"]


def refuse(run: Run, outputs: Outputs) -> tuple[str, ...]:
    """Return the options without effect that were given for several jobs of a batch.

    Raises:
        InputError: an option that was given for this job has no effect.
    """
    return requirements.refuse(run.job, REQUIREMENTS, run, outputs)


def _shows(run: Run, outputs: Outputs) -> bool:
    return any(output.shows for output in outputs)


def _shows_place(run: Run, outputs: Outputs) -> bool:
    """Whether an output depends on where the texture lies on the source."""
    return any(output.shows or output.name == run.job.stmap for output in outputs)


def _samples(run: Run, outputs: Outputs) -> bool:
    """Whether an output shows resampled colours of the texture."""
    return any(output.samples or isinstance(output, Plot) for output in outputs)


def _has_raster(run: Run, outputs: Outputs) -> bool:
    """Whether an output has pixels, or describes those of a picture."""
    return any(
        output.samples or output.name == run.job.stmap or formats.of(output.name).world for output in outputs
    )


def _pads(run: Run, outputs: Outputs) -> bool:
    """Whether an output has a picture whose colours can be extended, be it in a mesh."""
    return _has_raster(run, outputs) or run.job.carry_maps


def _has_size(run: Run, outputs: Outputs) -> bool:
    """Whether --size has an effect; its proportions are also those of the charts of a mesh."""
    return _has_raster(run, outputs) or run.target.is_mesh


def _has_box(run: Run, outputs: Outputs) -> bool:
    """Whether --target-box has an effect; a saved map keeps it for pictures that are carried later."""
    return _has_raster(run, outputs) or any(
        formats.of(output.name).map or formats.of(output.name).drawing for output in outputs
    )


def _has_edge(run: Run, outputs: Outputs) -> bool:
    """Whether an output depends on what lies beyond the texture's edge. Textures of meshes repeat anyway."""
    repeats = run.job.edge in ("repeat", "mirror")
    return _shows_place(run, outputs) if repeats else _samples(run, outputs)


def _reads_picture(run: Run, outputs: Outputs) -> bool:
    """Whether the texture is read from a picture, rather than drawn."""
    is_read = has_texture(run.job, run.source) and not is_rendered(run.job, run.source)
    return is_read and _samples(run, outputs)


def _has_background(run: Run, outputs: Outputs) -> bool:
    """Whether --background decides what is seen behind the result: another value would give another picture."""
    if run.job.background == "target":
        return True  # see `_shows_target`
    if run.job.background == "paper":
        return on_paper(run.job, run.source)
    return shows_itself(run.job, run.source)


def _shows_target(run: Run, outputs: Outputs) -> bool:
    """Whether an output can show the target's own drawing, and there is one, if --background asks for it."""
    if run.job.background != "target":
        return True
    from ..background import has_own_picture

    return any(output.shows_target for output in outputs) and has_own_picture(run.target)


def _has(*constraints: str) -> Callable[[Run, Outputs], bool]:
    return lambda run, outputs: (
        run.job.several or any(run.constraints.get(name) is not None for name in constraints)
    )


def _compares_detail(run: Run, outputs: Outputs) -> bool:
    job = run.job
    return job.detail == 0 or (job.exact and has_texture(job, run.source) and run.detail is not None)


def _finds_faces(run: Run, outputs: Outputs) -> bool:
    return run.job.faces == "off" or (run.detail is not None and bool(run.detail.faces))


def _has_mesh(run: Run, outputs: Outputs) -> bool:
    return any(shape.is_mesh for pair in run.pairs for shape in pair)


def _bakes(run: Run, outputs: Outputs) -> bool:
    return run.job.bake


def _writes_mesh(run: Run, outputs: Outputs) -> bool:
    return any(output.is_mesh for output in outputs)


PICTURE = "no picture is written; write one with -o FILE.png"
TEXTURE = "none of the outputs shows a texture; write a picture with -o FILE.png"

OF_CONSTRAINTS = (
    Requirement(("exact_pins", "pin_weight"), _has("pins"), "there are no pins; add some with --pin"),
    Requirement(("stroke_weight",), _has("strokes"), "there are no strokes; add some with --constraints"),
    Requirement(
        ("rigid_each",), _has("rigid", "rigid_target"), "there are no rigid regions; add some with --rigid"
    ),
)
REQUIREMENTS = (
    *OF_CONSTRAINTS,
    Requirement(("texture_scale", "texture_offset", "texture_turn", "texture_box"), _shows_place, TEXTURE),
    Requirement(("edge",), _has_edge, TEXTURE),
    Requirement(("filter",), _samples, TEXTURE),
    Requirement(("size",), _has_size, PICTURE),
    Requirement(("target_box",), _has_box, PICTURE),
    Requirement(("padding",), _pads, PICTURE),
    Requirement(("overlap",), _bakes, "nothing is baked; use --bake"),
    Requirement(
        ("colorspace",),
        _reads_picture,
        "the texture is not read from a picture that is resampled; name one with --texture",
    ),
    Requirement(
        ("background",),
        _has_background,
        "only a drawing that is its own texture, and fills the target, has gaps that show paper",
    ),
    Requirement(
        ("background",),
        _shows_target,
        "the target's drawing is only shown in pictures and .svg files, and if the target is an SVG or DXF file, a "
        "picture or a text",
    ),
    Requirement(
        ("detail",),
        _compares_detail,
        "maps are compared by detail only with the balanced method, for a drawing or photo that fills a planar target "
        "and is not moved on its source (--texture-offset and the like)",
    ),
    Requirement(("faces",), _finds_faces, "no face is found in a photo that fills a planar target"),
    Requirement(("cut_open", "no_cut"), _has_mesh, "none of the shapes is a mesh in space"),
    Requirement(
        ("carry_maps", "subdivide_rim"), _writes_mesh, "no mesh is written; write one with -o FILE.glb"
    ),
)
