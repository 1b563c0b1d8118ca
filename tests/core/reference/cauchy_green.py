"""Cauchy-Green coordinates."""

import cmath
import math

import numpy as np

ON_EDGE = 1e-9  # radians: an edge seen under an angle this close to -π contains the point
ROUNDING = 4e-16
MOST_SLACK = 0.5  # largest amount of both in radians


def edge_log(a, b, edge):
    """Return log(b / a), accurate if the edge b - a is short relative to a."""
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


def _limit(polygon, z, e):
    """Return L_e = log(B_{e+1} / B_e) of one edge; on the edge, the limit from inside with imaginary part +π; 0 at its
    ends.
    """
    start, end = polygon[e] - z, polygon[(e + 1) % polygon.size] - z
    if start == 0 or end == 0:
        return 0j
    log = edge_log(start, end, polygon[(e + 1) % polygon.size] - polygon[e])
    if log.imag < MOST_SLACK - math.pi:
        slack = ON_EDGE + ROUNDING * (1 + abs(z)) / min(abs(start), abs(end))
        if log.imag < min(slack, MOST_SLACK) - math.pi:
            log += 2j * math.pi
    return log


def _at_vertex(polygon, j):
    """Return the sum of the edges j - 1 and j at vertex j: log(B_{j+1} / B_{j-1}) with imaginary part in (0, 2π); the
    principal value is wrong at convex vertices.
    """
    pair = cmath.log((polygon[(j + 1) % polygon.size] - polygon[j]) / (polygon[j - 1] - polygon[j]))
    return pair if pair.imag > 0 else pair + 2j * math.pi


def _edge_logs(polygon, z, out):
    """Compute L_e for one point; at vertex j, the edges j - 1 and j have 0 and the sum of both."""
    vertex = -1
    for e in range(polygon.size):
        out[e] = _limit(polygon, z, e)
        if polygon[e] == z:
            vertex = e
    if vertex >= 0:
        out[vertex] = _at_vertex(polygon, vertex)


def _edge_weights(polygon, z, out):
    """Compute L_e / (2πi A_e) for one point, from which both the coordinates and their derivatives are formed."""
    _edge_logs(polygon, z, out)
    for e in range(polygon.size):
        out[e] /= 2j * math.pi * (polygon[(e + 1) % polygon.size] - polygon[e])


def _coordinates(polygon, z, out):
    weights = np.empty(polygon.size, dtype=np.complex128)
    for p in range(z.size):
        _edge_weights(polygon, z[p], weights)
        out[p] = 0
        for e in range(polygon.size):
            f = (e + 1) % polygon.size
            out[p, e] += (polygon[f] - z[p]) * weights[e]
            out[p, f] -= (polygon[e] - z[p]) * weights[e]


def _derivatives(polygon, z, out):
    weights = np.empty(polygon.size, dtype=np.complex128)
    for p in range(z.size):
        _edge_weights(polygon, z[p], weights)
        out[p] = 0
        for e in range(polygon.size):
            out[p, e] -= weights[e]
            out[p, (e + 1) % polygon.size] += weights[e]
