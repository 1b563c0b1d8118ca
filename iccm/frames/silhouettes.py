"""Silhouettes of a target: what may be shown of it where its own gaps would cut a picture to pieces.

A ring, a window or an icon drawn with lines paints little of the area that people see as its shape. A picture that is
placed in it may then be shown on its silhouette instead: with its holes filled, or with the gaps between its parts
closed: on its convex hull, which is widened where it is long and thin, as that of three dots in a row. What the target
paints is then a tone below the picture. A picture without margin, which leaves no paper, takes the form of what the
target paints, as a photo in a word does; only large holes and lines around a wide gap, such as those of a folder's
icon, are closed, and the picture is faded there. Still the target's form is seen less well, which has a cost.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
import shapely.affinity

from ..arrays import Box, Real
from ..drawings.drawing import Drawing
from ..polygons import polygons_of, unite

ENCLOSED_WEIGHT = 0.1
"""Of filled holes in the share of the target that counts as bare: its outline stays."""
CLOSED_WEIGHT = 0.2
"""Of closed gaps, which change the outline, in that share."""
CLOSING_COST = 0.07
"""Share that counts as bare in addition where gaps are closed, since an outline that is nearly the target's looks
like a mistake: a cost of 0.14."""
LEAST_WIDTH_RATIO = 0.5
"""Of width to length of the hull of a target with gaps: a thinner one is widened, or a subject would be tiny."""
BAR_WIDTH_RATIO = 1 / 8
"""Of width to length of a solid target: a thinner one is widened as well, since people see it as a line."""
WITH_HOLES_AREA_SHARE = 3 / 4
"""Of the area with holes filled: in a target that paints less, holes would hide what a picture without margin shows, so
that it is also shown there, faded. Holes of most letters and of faces are smaller."""
LINES_AREA_SHARE = 1 / 3
"""Of the area of a frame: a target that paints less is drawn with lines."""
LINES_GAP_WIDTH_SHARE = 0.4
"""Relative to the size (square root of the area) of a frame around such lines: if its widest gap is at least as wide, a
picture without margin is also shown on the frame. Gaps of words are narrower."""
GAP_WIDTH_PRECISION_SHARE = 0.01
"""Relative to the frame's size, of the width of the widest gap."""
LEAST_ADDED_SHARE = 1e-3
"""Of the silhouette's area: if less is filled, nobody sees it."""


class Silhouette(NamedTuple):
    """A region in which a picture may be shown.

    Attributes:
        drawing: the region; the target itself, or with gaps filled.
        cost: what filling them costs, as a share of the target that counts as bare.
    """

    drawing: Drawing
    cost: float


def silhouettes(target: Drawing, *, is_full: bool, canvas: Box | None = None) -> Iterator[Silhouette]:
    """Yield the regions in which a picture may be shown, first what the target paints.

    Parameters
    ----------
    target
        The target.
    is_full
        Whether the picture has no margin.
    canvas
        The box of the target's plane that pictures show; None if it has no bounds.
    """
    yield Silhouette(target, 0.0)
    filled = target.filled()
    painted_share = target.region.area / filled.region.area
    if painted_share < (WITH_HOLES_AREA_SHARE if is_full else 1 - LEAST_ADDED_SHARE):
        yield Silhouette(filled, ENCLOSED_WEIGHT * (1 - painted_share))
    hull = target.frames[-1].outline.polygon
    if is_full:
        frames = (frame.outline.polygon for frame in target.frames if not frame.left_out)
        closings = [frame for frame in frames if _are_lines_around_gap(target, filled, frame)]
    elif hull.area * (1 - LEAST_ADDED_SHARE) > filled.region.area:
        closings = [hull, _widened(hull, canvas)]
    else:
        closings = [_widened(hull, canvas)] if _width_ratio(hull) <= BAR_WIDTH_RATIO else []
    for region in dict.fromkeys(closings):
        closed, enclosed = region.area - filled.region.area, filled.region.area - target.region.area
        cost = CLOSING_COST + (CLOSED_WEIGHT * closed + ENCLOSED_WEIGHT * enclosed) / region.area
        yield Silhouette(Drawing(region), cost)


