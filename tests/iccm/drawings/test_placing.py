"""Similar copies of regions inside others, and maps that keep a drawing's proportions."""

import numpy as np
import pytest
import shapely

import iccm
from iccm.drawings.placing import largest_copy, largest_copy_about, transform_region
from iccm.errors import InputError

SIGN = shapely.box(0, 0, 5, 3)
SHIELD = shapely.Polygon([(0, 9), (8, 10), (8, 5), (4.5, 0), (0, 4)])
WORD = shapely.MultiPolygon([shapely.box(0, 0, 1, 4), shapely.box(2, 0, 3.5, 2.5), shapely.box(4, 0, 7, 4)])
HOOK = shapely.Polygon([(0, 0), (5, 0), (5, 4), (4, 4), (4, 1), (1, 1), (1, 6), (0, 6)])


def is_similar(fit, inner):
    """Whether a map is a similarity at points inside a region."""
    z = np.array([complex(*inner.representative_point().coords[0]), inner.centroid.x + 1j * inner.centroid.y])
    f_z, f_zbar = fit.map.derivatives(z)
    return np.allclose(f_zbar, 0, atol=1e-9) and np.allclose(f_z, f_z[0])


@pytest.mark.parametrize(
    ("inner", "outer", "scale"),
    [
        (SIGN, shapely.box(10, 20, 20, 23), 1.0),  # as high as the other
        (SIGN, shapely.box(10, 20, 20, 90), 2.0),  # as wide
        (SHIELD, transform_region(SHIELD, iccm.plane.Similarity(3.0, 7 - 2j)), 3.0),
        (
            HOOK,
            transform_region(HOOK, iccm.plane.Similarity(0.5, -9j)),
            0.5,
        ),  # not convex: no smaller copy contains a given point
        (shapely.Point(0, 0).buffer(1, 64), SHIELD, shapely.maximum_inscribed_circle(SHIELD, 1e-3).length),
    ],
)
def test_the_largest_copy_lies_inside(inner, outer, scale):
    copy = largest_copy(inner, outer)
    assert outer.covers(transform_region(inner, copy))
    assert copy.factor == pytest.approx(scale, rel=2e-3)


def test_no_other_place_and_no_other_rotation_is_larger():
    rng = np.random.default_rng(5)
    for rotation in (0.0, None):
        copy = largest_copy(SIGN, SHIELD, rotation)
        assert SHIELD.covers(transform_region(SIGN, copy))
        for _ in range(3000):
            turn = np.exp(1j * rng.uniform(-np.pi, np.pi)) if rotation is None else 1.0
            place = complex(rng.uniform(0, 8), rng.uniform(0, 10))
            factor = 1.03 * abs(copy.factor) * turn
            candidate = iccm.plane.Similarity(factor, place - factor * (2.5 + 1.5j))
            assert not SHIELD.covers(transform_region(SIGN, candidate))


def test_a_copy_that_has_room_lies_in_its_middle():
    copy = largest_copy(SIGN, shapely.box(10, 20, 20, 60))
    assert copy(2.5 + 1.5j) == pytest.approx(15 + 40j, abs=0.1)


def test_a_copy_avoids_holes_and_other_parts():
    ring = shapely.Point(0, 0).buffer(9).difference(shapely.Point(1, 0).buffer(5))
    region = shapely.union(ring, shapely.box(20, 20, 24, 23))
    copy = largest_copy(SIGN, region)
    assert region.covers(transform_region(SIGN, copy)) and abs(copy.factor) > 0.6


def test_there_is_a_copy_in_thin_lines_too():
    lines = shapely.MultiLineString([[(0, 0), (100, 3)], [(50, 1), (48, 90)], [(48, 60), (90, 80)]]).buffer(
        0.05
    )
    copy = largest_copy(SHIELD, lines)
    assert lines.covers(transform_region(SHIELD, copy)) and abs(copy.factor) * 8 > 0.06


def test_inside_a_ring_nothing_is_hidden():
    ring = shapely.Point(0, 0).buffer(9).difference(shapely.Point(1, 0).buffer(3.5))
    fit = iccm.fit(SIGN, ring, place="inside")
    assert (1 - fit.coverage.hidden) == pytest.approx(1, abs=1e-3)
    speck = shapely.Point(0, 0).buffer(9).difference(shapely.Point(1, 0).buffer(0.3))
    assert iccm.fit(SIGN, speck, place="inside").coverage.bare < 0.6  # small holes may lie in it


def test_a_point_determines_where_the_copy_lies():
    copy = largest_copy_about(SIGN, SHIELD, 1 + 1j, 4 + 6j)
    assert copy(1 + 1j) == pytest.approx(4 + 6j)
    assert SHIELD.covers(transform_region(SIGN, copy))
    larger = iccm.plane.Similarity(1.001 * copy.factor, 4 + 6j - 1.001 * copy.factor * (1 + 1j))
    assert not SHIELD.covers(transform_region(SIGN, larger))
    assert largest_copy_about(SIGN, SHIELD, 1 + 1j, -1 + 6j) is None


