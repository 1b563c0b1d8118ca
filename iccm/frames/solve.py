"""Solve for the map of whole drawings, with the cheapest choice of frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Complex
from ..balanced.constraints.validate import NO_PINS
from ..balanced.fit import loses_too_much
from ..balanced.model.energy import Energy
from ..balanced.search.multilevel import SIMILAR
from ..balanced.search.warm_start import CLOSE_TOLERANCES
from ..curve import Curve, hausdorff
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
from .choice import STRAIGHT_COST_RATIO, Choice, choose, map_cost, may_pair, stretch_between, textured_region

if TYPE_CHECKING:
    from ..drawings.detail import Detail

Solver = Callable[..., Fit]
"""Solves for the map of two outlines with their holes, by refining the coarse map if there is one, and with the source
stretched first: `solver(source, target, source_holes, target_holes, options, coarse=coarse, stretch=stretch)`.
"""

LEAST_LEFT_OUT_SHARE = 1e-3
"""Of a drawing's area: if parts left out sum to less, they are specks and not reported."""
OTHER_OUTLINE_SHARE = 0.05
"""Hausdorff distance relative to the diagonal, from which a map does not continue one of a drawing's frames."""
SHOWN_ON_SILHOUETTE = (
    "The picture is placed on the target's silhouette, whose gaps and concavities are filled, because these would cut "
    "it; fit='box' bends it into the target instead, and holes='keep' maps the outlines with their gaps."
)
MOST_SOLVED_CHOICES = 3  # choices that are tried, cheapest first, until one has a map without folds


@dataclass(frozen=True, eq=False)
class DrawingPair:
    """Two drawings to be mapped, and how.

    Attributes:
        source: the drawing that is mapped.
        target: the drawing onto which it is mapped.
        options: how to solve; `fit` selects the candidates.
        solver: solves for a pair of outlines with holes.
        free_gaps: whether gaps of the source may be shown at no cost.
        opaque: whether the texture covers the gaps between the source's parts.
    """

    source: Drawing
    target: Drawing
    options: Options
    solver: Solver
    free_gaps: bool = False
    opaque: bool = True

    def choose(self) -> list[Choice]:
        """Return ways to map the drawings, the cheapest first."""
        framed = FITS[self.options.fit].of_drawings
        return choose(self.source, self.target, self.options, free_gaps=self.free_gaps, framed=framed)

    def unsearched(self) -> Choice:
        """Return the choice of the tightest frames that contain all of both drawings, mapped as the options request."""
        mode = FITS[self.options.fit]
        holed = self.source.is_one_part and self.target.is_one_part and not mode.of_drawings
        fit = self.options.fit if mode.leaves_out_parts else "whole"
        return Choice((self.source.tightest, self.target.tightest), fit, holed)

    def solve(self, choice: Choice) -> Fit:
        """Solve for the map of a choice of frames.

        Raises:
            NoMapError: no map without folds was found.
        """
        outlines, options = (choice.frames[0].outline, choice.frames[1].outline), self.options
        if options.is_balanced:
            options = replace(options, fit=choice.fit)
        holes = (self.source.mappable_holes, self.target.mappable_holes) if choice.holed else ([], [])
        fit = self.solver(*outlines, *holes, options, coarse=choice.coarse, stretch=choice.stretch)
        if choice.composed is not None or choice.stretch != 1:
            fit.notes[:] = [note for note in fit.notes if note != SIMILAR]  # a stretch, or a copy
        notes = [*fit.notes, *_parts_left_out(choice)]
        if choice.shown is not None:
            notes.append(SHOWN_ON_SILHOUETTE)
        drawings = self.source, choice.shown or self.target
        fit = with_details(replace(fit, notes=notes), drawings=drawings, opaque=self.opaque)
        return _with_losses_checked(fit, options)

    def cost(self, fit: Fit) -> float:
        """Return the cost of a map without that of the rotation, which pins determine."""
        map = triangulated(fit.map)
        regions = self.source.region, self.target.region
        covering = textured_region(self.source, free_gaps=self.free_gaps)
        return map_cost((map.source, map.image, map.faces), regions, covering, Energy.of(self.options)).total


