"""Pair parts of two drawings one-to-one by place and size."""

from collections.abc import Sequence

import numpy as np
import shapely

from ..arrays import Real

SIZE_COST = 0.1
"""Weight of sizes. The cost of a pair is the squared distance, in half diagonals of the drawings, plus SIZE_COST times
the squared natural logarithm of the ratio of areas: a ratio of ten counts as much as 0.7 half diagonals."""


def pair_by_cost(
    middles: tuple[Real, Real], areas: tuple[Real, Real], bonus: Real | None = None
) -> list[tuple[int, int]]:
    """Return the pairs of parts with the least total cost (Kuhn 1955), as many as the side with fewer parts has.

    Parameters
    ----------
    middles
        For both sides, (k, d) the parts' centroids relative to the drawing's middle, in half diagonals.
    areas
        For both sides, (k,) the parts' shares of the area.
    bonus
        (k, l) reduction of the cost of each pair, for example for matching names.
    """
    from scipy.optimize import (
        linear_sum_assignment,  # slow to import, and few drawings pair their parts
    )

    apart = ((middles[0][:, None] - middles[1]) ** 2).sum(axis=-1)
    cost = apart + SIZE_COST * (np.log(areas[0])[:, None] - np.log(areas[1])) ** 2
    rows, columns = linear_sum_assignment(cost if bonus is None else cost - bonus)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def pair_by_place(
    sources: Sequence[shapely.Polygon], targets: Sequence[shapely.Polygon]
) -> list[tuple[int, int]]:
    """Pair parts of two drawings by position and size."""
    placed = [_in_half_diagonals(parts) for parts in (sources, targets)]
    return pair_by_cost((placed[0][0], placed[1][0]), (placed[0][1], placed[1][1]))


def _in_half_diagonals(parts: Sequence[shapely.Polygon]) -> tuple[Real, Real]:
    """Return centroids (k, 2) relative to the drawing's middle, in half diagonals, and shares of the area (k,)."""
    left, low, right, high = shapely.total_bounds(np.array(parts))
    middle = np.array([left + right, low + high]) / 2
    centroids = shapely.get_coordinates(shapely.centroid(np.array(parts)))
    areas = shapely.area(np.array(parts))
    return (centroids - middle) / (np.hypot(right - left, high - low) / 2), areas / areas.sum()
