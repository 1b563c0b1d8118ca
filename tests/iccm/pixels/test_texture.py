"""A picture's place in the plane, with unequal sides, rotated, or repeated beyond its edges."""

import numpy as np
import pytest

from iccm.pixels.texture import Texture, TexturePlaces, Wrapped, wrapped

OBLONG = Texture(np.zeros((20, 60, 3), np.uint8), (1 + 1j, 7 + 5j))  # 10 texels per unit across, 5 down


def places(texture, z, right, down):
    columns = np.array([z]), np.array([right], np.complex64), np.array([down], np.complex64)
    result = texture.places(*columns)
    return result.xy[0], result.jacobian[0]


def test_an_oblong_texture_has_a_scale_across_and_one_down():
    assert OBLONG.scale == (10, 5)
    xy, turn = places(OBLONG, 2.5 + 4j, 0.1 + 0.3j, 0.2 - 0.4j)
    assert xy == pytest.approx([15, 5])
    assert turn == pytest.approx([1, 2, -1.5, 2])  # dx/dx, dx/dy, dy/dx, dy/dy


def test_a_rotated_texture_is_looked_up_where_it_was():
    turned = Texture(OBLONG.pixels, OBLONG.box, rotation=1j)
    middle, away = 4 + 3j, 1.5 + 0.5j
    straight, rotated = (
        places(t, middle + f * away, f * 0.1, f * 0.1j) for t, f in ((OBLONG, 1), (turned, 1j))
    )
    assert rotated[0] == pytest.approx(straight[0])
    assert rotated[1] == pytest.approx(straight[1], abs=1e-6)


def test_a_mirrored_texture_runs_backwards_in_every_other_tile():
    xy = np.array([[7.0, 3.0], [67.0, 3.0], [7.0, 23.0], [-7.0, -3.0], [127.0, 43.0]])
    turn = np.tile([1.0, 2.0, 3.0, 4.0], (5, 1))
    result = wrapped(TexturePlaces(xy, turn), (60, 20), ("mirror", "mirror"))
    assert result.xy == pytest.approx(np.array([[7, 3], [53, 3], [7, 17], [7, 3], [7, 3]]))
    across, down = [1, -1, 1, -1, 1], [1, 1, -1, -1, 1]
    assert result.jacobian == pytest.approx(
        np.array([[a, 2 * a, 3 * d, 4 * d] for a, d in zip(across, down)])
    )


def test_each_direction_repeats_in_its_own_way():
    z = np.array([8 + 6j])
    still = np.zeros(1, np.complex64)
    for wrap, xy in (
        (("repeat", "repeat"), [10, 15]),
        (("mirror", "repeat"), [50, 15]),
        (("repeat", "mirror"), [10, 5]),
        (("clamp", "clamp"), [70, -5]),
    ):
        assert Wrapped(OBLONG, wrap).places(z, still, still).xy[0] == pytest.approx(xy)
