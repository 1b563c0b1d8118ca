"""Transfer a map to another mesh of the same shape."""

import numpy as np

from ...arrays import Complex, Index
from ...maps.triangulated.adjacency import edges_of
from ...maps.triangulated.location import PatchLocator
from ...maps.triangulated.rim import Rim
from ...plane import cross

FEW_POINTS = 8  # such as pins: compared with all boxes of a mesh sooner than these are sorted (measured)


def interpolate(z: Complex, faces: Index, values: Complex, points: Complex) -> Complex:
    """Return the piecewise linear function at points, extended linearly from the closest triangle beyond the mesh.

    Args:
        z: (n,) vertices.
        faces: (m, 3) counter-clockwise triangles.
        values: (n,) complex.
        points: (p,) complex.
    """
    nearest = nearest_triangles(z, faces, points)
    a, b, c = z[faces[nearest]].T
    area = cross(b - a, c - a)
    second, third = cross(points - a, c - a) / area, cross(b - a, points - a) / area
    first, *corners = values[faces[nearest]].T
    return first + second * (corners[0] - first) + third * (corners[1] - first)


def nearest_triangles(z: Complex, faces: Index, points: Complex) -> Index:
    """Return (p,) the triangle that contains each point, or the closest one."""
    corners = z[faces]
    locator = PatchLocator(corners, np.zeros_like(corners))
    triangle, _ = locator.locate_once(points) if points.size <= FEW_POINTS else locator(points, 1)
    outside = triangle < 0
    if outside.any():
        rim = Rim(z, edges_of(faces))
        triangle[outside] = rim.beside[rim.closest(points[outside])[0]]
    return triangle
