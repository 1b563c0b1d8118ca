"""The drawing inside the source shape as SVG: its paths mapped, its styles kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ....errors import InputError
from ... import formats
from ...artwork import carry_parts, check
from ...meshes.mesh_files import names_layout
from ...spec import Spec
from .. import framing
from ..job import Job
from ..state import Run
from .output import Output

if TYPE_CHECKING:
    from ....arrays import Complex
    from ....solve import Fit

SAME_AREA = 1e-6  # of a drawing's area: its frame adds nothing to it


class Artwork(Output):
    """An SVG of what the source file draws."""

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """An SVG as source, and a planar target, or a chart of a mesh's layout."""
        if formats.suffix_of(self.name) != ".svg":
            raise InputError(f"{self.name}: artwork is written as .svg; compress that")
        drawn = formats.suffix_of(Spec.of(job.source).path) in (".svg", ".svgz")
        flat = not onto_mesh or job.plane == "uv" or names_layout(job.target or "")
        if not drawn or not flat or job.bake:
            raise InputError(
                f"{self.name}: artwork is carried from an SVG to a planar shape or a chart (mesh#uv); "
                "use a picture's suffix"
            )

    def check(self, run: Run) -> None:
        """A drawing that can be carried.

        Raises:
            InputError: it is malformed, or too much; the chart is mirrored.
        """
        for _, target in run.pairs:
            if target.mirror is not None:
                chart = f"#{target.part}" if target.part else "this chart"
                raise InputError(
                    f"{target.spec}: its layout shows {chart} mirrored, and artwork is not; use a picture's suffix"
                )
        check(run.source, run.target, len(run.pairs) if run.job.parts == "each" else 1)
        run.note(*framing.remarks(run.job, run.source, run.target))

    def write(self, run: Run, path: Path) -> None:
        """All of it, and notes on what was cut off or left out."""
        self.write_faded(run, path, 0.0)

    def write_faded(self, run: Run, path: Path, opacity: float) -> None:
        """The same, of which what the target does not paint is seen with an opacity."""
        with run.phases.timed("artwork"):
            carried = [(source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)]
            target = replace(run.target, box=framing.picture_box(run.job, run.target))
            painted = [ring for fit in run.fits for ring in painted_rings(fit)] if opacity < 1 else []
            each = run.job.parts == "each"
            notes = carry_parts(carried, target, path, each=each, painted=painted, opacity=opacity)
            run.note(*notes)


def painted_rings(fit: Fit) -> list[Complex]:
    """The rings that cut a drawing carried by a map of whole drawings; none where the map's outline does that."""
    if fit.drawings is None or fit.target is None:
        return []
    drawing = fit.drawings[1]
    own_outline = (
        drawing.is_one_part and abs(fit.target.area - drawing.region.area) <= SAME_AREA * drawing.region.area
    )
    return [] if own_outline else drawing.rings
