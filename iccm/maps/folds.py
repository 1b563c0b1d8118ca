"""Which sheet of a folded map is seen: the one that goes on from the widest place."""

from heapq import heapify, heappop, heappush

import numpy as np

from ..arrays import Complex, Index, Real
from .refinement import neighbours
from .triangulated.adjacency import edges_of
from .triangulated.patches import cross


def by_sheets(image: Complex, faces: Index, clearance: Real) -> tuple[Index, int]:
    """The triangles in the order in which they lie over each other, and how many are seen at all.

    A sheet is reached from the triangle with most room around its image, the widest places first; those that are turned
    over belong to none, and come last. So two triangles over one place are of the sheets that go the wider ways there.

    Args:
        image: (n,) images of the vertices.
        faces: (m, 3) triangles.
        clearance: (m,) how far each one's image is from that of the boundary.
    """
    a, b, c = image[faces].T
    upright = cross(b - a, c - a) > 0
    beside = neighbours(edges_of(faces)).tolist()
    room, left = (-clearance).tolist(), upright.tolist()
    starts = [(room[t], t) for t in np.flatnonzero(upright).tolist()]
    heapify(starts)
    order: list[int] = []
    ready: list[tuple[float, int]] = []
    while ready or starts:
        _, t = heappop(ready or starts)
        if not left[t]:
            continue
        left[t] = False
        order.append(t)
        for u in beside[t]:
            if u >= 0 and left[u]:
                heappush(ready, (room[u], u))
    return faces[np.concatenate([np.array(order, np.int64), np.flatnonzero(~upright)])], len(order)
