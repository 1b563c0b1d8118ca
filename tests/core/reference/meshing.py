"""Triangulation of polygons."""

import numpy as np

from .flips import cross, dot, flip, opposite, push, relink, set_row, twice_area

# relative to the squared edges: an ear with less area is three collinear points up to rounding
FLAT_EAR = 1e-13
ON_EDGE = 1e-11  # twice the area, for a domain of area one, below which a new point counts as on an edge
ROUNDING = 1e-13  # relative error of the in-circle determinant
THIN = 1e-14  # twice the area, for a domain of area one, that a flip may leave
MOST_FLIPS = 2_000_000  # a limit that no mesh comes near
LEAST_ANGLE = 25.0  # degrees; thinner triangles get a point. Above 28 the refinement does not converge
LEAST_SINE2 = float(np.sin(np.radians(LEAST_ANGLE)) ** 2)
# cosine below which an edge of the outline may be seen from a new point; found by experiment
ENCROACHED = -0.3
ROUNDS = 60  # of refinement; icons need up to 8
MOST_RECOVERIES = 60  # sweeps of flips for an edge of a line; strokes need a few at most
ON_LINE = 1e-15  # distance, in a domain of area one, below which a vertex counts as on a line
THIN_FLIP = 1e-13  # twice the area that a flip for an edge of a line may leave
FARTHEST_WALK = 200  # triangles between a bad one and its circumcentre


def in_circle(z, a, b, c, d):
    """Return whether d lies inside the circumcircle of the counter-clockwise triangle a, b, c by more than rounding."""
    u, v, w = z[a] - z[d], z[b] - z[d], z[c] - z[d]
    first, second, third = (
        dot(u, u) * cross(v, w),
        dot(v, v) * cross(w, u),
        dot(w, w) * cross(u, v),
    )
    return first + second + third > ROUNDING * (abs(first) + abs(second) + abs(third))


def _is_ear(z, before, i, after, following):
    """Return whether the corner i of the remaining polygon can be cut off."""
    a, b, c = z[before], z[i], z[after]
    size = dot(b - a, b - a) + dot(c - b, c - b)
    if cross(b - a, c - b) <= FLAT_EAR * size:
        return False
    slack = -1e-15
    j = following[after]
    while j != before:
        p = z[j]
        if cross(b - a, p - a) >= slack and cross(c - b, p - b) >= slack and cross(a - c, p - c) >= slack:
            return False
        j = following[j]
    return True


def _join(across, u, k, t):
    """Set t as the neighbour opposite corner k of triangle u, unless u is -1."""
    if u >= 0:
        across[u, k] = t


def clip_ears(z, following, before, beyond, side, faces, across):
    """Triangulate the simple counter-clockwise polygon z (n,); return the number of triangles, or -1 on failure.

    `across` must be filled with -1; the arrays before it (n,) are written.

    Meisters, *Polygons have ears*, 1975. For each remaining edge, the triangle on its other side is stored.
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


def is_constrained(links, a, b):
    """Return whether vertices a and b are the ends of an edge that must be kept."""
    return a < links.size and b < links.size and (links[a] == b or links[b] == a)


def legalise(z, faces, across, stack, fixed, links):
    """Flip edges (Lawson), beginning with the triangles on the stack, until all are Delaunay.

    Args:
        z: (n,) vertices.
        faces: (t, 3) triangles.
        across: (t, 3) their neighbours.
        stack: triangles to inspect, after their number; emptied.
        fixed: no flip may join two vertices below this index; 0 allows every flip.
        links: (c,) the vertex to which each of the first c is joined by an edge that is kept, -1 for none.
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


def _limit(x, y, sizes):
    """Return the area limit at a point."""
    i = min(max(int((x - sizes.corner.real) / sizes.side), 0), sizes.areas.shape[0] - 1)
    j = min(max(int((y - sizes.corner.imag) / sizes.side), 0), sizes.areas.shape[1] - 1)
    return sizes.areas[i, j]


def _circumcentre(a, b, c):
    """Return the circumcentre of a triangle and the square of its circumradius."""
    u, v = a - c, b - c
    uu, vv, half = dot(u, u), dot(v, v), 0.5 / cross(u, v)
    offset = complex((v.imag * uu - u.imag * vv) * half, (u.real * vv - v.real * uu) * half)
    return c + offset, dot(offset, offset)


def _walk(z, faces, across, t, point, links):
    """Walk straight from t to the triangle that contains a point; return -1 if that leaves the polygon or crosses a
    line.
    """
    for _ in range(FARTHEST_WALK):
        next_one = t
        for k in range(3):
            a, b = z[faces[t, (k + 1) % 3]], z[faces[t, (k + 2) % 3]]
            if cross(b - a, point - a) < 0:
                blocked = is_constrained(links, faces[t, (k + 1) % 3], faces[t, (k + 2) % 3])
                next_one = -1 if blocked else across[t, k]
                break
        if next_one == t or next_one < 0:
            return min(t, next_one)
        t = next_one
    return -1


