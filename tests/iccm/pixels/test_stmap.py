"""STMaps of oblong textures and canvases: the meaning of s and t, and the inverse."""

import numpy as np
import pytest

from iccm.pixels.canvas import Canvas
from iccm.pixels.stmap import Stored, flat, point_of, st_of, stmap, transform
from tests.triangulations import irregular, map_of

RECTANGLE = np.array([0, 3, 3 + 1j, 1j])
BOX = (-1 - 1j, 4 + 1j)
CANVAS = Canvas(60, 25, (0j, 3 + 1j))


def identity():
    return map_of(irregular(RECTANGLE, 0.3), lambda w: w)


def test_s_counts_from_the_left_and_t_from_the_bottom():
    st = np.concatenate(list(stmap(identity(), BOX, CANVAS)))
    w = CANVAS.centres()
    assert (st[..., 3] == 1).all() and (st[..., 2] == 0).all()
    assert st[..., 0] == pytest.approx((w.real + 1) / 5, abs=1e-6)
    assert st[..., 1] == pytest.approx((w.imag + 1) / 2, abs=1e-6)


@pytest.mark.parametrize("turn", [1, np.exp(0.7j)])
def test_points_and_places_are_each_others_inverses(turn):
    lying = flat(BOX, turn)
    z = np.array([0.3 + 0.1j, 2.9 + 0.8j, -1.5 + 3j])
    assert point_of(lying, st_of(lying, z)) == pytest.approx(z)
    assert st_of(lying, np.array([1.5 + 0j])) == pytest.approx(np.array([[0.5, 0.5]]))


def test_a_stored_map_has_its_coverage_and_slopes():
    rows, columns = np.indices((4, 6))
    st = np.zeros((4, 6, 4), np.float32)
    st[..., 0], st[..., 1], st[..., 3] = 0.1 + 0.1 * columns, 0.9 - 0.2 * rows, 1
    st[0, 0, 3], st[3, 5, 3] = 0.25, 0
    band = Stored(st, 2.0).band(0)
    assert band.coverage[0, 0] == 0.25 and band.coverage[3, 5] == 0 and band.coverage[1, 1] == 1
    assert np.isnan(band.z[3, 5]) and band.z[1, 2] == pytest.approx(0.6 + 0.7j)
    assert band.right[1:3, :5] == pytest.approx(np.full((2, 5), 0.2))  # s times the aspect ratio
    assert band.down[:3, 1:5] == pytest.approx(np.full((3, 4), -0.2j))


def test_an_stmap_without_coverage_is_empty_where_s_and_t_are_0():
    st = np.full((3, 3, 2), 0.5, np.float32)
    st[0, 1] = 0
    st[2, 2] = 0.5, 0
    assert np.array_equal(Stored(st, 1.0).band(0).coverage > 0, [[1, 0, 1], [1, 1, 1], [1, 1, 1]])


def test_the_map_of_an_stmap_is_the_map_it_was_made_of():
    st = np.concatenate(list(stmap(identity(), BOX, CANVAS)))
    back = transform(st, BOX, CANVAS)
    z = np.array([0.4 + 0.7j, 2.6 + 0.2j])
    assert back(z) == pytest.approx(z, abs=1e-5)
    assert back.inverse(z) == pytest.approx(z, abs=1e-5)
