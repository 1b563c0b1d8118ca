"""Bounds on the distortion of triangulated maps: the quadratic patches held to those that straight triangles meet."""

from dataclasses import replace

import numpy as np

from ..arrays import Real
from . import distortion
from .triangulated.map import TriangulatedMap
from .triangulated.patches import shrunk

ROUNDS = 20  # of straightening; a straightened edge may take its neighbour over a bound, in one round or two


def straighten_beyond_bounds(
    map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None
) -> TriangulatedMap:
    """The map with triangles left straight where their patches exceed a bound asked for."""
    for _ in range(ROUNDS):
        sides = np.unique(map.edges.sides[_excess(map, max_dilatation, max_stretch) > 1])
        bent = sides[map.bulges[sides] != 0]
        if not bent.size:
            break
        bulge = map.bulges.copy()
        bulge[bent] = 0
        map = replace(map, bulge=shrunk(map.faces, map.image, map.source, map.edges, bulge))
    return map


def meets_bounds(map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None) -> bool:
    """Whether what is drawn meets the bounds asked for, but for rounding."""
    return bool(_excess(map, max_dilatation, max_stretch).max() <= 1 + 1e-9)


def _excess(map: TriangulatedMap, max_dilatation: float | None, max_stretch: float | None) -> Real:
    """(m,) how many times the bounds the largest dilatation and stretch of each patch are."""
    worst = np.zeros(len(map.faces))
    if max_dilatation is None and max_stretch is None:
        return worst
    found = distortion.of_triangles(map)
    for bound, values in (
        (max_dilatation, found.dilatations),
        (max_stretch, found.stretches),
    ):
        if bound is not None:
            worst = np.maximum(worst, values.reshape(worst.size, -1).max(axis=1) / bound)
    return worst
