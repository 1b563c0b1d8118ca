"""The area that a whole drawing paints: fills, strokes, and the inside of closed lines in line drawings."""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import shapely

from ...polygons import fill_holes, simplify_each, unite
from .fill import DRAWN_AREA_SHARE, has_body, with_lines_filled
from .gaps import bridges
from .strokes import Fills, Seen, areas, width_of
from .tree import Node

LINE_WIDTH_SHARE = 1 / 8
"""Of the longer side of the drawing. A wider stroke is an area itself, such as a ring, not the line around an area;
icon sets usually draw lines 2 of 20 units wide."""
VISIBLE_WIDTH_SHARE = 1 / 512
"""Of the longer side of the drawing: a narrower stroke beside fills would be less than a pixel of 512."""

MANY_VERTICES, FLATNESS_SHARE = 2000, 1e-4
"""Vertices of an area above which it is simplified, and the tolerance relative to the longer side. Curves and round
line ends are flattened relative to their own size, which is far too fine for a drawing with hundreds of them."""

Cut = Callable[[Node, shapely.Geometry], shapely.Geometry]


def painted_areas(
    shapes: Iterable[Seen],
    cut: Cut,
    pictures: Iterable[shapely.Geometry] = (),
    filled: Fills | None = None,
) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Compute the area that shapes paint together.

    Args:
        shapes: all shapes that are shown, with their subpaths in the root's units.
        cut: restricts a shape's painted area to what its clip paths and masks show.
        pictures: areas of embedded pictures.
        filled: cache of fills computed before.

    Returns:
        The ink, as drawn: all fills, and strokes wide enough to be visible. And the painted area: the same, with closed
        lines filled if the drawing is made of lines; small gaps in them are closed.

    Raises:
        InputError: a malformed width, or lines that cross too often.
    """
    shapes = list(shapes)
    fills, strokes = areas(shapes, cut, filled)
    fills = unite([fills, *pictures])
    if not strokes:
        ink = _thinned(fills, _longer_side(fills))
        return ink, with_lines_filled(ink)
    stroke_area = unite([area for _, area in strokes])
    painted_area = unite([fills, stroke_area])
    extent = _longer_side(painted_area)
    widths = [width_of(node) * math.sqrt(abs(node.affine.determinant)) for node, _ in strokes]
    lines = max(widths) <= LINE_WIDTH_SHARE * extent
    closed = fill_holes(_without_gaps(stroke_area, shapes, extent)) if lines else stroke_area
    enclosed = fill_holes(unite([painted_area, closed]))
    if lines and fills.area < DRAWN_AREA_SHARE * enclosed.area:
        filled_area = unite([with_lines_filled(fills), closed]) if has_body(enclosed) else painted_area
        return _thinned(painted_area, extent), _thinned(filled_area, extent)
    visible = [area for (_, area), width in zip(strokes, widths) if width >= VISIBLE_WIDTH_SHARE * extent]
    ink = _thinned(painted_area if len(visible) == len(strokes) else unite([fills, *visible]), extent)
    return ink, with_lines_filled(ink)


def _without_gaps(lines: shapely.Geometry, shapes: Sequence[Seen], extent: float) -> shapely.Geometry:
    """Return the area of lines with small gaps closed, if they enclose more area that way."""
    closed = unite([lines, *bridges(shapes, extent)])
    closed_holes, open_holes = (shapely.area(fill_holes(area)) - area.area for area in (closed, lines))
    return closed if closed_holes > open_holes else lines


def _thinned(area: shapely.Geometry, extent: float) -> shapely.Geometry:
    """Simplify an area with very many vertices, within FLATNESS_SHARE relative to the whole drawing."""
    if shapely.get_num_coordinates(area) <= MANY_VERTICES:
        return area
    return simplify_each(area, FLATNESS_SHARE * extent)


def _longer_side(area: shapely.Geometry) -> float:
    low_x, low_y, high_x, high_y = area.bounds
    return 0.0 if area.is_empty else float(np.max([high_x - low_x, high_y - low_y]))
