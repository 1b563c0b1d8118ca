"""The map as a constraints file with handles: a lattice of pins, and the map that they hold."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ....errors import InputError
from ....maps.triangulated.map import TriangulatedMap
from ... import limits
from ..constraints import constraints_text, fingerprint
from ..report import OutputReport
from .output import Output

if TYPE_CHECKING:
    from ....result import Fit
    from ...shapes.shape import Shape
    from ..job import Job
    from ..state import Run

UNSUPPORTED = ("rigid", "rigid_target", "importance", "size_map", "exact_pins")
"""Options with which a map is not kept as it is, or whose handles would not be soft."""


class Handles(Output):
    """A constraints file from which `--constraints` makes the same map again until one of its handles is moved."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require the number of handles, and a single map of whole outlines."""
        if job.handles is None:
            raise InputError(
                f"{self.name}: a .json file holds handles of the map; give their number with --handles "
                "ROWSxCOLUMNS, or write the report with --report"
            )
        if not job.target:
            raise InputError("--handles: only works with iccm map")
        if job.several:
            raise InputError(
                f"--handles: a file holds only one map; choose one part (file#id) instead of --parts {job.parts}"
            )
        if onto_mesh:
            raise self._refusal(job.target)
        refused = [name for name in UNSUPPORTED if getattr(job, name)]
        if not job.exact:
            refused.append(f"method {job.method}")
        if job.place != "fill":
            refused.append(f"place {job.place}")
        if job.fit not in (None, "auto", "whole"):
            refused.append(f"fit {job.fit}")
        if refused:
            option = refused[0].replace("_", "-")
            raise InputError(f"--handles: cannot be combined with --{option}; leave one of the two out")

    def check(self, run: Run) -> None:
        """Require plane shapes without strokes and rigid regions, and a handle inside."""
        from ...shapes import handles

        for shape in (run.source, run.target):
            if shape.is_mesh or shape.view:
                raise self._refusal(shape.spec)
        for kind, name in (("strokes", "strokes"), ("rigid", "rigid regions")):
            if run.constraints.get(kind):
                raise InputError(f"--handles: does not work with {name}; leave one of the two out")
        rows, columns = self._size(run)
        if not handles.has_room(run.source, rows, columns):
            raise InputError(
                f"--handles: none of the {rows}x{columns} points lies inside {run.source.spec}; {handles.CURE}"
            )

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the pins of the job with the handles, and the map."""
        from ...shapes import constraints, listing
        from ...shapes.handles import handles_of
        from ...shapes.starts import StartingMap

        fit, pair = run.fit, (run.source, run.target)
        if fit.coverage.is_partial:
            raise InputError(
                "--handles: not possible where an unmatched hole closes to a slit; use "
                "--holes cut or --holes fill"
            )
        if not isinstance(fit.map, TriangulatedMap) or not _maps_whole_outlines(fit, pair):
            raise InputError(
                f"--handles: {run.job.start or 'the map'} does not map the whole outlines; make it again with "
                "--fit whole"
            )
        with run.phases.timed("write"):
            listed = run.inputs.listed
            pins = listed.pins_of(*pair) if listed else []
            pins += listing.typed_pins(run.job.pin)
            pins += handles_of(fit, *pair, *self._size(run), pins)
            collected = constraints.collect(*pair, listing.ConstraintsFile(pins=pins))
            fingerprint_of_pins = fingerprint(run.job, collected.pins, collected.settings)
            if len(fit.map.faces) > limits.START_ENTRIES:
                raise InputError(
                    f"--handles: the map has {len(fit.map.faces)} triangles, and a file of pins holds at most "
                    f"{limits.START_ENTRIES}; simplify the outlines"
                )
            start = StartingMap.of(fit.map, *pair, kept=fingerprint_of_pins)
            start.map(*pair)  # refuses a map that folds when it is rounded
            path.write_text(constraints_text(pair, {"pins": pins}, start), encoding="utf-8")
        return OutputReport()

    @staticmethod
    def _size(run: Run) -> tuple[int, int]:
        size = run.job.handles
        assert size is not None
        return size

    def _refusal(self, spec: str) -> InputError:
        return InputError(f"--handles: only works for planar shapes, and {spec} is not one")


def _maps_whole_outlines(fit: Fit, pair: tuple[Shape, Shape]) -> bool:
    """Return whether a map is between the whole outlines, or the tightest frames, as maps with pins are."""
    assert fit.target is not None
    frames = [shape.drawing.tightest.outline if shape.drawing else shape.curve for shape in pair]
    return all(np.array_equal(outline.z, frame.z) for outline, frame in zip((fit.source, fit.target), frames))
