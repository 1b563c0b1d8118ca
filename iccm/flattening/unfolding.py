"""Cut a hard surface into nets: rigid unfoldings of its flat faces along the fewest and shortest seams.

Planar regions are joined one after another by a rigid motion about a common edge, the longest edges first (the dual
tree of an unfolding is grown like Prim's spanning tree), unless the net would overlap itself. A region that fits
nowhere starts another chart. Edges within smooth developable parts, such as the side of a cylinder, are joined before
hard ones, so that seams lie on hard edges. Nothing is stretched.

Ties are broken by geometry: lengths that differ by rounding count as equal, and of equal ones the nearest to the first
region is joined first, which turns a cube into a cross. Charts therefore do not depend on the order of faces.
"""

import heapq
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, Real, complex_of, unit_vectors, xy_of
from ..meshes.flatten import LEAST_STEEP_SHARE, gradient_integrals
from ..meshes.mesh import face_angles
from ..meshes.patch import Patch
from ..meshes.stretch import SLIVER_HEIGHT_SHARE
from ..meshes.topology import labels
from ..sorting import grouped

FLAT_DEGREES = 0.2
"""Angle between two triangles that count as coplanar: most of rounding in files of six digits."""
PLANAR_DEGREES = 1.0
"""Largest angle between a triangle and its planar region: the sides of a finely divided cylinder are not one region."""
CREASE_DEGREES = 30.0
"""Angle at an edge from which it is hard: the usual default of modelling programs for smooth shading."""
MOST_SMOOTH_CURVATURE = 0.1
"""Sum of the angle defects (radians) inside a smooth part that counts as developable: unfolding it opens gaps of about
this angle."""
MOST_TIPS = 2
"""Vertices of a smooth part whose defect does not count: the tips of cones, from which a seam starts anyway."""
EQUAL_SHARE = 1e-7
"""Share of the surface's size by which equal lengths and positions may differ, by noise and rounding."""
MOST_TURNED_DEGREES = 50.0
"""Angle between the model's up on two parts of a chart: a picture on a net with larger ones would lie on its side."""
CLOSED_GAP_SHARE = 0.02
"""Share of an edge's length by which its two sides may lie apart in a net; they are joined, which stretches the
triangles beside it by about as much."""
SHRUNK_SHARE = 1e-3
"""Share of a region's width by which its outline is drawn in for tests of overlap, so that neighbours do not count."""
MOST_REGIONS = 4_000
"""Planar regions at most: surfaces with more are smooth or noisy, and their nets would be in shreds."""
GENERIC_DIRECTION = np.array([0.8017, 0.5345, 0.2673])
"""No symmetry of usual models maps two different points to the same place along it."""


@dataclass(frozen=True, eq=False)
class Net:
    """Charts of a surface that are unfolded rigidly.

    Attributes:
        chart: (m,) the chart of each triangle.
        flat: (m, 3) positions of the corners of triangles, in the plane of their chart.
        seams: (3m,) whether a half-edge is on a seam: its two sides are in different charts, or apart.
    """

    chart: Index
    flat: Complex
    seams: Flags