def test_inside_all_is_shown_and_keeps_its_proportions():
    fit = iccm.fit(WORD, SHIELD, place="inside")
    report = fit.report()
    assert is_similar(fit, WORD) and fit.status.ok and report["injective"]["share"] == pytest.approx(1)
    copy = transform_region(WORD, largest_copy(fit.details.drawings[0].tightest.outline.polygon, SHIELD))
    assert report["shown"] == pytest.approx(1, abs=1e-3)
    assert (1 - fit.coverage.bare) == pytest.approx(shapely.convex_hull(copy).area / SHIELD.area, abs=0.1)
    assert not any("bare" in note for note in report["notes"])  # as requested


def test_slice_covers_all_and_keeps_its_proportions():
    fit = iccm.fit(SIGN, SHIELD, place="slice")
    assert is_similar(fit, SIGN)
    assert (1 - fit.coverage.bare) == pytest.approx(1, abs=1e-6) and (1 - fit.coverage.hidden) < 0.6
    scale = np.sqrt(SHIELD.area / fit.source.area)
    assert scale == pytest.approx(10 / 3, rel=2e-3)  # the height is decisive
    assert not any("hidden" in note for note in fit.report()["notes"])


@pytest.mark.parametrize("place", ["inside", "slice"])
def test_the_picture_is_rotated_as_requested(place):
    fit = iccm.fit(SIGN, SHIELD, place=place, turn=40)
    z = np.array([2.5 + 1.5j, 2.6 + 1.5j])
    assert np.degrees(np.angle(np.diff(fit.map(z))))[0] == pytest.approx(40)
    largest = iccm.fit(SHIELD, SIGN, place=place, turn="any")
    upright = iccm.fit(SHIELD, SIGN, place=place)
    scales = [abs(np.diff(placed.map(np.array([4 + 5j, 4.1 + 5j])))[0]) for placed in (largest, upright)]
    assert scales[0] > scales[1] if place == "inside" else scales[0] < scales[1]


@pytest.mark.parametrize("place", ["inside", "slice"])
def test_a_pin_is_met_by_the_similarity(place):
    fit = iccm.fit(SIGN, SHIELD, place=place, pins=[(2 + 1j, 4.5 + 6j)])
    assert fit.map(2 + 1j) == pytest.approx(4.5 + 6j, abs=1e-6)
    assert is_similar(fit, SIGN) and fit.status.ok


def test_two_pins_are_met_and_protruding_parts_are_bent():
    pins = [(1 + 1j, 2 + 6.3j), (4 + 1j, 6 + 6.3j)]
    fit = iccm.fit(SIGN, SHIELD, place="inside", exact_pins=True, pins=pins)
    assert np.allclose(fit.map(np.array([1 + 1j, 4 + 1j])), [2 + 6.3j, 6 + 6.3j], atol=1e-6)
    assert is_similar(fit, SIGN)
    pins = [(1 + 1j, 1.2 + 6.5j), (4 + 1j, 6.8 + 6.5j)]
    fit = iccm.fit(SIGN, SHIELD, place="inside", exact_pins=True, pins=pins)
    assert np.allclose(fit.map(np.array([1 + 1j, 4 + 1j])), [1.2 + 6.5j, 6.8 + 6.5j], atol=1e-6)
    assert not is_similar(fit, SIGN) and fit.status.ok and fit.report()["injective"]["certified"]


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"place": "under"}, "place"),
        ({"place": "inside", "fit": "cover"}, "fit"),
        ({"place": "slice", "holes": "keep"}, "holes"),
        ({"place": "slice", "max_left_out": 0.1}, "max_left_out"),
        ({"place": "inside", "method": "conformal"}, "place"),
        ({"place": "inside", "pins": [(1 + 1j, 0.1 + 9j), (4 + 1j, 8 + 9.9j)]}, "place.*pins"),
        ({"place": "inside", "pins": [(1 + 1j, 5 + 5j), (4 + 1j, 3 + 5j)], "turn": 0}, "place.*pins"),
    ],
)
def test_impossible_placements_are_refused(options, names):
    with pytest.raises(InputError, match=names):
        iccm.fit(SIGN, SHIELD, **options)


def test_a_placed_map_is_saved_with_its_place(tmp_path):
    fit = iccm.fit(SIGN, SHIELD, place="slice")
    fit.save(tmp_path / "map.npz")
    again = iccm.load(tmp_path / "map.npz")
    assert again.details.place == "slice" and (1 - again.coverage.hidden) == (1 - fit.coverage.hidden)
    assert iccm.warp(again, iccm.checkerboard(64), size=(16, 20)).box == pytest.approx((0j, 8 + 10j))
