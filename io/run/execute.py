"""Run a job: read its inputs, solve, write what was asked for."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import ahead, progress
from ...errors import InputError
from ...memory import Memory
from ...progress import Listener
from .. import files, formats, references
from ..memory import Bounded
from ..spec import Spec
from . import outputs, parts, report
from .constraints import calling, constrained, holed, solved
from .inputs import Inputs
from .job import STEM, WRITTEN, Job, shared
from .outputs.output import Output
from .phases import Phases
from .state import Run, Tell


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a job.

    Attributes:
        ok: whether the result is as good as was asked for; exit code 0 or 1.
        message: one sentence.
        report: the figures, see `report.build`.
        written: the files.
        notes: remarks on the inputs and on the solving.
    """

    ok: bool
    message: str
    report: dict[str, Any]
    written: tuple[str, ...]
    notes: tuple[str, ...]


def run(
    job: Job, *, threads: int | None = None, tell: Tell = lambda note: None, listener: Listener | None = None
) -> Outcome:
    """Do all of a job.

    Args:
        job: what to do.
        threads: threads for the pixels, None for all cores; never changes the result.
        tell: is given each remark as it is made, and a sentence when something has to be compiled.
        listener: is told what is under way, see `iccm.progress`.

    Raises:
        InputError: an input or output is wrong. Nothing has been written then.
    """
    from ...blas import one_thread

    with one_thread(), references.outside(job.outside), Phases.of(tell, listener) as phases:
        return _run(job, threads, tell, phases)


def _run(job: Job, threads: int | None, tell: Tell, phases: Phases) -> Outcome:
    with phases.timed("read"):
        inputs = Inputs(job)
        job = with_outputs(job, inputs)
        wanted = check(job, inputs)
        state = _read(job, inputs, threads, tell, phases)
        wanted = _expanded(state, wanted)
        _check_read(state, wanted)
    if job.method in (None, "balanced") and ahead.missing():
        with phases.timed("compile"):
            ahead.compile_ahead(threads)
    if any(output.samples for output in wanted):
        state.begin("sampler")
    _solve(state)
    state.begin("found")
    with ExitStack() as stack:
        for output in wanted:
            path = stack.enter_context(files.writing(output.name, force=job.force))
            output.write(state.showing(output.map), path)
        progress.tell("evaluate")
        figures = report.build(state)
        if job.report:
            report.write(figures, job.report, stack, force=job.force)
    ok, message = report.verdict(state, figures)
    names = [output.name for output in wanted] + ([job.report] if job.report else [])
    written = (*(name for name in names if name != "-"), *state.figures.get("also_written", []))
    return Outcome(ok, message, figures, written, tuple(state.notes))


def with_outputs(job: Job, inputs: Inputs | None = None) -> Job:
    """The job with a picture, or a mesh for a mesh, named after its shapes, when it writes nothing else.

    Raises:
        InputError: that mesh would not show the texture.
    """
    if job.output or any(getattr(job, field) for field in WRITTEN):
        return job
    specs = [Spec.of(spec) for spec in (job.source, job.target) if spec]
    names = [spec.path.stem + (f"#{spec.chosen}" if spec.chosen else "") for spec in specs]
    name = "-".join(names if job.target else [*names, "deformed"]).replace("#", "-")
    suffix = outputs.suffix_for(job, inputs or Inputs(job))
    if len(job.maps) > 1:
        name, suffix = f"{name}-{STEM}", ".png"
    try:
        return job.model_copy(update={"output": shared([name + suffix], job.maps)})
    except ValueError as error:
        raise InputError(str(error)) from None


def check(job: Job, inputs: Inputs | None = None) -> list[Output]:
    """The outputs, after checking that all of them can be written and no input is among them.

    Raises:
        InputError: an unknown suffix, or as `_free`.
    """
    formats.check_report(job.report)
    wanted = outputs.of(job, inputs or Inputs(job))
    _free(job, job.outputs, job.inputs)
    return wanted


def _free(job: Job, outputs: Iterable[str], inputs: Iterable[str], taken: Iterable[str] = ()) -> None:
    """Refuse outputs that cannot be written, are inputs, are named twice or taken by others.

    Raises:
        InputError: a folder that is missing or not writable, a file that exists.
    """
    read, seen = ({Path(name).resolve() for name in names} for names in (inputs, taken))
    for name in outputs:
        real = files.check_output(name, force=job.force)
        if real in read:
            raise InputError(f"{name}: is also an input; name another output")
        if real in seen:
            raise InputError(f"{name}: is named for two outputs; give each its own")
        seen.add(real)


def _read(job: Job, inputs: Inputs, threads: int | None, tell: Tell, phases: Phases) -> Run:
    """The job's shapes and constraints."""
    if job.parts == "all":
        pairs, notes = parts.read(job, inputs)
    else:
        source = inputs.shape(job.source)
        aim = inputs.shape(job.target, target=True) if job.target else source
        pairs, notes = [(source, aim)], []
    room = Bounded(job.memory, _scratch(job)) if job.memory else Memory()
    state = Run(job, inputs, pairs, room, tell, phases, threads)
    for note in notes:
        state.note(note)
    if job.parts == "largest":
        state.constraints, state.called = constrained(job, state.source, state.target, inputs.listed)
    return state


def _expanded(state: Run, wanted: list[Output]) -> list[Output]:
    """The outputs tile by tile.

    Raises:
        InputError: as `outputs.expanded`, or as `_free`.
    """
    found, known = outputs.expanded(state, wanted), {output.name for output in wanted}
    if more := [output.name for output in found if output.name not in known]:
        _free(state.job, more, state.inputs.named, taken=state.job.outputs)
    return found


def _check_read(state: Run, wanted: list[Output]) -> None:
    """Tell what is wrong with the inputs, or with --size, before the solving."""
    from ..shapes.holes import about

    job, shapes = state.job, [shape for pair in state.pairs for shape in pair]
    outputs.check(state, wanted)
    if others := [name for output in wanted for name in output.beside(state)]:
        _free(job, others, state.inputs.named, taken=job.outputs)
    for note in [f"{shape.spec}: {note}" for shape in shapes for note in shape.notes]:
        state.note(note)
    for note in about(state.pairs, keep=job.holes == "keep", mapped=holed(job)):
        state.note(note)


def _scratch(job: Job) -> Path:
    """The folder of the first output: the disk that has room for the picture has it for the scratch file."""
    return Path(job.outputs[0]).resolve().parent if job.outputs else Path(tempfile.gettempdir())


def _solve(state: Run) -> None:
    job = state.job
    count, constraints = len(state.pairs), state.constraints
    with state.phases.timed("solve"):
        for k, (source, target) in enumerate(state.pairs):
            within = progress.within("solve" if count == 1 else f"solve part {k + 1} of {count}")
            with within, calling(state.called):
                fit = solved(job, source, target, constraints | job.solver, state.note)
                state.fits.append(fit)
    for (source, _), fit in zip(state.pairs, state.fits):
        for note in fit.notes:
            state.note(parts.named(source, note))
