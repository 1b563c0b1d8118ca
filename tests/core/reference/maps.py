"""Patches, sheets of folded maps, and bounds for harmonic maps."""

import math

import numpy as np

STEPS = 12
BESIDE = 0.05
SHRINK = 0.7  # factor for the curvature of triangles that would fold
ROUNDS = 40  # of shrinking; 0.7^40 = 6e-7 is as good as linear, which is used for the rest


def _locate(control, boxes, grid, z, rounding, patch, place):
    """Write the patch and the position in it for each point that has one."""
    for i in range(z.size):
        x, y = z[i].real, z[i].imag
        column, row = _bucket(x - grid.low.real, grid.size), _bucket(y - grid.low.imag, grid.size)
        if not (0 <= column < grid.columns and 0 <= row < grid.rows):
            continue
        bucket = row * grid.columns + column
        least = rounding
        for k in range(grid.begin[bucket], grid.begin[bucket + 1]):
            t = grid.patches[k]
            if not (boxes[t, 0] <= x <= boxes[t, 2] and boxes[t, 1] <= y <= boxes[t, 3]):
                continue
            l1, l2, away = solve(control[t], z[i])
            if away <= least:
                least, patch[i] = away, t
                place[i, 0], place[i, 1], place[i, 2] = 1 - l1 - l2, l1, l2
                if away <= 0:
                    break


def _bucket(x, size):
    """Return the index of a bucket; -1 for NaN."""
    n = np.floor(x / size)
    return np.int64(n) if abs(n) < 1e9 else np.int64(-1)


def solve(c, z):
    """Return the parameters L_1 and L_2 of a point on a patch (6,), and its distance outside, in units of the plane.

    Uses Newton's method from the straight triangle's solution. The quadratic can have a second solution outside, so
    steps start within BESIDE of the triangle. If they do not converge, and the patch is bent by more than its width,
    each step starts at the closest point of the triangle. If it does not converge either, the point is outside at
    infinite distance.
    """
    u, v, r0 = c[1] - c[0], c[2] - c[0], z - c[0]
    area = u.real * v.imag - u.imag * v.real
    l1 = (r0.real * v.imag - r0.imag * v.real) / area
    l2 = (u.real * r0.imag - u.imag * r0.real) / area
    if c[3] != 0 or c[4] != 0 or c[5] != 0:
        straight = l1, l2
        l1, l2, converged = _descend(c, u, v, r0, straight, lambda l1, l2: _pulled_in(l1, l2))
        width = abs(area) / max(abs(u), abs(v), abs(v - u))
        if not converged and max(abs(c[3]), abs(c[4]), abs(c[5])) > width:
            l1, l2, converged = _descend(c, u, v, r0, straight, lambda l1, l2: _projected(u, v, l1, l2))
        if not converged:
            return l1, l2, np.inf
    away = max(-(1 - l1 - l2) / abs(v - u), -l1 / abs(v), -l2 / abs(u)) * abs(area)
    return l1, l2, away


def _descend(c, u, v, r0, straight, start_at):
    """Return the parameters after Newton's method, and whether it converged."""
    l1, l2 = straight
    for _ in range(STEPS):
        l1, l2 = start_at(l1, l2)
        h1, h2 = _step(c, u, v, r0, l1, l2)
        l1, l2 = l1 + h1, l2 + h2
        if abs(h1) + abs(h2) < 1e-8:  # the error after the step is about its square
            return l1, l2, True
    return l1, l2, False


def _projected(u, v, l1, l2):
    """Return the parameters of the closest point of the straight triangle."""
    if l1 >= 0 and l2 >= 0 and l1 + l2 <= 1:
        return l1, l2

    def share(a, b):
        dot = a.real * b.real + a.imag * b.imag
        return min(max(dot / (b.real * b.real + b.imag * b.imag), 0.0), 1.0)

    z = l1 * u + l2 * v
    third = share(z - u, v - u)
    starts = [(share(z, u), 0.0), (0.0, share(z, v)), (1 - third, third)]
    return min(starts, key=lambda start: np.hypot(*_parts(z - (start[0] * u + start[1] * v))))


def _parts(z):
    return z.real, z.imag


def _pulled_in(l1, l2):
    """Return parameters with no barycentric coordinate below -BESIDE."""
    l0 = max(1 - l1 - l2, -BESIDE)
    l1, l2 = max(l1, -BESIDE), max(l2, -BESIDE)
    total = l0 + l1 + l2
    return l1 / total, l2 / total


def _step(c, u, v, r0, l1, l2):
    """Return the step of Newton's method from given parameters."""
    l0 = 1 - l1 - l2
    r = r0 - (l1 * u + l2 * v + 2 * (l1 * l2 * c[3] + l2 * l0 * c[4] + l0 * l1 * c[5]))
    a = u + 2 * ((l0 - l1) * c[5] + l2 * (c[3] - c[4]))
    b = v + 2 * ((l0 - l2) * c[4] + l1 * (c[3] - c[5]))
    area = a.real * b.imag - a.imag * b.real
    return (r.real * b.imag - r.imag * b.real) / area, (a.real * r.imag - a.imag * r.real) / area


