"""What a fill shows: from closed runs of points to the outlines of the regions that are painted."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..cauchy import Complex
from ..errors import InputError

# A crossing is harmless, and repaired, when the loops it makes have at most this part of the area.
HARMLESS = 1e-3


@dataclass(frozen=True, eq=False)
class Outline:
    """One painted region, in the file's units and directions (x + iy as written).

    Attributes:
        name: what it comes from, for messages.
        z: (n,) vertices of its outer boundary, not repeated at the end.
        area: area enclosed by the outer boundary, holes included.
        holes: number of holes.
    """

    name: str
    z: Complex
    area: float
    holes: int


def outlines(rings: Sequence[Complex], rule: str, name: str) -> list[Outline]:
    """The regions that filling the rings together by `rule` (nonzero or evenodd) paints; rings are closed implicitly.

    Rings may overlap, nest and touch each other: what counts is what the fill shows. A single ring must not cross
    itself, except where that makes loops of less than HARMLESS of its area.

    Raises:
        InputError: no ring encloses anything, or one crosses itself; the message says where.
    """
    rings = [ring for ring in (distinct(r) for r in rings) if ring.size]
    whole = [ring for ring in rings if ring.size > 2]
    if not whole:
        raise InputError(
            f"{name}: {max((r.size for r in rings), default=0)} distinct points; at least 3 are needed"
        )
    whole = [ring for ring in whole if not _flat(ring)]
    if not whole:
        raise InputError(f"{name}: encloses no area")
    whole = [part for ring in whole for part in _untangled(ring, name)]
    polygons = [shapely.Polygon(_xy(ring)) for ring in whole] if len(whole) == 1 else painted(whole, rule)
    found = [_outline(polygon, name) for polygon in polygons]
    if not found:
        raise InputError(f"{name}: encloses no area")
    return sorted(found, key=lambda o: -o.area)


def distinct(z: Complex) -> Complex:
    """A ring without repeated neighbours (to 1e-12 of its size)."""
    if z.size < 2:
        return z
    tiny = 1e-12 * max(np.ptp(z.real), np.ptp(z.imag))
    keep = np.abs(z - np.roll(z, 1)) > tiny
    return z[keep] if keep.any() else z[:1]


def painted(rings: Sequence[Complex], rule: str) -> list[shapely.Polygon]:
    """The polygons that filling the rings by `rule` paints, whatever crosses what."""
    faces, winding = _faces(rings)
    inside = winding % 2 != 0 if rule == "evenodd" else winding != 0
    return _polygons(shapely.union_all(faces[inside]))


def _untangled(ring: Complex, name: str) -> list[Complex]:
    """Simple rings that paint the same: the ring itself, or its lobes where it touches itself or all but does.

    A crossing turns part of what is enclosed the other way round, or encloses it twice.
    """
    polygon = shapely.Polygon(_xy(ring))
    if polygon.is_valid:
        return [ring]
    faces, winding = _faces([ring])
    area = shapely.area(faces)
    sign = 1 if area @ winding > 0 else -1
    once, twisted = winding == sign, (winding != sign) & (winding != 0)
    if area[twisted].sum() > HARMLESS * area[once].sum():
        raise InputError(f"{name}: the outline crosses itself {_place(polygon)}; remove the crossing")
    lobes = shapely.orient_polygons(_polygons(shapely.union_all(faces[once])), exterior_cw=sign < 0)
    return [_z(part) for lobe in lobes for part in (lobe.exterior, *lobe.interiors)]


def _faces(rings: Sequence[Complex]) -> tuple[np.ndarray, np.ndarray]:
    """The faces that the rings cut the plane into, and how often the rings wind around each."""
    closed = [shapely.LinearRing(_xy(ring)) for ring in rings]
    faces = np.array(shapely.get_parts(shapely.polygonize([shapely.unary_union(closed)])))
    points = shapely.get_coordinates(shapely.point_on_surface(faces))
    return faces, np.array([sum(_windings(rings, x, y)) for x, y in points], dtype=int)


def _windings(rings: Sequence[Complex], x: float, y: float) -> Iterator[int]:
    """How often each ring winds around a point that is on none of them: signed crossings of the ray to the right."""
    for ring in rings:
        a, b = ring, np.roll(ring, -1)
        if not (a.real.min() <= x <= a.real.max() and a.imag.min() <= y <= a.imag.max()):
            continue
        up, down = (a.imag <= y) & (b.imag > y), (a.imag > y) & (b.imag <= y)
        side = ((b - a).conj() * (complex(x, y) - a)).imag
        yield int(np.count_nonzero(up & (side > 0))) - int(np.count_nonzero(down & (side < 0)))


def _outline(polygon: shapely.Polygon, name: str) -> Outline:
    z = _z(polygon.exterior)
    return Outline(name, z, shapely.Polygon(polygon.exterior).area, len(polygon.interiors))


def _polygons(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(geometry) if part.geom_type == "Polygon" and part.area > 0]


def _flat(ring: Complex) -> bool:
    """Whether all points lie on a line, to within rounding."""
    w = ring - ring[0]
    far = w[np.argmax(np.abs(w))]
    return bool(np.abs((w * far.conjugate()).imag).max() <= 1e-13 * abs(far) ** 2)


def _place(polygon: shapely.Polygon) -> str:
    """Where an invalid polygon is so, in the file's own coordinates."""
    reason = shapely.is_valid_reason(polygon)
    return (
        f"at ({', '.join(reason.split('[')[1].rstrip(']').split()[:2])})" if "[" in reason else f"({reason})"
    )


def _xy(z: Complex) -> np.ndarray:
    return np.column_stack([z.real, z.imag])


def _z(ring: shapely.LinearRing) -> Complex:
    return shapely.get_coordinates(ring)[:-1] @ np.array([1, 1j])
