"""Run a job: read its inputs, solve, write what was asked for."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from . import files, shapes
from .job import Job, path_of

if TYPE_CHECKING:
    from ..solve import Fit
    from .images import Image
    from .shapes import Shape

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".webp", ".hdr", ".bmp")
PLOTS = (".png", ".svg", ".pdf")
LONGER_SIDE = 1024
SOLVER = (
    "quasi", "method", "order", "max_iterations", "tolerance", "vertices", "pin_weight", "stroke_weight", "smoothness"
)  # fmt: skip


@dataclass
class Run:
    """A job under way: what was read, what was found, and how long each part took."""

    job: Job
    source: Shape
    target: Shape
    fit: Fit
    seconds: dict[str, float]
    threads: int | None = None
    notes: list[str] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def found(self) -> dict[str, Any]:
        """The solver's own report, made once."""
        with self.timed("evaluate"):
            return self.fit.report()

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
        written: the files, in the order of writing.
    """

    ok: bool
    message: str
    report: dict[str, Any]
    written: tuple[str, ...]
    notes: tuple[str, ...]


def run(job: Job, *, threads: int | None = None, tell: Callable[[str], None] = lambda note: None) -> Outcome:
    """Do all of a job.

    Args:
        job: what to do.
        threads: threads for the pixels, None for all cores; never changes the result.
        tell: is given each remark on the inputs as it is made.

    Raises:
        InputError: an input or output is wrong. Nothing has been written then.
    """
    from . import report

    start = time.perf_counter()
    job = with_outputs(job)
    makers = check(job)
    state = _solve(job, threads, tell)
    with ExitStack() as stack:
        for name, make in makers.items():
            make(state, stack.enter_context(files.replacing(name, force=job.force)) if name != "-" else None)
        state.seconds["total"] = time.perf_counter() - start
        figures = report.build(state)
        if job.report:
            report.write(figures, job.report, stack, force=job.force)
    ok, message = report.verdict(state, figures)
    return Outcome(ok, message, figures, job.outputs, tuple(state.notes))


def with_outputs(job: Job) -> Job:
    """The job with a picture named after its shapes in the current folder, when it writes nothing else."""
    if job.output or job.report or job.plot:
        return job
    names = [
        Path(path_of(spec)).stem + spec[len(path_of(spec)) :] for spec in (job.source, job.target) if spec
    ]
    name = "-".join(names if job.target else [*names, "deformed"]).replace("#", "-")
    return job.model_copy(update={"output": (f"{name}.png",)})


Maker = Callable[[Run, Path | None], None]


def check(job: Job) -> dict[str, Maker]:
    """What makes each output, after checking that all of them can be written and no input is among them.

    Raises:
        InputError: an unknown suffix, a folder that is missing or not writable, a file that exists.
    """
    makers = {name: _maker(name) for name in job.output}
    if job.plot:
        _known(job.plot, PLOTS, "--plot")
        makers[job.plot] = _plot
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


def _maker(name: str) -> Maker:
    if name == "-":
        return _picture_on_stdout
    _known(name, PICTURES, "-o")
    return _picture


def _known(name: str, suffixes: tuple[str, ...], option: str) -> None:
    if Path(name).suffix.lower() not in suffixes:
        raise InputError(f"{name}: unknown suffix for {option}; use one of {' '.join(suffixes)}")


def _solve(job: Job, threads: int | None, tell: Callable[[str], None]) -> Run:
    import iccm

    seconds: dict[str, float] = {}
    with _timed(seconds, "read"):
        source = shapes.read(job.source)
        target = shapes.read(job.target) if job.target else source
        pins, strokes = constrained(job, source, target)
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
    return Run(job, source, target, fit, seconds, threads, [*notes, *fit.notes])


def constrained(job: Job, source: Shape, target: Shape) -> tuple[Any, Any]:
    """The pins (k, 2) and strokes of a job in the core plane: those in the files, then --constraints, then --pin."""
    pins, strokes = _drawn(job, source, target)
    typed = [(source.to_core(pin[:2]), target.to_core(pin[2:])) for pin in job.pin]
    if typed:
        pins = np.concatenate(
            [np.reshape(pins, (-1, 2)), np.reshape(np.array(typed, dtype=complex), (-1, 2))]
        )
    _inside(source, "pin", [pin[0] for pin in pins])
    _inside(source, "vertex of a stroke", [z for stroke in strokes for z in stroke[0].z])
    return (pins if len(pins) else None), (strokes or None)


def _inside(shape: Shape, what: str, points: list[complex]) -> None:
    """Say in the file's own units which point of the source lies outside it."""
    z = np.array(points, dtype=complex)
    gap = np.abs(shape.curve.at(shape.curve.closest(z)) - z) if z.size else z.real
    outside = np.flatnonzero(~shape.curve.contains(z) & (gap > 1e-6 * shape.curve.diagonal))
    if outside.size:
        x, y = shape.to_file(z[outside[0]])
        where = f"({x:g}, {y:g}) is outside the shape by {gap[outside[0]]:.3g}"
        raise InputError(f"{shape.spec}: {what} {outside[0] + 1}: {where}; move it inside")


