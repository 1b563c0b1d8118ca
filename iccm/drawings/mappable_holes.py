"""Select the holes of a shape that can be mapped: large enough, and apart from the outline and from each other."""

from collections.abc import Sequence

import numpy as np
import shapely

from ..arrays import Complex
from ..curve import Curve, polygon_of

MOST_HOLES = 64
"""Holes that are mapped at most, the largest first, since each costs a chain of vertices on every mesh."""
SPECK_AREA_SHARE = 1e-5  # of the area inside the outline: a smaller hole would need equally small triangles
CLOSE_SHARE = 2e-4
"""Of the diagonal: a hole closer than this to the outline, or to another hole, leaves no room for a map."""


def mappable(curve: Curve, holes: Sequence[Complex]) -> list[int]:
    """Return the indices of the mappable holes of an outline, ascending."""
    rings = [polygon_of(hole) for hole in holes]
    sizes = shapely.area(rings)
    domain = curve.polygon
    outline = domain.exterior
    clearance = CLOSE_SHARE * curve.diagonal
    indices: list[int] = []
    for k in np.argsort(-sizes, kind="stable"):
        ring = rings[k]
        if len(indices) == MOST_HOLES or not (ring.is_valid and sizes[k] > SPECK_AREA_SHARE * curve.area):
            continue
        if ring.buffer(-clearance).is_empty:  # a hairline, as between parts that almost touch
            continue
        free = ring.distance(outline) > clearance and all(
            ring.distance(rings[j]) > clearance for j in indices
        )
        if free and domain.contains_properly(ring):
            indices.append(int(k))
    return sorted(indices)
