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
from ...maps.summary import CERTAIN_SHARE, SEEN_FOLDS
from ...result import FAR_OFF_TOLERANCES
from ...status import Status
from .. import files
from .parts import label
from .phases import Doubt

if TYPE_CHECKING:
    from .state import Run

SCHEMA = "iccm.report/1"


@dataclass(frozen=True)
class OutputReport:
    """What is found in writing an output, for the report of the run.

    Attributes:
        figures: entries of the report.
        tile: the number of the tile that they are of, if the output is of one.
        parts: entries of each part's map, as the output has it, which take the place of the solver's.
        message: a sentence that takes the place of the solver's.
        files: names of those that were written beside it; None of a kind of output that never has any.
    """

    figures: dict[str, Any] = field(default_factory=dict)
    tile: int | None = None
    parts: Sequence[dict[str, Any]] = ()
    message: str | None = None
    files: Sequence[str] | None = None


def build(run: Run, outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Build the report: what the solver found, then time, inputs with their hashes, options and version.

    What puts the picture in doubt becomes notes. Seconds are left out when SOURCE_DATE_EPOCH is set, so that the same
    job then gives the same bytes.

    Args:
        run: the job.
        outputs: what was found in writing each output.
    """
    found = map_figures(run, outputs)
    note_doubts(run, found)
    figures = run.figures | output_figures(outputs)
    report = {"schema": SCHEMA, "version": __version__, **found, **figures}
    if run.fit.status.ok and has_flips(figures):
        report |= {"status": Status.FLIPPED.name.lower(), "message": Status.FLIPPED.value}
    if "SOURCE_DATE_EPOCH" not in os.environ:
        report["seconds"] = run.phases.report()
    report["notes"] = run.notes
    report["inputs"] = [{"path": name, "sha256": run.inputs.sha256(name)} for name in run.inputs.named]
    report["job"] = run.job.model_dump(mode="json", exclude_defaults=True, exclude={"force"})
    return as_json(report)


def map_figures(run: Run, outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Return the solver's report, with what outputs measured in the place of what it knows."""
    found = dict(run.fit_report)
    if "parts" in found:
        found["parts"] = [dict(part) for part in found["parts"]]
    for output in outputs:
        for part, figures in zip(found.get("parts", []), output.parts):
            part |= {key: part[key] | value for key, value in figures.items() if key in part}
        for figures in output.parts[:1]:
            found |= {key: found[key] | value for key, value in figures.items()}
        if output.message:
            found["message"] = output.message
    return found


def output_figures(outputs: Sequence[OutputReport]) -> dict[str, Any]:
    """Return the entries of the report that outputs add: those of tiles by their numbers, files beside them in one
    list.
    """
    found = dict[str, Any]()
    for output in outputs:
        if output.tile is None:
            found |= output.figures
        else:
            found.setdefault("tiles", {})[str(output.tile)] = output.figures
        if output.files is not None:
            found["also_written"] = [*found.get("also_written", []), *output.files]
    return found


def note_doubts(run: Run, found: dict[str, Any]) -> None:
    """Note, once, what the solver has to say and what puts the picture in doubt, by its figures (`map_figures`)."""
    weighed = not run.job.exact
    parts = found.get("parts", [found])
    for pair, fit, part in zip(run.pairs, run.fits, parts):
        doubted = doubts(found | part, run.job.tolerance, run.job.quasi is not None, weighed=weighed)
        noted = [note if note in fit.notes else Doubt(note) for note in part["notes"]]
        run.note(*(type(note)(label(pair, note)) for note in [*noted, *doubted]))


def doubts(found: dict[str, Any], tolerance: float, quasi: bool, *, weighed: bool = True) -> list[str]:
    """Sentences on what a solver that ended well leaves wrong with the picture: pins and strokes may contradict the
    outline or each other. They name the part of the report that says how much, and change with nothing else.

    Args:
        found: the solver's own report.
        tolerance: the gap that would do.
        quasi: whether the map was free to be quasi-conformal.
        weighed: whether constraints pull with a weight, instead of being met.
    """
    said: list[str] = []
    gap, injective = (found["boundary"] or {}).get("hausdorff", 0.0), found["injective"]
    pulled = weighed and bool(found["pins"] or found["strokes"])
    if gap > FAR_OFF_TOLERANCES * tolerance and (pulled or found["status"] not in ("gap", "crowded")):
        said.append(Doubt("the mapped outline is far from the target's outline (boundary)"))
    if not injective["certified"]:
        seen = injective["folded"] >= SEEN_FOLDS
        what = "not one-to-one, so the picture overlaps itself" if seen else "not certified to be one-to-one"
        said.append(Doubt(f"the map is {what} (injective)"))
    elif injective["share"] < CERTAIN_SHARE and not injective["folded"] >= SEEN_FOLDS:
        said.append(
            f"the picture may overlap itself near the outline: only {injective['share']:.1%} of the "
            "source's area is certified one-to-one (injective)"
        )
    if not (found["pins"] or found["strokes"]) or not weighed:
        return said
    cure = "move pins and strokes, or lower their weights" + ("" if quasi else ", or try --quasi 0.01")
    return [type(text)(f"{text}; {cure}") for text in said]


def as_json(value: Any) -> Any:
    """Only what JSON can say: numpy becomes lists and numbers, complex numbers pairs, NaN and infinity null.

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
    """Return the report, made so by `as_json`, as it is written: one key a line, ending in a newline."""
    return json.dumps(as_json(report), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write(report: dict[str, Any], name: str, stack: ExitStack, *, force: bool) -> None:
    """Write the report to stdout, or to a file; it appears when the stack is left."""
    path = stack.enter_context(files.writing(name, force=force, suffix=".json"))
    path.write_text(text(report), encoding="utf-8")


def verdict(run: Run, report: dict[str, Any]) -> tuple[bool, str]:
    """Return whether the result is good enough, and a sentence on it."""
    wanted = run.job.require_injective
    for pair, fit, part in zip(run.pairs, run.fits, report.get("parts", [report])):
        if not fit.status.ok:
            return False, label(pair, fit.status.value)
        share = (part.get("injective") or {}).get("share") or 0.0
        if wanted is not None and not share >= wanted:
            found = f"{share:.4g} of the source's area is certified one-to-one, less than {wanted:g}"
            return False, label(pair, f"{found} (--require-injective)")
    if left := report.get("without_map"):
        return False, (
            f"{len(left)} of {len(left) + len(run.fits)} parts are omitted, because no map was "
            "found for them."
        )
    return not has_flips(report), report["message"]


def has_flips(figures: dict[str, Any]) -> bool:
    """Return whether texture coordinates were written that turn a triangle over, or leave it without area."""
    return any((figures.get("uv") or {}).values())
