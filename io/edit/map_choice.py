"""The choice between two maps of a scene: one continued from the previous map, or one from scratch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...maps.triangulated.map import TriangulatedMap

# relative to the target's diagonal: maps are the same if 95 % of the points move by less (4 pixels of 800)
AGREED_DIAGONAL_SHARE = 0.005


@dataclass(frozen=True, eq=False)
class MapChoice:
    """How the map of a scene is computed, so that undo and the command line can repeat it.

    Attributes:
        start: the map that it may continue from; None if there is none.
        fresh: whether it is computed from scratch even though there is a `start`.
        other: whether the map from scratch is known to be different.
        gain: how many times less that one is stretched on 95 % of the target.
        kept: whether `start` is the map as it is, rather than one to converge from.
        springs: stiffness of its soft pins, see `Live.springs`, with which the next drag begins; None if not known.
    """

    start: TriangulatedMap | None = None
    fresh: bool = False
    other: bool = False
    gain: float = 1.0
    kept: bool = False
    springs: dict[complex, float] | None = None

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


def same(map: TriangulatedMap, reference: TriangulatedMap) -> bool:
    """Return whether two maps of the same shapes look the same."""
    inner = np.setdiff1d(np.arange(map.source.size), np.concatenate(map.loops))
    gaps = np.abs(reference(map.source[inner]) - map.image[inner])
    gaps = gaps[np.isfinite(gaps)]
    return bool(gaps.size) and float(np.quantile(gaps, 0.95)) <= AGREED_DIAGONAL_SHARE * map.image_diagonal
