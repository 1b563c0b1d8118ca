"""Cracks of results, compared with this test's own raster."""

import numpy as np
import pytest
import shapely

import iccm
from iccm.drawings.cracks import crack_share
from iccm.drawings.drawing import Drawing
from tests.cases import slow

SIDE = 512
STAR = shapely.Polygon(
    [
        (3 + r * np.cos(a), 2 + r * np.sin(a))
        for k, a in enumerate(np.arange(10) * np.pi / 5 + 0.3)
        for r in [2 if k % 2 else 0.9]
    ]
)
PLATE = shapely.union(shapely.Point(10, 4).buffer(3), shapely.box(9, 1.5, 16, 6))


def counted(target, covered):
    """The share of a target that a closing of the visible area fills, by distances between pixel centres.

    `covered` returns whether something is visible at points of the target's plane.
    """
    left, low, right, high = target.bounds
    step = max(right - left, high - low) / SIDE
    x = np.arange(left - 4.5 * step, right + 5 * step, step)
    y = np.arange(low - 4.5 * step, high + 5 * step, step)
    w = x[None, :] + 1j * y[:, None]
    painted = shapely.contains_xy(target, w.real, w.imag)
    result = painted & covered(w)
    disc = [(i, j) for i in range(-3, 4) for j in range(-3, 4) if i * i + j * j <= 9]
    grown = np.any([np.roll(result, shift, (0, 1)) for shift in disc], axis=0)
    closed = np.all([np.roll(grown, shift, (0, 1)) for shift in disc], axis=0)
    return (closed & painted & ~result).sum() / painted.sum()


def test_a_slit_is_a_crack_and_a_gap_is_not():
    plate = Drawing(shapely.box(0, 0, 100, 60))
    for width, expected in ((1.0, 0.01), (0.6, 0.006), (2.5, 0.0)):
        halves = [np.array([0, 40, 40 + 60j, 60j]), np.array([40 + width, 100, 100 + 60j, 40 + width + 60j])]
        assert crack_share(plate, [halves]) == pytest.approx(expected, abs=0.0015)


def test_gaps_of_the_target_are_not_cracks():
    split = Drawing(shapely.union(shapely.box(0, 0, 40, 60), shapely.box(40.7, 0, 100, 60)))
    all_of_it = [np.array([-1 - 1j, 101 - 1j, 101 + 61j, -1 + 61j])]
    assert crack_share(split, [all_of_it]) == 0


@pytest.mark.parametrize("fit", [slow("contain"), "auto"])
def test_the_cracks_of_a_map_are_those_of_its_picture(fit):
    bars = shapely.MultiPolygon([STAR, shapely.transform(STAR, lambda xy: 0.9 * xy + [3.1, 1.4])])
    result = iccm.fit(bars, PLATE, fit=fit, opaque=False)

    def is_covered(w):
        z = result.inverse(w)
        inside = np.isfinite(z)
        return inside & shapely.contains_xy(bars, np.where(inside, z, 0).real, np.where(inside, z, 0).imag)

    by_hand = counted(PLATE, is_covered)
    assert result.report()["cracks"] == pytest.approx(by_hand, abs=0.002)


@pytest.mark.slow
def test_visible_cracks_get_a_note():
    two = shapely.MultiPolygon([shapely.box(0, 0, 4.97, 6), shapely.box(5.03, 0, 10, 6)])
    whole = shapely.box(0, 0, 20, 12.5)
    cracked, painted = (iccm.fit(two, whole, fit="frame", opaque=opaque) for opaque in (False, True))
    assert cracked.report()["cracks"] == pytest.approx(0.006, abs=0.0025)  # up to a pixel
    assert any("cracks" in note.lower() for note in cracked.report()["notes"])
    assert painted.report()["cracks"] == 0
    assert not any("cracks" in note.lower() for note in painted.report()["notes"])


@pytest.mark.slow
def test_plots_hatch_the_area_that_figures_count():
    sign, shield = shapely.box(0, 0, 5, 3), shapely.Polygon([(0, 9), (8, 10), (8, 5), (4.5, 0), (0, 4)])
    for place, side in (("inside", 1), ("slice", 0)):
        fit = iccm.fit(sign, shield, place=place)
        areas = [
            region.area / whole.area
            for region, whole in zip(fit.coverage.unseen, (sign, shield), strict=True)
        ]
        assert areas[side] == pytest.approx(fit.coverage.bare if side else fit.coverage.hidden, abs=2e-3)
        assert areas[1 - side] == pytest.approx(0, abs=1e-3)
    two = shapely.MultiPolygon([STAR, shapely.transform(STAR, lambda xy: 0.9 * xy + [3.1, 1.4])])
    fit = iccm.fit(two, PLATE, fit="frame", opaque=False)
    hidden, bare = fit.coverage.unseen
    assert bare.area / PLATE.area == pytest.approx(fit.coverage.bare, abs=0.01)
    assert hidden.area / two.area == pytest.approx(fit.coverage.hidden, abs=0.01)
