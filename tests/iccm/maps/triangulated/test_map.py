"""Triangulated maps: exact where possible, consistent with their inverse, smooth across edges."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from iccm.maps.triangulated.adjacency import edges_of
from iccm.maps.triangulated.evaluation import evaluate
from iccm.maps.triangulated.location import solve
from iccm.maps.triangulated.map import TriangulatedMap
from iccm.maps.triangulated.patches import (
    MOST_DEVIATION,
    bernstein,
    cross,
    shrunk,
    tangential,
    tangents,
    vertex_gradients,
)
from tests.shapes import arrow, ell
from tests.triangulations import (
    irregular,
    lattice,
    map_of,
    ring,
    scattered,
    wavy,
    wavy_derivatives,
)

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def affine(w):
    return (0.7 + 0.2j) * w + (0.1 - 0.3j) * w.conj() + 0.4 - 2j


def far_away(w):
    return 1e3 * w + 2e4 - 1e4j


MAPS = {
    "wavy square": lambda: map_of(irregular(SQUARE, 0.1), wavy),
    "ell, coarse": lambda: map_of(irregular(ell() / 2, 0.3), wavy),
    "arrow": lambda: map_of(irregular(arrow(), 0.2), lambda w: w + 0.02 * w**2 + 0.1 * w.conj()),
    "ring": lambda: map_of(ring(24, 4), lambda w: w + 0.05 * w**2),
    "far away": lambda: map_of(irregular(arrow(), 0.3), far_away),
    "sheared": lambda: map_of(
        irregular(ell(), 0.1), lambda w: w.real + 1j * (0.1 * w.imag + 0.5 * np.sin(w.real))
    ),
}


@pytest.fixture(params=MAPS)
def map(request) -> TriangulatedMap:
    map = MAPS[request.param]()
    assert map.injectivity.certified
    return map


def linear(map):
    return replace(map, bulge=np.zeros(len(map.edges.ends), complex))


def test_affine_maps_are_met_exactly():
    map = map_of(irregular(arrow(), 0.2), affine)
    triangle, place = scattered(map, 2000)
    w = np.sum(map.corners[triangle] * place, axis=1)
    z, z_w, z_wbar = map.inverse_jet(w)
    assert np.abs(z - affine(w)).max() < 1e-13
    assert np.abs(z_w - (0.7 + 0.2j)).max() < 1e-10
    assert np.abs(z_wbar - (0.1 - 0.3j)).max() < 1e-10
    assert np.abs(map(z) - w).max() < 1e-12


def test_forth_and_back_everywhere(map):
    triangle, place = scattered(map, 20_000)
    w = np.sum(map.corners[triangle] * place, axis=1)
    z = map.inverse(w)
    assert np.abs(map(z) - w).max() < 1e-11 * map.image_diagonal
    assert np.abs(map.inverse(map(z)) - z).max() < 1e-11 * map.diagonal
    assert np.abs(map.jet_at(triangle, place)[0] - z).max() < 1e-12 * map.diagonal


def test_vertices_go_to_vertices(map):
    assert np.abs(map(map.source) - map.image).max() <= 1e-15 * np.abs(map.image).max()
    assert np.abs(map.inverse(map.image) - map.source).max() <= 1e-15 * np.abs(map.source).max()


def test_derivatives_are_those_of_differences(map):
    triangle, place = scattered(map, 500)
    inner = 0.8 * place + 0.2 / 3
    w = np.sum(map.corners[triangle] * inner, axis=1)
    z, z_w, z_wbar = map.inverse_jet(w)
    f_z, f_zbar = map.derivatives(z)
    step = 1e-6 * map.image_diagonal
    for move in (step, 1j * step, (1 - 1j) * step):
        expected = (map.inverse(w + move) - map.inverse(w - move)) / 2
        assert np.abs(z_w * move + z_wbar * np.conj(move) - expected).max() < 1e-8 * map.diagonal
        h = z_w * move + z_wbar * np.conj(move)
        assert np.allclose(f_z * h + f_zbar * h.conj(), move, rtol=1e-9)


def errors(n, smooth, mesh):
    map = map_of(mesh(n), wavy)
    map = map if smooth else linear(map)
    w = 0.25 + 0.25j + 0.5 * np.random.default_rng(3).random((2000, 2)) @ np.array([1, 1j])
    z, z_w, z_wbar = map.inverse_jet(w)
    p, q = wavy_derivatives(w)
    return np.array([np.abs(z - wavy(w)).mean(), (np.abs(z_w - p) + np.abs(z_wbar - q)).mean()])


def test_on_regular_triangles_values_are_of_third_order_and_derivatives_of_second():
    rate = np.log2(errors(16, True, lattice) / errors(32, True, lattice))
    assert rate[0] > 2.8
    assert rate[1] > 1.8
    assert np.all(np.log2(errors(16, False, lattice) / errors(32, False, lattice)) < [2.2, 1.2])


def test_on_irregular_triangles_errors_are_a_fraction_of_the_linear_ones():
    ratio = errors(32, True, scrambled) / errors(32, False, scrambled)
    assert ratio[0] < 0.45
    assert ratio[1] < 0.35
    assert np.all(np.log2(errors(16, True, scrambled) / errors(32, True, scrambled)) > [1.7, 0.7])


def scrambled(n):
    return irregular(SQUARE, 1 / n)


def jumps(map):
    """The jumps of the inverse's derivatives at the midpoints of inner edges."""
    sides = map.edges.sides
    first, second = np.full((2, len(map.edges.ends), 2), np.nan + 0j)
    for k in range(3):
        middle = np.tile(0.5 * (np.arange(3) != k), (len(sides), 1))
        jet = np.stack(map.jet_at(np.arange(len(sides)), middle)[1:], axis=1)
        new = np.isnan(first[sides[:, k], 0])
        first[sides[new, k]] = jet[new]
        second[sides[:, k]] = jet  # of two sides with the same number k the last one is used
        second[sides[~new, k]] = jet[~new]
    inner = np.setdiff1d(np.arange(len(first)), map.edges.rim)
    return np.abs(first - second)[inner].sum(axis=1)


