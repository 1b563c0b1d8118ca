"""The constraints of a job in the core plane: those drawn in the files, those listed, those typed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import ConstraintError, InputError
from .job import Job

if TYPE_CHECKING:
    from ...result import Fit
    from ..shapes.listing import Listed
    from ..shapes.shape import Shape


Names = tuple[list[str], list[str]]  # of pins and of strokes, empty for those that have none


def constrained(
    job: Job, source: Shape, target: Shape, listed: Listed | None = None
) -> tuple[dict[str, Any], Names]:
    """The pins (k, 2), pairs of strokes and earlier map of a job as `iccm.fit` takes them, and the names of both;
    `listed` are those of its constraints file.

    Raises:
        InputError: a name without its partner, a place that a file does not have, a point outside the source.
    """
    from ..shapes.constraints import pairs_at

    pins, strokes, called, start = _drawn(job, source, target, listed)
    pairs = [pairs_at(source, target, here, there) for here, there in job.pin]
    typed = [each for pair in pairs for each in pair]
    pins = np.concatenate([np.reshape(pins, (-1, 2)), np.reshape(np.array(typed, dtype=complex), (-1, 2))])
    inside(source, "pin", list(pins[:, 0]))
    inside(source, "vertex of a stroke", [z for stroke in strokes for z in stroke[0].z])
    if job.target and exact(job):
        inside(target, "pin", list(pins[:, 1]))
        inside(target, "vertex of a stroke", [z for stroke in strokes for z in stroke[1].z])
    found = {"pins": pins if len(pins) else None, "strokes": strokes or None}
    return found | ({} if start is None else {"start": start}), called


@contextmanager
def calling(called: Names) -> Iterator[None]:
    """Add the names of pins and strokes to what is told of them by number."""
    try:
        yield
    except ConstraintError as error:
        pairs = zip(("pin", "stroke"), (error.pins, error.strokes), called)
        found = [
            f"{kind} {k + 1}: {names[k]}" for kind, which, names in pairs for k in which if _named(names, k)
        ]
        raise InputError(f"{error} ({', '.join(found)})" if found else str(error)) from None


def _named(names: list[str], k: int) -> bool:
    return k < len(names) and bool(names[k])


def exact(job: Job) -> bool:
    """Whether pins and strokes are met, not weighed: what lies outside the target could not be."""
    from ...problem import Options as Solver

    return Solver(**job.solver).is_balanced


def holed(job: Job) -> bool:
    """Whether the map of a job knows of holes: the balanced method's does, unless they are to be filled."""
    return job.holes == "keep" and exact(job)


def solved(job: Job, source: Shape, target: Shape, given: dict[str, Any], tell: Callable[[str], None]) -> Fit:
    """The map of two shapes as a job wants it, or the deformation; `tell` hears of holes that had to be left out."""
    import iccm

    from ..shapes.holes import deformed, fitted

    if not job.target:
        return deformed(source, **given) if holed(job) else iccm.deform(source.curve, **given)
    if holed(job):
        return fitted(source, target, tell, **given)
    return iccm.fit(source.domain, target.domain, **given)


def _drawn(job: Job, source: Shape, target: Shape, listed: Listed | None) -> tuple[Any, Any, Names, Any]:
    if not (listed or any(shape.pins or shape.strokes for shape in (source, target))):
        return [], [], ([], []), None
    from ..shapes import constraints

    start = listed.start.map(source, target) if listed and listed.start else None
    return *constraints.pair(source, target, listed), constraints.names(source, target, listed), start


def inside(shape: Shape, what: str, points: list[complex]) -> None:
    """Say in the file's own units which point lies outside a shape.

    Raises:
        InputError: one does.
    """
    z = np.array(points, dtype=complex)
    if not z.size:
        return
    gap = np.abs(shape.curve.at(shape.curve.closest(z)) - z)
    outside = np.flatnonzero(~shape.curve.contains(z) & (gap > 1e-6 * shape.curve.diagonal))
    if outside.size:
        x, y = shape.to_file(z[outside[0]])
        where = f"({x:g}, {y:g}) is outside the shape by {gap[outside[0]]:.3g}"
        raise InputError(f"{shape.spec}: {what} {outside[0] + 1}: {where}; move it inside")
