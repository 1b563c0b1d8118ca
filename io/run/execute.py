"""Run a job: read its inputs, solve, and write the outputs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ... import deadline, progress
from ...deadline import TimeUp
from ...errors import InputError
from ...progress import Listener
from .. import files, formats, references
from . import earlier, outputs, parts, projected, report, texture
from .constraints import add_names, go_on, solve
from .job import Job, Outcome
from .outputs.output import Output
from .parts import Pair, Pairs
from .phases import Doubt, Phases
from .report import OutputReport
from .resolve import resolve
from .state import Run, Tell

if TYPE_CHECKING:
    from ...solve import Fit


def run(
    job: Job,
    *,
    threads: int | None = None,
    tell: Tell = lambda note: None,
    listener: Listener | None = None,
    dry: bool = False,
    again: bool = False,
) -> Outcome:
    """Run a job.

    Args:
        job: the job.
        threads: threads for the pixels, None for all cores; never changes the result.
        tell: called with each note as it is made.
        listener: receives progress, see `iccm.progress`.
        dry: whether to read and check only, without solving or writing anything.
        again: whether outputs that an earlier run of the same shapes wrote may be replaced, see `earlier`.

    Raises:
        InputError: an input or output is invalid. In this case nothing has been written.
    """
    from ...blas import one_thread

    with one_thread(), references.outside(job.allow_outside), progress.heard(listener):
        return _run(job, threads, tell, Phases(), dry, again)


def _run(job: Job, threads: int | None, tell: Tell, phases: Phases, dry: bool, again: bool) -> Outcome:
    with phases.timed("read"):
        run, writers = _read(job, threads, tell, phases, again)
    job = run.job
    if dry:
        outputs.tell_share(run)
        would_write = tuple(name for name in job.outputs if name != "-")
        return Outcome(True, "", {}, would_write, tuple(run.notes), run.idle)
    sampled = any(output.samples for output in writers)
    if sampled:
        run.begin("sampler")
    solve_pairs(run)
    if run.source.is_mesh and run.target.is_mesh and job.parts == "all":
        from .pieces import add_landmarks

        add_landmarks(run, solve_pairs)
    elif run.source.is_mesh and run.target.is_mesh and job.target:
        run, writers = _matched_by_position(run, writers, threads, again)
        job = run.job
    elif run.target.is_mesh:
        from .layout_choice import choose_layout

        choose_layout(run, solve_pairs)
    note_maps(run)
    outputs.tell_share(run)
    if sampled and len(run.fits) == 1:
        run.note(*texture.notes_on_lines(job, run.source, run.fits[0]))
    run.begin("fit_report")
    with files.together(), ExitStack() as stack:
        output_reports, time_up = _write_in_time(run, writers, stack)
        written_outputs = writers[: len(output_reports)]
        with deadline.limited(None):  # what is known of the map by now is reported
            progress.tell("evaluate")
            figures = report.build(run, output_reports)
            if time_up:
                late = [output.name for output in writers if output not in written_outputs]
                figures |= report.out_of_time(time_up, late)
            if job.report:
                report.write(figures, job.report, stack, force=job.force)
    ok, message = report.verdict(run, figures)
    names = [output.name for output in written_outputs] + ([job.report] if job.report else [])
    companions = [name for output_report in output_reports for name in output_report.files or ()]
    written = (*(name for name in names if name != "-"), *companions)
    if again:
        earlier.remember(job, written)
    return Outcome(ok, message, figures, written, tuple(run.notes), run.idle)


def _write_in_time(
    run: Run, writers: list[Output], stack: ExitStack
) -> tuple[list[OutputReport], TimeUp | None]:
    """Write the outputs, which appear when the stack is closed, until the time limit is over.

    Returns:
        The reports of the outputs that are complete, and the error that ended writing, if any.
    """
    output_reports = list[OutputReport]()
    for output in writers:
        try:
            with ExitStack() as incomplete:
                path = incomplete.enter_context(files.writing(output.name, force=run.job.force))
                written = output.write(run.with_texture(output.map), path, output_reports)
                stack.push(incomplete.pop_all())
        except TimeUp as error:
            return output_reports, error
        output_reports.append(written)
    return output_reports, None


def _read(job: Job, threads: int | None, tell: Tell, phases: Phases, again: bool) -> tuple[Run, list[Output]]:
    """Read the inputs of a job and check its outputs; return both with all names and options filled in.

    Raises:
        InputError: an input or output is invalid. An output that may not be written is reported only if nothing else is
            wrong.
    """
    resolved = resolve(job, again=again)
    heard = tell if resolved.refusal is None else _ignore  # notes are for jobs that run
    run = Run.read(resolved.job, resolved.inputs, threads, heard, phases, resolved.notes)
    writers = outputs.check(run, resolved.writers)
    if resolved.refusal is not None:
        raise resolved.refusal
    return run, writers


def _matched_by_position(
    run: Run, writers: list[Output], threads: int | None, again: bool
) -> tuple[Run, list[Output]]:
    """Solve again with pins by position if two meshes are in the same place and their map has drifted."""
    from .by_position import pins_by_position

    pins = pins_by_position(run)
    if not pins:
        return run, writers
    known_notes = set(run.notes)

    def tell(note: str) -> None:
        if note not in known_notes:
            known_notes.add(note)
            run.tell(note)

    pinned = run.job.model_copy(update={"pin": tuple(pins)})
    with run.phases.timed("read"):
        pinned_run, pinned_outputs = _read(pinned, threads, tell, run.phases, again)
    text = (
        f"lies where {run.job.source} does, so {len(pins)} of its vertices are pinned to the nearest points"
    )
    pinned_run.note(f"{run.job.target}: {text} (use --pin for other pins)")
    try:
        solve_pairs(pinned_run)
    except InputError:
        return run, writers
    return (pinned_run, pinned_outputs) if _apart(pinned_run) < _apart(run) else (run, writers)


def _apart(run: Run) -> float:
    """Return the p95 of the distance between corresponding points of two surfaces."""
    return float(run.fit.report()["apart"]["p95"])


def _ignore(note: str) -> None:
    """Ignore a note."""


Settings = tuple[dict[str, Any], bool]
"""Options of `iccm.fit` that differ from the job's, and whether holes are mapped onto holes."""


