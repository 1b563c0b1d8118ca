"""Run a job: read its inputs, solve, and write the outputs."""

from __future__ import annotations

from contextlib import ExitStack

from ... import deadline, progress
from ...deadline import TimeUp
from ...errors import InputError
from ...progress import Listener
from .. import files, references
from . import earlier, outputs, report, texture
from .job import Job, Outcome
from .maps import note_maps, solve_pairs
from .outputs.output import Output
from .phases import Phases
from .report import OutputReport
from .resolve import resolve
from .state import Run, Tell


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
    if run.source.is_mesh and run.target.is_mesh:
        from .by_position import place_on_twins

        with run.phases.timed("solve"):
            place_on_twins(run)
    sampled = any(output.samples for output in writers)
    if sampled:
        run.begin("sampler")
    run.solve = solve_pairs
    if run.target.is_mesh and not run.source.is_mesh:
        from .layout_choice import solve_or_lay_out

        solve_or_lay_out(run, solve_pairs)
    else:
        solve_pairs(run)
    if run.source.is_mesh and run.target.is_mesh and job.parts == "all":
        from .pieces import add_landmarks

        add_landmarks(run, solve_pairs)
    elif run.source.is_mesh and run.target.is_mesh and job.target:
        run, writers = _matched_by_up(run, writers, threads, again)
        job = run.job
    note_maps(run)
    run.note(*texture.note_on_faces(job, run.source, run.detail))
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


def _matched_by_up(
    run: Run, writers: list[Output], threads: int | None, again: bool
) -> tuple[Run, list[Output]]:
    """Solve again with pins by the up axes of two meshes if one would not be upright on the other."""
    from .by_position import pins_by_up

    if not report.is_tilted(run):
        return run, writers
    turn = run.job.turn or 0.0
    pins = pins_by_up(run, float(turn))
    fault = f"--turn {turn:g}" if turn else f"{run.job.source} would lie on its side on it, or turned"
    alike = "correspond, seen" if turn else "look alike"
    remark = f"{fault}, so {len(pins)} places are pinned that {alike} from the side that both models face"
    known_notes = set(run.notes)

    def tell(note: str) -> None:
        if note not in known_notes:
            known_notes.add(note)
            run.tell(note)

    pinned = run.job.model_copy(update={"pin": tuple(pins)})
    try:
        with run.phases.timed("read"):
            pinned_run, pinned_outputs = _read(pinned, threads, tell, run.phases, again)
    except TimeUp:
        raise
    except InputError:  # no cut passes through the pins
        return run, writers
    pinned_run.note(f"{run.job.target}: {remark} (use --pin for other pins)")
    try:
        solve_pairs(pinned_run)
    except InputError:
        return run, writers
    better = report.is_turned(pinned_run) and report.turn_error(pinned_run) < report.turn_error(run)
    return (pinned_run, pinned_outputs) if better else (run, writers)


def _ignore(note: str) -> None:
    """Ignore a note."""
