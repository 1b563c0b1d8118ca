"""Round outlines to a grid before the search, so that noise far below the grid spacing does not change any decision.

Decisions are the choice of vertices, of triangles, and between maps that are about equally good. At the end,
rounded points are restored to the given ones.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Complex, Flags, Index, distinct
from ...curve import Curve, inside_any
from ...plane import triangle_areas
from ..holes.outlines import are_disjoint
from ..model.discrete_map import folds
from ..model.mesh_map import MeshMap
from ..model.unit_coordinates import begun_farthest
from .unit_problem import UnitProblem

GRID_SPACING = 2.0**-13  # relative to the root of the area: 1.2e-4, less than the tolerance of outlines
ON_GRID_SHARE = 1e-9  # relative to the root of the area: vertices this close to the grid were rounded to it


def rounded(problem: UnitProblem) -> UnitProblem:
    """Return the problem with its outlines and pins on the grid.

    It is unchanged if rounded outlines would touch, if a pin would leave its domain or meet another, or if there are
    strokes.
    """
    loops = [
        [_snap_loop(c.z) for c in (outer, *inner)]
        for outer, inner in zip((problem.source, problem.target), problem.holes.sides)
    ]
    if problem.strokes or not all(min(z.size for z in side) > 2 and are_disjoint(side) for side in loops):
        return problem
    (first, *rims), (second, *goals) = ([Curve(z) for z in side] for side in loops)
    source, target = (Curve(begun_farthest(curve.z)) for curve in (first, second))
    pins, anchors = snap_to_coarse_grid(problem.pins), snap_to_coarse_grid(problem.outline_pins).T.tolist()
    for curve, holes, points in zip((source, target), (rims, goals), pins.T):
        inside = curve.contains(points) & ~inside_any(holes, points)
        if not inside.all() or distinct(points).size < points.size:
            return problem
    return problem._replace(
        source=source,
        target=target,
        holes=problem.holes._replace(source=tuple(rims), target=tuple(goals)),
        pins=pins,
        anchors=(tuple(anchors[0]), tuple(anchors[1])),
    )


def snap_to_coarse_grid(z: Complex) -> Complex:
    """Return the closest points of the grid."""
    return np.asarray(np.round(z / GRID_SPACING) * GRID_SPACING)


def _snap_loop(z: Complex) -> Complex:
    z = snap_to_coarse_grid(z)
    return z[z != np.roll(z, 1)]


def restore_outline(state: MeshMap, source: Sequence[Complex], target: Sequence[Complex]) -> MeshMap:
    """Return the map with the vertices of both outlines at the given positions.

    Other boundary vertices are moved along. Boundary vertices that would fold a triangle are not moved. If
    triangles fold all the same, the map is returned unchanged.

    Args:
        state: the map.
        source: (n,) given points of each outline of the source, and pins.
        target: those of the target.
    """
    loops = [state.outer, *(loop.vertices for loop in (*state.loops, *state.filled))]
    restored = []
    for z, points in zip((state.z, state.u), (source, target)):
        z, vertices = z.copy(), np.concatenate(points)
        place = dict(zip(snap_to_coarse_grid(vertices).tolist(), vertices.tolist()))
        grid = snap_to_coarse_grid(z)
        is_given = np.abs(grid - z) < ON_GRID_SHARE
        is_given[is_given] = [key in place for key in grid[is_given].tolist()]
        shift = np.zeros(z.size, np.complex128)
        shift[is_given] = [place[key] for key in grid[is_given].tolist()] - z[is_given]
        for loop in loops:
            shift[loop] = _between(z[loop], shift[loop], is_given[loop])
        restored.append(
            _without_folds(z, shift, state.faces, np.concatenate([np.r_[loop] for loop in loops]))
        )
        if folds(state.faces, restored[-1]):
            return state
    return replace(state, z=restored[0], u=restored[1])


def _without_folds(z: Complex, shift: Complex, faces: Index, rims: Index) -> Complex:
    """Return vertices (n,) moved by their shifts, except those of outlines (b,) in triangles that would fold.

    Pins are always moved, since they have to be exact.
    """
    loose = np.zeros(z.size, bool)
    loose[rims] = True
    while True:
        folded = faces[triangle_areas((z + shift)[faces]) <= 0].ravel()
        blocked = folded[loose[folded] & (shift[folded] != 0)]
        if not blocked.size:
            return z + shift
        shift = shift.copy()
        shift[blocked] = 0


def _between(z: Complex, shift: Complex, is_given: Flags) -> Complex:
    """Return the shifts of a closed polyline's vertices, with unknown ones interpolated linearly in arclength."""
    if not is_given.any():
        return shift
    lengths = np.abs(np.diff(z, append=z[0]))
    s = np.cumsum(lengths) - lengths
    parts = (
        np.interp(s, s[is_given], part[is_given], period=lengths.sum()) for part in (shift.real, shift.imag)
    )
    x, y = parts
    return x + 1j * y
