"""The choice between two maps of a scene: continued from the map before it, or from scratch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...maps.triangulated.map import TriangulatedMap

AGREED = 0.005  # of the target's diagonal: what 95 % of the points move less than that is one map (4 pixels of 800)


@dataclass(frozen=True, eq=False)
class MapChoice:
    """How the map of a scene is found, and is found again: by undo, and by the command from what is saved.

    Attributes:
        start: the map that it continues from; None if it is made from scratch.
        fresh: whether it is made from scratch all the same.
        other: whether the map from scratch is known to be another.
    """

    start: TriangulatedMap | None = None
    fresh: bool = False
    other: bool = False

    @property
    def begins(self) -> TriangulatedMap | None:
        """The map that it does continue from."""
        return None if self.fresh else self.start

    @property
    def alternative(self) -> str:
        """Which other map there is, as `MapUpdate.other`."""
        if self.start is None or not (self.other or self.fresh):
            return ""
        return "kept" if self.fresh else "fresh"


def same(one: TriangulatedMap, other: TriangulatedMap) -> bool:
    """Return whether two maps of the same shapes are not seen to differ."""
    inner = np.setdiff1d(np.arange(one.source.size), np.concatenate(one.loops))
    gaps = np.abs(other(one.source[inner]) - one.image[inner])
    gaps = gaps[np.isfinite(gaps)]
    return bool(gaps.size) and float(np.quantile(gaps, 0.95)) <= AGREED * one.image_diagonal
