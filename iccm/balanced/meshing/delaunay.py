"""A constrained Delaunay triangulation under edit: ear clipping to begin with, flips that keep it Delaunay.

A triangulation is two arrays: `faces` (t, 3), counter-clockwise vertices, and `across` (t, 3), the triangle beyond the
edge opposite each of them, -1 on the outline. Both have room for more triangles than there are.
"""

from ...flips import flip, opposite, push
from ...jit import kernel
from ..kernels import cross, dot, set_row, twice_area

FLAT = 1e-13  # of the squared edges: an ear with less area is three points on a line but for rounding
ROUNDING = 1e-13
"""Relative: the in-circle determinant's error bound is 1e-15 (Shewchuk 1997), with room to spare."""
THIN = 1e-14  # twice the area, of a domain of area one, that a flip may leave
MOST_FLIPS = 2_000_000  # a bound that no mesh comes near


@kernel
def in_circle(z, a, b, c, d):
    """Whether d lies inside the circle of the counter-clockwise triangle a, b, c by more than rounding."""
    u, v, w = z[a] - z[d], z[b] - z[d], z[c] - z[d]
    first, second, third = (
        dot(u, u) * cross(v, w),
        dot(v, v) * cross(w, u),
        dot(w, w) * cross(u, v),
    )
    return first + second + third > ROUNDING * (abs(first) + abs(second) + abs(third))


@kernel
def _is_ear(z, before, i, after, following):
    """Whether the corner i of the remaining polygon can be cut off."""
    a, b, c = z[before], z[i], z[after]
    size = dot(b - a, b - a) + dot(c - b, c - b)
    if cross(b - a, c - b) <= FLAT * size:
        return False
    slack = -1e-15
    j = following[after]
    while j != before:
        p = z[j]
        if cross(b - a, p - a) >= slack and cross(c - b, p - b) >= slack and cross(a - c, p - c) >= slack:
            return False
        j = following[j]
    return True


@kernel
def _join(across, u, k, t):
    """Tells triangle u, unless it is -1, that t is opposite its corner k."""
    if u >= 0:
        across[u, k] = t


@kernel
def clip_ears(z, following, before, beyond, side, faces, across):
    """Triangulates the simple counter-clockwise polygon z (n,); the number of triangles, or -1 where it fails.

    `across` must hold -1 everywhere; the arrays before it (n,) are written.

    Meisters, *Polygons have ears*, 1975. Every remaining edge remembers the triangle on its other side.
    """
    count = z.size
    for v in range(count):  # array expressions compile slowly
        following[v], before[v] = (v + 1) % count, (v - 1) % count
        beyond[v], side[v] = -1, 0
    left, t, idle = count, 0, 0
    i = following[count - 1]
    while left > 3:
        p, q = before[i], following[i]
        if not _is_ear(z, p, i, q, following):
            i = q
            idle += 1
            if idle > left:
                return -1
            continue
        set_row(faces, t, p, i, q)
        across[t, 0], across[t, 2] = beyond[i], beyond[p]
        _join(across, beyond[p], side[p], t)
        _join(across, beyond[i], side[i], t)
        beyond[p], side[p] = t, 1
        following[p], before[q] = q, p
        left, idle, i, t = left - 1, 0, following[q], t + 1
    a, b = i, following[i]
    c = following[b]
    set_row(faces, t, a, b, c)
    set_row(across, t, beyond[b], beyond[c], beyond[a])
    _join(across, beyond[a], side[a], t)
    _join(across, beyond[b], side[b], t)
    _join(across, beyond[c], side[c], t)
    return t + 1


@kernel
def is_constrained(links, a, b):
    """Whether vertices a and b are the ends of an edge that every mesh must keep."""
    return a < links.size and b < links.size and (links[a] == b or links[b] == a)


@kernel
def legalise(z, faces, across, stack, fixed, links):
    """Lawson's flips, from the triangles on the stack on, until all edges are Delaunay.

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles.
        across: (t, 3) their neighbours.
        stack: triangles to look at, after their number; emptied.
        fixed: no flip may join two vertices below this number; 0 allows every flip.
        links: (c,) the vertex to which each of the first c is joined by an edge that stays, -1 for none.
    """
    for _ in range(MOST_FLIPS):
        if stack[0] == 0:
            return
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            u = across[t, k]
            if u < 0:
                continue
            a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            d = faces[u, opposite(faces, u, b, c)]
            if (a < fixed and d < fixed) or is_constrained(links, b, c):
                continue
            if in_circle(z, a, b, c, d) and twice_area(z, a, b, d) > THIN and twice_area(z, a, d, c) > THIN:
                flip(faces, across, t, k)
                push(stack, t)
                push(stack, u)
                break
