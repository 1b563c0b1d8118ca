"""Edges of pictures, and what of them a map shows."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import shapely.affinity

from iccm.drawings.cost import Cost
from iccm.drawings.detail import Detail, TargetView, cost_of_detail, hidden_cost, paper_cost
from iccm.drawings.drawing import Drawing
from iccm.frames.composition import Composer, _PlacementSearch, box_frame, outline_points, subject_of
from iccm.frames.silhouettes import silhouettes
from iccm.options import Options

WIDTH, HEIGHT = 90, 60


STEP = shapely.box(20, 10, 70, 30).difference(shapely.box(20, 10, 45, 20))


def picture_of(*boxes):
    """A picture of 90 by 60 units, a pixel each, with painted boxes (left, low, right, high)."""
    pixels = np.zeros((HEIGHT, WIDTH, 4))
    for left, low, right, high in boxes:
        pixels[HEIGHT - high : HEIGHT - low, left:right] = 0.8, 0.1, 0.1, 1
    return pixels


def detail_of(*boxes, **how):
    return Detail.of_picture(picture_of(*boxes), (0, WIDTH + 1j * HEIGHT), **how)


def detail_of_step():
    return detail_of((45, 10, 70, 30), (20, 20, 70, 30))


def test_edges_of_a_step_lie_on_its_sides_and_point_across_them():
    detail = detail_of_step()
    assert detail.box == (20 + 10j, 70 + 30j)
    assert detail.weights.sum() == pytest.approx(1)
    distances = [np.abs(detail.points.real - x) for x in (20, 45, 70)]
    distances += [np.abs(detail.points.imag - y) for y in (10, 20, 30)]
    assert np.min(distances, axis=0).max() <= 2.5
    upright = np.abs(detail.points.real - 70) < 1.2
    away_from_corners = upright & (np.abs(detail.points.imag - 20) < 5)
    assert away_from_corners.any() and np.abs(detail.normals[away_from_corners].imag).max() < 1e-6


def test_a_picture_without_margin_has_no_edge_at_its_rim():
    assert detail_of((0, 0, WIDTH, HEIGHT)).is_empty
    halves = picture_of((0, 0, WIDTH, HEIGHT))
    halves[:, 45:, :3] = 0
    flag = Detail.of_picture(halves, (0, WIDTH + 1j * HEIGHT))
    assert flag.is_full and flag.fills_box and np.abs(flag.points.real - 45).max() < 4
    assert not detail_of_step().is_full
    bar = detail_of((20, 10, 70, 30))  # its outline is all that there is to see
    assert not bar.is_full and not bar.is_empty
    assert detail_of((20, 10, 70, 30), on_paper=False).is_full  # without paper, it has to cover the target


@pytest.mark.parametrize(("share", "least", "most"), [(0.3, 0, 0.02), (0.9, 0.5, 0.7), (0, 0, 0), (1, 1, 1)])
def test_a_margin_of_paper_costs_next_to_nothing_and_a_tiny_subject_much(share, least, most):
    assert least <= paper_cost(share) <= most


def test_a_subject_in_pieces_costs_more_than_one_that_is_whole_but_tiny():
    whole_but_tiny, in_pieces = Cost(1, 0, paper_cost(1)), Cost(1, hidden_cost(0.9), 0)
    assert whole_but_tiny.total < in_pieces.total


def disc_picture(*stripes):
    """A disc of 60 units in the middle of the picture, with horizontal stripes of these colours."""
    pixels = np.zeros((HEIGHT, WIDTH, 4))
    for number, colour in enumerate(stripes):
        rows = slice(number * HEIGHT // len(stripes), (number + 1) * HEIGHT // len(stripes))
        pixels[rows, :, :3] = colour
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    pixels[..., 3] = np.hypot(x - WIDTH / 2 + 0.5, y - HEIGHT / 2 + 0.5) < 29
    return pixels


def test_a_flag_cut_by_a_circle_has_no_margin_but_a_ball_has():
    box = (0, WIDTH + 1j * HEIGHT)
    flag = Detail.of_picture(disc_picture((1, 0, 0), (1, 1, 1), (0, 0, 1)), box)
    ball = Detail.of_picture(disc_picture((1, 0.1, 0), (0.95, 0.05, 0), (0.9, 0, 0)), box)
    assert flag.is_full and not flag.fills_box and not ball.is_full


def test_a_gem_with_facets_is_not_cut_from_a_larger_picture():
    pixels = disc_picture((1, 0.9, 0.3), (1, 0.6, 0), (0.9, 0.4, 0))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    pixels[..., 3] = np.abs(x - WIDTH / 2) < np.minimum(20 + y, 1.2 * (HEIGHT - 4 - y))
    assert not Detail.of_picture(pixels, (0, WIDTH + 1j * HEIGHT)).is_full


def test_translucent_parts_belong_to_a_subject_but_its_shadow_does_not():
    """The pale part of icons of two tones was left out, so that the rest was in the middle."""
    pixels = picture_of((45, 20, 70, 30))
    pixels[HEIGHT - 30 : HEIGHT - 20, 20:45] = 0, 0, 0, 0.3
    pixels[HEIGHT - 20 : HEIGHT - 15, 20:70] = 0, 0, 0, 0.15
    assert Detail.of_picture(pixels, (0, WIDTH + 1j * HEIGHT)).box == (20 + 20j, 70 + 30j)


def test_a_picture_on_a_flat_ground_is_continued_by_it_unless_there_is_no_paper():
    pixels = picture_of((0, 0, WIDTH, HEIGHT))
    pixels[20:40, 30:50, :3] = 1
    box = (0, WIDTH + 1j * HEIGHT)
    assert not Detail.of_picture(pixels, box).is_full
    assert Detail.of_picture(pixels, box, on_paper=False).is_full


def test_a_long_subject_counts_half_as_wide_as_it_is_long():
    detail = detail_of((10, 20, 80, 24), (10, 28, 80, 30))
    subject = detail.subject(shapely.box(10, 20, 80, 30))
    assert subject.painted.bounds == pytest.approx((10, 25 - 17.5, 80, 25 + 17.5))


def test_silhouettes_fill_holes_then_gaps_and_cost_what_they_lose():
    ring = shapely.box(0, 0, 10, 10).difference(shapely.box(1, 1, 9, 9))
    target = Drawing(shapely.union(ring, shapely.box(14, 0, 16, 10)))
    found = list(silhouettes(target, is_full=False))
    areas, costs = [item.drawing.region.area for item in found], [item.cost for item in found]
    assert areas[:2] == pytest.approx([56, 120]) and areas[-1] == pytest.approx(160)
    assert costs[0] == 0 and costs == sorted(costs) and costs[1] == pytest.approx(0.1 * 64 / 120)
    assert costs[-1] == pytest.approx(0.07 + (0.1 * 64 + 0.2 * 40) / 160)


def test_the_hull_of_a_thin_row_is_widened_within_the_canvas():
    row = Drawing(shapely.MultiPolygon([shapely.box(x, 9, x + 2, 11) for x in (0, 9, 18)]))
    wide = list(silhouettes(row, is_full=False))[-1].drawing.painted
    assert wide.bounds == pytest.approx((0, 5, 20, 15))
    cut = list(silhouettes(row, is_full=False, canvas=(-1 + 8j, 21 + 20j)))[-1].drawing.painted
    assert cut.bounds == pytest.approx((0, 8, 20, 15))
    banner, line = (Drawing(shapely.box(0, 0, 20, height)) for height in (4, 2))
    assert [item.drawing for item in silhouettes(banner, is_full=False)] == [banner]
    assert list(silhouettes(line, is_full=False))[-1].drawing.painted.bounds == pytest.approx((0, -4, 20, 6))


@pytest.mark.parametrize(("width", "count"), [(1, 2), (4.9, 2), (5.1, 1)])
def test_a_picture_without_margin_fills_holes_of_more_than_a_quarter_of_the_target(width, count):
    ring = shapely.box(0, 0, 20, 20).difference(shapely.box(width, width, 20 - width, 20 - width))
    assert len(list(silhouettes(Drawing(ring), is_full=True))) == count


@pytest.mark.parametrize(
    ("target", "count"),
    [
        (shapely.box(0, 0, 20, 20) - shapely.box(1, 1, 20, 19), 2),  # open on one side: also its hull
        (shapely.box(0, 0, 20, 20) - shapely.box(4, 4, 20, 16), 1),  # wide strokes
        (shapely.MultiPolygon([shapely.box(x, 0, x + 0.5, 6) for x in range(0, 21, 3)]), 1),  # narrow gaps
    ],
)
def test_a_picture_without_margin_is_shown_between_lines_around_a_wide_gap(target, count):
    found = [item.drawing.region.area for item in silhouettes(Drawing(target), is_full=True)]
    assert len(found) == count and all(area == pytest.approx(400, rel=0.05) for area in found[1:])


def test_an_edge_is_seen_inside_the_target_and_less_at_its_rim():
    view = TargetView.of(shapely.box(0, 0, 100, 50))
    middle, pressed, outside = view.seen(np.array([30 + 20j, 30 + 1j, 30 - 3j]))
    assert middle == 1 and 0 < pressed < 0.9 and outside == 0
    assert view.widest.imag == pytest.approx(25, abs=1)


def grid_map(of):
    """The map `of` on a grid of triangles over the picture."""
    x, y = np.meshgrid(np.linspace(0, WIDTH, 10), np.linspace(0, HEIGHT, 7))
    z = (x + 1j * y).ravel()
    corner = np.arange(60).reshape(6, 10)[:, :9].ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + 11], 1), np.stack([corner, corner + 11, corner + 10], 1)]
    )
    return z, of(z), faces


def cost_onto(of, target, **how):
    detail = detail_of_step()
    subject = Drawing(STEP).region
    how = {"paper": paper_cost} | how
    return cost_of_detail(*grid_map(of), detail, TargetView.of(target), subject=subject, **how)


def test_a_similarity_that_shows_everything_costs_what_its_paper_does():
    cost = cost_onto(lambda z: 2 * z + 5, shapely.box(5, 0, 5 + 2 * WIDTH, 2 * HEIGHT))
    paper = 1 - STEP.area / (WIDTH * HEIGHT)
    assert cost.energy == pytest.approx(1) and cost.hidden == pytest.approx(0, abs=1e-9)
    assert cost.rotation == pytest.approx(1) and cost.bare == pytest.approx(paper_cost(paper), abs=0.02)


def test_stretch_rotation_and_cropping_each_raise_their_part_of_the_cost():
    whole = shapely.box(-200, -200, 300, 300)
    stretched = cost_onto(lambda z: 2 * z.real + 1j * z.imag, whole)
    assert stretched.energy == pytest.approx(1 + 12 * 0.25)
    flag = cost_onto(lambda z: 2 * z.real + 1j * z.imag, whole, paper=None)
    assert flag.energy == pytest.approx(1 + 2 * 0.25)
    assert cost_onto(lambda z: z * np.exp(1j * np.pi / 6), whole).rotation == pytest.approx(1.5)
    half = cost_onto(lambda z: z, shapely.box(45, 0, WIDTH, HEIGHT))
    assert 0.8 < half.hidden <= 1.1
    assert cost_onto(lambda z: z, shapely.box(0, 0, WIDTH, HEIGHT), paper=None).bare > 0.7


def test_a_subject_is_placed_whole_and_upright_in_the_middle_of_a_wide_target():
    source, detail = Drawing(STEP), detail_of_step()
    target = Drawing(shapely.box(100, 200, 400, 260))
    choice = Composer(source, target, detail, Options()).placed()
    assert choice is not None and choice.composed.hidden < 0.1 and choice.stretch == 1
    frame = choice.frames[0].outline
    assert (frame.box[0] + frame.box[1]).real / 2 == pytest.approx(45, abs=4)
    assert frame.polygon.covers(source.painted)


def test_a_subject_keeps_away_from_the_rim_and_near_the_middle_of_a_target_with_a_bite():
    source, detail = Drawing(STEP), detail_of_step()
    bitten = shapely.Point(0, 0).buffer(100).difference(shapely.Point(80, 80).buffer(50))
    search = _PlacementSearch(
        subject_of(source, detail), detail, TargetView.of(bitten), outline_points(bitten)
    )
    placement = search.best()
    cost = search.cost(placement)
    assert abs(placement.image - complex(bitten.centroid.x, bitten.centroid.y)) < 20
    assert cost.hidden < 0.1 and placement.stretch == 1
    subject = shapely.Polygon([(w.real, w.imag) for w in placement(Drawing(STEP).rings[0])])
    assert bitten.covers(subject) and subject.distance(bitten.exterior) > 6


def test_a_subject_in_a_part_of_the_target_costs_less_than_one_across_its_outline():
    source, detail = Drawing(STEP), detail_of_step()
    shown = shapely.box(0, 0, 30, 10)
    parts = shapely.MultiPolygon([shapely.box(0, 0, 20, 10), shapely.box(22, 0, 30, 10)])
    search = _PlacementSearch(subject_of(source, detail), detail, TargetView.of(shown), outline_points(parts))
    size = np.log(4 / abs(detail.box[1] - detail.box[0]))
    inside, across = (
        search.cost(search.placement((x, 5.0, size))).bare for x in (10.0, 20.0)
    )  # both are 5 off the middle
    assert across > inside + 0.002


def placed_step(target):
    """The step as it is placed in a target."""
    choice = Composer(Drawing(STEP), Drawing(target), detail_of_step(), Options()).placed()
    before, after = (frame.outline.box for frame in choice.frames)
    scale = (after[1] - after[0]).real / (before[1] - before[0]).real
    shift = after[0] - scale * before[0]
    return shapely.affinity.affine_transform(STEP, [scale, 0, 0, scale, shift.real, shift.imag])


def test_a_subject_is_made_a_little_smaller_to_lie_within_a_frame_but_not_much_smaller():
    plate = shapely.box(0, 0, 300, 130)
    alone = placed_step(plate)
    for bars, is_inside in ((12, True), (52, False)):
        room = shapely.box(bars, bars, 300 - bars, 130 - bars)
        placed = placed_step(plate - room)
        assert room.contains(placed) == is_inside
        ratio = np.sqrt(placed.area / alone.area)
        assert ratio > (0.74 if is_inside else 0.9)
        assert placed.envelope.centroid.distance(plate.centroid) < 10


def test_points_of_an_outline_are_even_also_on_holes():
    region = shapely.box(0, 0, 30, 10).difference(shapely.box(5, 2, 8, 4))
    points = outline_points(region)
    assert shapely.distance(shapely.points(points.real, points.imag), region.boundary).max() < 1e-9
    on_hole = shapely.contains_xy(shapely.box(4, 1, 9, 5), points.real, points.imag)
    assert on_hole.mean() == pytest.approx(10 / 90, abs=0.01)


def test_the_box_has_a_margin_unless_the_picture_fills_it():
    source = Drawing(STEP)
    margin = 0.05 * 50
    assert box_frame(source, detail_of_step()).outline.box == pytest.approx(
        (20 - margin + 1j * (10 - margin), 70 + margin + 1j * (30 + margin))
    )
    assert box_frame(source).outline.box == (20 + 10j, 70 + 30j)


def test_a_wide_photo_is_cropped_rather_than_stretched_onto_a_square():
    stripes = [(left, 0, left + 5, HEIGHT) for left in range(0, WIDTH, 10)]
    pixels = picture_of(*stripes)
    pixels[..., 3] = 1
    detail = Detail.of_picture(pixels, (0, WIDTH + 1j * HEIGHT))
    target = Drawing(shapely.box(0, 0, 60, 60))
    flag, photo = (
        Composer(Drawing(shapely.box(0, 0, WIDTH, HEIGHT)), target, one, Options()).placed().stretch
        for one in (detail, replace(detail, is_photo=True))
    )
    assert flag < 0.75 and 0.85 < photo < 1.02  # 2/3 fits the whole picture into the square
