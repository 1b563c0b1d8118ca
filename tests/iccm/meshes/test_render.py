"""Rendered surfaces: orientation, and edges without a fringe."""

import numpy as np

from iccm.meshes.render import render
from iccm.pixels.sampler import Sampler
from iccm.pixels.texture import Texture

POINTS = np.array([[0, 0, 0], [4.03, 0.3, 0], [3.7, 2.9, 0], [0.2, 2.1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
FRONT = np.eye(3)  # x right, y up


def test_what_is_up_on_the_surface_is_up_in_the_picture():
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4, :, 0], pixels[4:, :, 2] = 255, 255  # red above blue
    corners = np.array([[0, 8], [8, 8], [8, 0], [0, 0]], float)[FACES]  # in texels, y down
    sampler = Sampler(Texture(pixels, (0, 1 + 1j)), "nearest")
    made = render(POINTS, FACES, corners, sampler, 80, FRONT).astype(int)
    assert made.shape[1] == 80 and 50 < made.shape[0] < 65
    seen = made[..., 3] == 255
    rows = (
        np.nonzero(seen & (made[..., 0] > made[..., 2]))[0],
        np.nonzero(seen & (made[..., 2] > made[..., 0]))[0],
    )
    assert rows[0].size > 1000 and rows[1].size > 1000 and rows[0].mean() < rows[1].mean() - 15


def test_edges_have_the_colour_of_the_inside():
    """A flat surface has a single colour, which edge pixels contain partially."""
    made = render(POINTS, FACES, np.zeros((2, 3, 2)), None, 80, FRONT)
    edge, inside = (made[..., 3] > 0) & (made[..., 3] < 255), made[..., 3] == 255
    assert edge.sum() > 50 and np.ptp(made[inside][:, :3], axis=0).max() <= 1
    assert np.abs(made[edge][:, :3].astype(int) - made[inside][0, :3]).max() <= 1
