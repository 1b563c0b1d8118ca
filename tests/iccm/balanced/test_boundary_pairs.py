"""Boundary pairs: in order, through corners and anchors, and well spaced."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.balanced.model.boundary_pairs import Match, boundary_pairs, limit_slope, pass_through
from iccm.balanced.model.outline import Outline, manageable
from iccm.balanced.search.initial_matches import (
    STEPS,
    Different,
    arclength_matches,
    best_path,
    best_scores,
    elastic_matches,
    implied_rotation,
    step_gains,
    without_upside_down,
)
from iccm.curve import Curve


def polygon(radii, turn=0.0):
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return Curve(np.array(radii) * np.exp(1j * (angles + turn)))


def outline(curve):
    return Outline.of(curve, 0.0, 0.0)


RADII = st.lists(st.floats(0.3, 1.0), min_size=5, max_size=25)


@settings(max_examples=40, deadline=None)
@given(RADII, RADII, st.floats(0, 1), st.floats(0.05, 0.5))
def test_pairs_are_in_order_and_hold_every_corner(first, second, shift, spacing):
    source, target = outline(polygon(first)), outline(polygon(second, 0.1))
    match = Match(np.array([0.0, source.length]), shift * target.length + np.array([0.0, target.length]))
    pairs = boundary_pairs(source, target, match, spacing)
    for values, length, corner_lengths, corners in (
        (pairs.s, source.length, pairs.at_source, source.corners),
        (pairs.tau, target.length, pairs.at_target, target.corners),
    ):
        gaps = np.diff(values, append=values[0] + length)
        assert gaps.min() > 0 and gaps.max() <= spacing * (1 + 1e-6)
        assert np.allclose(np.sort(np.mod(values[corner_lengths] + 1e-9, length)), corners + 1e-9, atol=1e-8)


def test_close_corners_of_the_two_outlines_become_one_pair():
    source = outline(polygon([1.0] * 6))
    match = Match(np.array([0.0, source.length]), np.array([0.0, source.length]) + 0.01)
    pairs = boundary_pairs(source, source, match, 0.3)
    assert (pairs.at_source & pairs.at_target).sum() == 6 == pairs.at_source.sum()


@settings(max_examples=40, deadline=None)
@given(st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.floats(-2, 2))
def test_a_match_is_bent_through_its_anchors(place, goal, shift):
    length, target = 3.0, 5.0
    match = Match(np.array([0.0, 1.0, length]), shift + np.array([0.0, 2.5, target]))
    anchors = Match(np.array([0.0, place * length]), np.array([0.0, goal * target]))
    bent = pass_through(match, anchors)
    assert np.allclose(bent.at(anchors.s), anchors.tau, atol=1e-9)
    assert bent.tau[-1] - bent.tau[0] == pytest.approx(target)
    assert (np.diff(bent.tau) >= 0).all() and (np.diff(bent.s) > 0).all()


def test_slopes_are_limited_and_the_lap_is_kept():
    match = limit_slope(Match(np.array([0.0, 1.0, 1.01, 2.0]), np.array([0.0, 0.001, 2.9, 3.0])), 4.0)
    slopes = np.diff(match.tau) / np.diff(match.s) / 1.5
    assert match.tau[-1] - match.tau[0] == pytest.approx(3) and slopes.max() / slopes.min() <= 16 + 1e-9


def test_a_shape_matches_itself_elastically():
    curve = polygon([1.0, 0.5, 0.9, 0.4, 1.0, 0.7, 0.3])
    best = next(elastic_matches(curve, curve, 0.0))
    s = np.linspace(0, curve.length, 50)
    gap = np.mod(best.at(s) - s + 0.5 * curve.length, curve.length) - 0.5 * curve.length
    assert np.abs(gap).max() < 1e-9


def gain(score, i, j, a, b):
    """The score of a step from (i, j): the sum over the samples that it passes, over its length."""
    count, size = max(a, b), len(score)
    passed = [score[i + m * a // count, (j + m * b // count) % size] for m in range(count)]
    return np.mean(passed) * np.sqrt(a * b)


def test_the_best_path_is_that_of_all_paths():
    n, shift = 6, 2
    score = np.random.default_rng(5).standard_normal((n, n))
    gains = step_gains(score)[:, :, None, shift : shift + n + 1]
    scores = best_scores(gains)[:, 0]
    rows, columns = best_path(scores, gains[:, :, 0])

    def best(i, j):
        if (i, j) == (n, n):
            return 0.0
        ahead = [(a, b) for a, b in STEPS if i + a <= n and j + b <= n]
        return max((gain(score, i, j + shift, a, b) + best(i + a, j + b) for a, b in ahead), default=-np.inf)

    steps = zip(rows, columns, np.diff(rows), np.diff(columns))
    assert scores[-1, -1] == pytest.approx(best(0, 0))
    assert scores[-1, -1] == pytest.approx(sum(gain(score, i, j + shift, a, b) for i, j, a, b in steps))
    assert (rows[0], columns[0], rows[-1], columns[-1]) == (0, 0, n, n)


def test_starts_that_mirror_the_picture_are_omitted():
    curve = polygon([1.0, 0.5, 0.9, 0.4, 1.0, 0.7, 0.3])
    curve = Curve(curve.z - curve.z.mean())
    matches = arclength_matches(curve, curve)
    kept = without_upside_down(matches, curve, curve)
    assert 3 <= len(kept) < len(matches) and kept[0] is matches[0]
    assert max(abs(implied_rotation(match, curve, curve)) for match in kept) < np.radians(100)


def test_a_rotated_shape_matches_at_its_rotation():
    curve = polygon([1.0, 0.5, 0.9, 0.4, 1.0, 0.7, 0.3])
    turned = Curve(curve.z * 1j)
    best = next(elastic_matches(curve, turned, 0.5 * np.pi))
    s = np.linspace(0, curve.length, 50)
    assert np.abs(turned.at(best.at(s)) - 1j * curve.at(s)).max() < 1e-9


def test_equivalent_matches_count_once():
    curve = polygon([1.0] * 8)
    distinct = Different(curve, curve)
    matches = arclength_matches(curve, curve)
    assert all(distinct.add(match) for match in matches)
    assert not distinct.add(Match(matches[2].s, matches[2].tau + 0.01 * curve.length))


def test_arclengths_go_to_the_given_outline_and_back():
    angles = 2 * np.pi * np.arange(400) / 400
    curve = Curve((1 + 0.3 * np.cos(3 * angles)) * np.exp(1j * angles))
    coarse = Outline.of(curve, 5e-3, 1e-2)
    s = np.linspace(-1, 2, 77) * coarse.length
    assert coarse.curve.z.size < 100 and coarse.corners.size < coarse.curve.z.size
    assert np.allclose(coarse.simplified_from(coarse.original(s)), s)
    assert np.abs(curve.at(coarse.original(s)) - coarse.curve.at(s)).max() < 0.02 * curve.diagonal


def test_an_outline_of_many_vertices_is_simplified():
    rng = np.random.default_rng(0)
    angles = 2 * np.pi * np.arange(12000) / 12000
    curve = Curve((1 + 0.004 * rng.standard_normal(12000)) * np.exp(1j * angles))
    assert manageable(curve, 1e-3).z.size <= 3000
