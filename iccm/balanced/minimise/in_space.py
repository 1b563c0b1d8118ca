"""The energy of a map onto a surface in space, as a function of its vertices' places in the surface's layout.

A metric of the layout (`model.metric`) is taken where the map is at the beginning of some steps, and does not know that
it changes as vertices move: where it changes fast, at ears and legs, steps lose more than they gain. Here every vertex
of the map is a point of the surface, the image of a triangle is the one that joins three of these, and the derivative
of a point in space by its place in the layout is that of the surface's triangle it is in; line searches look at that.
A light energy in the layout keeps triangles from folding there.
"""

from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Flags, Index, Real
from ...jit import in_place
from ...meshes.locate import Locator, Places, place_on
from .energy import Objective, RestShapes, assemble, total

BARRIER = 0.01  # weight of the energy in the layout (by hand)


class Ground(NamedTuple):
    """A surface in space and its layout, beside which it goes on linearly.

    Attributes:
        places: what finds the layout's triangle at a place.
        points: (p, 3) vertices in space, the surface's area taken as one.
        slopes: (k, 3, 2) derivatives of points in space by the place in the layout, for each triangle.
    """

    places: Places
    points: Real
    slopes: Real

    @classmethod
    def of(cls, locator: Locator, points: Real) -> "Ground":
        """A layout, and where its vertices are in space."""
        flat, corners = locator.flat[locator.faces], points[locator.faces]
        sides, edges = (w[:, 1:] - w[:, :1] for w in (flat, corners))
        matrix = np.stack([sides.real, sides.imag], axis=1)  # columns are the sides
        return cls(locator.places, points, edges.transpose(0, 2, 1) @ np.linalg.inv(matrix))


class SurfaceMap(NamedTuple):
    """A map onto a surface in space: what its energy needs beside the triangles at rest, and arrays that it writes.

    The triangles at rest share no corners: t has 3t, 3t + 1 and 3t + 2, and as many blocks of its own.

    Attributes:
        ground: the surface.
        layout: the triangles at rest for the energy in the layout, corners and slots being the mesh's.
        barrier: what is minimised of that.
        open: (m,) triangles in holes of the source, whose images are those in the layout.
        turns: (m,) 1 for corners that run counter-clockwise, else -1.
        on: (n,) the surface's triangle that each vertex is in.
        points: (n, 3) vertices in space.
        laid: (3m,) images of triangles laid flat.
        axes: (m, 2, 3) directions in space that become x and y then.
        jacobians: (3, 2, 2) derivatives of a triangle's laid corners by their places in the layout.
        slopes: (3m,) gradients at laid corners.
        blocks: (6m, 4) of the Hessian.
    """

    ground: Ground
    layout: RestShapes
    barrier: Objective
    open: Flags
    turns: Real
    on: Index
    points: Real
    laid: Complex
    axes: Real
    jacobians: Real
    slopes: Complex
    blocks: Real

    @classmethod
    def of(cls, ground: Ground, layout: RestShapes, theta: float, open: Flags, turns: Real) -> "SurfaceMap":
        """Of a mesh's triangles at rest in the source's layout."""
        n, m = int(layout.corners.max()) + 1, len(layout.corners)
        light = layout._replace(weights=BARRIER * layout.weights)
        laid, slopes = np.empty((2, 3 * m), np.complex128)
        return cls(
            *(ground, light, Objective.of(theta, 1.0), open, turns),
            on=np.empty(n, np.int64),
            points=np.empty((n, 3)),
            laid=laid,
            axes=np.empty((m, 2, 3)),
            jacobians=np.empty((3, 2, 2)),
            slopes=slopes,
            blocks=np.empty((6 * m, 4)),
        )


def separate(gradients: Complex, weights: Real) -> RestShapes:
    """Triangles (m, 3) at rest that share no corners."""
    m = len(gradients)
    corners, slots = np.arange(3 * m).reshape(m, 3), np.arange(6 * m).reshape(m, 6)
    return RestShapes(corners, slots, gradients, weights)


@in_place
def _normalise(vector):
    """Divides a vector (3,) by its length, which is returned."""
    squares = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]
    length = max(np.sqrt(squares), 1e-300)
    for c in range(3):
        vector[c] /= length
    return length


@in_place
def _land(surface, u):
    """Fills in where vertices with places u (n,) are in space."""
    places, points, slopes = surface.ground.places, surface.ground.points, surface.ground.slopes
    for v in range(u.size):
        here = surface.points[v]
        t = place_on(places, u[v], here)
        a, b, c = places.faces[t, 0], places.faces[t, 1], places.faces[t, 2]
        shares = here[0], here[1], here[2]
        # 0 but where the place is beside the surface, which goes on linearly there
        beside = u[v] - shares[0] * places.flat[a] - shares[1] * places.flat[b] - shares[2] * places.flat[c]
        for k in range(3):
            here[k] = shares[0] * points[a, k] + shares[1] * points[b, k] + shares[2] * points[c, k]
            here[k] += slopes[t, k, 0] * beside.real + slopes[t, k, 1] * beside.imag
        surface.on[v] = t


@in_place
def _lay(surface, u):
    """Fills in the images of triangles laid flat, the first corner at 0 and the second on the x axis."""
    corners, points, laid = surface.layout.corners, surface.points, surface.laid
    for t in range(corners.shape[0]):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        if surface.open[t]:
            laid[3 * t], laid[3 * t + 1], laid[3 * t + 2] = u[a], u[b], u[c]
            continue
        x, y, turn = surface.axes[t, 0], surface.axes[t, 1], surface.turns[t]
        for k in range(3):
            x[k], y[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
        length = _normalise(x)
        along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
        for k in range(3):
            y[k] -= along * x[k]
        height = turn * _normalise(y)
        for k in range(3):
            y[k] *= turn
        laid[3 * t], laid[3 * t + 1], laid[3 * t + 2] = 0j, complex(length, 0.0), complex(along, height)


@in_place
def total_in_space(rest, surface, u, objective):
    """The energy of images u (n,), without the curves'; infinite where a triangle is folded in the layout."""
    energy = total(surface.layout, u, surface.barrier)
    if energy == np.inf:
        return energy
    _land(surface, u)
    _lay(surface, u)
    return energy + total(rest, surface.laid, objective)


@in_place
def _fill_jacobians(surface, t):
    """Fills in the derivatives of triangle t's laid corners by their places in the layout."""
    for k in range(3):
        slopes = surface.ground.slopes[surface.on[surface.layout.corners[t, k]]]
        for i in range(2):
            axis = surface.axes[t, i]
            for j in range(2):
                if surface.open[t]:
                    surface.jacobians[k, i, j] = 1.0 if i == j else 0.0
                else:
                    along = axis[0] * slopes[0, j] + axis[1] * slopes[1, j] + axis[2] * slopes[2, j]
                    surface.jacobians[k, i, j] = along


@in_place
def assemble_in_space(rest, surface, u, objective, matrix, gradient):
    """The same; fills in the gradient and the projected Hessian, second derivatives of the surface left out, so that it
    stays positive."""
    _land(surface, u)
    _lay(surface, u)
    energy = assemble(surface.layout, u, surface.barrier, matrix, gradient)
    energy += assemble(rest, surface.laid, objective, surface.blocks, surface.slopes)
    corners, slots, jacobians = surface.layout.corners, surface.layout.slots, surface.jacobians
    for t in range(corners.shape[0]):
        _fill_jacobians(surface, t)
        pair = 0
        for k in range(3):
            # Jₖᵀ g for the gradient g at a laid corner, Jₖᵀ B Jₗ for the block B of two
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
