"""Edge flips in a triangulation under edit.

A triangulation is two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the triangle beyond the
edge opposite each of them, -1 on the outline.
"""

import numpy as np

from .arrays import Index
from .jit import kernel


def neighbours(faces: Index, count: int) -> Index:
    """(t, 3) the triangles across the edges of faces (t, 3), whose vertices are numbers below `count`."""
    across = np.empty_like(faces)
    _join(faces, np.full(count, -1), np.empty(faces.size, np.int64), across)
    return across


@kernel
def _join(faces, first, following, across):
    """Writes the triangles beyond the sides of faces (m, 3), -1 for none.

    Args:
        first: (n,) -1 for every vertex; written: the last side that begins there,
        following: (3m,) written: and the one before that.
        across: (m, 3) written.
    """
    for t in range(len(faces)):
        for k in range(3):
            start, end = faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            across[t, k], following[3 * t + k], first[start] = -1, first[start], 3 * t + k
            side = first[end]
            while side >= 0:
                u, j = side // 3, side % 3
                if faces[u, (j + 2) % 3] == start:
                    across[t, k], across[u, j] = u, t
                    break
                side = following[side]


@kernel
def relink(across, t, old, new):
    """Tells triangle t, unless it is -1, that its neighbour old is now new."""
    if t >= 0:
        for k in range(3):
            if across[t, k] == old:
                across[t, k] = new
                return


@kernel
def opposite(faces, u, b, c):
    """The place in triangle u of the vertex that is neither b nor c."""
    for k in range(3):
        if faces[u, k] != b and faces[u, k] != c:
            return k
    return 0


@kernel
def write(faces, across, t, a, b, c, beyond_a, beyond_b, beyond_c):
    """Writes a triangle and its neighbours."""
    faces[t, 0], faces[t, 1], faces[t, 2] = a, b, c
    across[t, 0], across[t, 1], across[t, 2] = beyond_a, beyond_b, beyond_c


@kernel
def flip(faces, across, t, k):
    """Replaces the edge opposite corner k of t by the other diagonal of the two triangles beside it."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    write(faces, across, t, a, b, d, beyond_bd, u, beyond_ab)
    write(faces, across, u, a, d, c, beyond_dc, beyond_ca, t)
    relink(across, beyond_bd, u, t)
    relink(across, beyond_ca, t, u)


@kernel
def push(stack, t):
    """Puts a triangle on the stack, whose first entry counts what is on it, unless it is full."""
    if stack[0] + 1 < stack.size:
        stack[0] += 1
        stack[stack[0]] = t
