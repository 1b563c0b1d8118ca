"""Maps in which each region of a coverage has an area in proportion to a value."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely

from ..arrays import Complex, Index, Real, complex_of, xy_of
from ..balanced.model.discrete_map import folds
from ..balanced.model.measures import stretches
from ..curve import Curve
from ..errors import InputError
from ..maps.distortion import weighted_quantile
from ..maps.triangulated.map import TriangulatedMap, without_bulges
from ..plane import diagonal, triangle_areas
from ..result import Fit
from ..status import Status
from .areas import RegionMesh, match_areas
from .mesh import FrameTriangulation, mesh_of

SMALLEST_AREA_SHARE, SMALLEST_OF_MEAN = 1e-4, 1e-2
"""Smallest area relative to the total, and to the mean of all regions, whichever is less: smaller regions, such as
those with value zero, would be invisible, and squeezed."""
MOST_STEPS = 120  # of Newton's method; real maps take 10 to 60
AREA_TOLERANCE = 1e-3  # relative to each region's area: differences that are small enough to stop
SLIVER_SHARE = 1e-5  # of the box's longer side: gaps between neighbours that are narrower are closed
DETAIL_SHARES = 1e-5, 5e-3  # of the box's longer side: first and largest tolerance of simplified borders
DETAIL_RATIO = 1.6  # of successive tolerances


@dataclass(frozen=True, eq=False)
class Cartogram:
    """A map of a frame around regions in which each region has the area that it should have.

    Attributes:
        mesh: the triangulation of the frame.
        image: (n,) images of its vertices.
        polygons: (r,) the regions as they were mapped, edge-matched.
        region: (m,) the region of each triangle, -1 for none.
        target_areas: (r,) areas that the regions should have; their sum is that of the regions.
        steps: number of Newton steps.
    """

    mesh: FrameTriangulation
    image: Complex
    polygons: Sequence[shapely.Geometry]
    region: Index
    target_areas: Real
    steps: int

    @cached_property
    def areas(self) -> Real:
        """The areas of the regions in the cartogram; shape (r,)."""
        return _areas(self.image, self.mesh.faces, self.region, self.target_areas.size)

    @cached_property
    def errors(self) -> Real:
        """The differences of the areas from the target areas, relative to these; shape (r,)."""
        errors: Real = np.abs(self.areas / self.target_areas - 1)
        return errors

    @cached_property
    def map(self) -> TriangulatedMap:
        """The map of the frame, linear on every triangle."""
        frame = np.arange(self.mesh.frame)
        return without_bulges(TriangulatedMap(self.mesh.z, self.image, self.mesh.faces, (frame,)))

    @property
    def folds(self) -> int:
        """Number of triangles whose image is not counter-clockwise."""
        return folds(self.mesh.faces, self.image)

    @cached_property
    def dilatations(self) -> Real:
        """(2,) mean and 95th percentile over the regions' area of the ratio of the stretches; 1 for a similarity."""
        faces = self.mesh.faces[self.region >= 0]
        dilatation, _, _ = stretches(self.mesh.z, self.image, faces)
        area = triangle_areas(self.image[faces])
        return np.array([np.average(dilatation, weights=area), weighted_quantile(dilatation, area, 0.95)])

    def fit(self) -> Fit:
        """Return the map as a result that can be saved."""
        frame = Curve(self.mesh.z[: self.mesh.frame])
        target = Curve(self.image[: self.mesh.frame])
        pins = np.empty((0, 2), complex)
        return Fit(self.map, Status.REACHED, [], frame, target, pins, [], ["A cartogram, in a frame."])

    def regions(self, digits: int) -> list[shapely.Geometry]:
        """Return the regions of the cartogram, with coordinates rounded to a number of decimals."""
        image = np.round(self.image.real, digits) + 1j * np.round(self.image.imag, digits)
        along = dict[tuple[int, int], Index]()
        for (start, end), chain in zip(self.mesh.parents.tolist(), self.mesh.chains):
            along[start, end] = chain
            along[end, start] = chain[::-1]
        points = self.mesh.z
        order = np.argsort(points)
        ordered = points[order]

        def ring(border: shapely.Geometry) -> list[tuple[float, float]]:
            numbers = order[np.searchsorted(ordered, complex_of(shapely.get_coordinates(border)))].tolist()
            sides = [along[pair][:-1] for pair in pairwise(numbers)]
            vertices = image[np.concatenate(sides)]
            return list(map(tuple, xy_of(np.append(vertices, vertices[0])).tolist()))

        mapped = []
        for region in self.polygons:
            parts = [
                shapely.Polygon(ring(part.exterior), [ring(hole) for hole in part.interiors])
                for part in shapely.get_parts(region)
            ]
            mapped.append(parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts))
        return mapped


