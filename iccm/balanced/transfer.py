"""Carrying a map over to another mesh of the same shape."""

import numpy as np

from .kernels import cross, kernel

CELLS = 1.5  # width of a bucket in mean edge lengths of a domain of area one


@kernel
def _cell_range(low, high, corner, side, count):
    """First and last cell, of `count`, that an interval touches."""
    first, last = int(np.floor((low - corner) / side)), int(np.floor((high - corner) / side))
    return min(max(first, 0), count - 1), min(max(last, 0), count - 1)


@kernel
def _buckets(z, faces, corner, side, columns, rows):
    """The triangles whose boxes touch each cell of a grid: where each cell's begin, and all in a row."""
    starts = np.zeros(columns * rows + 1, np.int64)
    held = np.empty(0, np.int64)
    for filling in range(2):
        for t in range(faces.shape[0]):
            a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
            x0, x1 = min(a.real, b.real, c.real), max(a.real, b.real, c.real)
            y0, y1 = min(a.imag, b.imag, c.imag), max(a.imag, b.imag, c.imag)
            i0, i1 = _cell_range(x0, x1, corner.real, side, columns)
            j0, j1 = _cell_range(y0, y1, corner.imag, side, rows)
            for i in range(i0, i1 + 1):
                for j in range(j0, j1 + 1):
                    if filling == 1:
                        starts[i * rows + j] -= 1
                        held[starts[i * rows + j]] = t
                    else:
                        starts[i * rows + j] += 1
        if filling == 0:
            starts[:] = np.cumsum(starts)
            held = np.empty(starts[columns * rows], np.int64)
    return starts, held


@kernel
def interpolate(z, faces, values, points):
    """The piecewise linear function at points of a mesh, extended linearly from a close triangle beyond it.

    Args:
        z: (n,) vertices.
        faces: (m, 3) counter-clockwise triangles.
        values: (n,) complex.
        points: (p,) complex.
    """
    corner = complex(z.real.min(), z.imag.min())
    width, height = z.real.max() - corner.real, z.imag.max() - corner.imag
    side = max(CELLS / np.sqrt(faces.shape[0]), 1e-3 * max(width, height))
    columns, rows = int(width / side) + 1, int(height / side) + 1
    starts, held = _buckets(z, faces, corner, side, columns, rows)
    result = np.empty(points.size, np.complex128)
    for k in range(points.size):
        point = points[k]
        i, _ = _cell_range(point.real, point.real, corner.real, side, columns)
        j, _ = _cell_range(point.imag, point.imag, corner.imag, side, rows)
        best, reach = -np.inf, 0
        while best == -np.inf:
            for cell in range((2 * reach + 1) ** 2):
                ci, cj = i - reach + cell // (2 * reach + 1), j - reach + cell % (2 * reach + 1)
                if ci < 0 or cj < 0 or ci >= columns or cj >= rows:
                    continue
                for t in held[starts[ci * rows + cj] : starts[ci * rows + cj + 1]]:
                    a, b, c = z[faces[t, 0]], z[faces[t, 1]], z[faces[t, 2]]
                    area = cross(b - a, c - a)
                    second, third = cross(point - a, c - a) / area, cross(b - a, point - a) / area
                    inside = min(1 - second - third, second, third)
                    if inside > best:
                        best = inside
                        result[k] = (
                            (1 - second - third) * values[faces[t, 0]]
                            + second * values[faces[t, 1]]
                            + third * values[faces[t, 2]]
                        )
                    if inside >= 0:
                        break
            reach += 1
    return result
