"""Rigid regions as given, made fit for a mesh: joined where they meet, kept off the outlines, simplified."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Complex, Flags, Index, complex_of, xy_of
from ...curve import Curve
from ...errors import InputError
from ...plane import Similarity
from ..constraints.validate import NO_PINS, Pins

# Of the root of the area, of which an edge of the last mesh is 0.02 long.
OUTLINE_MARGIN = 0.01  # how far regions keep off the outlines, which slide
REGION_DETAIL = (
    3e-3  # how far their own outlines may be off those given, and half the gap over which they join
)
LEAST_REGION_AREA = 1e-5  # area of a region
LOST_AREA_SHARE = 0.02  # of a region's area: less that is too close to an outline is not worth a word
SIMILARITY_ERROR_SHARE = 0.01  # of a region's scale: how far pins in it may be off a similarity
MOST_REGIONS = 200  # regions: what is drawn by hand has fewer, noise in a mask more


Rings = tuple[Complex, ...]


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions apart from each other and from the outlines.

    Attributes:
        polygons: of each the outer ring, counter-clockwise, and those of holes in it, clockwise.
        notes: sentences on what became of those given.
    """

    polygons: tuple[Rings, ...]
    notes: tuple[str, ...] = ()

    def holding(self, z: Complex) -> np.ndarray:
        """Return (p,) the region that each point is in; -1 for none."""
        found = np.full(z.size, -1)
        for k, rings in enumerate(self.polygons):
            found[shapely.contains_xy(_polygon(rings), z.real, z.imag)] = k
        return found


NO_REGIONS = Regions(())


def regions_of(
    given: Sequence[Complex],
    source: Curve,
    holes: Sequence[Curve] = (),
    pins: Complex = NO_PINS,
    strokes: Sequence[tuple[Curve, Curve]] = (),
) -> Regions:
    """Return the regions of a domain with holes.

    Args:
        given: (p,) vertices of simple polygons.
        source: the outline.
        holes: those of holes.
        pins: (k, 2) points of the source and where they go; one beside a region's outline is taken into it.
        strokes: as above.

    Raises:
        InputError: one is outside the domain, or too thin; too many; a stroke through one.
    """
    domain = shapely.Polygon(xy_of(source.z), [xy_of(hole.z) for hole in holes])
    unit = np.sqrt(domain.area)
    room, detail = domain.buffer(-OUTLINE_MARGIN * unit), REGION_DETAIL * unit
    shapes = [shapely.Polygon(xy_of(z)) for z in given]
    for k, shape in enumerate(shapes):
        if not shape.intersects(domain):
            raise InputError(f"rigid region {k + 1}: lies outside the source shape; draw it inside")
    whole = shapely.union_all(shapes)
    for k, pair in enumerate(strokes):
        if whole.intersects(shapely.LineString(xy_of(pair[0].z))):
            raise InputError(
                f"stroke {k + 1}: runs through a rigid region; end it outside the region, or pin the region instead"
            )
    near = shapely.points(pins[:, 0].real, pins[:, 0].imag)
    near = near[whole.dwithin(near, detail)] if near.size else near
    joined = shapely.union_all([whole, *shapely.buffer(near, 3 * detail)])
    joined = joined.buffer(detail, join_style="mitre").buffer(-detail, join_style="mitre").simplify(detail)
    parts = [_without_small_holes(part, holes) for part in _parts(joined)]
    kept = [
        part
        for part in _parts(shapely.union_all(parts).intersection(room))
        if part.area > LEAST_REGION_AREA * unit**2
    ]
    if not kept:
        raise InputError(
            "rigid: no part of the region lies inside the source shape and is large enough; "
            "draw it larger, inside the shape"
        )
    if len(kept) > MOST_REGIONS:
        raise InputError(
            f"rigid: {len(kept)} regions are given, at most {MOST_REGIONS} are possible; remove some"
        )
    notes = []
    inside = whole.intersection(domain).area
    share = shapely.union_all(kept).intersection(whole).area / inside
    if 1 - share > LOST_AREA_SHARE:
        notes.append(
            "A rigid region touches the outline, which slides: the region is rigid only beyond 1 % of "
            f"the shape's size from the outline, on {share:.0%} of its area."
        )
    ordered = [shapely.geometry.polygon.orient(part) for part in kept]
    rings = [(part.exterior, *part.interiors) for part in ordered]
    polygons = tuple(tuple(complex_of(shapely.get_coordinates(r)[:-1]) for r in each) for each in rings)
    return Regions(polygons, tuple(notes))


def aims_of(regions: Regions, pins: Pins, size: float) -> tuple[Complex, Flags, Complex]:
    """Return as `aims_by`, of polygons and pins in unit coordinates."""
    return aims_by(len(regions.polygons), regions.holding(pins.inner[:, 0]), pins.inner, size)


def aims_by(count: int, own: Index, pins: Complex, size: float) -> tuple[Complex, Flags, Complex]:
    """Return (k,) derivatives that regions are to have, and which ones their pins say; (k, 2) the middles of their pins
    and where these are to be, NaN where there are none; in unit coordinates.

    Args:
        count: how many regions there are.
        own: (p,) the region that each pin is in, -1 for none.
        pins: (p, 2) pins and where they are to be.
        size: what regions have unless pins say it.

    Raises:
        InputError: the pins in a region are moved by no similarity.
    """
    aims, said, held = np.full(count, size, complex), np.zeros(count, bool), np.full((count, 2), np.nan + 0j)
    for k in np.unique(own[own >= 0]):
        here, there = pins[own == k].T
        held[k] = here.mean(), there.mean()
        if here.size < 2:
            continue
        found = Similarity.fit(here, there)
        off = np.abs(found(here) - there).max() / (abs(found.factor) * np.abs(here - here.mean()).max())
        if off > SIMILARITY_ERROR_SHARE:
            raise InputError(
                f"rigid region {k + 1}: no similarity moves its {here.size} pins to their targets; keep "
                "at most two of them"
            )
        aims[k], said[k] = found.factor, True
    return aims, said, held


def _polygon(rings: Rings) -> shapely.Polygon:
    return shapely.Polygon(xy_of(rings[0]), [xy_of(hole) for hole in rings[1:]])


def _parts(found: shapely.Geometry) -> list[shapely.Polygon]:
    """Return the polygons of a geometry, from the top left on."""
    parts = [part for part in shapely.get_parts(found) if part.geom_type == "Polygon" and not part.is_empty]
    return sorted(parts, key=lambda part: (-part.bounds[3], part.bounds[0]))


def _without_small_holes(part: shapely.Polygon, holes: Sequence[Curve]) -> shapely.Polygon:
    """Return a region without its holes, which move with it, but for those that hold a hole of the domain."""
    kept = [
        ring for ring in part.interiors if any(shapely.Polygon(ring).contains(_inner(hole)) for hole in holes)
    ]
    return shapely.Polygon(part.exterior, kept)


def _inner(hole: Curve) -> shapely.Point:
    return shapely.Polygon(xy_of(hole.z)).representative_point()
