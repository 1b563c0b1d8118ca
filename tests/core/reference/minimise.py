"""Cholesky factors, the energy, sliding vertices and Newton's method in the plane, which takes its line search from the
core.
"""

import numpy as np

from iccm.balanced.minimise.sliding import FREE, HELD, SLIDING, Rail
from tests.core.line_search import line_search

VOID, UNTANGLING_AREA = 1e-3, 0.5
SHARE_OF_GAP, SAME_PLACE = 0.9, 1e-8
SHARE_OF_FLIP, ARMIJO, LONGEST = 0.95, 1e-5, 0.5
SHARE_WHILE_MOVING, GROWTH = 0.9, 1.5
CRAWL, CRAWLING, LONGER = 0.03, 5, 1.1
REGULAR, SHORT, LONG, DAMPED = 1e-9, 0.1, 0.5, 1e-4


def _assemble(system, matrix, gradient, front, values, place, panel, tall):
    """Add a front's part of the matrix and of the gradient to its columns, and record the positions of its rows."""
    fronts = system.fronts
    first, end = fronts.starts[front], fronts.starts[front + 1]
    for c in range(first, end):
        place[c] = 2 * (c - first)
    row = 2 * (end - first)
    for p in range(fronts.beyond_starts[front], fronts.beyond_starts[front + 1]):
        place[fronts.beyond[p]] = row
        row += 2
    for c in range(first, end):
        column, g = panel + place[c] * tall, gradient[system.order[c]]
        for p in range(system.starts[c], system.starts[c + 1]):
            slot = column + place[system.columns[p]]
            values[slot] = matrix[p, 0]
            values[slot + 1] = matrix[p, 1]
            values[slot + tall] = matrix[p, 2]
            values[slot + tall + 1] = matrix[p, 3]
        values[column + tall - 1], values[column + 2 * tall - 1] = g.real, g.imag


def _extend_add(fronts, child, values, place, source, panel, tall, pivots, update):
    """Add a child's update to the columns and the update of its parent's front."""
    beyond = fronts.beyond[fronts.beyond_starts[child] : fronts.beyond_starts[child + 1]]
    size = 2 * beyond.size + 1
    for p in range(beyond.size):
        column = place[beyond[p]]
        for half in range(2):
            left = values[source + (2 * p + half) * size : source + (2 * p + half + 1) * size]
            goal = panel + (column + half) * tall
            if column >= pivots:
                goal = update + (column - pivots + half) * (tall - pivots) - pivots
            for q in range(p, beyond.size):
                row = goal + place[beyond[q]]
                values[row] += left[2 * q]
                values[row + 1] += left[2 * q + 1]
            values[goal + tall - 1] += left[size - 1]


def _column(panel, tall, pivots, update, c):
    """Return the position of the diagonal entry of a front's column c: among its own columns, or in its update."""
    return panel + c * (tall + 1) if c < pivots else update + (c - pivots) * (tall - pivots + 1)


def _rank_8(values, block, begin, panel, tall, pivots, update):
    """Subtract the product of the eight columns at `block` with themselves from the lower triangle of all columns from
    `begin`.
    """
    for c in range(begin, tall - 1):
        goal, start, count = _column(panel, tall, pivots, update, c), block + c, tall - c
        x = values[goal : goal + count]
        a = values[start : start + count]
        b = values[start + 1 * tall : start + 1 * tall + count]
        c_ = values[start + 2 * tall : start + 2 * tall + count]
        d = values[start + 3 * tall : start + 3 * tall + count]
        e = values[start + 4 * tall : start + 4 * tall + count]
        f = values[start + 5 * tall : start + 5 * tall + count]
        g = values[start + 6 * tall : start + 6 * tall + count]
        h = values[start + 7 * tall : start + 7 * tall + count]
        a0, b0, c0, d0, e0, f0, g0, h0 = a[0], b[0], c_[0], d[0], e[0], f[0], g[0], h[0]
        for i in range(count):
            x[i] -= (
                a0 * a[i] + b0 * b[i] + c0 * c_[i] + d0 * d[i] + e0 * e[i] + f0 * f[i] + g0 * g[i] + h0 * h[i]
            )


def _rank_2(values, block, begin, panel, tall, pivots, update):
    """Do the same as `_rank_8` for two columns; four at once take as long as twice two."""
    for c in range(begin, tall - 1):
        goal, start, count = _column(panel, tall, pivots, update, c), block + c, tall - c
        x = values[goal : goal + count]
        a = values[start : start + count]
        b = values[start + tall : start + tall + count]
        a0, b0 = a[0], b[0]
        for i in range(count):
            x[i] -= a0 * a[i] + b0 * b[i]