def _drawn(job: Job, source: Shape, target: Shape) -> tuple[Any, Any]:
    if not (job.constraints or any(shape.pins or shape.strokes for shape in (source, target))):
        return [], []
    from . import constraints

    listed = constraints.read(job.constraints) if job.constraints else None
    return constraints.pair(source, target, listed)


def picture(run: Run) -> Image:
    """The texture carried to the target's canvas, in the texture's own depth and colour space."""
    from ..resample import warp

    job = run.job
    image, box = texture(run)
    with run.timed("resample"):
        warped = warp(
            run.fit.map,
            image.texture(box, kind=job.kind),
            canvas(run),
            filter=job.filter,
            kind=job.kind,
            edge=job.edge,
            padding=job.padding,
            max_error=job.max_pixel_error,
            threads=run.threads,
        )
    run.figures["pixels"] = warped.diagnostics.as_dict()
    return image.with_pixels(warped.pixels, warped.alpha)


def texture(run: Run) -> tuple[Image, tuple[complex, complex]]:
    """The texture and its place in the source's plane: --texture, or a checkerboard with square squares."""
    from . import images

    box = run.source.box if run.job.texture_box == "viewbox" else run.source.curve.box
    if run.job.texture:
        with run.timed("read"):
            return images.read(
                run.job.texture, max_pixels=run.job.max_pixels, colorspace=run.job.colorspace
            ), box
    from ..checkerboard import checkerboard

    middle, half = (box[0] + box[1]) / 2, max((box[1] - box[0]).real, (box[1] - box[0]).imag) / 2
    pixels = checkerboard(1024)
    return images.Image(pixels, alpha=-1, associated=False, colorspace="sRGB", metadata={}), (
        middle - half * (1 + 1j),
        middle + half * (1 + 1j),
    )


def canvas(run: Run) -> Any:
    """The target's raster: its box, grown about its middle to the proportions of --size.

    Raises:
        InputError: more pixels than --max-pixels.
    """
    from ..resample import Canvas

    low, high = run.target.box
    extent = high - low
    width, height = _pixels(run.job.size or (LONGER_SIDE,), extent)
    if width * height > run.job.max_pixels:
        raise InputError(
            f"--size: {width}x{height} is more than {run.job.max_pixels} pixels; raise --max-pixels"
        )
    scale = max(extent.real / width, extent.imag / height)
    middle, half = (low + high) / 2, scale * complex(width, height) / 2
    return Canvas(width, height, (middle - half, middle + half))


def _pixels(size: tuple[int, ...], extent: complex) -> tuple[int, int]:
    if len(size) == 2:
        return size[0], size[1]
    scale = size[0] / max(extent.real, extent.imag)
    return max(1, round(extent.real * scale)), max(1, round(extent.imag * scale))


def _picture(run: Run, path: Path | None) -> None:
    from . import images

    assert path is not None
    made = picture(run)
    with run.timed("write"):
        images.write(path, made)


def _picture_on_stdout(run: Run, path: Path | None) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        _picture(run, Path(folder) / "picture.png")
        with open(Path(folder) / "picture.png", "rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)


def _plot(run: Run, path: Path | None) -> None:
    from . import plot

    assert path is not None
    with run.timed("plot"):
        plot.draw(run, path)


@contextmanager
def _timed(seconds: dict[str, float], part: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[part] = seconds.get(part, 0.0) + time.perf_counter() - start