def _encroaches(z, faces, across, t, new, cavity, mark, stamp, links):
    """Return whether the vertex new, inside t, sees an edge of the outline or of a line in its cavity under too large
    an angle.
    """
    cavity[0], mark[t] = t, stamp
    count, position = 1, 0
    while position < count:
        t, position = cavity[position], position + 1
        for k in range(3):
            u = across[t, k]
            if u < 0 or is_constrained(links, faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]):
                a, b = z[faces[t, (k + 1) % 3]] - z[new], z[faces[t, (k + 2) % 3]] - z[new]
                if dot(a, b) < ENCROACHED * abs(a) * abs(b):
                    return True
            elif (
                mark[u] != stamp
                and count < cavity.size
                and in_circle(z, faces[u, 0], faces[u, 1], faces[u, 2], new)
            ):
                cavity[count], mark[u] = u, stamp
                count += 1
    return False


def _insert(z, faces, across, t, new, triangles, stack, fixed, links):
    """Insert the vertex new into triangle t; return False if it lies on an edge."""
    a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
    if min(twice_area(z, a, b, new), twice_area(z, b, c, new), twice_area(z, c, a, new)) < ON_EDGE:
        return False
    u, v = triangles, triangles + 1
    beyond_a, beyond_b, beyond_c = across[t, 0], across[t, 1], across[t, 2]
    set_row(faces, t, new, b, c)
    set_row(faces, u, new, c, a)
    set_row(faces, v, new, a, b)
    set_row(across, t, beyond_a, u, v)
    set_row(across, u, beyond_b, v, t)
    set_row(across, v, beyond_c, t, u)
    relink(across, beyond_b, t, u)
    relink(across, beyond_c, t, v)
    push(stack, t)
    push(stack, u)
    push(stack, v)
    legalise(z, faces, across, stack, fixed, links)
    return True


def _defect(z, faces, t, sizes, only_large):
    """Return whether triangle t is too large or too thin, and the point to insert."""
    a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
    centre, radius2 = _circumcentre(a, b, c)
    whole = a + b + c
    large = 0.5 * cross(b - a, c - a) > _limit(whole.real / 3, whole.imag / 3, sizes)
    shortest2 = min(dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c))
    thin = shortest2 < 4 * radius2 * LEAST_SINE2
    return large or (thin and not only_large), centre


def _refine(z, vertices, faces, across, triangles, stack, fixed, links, mark, cavity, sizes):
    """Insert circumcentres, of large triangles first, until no triangle can be improved.

    `mark` has a zero for each possible triangle, `cavity` has room for the triangles of a cavity.
    """
    for t in range(triangles):
        push(stack, t)
    legalise(z, faces, across, stack, fixed, links)
    stamp = 0
    for sweep in range(ROUNDS):
        before = vertices
        for t in range(triangles):
            improvable, point = _defect(z, faces, t, sizes, sweep == 0)
            if not improvable or vertices + 1 >= z.size:
                continue
            holder = _walk(z, faces, across, t, point, links)
            if holder < 0:
                continue
            stamp += 1
            z[vertices] = point
            if _encroaches(z, faces, across, holder, vertices, cavity, mark, stamp, links):
                continue
            if _insert(z, faces, across, holder, vertices, triangles, stack, fixed, links):
                vertices, triangles = vertices + 1, triangles + 2
        if vertices == before and sweep > 0:
            break
    return vertices, triangles


