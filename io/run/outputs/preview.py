"""The contact sheet of a run onto a mesh: its textured surface from four sides."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....errors import InputError
from ....pixels.sampler import Sampler
from ...shapes.mesh_shape import as_mesh
from .. import preview
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .output import Output


class Preview(Output):
    """A contact sheet."""

    shows = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a mesh as the target, and the suffix of a PNG."""
        preview.check(self.name)
        if not onto_mesh:
            raise InputError(
                f"--preview {self.name}: shows a mesh from four sides, and the target is not one"
            )

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Render the surface of all parts."""
        with run.phases.timed("preview"):
            placed = run.image.texture(run.box, kind=run.job.kind)
            parts = [
                preview.textured(as_mesh(target), fit.map, source, placed)[0]
                for (source, target), fit in zip(run.pairs, run.fits)
            ]
            up_axis = as_mesh(run.target).file.mesh.up_axis
            preview.write(path, parts, Sampler(placed, edge="repeat"), up_axis)
        return OutputReport()
