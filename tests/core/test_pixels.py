"""Kernels of pixels, against the same in plain Python and NumPy.

Kernels of filters are compared with their definition in tests/iccm/pixels/test_filters.py.
"""

import numpy as np
import pytest

from iccm.pixels import colour, coverage, filters, pyramid, texture, triangulated_preimages
from iccm.pixels.canvas import Band, Diagnostics
from tests.core.reference import pixels as reference

EDGES = list(pyramid.EDGES.values())


def random_map(count: int, seed: int, height: int, width: int):
    """Triangles that overlap and lie beyond the pixels, and quadratic patches of them."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-3, width + 3, count) + 1j * rng.uniform(-3, height + 3, count)
    corners = middle[:, None] + 4 * (rng.normal(size=(count, 3)) + 1j * rng.normal(size=(count, 3)))
    corners[0] = np.round(corners[0])  # through pixels' centres
    patches = rng.normal(size=(count, 6)) + 1j * rng.normal(size=(count, 6))
    return corners, triangulated_preimages.powers(corners, patches)


@pytest.mark.parametrize("slopes", [False, True])
def test_pixels_are_filled_by_triangles(slopes):
    rng = np.random.default_rng(1)
    row, rows, width = 5, 17, 29
    corners, powers = random_map(40, 1, 24, width)
    chosen = np.arange(39)[::-1].copy()
    reach = np.stack([corners.imag.min(axis=1), corners.imag.max(axis=1)], axis=1)[chosen]
    covered = (rng.random((rows, width)) < 0.5).astype(np.float32)
    results = []
    for fill in (
        lambda *out: triangulated_preimages._fill(
            *(corners, powers, chosen, reach, chosen.size, row, rows, width, covered),
            *out[:3],
            slopes,
            out[3],
        ),
        lambda *out: reference.fill(corners, powers, chosen, reach, row, covered, *out),
    ):
        z, right, down = (
            np.zeros((rows, width), kind) for kind in (np.complex128, np.complex64, np.complex64)
        )
        if not slopes:
            right = down = np.empty((0, 0), np.complex64)
        state = np.zeros((rows, width), np.uint8)
        results.append((fill(z, right, down, state), z, right, down, state))
    for ours, theirs in zip(*results):
        np.testing.assert_array_equal(ours, theirs)
    assert set(np.unique(results[0][-1])) == {0, 1, 2}


@pytest.mark.parametrize("winding", [False, True])
def test_pixels_are_covered_by_polylines(winding):
    rng = np.random.default_rng(2)
    rows, width = 19, 26
    loop = rng.uniform(-4, width + 5, 30) + 1j * rng.uniform(-3, rows + 6, 30)
    loop[4] = loop[3].real + 1j * loop[4].imag  # an upright side
    loop[8] = loop[7].real + 1j * loop[7].imag
    row = 2
    ours, inside = coverage.coverage(loop, row, rows, width)
    start = loop - 1j * row
    end = np.roll(start, -1)
    falls = start.imag > end.imag
    low, high = np.where(falls, end, start), np.where(falls, start, end)
    theirs, within = np.empty((rows, width), np.float32), np.empty((rows if winding else 0, width), bool)
    apart = low.imag < high.imag
    reference.cover(
        *(low[apart], high[apart], np.where(falls, -1.0, 1.0)[apart]),
        *(np.zeros(width + 2), np.zeros(width + 1, np.int64), theirs, within),
    )
    np.testing.assert_array_equal(ours, theirs)
    assert np.unique(ours).size > 50
    if winding:
        np.testing.assert_array_equal(inside, within)
    else:
        np.testing.assert_array_equal(coverage.coverage_box(loop, row, rows, width), theirs)


def halved(picture, taps, edge):
    """Both ways, in double precision."""
    for axis in (0, 1):
        n = picture.shape[axis]
        taken = 2 * np.arange((n + 1) // 2)[:, None] + np.arange(-5, 7)
        beyond = (taken < 0) | (taken >= n)
        if edge in (pyramid.REPEAT, pyramid.MIRROR):
            taken = pyramid._inside(taken, n, edge)
        texels = np.moveaxis(picture, axis, 0)[np.clip(taken, 0, n - 1)]
        if edge == pyramid.CLEAR:
            texels[beyond] = 0
        picture = np.moveaxis(np.einsum("itj...,t->ij...", texels, taps), 0, axis)
    return picture


@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("shape", [(37, 52, 3), (8, 5, 1), (1, 23, 4), (41, 1, 7), (3, 2, 2)])
def test_pictures_are_halved(edge, shape):
    picture = np.random.default_rng(3).random(shape, dtype=np.float32)
    x = (np.arange(12) - 5.5) / 2
    taps = np.sinc(x) * np.sinc(x / 3)
    expected = halved(picture.astype(float), taps / taps.sum(), edge)
    assert pyramid._reduced(picture, edge) == pytest.approx(expected, abs=1e-6)


def test_rows_repeat_as_the_core_has_them():
    rows = np.arange(-30, 40)
    assert pyramid._inside(rows, 7, pyramid.REPEAT).tolist() == [i % 7 for i in rows]
    tiles = np.concatenate([np.arange(7), np.arange(7)[::-1]])
    assert pyramid._inside(rows, 7, pyramid.MIRROR).tolist() == [tiles[i % 14] for i in rows]


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels, alpha", [(3, -1), (4, 3), (2, 0)])
def test_stored_integers_are_decoded(kind, channels, alpha):
    rng = np.random.default_rng(4)
    top = np.iinfo(kind).max
    pixels = rng.integers(0, top + 1, (7, 11, channels)).astype(kind)
    table = rng.random((top + 1, channels), dtype=np.float32)
    expected = table[pixels, np.arange(channels)]
    if alpha >= 0:
        colours = [k for k in range(channels) if k != alpha]
        expected[..., colours] *= expected[..., [alpha]]
    np.testing.assert_array_equal(pyramid.ready(pixels, table, alpha), expected)
    np.testing.assert_array_equal(pyramid.ready(pixels[:, ::2], table, alpha), expected[:, ::2])


@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("kind", [np.float32, np.uint8, np.uint16])
def test_the_nearest_texels(edge, kind):
    rng = np.random.default_rng(5)
    h, w, c = 9, 14, 3
    if kind is np.float32:
        ready = rng.random((h, w, c), dtype=np.float32)
        tex = pyramid.pyramid(ready, edge, reduced=False)
    else:
        pixels = rng.integers(0, np.iinfo(kind).max + 1, (h, w, c)).astype(kind)
        table = rng.random((np.iinfo(kind).max + 1, c), dtype=np.float32)
        tex, ready = pyramid.compact(pixels, table, 2, edge, reduced=False), pyramid.ready(pixels, table, 2)
    xy = rng.uniform((-2 * w, -2 * h), (3 * w, 3 * h), (300, 2))
    nearest = np.floor(xy).astype(int)
    beyond = ((nearest < 0) | (nearest >= (w, h))).any(axis=1)
    if edge in (pyramid.REPEAT, pyramid.MIRROR):
        j, i = (pyramid._inside(nearest[:, k], n, edge) for k, n in enumerate((w, h)))
    else:
        j, i = (np.clip(nearest[:, k], 0, n - 1) for k, n in enumerate((w, h)))
    expected = ready[i, j]
    if edge == pyramid.CLEAR:
        expected[beyond] = 0
    np.testing.assert_array_equal(filters.read(tex, xy, np.ones((300, 4)), filters.NEAREST), expected)
    assert beyond.any() and not beyond.all()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("name", ["linear", "cubic", "lanczos"])
def test_texels_that_are_stored_as_integers_count_as_they_are_decoded(kind, edge, name):
    rng = np.random.default_rng(6)
    pixels = rng.integers(0, np.iinfo(kind).max + 1, (31, 24, 4)).astype(kind)
    table = rng.random((np.iinfo(kind).max + 1, 4), dtype=np.float32)
    stored = pyramid.compact(pixels, table, 3, edge, reduced=False)
    ready = pyramid.pyramid(pyramid.ready(pixels, table, 3), edge, reduced=False)
    xy, turn = rng.uniform(-9, 40, (200, 2)), rng.normal(size=(200, 4))
    ours, theirs = (filters.read(tex, xy, turn, filters.FILTERS[name]) for tex in (stored, ready))
    # where the texture is magnified, the short way has weights in double precision
    assert ours == pytest.approx(theirs, abs=2e-6)


def test_places_in_a_picture():
    rng = np.random.default_rng(7)
    z, right, down = (rng.normal(size=50) + 1j * rng.normal(size=50) for _ in range(3))
    picture = texture.Texture(np.zeros((30, 20, 3), np.uint8), (complex(-1, -2), complex(3, 1)))
    places = picture.places(z, right.astype(np.complex64), down.astype(np.complex64))
    right, down = right.astype(np.complex64), down.astype(np.complex64)
    across, below = 20 / 4, 30 / 3
    expected = np.column_stack([(z.real + 1) * across, (1 - z.imag) * below])
    np.testing.assert_allclose(places.xy, expected, rtol=1e-15)
    turn = [right.real * across, down.real * across, -right.imag * below, -down.imag * below]
    np.testing.assert_allclose(places.jacobian, np.column_stack(turn), rtol=1e-7)


def test_bytes_are_those_of_the_formula():
    rng = np.random.default_rng(8)
    values = np.concatenate([rng.uniform(-0.2, 1.2, 4000), [np.nan, np.inf, -np.inf, 0, 1]]).astype(
        np.float32
    )
    values = values.reshape(1, -1, 5)
    encoded = colour.encode(values, np.dtype(np.uint8), 2, srgb=True)
    clipped = np.clip(np.nan_to_num(values.astype(float), posinf=1), 0, 1)
    expected = np.rint(colour.srgb_from_linear(clipped) * 255)
    expected[..., 2] = np.rint(clipped[..., 2] * 255)
    np.testing.assert_array_equal(encoded, expected)


@pytest.mark.parametrize("channels, alpha", [(3, 3), (4, 3), (1, 1), (4, 0), (6, 6)])
@pytest.mark.parametrize("clamped", [False, True])
def test_painted_pixels_are_placed_filtered_and_encoded(channels, alpha, clamped):
    rng = np.random.default_rng(9)
    rows, width, columns = 12, 33, (5, 29)
    tex = pyramid.pyramid(rng.random((40, 27, channels), dtype=np.float32), pyramid.CLAMP)
    z = rng.uniform(-1, 6, (rows, width)) + 1j * rng.uniform(-4, 5, (rows, width))
    right, down = (
        (0.3 * (rng.normal(size=z.shape) + 1j * rng.normal(size=z.shape))).astype(np.complex64) for _ in "12"
    )
    covered = np.where(rng.random(z.shape) < 0.3, 0, rng.random(z.shape)).astype(np.float32)
    band = Band(0, covered, z, right, down, Diagnostics())
    corner = (0.5, 4.0, 6.0, 5.0)
    painted = np.full((rows, width, max(channels, alpha + 1)), 7, np.uint8)
    filters.paint(tex, band, columns, corner, filters.CUBIC, clamped, alpha, painted)
    is_covered = covered > 0
    is_covered[:, : columns[0]] = is_covered[:, columns[1] :] = False
    assert (painted[~is_covered] == 7).all()
    z, right, down, share = (part[is_covered] for part in (z, right, down, covered))
    right, down = right.astype(complex), down.astype(complex)
    xy = np.column_stack([(z.real - 0.5) * 6, (4 - z.imag) * 5])
    turn = np.column_stack([right.real * 6, down.real * 6, -right.imag * 5, -down.imag * 5])
    values = filters.read(tex, xy, turn, filters.CUBIC, clamped)
    if alpha < channels:
        share = share * values[:, alpha]
        values /= np.where(values[:, [alpha]] == 0, 1, values[:, [alpha]])
        values[:, alpha] = share
    else:
        values = np.column_stack([values, share])
    expected = colour.encode(values[None], np.dtype(np.uint8), alpha, srgb=True)[0]
    np.testing.assert_array_equal(painted[is_covered], expected)


def test_pictures_that_are_parts_of_others_are_filtered():
    """Every second column, and three channels of four: arrays that are not contiguous."""
    rng = np.random.default_rng(11)
    wide = rng.random((20, 34, 4), dtype=np.float32)
    part = wide[:, ::2, :3]
    xy, turn = rng.uniform(0, 17, (40, 2))[::2], rng.normal(size=(4, 20)).T
    results = [
        filters.read(pyramid.pyramid(picture, pyramid.CLAMP), xy, turn, filters.CUBIC)
        for picture in (part, part.copy())
    ]
    np.testing.assert_array_equal(*results)
