"""Fit smooth outlines with corners to pixel contours.

A contour is first simplified to a polygon (Douglas & Peucker 1973), whose edges are then replaced by lines fitted to
the points that they represent. This polygon is the control polygon of a curve: parabolas at vertices that are not
corners, as in a quadratic B-spline, and straight lines in the middle of edges much longer than their neighbours. The
curve is linear in the control vertices, which are moved to fit the contour by least squares. All lengths are in pixels.
"""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from ...arrays import Complex, Real, complex_of, xy_of
from ...plane import cross

REACH_PIXELS = 1.5  # distance that a vertex may move from its position in the simplified contour
CUT_EDGE_PIXELS = 2.0  # longest edge by which a pixel contour cuts a corner, and its distance from it
ALMOST_STRAIGHT_TOLERANCES = 0.5
"""Relative to the tolerance: a fitted vertex closer to the line through its neighbours is noise."""
CUT_PIXELS = 1.0
"""Pixel contours cut corners: points this close to a corner are on neither of its edges."""
CORNER_TOLERANCES = 4.0
"""Least height of a corner above the chord between its edges' midpoints, relative to the tolerance. On a smooth curve
an edge's sagitta is at most one tolerance, and the height of a vertex at most two."""
LONG_EDGE_RATIO = 3.0  # relative to its neighbour's length: the middle of a longer edge is straight
SMOOTHING_TOLERANCES = 2.2
"""Length over which curvature is smoothed, relative to the tolerance: longer than the steps of a staircase, shorter
than details that the polygon keeps."""
ALONG_WEIGHT = 0.3
"""Weight of distances along the curve relative to those across it, which alone measure the fit."""
STAY_WEIGHT = 0.05  # weight of the distance from the previous position, which makes the solution unique
FITTING_ROUNDS = 3
"""Number of least squares solutions; points are projected onto the curve again in between: the curve settles in a
few."""
SAMPLES_PER_EDGE = 16  # points of the curve per edge: they miss 1/128 of a sagitta of two tolerances
FINE_PIXELS = 0.02  # sagitta of the result's edges, invisible even when enlarged 30 times
POINTS_AT_ONCE = 4096  # points projected at a time, to limit memory
NEIGHBOURS = np.array(
    [-1, 0, 1, 2]
)  # vertices on which an edge's part of the curve depends, relative to its first one


def smooth_outline(
    contour: shapely.Polygon, tolerance: float, flatness: float = FINE_PIXELS
) -> shapely.Polygon:
    """Fit a smooth curve with corners to a pixel contour, and return it as a polygon.

    Args:
        contour: its exterior is the contour; holes are ignored.
        tolerance: distance in pixels for simplifying the contour.
        flatness: largest distance in pixels between the polygon and the curve.

    Returns:
        The curve if it is within twice the tolerance of the contour, except at corners, which contours cut. Otherwise
        its control polygon, or the simplified contour, whichever is valid.
    """
    z = complex_of(shapely.get_coordinates(contour.exterior)[:-1])
    # simplification keeps the first point, so start at an extreme one, which is likely to be a corner
    z = np.roll(z, -int(np.argmax(np.abs(z - z.mean()))))
    simple = shapely.simplify(shapely.Polygon(xy_of(z)), tolerance)
    fitted, first = _fit_edges(z, complex_of(shapely.get_coordinates(simple.exterior)[:-1]), tolerance)
    curve, distance = _fit_curve(z, fitted, first, tolerance)
    if distance <= 2 * tolerance:
        smooth = shapely.Polygon(xy_of(curve))
        if smooth.is_valid and smooth.area > 0:
            return shapely.simplify(smooth, max(flatness, FINE_PIXELS))
    straight = shapely.Polygon(xy_of(fitted))
    return straight if straight.is_valid and straight.area > 0 else simple


