"""Linear maps of the plane given by two complex numbers, compared with matrices."""

import numpy as np
import pytest

from iccm.meshes.stretch import Linear, laid_flat, linear, stretches

RNG = np.random.default_rng(4)


def numbers(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


def test_maps_are_composed_and_inverted():
    first, then, z = Linear(numbers(5), numbers(5)), Linear(numbers(5), numbers(5)), numbers(5)
    image = first.a * z + first.b * z.conj()
    composed = then @ first
    assert composed.a * z + composed.b * z.conj() == pytest.approx(then.a * image + then.b * image.conj())
    assert composed.determinant == pytest.approx(first.determinant * then.determinant)
    back = first.inverse()
    assert back.a * image + back.b * image.conj() == pytest.approx(z)


def test_triangles_go_onto_triangles():
    z, w = numbers(5, 3), numbers(5, 3)
    derivative = linear(z, w)
    step = z[:, 1:] - z[:, :1]
    assert derivative.a[:, None] * step + derivative.b[:, None] * step.conj() == pytest.approx(
        w[:, 1:] - w[:, :1]
    )


def test_stretches_are_singular_values():
    space = RNG.normal(size=(1, 3, 3))
    flat = laid_flat(space)
    plane = 3 * flat.real + 0.5j * flat.imag
    assert [float(values[0]) for values in stretches(space, plane)] == pytest.approx([3, 0.5])
    assert [float(values[0]) for values in stretches(space, plane.conj())] == pytest.approx([3, -0.5])
