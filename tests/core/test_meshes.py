"""Kernels of meshes, against the same in plain Python: equal bits, since the arithmetic is the same."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from iccm.arrays import xy_of
from iccm.meshes import bake, locate, rasterise, render
from iccm.meshes.topology import Triangles
from tests.core.reference import meshes as reference


def triangles(count: int, seed: int, width: float, height: float):
    """Triangles of either orientation that overlap and lie beyond the grid, some of them without area."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform((-6, -3), (width + 4, height + 8), (count, 3, 2))
    corners[: count // 2] = corners[: count // 2, :1] + 0.2 * (
        corners[: count // 2] - corners[: count // 2, :1]
    )
    corners[2, 1] = corners[2, 0]
    corners[3] = np.round(corners[3]) + 0.5  # corners on texel centres
    return corners


@pytest.mark.parametrize("wrap", [False, True])
def test_texels_are_filled_by_triangles(wrap):
    height, width = 23, 31
    corners = triangles(40, 1, width, height)
    ours, theirs = (np.full((height, width), -1, np.int32) for _ in range(2))
    for top, bottom in ((0, 9), (9, 23)):
        overlaps = rasterise._fill(corners, len(corners), ours, height, width, top, bottom, wrap)
        assert overlaps == reference.fill(corners, theirs, top, bottom, wrap) > 0
    np.testing.assert_array_equal(ours, theirs)
    assert -1 in ours or wrap


@pytest.mark.parametrize("wrap", [False, True])
def test_texels_that_triangles_touch(wrap):
    height, width = 19, 26
    corners = triangles(12, 2, width, height)
    chosen = np.array([0, 1, 2, 4, 7, 9])
    owner = np.full((height, width), -1, np.int32)
    reference.fill(corners[:3], owner, 0, height, wrap)
    centre = owner >= 0
    results = []
    for touch in (
        lambda o, n: rasterise._touch(corners, chosen, chosen.size, o, centre, n, height, width, wrap),
        lambda o, n: reference.touch(corners, chosen, o, centre, n, wrap),
    ):
        touched, nearest = owner.copy(), np.full((height, width), np.inf, np.float32)
        touch(touched, nearest)
        results.append((touched, nearest))
    for ours, theirs in zip(*results):
        np.testing.assert_array_equal(ours, theirs)
    assert (results[0][0] != owner).any()


@pytest.mark.parametrize("kind", [float, complex])
def test_affine_functions_take_corners_to_values(kind):
    rng = np.random.default_rng(3)
    corners = triangles(30, 3, 50, 20)
    values = rng.normal(size=(30, 3)) + (1j * rng.normal(size=(30, 3)) if kind is complex else 0)
    theirs = np.empty((30, 3), kind)
    reference.affine(corners, values, theirs)
    ours = rasterise.affine(corners, values)
    np.testing.assert_array_equal(ours, theirs)
    at_corners = ours[:, :1] + ours[:, 1:2] * corners[..., 0] + ours[:, 2:] * corners[..., 1]
    sound = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) > 1
    np.testing.assert_allclose(at_corners[sound], values[sound], rtol=0, atol=1e-10)


def test_affine_functions_at_texels():
    rng = np.random.default_rng(4)
    height, width, first = 21, 34, 5
    corners = triangles(18, 4, width, height)
    coefficients = rng.normal(size=(18, 3)) + 1j * rng.normal(size=(18, 3))
    owner = rng.integers(0, 18, 200).astype(np.int32)
    texels = rng.integers(0, width * (height - first), 200)
    ours, theirs = ([np.empty(200, complex) for _ in range(3)] for _ in range(2))
    bake._evaluate(coefficients, corners, owner, texels, texels.size, first, height, width, *ours)
    reference.evaluate(coefficients, corners, owner, texels, first, (height, width), *theirs)
    for compiled, expected in zip(ours, theirs):
        np.testing.assert_array_equal(compiled, expected)


def test_walks_to_points():
    rng = np.random.default_rng(5)
    points = rng.random((80, 2)) * (2, 1)
    faces = Delaunay(points).simplices.astype(np.int64)
    flat = points[:, 0] + 1j * points[:, 1]
    twin = Triangles(faces, len(points)).twin
    z = rng.uniform(-0.5, 2.5, 300) + 1j * rng.uniform(-0.5, 1.5, 300)
    start = rng.integers(0, len(faces), z.size).astype(np.int32)
    ours, theirs = ((np.empty(z.size, np.int64), np.empty((z.size, 3))) for _ in range(2))
    locate._walk(flat, faces, twin, z, start, z.size, *ours)
    reference.walk(flat, faces, twin, z, start, *theirs)
    np.testing.assert_array_equal(ours[0], theirs[0])
    # points outside take lengths, which the C library rounds in its own way
    np.testing.assert_allclose(ours[1], theirs[1], rtol=0, atol=1e-14)
    inside = (ours[1] > 0).all(axis=1)
    reached = np.einsum("pk,pkx->px", ours[1], points[faces[ours[0]]])
    np.testing.assert_allclose(reached[inside], xy_of(z)[inside], rtol=0, atol=1e-12)
    assert 0 < inside.sum() < z.size


def test_the_triangles_nearest_to_the_viewer():
    height, width = 22, 37
    corners, slopes = triangles(25, 6, width, height), np.random.default_rng(6).normal(size=(25, 3))
    ours, theirs = (
        (np.full((height, width), -1, np.int32), np.full((height, width), -np.inf, np.float32))
        for _ in range(2)
    )
    render._nearest(corners, slopes, 25, *ours, height, width)
    reference.nearest(corners, slopes, *theirs)
    for compiled, expected in zip(ours, theirs):
        np.testing.assert_array_equal(compiled, expected)


def test_corners_of_single_precision_are_fitted_and_rasterised():
    """As those of layouts in GLB files are."""
    corners = triangles(20, 7, 30, 20).astype(np.float32)
    values = np.random.default_rng(7).random((20, 3), dtype=np.float32)
    expected = rasterise.affine(corners.astype(float), values.astype(float))
    np.testing.assert_array_equal(rasterise.affine(corners, values), expected)
    owners = [rasterise.rasterise(c, 30, 20).owner for c in (corners, corners.astype(float))]
    np.testing.assert_array_equal(*owners)
