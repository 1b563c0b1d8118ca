"""The choice between two maps of a scene: one continued from the previous map, or one from scratch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...balanced.warped import TargetWarp
from ...maps.triangulated.map import TriangulatedMap

MOST_POINTS_SHARE = (
    0.95  # of the points of the source: as many move less than the displacement between two maps
)
# relative to the target's diagonal: maps are the same if their displacement is at most this (4 pixels of 800)
AGREED_DIAGONAL_SHARE = 0.005


@dataclass(frozen=True, eq=False)
class MapChoice:
    """How the map of a scene is computed, so that undo and the command line can repeat it.

    Attributes:
        start: the map that it may continue from; None if there is none.
        fresh: whether it is computed from scratch even though there is a `start`.
        other: whether the map from scratch is known to be different.
        cost_ratio: cost of the map that continues from `start`, relative to that of the map from scratch.
        kept: whether `start` is the map as it is, rather than one to converge from.
        springs: stiffness of its soft pins, see `Live.springs`, with which the next drag begins; None if not known.
        warp: the map that `start` is composed of, if it is one that leaves parts out, with a deformation after it.
    """

    start: TriangulatedMap | None = None
    fresh: bool = False
    other: bool = False
    cost_ratio: float = 1.0
    kept: bool = False
    springs: dict[complex, float] | None = None
    warp: TargetWarp | None = None

    @property
    def begins(self) -> TriangulatedMap | None:
        """The map that it actually continues from."""
        return None if self.fresh else self.start

    @property
    def alternative(self) -> str:
        """The other map that the user can choose, as in `MapUpdate.other`."""
        if self.start is None or not (self.other or self.fresh):
            return ""
        return "kept" if self.fresh else "fresh"


def greatest_displacement(earlier: Sequence[TriangulatedMap], later: Sequence[TriangulatedMap]) -> float:
    """Return the greatest displacement among the maps of all parts; infinite if they are not of the same parts."""
    if len(earlier) != len(later):
        return np.inf
    return max(displacement(*maps) for maps in zip(earlier, later))


def displacement(earlier: TriangulatedMap, later: TriangulatedMap) -> float:
    """Return how far the images of points of the source move from one map to another, as the quantile MOST_POINTS_SHARE
    over the vertices inside of the earlier map, in units of the target; infinite where the maps share no points.
    """
    inner = np.setdiff1d(np.arange(earlier.source.size), np.concatenate(earlier.loops))
    distances = np.abs(later(earlier.source[inner]) - earlier.image[inner])
    distances = distances[np.isfinite(distances)]
    return float(np.quantile(distances, MOST_POINTS_SHARE)) if distances.size else np.inf


def same(first: TriangulatedMap, second: TriangulatedMap) -> bool:
    """Return whether two maps of the same shapes look the same."""
    return displacement(first, second) <= AGREED_DIAGONAL_SHARE * first.image_diagonal
