"""Fill concavities of an outline, and return the outline without them and the concavities.

A concavity is the area between an outline and a chord outside that joins two of its vertices, the concavity's
mouth. A map of the filled shape, in which the triangles of concavities have little weight, decides how far each
one closes.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from ...arrays import Complex, Flags, Index, complex_of, xy_of
from ...curve import Curve, polygon_of
from ...plane import cross, polygon_area
from ..model.boundary_pairs import subdivide
from ..model.outline import Outline

SHALLOW_DEPTH_SHARE = 0.02  # relative to the root of the area: vertices this close to the hull are on it
ROUNDING_MOUTH_SHARE = 1e-9  # relative to a mouth's length: trimmed at its ends, where it meets the outline
LEAST_BAY_AREA_SHARE = 0.01  # relative to the shape's area, which is one: smaller concavities are not filled


class Filled(NamedTuple):
    """A shape with filled concavities.

    Attributes:
        outline: the shape including its concavities, counter-clockwise.
        bays: for each concavity, the vertices of the shape's own outline from one end of the mouth to the
            other, ends included; the ends are vertices of `outline` too.
    """

    outline: Curve
    bays: tuple[Complex, ...]


def fill_hull(curve: Curve, fixed_vertices: Sequence[complex] = ()) -> Filled:
    """Fill the concavities between a shape and its convex hull.

    Args:
        curve: outline of the shape, counter-clockwise.
        fixed_vertices: vertices that must stay on the outline; concavities with such vertices are not filled.
    """
    ends = np.flatnonzero(_on_hull(curve.z))
    rolled = np.roll(curve.z, -ends[0])
    path, places = np.append(rolled, rolled[0]), np.append(ends - ends[0], curve.z.size)
    outline, bays = _mouths(curve.polygon, path, places, fixed_vertices)
    return Filled(Curve(outline[:-1]), bays)


def fill_half_hull(curve: Curve, top: int) -> tuple[Filled, complex]:
    """Fill the concavities of a symmetric shape, given its right half.

    Args:
        curve: the half, from the lower end of the axis (the imaginary axis) up to the upper end, and down the
            axis.
        top: index of the upper end.

    Returns:
        The filled half, and the upper end of its axis; the lower end is its first vertex.
    """
    path = curve.z[: top + 1]
    ends = np.flatnonzero(_on_hull(np.append(path, -path[-2:0:-1].conj()))[: path.size])
    outline, bays = _mouths(curve.polygon, path[ends[0] : ends[-1] + 1], ends - ends[0])
    axis = path[:0]
    if ends[-1] < top:  # the axis divides a concavity
        outline, axis = np.append(outline, 1j * path[ends[-1]].imag), path[top:]
        bays += (path[ends[-1] :],)
    if ends[0] > 0:
        outline, axis = np.append(1j * path[ends[0]].imag, outline), np.append(axis, path[0])
        bays += (path[: ends[0] + 1],)
    return Filled(Curve(np.append(outline, axis)), bays), complex(outline[-1])


def _on_hull(z: Complex) -> Flags:
    """Return which vertices of a polygon are on its convex hull, or close to it."""
    polygon = polygon_of(z)
    away = shapely.distance(shapely.points(xy_of(z)), polygon.convex_hull.exterior)
    return away <= SHALLOW_DEPTH_SHARE * np.sqrt(polygon.area)


def _mouths(
    shape: shapely.Polygon, path: Complex, ends: Index, fixed_vertices: Sequence[complex] = ()
) -> tuple[Complex, tuple[Complex, ...]]:
    """Skip the concavities of an outline between vertices `ends` (k,).

    Concavities stay part of the outline if their mouth is not outside the shape, or if they have vertices that
    are kept.

    Returns:
        A polyline that includes all ends, and the concavities that it skips.
    """
    outline, bays, stack = [path[:1]], [], list(pairwise(ends.tolist()))[::-1]
    while stack:
        start, stop = stack.pop()
        bay = path[start : stop + 1]
        beyond = -cross(bay[-1] - bay[0], bay - bay[0])
        # The outline crosses the chord: split the concavity at the farthest vertex beyond it.
        if beyond[1:-1].max(initial=0) > 0:
            middle = start + int(beyond.argmax())
            stack += [(middle, stop), (start, middle)]
            continue
        if (
            bay.size > 2
            and -polygon_area(bay) > LEAST_BAY_AREA_SHARE
            and not np.isin(bay[1:-1], fixed_vertices).any()
            and not shape.intersects(_within(bay[0], bay[-1]))
        ):
            bays.append(bay)
            bay = bay[[0, -1]]
        outline.append(bay[1:])
    return np.concatenate(outline), tuple(bays)


def _within(start: complex, end: complex) -> shapely.LineString:
    """Return a segment without its ends."""
    return shapely.LineString(
        xy_of(start + (end - start) * np.array([ROUNDING_MOUTH_SHARE, 1 - ROUNDING_MOUTH_SHARE]))
    )


def bays_within(
    outline: Outline, bays: Sequence[Complex], fineness: float, spacing: float
) -> tuple[Complex, ...]:
    """Return the concavities of a simplified outline, with points no farther apart than `spacing`.

    Args:
        outline: the outline.
        bays: polylines of the concavities, which are simplified.
        fineness: tolerance relative to the outline's diagonal; it is at most half a concavity's depth.
        spacing: longest edge.
    """
    paths = []
    for bay in bays:
        mouth, line = shapely.LineString(xy_of(bay[[0, -1]])), shapely.LineString(xy_of(bay))
        depth = line.hausdorff_distance(mouth)
        path = complex_of(
            shapely.get_coordinates(line.simplify(min(fineness * outline.curve.diagonal, 0.5 * depth)))
        )
        gaps = np.abs(np.diff(path))
        gap, share = subdivide(gaps, spacing)
        path = np.append(path[gap] + share * np.diff(path)[gap], path[-1])
        while path.size < 4:  # each end needs a separate neighbour
            path = np.insert(path, np.arange(1, path.size), 0.5 * (path[1:] + path[:-1]))
        paths.append(path)
    return tuple(paths)
