"""Regions that a fill paints: from closed polylines to the outlines of painted regions."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from ...arrays import Complex, Index, complex_of, xy_of
from ...curve import polygon_of
from ...errors import InputError
from ...plane import cross, diagonal, distinct_each
from ...polygons import fill_holes, polygons_of, unite
from .. import limits
from . import crossings

# A self-crossing is harmless, and repaired, if the loops that it makes have at most this share of the area.
HARMLESS_AREA_SHARE = 1e-3
SEGMENTS_AT_ONCE, MOST_PAIRS = 1 << 16, 1 << 20
"""Pairs of points and segments tested for crossings at once, and pairs of points and rings whose boxes overlap: a few
MB of memory."""
FLAT_SHARE = 1e-13  # height of a ring whose points are collinear up to rounding, relative to its length
FLAT_AREA_SHARE = 1e-12
"""Relative to the squared diagonal of a ring's box: more than the area of any flat ring, which lies in a rectangle that
is twice as long and high as the largest distances from its first point."""
DRAWN_AREA_SHARE = 1 / 3
"""Of the enclosed area: a drawing that paints less is a line drawing, outlines around empty insides."""
BODY_AREA_SHARE = 1 / 2
"""Of the area of the convex hulls of a drawing's parts. If lines and what they enclose cover less, most lines are open,
as in a stick figure with a round head: filling the few closed ones would show a head without a body."""


class FaceBudget:
    """Limit on the faces into which outlines that cross cut the plane, for all shapes of a drawing together.

    Attributes:
        latest: the rings that were cut last, as bytes, with their faces and winding numbers: a ring is first tested for
            crossings, and then painted.
    """

    def __init__(self) -> None:
        self._left = limits.CUT_FACES
        self.latest: tuple[tuple[bytes, ...], np.ndarray, np.ndarray] | None = None

    def check(self) -> None:
        """Refuse further work once the limit is exceeded.

        Raises:
            TooMuch: it is.
        """
        if self._left < 0:
            raise crossings.TooMuch(
                "the lines of the drawing cross too often in all; unite its shapes, or remove the crossings (Inkscape: "
                "Path > Union)"
            )

    def spend(self, count: int) -> None:
        """Count faces."""
        self._left -= count


Refused = tuple[float, InputError]
Paint = Callable[[Sequence[Complex], str], list[shapely.Polygon]]


@dataclass(frozen=True, eq=False)
class FilledOutline:
    """One painted region, in the file's units and directions (x + iy as written).

    Attributes:
        name: what it comes from, for messages.
        z: (n,) vertices of its outer boundary, without a repeated end point.
        area: area enclosed by the outer boundary, holes included.
        holes: boundaries of its holes.
        notes: changes made to obtain it.
        names: ids and labels of its element and of all groups that contain it.
        element: number of the element or letter that it is a part of; None if unknown.
    """

    name: str
    z: Complex
    area: float
    holes: tuple[Complex, ...] = ()
    notes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    element: int | None = None


def outlines(
    rings: Iterable[Complex],
    rule: str,
    name: str,
    notes: tuple[str, ...] = (),
    *,
    keep_crossed: bool = True,
    paint: Paint | None = None,
    budget: FaceBudget | None = None,
) -> tuple[list[FilledOutline], list[Refused]]:
    """Return the regions painted by filling rings together by `rule` (nonzero or evenodd), the largest first.

    Rings are closed implicitly, and may overlap, nest and touch each other; the result is what the fill shows. If a
    ring crosses itself in loops of less than HARMLESS_AREA_SHARE of its area, these are cut off. If the loops are
    larger, it is painted as it is, with a note; or, without `keep_crossed`, it is refused, and the others are painted
    without it. `paint` replaces the function `painted`. `budget` is that of the drawing.

    Returns:
        The outlines; and for each refused ring the area at stake, and an error that says where and why.

    Raises:
        InputError: no ring encloses anything.
    """
    rings = [ring for ring in distinct_each(list(rings)) if ring.size]
    usable = [ring for ring in rings if ring.size > 2]
    if not usable:
        raise InputError(
            f"{name}: has {max((r.size for r in rings), default=0)} distinct points; at least 3 are needed"
        )
    budget = budget or FaceBudget()
    paint = paint or partial(painted, budget=budget)
    if len(usable) == 1 and (single := _simple(usable[0])):  # most shapes of a drawing
        paint(usable, rule)  # for the cache
        return [FilledOutline(name, usable[0], single.area, notes=notes)], []
    simple: list[Complex] = []
    refused: list[Refused] = []
    for ring, is_flat, polygon in zip(usable, _flat(usable), _polygons_of(usable)):
        if is_flat:
            continue
        lobes, twisted, place = _untangled(ring, polygon, budget)
        fault = f"{name}: the outline crosses itself {place}"
        if not place:
            simple.extend(lobes)
        elif keep_crossed:
            simple.extend(lobes)
            notes = (*notes, f"{fault}; the area that its fill paints is used")
        else:
            refused.append((twisted, InputError(f"{fault}; remove the crossing")))
    polygons = paint(simple, rule)
    painted_outlines = outlines_of(shapely.MultiPolygon(polygons), name, notes)
    if not painted_outlines and not refused:
        raise InputError(f"{name}: encloses no area")
    return painted_outlines, refused


def outlines_of(region: shapely.Geometry, name: str, notes: tuple[str, ...] = ()) -> list[FilledOutline]:
    """Return the outlines of the parts of a region, the largest first."""
    parts = [
        FilledOutline(
            name,
            _z(part.exterior),
            shapely.Polygon(part.exterior).area,
            tuple(map(_z, part.interiors)),
            notes,
        )
        for part in polygons_of(region)
    ]
    return sorted(parts, key=lambda o: -o.area)


def painted(rings: Sequence[Complex], rule: str, budget: FaceBudget | None = None) -> list[shapely.Polygon]:
    """Return the polygons painted by filling rings by `rule`; rings may cross. `budget` is that of the drawing."""
    if not rings:
        return []
    if len(rings) == 1 and (polygon := polygon_of(rings[0])).is_valid:  # most shapes of a drawing
        return [polygon] if polygon.area > 0 else []
    faces, winding = _faces(rings, budget or FaceBudget())
    inside = winding % 2 != 0 if rule == "evenodd" else winding != 0
    return list(polygons_of(unite(faces[inside])))


def with_lines_filled(ink: shapely.Geometry) -> shapely.Geometry:
    """Fill holes of an area if it covers so little of what it encloses that it is a line drawing."""
    filled = fill_holes(ink)
    return filled if ink.area < DRAWN_AREA_SHARE * filled.area and has_body(filled) else ink


def has_body(filled: shapely.Geometry) -> bool:
    """Return whether lines and what they enclose cover most of the convex hulls of their parts."""
    hulls = unite(list(shapely.convex_hull(shapely.get_parts(filled))))
    return bool(filled.area >= BODY_AREA_SHARE * hulls.area)


def _untangled(
    ring: Complex, polygon: shapely.Polygon, budget: FaceBudget
) -> tuple[list[Complex], float, str]:
    """Split a ring, given also as a polygon, into simple rings that paint the same.

    A crossing reverses the orientation of a part of the enclosed area, or encloses it twice. If that part is large, the
    ring is returned as it is, with the enclosed area and the position of a crossing.
    """
    if polygon.is_valid:
        return [ring], 0.0, ""
    faces, winding = _faces([ring], budget)
    area = shapely.area(faces)
    sign = 1 if area @ winding > 0 else -1
    once, twisted = winding == sign, (winding != sign) & (winding != 0)
    if area[twisted].sum() > HARMLESS_AREA_SHARE * area[once].sum():
        return [ring], float(area[winding != 0].sum()), _place(polygon)
    lobes = shapely.orient_polygons(polygons_of(unite(faces[once])), exterior_cw=sign < 0)
    return [_z(part) for lobe in lobes for part in (lobe.exterior, *lobe.interiors)], 0.0, ""


def _faces(rings: Sequence[Complex], budget: FaceBudget) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces into which rings cut the plane, and the winding number of the rings about each.

    Raises:
        InputError: the rings cross too often.
    """
    budget.check()
    key = tuple(ring.tobytes() for ring in rings)
    if budget.latest is not None and budget.latest[0] == key:
        _, faces, winding = budget.latest
        budget.spend(len(faces))
        return faces, winding
    crossings.check([np.append(ring, ring[:1]) for ring in rings])
    lines = _Lines(rings)
    closed = shapely.linearrings(xy_of(lines.begin), indices=np.repeat(np.arange(len(rings)), lines.sizes))
    faces = np.array(shapely.get_parts(shapely.polygonize([shapely.unary_union(closed)])))
    budget.spend(len(faces))
    points = shapely.point_on_surface(faces)
    winding = lines.windings(points, shapely.box(*shapely.bounds(closed).T))
    budget.latest = key, faces, winding
    return faces, winding


