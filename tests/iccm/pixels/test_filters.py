"""Filters compared with their definition, evaluated in double precision with NumPy's singular values."""

import numpy as np
import pytest

from iccm.pixels import filters, pyramid

# constants of core/pixels/filters.h
LONGEST = 8.0  # relative to the shortest axis of a kernel: beyond this, that axis is widened
MOST = 232  # largest number of rows and columns of a kernel


KERNELS = {
    "linear": (1, lambda x: np.maximum(0, 1 - np.abs(x))),
    "cubic": (2, lambda x: np.where(x < 1, (1.5 * x - 2.5) * x**2 + 1, np.where(x < 2, (1 - x) * (2 - x)**2 / 2, 0))),
    "lanczos": (3, lambda x: np.where(x < 3, np.sinc(x) * np.sinc(x / 3), 0)),
}  # fmt: skip


def axes(turn):
    """S, with no axis below one texel or an eighth of the longest; that of a point if it is not finite."""
    matrix = turn.reshape(2, 2)
    if not np.isfinite(matrix).all():
        return np.eye(2)
    vectors, values, _ = np.linalg.svd(matrix)
    values = np.maximum(values, 1)
    return vectors @ np.diag(np.maximum(values, values.max() / LONGEST)) @ vectors.T


def defined(tex, level, place, stretch, name):
    """The mean of a level's texels around a place, weighted by k(u) k(v), (u, v) = S⁻¹ d."""
    size, h, w = tex.size[level], tex.height[level], tex.width[level]
    pixels = tex.base if level == 0 else tex.texels[tex.start[level] :][: h * w].reshape(h, w, -1)
    radius, kernel = KERNELS[name]
    if np.linalg.eigvalsh(stretch).min() >= 4 * size:
        stretch = 4 * size * np.eye(2)
    x, y = place / size
    reach = int(radius * np.linalg.norm(stretch / size, 2) * 1.5) + 2
    i, j = (np.arange(int(v) - reach, int(v) + reach) for v in (y, x))
    away = np.stack(np.meshgrid(j + 0.5 - x, i + 0.5 - y), axis=2) @ np.linalg.inv(stretch / size)
    weights = kernel(np.abs(away[..., 0])) * kernel(np.abs(away[..., 1]))
    texels = pixels[np.clip(i, 0, h - 1)][:, np.clip(j, 0, w - 1)].astype(float)
    if tex.edge == pyramid.CLEAR:
        texels[(i < 0) | (i >= h)] = 0
        texels[:, (j < 0) | (j >= w)] = 0
    return np.einsum("ij,ijk->k", weights, texels) / weights.sum()


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("channels", [1, 3, 4, 6])
@pytest.mark.parametrize("edge", [pyramid.CLAMP, pyramid.CLEAR])
@pytest.mark.parametrize("shape", [(60, 45), (3, 5), (1, 1)])
def test_a_filter_agrees_with_its_definition(name, channels, edge, shape):
    rng = np.random.default_rng(5)
    tex = pyramid.pyramid(rng.random((*shape, channels), dtype=np.float32), edge)
    tex.complete()
    xy = rng.uniform(-4, np.array(shape[::-1]) + 4, (60, 2))
    turn = rng.normal(0, 1, (60, 4)) * 10 ** rng.uniform(-1, 1.5, (60, 1))
    xy[0], turn[0] = np.round(xy[0]) + 0.5, (1, 0, 0, 1)
    turn[1], turn[2] = np.nan, 0
    effect = filters.read(tex, xy, turn, filters.FILTERS[name])
    for place, matrix, value in zip(xy, turn, effect):
        stretch = axes(matrix)
        short = np.linalg.eigvalsh(stretch).min()
        level = int(np.flatnonzero(tex.size <= short * (1 + 1e-12)).max())
        assert value == pytest.approx(defined(tex, level, place, stretch, name), abs=2e-6)


def test_the_longest_kernel_has_room():
    """Axes of 32 and 4 texels: the largest before a level is left, while the smallest level has no next one."""
    tex = pyramid.compact(
        np.full((300, 300, 1), 200, np.uint8), np.linspace(0, 1, 256, dtype=np.float32)[:, None], -1, 0
    )
    for lean in np.linspace(0, np.pi, 33):
        turn = np.array([[np.cos(lean), -np.sin(lean)], [np.sin(lean), np.cos(lean)]]) @ np.diag(
            [31.99, 3.999]
        )
        stretch = axes(turn.ravel())
        reach = 3 * np.abs(stretch).sum(axis=1).max()
        assert 2 * reach + 1 <= MOST
        assert filters.read(
            tex, np.full((1, 2), 150.0), turn.reshape(1, 4), filters.LANCZOS
        ) == pytest.approx(200 / 255)


