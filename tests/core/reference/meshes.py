"""The kernels of iccm.meshes in plain Python."""

import numpy as np


def evaluate(coefficients, corners, owner, texels, first, shape, z, zx, zy):
    """Evaluate an affine function per triangle at its texels; texels that wrap around are moved back first."""
    height, width = shape
    for i in range(owner.size):
        t = owner[i]
        x = beside(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0], texels[i] % width + 0.5, width)
        y = beside(
            corners[t, 0, 1], corners[t, 1, 1], corners[t, 2, 1], first + texels[i] // width + 0.5, height
        )
        zx[i], zy[i] = coefficients[t, 1], coefficients[t, 2]
        z[i] = coefficients[t, 0] + zx[i] * x + zy[i] * y


def beside(a, b, c, x, size):
    """Return the place x, moved by multiples of `size` unless it lies between three others or within half a texel of
    them.
    """
    low, high = min(a, b, c) - 0.5, max(a, b, c) + 0.5
    if x < low:
        x += size * np.ceil((low - x) / size)
    elif x > high:
        x -= size * np.ceil((x - high) / size)
    return x


def affine(corners, values, out):
    for t in range(corners.shape[0]):
        ax, ay = corners[t, 1, 0] - corners[t, 0, 0], corners[t, 1, 1] - corners[t, 0, 1]
        bx, by = corners[t, 2, 0] - corners[t, 0, 0], corners[t, 2, 1] - corners[t, 0, 1]
        area = ax * by - ay * bx
        inverse = 1.0 / area if area != 0 else 0.0
        d1, d2 = values[t, 1] - values[t, 0], values[t, 2] - values[t, 0]
        out[t, 1] = (d1 * by - d2 * ay) * inverse
        out[t, 2] = (d2 * ax - d1 * bx) * inverse
        out[t, 0] = values[t, 0] - out[t, 1] * corners[t, 0, 0] - out[t, 2] * corners[t, 0, 1]


def edges(tri, sign, a, b, c):
    """Compute the coefficients of the three edge functions a x + b y + c of a triangle with orientation `sign`,
    positive inside.
    """
    for k in range(3):
        p, q = k, (k + 1) % 3
        if sign < 0:
            p, q = q, p
        a[k] = tri[p, 1] - tri[q, 1]
        b[k] = tri[q, 0] - tri[p, 0]
        # anchored at the same end for both triangles of an edge, so that they compute the same number with opposite
        # sign
        u = p if (tri[p, 0], tri[p, 1]) < (tri[q, 0], tri[q, 1]) else q
        c[k] = -(a[k] * tri[u, 0] + b[k] * tri[u, 1])


def span(tri, axis, start, stop, grow, wrap):
    """Return the texels first .. last - 1 whose centres can lie in the triangle along one axis, grown by `grow`."""
    low, high = min(tri[0, axis], tri[1, axis], tri[2, axis]), max(tri[0, axis], tri[1, axis], tri[2, axis])
    first, last = int(np.ceil(low - 0.5 - grow)), int(np.floor(high - 0.5 + grow)) + 1
    if not wrap:
        first, last = max(first, start), min(last, stop)
    return first, last


def turn(tri):
    return (tri[1, 0] - tri[0, 0]) * (tri[2, 1] - tri[0, 1]) - (tri[1, 1] - tri[0, 1]) * (
        tri[2, 0] - tri[0, 0]
    )


def inside(e, a, b):
    """Return whether a point with edge function e is inside: on an edge, only if that is a left or a top one."""
    return e > 0 or (e == 0 and (a > 0 or (a == 0 and b > 0)))


def set_up(tri, width, top, bottom, grow, wrap, a, b, c):
    """Compute the edge functions a, b, c of a triangle, and the columns x0 .. x1 - 1 and rows y0 .. y1 - 1 to scan.

    Unless triangles wrap around, rows are among top .. bottom - 1 and columns on the grid.
    """
    y0, y1 = span(tri, 1, top, bottom, grow, wrap)
    sign = turn(tri) if y0 < y1 else 0.0
    if not (sign > 0 or sign < 0):
        return 0, 0, 0, 0
    edges(tri, sign, a, b, c)
    x0, x1 = span(tri, 0, 0, width, grow, wrap)
    return x0, x1, y0, y1


def fill(corners, owner, top, bottom, wrap):
    """Assign the texels of rows top .. bottom - 1 to triangles; return how often one lies in a further triangle."""
    height, width = owner.shape
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    overlaps = 0
    for t in range(corners.shape[0]):
        x0, x1, y0, y1 = set_up(corners[t], width, top, bottom, 0.0, wrap, a, b, c)
        for y in range(y0, y1):
            row = y % height
            if not top <= row < bottom:
                continue
            for x in range(x0, x1):
                px, py = x + 0.5, y + 0.5
                if (
                    inside(a[0] * px + b[0] * py + c[0], a[0], b[0])
                    and inside(a[1] * px + b[1] * py + c[1], a[1], b[1])
                    and inside(a[2] * px + b[2] * py + c[2], a[2], b[2])
                ):
                    column = x % width
                    if owner[row, column] < 0:
                        owner[row, column] = t
                    else:
                        overlaps += 1
    return overlaps