def _eliminate(values, panel, tall, pivots, update):
    """Eliminate the `pivots` columns of a front; return False if they are not positive definite."""
    begin = 0
    while begin < pivots:
        wide = 8 if pivots - begin >= 8 else 2
        block = panel + begin * tall
        for j in range(wide):
            column = block + j * tall
            x = values[column + begin + j : column + tall]
            for k in range(j):
                a = values[block + k * tall + begin + j : block + (k + 1) * tall]
                a0 = a[0]
                for i in range(x.size):
                    x[i] -= a0 * a[i]
            if not x[0] > 0:
                return False
            scale = 1 / np.sqrt(x[0])
            for i in range(x.size):
                x[i] *= scale
        begin += wide
        if wide == 8:
            _rank_8(values, block, begin, panel, tall, pivots, update)
        else:
            _rank_2(values, block, begin, panel, tall, pivots, update)
    return True


def factorise(system, matrix, gradient, factor):
    """Compute the factor of a matrix and forward-substitute a gradient; return False if the matrix is not positive
    definite.

    Args:
        system: the pattern of the matrix.
        matrix: (e, 4) blocks xx, xy, yx, yy of the upper triangle.
        gradient: (n,) complex, x + iy of each vertex.
        factor: written.
    """
    fronts, values, place = system.fronts, factor.values, factor.place
    waiting, sources, top = factor.waiting, factor.sources, 0
    number = fronts.parents.size
    sources[0] = fronts.panels[number]
    for front in range(number):
        pivots = 2 * (fronts.starts[front + 1] - fronts.starts[front])
        size = 2 * (fronts.beyond_starts[front + 1] - fronts.beyond_starts[front]) + 1
        panel, tall = fronts.panels[front], pivots + size
        update = sources[top]
        values[panel : panel + pivots * tall] = 0.0
        values[update : update + size * size] = 0.0
        _assemble(system, matrix, gradient, front, values, place, panel, tall)
        # in postorder, the updates of a front's children are on top of the stack
        while top > 0 and fronts.parents[waiting[top - 1]] == front:
            top -= 1
            _extend_add(fronts, waiting[top], values, place, sources[top], panel, tall, pivots, update)
        if not _eliminate(values, panel, tall, pivots, update):
            return False
        goal = sources[top]
        # its own update moves down over those that have been added
        if goal < update:
            goals, left = values[goal : goal + size * size], values[update : update + size * size]
            for i in range(size * size):
                goals[i] = left[i]
        if size > 1:
            waiting[top] = front
            top += 1
            sources[top] = goal + size * size
    return True


def forward_substitute(system, gradient, factor):
    """Replace the gradient that was factorised with H by another gradient g (n,): compute L⁻¹ g."""
    fronts, values, left = system.fronts, factor.values, factor.left
    for row in range(system.order.size):
        g = gradient[system.order[row]]
        left[2 * row], left[2 * row + 1] = g.real, g.imag
    for front in range(fronts.parents.size):
        first, end = fronts.starts[front], fronts.starts[front + 1]
        pivots, beyond = (
            2 * (end - first),
            fronts.beyond[fronts.beyond_starts[front] : fronts.beyond_starts[front + 1]],
        )
        tall, panel = pivots + 2 * beyond.size + 1, fronts.panels[front]
        for j in range(pivots):
            column = panel + j * tall
            value = left[2 * first + j] / values[column + j]
            values[column + tall - 1] = value
            for i in range(j + 1, pivots):
                left[2 * first + i] -= values[column + i] * value
            for p in range(beyond.size):
                row = column + pivots + 2 * p
                left[2 * beyond[p]] -= values[row] * value
                left[2 * beyond[p] + 1] -= values[row + 1] * value


def back_substitute(system, factor, step):
    """Compute the step -H⁻¹ g (n,), complex, for the factor of H and g: the x with Lᵀ x + L⁻¹ g = 0."""
    fronts, part, values = system.fronts, factor.part, factor.values
    for front in range(fronts.parents.size - 1, -1, -1):
        first, end = fronts.starts[front], fronts.starts[front + 1]
        pivots, panel_end = 2 * (end - first), fronts.panels[front + 1]
        tall = pivots
        for p in range(fronts.beyond_starts[front], fronts.beyond_starts[front + 1]):
            value = step[system.order[fronts.beyond[p]]]
            part[tall], part[tall + 1] = value.real, value.imag
            tall += 2
        part[tall] = 1.0  # for the row of L⁻¹ g
        tall += 1
        for j in range(pivots - 1, -1, -1):
            later, column = part[j + 1 : tall], values[panel_end + j + 1 - tall : panel_end]
            sums, remainder, whole = [0.0] * 4, 0.0, later.size // 4 * 4
            for i in range(whole):
                sums[i % 4] += later[i] * column[i]
            for i in range(whole, later.size):
                remainder += later[i] * column[i]
            part[j] = -((sums[0] + sums[2]) + (sums[1] + sums[3]) + remainder) / values[panel_end + j - tall]
            panel_end -= tall
        for c in range(first, end):
            step[system.order[c]] = complex(part[2 * (c - first)], part[2 * (c - first) + 1])


def cross(a, b):
    """Return the determinant of two vectors of the plane, complex numbers."""
    return a.real * b.imag - a.imag * b.real


def dot(a, b):
    """Return the scalar product of two vectors of the plane, complex numbers."""
    return a.real * b.real + a.imag * b.imag


