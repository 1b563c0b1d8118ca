"""The drawing between two drawings in the same plane: parts and holes grow and shrink, and nothing fades.

The signed distances to both boundaries are interpolated, and the area where the result is negative is painted (Payne
and Toga, *Distance field manipulation of surface models*, IEEE Computer Graphics and Applications, 1992). A part that
overlaps nothing of the other drawing shrinks to the middle of its thickest place instead, and so does a hole that the
other drawing paints: interpolated distances would make them vanish at once where they are small.

Areas of several colours grow and shrink in the same way: each place has the colour to whose area the interpolated
distance is least.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt, gaussian_filter
from skimage.measure import find_contours

from ..arrays import Complex, Real, complex_of, xy_of
from ..errors import InputError
from ..plane import segment_distances
from ..polygons import fill_holes, polygons_of, unite
from .drawing import Drawing

CELLS_ACROSS = 320
"""Of the grid on which distances are interpolated, on the longer side; boundaries are placed between its points."""
GONE_SHARE = 2 / 3
"""Share of the time after which a part or hole without a counterpart in the other drawing has vanished."""
CANCELLED_CELLS = 0.5
"""Distance from the boundary up to which a place half-way between both drawings is painted."""
NOWHERE_CELLS = 1e4
"""Distance to a colour that paints nothing: more than any other on the grid."""
SMOOTHING_CELLS = 2.0
"""Standard deviation of the Gaussian that smooths interpolated distances half-way: 1 % of the drawing is rounded."""
SIMPLIFICATION_CELLS = 0.1
"""Largest deviation of the boundary's vertices, which is not visible."""
WALKED_POINTS = 4
"""Along the boundary from the cell that is nearest to a point, both ways, among them the nearest segment."""


def intermediate(first: Drawing, second: Drawing, share: float) -> Drawing:
    """Return the drawing between two drawings.

    Parameters
    ----------
    first, second
        The drawings, in the same plane.
    share
        Position between them, from 0 to 1.

    Examples
    --------
    >>> import shapely
    >>> small, large = (Drawing(shapely.Point(0, 0).buffer(r, 64)) for r in (1, 3))
    >>> round(float(np.sqrt(intermediate(small, large, 0.5).painted.area / np.pi)), 1)
    2.0
    """
    if share <= 0 or share >= 1:
        return second if share >= 1 else first
    places, step = _grid([first, second])
    drawing = _of_level(_silhouette(first, second, share, places, step), places, step)
    if drawing is None:
        raise InputError("the drawing between both: the drawing paints nothing")
    return drawing


def intermediate_areas(
    first: Sequence[Drawing | None], second: Sequence[Drawing | None], share: float
) -> list[Drawing | None]:
    """Return the areas between those of two drawings, which do not overlap.

    Parameters
    ----------
    first, second
        The areas of both drawings in the same plane, one for each colour; None where one does not have the colour.
    share
        Position between them, above 0 and below 1.

    Returns
    -------
    list
        For each colour the area of it and of all colours after it, so that painting them in order shows no gaps; None
        where nothing is painted.

    Examples
    --------
    A disc in another colour that vanishes from a square:

    >>> import shapely
    >>> disc, square = shapely.Point(0, 0).buffer(1), shapely.box(-2, -2, 2, 2)
    >>> first = [Drawing(square.difference(disc)), Drawing(disc)]
    >>> below, above = intermediate_areas(first, [Drawing(square), None], 1 / 3)
    >>> round(below.painted.area), round(float(np.sqrt(above.painted.area / np.pi)), 1)
    (16, 0.5)
    """
    both = [[area for area in areas if area is not None] for areas in (first, second)]
    places, step = _grid([*both[0], *both[1]])
    wholes = [Drawing(unite([area.painted for area in areas])) for areas in both]
    outside = _silhouette(wholes[0], wholes[1], share, places, step)
    levels, shrinking = [], []
    for number, (before, after) in enumerate(zip(first, second)):
        (one, other), alone = _separated(before, after)
        # among colours without distances, the first one is below
        nowhere = np.full(places.shape, (number + 1) * NOWHERE_CELLS * step)
        levels.append(nowhere if one is None or other is None else _blend(one, other, share, places))
        shrinking += [(number, part) for part in _shrunk(alone, share, places)]
    layers: list[Drawing | None] = [_of_level(outside, places, step)]
    for number in range(1, len(levels)):
        ahead = np.min(levels[number:], axis=0) - np.min(levels[:number], axis=0)
        for of_colour, part in shrinking:
            ahead = np.minimum(ahead, part) if of_colour >= number else np.maximum(ahead, -part)
        layers.append(_of_level(np.maximum(outside, ahead), places, step))
    return layers


def _grid(drawings: Sequence[Drawing]) -> tuple[Complex, float]:
    """Return points (rows, columns) over all drawings and a margin around them, and their distance."""
    left, low, right, high = shapely.total_bounds([drawing.painted for drawing in drawings])
    step = max(right - left, high - low) / CELLS_ACROSS
    x, y = (np.arange(start - 2 * step, end + 3 * step, step) for start, end in ((left, right), (low, high)))
    return x + 1j * y[:, None], step


