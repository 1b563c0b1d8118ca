"""Charts packed into a region: separate, inside, at one scale, and without wasting space."""

import numpy as np
import pytest
import shapely

from iccm.arrays import xy_of
from iccm.errors import InputError
from iccm.meshes.packing import GRID_CELLS_ACROSS, pack


def chart(rng, size):
    """A star-shaped polygon as a fan of triangles around its last vertex."""
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    radius = 1 + 0.35 * np.sin(3 * angle + rng.uniform(0, 6)) + 0.15 * np.cos(5 * angle)
    rim = size * radius * (1.7 * np.cos(angle) + 1j * np.sin(angle)) * np.exp(1j * rng.uniform(0, 6))
    faces = np.column_stack([np.full(24, 24), np.arange(24), np.roll(np.arange(24), -1)])
    return np.append(rim, 0) + complex(*rng.normal(size=2)), faces


def charts_of(count, seed=3):
    rng = np.random.default_rng(seed)
    return [chart(rng, np.exp(rng.normal() * 0.8)) for _ in range(count)]


def regions(charts, packing):
    return [shapely.Polygon(xy_of(packing.of(flat, k)[:-1])) for k, (flat, _) in enumerate(charts)]


@pytest.mark.parametrize("rotates", [True, False])
@pytest.mark.parametrize("count", [1, 7, 60])
def test_charts_are_apart_by_the_margin_and_inside(count, rotates):
    charts, margin = charts_of(count), 6
    square = shapely.box(10, -3, 14, 1)
    packing = pack(charts, square, margin=margin, rotates=rotates)
    placed = regions(charts, packing)
    texel = 4 / GRID_CELLS_ACROSS
    assert all(square.buffer(-margin / 2 * texel).covers(region) for region in placed)
    away = [a.distance(b) for k, a in enumerate(placed) for b in placed[:k]]
    assert min(away, default=1) >= margin * texel
    assert np.ptp(np.abs(packing.factor)) < 1e-12 * np.abs(packing.factor[0])
    assert packing.filled == pytest.approx(sum(region.area for region in placed) / square.area)
    if not rotates:
        assert (packing.factor.imag == 0).all() and (packing.factor.real > 0).all()


def test_small_charts_fill_most_of_a_square():
    assert pack(charts_of(60), shapely.box(0, 0, 1, 1), margin=2, rotates=True).filled > 0.65


def test_any_outline_is_filled_but_not_its_holes():
    heart = shapely.Point(0, 0).buffer(1).union(shapely.Point(1.4, 0.3).buffer(0.8))
    region = heart.difference(shapely.box(-0.4, -0.1, 0.2, 0.5))
    charts = charts_of(25)
    packing = pack(charts, region, margin=3, rotates=False)
    assert all(region.covers(chart) for chart in regions(charts, packing))
    assert packing.filled > 0.35


def test_copies_take_different_places():
    outline = chart(np.random.default_rng(5), 1.0)
    packing = pack([outline] * 30, shapely.box(0, 0, 1, 1), margin=1, rotates=True)
    placed = regions([outline] * 30, packing)
    assert shapely.union_all(placed).area == pytest.approx(sum(copy.area for copy in placed))


def test_a_long_chart_lies_diagonally_nowhere():
    """Its smallest rectangle is upright after packing, so that it wastes no space."""
    strip = np.array([0, 10, 10 + 1j, 1j]) * np.exp(0.6j)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    packing = pack([(strip, faces)] * 4, shapely.box(0, 0, 1, 1), margin=2, rotates=True)
    sides = np.diff(packing.of(strip, 2))
    assert np.minimum(np.abs(sides.real), np.abs(sides.imag)).max() < 1e-9


def test_the_longest_chart_may_lie_diagonally_where_that_leaves_more_room():
    strip = np.array([0, 10, 10 + 1j, 1j])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    packing = pack([(strip, faces), (strip / 4, faces)], shapely.box(0, 0, 1, 1), margin=2)
    assert np.abs(packing.factor[0]) > 0.12  # upright, its scale is a tenth at most
    assert np.isclose(abs(packing.factor[0].real), abs(packing.factor[0].imag))


def test_charts_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="no room"):
        pack(charts_of(400), shapely.box(0, 0, 1, 1), margin=200, rotates=False)
