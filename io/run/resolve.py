"""Completion of a job before its inputs become shapes: values that depend on files are filled in once.

What depends only on other values, such as which output is the STMap, is filled in by `Job` itself. This module fills in
names of outputs, whether outputs of an earlier run may be replaced, whether two meshes are mapped piece by piece, and
pins between the same vertices of two meshes.
After that a job does not change.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from ...errors import InputError
from .. import files, formats
from ..spec import Spec, short_name
from . import earlier, outputs
from .inputs import Inputs
from .job import STEM, WRITTEN, Job, pair_outputs
from .outputs.output import Output


@dataclass(frozen=True)
class Resolved:
    """A complete job.

    Attributes:
        job: with the names of its outputs.
        inputs: the files that it reads.
        writers: its outputs.
        notes: on what was filled in.
        refusal: why an output may not be written; mistakes in the inputs are reported first.
    """

    job: Job
    inputs: Inputs
    writers: list[Output]
    notes: list[str]
    refusal: InputError | None


def resolve(job: Job, *, again: bool = False) -> Resolved:
    """Fill in the values that depend on the files of a job.

    Args:
        job: as given.
        again: whether outputs that an earlier run of the same shapes wrote may be replaced, see `earlier`.

    Raises:
        InputError: an input is invalid, or an output cannot be made.
    """
    inputs = Inputs(job)
    job = by_pieces(name_outputs(job, inputs), inputs)
    if job.along is not None:
        from .along import with_box

        job = with_box(job, inputs)
    inputs = inputs.of_job(job)
    earlier_outputs = earlier.own_outputs(job) if again and not job.force else set()
    writers = outputs.of(job, inputs)
    formats.check_report(job.report)
    refusal: InputError | None = None
    try:
        files.check_outputs(job.outputs, job.inputs, force=job.force, replaceable=earlier_outputs)
    except InputError as error:
        refusal = error
    if earlier_outputs:  # all existing outputs are from earlier runs
        job = job.model_copy(update={"force": True})
    job, inputs, notes = pin_same_vertices(job, inputs.of_job(job))
    return Resolved(job, inputs, writers, notes, refusal)


def by_pieces(job: Job, inputs: Inputs) -> Job:
    """Return the job with `--parts all` if it maps two meshes as a whole, and one of them has several pieces.

    Raises:
        InputError: a mesh cannot be read.
    """
    is_for_one_shape = any(
        (job.has_pins, job.rigid, job.rigid_target, job.importance, job.size_map, job.start)
    )
    one_map = any(formats.of(name).map for name in job.output if name != "-")
    if (
        job.parts != "auto"
        or not job.target
        or job.plane == "uv"
        or is_for_one_shape
        or one_map
        or job.subdivide_rim
    ):
        return job
    specs = job.source, job.target
    if not all(map(inputs.is_mesh, specs)) or any(map(inputs.is_layout, specs)):
        return job
    counts = [inputs.piece_count(spec) for spec in specs]
    several = None not in counts and counts != [1, 1]
    return job.model_copy(update={"parts": "all"}) if several else job


def pin_same_vertices(job: Job, inputs: Inputs) -> tuple[Job, Inputs, list[str]]:
    """Pin each vertex of a closed mesh to the same vertex of the other if both have the same topology and no pins are
    given.

    Returns:
        The job with these pins, its files, and a note on them.

    Raises:
        InputError: a mesh cannot be read, or --trace is given without a picture.
    """
    inputs.check_trace()
    pins = inputs.same_vertices()
    if not pins:
        return job, inputs, []
    job = job.model_copy(update={"pin": pins})
    note = (
        f"{job.target}: has the same topology as {job.source}, so {len(pins)} vertices are pinned "
        "to the same vertices (use --pin for other pins)"
    )
    return job, inputs.of_job(job), [note]


def name_outputs(job: Job, inputs: Inputs) -> Job:
    """Return the job with a default output named after its shapes, if it has no other output.

    The output is a picture, or a mesh for a mesh.

    Raises:
        InputError: the mesh could not show the texture, or the name exists as a symbolic link, whose destination was
            not named by the user.
    """
    if job.output or any(getattr(job, field) for field in WRITTEN):
        return job
    stems = [short_name(spec) for spec in (job.source, job.target) if spec]
    name = "-".join(stems if job.target else [*stems, "deformed"])
    suffix = suffix_for(job, inputs)
    if len(job.maps) > 1:
        name, suffix = f"{name}-{STEM}", ".png"
    try:
        names = pair_outputs([name + suffix], job.maps)
    except ValueError as error:
        raise InputError(str(error)) from None
    if links := [path for path in names if os.path.islink(path)]:
        raise InputError(f"{links[0]}: is a link; name the output with -o")
    return job.model_copy(update={"output": names})


def suffix_for(job: Job, inputs: Inputs) -> str:
    """Return the suffix of the default output: a mesh's for a mesh, else that of a picture."""
    if job.target is None or job.bake or not inputs.is_mesh(job.target) or inputs.is_layout(job.target):
        return ".png"
    path = Spec.of(job.target).path
    return formats.suffix_of(path) if formats.of(path).uv else ".obj"
