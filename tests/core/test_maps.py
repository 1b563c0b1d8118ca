"""Kernels of maps, compared with plain Python."""

import numpy as np
import pytest

from iccm import buckets, sorting
from iccm.maps import cauchy_green, enclosure, extended_inverse, folds, refinement
from iccm.maps.triangulated import adjacency, evaluation, location, patches
from iccm.maps.triangulated.adjacency import neighbours
from tests.core.compare import run_both
from tests.core.reference import cauchy_green as plain_cauchy_green
from tests.core.reference import maps as plain
from tests.core.reference import refinement as plain_refinement
from tests.triangulations import irregular

BENT = np.array([0, 3 + 0.2j, 2.8 + 1.9j, 1.1 + 0.7j, 0.9 + 2.5j, -0.3 + 1.4j])


def equal(compiled, expected):
    assert len(compiled) == len(expected)
    for a, b in zip(compiled, expected):
        assert np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind in "fc")


def refine(z, n, room, faces, across, count, triangle_room, stack, stack_room, thin, tiniest2):
    assert (room, triangle_room, stack_room) == (z.size, len(faces), stack.size)
    n, count[0] = plain_refinement._mend(z, n, faces, count[0], across, stack, thin, tiniest2)
    return n


@pytest.mark.parametrize("h", [0.3, 0.15])
def test_refinement_mends_thin_triangles(monkeypatch, h):
    z, faces, _ = irregular(BENT, h, seed=4)
    # triangles that come from stretched ones are usually thin
    z = z.real + 0.15j * z.imag

    def work():
        refined = refinement.shaped(z, faces)
        return refined.z, refined.faces, refined.across

    compiled, expected = run_both(monkeypatch, refinement, {"_refine": refine}, work)
    assert len(compiled[0]) > z.size + 10
    equal(compiled, expected)


def test_edges_of_triangles():
    rng = np.random.default_rng(5)
    z, faces, _ = irregular(BENT, 0.2, seed=5)
    faces = rng.permutation(faces)
    across = neighbours(faces, z.size)
    edges = adjacency.edges_across(faces, across)
    expected = plain_refinement._numbered(faces, across)
    equal([edges.ends, edges.sides, edges.rim, edges.beside, edges.opposite], expected)


def test_pairs_are_sorted_and_equal_ones_stay_in_order(monkeypatch):
    rng = np.random.default_rng(6)
    faces = rng.integers(0, 40, (200, 3))

    def order_pairs(first, second, n, bound, order):
        assert n == first.size and bound > max(first.max(), second.max())
        order[:] = plain_refinement._by_counting(
            first, plain_refinement._by_counting(second, np.arange(n), bound), bound
        )

    def work():
        edges = adjacency.edges_of(faces)
        return edges.ends, edges.sides, edges.rim, edges.beside, edges.opposite

    equal(*run_both(monkeypatch, sorting, {"_order_pairs": order_pairs}, work))


def test_nearest_segments_are_those_of_a_search_of_all():
    rng = np.random.default_rng(7)
    draw = lambda n, size: size * (rng.standard_normal(n) + 1j * rng.standard_normal(n))  # noqa: E731
    start, w = draw(150, 1.0), draw(400, 2.0)
    along = draw(150, 0.2)
    along[7] = 0
    start[30], along[30] = start[20], along[20]  # the first of equal ones
    w[:20], w[20:23] = start[:20], (np.nan, complex(0, np.inf), 1e6)
    segment, part = buckets.nearest_segments(w, start, start + along)
    along = (start + along) - start
    for point, number, share in zip(w, segment, part):
        if not np.isfinite(point):
            assert (number, share) == (0, 0)
            continue
        off = point - start
        length = along.real * along.real + along.imag * along.imag
        t = along.real * off.real + along.imag * off.imag
        t = np.where(t > 0, np.minimum(t / np.where(length > 0, length, 1), 1.0), 0.0)
        x, y = off.real - t * along.real, off.imag - t * along.imag
        best = int(np.argmin(x * x + y * y))
        assert (number, share) == (best, t[best])


def bent_patches(seed):
    """Corners (m, 3), curvature vectors (m, 3) and edges of patches of a plane, some of which are straight."""
    rng = np.random.default_rng(seed)
    z, faces, _ = irregular(BENT, 0.4, seed)
    edges = adjacency.edges_of(faces)
    bulge = 0.03 * random_complex(rng, len(edges.ends))
    bulge[edges.rim] = 0
    bulge[edges.sides[::3]] = 0
    return z[faces], bulge[edges.sides], edges


