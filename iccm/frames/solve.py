"""Solve for the map of whole drawings, with the cheapest choice of frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Complex
from ..balanced.constraints.validate import NO_PINS
from ..balanced.fit import coverage_notes, loses_too_much, settings_of
from ..balanced.search.multilevel import SIMILAR
from ..curve import Curve, hausdorff
from ..drawings.cost import cost_of
from ..drawings.drawing import Drawing
from ..drawings.frame import Frame
from ..errors import InputError
from ..fit_data import with_details
from ..fits import FITS
from ..maps.approximation import triangulated
from ..maps.triangulated.map import TriangulatedMap
from ..options import Options
from ..result import Fit
from ..status import Status
from .choice import Choice, choose, may_pair, textured_region

if TYPE_CHECKING:
    from ..drawings.detail import Detail

Solver = Callable[..., Fit]
"""Solves for the map of two outlines with their holes, by refining the coarse map if there is one:
`solver(source, target, source_holes, target_holes, options, coarse=coarse)`.
"""

LEAST_LEFT_OUT_SHARE = 1e-3
"""Of a drawing's area: if parts left out sum to less, they are specks and not reported."""
OTHER_OUTLINE_SHARE = 0.05
"""Hausdorff distance relative to the diagonal, from which a map does not continue one of a drawing's frames."""
SHOWN_ON_SILHOUETTE = (
    "The picture is shown on the target's silhouette, because the target's gaps would cut it to pieces; --holes "
    "keep maps the outlines with their gaps instead."
)
MOST_SOLVED_CHOICES = 3  # choices that are tried, cheapest first, until one has a map without folds


