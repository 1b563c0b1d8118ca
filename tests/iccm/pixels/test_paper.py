"""Paper below drawings: where it is visible, and its colour."""

import functools

import numpy as np
import pytest
import shapely
import shapely.affinity

from iccm.arrays import xy_of
from iccm.pixels.paper import INK_SHARE, cleared, on_paper, without_holes
from iccm.pixels.texture import Texture

BOX = (0j, 5 + 3j)


def at(texture, place):
    """The pixel of a texture at a place in the plane."""
    height, width = texture.pixels.shape[:2]
    low, high = texture.box
    column = (place - low).real / (high - low).real * width
    row = (high - place).imag / (high - low).imag * height
    return texture.pixels[int(row), int(column)]


def drawing(colour, dtype=np.uint8, associated=False):
    """3 rows of 5 pixels: the first two columns are painted, the third by half, the rest not at all."""
    largest = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    pixels = np.zeros((3, 5, len(colour) + 1))
    pixels[:, :3, :-1] = colour
    pixels[:, :2, -1], pixels[:, 2, -1] = 1, 0.5
    if associated:
        pixels[..., :-1] *= pixels[..., -1:]
    pixels = pixels * largest
    stored = np.rint(pixels) if largest > 1 else pixels
    return Texture(stored.astype(dtype), BOX, alpha=len(colour), associated=associated)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("associated", [False, True])
def test_paper_shows_where_nothing_is_painted(dtype, associated):
    colour = np.array((0.8, 0.1, 0.3))
    texture = on_paper(drawing(colour, dtype, associated))
    largest = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    got = texture.pixels[1] / largest
    paper = INK_SHARE * colour + (1 - INK_SHARE)
    expected = np.array([colour, colour, (colour + paper) / 2, paper, paper])
    np.testing.assert_allclose(got[:, :3], expected, atol=2.1 / 255)
    np.testing.assert_allclose(got[:, 3], 1)


def luminance(colour):
    """Relative luminance of an sRGB colour from 0 to 1 (IEC 61966-2-1)."""
    colour = np.asarray(colour, float)
    light = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return light @ (0.2126, 0.7152, 0.0722)


def test_a_drawing_as_light_as_white_lies_on_dark_paper():
    white, grey = (on_paper(drawing(c)).pixels[0, 4] for c in ((1, 1, 1), (0.8,)))
    assert white[:3].max() < 60
    assert len(grey) == 2 and grey[0] > 200


@pytest.mark.parametrize("colour", [(1, 0.8, 0), (0.96, 0.63, 0.25), (0.7, 0.2, 0.9), (0.1, 0.1, 0.3)])
def test_paper_differs_from_white_and_from_the_drawing(colour):
    paper = on_paper(drawing(colour)).pixels[0, 4, :3] / 255
    from_white, from_ink = (
        1.05 / (luminance(paper) + 0.05),
        (luminance(paper) + 0.05) / (luminance(colour) + 0.05),
    )
    assert from_white > 1.19
    assert from_ink > 0.98 * from_white


def test_textures_without_alpha_or_without_gaps_stay_as_they_are():
    opaque = Texture(np.full((3, 5, 3), 7, np.uint8), BOX)
    assert on_paper(opaque) is opaque
    full = Texture(np.full((3, 5, 4), 255, np.uint8), BOX, alpha=3)
    np.testing.assert_array_equal(on_paper(full).pixels, full.pixels)


def test_a_light_drawing_with_a_dark_part_lies_on_dark_paper_if_its_silhouette_is_light():
    pixels = np.zeros((40, 60, 4), np.uint8)
    pixels[10:30, 10:50] = pixels[5:10, 10:20] = 240, 244, 250, 255
    pixels[14:26, 20:40] = 60, 60, 70, 255
    assert on_paper(Texture(pixels, (0, 60 + 40j), alpha=3)).pixels[2, 2, :3].max() < 80
    pixels[5:30, 10] = pixels[5:30, 49] = pixels[5, 10:20] = pixels[29, 10:50] = 0, 0, 0, 255
    assert on_paper(Texture(pixels, (0, 60 + 40j), alpha=3)).pixels[2, 2, :3].min() > 150


