"""Rasters in the plane with unequal sides and pixels that are not square."""

import numpy as np
import pytest

from iccm.pixels.canvas import Canvas, proportional

OBLONG = Canvas(5, 4, (1 + 2j, 11 + 4j))  # pixels of 2 by 1/2


@pytest.mark.parametrize(
    ("longer", "extent", "size"),
    [(100, 3 + 1j, (100, 33)), (90, 1 + 3j, (30, 90)), (7, 1000 + 1j, (7, 1))],
)
def test_the_longer_side_has_the_requested_pixels(longer, extent, size):
    assert proportional(longer, extent) == size


def test_a_canvas_about_a_box_has_square_pixels_and_shows_all_of_it():
    assert Canvas.about(40, 10, (0j, 3 + 2j)).box == (-2.5 + 0j, 5.5 + 2j)
    low, high = Canvas.about(10, 40, (0j, 3 + 2j)).box
    assert (low, high) == (pytest.approx(0 - 5j), pytest.approx(3 + 7j))


def test_pixel_centres_are_amid_their_pixels():
    assert OBLONG.step == (2, 0.5)
    assert OBLONG.centre(1, 2) == 6 + 3.25j
    assert OBLONG.centre(0, 1, size=2) == 7 + 3.5j  # in the middle of the second block of 2 by 2 pixels
    assert np.array_equal(OBLONG.centres(3), [[2 + 2.25j, 4 + 2.25j, 6 + 2.25j, 8 + 2.25j, 10 + 2.25j]])


def test_points_in_pixels_count_from_the_upper_left_corner():
    rows, columns = np.indices((4, 5))
    assert OBLONG.pixels(OBLONG.centres()) == pytest.approx(columns + 0.5 + 1j * (rows + 0.5))
