"""The figure of a run; for a mesh its flattening and its textured surface."""

from __future__ import annotations

from pathlib import Path

from ... import formats
from ..job import Job
from ..state import Run
from .output import Output


class Plot(Output):
    """A figure."""

    shows = True  # on a mesh

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """A suffix of figures."""
        formats.check(self.name, "plot", "--plot")

    def write(self, run: Run, path: Path) -> None:
        """matplotlib is imported here: it takes longer than many runs."""
        from .. import plots

        with run.phases.timed("plot"):
            if not run.target.is_mesh:
                if len(run.fits) > 1:
                    run.note(f"{self.name}: shows the largest part alone")
                plots.save(run.fit.plot(run.fit_report, _names(run.job)), path)
                return
            from ...shapes.mesh_shape import as_mesh

            placed, target = run.image.texture(run.box, kind=run.job.kind), as_mesh(run.target)
            plots.draw(target, path, map=run.fit.map, source=run.source, texture=placed, pins=run.fit.pins)


def _names(job: Job) -> tuple[str, str]:
    """Titles of the source and of its image."""
    onto = f" over the target: {Path(job.target).name}" if job.target else ""
    return f"source: {Path(job.source).name}", f"its image{onto}"
