"""Whole drawings: frames, what a map shows of two drawings, its cost, and maps by means of frames."""

import numpy as np
import pytest
import shapely

import iccm
from iccm.arrays import xy_of
from iccm.balanced.coarse import coarse_map
from iccm.curve import Curve
from iccm.drawings.cost import LOST_POINT_ENERGY, Cost, cost_of
from iccm.drawings.detail import Detail
from iccm.drawings.drawing import Drawing
from iccm.drawings.frame import close_hairlines, frames_of
from iccm.drawings.mappable_holes import mappable
from iccm.drawings.pairing import pair_by_place
from iccm.drawings.region import PaintedRegion
from iccm.drawings.visible import middles
from iccm.errors import InputError
from iccm.frames import choice
from iccm.frames.choice import Choice, _FrameSearch, _Judge, choose
from iccm.frames.solve import DrawingPair
from iccm.options import Options
from iccm.pixels.canvas import Canvas
from iccm.pixels.composed import PaintedMap
from iccm.pixels.preimages import of as preimages_of
from tests.cases import slow, some_fast

BARS = shapely.MultiPolygon([shapely.box(0, 0, 5, 1), shapely.box(1, 2, 4, 3.5), shapely.box(0.5, 4, 5, 4.7)])
RING = shapely.Polygon([(0, 0), (7, 0), (7, 5), (0, 4)], [[(2, 1), (2, 3), (4, 3), (4, 1)]])


def two_triangles(z):
    """The corners of a rectangle as a mesh of two triangles."""
    return np.asarray(z, dtype=complex), np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("painted", [BARS, RING, shapely.union(RING, shapely.box(9, 1, 9.5, 8))])
def test_frames_hold_the_drawing_and_grow_up_to_its_hull(painted):
    frames = frames_of(painted)
    whole = [frame for frame in frames if frame.left_out == 0]
    for frame in whole:
        polygon = frame.outline.polygon
        assert polygon.is_valid and painted.difference(polygon).area < 1e-9 * painted.area
    areas = [frame.outline.area for frame in whole]
    assert areas == sorted(areas)
    assert areas[-1] == pytest.approx(shapely.convex_hull(painted).area)


def test_a_single_part_has_its_own_outline_first():
    drawing = Drawing(RING)
    assert drawing.is_one_part and drawing.frames[0].radius == 0
    assert drawing.tightest.outline.area == pytest.approx(shapely.Polygon(RING.exterior).area)
    assert len(drawing.holes) == len(drawing.mappable_holes) == 1


def test_the_tightest_frame_of_bars_excludes_the_space_around_them():
    tightest = Drawing(BARS).tightest.outline
    assert not tightest.contains(np.array([0.2 + 3j]))[0]  # beside the short bar
    assert tightest.contains(np.array([2.5 + 1.5j]))[0]  # between two bars


def test_a_small_part_far_away_need_not_be_in_every_frame():
    dot = shapely.box(30, 30, 30.2, 30.1)
    first, *remaining = frames_of(shapely.union(RING, dot))
    assert first.left_out == pytest.approx(dot.area / (RING.area + dot.area))
    assert all(frame.left_out == 0 for frame in remaining)


def test_hairlines_are_filled_and_other_gaps_stay():
    halves = shapely.union(shapely.box(0, 0, 10, 3), shapely.box(0, 3.002, 10, 7))
    filled = close_hairlines(halves)
    assert filled.geom_type == "Polygon" and filled.area == pytest.approx(70, rel=1e-6)
    slit = shapely.Polygon([(0, 0), (9, 0), (9, 3), (2, 3), (9, 3 + 1e-13), (9, 6), (0, 6)])
    assert len(close_hairlines(slit).exterior.coords) == 5
    assert close_hairlines(BARS) is BARS and close_hairlines(RING) is RING


def test_hairlines_are_filled_where_an_offset_touches_itself():
    upper = shapely.Polygon([(30.7, -101.3), (34, -99.6), (37.2, -102.7), (37, -108.9), (32, -108)])
    lower = shapely.Polygon(
        [(31.69, -109.32), (34.19, -108.42), (36.69, -110.42), (36.99, -116.52), (31.99, -117.22)]
    )
    bar = shapely.box(1140.6, 0, 1150.6, 1140.6)
    closed = close_hairlines(shapely.MultiPolygon([upper, lower, bar]))
    assert closed.is_valid
    assert closed.area == pytest.approx(upper.area + lower.area + bar.area, rel=1e-3)


