"""Run a job: read its inputs, solve, write what was asked for."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from . import files, limits, placement, products, report, shapes
from .constrained import constrained
from .job import WRITTEN, Job, path_of

if TYPE_CHECKING:
    from ..solve import Fit
    from .images import Image
    from .shapes import Shape

SOLVER = (
    "quasi", "method", "order", "max_iterations", "tolerance", "vertices", "pin_weight", "stroke_weight", "smoothness"
)  # fmt: skip
Tell = Callable[[str], None]
Progress = Callable[[int, int], None]


@dataclass
class Run:
    """A job under way.

    Attributes:
        job: what to do.
        source, target: its shapes; the same for a deformation.
        fit: the map.
        seconds: what each part took.
        tell: is given each remark as it is made.
        threads: for the pixels; None for all cores.
        progress: is given rows done and rows in all.
        read_before: the texture, where it was read before the solving.
        notes: remarks on the inputs and on the solving.
        figures: what making the products adds to the report.
    """

    job: Job
    source: Shape
    target: Shape
    fit: Fit
    seconds: dict[str, float]
    tell: Tell
    threads: int | None = None
    progress: Progress | None = None
    read_before: Image | None = None
    notes: list[str] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def found(self) -> dict[str, Any]:
        """The solver's own report, made once."""
        with self.timed("evaluate"):
            return self.fit.report()

    def note(self, remark: str) -> None:
        """Add a remark."""
        self.notes.append(remark)
        self.tell(remark)

    @cached_property
    def image(self) -> Image:
        """The texture."""
        return self.read_before or placement.image_of(self.job, self.source)

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the block's time to `part` of the report."""
        with _timed(self.seconds, part):
            yield


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
    state = _solved(job, threads, tell)
    state.progress = progress
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

    kernels = (Path(iccm.__file__).parent / "__pycache__").glob("sampling.*.nbi")
    return "NUMBA_CACHE_DIR" not in os.environ and not any(kernels)


def with_outputs(job: Job) -> Job:
    """The job with a picture, or a mesh for a mesh, named after its shapes, when it writes nothing else."""
    if job.output or any(getattr(job, field) for field in WRITTEN):
        return job
    names = [
        Path(path_of(spec)).stem + spec[len(path_of(spec)) :] for spec in (job.source, job.target) if spec
    ]
    name = "-".join(names if job.target else [*names, "deformed"]).replace("#", "-")
    return job.model_copy(update={"output": (name + products.suffix_for(job),)})


def check(job: Job) -> dict[str, products.Maker]:
    """What makes each output, after checking that all of them can be written and no input is among them.

    Raises:
        InputError: an unknown suffix, a folder that is missing or not writable, a file that exists.
    """
    makers = {name: products.maker(name, job) for name in job.output}
    if job.plot:
        makers[job.plot] = products.plotter(job.plot)
    if job.stmap:
        makers[job.stmap] = products.stmapper(job.stmap)
    inputs = {Path(name).resolve() for name in job.inputs}
    seen: set[Path] = set()
    for name in job.outputs:
        real = files.check_output(name, force=job.force)
        if real in inputs:
            raise InputError(f"{name}: is also an input; name another output")
        if real in seen:
            raise InputError(f"{name}: is named for two outputs; give each its own")
        seen.add(real)
    return makers


def _solved(job: Job, threads: int | None, tell: Tell) -> Run:
    import iccm

    seconds: dict[str, float] = {}
    with _timed(seconds, "read"):
        source = read(job.source, job)
        target = read(job.target, job) if job.target else source
        pins, strokes = constrained(job, source, target)
        image = placement.foreseen(job, source, target)
    notes = list(dict.fromkeys(f"{s.spec}: {note}" for s in (source, target) for note in s.notes))
    for note in notes:
        tell(note)
    options = {name: value for name in SOLVER if (value := getattr(job, name)) is not None}
    with _timed(seconds, "solve"):
        if job.target:
            fit = iccm.fit(source.curve, target.curve, pins=pins, strokes=strokes, **options)
        else:
            fit = iccm.deform(source.curve, pins=pins, strokes=strokes, **options)
    for note in fit.notes:
        tell(note)
    return Run(
        job, source, target, fit, seconds, tell, threads, read_before=image, notes=[*notes, *fit.notes]
    )


def read(spec: str, job: Job) -> Shape:
    """A shape from a drawing, a picture or a mesh.

    Raises:
        InputError: it cannot be read, is no domain, or is larger than --max-faces or --max-pixels allow.
    """
    if not products.is_mesh(spec):
        return shapes.read(spec)
    from . import transfer

    limits.faces(Path(path_of(spec)), job.max_faces)
    return transfer.read(spec, cut=job.cut)


@contextmanager
def _timed(seconds: dict[str, float], part: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[part] = seconds.get(part, 0.0) + time.perf_counter() - start
