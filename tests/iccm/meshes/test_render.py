"""Rendered surfaces: orientation, and edges without a fringe."""

import numpy as np

from iccm.meshes.render import render
from iccm.pixels.sampler import Sampler
from iccm.pixels.texture import Texture

POINTS = np.array([[0, 0, 0], [4.03, 0.3, 0], [3.7, 2.9, 0], [0.2, 2.1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
FRONT = np.eye(3)  # x right, y up


def test_up_on_the_surface_is_up_in_the_picture():
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4, :, 0], pixels[4:, :, 2] = 255, 255  # red above blue
    corners = np.array([[0, 8], [8, 8], [8, 0], [0, 0]], float)[FACES]  # in texels, y down
    sampler = Sampler(Texture(pixels, (0, 1 + 1j)), "nearest")
    picture = render(POINTS, FACES, corners, sampler, 80, FRONT).astype(int)
    assert picture.shape[1] == 80 and 50 < picture.shape[0] < 65
    seen = picture[..., 3] == 255
    rows = (
        np.nonzero(seen & (picture[..., 0] > picture[..., 2]))[0],
        np.nonzero(seen & (picture[..., 2] > picture[..., 0]))[0],
    )
    assert rows[0].size > 1000 and rows[1].size > 1000 and rows[0].mean() < rows[1].mean() - 15


def test_edges_have_the_colour_of_the_inside():
    """A flat surface has a single colour, which edge pixels contain partially."""
    picture = render(POINTS, FACES, np.zeros((2, 3, 2)), None, 80, FRONT)
    edge, inside = (picture[..., 3] > 0) & (picture[..., 3] < 255), picture[..., 3] == 255
    assert edge.sum() > 50 and np.ptp(picture[inside][:, :3], axis=0).max() <= 1
    assert np.abs(picture[edge][:, :3].astype(int) - picture[inside][0, :3]).max() <= 1
