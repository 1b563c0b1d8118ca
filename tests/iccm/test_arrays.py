import hypothesis.extra.numpy as arrays
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
    with pytest.raises(InputError, match=r"outline: an array of shape \(2, 2\); \(n,\)"):
        as_complex([[1, 2], [3, 4]], "outline")