def solve_pairs(run: Run, settings_of: Callable[[Pair], Settings] | None = None) -> None:
    """Solve for the map of each pair of shapes. If there are several, pairs without a map are reported and left out.

    Args:
        run: the job.
        settings_of: returns options for a pair, if they differ from the job's.

    Raises:
        InputError: no pair has a map.
    """
    check_place(run)
    pair_parts(run)
    job, count, arguments = run.job, len(run.pairs), run.constraints | run.job.solver
    if job.target and job.exact:
        arguments |= {"holes": "keep"} if job.holes == "keep" else {}
        meshes = any(shape.is_mesh for pair in run.pairs for shape in pair)
        arguments |= {"fit": "whole"} if meshes and job.fit is None else {}
        arguments |= {"fit": "whole"} if job.handles else {}  # as with the pins that will be read
    solved, failed = Pairs(), list[tuple[Pair, InputError]]()
    with run.phases.timed("solve"):
        for k, pair in enumerate(run.pairs):
            within = progress.within("solve" if count == 1 else f"solve part {k + 1} of {count}")
            try:
                with within, add_names(run.called):
                    pair_arguments, holed = settings_of(pair) if settings_of else ({}, job.holed)
                    if run.choices and (holed or not any(shape.holes for shape in pair)):
                        pair_arguments = pair_arguments | {"choices": run.choices[k]}
                    fit = _solved(run, pair, arguments | pair_arguments, holed)
                    run.fits.append(fit)
                    solved.append(_framed(pair, fit))
            except InputError as error:
                failed.append((pair, error))
    if not solved:
        raise failed[0][1]
    run.pairs = solved
    if failed:
        run.figures["without_map"] = parts.without_map(failed)
    run.note(*(Doubt(parts.label(pair, f"omitted: {why}")) for pair, why in failed))


