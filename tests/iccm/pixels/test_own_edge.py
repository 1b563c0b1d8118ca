"""Textures whose own antialiased edge is the source's outline."""

import numpy as np
import pytest

import iccm
from iccm.pixels.coverage import coverage_box
from iccm.pixels.own_edge import without_own_edge
from iccm.pixels.texture import Texture

N = 32
DISK = 16 + 16j + 12.3 * np.exp(2j * np.pi * np.arange(200) / 200)
BOX = (0j, N * (1 + 1j))


def sticker(opacity: float = 1.0) -> np.ndarray:
    """A disk (N, N, 4) with varying colours, as a renderer draws it: 8 bits, straight alpha."""
    out = np.zeros((N, N, 4), np.uint8)
    out[..., 0], out[..., 1] = np.mgrid[:N, :N] * 8
    out[..., 3] = np.rint(255 * opacity * coverage_box(DISK, 0, N, N)[::-1])
    out[out[..., 3] == 0] = 0
    return out


@pytest.mark.parametrize("opacity", [1.0, 0.6])
def test_alpha_is_that_of_the_inside_up_to_the_outline_and_beyond(opacity):
    pixels = sticker(opacity)
    result = without_own_edge(Texture(pixels, BOX, 3), [DISK]).pixels
    assert (result[..., 3] == round(255 * opacity)).all()
    kept = pixels[..., 3] >= 128 * opacity  # what is covered by half keeps its colour
    assert np.array_equal(result[kept, :3], pixels[kept, :3])
    beyond = ~kept & (np.hypot(*(np.mgrid[:N, :N] - 15.5)) < 14)  # others take the colour of the nearest
    ramp = 8 * np.moveaxis(np.mgrid[:N, :N], 0, 2)
    assert np.abs(result[beyond, :2].astype(int) - ramp[beyond]).max() <= 16


def test_associated_alpha_is_treated_as_straight_alpha():
    straight = sticker().astype(np.float32) / 255
    associated = np.concatenate([straight[..., :3] * straight[..., 3:], straight[..., 3:]], axis=2)
    from_straight = without_own_edge(Texture(straight, BOX, 3, "linear"), [DISK]).pixels
    from_associated = without_own_edge(Texture(associated, BOX, 3, "linear", True), [DISK]).pixels
    assert from_associated == pytest.approx(from_straight, abs=1e-5)


def test_a_transparent_window_inside_stays():
    pixels = sticker()
    pixels[13:19, 12:18, 3] = 0
    result = without_own_edge(Texture(pixels, BOX, 3), [DISK]).pixels
    assert np.array_equal(result[10:22, 9:21], pixels[10:22, 9:21])


def _faded(x, y):
    return np.clip(0.5 + (12.3 - np.hypot(x, y)) / 12, 0, 1)


@pytest.mark.parametrize(
    "alpha",
    [
        _faded,  # crosses one half at the outline, but is not an edge
        lambda x, y: np.clip(0.5 + x / 2, 0, 1),  # an edge elsewhere
        lambda x, y: np.random.default_rng(0).random(x.shape),
        lambda x, y: np.clip(9 - np.hypot(x, y), 0, 1),  # a disk well inside
    ],
)
def test_alpha_that_has_nothing_to_do_with_the_outline_stays(alpha):
    y, x = np.mgrid[:N, :N] - 15.5
    pixels = np.full((N, N, 4), 255, np.uint8)
    pixels[..., 3] = np.rint(255 * alpha(x, y))
    texture = Texture(pixels, BOX, 3)
    assert without_own_edge(texture, [DISK]) is texture


def test_holes_of_the_source_count_as_outlines():
    hole = 16 + 16j + 5.2 * np.exp(2j * np.pi * np.arange(100) / 100)
    pixels = sticker()
    pixels[..., 3] -= np.rint(255 * coverage_box(hole, 0, N, N)).astype(np.uint8)
    texture = Texture(pixels, BOX, 3)
    assert (without_own_edge(texture, [DISK, hole]).pixels[..., 3] == 255).all()
    assert without_own_edge(texture, [DISK]).pixels[15, 15, 3] == 0


def test_the_outline_of_an_oblong_texture_is_found():
    """20 rows of 50 texels, each 2 wide and 1 high."""
    texels = 31 + 10.4j + 7.7 * np.exp(2j * np.pi * np.arange(200) / 200)  # y down
    outline = 2 * texels.real + 1j * (20 - texels.imag)
    pixels = np.full((20, 50, 4), 90, np.uint8)
    pixels[..., 3] = np.rint(255 * coverage_box(texels, 0, 20, 50))
    result = without_own_edge(Texture(pixels, (0j, 100 + 20j), 3), [outline]).pixels
    assert (result[..., 3] == 255).all()


def test_a_float_texture_keeps_how_transparent_it_is():
    pixels = sticker(0.6).astype(np.float32) / 255
    result = without_own_edge(Texture(pixels, BOX, 3, "linear"), [DISK]).pixels
    assert result[..., 3] == pytest.approx(0.6, abs=1e-6)


def test_texels_transparent_up_to_the_outline_lend_no_colour():
    """Alpha is extended along the outline, too, over texels that are transparent and black."""
    pixels = sticker()
    pixels[pixels[..., 3] > 0, :3] = 200
    pixels[20:] = 0
    result = without_own_edge(Texture(pixels, BOX, 3), [DISK]).pixels
    assert (result[result[..., 3] > 0, :3] == 200).all() and (result[24:29, 16, 3] == 0).all()


def test_a_sticker_enlarged_is_opaque_up_to_the_targets_own_edge():
    transfer = iccm.transfer(sticker(), DISK, DISK * 2, size=400, texture_box=BOX)
    plain = iccm.transfer(sticker()[..., :3], DISK, DISK * 2, size=400, texture_box=BOX)
    assert np.array_equal(transfer.pixels[..., 3], plain.pixels[..., 3])


@pytest.mark.slow
def test_rows_and_kernel_give_the_same_alpha(shapes, iccm):
    from PIL import Image

    Image.fromarray(sticker()).save("sticker.png")
    result = iccm(
        "map", "sticker.png", "blob.svg", "--texture", "sticker.png", "-o", "out.png", "--size", "200"
    )
    assert result.code == 0
    alpha = np.asarray(Image.open("out.png"))[..., 3]
    result = iccm(
        "map", "sticker.png", "blob.svg", "--texture", "checker", "-o", "board.png", "--size", "200"
    )
    assert np.array_equal(alpha, np.asarray(Image.open("board.png"))[..., 3])
