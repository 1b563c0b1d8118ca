"""Start the final map of a large surface from the map on a coarser triangulation of it.

A factorisation takes time in proportion to the power 1.5 of the vertices, and Newton's method takes as many steps on
the surface's own triangles as on a coarser mesh. So steps are made on a triangulation with an eighth of the vertices,
and what is left to do on all triangles is to move vertices one by one, in linear time (cascadic multigrid: Bornemann
and Deuflhard, *The cascadic multigrid method for elliptic problems*, 1996). See `flattening.coarsening`, which does the
same for layouts.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.model.discrete_map import DiscreteMap, folds
from ..balanced.search.final_mesh import LAST_DECREASE
from ..balanced.search.levels import FINE_POWER
from ..flattening.coarsening import Removed, coarser, reinsert_vertices, smooth
from ..flattening.free import LARGE_VERTEX_COUNT
from ..meshes.mesh import face_areas, with_unit_area
from ..meshes.stretch import laid_flat, linear
from .own_metric import OwnMetric

COARSER_FACTOR = 8  # ratio of vertices between triangulations, as for layouts
SWEEPS_AT_ONCE, MOST_SWEEPS = 2, 10
"""Times that vertices are moved one by one between two checks of the energy, and at most. If more were needed, Newton's
method follows. Six to eight are on fine meshes."""
DIRECT_VERTEX_COUNT = 50_000
"""Vertices up to which Newton's method also runs on all triangles; a step there takes half a second."""


def started_coarsely(
    state: DiscreteMap, points: Real, descent: Callable[[DiscreteMap], DiscreteMap]
) -> tuple[DiscreteMap, bool]:
    """Return a map on a surface's own triangles with less energy, found by way of coarser triangulations.

    Also returns whether it needs no Newton steps: it is large, and moving vertices one by one gains no more.

    Returns the map as it is where it is small, has terms that depend on the triangulation (soft pins, a metric of the
    target, virtual triangles), or where a coarser triangulation does not help.

    Args:
        state: the map, without folds.
        points: (n, 3) its vertices in space.
        descent: Newton's method on a triangulation.
    """
    planar = state.ground is None and state.metrics[1] is None and state.weights is None
    plain = state.energy.pins is None and not state.energy.terms and state.rigid is None
    if state.u.size < LARGE_VERTEX_COUNT or not (planar and plain):
        return state, False
    # The boundary slides, and a triangle with three vertices on it would hold it: so its neighbours stay, too.
    fixed = np.zeros(state.u.size, bool)
    fixed[: state.constrained] = True
    stay = np.unique(state.faces[fixed[state.faces].any(axis=1)])
    coarse, removed = coarser(points, state.faces, state.u, state.u.size // COARSER_FACTOR, stay)
    coarse_vertices = np.unique(coarse)
    if 2 * coarse_vertices.size > state.u.size:
        return state, False
    small = _on_coarser(state, points, coarse_vertices, np.searchsorted(coarse_vertices, coarse))
    small = descent(started_coarsely(small, points[coarse_vertices], descent)[0])
    return _refine_to_all_triangles(state, points, small, coarse_vertices, removed)


def _on_coarser(state: DiscreteMap, points: Real, vertices: Index, faces: Index) -> DiscreteMap:
    """Return the map on triangles (k, 3) between the vertices `vertices`, the first of which are the constrained ones.

    The images take the place of the layout, in which coarser triangles may fold: only their shapes in space count.
    """
    u = state.u[vertices]
    space = laid_flat(points[vertices][faces]) / np.sqrt(face_areas(points[state.faces]).sum())
    metric = OwnMetric(linear(u[faces], space), np.ones(len(faces), bool))
    return replace(state, faces=faces, z=u, u=u.copy(), metrics=(metric, None)).with_pattern()


def _refine_to_all_triangles(
    state: DiscreteMap, points: Real, small: DiscreteMap, coarse_vertices: Index, removed: Removed
) -> tuple[DiscreteMap, bool]:
    """Return the map with the images found on the coarser triangulation, if it has less energy then.

    Removed vertices are reinserted one by one, and then all are moved in sweeps. Also returns whether the map is large
    and has converged, so that it needs no Newton steps.
    """
    u = state.u.copy()
    u[coarse_vertices] = small.u
    unit = with_unit_area(points, state.faces)
    theta, share = state.energy.balance, state.boundary.area_share(True)
    if not reinsert_vertices(removed, unit, theta, u, q=FINE_POWER, share=share) or folds(state.faces, u):
        return state, False
    value, is_converged = _energy(state, u), False
    fixed = np.arange(u.size) < state.constrained
    for _ in range(MOST_SWEEPS // SWEEPS_AT_ONCE):
        smooth(state.faces, unit, fixed, SWEEPS_AT_ONCE, theta, u, q=FINE_POWER, share=share)
        previous, value = value, _energy(state, u)
        is_converged = previous - value < LAST_DECREASE * value
        if is_converged:
            break
    if folds(state.faces, u) or not value < _energy(state, state.u):
        return state, False
    better = replace(state, u=u, boundary=small.boundary, inside=small.inside)
    return better.with_value(FINE_POWER), is_converged and u.size >= DIRECT_VERTEX_COUNT


def _energy(state: DiscreteMap, u: Complex) -> float:
    """Return the energy of images (n,) without the boundary's term."""
    return state.rest_energy(u, FINE_POWER)
