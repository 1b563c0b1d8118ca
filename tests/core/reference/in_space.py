"""The energy of a map onto a surface in space."""

import numpy as np

from tests.core.reference.meshes import walk_to
from tests.core.reference.minimise import assemble, total


def _place_on(places, z, weights):
    last = len(places.grid) - 1
    cell = (z - places.low) * places.scale
    column, row = int(min(max(cell.real, 0), last)), int(min(max(cell.imag, 0), last))
    return walk_to(places.flat, places.faces, places.twin, z, places.grid[row, column], weights)


def _normalise(vector):
    """Divide a vector (3,) by its length; return the length."""
    squares = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]
    length = max(np.sqrt(squares), 1e-300)
    for c in range(3):
        vector[c] /= length
    return length


def _land(surface, u):
    """Compute the positions in space of vertices with places u (n,)."""
    places, points, slopes = surface.ground.places, surface.ground.points, surface.ground.slopes
    for v in range(u.size):
        point = surface.points[v]
        t = _place_on(places, u[v], point)
        a, b, c = places.faces[t, 0], places.faces[t, 1], places.faces[t, 2]
        shares = point[0], point[1], point[2]
        # 0 unless the place is beside the surface, which is extended linearly there
        offset = u[v] - shares[0] * places.flat[a] - shares[1] * places.flat[b] - shares[2] * places.flat[c]
        for k in range(3):
            point[k] = shares[0] * points[a, k] + shares[1] * points[b, k] + shares[2] * points[c, k]
            point[k] += slopes[t, k, 0] * offset.real + slopes[t, k, 1] * offset.imag
        surface.on[v] = t


def _lay(surface, u):
    """Compute the images of triangles in their own plane, with the first corner at 0 and the second on the x axis."""
    corners, points, laid = surface.layout.corners, surface.points, surface.flat_images
    for t in range(corners.shape[0]):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        if surface.open[t]:
            laid[3 * t], laid[3 * t + 1], laid[3 * t + 2] = u[a], u[b], u[c]
            continue
        x, y, orientation = surface.axes[t, 0], surface.axes[t, 1], surface.orientations[t]
        for k in range(3):
            x[k], y[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
        length = _normalise(x)
        along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
        for k in range(3):
            y[k] -= along * x[k]
        height = orientation * _normalise(y)
        for k in range(3):
            y[k] *= orientation
        laid[3 * t], laid[3 * t + 1], laid[3 * t + 2] = 0j, complex(length, 0.0), complex(along, height)


def total_in_space(rest_shapes, surface, u, objective):
    """Return the energy of images u (n,), without that of curves; infinite if a triangle is folded in the layout."""
    energy = total(surface.layout, u, surface.barrier)
    if energy == np.inf:
        return energy
    _land(surface, u)
    _lay(surface, u)
    return energy + total(rest_shapes, surface.flat_images, objective)


def _fill_jacobians(surface, t, jacobians):
    """Compute the derivatives of triangle t's corners in its plane by their places in the layout."""
    for k in range(3):
        slopes = surface.ground.slopes[surface.on[surface.layout.corners[t, k]]]
        for i in range(2):
            axis = surface.axes[t, i]
            for j in range(2):
                if surface.open[t]:
                    jacobians[k, i, j] = 1.0 if i == j else 0.0
                else:
                    along = axis[0] * slopes[0, j] + axis[1] * slopes[1, j] + axis[2] * slopes[2, j]
                    jacobians[k, i, j] = along


def assemble_in_space(rest_shapes, surface, u, objective, matrix, gradient):
    """Compute the energy, its gradient and the projected Hessian; second derivatives of the surface are omitted, so
    that it stays positive.
    """
    _land(surface, u)
    _lay(surface, u)
    energy = assemble(surface.layout, u, surface.barrier, matrix, gradient)
    energy += assemble(rest_shapes, surface.flat_images, objective, surface.blocks, surface.slopes)
    corners, slots = surface.layout.corners, surface.layout.slots
    jacobians = np.empty((3, 2, 2))
    for t in range(corners.shape[0]):
        _fill_jacobians(surface, t, jacobians)
        pair = 0
        for k in range(3):
            # Jₖᵀ g for the gradient g at a corner, Jₖᵀ B Jₗ for the block B of two
            first, slope = jacobians[k], surface.slopes[3 * t + k]
            x, y = complex(first[0, 0], first[0, 1]), complex(first[1, 0], first[1, 1])
            gradient[corners[t, k]] += slope.real * x + slope.imag * y
            for m in range(k, 3):
                second, block, slot = jacobians[m], surface.blocks[6 * t + pair], slots[t, pair]
                for j in range(2):
                    over_x = block[0] * second[0, j] + block[1] * second[1, j]
                    over_y = block[2] * second[0, j] + block[3] * second[1, j]
                    matrix[slot, j] += x.real * over_x + y.real * over_y
                    matrix[slot, 2 + j] += x.imag * over_x + y.imag * over_y
                pair += 1
    return energy
