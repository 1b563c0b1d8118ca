"""Cubics fitted to images of curves."""

import numpy as np
import pytest

from iccm.maps import arc_fit, bezier_fit

TOLERANCE = 1e-4


def spirals(which, t):
    """Points on curves that bend more and more; the last one is straight."""
    return np.where(which == 3, t * (2 + 1j), np.exp((0.3 + 2j) * (which + 1) * t) + which)


def test_cubics_are_within_the_tolerance_and_join(monkeypatch):
    fitted = bezier_fit.refit(spirals, 4, TOLERANCE)
    for number, cubics in enumerate(fitted):
        t = np.linspace(0, 1, 4000)
        curve = spirals(np.full(t.size, number), t)
        s = np.linspace(0, 1, 40)[:, None]
        weights = np.concatenate([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3], axis=1)
        points = (cubics @ weights.T).ravel()
        away = np.abs(points[:, None] - curve).min(axis=1)
        assert away.max() < 1.5 * TOLERANCE + np.abs(np.diff(curve)).max() / 2
        assert np.array_equal(cubics[1:, 0], cubics[:-1, 3])
        assert [cubics[0, 0], cubics[-1, 3]] == pytest.approx([curve[0], curve[-1]], abs=1e-12)
    assert len(fitted[3]) == 1 < len(fitted[0]) < len(fitted[2])


def test_a_curve_that_leaves_the_cubic_anywhere_is_divided():
    for place in (0.1, 0.3, 0.5, 0.7, 0.9):  # a bump that all but one of the compared parameters miss
        bump = lambda which, t, place=place: t + 1j * np.exp(-(((t - place) / 0.05) ** 2))  # noqa: E731
        (cubics,) = bezier_fit.refit(bump, 1, 1e-3)
        assert len(cubics) > 4


@pytest.mark.parametrize("block", [1, 3, 1000])
def test_blocks_of_intervals_do_not_change_the_result(monkeypatch, block):
    expected = bezier_fit.refit(spirals, 4, TOLERANCE)
    arcs = arc_fit.refit_arcs(spirals, np.arange(4) == 3, TOLERANCE)
    monkeypatch.setattr(bezier_fit, "INTERVALS_AT_ONCE", block)
    for a, b in zip(expected, bezier_fit.refit(spirals, 4, TOLERANCE), strict=True):
        assert np.array_equal(a, b)
    for a, b in zip(arcs, arc_fit.refit_arcs(spirals, np.arange(4) == 3, TOLERANCE), strict=True):
        assert np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])


def test_curves_without_an_image_end():
    fitted = bezier_fit.refit(lambda which, t: np.where(t > 0.4, np.nan, t).astype(complex), 1, TOLERANCE)
    assert not np.isfinite(fitted[0]).all()


def test_no_curves_have_no_cubics():
    assert sum(len(part) for part in bezier_fit.refit(spirals, 0, TOLERANCE)) == 0
