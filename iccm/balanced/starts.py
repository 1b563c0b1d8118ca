"""Correspondences of two outlines to start from: elastic matches and arclength with shifts.

Elastic matching of closed curves by dynamic programming over cyclic shifts (Sebastian, Klein, Kimia, *On aligning
curves*, 2003): monotone paths with slopes from ¼ to 4 that maximise ∫ √(ds dτ) (cos of the angle between the tangents
- ½ |difference of the positions|²), positions relative to the radius of gyration.
"""

from collections.abc import Iterator

import numpy as np

from ..arrays import Complex
from ..curve import Curve
from ..jit import kernel
from .pairs import Match

SAMPLES = 64  # of each outline; 120 found the same matches on 15 pairs
SHIFTS = 16  # cyclic shifts of the target tried for each turn
POSITION = 0.5  # weight of the difference of positions
SMOOTH = 0.01  # of the length: the chord beyond a sample's ends over which its tangent is taken
DIFFERENT = 0.12  # mean distance on the unit circle from which two matches count as two
STEPS = np.array([(1, 1), (1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2), (1, 4), (4, 1), (3, 4), (4, 3)])
ARCLENGTHS = 8  # shifts of the arclength correspondence
MOST_TURNED = np.radians(100)
"""Of the similarity that fits a match best: of 16 pairs, no map that turned by more than 60° went on as upright."""
TURNS = ((0.0, 5), (0.6, 2), (-0.6, 2))  # of elastic starts, and how many of each
ANY_TURN = (0.0, 4), (0.5 * np.pi, 2), (np.pi, 2), (-0.5 * np.pi, 2)
"""The same where the turn is left to the shapes."""


@kernel
def step_gains(score, steps, gains):
    """Fills in the gain of every step from every pair of samples.

    Args:
        score: (n, 3n) gain of matching sample i of one curve with sample j of the other, three times over.
        steps: (k, 2) steps that a path is made of.
        gains: (k, n, 2n) zeros, written; steps that leave the rows gain nothing.
    """
    n = score.shape[0]
    for k in range(steps.shape[0]):
        a, b = steps[k, 0], steps[k, 1]
        count = max(a, b)
        for i in range(n + 1 - a):
            for m in range(count):
                row, first = score[i + (m * a) // count], (m * b) // count
                for j in range(2 * n):
                    gains[k, i, j] += row[first + j]
            for j in range(2 * n):
                gains[k, i, j] *= np.sqrt(a * b) / count


@kernel
def best_path(gains, steps, shift):
    """The monotone path from (0, shift) to (n, n + shift) with the largest score: its score, rows and columns, these
    from 0 to n.

    Args:
        gains: (k, n, 2n) of `step_gains`.
        steps: (k, 2) steps that a path is made of.
        shift: sample of the second curve, from 0 to n - 1.
    """
    n = gains.shape[1]
    best, came = np.full((n + 1, n + 1), -np.inf), np.zeros((n + 1, n + 1), np.int64)
    best[0, 0] = 0.0
    for i in range(1, n + 1):
        row, ways = best[i], came[i]
        for k in range(steps.shape[0]):
            a, b = steps[k, 0], steps[k, 1]
            if i < a:
                continue
            before, more = best[i - a], gains[k, i - a, shift:]
            for j in range(n + 1 - b):  # a row at a time, which processors do several of at once
                value = before[j] + more[j]
                if value > row[j + b]:
                    row[j + b], ways[j + b] = value, k
    rows, columns = np.zeros(2 * n + 2, np.int64), np.zeros(2 * n + 2, np.int64)
    i, j, at = n, n, rows.size
    while True:
        at -= 1
        rows[at], columns[at] = i, j
        if i == 0 and j == 0:
            return best[n, n], rows[at:].copy(), columns[at:].copy()
        i, j = i - steps[came[i, j], 0], j - steps[came[i, j], 1]


def _samples(curve: Curve, offset: float = 0.0) -> tuple[Complex, Complex]:
    """(SAMPLES,) unit tangents and centred middles, in radii of gyration, of equal pieces of a closed curve."""
    s = offset + curve.length * np.arange(SAMPLES) / SAMPLES
    start, end = curve.at(s), curve.at(s + curve.length / SAMPLES)
    reach = SMOOTH * curve.length
    chord = curve.at(s + curve.length / SAMPLES + reach) - curve.at(s - reach)
    middle = 0.5 * (start + end)
    return chord / np.maximum(np.abs(chord), 1e-12), middle / np.sqrt(np.mean(np.abs(middle) ** 2))


def elastic_matches(source: Curve, target: Curve, turn: float) -> Iterator[Match]:
    """Elastic matches of the source turned by `turn` radians with the target, best first."""
    tangents, middles = (np.exp(1j * turn) * w for w in _samples(source))
    goals, places = _samples(target)
    angles = (tangents[:, None] * goals.conj()).real
    score = angles - POSITION * np.abs(middles[:, None] - places) ** 2
    gains = np.zeros((len(STEPS), SAMPLES, 2 * SAMPLES))
    step_gains(np.tile(score, 3), STEPS, gains)
    found = []
    for k in range(SHIFTS):
        shift = k * SAMPLES // SHIFTS
        value, rows, columns = best_path(gains, STEPS, shift)
        s, tau = rows / SAMPLES * source.length, (columns + shift) / SAMPLES * target.length
        found.append((-value, k, Match(s, tau)))
    return (match for _, _, match in sorted(found, key=lambda entry: entry[:2]))


def arclength_matches(source: Curve, target: Curve) -> list[Match]:
    """Equal shares of the arclength, with evenly spaced shifts."""
    shifts = target.length * np.arange(ARCLENGTHS) / ARCLENGTHS
    ends = np.array([0.0, 1.0])
    return [Match(ends * source.length, shift + ends * target.length) for shift in shifts]


class Different:
    """A list of matches that refuses one too much like those it has."""

    def __init__(self, source: Curve, target: Curve):
        self._samples, self._length = source.length * np.arange(64) / 64, target.length
        self._kept: list[Complex] = []
        self.matches: list[Match] = []

    def add(self, match: Match) -> bool:
        """Whether the match was new."""
        places = np.exp(2j * np.pi / self._length * match.at(self._samples))
        if any(np.mean(np.abs(places - other)) < DIFFERENT for other in self._kept):
            return False
        self._kept.append(places)
        self.matches.append(match)
        return True


def candidates(source: Curve, target: Curve, turns: tuple[tuple[float, int], ...]) -> list[Match]:
    """Elastic matches at several turns, and shifts of the arclength."""
    found = Different(source, target)
    for turn, count in turns:
        first_new(found, elastic_matches(source, target, turn), count)
    return found.matches + arclength_matches(source, target)


def first_new(found: Different, matches: Iterator[Match], count: int) -> None:
    """Adds the first `count` matches that differ from those found."""
    for match in matches:
        if found.add(match):
            count -= 1
        if count == 0:
            return


def implied_turn(match: Match, source: Curve, target: Curve) -> float:
    """Radians of the similarity that fits a match best."""
    s = source.length * np.arange(SAMPLES) / SAMPLES
    return float(np.angle(np.sum(source.at(s).conj() * target.at(match.at(s)))))


def upright_ones(matches: list[Match], source: Curve, target: Curve) -> list[Match]:
    """The matches that do not turn the picture over."""
    return [match for match in matches if abs(implied_turn(match, source, target)) < MOST_TURNED]
