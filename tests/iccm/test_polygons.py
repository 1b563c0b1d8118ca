"""Regions of many parts: equal to GEOS's results for the whole."""

import numpy as np
import pytest
import shapely

from iccm import deadline
from iccm.drawings.frame import HAIRLINE_WIDTH_SHARE, close_hairlines
from iccm.polygons import fill_holes, neighbourhoods, offset, offset_each, polygons_of, simplify_each, unite

RING = shapely.Polygon([(0, 0), (5, 0), (6, 4), (0, 5)], [[(1, 1), (4, 1), (4, 3), (1, 3)]])
ISLAND = shapely.Polygon([(2, 1.5), (3, 1.5), (2.5, 2.5)])
FAR = shapely.box(20, 0, 21, 3)


def test_a_union_joins_overlapping_or_touching_polygons_only():
    parts = [shapely.box(0, 0, 2, 1), shapely.box(1, 0, 3, 2), shapely.box(3, 0, 4, 1), FAR]
    union = unite(
        [shapely.MultiPolygon(parts[:1]), *parts[1:], shapely.Polygon(), shapely.LineString([(0, 0), (9, 9)])]
    )
    assert union.is_valid and union.geom_type == "MultiPolygon" and len(union.geoms) == 2
    assert union.equals(shapely.union_all(parts))


@pytest.mark.parametrize("nothing", [[], [shapely.Polygon()], shapely.GeometryCollection()])
def test_the_union_of_nothing_is_empty(nothing):
    assert unite(nothing).geom_type == "Polygon" and unite(nothing).is_empty
    assert not len(polygons_of(nothing))


def test_filling_holes_absorbs_the_parts_in_them():
    filled = fill_holes(shapely.MultiPolygon([RING, ISLAND, FAR]))
    assert filled.equals(shapely.MultiPolygon([shapely.Polygon(RING.exterior), FAR]))


@pytest.mark.parametrize("distance", [0.3, -0.4, 8.0])
def test_an_offset_of_parts_is_that_of_the_region(distance):
    region = shapely.MultiPolygon([RING, ISLAND, FAR])
    whole = shapely.buffer(region, distance, join_style="mitre")
    result = offset(region, distance, join_style="mitre")
    assert result.is_valid and result.symmetric_difference(whole).area < 1e-9 * whole.area


def test_neighbourhoods_hold_each_part_and_its_surroundings():
    region = shapely.MultiPolygon([RING, ISLAND, FAR])
    areas = list(neighbourhoods(region, 0.6))
    assert [share for _, share in areas] == [0.5, 0.5, 1.0]
    assert areas[0][0].equals(shapely.MultiPolygon([RING, ISLAND])) and areas[2][0].equals(FAR)
    around, reach = areas[1][0], shapely.box(*ISLAND.bounds).buffer(0.6, join_style="mitre")
    assert around.symmetric_difference(shapely.union(ISLAND, RING.intersection(reach))).area < 1e-12


def test_hairlines_of_many_parts_are_those_of_the_region():
    rng = np.random.default_rng(5)
    heights = 1 + rng.random(12)
    boxes = [shapely.box(k, 0, k + 1 - 1e-3, height) for k, height in enumerate(heights)]
    boxes[6] = shapely.box(6.2, 0, 7 - 1e-3, heights[6])  # one gap is wide
    region = shapely.MultiPolygon(boxes)
    half = 0.5 * HAIRLINE_WIDTH_SHARE * np.sqrt(region.convex_hull.area)
    assert half > 0.5e-3
    closed = close_hairlines(region)
    assert [len(part.interiors) for part in closed.geoms] == [0, 0]
    expected = shapely.union_all([*boxes, shapely.buffer(shapely.buffer(region, half), -half)])
    assert closed.symmetric_difference(expected).area < 1e-4 * region.area


def test_offsets_end_when_the_time_is_over(monkeypatch):
    now = 0.0
    monkeypatch.setattr(deadline.time, "monotonic", lambda: now)
    with deadline.limited(5.0):
        now = 6.0
        with pytest.raises(deadline.TimeUp, match="drawing"):
            offset(RING, 0.1)


def test_small_regions_are_offset_as_large_ones_are(monkeypatch):
    """Whether GEOS gets all parts of a region at once, or one by one; for regions of one part and of touching parts."""
    touching = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1, 0, 2, 3)])
    regions = np.array([RING, touching, shapely.MultiPolygon([RING, ISLAND, FAR])], dtype=object)
    at_once = {distance: offset_each(regions, distance, join_style="mitre") for distance in (0.3, -0.1)}
    monkeypatch.setattr("iccm.polygons.SMALL_REGION_PARTS", 0)
    monkeypatch.setattr("iccm.polygons.REGIONS_AT_ONCE", 2)
    for distance, offsets in at_once.items():
        apart = offset_each(regions, distance, join_style="mitre")
        for whole, by_parts in zip(offsets[[0, 2]], apart[[0, 2]]):
            assert whole.symmetric_difference(by_parts).area < 1e-9
    assert at_once[0.3][1].symmetric_difference(offset(touching, 0.3, join_style="mitre")).area < 1e-9


def test_a_valid_region_is_returned_as_it_is_and_one_that_overlaps_is_united():
    apart = shapely.MultiPolygon([RING, ISLAND, FAR])
    assert unite(apart).equals_exact(apart) and unite([apart, shapely.Polygon()]).equals_exact(apart)
    overlapping = shapely.MultiPolygon([FAR, shapely.box(20.5, 1, 22, 2)])
    assert unite(overlapping).geom_type == "Polygon" and unite(overlapping).area == 3 + 1


def test_parts_are_simplified_like_the_region_and_united_where_they_then_overlap():
    bump = shapely.Polygon([(0, 0), (4, 0), (4, 3), (2, 3.01), (0, 3)])
    far = shapely.box(7, 1, 9, 2)
    simple = simplify_each(shapely.MultiPolygon([bump, far]), 0.05)
    assert simple.equals(shapely.simplify(shapely.MultiPolygon([bump, far]), 0.05))
    assert shapely.get_num_coordinates(simple) == 10
    notch = shapely.Polygon([(5, 0), (5, 3), (4.01, 3), (4.03, 1.5), (4.01, 0)])
    beak = shapely.Polygon([(0, 0), (4, 0), (4.02, 1.5), (4, 3), (0, 3)])
    assert simplify_each(shapely.MultiPolygon([beak, notch]), 0.05).is_valid
