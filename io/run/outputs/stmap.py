"""The map itself: for each pixel of the target its place in the texture."""

from __future__ import annotations

from pathlib import Path

from ....errors import InputError
from ...pictures import stmap_files
from .. import framing
from ..job import Job
from ..state import Run
from . import checks
from .output import Output


class STMap(Output):
    """A map as a picture of floats."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """A suffix whose format holds floats."""
        stmap_files.check(self.name)

    def check(self, run: Run) -> None:
        """No texture coordinates on the way, and room for the rows."""
        if run.job.bake or run.source.has_uv:
            spec = (run.target if run.job.bake else run.source).spec
            raise InputError(
                f"{spec}: an STMap cannot hold its texture coordinates; leave out "
                f"{'--bake' if run.job.bake else '--stmap'}, and carry each picture with --texture"
            )
        width, _ = checks.canvas(run)
        run.room.check(stmap_files.band_bytes(width), f"rows of {width} pixels")

    def write(self, run: Run, path: Path) -> None:
        """Rows as they are computed."""
        box = framing.covered(run.job, run.source)
        with run.phases.timed("resample"):
            stmap_files.write(path, run.mapping, box, run.canvas, room=run.room, threads=run.threads)
