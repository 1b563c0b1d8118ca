"""Correspondences of two outlines to start from: elastic matches, and arclength with shifts.

Elastic matching of closed curves by dynamic programming over cyclic shifts (Sebastian, Klein, Kimia, *On
aligning curves*, 2003): monotone paths with slopes from ¼ to 4 that maximise ∫ √(ds dτ) (cos of the angle
between the tangents - ½ |difference of the positions|²), with positions relative to the radius of gyration.
"""

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...arrays import Complex, Index, Real
from ...curve import Curve
from ..model.boundary_pairs import Match

OUTLINE_SAMPLES = 64  # of each outline; 120 found the same matches on 15 pairs
CYCLIC_SHIFTS = 16  # cyclic shifts of the target tried for each rotation
POSITION_WEIGHT = 0.5  # weight of the difference of positions
# Relative to the length: extension of the chord from which a sample's tangent is computed.
TANGENT_CHORD_SHARE = 0.01
# Mean distance on the unit circle above which two matches count as different.
DIFFERENT_MATCH_DISTANCE = 0.12
STEPS = np.array([(1, 1), (1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2), (1, 4), (4, 1), (3, 4), (4, 3)])
LONGEST = 4  # the most rows or columns of a step
ARCLENGTH_SHIFTS = 8  # number of shifts of the arclength correspondence
MOST_TURNED = np.radians(100)
"""Largest rotation of the similarity that fits a match best. On 16 pairs, no match rotated by more than 60° led
to an upright map.
"""
TURNS = ((0.0, 5), (0.6, 2), (-0.6, 2))  # rotations of elastic starts in radians, and the number of each
ANY_TURN = (0.0, 4), (0.5 * np.pi, 2), (np.pi, 2), (-0.5 * np.pi, 2)
"""The same if the rotation is left to the shapes."""


def step_gains(score: Real) -> Real:
    """Return (k, n + 1, 2n) the gain of each step to each pair of samples, with the second curve's samples repeated.

    Args:
        score: (n, n) gain of matching sample i of one curve with sample j of the other.
    """
    n = len(score)
    around, gains = np.tile(score, 3), np.zeros((len(STEPS), n + 1, 2 * n))
    for gain, (a, b) in zip(gains, STEPS.tolist()):
        count = max(a, b)
        for m in range(count):
            i, j = m * a // count, m * b // count
            gain[a:, b:] += around[i : i + n + 1 - a, j : j + 2 * n - b]
        gain *= np.sqrt(a * b) / count
    return gains


def best_scores(gains: Real) -> Real:
    """Return the largest scores of monotone paths from (0, 0) to (i, j), for several shifts at once.

    Args:
        gains: (k, n + 1, s, n + 1) from `step_gains`, by step, row, shift, and column beyond the shift.

    Returns:
        (LONGEST + n + 1, s, LONGEST + n + 1), of which the first LONGEST rows and columns are -inf.
    """
    _, rows, shifts, _ = gains.shape
    wide = LONGEST + rows
    best = np.full((wide, shifts, wide), -np.inf)
    best[LONGEST, :, LONGEST] = 0.0
    places = wide * np.arange(shifts)[:, None] + np.arange(rows)
    predecessors = ((LONGEST - STEPS) @ [shifts * wide, 1])[:, None, None] + places  # from row i - LONGEST on
    for i in range(1, rows):
        best[LONGEST + i, :, LONGEST:] = (best[i:].take(predecessors) + gains[:, i]).max(axis=0)
    return best


def best_path(best: Real, gains: Real) -> tuple[Index, Index]:
    """Return the rows and columns, from 0 to n, of the best path to the last entry of the scores.

    Args:
        best: (LONGEST + n + 1, LONGEST + n + 1) from `best_scores`, for one shift.
        gains: (k, n + 1, n + 1) for the same shift.
    """
    i = j = gains.shape[1] - 1
    path = [(i, j)]
    while i > 0:
        # steps from before the first row or column come from the padding, whose scores are -inf
        before = best[LONGEST + i - STEPS[:, 0], LONGEST + j - STEPS[:, 1]]
        step = (before + gains[:, i, j]).argmax()
        i, j = i - int(STEPS[step, 0]), j - int(STEPS[step, 1])
        path.append((i, j))
    rows, columns = np.array(path[::-1]).T
    return rows, columns


