"""Find the largest similar copy of one region inside another.

The problem is not convex, so the search has two stages. On a coarse raster, a correlation tests all positions of a copy
of a given scale at once, which finds the best place for any shapes. From there linear programs move the exact copy
along the boundaries that it touches until it cannot grow any more.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Complex, complex_of, xy_of
from ..pixels.canvas import Canvas, proportional
from ..pixels.coverage import painted_share
from ..plane import Similarity
from ..polygons import rings_of

RASTER_PIXELS = 96
"""Pixels of the outer region's longer side: places are found to a hundredth of its size, and refined from there."""
SCALE_STEP_RATIO = 0.93
"""Ratio of successive scales that are tried on the raster, from an upper bound downwards."""
MOST_SCALES = 64
"""Number of these scales: the smallest is a hundredth of the upper bound."""
EDGE_TOLERANCE_SHARE = 0.15
"""Area outside, in pixels per pixel of the copy's boundary, that is put down to rasterization."""
MOST_PLACES = 4
"""Places found on the raster that are refined, the best first."""
SIMPLIFIED_SHARE = 5e-4
"""Tolerance of boundaries in the search, relative to a region's size. The exact regions decide at the end."""
SAMPLE_SPACING_SHARE = 0.02
"""Relative to the copy's extent: spacing of the boundary points that the linear programs keep inside."""
NUDGE_SHARE = 2e-3
"""Relative to the copy's extent: the nearest boundary of the outer region is measured from this far inside a boundary
point, so that its direction is defined where both touch."""
MOST_LINEAR_PROGRAMS = 16
"""Linear programs from each place: more than 10 were never needed."""
FIRST_STEP_SHARE = 0.05
"""Relative to the copy's extent: how far the first linear program may move it."""
LAST_STEP_SHARE = 2e-4
"""Relative to the copy's extent: the iteration ends when steps are smaller."""
ROTATIONS_TRIED = 24
"""Number of rotations tried where any is allowed: every 15 degrees."""
UPRIGHT_GAIN_RATIO = 0.98
"""Of the largest scale: among copies at least this large, the one with the least rotation is preferred."""
CENTRING_RATIO = 0.985
"""Of the largest scale: size of the copy while it is centred in its room."""
MUCH_ROOM_SHARE = 0.06
"""Relative to the copy's extent: twice the room that this shrinking makes. A copy with less room stays where it can be
largest."""
SCALE_PRECISION = 1e-4
"""Relative precision of the largest scale at a place."""


def largest_copy(
    inner: shapely.Geometry, outer: shapely.Geometry, rotation: float | None = 0.0
) -> Similarity | None:
    """Return the largest similarity that maps one region into another; None where there is none.

    Parameters
    ----------
    inner
        The region that is copied: a polygon.
    outer
        The region that must contain the copy; it may have holes and several parts.
    rotation
        Rotation of the copy in radians; None for the rotation with the largest copy.

    Examples
    --------
    >>> wide, tall = shapely.box(0, 0, 4, 1), shapely.box(10, 0, 12, 3)
    >>> placed = largest_copy(wide, tall)
    >>> round(abs(placed.factor), 2), complex(np.round(placed(2 + 0.5j), 2))
    (0.5, (11+1.5j))
    """
    centre = complex_of(shapely.get_coordinates(shapely.centroid(inner)))[0]
    moved = transform_region(inner, Similarity(1.0, -centre))
    search = _Search.of(moved, outer)
    # 1. A raster finds places for a few sizes and rotations; the upright one and the largest copies are kept.
    angles = [rotation] if rotation is not None else _angles()
    starts = list(_starts(search, angles))  # sorted by the amount of rotation
    best_starts = dict.fromkeys(
        starts[:1] + sorted(starts, key=lambda start: -abs(start.factor))[:MOST_PLACES]
    )
    # 2. Linear programs grow the copies, of simplified regions.
    grown = [_grow(search, start, rotates=rotation is None) for start in best_starts]
    copies = [copy for copy in grown if copy is not None]
    if not copies:
        return None
    # 3. Of the copies that are nearly the largest, the one with the least rotation is taken.
    least = UPRIGHT_GAIN_RATIO * max(abs(copy.factor) for copy in copies)
    large = [copy for copy in copies if abs(copy.factor) >= least]
    best = min(large, key=lambda copy: (round(abs(np.angle(copy.factor)), 3), -abs(copy.factor)))
    # 4. It is centred where there is room, and fitted into the given regions.
    shapely.prepare(outer)
    exact = _shrink(moved, outer, _centre_in_room(search, best))
    if exact is None:
        return None
    exact = _enlarge(moved, outer, exact)
    return Similarity(exact.factor, exact.shift - exact.factor * centre)


