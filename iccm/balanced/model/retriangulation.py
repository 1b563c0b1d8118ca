"""A map's triangulation changed where that lowers its energy: edges flipped, vertices and their images as they are.

Dyn, Levin & Rippa, *Data dependent triangulations for piecewise linear interpolation*, 1990: long triangles along the
direction in which a map changes least approximate it better than round ones.
"""

from dataclasses import replace

import numpy as np

from ...flips import flip, neighbours, opposite, push
from ...jit import in_place, kernel
from ..kernels import dot, twice_area
from ..meshing.delaunay import THIN, is_constrained
from ..minimise.energy import Objective, density
from .discrete_map import DiscreteMap
from .metric import PLANES

GAIN = 1e-6  # relative, of an edge flip: rounding decides nothing, and flipping ends


def retriangulated(state: DiscreteMap, q: float) -> DiscreteMap:
    """The map with edges flipped while that lowers the energy of the two triangles beside them.

    Edges of the outlines, of strokes, voids and rigid regions stay, and none comes to join two vertices of outlines.
    Maps between surfaces, whose triangles' shapes are those of space, stay as they are.
    """
    if state.metrics != PLANES or state.ground is not None or state.multipliers is not None:
        return state
    kinds = np.zeros(len(state.faces), np.int64)
    if state.weights is not None:
        kinds[state.weights != 1] = -1
    if state.rigid is not None:
        kinds[state.rigid >= 0] = -1
    faces = state.faces.copy()
    across, stack = neighbours(faces, state.z.size), np.zeros(8 * len(faces), np.int64)
    stack[0], stack[1 : len(faces) + 1] = len(faces), np.arange(len(faces))
    objective = Objective.of(state.theta, q, state.boundary.area_share(True))
    links = state.following
    rays = state.inside.rays(state.z[: state.border])
    links[rays[:, 0]] = state.border + rays[:, 1]  # an edge of an outline has one triangle and stays anyway
    _lower(state.z, state.u, faces, across, stack, kinds, state.border, links, objective)
    return replace(state, faces=faces).with_pattern()


@kernel
def _lower(z, u, faces, across, stack, kinds, border, links, objective):
    """Flips edges, from the triangles on the stack on, while that lowers the energy.

    Args:
        z: (n,) vertices.
        u: (n,) their images.
        faces: (t, 3) triangles, written.
        across: (t, 3) their neighbours, written.
        stack: triangles to look at, after their number; emptied.
        kinds: (t,) 0 for triangles that may change.
        border: how many vertices are on outlines.
        links: (c,) the vertex to which each of the first c is joined by an edge that stays.
        objective: what is minimised.
    """
    while stack[0] > 0:
        t = stack[stack[0]]
        stack[0] -= 1
        for k in range(3):
            v = across[t, k]
            if v < 0 or kinds[t] != 0 or kinds[v] != 0:
                continue
            a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            d = faces[v, opposite(faces, v, b, c)]
            if (a < border and d < border) or is_constrained(links, b, c):
                continue
            now = _energy(z, u, a, b, c, objective) + _energy(z, u, d, c, b, objective)
            then = _energy(z, u, a, b, d, objective) + _energy(z, u, a, d, c, objective)
            if then < (1 - GAIN) * now:
                flip(faces, across, t, k)
                push(stack, t)
                push(stack, v)
                break


@in_place
def _energy(z, u, a, b, c, objective):
    """The energy of a triangle; infinite where it, or its image, is turned over or has next to no area."""
    area, image = twice_area(z, a, b, c), twice_area(u, a, b, c)
    if area <= THIN or image <= THIN:
        return np.inf
    # |f_z|² + |f_z̄|² is half the sum of the squared singular values of the affine map
    ab, ac, first, second = z[b] - z[a], z[c] - z[a], u[b] - u[a], u[c] - u[a]
    d = image / area
    e, f, g = dot(ab, ab), dot(ab, ac), dot(ac, ac)
    p = (g * dot(first, first) - 2 * f * dot(first, second) + e * dot(second, second)) / (2 * area * area)
    return 0.5 * area * density(p, d, objective.theta, objective.q, objective.share)
