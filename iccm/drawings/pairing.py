"""Parts of two drawings, paired one to one by place and size."""

from collections.abc import Sequence

import numpy as np
import shapely

from ..arrays import Real

SIZE_COST = 0.1
"""The cost of a pair is the squared distance, in half diagonals of the drawings, plus SIZE_COST times the squared
natural logarithm of the ratio of areas: a tenth of the area counts as much as 0.7 half diagonals."""


def pair_by_cost(
    middles: tuple[Real, Real], areas: tuple[Real, Real], bonus: Real | None = None
) -> list[tuple[int, int]]:
    """Return the pairs of parts that cost the least together (Kuhn 1955), as many as the side with fewer has.

    Parameters
    ----------
    middles
        Of both sides, (k, d) the parts' centroids, in half diagonals of each drawing about its middle.
    areas
        Of both sides, (k,) the parts' shares of the area.
    bonus
        (k, l) what is taken off the cost of each pair, such as for names that both have.
    """
    from scipy.optimize import (
        linear_sum_assignment,  # takes long to import, and few drawings pair their parts
    )

    apart = ((middles[0][:, None] - middles[1]) ** 2).sum(axis=-1)
    cost = apart + SIZE_COST * (np.log(areas[0])[:, None] - np.log(areas[1])) ** 2
    rows, columns = linear_sum_assignment(cost if bonus is None else cost - bonus)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def pair_by_place(
    sources: Sequence[shapely.Polygon], targets: Sequence[shapely.Polygon]
) -> list[tuple[int, int]]:
    """Return the pairs of parts of two drawings that lie alike and are alike in size."""
    placed = [_in_half_diagonals(parts) for parts in (sources, targets)]
    return pair_by_cost((placed[0][0], placed[1][0]), (placed[0][1], placed[1][1]))


def _in_half_diagonals(parts: Sequence[shapely.Polygon]) -> tuple[Real, Real]:
    """Return the centroids about the drawing's middle (k, 2), in half diagonals, and shares of the area (k,)."""
    left, low, right, high = shapely.total_bounds(np.array(parts))
    middle = np.array([left + right, low + high]) / 2
    centroids = shapely.get_coordinates(shapely.centroid(np.array(parts)))
    areas = shapely.area(np.array(parts))
    return (centroids - middle) / (np.hypot(right - left, high - low) / 2), areas / areas.sum()