def rooms(target: Drawing, *, within: Drawing) -> list[shapely.Polygon]:
    """Return the holes of a target that lie within what is shown of it, the largest first.

    Parts of the target that lie in a hole count as filled.

    Parameters
    ----------
    target
        The target.
    within
        What is shown of it, see `silhouettes`.

    Examples
    --------
    >>> frame = Drawing(shapely.box(0, 0, 6, 5) - shapely.box(1, 1, 5, 4))
    >>> [[room.area for room in rooms(frame, within=shown)] for shown in (frame.filled(), frame)]
    [[12.0], []]
    """
    holes = [shapely.Polygon(ring) for part in polygons_of(target.painted) for ring in part.interiors]
    shown = [
        hole
        for hole in holes
        if shapely.difference(hole, within.painted).area <= LEAST_ADDED_SHARE * hole.area
    ]
    return sorted(shown, key=lambda hole: -hole.area)


def clear_part(target: Drawing, shown: Drawing) -> shapely.Geometry:
    """Return the part of what is shown of a target in which a picture without margin is not faded.

    It is what the target paints, which people see as its shape. But where its holes are filled and larger than the
    lines around them, as those of a ring, the holes are clear and the lines are faded, since a picture shows more
    there; parts within the holes, such as a question mark in the ring, are left out.

    Parameters
    ----------
    target
        The target.
    shown
        What is shown of it, see `silhouettes`.

    Examples
    --------
    >>> ring, dot = shapely.box(0, 0, 7, 6) - shapely.box(1, 1, 6, 5.5), shapely.box(2, 2, 3, 3)
    >>> target = Drawing(ring | dot)
    >>> clear_part(target, target.filled()).area, clear_part(target, Drawing(shapely.box(0, 0, 8, 6))).area
    (22.5, 20.5)
    """
    closed = shapely.difference(shown.painted, target.filled().painted).area
    parts = polygons_of(target.painted)
    enclosing = shapely.polygons(shapely.get_exterior_ring(parts))
    inner, outer = shapely.STRtree(enclosing).query(parts, predicate="within")
    holes = shapely.difference(shown.painted, unite(np.delete(parts, inner[inner != outer])))
    if closed > LEAST_ADDED_SHARE * shown.painted.area or holes.area <= shown.painted.area / 2:
        return target.painted
    return holes


def _are_lines_around_gap(target: Drawing, filled: Drawing, frame: shapely.Polygon) -> bool:
    """Return whether what a target paints in a frame are lines around a wide gap that they do not enclose."""
    if target.region.area > LINES_AREA_SHARE * frame.area:
        return False
    gap, size = shapely.difference(frame, filled.painted), float(np.sqrt(frame.area))
    if gap.is_empty:
        return False
    circle = shapely.maximum_inscribed_circle(gap, GAP_WIDTH_PRECISION_SHARE * size)
    return 2 * shapely.length(circle) >= LINES_GAP_WIDTH_SHARE * size


def _sides(region: shapely.Polygon) -> tuple[Real, Real]:
    """Return the longer and the shorter side (2,) of the smallest rectangle around a region."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(region))
    long, short = sorted((corners[k + 1] - corners[k] for k in (0, 1)), key=lambda side: -np.hypot(*side))
    return long, short


def _width_ratio(region: shapely.Polygon) -> float:
    """Return the ratio of width to length of a region, at most 1."""
    long, short = _sides(region)
    return float(np.hypot(*short) / np.hypot(*long))


def _widened(hull: shapely.Polygon, canvas: Box | None) -> shapely.Polygon:
    """Return a convex region that is widened if it is long and thin, as far as the canvas has room."""
    ratio = _width_ratio(hull)
    if ratio >= LEAST_WIDTH_RATIO:
        return hull
    (x, y), _ = _sides(hull)
    angle, centre = float(np.arctan2(y, x)), shapely.minimum_rotated_rectangle(hull).centroid
    level = shapely.affinity.rotate(hull, -angle, origin=centre, use_radians=True)
    wide = shapely.affinity.scale(level, 1, LEAST_WIDTH_RATIO / ratio, origin=centre)
    wide = shapely.affinity.rotate(wide, angle, origin=centre, use_radians=True)
    if canvas is not None:
        low, high = canvas
        wide = shapely.union(
            shapely.intersection(wide, shapely.box(low.real, low.imag, high.real, high.imag)), hull
        )
    return wide if wide.geom_type == "Polygon" else hull
