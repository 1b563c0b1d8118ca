"""Cauchy-Green coordinates of a polygon and their derivatives.

Weber, Ben-Chen, Gotsman, *Complex Barycentric Coordinates with Applications to Planar Shape Deformation*,
Eurographics 2009; Segall, Ben-Chen, *Iterative Closest Conformal Maps between Planar Domains*, SGP 2016, Appendix A.

For a counter-clockwise polygon z_0 .. z_{n-1} with A_e = z_{e+1} - z_e and B_j = z_j - z, edge e contributes

    C :  B_{e+1}/A_e · L_e  to column e,   -B_e/A_e · L_e  to column e+1,     L_e = log(B_{e+1} / B_e)
    D :  -L_e/A_e           to column e,    L_e/A_e        to column e+1

each divided by 2πi, so one logarithm per point and edge serves both.
"""

import cmath
import math

import numpy as np

from ..arrays import Complex
from ..jit import NUMPY, kept, kernel
from ..parallel import over_slices

TAU_I = 2j * np.pi
# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
BLOCK_ENTRIES = 1 << 21  # entries of one complex block: 32 MB, a handful of which are alive at a time
SLICE, MANY = 64, 1024  # points a thread takes at a time, of matrices and of jets
FAR = 0.05  # an edge by the sum of the vectors to its ends: the series left out is 1e-16 of what is kept
ON_EDGE = 1e-9  # radians: an edge seen under an angle this close to -π is one the point lies on
ROUNDING = 4e-16
"""Relative error of a coordinate, which turns the angle by itself over the distance to an end."""
MOST_SLACK = 0.5  # radians, that the two may amount to


@kernel
def edge_log(a, b, edge):
    """log(b / a), accurate when the edge b - a is short against a."""
    a2 = max(a.real * a.real + a.imag * a.imag, 1e-300)
    re = (edge.real * a.real + edge.imag * a.imag) / a2
    im = (edge.imag * a.real - edge.real * a.imag) / a2
    s = 2 * re + re * re + im * im
    if -0.5 < s < 1.0:
        return complex(0.5 * math.log1p(s), math.atan2(im, 1 + re))
    b2 = max(b.real * b.real + b.imag * b.imag, 1e-300)
    return complex(
        0.5 * math.log(b2 / a2),
        math.atan2(b.imag * a.real - b.real * a.imag, b.real * a.real + b.imag * a.imag),
    )


@kernel
def _limit(polygon, z, e):
    """L_e = log(B_{e+1} / B_e) of one edge; on it the limit from inside, of imaginary part +π; 0 at its ends."""
    start, end = polygon[e] - z, polygon[(e + 1) % polygon.size] - z
    if start == 0 or end == 0:
        return 0j
    log = edge_log(start, end, polygon[(e + 1) % polygon.size] - polygon[e])
    if log.imag < MOST_SLACK - math.pi:
        slack = ON_EDGE + ROUNDING * (1 + abs(z)) / min(abs(start), abs(end))
        if log.imag < min(slack, MOST_SLACK) - math.pi:
            log += 2j * math.pi
    return log


@kernel
def _at_vertex(polygon, j):
    """What the edges j - 1 and j add up to at vertex j: log(B_{j+1} / B_{j-1}) with imaginary part in (0, 2π); the
    principal value is wrong at convex vertices."""
    pair = cmath.log((polygon[(j + 1) % polygon.size] - polygon[j]) / (polygon[j - 1] - polygon[j]))
    return pair if pair.imag > 0 else pair + 2j * math.pi


@kept()
def _edge_logs(polygon, z, out):
    """L_e of one point; at vertex j the pair of edges (j - 1, j) holds 0 and what they add up to."""
    at = -1
    for e in range(polygon.size):
        out[e] = _limit(polygon, z, e)
        if polygon[e] == z:
            at = e
    if at >= 0:
        out[at] = _at_vertex(polygon, at)


@kept()
def _edge_weights(polygon, z, out):
    """L_e / (2πi A_e) of one point: what both the coordinates and their derivatives are made of."""
    _edge_logs(polygon, z, out)
    for e in range(polygon.size):
        out[e] /= 2j * math.pi * (polygon[(e + 1) % polygon.size] - polygon[e])


@kept()
def _coordinates(polygon, z, out):
    weights = np.empty(polygon.size, dtype=np.complex128)
    for p in range(z.size):
        _edge_weights(polygon, z[p], weights)
        out[p] = 0
        for e in range(polygon.size):
            f = (e + 1) % polygon.size
            out[p, e] += (polygon[f] - z[p]) * weights[e]
            out[p, f] -= (polygon[e] - z[p]) * weights[e]


@kept()
def _derivatives(polygon, z, out):
    weights = np.empty(polygon.size, dtype=np.complex128)
    for p in range(z.size):
        _edge_weights(polygon, z[p], weights)
        out[p] = 0
        for e in range(polygon.size):
            out[p, e] -= weights[e]
            out[p, (e + 1) % polygon.size] += weights[e]


