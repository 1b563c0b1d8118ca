"""The source's drawing as DXF in millimetres: entities of a DXF drawing stay what they are, of others lines remain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ....errors import InputError
from ... import files, formats
from ...artwork import TOLERANCE_SHARE, dxf, is_drawn, new_dxf
from ...spec import Spec
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .artwork import Artwork
from .output import Output

if TYPE_CHECKING:
    from ....maps.approximation import AnyMap
    from ...shapes.shape import Shape


class DxfDrawing(Output):
    """A DXF of the source's drawing."""

    def __init__(self, name: str) -> None:
        """Store the name, and the output that reads and maps drawings that are not DXF."""
        super().__init__(name)
        self._artwork = Artwork(name)

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a drawing as the source, a planar target, and for DXF maps of different parts of the source."""
        path = Spec.of(job.source).path
        if not is_drawn(path) or onto_mesh or job.bake:
            raise InputError(
                f"{self.name}: a DXF drawing needs a drawing (.dxf, .svg) as the source, and a planar shape as the "
                "target; use another suffix"
            )
        if job.repeated and _is_dxf(path):
            raise InputError(
                f"{self.name}: a DXF drawing shows the source once; leave out --parts {job.parts}"
            )

    def check(self, run: Run) -> None:
        """Check that the drawing can be read.

        Raises:
            InputError: it cannot.
        """
        if _is_dxf(run.source.path):
            dxf.check(run.source.path)
        else:
            self._artwork.prepare(run)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the drawing, and note what was cut off or left out."""
        with run.phases.timed("artwork"):
            parts: list[tuple[Shape, AnyMap]] = [
                (source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)
            ]
            by_default = TOLERANCE_SHARE * run.target.curve.diagonal
            if not _is_dxf(run.source.path):
                run.note(*self._lines(run, path, by_default))
                return OutputReport()
            notes = dxf.carry(
                run.source.path,
                parts,
                run.target,
                path,
                tolerance=run.job.max_line_error,
                default_tolerance=by_default,
            )
            run.note(*notes)
        return OutputReport()

    def _lines(self, run: Run, path: Path, default_tolerance: float) -> list[str]:
        """Write the lines of a drawing that is not a DXF, and return notes."""
        unit = run.target.millimetres or 1.0
        tolerance = run.job.max_line_error or default_tolerance * unit
        halved = run.job.model_copy(update={"max_line_error": tolerance / unit / 2})
        with files.scratch() as folder:
            drawing = folder / "drawing.svg"
            self._artwork.write_lines(replace(run, job=halved), drawing)
            plane = dxf.Plane.of(run.target, 1 / unit)
            lines, notes = new_dxf.of_svg(drawing.read_bytes(), plane.to_down.inverse)
        new_dxf.write(lines, path, tolerance / 2)
        return [
            *(f"{count} × {note}" for note, count in sorted(notes.items()) if count),
            *dxf.remarks(run.target, tolerance),
        ]


def _is_dxf(path: Path) -> bool:
    return formats.suffix_of(path) == ".dxf"
