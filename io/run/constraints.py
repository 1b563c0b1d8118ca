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


def constrain(
    job: Job, source: Shape, target: Shape, listed: Listed | None = None
) -> tuple[dict[str, Any], Names]:
    """The pins (k, 2), pairs of strokes and earlier map of a job as `iccm.fit` takes them, and the names of both;
    `listed` are those of its constraints file.

    Raises:
        InputError: a name without its partner, a place that a file does not have, a point outside the source.
    """
    from ..shapes import constraints

    found = constraints.collect(source, target, listed)
    found.check_weights()
    typed = [pair for start, end in job.pin for pair in constraints.pairs_at(source, target, start, end)]
    pins = np.concatenate([found.pins, np.reshape(np.array(typed, dtype=complex), (-1, 2))])
    for side, shape in enumerate((source, target) if job.target and job.exact else (source,)):
        check_inside(shape, "pin", list(pins[:, side]))
        check_inside(shape, "vertex of a stroke", [z for stroke in found.strokes for z in stroke[side].z])
    given: dict[str, Any] = {"pins": pins if len(pins) else None, "strokes": found.strokes or None}
    regions = job.rigid or (listed and listed.rigid) or source.rigid
    if regions and job.target:
        from ..shapes.regions import read

        given["rigid"] = read(source, job.rigid, listed.rigid if listed else ())
    if job.importance or job.size_map:
        from ..shapes.regions import fields

        given |= fields(source, job.importance, job.size_map)
    if listed and listed.start:
        given["start"] = listed.start.map(source, target)
    return given, found.names


@contextmanager
def add_names(called: Names) -> Iterator[None]:
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


def solve(
    source: Shape, target: Shape | None, given: dict[str, Any], *, holed: bool, tell: Callable[[str], None]
) -> Fit:
    """The map of two shapes, or the deformation of one, with their holes if it knows of them (`holed`).

    Args:
        source: the shape that is mapped.
        target: the shape that it is mapped onto; None for a deformation.
        given: options of `iccm.fit` and `iccm.deform`.
        holed: whether holes go onto holes.
        tell: hears of holes that had to be left out.
    """
    import iccm

    from ..shapes.holes import deform_with_holes, fit_with_holes

    if target is None:
        return deform_with_holes(source, **given) if holed else iccm.deform(source.curve, **given)
    if holed:
        return fit_with_holes(source, target, tell, **given)
    return iccm.fit(source.domain, target.domain, **given)


def check_inside(shape: Shape, what: str, points: list[complex]) -> None:
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
