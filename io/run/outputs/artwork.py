"""The drawing inside the source shape as SVG: its paths mapped, its styles kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ....errors import InputError
from ... import formats
from ...artwork import carry_parts, check
from ...spec import Spec
from .. import framing
from ..job import Job
from ..state import Run
from .output import Output


class Artwork(Output):
    """An SVG of what the source file draws."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """An SVG as source, and a planar target."""
        if formats.suffix_of(self.name) != ".svg":
            raise InputError(f"{self.name}: artwork is written as .svg; compress that")
        if formats.suffix_of(Spec.of(job.source).path) not in (".svg", ".svgz") or onto_mesh:
            raise InputError(
                f"{self.name}: artwork is carried from an SVG to a planar shape; use a picture's suffix"
            )

    def check(self, run: Run) -> None:
        """A drawing that can be carried.

        Raises:
            InputError: it is malformed, or too much.
        """
        check(run.source, run.target)
        for note in framing.remarks(run.job, run.source, run.target):
            run.note(note)

    def write(self, run: Run, path: Path) -> None:
        """All of it, and notes on what was cut off or left out."""
        with run.phases.timed("artwork"):
            carried = [(source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)]
            target = replace(run.target, box=framing.shown(run.job, run.target))
            for note in carry_parts(carried, target, path):
                run.note(note)