def twice_area(z, a, b, c):
    """Return twice the signed area of the triangle of vertices a, b, c of z."""
    return cross(z[b] - z[a], z[c] - z[a])


def located(knots, s):
    """Return the edge of a closed polyline that contains arclength s, and the arclength from that edge's start.

    Args:
        knots: (e + 1,) arclengths of the vertices, from 0 to the length.
        s: any arclength, wrapped around the curve.
    """
    length = knots[-1]
    s -= np.floor(s / length) * length
    edge, end = 0, knots.size - 1
    while end - edge > 1:  # a bisection, since NumPy's compiles slowly
        middle = (edge + end) // 2
        if knots[middle] <= s:
            edge = middle
        else:
            end = middle
    return edge, s - knots[edge]


def move(start, step, share, result):
    """Compute start + share · step, in a loop, since array expressions compile slowly."""
    for v in range(start.size):
        result[v] = start[v] + share * step[v]


def power(base, exponent):
    """Return base ** exponent, without a logarithm for the most frequent exponents."""
    if exponent == 1.0:
        return base
    if exponent == 2.0:
        return base * base
    if exponent == 0.0:
        return 1.0
    return base**exponent


def density(p, d, theta, q, share):
    """Return W for one triangle with d > 0; the image's area has the weight `share`, ½ if map and inverse count
    equally.
    """
    core = p / d * power(0.5 * (d + 1 / d), theta)
    return core * power(core, q - 1) * (1 - share + share * d)


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


def void_derivatives(p, d, forward):
    """Return the density of a virtual triangle, with the derivatives of `density_derivatives`.

    It is d + VOID p/d, the area of its image and a barrier; if not `forward`, the same for the inverse map, whose p and
    d are given.
    """
    if not forward:
        return 1 + VOID * p, VOID, 0.0, 0.0, 0.0, 0.0
    shape = VOID / d
    return d + shape * p, shape, 1 - shape * p / d, 0.0, -shape / d, 2 * shape * p / (d * d)


def untangling_derivatives(p, d, epsilon):
    """Return a density that is finite for folded triangles, with the derivatives of `density_derivatives`.

    (p + ½ (1 + d²)/2·2) / (1 + ½) with d in the denominators replaced by (d + √(ε² + d²))/2 (Garanzha et al.,
    *Foldover-free maps in 50 lines of code*, 2021).
    """
    root = np.sqrt(epsilon * epsilon + d * d)
    x = 0.5 * (d + root) if d > 0 else 0.5 * epsilon * epsilon / (root - d)
    x1, x2 = x / root, 0.5 * epsilon * epsilon / (root * root * root)
    area, share = (d * d + 1) / (2 * x), 1 / (1 + UNTANGLING_AREA)
    area1 = d / x - (d * d + 1) * x1 / (2 * x * x)
    inverse2 = 2 * x1 * x1 / (x * x * x) - x2 / (x * x)  # second derivative of 1/x
    area2 = 1 / x - 2 * d * x1 / (x * x) + 0.5 * (d * d + 1) * inverse2
    return (
        share * (p / x + UNTANGLING_AREA * area),
        share / x,
        share * (UNTANGLING_AREA * area1 - p * x1 / (x * x)),
        0.0,
        -share * x1 / (x * x),
        share * (p * inverse2 + UNTANGLING_AREA * area2),
    )


def hat_gradients(corners, z, gradients, areas):
    """Compute the Wirtinger gradients of the hat functions and the areas of the source's triangles.

    Args:
        corners: (m, 3) triangles of either orientation.
        z: (n,) vertices of the source.
        gradients: (m, 3) complex α, written: f_z = Σ α u and f_z̄ = Σ ᾱ u for values u at the corners.
        areas: (m,) written, positive.
    """
    for t in range(corners.shape[0]):
        a, b, c = z[corners[t, 0]], z[corners[t, 1]], z[corners[t, 2]]
        area = 0.5 * ((b - a).real * (c - a).imag - (b - a).imag * (c - a).real)
        scale = complex(0.0, -0.25 / area)
        gradients[t, 0] = scale * (c - b).conjugate()
        gradients[t, 1] = scale * (a - c).conjugate()
        gradients[t, 2] = scale * (b - a).conjugate()
        areas[t] = abs(area)


def wirtinger(corners, gradients, u, t):
    """Return f_z and f_z̄ on triangle t."""
    a, b = 0j, 0j
    for k in range(3):
        value, alpha = u[corners[t, k]], gradients[t, k]
        a += alpha * value
        b += alpha.conjugate() * value
    return a, b


