"""Solve for the map of whole drawings, with the cheapest choice of frames."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..balanced.fit import coverage_notes, loses_too_much, settings_of
from ..curve import Curve, hausdorff
from ..drawings.drawing import Drawing
from ..drawings.frame import Frame
from ..drawings.seen import seen
from ..errors import InputError
from ..fits import FITS
from ..maps.approximation import triangulated
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..result import Fit
from ..status import Status
from .choice import Choice, choices, may_pair, textured_region

Solver = Callable[..., Fit]
"""Solves for the map of two outlines: `solver(source, target, source_holes, target_holes, options)`."""

LEAST_LEFT_OUT_SHARE = 1e-3
"""Of a drawing's area: if parts left out sum to less, they are specks and not reported."""
MOST_SOLVED_CHOICES = 3  # choices that are tried, cheapest first, until one has a map without folds


def fit_drawings(
    source: Drawing,
    target: Drawing,
    options: Options,
    solver: Solver,
    *,
    free_gaps: bool = False,
    searched: bool = True,
    pinned: bool = False,
    start: TriangulatedMap | None = None,
) -> Fit:
    """Return the map of two drawings.

    Parameters
    ----------
    source, target
        The drawings.
    options
        How to solve; `fit` selects the candidates.
    solver
        Solves for a pair of outlines with holes.
    free_gaps
        Whether gaps of the source may be shown at no cost.
    searched
        Whether frames are chosen by their cost. Otherwise, as with rigid regions, outlines are mapped where both
        drawings have one part, and the tightest frames where they do not.
    pinned
        Whether there are pins.
    start
        The map to continue from, which determines the frames.

    Raises
    ------
    NoMapError
        No map without folds was found.
    """
    by_cost = FITS[options.fit].is_searched and options.holes != "keep"
    if by_cost and start is not None:
        return solve_choice(_continued(source, target, start), source, target, options, solver)
    if not by_cost or not searched:
        return solve_choice(_unsearched(source, target, options), source, target, options, solver)
    framed = FITS[options.fit].of_drawings
    ranked = choices(source, target, settings_of(options), free_gaps=free_gaps, framed=framed)
    # the sort is stable: choices within the bounds stay sorted by cost
    ranked.sort(key=lambda choice: _excess(choice, options))
    if pinned:
        return _cheapest_with_pins(ranked, source, target, options, solver, free_gaps=free_gaps)
    missed: Fit | None = None
    failure: InputError | None = None
    for choice in ranked[:MOST_SOLVED_CHOICES]:
        try:
            fit = solve_choice(choice, source, target, options, solver)
        except InputError as error:  # folds, or an outline too fine for its mesh: another frame may work
            failure = failure or error
            continue
        if fit.status.ok:
            return fit
        missed = missed or fit
    if missed is not None:
        return missed
    assert failure is not None
    raise failure


def _excess(choice: Choice, options: Options) -> float:
    """Return by how much a choice exceeds the allowed hidden and bare shares."""
    hidden = max(0.0, choice.seen.hidden - options.max_left_out)
    return hidden + max(0.0, choice.seen.bare - options.max_uncovered)


def paired_parts(
    source: Drawing, target: Drawing, options: Options, *, free_gaps: bool = False
) -> Sequence[tuple[Drawing, Drawing]]:
    """Return pairs of parts to map one-to-one, where that costs less than mapping the drawings as wholes."""
    if not may_pair(source, target):
        return []
    return choices(source, target, settings_of(options), free_gaps=free_gaps, pair_parts=True)[0].pairs


