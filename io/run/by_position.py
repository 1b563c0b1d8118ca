"""Pins by position: two meshes in the same place, such as a model and its subdivision, whose map drifted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Index, Real
from ...status import Status
from ..point_syntax import Place

if TYPE_CHECKING:
    from .state import Run

PINS, PINS_OF_CUT = 24, 6
"""Places that are pinned: of a head and its subdivision p95 of `apart` is .21 without, .09 with 24; more contradict
each other. A closed mesh is cut through all of them, which more than a few hardly leave room for."""
NEAR_SHARE = (
    0.05  # of the target's diagonal: places that are farther from the source are not pinned (by hand)
)


def pins_by_position(run: Run) -> list[tuple[Place, Place]]:
    """Pins from the nearest points of the source to vertices of the target, where a map without constraints drifted."""
    import igl

    from ..shapes.mesh_shape import as_mesh

    job = run.job
    constrained = job.pin or job.constraints or job.start or job.rigid or job.rigid_target or job.several
    if constrained or len(run.fits) != 1 or run.fit.status is not Status.DRIFTED:
        return []
    source, target = (as_mesh(shape).flattening.patch for shape in run.pairs[0])
    points, faces = np.ascontiguousarray(source.points), np.ascontiguousarray(source.faces)
    tree = igl.AABB()
    tree.init(points, faces)
    squared, _, nearest = tree.squared_distance(points, faces, np.ascontiguousarray(target.points))
    size = float(np.linalg.norm(np.ptp(target.points, axis=0)))
    near = np.flatnonzero(np.sqrt(squared) <= NEAR_SHARE * size)
    if not near.size:
        return []
    is_cut = bool(len(source.seam) or len(target.seam))
    chosen = near[_spread_out(target.points[near], PINS_OF_CUT if is_cut else PINS)]
    base = as_mesh(run.target).file.mesh.base
    return [(tuple(nearest[k].tolist()), f"v{target.vertex[k] + base}") for k in chosen]


def _spread_out(points: Real, most: int) -> Index:
    """Return some of the points (n, 3), each the farthest from those before."""
    middle = points.mean(axis=0)
    found = [int(np.argmax(np.linalg.norm(points - middle, axis=1)))]
    away = np.linalg.norm(points - points[found[0]], axis=1)
    while len(found) < min(most, len(points)) and away.max() > 0:
        found.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[found[-1]], axis=1))
    return np.array(found)
