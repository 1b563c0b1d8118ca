"""The figure of a run: the source and its image; for a mesh, its flattening and its textured surface."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ....arrays import Box
from ....maps.summary import in_words
from ....pixels.canvas import Canvas, proportional
from ... import formats
from .. import report
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .output import Output
from .picture import displayed

LONGER_SIDE_PIXELS = 900  # longer side of the picture


class Plot(Output):
    """A figure."""

    shows = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a suffix of figures."""
        formats.check_plot(self.name)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Draw the figure. matplotlib is imported here because that takes longer than many runs."""
        from .. import plots

        with run.phases.timed("plot"):
            figures = report.map_figures(run, earlier)
            report.note_doubts(run, figures)
            if not run.target.is_mesh:
                if len(run.fits) > 1:
                    run.note(f"{self.name}: the grids and figures are those of the largest part only")
                annotated = figures | {"notes": run.notes}
                plots.save(run.fit.plot(annotated, _names(run.job), _carried(run)), path)
                return OutputReport()
            from ...shapes.mesh_shape import as_mesh

            placed, target = run.image.texture(run.box, kind=run.job.kind), as_mesh(run.target)
            words = in_words(figures | {"notes": run.notes})
            arguments: dict[str, Any] = {"map": run.fit.map, "source": run.source, "pins": run.fit.pins}
            plots.draw(target, path, words, texture=placed, **arguments)
        return OutputReport()


def _carried(run: Run) -> tuple[NDArray, Box]:
    """Return the mapped picture as screens show it, and its box in the target's plane."""
    canvas = run.canvas_of(None)
    canvas = Canvas.about(*proportional(LONGER_SIDE_PIXELS, canvas.box[1] - canvas.box[0]), canvas.box)
    return displayed(run, canvas), canvas.box


def _names(job: Job) -> tuple[str, str]:
    """Return the titles of the source and of its image."""
    onto = f" over the target: {Path(job.target).name}" if job.target else ""
    return f"source: {Path(job.source).name}", f"mapped source{onto}"
