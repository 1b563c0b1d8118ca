"""`--along`: bend the source along a line of the target."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from ..shapes.shape import BBOX
from ..spec import Spec, is_view
from .job import Job

if TYPE_CHECKING:
    from ..shapes.line_band import LineBand
    from ..shapes.shape import Shape
    from .inputs import Inputs

EXCLUDED = "turn", "fit", "start", "handles", "bake"
"""Options that ask for another map, or for another kind of target."""


def with_box(job: Job, inputs: Inputs) -> Job:
    """Return the job with the source's box as its source, which is bent along the line.

    Raises:
        InputError: an option or a shape cannot be combined with --along.
    """
    from ..shapes.silhouette import CANVAS

    defaults = job.defaults()
    others = [name for name in EXCLUDED if getattr(job, name) != defaults[name]]
    others += ["parts"] if job.parts not in ("auto", "joined") else []
    others += ["place"] if job.place != "fill" else []
    others += ["pin"] if job.has_pins else []
    others += ["method"] if not job.exact else []
    if others:
        raise InputError(f"--along: cannot be combined with --{others[0]}; leave one of the two out")
    for spec in (job.source, job.target or ""):
        if is_view(spec) or inputs.is_mesh(spec):
            raise InputError(f"{spec}: --along only works for planar drawings; leave it out")
    is_box = (Spec.of(job.source).selection or "").rpartition("#")[2] in (BBOX, CANVAS)
    return job if is_box else job.model_copy(update={"source": f"{job.source}#{BBOX}"})


def read(job: Job, inputs: Inputs) -> tuple[Shape, LineBand]:
    """Return the source's box, which shows the source itself unless there is a texture, and the band.

    Raises:
        InputError: a shape cannot be read, or the band overlaps itself.
    """
    from ..shapes import line_band

    source = inputs.shape(job.source)
    width = None if job.along == "auto" else float(job.along or 0)
    band = line_band.band_along(job.target or "", width, source, max_segments=job.max_segments)
    return (source if job.texture or job.checkered else replace(source, coloured=True)), band


def constraints(source: Shape, band: LineBand) -> dict[str, Any]:
    """Return the strokes that map the box and the baseline of the source onto the band, as arguments of `iccm.fit`."""
    from ..shapes.line_band import baseline_of

    return {"strokes": band.strokes(source.curve.box, baseline_of(source))}
