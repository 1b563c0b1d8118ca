"""Close small gaps in lines: ends of strokes that almost meet, so that the eye sees a closed outline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Complex, xy_of
from ...plane import distinct
from .strokes import CAPS, Seen, width_of
from .tree import Node

GAP_SIDE_SHARE = 1 / 32
"""Of the longer side of the drawing: the widest gap that is closed, as in photographed pencil drawings; or the width of
the line if that is larger."""
MOST_ANGLE_DEGREES = 75
"""Largest angle between a line's end and the gap: a gap to the side of a line, as between two parallel bars, is not
closed. At a corner of 30 degrees both lines end at 75 degrees to the gap."""
MOST_ENDS = 2000  # drawings with more are hatched, with ends near each other by chance


@dataclass(frozen=True)
class _End:
    """The end of an open stroke.

    Attributes:
        place: where the line ends, in the root's units.
        direction: unit direction in which it ends.
        width: of the stroke.
        cap: distance by which the stroke extends beyond the end.
    """

    place: complex
    direction: complex
    width: float
    cap: float


def bridges(shapes: Sequence[Seen], extent: float) -> list[shapely.Geometry]:
    """Return areas that close small gaps between ends of strokes, each as wide as the thinner stroke.

    A gap is closed if its visible part is no longer than `GAP_SIDE_SHARE` of the drawing or the width of the line, and
    if it continues both lines within `MOST_ANGLE_DEGREES`. The shortest gaps are closed first, and each end once.

    Args:
        shapes: shapes with their subpaths in the root's units.
        extent: the longer side of the drawing.
    """
    ends = [end for node, runs in shapes for run in runs if not run.closed for end in _ends(node, run.z)]
    if not 2 <= len(ends) <= MOST_ENDS:
        return []
    places = np.array([end.place for end in ends])
    reach = max(GAP_SIDE_SHARE * extent, max(end.width for end in ends)) + 2 * max(end.cap for end in ends)
    points = shapely.points(xy_of(places))
    first, second = shapely.STRtree(points).query(points, predicate="dwithin", distance=reach)
    pairs = [(i, j) for i, j in zip(first.tolist(), second.tolist()) if i < j]
    pairs.sort(key=lambda pair: abs(places[pair[0]] - places[pair[1]]))
    joined = set[int]()
    areas = []
    for i, j in pairs:
        if not joined & {i, j} and _continue_each_other(ends[i], ends[j], extent):
            joined |= {i, j}
            line = shapely.LineString(xy_of(places[[i, j]]))
            areas.append(shapely.buffer(line, min(ends[i].width, ends[j].width) / 2))
    return areas


def _ends(node: Node, z: Complex) -> list[_End]:
    """Return both ends of an open subpath of a shape; none if it has no length."""
    z = distinct(z, closed=False)
    if z.size < 2:
        return []
    width = width_of(node) * math.sqrt(abs(node.affine.determinant))
    cap = width / 2 if node.properties.get("stroke-linecap", "") in CAPS else 0.0
    ends = []
    for line in (z, z[::-1]):
        is_far = np.abs(line - line[0]) >= width
        back = line[is_far.argmax()] if is_far.any() else line[-1]
        away = line[0] - back
        if away:
            ends.append(_End(complex(line[0]), complex(away / abs(away)), width, cap))
    return ends


def _continue_each_other(first: _End, second: _End, extent: float) -> bool:
    """Return whether the gap between two ends is small, and continues both lines."""
    gap = second.place - first.place
    if abs(gap) - first.cap - second.cap > max(GAP_SIDE_SHARE * extent, min(first.width, second.width)):
        return False
    least = math.cos(math.radians(MOST_ANGLE_DEGREES)) * abs(gap)
    return (gap * first.direction.conjugate()).real >= least and (
        -gap * second.direction.conjugate()
    ).real >= least
