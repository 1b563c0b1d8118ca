"""Assign holes to holes and match their outlines, for each start."""

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Complex, Index, Real
from ...curve import Curve
from ..model.boundary_pairs import HoleMatch, Match
from ..model.outline import Outline
from ..model.unit_coordinates import unit_similarity
from . import initial_matches

# Cost of a pair: the squared distance of the centroids in radii of gyration, plus SIZE times the squared
# natural logarithm of the ratio of areas. A requested pair outweighs both.
SIZE, WISHED = 0.1, 1e6
ROTATION_STEP_RADIANS = np.radians(15)  # rotations closer than this share the matches of holes


class Partners:
    """Holes of two domains, to be assigned to each other at any rotation.

    Args:
        source: outlines of the source, the outer one first.
        target: those of the target.
        wished: (i, j) holes that must be partners.
        prescribed: returns the match of two holes if it is given, and None otherwise; by default none is given.
    """

    def __init__(
        self,
        source: Sequence[Outline],
        target: Sequence[Outline],
        wished: Sequence[tuple[int, int]],
        prescribed: Callable[[int, int], Match | None] = lambda source, target: None,
    ):
        self.prescribed = prescribed
        self.outer = source[0].curve, target[0].curve
        self.holes = [o.curve for o in source[1:]], [o.curve for o in target[1:]]
        self.middles = [
            np.array([middle_of(hole) for hole in holes]) / gyration(outer)
            for outer, holes in zip(self.outer, self.holes)
        ]
        areas = [np.abs([hole.area for hole in holes]) for holes in self.holes]
        self.cost = SIZE * (np.log(areas[0])[:, None] - np.log(areas[1])) ** 2
        for i, j in wished:
            self.cost[i, j] -= WISHED
        self._matches: dict[tuple[int, int, int], Match] = {}

    def assigned(self, rotation: float) -> tuple[Index, Index]:
        """Return the pairs of holes with the least total cost at a rotation, as many as the smaller side has holes."""
        from scipy.optimize import linear_sum_assignment

        sources, targets = self.middles
        apart = np.abs(sources[:, None] * np.exp(1j * rotation) - targets) ** 2
        return linear_sum_assignment(apart + self.cost)

    def of(self, match: Match) -> Match:
        """Return the match of the outer outlines with the matches of holes at its rotation."""
        rotation = initial_matches.implied_rotation(match, *self.outer)
        holes = (
            HoleMatch(int(i), int(j), self._match(i, j, rotation)) for i, j in zip(*self.assigned(rotation))
        )
        return match._replace(holes=tuple(holes))

    def _match(self, i: int, j: int, rotation: float) -> Match:
        key = int(i), int(j), round(rotation / ROTATION_STEP_RADIANS)
        if key not in self._matches:
            if (prescribed := self.prescribed(key[0], key[1])) is not None:
                return prescribed
            source, target = self.holes[0][i], self.holes[1][j]
            unit_source = Curve(unit_similarity(source)(source.z))
            unit_target = Curve(unit_similarity(target)(target.z))
            rotation = key[2] * ROTATION_STEP_RADIANS
            best = next(initial_matches.elastic_matches(unit_source, unit_target, rotation))
            self._matches[key] = _scale(best, source.length, target.length)
        return self._matches[key]


def _scale(match: Match, length: float, goal: float) -> Match:
    """Return the match in arclengths of curves with other lengths."""
    laps = match.s[-1] - match.s[0], match.tau[-1] - match.tau[0]
    return Match(match.s * (length / laps[0]), match.tau * (goal / laps[1]))


def middle_of(curve: Curve) -> complex:
    """Return the centroid of the inside of a closed curve."""
    return unit_similarity(curve).centre


def gyration(curve: Curve) -> float:
    """Return the radius of gyration of an outline about 0."""
    z: Complex = curve.at(
        curve.length * np.arange(initial_matches.OUTLINE_SAMPLES) / initial_matches.OUTLINE_SAMPLES
    )
    squares: Real = np.abs(z) ** 2
    return float(np.sqrt(squares.mean()))
