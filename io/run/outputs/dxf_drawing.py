"""The source's DXF drawing, with its entities mapped, as DXF in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ....errors import InputError
from ... import formats
from ...artwork import TOLERANCE_SHARE, dxf
from ...spec import Spec
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .output import Output

if TYPE_CHECKING:
    from ....maps.approximation import AnyMap
    from ...shapes.shape import Shape


class DxfDrawing(Output):
    """A DXF of the source's drawing."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a DXF as the source, a planar target, and maps of different parts of the source."""
        is_drawing = formats.suffix_of(Spec.of(job.source).path) == ".dxf"
        if not is_drawing or onto_mesh or job.bake:
            raise InputError(
                f"{self.name}: a DXF drawing needs a DXF file as the source, and a planar shape as the target; use "
                "another suffix"
            )
        if job.repeated:
            raise InputError(
                f"{self.name}: a DXF drawing shows the source once; leave out --parts {job.parts}"
            )

    def check(self, run: Run) -> None:
        """Check that the drawing can be read.

        Raises:
            InputError: it cannot.
        """
        dxf.check(run.source.path)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the drawing, and note what was cut off or left out."""
        with run.phases.timed("artwork"):
            parts: list[tuple[Shape, AnyMap]] = [
                (source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)
            ]
            by_default = TOLERANCE_SHARE * run.target.curve.diagonal
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