def fit_drawings(
    pair: DrawingPair,
    *,
    searched: bool = True,
    pins: Complex = NO_PINS,
    start: TriangulatedMap | None = None,
    choices: Sequence[Choice] | None = None,
    detail: Detail | None = None,
) -> Fit:
    """Return the map of two drawings.

    Parameters
    ----------
    pair
        The drawings, and how to map them.
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
    options = pair.options
    mode = FITS[options.fit]
    if options.fit == "box" and start is None:
        from .composition import box_frame

        return pair.solve(Choice((box_frame(pair.source, detail), pair.target.tightest)))
    by_cost = mode.is_searched and options.holes != "keep"
    if start is not None and (by_cost or options.keep_start):
        choice = (_kept if options.keep_start else _continued)(pair, start)
        return pair.solve(replace(choice, shown=_shown(pair, start, choice, detail)))
    if not by_cost or not searched:
        return pair.solve(pair.unsearched())
    if detail is not None and detail.weight > 0 and mode.compares:
        from .composition import compose  # SciPy's optimizers, which it imports, take a tenth of a second

        ranked = compose(pair.source, pair.target, detail, options, lambda: choices or pair.choose())
        if len(pins) and ranked[0].composed is not None:
            # pins that were placed in another map, such as those of a georeferenced picture, contradict this one
            composed = ranked[0]
            ranked = [choice for choice in ranked if choice.composed is None] or list(
                choices or pair.choose()
            )
            if _pin_miss(composed, pins) <= _pin_miss(ranked[0], pins):
                with suppress(InputError):  # pins may be outside of the part of the picture that is shown
                    return pair.solve(composed)
    else:
        ranked = list(choices or pair.choose())
    # the sort is stable: choices within the bounds stay sorted by cost
    ranked.sort(key=lambda choice: _excess(choice, options))
    if len(pins):
        return _cheapest_with_pins(pair, ranked)
    return _first_that_succeeds(pair, ranked)


def _first_that_succeeds(pair: DrawingPair, ranked: Sequence[Choice]) -> Fit:
    """Return the map of the first choice that meets all requirements; else that of the first choice that has a map.

    Raises:
        NoMapError: none of them has a map without folds.
    """
    missed: Fit | None = None
    failure: InputError | None = None
    for choice in ranked[:MOST_SOLVED_CHOICES]:
        try:
            fit = pair.solve(choice)
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
    return choose(source, target, options, free_gaps=free_gaps, pair_parts=True)


def _cheapest_with_pins(pair: DrawingPair, ranked: Sequence[Choice]) -> Fit:
    """Return the cheaper of two maps with pins: of the frames that are best without pins, and of the outlines.

    So a pin that is placed where the map takes it anyway changes nothing, and pins that connect protrusions, which
    the frames close, get the outlines. Maps with concavities filled are not considered, because they cannot follow
    pins that are dragged.

    Args:
        pair: the drawings.
        ranked: the choices, best first, compared without pins.

    Raises:
        InputError: neither map exists.
    """
    outlines = pair.unsearched()
    best = next((choice for choice in ranked if choice.fit == "whole"), outlines)
    have_holes = bool(pair.source.mappable_holes or pair.target.mappable_holes)
    is_stretched = best.stretch != 1
    if (
        best.frames == outlines.frames
        and not is_stretched
        and (best.holed == outlines.holed or not have_holes)
    ):
        return pair.solve(outlines)

    def rank(fit: Fit) -> tuple[bool, float]:
        """Return what maps are compared by: whether they fail, then their cost."""
        return not fit.status.ok, pair.cost(fit)

    try:
        fit = pair.solve(best)
    except InputError:  # pins may be on the outline of one frame, and inside the other
        return pair.solve(outlines)
    rank_of_best = rank(fit)
    if is_stretched and rank_of_best <= (False, STRAIGHT_COST_RATIO * best.cost.total):
        return fit  # the pins hardly bend it
    unpinned_costs = [
        choice.cost._replace(rotation=1.0).total
        for choice in ranked
        if choice.frames == outlines.frames and choice.fit == "whole" and choice.stretch == 1
    ]
    if rank_of_best <= (False, min(unpinned_costs, default=0.0)):
        return fit  # because pins only raise the cost of the outlines
    try:
        fit_of_outlines = pair.solve(outlines)
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


def _continued(pair: DrawingPair, start: TriangulatedMap) -> Choice:
    """Return the choice of frames of an earlier map: those whose outlines are closest to its outlines.

    Where none of the source's is close, as after it was composed, its frame is that of the earlier map.
    """
    loop = start.loops[0]
    outlines = Curve(start.source[loop]), Curve(start.image[loop])
    frames = _closest_frame(pair.source, outlines[0]), _closest_frame(pair.target, outlines[1])
    near = [OTHER_OUTLINE_SHARE * outline.diagonal for outline in outlines]
    is_near = [
        hausdorff(frame.outline, outline) < most for frame, outline, most in zip(frames, outlines, near)
    ]
    if is_near == [False, True]:
        frames = Frame(outlines[0], np.inf), frames[1]
    holed = len(start.loops) > 1
    return Choice(frames, "whole", holed, stretch=1.0 if holed else _stretch_of(outlines, frames))


def _stretch_of(outlines: tuple[Curve, Curve], frames: tuple[Frame, Frame]) -> float:
    """Return the ratio by which an earlier map stretches a frame onto the other one; 1 if it maps them otherwise.

    Args:
        outlines: the map's outline, and its image with the same vertices.
        frames: the frames that are closest to them.
    """
    ratio = stretch_between(frames)
    if ratio is None:
        return 1.0
    (low, high), (image_low, image_high) = (outline.box for outline in outlines)
    moved = outlines[0].z - low
    across, up = (
        (image_high - image_low).real / (high - low).real,
        (image_high - image_low).imag / (high - low).imag,
    )
    away = np.abs(image_low + across * moved.real + 1j * up * moved.imag - outlines[1].z)
    return ratio if away.mean() <= OTHER_OUTLINE_SHARE * outlines[1].diagonal else 1.0


def _kept(pair: DrawingPair, start: TriangulatedMap) -> Choice:
    """Return the choice of frames for a map that stays as it is: on each side, the frame whose outline the map follows
    so closely that it is kept (see `outlines_followed`); else, as where it leaves out parts, the map's own outline.
    """
    frames, tolerance = [], pair.options.tolerance
    for drawing, side in ((pair.source, start.source), (pair.target, start.image)):
        outline = Curve(side[start.loops[0]])
        frame = _closest_frame(drawing, outline)
        is_near = hausdorff(frame.outline, outline) <= CLOSE_TOLERANCES * tolerance * outline.diagonal
        frames.append(frame if is_near else Frame(outline, np.inf))
    return Choice((frames[0], frames[1]), "whole", holed=len(start.loops) > 1)


def _shown(
    pair: DrawingPair, start: TriangulatedMap, choice: Choice, detail: Detail | None
) -> Drawing | None:
    """Return what pictures show of the target, if that is more than it paints: around a picture that was composed."""
    is_composed = all(choice.frames[0] is not frame for frame in pair.source.frames)
    if detail is None or detail.weight == 0 or not is_composed or not FITS[pair.options.fit].compares:
        return None
    from .composition import Composer

    return Composer(pair.source, pair.target, detail, pair.options).shown(start)


def _closest_frame(drawing: Drawing, outline: Curve) -> Frame:
    """Return the frame of a drawing whose outline is closest to another outline."""
    return min(drawing.frames, key=lambda frame: hausdorff(frame.outline, outline))


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
