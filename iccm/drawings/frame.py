"""Frames: simply connected regions that contain a drawing, with the gaps between its parts closed.

A drawing may have any number of parts, each with any number of holes. Maps of disks have the fewest singular points, so
a drawing is mapped by way of a disk around it. A frame is the outer boundary of a morphological closing of the drawing
(Serra 1982: dilation, then erosion by the same disk). The larger the closing radius, the more of the gaps between and
around the parts belongs to the frame; the last degree is the convex hull.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from ..arrays import Complex, complex_of
from ..curve import Curve
from ..errors import InputError
from ..polygons import (
    Polygons,
    fill_holes,
    neighbourhoods,
    offset,
    offset_each,
    polygons_of,
    simplify_each,
    unite,
)

FIRST_RADIUS_SHARE = 0.005
"""Smallest closing radius that is tried, relative to the drawing's size (the square root of its hull's area): about two
pixels of 512; anything narrower is not perceived as a gap."""
RADIUS_STEP_RATIO = 1.25
"""Ratio of successive closing radii that are tried, until one joins all parts. The width of the neck between two parts
is the excess of the radius over half their distance, so the ratio also bounds how thin a neck can be."""
WIDER_RADII = (1.0, 2.5)
"""Closing radii of the frames between the outline and the hull, relative to the smallest that joins all parts."""
MANY_PARTS = 1000
"""Number of parts from which only the first of these frames is computed: each takes half a second for a thousand
letters (measured), and between so many parts wider closings hardly differ."""
LARGEST_RADIUS_SHARE = 2.0
"""Relative to the drawing's size: for larger radii the convex hull is used."""
SINGLE_PART_RADIUS_SHARE = 0.05
"""First closing radius of a drawing of one part, which needs no joining, relative to its size."""
MAIN_PART_SHARE = 0.9
"""Of the painted area: a part with at least this share may represent the drawing, which then loses the rest."""
DETAIL_SHARE = 1e-3
"""Tolerance of closings, relative to the drawing's size. The painted outline itself is kept exactly."""
HAIRLINE_WIDTH_SHARE = 1e-3
"""Relative to the drawing's size: half a pixel of 512. Narrower gaps are filled."""
HAIRLINE_LENGTH_SHARE = 0.02
"""Relative to the drawing's size, both sides together: shorter hairlines are left as they are."""
MITRE_LIMIT = 20.0
"""Relative to the offset: blunts corners sharper than six degrees."""
SLIVER_WIDTH_SHARE = 1e-6
"""Relative to the drawing's size: narrower gaps come from rounding."""
ARC_SEGMENTS = 6
"""Segments per quarter circle in closings: their corners deviate by at most radius · (1 - cos(π/24))."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A simply connected region around a drawing, or around the main part of it.

    Attributes:
        outline: the boundary, counter-clockwise.
        radius: closing radius relative to the drawing's size; 0 for the outline of a part itself, infinite for the
            convex hull and for any other region, such as a box.
        left_out: share of the painted area that lies outside.
    """

    outline: Curve
    radius: float
    left_out: float = 0.0


def frames_of(painted: shapely.Geometry) -> list[Frame]:
    """Return the frames of a drawing, from the tightest to the convex hull.

    The first is the outline itself if one part has (nearly) all of the area; the next is the smallest closing that
    joins all parts; then come wider closings. Frames that differ from the one before only by rounding are dropped.

    Parameters
    ----------
    painted
        The painted region: a valid Polygon or MultiPolygon with an area.

    Raises
    ------
    InputError
        Nothing is painted.
    """
    parts = polygons_of(painted)
    if not len(parts):
        raise InputError("the drawing paints nothing")
    total = float(shapely.area(parts).sum())
    size = float(np.sqrt(shapely.convex_hull(painted).area))
    frames: list[Frame] = []
    main = parts[shapely.area(parts).argmax()]
    if main.area >= MAIN_PART_SHARE * total:
        frames.append(Frame(_outline(main), 0.0, 1 - main.area / total))
    filled = fill_holes(painted)  # frames have no holes
    simple = simplify_each(filled, DETAIL_SHARE * size)
    radius, joined = SINGLE_PART_RADIUS_SHARE * size, None
    if len(parts) > 1:
        radius, joined = _joining_radius(simple, size)
    for times in WIDER_RADII if len(parts) < MANY_PARTS else WIDER_RADII[:1]:
        closing = joined if joined is not None and times == 1 else _closing(simple, times * radius)
        closed = close_gaps(filled, closing, size)
        if closed is not None:
            frames.append(Frame(_outline(closed), times * radius / size))
    frames.append(Frame(_outline(shapely.convex_hull(painted)), np.inf))
    return _distinct(frames)