def touch(corners, chosen, owner, centre, nearest, wrap):
    """Assign texels whose centre is in no triangle to the triangle of `chosen` that enters their square the
    farthest.
    """
    height, width = owner.shape
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for t in chosen:
        x0, x1, y0, y1 = set_up(corners[t], width, 0, height, 0.5, wrap, a, b, c)
        for y in range(y0, y1):
            row = y % height
            for x in range(x0, x1):
                column = x % width
                if centre[row, column]:
                    continue
                away = 0.0
                for k in range(3):
                    e = a[k] * (x + 0.5) + b[k] * (y + 0.5) + c[k]
                    if e <= -0.5 * (abs(a[k]) + abs(b[k])):
                        away = np.inf
                        break
                    away = max(away, -e / np.sqrt(a[k] * a[k] + b[k] * b[k]))
                if away < nearest[row, column]:
                    nearest[row, column] = away
                    owner[row, column] = t


def nearest(corners, slopes, owner, depth):
    """Return the triangle nearest to the viewer for each sample."""
    height, width = owner.shape
    for t in range(corners.shape[0]):
        tri = corners[t]
        turn = (tri[1, 0] - tri[0, 0]) * (tri[2, 1] - tri[0, 1]) - (tri[1, 1] - tri[0, 1]) * (
            tri[2, 0] - tri[0, 0]
        )
        if turn == 0:
            continue
        x0, x1 = (
            max(0, int(np.floor(tri[:, 0].min() - 0.5))),
            min(width - 1, int(np.ceil(tri[:, 0].max() - 0.5))),
        )
        y0, y1 = (
            max(0, int(np.floor(tri[:, 1].min() - 0.5))),
            min(height - 1, int(np.ceil(tri[:, 1].max() - 0.5))),
        )
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                inside = True
                for k in range(3):
                    q = (k + 1) % 3
                    e = (tri[q, 0] - tri[k, 0]) * (y + 0.5 - tri[k, 1]) - (tri[q, 1] - tri[k, 1]) * (
                        x + 0.5 - tri[k, 0]
                    )
                    if e * turn < 0:
                        inside = False
                        break
                if inside:
                    d = slopes[t, 0] + slopes[t, 1] * (x + 0.5) + slopes[t, 2] * (y + 0.5)
                    if d > depth[y, x]:
                        depth[y, x] = d
                        owner[y, x] = t


def cross(o, a, b):
    return (a.real - o.real) * (b.imag - o.imag) - (a.imag - o.imag) * (b.real - o.real)


def walk(flat, faces, twin, z, start, triangle, weights):
    """Compute the triangles of points, and their barycentric coordinates."""
    for i in range(z.size):
        triangle[i] = walk_to(flat, faces, twin, z[i], start[i], weights[i])


def walk_to(flat, faces, twin, z, t, weights):
    """Walk across the edge that the point lies farthest beyond until it lies beyond none, or a boundary stops the
    walk.
    """
    steps = 0
    while True:
        a, b, c = flat[faces[t, 0]], flat[faces[t, 1]], flat[faces[t, 2]]
        area = cross(a, b, c)
        w = (cross(b, c, z) / area, cross(c, a, z) / area, cross(a, b, z) / area)
        worst, beyond = -1, 0.0
        for k in range(3):  # weight k belongs to the edge from corner k + 1 to k + 2
            if w[k] < beyond and twin[3 * t + (k + 1) % 3] >= 0:
                worst, beyond = k, w[k]
        if worst < 0 or steps > 4096:
            break
        t = twin[3 * t + (worst + 1) % 3] // 3
        steps += 1
    clamped(a, b, c, z, w, weights)
    return t


def clamped(a, b, c, z, w, out):
    """Return the barycentric coordinates of the triangle's point nearest to z, given those of z."""
    out[0], out[1], out[2] = w
    if min(w[0], w[1], w[2]) >= 0:
        return
    p = (a, b, c)
    least = np.inf
    for k in range(3):
        u, v = p[k], p[(k + 1) % 3]
        e = v - u
        s = ((z - u) * e.conjugate()).real / max(abs(e) ** 2, 1e-300)
        s = min(max(s, 0.0), 1.0)
        d = abs(u + s * e - z)
        if d < least:
            least = d
            out[k], out[(k + 1) % 3], out[(k + 2) % 3] = 1 - s, s, 0.0
