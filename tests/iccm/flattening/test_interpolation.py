"""Interpolated shapes: exact ends, stretch as geometric mean, no folds, and the same in reverse."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import iccm
from iccm import InputError
from iccm.curve import Curve
from iccm.maps.triangulated.simple import fault
from iccm.plane import orientation, triangle_areas

SQUARE = np.array([0, 4, 4 + 4j, 4j])
U = np.array([-3, 3, 3 + 6j, 2 + 6j, 2 + 1j, -2 + 1j, -2 + 6j, -3 + 6j])
STEPS = np.exp(2j * np.pi * np.arange(60) / 60)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_an_affine_map_is_interpolated_exactly(share):
    fit = iccm.fit(SQUARE, SQUARE)
    z = fit.map.source
    fit = replace(fit, map=replace(fit.map, image=3 * z.real + 0.5j * z.imag, bulge=None))
    (middle,) = iccm.morph(fit, [share])
    size = np.ptp(middle.image.real), np.ptp(middle.image.imag)
    assert size == pytest.approx((4 * 3**share, 4 * 0.5**share), rel=1e-5)


def test_rotations_are_interpolated_steadily():
    corners = np.array([0, 4, 4 + 4j, 2 + 3j, 5j])
    fit = iccm.fit(corners, corners * np.exp(1j), turn=np.degrees(1))
    for share, map in zip((0.25, 0.75), iccm.morph(fit, [0.25, 0.75])):
        assert np.angle(np.vdot(map.source - map.source.mean(), map.image)) == pytest.approx(share, abs=1e-6)
        assert triangle_areas(map.image[map.faces]) == pytest.approx(triangle_areas(map.source[map.faces]))


def test_shapes_move_steadily_from_place_to_place():
    fit = iccm.fit(SQUARE, 2 * SQUARE + 30 - 7j)
    first, last = fit.map.source.mean(), fit.map.image.mean()
    for share, map in zip((0.25, 0.75), iccm.morph(fit, [0.25, 0.75])):
        assert map.image.mean() == pytest.approx((1 - share) * first + share * last)


@pytest.mark.slow
def test_the_ends_are_those_shapes_and_nothing_folds_between():
    fit = iccm.fit(U, 2 * STEPS, fit="whole")
    maps = list(iccm.morph(fit, np.linspace(0, 1, 9)))
    assert np.array_equal(maps[0].image, fit.map.source) and maps[-1] is fit.map
    for map in maps:
        assert (orientation(*map.image[map.faces].T) > 0).all() and not fault([map.image[map.loops[0]]])
    moves = [np.abs(b.image - a.image).max() for a, b in pairwise(maps)]
    assert max(moves) < 2.5 * np.median(moves)


@pytest.mark.slow
def test_the_reverse_sequence_has_the_same_shapes():
    fit = iccm.fit(U, 2 * STEPS, fit="whole")
    inverse = iccm.TriangulatedMap(fit.map.image, fit.map.source, fit.map.faces, fit.map.loops)
    back = iccm.Fit(inverse, fit._ended, [], fit.target, fit.source, fit.pins, [])
    forward = [map.image for map in iccm.morph(fit, [0.25, 0.5, 0.75])]
    again = [map.image for map in iccm.morph(back, [0.25, 0.5, 0.75])][::-1]
    for shape, reverse_shape in zip(forward, again):
        assert np.abs(shape - reverse_shape).max() < 1e-2 * Curve(U).diagonal


def test_the_source_may_begin_at_another_vertex():
    fit = iccm.fit(SQUARE, 2 * STEPS)
    first, last = iccm.morph(fit, [0, 1], placed=(0.5j, 7))
    assert np.allclose(first.image, 0.5j * fit.map.source + 7) and last is fit.map


@pytest.mark.slow
def test_partial_maps_and_others_are_refused():
    with pytest.raises(InputError, match=r"morph: .*parts.*fit='whole'"):
        iccm.morph(iccm.fit(U, SQUARE, fit="contain"), [0.5])
    with pytest.raises(InputError, match=r"morph: .*balanced map"):
        iccm.morph(iccm.fit(SQUARE, STEPS, method="conformal"), [0.5])