def total(rest_shapes, u, objective):
    """Return the energy of the images u (n,); infinite if a triangle is folded, unless epsilon > 0 (untangling)."""
    theta, q, share, epsilon = objective.theta, objective.q, objective.share, objective.epsilon
    corners, gradients, weights = rest_shapes.corners, rest_shapes.gradients, rest_shapes.weights
    energy = 0.0
    for t in range(corners.shape[0]):
        a, b = wirtinger(corners, gradients, u, t)
        aa, bb = dot(a, a), dot(b, b)
        if epsilon > 0:
            energy += abs(weights[t]) * untangling_derivatives(aa + bb, aa - bb, epsilon)[0]
        elif aa > bb and rest_shapes.aims.size > 0 and rest_shapes.aims[t] != 0:
            a -= rest_shapes.aims[t]
            energy += weights[t] * (dot(a, a) + bb)
        elif aa > bb and weights[t] < 0:
            energy -= weights[t] * void_derivatives(aa + bb, aa - bb, objective.forward)[0]
        elif aa > bb:
            energy += weights[t] * density(aa + bb, aa - bb, theta, q, share)
        else:
            return np.inf
    return energy


def least_determinant(rest_shapes, u):
    """Return the smallest determinant of all triangles."""
    least = np.inf
    for t in range(rest_shapes.corners.shape[0]):
        a, b = wirtinger(rest_shapes.corners, rest_shapes.gradients, u, t)
        least = min(least, dot(a, a) - dot(b, b))
    return least


def _projected(first, second, coupling):
    """Return the three entries of the matrix [[first, coupling], [coupling, second]] with negative eigenvalues set to
    zero.
    """
    middle, determinant = 0.5 * (first + second), first * second - coupling * coupling
    if middle >= 0 and determinant >= 0:
        return first, second, coupling
    radius = np.sqrt(max(middle * middle - determinant, 0.0))
    if not middle + radius > 0:
        return 0.0, 0.0, 0.0
    share, small = 0.5 * (middle + radius) / radius, middle - radius
    return share * (first - small), share * (second - small), share * coupling


def _add(matrix, slot, r, s, x, y, a, b):
    """Add the block r aᵀ + s bᵀ + (i x)(i a)ᵀ + (i y)(i b)ᵀ of complex numbers regarded as vectors."""
    matrix[slot, 0] += r.real * a.real + s.real * b.real + x.imag * a.imag + y.imag * b.imag
    matrix[slot, 1] += r.real * a.imag + s.real * b.imag - x.imag * a.real - y.imag * b.real
    matrix[slot, 2] += r.imag * a.real + s.imag * b.real - x.real * a.imag - y.real * b.imag
    matrix[slot, 3] += r.imag * a.imag + s.imag * b.imag + x.real * a.real + y.real * b.real


def assemble(rest_shapes, u, objective, matrix, gradient):
    """Return the energy at u; compute its gradient and projected Hessian.

    Args:
        rest: triangles at rest.
        u: (n,) images, without folds unless epsilon > 0.
        objective: the energy to minimise.
        matrix: (e, 4) blocks of the upper triangle, written.
        gradient: (n,) complex, x + iy, written.
    """
    theta, q, share, epsilon = objective.theta, objective.q, objective.share, objective.epsilon
    corners, slots, gradients, weights = (
        rest_shapes.corners,
        rest_shapes.slots,
        rest_shapes.gradients,
        rest_shapes.weights,
    )
    for p in range(matrix.shape[0]):
        matrix[p, 0] = matrix[p, 1] = matrix[p, 2] = matrix[p, 3] = 0.0
    for v in range(gradient.size):
        gradient[v] = 0j
    energy = 0.0
    for t in range(corners.shape[0]):
        a, b = wirtinger(corners, gradients, u, t)
        aimed = epsilon == 0 and rest_shapes.aims.size > 0 and rest_shapes.aims[t] != 0
        if aimed:  # quadratic: its derivatives by a - c and b are those of p
            a -= rest_shapes.aims[t]
        aa, bb, weight = dot(a, a), dot(b, b), abs(weights[t])
        if aimed:
            w, w_p, w_d, w_pp, w_pd, w_dd = aa + bb, 1.0, 0.0, 0.0, 0.0, 0.0
        elif epsilon > 0:
            w, w_p, w_d, w_pp, w_pd, w_dd = untangling_derivatives(aa + bb, aa - bb, epsilon)
        elif weights[t] < 0:
            w, w_p, w_d, w_pp, w_pd, w_dd = void_derivatives(aa + bb, aa - bb, objective.forward)
        else:
            w, w_p, w_d, w_pp, w_pd, w_dd = density_derivatives(aa + bb, aa - bb, theta, q, share)
        energy += weight * w
        size_a, size_b = np.sqrt(aa), np.sqrt(bb)
        # directions of a and b; if one vanishes, any direction will do, since the derivatives along it vanish, too
        unit_a = a * (1 / size_a) if size_a > 1e-140 else 1 + 0j
        unit_b = b * (1 / size_b) if size_b > 1e-140 else 1 + 0j
        # the chain rule for |a| and |b|, p = |a|² + |b|² and d = |a|² - |b|²: slopes over |a| and |b|, which are also
        # the tangential eigenvalues, then the 2 × 2 block of the radial directions
        along_a, along_b = 2 * weight * (w_p + w_d), 2 * weight * (w_p - w_d)
        radial_a, radial_b, coupling = _projected(
            along_a + 4 * weight * (w_pp + 2 * w_pd + w_dd) * aa,
            along_b + 4 * weight * (w_pp - 2 * w_pd + w_dd) * bb,
            4 * weight * (w_pp - w_dd) * size_a * size_b,
        )
        around_a, around_b = max(along_a, 0.0), max(along_b, 0.0)
        along_a, along_b = along_a * size_a, along_b * size_b
        # in terms of the corners' values: a = Σ α u and b = Σ ᾱ u map the eigenvectors to multiples of the hats'
        # gradients
        pair = 0
        for k in range(3):
            alpha = gradients[t, k]
            a, b = unit_a * alpha.conjugate(), unit_b * alpha
            gradient[corners[t, k]] += along_a * a + along_b * b
            r, s = radial_a * a + coupling * b, coupling * a + radial_b * b
            x, y = around_a * a, around_b * b
            for m in range(k, 3):
                alpha = gradients[t, m]
                _add(matrix, slots[t, pair], r, s, x, y, unit_a * alpha.conjugate(), unit_b * alpha)
                pair += 1
    return energy


