"""Shapes of the same form but other proportions: one is stretched onto the other, and lines stay straight."""

import numpy as np
import pytest

import iccm

TRAPEZOID = np.array([0, 9, 7 + 5j, 1 + 5j])  # not symmetric
DRESS = (
    "M140 20C150 70 175 100 200 105C225 100 250 70 260 20H285C285 90 300 140 275 220C320 330 360 430 375 530C260 560 "
    "140 560 25 530C40 430 80 330 125 220C100 140 115 90 115 20Z"
)
HEART = (
    "M240 420C60 300 20 200 20 140C20 70 75 20 140 20C185 20 222 45 240 85C258 45 295 20 340 20C405 20 460 70 460 140"
    "C460 200 420 300 240 420Z"
)
INSIDE = np.array([2 + 1j, 6 + 1j, 5 + 4j, 3 + 3j])


def stretch(z, across, up):
    return across * np.real(z) + 1j * up * np.imag(z)


@pytest.mark.parametrize(("across", "up"), [(2, 1), (1, 3.4), (0.5, 1.5)])
def test_a_shape_of_other_proportions_is_stretched(across, up):
    fit = iccm.fit(TRAPEZOID, stretch(TRAPEZOID, across, up) + 3)
    assert fit.status.ok and not fit.notes
    assert fit.map(INSIDE) == pytest.approx(stretch(INSIDE, across, up) + 3, abs=1e-6)
    assert fit.inverse(stretch(INSIDE, across, up) + 3) == pytest.approx(INSIDE, abs=1e-6)
    assert fit.source.z.size == 4 and fit.report()["boundary"]["hausdorff"] < 1e-9


def test_a_shape_is_bent_where_a_stretch_costs_much_more():
    goal = stretch(INSIDE, 9, 1)
    fit = iccm.fit(TRAPEZOID, stretch(TRAPEZOID, 9, 1))
    assert np.abs(fit.map(INSIDE) - goal).max() > 1


def test_nothing_is_stretched_where_angles_are_to_be_kept_or_the_form_is_another():
    target = stretch(TRAPEZOID, 1.6, 1)
    angles = iccm.fit(TRAPEZOID, target, balance=0)
    assert np.abs(angles.map(INSIDE) - stretch(INSIDE, 1.6, 1)).max() > 0.2
    notched = np.insert(target, 2, 10 + 2j)
    assert np.abs(iccm.fit(TRAPEZOID, notched).map(INSIDE) - stretch(INSIDE, 1.6, 1)).max() > 0.2


def test_the_first_pin_changes_nothing_and_the_next_ones_bend_the_stretch_near_them():
    target = stretch(TRAPEZOID, 1, 3.4)
    place = 6 + 1j
    first = iccm.fit(TRAPEZOID, target, pins=[(place, stretch(place, 1, 3.4))])
    assert first.map(INSIDE) == pytest.approx(stretch(INSIDE, 1, 3.4), abs=0.15)
    goal = stretch(place, 1, 3.4) + 1j
    moved = iccm.fit(TRAPEZOID, target, pins=[(place, goal)], exact_pins=True)
    assert moved.status.ok and moved.map(place) == pytest.approx(goal, abs=1e-3)
    assert moved.map(3 + 3j) == pytest.approx(stretch(3 + 3j, 1, 3.4), abs=0.5)
    assert moved.pins[0] == pytest.approx([place, goal])


def test_a_map_that_continues_from_a_stretch_stays_one():
    target = stretch(TRAPEZOID, 1, 3.4)
    place = 6 + 1j
    start = iccm.fit(TRAPEZOID, target, pins=[(place, stretch(place, 1, 3.4))])
    goal = stretch(place, 1, 3.4) + 0.5j
    fit = iccm.fit(TRAPEZOID, target, pins=[(place, goal)], start=start)
    assert fit.map(3 + 3j) == pytest.approx(stretch(3 + 3j, 1, 3.4), abs=0.3)


@pytest.mark.slow
def test_a_symmetric_map_is_preferred_to_one_that_leans(tmp_path):
    """A dress onto a heart was rotated by 22 degrees, which costs 5 % less energy."""
    shapes = []
    for name, path in (("dress", DRESS), ("heart", HEART)):
        file = tmp_path / f"{name}.svg"
        file.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 480 560"><path d="{path}"/></svg>'
        )
        shapes.append(iccm.read_shape(file))
    fit = iccm.fit(*shapes)
    points = np.array([210 - 300j, 160 - 450j])
    images = fit.map(points)
    assert fit.map(400 - points.conj()) == pytest.approx(480 - images.conj(), abs=1)
