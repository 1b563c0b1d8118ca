"""Cartograms of arrays of polygons: areas, shared borders, and maps without folds."""

import numpy as np
import pytest
import shapely
from scipy.optimize import root
from scipy.spatial import Delaunay

from iccm.arrays import complex_of
from iccm.cartograms import areas
from iccm.cartograms.areas import OBJECTIVE, RegionMesh, match_areas
from iccm.cartograms.mesh import mesh_of
from iccm.cartograms.method import SMALLEST_AREA_SHARE, areas_for, cartogram
from iccm.errors import InputError
from iccm.plane import triangle_areas

RING = np.exp(2j * np.pi * np.arange(64) / 64)


def disc(radius, centre=0j):
    z = centre + radius * RING
    return shapely.Polygon(np.column_stack([z.real, z.imag]))


def check(result, error=2e-3):
    """Areas are met, nothing folds, and the written regions are an edge-matched coverage of these areas."""
    assert result.errors.max() < error
    assert result.folds == 0 and result.map.injectivity.certified
    regions = np.array(result.regions(9))
    assert shapely.is_valid(regions).all() and shapely.coverage_is_valid(regions)
    assert shapely.area(regions) == pytest.approx(result.target_areas, rel=2 * error)
    return regions


def test_rectangles_share_the_area_in_proportion_to_their_values():
    result = cartogram([shapely.box(0, 0, 2, 1), shapely.box(2, 0, 3, 1)], np.array([1.0, 4.0]), 1000)
    regions = check(result)
    assert shapely.area(regions) == pytest.approx([0.6, 2.4], rel=2e-3)
    assert regions[0].touches(regions[1])
    assert regions[0].intersection(regions[1]).length > 0.5


def test_regions_of_equal_density_stay_where_they_are():
    result = cartogram([shapely.box(0, 0, 2, 1), shapely.box(2, 0, 3, 1)], np.array([20.0, 10.0]), 1000)
    assert np.abs(result.image - result.mesh.z).max() < 1e-3
    assert result.dilatations == pytest.approx([1, 1], abs=1e-2)


def test_a_disc_in_a_ring_becomes_the_disc_of_its_area():
    inner, outer = disc(1), disc(2)
    result = cartogram([inner, outer.difference(inner)], np.array([1.0, 1.0]), 1000)
    regions = check(result)
    z = complex_of(shapely.get_coordinates(regions[0]))
    radii = np.abs(z - z[:-1].mean())
    assert radii == pytest.approx(np.sqrt(outer.area / 2 / np.pi), rel=0.03)


@pytest.mark.slow
def test_neighbours_without_common_vertices_are_matched():
    left = shapely.Polygon([(0, 0), (2, 0), (2, 3), (0, 3)])
    above, below = (
        shapely.box(2, 1.2, 4, 3),
        shapely.box(2, 0, 4, 1.2),
    )  # the left one has no vertex at (2, 1.2)
    gap = shapely.box(4 + 1e-5, 0, 5, 3)  # a sliver apart, beside which the others overlap slightly
    above = above.union(shapely.box(3.5, 1.2 - 1e-6, 4, 1.3))
    check(cartogram([left, above, below, gap], np.array([5.0, 1.0, 3.0, 2.0]), 1000))


def test_holes_islands_and_parts_that_touch_in_a_point():
    land = shapely.box(0, 0, 6, 4).difference(disc(0.7, 2 + 2j)).difference(disc(0.6, 4 + 2j))
    enclave = disc(0.7, 2 + 2j)  # the other hole is a lake
    pieces = shapely.MultiPolygon([shapely.box(6, 4, 7, 5), shapely.box(8, 0, 8.01, 0.01)])
    result = cartogram([land, enclave, pieces], np.array([4.0, 4.0, 1.0]), 1000)
    regions = check(result)
    assert len(regions[0].interiors) == 2 and len(shapely.get_parts(regions[2])) == 2


@pytest.mark.slow
def test_values_that_are_missing_or_zero():
    source_areas = np.array([1.0, 2.0, 1.0])
    assert areas_for(np.array([3.0, np.nan, 1.0]), source_areas) == pytest.approx([1.5, 2.0, 0.5])
    tiny = areas_for(np.array([3.0, 0.0, 1.0]), source_areas)
    assert tiny.sum() == pytest.approx(4) and tiny[1] == pytest.approx(4 * SMALLEST_AREA_SHARE, rel=1e-3)
    boxes = [shapely.box(0, 0, 1, 1), shapely.box(1, 0, 2, 2), shapely.box(0, 1, 1, 2)]
    check(cartogram(boxes, np.array([3.0, 0.0, 1.0]), 1000))
    for values in ([1.0, -1.0, 1.0], [0.0, 0.0, 0.0], [np.nan] * 3):
        with pytest.raises(InputError):
            cartogram(boxes, np.array(values), 1000)


def test_the_derivatives_of_areas():
    points, edges = (
        np.array([0, 2, 2 + 1j, 1.2j, 3.1 + 0.4j]),
        [(0, 1), (1, 2), (2, 3), (0, 3), (1, 4), (2, 4)],
    )
    mesh = mesh_of(points, np.array(edges))
    inside = shapely.contains_xy(shapely.Polygon([(0, 0), (2, 0), (2, 1), (0, 1.2)]), *_xy(mesh))
    region = np.where(inside, 0, -1)
    regions = RegionMesh(mesh.z, mesh.faces, region, np.array([1.0]), np.arange(mesh.z.size) < mesh.frame)
    generator = np.random.default_rng(3)
    direction = generator.normal(size=mesh.z.size) + 1j * generator.normal(size=mesh.z.size)
    direction[regions.fixed] = 0
    slope = (regions.gradients_of_areas(mesh.z).conj() @ direction).real
    step = 1e-6
    difference = (regions.areas(mesh.z + step * direction) - regions.areas(mesh.z - step * direction)) / (
        2 * step
    )
    assert slope == pytest.approx(difference, rel=1e-6)


