"""Jobs with a sheet that is seen in a picture: mock-ups, and the rectification of photographs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import InputError
from .. import formats
from ..shapes.projected import is_sheet, read_pair, view_of
from ..spec import Spec, is_view
from .job import Job

if TYPE_CHECKING:
    from ...result import Fit
    from .parts import Pair

SOLVED = ("shapes", "constraints", "method", "paper", "mesh")
"""Topics of the options that concern maps which are solved for."""
APPLIES = ("tolerance", "require_injective")
"""Options of these topics that concern every map."""


def is_projected(job: Job) -> bool:
    """Return whether one of a job's shapes is a sheet that is seen in a picture, or a sheet itself."""
    return is_view(job.source) or is_view(job.target or "")


def read(job: Job) -> Pair:
    """Read the shapes of such a job.

    Raises:
        InputError: a shape is invalid, or an option is given that does not apply, because the map is known.
    """
    view = job.source if is_view(job.source) else job.target
    if job.target is None:
        raise InputError(f"{view}: only works with iccm map")
    for name, (_, option) in job.rows.items():
        if option is None or option.topic not in SOLVED or name in APPLIES:
            continue
        if getattr(job, name) != option.default:
            text = f"--{name.replace('_', '-')}: does not apply, because the map of {view} is given by its geometry"
            raise InputError(f"{text}; leave it out")
    source = Spec.of(job.source).path
    if job.texture and is_sheet(job.target) and not is_view(job.source) and not formats.of(source).picture:
        raise InputError(
            f"{job.source}: onto a sheet, its canvas is mapped and not its outline; mark the sheet on the photo "
            f"instead: {job.texture}#plane=… with its four corners, or #cylinder=DIAMETERxHEIGHT:… with six points "
            "of a label's edges"
        )
    return read_pair(job.source, job.target)


def solve(pair: Pair) -> Fit:
    """Return the map of such a job.

    Raises:
        InputError: nothing of the sheet is seen on both sides.
    """
    from ...projection import method

    source, target = pair
    return method.solve(view_of(source), view_of(target), (source.spec, target.spec))
