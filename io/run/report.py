"""The report of a run: one JSON object, `iccm.report/1`, described in docs/reference/report.md."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import __version__
from ...deadline import TimeUp
from ...figures import FAR_OFF_TOLERANCES
from ...fits import leaves_bare
from ...maps.summary import CERTAIN_SHARE, SEEN_FOLDS_SHARE
from ...meshes.layout import is_stacked
from ...status import Status
from .. import files
from ..spec import Spec
from .parts import label
from .phases import Doubt

if TYPE_CHECKING:
    from .state import Run

SCHEMA = "iccm.report/1"


MOST_TILT_DEGREES = 45.0
"""Rotation of a mesh on another one from which up is nearer to the side than to up."""
MOST_TURN_ERROR_DEGREES = 20.0
"""Difference to a requested rotation up to which it is seen: models of other forms do not have exactly one."""
LEAST_SHARE = 0.5
"""Share of the target's painted area, and of a mesh's area, that a good result maps; if it is less, most of what was
asked for is missing."""

LEAST_SHOWN_SHARE = 0.1
"""Share of the source that a target of lines shows at least: of less, nobody recognises anything."""


@dataclass(frozen=True)
class OutputReport:
    """The part of a run's report that an output adds.

    Attributes:
        figures: entries of the report.
        tile: the number of the tile (UDIM) of these figures, if the output is for one tile.
        parts: entries of each part's map for this output, which replace the solver's.
        message: a sentence that replaces the solver's.
        files: names of files written beside the output; None for kinds of outputs that never have any.
    """

    figures: dict[str, Any] = field(default_factory=dict)
    tile: int | None = None
    parts: Sequence[dict[str, Any]] = ()
    message: str | None = None
    files: Sequence[str] | None = None


def build(run: Run, outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Build the report: the solver's figures, times, inputs with their hashes, options and version.

    Doubts about the picture become notes. Times are left out if SOURCE_DATE_EPOCH is set, so that the same job gives
    the same bytes.

    Args:
        run: the job.
        outputs: what each output adds.
    """
    solver_figures = map_figures(run, outputs)
    note_doubts(run, solver_figures)
    figures = run.figures | output_figures(outputs)
    report = {"schema": SCHEMA, "version": __version__, **solver_figures, **figures}
    fault = _fault(run, figures)
    if run.fit.status.ok and fault:
        report |= {"status": fault.name.lower(), "message": fault.value}
    if "SOURCE_DATE_EPOCH" not in os.environ:
        report["seconds"] = run.phases.report()
    report["notes"] = run.notes
    report["inputs"] = [{"path": name, "sha256": run.inputs.sha256(name)} for name in run.inputs.named]
    report["job"] = run.job.model_dump(mode="json", exclude_defaults=True, exclude={"force"})
    return as_json(report)


def out_of_time(error: TimeUp, names: Sequence[str]) -> dict[str, Any]:
    """Return the entries of a report whose outputs are not all written, because the time limit was over."""
    return as_json({"status": Status.LIMIT.name.lower(), "message": str(error), "not_written": list(names)})


