"""Edge flips in a triangulation under edit.

A triangulation is two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the triangle beyond the
edge opposite each of them, -1 on the outline.
"""

import numpy as np

from .arrays import Index
from .jit import kernel
from .native import function

_neighbours = function(
    "int64_t iccm_maps_neighbours(const int64_t *faces, int64_t m, int64_t vertices, int64_t *across)"
)


def neighbours(faces: Index, count: int) -> Index:
    """(t, 3) the triangles across the edges of faces (t, 3), whose vertices are numbers below `count`."""
    faces = np.ascontiguousarray(faces)
    across = np.empty_like(faces)
    _neighbours(faces, len(faces), count, across)
    return across


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