def _fit_edges(z: Complex, corners: Complex, tolerance: float) -> tuple[Complex, NDArray[np.intp]]:
    """Move the vertices of a simplified contour to the intersections of lines fitted to its edges.

    Simplification alone deviates by up to the tolerance, and cuts corners.

    Returns:
        (k,) vertices, and the index of the contour's point at each.
    """
    first = _places(corners, z)
    count = _points_of_edges(first, z.size)
    lines = [_line(np.take(z, np.arange(a, a + n + 1), mode="wrap")) for a, n in zip(first, count)]
    vertices = np.array([_meeting(lines[k - 1], lines[k], corner) for k, corner in enumerate(corners)])
    is_kept = np.ones(vertices.size, dtype=bool)
    length = np.abs(np.roll(vertices, -1) - vertices)
    for k in np.flatnonzero(length < CUT_EDGE_PIXELS).tolist():
        # a short edge between long ones cuts a corner, which is at their intersection
        previous, following = k - 1, (k + 1) % vertices.size
        is_cut = (
            2 * length[k] < min(length[previous], length[following])
            and is_kept[previous]
            and is_kept[following]
        )
        if is_cut and is_kept.sum() > 3:
            point = _intersection(lines[previous], lines[following])
            if (
                point is not None
                and max(abs(point - vertices[k]), abs(point - vertices[following])) <= CUT_EDGE_PIXELS
            ):
                vertices[following], is_kept[k] = point, False
    vertices, first = vertices[is_kept], first[is_kept]
    straightened = shapely.simplify(shapely.Polygon(xy_of(vertices)), ALMOST_STRAIGHT_TOLERANCES * tolerance)
    number = _places(complex_of(shapely.get_coordinates(straightened.exterior)[:-1]), vertices)
    return vertices[number], first[number]


def _places(some: Complex, z: Complex) -> NDArray[np.intp]:
    """Return the indices of some points in a contour."""
    index = {point: k for k, point in enumerate(z.tolist())}
    return np.array([index[point] for point in some.tolist()], dtype=np.intp)


