"""Half-edge collapses, and their reversal."""

import numpy as np

from .flips import cross, dot, set_row, twice_area

DEGREE = 12  # triangles around a removed vertex at most: twice the usual number
THIN = 0.2  # relative to an equilateral triangle's ratio of area to squared sides: no thinner ones are made
SMALL = 0.01  # relative to the energy: gain of a step at which Newton's method ends


def power(base, exponent):
    """Return base ** exponent, without a logarithm for the most frequent exponents."""
    if exponent == 1.0:
        return base
    if exponent == 2.0:
        return base * base
    if exponent == 0.0:
        return 1.0
    return base**exponent


def density_derivatives(p, d, theta, q, share):
    """Return W and its derivatives W_p, W_d, W_pp, W_pd, W_dd."""
    inverse = 1 / d
    area, area1, area2 = 0.5 * (d + inverse), 0.5 * (1 - inverse * inverse), inverse * inverse * inverse
    grown, less = power(area, theta), 1 / area
    grown1 = theta * grown * less * area1
    grown2 = theta * grown * less * ((theta - 1) * less * area1 * area1 + area2)
    core_p = grown * inverse
    core, core_pd = p * core_p, (grown1 - core_p) * inverse
    core_d = p * core_pd
    core_dd = p * inverse * (grown2 - 2 * core_pd)
    value, first, second = core, 1.0, 0.0
    if q > 1:
        below = power(core, q - 2)
        first, second = q * below * core, q * (q - 1) * below
        value = below * core * core
    pp, pd = second * core_p * core_p, first * core_pd + second * core_p * core_d
    dd = first * core_dd + second * core_d * core_d
    core_p, core_d, area = first * core_p, first * core_d, 1 - share + share * d
    return (
        value * area,
        core_p * area,
        core_d * area + share * value,
        pp * area,
        pd * area + share * core_p,
        dd * area + 2 * share * core_d,
    )


def _roundness(points, a, b, c):
    """Return area over the sum of squared sides, normalised to 1 for an equilateral triangle in space."""
    square, x, y = 0.0, np.empty(3), np.empty(3)
    for k in range(3):
        x[k], y[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
        square += x[k] * x[k] + y[k] * y[k] + (y[k] - x[k]) * (y[k] - x[k])
    s, t, r = x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]
    return 2 * np.sqrt(3.0) * np.sqrt(s * s + t * t + r * r) / square


def _ring(faces, around, v, ring):
    """Write the neighbours of v in counter-clockwise order; return their number, negative on the boundary, 0 for a
    non-manifold vertex.

    Args:
        faces: (m, 3) triangles.
        around: (d,) triangles at v.
        v: a vertex.
        ring: (DEGREE + 1,) written.
    """
    d = around.size
    ends, begin = np.empty((d, 2), np.int64), -1
    for i in range(d):
        t = around[i]
        k = 0 if faces[t, 0] == v else 1 if faces[t, 1] == v else 2
        ends[i, 0], ends[i, 1] = faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    for i in range(d):
        first = True
        for j in range(d):
            first = first and ends[j, 1] != ends[i, 0]
        if first:
            if begin >= 0:
                return 0
            begin = i
    edge = max(begin, 0)
    for i in range(d):
        ring[i] = ends[edge, 0]
        following = -1
        for j in range(d):
            if ends[j, 0] == ends[edge, 1]:
                following = j
        if following < 0:
            ring[i + 1] = ends[edge, 1]
            return -(d + 1) if i == d - 1 else 0
        edge = following
    return d if begin < 0 and edge == 0 else 0