def largest_copy_about(
    inner: shapely.Geometry, outer: shapely.Geometry, point: complex, image: complex, rotation: float = 0.0
) -> Similarity | None:
    """Return the largest similarity into a region that maps one given point to another; None where there is none.

    Parameters
    ----------
    inner, outer
        As for `largest_copy`.
    point, image
        The given point and its image.
    rotation
        Rotation of the copy in radians.
    """
    moved = transform_region(inner, Similarity(1.0, -point))
    shapely.prepare(outer)
    factor = complex(np.exp(1j * rotation))
    scale = float(np.sqrt(outer.area / inner.area))
    smallest = scale * SCALE_STEP_RATIO**MOST_SCALES
    while not _is_inside(moved, outer, Similarity(scale * factor, image)):
        scale *= (3 + SCALE_STEP_RATIO) / 4
        if scale < smallest:
            return None
    largest = _enlarge(moved, outer, Similarity(scale * factor, image))
    return Similarity(largest.factor, image - largest.factor * point)


class _Search(NamedTuple):
    """Both regions, simplified for the search.

    Attributes:
        inner: the region that is copied, with its centroid at 0.
        outer: the region that contains the copy, prepared for queries.
        points: (n,) points on the inner region's boundary.
        inward: (n,) the unit normals there that point into it.
        extent: the largest distance of the inner region from 0.
    """

    inner: shapely.Geometry
    outer: shapely.Geometry
    points: Complex
    inward: Complex
    extent: float

    @classmethod
    def of(cls, inner: shapely.Geometry, outer: shapely.Geometry) -> "_Search":
        """Prepare the search for copies of a region inside another."""
        simple, room = _simplified(inner), _simplified(outer)
        shapely.prepare(room)
        extent = float(np.abs(complex_of(shapely.get_coordinates(simple))).max())
        points, inward = [], []
        for ring in rings_of(simple):
            dense = shapely.segmentize(shapely.LinearRing(xy_of(ring)), SAMPLE_SPACING_SHARE * extent)
            z = complex_of(shapely.get_coordinates(dense)[:-1])
            along = np.roll(z, -1) - np.roll(z, 1)
            points.append(z)
            inward.append(1j * along / np.maximum(np.abs(along), 1e-300))
        return cls(simple, room, np.concatenate(points), np.concatenate(inward), extent)


def _simplified(region: shapely.Geometry) -> shapely.Geometry:
    return shapely.simplify(region, SIMPLIFIED_SHARE * float(np.sqrt(region.area)))


