"""Run a job: read its inputs, solve, write what was asked for."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from ...memory import Room
from .. import files, formats
from ..memory import Bounded
from ..meshes import size_limits
from ..shapes import shape
from ..spec import Spec
from . import framing, parts, raster_size, report
from . import inputs as companions
from . import outputs as products
from .constraints import constrained
from .job import WRITTEN, Job
from .options import SOLVER
from .parts import Pairs
from .state import Progress, Run, Tell

if TYPE_CHECKING:
    from ..shapes.shape import Shape


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
    job: Job, *, threads: int | None = None, tell: Tell = lambda note: None, progress: Progress | None = None
) -> Outcome:
    """Do all of a job.

    Args:
        job: what to do.
        threads: threads for the pixels, None for all cores; never changes the result.
        tell: is given each remark on the inputs as it is made.
        progress: is given rows done and rows in all, of each picture.

    Raises:
        InputError: an input or output is wrong. Nothing has been written then.
    """
    start = time.perf_counter()
    job = with_outputs(job)
    makers = check(job)
    state = _read(job, threads, tell, progress)
    if raster_size.pictures(job):
        state.begin("sampler")
    _solve(state)
    state.begin("found")
    if makers and _cold():
        tell("the first run compiles, once; this may take a minute")
    with ExitStack() as stack:
        for name, make in makers.items():
            temporary = stack.enter_context(files.replacing(name, force=job.force)) if name != "-" else None
            make(state, temporary, Path(name))
        state.seconds["total"] = time.perf_counter() - start
        figures = report.build(state)
        if job.report:
            report.write(figures, job.report, stack, force=job.force)
    ok, message = report.verdict(state, figures)
    return Outcome(
        ok, message, figures, (*job.outputs, *state.figures.get("also_written", [])), tuple(state.notes)
    )


def _cold() -> bool:
    """Whether the kernels have never been compiled here; elsewhere than beside the modules nobody looks."""
    import iccm

    kernels = (Path(iccm.__file__).parent / "pixels" / "__pycache__").glob("filters.*.nbi")
    return "NUMBA_CACHE_DIR" not in os.environ and not any(kernels)


def with_outputs(job: Job) -> Job:
    """The job with a picture, or a mesh for a mesh, named after its shapes, when it writes nothing else."""
    if job.output or any(getattr(job, field) for field in WRITTEN):
        return job
    specs = [Spec.of(spec) for spec in (job.source, job.target) if spec]
    names = [spec.path.stem + (f"#{spec.chosen}" if spec.chosen else "") for spec in specs]
    name = "-".join(names if job.target else [*names, "deformed"]).replace("#", "-")
    return job.model_copy(update={"output": (name + products.suffix_for(job),)})


def check(job: Job) -> dict[str, products.Maker]:
    """What makes each output, after checking that all of them can be written and no input is among them.

    Raises:
        InputError: an unknown suffix, or as `_free`.
    """
    makers = {name: products.maker(name, job) for name in job.output}
    if job.plot:
        makers[job.plot] = products.plotter(job.plot)
    if job.stmap:
        makers[job.stmap] = products.stmapper(job.stmap)
    _free(job, job.outputs, job.inputs)
    return makers


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


def _read(job: Job, threads: int | None, tell: Tell, progress: Progress | None) -> Run:
    """The job's inputs; what is wrong with them, or with --size, is told before the solving."""
    start = time.perf_counter()
    pairs, notes = _shapes(job)
    room = Bounded(job.memory, _scratch(job)) if job.memory else Room()
    state = Run(job, pairs, room, tell, threads, progress)
    if job.parts == "largest":
        state.pins, state.strokes = constrained(job, *pairs[0])
    for note in notes:
        state.note(note)
    products.check(state)
    if others := products.beside(state):
        _free(job, others, companions.inputs(job), taken=job.outputs)
    for note in dict.fromkeys(
        f"{each.spec}: {note}" for pair in pairs for each in pair for note in each.notes
    ):
        state.note(note)
    state.seconds["read"] = time.perf_counter() - start
    return state


def _shapes(job: Job) -> tuple[Pairs, list[str]]:
    """Source and target, or the parts of them that go together, and what is to be said of that and of what is shown."""
    if job.parts == "all":
        pairs, notes = parts.read(job)
    else:
        source = read(job.source, job)
        pairs, notes = [(source, read(job.target, job) if job.target else source)], []
    box, said = framing.shown(job, pairs[0][1])
    seen = (
        raster_size.pictured(job)
        or job.stmap
        or any(formats.suffix_of(name) == ".svg" for name in job.output)
    )
    return [(s, replace(t, box=box) if box != t.box else t) for s, t in pairs], [
        *notes,
        *(said if seen else []),
    ]


def _scratch(job: Job) -> Path:
    """The folder of the first output: the disk that has room for the picture has it for the scratch file."""
    return Path(job.outputs[0]).resolve().parent if job.outputs else Path(tempfile.gettempdir())


def _solve(state: Run) -> None:
    import iccm

    job = state.job
    given = {name: value for name in SOLVER if (value := getattr(job, name)) is not None}
    with state.timed("solve"):
        for source, target in state.pairs:
            solve = (
                partial(iccm.fit, source.curve, target.curve)
                if job.target
                else partial(iccm.deform, source.curve)
            )
            state.fits.append(solve(pins=state.pins, strokes=state.strokes, **given))
    for (source, _), fit in zip(state.pairs, state.fits):
        for note in fit.notes:
            state.note(f"#{source.part}: {note}" if source.part else note)


def read(spec: str, job: Job) -> Shape:
    """A shape from a drawing, a picture or a mesh.

    Raises:
        InputError: it cannot be read, is no domain, or is larger than --max-faces or --max-pixels allow.
    """
    if not products.is_mesh(spec):
        return shape.read(spec)
    from ..shapes import mesh_shape

    size_limits.faces(Spec.of(spec).path, job.max_faces)
    return mesh_shape.read(spec, cut=job.cut)
