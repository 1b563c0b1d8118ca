"""Measure cracks: slits in a result so narrow that they look like defects rather than gaps."""

from collections.abc import Sequence

import numpy as np

from ..arrays import Complex, Flags
from ..pixels.canvas import Canvas, proportional
from ..pixels.coverage import painted_share
from .drawing import Drawing

RASTER_PIXELS = 512
"""Pixels of the target drawing's longer side."""
CRACK_RADIUS_PIXELS = 3
"""Radius in pixels of the disk by which the result is closed, which fills slits up to twice as wide."""
PAINTED_PIXEL_SHARE = 0.5
"""Share of a pixel from which it counts as painted."""


def crack_share(target: Drawing, layers: Sequence[Sequence[Complex]]) -> float:
    """Return the area of cracks inside a drawing, relative to its painted area.

    Cracks are the pixels that a morphological closing by a small disk adds to the result within the drawing's painted
    area. Gaps of the drawing itself are not cracks.

    Parameters
    ----------
    target
        The drawing.
    layers
        Regions in its plane; the result is painted where all of them are. Each is given by its rings, those of parts
        counter-clockwise, those of holes clockwise.

    Examples
    --------
    >>> import shapely
    >>> halves = [np.array([0, 49.5, 49.5 + 50j, 50j]), np.array([50.5, 100, 100 + 50j, 50.5 + 50j])]
    >>> round(crack_share(Drawing(shapely.box(0, 0, 100, 50)), [halves]), 3)
    0.012
    """
    left, low, right, high = target.painted.bounds
    box = complex(left, low), complex(right, high)
    canvas = Canvas.about(*proportional(RASTER_PIXELS, box[1] - box[0]), box)
    painted = painted_share(target.rings, canvas) >= PAINTED_PIXEL_SHARE
    result = painted.copy()
    for rings in layers:
        result &= painted_share(rings, canvas) >= PAINTED_PIXEL_SHARE
    if not painted.any() or (result == painted).all():
        return 0.0
    # the padding keeps the erosion away from the raster's border
    grown = _dilated(np.pad(result, 2 * CRACK_RADIUS_PIXELS))
    closed = ~_dilated(~grown)
    inner = slice(2 * CRACK_RADIUS_PIXELS, -2 * CRACK_RADIUS_PIXELS)
    filled = closed[inner, inner] & painted & ~result
    return float(filled.sum() / painted.sum())


def _dilated(mask: Flags) -> Flags:
    """Dilate a mask by the disk. Written here since importing a library for it takes longer than the dilation."""
    wide = np.pad(mask, CRACK_RADIUS_PIXELS)
    height, width = mask.shape
    grown = np.zeros_like(mask)
    for down in range(-CRACK_RADIUS_PIXELS, CRACK_RADIUS_PIXELS + 1):
        reach = int(np.sqrt(CRACK_RADIUS_PIXELS**2 - down**2))
        for right in range(-reach, reach + 1):
            top, left = CRACK_RADIUS_PIXELS + down, CRACK_RADIUS_PIXELS + right
            grown |= wide[top : top + height, left : left + width]
    return grown