def _split(z, new, faces, across, t, k, triangles, stack, outline, links):
    """Split the inner edge opposite corner k of t at the vertex new, which lies on it."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    t2, u2 = triangles, triangles + 1
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    set_row(faces, t, a, b, new)
    set_row(faces, t2, a, new, c)
    set_row(faces, u, d, new, b)
    set_row(faces, u2, d, c, new)
    set_row(across, t, u, t2, beyond_ab)
    set_row(across, t2, u2, beyond_ca, t)
    set_row(across, u, t, beyond_bd, u2)
    set_row(across, u2, t2, u, beyond_dc)
    relink(across, beyond_ca, t, t2)
    relink(across, beyond_dc, u, u2)
    push(stack, t)
    push(stack, t2)
    push(stack, u)
    push(stack, u2)
    legalise(z, faces, across, stack, outline, links)


def _refine_and_split(z, given, faces, across, triangles, stack, fixed, links, mark, cavity, sizes):
    """Refine the mesh, then split inner edges that join two of the first `given` vertices, except for those of lines.

    One kernel compiles faster than two.
    """
    vertices, triangles = _refine(
        z, given, faces, across, triangles, stack, fixed, links, mark, cavity, sizes
    )
    for _ in range(ROUNDS):
        before = vertices
        for t in range(triangles):
            for k in range(3):
                b, c = faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
                if (
                    across[t, k] < 0
                    or b >= given
                    or c >= given
                    or vertices >= z.size
                    or is_constrained(links, b, c)
                ):
                    continue
                z[vertices] = 0.5 * (z[b] + z[c])
                _split(z, vertices, faces, across, t, k, triangles, stack, given, links)
                vertices, triangles = vertices + 1, triangles + 2
                break
        if vertices == before:
            break
    return vertices, triangles


def _holder(z, faces, triangles, point):
    """Return the triangle that contains a point: the one for which the point is farthest inside."""
    best, holder = -np.inf, 0
    for t in range(triangles):
        inside = np.inf
        for k in range(3):
            a, b = z[faces[t, k]], z[faces[t, (k + 1) % 3]]
            inside = min(inside, cross(b - a, point - a) / abs(b - a))
        if inside > best:
            best, holder = inside, t
    return holder


def _insert_given(z, border, given, faces, across, triangles, stack, links):
    """Insert the given vertices and recover the edges between them; return the number of triangles, or -1."""
    nothing = links[:0]
    for t in range(triangles):
        push(stack, t)
    legalise(z, faces, across, stack, 0, nothing)
    for new in range(border, given):
        t = _holder(z, faces, triangles, z[new])
        if _insert(z, faces, across, t, new, triangles, stack, 0, nothing):
            triangles += 2
            continue
        # it lies on a side, or nearly so: the side with which it spans the least area is split
        best, side = np.inf, -1
        for k in range(3):
            area = twice_area(z, faces[t, (k + 1) % 3], faces[t, (k + 2) % 3], new)
            if across[t, k] >= 0 and area < best:
                best, side = area, k
        if side < 0:
            return -1
        _split(z, new, faces, across, t, side, triangles, stack, 0, nothing)
        triangles += 2
    for v in range(given):
        if links[v] >= 0 and not recover(z, faces, across, triangles, v, links[v], links):
            return -1
    for t in range(triangles):
        push(stack, t)
    legalise(z, faces, across, stack, 0, links)
    return triangles


def _carve(faces, across, triangles, first, last, links, stack):
    """Remove the triangles inside the holes; return the number of the others.

    The vertices from first to last form the holes' boundaries, each linked to the next one with the hole on the right.
    """
    dead = np.zeros(triangles, np.bool_)
    stack[0] = 0
    for t in range(triangles):
        for k in range(3):
            a, b = faces[t, k], faces[t, (k + 1) % 3]
            if first <= b < last and links[b] == a and not dead[t]:
                dead[t] = True
                push(stack, t)
    while stack[0] > 0:
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            u = across[t, k]
            if u < 0 or dead[u] or is_constrained(links, faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]):
                continue
            dead[u] = True
            push(stack, u)
    place, left = np.empty(triangles + 1, np.int64), 0
    place[triangles] = -1  # entry for the missing neighbour, -1
    for t in range(triangles):
        place[t] = -1 if dead[t] else left
        left += 0 if dead[t] else 1
    for t in range(triangles):
        new = place[t]
        if new >= 0:
            for k in range(3):
                faces[new, k], across[new, k] = faces[t, k], place[across[t, k]]
    for t in range(left, triangles):
        for k in range(3):
            across[t, k] = -1
    return left


def _side(z, p, q, v):
    """Return the side of the line from p to q on which the vertex v lies: 1, -1, or 0 if rounding decides."""
    ahead, to = z[q] - z[p], z[v] - z[p]
    area = cross(ahead, to)
    return 0 if abs(area) <= ON_LINE * (abs(ahead) + abs(to)) else 1 if area > 0 else -1


def recover(z, faces, across, triangles, v, w, links):
    """Flip edges that cross the one from v to w until that is in the mesh; return False if that fails."""
    for _ in range(MOST_RECOVERIES):
        crossing = False
        for t in range(triangles):
            for k in range(3):
                a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
                u = across[t, k]
                if u < 0 or a > faces[u, opposite(faces, u, b, c)] or v in (b, c) or w in (b, c):
                    continue
                if _side(z, v, w, b) * _side(z, v, w, c) >= 0 or _side(z, b, c, v) * _side(z, b, c, w) >= 0:
                    continue
                d = faces[u, opposite(faces, u, b, c)]
                if is_constrained(links, b, c) and min(b, c) < min(v, w):
                    return False
                crossing = True
                if min(twice_area(z, a, b, d), twice_area(z, a, d, c)) > THIN_FLIP:
                    flip(faces, across, t, k)
                    break
        if not crossing:
            return True
    return False