def _round(faces, points, z, starts, around, blocked, most, vertex, into, triangle, weights, ends, edges):
    """Remove vertices that are not neighbours; return their number. Removed faces get a first corner of -1.

    Args:
        faces: (m, 3) changed.
        points: (n, 3) in space.
        z: (n,) layout.
        starts: (n + 1,) where the triangles at each vertex begin in `around`.
        around: (3m,) triangles at the vertices.
        blocked: (n,) vertices that stay, written.
        most: largest number of vertices to remove.
        vertex, into, triangle, weights, ends, edges: of `Removed`, written.
    """
    ring, number = np.empty(DEGREE + 1, np.int64), 0
    for v in range(z.size):
        d = starts[v + 1] - starts[v]
        if blocked[v] or d < 2 or d > DEGREE or number == most or number == vertex.size:
            continue
        star = around[starts[v] : starts[v + 1]]
        size = _ring(faces, star, v, ring)
        open_, size = size < 0, abs(size)
        # choose the neighbour for which the remaining triangles are roundest and none is flipped
        best, into_ = THIN, -1
        for i in range(0, size, size - 1 if open_ else 1):
            w, worst = ring[i], 1.0
            for j in range(d):
                x, y = ring[j], ring[(j + 1) % size]
                if x != w and y != w:
                    worst = min(worst, _roundness(points, w, x, y)) if twice_area(z, w, x, y) > 0 else 0.0
            if worst > best:
                best, into_ = worst, w
        if into_ < 0:
            continue
        # its position in these, to restore it: in the triangle that it is farthest inside
        w, inside, end = into_, -np.inf, ends[number]
        vertex[number], into[number] = v, w
        for j in range(d):
            x, y = ring[j], ring[(j + 1) % size]
            edges[end + j, 0], edges[end + j, 1] = x, y
            if x != w and y != w:
                area = twice_area(z, w, x, y)
                p, q = twice_area(z, v, y, w) / area, twice_area(z, v, w, x) / area
                least = min(p, q, 1 - p - q)
                if least > inside:
                    inside = least
                    set_row(triangle, number, w, x, y)
                    set_row(weights, number, 1 - p - q, p, q)
        for i in range(size):
            blocked[ring[i]] = True
        for t in star:
            gone = faces[t, 0] == w or faces[t, 1] == w or faces[t, 2] == w
            for k in range(3):
                if faces[t, k] == v:
                    faces[t, k] = w
            if gone:
                faces[t, 0] = -1
        number += 1
        ends[number] = end + d
    return number


def _bisector(edges, w, u):
    """Return the bisector of the first and the last of the other vertices around a hole, seen from w on its
    boundary.
    """
    first, angle = edges[0, 0], 0.0
    for e in range(len(edges)):
        if edges[e, 0] == w:
            first = edges[e, 1]
    for e in range(len(edges)):
        x, y = u[edges[e, 0]] - u[w], u[edges[e, 1]] - u[w]
        if edges[e, 0] != w and edges[e, 1] != w:
            angle += np.arctan2(cross(x, y), dot(x, y))
    return (u[first] - u[w]) * np.exp(0.5j * angle)


def _room(edges, u, a, way):
    """Return the share of a path from a to u up to which all edges are seen from the left; 0 if none at the start."""
    share = np.inf
    for e in range(len(edges)):
        x, y = u[edges[e, 0]] - a, u[edges[e, 1]] - a
        left, more = cross(x, y), cross(way, x - y)
        if x == 0 or y == 0:
            left = 0.0
        if more < 0:
            share = min(share, max(left, 0.0) / -more)
        elif left == 0 and more == 0:
            share = 0.0
    return share


def _shape(corners):
    """Return the Wirtinger gradients of the hat functions (3,) of a triangle in space, and its area.

    Slivers are made a little higher, as `laid_flat` does.
    """
    sides = [np.linalg.norm(corners[(k + 2) % 3] - corners[(k + 1) % 3]) for k in range(3)]
    apex = int(np.argmax(sides))
    a, b, c = (corners[(apex + k) % 3] for k in (1, 2, 0))
    length = sides[apex]
    height = max(np.linalg.norm(np.cross(b - a, c - a)) / length, 1e-4 * length)
    tip, scale = complex(np.dot(b - a, c - a) / length, height), -0.5j / (length * height)
    alpha = np.empty(3, complex)
    alpha[(apex + 1) % 3] = scale * (tip - length).conjugate()
    alpha[(apex + 2) % 3] = -scale * tip.conjugate()
    alpha[apex] = scale * length
    return alpha, 0.5 * length * height


def _pull(points, edges, v, u, theta, power, measure):
    """Return the energy of the triangles around v, its gradient in the position of v, and the Hessian's entries xx, yy,
    xy.
    """
    energy, slope, xx, yy, xy = 0.0, 0j, 0.0, 0.0, 0.0
    for e in range(len(edges)):
        b, c = edges[e, 0], edges[e, 1]
        (alpha, beta, gamma), area = _shape(points[[v, b, c]])
        x, y = u[b] - u[v], u[c] - u[v]
        f, g = beta * x + gamma * y, beta.conjugate() * x + gamma.conjugate() * y
        ff, gg = dot(f, f), dot(g, g)
        if not ff > gg:
            return np.inf, slope, xx, yy, xy
        w, w_p, w_d, w_pp, w_pd, w_dd = density_derivatives(ff + gg, ff - gg, theta, power, measure)
        f, g = 2 * alpha.conjugate() * f, 2 * alpha * g
        p, d, scaling = f + g, f - g, 4 * w_p * dot(alpha, alpha)
        energy += area * w
        slope += area * (w_p * p + w_d * d)
        xx += area * (scaling + w_pp * p.real**2 + 2 * w_pd * p.real * d.real + w_dd * d.real**2)
        yy += area * (scaling + w_pp * p.imag**2 + 2 * w_pd * p.imag * d.imag + w_dd * d.imag**2)
        xy += area * (
            w_pp * p.real * p.imag + w_pd * (p.real * d.imag + p.imag * d.real) + w_dd * d.real * d.imag
        )
    return energy, slope, xx, yy, xy


