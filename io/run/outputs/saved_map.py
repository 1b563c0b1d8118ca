"""The map itself as arrays, without loss, for `iccm apply` and `iccm.load`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ....errors import InputError
from ....saved.map_file import SavedPlane
from ..job import Job
from ..report import OutputReport
from ..state import Run
from .output import Output

if TYPE_CHECKING:
    from ...shapes.shape import Shape


class SavedMap(Output):
    """A map between planar shapes as a file of arrays."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a single map that is not onto a mesh."""
        if job.several:
            raise InputError(
                f"{self.name}: a file can contain only one map; choose one part (file#id) instead of --parts"
            )
        if onto_mesh:
            raise self._refusal(job.target or job.source)

    def check(self, run: Run) -> None:
        """Require plane shapes."""
        for shape in (run.source, run.target):
            if shape.is_mesh:
                raise self._refusal(shape.spec)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the map, with the options of the job that affect pictures made with it."""
        with run.phases.timed("write"):
            job = {name: value for name, value in run.job.solver.items() if _plain(value)}
            planes = plane_of(run.source), plane_of(run.target)
            run.fit.save(path, planes, job=job | {"holes": run.job.holes, "target_box": run.job.target_box})
        return OutputReport()

    def _refusal(self, spec: str) -> InputError:
        return InputError(
            f"{self.name}: only maps between planar shapes can be saved, and {spec} is a mesh; write its "
            "map with --stmap"
        )


def plane_of(shape: Shape) -> SavedPlane:
    """Return what the file of a map stores about a shape."""
    name = Path(shape.spec).name
    lying = shape.millimetres, shape.unit, shape.georeference
    return SavedPlane(shape.curve.z, shape.box, shape.flip, shape.holes, name, *lying)


def _plain(value: object) -> bool:
    return isinstance(value, str | int | float)
