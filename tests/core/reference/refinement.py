"""Lepp-Delaunay refinement, and edges of triangulations."""

import numpy as np

from .flips import flip, opposite, push, relink, write

SWEEPS, WALK = 30, 1000
FALL = 1 - 1e-6  # factor of the roughness that a flip must achieve


def _numbered(faces, across):
    """Return the edges of triangles, as `Edges` lists them."""
    m = len(faces)
    ends, sides, count = np.empty((3 * m, 2), np.int64), np.empty((m, 3), np.int64), 0
    rim, beside, corner, around = (
        np.empty(3 * m, np.int64),
        np.empty(3 * m, np.int64),
        np.empty(3 * m, np.int64),
        0,
    )
    for t in range(m):
        for k in range(3):
            u, start, end = across[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            if 0 <= u < t:
                sides[t, k] = sides[u, opposite(faces, u, start, end)]
                continue
            if u < 0:
                rim[around], beside[around], corner[around] = count, t, k
                around += 1
            sides[t, k], ends[count, 0], ends[count, 1] = count, start, end
            count += 1
    return ends[:count], sides, rim[:around], beside[:around], corner[:around]


def _cross(a, b):
    return a.real * b.imag - a.imag * b.real


def _square(a):
    return a.real * a.real + a.imag * a.imag


def _roughness(z, a, b, c):
    """Return the sum of a triangle's squared sides over twice its area; infinite if it is not counter-clockwise."""
    u, v = z[b] - z[a], z[c] - z[a]
    area = _cross(u, v)
    return (_square(u) + _square(v) + _square(v - u)) / area if area > 0 else np.inf


def _flip_all(z, faces, across, stack):
    """Flip edges, beginning with the triangles on the stack, until no flip decreases the roughness."""
    while stack[0] > 0:
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            u = across[t, k]
            if u < 0:
                continue
            a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            d = faces[u, opposite(faces, u, b, c)]
            before = _roughness(z, a, b, c) + _roughness(z, d, c, b)
            if not _roughness(z, a, b, d) + _roughness(z, a, d, c) < FALL * before:
                continue
            flip(faces, across, t, k)
            push(stack, t)
            push(stack, u)
            break


def _longest(z, faces, t):
    """Return the corner opposite to a triangle's longest side, and the square of that side."""
    side, longest = 0, -1.0
    for k in range(3):
        square = _square(z[faces[t, (k + 1) % 3]] - z[faces[t, (k + 2) % 3]])
        if square > longest:
            side, longest = k, square
    return side, longest


def _cut(z, new, faces, across, t, k, m, stack):
    """Split the side opposite to corner k of t at the vertex new; return the number of triangles, m before."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    t2, u2 = m, m + 1
    relink(across, beyond_ca, t, t2)
    write(faces, across, t, a, b, new, u, t2, beyond_ab)
    write(faces, across, t2, a, new, c, u2 if u >= 0 else -1, beyond_ca, t)
    push(stack, t)
    push(stack, t2)
    if u < 0:
        _flip_all(z, faces, across, stack)
        return m + 1
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    relink(across, beyond_dc, u, u2)
    write(faces, across, u, d, new, b, t, beyond_bd, u2)
    write(faces, across, u2, d, c, new, t2, u, beyond_dc)
    push(stack, u)
    push(stack, u2)
    _flip_all(z, faces, across, stack)
    return m + 2


def _terminal(z, faces, across, t):
    """Return the side to split, as a triangle and the opposite corner.

    Going from t across longest sides, it is the side that is the longest of both its triangles, or one of the polygon.
    If the second longest side of either triangle belongs to the polygon, that is split: otherwise vertices inside would
    come closer and closer to it.
    """
    k, longest = _longest(z, faces, t)
    for _ in range(WALK):
        u = across[t, k]
        if u < 0:
            return t, k
        j, length = _longest(z, faces, u)
        if across[u, j] == t or length <= longest:
            break
        t, k, longest = u, j, length
    for v in (t, across[t, k]):
        first, _ = _longest(z, faces, v)
        i, j = (first + 1) % 3, (first + 2) % 3
        before = _square(z[faces[v, j]] - z[faces[v, first]]), _square(z[faces[v, first]] - z[faces[v, i]])
        second = i if before[0] > before[1] else j
        if across[v, second] < 0:
            return v, second
    return t, k


def _mend(z, n, faces, m, across, stack, thin, tiniest2):
    """Flip edges on the stack, then add vertices until no triangle is thin, up to rounding, or until there is no room;
    return the numbers of vertices and triangles.
    """
    _flip_all(z, faces, across, stack)
    for _ in range(SWEEPS):
        before = n
        for t in range(m):
            while n < z.size and m + 2 <= len(faces):
                _, longest = _longest(z, faces, t)
                a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
                if _cross(b - a, c - a) >= thin * longest or longest < tiniest2:
                    break
                u, k = _terminal(z, faces, across, t)
                z[n] = 0.5 * (z[faces[u, (k + 1) % 3]] + z[faces[u, (k + 2) % 3]])
                m = _cut(z, n, faces, across, u, k, m, stack)
                n += 1
        if n == before:
            break
    return n, m


def _by_counting(key, order, count):
    """Return `order` sorted stably by key[order], with numbers below `count`."""
    place, out = np.zeros(count + 1, np.int64), np.empty(order.size, np.int64)
    for k in key:
        place[k + 1] += 1
    for k in range(count):
        place[k + 1] += place[k]
    for item in order:
        out[place[key[item]]] = item
        place[key[item]] += 1
    return out
