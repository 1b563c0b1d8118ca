"""Curves in the plane: complex vertices, closed (a domain's boundary) or open (a stroke)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.validation import explain_validity

from . import limits
from .arrays import Complex, Real, as_complex, complex_of, xy_of
from .buckets import SegmentGrid
from .errors import InputError
from .plane import bounding_box, distinct, polygon_area, segment_distances

HAUSDORFF_ERROR_SHARE = 0.01  # relative error of a Hausdorff distance, which may be too small by this
ROUNDING_SHARE = 1e-9  # relative to the diagonal: shorter distances are not refined


@dataclass(frozen=True, eq=False)
class Curve:
    """A polyline with complex vertices.

    Attributes:
        z: (n,) complex vertices; a closed curve does not repeat the first one.
        closed: whether the last vertex joins the first.

    >>> import iccm
    >>> square = iccm.Curve.domain([0, 2, 2 + 2j, 2j])
    >>> float(square.area), float(square.length), square.closed
    (4.0, 8.0, True)
    >>> square.contains(np.array([1 + 1j, 3 + 1j]))
    array([ True, False])
    """

    z: Complex
    closed: bool = True

    @classmethod
    def domain(cls, z: ArrayLike, name: str = "shape") -> "Curve":
        """Return the boundary of a domain: finite, simple, without repeated neighbours, counter-clockwise.

        Raises:
            InputError: not (n,) numbers; NaN or infinite vertices; fewer than three distinct ones; no area; or
                a self-intersection, with its place.
        """
        curve = cls(distinct(_finite(z, name)))
        if curve.z.size < 3:
            raise InputError(f"{name}: has {curve.z.size} distinct vertices; at least 3 are needed")
        smallest = 1e-14 * curve.diagonal**2
        # the area of a figure eight is zero, too, if its halves are equal, but not that of its hull
        if abs(curve.area) <= smallest and curve.polygon.convex_hull.area <= smallest:
            raise InputError(f"{name}: the outline encloses no area")
        if not curve.polygon.is_valid:
            why, _, place = explain_validity(curve.polygon).rstrip("]").partition("[")
            x, y = (f"{float(number):.6g}" for number in place.split()[:2])
            verb, remedy = (
                ("touches", "separate its parts there")
                if why.startswith("Ring")
                else ("crosses", "remove the crossing")
            )
            raise InputError(f"{name}: the outline {verb} itself at ({x}, {y}); {remedy}")
        if abs(curve.area) <= smallest:
            raise InputError(f"{name}: the outline encloses no area")
        return curve if curve.area > 0 else curve.reversed()

    @classmethod
    def stroke(cls, z: ArrayLike, name: str = "stroke") -> "Curve":
        """Return an open polyline of at least two distinct vertices.

        Raises:
            InputError: not (n,) numbers, NaN or infinite vertices, or fewer than two distinct ones.
        """
        curve = cls(distinct(_finite(z, name), closed=False), closed=False)
        if curve.z.size < 2:
            raise InputError(f"{name}: a stroke needs at least 2 distinct points")
        return curve

    @cached_property
    def edges(self) -> Complex:
        """Edge vectors; e = n for a closed curve, n - 1 for an open one; shape (e,)."""
        return np.roll(self.z, -1) - self.z if self.closed else np.diff(self.z)

    @cached_property
    def lengths(self) -> Real:
        """Edge lengths; shape (e,)."""
        return np.abs(self.edges)

    @cached_property
    def knots(self) -> Real:
        """(e + 1,) arclength at the edges' ends, from 0 to the total length."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def length(self) -> float:
        """Total arclength."""
        return float(self.knots[-1])

    @cached_property
    def area(self) -> float:
        """Signed area, positive when counter-clockwise."""
        return polygon_area(self.z)

    @cached_property
    def box(self) -> tuple[complex, complex]:
        """Lower left and upper right corner of the bounding box."""
        return bounding_box(self.z)

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal: the unit of every reported length."""
        return abs(self.box[1] - self.box[0])

    @cached_property
    def diameter(self) -> float:
        """Largest distance of two vertices.

        Unlike the diagonal, which it never exceeds, it is invariant under rotation.
        """
        points = shapely.MultiPoint(xy_of(self.z))
        return _widest(complex_of(shapely.get_coordinates(points.convex_hull)))

    @property
    def polygon(self) -> shapely.Polygon:
        """The inside of a closed curve as a shapely polygon.

        It is a new object at each access, so that threads do not share it.
        """
        return polygon_of(self.z)

    @cached_property
    def normals(self) -> Complex:
        """Unit normals of the edges, outward for a counter-clockwise curve; shape (e,)."""
        return -1j * self.edges / self.lengths

    def reversed(self) -> "Curve":
        """Return the curve in the opposite direction; a closed one keeps its first vertex."""
        return Curve(np.roll(self.z[::-1], 1) if self.closed else self.z[::-1].copy(), self.closed)

    def contains(self, w: Complex) -> NDArray[np.bool_]:
        """Return (p,) whether points lie inside a closed curve."""
        polygon = self.polygon
        shapely.prepare(polygon)
        return shapely.contains_xy(polygon, w.real, w.imag)

    def at(self, s: ArrayLike) -> Complex:
        """Return the points at arclengths s; cyclic on a closed curve, clamped on an open one."""
        edge, t = self.locate(s)
        end = (edge + 1) % self.z.size
        return self.z[edge] * (1 - t) + self.z[end] * t

    def locate(self, s: ArrayLike) -> tuple[NDArray[np.intp], Real]:
        """Return the edges that contain arclengths s, and the positions on these edges, in [0, 1]."""
        arclengths = np.asarray(s, dtype=np.float64)
        s = np.mod(arclengths, self.length) if self.closed else np.clip(arclengths, 0, self.length)
        edge = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, self.edges.size - 1)
        return edge, np.clip((s - self.knots[edge]) / self.lengths[edge], 0, 1)

    def sample(self, per_edge: int) -> Complex:
        """Return (e · per_edge,) points at the middles of `per_edge` equal parts of each edge, so never at a vertex."""
        t = (np.arange(per_edge) + 0.5) / per_edge
        return (self.z[: self.edges.size, None] + self.edges[:, None] * t).ravel()

    @cached_property
    def _edge_grid(self) -> SegmentGrid:
        """The edges, prepared for searches of the nearest one."""
        return SegmentGrid(self.z[: self.edges.size], np.roll(self.z, -1)[: self.edges.size])

    def closest(self, w: Complex) -> Real:
        """Return (p,) the arclengths of the closest points of the curve to points w (p,)."""
        edge, part = self._edge_grid.nearest(np.asarray(w))
        return self.knots[edge] + part * self.lengths[edge]

    def nearest(self, w: Complex) -> Complex:
        """Return the closest point of the curve to each of the points w (p,)."""
        return self.at(self.closest(w))

    def distances(self, w: Complex) -> Real:
        """Return (p,) distances of points to the curve."""
        return np.abs(self.nearest(w) - w)

    def pulled_in(self, w: Complex) -> Complex:
        """Return points with those outside a closed curve moved to the closest point on it."""
        return np.where(self.contains(w), w, self.nearest(w)) if w.size else w

    def resample(self, count: int) -> "Curve":
        """Return the curve with about `count` vertices and nearly equal edges.

        All corners sharper than 30° are kept.
        """
        return Curve(self.at(resampled_knots(self, count)), self.closed)


def polygon_of(outline: Complex, *holes: Complex) -> shapely.Polygon:
    """Return the shapely polygon with vertices (n,), and with holes."""
    return shapely.Polygon(xy_of(outline), [xy_of(hole) for hole in holes])


def inside_any(curves: Iterable[Curve], w: Complex) -> NDArray[np.bool_]:
    """Return (p,) whether points lie inside one of several closed curves."""
    inside = np.zeros(w.size, bool)
    for curve in curves:
        inside |= curve.contains(w)
    return inside


def corners_of(curve: Curve, least: float) -> NDArray[np.intp]:
    """Return the indices of the vertices at which a closed curve bends by more than `least`, in radians."""
    return np.flatnonzero(np.abs(np.angle(curve.edges / np.roll(curve.edges, 1))) > least)


def boundary_samples(polygon: Complex, per_edge: int = 4) -> Complex:
    """Return (n · per_edge,) points on a polygon, in order, including its vertices."""
    t = np.arange(per_edge) / per_edge
    return (polygon[:, None] + (np.roll(polygon, -1) - polygon)[:, None] * t).ravel()


def interior_grid(curve: Curve, count: int, holes: Sequence[Complex] = ()) -> Complex:
    """Return about `count` points of a square grid inside a closed curve and outside of holes.

    None is closer to an outline than a hundredth of the spacing. There is at least one point.
    """
    step = np.sqrt(abs(curve.area) / count)
    lo, hi = curve.box
    x = np.arange(lo.real + step / 2, hi.real, step)
    y = np.arange(lo.imag + step / 2, hi.imag, step)
    z = (x[None, :] + 1j * y[:, None]).ravel()
    domain = polygon_of(curve.z, *holes)
    ring = domain.buffer(-0.01 * step)
    shapely.prepare(ring)
    inside = z[shapely.contains_xy(ring, z.real, z.imag)]
    if inside.size:
        return inside
    point = domain.representative_point()
    return np.array([complex(point.x, point.y)])


def hausdorff(a: Curve, b: Curve) -> float:
    """Return the two-sided Hausdorff distance of two curves, accurate to 1 % or to rounding."""
    return max(_directed_hausdorff(a, b), _directed_hausdorff(b, a))


def _directed_hausdorff(a: Curve, b: Curve) -> float:
    """Return the largest distance of a point of one curve to another.

    Branch and bound over pieces of its edges: since the distance to one segment is convex, the distance on a
    piece is at most the larger of the distances of its ends to either end's nearest segment.
    """
    starts, steps = b.z[: b.edges.size], b.edges
    nearest = b._edge_grid.nearest
    vertex_edges = nearest(a.z)[0]
    start, end = a.z[: a.edges.size], np.roll(a.z, -1)[: a.edges.size]
    # the nearest edges of the other curve to both ends of each piece
    start_edge, end_edge = vertex_edges[: a.edges.size], np.roll(vertex_edges, -1)[: a.edges.size]
    attained = 0.0  # the largest distance of a point so far: a lower bound
    precision = max(ROUNDING_SHARE * b.diagonal, 4 * np.spacing(np.abs(a.z).max()))
    while start.size:
        start_to_start = segment_distances(start, starts[start_edge], steps[start_edge])
        end_to_start = segment_distances(end, starts[start_edge], steps[start_edge])
        start_to_end = segment_distances(start, starts[end_edge], steps[end_edge])
        end_to_end = segment_distances(end, starts[end_edge], steps[end_edge])
        attained = max(attained, float(start_to_start.max()), float(end_to_end.max()))
        upper = np.minimum(np.maximum(start_to_start, end_to_start), np.maximum(start_to_end, end_to_end))
        is_open = upper > attained * (1 + HAUSDORFF_ERROR_SHARE) + precision
        is_open &= np.abs(end - start) > precision
        middle = 0.5 * (start[is_open] + end[is_open])
        middle_edge = nearest(middle)[0]
        start, end = np.append(start[is_open], middle), np.append(middle, end[is_open])
        start_edge = np.append(start_edge[is_open], middle_edge)
        end_edge = np.append(middle_edge, end_edge[is_open])
    return attained


def closer_outline(outline: Complex, filled: Complex | None, goal: Curve) -> Complex:
    """Return the outline that is closer to the goal: a map's outline, or the one with concavities filled, if any."""
    if filled is None:
        return outline
    return min((outline, filled), key=lambda loop: hausdorff(Curve(loop), goal))