@pytest.mark.parametrize("size", [1e-3, 1e4])
def test_hairlines_do_not_depend_on_the_unit(size):
    halves = shapely.union(shapely.box(0, 0, 10, 3), shapely.box(0, 3.002, 10, 7))
    apart = shapely.union(shapely.box(0, 0, 10, 3), shapely.box(0, 3.1, 10, 7))
    halves, apart = (shapely.transform(region, lambda xy: size * xy) for region in (halves, apart))
    assert close_hairlines(halves).geom_type == "Polygon" and close_hairlines(apart) is apart


def test_only_the_largest_of_crowded_holes_are_mapped():
    def square(x, y, side):
        return complex(x, y) + side * np.array([0, 1, 1 + 1j, 1j])

    holes = [
        square(5, 40, 2),
        square(7.01, 30, 20),
        square(80, 60, 0.2),
        square(60, 10, 10),
        square(99.99, 50, 0.005),
    ]
    assert mappable(Curve.domain(square(0, 0, 100)), holes) == [1, 3]


def test_rings_are_the_drawing_again():
    drawing = Drawing(shapely.union(RING, BARS.buffer(0.2).intersection(shapely.box(-9, 4.5, 9, 9))))
    again = Drawing.of_rings(drawing.rings)
    assert again.painted.equals_exact(drawing.painted, 0)
    backwards = [ring[::-1] for ring in drawing.rings]
    assert Drawing.of_rings(backwards).painted.symmetric_difference(drawing.painted).area < 1e-12
    with pytest.raises(InputError, match="paints nothing"):
        Drawing(shapely.Polygon())


def test_the_samples_of_a_triangle_are_the_middles_of_its_parts():
    weights = middles(4)
    assert weights.shape == (16, 3) and np.allclose(weights.sum(axis=1), 1)
    assert np.allclose(weights.mean(axis=0), 1 / 3) and weights.min() > 0


def test_visible_shares_are_those_of_counted_areas():
    z, faces = two_triangles([0, 4, 4 + 2j, 2j])
    u = 3 * z + 1j
    source, target = PaintedRegion(shapely.box(0, 0, 4, 2)), PaintedRegion(shapely.box(0, 1, 9, 7))
    visible_shares = cost_of(z, u, faces, source, target, covering=None, subdivision=40)
    assert visible_shares.energy == pytest.approx(
        1, abs=1e-12
    )  # a similarity, whatever part of it is visible
    assert visible_shares.hidden == pytest.approx(1 / 4, abs=0.01) and visible_shares.bare == pytest.approx(
        0, abs=0.01
    )
    left = PaintedRegion(shapely.box(0, 0, 1, 2))
    visible_shares = cost_of(z, u, faces, left, target, covering=left, subdivision=40)
    assert visible_shares.hidden == pytest.approx(0, abs=0.02) and visible_shares.bare == pytest.approx(
        2 / 3, abs=0.01
    )


def test_the_energy_of_the_visible_part_is_that_of_a_stretch():
    z, faces = two_triangles([0, 4, 4 + 2j, 2j])
    u = 3 * z.real + 1j * z.imag
    regions = PaintedRegion(shapely.box(0, 0, 4, 2)), PaintedRegion(shapely.box(0, 0, 12, 2))
    visible_shares = cost_of(z, u, faces, *regions, covering=None)
    assert visible_shares.energy == pytest.approx((3 + 1 / 3) / 2)  # areas are uniform: (K + 1/K) / 2


