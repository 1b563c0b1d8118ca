"""Landmarks for pairs of pieces of two meshes, each of which is mapped like two whole meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from ...errors import InputError
from ..shapes.mesh_shape import as_mesh
from .by_position import beside, update_extents
from .constraints import constrain
from .job import is_mesh
from .state import Run

if TYPE_CHECKING:
    from ..shapes.shape import Shape


def add_landmarks(run: Run, solve: Callable[[Run], None]) -> None:
    """Solve for pairs of pieces again with the same vertices of the same topology as landmarks.

    Args:
        run: the job, solved.
        solve: function that solves a job; it raises an InputError where there is no map.
    """
    for k in range(len(run.pairs)):
        if any(run.fits[k] is fit for fit in run.known.values()):
            continue
        trial, remark = _with_landmarks(run, k)
        if trial is None:
            continue
        try:
            solve(trial)
        except InputError:
            continue
        gap, trial_gap = run.fits[k].report().get("apart"), trial.fit.report().get("apart")
        if not trial.fit.status.ok and not (gap and trial_gap and trial_gap["p95"] < gap["p95"]):
            continue
        run.pairs[k], run.fits[k] = trial.pairs[0], trial.fit
        update_extents(run)
        run.note(f"{run.job.target}: {remark}")


def _with_landmarks(run: Run, k: int) -> tuple[Run | None, str]:
    """Return a pair as a separate job with landmarks, not yet solved, and a remark on them; None if it has none."""
    source, target = run.pairs[k]
    names = {side: f"{shape.path}#{shape.part}" for side, shape in (("source", source), ("target", target))}
    job = run.job.model_copy(update={**names, "parts": "largest"})
    inputs = run.inputs.of_job(job)
    pins = inputs.same_vertices()
    of_source = f"#{source.part} of {run.job.source}"
    text = f"{len(pins)} vertices are pinned to the same vertices"
    remark = f"#{target.part} has the same topology as {of_source}, so {text}"
    if not pins:
        return None, ""
    job = job.model_copy(update={"pin": tuple(pins)})
    inputs = run.inputs.of_job(job)
    trial = Run.read(job, inputs, run.threads, lambda note: None, run.phases)
    pair = _in_place_of(run, 0, trial.source, source), _in_place_of(run, 1, trial.target, target)
    splits = [_is_split(new, old) for new, old in zip(pair, (source, target))]
    if splits[1] or (splits[0] and not all(is_mesh(name) or job.bake for name in job.outputs)):
        return None, ""  # pictures in the target's plane need the file's own triangles
    trial.pairs = [pair]
    trial.constraints, trial.called = constrain(job, *pair, inputs.listed)
    return trial, remark


def _is_split(shape: Shape, original: Shape) -> bool:
    """Return whether a piece has other triangles than before, because its cut runs through faces."""
    return as_mesh(shape).file.mesh.corners.size != as_mesh(original).file.mesh.corners.size


def _in_place_of(run: Run, side: int, shape: Shape, replaced: Shape) -> Shape:
    """Return a piece moved to where the same piece lies that was cut in another way.

    It refers to the file's triangles unless its own were split.
    """
    shifted = beside(run, side, as_mesh(shape), as_mesh(replaced))
    return shifted if _is_split(shifted, replaced) else replace(shifted, file=as_mesh(replaced).file)