def resampled_knots(curve: Curve, count: int, corner: float = np.pi / 6) -> Real:
    """Return arclengths of about `count` vertices: the corners, and equal steps between neighbouring corners.

    Args:
        curve: the curve.
        count: approximate number of vertices.
        corner: angle in radians by which the curve bends at a corner.
    """
    turning_angles = np.abs(np.angle(curve.edges / np.roll(curve.edges, 1)))
    if not curve.closed:
        turning_angles[0] = np.pi
    keep = curve.knots[:-1][turning_angles > corner]
    if not keep.size:
        keep = curve.knots[:1]
    ends = np.append(keep[1:], keep[0] + curve.length) if curve.closed else np.append(keep[1:], curve.length)
    parts = np.maximum(1, np.round((ends - keep) * count / curve.length)).astype(int)
    spans = [a + (b - a) * np.arange(k) / k for a, b, k in zip(keep, ends, parts)]
    if not curve.closed:
        spans.append(ends[-1:])
    return np.concatenate(spans)


def _widest(hull: Complex) -> float:
    """Return the largest distance of two corners of a convex polygon (with the first one repeated) or segment.

    The two are antipodal: there are parallel lines through them with all other corners between (Shamos,
    *Computational Geometry*, 1978). One is an end of an edge, the other the corner where the edges turn to the
    opposite direction.
    """
    if hull.size < 4:
        return float(abs(hull[-1] - hull[0]))
    z = hull[:-1] if Curve(hull[:-1]).area > 0 else hull[:0:-1]
    directions = np.unwrap(np.angle(np.roll(z, -1) - z))
    opposite = np.searchsorted(
        directions, directions[0] + np.mod(directions - directions[0] + np.pi, 2 * np.pi)
    )
    across = z[(opposite[:, None] + [-1, 0, 1]) % z.size]  # and its neighbours, since angles are rounded
    return float(max(np.abs(across - end[:, None]).max() for end in (z, np.roll(z, -1))))


def _finite(z: ArrayLike, name: str) -> Complex:
    z = as_complex(z, name)
    bad = np.flatnonzero(~np.isfinite(z))
    if bad.size:
        raise InputError(f"{name}: vertex {bad[0]} is not a finite number")
    far = np.flatnonzero(np.maximum(np.abs(z.real), np.abs(z.imag)) > limits.COORDINATE)
    if far.size:
        raise InputError(
            f"{name}: vertex {far[0]} has a coordinate above {limits.COORDINATE:g}, too large to compute areas; "
            "scale the shape down"
        )
    return z
