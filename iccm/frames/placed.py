"""Maps that keep the source drawing's proportions: a similar copy of it inside the target, or one that covers it.

With `inside`, the frame of the source is copied into the target by the largest similarity. With `slice`, the frame of
the target is copied into the source by the largest similarity, and the map is the inverse: the source is as small as
possible while covering the target, and is cut where it extends beyond it. Where pins require a copy that sticks out of
the other drawing, the copy is clipped there, and the map is bent to the part that is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from ..arrays import Complex, complex_of
from ..balanced.search.multilevel import SIMILAR
from ..curve import Curve
from ..drawings.cost import Cost
from ..drawings.drawing import Drawing
from ..drawings.placing import largest_copy, largest_copy_about, transform_region
from ..errors import InputError
from ..fit_data import with_details
from ..options import Options
from ..plane import Similarity
from ..result import Fit
from .solve import DrawingPair

if TYPE_CHECKING:
    from ..drawings.detail import Detail

ROUNDING_SHARE = 1e-9
"""Relative to the target's diagonal: points closer than this are equal."""
MOST_CUT_SHARE = 0.5
"""Of the copy's area: if pins put more of it outside, the drawing has no place there."""
HIDDEN_INSIDE_WEIGHT = 3.0
"""Weight of source area that gaps of the target hide, with `inside`. It puts a drawing beside the hole of a ring, but
does not avoid small holes."""
SHIFTS_PER_SIDE = 21
"""Places of the cropped part that are compared, across and down."""
LEAST_GAIN = 0.02
"""Share of the detail that has to be gained for a shift by the size of the part, to leave the middle."""
SLIVER_AREA_SHARE = 1e-4
"""Of the copy's area: smaller pieces that are cut off come from rounding."""


class Placement(NamedTuple):
    """A similarity from the source's plane to the target's, and the outlines that are mapped onto each other."""

    similarity: Similarity
    source: Curve
    target: Curve

    def meets(self, pins: Complex) -> bool:
        """Return whether the similarity maps the outlines and the pins (k, 2) onto each other without any bending."""
        images = self.similarity(self.source.z)
        is_whole = images.size == self.target.z.size and bool(
            np.allclose(images, self.target.z, rtol=0, atol=self._near)
        )
        return is_whole and bool(np.all(np.abs(self.similarity(pins[:, 0]) - pins[:, 1]) <= self._near))

    @property
    def _near(self) -> float:
        return ROUNDING_SHARE * self.target.diagonal


def fit_placed(pair: DrawingPair, *, pins: Complex, detail: Detail | None = None) -> Fit:
    """Map a drawing inside another, or over another, in its own proportions.

    Parameters
    ----------
    pair
        The drawings, and how to map them; the option `place` is inside or slice.
    pins
        (k, 2) points of the source and their images, which determine the placement.
    detail
        The edges of the picture, which the cropped part of it should show; None to crop about the middle.

    Raises
    ------
    InputError
        There is no place for the drawing that agrees with the pins.
    """
    source, target, options = pair.source, pair.target, pair.options
    regions = list(_regions(source, target, options))
    if len(pins) > 1:
        regions = regions[:1]  # pins determine where the copy lies, whatever region contains it
    placements = [_placement(inner, outer, options, pins) for inner, outer in regions]
    possible = [placement for placement in placements if placement is not None]
    if not possible:
        raise InputError(
            f"place: the picture cannot be placed so that it meets these pins (place {options.place}); move the pins, "
            "or use place fill"
        )
    best = min(possible, key=lambda placement: _cost(placement, pair))
    if options.place == "slice" and detail is not None and not detail.is_empty and not len(pins):
        best = _with_most_detail(best, source, target, detail)
    turn = float(np.degrees(np.angle(best.similarity.factor)))
    whole = replace(options, place="fill", fit="whole", turn=turn)
    fit = pair.solver(best.source, best.target, [], [], whole, pinned=not best.meets(pins))
    notes = [note for note in fit.notes if note != SIMILAR]  # a similarity was requested
    details = {"drawings": (source, target), "place": options.place, "opaque": pair.opaque}
    return with_details(replace(fit, notes=notes), **details)


def _with_most_detail(placement: Placement, source: Drawing, target: Drawing, detail: Detail) -> Placement:
    """Return a placement moved inside the source so that what the target shows has the most detail."""
    from ..drawings.detail import TargetView

    view = TargetView.of(target.painted)
    outer, part = source.tightest.outline, placement.source
    slack = [side - own for side, own in zip(outer.box, part.box)]
    across = np.linspace(slack[0].real, slack[1].real, SHIFTS_PER_SIDE)
    up = np.linspace(slack[0].imag, slack[1].imag, SHIFTS_PER_SIDE)
    shifts = np.append((across[:, None] + 1j * up).ravel(), 0)
    seen = np.array(
        [view.seen(placement.similarity(detail.points - shift)) @ detail.weights for shift in shifts]
    )
    seen -= LEAST_GAIN * np.abs(shifts) / part.diagonal
    shapely.prepare(outer.polygon)
    for number in np.argsort(-seen, kind="stable"):
        shift = complex(shifts[number])
        moved = Curve(part.z + shift)
        if shift == 0 or shapely.covers(outer.polygon.buffer(ROUNDING_SHARE * part.diagonal), moved.polygon):
            break
    factor = placement.similarity.factor
    similarity = placement.similarity._replace(shift=placement.similarity.shift - factor * shift)
    return Placement(similarity, moved, placement.target)


