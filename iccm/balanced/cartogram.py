"""Areas that a size map asks for: each connected part of one size is given as much as it lacked, and mapped again.

The energy weighs areas against angles, so that parts that should grow much get less than they should. A fixed-point
iteration: the size of each part is multiplied by the root of the area wished over that it got. It stops where all are
CLOSE, or where PATIENCE rounds came hardly closer.
"""

from collections.abc import Callable

import numpy as np

from ..arrays import Index, Real
from ..errors import InputError
from ..maps.approximation import triangulated
from ..maps.fields import Field
from ..maps.triangulated.map import TriangulatedMap
from ..plane import triangle_areas
from ..result import Fit
from .model.metric import PLACES

MET_FROM = 8.0  # balance from which areas are met
CLOSE = 0.015  # of the area of each part: what is so close is met
PATIENCE, GAIN = 10, 0.1  # rounds by which it has to come closer by a share; it ends where it does not
LEVELS = 64  # of sizes, that are told from each other
LEAST = 2e-3  # of the source's area: smaller parts are left to what surrounds them
TOLD = "The areas asked for are met to {:.1%} by all {} parts of the source (size-map)."


def met(field: Field, first: Fit, again: Callable[[Field, TriangulatedMap], Fit]) -> Fit:
    """The map whose areas are those that a field of sizes asks for, or as close as rounds come.

    Args:
        field: the sizes.
        first: the map by them.
        again: the map by others, gone on to from an earlier one.
    """
    parts = parts_of(field)
    found = best = first
    sizes, (factors, off), since = field.values, missing(first, field, parts), 0
    least = mark = off
    while off > CLOSE and since < PATIENCE:
        sizes, since = sizes * factors[parts], since + 1
        try:
            found = again(Field(sizes, field.box), triangulated(found.map))
        except InputError:
            break
        factors, off = missing(found, field, parts)
        if off < least and found.status.ok:
            best, least = found, off
        if least <= (1 - GAIN) * mark:
            mark, since = least, 0
    best.notes.append(TOLD.format(least, int(np.count_nonzero(factors != 1))))
    return best


def parts_of(field: Field) -> Index:
    """(h, w) the connected part of one size, told apart by LEVELS, that each pixel is in."""
    from scipy.ndimage import label  # slow to import, and seldom needed

    sizes, levels = np.unique(field.values, return_inverse=True)
    if sizes.size > LEVELS:
        heights = np.log(field.values / sizes[0]) / np.log(sizes[-1] / sizes[0])
        levels = np.minimum((heights * LEVELS).astype(int), LEVELS - 1)
    levels, parts, count = levels.reshape(field.values.shape), np.zeros(field.values.shape, np.int64), 0
    for level in np.unique(levels):
        own, more = label(levels == level)
        parts[own > 0] = count + own[own > 0] - 1
        count += more
    return parts


def missing(fit: Fit, field: Field, parts: Index) -> tuple[Real, float]:
    """(p,) by what to multiply the size of each part, and how far the area of one is off at most."""
    map = triangulated(fit.map)
    places = map.source[map.faces] @ PLACES.T
    (low, high), (height, width) = field.box, parts.shape
    j = np.clip((places.real - low.real) / (high - low).real * width, 0, width - 1).astype(int)
    i = np.clip((high.imag - places.imag) / (high - low).imag * height, 0, height - 1).astype(int)
    own, count = parts[i, j], int(parts.max()) + 1
    source, image = (
        np.bincount(
            own.ravel(), np.repeat(np.abs(triangle_areas(w[map.faces])), own.shape[1]), minlength=count
        )
        for w in (map.source, map.image)
    )
    wished = np.bincount(
        own.ravel(),
        (np.abs(triangle_areas(map.source[map.faces]))[:, None] * field.values[i, j] ** 2).ravel(),
        minlength=count,
    )
    counted = source > LEAST * source.sum()
    ratio = np.where(counted, wished / wished.sum() / np.where(counted, image / image.sum(), 1), 1)
    return np.sqrt(ratio), float(np.max(np.abs(1 / ratio - 1), initial=0, where=counted))
