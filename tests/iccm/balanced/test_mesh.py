"""The mesher: what it covers, preserves and avoids."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.balanced.errors import Stuck
from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise.energy import geometry


def densified(corners, spacing):
    ends = np.roll(corners, -1)
    parts = np.maximum(1, np.ceil(np.abs(ends - corners) / spacing)).astype(int)
    return np.concatenate([a + (b - a) * np.arange(k) / k for a, b, k in zip(corners, ends, parts)])


def unit(corners):
    z = np.asarray(corners, complex)
    area = 0.5 * np.sum((z.conj() * np.roll(z, -1)).imag)
    return z / np.sqrt(area)


def edges_of(faces):
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)


def least_angle(z, faces):
    a, b, c = z[faces].T
    return min(np.abs(np.angle((y - x) / (w - x))).min() for x, y, w in ((a, b, c), (b, c, a), (c, a, b)))


ELL = unit([0, 2, 2 + 1j, 1 + 1j, 1 + 2j, 2j])
COMB = unit([0, 5, 5 + 3j, 4 + 3j, 4 + 1j, 3 + 1j, 3 + 3j, 2 + 3j, 2 + 1j, 1 + 1j, 1 + 3j, 3j])


def check(outline, z, faces):
    _, areas = geometry(z, faces)
    signed = ((z[faces[:, 1]] - z[faces[:, 0]]).conj() * (z[faces[:, 2]] - z[faces[:, 0]])).imag
    whole = 0.5 * np.sum((outline.conj() * np.roll(outline, -1)).imag)
    assert (signed > 0).all() and areas.sum() == pytest.approx(whole, rel=1e-12)
    edges, count = edges_of(faces)
    rim = {tuple(sorted((k, (k + 1) % outline.size))) for k in range(outline.size)}
    assert {tuple(e) for e in edges[count == 1].tolist()} == rim
    inner = edges[count == 2]
    assert not (inner < outline.size).all(axis=1).any()  # no chord joins two vertices of the outline
    assert np.array_equal(z[: outline.size], outline)


@pytest.mark.parametrize("corners", [ELL, COMB], ids=["ell", "comb"])
@pytest.mark.parametrize("size", [0.3, 0.1, 0.04])
def test_covers_the_polygon_and_keeps_its_outline(corners, size):
    outline = densified(corners, 0.75 * size)
    z, faces = triangulate(outline, Sizes.even(0.5 * size**2))
    check(outline, z, faces)
    _, areas = geometry(z, faces)
    assert np.quantile(areas, 0.99) <= 0.5 * size**2


def test_angles_are_good_where_the_outline_allows():
    outline = densified(ELL, 0.05)
    z, faces = triangulate(outline, Sizes.even(0.002))
    assert np.degrees(least_angle(z, faces)) > 20


def test_graded_sizes_make_small_triangles_at_the_requested_places():
    outline = densified(ELL, 0.1)
    areas = np.full((10, 10), 0.01)
    areas[:3, :3] = 0.0005
    low, high = min(ELL.real), max(ELL.real)
    z, faces = triangulate(outline, Sizes(complex(low, low), (high - low) / 10, areas))
    _, triangle_areas = geometry(z, faces)
    away = np.abs(z[faces].mean(1))
    assert 3 * np.median(triangle_areas[away < 0.15]) < np.median(triangle_areas[away > 0.8])
    check(outline, z, faces)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=5, max_size=40))
def test_any_star_shaped_polygon(radii):
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    outline = densified(unit(np.array(radii) * np.exp(1j * angles)), 0.15)
    check(outline, *triangulate(outline, Sizes.even(0.02)))


def test_a_crossing_outline_is_refused():
    with pytest.raises(Stuck):
        triangulate(np.array([0, 1, 1j, 1 + 1j]), Sizes.even(0.1))
