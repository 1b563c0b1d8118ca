"""Several maps as one: a pixel shows the first part that covers it; no seams where parts meet; holes stay empty."""

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.pixels import preimages
from iccm.pixels.canvas import Canvas
from iccm.pixels.composed import Faded, Holed, PaintedMap, Reflected, Several
from iccm.pixels.coverage import coverage
from iccm.pixels.stmap import stmap
from iccm.pixels.texture import Texture
from iccm.pixels.warp import warp
from tests.triangulations import irregular, map_of, wavy

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def square(size, to, shift):
    """A map of the unit square onto one of another size and place, whose source lies elsewhere."""
    return map_of(irregular(SQUARE, 0.3), lambda w: w + shift).moved(image=(size, 0, to))


def several(*maps):
    return Several(maps, [Curve(np.concatenate([map.image[loop] for loop in map.loops])).box for map in maps])


def bands(map, canvas):
    source = preimages.of(map, canvas, 1e-3)
    return [source(row) for row in range(0, canvas.height, 32)]


def test_small_parts_lie_over_large_ones():
    below, above = square(8, 1 + 1j, 100), square(2, 4 + 4j, 200)
    canvas = Canvas(100, 100, (0, 10 + 10j))
    strips = bands(several(above, below), canvas)
    z, cover = (np.concatenate([getattr(band, name) for band in strips]) for name in ("z", "coverage"))
    assert (z[42:58, 42:58].real > 199).all() and (z[12:38, 12:88].real < 102).all()
    assert (cover[11:89, 11:89] == 1).all() and cover[:9].max() == 0 and np.isnan(z[:9]).all()
    assert np.isfinite(z[cover > 0]).all()
    alone = bands(below, canvas)
    assert np.array_equal(strips[0].z[:38], alone[0].z[:38], equal_nan=True)
    assert np.array_equal(strips[0].right[:38], alone[0].right[:38], equal_nan=True)


def test_parts_that_share_an_edge_leave_no_seam():
    left, right = square(5, 0, 0), square(5, 5, 10)
    canvas = Canvas(33, 33, (0, 10 + 10j))  # the edge runs through the middle of a column
    (band, last) = bands(several(left, right), canvas)
    cover = np.concatenate([band.coverage, last.coverage])
    assert np.abs(cover[18:] - 1).max() < 1e-5
    rows = np.concatenate(list(stmap(several(left, right), (0, 11 + 1j), canvas)))
    assert rows.shape == (33, 33, 4) and rows[25, 3, 0] < 0.1 < 0.9 < rows[25, 30, 0]


def test_edges_over_other_parts_are_mixed_by_the_area_that_each_covers():
    below, above = square(8, 1 + 1j, 0), square(3, 4.25 + 4.25j, 14)
    canvas = Canvas(10, 10, (0, 10 + 10j))
    pixels = np.zeros((10, 20, 3), np.uint8)
    pixels[:, :10], pixels[:, 10:] = (255, 0, 0), (0, 0, 255)
    texture = Texture(pixels, (0, 20 + 10j), transfer="linear")
    picture = warp(several(above, below), texture, canvas).pixels
    assert (picture[4, 2] == [255, 0, 0, 255]).all() and (picture[4, 5] == [0, 0, 255, 255]).all()
    left, right = picture[4, 4].astype(int), picture[4, 7].astype(int)  # three quarters and one quarter of it
    assert np.abs(left - [64, 0, 191, 255]).max() <= 1 and np.abs(right - [191, 0, 64, 255]).max() <= 1
    sharp = warp(several(above, below), texture, canvas, filter="nearest").pixels
    assert set(map(tuple, sharp[4, 1:9])) == {(255, 0, 0, 255), (0, 0, 255, 255)}


