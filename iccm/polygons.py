"""Regions of many polygons: unions, filled holes and offsets, in time nearly proportional to the number of parts.

GEOS unites in a tree of pairs, and orders the parts of an offset by comparing all pairs, which takes minutes
for text of 5,000 letters. Parts that do not reach each other are therefore processed separately.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from . import deadline
from .arrays import Complex, complex_of

Polygons = NDArray[np.object_]
REGION = "the region that a drawing paints"
REGIONS_AT_ONCE = 512
"""Regions that are processed between two checks of the time limit; they take a tenth of a second for letters
(measured).
"""
SMALL_REGION_PARTS = 8
"""Number of parts up to which GEOS offsets a region faster as a whole than part by part (measured with letters)."""


def polygons_of(geometries: shapely.Geometry | Iterable[shapely.Geometry]) -> Polygons:
    """Return the polygons with nonzero area in one or several geometries, as an array."""
    parts = shapely.get_parts(shapely.get_parts(geometries))  # collections hold multipolygons
    return parts[(shapely.get_type_id(parts) == shapely.GeometryType.POLYGON) & (shapely.area(parts) > 0)]


def unite(geometries: shapely.Geometry | Iterable[shapely.Geometry]) -> shapely.Geometry:
    """Return the union of the polygons of one or several geometries.

    The result is a Polygon, which is empty if there are none, or a MultiPolygon.

    Raises:
        TimeUp: The time limit is exceeded.
    """
    deadline.check(REGION)
    regions = np.atleast_1d(
        np.asarray(geometries if isinstance(geometries, shapely.Geometry) else list(geometries))
    )
    regions = regions[~shapely.is_empty(regions)]
    parts = polygons_of(regions)
    apart = len(regions) == 1 and regions[0].geom_type == "MultiPolygon" and regions[0].is_valid
    if len(parts) < 2 or apart:  # the parts of a valid MultiPolygon do not overlap
        return _region(parts)
    return _region(polygons_of(shapely.disjoint_subset_union_all(parts)))


def fill_holes(region: shapely.Geometry) -> shapely.Geometry:
    """Return a region with the holes of all parts filled."""
    return unite(shapely.polygons(shapely.get_exterior_ring(polygons_of(region))))


def offset(region: shapely.Geometry, distance: float, **style: Any) -> shapely.Geometry:
    """Return a region grown by a distance, or shrunk by a negative one; `style` is passed to `shapely.buffer`.

    Raises:
        TimeUp: The time limit is exceeded.
    """
    deadline.check(REGION)
    buffered = shapely.buffer(polygons_of(region), distance, **style)
    # shrunk parts remain disjoint
    return unite(buffered) if distance > 0 else _region(polygons_of(buffered))


def offset_each(regions: Polygons, distance: float, **style: Any) -> Polygons:
    """Grow or shrink each of several regions by a distance, like `offset`; fast for many small regions.

    Raises:
        TimeUp: The time limit is exceeded.
    """
    results = np.empty(len(regions), dtype=object)
    for start in range(0, len(regions), REGIONS_AT_ONCE):
        deadline.check(REGION)
        part = slice(start, start + REGIONS_AT_ONCE)
        small = shapely.get_num_geometries(regions[part]) <= SMALL_REGION_PARTS
        results[part][small] = shapely.buffer(regions[part][small], distance, **style)
        results[part][~small] = [offset(region, distance, **style) for region in regions[part][~small]]
    return results


def simplify_each(region: shapely.Geometry, tolerance: float) -> shapely.Geometry:
    """Simplify a region part by part: GEOS compares every line of a region with all nearby parts.

    Raises:
        TimeUp: The time limit is exceeded.
    """
    return unite(shapely.multipolygons(shapely.simplify(polygons_of(region), tolerance)))


def neighbourhoods(region: shapely.Geometry, distance: float) -> Iterator[tuple[shapely.Geometry, float]]:
    """Yield each part of a region together with nearby pieces of other parts, and its share in that.

    Properties that depend only on points within `distance`, such as closings by a disc of less than a third of
    it, can be computed for these one by one. The share is 1 if there are no nearby pieces, else 0.5.

    Args:
        region: Polygons that do not overlap.
        distance: Distance from a part within which others are near; their pieces in a box around the part are
            included.

    Raises:
        TimeUp: The time limit is exceeded.
    """
    parts = polygons_of(region)
    if len(parts) < 2:
        yield from ((part, 1.0) for part in parts)
        return
    tree = shapely.STRtree(parts)
    for start in range(0, len(parts), REGIONS_AT_ONCE):
        deadline.check(REGION)
        some = parts[start : start + REGIONS_AT_ONCE]
        pairs = tree.query(some, predicate="dwithin", distance=distance)
        yield from _with_others(parts, start, len(some), pairs, distance)


def _with_others(
    parts: Polygons, start: int, count: int, pairs: NDArray[np.intp], distance: float
) -> Iterator[tuple[shapely.Geometry, float]]:
    """Yield the result of `neighbourhoods` for `count` parts, given (2, p) pairs of these and of all near parts."""
    order = np.argsort(pairs[0], kind="stable")
    ends = np.cumsum(np.bincount(pairs[0], minlength=count))
    boxes = shapely.bounds(parts[start : start + count]) + distance * np.array([-1, -1, 1, 1])
    for k, neighbours in enumerate(np.split(pairs[1][order], ends[:-1]), start):
        part = parts[k]
        neighbours = neighbours[neighbours != k]
        if not neighbours.size:
            yield part, 1.0
            continue
        nearby = polygons_of(shapely.clip_by_rect(parts[neighbours], *boxes[k - start].tolist()))
        yield _region(np.array([part, *nearby], dtype=object)), 0.5 if len(nearby) else 1.0


def _region(parts: Polygons) -> shapely.Geometry:
    """Return disjoint polygons as one geometry."""
    if len(parts) < 2:
        return parts[0] if len(parts) else shapely.Polygon()
    return shapely.multipolygons(parts)


def rings_of(region: shapely.Geometry) -> list[Complex]:
    """Return the rings of a region, those of parts counter-clockwise, those of holes clockwise."""
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon" and not part.is_empty]
    oriented = shapely.orient_polygons(np.array(parts, dtype=object))
    rings = [ring for part in oriented for ring in (part.exterior, *part.interiors)]
    return [complex_of(shapely.get_coordinates(ring)[:-1]) for ring in rings]
