"""Repeated or mirrored textures beyond their edges, without a seam at any scale."""

import numpy as np
import pytest

from iccm.pixels import filters, pyramid
from iccm.pixels.sampler import Sampler
from iccm.pixels.texture import Texture

RNG = np.random.default_rng(3)
PLACES = RNG.uniform(-1, 2, (300, 2))
TURNS = np.concatenate(
    [
        np.outer(scales, turn)
        for scales, turn in zip(
            2 ** RNG.uniform(-2, 6, (3, 100)), ((1, 0, 0, 1), (0.9, -0.4, 0.4, 0.9), (2, 0.5, 0.1, 0.6))
        )
    ]
)
KERNELS = [name for name in filters.FILTERS]


def _pyramid(edge: str, size: tuple[int, int], *, stored: bool = False) -> pyramid.Pyramid:
    pixels = np.random.default_rng(1).integers(0, 256, (*size, 3), dtype=np.uint8)
    decode = np.repeat(np.arange(256, dtype=np.float32)[:, None] / 255, 3, axis=1)
    if stored:
        return pyramid.compact(pixels, decode, -1, pyramid.EDGES[edge])
    return pyramid.pyramid(pyramid.ready(pixels, decode, -1), pyramid.EDGES[edge], spline=True)


@pytest.mark.parametrize("size", [(64, 64), (37, 50), (3, 2)])
@pytest.mark.parametrize("kind", KERNELS)
@pytest.mark.parametrize("stored", [False, True])
def test_a_texture_that_repeats_is_periodic_at_every_scale(size, kind, stored):
    tex = _pyramid("repeat", size, stored=stored)
    xy = PLACES * size[::-1]
    values = filters.read(tex, xy, TURNS, filters.FILTERS[kind])
    moved = filters.read(tex, xy + np.multiply(size[::-1], (-5, 3)), TURNS, filters.FILTERS[kind])
    assert moved == pytest.approx(values, abs=1e-5)


@pytest.mark.parametrize("size", [(64, 64), (37, 50)])
@pytest.mark.parametrize("kind", ["linear", "cubic", "lanczos", "spline"])
def test_a_texture_that_is_mirrored_is_even_about_its_edges(size, kind):
    tex = _pyramid("mirror", size)
    height, width = size
    xy = PLACES * (width, height)
    values = filters.read(tex, xy, TURNS, filters.FILTERS[kind])
    flip = TURNS * (-1, -1, 1, 1)
    about_left = filters.read(tex, xy * (-1, 1), flip, filters.FILTERS[kind])
    about_right = filters.read(tex, np.array([2 * width, 0]) + xy * (-1, 1), flip, filters.FILTERS[kind])
    again = filters.read(tex, xy + np.array([0, 2 * height]), TURNS, filters.FILTERS[kind])
    for copy in (about_left, about_right, again):
        assert copy == pytest.approx(values, abs=2e-5)


@pytest.mark.parametrize("kind", ["linear", "cubic", "lanczos"])
def test_a_tile_is_filtered_as_the_same_tiles_side_by_side(kind):
    tile = np.random.default_rng(2).random((64, 64, 3)).astype(np.float32)
    single = pyramid.pyramid(tile, pyramid.REPEAT)
    many = pyramid.pyramid(np.tile(tile, (8, 8, 1)), pyramid.CLAMP)
    few = TURNS[np.abs(TURNS).max(axis=1) < 8]  # whose kernels stay among these
    xy = 256 + 64 * PLACES[: len(few)]
    effect, expected = (filters.read(tex, xy, few, filters.FILTERS[kind]) for tex in (single, many))
    assert effect == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("edge", "mode"), [("repeat", "wrap"), ("mirror", "symmetric"), ("clamp", "edge")])
def test_a_spline_through_a_tile_is_that_through_all_around_it(edge, mode):
    tile = np.random.default_rng(2).random((20, 26, 2)).astype(np.float32)
    single = pyramid.pyramid(tile, pyramid.EDGES[edge], spline=True)
    many = pyramid.pyramid(np.pad(tile, [(40, 40), (40, 40), (0, 0)], mode=mode), pyramid.CLAMP, spline=True)
    xy = np.random.default_rng(3).uniform(-3, [29, 23], (300, 2))
    magnified = np.tile([0.3, 0.1, -0.1, 0.3], (300, 1))
    effect = filters.read(single, xy, magnified, filters.SPLINE)
    assert effect == pytest.approx(filters.read(many, xy + 40, magnified, filters.SPLINE), abs=1e-4)


@pytest.mark.parametrize(("edge", "mode"), [("repeat", "wrap"), ("mirror", "symmetric")])
def test_reductions_of_a_tile_are_those_of_all_around_it(edge, mode):
    tile = np.random.default_rng(2).random((64, 48, 2)).astype(np.float32)
    single = pyramid.pyramid(tile, pyramid.EDGES[edge])
    many = pyramid.pyramid(np.pad(tile, [(64, 64), (64, 64), (0, 0)], mode=mode), pyramid.CLAMP)
    xy = np.random.default_rng(3).uniform(-4, [52, 68], (300, 2))
    wide = np.tile([3.0, 0.5, -0.4, 2.6], (300, 1))
    effect = filters.read(single, xy, wide, filters.LINEAR)
    assert effect == pytest.approx(filters.read(many, xy + 64, wide, filters.LINEAR), abs=1e-5)


@pytest.mark.parametrize("stored", [False, True])
@pytest.mark.parametrize("edge", list(pyramid.EDGES))
def test_rows_that_are_reduced_strip_by_strip_are_those_reduced_at_once(edge, stored, monkeypatch):
    whole = _pyramid(edge, (200, 7), stored=stored).complete().texels
    monkeypatch.setattr(pyramid, "STRIP_ROWS", 1000)
    assert np.array_equal(_pyramid(edge, (200, 7), stored=stored).complete().texels, whole)


def test_a_rotated_texture_is_where_its_rotation_places_it():
    pixels = np.random.default_rng(5).integers(0, 256, (8, 8, 3), dtype=np.uint8)
    plain = Texture(pixels, (1 + 1j, 5 + 5j))
    turned = Texture(np.rot90(pixels).copy(), (1 + 1j, 5 + 5j), rotation=-1j)  # back again
    z = 3 + 3j + RNG.uniform(-1.9, 1.9, 50) + 1j * RNG.uniform(-1.9, 1.9, 50)
    right, down = np.full(50, 0.3 + 0.1j, np.complex64), np.full(50, 0.2 - 0.4j, np.complex64)
    values = [Sampler(texture).values(texture.places(z, right, down)) for texture in (plain, turned)]
    assert values[1] == pytest.approx(values[0], abs=1e-5)