def close_gaps(painted: shapely.Geometry, closed: shapely.Geometry, size: float) -> shapely.Polygon | None:
    """Return the closing of a region by a disk with holes filled; None where it has several parts.

    Parameters
    ----------
    painted
        The region.
    closed
        The closing of a simplified copy, which shows where the gaps are.
    size
        The drawing's size, in the region's units.
    """
    # The boundary of `closed` is rounded and simplified. It is used only to find the gaps: the frame is the union of
    # the exact drawing and these gaps, without slivers along the drawing's edges.
    gaps = _without_slivers(shapely.difference(closed, painted), size)
    # one overlay of two valid regions, not a tree of the unions of thousands of parts
    joined = shapely.union(painted, gaps)
    if joined.geom_type != "Polygon":
        return None
    return shapely.Polygon(joined.exterior)


def close_hairlines(painted: shapely.Geometry) -> shapely.Geometry:
    """Return a region with its hairline gaps filled, such as those between parts of a drawing that share an edge.

    They are invisible, but a map would have to follow both of their sides. A region without any is returned as it is.
    """
    size = float(np.sqrt(shapely.convex_hull(painted).area))
    width = HAIRLINE_WIDTH_SHARE * size
    mitred = {
        "join_style": "mitre",
        "mitre_limit": MITRE_LIMIT,
    }  # corners are restored when the offset is undone
    regions, shares = zip(*neighbourhoods(painted, 2 * width))
    nearby = np.array(regions, dtype=object)
    filled = offset_each(offset_each(nearby, 0.5 * width, **mitred), -0.5 * width, **mitred)
    # Gaps may be so narrow that they have no area, but each has a boundary on both sides.
    less = shapely.length(nearby) - shapely.length(filled)
    closed = filled[less > 0]
    invalid = ~shapely.is_valid(closed)  # GEOS's offsets may leave holes that touch their outline
    closed[invalid] = shapely.make_valid(closed[invalid])
    if (np.array(shares) * np.maximum(less, 0)).sum() < HAIRLINE_LENGTH_SHARE * size:
        return painted
    return shapely.make_valid(simplify_each(unite([painted, *closed]), SLIVER_WIDTH_SHARE * size))


def _without_slivers(gaps: shapely.Geometry, size: float) -> shapely.Geometry:
    """Drop slivers that come from rounding, and widen gaps a little so that they overlap their surroundings."""
    width = SLIVER_WIDTH_SHARE * size
    return offset(offset(gaps, -width, join_style="mitre"), 2 * width, join_style="mitre")


def _closing(region: shapely.Geometry, radius: float) -> shapely.Geometry:
    """Return a region dilated, then eroded by a disk."""
    return offset(offset(region, radius, quad_segs=ARC_SEGMENTS), -radius, quad_segs=ARC_SEGMENTS)


def _joining_radius(simple: shapely.Geometry, size: float) -> tuple[float, shapely.Geometry | None]:
    """Return the smallest tried radius whose closing joins all parts, and that closing; None if no radius does."""
    parts = polygons_of(simple)
    tree = shapely.STRtree(parts)
    radius = FIRST_RADIUS_SHARE * size
    while radius < LARGEST_RADIUS_SHARE * size:
        closed = _joined(simple, radius) if _form_one_group(parts, tree, 2 * radius) else None
        if closed is not None:
            return radius, closed
        radius *= RADIUS_STEP_RATIO
    return radius, None


def _form_one_group(parts: Polygons, tree: shapely.STRtree, distance: float) -> bool:
    """Return whether parts form one group if those within `distance` of each other are linked.

    Parts that disks of half the distance do not join are not joined by the closing either. This test takes a hundredth
    of the time of a closing.
    """
    i, j = tree.query(parts, predicate="dwithin", distance=distance)
    reached = np.arange(len(parts)) == 0
    count = 0
    while count < reached.sum():
        count = int(reached.sum())
        reached[j[reached[i]]] = True
    return bool(reached.all())


def _joined(region: shapely.Geometry, radius: float) -> shapely.Geometry | None:
    """Return the closing of a region by a disk if it has a single part, else None."""
    grown = offset(region, radius, quad_segs=ARC_SEGMENTS)  # parts that are separate now stay separate
    if grown.geom_type != "Polygon":
        return None
    closed = offset(grown, -radius, quad_segs=ARC_SEGMENTS)
    return closed if closed.geom_type == "Polygon" else None


def _outline(part: shapely.Polygon) -> Curve:
    """Return the outer boundary of a part as a curve."""
    z: Complex = complex_of(shapely.get_coordinates(part.exterior)[:-1])
    return Curve.domain(z)


def _distinct(frames: list[Frame]) -> list[Frame]:
    """Drop frames that enclose the same as the frame before."""
    distinct: list[Frame] = []
    for frame in frames:
        is_same = distinct and distinct[-1].left_out == frame.left_out
        if (
            is_same
            and abs(frame.outline.area - distinct[-1].outline.area) <= DETAIL_SHARE * frame.outline.area
        ):
            continue
        distinct.append(frame)
    return distinct