def _cheapest_with_pins(
    ranked: Sequence[Choice],
    source: Drawing,
    target: Drawing,
    options: Options,
    solver: Solver,
    *,
    free_gaps: bool,
) -> Fit:
    """Return the cheaper of two maps with pins: of the frames that are best without pins, and of the outlines.

    So a pin that is placed where the map takes it anyway changes nothing, and pins that connect protrusions, which
    the frames close, get the outlines. Maps with concavities filled are not considered, because they cannot follow
    pins that are dragged.

    Args:
        ranked: the choices, best first, compared without pins.
        source: the drawing that is mapped.
        target: the drawing onto which it is mapped.
        options: how to solve.
        solver: solves for a pair of outlines with the pins.
        free_gaps: as for `fit_drawings`.

    Raises:
        InputError: neither map exists.
    """
    outlines = _unsearched(source, target, options)
    best = next((choice for choice in ranked if choice.fit == "whole"), outlines)
    have_holes = bool(source.mappable_holes or target.mappable_holes)
    if best.frames == outlines.frames and (best.holed == outlines.holed or not have_holes):
        return solve_choice(outlines, source, target, options, solver)

    def rank(fit: Fit) -> tuple[bool, float]:
        """Return what maps are compared by: whether they fail, then their cost."""
        return not fit.status.ok, _cost(fit, source, target, options, free_gaps=free_gaps)

    try:
        fit = solve_choice(best, source, target, options, solver)
    except InputError:  # pins may be on the outline of one frame, and inside the other
        return solve_choice(outlines, source, target, options, solver)
    rank_of_best = rank(fit)
    unpinned_costs = [
        choice.cost for choice in ranked if choice.frames == outlines.frames and choice.fit == "whole"
    ]
    if rank_of_best <= (False, min(unpinned_costs, default=0.0)):
        return fit  # because pins only raise the cost of the outlines
    try:
        fit_of_outlines = solve_choice(outlines, source, target, options, solver)
    except InputError:
        return fit
    return fit if rank_of_best <= rank(fit_of_outlines) else fit_of_outlines


def _cost(fit: Fit, source: Drawing, target: Drawing, options: Options, *, free_gaps: bool) -> float:
    """Return the cost of a map of drawings without that of the rotation, which pins determine."""
    map = triangulated(fit.map)
    visible = seen(
        map.source,
        map.image,
        map.faces,
        source.region,
        target.region,
        covering=textured_region(source, free_gaps=free_gaps),
        theta=settings_of(options).theta,
    )
    return visible.cost()


def _continued(source: Drawing, target: Drawing, start: TriangulatedMap) -> Choice:
    """Return the choice of frames of an earlier map: those whose outlines are closest to its outlines."""
    loop = start.loops[0]
    frames = (
        _closest_frame(source, Curve(start.source[loop])),
        _closest_frame(target, Curve(start.image[loop])),
    )
    return Choice(frames, "whole", holed=len(start.loops) > 1)


def _closest_frame(drawing: Drawing, outline: Curve) -> Frame:
    """Return the frame of a drawing whose outline is closest to another outline."""
    return min(drawing.frames, key=lambda frame: hausdorff(frame.outline, outline))


def _unsearched(source: Drawing, target: Drawing, options: Options) -> Choice:
    """Return the choice of the tightest frames that contain all of both drawings, mapped as the options request."""
    fit = options.fit if FITS[options.fit].leaves_out_parts else "whole"
    holed = source.is_one_part and target.is_one_part and not FITS[options.fit].of_drawings
    return Choice((source.tightest, target.tightest), fit, holed)


def solve_choice(choice: Choice, source: Drawing, target: Drawing, options: Options, solver: Solver) -> Fit:
    """Solve for the map of a choice of frames.

    Raises
    ------
    NoMapError
        No map without folds was found.
    """
    outlines = choice.frames[0].outline, choice.frames[1].outline
    if options.is_balanced:
        options = replace(options, fit=choice.fit)
    holes = (source.mappable_holes, target.mappable_holes) if choice.holed else ([], [])
    fit = solver(*outlines, *holes, options)
    notes = [*without_outline_losses(fit), *_parts_left_out(choice)]
    return _with_losses_checked(replace(fit, drawings=(source, target), notes=notes), options)


def _with_losses_checked(fit: Fit, options: Options) -> Fit:
    """Return a map of drawings with another status if it hides more of the source, or leaves more of the target bare,
    than allowed.
    """
    if min(options.max_left_out, options.max_uncovered) >= 1:
        return fit  # measuring the shares takes time
    visible = fit.seen
    assert visible is not None
    if not loses_too_much(visible.hidden, visible.bare, options):
        return fit
    note = (
        f"{visible.hidden:.1%} of the source drawing is hidden, and {visible.bare:.1%} of the target is bare."
    )
    return replace(fit, ended=Status.BOUNDS, notes=[*fit.notes, note])


def _parts_left_out(choice: Choice) -> list[str]:
    """Return a note for each drawing with small parts that are not mapped."""
    return [
        f"Small parts, {frame.left_out:.1%} of the {side} drawing, are left out; fit frame includes them."
        for frame, side in zip(choice.frames, ("source", "target"))
        if frame.left_out >= LEAST_LEFT_OUT_SHARE
    ]


def without_outline_losses(fit: Fit) -> list[str]:
    """Return a map's notes without those on the losses of outlines, since drawings have other losses."""
    loss_notes = set(coverage_notes(fit))
    return [note for note in fit.notes if note not in loss_notes]