def test_derivatives_jump_less_than_on_straight_triangles():
    map = map_of(scrambled(24), wavy)
    smooth, straight = (
        np.quantile(jumps(triangulated_map), [0.5, 0.95]) for triangulated_map in (map, linear(map))
    )
    assert smooth[0] < straight[0] / 5
    assert smooth[1] < straight[1] / 3


def test_patches_keep_their_bounds(map):
    away = deviation(map.patches[:, :3], map.patches[:, 3:])
    assert away.max() <= MOST_DEVIATION * (1 + 1e-9)
    ratio = ratios(map)
    assert ratio.min() >= (1 - MOST_DEVIATION) ** 2 * (1 - 1e-9)
    assert ratio.max() <= (1 + MOST_DEVIATION) ** 2 * (1 + 1e-9)


def deviation(corners, bulge):
    """The largest deviation of a patch's derivative from its triangle's, relative to that."""
    (x, y, z), (a, b) = corners.T, tangents(corners, bulge)
    u, v, worst = y - x, z - x, np.zeros(len(corners))
    for along, across in zip(a, b):
        du, dv = along - u, across - v
        size = np.abs(du * v.conj() - dv * u.conj()) + np.abs(dv * u - du * v)
        worst = np.maximum(worst, size / (2 * np.abs(cross(u, v))))
    return worst


def ratios(map):
    z = map.patches[:, :3]
    return bernstein(z, map.patches[:, 3:]) / cross(z[:, 1] - z[:, 0], z[:, 2] - z[:, 0])


def test_bulges_are_shrunk_where_they_would_fold_a_patch():
    w, faces, loops = lattice(8)
    z = w.real**4 + 1j * w.imag**3
    map = TriangulatedMap(z, w, faces, loops)
    p, q = vertex_gradients(faces, w, z)
    i, j = map.edges.ends.T
    whole = 0.25 * ((p[i] - p[j]) * (w[j] - w[i]) + (q[i] - q[j]) * (w[j] - w[i]).conj())
    rough = replace(map, bulge=tangential(whole, z, map.edges, map.edges.rim))
    assert ratios(rough).min() < 0
    assert deviation(map.patches[:, :3], map.patches[:, 3:]).max() <= MOST_DEVIATION * (1 + 1e-9)
    assert map.injectivity.certified
    kept = np.abs(map.bulges - rough.bulges) < 1e-15
    assert 0.2 < kept.mean() < 1


def test_the_outline_stays_where_it_is(map):
    for loop in map.loops:
        after = np.roll(loop, -1)
        start, along = map.source[loop][:, None], (map.source[after] - map.source[loop])[:, None]
        w = map.image[loop][:, None] + (map.image[after] - map.image[loop])[:, None] * np.arange(4) / 4
        z = map.inverse(w)
        part = (z - start) / along
        assert np.abs(part[:, 0]).max() < 1e-9 and np.abs(part.imag).max() < 1e-9
        assert np.all(np.diff(part.real, axis=1) > 0)
        assert np.abs(map(z) - w).max() < 1e-11 * map.image_diagonal


