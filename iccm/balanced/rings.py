"""Cut a ring open along a seam, if the other shape has no hole; both edges of the picture meet at the seam.

The seam is a straight gap, far thinner than a pixel, from the outer outline to the closest point of the hole,
and leaves a simple polygon. It is placed where a coarse map costs least: places all around are compared, then
those halfway between the best and its neighbours.
"""

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import shapely

from ..arrays import complex_of, xy_of
from ..curve import Curve, polygon_of
from ..errors import InputError
from .constraints.validate import UNPINNED
from .errors import Stuck
from .holes.given import NONE
from .model.frames import frames_of, unit_curve
from .model.settings import Settings, SolveLog
from .search import multilevel
from .search.partial import cost

SEAM_WIDTH_SHARE = 1e-6  # relative to the diagonal: a thousandth of a pixel of 1024
# Widths by which each end extends beyond the ring, so that the seam cuts slanting outlines.
OVERLAP_WIDTHS = 10
SEAMS_TRIED, HALVINGS = 4, 3
"""Places compared all around, and the number of refinements with the two places halfway to the best one's
neighbours.
"""
MOST_SAVED_SHARE = 0.2
"""Largest share of the cost that a better place is expected to save, compared with the best of SEAMS_TRIED
places: it was up to 16 % on 34 rings. Each refinement halves it.
"""


def open_ring(outer: Curve, hole: Curve, s: float) -> Curve | None:
    """Cut a ring from arclength s of its outer outline to its hole.

    Returns:
        The outline of the open ring; None if the cut would leave the ring.
    """
    ring = polygon_of(outer.z, hole.z)
    start = complex(outer.at(np.array([s]))[0])
    line = shapely.shortest_line(shapely.Point(start.real, start.imag), ring.interiors[0])
    a, b = complex_of(shapely.get_coordinates(line))
    width = SEAM_WIDTH_SHARE * outer.diagonal
    if not abs(b - a) > OVERLAP_WIDTHS * width or not ring.buffer(width).contains(line):
        return None
    more = OVERLAP_WIDTHS * width * (b - a) / abs(b - a)
    cut = shapely.LineString(xy_of(np.array([a - more, b + more]))).buffer(0.5 * width, cap_style="flat")
    left = ring.difference(cut)
    if left.geom_type != "Polygon" or left.interiors:
        return None
    return Curve.domain(complex_of(shapely.get_coordinates(left.exterior)[:-1]))


def best_seam(
    outer: Curve, hole: Curve, price: Callable[[Curve], float], most: float = np.inf
) -> Curve | None:
    """Return the ring cut open where a map costs least.

    Args:
        outer: outline of the ring.
        hole: its hole.
        price: returns the cost of a map of an open ring; infinite if there is no map.
        most: give up as soon as no place is likely to cost less than this.

    Returns:
        The outline of the open ring; None if no place costs less than `most`.
    """
    found: dict[float, tuple[float, Curve]] = {}

    def attempt(share: float) -> None:
        opened = None if share in found else open_ring(outer, hole, share * outer.length)
        if opened is not None:
            found[share] = price(opened), opened

    for k in range(SEAMS_TRIED):
        attempt(k / SEAMS_TRIED)
    for halving in range(1, HALVINGS + 1):
        best = min(found, key=lambda share: found[share][0], default=0.0)
        if not found or not (1 - MOST_SAVED_SHARE / 2 ** (halving - 1)) * found[best][0] < most:
            return None
        for step in (-1, 1):
            attempt((best + step / (SEAMS_TRIED * 2**halving)) % 1.0)
    least, ring = min(found.values(), key=lambda each: each[0])
    return ring if least < most else None


def coarse_cost(source: Curve, target: Curve, settings: Settings) -> float:
    """Return the cost of the best coarse map between two whole outlines; infinite if there is none.

    The search starts from elastic matches.
    """
    frames = frames_of(source, target, settings.turn, ((), ()))
    outlines = unit_curve(frames[0], source), unit_curve(frames[1], target)
    problem = multilevel.problem_of(*outlines, NONE, UNPINNED, settings)
    used = multilevel.directions(problem)[0]
    with suppress(Stuck, InputError):
        return cost(used, multilevel.coarse_map(used, multilevel.coarse_size(used), SolveLog(), elastic=True))
    return np.inf