class Faceted:
    """A surface as planar regions with straight joints.

    Attributes:
        piece: the surface, oriented.
    """

    def __init__(self, piece: Patch) -> None:
        self.piece = piece
        self._half = np.flatnonzero(piece.triangles.twin > np.arange(piece.triangles.twin.size))
        self._sides = np.stack([self._half, piece.triangles.twin[self._half]]) // 3

    @cached_property
    def size(self) -> float:
        """Diagonal of the surface's box."""
        return float(np.linalg.norm(np.ptp(self.piece.points, axis=0)))

    @cached_property
    def normals(self) -> Real:
        """Area vectors of the triangles; shape (m, 3)."""
        a, b, c = np.moveaxis(self.piece.points[self.piece.faces], 1, 0)
        return np.cross(b - a, c - a) / 2

    @cached_property
    def angles(self) -> Real:
        """(e,) angles between the triangles at each inner edge, in degrees; 0 at slivers, whose normals are noise."""
        a, b = self._unit[self._sides]
        angles = np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b)))
        corners = self.piece.points[self.piece.faces]
        longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        sliver = 2 * self.piece.areas <= SLIVER_HEIGHT_SHARE * longest**2
        on_longest = self._lengths >= (1 - SLIVER_HEIGHT_SHARE) * longest[self._sides]
        return np.where((sliver[self._sides] & on_longest).any(axis=0), 0.0, angles)

    @property
    def _unit(self) -> Real:
        return unit_vectors(self.normals)

    @cached_property
    def _lengths(self) -> Real:
        ends = self.piece.points[np.stack([shape[self._half] for shape in self._ends])]
        return np.linalg.norm(ends[0] - ends[1], axis=1)

    @property
    def _ends(self) -> tuple[Index, Index]:
        return self.piece.triangles.tail, self.piece.triangles.head

    @cached_property
    def region(self) -> Index:
        """The planar region of each triangle; triangles of a polygon are in one region; shape (m,)."""
        inside = ~self.piece.drawn[self._half]
        joined = inside | (self.angles < FLAT_DEGREES)
        region = self._labels(joined)
        mean = unit_vectors(_sums(region, self.normals))
        away = np.degrees(np.arccos(np.clip((self._unit * mean[region]).sum(axis=1), -1, 1)))
        bent = np.bincount(region, (away > PLANAR_DEGREES) * self.piece.areas) > 0
        return self._labels(inside | (joined & ~bent[region[self._sides[0]]]))

    def _labels(self, joined: Flags) -> Index:
        first, second = self._sides[:, joined]
        return labels(first, second, len(self.piece.faces))

    @cached_property
    def part(self) -> Index:
        """The smooth part of each triangle, bounded by hard edges; shape (m,)."""
        return self._labels(~self.piece.drawn[self._half] | (self.angles < CREASE_DEGREES))

    @cached_property
    def developable(self) -> Flags:
        """(k,) whether a smooth part can be unfolded: it has hardly any curvature inside, except at tips of cones."""
        shape, points = self.piece.triangles, self.piece.points
        total = np.bincount(shape.tail, face_angles(points[shape.faces]).ravel(), minlength=shape.count)
        part = self.part
        border = (shape.twin < 0) | (part[shape.twin // 3] != part.repeat(3))
        inner = np.ones(shape.count, bool)
        inner[shape.tail[border]] = inner[shape.head[border]] = False
        of_vertex = np.empty(shape.count, np.int64)
        of_vertex[shape.tail] = part.repeat(3)
        vertex = np.flatnonzero(inner)
        defect = np.abs(2 * np.pi - total[vertex])
        order = np.lexsort([-defect, of_vertex[vertex]])
        vertex, defect = vertex[order], defect[order]
        owner = of_vertex[vertex]
        first = np.searchsorted(owner, owner)
        counted = np.arange(owner.size) - first >= MOST_TIPS
        return np.bincount(owner[counted], defect[counted], minlength=part.max() + 1) < MOST_SMOOTH_CURVATURE

    @property
    def hard_share(self) -> float:
        """Share of the area in developable parts."""
        area = self.piece.areas
        return float(area[self.developable[self.part]].sum() / area.sum())

    def net(self, longest: float = np.inf, *, standing: bool = False) -> Net | None:
        """Unfold the surface; each part that is not developable is a chart, with positions of no meaning.

        Regions are not joined to charts whose box has a diagonal above `longest`, in the unit of the surface; if the
        net is `standing`, nor across hard edges to charts where the model's up is in another direction. Returns None
        where there are too many regions.
        """
        if self.region.max() >= MOST_REGIONS:
            return None
        growth = _Growth(self, longest, standing)
        growth.join(within=self.part)
        growth.join(within=None)
        chart, flat = growth.unit, growth.flat
        tail, opposite = self._half, self.piece.triangles.twin[self._half]
        after = 3 * (np.arange(3 * len(chart)) // 3) + (np.arange(3 * len(chart)) + 1) % 3
        z = flat.ravel()
        gap = np.maximum(np.abs(z[tail] - z[after[opposite]]), np.abs(z[after[tail]] - z[opposite]))
        apart = gap > CLOSED_GAP_SHARE * self._lengths + EQUAL_SHARE * self.size
        bent = ~self.developable[self.part]
        apart &= self.piece.drawn[tail] & ~bent[tail // 3]
        cut = (chart[tail // 3] != chart[opposite // 3]) | apart
        seams = np.zeros(3 * len(chart), bool)
        seams[tail[cut]] = seams[opposite[cut]] = True
        return Net(chart, flat, seams)


class _Growth:
    """Units of rigidly joined planar regions, which grow.

    Attributes:
        unit: (m,) the unit of each triangle.
        flat: (m, 3) positions of corners in the plane of the unit.
    """

    def __init__(self, surface: Faceted, longest: float, standing: bool) -> None:
        self._surface, piece = surface, surface.piece
        region = surface.region
        bent = ~surface.developable[surface.part]
        # a part that is not developable is one region, which is not joined to others
        region = np.where(bent, region.max() + 1 + surface.part, region)
        self._region = np.unique(region, return_inverse=True)[1].ravel()
        self._count = int(self._region.max()) + 1
        self._bent = np.zeros(self._count, bool)
        self._bent[self._region[bent]] = True
        self.unit = self._region.copy()
        self.flat = _projected(piece, self._region, surface.normals)
        order, starts = grouped(self._region, self._count)
        self._members = [order[starts[k] : starts[k + 1]] for k in range(self._count)]
        self._outlines = self._shrunk_outlines()
        self._joints()
        area = np.bincount(self._region, piece.areas)
        middle = piece.points[piece.faces].mean(axis=1) @ GENERIC_DIRECTION
        middle = np.bincount(self._region, middle * piece.areas) / np.maximum(area, 1e-300)
        self._area, self._place = area, middle
        self._ups = self._steepest(piece)
        self._longest, self._standing = longest, standing

    def _shrunk_outlines(self) -> np.ndarray:
        """Return (r,) the regions' polygons, drawn in a little."""
        triangles = shapely.polygons(np.stack([self.flat.real, self.flat.imag], axis=-1))
        outlines = np.array(
            [
                shapely.Polygon() if bent else _union(triangles[member])
                for member, bent in zip(self._members, self._bent)
            ]
        )
        width = 2 * shapely.area(outlines) / np.maximum(shapely.length(outlines), 1e-300)
        return shapely.buffer(outlines, -SHRUNK_SHARE * width, join_style="mitre")

    def _steepest(self, piece: Patch) -> Complex:
        """Return (r,) the model's up seen in each region, times its area; short where the region is horizontal."""
        height = piece.points[:, piece.mesh.up_axis]
        rises = gradient_integrals(self.flat, height[piece.faces])
        return complex_of(
            np.column_stack(
                [np.bincount(self._region, part, self._count) for part in (rises.real, rises.imag)]
            )
        )

    def _joints(self) -> None:
        """Collect the joints: pairs of regions with common edges, which lie on one line as both are planar."""
        surface, half = self._surface, self._surface._half
        twin = surface.piece.triangles.twin
        a, b = self._region[half // 3], self._region[twin[half] // 3]
        usable = (a != b) & ~self._bent[a] & ~self._bent[b]
        half, a, b, length = half[usable], a[usable], b[usable], surface._lengths[usable]
        key = np.minimum(a, b) * self._count + np.maximum(a, b)
        distinct, joint = np.unique(key, return_inverse=True)
        joint = joint.ravel()
        total = np.bincount(joint, length, minlength=distinct.size).astype(float, copy=False)
        order = np.lexsort([length, joint])
        last = np.flatnonzero(np.diff(joint[order], append=-1))
        self._edge = half[order[last]]  # the longest edge of each joint
        ends = surface.piece.points[np.stack([end[half] for end in surface._ends])].mean(axis=0)
        middle = np.bincount(
            joint, (ends @ GENERIC_DIRECTION) * length, minlength=distinct.size
        ) / np.maximum(total, 1e-300)
        preferred = np.bincount(joint, length * surface.piece.preferred[half], minlength=distinct.size)
        # joints along borders of the file come last, so that seams lie there
        last_ones = (2 * preferred > total) * (total.max(initial=0.0) + surface.size)
        self._rank = _ranks(last_ones - total, EQUAL_SHARE * surface.size)
        self._order = _ranks(middle, EQUAL_SHARE * surface.size)
        self._at = [list[int]() for _ in range(self._count)]
        for k, edge in enumerate(self._edge.tolist()):
            for side in (edge // 3, int(twin[edge]) // 3):
                self._at[self._region[side]].append(k)

    def join(self, within: Index | None) -> None:
        """Join units, within the parts (m,) if these are given."""
        count = int(self.unit.max()) + 1
        first = np.full(count, -1)
        first[self.unit] = np.arange(self.unit.size)
        regions = [list[int]() for _ in range(count)]
        for region, member in enumerate(self._members):
            regions[self.unit[member[0]]].append(region)
        part = None if within is None else within[first]
        size = np.array([self._area[members].sum() for members in regions])
        place = np.array([np.dot(self._area[r], self._place[r]) for r in regions]) / np.maximum(size, 1e-300)
        extent = self._surface.size
        roots = np.lexsort(
            [_ranks(place, EQUAL_SHARE * extent), _ranks(-np.sqrt(size), EQUAL_SHARE * extent)]
        )
        owner = self._owners(regions)
        free = np.ones(count, bool)
        for root in roots.tolist():
            if free[root]:
                free[root] = False
                self._grow(root, regions, owner, free, part)
        self.unit = np.unique(owner, return_inverse=True)[1].ravel()[self._region]

    def _owners(self, regions: list[list[int]]) -> Index:
        owner = np.empty(self._count, np.int64)
        for unit, members in enumerate(regions):
            owner[members] = unit
        return owner

    def _grow(
        self, root: int, regions: list[list[int]], owner: Index, free: Flags, part: Index | None
    ) -> None:
        """Join free units to a root, over the longest joints first; `owner` (r,) and `free` are changed."""
        twin = self._surface.piece.triangles.twin
        covered = _Covered(self._outlines[regions[root]])
        up, area = self._ups[regions[root]].sum(), self._area[regions[root]].sum()
        heap = list[tuple[int, int, int, int]]()

        def reach(new_regions: Iterable[int], depth: int) -> None:
            for region in new_regions:
                for k in self._at[region]:
                    heapq.heappush(heap, (int(self._rank[k]), depth, int(self._order[k]), k))

        reach(regions[root], 0)
        while heap:
            _, depth, _, k = heapq.heappop(heap)
            edge, opposite = int(self._edge[k]), int(twin[self._edge[k]])
            if owner[self._region[edge // 3]] != root:
                edge, opposite = opposite, edge
            unit = int(owner[self._region[opposite // 3]])
            if unit == root or not free[unit] or (part is not None and part[unit] != part[root]):
                continue
            factor, shift = self._motion(edge, opposite)
            ups = factor * self._ups[regions[unit]]
            if self._standing and part is None and self._is_turned(ups.sum(), regions[unit], up, area):
                continue
            moved = _moved(self._outlines[regions[unit]], factor, shift)
            is_long = np.isfinite(self._longest) and covered.extent_with(moved) > self._longest
            if is_long or covered.meets(moved):
                continue
            covered.add(moved)
            self._outlines[regions[unit]], self._ups[regions[unit]] = moved, ups
            up, area = up + ups.sum(), area + self._area[regions[unit]].sum()
            triangles = np.concatenate([self._members[region] for region in regions[unit]])
            self.flat[triangles] = factor * self.flat[triangles] + shift
            owner[regions[unit]], free[unit] = root, False
            reach(regions[unit], depth + 1)

    def _is_turned(self, up: complex, regions: list[int], chart_up: complex, chart_area: float) -> bool:
        """Return whether regions with a sum of `up` would not be upright in a chart with one of `chart_up`."""
        is_horizontal = abs(up) < LEAST_STEEP_SHARE * self._area[regions].sum()
        if is_horizontal or abs(chart_up) < LEAST_STEEP_SHARE * chart_area:
            return False
        return abs(np.angle(up * np.conj(chart_up), deg=True)) > MOST_TURNED_DEGREES

    def _motion(self, edge: int, opposite: int) -> tuple[complex, complex]:
        """Return the rotation and translation that put the side of an edge onto its opposite side."""
        z = self.flat.ravel()
        a, b = z[edge], z[_after(edge)]
        c, d = z[_after(opposite)], z[opposite]
        factor = (b - a) * np.conj(d - c)
        factor /= max(abs(factor), 1e-300)
        return factor, (a + b) / 2 - factor * (c + d) / 2


class _Covered:
    """The part of a plane that a chart covers: outlines of regions with their boxes."""

    def __init__(self, outlines: np.ndarray) -> None:
        self._outlines, self._boxes, self._count = outlines, shapely.bounds(outlines), len(outlines)
        self._box = _total_box(self._boxes)

    def meets(self, outlines: np.ndarray) -> bool:
        """Return whether some outlines overlap the covered part."""
        mine = self._boxes[: self._count]
        if len(outlines) > 8:
            tree = shapely.STRtree(outlines)
            low, high = np.split(_total_box(shapely.bounds(outlines)), 2)
            near = ((mine[:, :2] <= high) & (mine[:, 2:] >= low)).all(axis=1)
            near_outlines = self._outlines[: self._count][near]
            return bool(tree.query(near_outlines, predicate="intersects").size)
        for outline, box in zip(outlines, shapely.bounds(outlines)):
            near = ((mine[:, :2] <= box[2:]) & (mine[:, 2:] >= box[:2])).all(axis=1)
            if near.any():
                shapely.prepare(outline)
                if shapely.intersects(outline, self._outlines[: self._count][near]).any():
                    return True
        return False

    def extent_with(self, outlines: np.ndarray) -> float:
        """Return the diagonal of the box that the covered part and some outlines have in common."""
        low, high = np.split(_total_box(np.vstack([self._box, shapely.bounds(outlines)])), 2)
        return float(np.linalg.norm(high - low))

    def add(self, outlines: np.ndarray) -> None:
        """Cover some outlines, too."""
        end = self._count + len(outlines)
        if end > len(self._outlines):
            room = max(end, 2 * len(self._outlines)) - len(self._outlines)
            self._outlines = np.append(self._outlines, np.full(room, None))
            self._boxes = np.append(self._boxes, np.full((room, 4), np.nan), axis=0)
        self._outlines[self._count : end] = outlines
        self._boxes[self._count : end] = shapely.bounds(outlines)
        self._box = _total_box(np.vstack([self._box, self._boxes[self._count : end]]))
        self._count = end


def _total_box(boxes: Real) -> Real:
    """Return (4,) the box around boxes (k, 4) of lowest and highest coordinates, without those of nothing, NaN."""
    return np.append(np.fmin.reduce(boxes[:, :2]), np.fmax.reduce(boxes[:, 2:]))


def _union(triangles: np.ndarray) -> shapely.Geometry:
    if len(triangles) == 1:
        return triangles[0]
    try:
        return shapely.coverage_union_all(triangles)
    except shapely.errors.GEOSException:  # bent by rounding, so that triangles overlap
        return shapely.union_all(shapely.make_valid(triangles))


def _after(half_edge: int) -> int:
    return 3 * (half_edge // 3) + (half_edge + 1) % 3


def _moved(outlines: np.ndarray, factor: complex, shift: complex) -> np.ndarray:
    return shapely.transform(outlines, lambda xy: xy_of(factor * complex_of(xy) + shift))


def _projected(piece: Patch, region: Index, normals: Real) -> Complex:
    """Return (m, 3) corners of triangles in the planes of their regions, seen from outside."""
    up = unit_vectors(_sums(region, normals))
    axis = np.eye(3)[np.argmin(np.abs(up), axis=1)]
    right = unit_vectors(np.cross(axis, up))
    ahead = np.cross(up, right)
    corners = piece.points[piece.faces]
    return np.einsum("mki,mi->mk", corners, right[region]) + 1j * np.einsum(
        "mki,mi->mk", corners, ahead[region]
    )


def _sums(region: Index, vectors: Real) -> Real:
    """Return (r, 3) sums of the vectors (m, 3) of each region."""
    order, starts = grouped(region, int(region.max()) + 1)
    sums: Real = np.add.reduceat(vectors[order], starts[:-1])
    return sums


def _ranks(values: Real, tolerance: float) -> Index:
    """Return (n,) the places of values in order; those that differ from the next by less than `tolerance` are equal."""
    order = np.argsort(values, kind="stable")
    rank = np.empty(values.size, np.int64)
    rank[order] = np.cumsum(np.diff(values[order], prepend=values[order[:1]]) > tolerance)
    return rank