def taps(tex, place, stretch):
    """The rectangle of the picture's own texels that a cubic kernel reads there."""
    reach = 2 * np.abs(stretch).sum(axis=1)
    first, last = np.ceil(place - reach - 0.5).astype(int), np.floor(place + reach - 0.5).astype(int)
    i, j = (np.clip(np.arange(first[k], last[k] + 1), 0, tex.base.shape[1 - k] - 1) for k in (1, 0))
    return tex.base[i][:, j].reshape(-1, tex.base.shape[2])


@pytest.mark.parametrize("channels", [1, 3, 4, 6])
def test_a_clamped_kernel_stays_within_its_texels(channels):
    """Elsewhere it is the unclamped one: where the texture is magnified, where it is not, and at its edge."""
    rng = np.random.default_rng(6)
    tex = pyramid.pyramid(rng.random((40, 50, channels), dtype=np.float32).round(), pyramid.CLAMP)
    xy = rng.uniform(-2, [52, 42], (400, 2))
    turn = rng.normal(0, 0.6, (400, 4))
    plain, clamped = (filters.read(tex, xy, turn, filters.CUBIC, clamp) for clamp in (False, True))
    changed = 0
    for place, matrix, before, after in zip(xy, turn, plain, clamped):
        texels = taps(tex, place, axes(matrix))
        assert after == pytest.approx(np.clip(before, texels.min(axis=0), texels.max(axis=0)), abs=1e-6)
        changed += bool((after != before).any())
    assert changed > 100


def stripes(height, width, wavelength, lean):
    """Stripes of two colours, 100 and 200, as (h, w, 1) uint8."""
    i, j = np.mgrid[:height, :width]
    phase = (np.cos(lean) * j + np.sin(lean) * i) / wavelength
    return np.where(phase % 1 < 0.5, 100, 200).astype(np.uint8)[..., None]


@pytest.mark.parametrize("edge", list(pyramid.EDGES.values()))
@pytest.mark.parametrize("stored", [False, True])
def test_a_picture_that_is_shrunk_keeps_the_range_of_its_texels(edge, stored):
    """The reductions that a clamped kernel reads keep it, too, for any number of levels in between."""
    texels = stripes(512, 384, 41.3, 0.4)
    table = np.linspace(0, 1, 256, dtype=np.float32)[:, None]
    low, high = (pyramid.ready(np.full((1, 1, 1), v, np.uint8), table, -1).item() for v in (100, 200))
    if stored:
        tex = pyramid.compact(texels, table, -1, edge, clamped=True)
    else:
        tex = pyramid.pyramid(pyramid.ready(texels, table, -1), edge, clamped=True)
    for factor in (1.5, 2.3, 6.8, 13.1):
        centres = np.arange(factor / 2 + 24, 360, factor)
        xy = np.stack(np.meshgrid(centres, centres), axis=2).reshape(-1, 2)
        value = filters.read(tex, xy, np.tile([factor, 0, 0, factor], (len(xy), 1)), filters.CUBIC, True)
        if edge == pyramid.CLEAR:  # transparent black is among the texels near the edge
            value = value[np.abs(xy - [192, 256]).max(axis=1) < 60]
        assert low - 1e-6 <= value.min() and value.max() <= high + 1e-6


def contrast(clamped, factor, wavelength):
    """The modulation transfer at a wavelength, in pixels of a picture reduced by a factor."""
    i, j = np.mgrid[:512, :512]
    across, down = 2 * np.pi / (factor * wavelength) * np.array([np.cos(0.3), np.sin(0.3)])
    wave = 0.5 + 0.2 * np.sin(across * j + down * i)
    tex = pyramid.pyramid(wave.astype(np.float32)[..., None], pyramid.CLAMP, clamped=clamped)
    centres = np.arange(100, 412, factor)
    xy = np.stack(np.meshgrid(centres, centres), axis=2).reshape(-1, 2)
    values = filters.read(tex, xy, np.tile([factor, 0, 0, factor], (len(xy), 1)), filters.CUBIC, clamped)
    phase = (xy - 0.5) @ [across, down]
    waves = np.stack([np.sin(phase), np.cos(phase), np.ones_like(phase)], axis=1)
    sine, cosine, _ = np.linalg.lstsq(waves, values[:, 0], rcond=None)[0]
    return np.hypot(sine, cosine) / 0.2


@pytest.mark.parametrize("factor", [2.0, 6.8])
@pytest.mark.parametrize("wavelength", [16, 8, 4, 3])
def test_a_range_that_is_kept_costs_no_sharpness(factor, wavelength):
    plain, clamped = (contrast(clamp, factor, wavelength) for clamp in (False, True))
    assert plain >= clamped > 0.98 * plain
    assert clamped > {16: 0.99, 8: 0.98, 4: 0.9, 3: 0.69}[wavelength]
