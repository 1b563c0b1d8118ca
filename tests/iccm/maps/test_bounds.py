"""Bounds on the distortion: what the angles of the outlines allow."""

import numpy as np
import pytest

from iccm.maps.bounds import angle_ratio
from iccm.maps.triangulated.map import TriangulatedMap


def notched(depth):
    """A regular polygon of 12 vertices about 0, the first of which is moved inwards, and 0."""
    rim = np.exp(2j * np.pi * np.arange(12) / 12)
    rim[0] *= depth
    return np.append(rim, 0)


def inner_angles(z, faces):
    """The sum of the triangles' angles at each vertex."""
    angles = np.zeros(z.size)
    for k in range(3):
        corner, first, second = (z[np.roll(faces, -k, axis=1)[:, j]] for j in range(3))
        np.add.at(angles, faces[:, k], np.abs(np.angle((second - corner) / (first - corner))))
    return angles


def test_the_angle_ratio_is_that_of_inner_angles_also_at_reflex_corners():
    faces = np.array([[12, k, (k + 1) % 12] for k in range(12)])
    source, image = notched(0.3), 2j * notched(0.6)
    before, after = (inner_angles(z, faces)[:12] for z in (source, image))
    assert before[0] > 1.5 * np.pi and after[0] > 1.2 * np.pi  # reflex on both sides
    map = TriangulatedMap(source, image, faces, (np.arange(12),))
    expected = np.maximum(before / after, after / before).max()
    assert angle_ratio(map) == pytest.approx(expected)
    assert angle_ratio(map.linear_inverse()) == pytest.approx(expected)
