"""Pixels of triangulated maps: each equals the inverse at its centre, none is missing, and threads change nothing."""

from dataclasses import replace

import numpy as np
import pytest

from iccm.maps.triangulated.map import TriangulatedMap
from iccm.parallel import in_order
from iccm.pixels.canvas import BAND_ROWS, Canvas
from iccm.pixels.coverage import coverage
from iccm.pixels.triangulated_preimages import Blocks, TriangulatedPreimages
from tests.shapes import arrow, ell
from tests.triangulations import irregular, lattice, map_of, ring, wavy

BOX = (-0.1 - 0.2j, 1.1 + 1.05j)
MAPS = {
    "scattered": lambda: map_of(irregular(np.array([0, 1, 1 + 1j, 1j]), 0.1), wavy),
    "sides on centres": lambda: map_of(lattice(16), wavy),
    "ring": lambda: moved(map_of(ring(40, 5), lambda w: w + 0.05 * w**2), 0.25, 0.5 + 0.5j),
    "ell": lambda: moved(map_of(irregular(ell(), 0.3), lambda w: w * 1.3j), 0.5, 0),
    "arrow": lambda: moved(map_of(irregular(arrow(), 0.2), lambda w: w + 0.02 * w**2), 0.2, 0.1 + 0.3j),
    "triangles smaller than pixels": lambda: map_of(irregular(np.array([0, 1, 1 + 1j, 1j]), 0.012), wavy),
}
CANVASES = {
    "oblong pixels": Canvas(231, 150, BOX),
    "whole steps": Canvas(160, 160, (-0.25 - 0.25j, 1.0 + 1.0j)),
    "a part": Canvas(200, 300, (0.31 + 0.27j, 0.74 + 0.81j)),
}


def moved(map, scale, to):
    return map.moved(image=(scale, 0, to))


@pytest.fixture(params=MAPS)
def map(request) -> TriangulatedMap:
    return MAPS[request.param]()


@pytest.fixture(params=CANVASES)
def canvas(request) -> Canvas:
    return CANVASES[request.param]


def whole(map, canvas, threads=1):
    source = TriangulatedPreimages(map, canvas)
    bands = list(in_order(source.band, range(0, canvas.height, BAND_ROWS), threads))
    arrays = (
        np.concatenate([getattr(band, name) for band in bands]) for name in ("z", "right", "down", "coverage")
    )
    return (
        *arrays,
        sum(band.diagnostics.inside for band in bands),
        sum(band.diagnostics.edge for band in bands),
    )


def located(map, w):
    """Whether points are inside, farther from the outline than rounding, and as far from the triangles' sides."""
    triangle, place = map._image_locator(w.ravel())
    away = map.image_rim.closest(w.ravel())[2]
    facts = triangle >= 0, away > 1e-9, np.abs(place).min(axis=1) > 1e-9
    return (fact.reshape(w.shape) for fact in facts)


def test_every_pixel_is_the_inverse_at_its_centre(map, canvas):
    z, right, down, covered, inside, edge = whole(map, canvas)
    w = canvas.centres()
    expected, z_w, z_wbar = map.inverse_jet(w)
    within, clear, off_sides = located(map, w)
    ask = within & clear
    assert np.abs(z - expected)[ask].max() < 1e-11 * map.diagonal
    dx, dy = canvas.step
    across, below = (z_w + z_wbar) * dx, -1j * (z_w - z_wbar) * dy
    size = np.abs(across[ask]).max() + np.abs(below[ask]).max()
    for slope, exact in ((right, across), (down, below)):
        error = np.abs(slope - exact)
        assert error[ask & off_sides].max(initial=0) < 1e-6 * size
        assert error[ask].max() < 0.3 * size  # on a side of two triangles, either one's is acceptable
    assert np.isnan(z[~within & clear & (covered == 0)]).all()
    assert abs(inside - within.sum()) <= (~clear).sum()
    assert inside + edge == np.isfinite(z).sum()