def _points_of_edges(first: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return (k,) the number of points from each vertex to the next along a closed contour of `size` points."""
    return np.mod(np.roll(first, -1) - first - 1, size) + 1


Line = tuple[complex, complex]
"""A point and a unit direction."""


def _line(z: Complex) -> Line:
    """Fit a line to points by total least squares."""
    z = z[1:-1] if z.size > 4 else z  # ends are shared with neighbours, and may be at cut corners
    middle = complex(z.mean())
    direction = np.sqrt(complex(np.mean((z - middle) ** 2)))
    return middle, (direction / abs(direction) if direction else complex(z[-1] - z[0]) / abs(z[-1] - z[0]))


def _intersection(first: Line, second: Line) -> complex | None:
    """Return the intersection of two lines; None if they are almost parallel."""
    (a, d), (b, e) = first, second
    sine = cross(d, e)
    return a + d * cross(b - a, e) / sine if abs(sine) > 0.05 else None


def _meeting(first: Line, second: Line, corner: complex) -> complex:
    """Return the intersection of two lines if it is near the corner, else the mean of the corner's projections."""
    point = _intersection(first, second)
    if point is not None and abs(point - corner) <= REACH_PIXELS:
        return point
    feet = [p + u * ((corner - p) * u.conjugate()).real for p, u in (first, second)]
    return sum(feet) / 2 if max(abs(foot - corner) for foot in feet) <= REACH_PIXELS else corner


def _fit_curve(
    z: Complex, start: Complex, first: NDArray[np.intp], tolerance: float
) -> tuple[Complex, float]:
    """Move the vertices of a control polygon until its curve fits the contour best.

    Args:
        z: (p,) points of the contour.
        start: (n,) vertices of the control polygon.
        first: (n,) the index of the contour's point at each vertex.
        tolerance: of the polygon.

    Returns:
        Points of the curve, and the largest distance to it from points of the contour that are not at corners.
    """
    n, sharp = start.size, _is_corner(start, tolerance)
    basis = _basis(start, sharp)
    edge = np.repeat(np.arange(n), _points_of_edges(first, z.size))
    points = np.roll(z, -first[0])
    away = [np.where(sharp[k], np.abs(points - start[k]), np.inf) for k in (edge, (edge + 1) % n)]
    is_used = np.minimum(*away) > CUT_PIXELS
    edge, points = edge[is_used], points[is_used]
    fairness = _curvature_changes(start, sharp, SMOOTHING_TOLERANCES * tolerance)
    vertices = start
    for _ in range(FITTING_ROUNDS):
        feet = _project(points, edge, _sections(basis, vertices))
        best = _solve(points, feet, basis, vertices, fairness)
        shift = best - start
        vertices = start + shift * np.minimum(1, REACH_PIXELS / np.maximum(np.abs(shift), REACH_PIXELS))
    sections = _sections(basis, vertices)
    distance = _project(points, edge, sections).distance
    return sections[:, :-1].ravel(), float(distance.max(initial=0.0))


def _is_corner(polygon: Complex, tolerance: float) -> NDArray[np.bool_]:
    """Mark (n,) the vertices that are corners, as in Potrace (Selinger 2003): far above their edges' midpoints."""
    previous, following = (np.roll(polygon, 1) + polygon) / 2, (np.roll(polygon, -1) + polygon) / 2
    chord = following - previous
    height = np.abs(cross(chord, polygon - previous)) / np.maximum(np.abs(chord), 1e-12)
    return height > CORNER_TOLERANCES * tolerance


def _basis(polygon: Complex, sharp: NDArray[np.bool_]) -> Real:
    """Return the curve's points as linear combinations of vertices.

    The part of the curve for an edge reaches from the middle of the parabola at its start to that at its end. A
    parabola touches both edges at their midpoints, or nearer to the vertex if the other edge is much shorter. At a
    corner it degenerates to the vertex.

    Returns:
        (n, SAMPLES_PER_EDGE, 4) for each edge, coefficients of the vertices NEIGHBOURS relative to its first one.
    """
    length = np.maximum(np.abs(np.roll(polygon, -1) - polygon), 1e-9)
    previous = np.roll(length, 1)
    # shares of the edges before and after a vertex that its parabola covers
    before = np.where(sharp, 0, np.minimum(previous, LONG_EDGE_RATIO * length) / 2) / previous
    after = np.where(sharp, 0, np.minimum(length, LONG_EDGE_RATIO * previous) / 2) / length
    next_before, next_after = np.roll(before, -1), np.roll(after, -1)
    start, end = (after * length)[:, None], ((1 - next_before) * length)[:, None]
    s = np.linspace(0, 1, SAMPLES_PER_EDGE) * length[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        first = _parabola(0.5 + 0.5 * s / start, before, after)
        last = _parabola(0.5 * (s - end) / (length[:, None] - end), next_before, next_after)
    zero, share = np.zeros_like(s), s / length[:, None]
    straight = np.stack([zero, 1 - share, share, zero], axis=2)
    first = np.concatenate([first, zero[..., None]], axis=2)
    last = np.concatenate([zero[..., None], last], axis=2)
    return np.where((s < start)[..., None], first, np.where((s > end)[..., None], last, straight))


def _parabola(t: Real, before: Real, after: Real) -> Real:
    """Return (n, s, 3) coefficients of a vertex and its neighbours for points at t on the vertex's parabola.

    The parabola begins and ends at the given shares of both edges.
    """
    before, after = before[:, None], after[:, None]
    head, middle, tail = (1 - t) ** 2, 2 * t * (1 - t), t**2
    return np.stack([head * before, head * (1 - before) + middle + tail * (1 - after), tail * after], axis=2)


def _sections(basis: Real, vertices: Complex) -> Complex:
    """Return (n, SAMPLES_PER_EDGE) points of the curve for each edge."""
    number = np.arange(vertices.size)[:, None] + NEIGHBOURS
    return np.einsum("nsk,nk->ns", basis, vertices[number % vertices.size])


class Feet(NamedTuple):
    """The nearest points of a curve.

    Attributes:
        edge: (p,) edge of the control polygon.
        sample: (p,) sample of the curve before the point.
        share: (p,) share of the way to the next sample.
        tangent: (p,) unit tangent.
        distance: (p,) distance from the projected point.
    """

    edge: NDArray[np.intp]
    sample: NDArray[np.intp]
    share: Real
    tangent: Complex
    distance: Real


def _project(points: Complex, edge: NDArray[np.intp], sections: Complex) -> Feet:
    """Project points onto the parts of the curve that belong to their edges and both neighbours."""
    n, steps = sections.shape[0], SAMPLES_PER_EDGE - 1
    # (n, 3 steps + 1) samples of the curve along each edge and both neighbours. Points are only projected onto these,
    # since the opposite side of a thin part may be nearer.
    before, after = np.roll(sections, 1, axis=0), np.roll(sections, -1, axis=0)
    samples = np.concatenate([before[:, :-1], sections[:, :-1], after], axis=1)
    segments = np.diff(samples, axis=1)
    squared_lengths = np.maximum(np.abs(segments) ** 2, 1e-18)
    feet = list[Feet]()
    for k in range(0, points.size, POINTS_AT_ONCE):
        own_edges = edge[k : k + POINTS_AT_ONCE]
        step = segments[own_edges]
        offset = points[k : k + POINTS_AT_ONCE, None] - samples[own_edges, :-1]
        share = np.clip((offset * step.conj()).real / squared_lengths[own_edges], 0, 1)
        distance = np.abs(offset - share * step)
        nearest = distance.argmin(axis=1)
        nearest_index = np.arange(own_edges.size), nearest
        tangent = step[nearest_index] / np.sqrt(squared_lengths[own_edges][nearest_index])
        feet.append(
            Feet(
                edge=(own_edges + nearest // steps - 1) % n,
                sample=nearest % steps,
                share=share[nearest_index],
                tangent=tangent,
                distance=distance[nearest_index],
            )
        )
    return Feet(*(np.concatenate(column) for column in zip(*feet))) if feet else _NO_FEET


_NO_FEET = Feet(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0), np.zeros(0, complex), np.zeros(0))


def _curvature_changes(polygon: Complex, sharp: NDArray[np.bool_], length: float) -> sparse.csr_array:
    """Return (n, n) differences of curvature vectors between neighbouring vertices, zero at corners.

    They are weighted to smooth details shorter than a length in least squares.
    """
    n = polygon.size
    following = np.maximum(np.abs(np.roll(polygon, -1) - polygon), 0.5)
    previous = np.roll(following, 1)
    spacing = (following + previous) / 2
    number = np.arange(n)
    columns = (number[:, None] + [-1, 0, 1]) % n
    second = (
        np.stack([1 / previous, -(1 / previous + 1 / following), 1 / following], axis=1) / spacing[:, None]
    )
    curvature = sparse.csr_array((second.ravel(), (np.repeat(number, 3), columns.ravel())), shape=(n, n))
    smooth = ~(sharp | np.roll(sharp, -1))
    weight = np.where(smooth, length**3 / np.sqrt(following), 0)
    return sparse.diags_array(weight) @ (curvature[(number + 1) % n] - curvature)


def _solve(
    points: Complex, feet: Feet, basis: Real, vertices: Complex, fairness: sparse.csr_array
) -> Complex:
    """Fit the curve to the points by least squares, with the feet on the curve held fixed. Returns its vertices (n,).

    Distances across the curve have full weight, those along it little, since feet may slide.
    """
    n, count = vertices.size, points.size
    share = feet.share[:, None]
    weights = basis[feet.edge, feet.sample] * (1 - share) + basis[feet.edge, feet.sample + 1] * share
    columns = (feet.edge[:, None] + NEIGHBOURS) % n
    rows = np.repeat(np.arange(count), 2 * NEIGHBOURS.size)
    coordinates = np.concatenate([columns, columns + n], axis=1).ravel()  # x of all vertices, then y
    system, goals = list[sparse.csr_array](), list[Real]()
    for direction in (1j * feet.tangent, ALONG_WEIGHT * feet.tangent):
        entries = [weights * part[:, None] for part in (direction.real, direction.imag)]
        values = np.concatenate(entries, axis=1).ravel()
        system.append(sparse.csr_array((values, (rows, coordinates)), shape=(count, 2 * n)))
        goals.append((direction.conj() * points).real)
    system += [sparse.block_diag([fairness, fairness]), np.sqrt(STAY_WEIGHT) * sparse.eye_array(2 * n)]
    goals += [np.zeros(2 * n), np.sqrt(STAY_WEIGHT) * np.concatenate([vertices.real, vertices.imag])]
    matrix = sparse.csr_array(sparse.vstack(system))
    solution = spsolve((matrix.T @ matrix).tocsc(), matrix.T @ np.concatenate(goals))
    return solution[:n] + 1j * solution[n:]