def cartogram(regions: Sequence[shapely.Geometry], values: Real, most_points: int) -> Cartogram:
    """Return the cartogram of regions.

    Args:
        regions: valid polygons or multipolygons in one plane, each of which may have several parts and holes.
        values: (r,) not negative; NaN for regions that keep the mean density.
        most_points: number of vertices of all borders to which these are simplified.

    Raises:
        InputError: the values are negative or all zero, or a region has no area.
    """
    if np.any(values < 0) or not np.nansum(values) > 0:
        raise InputError("values must not be negative, and some must be positive")
    polygons = _simplified(_edge_matched(regions), most_points)
    points, edges = _borders(polygons)
    mesh = mesh_of(points, edges)
    region = _regions_of(mesh, polygons)
    source_areas = _areas(mesh.z, mesh.faces, region, len(polygons))
    if not source_areas.min() > 0:
        raise InputError(f"region {int(np.argmin(source_areas)) + 1} has no area")
    target_areas = areas_for(values, source_areas)
    scale = np.sqrt(triangle_areas(mesh.z[mesh.faces]).sum())
    is_fixed = np.arange(mesh.z.size) < mesh.frame
    system = RegionMesh(mesh.z / scale, mesh.faces, region, target_areas / scale**2, is_fixed)
    image, steps = match_areas(system, system.z.copy(), MOST_STEPS, AREA_TOLERANCE)
    return Cartogram(mesh, image * scale, polygons, region, target_areas, steps)


def areas_for(values: Real, source_areas: Real) -> Real:
    """Return (r,) areas in proportion to values, with the same total as the source areas.

    Regions whose value is NaN get the area that they have at the mean density of the others, and none gets less than
    the smallest area.

    >>> areas_for(np.array([3.0, 1.0]), np.array([1.0, 1.0]))
    array([1.5, 0.5])
    """
    has_value = ~np.isnan(values)
    density = values[has_value].sum() / source_areas[has_value].sum()
    areas = np.where(has_value, values, density * source_areas)
    smallest = min(SMALLEST_AREA_SHARE, SMALLEST_OF_MEAN / source_areas.size)
    areas = np.maximum(areas / areas.sum(), smallest)
    return areas / areas.sum() * source_areas.sum()


def _edge_matched(regions: Sequence[shapely.Geometry]) -> Sequence[shapely.Geometry]:
    """Return regions that do not overlap, and whose shared borders have the same vertices."""
    low_x, low_y, high_x, high_y = shapely.total_bounds(np.array(regions))
    width = SLIVER_SHARE * max(high_x - low_x, high_y - low_y)
    cleaned = shapely.coverage_clean(np.array(regions), gap_width=width)
    for number, region in enumerate(cleaned, 1):
        if region.is_empty:
            raise InputError(f"region {number} is covered by others or has no area")
    return cleaned


def _simplified(regions: Sequence[shapely.Geometry], most_points: int) -> Sequence[shapely.Geometry]:
    """Return regions with simplified borders that have at most about a number of vertices together."""
    low_x, low_y, high_x, high_y = shapely.total_bounds(np.array(regions))
    side = max(high_x - low_x, high_y - low_y)
    tolerance, largest = (share * side for share in DETAIL_SHARES)
    simple = regions
    while _borders(simple)[0].size > most_points and tolerance <= largest:
        with np.errstate(over="ignore"):
            simple = shapely.coverage_simplify(regions, tolerance)
        tolerance *= DETAIL_RATIO
    return simple


def _borders(regions: Sequence[shapely.Geometry]) -> tuple[Complex, Index]:
    """Return the vertices of all borders, sorted, and (e, 2) the edges between them."""
    rings = shapely.get_rings(shapely.get_parts(np.array(regions)))
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    points, number = np.unique(complex_of(xy), return_inverse=True)
    inner = ring[:-1] == ring[1:]
    edges = np.sort(np.column_stack([number[:-1], number[1:]])[inner], axis=1)
    return points, np.unique(edges, axis=0)


def _regions_of(mesh: FrameTriangulation, regions: Sequence[shapely.Geometry]) -> Index:
    """Return (m,) the region of each triangle, -1 for none."""
    middles = mesh.z[mesh.faces].mean(axis=1)
    triangle, region = shapely.STRtree(regions).query(shapely.points(xy_of(middles)), predicate="within")
    numbers = np.full(len(mesh.faces), -1)
    numbers[triangle] = region
    return numbers


def _areas(z: Complex, faces: Index, region: Index, count: int) -> Real:
    inside = region >= 0
    areas: Real = np.bincount(region[inside], triangle_areas(z[faces])[inside], count).astype(float)
    return areas


def digits_for(z: Complex) -> int:
    """Return the number of decimals to which coordinates may be rounded without visible change."""
    return int(np.ceil(-np.log10(1e-9 * diagonal(z))))