def _samples(curve: Curve) -> tuple[Complex, Complex]:
    """Return (OUTLINE_SAMPLES,) unit tangents and midpoints of equal pieces of a closed curve.

    The curve's centroid should be 0; the midpoints are in units of the radius of gyration.
    """
    s = curve.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    start, end = curve.at(s), curve.at(s + curve.length / OUTLINE_SAMPLES)
    reach = TANGENT_CHORD_SHARE * curve.length
    chord = curve.at(s + curve.length / OUTLINE_SAMPLES + reach) - curve.at(s - reach)
    middle = 0.5 * (start + end)
    return chord / np.maximum(np.abs(chord), 1e-12), middle / np.sqrt(np.mean(np.abs(middle) ** 2))


def elastic_matches(source: Curve, target: Curve, rotation: float) -> Iterator[Match]:
    """Yield elastic matches of the source, rotated by `rotation` radians, with the target, best first."""
    tangents, middles = (np.exp(1j * rotation) * w for w in _samples(source))
    goals, places = _samples(target)
    angles = (tangents[:, None] * goals.conj()).real
    score = angles - POSITION_WEIGHT * np.abs(middles[:, None] - places) ** 2
    gains = sliding_window_view(step_gains(score), OUTLINE_SAMPLES + 1, axis=2)[
        :, :, : OUTLINE_SAMPLES : OUTLINE_SAMPLES // CYCLIC_SHIFTS
    ]
    best = best_scores(gains)
    for k in np.argsort(-best[-1, :, -1], kind="stable"):
        rows, columns = best_path(best[:, k], gains[:, :, k])
        shift = k * OUTLINE_SAMPLES // CYCLIC_SHIFTS
        yield Match(
            rows / OUTLINE_SAMPLES * source.length, (columns + shift) / OUTLINE_SAMPLES * target.length
        )


def arclength_matches(source: Curve, target: Curve, count: int = ARCLENGTH_SHIFTS) -> list[Match]:
    """Return matches in proportion to arclength, with evenly spaced shifts."""
    shifts = target.length * np.arange(count) / count
    ends = np.array([0.0, 1.0])
    return [Match(ends * source.length, shift + ends * target.length) for shift in shifts]


class Different:
    """A list of matches that rejects matches similar to those it has."""

    def __init__(self, source: Curve, target: Curve):
        self._samples, self._length = source.length * np.arange(64) / 64, target.length
        self._kept: list[Complex] = []
        self.matches: list[Match] = []

    def add(self, match: Match) -> bool:
        """Add a match if it is new, and return whether it was."""
        places = np.exp(2j * np.pi / self._length * match.at(self._samples))
        if any(np.mean(np.abs(places - other)) < DIFFERENT_MATCH_DISTANCE for other in self._kept):
            return False
        self._kept.append(places)
        self.matches.append(match)
        return True


def candidates(
    source: Curve, target: Curve, rotations: tuple[tuple[float, int], ...], times: int = 1
) -> list[Match]:
    """Return elastic matches at several rotations, and shifts of the arclength; `times` as many as usual."""
    distinct = Different(source, target)
    for rotation, count in rotations:
        first_new(distinct, elastic_matches(source, target, rotation), times * count)
    return distinct.matches + arclength_matches(source, target, times * ARCLENGTH_SHIFTS)


def first_new(distinct: Different, matches: Iterator[Match], count: int) -> None:
    """Add the first `count` matches that differ from those found."""
    for match in matches:
        if distinct.add(match):
            count -= 1
        if count == 0:
            return


def implied_rotation(match: Match, source: Curve, target: Curve) -> float:
    """Return the rotation in radians of the similarity that fits a match best."""
    s = source.length * np.arange(OUTLINE_SAMPLES) / OUTLINE_SAMPLES
    return float(np.angle(np.sum(source.at(s).conj() * target.at(match.at(s)))))


def without_upside_down(matches: list[Match], source: Curve, target: Curve) -> list[Match]:
    """Return the matches that do not turn the picture upside down."""
    return [match for match in matches if abs(implied_rotation(match, source, target)) < MOST_TURNED]
