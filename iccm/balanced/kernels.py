"""The small kernels that all files of this folder share."""

import numpy as np

from ..jit import in_place


@in_place
def cross(a, b):
    """The determinant of two vectors of the plane, complex numbers."""
    return a.real * b.imag - a.imag * b.real


@in_place
def dot(a, b):
    """The scalar product of two vectors of the plane, complex numbers."""
    return a.real * b.real + a.imag * b.imag


@in_place
def twice_area(z, a, b, c):
    """Twice the signed area of the triangle of vertices a, b, c of z."""
    return cross(z[b] - z[a], z[c] - z[a])


@in_place
def located(knots, s):
    """The edge of a closed polyline that holds arclength s, and the arclength from that edge's start.

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


@in_place
def set_row(table, row, first, second, third):
    """Writes the three numbers of a row; no tuple, whose assignment compiles slowly."""
    table[row, 0], table[row, 1], table[row, 2] = first, second, third


@in_place
def move(start, step, share, result):
    """Fills in start + share · step; a loop, since array expressions compile slowly."""
    for v in range(start.size):
        result[v] = start[v] + share * step[v]
