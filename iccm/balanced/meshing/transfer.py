"""Carrying a map over to another mesh of the same shape."""

import igl
import numpy as np

from ...arrays import Complex, Index, xy_of


def interpolate(z: Complex, faces: Index, values: Complex, points: Complex) -> Complex:
    """The piecewise linear function at points of a mesh, extended linearly from the closest triangle beyond it.

    Args:
        z: (n,) vertices.
        faces: (m, 3) counter-clockwise triangles.
        values: (n,) complex.
        points: (p,) complex.
    """
    _, nearest, _ = igl.point_mesh_squared_distance(xy_of(points), xy_of(z), faces)
    a, b, c = z[faces[nearest]].T
    area = _cross(b - a, c - a)
    second, third = _cross(points - a, c - a) / area, _cross(b - a, points - a) / area
    first, *others = values[faces[nearest]].T
    return first + second * (others[0] - first) + third * (others[1] - first)


def _cross(a: Complex, b: Complex) -> np.ndarray:
    return a.real * b.imag - a.imag * b.real