def map_figures(run: Run, outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Return the solver's report, updated with figures measured while writing outputs."""
    figures = dict(run.fit_report)
    if "parts" in figures:
        figures["parts"] = [dict(part) for part in figures["parts"]]
    for output in outputs:
        for part, updates in zip(figures.get("parts", []), output.parts):
            part |= {key: part[key] | value for key, value in updates.items() if key in part}
        for updates in output.parts[:1]:
            figures |= {key: figures[key] | value for key, value in updates.items()}
        if output.message:
            figures["message"] = output.message
    return figures


def output_figures(outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Return the entries that outputs add to the report: those of tiles by tile number, files beside outputs in one
    list.
    """
    entries = dict[str, Any]()
    for output in outputs:
        if output.tile is None:
            entries |= output.figures
        else:
            entries.setdefault("tiles", {})[str(output.tile)] = output.figures
        if output.files is not None:
            entries["also_written"] = [*entries.get("also_written", []), *output.files]
    return entries


def note_doubts(run: Run, figures: dict[str, Any]) -> None:
    """Note the solver's remarks and doubts about the picture, once, from the figures of `map_figures`."""
    weighed = not run.job.exact
    wanted = (
        ("covered", "cracks") if run.job.background in ("transparent", "target") else ()
    )  # nothing is painted in gaps, as requested
    parts = figures.get("parts", [figures])
    for pair, fit, part in zip(run.pairs, run.fits, parts):
        doubted = doubts(figures | part, run.job.tolerance, run.job.quasi is not None, weighed=weighed)
        notes = [note for note in part["notes"] if not any(f"({entry})" in note for entry in wanted)]
        noted = [note if note in fit.notes else Doubt(note) for note in notes]
        run.note(*(type(note)(label(pair, note)) for note in [*noted, *doubted]))


def doubts(figures: dict[str, Any], tolerance: float, quasi: bool, *, weighed: bool = True) -> list[str]:
    """Return sentences on what is wrong with the picture although the solver ended well.

    For example, pins and strokes may contradict the outline or each other. Each sentence names the entry of the report
    with the figure, and depends on nothing else.

    Args:
        figures: the solver's own report.
        tolerance: the largest acceptable gap.
        quasi: whether the map was allowed to be quasiconformal.
        weighed: whether constraints are weighted in the energy, instead of met exactly.
    """
    sentences: list[str] = []
    gap, injective = (figures["boundary"] or {}).get("hausdorff", 0.0), figures["injective"]
    pulled = weighed and bool(figures["pins"] or figures["strokes"])
    if gap > FAR_OFF_TOLERANCES * tolerance and (pulled or figures["status"] not in ("gap", "crowded")):
        sentences.append(Doubt("the mapped outline is far from the target's outline (boundary)"))
    if not injective["certified"]:
        has_folds = injective["folded"] >= SEEN_FOLDS_SHARE
        fault = (
            "not one-to-one, so the picture overlaps itself"
            if has_folds
            else "not certified to be one-to-one"
        )
        sentences.append(Doubt(f"the map is {fault} (injective)"))
    elif injective["share"] < CERTAIN_SHARE and not injective["folded"] >= SEEN_FOLDS_SHARE:
        sentences.append(
            f"the picture may overlap itself near the outline: only {injective['share']:.1%} of the "
            "source's area is certified one-to-one (injective)"
        )
    if not (figures["pins"] or figures["strokes"]) or not weighed:
        return sentences
    cure = "move pins and strokes, or lower their weights" + ("" if quasi else ", or try --quasi 0.01")
    return [type(text)(f"{text}; {cure}") for text in sentences]


def as_json(value: Any) -> Any:
    """Convert a value to JSON: arrays become lists, complex numbers pairs, NaN and infinity null.

    File names that are not UTF-8 keep their odd bytes as escapes.
    """
    if isinstance(value, dict):
        return {str(key): as_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [as_json(item) for item in value]
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, np.generic):
        return as_json(value.item())
    if isinstance(value, complex):
        return [as_json(value.real), as_json(value.imag)]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def text(report: dict[str, Any]) -> str:
    """Return the text of a report: one key per line, ending in a newline."""
    return json.dumps(as_json(report), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write(report: dict[str, Any], name: str, stack: ExitStack, *, force: bool) -> None:
    """Write the report to stdout or to a file; the file appears when the stack is closed."""
    path = stack.enter_context(files.writing(name, force=force, suffix=".json"))
    path.write_text(text(report), encoding="utf-8")


def verdict(run: Run, report: dict[str, Any]) -> tuple[bool, str]:
    """Return whether the result meets the requirements, and a sentence about it."""
    least_share = run.job.require_injective
    for pair, fit, part in zip(run.pairs, run.fits, report.get("parts", [report])):
        if not fit.status.ok:
            return False, label(pair, fit.status.value)
        share = (part.get("injective") or {}).get("share") or 0.0
        if least_share is not None and not share >= least_share:
            shortfall = f"{share:.4g} of the source's area is certified one-to-one, less than {least_share:g}"
            return False, label(pair, f"{shortfall} (--require-injective)")
    if report.get("not_written"):
        return False, report["message"]
    if omitted := report.get("without_map"):
        return False, (
            f"{len(omitted)} of {len(omitted) + len(run.fits)} parts are omitted, because no map was "
            "found for them."
        )
    return _fault(run, report) is None, report["message"]


def _fault(run: Run, figures: dict[str, Any]) -> Status | None:
    """Return what is wrong with a result although all of its maps are good; None if nothing is."""
    if has_flips(figures):
        return Status.FLIPPED
    if is_tilted(run):
        return Status.TILTED
    if any(_is_partial(run, side) for side in ((0, 1) if run.job.target else (0,))):
        return Status.PARTIAL
    if _leaves_bare(run):
        return Status.BARE
    if run.fits and all(fit.coverage.seen is not None and fit.coverage.seen.hidden >= 1 for fit in run.fits):
        return Status.HIDDEN
    if _is_lost_in_lines(run):
        return Status.LINES
    if figures.get("empty"):
        return Status.EMPTY
    layouts = [
        baked for baked in (figures, *figures.get("tiles", {}).values()) if "conflicting_texels" in baked
    ]
    if run.job.overlap == "refuse" and any(map(is_stacked, layouts)):
        return Status.STACKED
    unpaired = (figures.get("unpaired") or {}).get("target")
    return Status.UNPAIRED if unpaired and run.source.is_mesh and run.target.is_mesh else None


def is_tilted(run: Run) -> bool:
    """Return whether a mesh is not upright on another one, or not turned by --turn, and nothing was given that could
    mean this.
    """
    job = run.job
    meant = job.has_pins or job.start or job.rigid or job.rigid_target or job.turn == "any"
    return not meant and not is_turned(run)


def is_turned(run: Run) -> bool:
    """Return whether meshes lie on others as --turn requests, by default upright, by the up axes of both."""
    most = MOST_TILT_DEGREES if run.job.turn is None else MOST_TURN_ERROR_DEGREES
    return all(turn_error(run, number) <= most for number in range(len(run.fits)))


def turn_error(run: Run, number: int = 0) -> float:
    """Return the difference in degrees between the rotation of a mesh on another one and that of --turn."""
    if not all(shape.is_mesh for shape in run.pairs[number]):
        return 0.0
    requested = float(run.job.turn or 0.0) if run.job.turn != "any" else 0.0
    return abs((run.fits[number].tilt - requested + 180) % 360 - 180)


def _is_partial(run: Run, side: int) -> bool:
    """Return whether less than `LEAST_SHARE` of the area of a mesh is mapped, and no part of it was selected."""
    spec, shapes = (run.job.target if side else run.job.source), run.shapes(side)
    if spec is None or len(shapes) > 1 or not shapes[0].is_mesh:
        return False
    if run.job.parts == "largest" or Spec.of(spec).selection:
        return False
    from ..shapes.mesh_shape import as_mesh

    return as_mesh(shapes[0]).share < LEAST_SHARE


def _is_lost_in_lines(run: Run) -> bool:
    """Return whether less than `LEAST_SHOWN_SHARE` of the source is seen, because the target is drawn with lines."""
    from .texture import MOST_PAINTED_BY_LINES_SHARE

    drawing = run.target.drawing
    if run.job.max_left_out is not None or not run.job.target or drawing is None or len(run.fits) != 1:
        return False
    seen = run.fit.coverage.seen
    is_thin = drawing.region.area < MOST_PAINTED_BY_LINES_SHARE * drawing.hull_region.area
    return is_thin and seen is not None and seen.hidden > 1 - LEAST_SHOWN_SHARE


def _leaves_bare(run: Run) -> bool:
    """Return whether the maps reach less than `LEAST_SHARE` of what the target paints, and no option allows that."""
    job = run.job
    if not job.target or leaves_bare(job.fit) or job.place == "inside" or job.max_uncovered is not None:
        return False
    planar = [fit for fit in run.fits if fit.target is not None and not all(fit.details.layouts)]
    areas = [abs(fit.target.area) for fit in planar if fit.target is not None]
    reached = sum(fit.coverage.reached * area for fit, area in zip(planar, areas))
    return bool(planar) and reached < LEAST_SHARE * sum(areas)


def has_flips(figures: dict[str, Any]) -> bool:
    """Return whether the written texture coordinates flip a triangle, or leave one without area."""
    return any((figures.get("uv") or {}).values())
