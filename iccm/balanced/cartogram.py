"""Areas that a size map asks for: each connected part of one size is given as much as it lacked, and mapped again.

The energy weighs areas against angles, so that parts that should grow much get less than they should. A fixed-point
iteration: the size of each part is multiplied by the root of the area wished over that it got, or by less where the
round before left more area misplaced; it continues from there all the same, as a map that had not come to rest may have
been closer than it stays. Where a round on the mesh that is there hardly helps, the outlines slide anew: corners that
hold their vertices are in the way of that, and necks need it. It stops where the areas of all parts are met to
MET_AREA_SHARE, or where PATIENCE_ROUNDS rounds came hardly closer.
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

LEAST_BALANCE = 8.0  # balance from which areas are met
MET_AREA_SHARE = 0.015  # of the area of each part: what is so close is met
PATIENCE_ROUNDS, LEAST_GAIN_SHARE = 10, 0.1
"""Rounds in which this share of what is misplaced has to go, or it ends."""
SIZE_LEVELS = 64  # of sizes, that are distinguished from each other
LEAST_PART_AREA_SHARE = 2e-3  # of the source's area: smaller parts are left to what surrounds them
TOLD = "All {1} parts of the source have the requested areas up to {0:.1%} (size-map)."


def match_areas(field: Field, first: Fit, again: Callable[[Field, TriangulatedMap, bool], Fit]) -> Fit:
    """Return the map whose areas are those that a field of sizes asks for, or as close as rounds come.

    Args:
        field: the sizes.
        first: the map by them.
        again: the map by others, continued to from an earlier one, and whether its outlines slide anew.
    """
    parts = parts_of(field)
    here, sizes, lacks, step, since = first, field.values, missing(first, field, parts), 1.0, 0
    best, least, mark, gained, slides = first, lacks, lacks.misplaced, 1.0, False
    while least.off > MET_AREA_SHARE and since < PATIENCE_ROUNDS:
        since += 1
        slides = gained < LEAST_GAIN_SHARE and not slides
        tried = sizes * lacks.factors[parts] ** step
        try:
            found = again(Field(tried, field.box), triangulated(here.map), slides)
        except InputError:
            break
        now = missing(found, field, parts)
        gained = 1 - now.misplaced / lacks.misplaced
        step = min(1.0, 2 * step) if found.status.ok and gained > 0 else 0.5 * step
        if not found.status.ok or (slides and gained <= 0):
            continue
        here, sizes, lacks = found, tried, now
        if now.misplaced < least.misplaced:
            best, least = found, now
        if least.misplaced <= (1 - LEAST_GAIN_SHARE) * mark:
            mark, since = least.misplaced, 0
    best.notes.append(TOLD.format(least.off, int(np.count_nonzero(least.factors != 1))))
    return best


def parts_of(field: Field) -> Index:
    """Return (h, w) the connected part of one size, distinguished by SIZE_LEVELS, that each pixel is in."""
    from scipy.ndimage import label  # slow to import, and seldom needed

    sizes, levels = np.unique(field.values, return_inverse=True)
    if sizes.size > SIZE_LEVELS:
        heights = np.log(field.values / sizes[0]) / np.log(sizes[-1] / sizes[0])
        levels = np.minimum((heights * SIZE_LEVELS).astype(int), SIZE_LEVELS - 1)
    levels, parts, count = levels.reshape(field.values.shape), np.zeros(field.values.shape, np.int64), 0
    for level in np.unique(levels):
        own, more = label(levels == level)
        parts[own > 0] = count + own[own > 0] - 1
        count += more
    return parts


class Missing(NamedTuple):
    """What parts lack of the areas wished.

    Attributes:
        factors: (p,) by what to multiply the size of each.
        off: how far the area of one is off at most, relative to what it should be.
        misplaced: the share of the area that is in other parts than it should be.
    """

    factors: Real
    off: float
    misplaced: float


def missing(fit: Fit, field: Field, parts: Index) -> Missing:
    """Return what the parts of a field of sizes lack in a map."""
    map = triangulated(fit.map)
    places = map.source[map.faces] @ PLACES.T
    pixels = field.pixels(places)
    own, count = parts[pixels].ravel(), int(parts.max()) + 1
    source, image = (
        np.bincount(own, np.repeat(np.abs(triangle_areas(w[map.faces])), places.shape[1]), count)
        for w in (map.source, map.image)
    )
    areas = np.abs(triangle_areas(map.source[map.faces]))[:, None]
    wished = np.bincount(own, (areas * field.values[pixels] ** 2).ravel(), count)
    wished, image = wished / wished.sum(), image / image.sum()
    counted = source > LEAST_PART_AREA_SHARE * source.sum()
    ratio = np.where(counted, wished / np.where(counted, image, 1), 1)
    off = np.max(np.abs(1 / ratio - 1), initial=0, where=counted)
    return Missing(np.sqrt(ratio), float(off), 0.5 * float(np.abs(wished - image).sum()))