def _xy(mesh):
    middles = mesh.z[mesh.faces].mean(axis=1)
    return middles.real, middles.imag


def test_borders_are_edges_of_the_mesh_even_at_acute_corners():
    fan = [complex(5 * np.cos(a), 5 * np.sin(a)) for a in np.radians([0, 2, 5, 9, 30])]
    edges = np.array([(0, k) for k in range(1, 6)])
    mesh = mesh_of(np.array([0j, *fan]), edges)
    pairs = {tuple(sorted(pair)) for face in mesh.faces.tolist() for pair in zip(face, [*face[1:], face[0]])}
    for (start, end), chain in zip(mesh.parents, mesh.chains):
        assert chain[0] == start and chain[-1] == end
        assert all(tuple(sorted(pair)) in pairs for pair in zip(chain[:-1].tolist(), chain[1:].tolist()))


RADIUS = 1.4  # in the cartogram, of the disc of radius 1 in a disc of radius 2 that is held
CELLS = 60


def radial_map():
    """Radii 1 to 2 around the disc, and their images of least energy.

    By symmetry the map is radial: the disc is scaled, and the radii around it solve a problem in one dimension.
    """
    radii = np.linspace(1, 2, CELLS + 1)
    middle, step, scale = 0.5 * (radii[1:] + radii[:-1]), 1 / CELLS, np.sqrt((4 - RADIUS**2) / 3)

    def density(first, second):
        area, squares = first * second, 0.5 * (first * first + second * second)
        shape = squares / area * (0.5 * (area + 1 / area)) ** OBJECTIVE.theta
        return shape**OBJECTIVE.q * 0.5 * (1 + area)

    def forces(inner):
        images = np.concatenate([[RADIUS], inner, [2.0]])
        along, across = np.diff(images) / step / scale, 0.5 * (images[1:] + images[:-1]) / middle / scale
        tiny = 1e-30j  # derivatives by complex steps
        by_along = middle * density(along + tiny, across + 0j).imag / 1e-30
        by_across = 0.5 * step * density(along + 0j, across + tiny).imag / 1e-30
        return by_along[:-1] - by_along[1:] + by_across[:-1] + by_across[1:]

    inner = root(forces, np.linspace(RADIUS, 2, CELLS + 1)[1:-1], tol=1e-12).x
    return radii, np.concatenate([[RADIUS], inner, [2.0]])


def error_on_circles(count):
    """The root mean square distance from the radial map on a mesh of this many circles per unit."""
    circles = [
        k
        / count
        * np.exp(2j * np.pi * (np.arange(round(2 * np.pi * k)) + 0.5 * (k % 2)) / round(2 * np.pi * k))
        for k in range(1, 2 * count + 1)
    ]
    z = np.concatenate([[0j], *circles])
    faces = Delaunay(np.column_stack([z.real, z.imag])).simplices.astype(np.int64)
    faces = np.where((triangle_areas(z[faces]) < 0)[:, None], faces[:, ::-1], faces)
    region = (np.abs(z[faces].mean(axis=1)) > 1).astype(np.int64)
    source_areas = np.bincount(region, triangle_areas(z[faces]))
    scale = np.sqrt(source_areas.sum())
    target_areas = np.array([RADIUS**2 * source_areas[0], source_areas.sum() - RADIUS**2 * source_areas[0]])
    fixed = np.abs(z) > 2 - 1e-9
    regions = RegionMesh(z / scale, np.ascontiguousarray(faces), region, target_areas / scale**2, fixed)
    image, _ = match_areas(regions, regions.z.copy(), 120, 1e-9)
    radius = np.abs(z)
    expected = np.where(radius <= 1, RADIUS * radius, np.interp(radius, *radial_map()))
    gap = np.abs(scale * image - expected * np.exp(1j * np.angle(z)))
    return np.sqrt(np.mean(gap**2))


def test_the_map_converges_to_the_radial_one_as_the_mesh_is_refined():
    coarse, middle, fine = (error_on_circles(count) for count in (4, 8, 16))
    assert coarse < 2e-3 and middle < coarse / 2.5 and fine < coarse / 7  # of second order, nearly


def test_areas_are_corrected_where_no_step_lowers_the_energy(monkeypatch):
    """A search that always fails stands for strongly curved areas, as in the counties of the United States."""
    search = areas._line_search

    def failing(regions, u, direction, energy, weights):
        error = np.abs(regions.areas(u) / regions.target_areas - 1).max()
        return (u, 0.0) if weights[0] and error < 0.05 else search(regions, u, direction, energy, weights)

    monkeypatch.setattr(areas, "_line_search", failing)
    boxes = [shapely.box(0, 0, 2, 1), shapely.box(2, 0, 3, 1), shapely.box(0, 1, 3, 2)]
    check(cartogram(boxes, np.array([1.0, 9.0, 2.0]), 1000), error=1.1e-3)