def _silhouette(first: Drawing, second: Drawing, share: float, places: Complex, step: float) -> Real:
    """Return a level at places that is negative inside the drawing between both."""
    gaps = [_gaps_painted_by(other, drawing) for drawing, other in ((first, second), (second, first))]
    filled = [
        Drawing(unite([drawing.painted, *closing])) if closing else drawing
        for drawing, closing in zip((first, second), gaps)
    ]
    (before, after), alone = _separated(*filled)
    if before is None or after is None:
        level = np.full(places.shape, NOWHERE_CELLS * step)
    else:
        # Half-way, distances cancel out beside a boundary of both from different sides: rounding would decide.
        level = _blend(before, after, share, places) - CANCELLED_CELLS * step * 4 * share * (1 - share)
    for gap in _shrunk(gaps, share, places):
        level = np.maximum(level, -gap)
    for part in _shrunk(alone, share, places):
        level = np.minimum(level, part)
    return level


def _blend(first: Drawing, second: Drawing, share: float, places: Complex) -> Real:
    """Return the interpolated signed distances to both drawings.

    Half-way they are smoothed: where boundaries of both cross, the nearest ones change from place to place.
    """
    level = (1 - share) * signed_distances(first, places) + share * signed_distances(second, places)
    smoothed: Real = gaussian_filter(level, SMOOTHING_CELLS * 4 * share * (1 - share), mode="nearest")
    return smoothed


def _shrunk(alone: Sequence[Sequence[shapely.Polygon]], share: float, places: Complex) -> Iterator[Real]:
    """Yield a level for each area of both drawings that the other one does not have, negative in what is left of it."""
    for areas, elapsed in zip(alone, (share, 1 - share)):
        if elapsed >= GONE_SHARE:
            continue
        for area in areas:
            depth = signed_distances(Drawing(area), places)
            yield depth - depth.min() * elapsed / GONE_SHARE


def _separated(
    first: Drawing | None, second: Drawing | None
) -> tuple[tuple[Drawing | None, Drawing | None], list[list[shapely.Polygon]]]:
    """Return what of both drawings overlaps, None for nothing, and the parts of both that overlap nothing."""
    overlapping, alone = list[Drawing | None](), []
    for drawing, other in ((first, second), (second, first)):
        parts = drawing.parts if drawing is not None else []
        lonely = [
            part for part in parts if other is None or not shapely.intersection(part, other.painted).area
        ]
        alone.append(lonely)
        kept = [part for part in parts if part not in lonely]
        overlapping.append(drawing if not lonely else Drawing(shapely.MultiPolygon(kept)) if kept else None)
    return (overlapping[0], overlapping[1]), alone


def _gaps_painted_by(other: Drawing, drawing: Drawing) -> list[shapely.Polygon]:
    """Return the holes of a drawing that another one paints completely."""
    gaps = polygons_of(shapely.difference(fill_holes(drawing.painted), drawing.painted))
    return [gap for gap in gaps if not shapely.difference(gap, other.painted).area]


def _of_level(level: Real, places: Complex, step: float) -> Drawing | None:
    """Return the drawing of the places with a negative level; None if there are none."""
    rings = []
    for contour in find_contours(level, 0.0):
        ring = complex(places[0, 0]) + step * (contour[:-1, 1] + 1j * contour[:-1, 0])
        if ring.size > 2:
            rings.append(complex_of(shapely.get_coordinates(_simplified(ring, step))[:-1]))
    rings = [ring for ring in rings if ring.size > 2]
    return Drawing.of_rings(rings, "the drawing between both") if rings else None


def signed_distances(drawing: Drawing, grid: Complex) -> Real:
    """Return the distances of a grid's points (rows, columns) to a drawing's boundary, negative inside what it paints.

    A distance transform finds for each grid point a boundary point in the nearest cell that has one. The distance is
    the least one to the segments within WALKED_POINTS of that point along the boundary.
    """
    step = float(grid[0, 1].real - grid[0, 0].real)
    points, following = _boundary(drawing, step)
    before = np.empty_like(following)
    before[following] = np.arange(following.size)
    cells = np.rint((points - grid[0, 0]) / step)
    inner = (np.clip(cells.imag, 0, grid.shape[0] - 1), np.clip(cells.real, 0, grid.shape[1] - 1))
    row, column = (index.astype(int) for index in inner)
    in_cell = np.full(grid.shape, -1)
    in_cell[row, column] = np.arange(points.size)
    rows, columns = distance_transform_edt(in_cell < 0, return_distances=False, return_indices=True)
    nearest = in_cell[rows, columns]

    distances = np.full(grid.shape, np.inf)
    # the nearest cell's point is not always the nearest: walk both ways
    for next_point in (following, before):
        start = nearest
        for _ in range(WALKED_POINTS):
            end = next_point[start]
            to_segment = segment_distances(grid, points[start], points[end] - points[start])
            np.minimum(distances, to_segment, out=distances)
            start = end
    return np.where(drawing.region.contains(grid), -distances, distances)


def _boundary(drawing: Drawing, spacing: float) -> tuple[Complex, np.ndarray]:
    """Return points on the boundary at most a spacing apart, and of each the index of the next one on its ring."""
    points, following, count = [], [], 0
    for ring in drawing.rings:
        closed = shapely.segmentize(shapely.LinearRing(xy_of(ring)), spacing)
        z = complex_of(shapely.get_coordinates(closed)[:-1])
        points.append(z)
        following.append(count + np.roll(np.arange(z.size), -1))
        count += z.size
    return np.concatenate(points), np.concatenate(following)


def _simplified(ring: Complex, step: float) -> shapely.LinearRing:
    return shapely.simplify(shapely.LinearRing(xy_of(ring)), SIMPLIFICATION_CELLS * step)
