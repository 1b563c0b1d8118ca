"""What is drawn, the quadratic patches, held to the bounds that its straight triangles meet; and what to say of it."""

from dataclasses import replace

import numpy as np

from ..arrays import Real
from ..maps import distortion
from ..maps.triangulated.map import TriangulatedMap
from ..maps.triangulated.patches import shrunk
from .solution import Settings

ROUNDS = 20  # of straightening; a straightened edge may take its neighbour over a bound, in one round or two
STRETCHED, DILATED = 5.0, 10.0  # over 5 % of the target: from here pictures look like combed stripes


def held(map: TriangulatedMap, settings: Settings) -> TriangulatedMap:
    """The map with triangles left straight where their patches exceed a bound asked for."""
    for _ in range(ROUNDS):
        sides = np.unique(map.edges.sides[_excess(map, settings) > 1])
        bent = sides[map.bulges[sides] != 0]
        if not bent.size:
            break
        bulge = map.bulges.copy()
        bulge[bent] = 0
        map = replace(map, bulge=shrunk(map.faces, map.image, map.source, map.edges, bulge))
    return map


def bounded(map: TriangulatedMap, settings: Settings) -> bool:
    """Whether what is drawn meets the bounds asked for, but for rounding."""
    return bool(_excess(map, settings).max() <= 1 + 1e-9)


def _excess(map: TriangulatedMap, settings: Settings) -> Real:
    """(m,) how many times the bounds the largest dilatation and stretch of each patch are."""
    worst = np.zeros(len(map.faces))
    if settings.max_dilatation is None and settings.max_stretch is None:
        return worst
    found = distortion.of_triangles(map)
    for bound, values in (
        (settings.max_dilatation, found.dilatations),
        (settings.max_stretch, found.stretches),
    ):
        if bound is not None:
            worst = np.maximum(worst, values.reshape(worst.size, -1).max(axis=1) / bound)
    return worst


def notes(map: TriangulatedMap) -> list[str]:
    """A sentence where the stretch cannot be small: a ring, a bar or a spiral onto a block, or the other way round."""
    found = distortion.of_triangles(map)
    stretch, dilatation = (found.quantile(each, 0.95) for each in (found.stretches, found.dilatations))
    if stretch <= STRETCHED and dilatation <= DILATED:
        return []
    return [
        "The shapes differ so much that the picture is stretched strongly, as any one-to-one map between them must: "
        f"on 5 % of the target lengths change by more than {stretch:.1f} times, "
        f"and by {dilatation:.0f} times as much one way as the other."
    ]
