"""Tiles (UDIM): their numbers, and pictures of several tiles as one."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.pictures import image_files, tiles
from iccm.io.pictures.image_files import Image


def test_numbers_count_rows_of_ten():
    assert [tiles.number_of(tile) for tile in (0j, 2 + 0j, 1j, 9 + 3j)] == [1001, 1003, 1011, 1040]
    assert tiles.number_of(10 + 0j) is None and tiles.number_of(-1 + 0j) is None
    assert tiles.all_of(np.array([[0.5, 1.5], [2.5, 0.5], [0.1, 0.2]])) == [0j, 2 + 0j, 1j]


@pytest.fixture
def pattern(tmp_path):
    """Tiles of 6 by 4 texels, one of half that size: 1002, 1012 above it, and 1013 beside that."""
    rng = np.random.default_rng(0)
    pictures = {}
    for number, shape in ((1002, (4, 6, 3)), (1012, (2, 3, 3)), (1013, (4, 6, 3))):
        pictures[number] = rng.integers(0, 256, shape, np.uint8)
        image_files.write(tmp_path / f"a.{number}.png", Image(pictures[number]))
    return str(tmp_path / "a.<UDIM>.png"), pictures


def test_pictures_of_tiles_lie_where_their_tiles_do(pattern):
    name, pictures = pattern
    image = tiles.read(name, [1 + 0j, 1 + 1j, 2 + 1j, 2 + 0j])
    assert image.box == (1 + 0j, 3 + 2j)
    pixels = image.image.pixels
    assert pixels.shape == (8, 12, 3)
    assert np.array_equal(pixels[4:, :6], pictures[1002]) and np.array_equal(pixels[:4, 6:], pictures[1013])
    assert np.array_equal(pixels[:4, :6], pictures[1012].repeat(2, axis=0).repeat(2, axis=1))
    assert not pixels[4:, 6:].any() and any("1003" in note for note in image.image.notes)


def test_tiles_are_enlarged_each_way_by_its_own_factor(pattern, tmp_path):
    name, _ = pattern
    flat = np.arange(36, dtype=np.uint8).reshape(2, 6, 3)
    image_files.write(tmp_path / "a.1003.png", Image(flat))
    pixels = tiles.read(name, [1 + 0j, 2 + 0j]).image.pixels
    assert np.array_equal(pixels[:, 6:], flat.repeat(2, axis=0))


def test_tiles_whose_sizes_do_not_divide_are_refused(pattern, tmp_path):
    image_files.write(tmp_path / "a.1003.png", Image(np.zeros((3, 6, 3), np.uint8)))
    with pytest.raises(InputError, match=r"1003.*6x3 does not divide 6x4"):
        tiles.read(pattern[0], [1 + 0j, 2 + 0j])
    with pytest.raises(InputError, match="all tiles together, 12x8, exceed the limit of 95"):
        tiles.read(pattern[0], [1 + 0j, 2 + 1j], max_pixels=95)
