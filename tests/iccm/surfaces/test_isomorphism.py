"""Meshes with the same connectivity in any order."""

import numpy as np
import pytest

from iccm.surfaces.isomorphism import SEEDS_TRIED, Polygons, isomorphism

RNG = np.random.default_rng(3)


def fans(count):
    """Many equal pieces of three triangles, and one of four."""
    fan = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0], [-1, 0, 0.1], [-1, -1, 0]])
    points, faces = [], []
    for k in range(count):
        triangles = 3 + (k == 0)
        faces += [[len(points), len(points) + j, len(points) + j + 1] for j in range(1, triangles + 1)]
        points += list(fan[: triangles + 2] + np.array([3 * k, 5 * (k % 7), 0]))
    return np.array(points), np.array(faces)


def shuffled(points, faces, shape):
    """The same triangles with vertices, faces and first corners in another order, in another shape."""
    order, rows = RNG.permutation(len(points)), RNG.permutation(len(faces))
    number = np.empty_like(order)
    number[order] = np.arange(order.size)
    corners = (np.arange(3) + RNG.integers(0, 3, (rows.size, 1))) % 3
    return Polygons.triangles(shape(points)[order], number[faces[rows[:, None], corners]]), rows[
        :, None
    ] * 3 + corners


@pytest.mark.parametrize("shape", [lambda x: x, lambda x: x @ [[0, 9.0, 0], [0, 0, 9], [8, 0, 0]] + 4])
def test_each_of_many_equal_pieces_is_matched_to_itself(shape):
    points, faces = fans(SEEDS_TRIED + 20)
    new, expected = shuffled(points, faces, shape)
    assert np.array_equal(isomorphism(Polygons.triangles(points, faces), new), expected.ravel())


def test_other_connectivity_has_no_partner():
    points, faces = fans(5)
    reconnected = np.concatenate([faces[:-1], [[0, 1, 5]]])
    assert isomorphism(Polygons.triangles(points, faces), Polygons.triangles(points, reconnected)) is None
