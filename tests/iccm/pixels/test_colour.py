"""Stored pixels and linear light, compared with values computed by hand."""

import numpy as np
import pytest

from iccm.pixels import colour

GREY = 0.21586050011389926  # 128 of 255 in linear light


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_black_and_white_are_0_and_1_in_every_depth(dtype):
    pixels = np.array([[[0], [np.iinfo(dtype).max]]], dtype)
    for srgb in (False, True):
        values = colour.decode(pixels, -1, srgb=srgb, associated=False, premultiply=False)
        assert values.ravel().tolist() == [0, 1]
        assert np.array_equal(colour.encode(values, np.dtype(dtype), -1, srgb=srgb), pixels)


def test_the_curve_of_srgb_meets_known_values():
    assert colour.linear_from_srgb(128 / 255) == pytest.approx(GREY)
    assert colour.linear_from_srgb(np.array([0.04, -0.5])) == pytest.approx([0.04 / 12.92, -0.21404114])
    assert colour.srgb_from_linear(GREY) == pytest.approx(128 / 255)


@pytest.mark.parametrize(
    ("associated", "premultiply", "red"),
    [
        (False, False, GREY),
        (False, True, GREY * 64 / 255),
        (True, False, colour.linear_from_srgb(128 / 64)),
        (True, True, colour.linear_from_srgb(128 / 64) * 64 / 255),
    ],
)
def test_alpha_is_not_decoded_and_multiplied_in_or_divided_out(associated, premultiply, red):
    for alpha in (0, 1):
        pixel = np.array([64, 128] if alpha == 0 else [128, 64], np.uint8).reshape(1, 1, 2)
        values = colour.decode(pixel, alpha, srgb=True, associated=associated, premultiply=premultiply)
        assert values[0, 0, alpha] == pytest.approx(64 / 255)
        assert values[0, 0, 1 - alpha] == pytest.approx(red)


@pytest.mark.parametrize(("dtype", "top"), [(np.uint8, 255), (np.uint16, 65535)])
def test_integers_are_rounded_to_the_nearest(dtype, top):
    values = (np.array([10.4, 10.6, 199.51, -3, top + 9.0]) / top).reshape(1, -1, 1).astype(np.float32)
    stored = colour.encode(values, np.dtype(dtype), -1, srgb=False)
    assert stored.ravel().tolist() == [10, 11, 200, 0, top]


def test_associated_colours_are_encoded_before_alpha_is_multiplied_in():
    value = np.array([[[GREY * 0.5, 0.5]]], np.float32)
    stored = colour.encode(value, np.dtype(np.uint16), 1, srgb=True, associated=True)
    assert stored.ravel().tolist() == [round(65535 * 128 / 255 / 2), 32768]