def rail_of(rails, v):
    """Return the curve of constrained vertex v."""
    a, b = rails.starts[rails.rail_index[v]], rails.starts[rails.rail_index[v] + 1]
    return Rail(rails.knots[a[0] : b[0]], rails.vertices[a[1] : b[1]], rails.corners[a[2] : b[2]])


def point_at(rail, s):
    """Return the point at arclength s."""
    edge, along = located(rail.knots, s)
    share = min(along / (rail.knots[edge + 1] - rail.knots[edge]), 1.0)
    end = rail.vertices[(edge + 1) % rail.vertices.size]
    return rail.vertices[edge] + share * (end - rail.vertices[edge])


def tangent(rail, s):
    """Return the unit tangent at arclength s."""
    edge, _ = located(rail.knots, s)
    step = rail.vertices[(edge + 1) % rail.vertices.size] - rail.vertices[edge]
    return step * (1 / abs(step))


def way_to_corners(rail, s):
    """Return whether s is on a corner, and the distances (negative, positive) to the corners behind and ahead."""
    length, corners = rail.knots[-1], rail.corners
    count = corners.size
    if count == 0:
        return False, -length, length
    tolerance = SAME_PLACE * length
    s -= np.floor(s / length) * length
    k, end = 0, count
    while k < end:  # the first corner not before s, by a bisection, since NumPy's compiles slowly
        middle = (k + end) // 2
        if corners[middle] < s - tolerance:
            k = middle + 1
        else:
            end = middle
    behind = (corners[k - 1] if k > 0 else corners[count - 1] - length) - s
    on = k < count and corners[k] <= s + tolerance
    k += 1 if on else 0
    ahead = (corners[k] if k < count else corners[k - count] + length) - s
    return on or behind > -tolerance or ahead < tolerance, behind, ahead


def gap_ahead(border, tau, v):
    """Return the arclength from outline vertex v to the next one."""
    return tau[border.following[v]] - tau[v] + border.laps[v]


def border_energy(border, tau):
    """Return the outline's energy; infinite if two vertices have changed places."""
    energy = 0.0
    for v in range(tau.size):
        gap, span = gap_ahead(border, tau, v), border.spans[v]
        if gap <= 0:
            return np.inf
        energy += 0.5 * border.stiffness[v] * (gap * gap / span + span * span / gap)
    return energy


def border_derivatives(border, tau, slope, curvature):
    """Compute the derivative by each τ and the second derivative by each gap."""
    for v in range(tau.size):
        slope[v] = 0.0
    for v in range(tau.size):
        gap, span, beta = gap_ahead(border, tau, v), border.spans[v], border.stiffness[v]
        pull = 0.5 * beta * (2 * gap / span - span * span / (gap * gap))
        slope[v] -= pull
        slope[border.following[v]] += pull
        curvature[v] = beta * (1 / span + span * span / (gap * gap * gap))


def choose_directions(rails, tau, kinds, gradient, slope, directions, low, high):
    """Compute the directions in which constrained vertices may slide: a unit tangent, or 0 to stay, and limits of the
    step.

    Args:
        rails: the curves that they slide on.
        tau: (c,) arclengths.
        kinds: (c,) HELD, SLIDING or FREE.
        gradient: (n,) of the energy in the plane.
        slope: (c,) of the curves' energy.
        directions: (c,) complex, written.
        low: (c,) most negative step, written.
        high: (c,) largest step, written.
    """
    for v in range(tau.size):
        directions[v], low[v], high[v] = 0j, 0.0, 0.0
        if kinds[v] != SLIDING:
            continue
        rail = rail_of(rails, v)
        nudge = 1e-9 * rail.knots[-1]
        on, behind, ahead = way_to_corners(rail, tau[v])
        forward = tangent(rail, tau[v] + nudge)
        directions[v], low[v], high[v] = forward, behind, ahead
        if not on:
            continue
        backward = tangent(rail, tau[v] - nudge)
        slope_ahead, slope_behind = (
            dot(gradient[v], forward) + slope[v],
            dot(gradient[v], backward) + slope[v],
        )
        low[v] = 0.0
        if tau[v] >= rails.ends[rails.rail_index[v]] - nudge:
            slope_ahead = 0.0
        elif rails.ends[rails.rail_index[v]] < np.inf and tau[v] <= nudge:
            slope_behind = 0.0
        if slope_ahead >= 0 and slope_behind <= 0:
            directions[v], high[v] = 0j, 0.0
        elif slope_ahead >= 0 or slope_behind > -slope_ahead > 0:
            directions[v], low[v], high[v] = backward, behind, 0.0


