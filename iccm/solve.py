"""The entry points: `fit` and `deform`, the roof over the methods."""

from collections.abc import Callable, Sequence
from typing import Any

from numpy.typing import ArrayLike

from .blas import on_one_thread
from .curve import Curve
from .errors import InputError
from .paper import algorithm1
from .problem import OTHERS, Options, Problem
from .result import Fit, Status

__all__ = ["Fit", "Status", "deform", "fit"]


@on_one_thread
def fit(
    source: ArrayLike | Curve,
    target: ArrayLike | Curve,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    **options: Any,
) -> Fit:
    """A map of the source domain onto the target domain: balanced, conformal, or as the paper has it.

    Args:
        source: (n,) complex vertices of the source's boundary, x + iy, y up, either way round.
        target: (m,) complex vertices of the target's boundary.
        pins: (k, 2) complex, a point inside the source and the point it should go to.
        strokes: pairs of open polylines, (p,) inside the source and (q,) where it should go.
        **options: see `iccm.problem.Options`.

    Returns:
        The map, how the solver ended, and the figures that judge it. Failure to converge is a status, not an exception.

    Raises:
        InputError: a boundary that is no simple polygon, a constraint outside the source, an option out of range.
    """
    settings = Options(**options)
    problem = Problem.of(source, target, pins, strokes, first=settings.method == "paper")
    return solver(problem, settings)(problem, settings)


def solver(problem: Problem, settings: Options) -> Callable[[Problem, Options], Fit]:
    """What solves a problem. Unless a method is named it is the balanced one; what that does not know is the conformal
    one's."""
    if settings.method == "paper":
        return algorithm1.solve
    others = any(getattr(settings, name) != getattr(Options, name) for name in OTHERS)
    if settings.method == "conformal" or settings.balance == 0 or (not settings.method and others):
        from .conformal import method as conformal

        return conformal.solve
    from .balanced import fit as balanced

    return balanced.solve


@on_one_thread
def deform(
    source: ArrayLike | Curve,
    *,
    pins: ArrayLike | None = None,
    strokes: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    **options: Any,
) -> Fit:
    """Move a shape by pins and strokes alone, without a target boundary (paper §3.3).

    The smoothness energy makes the problem well posed; arguments and errors as for `fit`.
    """
    settings = Options(**{"smoothness": 1e-4, "order": 0, "max_iterations": 100, **options})
    problem = Problem.of(source, None, pins, strokes)
    if not problem.pins.size and not problem.strokes:
        raise InputError("deform: no pins and no strokes; give at least one")
    return algorithm1.deform(problem, settings)
