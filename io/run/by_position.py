"""Pins by position, for two meshes in the same place, such as a model and its subdivision, whose map has drifted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Index, Real
from ...status import Status
from ..point_syntax import Place

if TYPE_CHECKING:
    from .state import Run

MOST_PINS, MOST_PINS_OF_CUT = 24, 6
"""Numbers of pins. For a head and its subdivision, p95 of `apart` is 0.21 without pins and 0.09 with 24; with more,
pins contradict each other. A closed mesh is cut through all of its pins, which leaves room for only a few.
"""
NEAR_SHARE = 0.05
"""Relative to the target's diagonal: points farther from the source are not pinned, since they may belong to
something else."""


def pins_by_position(run: Run) -> list[tuple[Place, Place]]:
    """Return pins from the nearest points of the source to vertices of the target, if an unconstrained map has
    drifted.
    """
    import igl

    from ..shapes.mesh_shape import as_mesh

    job = run.job
    constrained = job.has_pins or job.start or job.rigid or job.rigid_target or job.several
    if constrained or len(run.fits) != 1 or run.fit.status not in (Status.DRIFTED, Status.TWISTED):
        return []
    if not run.fit._has_drifted:  # a twisted map, perhaps between surfaces in different places
        return []
    source, target = (as_mesh(shape).flattening.patch for shape in run.pairs[0])
    points, faces = np.ascontiguousarray(source.points), np.ascontiguousarray(source.faces)
    tree = igl.AABB()
    tree.init(points, faces)
    squared, _, nearest = tree.squared_distance(points, faces, np.ascontiguousarray(target.points))
    size = float(np.linalg.norm(np.ptp(target.points, axis=0)))
    close = np.flatnonzero(np.sqrt(squared) <= NEAR_SHARE * size)
    if not close.size:
        return []
    is_cut = bool(len(source.seam) or len(target.seam))
    vertices = close[_spread_out(target.points[close], MOST_PINS_OF_CUT if is_cut else MOST_PINS)]
    base = as_mesh(run.target).file.mesh.base
    return [(tuple(nearest[k].tolist()), f"v{target.vertex[k] + base}") for k in vertices]


def _spread_out(points: Real, most: int) -> Index:
    """Return some of the points (n, 3), each the farthest from those before (farthest point sampling)."""
    middle = points.mean(axis=0)
    selection = [int(np.argmax(np.linalg.norm(points - middle, axis=1)))]
    away = np.linalg.norm(points - points[selection[0]], axis=1)
    while len(selection) < min(most, len(points)) and away.max() > 0:
        selection.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[selection[-1]], axis=1))
    return np.array(selection)