@kept(**NUMPY, fastmath={"contract", "reassoc", "nsz"})
def _jets(polygon, densities, slopes, z, out):
    """2πi times the integrals of densities (m, n), linear on every edge with given slopes, and times their derivatives,
    at points z (p,): Σ (φ_e + σ_e (z - z_e)) L_e and Σ σ_e L_e; `out` is (2, m, p).

    Seen from far an edge is short, and log((1 + u) / (1 - u)) = 2 (u + u³/3 + …) a fraction of the work. Loops are in
    real numbers, which LLVM computes several of at a time.
    """
    n = polygon.size
    x, y, across, up, square = np.empty((5, n))
    for e in range(n):
        edge = polygon[(e + 1) % n] - polygon[e]
        x[e], y[e] = 2 * polygon[e].real + edge.real, 2 * polygon[e].imag + edge.imag
        across[e], up[e] = edge.real, edge.imag
        square[e] = (edge.real * edge.real + edge.imag * edge.imag) / (FAR * FAR)
    re, im, near = np.empty(n), np.empty(n), np.empty(n)
    for p in range(z.size):
        zx, zy = z[p].real, z[p].imag
        for e in range(n):
            a, b = x[e] - 2 * zx, y[e] - 2 * zy
            size = a * a + b * b
            near[e] = size - square[e]
            # u + iv is the edge over start + end - 2 z; the series is summed by Horner's rule in its square
            u, v = (across[e] * a + up[e] * b) / size, (up[e] * a - across[e] * b) / size
            r, i = u * u - v * v, 2 * u * v
            c, d = 1 / 9 + r / 11, i / 11
            c, d = 1 / 7 + (r * c - i * d), r * d + i * c
            c, d = 1 / 5 + (r * c - i * d), r * d + i * c
            c, d = 1 / 3 + (r * c - i * d), r * d + i * c
            c, d = 1 + (r * c - i * d), r * d + i * c
            re[e], im[e] = 2 * (u * c - v * d), 2 * (u * d + v * c)
        at = -1
        for e in range(n):
            # edges that are close are few: by the logarithm itself, and at a vertex by its limit from inside
            if not near[e] > 0:
                log = _limit(polygon, z[p], e)
                re[e], im[e] = log.real, log.imag
                if polygon[e] == z[p]:
                    at = e
        if at >= 0:
            log = _at_vertex(polygon, at)
            re[at], im[at] = log.real, log.imag
        for k in range(densities.shape[0]):
            f, s = densities[k], slopes[k]
            total_re, total_im, rate_re, rate_im = 0.0, 0.0, 0.0, 0.0
            for e in range(n):
                a, b = zx - polygon[e].real, zy - polygon[e].imag
                c = f[e].real + (s[e].real * a - s[e].imag * b)
                d = f[e].imag + (s[e].real * b + s[e].imag * a)
                total_re += c * re[e] - d * im[e]
                total_im += c * im[e] + d * re[e]
                rate_re += s[e].real * re[e] - s[e].imag * im[e]
                rate_im += s[e].real * im[e] + s[e].imag * re[e]
            out[0, k, p] = complex(total_re, total_im)
            out[1, k, p] = complex(rate_re, rate_im) if at < 0 else complex(math.nan, math.nan)


def jets(polygon: Complex, densities: Complex, z: Complex, threads: int | None = None) -> Complex:
    """C(z) φ and D(z) φ without the matrices: the integrals of densities and their derivatives.

    Args:
        polygon: (n,) counter-clockwise vertices.
        densities: (m, n) values at the vertices.
        z: (p,) points inside, on edges or on vertices, where there is no derivative.
        threads: as many as there are processors by default; the result does not depend on it.

    Returns:
        (2, m, p) values and derivatives.
    """
    slopes = (np.roll(densities, -1, axis=1) - densities) / (np.roll(polygon, -1) - polygon)
    out = np.empty((2, len(densities), z.size), dtype=np.complex128)
    given = np.ascontiguousarray(polygon), np.ascontiguousarray(densities), slopes
    over_slices(lambda part: _jets(*given, z[part], out[:, :, part]), z.size, threads, MANY)
    return out / TAU_I


def coordinates(polygon: Complex, z: Complex) -> Complex:
    """Cauchy-Green coordinates C_j(z) (paper, Appendix A).

    Args:
        polygon: (n,) counter-clockwise vertices.
        z: (p,) points inside, on edges or on vertices (there: the limit from inside).

    Returns:
        (p, n) matrix with Σ_j C_j = 1 and Σ_j C_j z_j = z. No memory beyond it.
    """
    return _filled(_coordinates, polygon, z)


def derivatives(polygon: Complex, z: Complex) -> Complex:
    """D_j(z) = dC_j/dz (paper, Appendix A), (p, n), for points off the vertices, where it does not exist."""
    return _filled(_derivatives, polygon, z)


def _filled(kernel, polygon: Complex, z: Complex) -> Complex:
    """The matrix that a kernel fills, on all threads; what it holds does not depend on their number."""
    polygon, z = np.ascontiguousarray(polygon, dtype=complex), np.ascontiguousarray(z, dtype=complex)
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    over_slices(lambda rows: kernel(polygon, z[rows], out[rows]), z.size, step=SLICE)
    return out


def second_derivatives(polygon: Complex, z: Complex) -> Complex:
    """D2_j(z) = d²C_j/dz² (paper, Appendix A), (p, n), for points off the vertices."""
    out = np.empty((z.size, polygon.size), dtype=np.complex128)
    for rows in blocks(z.size, polygon.size):
        b = polygon[None, :] - z[rows, None]
        pair = 1.0 / (TAU_I * b * np.roll(b, -1, axis=1))  # 1 / (B_j B_{j+1})
        out[rows] = np.roll(pair, 1, axis=1) - pair
    return out


def blocks(rows: int, columns: int) -> list[slice]:
    """Slices that cut `rows` into blocks of at most BLOCK_ENTRIES entries."""
    step = max(1, BLOCK_ENTRIES // max(1, columns))
    return [slice(k, min(k + step, rows)) for k in range(0, rows, step)]
