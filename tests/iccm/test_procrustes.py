"""Procrustes analysis: identities, an independent implementation for two shapes, and mean outlines."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import procrustes

from iccm import Curve, InputError
from iccm.arrays import xy_of
from iccm.procrustes import mean_outline, superimpose

SHAPE = np.array([0, 4, 5 + 1.5j, 3.5 + 3j, 1 + 2.5j, 2 + 1j])  # without any symmetry


def varied(count, spread=0.15, seed=4):
    """Copies of the shape with scattered landmarks, each scaled, rotated and moved."""
    random = np.random.default_rng(seed)
    scattered = SHAPE + spread * random.normal(size=(count, SHAPE.size, 2)) @ [1, 1j]
    factors = random.uniform(0.3, 4, count) * np.exp(1j * random.uniform(-0.6, 0.6, count))
    return factors[:, None] * scattered + (random.normal(size=(count, 2)) @ [30, 30j])[:, None]


def test_similar_shapes_are_superimposed_exactly_by_the_known_similarity():
    factor, shift = 2.5 * np.exp(0.4j), 7 - 3j
    superimposed = superimpose(np.array([SHAPE, factor * SHAPE + shift]))
    assert superimposed.distances == pytest.approx([0, 0], abs=1e-12)
    first, second = superimposed.placed
    assert first.factor / second.factor == pytest.approx(factor)
    assert second(factor * SHAPE + shift) == pytest.approx(superimposed.mean)
    assert superimposed.sizes[1] / superimposed.sizes[0] == pytest.approx(2.5)
    # the mean is rotated by half of the rotation between the two
    assert np.angle(first.factor) == pytest.approx(0.2)


def test_the_mean_of_copies_is_the_shape():
    superimposed = superimpose(np.array([SHAPE] * 4))
    centred = SHAPE - SHAPE.mean()
    assert superimposed.mean == pytest.approx(centred / np.linalg.norm(centred))


def test_the_order_of_specimens_does_not_matter():
    shapes = varied(7)
    order = np.array([3, 6, 0, 2, 5, 1, 4])
    superimposed, reordered = superimpose(shapes), superimpose(shapes[order])
    assert reordered.mean == pytest.approx(superimposed.mean, abs=1e-10)
    assert reordered.distances == pytest.approx(superimposed.distances[order], abs=1e-10)


def test_two_shapes_have_the_distance_of_scipy():
    a, b = varied(2)
    _, _, disparity = procrustes(
        xy_of(a), xy_of(b)
    )  # of full Procrustes analysis, with scale: sin² of the angle
    superimposed = superimpose(np.array([a, b]))
    angle = np.arcsin(np.sqrt(disparity))
    assert superimposed.distances == pytest.approx(
        [2 * np.sin(angle / 4)] * 2
    )  # each is half the angle from the mean


def test_no_other_rotations_have_a_smaller_sum_of_squares():
    shapes = varied(5, spread=0.5)
    superimposed = superimpose(shapes)
    unit = shapes - shapes.mean(axis=1, keepdims=True)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)

    def scatter(angles):
        turned = np.exp(1j * angles)[:, None] * unit
        return np.sum(np.abs(turned - turned.mean(axis=0)) ** 2)

    angles = np.array([np.angle(place.factor) for place in superimposed.placed])
    best = min(minimize(scatter, angles + shake).fun for shake in ([0, 0.5, -0.4, 0.1, 1], [1, 0, 2, -1, 0]))
    assert scatter(angles) <= best * (1 + 1e-9)


def test_mirror_images_are_reflected_only_if_allowed():
    shapes = varied(6)
    shapes[[1, 4]] = shapes[[1, 4]].conj()
    superimposed = superimpose(shapes, reflect=True)
    assert superimposed.mirrored.tolist() == [False, True, False, False, True, False]
    assert superimposed.placed[1](shapes[1]) == pytest.approx(superimposed.mean, abs=0.15)
    assert superimposed.distances.max() < 0.2 < superimpose(shapes).distances.max()
    assert superimpose(shapes[[1, 4, 2]], reflect=True).mirrored.tolist() == [False, False, True]


def test_landmarks_in_one_point_are_refused():
    with pytest.raises(InputError, match="one point"):
        superimpose(np.array([SHAPE, np.full(SHAPE.size, 3 + 4j)]))


def test_the_mean_outline_divides_outlines_between_anchors_equally():
    box = Curve(np.array([0, 4, 4 + 2j, 2j]))
    taller = Curve(np.array([4, 4 + 4j, 4j, 0j]))  # begins elsewhere
    corners = np.array([box.closest(box.z), taller.closest(np.array([0, 4, 4 + 4j, 4j]))])
    mean = mean_outline([box, taller], corners, count=24)
    assert mean[0] == 0 and Curve(mean).area == pytest.approx(12)
    assert np.abs(mean - (4 + 3j)).min() < 1e-12


def test_outlines_without_anchors_begin_where_they_are_closest():
    circle = np.exp(2j * np.pi * np.arange(200) / 200) * (1 + 0.3 * np.cos(2 * np.pi * np.arange(200) / 200))
    outlines = [Curve(np.roll(circle, shift)) for shift in (0, 57, 140)]
    mean = mean_outline(outlines, np.empty((3, 0)), count=400)
    assert Curve(circle).distances(mean).max() < 0.01
    assert Curve(mean).area == pytest.approx(Curve(circle).area, rel=1e-3)