def test_the_ground_of_a_picture_is_its_paper_and_an_outline_is_not():
    pixels = np.zeros((40, 60, 4), np.uint8)
    pixels[5:35, 5:55] = 20, 40, 200, 255
    pixels[15:25, 20:40] = 255, 255, 255, 255
    assert on_paper(Texture(pixels, (0, 60 + 40j), alpha=3)).pixels[0, 0].tolist() == [20, 40, 200, 255]
    pixels[7:33, 7:53] = 255, 255, 0, 255  # the blue is now an outline
    assert on_paper(Texture(pixels, (0, 60 + 40j), alpha=3)).pixels[0, 0, :3].min() > 100


def test_a_tone_extends_the_texture_and_has_lighter_paper_in_its_holes_alone():
    texture = drawing((0.0, 0.0, 0.0))
    hole = np.array([5, 5 + 1j, 6 + 1j, 6])
    painted = [np.array([3 - 1j, 7 - 1j, 7 + 2j, 3 + 2j]), hole]
    plain, toned = on_paper(texture), on_paper(texture, painted)
    (low, high), (height, width) = toned.box, toned.pixels.shape[:2]
    assert low.real <= 0 and low.imag <= -1 and high.real >= 7 and high.imag >= 3
    assert high - low == complex(width, height)  # the same texels
    paper, tone = at(toned, 5.5 + 0.5j), at(toned, 5.5 + 1.5j)
    assert paper[3] == tone[3] == 255
    paper, tone = paper[:3], tone[:3]
    assert (tone < plain.pixels[0, 4, :3]).all() and (plain.pixels[0, 4, :3] < paper).all()
    assert (at(toned, 6.5 - 0.5j)[:3] == tone).all() and (at(toned, 6.5 + 0.5j)[:3] == tone).all()
    assert at(toned, 5.5 + 2.5j)[3] == at(toned, 0.5 - 0.5j)[3] == 0  # neither painted nor enclosed
    assert all((at(toned, z) == at(texture, z)).all() for z in (0.5 + 0.5j, 1.5 + 1.5j, 0.5 + 2.5j))


def test_a_tone_never_reaches_the_edge_of_the_texture_where_it_would_be_continued():
    square = np.array([-1 - 1j, 4 - 1j, 4 + 2j, -1 + 2j])
    toned = on_paper(drawing((0.5, 0, 0)), [square])
    alpha = toned.pixels[..., 3]
    assert not alpha[0].any() and not alpha[-1].any() and not alpha[:, 0].any() and not alpha[:, -1].any()


def test_no_tone_lies_below_a_picture_on_a_flat_ground():
    pixels = np.full((40, 60, 4), 255, np.uint8)
    pixels[10:30, 20:40, :3] = 0
    texture = Texture(pixels, (0, 60 + 40j), alpha=3)
    assert on_paper(texture, [np.array([-9, 70, 70 + 40j])]).pixels.shape == pixels.shape


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (1.0, 0.85, 0.1), (0.2, 0.4, 0.9)])
def test_a_tone_is_seen_on_white_and_below_the_drawing(colour):
    tone = at(on_paper(drawing(colour), [np.array([3, 7, 7 + 2j, 3 + 2j])]), 4.5 + 1.5j)[:3] / 255
    assert 1.05 / (luminance(tone) + 0.05) > 1.55
    assert np.abs(tone - colour).max() > 25 / 255


def test_a_drawing_of_the_usual_tone_lies_on_another_one():
    usual = at(on_paper(drawing((0.0, 0.0, 0.0)), [np.array([3, 7, 7 + 2j, 3 + 2j])]), 4.5 + 1.5j)[:3] / 255
    tone = at(on_paper(drawing(tuple(usual)), [np.array([3, 7, 7 + 2j, 3 + 2j])]), 4.5 + 1.5j)[:3] / 255
    assert np.abs(tone - usual).max() > 25 / 255