@pytest.mark.parametrize("orientation", [1, -1])
def test_pixels_in_holes_are_empty(orientation):
    map = map_of(irregular(SQUARE, 0.1), lambda w: w)
    canvas = Canvas(50, 50, (-0.1 - 0.1j, 1.1 + 1.1j))
    hole = 0.5 + 0.5j + 0.2 * np.exp(2j * np.pi * np.arange(100) / 100)[::orientation]
    whole = preimages.of(map, canvas, 1e-3)(0)
    band = preimages.of(Holed(map, [hole]), canvas, 1e-3)(0)
    pixel = canvas.step[0] * canvas.step[1]
    assert (whole.coverage.sum() - band.coverage.sum()) * pixel == pytest.approx(np.pi * 0.04, rel=1e-3)
    kept = band.coverage > 0
    assert np.array_equal(band.z[kept], whole.z[kept]) and np.isnan(band.z[~kept]).all()
    lost = whole.diagnostics.inside - band.diagnostics.inside
    assert lost * pixel == pytest.approx(np.pi * 0.04, rel=0.02)
    assert ((band.coverage > 0) & (band.coverage < 1)).sum() > (
        (whole.coverage > 0) & (whole.coverage < 1)
    ).sum()


@pytest.mark.parametrize("source", [None, 3.0])
@pytest.mark.parametrize("target", [None, 0.4])
def test_a_map_between_mirror_images_stands_for_one_between_the_planes(source, target):
    map = map_of(irregular(np.array([0, 1, 0.7 + 1j, 0.2j]), 0.1), wavy)
    canvas = Canvas(60, 40, (-0.3 - 0.1j, 1.5 + 1.2j))
    band = preimages.of(Reflected(map, source, target), canvas, 1e-3)(0)
    mirrored = (lambda w: w) if target is None else (lambda w: 2 * target - w.conj())
    loop = mirrored(map.image[map.loops[0]])
    assert band.coverage == pytest.approx(coverage(canvas.pixels(loop), 0, 40, 60)[0], abs=1e-5)
    inner = band.coverage == 1
    expected = map.inverse(mirrored(canvas.centres()[inner]))
    expected = expected if source is None else 2 * source - expected.conj()
    assert band.z[inner] == pytest.approx(expected, abs=1e-9)
    for axis, slope in ((1, band.right), (0, band.down)):
        step = np.diff(band.z, axis=axis)
        pairs = inner[:, :-1] & inner[:, 1:] if axis else inner[:-1] & inner[1:]
        before = slope[:, :-1] if axis else slope[:-1]
        assert np.abs(step - before)[pairs].max() < 0.2 * np.abs(step)[pairs].min()


def test_a_picture_is_cut_by_parts_with_holes():
    map = map_of(irregular(5 * SQUARE.real + 4j * SQUARE.imag, 0.5), lambda w: w)
    canvas = Canvas(50, 40, (0j, 5 + 4j))
    part = np.array([0.57 + 1j, 4 + 1j, 4 + 3.22j, 0.57 + 3.22j])
    hole = np.array([2 + 2j, 2 + 2.5j, 3 + 2.5j, 3 + 2j])
    island = np.array([4.5 + 0j, 5 + 0j, 5 + 0.5j, 4.5 + 0.5j])
    band = preimages.of(PaintedMap(map, [part, hole, island]), canvas, 1e-3)(0)
    area = band.coverage.sum() * canvas.step[0] * canvas.step[1]
    assert area == pytest.approx(3.43 * 2.22 - 0.5 + 0.25, rel=1e-5)
    assert (band.coverage[16:19, 21:29] == 0).all() and np.isnan(band.z[16:19, 21:29]).all()
    assert band.coverage[10, 5] == pytest.approx(0.3, abs=1e-5) and band.coverage[37, 47] == 1
    assert band.diagnostics.inside == (band.coverage >= 0.5).sum()


def test_a_picture_is_faded_outside_parts_and_stays_what_it_is_inside():
    map = map_of(irregular(5 * SQUARE.real + 4j * SQUARE.imag, 0.5), lambda w: w)
    canvas = Canvas(50, 40, (0j, 5 + 4j))
    part = np.array([0.57 + 1j, 4 + 1j, 4 + 3j, 0.57 + 3j])
    whole, faded = (preimages.of(of, canvas, 1e-3)(0) for of in (map, Faded(map, [part], 0.25)))
    assert faded.coverage[15, 20] == 1 and faded.coverage[2, 20] == pytest.approx(0.25)
    assert faded.coverage[15, 5] == pytest.approx(0.3 + 0.7 * 0.25, abs=1e-5)
    np.testing.assert_array_equal(faded.z, whole.z)
