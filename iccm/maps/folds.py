"""The sheet of a folded map that is seen: the one that goes on from the widest place."""

import numpy as np

from ..arrays import Complex, Index, Real
from ..jit import kernel
from .triangulated.patches import cross


def by_sheets(image: Complex, faces: Index, across: Index, clearance: Real) -> tuple[Index, int]:
    """The triangles in the order in which they lie over each other, and how many are seen at all.

    Of two triangles over one place the one lies on top to which a wider way leads from the triangle with most room
    around its image, over triangles that are not turned over. These are not seen, and come last.

    Args:
        image: (n,) images of the vertices.
        faces: (m, 3) triangles.
        across: (m, 3) those beyond their sides, -1 for none.
        clearance: (m,) how far each one's image is from that of the boundary.
    """
    a, b, c = image[faces].T
    up = cross(b - a, c - a) > 0
    upright = np.flatnonzero(up)
    widest = upright[np.argsort(-clearance[upright], kind="stable")]
    reached = np.full(len(faces), -1.0)
    _flood(widest, across, clearance, *np.empty((4, len(faces)), np.int64), reached)
    order = widest[np.argsort(-reached[widest], kind="stable")]
    return faces[np.concatenate([order, np.flatnonzero(~up)])], upright.size


@kernel
def _flood(widest, beside, clearance, label, following, last, count, reached):
    """Writes how wide the way to each triangle is, where there is one from the first of `widest`, the triangles with
    most room first: sheets grow together, and what joins the first one's is reached over the triangle that joins it.

    Args:
        widest: (k,) the triangles.
        beside: (m, 3) the triangles beside each.
        clearance: (m,) how much room there is.
        label, following, last, count: (m,) written: the sheet of each, the next triangle of it, the last of each sheet,
            and how many it has.
        reached: (m,) less than nothing; written.
    """
    for t in range(label.size):
        label[t] = -1
    for t in widest:
        label[t], following[t], last[t], count[t] = t, -1, t, 1
        if t == widest[0]:
            reached[t] = clearance[t]
        for k in range(3):
            u = beside[t, k]
            if u < 0 or label[u] < 0 or label[u] == label[t]:
                continue
            a, b = label[t], label[u]
            if b == widest[0] or (a != widest[0] and count[b] > count[a]):  # the smaller one is relabelled
                a, b = b, a
            first = a == widest[0]
            following[last[a]], last[a], count[a] = b, last[b], count[a] + count[b]
            v = b
            while v >= 0:
                label[v] = a
                if first:
                    reached[v] = clearance[t]
                v = following[v]
