"""Maps that keep the source drawing's proportions: a similar copy of it inside the target, or one that covers it.

Inside, the frame of the source is copied into the target by the largest similarity. To slice, the frame of the target
is copied into the source by the largest similarity, and the map is the inverse of that: the source drawing is as small
as it can be to cover the target, and what hangs over is cut. Where pins ask for a copy that sticks out of the other
drawing, the copy is cut off there, and the map bends to what is left of it.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely

from ..arrays import Complex, complex_of
from ..balanced.search.multilevel import SIMILAR
from ..curve import Curve
from ..drawings.cost import price
from ..drawings.drawing import Drawing
from ..drawings.placing import largest_copy, largest_copy_about, moved
from ..errors import InputError
from ..options import Options
from ..plane import Similarity
from ..result import Fit
from .solve import Solver, without_outline_losses

ROUNDED = 1e-9
"""Of the target's diagonal: points as close are the same."""
MOST_CUT = 0.5
"""Of the copy's area: where pins put more of it outside, the drawing has no place there."""
HIDDEN_INSIDE = 3.0
"""How many times a part of the source drawing counts that gaps of the target hide, where all was to be inside: so a
drawing is put beside the hole of a ring, but not beside small holes."""
SLIVER = 1e-4
"""Of the copy's area: smaller pieces that are cut off come from rounding."""


class Placement(NamedTuple):
    """A similarity from the source's plane to the target's, and the outlines that are mapped onto each other."""

    similarity: Similarity
    source: Curve
    target: Curve

    def meets(self, pins: Complex) -> bool:
        """Return whether the similarity alone is the map, and takes pins (k, 2) where they go."""
        images = self.similarity(self.source.z)
        is_whole = images.size == self.target.z.size and bool(
            np.allclose(images, self.target.z, rtol=0, atol=self._near)
        )
        return is_whole and bool(np.all(np.abs(self.similarity(pins[:, 0]) - pins[:, 1]) <= self._near))

    @property
    def _near(self) -> float:
        return ROUNDED * self.target.diagonal


def fit_placed(
    source: Drawing, target: Drawing, options: Options, solver: Solver, *, pins: Complex, opaque: bool
) -> Fit:
    """Return the map of a drawing placed inside another, or over another, in its own proportions.

    Parameters
    ----------
    source, target
        The drawings.
    options
        How to solve; `place` is inside or slice.
    solver
        Solves for a pair of outlines, without pins where `pinned` is false.
    pins
        (k, 2) points of the source and where they go, by which the drawing is placed.
    opaque
        Whether the texture covers the gaps between the source's parts.

    Raises
    ------
    InputError
        There is no place for the drawing where the pins ask for one.
    """
    regions = list(_regions(source, target, options))
    if len(pins) > 1:
        regions = regions[:1]  # the pins say where the copy lies, whatever it may lie in
    placements = [_placement(inner, outer, options, pins) for inner, outer in regions]
    found = [placement for placement in placements if placement is not None]
    if not found:
        raise InputError(
            f"place: with these pins no copy fits (place {options.place}); move the pins, or use place fill"
        )
    best = min(found, key=lambda placement: _cost(placement, source, target, options.place, opaque=opaque))
    turn = float(np.degrees(np.angle(best.similarity.factor)))
    whole = replace(options, place="fill", fit="whole", turn=turn)
    fit = solver(best.source, best.target, [], [], whole, pinned=not best.meets(pins))
    notes = [note for note in without_outline_losses(fit) if note != SIMILAR]  # that is what was asked for
    return replace(fit, drawings=(source, target), place=options.place, notes=notes)


def _regions(source: Drawing, target: Drawing, options: Options) -> Iterator[tuple[Curve, shapely.Geometry]]:
    """Yield the frame of one drawing, which is copied, and regions that may contain the copy: the frame of the other
    drawing, and where that has gaps its painted area."""
    inner, outer = (source, target) if options.place == "inside" else (target, source)
    yield inner.tightest.outline, outer.tightest.outline.polygon
    if not outer.is_one_part or outer.holes:
        yield inner.tightest.outline, outer.painted


def _placement(inner: Curve, outer: shapely.Geometry, options: Options, pins: Complex) -> Placement | None:
    """Return the placement for a frame that is copied and the region that must contain the copy; None where no copy
    lies as the pins ask.

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
    """Return the similarity that takes points closest to their images, rotated as asked; None where it would be a
    reflection in a point."""
    z, w = pairs.T
    found = Similarity.fit(z, w)
    if rotation is None:
        return found
    turn = complex(np.exp(1j * rotation))
    scale = (found.factor / turn).real  # least squares with the rotation held
    if scale <= 0:
        return None
    return Similarity(scale * turn, complex(np.mean(w) - scale * turn * np.mean(z)))


def _within(copy: Curve, outer: shapely.Geometry) -> Curve:
    """Return the outline of what of a copy lies in a region.

    Raises
    ------
    InputError
        That is less than half of it, or in several pieces.
    """
    region = copy.polygon
    if shapely.covers(outer, region):
        return copy
    pieces = shapely.get_parts(shapely.intersection(region, outer))
    pieces = [each for each in pieces if each.geom_type == "Polygon" and each.area > SLIVER * region.area]
    outside = 1 - sum(each.area for each in pieces) / region.area
    if outside > MOST_CUT:
        raise InputError(
            f"place: with these pins {outside:.0%} of the copy lies outside the target; move the pins, or "
            "use place fill"
        )
    if len(pieces) != 1:
        raise InputError(
            "place: with these pins the other drawing cuts the copy into pieces; move the pins, or use place fill"
        )
    return Curve.domain(complex_of(shapely.get_coordinates(pieces[0].exterior)[:-1]))


def _cost(placement: Placement, source: Drawing, target: Drawing, place: str, *, opaque: bool) -> float:
    """Return the cost of a placement (see `drawings.cost`), as if nothing were bent."""
    domain = placement.source.polygon
    seen_through = shapely.intersection(domain, moved(target.painted, placement.similarity.inverse()))
    shown = float(shapely.intersection(seen_through, source.painted).area)
    covered = (seen_through.area if opaque else shown) * abs(placement.similarity.factor) ** 2
    hidden, bare = 1 - shown / source.region.area, 1 - covered / target.region.area
    if place == "inside":
        hidden *= HIDDEN_INSIDE
    return price(1.0, (hidden, bare), 1.0)