def test_outside_but_near_counts_as_on_the_outline_and_farther_is_nothing():
    map = map_of(irregular(SQUARE, 0.1), lambda w: w + 0.1 * w**2, near=1e-2)
    for ask, plane, size in ((map.inverse, map.image, np.sqrt(2)), (map, map.source, map.diagonal)):
        loop = plane[map.loops[0]]
        middle, along = 0.5 * (loop + np.roll(loop, -1)), np.roll(loop, -1) - loop
        outward = -1j * along / np.abs(along)
        assert np.abs(ask(middle + 0.9e-2 * size * outward) - ask(middle)).max() < 1e-12
        assert np.isnan(ask(middle + 1.1e-2 * size * outward)).all()
    z, away = map.extended_inverse(np.array([2 + 0.5j, 0.5 + 0.5j]))
    assert np.abs(z[0] - map.inverse(np.array([1 + 0.5j]))[0]) < 1e-12
    assert np.allclose(away, [1, 0])


def test_nothing_in_a_hole():
    map = MAPS["ring"]()
    assert np.isnan(map.inverse(np.array([0.5 + 0j, 0, 3, np.nan, np.inf]))).all()
    assert np.isnan(map(np.array([0.1j, np.nan, np.inf]))).all()


def test_any_shape_and_any_number_of_threads():
    map = map_of(irregular(SQUARE, 0.1), wavy)
    w = np.random.default_rng(0).random((50, 300, 2)) @ np.array([1, 1j])
    assert map.inverse(w).shape == w.shape
    assert map(0.3 + 0.2j).shape == ()
    assert map.inverse(np.empty(0, complex)).shape == (0,)
    for by_one, by_four in zip(map.jet(map.inverse(w), 1), map.jet(map.inverse(w), 4)):
        assert np.array_equal(by_one, by_four, equal_nan=True)


def test_pickled_it_is_the_same_and_no_larger_than_its_data():
    map = MAPS["ring"]()
    fresh = len(pickle.dumps(map))
    w = np.linspace(1.1, 1.9, 7) * 1j
    expected = map.inverse(w)
    assert map.injectivity.certified
    again = pickle.dumps(map)
    assert len(again) == fresh
    assert np.array_equal(pickle.loads(again).inverse(w), expected)


def test_in_other_coordinates_it_is_the_same_map(map):
    source, image = (0.3 + 2j, 0.4, 5j), (-2, 0.5 - 0.1j, 3)
    moved = map.moved(source, image)
    triangle, place = scattered(map, 1000)
    w = np.sum(map.corners[triangle] * place, axis=1)
    transformed_w = image[0] * w + image[1] * w.conj() + image[2]
    z = map.inverse(w)
    expected = source[0] * z + source[1] * z.conj() + source[2]
    assert np.abs(moved.inverse(transformed_w) - expected).max() < 1e-11 * moved.diagonal
    assert moved.injectivity.certified


def test_turning_a_plane_over_is_refused():
    with pytest.raises(ValueError, match="orientation"):
        MAPS["ring"]().moved(image=(0, 1, 0))


def test_the_most_bent_patches_are_inverted():
    """Thin triangles whose derivative deviates by up to MOST_DEVIATION."""
    rng = np.random.default_rng(1)
    n = 60_000
    height = 10 ** rng.uniform(-6, 0, n)
    corners = np.stack([np.zeros(n), np.ones(n), rng.uniform(-0.2, 1.2, n) + 1j * height], axis=1)
    size = 10 ** rng.uniform(-2, 0.5, (2, n, 1)) * (rng.random((n, 3)) < 0.8)
    bulge = 0.5 * rng.normal(size=(n, 3)) * size[0] + 1j * height[:, None] * rng.normal(size=(n, 3)) * size[1]
    faces = np.arange(3 * n).reshape(n, 3)
    edges, free = edges_of(faces), np.empty(3 * n, np.complex128)
    free[edges.sides] = bulge
    bulge = shrunk(faces, np.tile(SQUARE[:3], n), corners.ravel(), edges, free)[edges.sides]
    place = rng.dirichlet([0.5] * 3, n)
    triangle = np.arange(n)
    patches = np.concatenate([corners, bulge], axis=1)
    z = evaluate(patches, np.tile(SQUARE[:3], (n, 1)), triangle, place)[0]
    places = np.array([solve(patches[t], z[t]) for t in triangle])
    assert np.abs(places[:, :2] - place[:, 1:]).max() < 1e-6
    assert places[:, 2].max() < 1e-12


def test_a_patch_bent_by_many_times_its_width_is_inverted():
    corners = [0, 0.0012103 - 0.0016471j, 0.8015406 + 0.6378634j]
    bulges = [0.00164 + 0.0350331j, 0.0015095 + 0.0351483j, 1.7e-5 - 2.32e-5j]
    patch = np.array([*corners, *bulges])
    place = np.random.default_rng(2).dirichlet([0.7] * 3, 2000)
    z = evaluate(patch[None], SQUARE[None, :3], np.zeros(2000, int), place)[0]
    places = np.array([solve(patch, point) for point in z])
    assert np.abs(places[:, :2] - place[:, 1:]).max() < 1e-6
    assert places[:, 2].max() < 1e-12
