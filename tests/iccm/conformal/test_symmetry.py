"""Conformal maps of shapes with a common axis of symmetry are symmetric."""

import numpy as np
import pytest

import iccm
from iccm.conformal.correspondence import Moebius
from iccm.conformal.symmetry import common_axes, shift_of, translation
from iccm.curve import Curve
from iccm.symmetry import axes_of
from tests.exact import to_square
from tests.shapes import blob, circle, conformal_fit, ell, pear, square, star

WIDE = np.array([-3 - 1j, 3 - 1j, 3 + 1j, -3 + 1j])
SHIELD = np.array([-1 + 1j, -1 - 0.5j, -0.6 - 1.2j, -1.7j, 0.6 - 1.2j, 1 - 0.5j, 1 + 1j])
TRIANGLE = np.array([-1, 1, 2.5j])
LYRE = np.array([-1, 1, 1.4 + 2j, 0.6 + 2.4j, 0.4 + 1j, -0.4 + 1j, -0.6 + 2.4j, -1.4 + 2j])


def angles(directions):
    return sorted(np.degrees(np.angle(directions)) % 180)


@pytest.mark.parametrize(
    ("outline", "degrees"),
    [
        (WIDE * np.exp(0.3j), [np.degrees(0.3), 90 + np.degrees(0.3)]),
        (square(3) + 5, [0, 45, 90, 135]),
        (ell(), [45]),
        (1j * TRIANGLE - 40j, [0]),
        (star(100), [0, 36, 72, 108, 144]),
        (pear(), []),
        (blob(), []),
    ],
)
def test_the_axes_of_an_outline(outline, degrees):
    found = angles(axes_of(Curve.domain(outline)))
    rotated = angles(axes_of(Curve.domain(outline * np.exp(0.1j))))
    wrapped = [degree for degree in found if degree < 179.9] + [0.0 for degree in found if degree >= 179.9]
    assert sorted(wrapped) == pytest.approx(degrees, abs=0.1)
    assert len(rotated) == len(degrees)


def test_of_a_disc_all_directions_are_axes():
    assert axes_of(Curve.domain(circle(200))) is None
    axes = common_axes(Curve.domain(circle()), Curve.domain(TRIANGLE), 1.0)
    assert len(axes) == 1
    ends, images = axes[0]
    assert sorted(images.imag) == pytest.approx([0, 2.5], abs=1e-6) and np.abs(images.real).max() < 1e-6
    assert (ends[1] - ends[0]) / (images[1] - images[0]) == pytest.approx(2 / 2.5, rel=1e-3)


def test_axes_in_common_are_parallel_in_the_upright_picture():
    wide, triangle = Curve.domain(WIDE), Curve.domain(TRIANGLE)
    assert len(common_axes(wide, triangle, 1.0)) == 1
    assert len(common_axes(wide, wide, 1.0)) == 2
    assert len(common_axes(triangle, Curve.domain(TRIANGLE * 1j), 1.0)) == 0
    assert len(common_axes(triangle, Curve.domain(TRIANGLE * 1j), 1j)) == 1


def test_translations_of_the_disc_take_ends_to_ends():
    ends, images = np.exp([0.4j, 2.9j]), np.exp([-1.0j, 3.5j])
    others = np.exp([1.5j, 4.6j])
    m = translation(ends, images, 0.7)
    assert isinstance(m, Moebius) and abs(m.b) < 1
    assert np.abs(m.inside(ends) - images).max() < 1e-12
    assert shift_of(ends, images, others, m.inside(others)) == pytest.approx(0.7)
    again = Moebius.of(m.parameters)
    assert np.abs(again.inside(others) - m.inside(others)).max() < 1e-12
    further = translation(ends, images, 1.2)
    inner = np.array([0.1 + 0.2j, -0.5j])
    closer = [np.abs(w - images[1]) for w in (m.inside(inner), further.inside(inner))]
    assert (closer[1] < closer[0]).all()
    several = translation(ends, images, np.array([[0.7], [1.2]]))
    assert np.abs(several.inside(inner) - [m.inside(inner), further.inside(inner)]).max() < 1e-12


def asymmetry_of(fit, source_axis, target_axis):
    """The distance of the map's mirror image from the map, relative to the target's diagonal.

    It is not exceeded at 90 % of the points: where corners are enlarged, linear interpolation of the boundary is
    less exact. Each axis is a point and a direction.
    """
    inside = iccm.curve.interior_grid(fit.source, 200)
    (p, d), (q, e) = source_axis, target_axis
    mirrored = q + e**2 * (fit.map(p + d**2 * (inside - p).conj()) - q).conj()
    away = np.abs(mirrored - fit.map(inside))
    return float(np.nanquantile(away, 0.9)) / fit.target.diagonal


VERTICAL = 0.0, 1j
PAIRS = {
    "wide to shield": (WIDE, SHIELD),
    "shield to wide": (SHIELD, WIDE),
    "triangle to lyre": (TRIANGLE, LYRE),
    "square to wide": (square(), WIDE),
    "disc to shield": (circle(), SHIELD),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_shapes_with_the_same_axis_have_a_symmetric_map(name):
    fit = conformal_fit(*PAIRS[name])
    assert fit.status.ok
    assert asymmetry_of(fit, VERTICAL, VERTICAL) < 5e-3
    top = np.array([0.9j * fit.source.box[1].imag])  # upright: the top stays on top
    assert fit.map(top)[0].imag > fit.map(np.array([0.1j + 0.9j * fit.source.box[0].imag]))[0].imag


def test_a_map_of_two_shapes_with_two_axes_in_common_is_symmetric_about_both():
    fit = conformal_fit(WIDE, square())
    assert asymmetry_of(fit, VERTICAL, VERTICAL) < 5e-3
    assert asymmetry_of(fit, (0.0, 1.0), (0.0, 1.0)) < 5e-3


def test_the_axis_may_have_any_direction():
    turned = np.exp(0.7j)
    fit = conformal_fit(WIDE * turned + 3, SHIELD * turned - 2j)
    assert asymmetry_of(fit, (3.0, 1j * turned), (-2j, 1j * turned)) < 5e-3


def test_the_symmetric_map_of_the_square_onto_the_disc_is_the_known_one():
    u = 0.8 * np.exp(2j * np.pi * np.arange(12) / 12)
    fit = conformal_fit(square(), circle(400), tolerance=1e-4)
    assert np.abs(fit.map(to_square()(u)) - u).max() < 2e-3


def test_pins_decide_against_symmetry():
    pins = [(0.5 + 0.2j, 0.3 - 0.5j), (-0.5 + 0.2j, -0.1 - 0.2j)]
    fit = conformal_fit(WIDE, SHIELD, pins=pins)
    assert asymmetry_of(fit, VERTICAL, VERTICAL) > 0.02


def test_shapes_whose_axes_differ_are_mapped_as_before():
    fit = conformal_fit(TRIANGLE, 1j * SHIELD)
    assert fit.status.ok
