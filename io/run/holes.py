"""Holes of a job's shapes: those that the map takes onto each other, and those that pictures leave transparent."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .constraints import exact

if TYPE_CHECKING:
    from ...solve import Fit
    from ..shapes.shape import Shape
    from .job import Job
    from .state import Run

UNMAPPED = (
    "no map without folds was found that takes holes onto holes: it passes over them, and pictures leave the target's "
    "transparent"
)


def known(job: Job) -> bool:
    """Whether the map of a job knows of holes: the balanced method's does, unless they are to be filled."""
    return job.holes == "keep" and job.target is not None and exact(job)


def fitted(job: Job, source: Shape, target: Shape, given: dict[str, Any], note: Callable[[str], None]) -> Fit:
    """The map of two shapes, with their holes if that can be; `note` is told if not."""
    import iccm

    from ...balanced import NoMapError
    from ..shapes import holes

    curves = source.curve, target.curve
    if not (known(job) and (source.holes or target.holes)):
        return iccm.fit(*curves, **given)
    chosen = holes.mappable(source), holes.mappable(target)
    inner = [[shape.holes[k] for k in side] for shape, side in zip((source, target), chosen)]
    partners = holes.named_partners(source, target, chosen)
    try:
        return iccm.fit(
            *curves, source_holes=inner[0], target_holes=inner[1], hole_partners=partners, **given
        )
    except NoMapError:
        note(f"{target.spec}: {UNMAPPED}")
        return iccm.fit(*curves, **given)


def about(state: Run) -> list[str]:
    """Remarks on holes that the map takes for inside."""
    from ..shapes import holes

    job, said = state.job, []
    keep = job.holes == "keep"
    for k, cure in enumerate(("", ", which pictures leave transparent" if keep else ", which pictures fill")):
        shapes = {id(pair[k]): pair[k] for pair in state.pairs if pair[k].holes}.values()
        count = sum(len(shape.holes) for shape in shapes)
        left = count - sum(len(holes.mappable(shape)) for shape in shapes) if known(job) else count
        why = ", too small or too close to an outline," if left and known(job) else ""
        if left:
            many = f"its {left} hole{'s' * (left > 1)}" if left == count else f"{left} of its {count} holes"
            said.append(f"{state.pairs[0][k].spec}: the map passes over {many}{why}{cure}".replace(",,", ","))
    return said[-1:] if state.pairs[0][0].spec == state.pairs[0][1].spec else said