def fit_drawings(
    source: Drawing,
    target: Drawing,
    options: Options,
    solver: Solver,
    *,
    free_gaps: bool = False,
    searched: bool = True,
    pins: Complex = NO_PINS,
    start: TriangulatedMap | None = None,
    choices: Sequence[Choice] | None = None,
    detail: Detail | None = None,
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
    pins
        (k, 2) points of the source and their places in the target.
    start
        The map to continue from, which determines the frames.
    choices
        Ways to map these drawings with these options, if they were compared before.
    detail
        The edges of the picture that the source shows, by which maps are then compared; None if the map depends on the
        shapes alone.

    Raises
    ------
    NoMapError
        No map without folds was found.
    """
    if options.fit == "box" and start is None:
        from .composition import box_frame

        frame = box_frame(source, detail)
        return solve_choice(Choice((frame, target.tightest)), source, target, options, solver)
    by_cost = FITS[options.fit].is_searched and options.holes != "keep"
    if by_cost and start is not None:
        return solve_choice(_continued(source, target, start), source, target, options, solver)
    if not by_cost or not searched:
        return solve_choice(_unsearched(source, target, options), source, target, options, solver)

    def compared() -> Sequence[Choice]:
        if choices is not None:
            return choices
        framed = FITS[options.fit].of_drawings
        return choose(source, target, settings_of(options), free_gaps=free_gaps, framed=framed)

    if detail is not None and detail.weight > 0 and FITS[options.fit].compares:
        from .composition import compose  # SciPy's optimizers, which it imports, take a tenth of a second

        ranked = compose(source, target, detail, settings_of(options), compared)
        if len(pins) and ranked[0].composed is not None:
            # pins that were placed in another map, such as those of a georeferenced picture, contradict this one
            composed = ranked[0]
            ranked = [choice for choice in ranked if choice.composed is None] or list(compared())
            if _pin_miss(composed, pins) <= _pin_miss(ranked[0], pins):
                with suppress(InputError):  # pins may be outside of the part of the picture that is shown
                    return solve_choice(composed, source, target, options, solver, pinned=True)
    else:
        ranked = list(compared())
    # the sort is stable: choices within the bounds stay sorted by cost
    ranked.sort(key=lambda choice: _excess(choice, options))
    if len(pins):
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
    hidden = max(0.0, choice.cost.hidden - options.max_left_out)
    return hidden + max(0.0, choice.cost.bare - options.max_uncovered)


def choose_with_parts(
    source: Drawing, target: Drawing, options: Options, *, free_gaps: bool = False
) -> list[Choice] | None:
    """Return ways to map two drawings, best first, among them by pairs of parts; None if their parts do not pair."""
    if not may_pair(source, target):
        return None
    return choose(source, target, settings_of(options), free_gaps=free_gaps, pair_parts=True)


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
        choice.cost.total for choice in ranked if choice.frames == outlines.frames and choice.fit == "whole"
    ]
    if rank_of_best <= (False, min(unpinned_costs, default=0.0)):
        return fit  # because pins only raise the cost of the outlines
    try:
        fit_of_outlines = solve_choice(outlines, source, target, options, solver)
    except InputError:
        return fit
    return fit if rank_of_best <= rank(fit_of_outlines) else fit_of_outlines


def _pin_miss(choice: Choice, pins: Complex) -> float:
    """Return the largest distance between the images of pins (k, 2) in the map of a choice without pins, and their
    places; infinite where a pin is outside the frame.
    """
    frame, target = (frame.outline.z for frame in choice.frames)
    if choice.coarse is not None:
        map = choice.coarse.map
        images = TriangulatedMap(map.z, map.u, map.faces, (np.arange(map.border),))(pins[:, 0])
    elif (
        frame.size == target.size and choice.composed is not None
    ):  # an upright stretch, given by its outlines
        across, up = (np.polyfit(part(frame), part(target), 1) for part in (np.real, np.imag))
        images = np.polyval(across, pins[:, 0].real) + 1j * np.polyval(up, pins[:, 0].imag)
    else:
        return np.inf
    distances = np.abs(images - pins[:, 1])
    return float(np.where(np.isfinite(distances), distances, np.inf).max())


def _cost(fit: Fit, source: Drawing, target: Drawing, options: Options, *, free_gaps: bool) -> float:
    """Return the cost of a map of drawings without that of the rotation, which pins determine."""
    map = triangulated(fit.map)
    return cost_of(
        map.source,
        map.image,
        map.faces,
        source.region,
        target.region,
        covering=textured_region(source, free_gaps=free_gaps),
        balance=options.balance,
    ).total


def _continued(source: Drawing, target: Drawing, start: TriangulatedMap) -> Choice:
    """Return the choice of frames of an earlier map: those whose outlines are closest to its outlines.

    Where none of the source's is close, as after it was composed, its frame is that of the earlier map.
    """
    loop = start.loops[0]
    outlines = Curve(start.source[loop]), Curve(start.image[loop])
    frames = _closest_frame(source, outlines[0]), _closest_frame(target, outlines[1])
    near = [OTHER_OUTLINE_SHARE * outline.diagonal for outline in outlines]
    is_near = [
        hausdorff(frame.outline, outline) < most for frame, outline, most in zip(frames, outlines, near)
    ]
    if is_near == [False, True]:
        frames = Frame(outlines[0], np.inf), frames[1]
    return Choice(frames, "whole", holed=len(start.loops) > 1)


def _closest_frame(drawing: Drawing, outline: Curve) -> Frame:
    """Return the frame of a drawing whose outline is closest to another outline."""
    return min(drawing.frames, key=lambda frame: hausdorff(frame.outline, outline))


def _unsearched(source: Drawing, target: Drawing, options: Options) -> Choice:
    """Return the choice of the tightest frames that contain all of both drawings, mapped as the options request."""
    fit = options.fit if FITS[options.fit].leaves_out_parts else "whole"
    holed = source.is_one_part and target.is_one_part and not FITS[options.fit].of_drawings
    return Choice((source.tightest, target.tightest), fit, holed)


def solve_choice(
    choice: Choice,
    source: Drawing,
    target: Drawing,
    options: Options,
    solver: Solver,
    *,
    pinned: bool = False,
) -> Fit:
    """Solve for the map of a choice of frames.

    With `pinned`, an upright stretch is bent to meet the pins.

    Raises
    ------
    NoMapError
        No map without folds was found.
    """
    outlines = choice.frames[0].outline, choice.frames[1].outline
    if options.is_balanced:
        options = replace(options, fit=choice.fit)
    holes = (source.mappable_holes, target.mappable_holes) if choice.holed else ([], [])
    if choice.stretch != 1 and not pinned:
        stretched_source = Curve(stretched(outlines[0].z, choice.stretch))
        fit = _unstretched(solver(stretched_source, outlines[1], *holes, options), choice)
    else:
        fit = solver(*outlines, *holes, options, coarse=choice.coarse)
    if choice.composed is not None or choice.stretch != 1:
        fit.notes[:] = [note for note in fit.notes if note != SIMILAR]  # a stretch, or a copy
    notes = [*without_outline_losses(fit), *_parts_left_out(choice)]
    if choice.shown is not None:
        notes.append(SHOWN_ON_SILHOUETTE)
    drawings = source, choice.shown or target
    return _with_losses_checked(with_details(replace(fit, notes=notes), drawings=drawings), options)


def stretched(z: Complex, ratio: float) -> Complex:
    """Return points of a plane whose width is stretched by a ratio relative to its height, with areas kept."""
    return np.sqrt(ratio) * z.real + 1j * z.imag / np.sqrt(ratio)


def _unstretched(fit: Fit, choice: Choice) -> Fit:
    """Return the map of a frame, given that of the stretched frame."""
    map = triangulated(fit.map)
    straight = np.zeros(len(map.edges.ends), complex)  # the map is affine
    source = stretched(map.source, 1 / choice.stretch)
    return replace(fit, map=replace(map, source=source, bulge=straight), source=choice.frames[0].outline)


def _with_losses_checked(fit: Fit, options: Options) -> Fit:
    """Return a map of drawings with another status if it hides more of the source, or leaves more of the target bare,
    than allowed.
    """
    if min(options.max_left_out, options.max_uncovered) >= 1:
        return fit  # measuring the shares takes time
    visible = fit.coverage.seen
    assert visible is not None
    if not loses_too_much(visible.hidden, visible.bare, options):
        return fit
    note = (
        f"{visible.hidden:.1%} of the source drawing is hidden, and {visible.bare:.1%} of the target is bare."
    )
    return replace(fit, _ended=Status.BOUNDS, notes=[*fit.notes, note])


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