def _regions(source: Drawing, target: Drawing, options: Options) -> Iterator[tuple[Curve, shapely.Geometry]]:
    """Yield pairs of the frame that is copied and a region for the copy.

    The region is the other drawing's frame, and if that drawing has gaps also its painted area.
    """
    inner, outer = (source, target) if options.place == "inside" else (target, source)
    yield inner.tightest.outline, outer.tightest.outline.polygon
    if not outer.is_one_part or outer.holes:
        yield inner.tightest.outline, outer.painted


def _placement(inner: Curve, outer: shapely.Geometry, options: Options, pins: Complex) -> Placement | None:
    """Return the largest placement of a frame in a region; None where no copy agrees with the pins.

    Parameters
    ----------
    inner
        The frame that is copied.
    outer
        The region that must contain the copy.
    options
        The kind of placement and the rotation.
    pins
        (k, 2) points of the source and their images.

    Raises
    ------
    InputError
        Most of the copy lies outside, or the rest is in pieces.
    """
    is_inside = options.place == "inside"
    turn = None if options.turn == "any" else np.radians(options.turn or 0.0)
    rotation = turn if turn is None or is_inside else -turn
    if len(pins) > 1:
        free = options.turn is None or options.turn == "any"
        copied = _through(pins if is_inside else pins[:, ::-1], None if free else rotation)
    elif len(pins) == 1:
        point, image = pins[0] if is_inside else pins[0, ::-1]
        copied = largest_copy_about(inner.polygon, outer, complex(point), complex(image), rotation or 0.0)
    else:
        copied = largest_copy(inner.polygon, outer, rotation)
    if copied is None:
        return None
    copy = _within(Curve(copied(inner.z)), outer)
    return Placement(copied, inner, copy) if is_inside else Placement(copied.inverse(), copy, inner)


def _through(pairs: Complex, rotation: float | None) -> Similarity | None:
    """Return the least-squares similarity for pairs of points (k, 2), with the given rotation in radians if any.

    Returns None where its scale would be negative.
    """
    z, w = pairs.T
    similarity = Similarity.fit(z, w)
    if rotation is None:
        return similarity
    turn = complex(np.exp(1j * rotation))
    scale = (similarity.factor / turn).real  # least squares with the rotation fixed
    if scale <= 0:
        return None
    return Similarity(scale * turn, complex(np.mean(w) - scale * turn * np.mean(z)))


def _within(copy: Curve, outer: shapely.Geometry) -> Curve:
    """Return the outline of the part of a copy that lies in a region.

    Raises
    ------
    InputError
        That part is less than half of the copy, or in several pieces.
    """
    region = copy.polygon
    if shapely.covers(outer, region):
        return copy
    pieces = shapely.get_parts(shapely.intersection(region, outer))
    pieces = [
        piece
        for piece in pieces
        if piece.geom_type == "Polygon" and piece.area > SLIVER_AREA_SHARE * region.area
    ]
    outside = 1 - sum(piece.area for piece in pieces) / region.area
    if outside > MOST_CUT_SHARE:
        raise InputError(
            f"place: with these pins {outside:.0%} of the picture lies outside the target; move the pins, or "
            "use place fill"
        )
    if len(pieces) != 1:
        raise InputError(
            "place: with these pins the target cuts the picture into pieces; move the pins, or use place fill"
        )
    return Curve.domain(complex_of(shapely.get_coordinates(pieces[0].exterior)[:-1]))


def _cost(placement: Placement, pair: DrawingPair) -> float:
    """Return the cost (see `drawings.cost`) of a placement without bending."""
    source, target, domain = pair.source, pair.target, placement.source.polygon
    seen_through = shapely.intersection(
        domain, transform_region(target.painted, placement.similarity.inverse())
    )
    seen_area = float(shapely.intersection(seen_through, source.painted).area)
    covered = (seen_through.area if pair.opaque else seen_area) * abs(placement.similarity.factor) ** 2
    hidden, bare = 1 - seen_area / source.region.area, 1 - covered / target.region.area
    if pair.options.place == "inside":
        hidden *= HIDDEN_INSIDE_WEIGHT
    return Cost(1.0, hidden, bare).total