def test_the_energy_weights_the_areas_of_both_drawings_equally():
    """Half of the source is unchanged, half becomes three times as large."""
    z, faces = two_triangles([0, 4, 4 + 2j, 2j])
    u = np.array([0, 4, 4 + 2j, 6j])
    quadrangle = shapely.Polygon([(0, 0), (4, 0), (4, 2), (0, 6)])
    visible_shares = cost_of(
        z, u, faces, PaintedRegion(shapely.box(0, 0, 4, 2)), PaintedRegion(quadrangle), covering=None
    )
    large, small = np.linalg.svd([[1, 0], [-1, 3]], compute_uv=False)
    energies = [
        1.25,
        (large / small + small / large) / 2 * (1.5 + 1 / 1.5) / 2,
    ]  # the mean scale of areas is 2
    assert visible_shares.energy == pytest.approx(
        np.average(energies, weights=[0.5 / 2 + 0.25 / 2, 0.5 / 2 + 0.75 / 2])
    )
    assert (visible_shares.hidden, visible_shares.bare) == (
        pytest.approx(0, abs=1e-9),
        pytest.approx(0, abs=1e-9),
    )


def test_the_price_lies_between_the_energy_and_that_of_a_lost_point():
    assert Cost(1.5, 0, 0).total == 1.5
    assert Cost(1.5, 0.2, 0.4, 2).total == pytest.approx(2 * (0.7 * 1.5 + 0.3 * LOST_POINT_ENERGY))
    assert Cost(np.inf, 1, 1).total == LOST_POINT_ENERGY


def test_parts_are_paired_by_place():
    parts = list(BARS.geoms)
    moved = [
        shapely.transform(part, lambda xy: xy * [2, 1.5] + [7, 9]) for part in (parts[2], parts[0], parts[1])
    ]
    assert sorted(pair_by_place(parts, moved)) == [(0, 1), (1, 2), (2, 0)]


def test_a_part_is_paired_with_its_copy_unless_sizes_differ_too_much():
    """If the areas of parts on the same side differ by a factor of seven, position decides, in half diagonals of each
    drawing.
    """
    large, small = shapely.box(0, 0, 2.72, 2.72), shapely.box(4.5, 0.86, 5.5, 1.86)
    mirrored = [shapely.transform(part, lambda xy: [5.5, 0] + xy * [-1, 1]) for part in (large, small)]
    assert pair_by_place([large, small], mirrored) == [(0, 1), (1, 0)]


def test_places_are_relative_to_the_middles_of_both_drawings():
    tower = [shapely.box(0, y, 1, y + 1) for y in (0, 3.5, 5, 10)]
    assert pair_by_place([shapely.box(7, 7, 8, 8)], tower) == [(0, 2)]


def test_a_picture_is_cut_to_the_painted_area():
    drawing = Drawing(shapely.union(RING, shapely.box(8, 1, 9.3, 3.6)))
    low, high = drawing.tightest.outline.box
    canvas = Canvas.about(93, 57, (low, high))
    fit = iccm.fit(shapely.MultiPolygon(drawing.parts), shapely.MultiPolygon(drawing.parts))
    bands = preimages_of(PaintedMap(fit.map, drawing.rings), canvas, 1e-3, slopes=False)
    covered = sum(float(bands(row).coverage.sum()) for row in range(0, canvas.height, 128))
    area = covered * canvas.step[0] * canvas.step[1]
    assert area == pytest.approx(drawing.region.area, rel=1e-4)


@pytest.mark.slow
def test_all_parts_of_both_drawings_are_mapped_and_certified():
    goal = shapely.MultiPolygon([shapely.box(10, 0, 13, 2), shapely.Point(16, 1.5).buffer(1.4, quad_segs=5)])
    fit = iccm.fit(BARS, goal)
    report = fit.report()
    assert fit.status.ok and report["injective"]["certified"]
    assert report["covered"] == pytest.approx(1, abs=1e-3) and 0.5 < report["shown"] <= 1
    bare = iccm.fit(BARS, goal, opaque=False)
    assert (
        1 - bare.coverage.bare
    ) < 1  # gaps of the source are visible where the texture does not cover them