def restrict(system, kinds, directions, matrix):
    """Rewrite the blocks of constrained vertices: the first unknown is along the direction, missing ones have 1.

    Args:
        system: the pattern.
        kinds: (c,) of the first c vertices; FREE ones keep their blocks.
        directions: (c,) of these vertices; 0 for a fixed one.
        matrix: (e, 4), changed in place.
    """
    count = directions.size
    for k in range(system.order.size):
        v = system.order[k]
        for p in range(system.starts[k], system.starts[k + 1]):
            w = system.order[system.columns[p]]
            if v < count and kinds[v] != FREE:
                for b in range(2):
                    matrix[p, b] = directions[v].real * matrix[p, b] + directions[v].imag * matrix[p, 2 + b]
                    matrix[p, 2 + b] = 0.0
            if w < count and kinds[w] != FREE:
                for b in range(0, 4, 2):
                    matrix[p, b] = directions[w].real * matrix[p, b] + directions[w].imag * matrix[p, b + 1]
                    matrix[p, b + 1] = 0.0
    for v in range(directions.size):
        if kinds[v] == FREE:
            continue
        matrix[system.diagonal[v], 3] = 1.0
        if directions[v] == 0:
            matrix[system.diagonal[v], 0] = 1.0


def stiffen(system, border, directions, curvature, matrix):
    """Add the outline's second derivatives to a restricted matrix."""
    for v in range(directions.size):
        w = border.following[v]
        if directions[v] != 0:
            matrix[system.diagonal[v], 0] += curvature[v]
        if directions[w] != 0:
            matrix[system.diagonal[w], 0] += curvature[v]
        if directions[v] != 0 and directions[w] != 0:
            matrix[system.ahead[v], 0] -= curvature[v]


def _remaining(kinds, goals, u, displacements):
    """Compute the displacements (n,) of fixed vertices to their goals; return whether there are any."""
    moving = False
    for v in range(displacements.size):
        displacements[v] = 0j
    for v in range(goals.size):
        if kinds[v] == HELD and goals[v] != u[v]:
            displacements[v], moving = goals[v] - u[v], True
    return moving


def add_product(system, matrix, displacements, gradient):
    """Add the matrix times the displacements (n,) to the gradient (n,), both x + iy of each vertex."""
    for k in range(system.order.size):
        row = system.order[k]
        for p in range(system.starts[k], system.starts[k + 1]):
            column = system.order[system.columns[p]]
            if displacements[column] != 0:
                x, y = displacements[column].real, displacements[column].imag
                gradient[row] += complex(
                    matrix[p, 0] * x + matrix[p, 1] * y, matrix[p, 2] * x + matrix[p, 3] * y
                )
            if row != column and displacements[row] != 0:
                x, y = displacements[row].real, displacements[row].imag
                gradient[column] += complex(
                    matrix[p, 0] * x + matrix[p, 2] * y, matrix[p, 1] * x + matrix[p, 3] * y
                )


def along_directions(kinds, directions, gradient):
    """Rewrite the gradient of constrained vertices along their directions, 0 for fixed ones."""
    for v in range(directions.size):
        if kinds[v] != FREE:
            gradient[v] = complex(dot(gradient[v], directions[v]), 0.0)


def constrain(pattern, constraints, u, tau, space):
    """Rewrite the derivatives by all vertices' positions as those by the free variables.

    These are positions of free vertices, and arclengths along curves. Returns whether fixed vertices have to move to
    their goals.

    Args:
        pattern: of the Hessian.
        constraints: the constraints of the first c vertices.
        u: (n,) positions.
        tau: (c,) arclengths.
        space: matrix and gradient are rewritten, and what a step along the curves needs is computed.
    """
    matrix, gradient, slope, directions = space.matrix, space.gradient, space.slope, space.directions
    rails, border, kinds = constraints.rails, constraints.border, constraints.kinds
    border_derivatives(border, tau, slope, space.curvature)
    choose_directions(rails, tau, kinds, gradient, slope, directions, space.low, space.high)
    # the whole displacement of fixed vertices is imposed: the others' gradient is that at its end, g + H way
    moving = _remaining(kinds, constraints.goals, u, space.to_goals)
    if moving:
        add_product(pattern, matrix, space.to_goals, gradient)
    restrict(pattern, kinds, directions, matrix)
    stiffen(pattern, border, directions, space.curvature, matrix)
    along_directions(kinds, directions, gradient)
    for v in range(directions.size):
        if directions[v] != 0:
            gradient[v] += slope[v]
    return moving