def random_complex(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def test_points_are_located_in_patches(monkeypatch):
    rng = np.random.default_rng(8)
    corners, bulge, _ = bent_patches(8)
    locator = location.PatchLocator(corners, bulge)
    z = rng.uniform(-0.5, 3.2, 300) + 1j * rng.uniform(-0.2, 2.6, 300)
    z[:20], z[20:40], z[40:42] = corners[:20, 1], 0.5 * (corners[:20, 0] + corners[:20, 2]), (np.nan, 1e300)
    z = np.concatenate([z, np.repeat(z, 3)])  # in the second part many points in a row are on one patch

    def locate(control, boxes, x, y, size, columns, rows, begin, touching, points, p, rounding, patch, place):
        assert p == points.size
        grid = buckets.BucketGrid(complex(x, y), size, columns, rows, begin, touching)
        plain._locate(control, boxes, grid, points, rounding, patch, place)

    compiled, expected = run_both(monkeypatch, location, {"_locate": locate}, lambda: locator(z))
    assert 400 < np.count_nonzero(compiled[0] >= 0) < 1160
    equal(compiled, expected)


def test_few_points_are_located_the_same_without_buckets():
    rng = np.random.default_rng(21)
    corners, bulge, _ = bent_patches(21)
    z = rng.uniform(-0.5, 3.2, 40) + 1j * rng.uniform(-0.2, 2.6, 40)
    z[:10], z[10], z[11] = corners[:10, 1], np.nan, 1e300
    locator = location.PatchLocator(corners, bulge)
    for few in (z, z[:1], z[10:12], z[:0]):
        for once, prepared in zip(locator.locate_once(few), locator(few), strict=True):
            assert np.array_equal(once, prepared, equal_nan=True)
    assert 0 < np.count_nonzero(locator(z)[0] >= 0) < 40


def test_a_point_that_newton_does_not_find_is_infinitely_far():
    patch = np.array([0, 1, 0.3 + 0.01j, 0.4j, -0.3 + 0.2j, 0.1j])
    rng = np.random.default_rng(9)
    z = 3 * random_complex(rng, 50)
    solutions = [location.solve(patch, point) for point in z]
    assert np.isinf(np.array(solutions)[:, 2]).any()
    assert np.array_equal(solutions, [plain.solve(patch, point) for point in z])


def test_patches_are_evaluated(monkeypatch):
    rng = np.random.default_rng(10)
    corners, bulge, _ = bent_patches(10)
    control, image = np.concatenate([corners, bulge], axis=1), corners + 0.1 * corners**2
    triangle = rng.integers(-1, len(corners), 200)
    place = rng.dirichlet([0.5] * 3, 200)

    def evaluate(control, corners, triangle, place, start, stop, p, out):
        assert out.shape == (4, p)
        plain._evaluate(control, corners, triangle, place, start, stop, out)

    work = lambda: evaluation.evaluate(control, image, triangle, place, 1)  # noqa: E731
    equal(*run_both(monkeypatch, evaluation, {"_evaluate": evaluate}, work))


@pytest.mark.parametrize("size", [0.01, 0.3])
def test_bulges_shrink(monkeypatch, size):
    rng = np.random.default_rng(11)
    z, faces, _ = irregular(BENT, 0.4, seed=11)
    edges = adjacency.edges_of(faces)
    free = size * random_complex(rng, len(edges.ends))
    limits = 10 ** rng.uniform(-7, 0, len(faces))  # some are never met, and their curvature becomes 0

    def shrink(corners, most, flat, sides, m, bulge, count):
        assert m == len(corners) and count == bulge.size
        plain._shrink(corners, most, flat, sides, bulge)

    work = lambda: patches.shrunk(faces, z + 0.1 * z**2, z, edges, free, limits)  # noqa: E731
    compiled, expected = run_both(monkeypatch, patches, {"_shrink": shrink}, work)
    assert np.array_equal(compiled, expected)
    assert (compiled == 0).any() and (compiled != 0).any()


def test_sheets_of_a_folded_map(monkeypatch):
    rng = np.random.default_rng(12)
    z, faces, _ = irregular(BENT, 0.3, seed=12)
    image = z + 0.15 * random_complex(rng, z.size)
    clearance = rng.uniform(0, 1, len(faces))
    across = neighbours(faces, z.size)

    def flood(widest, k, across, clearance, m, reached):
        assert k == widest.size and m == len(across)
        plain._flood(widest, across, clearance, *np.empty((4, m), np.int64), reached)

    work = lambda: folds.by_sheets(image, faces, across, clearance)  # noqa: E731
    compiled, expected = run_both(monkeypatch, folds, {"_flood": flood}, work)
    assert len(faces) // 4 < compiled[1] < len(faces)
    equal(compiled, expected)


def test_bends_of_an_inverse(monkeypatch):
    rng = np.random.default_rng(13)
    z, faces, _ = irregular(BENT, 0.4, seed=13)
    slopes = random_complex(rng, 2, z.size)
    slopes[0, 5] = np.nan

    def bends(faces, m, w, z_w, z_wbar, out):
        assert m == len(faces)
        plain._bends(faces, w, z_w, z_wbar, out)

    work = lambda: extended_inverse.bends(faces, z, *slopes, threads=1)  # noqa: E731
    compiled, expected = run_both(monkeypatch, extended_inverse, {"_bends": bends}, work)
    assert np.isinf(compiled).any() and np.array_equal(compiled, expected)


def polygon_and_points(seed, count):
    """A polygon, and points: inside, just inside, on edges and on vertices."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    polygon = (1 + 0.3 * np.cos(3 * angle + 1) + 0.05 * rng.standard_normal(count)) * np.exp(1j * angle)
    inside = rng.uniform(0, 0.6, 60) * np.exp(2j * np.pi * rng.uniform(0, 1, 60))
    edge = 0.7 * polygon[:9] + 0.3 * polygon[1:10]
    return polygon, np.concatenate([inside, (1 - 1e-7) * edge, edge, polygon[3:12]])


@pytest.mark.parametrize("kind", ["coordinates", "derivatives"])
def test_cauchy_green_coordinates(monkeypatch, kind):
    """Up to rounding: NumPy divides complex numbers by a product with the reciprocal."""
    polygon, z = polygon_and_points(14, 40)
    fill = getattr(plain_cauchy_green, f"_{kind}")

    def compute(vertices, n, z, start, stop, out):
        assert n == vertices.size
        with np.errstate(all="ignore"):
            fill(vertices, z[start:stop], out[start:stop])

    work = lambda: getattr(cauchy_green, kind)(polygon, z)  # noqa: E731
    compiled, expected = run_both(monkeypatch, cauchy_green, {f"_{kind}": compute}, work)
    assert np.isfinite(compiled).all()
    assert np.abs(compiled - expected).max() < 1e-15 * np.abs(expected).max()


@pytest.mark.parametrize("m", [1, 2, 3])
@pytest.mark.parametrize("count", [7, 64, 150])
def test_integrals_are_those_of_the_coordinates(m, count):
    """With less than a tile of edges, with one, and with several; two roundings per edge in the sum."""
    polygon, z = polygon_and_points(15, max(count, 13))
    densities = random_complex(np.random.default_rng(16), m, polygon.size)
    values, slopes = cauchy_green.jets(polygon, densities, z)
    bound = 4e-16 * polygon.size * np.abs(densities).max()
    assert np.abs(values - densities @ cauchy_green.coordinates(polygon, z).T).max() < bound
    inner = ~np.isin(z, polygon)
    expected = densities @ cauchy_green.derivatives(polygon, z[inner]).T
    assert np.isnan(slopes[:, ~inner]).all()
    assert np.allclose(slopes[:, inner], expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_integrals_do_not_depend_on_the_slices_they_are_computed_in():
    polygon, z = polygon_and_points(17, 30)
    densities = random_complex(np.random.default_rng(18), 2, polygon.size)
    whole = cauchy_green.jets(polygon, densities, z)
    parts = [cauchy_green.jets(polygon, densities, part) for part in np.array_split(z, [1, 6, 29])]
    equal([whole], [np.concatenate(parts, axis=2)])


@pytest.mark.parametrize("densities", [1, 2])
def test_bounds_of_pieces(densities):
    """Up to rounding: NumPy divides complex numbers by a product with the reciprocal."""
    rng = np.random.default_rng(19)
    polygon, middle = polygon_and_points(19, 40)
    half = rng.uniform(0, 0.05, middle.size)
    edge, rise = np.roll(polygon, -1) - polygon, random_complex(rng, densities, polygon.size)
    slope = random_complex(rng, 2, middle.size)
    compiled, expected = np.zeros((2, 4, middle.size))
    enclosure._bounds(
        polygon,
        edge,
        polygon.size,
        rise,
        densities,
        middle,
        half,
        slope,
        0,
        middle.size,
        middle.size,
        compiled,
    )
    plain._bounds(polygon, edge, rise, middle, half, slope, expected)
    assert np.array_equal(compiled[3], expected[3]) and 0 < compiled[3].sum() < middle.size
    assert np.allclose(compiled, expected, rtol=1e-13, atol=0)


def test_single_precision_is_accepted():
    """Meshes store them in their files."""
    rng = np.random.default_rng(20)
    z, faces, _ = irregular(BENT, 0.4, seed=20)
    z = z.astype(np.complex64)
    slopes = random_complex(rng, 2, z.size).astype(np.complex64)
    narrow, wide = (z, *slopes, faces.astype(np.int32)), (*map(np.complex128, (z, *slopes)), faces)

    def work(z, z_w, z_wbar, faces):
        edges = adjacency.edges_of(faces)
        bulge = patches.shrunk(faces, z, z, edges, 0.1 * z_w[edges.ends[:, 0]])
        locator = location.PatchLocator(z[faces], bulge[edges.sides])
        triangle, place = locator(z[faces].mean(axis=1))
        results = [extended_inverse.bends(faces, z, z_w, z_wbar), bulge, triangle, place]
        results += [*evaluation.evaluate(locator.control, z[faces], triangle, place)]
        results += [*buckets.nearest_segments(z + 1, z, z_w), neighbours(faces, z.size)]
        return [*results, cauchy_green.jets(BENT.astype(z.dtype), z_w[None, :6], z[faces].mean(axis=1))]

    for single, double in zip(work(*narrow), work(*wide), strict=True):
        assert np.allclose(single, double, rtol=1e-3, atol=1e-3, equal_nan=True)