def _settle(points, edges, v, u, theta, power, measure, force=0j):
    """Move v by Newton's method to where the energy of its triangles, less the work of a force, is least, until a step
    gains little.
    """
    energy, slope, xx, yy, xy = _pull(points, edges, v, u, theta, power, measure)
    while True:
        square = xx * yy - xy * xy
        if not (square > 0 and xx > 0):
            return
        slope -= force
        step = -complex(yy * slope.real - xy * slope.imag, xx * slope.imag - xy * slope.real) / square
        start, share = u[v], min(1.0, 0.5 * _room(edges, u, u[v], step))
        u[v] = start + share * step
        below, slope, xx, yy, xy = _pull(points, edges, v, u, theta, power, measure)
        gain = energy - below + dot(force, u[v] - start)
        if not gain > 0:
            u[v] = start
            return
        if gain < SMALL * energy:
            return
        energy = below


def put_back(vertex, into, corners, weights, starts, edges, points, theta, q, measure, u):
    """Compute the positions u (n,) of removed vertices, the last one first; return False if one has none.

    The whole hole is visible from the vertex onto which the removed one was collapsed. So there is room: on the path to
    the former position, or else along the bisector. From there each vertex moves to the position of least energy of its
    triangles.
    """
    for number in range(vertex.size - 1, -1, -1):
        around, a, v = edges[starts[number] : starts[number + 1]], u[into[number]], vertex[number]
        way = -a
        for k in range(3):
            way += weights[number, k] * u[corners[number, k]]
        share = _room(around, u, a, way)
        u[v] = a + (way if share > 1 else 0.5 * share * way)
        if not _is_proper(around, v, u):
            way = _bisector(around, into[number], u)
            share = _room(around, u, a, way)
            u[v] = a + (way if share > 1 else 0.5 * share * way)
        _settle(points, around, v, u, theta, q, measure)
        if not _is_proper(around, v, u):
            return False
    return True


def _is_proper(edges, v, u):
    """Whether the triangles between vertex v and the edges of its hole are counter-clockwise."""
    return all(cross(u[a] - u[v], u[b] - u[v]) > 0 for a, b in edges)


def smooth(faces, points, starts, around, fixed, forces, sweeps, theta, q, share, u):
    """Move each vertex that is not held to where the energy of its triangles, less the work of its force, is least,
    `sweeps` times.
    """
    for _ in range(sweeps):
        for v in range(u.size):
            if fixed[v]:
                continue
            edges = []
            for t in around[starts[v] : starts[v + 1]]:
                k = int(np.flatnonzero(faces[t] == v)[0])
                edges.append((faces[t][(k + 1) % 3], faces[t][(k + 2) % 3]))
            _settle(points, np.array(edges), v, u, theta, q, share, forces[v])
    return 0


def gradient(faces, points, theta, q, measure, u, slopes):
    """Return the energy of positions u (n,), and write its gradient (n,)."""
    energy = 0.0
    slopes[:] = 0
    for face in faces:
        alpha, area = _shape(points[face])
        f, g = alpha @ u[face], alpha.conj() @ u[face]
        ff, gg = dot(f, f), dot(g, g)
        if not ff > gg:
            return np.inf
        w, w_p, w_d, *_ = density_derivatives(ff + gg, ff - gg, theta, q, measure)
        energy += area * w
        slopes[face] += 2 * area * ((w_p + w_d) * f * alpha.conj() + (w_p - w_d) * g * alpha)
    return energy


def interpolate(vertex, corners, weights, step):
    """Interpolate displacements (n,) linearly at removed vertices, the last one first."""
    for number in range(vertex.size - 1, -1, -1):
        step[vertex[number]] = weights[number] @ step[corners[number]]
    return 0


def restrict(vertex, corners, weights, forces):
    """Move forces (n,) on removed vertices to the corners of their triangles, the first one first."""
    for number in range(vertex.size):
        for k in range(3):
            forces[corners[number, k]] += weights[number, k] * forces[vertex[number]]
    return 0