def release(constraints, space):
    """Rewrite the step of constrained vertices as one in the plane, and compute their steps along curves; vertices on a
    corner do not leave it to the wrong side.
    """
    step, slide = space.step, space.slide
    for v in range(slide.size):
        if constraints.kinds[v] == FREE:
            slide[v] = 0.0
            continue
        slide[v] = step[v].real
        if space.low[v] == 0:
            slide[v] = max(slide[v], 0.0)
        if space.high[v] == 0:
            slide[v] = min(slide[v], 0.0)
        step[v] = slide[v] * space.directions[v] + space.to_goals[v]


def gap_limit(border, tau, slide, most):
    """Return the largest share of the step, at most `most`, that keeps the outline's vertices well in order."""
    for v in range(tau.size):
        closing = slide[v] - slide[border.following[v]]
        if closing > 0:
            most = min(most, SHARE_OF_GAP * gap_ahead(border, tau, v) / closing)
    return most


def moved(constraints, u, tau, t, space):
    """Compute new_u and new_tau after a share t of the step; a whole step takes fixed vertices to their goals."""
    new_u, new_tau = space.new_u, space.new_tau
    move(u, space.step, t, new_u)
    for v in range(tau.size):
        s = min(max(t * space.slide[v], space.low[v]), space.high[v])
        new_tau[v] = tau[v] + s
        if s != 0:
            new_u[v] = point_at(rail_of(constraints.rails, v), new_tau[v])
        if t == 1.0 and constraints.kinds[v] == HELD:
            new_u[v] = constraints.goals[v]


def _moment(upright, u):
    """Return the moment S."""
    moment = 0j
    for v in range(u.size):
        moment += upright.moments[v] * u[v]
    return moment


def rotation_cost(weight, cosine):
    """Return the factor of the energy for a rotation with this cosine, at q = 1."""
    return 1 + 0.5 * weight * (1 - cosine)


def rotation_factor(upright, u, q):
    """Return the factor for the energy of images u (n,); infinite if they have no mean rotation."""
    if upright.weight == 0:
        return 1.0
    moment = _moment(upright, u)
    size = abs(moment)
    return rotation_cost(upright.weight, moment.real / size) ** q if size > 0 else np.inf


def rotation_derivatives(upright, u, q, turning):
    """Return the first and second derivative of the factor's logarithm by the rotation; compute the rotation's
    gradient.

    Args:
        upright: the cost.
        u: (n,) images.
        q: power.
        turning: (n,) complex, x + iy, written: the derivative of the rotation by each vertex.

    Returns:
        The first derivative, and the second one if it is positive, else 0.
    """
    moment = _moment(upright, u)
    if moment == 0:  # a map so squeezed that its rotation is lost in rounding
        for v in range(u.size):
            turning[v] = 0j
        return 0.0, 0.0
    inverse = 1 / moment
    for v in range(u.size):
        share = upright.moments[v] * inverse
        turning[v] = complex(share.imag, share.real)
    cosine, half = moment.real / abs(moment), 0.5 * upright.weight
    factor = rotation_cost(upright.weight, cosine)
    slope = half * moment.imag / abs(moment) / factor
    return q * slope, q * max(half * cosine / factor - slope * slope, 0.0)


def bend_step(turning, answer, curvature, step):
    """Turn the step -H⁻¹g into the one for H + c t tᵀ, where t is the rotation's gradient (Sherman and Morrison).

    Args:
        turning: (n,) t.
        answer: (n,) -H⁻¹t.
        curvature: c.
        step: (n,) changed in place.
    """
    along, across = 0.0, 0.0
    for v in range(step.size):
        along += dot(turning[v], step[v])
        across += dot(turning[v], answer[v])
    share = curvature * along / (1 - curvature * across)
    for v in range(step.size):
        step[v] += share * answer[v]


def largest_step(faces, u, step):
    """Return the smallest positive t at which a triangle of u + t · step has no area; 1e9 if there is none."""
    best = 1e9
    for t in range(faces.shape[0]):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        e, f, de, df = u[b] - u[a], u[c] - u[a], step[b] - step[a], step[c] - step[a]
        quadratic, linear, area = cross(de, df), cross(e, df) + cross(de, f), cross(e, f)
        if quadratic >= 0 and linear >= 0:
            continue
        discriminant = linear * linear - 4 * quadratic * area
        if discriminant < 0:
            continue
        r = -0.5 * (linear + (np.sqrt(discriminant) if linear >= 0 else -np.sqrt(discriminant)))
        for root in (
            r / quadratic,
            area / r,
        ):  # infinite or NaN if a coefficient vanishes: no comparison holds
            if 0 < root < best:
                best = root
    return best


def regularise(system, matrix, share):
    """Add a share of the mean diagonal to it."""
    mean = 0.0
    for slot in system.diagonal:
        mean += 0.5 * (matrix[slot, 0] + matrix[slot, 3])
    little = share * mean / system.diagonal.size + 1e-12
    for slot in system.diagonal:
        matrix[slot, 0] += little
        matrix[slot, 3] += little


