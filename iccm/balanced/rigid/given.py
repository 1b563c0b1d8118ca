"""Prepare rigid regions for a mesh: join regions that meet, keep them away from the outlines, and simplify them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Complex, Flags, Index, complex_of, distinct, xy_of
from ...curve import Curve
from ...errors import InputError
from ...plane import Similarity
from ..constraints.validate import NO_PINS
from ..model.boundary_mesh import region_at

# Lengths relative to the root of the area; an edge of the final mesh has length 0.02.
OUTLINE_MARGIN = 0.01  # distance of regions from the outlines, which slide
REGION_DETAIL = 3e-3  # tolerance of the regions' outlines, and half the gap across which they are joined
LEAST_REGION_AREA = 1e-5  # area of a region
# Relative to the regions' area: if more is too close to an outline, a note reports it.
LOST_AREA_SHARE = 0.02
SIMILARITY_ERROR_SHARE = 0.01  # relative to a region's size: largest deviation of its pins from a similarity
MOST_REGIONS = 200  # most regions: drawings have fewer, noisy masks more


Rings = tuple[Complex, ...]


@dataclass(frozen=True, eq=False)
class RigidRegions:
    """Regions disjoint from each other and from the outlines.

    Attributes:
        polygons: for each region, the outer ring, counter-clockwise, and those of holes in it, clockwise.
        notes: messages about changes to the given regions.
    """

    polygons: tuple[Rings, ...]
    notes: tuple[str, ...] = ()


NO_REGIONS = RigidRegions(())


def regions_of(
    vertices: Sequence[Complex],
    source: Curve,
    holes: Sequence[Curve] = (),
    pins: Complex = NO_PINS,
    strokes: Sequence[tuple[Curve, Curve]] = (),
) -> RigidRegions:
    """Return the regions of a domain with holes.

    Args:
        vertices: (p,) vertices of simple polygons.
        source: the outline.
        holes: outlines of holes.
        pins: (k, 2) points of the source and their places; a region is extended around pins close to its
            outline.
        strokes: polylines of the source and their images.

    Raises:
        InputError: a region is outside the domain or too thin, there are too many, or a stroke runs through
            one.
    """
    domain = shapely.Polygon(xy_of(source.z), [xy_of(hole.z) for hole in holes])
    unit = np.sqrt(domain.area)
    room, detail = domain.buffer(-OUTLINE_MARGIN * unit), REGION_DETAIL * unit
    shapes = [shapely.Polygon(xy_of(z)) for z in vertices]
    for k, shape in enumerate(shapes):
        if not shape.intersects(domain):
            raise InputError(f"rigid region {k + 1}: lies outside the source shape; draw it inside")
    whole = shapely.union_all(shapes)
    for k, pair in enumerate(strokes):
        if whole.intersects(shapely.LineString(xy_of(pair[0].z))):
            raise InputError(
                f"stroke {k + 1}: runs through a rigid region; end it outside the region, or pin the region instead"
            )
    near_pins = shapely.points(pins[:, 0].real, pins[:, 0].imag)
    near_pins = near_pins[whole.dwithin(near_pins, detail)] if near_pins.size else near_pins
    joined = shapely.union_all([whole, *shapely.buffer(near_pins, 3 * detail)])
    joined = joined.buffer(detail, join_style="mitre").buffer(-detail, join_style="mitre").simplify(detail)
    parts = [_without_small_holes(part, holes) for part in _parts(joined)]
    region_parts = [
        part
        for part in _parts(shapely.union_all(parts).intersection(room))
        if part.area > LEAST_REGION_AREA * unit**2
    ]
    if not region_parts:
        raise InputError(
            "rigid: no part of the region lies inside the source shape and is large enough; "
            "draw it larger, inside the shape"
        )
    if len(region_parts) > MOST_REGIONS:
        raise InputError(
            f"rigid: {len(region_parts)} regions are given, at most {MOST_REGIONS} are possible; remove some"
        )
    notes = []
    inside = whole.intersection(domain).area
    share = shapely.union_all(region_parts).intersection(whole).area / inside
    if 1 - share > LOST_AREA_SHARE:
        notes.append(
            "A rigid region touches the outline, which slides: the region is rigid only beyond 1 % of "
            f"the shape's size from the outline, on {share:.0%} of its area."
        )
    ordered = [shapely.geometry.polygon.orient(part) for part in region_parts]
    rings = [(part.exterior, *part.interiors) for part in ordered]
    polygons = tuple(tuple(complex_of(shapely.get_coordinates(r)[:-1]) for r in region) for region in rings)
    return RigidRegions(polygons, tuple(notes))


def aims_of(regions: RigidRegions, pins: Complex, size: float) -> tuple[Complex, Flags, Complex]:
    """Return the same as `aims_by`, for polygons and pins (p, 2) inside, in unit coordinates."""
    return aims_by(len(regions.polygons), region_at(pins[:, 0], regions.polygons), pins, size)


def aims_by(count: int, region_of_pin: Index, pins: Complex, size: float) -> tuple[Complex, Flags, Complex]:
    """Return the derivatives that rigid regions should have, as far as pins determine them.

    Args:
        count: number of regions.
        region_of_pin: (p,) the region that contains each pin, -1 for none.
        pins: (p, 2) pins and their goals, in unit coordinates.
        size: scale of regions for which pins do not determine it.

    Returns:
        (k,) derivatives, (k,) whether pins determine them, and (k, 2) the centroids of their pins and of these
        pins' goals, NaN if there are no pins.

    Raises:
        InputError: no similarity maps the pins in a region.
    """
    aims, is_prescribed = np.full(count, size, complex), np.zeros(count, bool)
    centroids = np.full((count, 2), np.nan + 0j)
    for k in distinct(region_of_pin[region_of_pin >= 0]):
        sources, goals = pins[region_of_pin == k].T
        centroids[k] = sources.mean(), goals.mean()
        if sources.size < 2:
            continue
        similarity = Similarity.fit(sources, goals)
        error = np.abs(similarity(sources) - goals).max() / (
            abs(similarity.factor) * np.abs(sources - sources.mean()).max()
        )
        if error > SIMILARITY_ERROR_SHARE:
            raise InputError(
                f"rigid region {k + 1}: no similarity moves its {sources.size} pins to their targets; keep "
                "at most two of them"
            )
        aims[k], is_prescribed[k] = similarity.factor, True
    return aims, is_prescribed, centroids


def _parts(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    """Return the polygons of a geometry, sorted from the top left."""
    parts = [
        part for part in shapely.get_parts(geometry) if part.geom_type == "Polygon" and not part.is_empty
    ]
    return sorted(parts, key=lambda part: (-part.bounds[3], part.bounds[0]))


def _without_small_holes(part: shapely.Polygon, holes: Sequence[Curve]) -> shapely.Polygon:
    """Return a region without its holes, which then move with it, except those that contain a hole of the domain."""
    kept_holes = [
        ring for ring in part.interiors if any(shapely.Polygon(ring).contains(_inner(hole)) for hole in holes)
    ]
    return shapely.Polygon(part.exterior, kept_holes)


def _inner(hole: Curve) -> shapely.Point:
    return shapely.Polygon(xy_of(hole.z)).representative_point()
