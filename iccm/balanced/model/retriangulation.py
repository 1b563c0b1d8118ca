"""Change a map's triangulation where that lowers its energy: edges are flipped, vertices and images do not move.

Dyn, Levin & Rippa, *Data dependent triangulations for piecewise linear interpolation*, 1990: long triangles in
the direction in which a map changes least approximate it better than round ones.
"""

from dataclasses import replace

import numpy as np

from ...maps.triangulated.adjacency import neighbours
from ...native import function
from .discrete_map import DiscreteMap
from .metric import PLANES

_flip_to_lower_energy = function(
    """int64_t iccm_model_flip_to_lower_energy(
        const Complex *z, const Complex *u, int64_t *faces, int64_t *across, int64_t *stack, int64_t stack_size,
        const bool *fixed, int64_t border, const int64_t *links, int64_t link_count, double theta, double q,
        double share)"""
)


def flip_edges(state: DiscreteMap, q: float) -> DiscreteMap:
    """Flip edges while that lowers the energy of the two adjacent triangles.

    Edges of outlines, strokes, virtual triangles and rigid regions are kept, and no new edge joins two vertices
    of outlines. Maps between surfaces are returned unchanged, since their triangles have the shapes of those in
    space.

    Args:
        state: the map.
        q: power of the density.
    """
    if state.metrics != PLANES or state.ground is not None or state.multipliers is not None:
        return state
    fixed = np.zeros(len(state.faces), bool)
    if state.weights is not None:
        fixed[state.weights != 1] = True
    if state.rigid is not None:
        fixed[state.rigid >= 0] = True
    faces = state.faces.copy()
    across, stack = neighbours(faces, state.z.size), np.zeros(8 * len(faces), np.int64)
    stack[0], stack[1 : len(faces) + 1] = len(faces), np.arange(len(faces))
    share = state.boundary.area_share(True)
    links = state.following
    rays = state.inside.rays(state.z[: state.border])
    links[rays[:, 0]] = (
        state.border + rays[:, 1]
    )  # replaces links along the outline, whose edges have one triangle and are never flipped
    _flip_to_lower_energy(
        state.z,
        state.u,
        faces,
        across,
        stack,
        stack.size,
        fixed,
        state.border,
        links,
        links.size,
        state.energy.balance,
        q,
        share,
    )
    flipped = replace(state, faces=faces).with_pattern()
    if state.energy.terms:  # flips do not take the terms into account
        energy = state.energy.between(state.z, state.u, state.material)
        flipped_energy = flipped.energy.between(flipped.z, flipped.u, flipped.material)
        return flipped if flipped_energy < energy else state
    return flipped