def descend(system, objective, surface, u, tau, steps, tolerance, reach=np.inf):
    """Take Newton steps until two of them gain less than `tolerance` of the energy each, or fixed vertices are stuck on
    the way to their goals; u and tau are changed in place.

    Args:
        system: the mesh and its constraints.
        objective: the energy to minimise.
        surface: the surface in space that the map goes to (`in_space.SurfaceMap`); None for the plane.
        u: (n,) positions on the moving side, without folds unless epsilon > 0, with sliding vertices on their curves at
            tau.
        tau: (c,) arclengths of the constrained vertices, increasing along each curve.
        steps: largest number of steps.
        tolerance: relative decrease that counts as none.
        reach: how far vertices may move, as the sum over all steps of the root mean square of their displacements.

    Returns:
        The energy, the number of steps, and how many of the last ones gained less than the tolerance.
    """
    pattern, rest_shapes, constraints, space = (
        system.pattern,
        system.rest,
        system.constraints,
        system.workspace,
    )
    border, matrix, gradient, step = constraints.border, space.matrix, space.gradient, space.step
    upright, turning = system.upright, space.turning
    energy, small, crawling, before, damping = np.inf, 0, 0, np.inf, 0.0
    factor, curvature = 1.0, 0.0
    for done in range(steps):
        energy = assemble(rest_shapes, u, objective, matrix, gradient)
        energy += border_energy(border, tau)
        if upright.weight > 0:  # energy and derivatives are those of the product with its second factor
            slope, curvature = rotation_derivatives(upright, u, objective.q, turning)
            for v in range(u.size):
                gradient[v] += energy * slope * turning[v]
            factor = rotation_factor(upright, u, objective.q)
        moving = constrain(pattern, constraints, u, tau, space)
        regularise(pattern, matrix, REGULAR + damping)
        if system.factorised:
            forward_substitute(pattern, gradient, space.factor)
        elif not factorise(pattern, matrix, gradient, space.factor):
            return factor * energy, done, small
        back_substitute(pattern, space.factor, step)
        if curvature > 0:
            along_directions(constraints.kinds, space.directions, turning)
            forward_substitute(pattern, turning, space.factor)
            back_substitute(pattern, space.factor, space.answer)
            bend_step(turning, space.answer, energy * curvature, step)
        decrease = 0.0
        for v in range(u.size):
            decrease += dot(gradient[v], step[v])
        release(constraints, space)
        t, squares = 1.0, 0.0
        for v in range(u.size):
            squares += dot(step[v], step[v])
        displacement = np.sqrt(squares / u.size)
        t_at_reach = reach / displacement
        if objective.epsilon == 0:
            if not moving:
                t = 1 / (1 + max(decrease / energy, -LONGEST))  # decrease < 0: Newton's for log E
            most = SHARE_WHILE_MOVING if moving else SHARE_OF_FLIP
            t = min(t, t_at_reach)
            t = min(gap_limit(border, tau, space.slide, t), most * largest_step(system.faces, u, step))
        energy, decrease = factor * energy, factor * decrease

        def energy_at(share):
            moved(constraints, u, tau, share, space)
            new_energy = border_energy(border, space.new_tau)
            if new_energy < np.inf:
                new_energy += total(rest_shapes, space.new_u, objective)
                new_energy *= rotation_factor(upright, space.new_u, objective.q)
            return new_energy

        def most_at(share, energy=energy, decrease=decrease, moving=moving):
            """Armijo's condition; on the way to goals, the energy may grow."""
            return GROWTH * energy if moving else energy + ARMIJO * share * decrease

        t, new_energy = line_search(t, energy_at, most_at)
        if t == 0:
            return energy, done, small
        for v in range(u.size):
            u[v] = space.new_u[v]
        for v in range(tau.size):
            tau[v] = space.new_tau[v]
        gained = energy - new_energy
        energy -= gained
        reach = reach - t * displacement if t < t_at_reach else 0.0
        if surface is not None:
            if t < SHORT:
                damping = max(10 * damping, DAMPED)
            elif t > LONG:
                damping *= 0.1
        if moving:
            crawling = crawling + 1 if t < min(CRAWL, LONGER * before) else 0
            before = t
            if crawling == CRAWLING:
                return energy, done + 1, small
        else:
            small = small + 1 if gained < tolerance * (energy + gained) else 0
        if small == 2 or reach == 0:
            return energy, done + 1, small
    return energy, steps, small


def quadratic_step(system, u, tau):
    """Go to the minimum of a quadratic energy whose derivatives are in the workspace; u and tau are changed in
    place.
    """
    pattern, constraints, space = system.pattern, system.constraints, system.workspace
    constrain(pattern, constraints, u, tau, space)
    regularise(pattern, space.matrix, REGULAR)
    if not factorise(pattern, space.matrix, space.gradient, space.factor):
        return False
    back_substitute(pattern, space.factor, space.step)
    release(constraints, space)
    moved(constraints, u, tau, 1.0, space)
    u[:], tau[:] = space.new_u, space.new_tau
    return True
