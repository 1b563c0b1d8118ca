"""A layout sought on coarser triangulations of the same surface first.

Vertices that are not neighbours are taken out in rounds, each drawn into a neighbour (half-edge collapse), so that no
triangle folds in the layout; they come back in the opposite order, each at its place in its triangle, or nearer to that
neighbour where a triangle would fold otherwise, so that there are no folds after it either, and from there to where
the triangles around it have least energy. After Hormann, Greiner and Campagna, *Hierarchical parametrization of
triangulated surfaces*, 1999.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..meshes.flatten import Flattening
from ..meshes.mesh import Mesh, face_areas
from ..meshes.patch import Patch
from ..meshes.topology import Triangles
from ..native import function
from .free import LARGE_VERTEX_COUNT, SMALL_GAIN_SHARE, Elastic, surface

COARSER_FACTOR = 8  # times the vertices of the next coarser triangulation, on which a step costs as much less
LEAST_REMOVED_SHARE = 0.1
"""Share of the vertices left that a round must take out to be worth another: what is left then is as coarse as its
shapes allow."""
NONE = np.empty(0, np.int64)

_remove = function(
    """int64_t iccm_flattening_remove(
        int64_t *faces, const double *points, const Complex *z, int64_t n, const int64_t *starts,
        const int64_t *around, bool *blocked, int64_t most, int64_t *vertex, int64_t *into, int64_t *triangle,
        double *weights, int64_t *ends, int64_t *edges)"""
)
_put_back = function(
    """int64_t iccm_flattening_put_back(
        const int64_t *vertex, const int64_t *into, const int64_t *triangle, const double *weights,
        const int64_t *starts, const int64_t *edges, int64_t count, const double *points, double theta,
        double min_gain, Complex *u)"""
)


class Removed(NamedTuple):
    """Vertices that were taken out, in that order.

    Attributes:
        vertex: (r,) their numbers.
        into: (r,) the neighbour that each was drawn into.
        corners: (r, 3) the triangle that each lay in then.
        weights: (r, 3) its barycentric coordinates there.
        starts: (r + 1,) where the edges around each begin in `edges`.
        edges: (e, 2) those opposite it, counter-clockwise.
    """

    vertex: Index
    into: Index
    corners: Index
    weights: Real
    starts: Index
    edges: Index

    @classmethod
    def of_size(cls, count: int, edges: int) -> "Removed":
        """Room for so many vertices, and edges around them."""
        return cls(
            vertex=np.empty(count, np.int64),
            into=np.empty(count, np.int64),
            corners=np.empty((count, 3), np.int64),
            weights=np.empty((count, 3)),
            starts=np.zeros(count + 1, np.int64),
            edges=np.empty((edges, 2), np.int64),
        )

    def first(self, count: int) -> "Removed":
        """Return the first so many vertices."""
        return Removed(
            vertex=self.vertex[:count],
            into=self.into[:count],
            corners=self.corners[:count],
            weights=self.weights[:count],
            starts=self.starts[: count + 1],
            edges=self.edges[: self.starts[count]],
        )

    @classmethod
    def joined(cls, rounds: "Sequence[Removed]") -> "Removed":
        """Return the vertices of several rounds, one after the other."""
        offsets = np.cumsum([0, *(len(each.edges) for each in rounds)])
        starts = [each.starts[:-1] + offset for each, offset in zip(rounds, offsets)]
        return cls(
            vertex=np.concatenate([each.vertex for each in rounds]),
            into=np.concatenate([each.into for each in rounds]),
            corners=np.concatenate([each.corners for each in rounds]),
            weights=np.concatenate([each.weights for each in rounds]),
            starts=np.concatenate([*starts, offsets[-1:]]),
            edges=np.concatenate([each.edges for each in rounds]),
        )


def relaxed(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    steps: int,
    tolerance: float,
) -> Complex:
    """Return (n,) positions of less energy, from some without folds; of large surfaces by way of a coarser
    triangulation.

    Args:
        sheet: the surface, all of whose vertices move.
        points: (n, 3) of them in space.
        u: (n,) positions at an area of one.
        theta: weight of the area part.
        steps: of Newton's method, at most, on each triangulation.
        tolerance: relative decrease that counts as none.
    """
    u = by_coarser(
        sheet,
        points,
        u,
        theta,
        lambda own, kept: relaxed(own, points[kept], u[kept], theta, steps, tolerance),
    )
    return sheet.relaxed(u, theta, steps, tolerance)


def by_coarser(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    solve: Callable[[Elastic, Index], Complex],
    stay: Index = NONE,
) -> Complex:
    """Return (n,) positions of less energy by way of a coarser triangulation; those given where the surface is small or
    there are none.

    Args:
        sheet, points, u, theta: as of `relaxed`.
        solve: positions (k,) without folds of the coarser surface, given that and the numbers (k,) of its vertices.
        stay: vertices that are not taken out.
    """
    small = _much_coarser(points, sheet.faces, u, LARGE_VERTEX_COUNT, stay)
    if small is None:
        return u
    kept, faces, removed = small
    found = u.copy()
    found[kept] = solve(surface(points[kept], faces), kept)
    unit = points / np.sqrt(face_areas(points[sheet.faces]).sum())
    better = put_back(removed, unit, theta, found) and sheet.energy(found, theta) < sheet.energy(u, theta)
    return found if better else u


def coarser_layout(layout: Flattening, large: int) -> tuple[Flattening, Index] | None:
    """Return a layout without folds on a coarser triangulation, a separate mesh, and the patch's vertex (k,) behind
    each of its vertices; None where the surface has fewer vertices than `large`, or there is none.
    """
    patch = layout.patch
    small = _much_coarser(patch.points, patch.faces, layout.flat, large, NONE)
    if small is None:
        return None
    kept, faces, _ = small
    mesh = Mesh.triangles(patch.mesh.name, patch.points[kept], faces)
    own = Patch(
        mesh,
        mesh.points,
        Triangles(faces, kept.size),
        np.arange(kept.size),
        np.arange(faces.size).reshape(-1, 3),
    )
    loops = [loop for loop in own.loops if np.isin(kept[loop], layout.loop).all()]
    return (replace(layout, patch=own, flat=layout.flat[kept], loop=loops[0]), kept) if loops else None


def _much_coarser(
    points: Real, faces: Index, z: Complex, large: int, stay: Index
) -> tuple[Index, Index, Removed] | None:
    """Return the vertices (k,) that are left of many, the triangles (m, 3) of these, and what was taken out."""
    if z.size < large:
        return None
    coarse, removed = coarser(points, faces, z, z.size // COARSER_FACTOR, stay)
    kept = np.unique(coarse)
    return None if 2 * kept.size > z.size else (kept, np.searchsorted(kept, coarse), removed)


def coarser(points: Real, faces: Index, z: Complex, goal: int, stay: Index = NONE) -> tuple[Index, Removed]:
    """Return (k, 3) triangles with about `goal` vertices or as few as there can be, some of which stay, without folds
    in a layout z (n,) that has none; and what was taken out.
    """
    faces = np.array(faces, np.int64)
    points, z = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(z, np.complex128)
    rounds: list[Removed] = []
    left = z.size
    while left > goal:
        # Vertices of a round are not neighbours: of a mesh of degree six a third of all can be, at most.
        most = min(left - goal, left // 3 + 1)
        removed, faces = _remove_round(points, faces, z, most, stay)
        rounds.append(removed)
        left -= removed.vertex.size
        if removed.vertex.size < LEAST_REMOVED_SHARE * left:
            break
    return faces, Removed.joined(rounds)


def _remove_round(points: Real, faces: Index, z: Complex, most: int, stay: Index) -> tuple[Removed, Index]:
    """Take out at most so many vertices that are not neighbours; what was taken out, and the triangles (m, 3) left."""
    corners = faces.ravel()
    # The triangles of each vertex: those of vertex v are around[starts[v] : starts[v + 1]].
    starts = np.append(0, np.cumsum(np.bincount(corners, minlength=z.size)))
    around = np.argsort(corners, kind="stable") // 3
    blocked = np.zeros(z.size, bool)
    blocked[stay] = True
    room = Removed.of_size(most, edges=corners.size)
    number = _remove(
        faces,
        points,
        z,
        z.size,
        starts,
        around,
        blocked,
        most,
        room.vertex,
        room.into,
        room.corners,
        room.weights,
        room.starts,
        room.edges,
    )
    return room.first(number), faces[faces[:, 0] >= 0]


def put_back(removed: Removed, points: Real, theta: float, u: Complex) -> bool:
    """Fill in positions of vertices that were taken out, the last one first; False where one has none.

    Each goes where the triangles around it have least energy, as far as none of them folds.

    Args:
        removed: what was taken out.
        points: (n, 3) vertices in space.
        theta: weight of the area part of the energy.
        u: (n,) positions, written for those that were taken out.
    """
    points = np.ascontiguousarray(points, np.float64)
    return bool(_put_back(*removed, removed.vertex.size, points, theta, SMALL_GAIN_SHARE, u))