def _angles() -> Sequence[float]:
    """Return the rotations to try, in radians, from upright outwards."""
    steps = np.arange(ROTATIONS_TRIED)
    signed = np.where(steps % 2, 1, -1) * ((steps + 1) // 2)
    return (signed * 2 * np.pi / ROTATIONS_TRIED).tolist()


def _starts(search: _Search, angles: Sequence[float]) -> Iterator[Similarity]:
    """Yield copies that lie inside up to rasterization.

    The first one is in the largest inscribed circle; then come the largest copies of each rotation.
    """
    low_x, low_y, high_x, high_y = search.outer.bounds
    box = complex(low_x, low_y), complex(high_x, high_y)
    canvas = Canvas.about(*proportional(RASTER_PIXELS, box[1] - box[0]), box)
    outside = np.pad(1 - painted_share(rings_of(search.outer), canvas), 1, constant_values=1.0)
    pixel = 1 / RASTER_PIXELS * float(np.sqrt(search.outer.area))
    circle = shapely.maximum_inscribed_circle(search.outer, pixel)  # a line from its centre to its boundary
    middle, edge = complex_of(shapely.get_coordinates(circle))
    yield Similarity(complex(np.exp(1j * angles[0]) * abs(edge - middle) / search.extent), complex(middle))
    largest = 0.0
    for angle in angles:
        direction = complex(np.exp(1j * angle))
        bound = _scale_bound(search, direction)
        for scale in bound * SCALE_STEP_RATIO ** np.arange(MOST_SCALES):
            if scale < SCALE_STEP_RATIO * largest:
                break
            places = list(_places(search, canvas, outside, complex(scale * direction)))
            yield from places
            if places:
                largest = max(largest, float(scale))
                break


def _scale_bound(search: _Search, direction: complex) -> float:
    """Return an upper bound on the scale of a copy, from the bounding boxes and the areas."""
    copy = transform_region(search.inner, Similarity(direction, 0.0))
    widths = np.diff(np.reshape(np.array([copy.bounds, search.outer.bounds]), (2, 2, 2)), axis=1)[:, 0]
    return float(min(*(widths[1] / widths[0]), np.sqrt(search.outer.area / copy.area)))


def _places(
    search: _Search, canvas: Canvas, outside: NDArray[np.float32], factor: complex
) -> Iterator[Similarity]:
    """Yield the best position in each connected set of positions where a copy lies inside, the best first.

    `outside` is the share of each pixel that lies outside, padded by one pixel on each side of the canvas.
    """
    from scipy import ndimage  # slow to import, and few maps place anything

    step = canvas.step[0]
    copy = transform_region(search.inner, Similarity(factor, 0.0))
    left, low, right, high = copy.bounds
    width, height = int(np.ceil((right - left) / step)), int(np.ceil((high - low) / step))
    if height > outside.shape[0] or width > outside.shape[1]:
        return
    corner = complex(left, high)  # upper left of the copy's own raster
    raster = Canvas(width, height, (corner - 1j * height * step, corner + width * step))
    painted = painted_share(rings_of(copy), raster)
    # the convolution is cyclic, but not wrapped where the copy's raster lies inside the other one
    spectrum = np.fft.rfft2(outside) * np.fft.rfft2(painted[::-1, ::-1], outside.shape)
    beyond = np.fft.irfft2(spectrum, outside.shape)[painted.shape[0] - 1 :, painted.shape[1] - 1 :]
    allowed = EDGE_TOLERANCE_SHARE * shapely.length(copy) / step
    labels, count = ndimage.label(beyond <= allowed)
    if not count:
        return
    spots = ndimage.minimum_position(beyond, labels, np.arange(1, count + 1))
    for row, column in sorted(spots, key=lambda spot: beyond[spot])[:MOST_PLACES]:
        # where the corner of the copy's raster is; the first row and column lie outside the canvas
        place = canvas.box[0].real + (column - 1) * step + 1j * (canvas.box[1].imag - (row - 1) * step)
        yield Similarity(factor, place - corner)


def _grow(search: _Search, start: Similarity, *, rotates: bool) -> Similarity | None:
    """Grow a copy from a start by linear programs; None where it lies inside at no scale."""
    current = _shrink(search.inner, search.outer, start)
    if current is None:
        return None
    current = _enlarge(search.inner, search.outer, current)
    step = FIRST_STEP_SHARE
    for _ in range(MOST_LINEAR_PROGRAMS):
        aim = _program(search, current, step, rotates=rotates)
        inside = aim and _shrink(search.inner, search.outer, aim)
        if inside and abs(inside.factor) > abs(current.factor) * (1 + SCALE_PRECISION):
            current = inside
        else:
            step /= 3
        if step < LAST_STEP_SHARE:
            break
    return _enlarge(search.inner, search.outer, current)


def _program(search: _Search, copy: Similarity, step: float, *, rotates: bool) -> Similarity | None:
    """Return the copy after one linear program.

    The program maximizes the scale while boundary points stay on their side of the nearest boundary. All motions are
    bounded by `step`, relative to the copy's extent.
    """
    from scipy.optimize import linprog  # slow to import, and few maps place anything

    extent = abs(copy.factor) * search.extent
    x = copy(search.points)
    normal = search.inward * (copy.factor / abs(copy.factor))
    nudged = x + NUDGE_SHARE * extent * normal
    lines = shapely.shortest_line(shapely.points(xy_of(nudged)), shapely.boundary(search.outer))
    y = complex_of(shapely.get_coordinates(lines)[1::2])
    away = y - nudged
    distance = np.abs(away)
    inside = shapely.contains_xy(search.outer, nudged.real, nudged.imag)
    is_near = inside & (distance > 0) & (distance < (2 * step + 2 * NUDGE_SHARE) * extent)
    if not is_near.any():
        return Similarity(copy.factor * (1 + step), copy.shift)
    x, n, y = x[is_near], away[is_near] / distance[is_near], y[is_near]
    arm = x - copy.shift

    def towards(w: Complex) -> NDArray[np.float64]:
        """Return the components of vectors along the normals."""
        return (n.conj() * w).real

    # changes: relative scale, rotation in radians, translation in units of the extent
    rows = np.column_stack([towards(arm), towards(1j * arm), extent * n.real, extent * n.imag])
    bounds = [(-step, step), (-step, step) if rotates else (0, 0), (-step, step), (-step, step)]
    solution = linprog([-1, 0, 0, 0], A_ub=rows / extent, b_ub=towards(y - x) / extent, bounds=bounds)
    if solution.x is None:
        return None
    scale, angle, right, up = solution.x
    factor = copy.factor * (1 + scale) * complex(np.exp(1j * angle))
    return Similarity(factor, copy.shift + extent * complex(right, up))


def _centre_in_room(search: _Search, copy: Similarity) -> Similarity:
    """Shrink a copy slightly, and centre it in the horizontal and vertical room around it where there is much."""
    smaller = Similarity(CENTRING_RATIO * copy.factor, copy.shift)
    if not _is_inside(search.inner, search.outer, smaller):
        return copy
    extent = abs(copy.factor) * search.extent
    for direction in (1.0, 1j, 1.0, 1j):
        ahead, behind = (_room(search, smaller, sign * direction * extent) for sign in (1, -1))
        if ahead + behind > MUCH_ROOM_SHARE:
            away = 0.5 * (ahead - behind) * direction * extent
            smaller = Similarity(smaller.factor, smaller.shift + away)
    return smaller if _is_inside(search.inner, search.outer, smaller) else copy


def _room(search: _Search, copy: Similarity, vector: complex) -> float:
    """Return how far a copy that lies inside can be moved along a vector, in units of that vector."""

    def fits(distance: float) -> bool:
        moved_copy = Similarity(copy.factor, copy.shift + distance * vector)
        return _is_inside(search.inner, search.outer, moved_copy)

    inside, beyond = 0.0, NUDGE_SHARE
    while fits(beyond):
        inside, beyond = beyond, 1.5 * beyond
    while beyond - inside > NUDGE_SHARE:
        middle = (inside + beyond) / 2
        inside, beyond = (middle, beyond) if fits(middle) else (inside, middle)
    return inside


def _shrink(inner: shapely.Geometry, outer: shapely.Geometry, copy: Similarity) -> Similarity | None:
    """Shrink a copy about the image of 0 as little as needed to lie inside; None where no scale does."""
    less = SCALE_PRECISION
    scaled = copy
    while not _is_inside(inner, outer, scaled):
        if less > 0.9:
            return None
        scaled = Similarity(copy.factor * (1 - less), copy.shift)
        less *= 1.5
    return scaled


def _enlarge(inner: shapely.Geometry, outer: shapely.Geometry, copy: Similarity) -> Similarity:
    """Enlarge a copy that lies inside about the image of 0 as far as possible."""

    def enlarged(times: float) -> Similarity:
        return Similarity(copy.factor * times, copy.shift)

    inside, beyond = 1.0, 1 + 10 * SCALE_PRECISION
    while _is_inside(inner, outer, enlarged(beyond)):
        inside, beyond = beyond, 1 + 2 * (beyond - 1)
    while beyond - inside > SCALE_PRECISION:
        middle = (inside + beyond) / 2
        inside, beyond = (middle, beyond) if _is_inside(inner, outer, enlarged(middle)) else (inside, middle)
    return enlarged(inside)


def _is_inside(inner: shapely.Geometry, outer: shapely.Geometry, copy: Similarity) -> bool:
    return bool(shapely.covers(outer, transform_region(inner, copy)))


def transform_region(region: shapely.Geometry, similarity: Similarity) -> shapely.Geometry:
    """Return the image of a region under a similarity."""
    return shapely.transform(region, lambda xy: xy_of(similarity(complex_of(xy))))
