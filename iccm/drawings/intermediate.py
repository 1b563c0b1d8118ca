"""The drawing between two drawings in the same plane: parts and holes grow and shrink, and nothing fades.

The signed distances to both boundaries are interpolated, and the area where the result is negative is painted (Payne
and Toga, *Distance field manipulation of surface models*, IEEE Computer Graphics and Applications, 1992). A gap of one
drawing that the other one paints then closes from its rim. A part that overlaps nothing of the other drawing shrinks to
the middle of its thickest place. There, interpolated distances would paint nothing at all half-way.
"""

from collections.abc import Iterator

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt
from skimage.measure import find_contours

from ..arrays import Complex, Real, complex_of, xy_of
from .drawing import Drawing

CELLS_ACROSS = 320
"""Of the grid on which distances are interpolated, on the longer side; boundaries are placed between its points."""
GONE_SHARE = 2 / 3
"""Share of the time after which a part that overlaps nothing of the other drawing has vanished."""
CANCELLED_CELLS = 0.5
"""Distance from the boundary up to which a place half-way between both drawings is painted."""
SIMPLIFICATION_CELLS = 0.05
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
    >>> round(float(np.sqrt(intermediate(small, large, 0.5).painted.area / np.pi)), 2)
    2.0
    """
    if share <= 0 or share >= 1:
        return second if share >= 1 else first
    both = shapely.MultiPolygon([*first.parts, *second.parts])
    left, low, right, high = both.bounds
    step = max(right - left, high - low) / CELLS_ACROSS
    x, y = (np.arange(start - 2 * step, end + 3 * step, step) for start, end in ((left, right), (low, high)))
    places = x + 1j * y[:, None]
    distances = [signed_distances(drawing, places) for drawing in (first, second)]
    level = (1 - share) * distances[0] + share * distances[1]
    for drawing, other, elapsed in ((first, second, share), (second, first, 1 - share)):
        for part in _parts_alone(drawing, other):
            depth = signed_distances(Drawing(part), places)
            level = np.minimum(level, depth - depth.min() * elapsed / GONE_SHARE)
    # Where one drawing paints what the other one leaves out, the distances cancel out half-way: rounding would decide.
    rings = []
    for contour in find_contours(level, CANCELLED_CELLS * step * 4 * share * (1 - share)):
        ring = complex(x[0], y[0]) + step * (contour[:-1, 1] + 1j * contour[:-1, 0])
        if ring.size > 2:
            rings.append(complex_of(shapely.get_coordinates(_simplified(ring, step))[:-1]))
    return Drawing.of_rings(rings, "the drawing between both")


def signed_distances(drawing: Drawing, grid: Complex) -> Real:
    """Return the distances of a grid's points (rows, columns) to a drawing's boundary, negative inside what it paints.

    For each grid point, the nearest cells with points of the boundary give the segments to which distances are exact.
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
    for way in (following, before):  # the middle of a cell is only near the boundary: walk along it both ways
        start = nearest
        for _ in range(WALKED_POINTS):
            end = way[start]
            np.minimum(distances, _to_segments(grid, points[start], points[end]), out=distances)
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


def _to_segments(z: Complex, a: Complex, b: Complex) -> Real:
    """Return the distances of points to segments, one each."""
    along = b - a
    length = np.maximum(np.abs(along) ** 2, np.finfo(float).tiny)
    position = np.clip(((z - a) * along.conj()).real / length, 0, 1)
    distance: Real = np.abs(z - a - position * along)
    return distance


def _parts_alone(drawing: Drawing, other: Drawing) -> Iterator[shapely.Polygon]:
    """Yield the parts of a drawing that overlap nothing of the other one."""
    for part in drawing.parts:
        if not shapely.intersection(part, other.painted).area:
            yield part


def _simplified(ring: Complex, step: float) -> shapely.LinearRing:
    return shapely.simplify(shapely.LinearRing(xy_of(ring)), SIMPLIFICATION_CELLS * step)
