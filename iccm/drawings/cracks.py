"""Cracks: slits in a result that are so narrow that an eye takes them for a defect, not for a gap."""

from collections.abc import Sequence

import numpy as np

from ..arrays import Complex, Flags
from ..pixels.canvas import Canvas, proportional
from .drawing import Drawing
from .raster import painted_share

RASTER = 512
"""Pixels of the target drawing's longer side."""
RADIUS = 3
"""Pixels: the radius of the disc by which the result is closed. A slit twice as wide is filled by that."""
PAINTED = 0.5
"""Of a pixel: from which on it counts as painted."""


def crack_share(target: Drawing, layers: Sequence[Sequence[Complex]]) -> float:
    """Return the area of cracks inside a drawing, relative to its painted area.

    Cracks are what a morphological closing by a small disc adds to the result inside of what the drawing paints; gaps
    of the drawing itself are not cracks.

    Parameters
    ----------
    target
        The drawing.
    layers
        Regions in its plane; the result shows something where all of them are. Each is given by its rings, those of
        parts counter-clockwise, those of holes clockwise.

    Examples
    --------
    >>> import shapely
    >>> halves = [np.array([0, 49.5, 49.5 + 50j, 50j]), np.array([50.5, 100, 100 + 50j, 50.5 + 50j])]
    >>> round(crack_share(Drawing(shapely.box(0, 0, 100, 50)), [halves]), 3)
    0.01
    """
    left, low, right, high = target.painted.bounds
    box = complex(left, low), complex(right, high)
    canvas = Canvas.about(*proportional(RASTER, box[1] - box[0]), box)
    painted = painted_share(target.rings, canvas) >= PAINTED
    result = painted.copy()
    for rings in layers:
        result &= painted_share(rings, canvas) >= PAINTED
    if not painted.any() or (result == painted).all():
        return 0.0
    # the margin keeps the erosion from seeing the raster's end
    grown = _dilated(np.pad(result, 2 * RADIUS))
    closed = ~_dilated(~grown)
    inner = slice(2 * RADIUS, -2 * RADIUS)
    filled = closed[inner, inner] & painted & ~result
    return float(filled.sum() / painted.sum())


def _dilated(mask: Flags) -> Flags:
    """Return a mask dilated by the disc. Libraries that do this take longer to import than this takes."""
    wide = np.pad(mask, RADIUS)
    height, width = mask.shape
    grown = np.zeros_like(mask)
    for down in range(-RADIUS, RADIUS + 1):
        reach = int(np.sqrt(RADIUS**2 - down**2))
        for right in range(-reach, reach + 1):
            top, left = RADIUS + down, RADIUS + right
            grown |= wide[top : top + height, left : left + width]
    return grown
