"""Match the areas that a size map prescribes, by a fixed-point iteration over whole solves.

The energy weighs areas against angles, so that parts that should grow much grow less than they should. In each
round, the size of each connected part of equal size is multiplied by the root of the desired area over its
present one (or by a smaller power of that, after rounds that misplaced more area), and the map is solved again.
A worse round is kept as a starting point all the same, since a map that had not converged may have been closer
than the converged one. If a round on the present mesh hardly helps, the outlines are made to slide again:
corners that hold their vertices are in the way, and narrow parts need it. The iteration ends when the areas of
all parts are met to MET_AREA_SHARE, or after PATIENCE_ROUNDS rounds with hardly any gain.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..arrays import Index, Real
from ..errors import InputError
from ..maps.approximation import triangulated
from ..maps.fields import Field
from ..maps.triangulated.map import TriangulatedMap
from ..plane import triangle_areas
from ..result import Fit
from .model.metric import PLACES

AREAS_MET_BALANCE = 8.0  # balance from which areas are matched
MET_AREA_SHARE = 0.015  # relative to the area of each part: areas this close are met
PATIENCE_ROUNDS, LEAST_GAIN_SHARE = 10, 0.1
"""The iteration ends unless the misplaced area decreases by this share within this many rounds."""
SIZE_LEVELS = 64  # number of sizes that are distinguished from each other
LEAST_PART_AREA_SHARE = 2e-3  # relative to the source's area; smaller parts are ignored
AREAS_MET_NOTE = "All {1} parts of the source have the requested areas up to {0:.1%} (size-map)."


def match_areas(field: Field, first: Fit, solve_again: Callable[[Field, TriangulatedMap, bool], Fit]) -> Fit:
    """Return the map whose areas are closest to those that a field of sizes prescribes.

    Args:
        field: the sizes.
        first: the map solved with these sizes.
        solve_again: solves with other sizes, starting from an earlier map; its last argument is whether the
            outlines slide again.
    """
    parts = parts_of(field)
    current, sizes, differences = first, field.values, area_differences(first, field, parts)
    best, least = current, differences
    step, gain = (
        1.0,
        1.0,
    )  # exponent of the correction of sizes, and share of the misplaced area that it put right
    slides = False
    milestone, rounds_without_gain = differences.misplaced_share, 0
    while least.largest_error > MET_AREA_SHARE and rounds_without_gain < PATIENCE_ROUNDS:
        rounds_without_gain += 1
        slides = (
            gain < LEAST_GAIN_SHARE and not slides
        )  # where other sizes help little, let the outlines slide once
        trial_sizes = sizes * differences.size_factors[parts] ** step
        try:
            trial = solve_again(Field(trial_sizes, field.box), triangulated(current.map), slides)
        except InputError:
            break
        trial_differences = area_differences(trial, field, parts)
        gain = 1 - trial_differences.misplaced_share / differences.misplaced_share
        step = min(1.0, 2 * step) if trial.status.ok and gain > 0 else 0.5 * step
        if not trial.status.ok or (slides and gain <= 0):
            continue  # with a shorter step from the same map
        current, sizes, differences = trial, trial_sizes, trial_differences
        if trial_differences.misplaced_share < least.misplaced_share:
            best, least = trial, trial_differences
        if least.misplaced_share <= (1 - LEAST_GAIN_SHARE) * milestone:
            milestone, rounds_without_gain = least.misplaced_share, 0
    best.notes.append(
        AREAS_MET_NOTE.format(least.largest_error, int(np.count_nonzero(least.size_factors != 1)))
    )
    return best


def parts_of(field: Field) -> Index:
    """Return (h, w) the index of the connected part of equal size that contains each pixel.

    At most SIZE_LEVELS sizes are distinguished.
    """
    from scipy.ndimage import label  # slow to import, and seldom needed

    sizes, levels = np.unique(field.values, return_inverse=True)
    if sizes.size > SIZE_LEVELS:
        heights = np.log(field.values / sizes[0]) / np.log(sizes[-1] / sizes[0])
        levels = np.minimum((heights * SIZE_LEVELS).astype(int), SIZE_LEVELS - 1)
    levels, parts, count = levels.reshape(field.values.shape), np.zeros(field.values.shape, np.int64), 0
    for level in np.unique(levels):
        labels, label_count = label(levels == level)
        parts[labels > 0] = count + labels[labels > 0] - 1
        count += label_count
    return parts


class AreaDifferences(NamedTuple):
    """Differences of the parts' areas from the desired ones.

    Attributes:
        size_factors: (p,) factors by which to multiply the size of each part.
        largest_error: largest difference of a part's area, relative to the desired one.
        misplaced_share: share of the total area that belongs to other parts.
    """

    size_factors: Real
    largest_error: float
    misplaced_share: float


def area_differences(fit: Fit, field: Field, parts: Index) -> AreaDifferences:
    """Return the differences of the parts' areas in a map from those that a field of sizes prescribes.

    Args:
        fit: the map.
        field: the sizes.
        parts: (h, w) the part of each pixel.
    """
    map = triangulated(fit.map)
    places = map.source[map.faces] @ PLACES.T
    pixels = field.pixels(places)
    part_index, count = parts[pixels].ravel(), int(parts.max()) + 1
    source_areas = np.repeat(np.abs(triangle_areas(map.source[map.faces])), places.shape[1])
    image_areas = np.repeat(np.abs(triangle_areas(map.image[map.faces])), places.shape[1])
    source = np.bincount(part_index, source_areas, count)
    image = np.bincount(part_index, image_areas, count)
    desired = np.bincount(part_index, source_areas * field.values[pixels].ravel() ** 2, count)
    desired, image = desired / desired.sum(), image / image.sum()
    counted = source > LEAST_PART_AREA_SHARE * source.sum()
    ratio = np.where(counted, desired / np.where(counted, image, 1), 1)
    largest_error = np.max(np.abs(1 / ratio - 1), initial=0, where=counted)
    return AreaDifferences(np.sqrt(ratio), float(largest_error), 0.5 * float(np.abs(desired - image).sum()))
