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
OVERLAP_WIDTHS = 10
"""Seam widths by which each end of the cut extends beyond the ring, so that it also cuts slanting outlines."""
SEAMS_TRIED, HALVINGS = 4, 3
"""Number of places compared all around, and of refinements: each tries the places halfway between the best one and
its neighbours.
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
    overlap = OVERLAP_WIDTHS * width * (b - a) / abs(b - a)
    cut = shapely.LineString(xy_of(np.array([a - overlap, b + overlap]))).buffer(
        0.5 * width, cap_style="flat"
    )
    remainder = ring.difference(cut)
    if remainder.geom_type != "Polygon" or remainder.interiors:
        return None
    return Curve.domain(complex_of(shapely.get_coordinates(remainder.exterior)[:-1]))


def best_seam(
    outer: Curve, hole: Curve, cost_of: Callable[[Curve], float], limit: float = np.inf
) -> Curve | None:
    """Return the ring cut open where a map costs least.

    Args:
        outer: outline of the ring.
        hole: its hole.
        cost_of: returns the cost of a map of an open ring; infinite if there is no map.
        limit: give up as soon as no place is likely to cost less than this.

    Returns:
        The outline of the open ring; None if no place costs less than `limit`.
    """
    seams: dict[float, tuple[float, Curve]] = {}

    def attempt(share: float) -> None:
        ring = None if share in seams else open_ring(outer, hole, share * outer.length)
        if ring is not None:
            seams[share] = cost_of(ring), ring

    for k in range(SEAMS_TRIED):
        attempt(k / SEAMS_TRIED)
    for halving in range(1, HALVINGS + 1):
        best = min(seams, key=lambda share: seams[share][0], default=0.0)
        if not seams or not (1 - MOST_SAVED_SHARE / 2 ** (halving - 1)) * seams[best][0] < limit:
            return None
        for step in (-1, 1):
            attempt((best + step / (SEAMS_TRIED * 2**halving)) % 1.0)
    least, ring = min(seams.values(), key=lambda seam: seam[0])
    return ring if least < limit else None


def coarse_cost(source: Curve, target: Curve, settings: Settings) -> float:
    """Return the cost of the best coarse map between two whole outlines; infinite if there is none.

    The search starts from elastic matches.
    """
    frames = frames_of(source, target, settings.turn, ((), ()))
    outlines = unit_curve(frames[0], source), unit_curve(frames[1], target)
    problem = multilevel.directions(multilevel.problem_of(*outlines, NONE, UNPINNED, settings))[0]
    with suppress(Stuck, InputError):
        size = multilevel.coarse_size(problem)
        return cost(problem, multilevel.coarse_map(problem, size, SolveLog(), elastic=True))
    return np.inf