def note_maps(run: Run) -> None:
    """Add the notes on the maps of a job, once it is certain that these are the maps that it uses."""
    run.note(*(parts.label(pair, note) for pair, fit in zip(run.pairs, run.fits) for note in fit.notes))


def check_place(run: Run) -> None:
    """Check that --place can be used: the shapes must be plane, and the map must not come from a file.

    Raises:
        InputError: --place with a mesh, or with an earlier map.
    """
    if run.job.place == "fill":
        return
    option = f"--place {run.job.place}"
    for shape in (shape for pair in run.pairs for shape in pair if shape.is_mesh):
        raise InputError(
            f"{option}: only works for planar drawings, and {shape.spec} is a mesh; leave the option out"
        )
    if run.job.start:
        raise InputError(f"{option}: cannot be combined with --start; leave one of the two out")


def pair_parts(run: Run) -> None:
    """Map the parts of two drawings separately if that costs less than mapping them joined (--parts auto)."""
    job, (source, target) = run.job, run.pairs[0]
    free = not any(value is not None for value in run.constraints.values()) and not job.start
    one_map = job.handles or any(formats.of(name).map for name in job.output if name != "-")
    is_automatic = job.parts == "auto" and job.fit in (None, "auto") and job.place == "fill"
    if not (
        is_automatic
        and job.exact
        and not one_map
        and free
        and job.target
        and source.drawing
        and target.drawing
        and run.detail is None
    ):
        return
    from ...frames.solve import choose_with_parts
    from ...options import Options

    choices = choose_with_parts(
        source.drawing, target.drawing, Options(**job.solver), free_gaps=run.free_gaps
    )
    if choices is None:
        return
    pairs = choices[0].pairs
    run.choices = [pair.choices for pair in pairs] if pairs else [choices]
    if pairs:
        run.pairs = [
            (source.part_of(pair.source, k + 1), target.part_of(pair.target, k + 1))
            for k, pair in enumerate(pairs)
        ]
        run.note(
            f"{target.spec}: its {len(pairs)} parts are mapped separately (use --parts joined to map them together)"
        )


def _framed(pair: Pair, fit: Fit) -> Pair:
    """Return the pair with the frames that the map was solved for.

    With --place, these frames are parts of the shapes; the shapes keep their extent, which determines pictures and
    textures.
    """
    source, target = pair
    if fit.target is not None and (source.view or target.view):
        return source.framed(fit.source), target.framed(fit.target)
    if fit.details.drawings is None or fit.target is None:
        return pair
    if fit.details.place != "fill":
        source, target = (replace(shape, extent=shape.bounds) for shape in pair)
    return source.framed(fit.source), target.framed(fit.target)


def _solved(run: Run, pair: Pair, arguments: dict[str, Any], holed: bool) -> Fit:
    (source, target), start = pair, run.start
    if source.view or target.view:
        return projected.solve(pair)
    if target.is_mesh:
        from ..shapes.mesh_shape import as_mesh

        mesh = as_mesh(target)
        if mesh.packed:
            from ...surfaces.packed import place

            return place(source.curve, mesh.flattening)
    mapped_onto = target if run.job.target else None
    settings: dict[str, Any] = {"holed": holed, "tell": run.note}
    if mapped_onto is not None and source.drawing is not None:
        arguments = arguments | {"opaque": run.opaque, "free_gaps": run.free_gaps, "detail": run.detail}
        drawing = mapped_onto.drawing
        if run.job.parts == "elements" and run.job.fit is None and drawing and not drawing.is_one_part:
            arguments["fit"] = "frame"  # other fits may hide a small part, such as the dot of an i
    if start:
        return go_on(start, source, mapped_onto, arguments, **settings)
    return solve(source, mapped_onto, arguments, **settings)