@pytest.mark.slow
def test_one_part_without_gaps_is_mapped_as_its_outline():
    square, leaf = shapely.box(0, 0, 3, 2), shapely.Point(0, 0).buffer(2, quad_segs=12)
    by_outline = iccm.fit(Curve.domain([0, 3, 3 + 2j, 2j]), leaf)
    by_drawing = iccm.fit(Drawing(square), leaf)
    z = np.array([0.3 + 0.4j, 2.1 + 1.7j, 1.5 + 1j])
    assert np.allclose(by_drawing.map(z), by_outline.map(z), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("fit", some_fast(["frame", "whole", "cover", "contain"], {"frame", "cover"}))
def test_every_fit_can_be_requested(fit):
    result = iccm.fit(BARS, shapely.union(RING, shapely.box(8, 1, 9.3, 3.6)), fit=fit)
    assert result.status.ok and result.report()["injective"]["certified"]
    assert 0 < (1 - result.coverage.hidden) <= 1 and 0 < (1 - result.coverage.bare) <= 1


HOOK = shapely.LineString([(0, 0), (0, 9), (7, 9), (7, 3), (4, 3)]).buffer(0.8, quad_segs=3)
LETTERS = shapely.MultiPolygon([HOOK, shapely.box(10, 0, 11, 9), shapely.box(12, 4, 18, 5)])


@pytest.mark.parametrize(
    "source, target",
    [
        slow(HOOK, BARS),
        (LETTERS, RING),
        slow(BARS, LETTERS),
    ],
)
def test_the_chosen_frames_cost_little_more_than_the_cheapest_of_all_pairs(source, target):
    drawings, options = (Drawing(source), Drawing(target)), Options(fit="frame")
    search = _FrameSearch(_Judge(*drawings, options, free_gaps=True), around_all=True)
    every = [
        search.attempt((i, j)) for i in range(len(drawings[0].frames)) for j in range(len(drawings[1].frames))
    ]
    least = min(choice_made.cost.total for choice_made in every if choice_made is not None)
    best = choose(*drawings, options, free_gaps=True, framed=True)[0]
    assert best.cost.total <= 1.02 * least


@pytest.mark.slow
def test_no_coarse_map_costs_less_than_the_areas_of_its_frames_permit():
    frames_without_loss = 0
    for source, target in ((LETTERS, RING), (shapely.box(0, 0, 3, 1), BARS), (BARS, HOOK)):
        judge = _Judge(Drawing(source), Drawing(target), Options(), free_gaps=source is BARS)
        for pair in (
            (judge.source.tightest, judge.target.frames[-1]),
            (judge.source.frames[-1], judge.target.tightest),
        ):
            coarse = coarse_map(*(frame.outline for frame in pair), judge.options)
            bound = judge.least_cost_of(pair)
            frames_without_loss += bound == 1
            assert coarse is None or bound <= judge.choice(pair, "whole", coarse).cost.total
    assert frames_without_loss < 3
    # half of the frame is painted, so that half of a full square is hidden
    square, bars = (
        Drawing(shapely.box(0, 0, 2, 2)),
        Drawing(shapely.box(0, 0, 1, 2) | shapely.box(3, 0, 4, 2)),
    )
    judge = _Judge(square, bars, Options(), free_gaps=False)
    half_hidden = 0.75 * 1 + 0.25 * LOST_POINT_ENERGY
    assert judge.least_cost_of((square.tightest, bars.frames[-1])) == pytest.approx(half_hidden)


@pytest.mark.slow
def test_a_descent_that_costs_much_more_than_the_best_is_given_up(monkeypatch):
    drawings, options = (Drawing(HOOK), Drawing(BARS)), Options(fit="frame")

    def costs():
        search = _FrameSearch(_Judge(*drawings, options, free_gaps=True), around_all=True)
        return [descent.cost.total for descent in search.descents()]

    shorter = costs()
    monkeypatch.setattr(choice, "ABANDONED_COST_RATIO", np.inf)
    longer = costs()
    assert len(shorter) < len(longer) and min(shorter) == min(longer)


@pytest.mark.slow
def test_joined_frames_much_costlier_than_paired_parts_are_not_searched(monkeypatch):
    hook = Drawing(shapely.MultiPolygon([HOOK, shapely.box(10, 0, 11, 9)]))
    apart = Drawing(shapely.MultiPolygon([HOOK, shapely.box(16, 0, 17, 12)]))
    options = Options()
    ranked = choose(hook, apart, options, pair_parts=True)
    monkeypatch.setattr(choice, "GIVEN_UP_COST_RATIO", np.inf)
    compared = choose(hook, apart, options, pair_parts=True)
    assert len(ranked) == 1 < len(compared)
    for best in (ranked[0], compared[0]):
        assert best.cost.total == ranked[0].cost.total and len(best.pairs) == 2
    assert min(frame.cost.total for frame in compared[1:]) > best.cost.total


@pytest.mark.slow
def test_fit_frame_keeps_all_parts_and_other_fits_report_the_omitted():
    part = shapely.union(shapely.box(0, 0, 6, 5), shapely.box(20, 1, 21, 2.5))  # 5 % lies far away
    source, target = Drawing(part), Drawing(shapely.Polygon([(0, 0), (9, 1), (8, 6), (1, 5)]))
    options = Options(fit="auto")
    assert source.frames[0].left_out == pytest.approx(1.5 / 31.5)
    framed = choose(source, target, options, framed=True)
    assert framed and all(frame.left_out == 0 for choice in framed for frame in choice.frames)

    def solver(source, target, source_holes, target_holes, options, coarse=None, stretch=1.0):
        return iccm.fit(source.z, target.z, fit=options.fit)

    pair = DrawingPair(source, target, options, solver)
    main_part = Choice((source.frames[0], target.tightest))
    notes = pair.solve(main_part).notes
    assert any("4.8%" in note and "source" in note and "left out" in note for note in notes)
    notes = pair.solve(framed[0]).notes
    assert not any("4.8%" in note for note in notes)


@pytest.mark.parametrize("count", [5, 200])
def test_a_region_of_many_parts_contains_the_points_of_its_parts(count):
    rng = np.random.default_rng(3)
    outer = np.exp(2j * np.pi * np.arange(7) / 7) * (1, 0.8, 1.1, 1, 0.7, 1, 1.2)
    parts = [
        shapely.Polygon(xy_of(outer + 2.4 * k + 0.1j * (k % 3)), [xy_of(0.3 * outer[::-1] + 2.4 * k)])
        for k in range(count)
    ]
    places = rng.uniform(-2, 2.4 * count, (3, 700)) + 1j * rng.uniform(-1.5, 1.5, (3, 700))
    inside = PaintedRegion(shapely.MultiPolygon(parts)).contains(places)
    expected = np.logical_or.reduce([shapely.contains_xy(part, places.real, places.imag) for part in parts])
    assert inside.shape == places.shape and 0.1 < inside.mean() < 0.9
    np.testing.assert_array_equal(inside, expected)


def test_a_drawing_of_very_many_parts_has_fewer_frames(monkeypatch):
    """The tightest one that joins all parts is kept, and so is the hull."""
    rng = np.random.default_rng(3)
    places = [(5 * k % 35 + rng.random(), k // 7 * 4 + rng.random()) for k in range(30)]
    painted = shapely.MultiPolygon([shapely.box(x, y, x + 2, y + 1.5) for x, y in places])
    every = frames_of(painted)
    monkeypatch.setattr("iccm.drawings.frame.MANY_PARTS", 30)
    few = frames_of(painted)
    assert len(few) == len(every) - 1
    assert [frame.radius for frame in few] == [every[0].radius, np.inf]
    assert np.array_equal(few[0].outline.z, every[0].outline.z)


@pytest.mark.slow
def test_limits_of_hidden_and_bare_areas_are_kept_or_the_status_is_not_ok():
    free = iccm.fit(BARS, RING)
    hidden = free.coverage.hidden
    assert free.status.ok and 0.01 < hidden < 0.5
    kept = iccm.fit(BARS, RING, max_left_out=hidden + 0.02, max_uncovered=0.5)
    assert kept.status.ok and (1 - kept.coverage.hidden) == pytest.approx(1 - free.coverage.hidden)
    missed = iccm.fit(BARS, RING, max_left_out=0.0)
    assert not missed.status.ok and f"{missed.coverage.hidden:.1%}" in missed.notes[-1]


DOTTED_COMB = shapely.union_all(
    [
        shapely.box(0, 0, 6, 0.8),
        *(shapely.box(x, 0, x + 0.5, height) for x, height in ((0, 3), (1.5, 4.5), (3, 3.5), (5.5, 4))),
        shapely.box(4.3, 2, 4.8, 2.6),
    ]
)
LEANING_BLOCK = shapely.Polygon([(0, 0), (7, 0.5), (6.5, 5), (0.5, 4)])


@pytest.fixture(scope="module")
def comb_on_block():
    """The map of a comb with a dot onto a block, which is one of frames."""
    fit = iccm.fit(DOTTED_COMB, shapely.MultiPolygon([LEANING_BLOCK]))
    assert not fit.coverage.is_partial and fit.source.area > 1.5 * DOTTED_COMB.area
    return fit


@pytest.mark.slow
def test_a_pin_where_the_map_takes_it_keeps_the_frames(comb_on_block):
    fit = comb_on_block
    z = np.array([0.3 + 2j, 5.2 + 0.4j])
    pins = np.stack([z, fit.map(z)], axis=1)
    pinned = iccm.fit(DOTTED_COMB, shapely.MultiPolygon([LEANING_BLOCK]), pins=pins)
    assert np.array_equal(pinned.source.z, fit.source.z) and np.array_equal(pinned.target.z, fit.target.z)
    assert pinned.status.ok
    assert (
        np.quantile(np.abs(pinned.map(fit._interior) - fit.map(fit._interior)), 0.95) < 0.02 * fit._diagonal
    )


def test_a_map_continues_on_the_frames_of_its_start(comb_on_block):
    fit = comb_on_block
    z = np.array([0.3 + 2j])
    pins = np.stack([z, fit.map(z) + 0.2 - 0.1j], axis=1)
    for strokes in ([], [(np.array([5.7 + 1j, 5.8 + 3j]), fit.map(np.array([5.7 + 1j, 5.8 + 3j])))]):
        continued = iccm.fit(
            DOTTED_COMB,
            shapely.MultiPolygon([LEANING_BLOCK]),
            pins=pins,
            strokes=strokes,
            start=fit,
            exact_pins=True,
        )
        assert np.array_equal(continued.source.z, fit.source.z)
        assert continued.status.ok and np.abs(continued.map(pins[0, 0]) - pins[0, 1]) < 1e-6


@pytest.mark.slow
def test_a_composition_that_pins_contradict_is_not_solved_for(monkeypatch):
    # a picture that fills its box is composed on the leaning block, but the pins are those of the map of outlines
    source, target = Drawing(shapely.box(0, 0, 6, 4)), Drawing(LEANING_BLOCK)
    pixels = np.ones((40, 60, 4))
    pixels[12:30, 9:40, :3] = 0.2
    detail = Detail.of_picture(pixels, (0, 6 + 4j))
    z = np.array([1 + 1j, 5 + 1j, 4.5 + 3.2j, 0.7 + 3j])
    pins = np.stack([z, iccm.fit(source, target).map(z)], axis=1)
    frames, solve = [], DrawingPair.solve

    def recorded(pair, choice, **options):
        frames.append(choice)
        return solve(pair, choice, **options)

    monkeypatch.setattr(DrawingPair, "solve", recorded)
    fit = iccm.fit(source, target, pins=pins, detail=detail)
    assert fit.status.ok and [choice.composed for choice in frames] == [None]


@pytest.mark.slow
def test_pins_that_frames_cannot_meet_get_the_outlines(comb_on_block):
    # a point between two teeth, which the frame encloses, goes to the outline of the block
    pins = np.array([[1 + 0.8j, 3.5 + 4.5j]])
    assert comb_on_block.source.distances(pins[:, 0])[0] > 0.1
    fit = iccm.fit(DOTTED_COMB, shapely.MultiPolygon([LEANING_BLOCK]), pins=pins)
    assert fit.source.distances(pins[:, 0])[0] < 1e-9
    assert fit.status.ok and np.abs(fit.map(pins[:, 0]) - pins[:, 1]).max() < 1e-6 * fit._diagonal


@pytest.mark.slow
@pytest.mark.parametrize("opaque", [True, False])
def test_gaps_that_a_transparent_texture_shows_count_as_bare(opaque):
    # a fifth of the frame is a gap
    bars = shapely.union(shapely.box(0, 0, 4, 1), shapely.box(0, 1.5, 4, 2.5))
    fit = iccm.fit(bars, shapely.box(0, 0, 4, 3), fit="frame", opaque=opaque, max_uncovered=0.05)
    assert fit.coverage.bare == pytest.approx(0 if opaque else 0.2, abs=0.02)
    assert fit.status.ok is opaque
