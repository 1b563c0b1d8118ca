"""Map points, lines and polygons: lines are refined to follow their true image, polygons stay simple.

Geometry outside the domain, beyond the accuracy of its outline, is cut off and counted.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, TypeVar

import numpy as np
import shapely

from ..arrays import Complex, Real, complex_of, xy_of
from ..curve import polygon_of

MOST_HALVINGS = 30  # halvings of a segment at most: to 1e-9 of it
LONGEST_PIECE_SHARE = (
    1 / 16
)  # of the domain's size: longer segments are first split into pieces of this length
FINER_ROUNDS = 8  # times that the tolerance is halved for polygons whose images are not simple
CHORD_SAMPLES = np.array(
    [0.25, 0.5, 0.75]
)  # parameters on a piece at which its image is compared with its chord

Rings = list[Complex]
Item = TypeVar("Item")


@dataclass(eq=False)
class Carrier:
    """Maps points, lines and polygons.

    Attributes:
        map: complex points (p,) to complex points, NaN outside the domain.
        rims: the boundaries of its domain, the outer one first.
        near: distance outside the boundary up to which points count as on it.
        tolerance: allowed deviation of a line's image from the true one, in units of the image.
        counts: counts of geometry that was outside, cut, or repaired, by kind.
    """

    map: Callable[[Complex], Complex]
    rims: Sequence[Complex]
    near: float
    tolerance: float
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._domain = polygon_of(*self.rims)
        self._reach = self._domain.buffer(self.near)
        self._piece = LONGEST_PIECE_SHARE * abs(complex(np.ptp(self.rims[0].real), np.ptp(self.rims[0].imag)))
        shapely.prepare(self._reach)

    def points(self, z: Complex) -> Complex:
        """Return images (p,) of points, NaN outside."""
        w = self.map(z)
        self.counts["points outside"] += int(np.isnan(w[np.isfinite(z)]).sum())
        return w

    def lines(self, lines: Sequence[Complex]) -> list[list[Complex]]:
        """Return for each polyline (k,) the images of its pieces inside the domain; none where all of it is outside."""
        parts = []
        for line in lines:
            shape = shapely.LineString(xy_of(line))
            whole = self._reach.covers(shape)
            parts.append(
                [line] if whole else [_z(part) for part in _parts(self._reach & shape, "LineString")]
            )
            self.counts["lines cut" if parts[-1] else "lines outside"] += not whole
        return _grouped(self._images(_flat(parts), self.tolerance), parts)

    def polygons(self, polygons: Sequence[Rings]) -> list[list[Rings]]:
        """Return for each polygon, a list of its rings (k,) with the outer one first, the images of its parts inside.

        All results are simple.
        """
        parts = []
        for polygon in map(as_polygon, polygons):
            self.counts["polygons repaired"] += not polygon.is_valid
            sound = polygon if polygon.is_valid else shapely.make_valid(polygon)
            whole = self._reach.covers(sound)
            parts.append(_parts(sound if whole else self._domain & sound, "Polygon"))
            self.counts["polygons cut" if parts[-1] else "polygons outside"] += not whole
        images = self._simple([_rings(part) for part in _flat(parts)])
        return [_flat(group) for group in _grouped(images, parts)]

    def _simple(self, polygons: Sequence[Rings]) -> list[list[Rings]]:
        """Return the image of each polygon, refined further if it is not simple.

        Images that never become simple are split into simple parts.
        """
        polygon_images: dict[int, Any] = {}
        tolerance, todo = self.tolerance, list(range(len(polygons)))
        for _ in range(FINER_ROUNDS):
            rings = [[np.append(ring, ring[0]) for ring in polygons[k]] for k in todo]
            images = map(as_polygon, _grouped(self._images(_flat(rings), tolerance), rings))
            polygon_images |= dict(zip(todo, images))
            todo, tolerance = [k for k in todo if not polygon_images[k].is_valid], tolerance / 2
        for k in todo:
            polygon_images[k] = shapely.make_valid(polygon_images[k])
        return [[_rings(part) for part in _parts(polygon_images[k], "Polygon")] for k in range(len(polygons))]

    def _images(self, lines: Sequence[Complex], tolerance: float) -> list[Complex]:
        """Return the images of polylines inside the domain, with as many additional points as the tolerance needs."""
        if not lines:
            return []
        last = np.cumsum([line.size for line in lines]) - 1
        z = np.concatenate(lines)
        w = self.map(z)
        heads = np.delete(np.arange(z.size), last)  # first points of the segments
        owner, low, points = self._refined(z, w, heads, tolerance / 2)
        owner, low = np.append(owner, np.arange(heads.size)), np.append(low, np.full(heads.size, 2.0))
        order = np.lexsort([low, owner])
        owner, points = _thinned(owner[order], np.append(points, w[heads + 1])[order], tolerance / 2)
        starts = np.append(True, owner[1:] != owner[:-1])
        ends = np.append(starts[1:], True) & ~np.isin(
            heads[owner] + 1, last
        )  # the next segment begins with it
        line = np.searchsorted(last, heads[owner])
        needed = ~ends & ~np.isnan(points)
        return np.split(points[needed], np.searchsorted(line[needed], np.arange(1, len(lines))))

    def _refined(self, z: Complex, w: Complex, heads: Any, tolerance: float) -> tuple[Any, Real, Complex]:
        """Split segments until the images of the pieces are straight to a tolerance.

        Returns the segment, and parameter and image of the beginning, of each piece.
        """
        begin, step = z[heads], z[heads + 1] - z[heads]
        count = np.maximum(1, np.ceil(np.abs(step) / self._piece)).astype(int)
        owner = np.repeat(np.arange(heads.size), count)
        low = (np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)) / count[owner]
        high = low + 1 / count[owner]
        inner = low > 0
        a = w[heads[owner]]
        a[inner] = self.map((begin[owner] + low * step[owner])[inner])
        b = np.where(np.append(inner[1:], False), np.roll(a, -1), w[heads[owner] + 1])
        pieces = []
        for depth in range(MOST_HALVINGS):
            t = low[:, None] + (high - low)[:, None] * CHORD_SAMPLES
            between = self.map((begin[owner, None] + t * step[owner, None]).ravel()).reshape(t.shape)
            is_bent = (_off(between, a, b) > tolerance) & (depth < MOST_HALVINGS - 1)
            pieces.append((owner[~is_bent], low[~is_bent], a[~is_bent]))
            if not is_bent.any():
                break
            middle, parameter = between[is_bent, 1], t[is_bent, 1]
            a, b = np.append(a[is_bent], middle), np.append(middle, b[is_bent])
            low, high = np.append(low[is_bent], parameter), np.append(parameter, high[is_bent])
            owner = np.tile(owner[is_bent], 2)
        arrays = [np.concatenate(part) for part in zip(*pieces)]
        return arrays[0], arrays[1], arrays[2]


def _off(points: Complex, a: Complex, b: Complex) -> Real:
    """Return (p,) largest distances of points (p, k) from the segments a to b (p,)."""
    step = (b - a)[:, None]
    offsets = points - a[:, None]
    part = np.clip((offsets * step.conj()).real / np.maximum(np.abs(step) ** 2, 1e-300), 0, 1)
    return np.abs(offsets - part * step).max(axis=1)


def _thinned(owner: Any, points: Complex, tolerance: float) -> tuple[Any, Complex]:
    """Simplify the polylines of segments, given by points and their owners, within a tolerance."""
    counts = np.bincount(owner)
    many = counts[owner] > 2
    many &= ~np.isin(owner, owner[np.isnan(points)])
    if not many.any():
        return owner, points
    names, index = np.unique(owner[many], return_inverse=True)
    lines = shapely.simplify(
        shapely.linestrings(xy_of(points[many]), indices=index), tolerance, preserve_topology=False
    )
    xy, line_index = shapely.get_coordinates(lines, return_index=True)
    joined = np.append(owner[~many], names[line_index])
    order = np.argsort(joined, kind="stable")
    return joined[order], np.append(points[~many], complex_of(xy))[order]


def as_polygon(rings: Sequence[Complex]) -> shapely.Polygon:
    """Return the polygon of rings (k,), the outer one first, which may cross themselves and each other."""
    outer, *holes = (xy_of(ring) if ring.size > 2 else None for ring in rings)
    return shapely.Polygon(outer, [hole for hole in holes if hole is not None])


def _rings(polygon: shapely.Polygon) -> Rings:
    """Return the rings of a polygon without repeated points, the outer one first."""
    return [_z(ring)[:-1] for ring in (polygon.exterior, *polygon.interiors)]


def _z(line: Any) -> Complex:
    return complex_of(shapely.get_coordinates(line))


def _parts(shape: Any, kind: str) -> list[Any]:
    """Return the non-empty parts of a geometry that have the given type."""
    components = shapely.get_parts(shapely.line_merge(shape) if kind == "LineString" else shape)
    nested = [part for component in components for part in shapely.get_parts(component)]
    return [part for part in nested if part.geom_type == kind and not part.is_empty]


def _flat(groups: Iterable[Iterable[Item]]) -> list[Item]:
    return [item for group in groups for item in group]


def _grouped(items: Sequence[Item], groups: Sequence[Sequence[Any]]) -> list[list[Item]]:
    """Split a list into groups of the same sizes as `groups`."""
    remaining = iter(items)
    return [list(islice(remaining, len(group))) for group in groups]
