"""The balance as a field, against maps whose singular values are known."""

import numpy as np
import pytest

from iccm.balanced.meshing.mesh import Sizes, triangulate
from iccm.balanced.minimise.emphasis import (
    LARGEST,
    MOST_SCALED,
    MOST_SHEARED,
    WEIGHT,
    BalanceField,
    emphasised,
)

SQUARE = np.array([-0.5 - 0.5j, 0.5 - 0.5j, 0.5 + 0.5j, -0.5 + 0.5j])
OUTLINE = np.concatenate([a + (b - a) * np.arange(8) / 8 for a, b in zip(SQUARE, np.roll(SQUARE, -1))])
Z, FACES = triangulate(OUTLINE, Sizes.even(0.02))
Y, FINE = triangulate(OUTLINE, Sizes.even(0.005))


def stretched(z, along, across):
    return along * z.real + 1j * across * z.imag


def test_a_similarity_leaves_the_balance_even():
    field = emphasised(Z, 1j * Z, FACES)
    np.testing.assert_allclose(field.thetas, 1, atol=0.01)
    np.testing.assert_allclose(field.weights, 1, atol=0.01)


def test_angles_count_most_where_dilatation_is_at_its_bound():
    found = [
        emphasised(Z, stretched(Z, np.sqrt(k), 1 / np.sqrt(k)), FACES) for k in (2.0, MOST_SHEARED, 12.0)
    ]
    assert found[1].weights == pytest.approx(1 + WEIGHT)
    assert found[1].thetas == pytest.approx(np.exp(-1), rel=0.01)
    assert found[0].weights.max() < 2 and found[2].weights.max() < 2


def test_sizes_count_most_where_the_scale_is_at_its_bound_either_way():
    for scale in (MOST_SCALED, 1 / MOST_SCALED):
        assert emphasised(Z, scale * Z, FACES).thetas == pytest.approx(np.exp(1), rel=0.01)
    assert emphasised(Z, MOST_SCALED * Z, FACES).times(1.0).thetas == pytest.approx(LARGEST)


def test_a_field_is_carried_to_another_mesh_of_the_shape():
    def smooth(points):
        return np.exp(0.5 * points.real), np.exp(1 + points.imag)

    field = BalanceField(*smooth(Z[FACES].mean(axis=1)))
    carried = field.carried(Z, FACES, Y, FINE)
    middle = Y[FINE].mean(axis=1)
    inside = np.maximum(np.abs(middle.real), np.abs(middle.imag)) < 0.3
    for found, expected in zip(carried, smooth(middle)):
        np.testing.assert_allclose(found[inside], expected[inside], rtol=0.05)


def test_the_mean_with_another_field_is_geometric():
    one, four = BalanceField.even(1.0, 3), BalanceField(np.full(3, 4.0), np.full(3, 9.0))
    np.testing.assert_allclose(one.mean(four), [[2.0] * 3, [3.0] * 3])
    assert one.mean(None) is one