class _Lines:
    """The segments of closed rings in one array.

    Attributes:
        sizes: (r,) numbers of segments of the rings.
        begin, end: (n,) their end points, ring by ring.
    """

    def __init__(self, rings: Sequence[Complex]):
        self.sizes = np.array([ring.size for ring in rings])
        self.begin = np.concatenate(rings)
        self.end = np.concatenate([np.roll(ring, -1) for ring in rings])
        self._starts = np.cumsum(self.sizes) - self.sizes

    def windings(self, points: np.ndarray, boxes: np.ndarray) -> np.ndarray:
        """Return (p,) winding numbers of the rings, with the given bounding boxes, about points off them.

        Raises:
            InputError: too many points are in too many boxes.
        """
        total = np.zeros(len(points), dtype=int)
        z = complex_of(shapely.get_coordinates(points))
        tree, work = shapely.STRtree(points), 0
        step = max(1, MOST_PAIRS // max(1, len(points)))
        for first in range(0, len(boxes), step):
            ring, point = tree.query(boxes[first : first + step])
            ring += first
            work += int(self.sizes[ring].sum())
            if work > limits.WINDINGS:
                raise crossings.TooMuch(crossings.NESTED)
            parts = np.cumsum(self.sizes[ring]) // SEGMENTS_AT_ONCE
            for pairs in np.split(np.arange(ring.size), np.flatnonzero(np.diff(parts)) + 1):
                if pairs.size:
                    winding_numbers = self._winding(ring[pairs], z[point[pairs]])
                    total += np.bincount(point[pairs], winding_numbers, total.size).astype(int)
        return total

    def _winding(self, ring: Index, z: Complex) -> Index:
        """Return (k,) winding numbers of one ring about each point: signed crossings of the ray to the right."""
        sizes = self.sizes[ring]
        first = np.cumsum(sizes) - sizes
        segment = np.arange(first[-1] + sizes[-1]) + np.repeat(self._starts[ring] - first, sizes)
        a, b, points = self.begin[segment], self.end[segment], np.repeat(z, sizes)
        up = (a.imag <= points.imag) & (b.imag > points.imag)
        down = (a.imag > points.imag) & (b.imag <= points.imag)
        side = cross(b - a, points - a)
        crossed = (up & (side > 0)).astype(int) - (down & (side < 0))
        return np.add.reduceat(crossed, first)


def _simple(ring: Complex) -> shapely.Polygon | None:
    """Return a ring as a polygon; None if it crosses itself, or its points may be collinear up to rounding."""
    polygon = polygon_of(ring)
    return polygon if polygon.is_valid and polygon.area > FLAT_AREA_SHARE * diagonal(ring) ** 2 else None


def _polygons_of(rings: Sequence[Complex]) -> np.ndarray:
    """Return rings of three points or more as polygons, all at once: text has thousands of small ones."""
    owner = np.repeat(np.arange(len(rings)), [ring.size for ring in rings])
    return shapely.polygons(shapely.linearrings(xy_of(np.concatenate(rings)), indices=owner))


def _flat(rings: Sequence[Complex]) -> np.ndarray:
    """Return whether all points of each ring are collinear up to rounding."""
    sizes = np.array([ring.size for ring in rings])
    starts = np.cumsum(sizes) - sizes
    z = np.concatenate(rings)
    w = z - np.repeat(z[starts], sizes)
    away = np.abs(w)
    farthest = np.flatnonzero(away == np.repeat(np.maximum.reduceat(away, starts), sizes))
    farthest_points = w[farthest[np.searchsorted(farthest, starts)]]
    off = np.maximum.reduceat(np.abs(cross(np.repeat(farthest_points, sizes), w)), starts)
    return off <= FLAT_SHARE * np.abs(farthest_points) ** 2


def _place(polygon: shapely.Polygon) -> str:
    """Return the position, in the file's coordinates, at which a polygon is invalid."""
    reason = shapely.is_valid_reason(polygon)
    return (
        f"at ({', '.join(reason.split('[')[1].rstrip(']').split()[:2])})" if "[" in reason else f"({reason})"
    )


def rings_of(area: shapely.Geometry) -> list[Complex]:
    """Return the closed boundaries of all polygons of an area; the last point of each repeats the first."""
    rings = [ring for part in polygons_of(area) for ring in (part.exterior, *part.interiors)]
    return [complex_of(shapely.get_coordinates(ring)) for ring in rings]


def _z(ring: shapely.LinearRing) -> Complex:
    return complex_of(shapely.get_coordinates(ring)[:-1])
