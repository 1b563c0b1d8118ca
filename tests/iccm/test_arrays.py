import hypothesis.extra.numpy as arrays
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from iccm.arrays import as_complex, xy_of
from iccm.errors import InputError


@given(arrays.arrays(np.complex128, arrays.array_shapes(max_dims=3)))
def test_coordinates_are_the_bits_of_the_complex_numbers(z):
    assert xy_of(z).shape == (*z.shape, 2)
    assert xy_of(z).tobytes() == np.ascontiguousarray(z).tobytes()


def test_an_array_of_another_shape_is_named():
    with pytest.raises(InputError, match=r"outline: .*shape \(2, 2\); .*\(n,\)"):
        as_complex([[1, 2], [3, 4j]], "outline")
    with pytest.raises(InputError, match=r"pins: .*shape \(2, 2, 3\); .*\(n, 2\)"):
        as_complex(np.zeros((2, 2, 3)), "pins", 2)


@given(arrays.arrays(np.float64, st.tuples(st.integers(0, 9), st.just(2))), st.sampled_from(["C", "F"]))
def test_real_pairs_are_x_and_y_to_the_bit(xy, order):
    z = as_complex(np.asarray(xy, order=order), "outline")
    assert z.real.tobytes() == xy[:, 0].tobytes() and z.imag.tobytes() == xy[:, 1].tobytes()
    pins = as_complex(np.stack([xy, xy[::-1]], 1), "pins", 2)
    assert pins.shape == (len(xy), 2) and pins[:, 0].tobytes() == z.tobytes() == pins[::-1, 1].tobytes()


def test_pairs_of_integers_and_of_numbers_in_lists_are_points():
    expected = np.array([1 + 2j, 3 + 4j])
    for pairs in ([(1, 2), (3, 4)], np.array([[1, 2], [3, 4]], np.uint8), [[1.0, 2], [3, 4]]):
        assert np.array_equal(as_complex(pairs, "outline"), expected)
    assert as_complex([(1, 2)], "pins", 2).tolist() == [[1, 2]]  # two real points, as before


def test_integers_beyond_floating_point_are_refused():
    with pytest.raises(InputError, match="outline: "):
        as_complex([0, 10**400, 1j], "outline")
