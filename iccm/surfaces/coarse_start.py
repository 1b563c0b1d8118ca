"""Start the final map of a large surface from the map on a coarser triangulation of it.

A Newton step costs in proportion to the triangles, and on the surface's own triangles it takes as many steps as on a
coarser mesh. So most steps are made on a triangulation with an eighth of the vertices, and those on all triangles only
adapt the shapes of the smallest ones. See `flattening.coarsening`, which does the same for layouts.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Index, Real
from ..balanced.model.discrete_map import DiscreteMap, folds
from ..balanced.search.levels import FINE_POWER
from ..flattening.coarsening import Removed, coarser, put_back
from ..flattening.free import LARGE_VERTEX_COUNT
from ..meshes.mesh import face_areas
from ..meshes.stretch import laid_flat, linear
from .own_metric import OwnMetric

COARSER_FACTOR = 8  # ratio of vertices between triangulations, as for layouts


def started_coarsely(
    state: DiscreteMap, points: Real, descent: Callable[[DiscreteMap], DiscreteMap]
) -> DiscreteMap:
    """Return a map on a surface's own triangles with less energy, found by way of coarser triangulations.

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
        return state
    # The boundary slides, and a triangle with three vertices on it would hold it: so its neighbours stay, too.
    held = np.zeros(state.u.size, bool)
    held[: state.constrained] = True
    stay = np.unique(state.faces[held[state.faces].any(axis=1)])
    coarse, removed = coarser(points, state.faces, state.u, state.u.size // COARSER_FACTOR, stay)
    kept = np.unique(coarse)
    if 2 * kept.size > state.u.size:
        return state
    small = _on_coarser(state, points, kept, np.searchsorted(kept, coarse))
    small = descent(started_coarsely(small, points[kept], descent))
    return _carried(state, points, small, kept, removed)


def _on_coarser(state: DiscreteMap, points: Real, kept: Index, faces: Index) -> DiscreteMap:
    """Return the map on triangles (k, 3) between the vertices `kept`, the first of which are the constrained ones.

    The images take the place of the layout, in which coarser triangles may fold: only their shapes in space count.
    """
    u = state.u[kept]
    space = laid_flat(points[kept][faces]) / np.sqrt(face_areas(points[state.faces]).sum())
    metric = OwnMetric(linear(u[faces], space), np.ones(len(faces), bool))
    return replace(state, faces=faces, z=u, u=u.copy(), metrics=(metric, None)).with_pattern()


def _carried(
    state: DiscreteMap, points: Real, small: DiscreteMap, kept: Index, removed: Removed
) -> DiscreteMap:
    """Return the map with the images found on the coarser triangulation, if it has less energy then."""
    found = state.u.copy()
    found[kept] = small.u
    unit = points / np.sqrt(face_areas(points[state.faces]).sum())
    if not put_back(removed, unit, state.energy.balance, found) or folds(state.faces, found):
        return state
    better = replace(state, u=found, boundary=small.boundary, inside=small.inside)
    return better if _energy(better, found) < _energy(state, state.u) else state


def _energy(state: DiscreteMap, u: Complex) -> float:
    """Return the energy of images (n,) without the boundary's term."""
    return state.rest_energy(u, FINE_POWER)