def _evaluate(patches, corners, triangle, place, start, stop, out):
    for i in range(start, stop):
        t = triangle[i]
        if t < 0:
            continue
        l0, l1, l2 = place[i, 0], place[i, 1], place[i, 2]
        c, w0 = patches[t], corners[t, 0]
        u, v = corners[t, 1] - w0, corners[t, 2] - w0
        e1, e2 = c[1] - c[0], c[2] - c[0]
        out[0, i] = c[0] + (l1 * e1 + l2 * e2 + 2 * (l1 * l2 * c[3] + l2 * l0 * c[4] + l0 * l1 * c[5]))
        out[1, i] = w0 + (l1 * u + l2 * v)
        a = e1 + 2 * ((l0 - l1) * c[5] + l2 * (c[3] - c[4]))
        b = e2 + 2 * ((l0 - l2) * c[4] + l1 * (c[3] - c[5]))
        half = 0.5 / (u.real * v.imag - u.imag * v.real)
        out[2, i] = complex(0, half) * (a * v.conjugate() - b * u.conjugate())
        out[3, i] = complex(0, half) * (b * u - a * v)


def _shrink(corners, most, flat, sides, bulge):
    """Shrink the curvature of triangles that are not flat, in place, until all deviate by at most `most` (m,)."""
    active, touched, rounds, go = np.ones(bulge.size, np.bool_), np.zeros(bulge.size, np.bool_), 0, True
    while go:
        go, rounds = False, rounds + 1
        for t in range(len(sides)):
            a, b, c = sides[t]
            if flat[t] or not (active[a] or active[b] or active[c]):
                continue
            if not _deviation(corners[t], bulge[a], bulge[b], bulge[c]) <= most[t]:
                touched[a] = touched[b] = touched[c] = go = True
        for e in range(bulge.size):
            if touched[e]:
                bulge[e] *= SHRINK if rounds % ROUNDS else 0.0
            active[e], touched[e] = touched[e], False


def _deviation(corners, d0, d1, d2):
    """Return the largest deviation of a patch's derivative from its triangle's, relative to that; it is attained at a
    corner, since the derivative is linear.
    """
    x, y, z = corners
    u, v = y - x, z - x
    worst = 0.0
    for du, dv in ((2 * d2, 2 * d1), (-2 * d2, 2 * (d0 - d2)), (2 * (d0 - d1), -2 * d1)):
        p, q = (
            du * v.conjugate() - dv * u.conjugate(),
            dv * u - du * v,
        )  # for the linear map that takes u to du, v to dv
        worst = max(worst, abs(p) + abs(q))
    return worst / (2 * abs(_cross(u, v)))


def _cross(a, b):
    return a.real * b.imag - a.imag * b.real


def _flood(widest, beside, clearance, label, following, last, count, reached):
    """Compute the width of the widest path from the first triangle of `widest` to each triangle, by Kruskal's method.

    Triangles are added in order of clearance. Sheets grow together; the triangle that connects a sheet with that of the
    first triangle determines its width.

    Args:
        widest: (k,) the triangles.
        beside: (m, 3) the neighbours of each.
        clearance: (m,) the clearance of each.
        label, following, last, count: (m,) written: the sheet of each triangle, the next triangle of the sheet, the
            last triangle and the number of triangles of each sheet.
        reached: (m,) initially negative; written.
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
            if b == widest[0] or (a != widest[0] and count[b] > count[a]):  # the smaller sheet is relabelled
                a, b = b, a
            first = a == widest[0]
            following[last[a]], last[a], count[a] = b, last[b], count[a] + count[b]
            v = b
            while v >= 0:
                label[v] = a
                if first:
                    reached[v] = clearance[t]
                v = following[v]


def _bends(faces, w, z_w, z_wbar, out):
    for t in range(faces.shape[0]):
        worst = 0.0
        for k in range(3):
            a, b = faces[t, k], faces[t, (k + 1) % 3]
            e = w[b] - w[a]
            off = abs((z_w[b] - z_w[a]) * e + (z_wbar[b] - z_wbar[a]) * e.conjugate()) / 8
            worst = max(worst, off) if off == off else np.inf
        out[t] = worst


def _bounds(polygon, edge, rise, middle, half, slopes, out):
    """Compute for each piece |Φ″| + |Ψ″| at its centre, R of both, the sums in f_z and f_z̄, and whether a vertex lies
    on it; `slopes` (m, p) are the derivatives of the densities' maps there.
    """
    n, two_densities = polygon.size, rise.shape[0] > 1
    for p in range(middle.size):
        m, r = middle[p], half[p]
        second0, second1 = 0j, 0j
        bound, terms, error = 0.0, 0.0, 0.0
        a = polygon[0] - m
        far_a = abs(a)
        for j in range(n):
            b = polygon[(j + 1) % n] - m
            far_b = abs(b)
            if not min(far_a, far_b) > r:
                error = 1.0
                break
            # `bent` is ρ_j in the formulas above, without the slope at the centre, which adds nothing to Φ″
            inverse = 1 / (a * b)
            bent = rise[0, j] - slopes[0, p] * edge[j]
            second0 += bent * inverse
            size, steep = abs(bent), abs(rise[0, j])
            if two_densities:
                bent = rise[1, j] - slopes[1, p] * edge[j]
                second1 += bent * inverse
                size += abs(bent)
                steep += abs(rise[1, j])
            product = (far_a - r) * (far_b - r)
            bound += size * (far_a + far_b - 2 * r) / (product * product)
            terms += steep * min(4.0 / abs(edge[j]), 1.0 / max(far_a, far_b))
            a, far_a = b, far_b
        out[0, p] = (abs(second0) + abs(second1)) / (2 * math.pi)
        out[1, p] = bound / (2 * math.pi)
        out[2, p] = terms / (2 * math.pi)
        out[3, p] = error
