"""Cartograms of arrays of polygons: areas, shared borders, and maps without folds."""

import numpy as np
import pytest
import shapely

from iccm.arrays import complex_of
from iccm.cartograms.areas import Regions
from iccm.cartograms.mesh import mesh_of
from iccm.cartograms.method import SMALLEST_AREA_SHARE, cartogram, wanted_areas
from iccm.errors import InputError

RING = np.exp(2j * np.pi * np.arange(64) / 64)


def disc(radius, centre=0j):
    z = centre + radius * RING
    return shapely.Polygon(np.column_stack([z.real, z.imag]))


def check(made, error=2e-3):
    """Areas are met, nothing folds, and the written regions are an edge-matched coverage of these areas."""
    assert made.errors.max() < error
    assert made.folds == 0 and made.map.injectivity.certified
    written = np.array(made.regions(9))
    assert shapely.is_valid(written).all() and shapely.coverage_is_valid(written)
    assert shapely.area(written) == pytest.approx(made.wanted, rel=2 * error)
    return written


def test_rectangles_share_the_area_in_proportion_to_their_values():
    made = cartogram([shapely.box(0, 0, 2, 1), shapely.box(2, 0, 3, 1)], np.array([1.0, 4.0]), 1000)
    written = check(made)
    assert shapely.area(written) == pytest.approx([0.6, 2.4], rel=2e-3)
    assert written[0].touches(written[1])
    assert written[0].intersection(written[1]).length > 0.5


def test_regions_of_equal_density_stay_where_they_are():
    made = cartogram([shapely.box(0, 0, 2, 1), shapely.box(2, 0, 3, 1)], np.array([20.0, 10.0]), 1000)
    assert np.abs(made.image - made.mesh.z).max() < 1e-3
    assert made.dilatations == pytest.approx([1, 1], abs=1e-2)


def test_a_disc_in_a_ring_becomes_the_disc_of_its_area():
    inner, outer = disc(1), disc(2)
    made = cartogram([inner, outer.difference(inner)], np.array([1.0, 1.0]), 1000)
    written = check(made)
    z = complex_of(shapely.get_coordinates(written[0]))
    radii = np.abs(z - z[:-1].mean())
    assert radii == pytest.approx(np.sqrt(outer.area / 2 / np.pi), rel=0.03)


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
    made = cartogram([land, enclave, pieces], np.array([4.0, 4.0, 1.0]), 1000)
    written = check(made)
    assert len(written[0].interiors) == 2 and len(shapely.get_parts(written[2])) == 2


def test_values_that_are_missing_or_zero():
    given = np.array([1.0, 2.0, 1.0])
    assert wanted_areas(np.array([3.0, np.nan, 1.0]), given) == pytest.approx([1.5, 2.0, 0.5])
    tiny = wanted_areas(np.array([3.0, 0.0, 1.0]), given)
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
    regions = Regions(mesh.z, mesh.faces, region, np.array([1.0]), np.arange(mesh.z.size) < mesh.frame)
    generator = np.random.default_rng(3)
    way = generator.normal(size=mesh.z.size) + 1j * generator.normal(size=mesh.z.size)
    way[regions.held] = 0
    slope = (regions.gradients_of_areas(mesh.z).conj() @ way).real
    step = 1e-6
    difference = (regions.areas(mesh.z + step * way) - regions.areas(mesh.z - step * way)) / (2 * step)
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