def area_of(rings):
    return functools.reduce(shapely.symmetric_difference, [shapely.Polygon(xy_of(ring)) for ring in rings])


PLATE = shapely.box(0, 0, 40, 20)


def test_the_part_of_an_area_below_a_drawing_is_cleared_and_the_drawing_is_enclosed_where_it_is_shown():
    area = shapely.box(0, 0, 30, 20) - shapely.box(2, 2, 28, 18)
    shown = shapely.box(0, 0, 34, 20)
    drawing = shapely.box(8, 6, 40, 12)  # across the right side, and beyond what is shown
    rings = cleared(area, [np.array([8 + 6j, 40 + 6j, 40 + 12j, 8 + 12j])], shown)
    hairline = 1e-3 * np.hypot(30, 20)  # is left of the drawing's edge, twice
    left = area_of(rings)
    assert left.intersection((drawing & shown).buffer(-2.1 * hairline)).area < 1e-9
    assert left.difference(drawing).symmetric_difference(area - drawing).area < 1e-9
    enclosed = shapely.union_all([shapely.Polygon(xy_of(ring)) for ring in without_holes(rings)])
    assert enclosed.area == pytest.approx(600 + (4 - hairline) * (6 - 2 * hairline), abs=0.01)


SQUARE = np.array([8 + 6j, 14 + 6j, 14 + 12j, 8 + 12j])


def test_parts_within_a_target_are_left_out_together_where_a_drawing_lies_on_one_of_them():
    frame = shapely.box(0, 0, 40, 20) - shapely.box(2, 2, 38, 18)
    another = shapely.affinity.translate(frame, 50, 0)
    below, beside, elsewhere = shapely.box(10, 5, 16, 9), shapely.box(20, 5, 24, 9), shapely.box(70, 5, 74, 9)
    left = area_of(cleared(frame | below | beside | another | elsewhere, [SQUARE], shapely.box(0, 0, 90, 20)))
    outside = left.difference(shapely.Polygon(xy_of(SQUARE)))
    assert outside.symmetric_difference(frame | another | elsewhere).area < 0.01


def test_holes_are_filled_below_a_drawing_with_others_of_their_size_but_large_ones_stay():
    below, alike, other = shapely.box(10, 5, 16, 9), shapely.box(20, 5, 26, 9.5), shapely.box(30, 5, 34, 11)
    left = area_of(cleared(PLATE - below - alike - other, [SQUARE], PLATE))
    hairline = 1e-3 * np.hypot(40, 20)
    assert left.area == pytest.approx(40 * 20 - (6 - 4 * hairline) ** 2 - other.area, abs=0.01)
    assert left.contains(shapely.Point(15.5, 7)) and not left.contains(shapely.Point(32, 7))
    window = shapely.box(10, 5, 30, 18)  # a third of the plate, with two thirds of the drawing
    assert area_of(cleared(PLATE - window, [SQUARE], PLATE)).area == pytest.approx(
        40 * 20 - window.area - 2 * 6, abs=2
    )


def test_a_hole_with_most_of_a_drawing_inside_stays():
    for right, is_kept in ((13, True), (12, False)):  # 5/6 and 2/3 of the drawing
        left = area_of(cleared(PLATE - shapely.box(6, 5, right, 13), [SQUARE], PLATE))
        assert left.contains(shapely.Point(7, 9)) != is_kept


def test_marks_in_the_middle_of_a_ring_that_is_placed_around_them_are_left_out():
    plate = PLATE - shapely.box(19, 9, 21, 11)
    bars = [
        np.array([10 + 2j, 12 + 2j, 12 + 18j, 10 + 18j]),
        np.array([28 + 2j, 30 + 2j, 30 + 18j, 28 + 18j]),
    ]
    assert area_of(cleared(plate, bars, PLATE)).contains(shapely.Point(20, 10))
