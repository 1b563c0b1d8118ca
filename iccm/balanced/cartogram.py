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
TOLD = "All {1} parts of the source have the requested areas up to {0:.1%} (size-map)."


def match_areas(field: Field, first: Fit, again: Callable[[Field, TriangulatedMap, bool], Fit]) -> Fit:
    """Return the map whose areas are closest to those that a field of sizes prescribes.

    Args:
        field: the sizes.
        first: the map solved with these sizes.
        again: solves with other sizes, starting from an earlier map; its last argument is whether the outlines
            slide again.
    """
    parts = parts_of(field)
    current, sizes, lacks, step, since = first, field.values, missing(first, field, parts), 1.0, 0
    best, least, mark, gained, slides = first, lacks, lacks.misplaced, 1.0, False
    while least.off > MET_AREA_SHARE and since < PATIENCE_ROUNDS:
        since += 1
        slides = gained < LEAST_GAIN_SHARE and not slides
        tried = sizes * lacks.factors[parts] ** step
        try:
            trial = again(Field(tried, field.box), triangulated(current.map), slides)
        except InputError:
            break
        now = missing(trial, field, parts)
        gained = 1 - now.misplaced / lacks.misplaced
        step = min(1.0, 2 * step) if trial.status.ok and gained > 0 else 0.5 * step
        if not trial.status.ok or (slides and gained <= 0):
            continue
        current, sizes, lacks = trial, tried, now
        if now.misplaced < least.misplaced:
            best, least = trial, now
        if least.misplaced <= (1 - LEAST_GAIN_SHARE) * mark:
            mark, since = least.misplaced, 0
    best.notes.append(TOLD.format(least.off, int(np.count_nonzero(least.factors != 1))))
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
        labels, more = label(levels == level)
        parts[labels > 0] = count + labels[labels > 0] - 1
        count += more
    return parts


class Missing(NamedTuple):
    """Differences of the parts' areas from the desired ones.

    Attributes:
        factors: (p,) by what to multiply the size of each part.
        off: largest relative deviation of a part's area.
        misplaced: share of the total area that is in other parts than it should be.
    """

    factors: Real
    off: float
    misplaced: float


def missing(fit: Fit, field: Field, parts: Index) -> Missing:
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
    source, image = (
        np.bincount(part_index, np.repeat(np.abs(triangle_areas(w[map.faces])), places.shape[1]), count)
        for w in (map.source, map.image)
    )
    areas = np.abs(triangle_areas(map.source[map.faces]))[:, None]
    wished = np.bincount(part_index, (areas * field.values[pixels] ** 2).ravel(), count)
    wished, image = wished / wished.sum(), image / image.sum()
    counted = source > LEAST_PART_AREA_SHARE * source.sum()
    ratio = np.where(counted, wished / np.where(counted, image, 1), 1)
    off = np.max(np.abs(1 / ratio - 1), initial=0, where=counted)
    return Missing(np.sqrt(ratio), float(off), 0.5 * float(np.abs(wished - image).sum()))
