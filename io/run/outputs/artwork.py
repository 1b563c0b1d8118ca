"""The source's drawing as SVG, with its paths mapped and its styles kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ....drawings.drawing import Drawing
from ....errors import InputError
from ....polygons import unite
from ... import formats
from ...artwork import ArtworkFrame, PreparedDrawing, carry_frames, is_drawn
from ...meshes.mesh_files import names_layout
from ...spec import Spec
from .. import background, framing
from ..job import Job
from ..report import OutputReport
from ..state import FADED_OPACITY, Run
from .output import Output

if TYPE_CHECKING:
    from ....arrays import Complex
    from ....solve import Fit
    from ...shapes.shape import Shape

LEAST_OPACITY = 1e-3  # of a mask: less than the 1/255 that a screen can show
SAME_AREA_SHARE = 1e-6  # relative to a drawing's area: smaller differences to its frame are ignored


class Artwork(Output):
    """An SVG of the source's drawing."""

    shows_target = True
    _prepared: PreparedDrawing | None = None

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require an SVG, a DXF or a text in a font as source, and a planar target or a chart of a mesh's layout."""
        if formats.suffix_of(self.name) != ".svg":
            raise InputError(f"{self.name}: artwork is written as .svg; compress it afterwards")
        is_drawing = is_drawn(Spec.of(job.source).path)
        flat = not onto_mesh or job.plane == "uv" or names_layout(job.target or "")
        if not is_drawing or not flat or job.bake:
            raise InputError(
                f"{self.name}: artwork needs an SVG or DXF drawing or a text (font.ttf#text=Hello) as the "
                "source, and a planar shape or a chart (mesh#uv) as the target; use a picture's suffix"
            )

    def check(self, run: Run) -> None:
        """Check that the drawing can be mapped.

        Raises:
            InputError: the drawing is malformed or too large, or the chart is mirrored.
        """
        for _, target in run.pairs:
            if target.mirror is not None:
                chart = f"#{target.part}" if target.part else "this chart"
                raise InputError(
                    f"{target.spec}: {chart} is mirrored in the layout, which artwork cannot be; use a "
                    "picture's suffix"
                )
        self.prepare(run)
        run.note(*framing.remarks(run.job, run.source, run.target))

    def prepare(self, run: Run) -> None:
        """Read the drawing, and keep it for the first frame that is written.

        Raises:
            InputError: the drawing is malformed or too large.
        """
        copies = len(run.pairs) if run.job.repeated else 1
        is_alone = run.job.background != "target"
        self._prepared = PreparedDrawing(run.source, on_canvas(run), copies, alone=is_alone)

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write the drawing, and note what was cut off or left out."""
        is_empty = self.write_frames([(run, path, 0.0)])
        return OutputReport({"empty": True} if is_empty else {})

    def write_faded(self, run: Run, path: Path, opacity: float) -> None:
        """Write the drawing with what lies outside of the target's painted area at an opacity."""
        self.write_frames([(run, path, opacity)])

    def write_lines(self, run: Run, path: Path) -> None:
        """Write the drawing without the paper that fills its gaps, for formats that only have lines."""
        self.write_frames([(run, path, 0.0)], on_paper=False)

    def write_frames(
        self, frames: Sequence[tuple[Run, Path, float]], *, alike: bool = False, on_paper: bool = True
    ) -> bool:
        """Write frames of a morph, whose paths have the same commands, each with the opacity of what lies outside.

        With `alike` all frames have the same elements: masks also where nothing fades, or everything has faded.
        With `on_paper` paper fills the gaps of a drawing that is its own picture, or the target is seen behind it.
        Returns whether a frame shows nothing of the drawing.
        """
        first = frames[0][0]
        with first.phases.timed("artwork"):
            artwork_frames = []
            cut = alike and any(painted_rings(run.fits) for run, _, _ in frames)
            shows_target = on_paper and first.job.background == "target"
            behind = background.element_of(first) if shows_target else None
            for run, path, opacity in frames:
                carried = [(source, fit.map) for (source, _), fit in zip(run.pairs, run.fits)]
                target = on_canvas(run)
                if cut:  # also in frames whose outlines already cut the drawing
                    painted = [ring for fit in run.fits for ring in _rings_of_target(fit)]
                else:
                    painted = painted_rings(run.fits) if opacity < 1 else []
                no_paper = not on_paper or alike or opacity or run.job.target is None
                paper = "" if no_paper else run.paper
                tone = (run.tone, run.toned) if paper and run.tone else ("", [])
                drawings = [fit.details.drawings[1] for fit in run.fits if fit.details.drawings is not None]
                if paper and len(drawings) == len(run.fits):
                    painted = Drawing(unite([drawing.painted for drawing in drawings])).rings
                else:
                    paper = ""
                opacity = max(opacity, LEAST_OPACITY) if alike else opacity
                faded = [] if alike or opacity else run.faded
                artwork_frames.append(
                    ArtworkFrame(
                        carried, target, path, painted, opacity, paper, *tone, faded, FADED_OPACITY, behind
                    )
                )
            tolerance = first.job.max_line_error
            notes, is_empty = carry_frames(
                artwork_frames,
                repeated=first.job.repeated,
                tolerance=tolerance,
                prepared_drawing=self._prepared,
            )
            first.note(*notes)
            return is_empty


def on_canvas(run: Run) -> Shape:
    """Return the target with the box that pictures show as its canvas."""
    return replace(run.target, box=framing.picture_box(run.job, run.target))


def painted_rings(fits: Sequence[Fit]) -> list[Complex]:
    """Return the rings that clip the mapped drawing; empty if the outlines of the maps already do that."""
    if all(_is_cut_by_its_outline(fit) for fit in fits):
        return []
    return [ring for fit in fits for ring in _rings_of_target(fit)]


def _is_cut_by_its_outline(fit: Fit) -> bool:
    """Return whether a map covers exactly what the target paints."""
    if fit.details.drawings is None or fit.target is None:
        return True
    drawing = fit.details.drawings[1]
    added = abs(fit.target.area - drawing.region.area)
    return drawing.is_one_part and added <= SAME_AREA_SHARE * drawing.region.area


def _rings_of_target(fit: Fit) -> list[Complex]:
    """Return the boundaries of what the target of a map paints."""
    if fit.details.drawings is not None:
        return fit.details.drawings[1].rings
    return [curve.z for curve in (fit.target, *fit.target_holes) if curve is not None]