def test_all_that_is_covered_has_a_source_point(map, canvas):
    z, right, down, covered, *_ = whole(map, canvas)
    for values in (z, right, down):
        assert np.isfinite(values[covered > 0]).all()
    area = np.prod(canvas.step) * covered.sum()
    if canvas.box[0].real < 0:
        u, v = map.corners[:, 1] - map.corners[:, 0], map.corners[:, 2] - map.corners[:, 0]
        assert area == pytest.approx(0.5 * (u.conj() * v).imag.sum(), rel=1e-6)


def test_touched_pixels_take_the_nearest_boundary_point():
    map, canvas = MAPS["arrow"](), CANVASES["oblong pixels"]
    z, right, down, _, _, edge = whole(map, canvas)
    w = canvas.centres()
    outside = np.isfinite(z) & ~next(iter(located(map, w)))
    assert outside.sum() == edge > 100
    nearest, away = map.extended_inverse(w[outside])
    assert away.max() < np.hypot(*canvas.step)
    assert np.abs(z[outside] - nearest).max() < 1e-12
    _, z_w, z_wbar = replace(map, near=0.1).inverse_jet(w[outside])
    dx, dy = canvas.step
    assert np.allclose(right[outside], (z_w + z_wbar) * dx, rtol=1e-6)
    assert np.allclose(down[outside], -1j * (z_w - z_wbar) * dy, rtol=1e-6)


def test_slopes_are_the_changes_from_pixel_to_pixel():
    """Neither mirrored, rotated nor shifted: compared with differences of pixels."""
    map = MAPS["scattered"]()
    z, right, down, *_ = whole(map, Canvas(400, 300, BOX))
    across, below = 0.5 * (z[:, 2:] - z[:, :-2]), 0.5 * (z[2:] - z[:-2])
    for change, slope in ((across, right[:, 1:-1]), (below, down[1:-1])):
        finite = np.isfinite(change) & np.isfinite(slope)
        assert np.quantile(np.abs(change - slope)[finite], 0.98) < 0.02 * np.abs(slope[finite]).mean()


def test_a_gap_between_neighbours_would_show(map):
    """The number of pixels inside agrees with the outline's winding numbers, for any triangles."""
    for seed in range(5):
        shift = complex(*np.random.default_rng(seed).uniform(-0.1, 0.1, 2))
        canvas = Canvas(97, 103, (BOX[0] + shift, BOX[1] + shift))
        preimages = TriangulatedPreimages(map, canvas)
        inside = coverage(preimages.loop, 0, canvas.height, canvas.width)[1]
        z = np.concatenate([preimages.band(row).z for row in range(0, canvas.height, BAND_ROWS)])
        clear = map.image_rim.closest(canvas.centres().ravel())[2].reshape(z.shape) > 1e-9
        assert np.isfinite(z[inside & clear]).all()


def test_threads_change_nothing():
    map, canvas = MAPS["ring"](), Canvas(333, 777, BOX)
    for by_one, by_five in zip(whole(map, canvas, 1), whole(map, canvas, 5)):
        assert np.array_equal(by_one, by_five, equal_nan=True)


def test_a_band_is_the_same_alone():
    map, canvas = MAPS["arrow"](), Canvas(300, 400, BOX)
    preimages = TriangulatedPreimages(map, canvas)
    first, second = preimages.band(128), preimages.band(256)
    again = preimages.band(128)
    assert first.z is not again.z
    assert np.array_equal(first.z, again.z, equal_nan=True)
    assert second.z.shape == (128, 300)
    assert preimages.band(384).z.shape == (16, 300)


def test_memory_comes_back_only_when_nobody_looks():
    blocks = Blocks(40)
    z, right, down, state = blocks.arrays(128, 40)
    part, turned = z[3:9, ::2].ravel()[1:], down.T
    del z, right, down, state
    assert not blocks.free
    del part
    assert not blocks.free
    del turned
    assert len(blocks.free) == 1
    small = blocks.arrays(7, 40)
    assert not blocks.free
    del small
    assert all(values.shape == (128, 40) for values in blocks.arrays(128, 40))


def test_nothing_in_sight():
    map = MAPS["ring"]()
    z, *_, covered, inside, edge = whole(map, Canvas(50, 40, (10 + 10j, 11 + 11j)))
    assert np.isnan(z).all()
    assert not covered.any()
    assert inside == edge == 0
