"""Find a layout on coarser triangulations of the same surface first.

Vertices are removed in rounds of vertices that are not neighbours. Each is collapsed into a neighbour (half-edge
collapse) so that no triangle folds in the layout. They are restored in the opposite order: each goes to its place in
the triangle that contained it, or closer to the neighbour if a triangle would fold there, and from there to where the
triangles around it have the least energy, again without folds. After Hormann, Greiner and Campagna, *Hierarchical
parametrization of triangulated surfaces*, 1999.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..balanced.minimise.energy import SOURCE_AREA
from ..meshes.flatten import Flattening
from ..meshes.mesh import with_unit_area
from ..meshes.patch import Patch, patch_of
from ..native import function
from ..sorting import grouped
from .free import LARGE_VERTEX_COUNT, SMALL_GAIN_SHARE, Elastic, surface

COARSER_FACTOR = 8  # ratio of vertices between triangulations; a Newton step costs that much less
LEAST_REMOVED_SHARE = 0.1
"""Share of the vertices that a round must remove to be worth another; below it, the triangulation is about as coarse
as its shapes allow."""
NONE = np.empty(0, np.int64)

_remove = function(
    """int64_t iccm_flattening_remove(
        int64_t *faces, const double *points, bool polar, const Complex *z, int64_t n, const int64_t *starts,
        const int64_t *around, bool *blocked, int64_t most, int64_t *vertex, int64_t *into, int64_t *triangle,
        double *weights, int64_t *ends, int64_t *edges)"""
)
_put_back = function(
    """int64_t iccm_flattening_put_back(
        const int64_t *vertex, const int64_t *into, const int64_t *triangle, const double *weights,
        const int64_t *starts, const int64_t *edges, int64_t count, const double *points, double theta,
        double q, double share, double min_gain, Complex *u)"""
)
_smooth = function(
    """int64_t iccm_flattening_smooth(
        const int64_t *faces, const double *points, int64_t n, const int64_t *starts, const int64_t *around,
        const bool *held, const Complex *forces, int64_t sweeps, double theta, double q, double share,
        double min_gain, Complex *u)"""
)
_gradient = function(
    """double iccm_flattening_gradient(
        const int64_t *faces, const double *points, int64_t n, int64_t m, double theta, double q, double share,
        const Complex *u, Complex *slopes)"""
)
_interpolate = function(
    """int64_t iccm_flattening_interpolate(
        const int64_t *vertex, const int64_t *triangle, const double *weights, int64_t count, Complex *step)"""
)
_restrict = function(
    """int64_t iccm_flattening_restrict(
        const int64_t *vertex, const int64_t *triangle, const double *weights, int64_t count, Complex *forces)"""
)


class Removed(NamedTuple):
    """Vertices that were removed, in this order.

    Attributes:
        vertex: (r,) their numbers.
        into: (r,) the neighbour that each was collapsed into.
        corners: (r, 3) the triangle that then contained it.
        weights: (r, 3) its barycentric coordinates there.
        starts: (r + 1,) where the edges around each begin in `edges`.
        edges: (e, 2) the edges opposite each, counter-clockwise.
    """

    vertex: Index
    into: Index
    corners: Index
    weights: Real
    starts: Index
    edges: Index

    @classmethod
    def of_size(cls, count: int, edges: int) -> "Removed":
        """Allocate room for `count` vertices and `edges` edges around them."""
        return cls(
            vertex=np.empty(count, np.int64),
            into=np.empty(count, np.int64),
            corners=np.empty((count, 3), np.int64),
            weights=np.empty((count, 3)),
            starts=np.zeros(count + 1, np.int64),
            edges=np.empty((edges, 2), np.int64),
        )

    def first(self, count: int) -> "Removed":
        """Return the first `count` vertices."""
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
        """Concatenate the vertices of several rounds."""
        offsets = np.cumsum([0, *(len(removed.edges) for removed in rounds)])
        starts = [removed.starts[:-1] + offset for removed, offset in zip(rounds, offsets)]
        return cls(
            vertex=np.concatenate([removed.vertex for removed in rounds]),
            into=np.concatenate([removed.into for removed in rounds]),
            corners=np.concatenate([removed.corners for removed in rounds]),
            weights=np.concatenate([removed.weights for removed in rounds]),
            starts=np.concatenate([*starts, offsets[-1:]]),
            edges=np.concatenate([removed.edges for removed in rounds]),
        )


def by_coarser(
    sheet: Elastic,
    points: Real,
    u: Complex,
    theta: float,
    solve: Callable[[Elastic, Index], Complex],
    stay: Index = NONE,
) -> Complex:
    """Return (n,) positions with less energy, found by way of a coarser triangulation.

    Returns the given positions where the surface is small, or the coarser triangulation does not help.

    Args:
        sheet: the surface, all of whose vertices move.
        points: (n, 3) vertices in space.
        u: (n,) positions in the plane without folds, scaled to a total area of one.
        theta: weight of the area part of the energy.
        solve: returns positions (k,) without folds on the coarser surface, given that surface and the numbers (k,) of
            its vertices.
        stay: vertices that must not be removed.
    """
    small = much_coarser(points, sheet.faces, u, LARGE_VERTEX_COUNT, stay)
    if small is None:
        return u
    vertices, faces, removed = small
    new_u = u.copy()
    new_u[vertices] = solve(surface(points[vertices], faces), vertices)
    unit = with_unit_area(points, sheet.faces)
    better = reinsert_vertices(removed, unit, theta, new_u) and sheet.energy(new_u, theta) < sheet.energy(
        u, theta
    )
    return new_u if better else u


def coarser_layout(layout: Flattening, large: int) -> tuple[Flattening, Index] | None:
    """Return a layout without folds on a coarser triangulation, with the numbers (k,) of its vertices.

    It is a separate mesh; the numbers are those of the patch's vertices behind its own. Returns None where the surface
    has fewer vertices than `large`, or cannot be coarsened enough.
    """
    patch = layout.patch
    small = much_coarser(patch.points, patch.faces, layout.flat, large, NONE)
    if small is None:
        return None
    vertices, faces, _ = small
    coarse = patch_of(patch.mesh.name, patch.points[vertices], faces)
    loop = same_loop(coarse, vertices, layout.loop)
    if loop is None:
        return None
    return replace(layout, patch=coarse, flat=layout.flat[vertices], loop=loop), vertices


def same_loop(coarse: Patch, vertices: Index, loop: Index) -> Index | None:
    """Return the boundary loop of a coarser triangulation that is left of a loop of the finer one, if there is one.

    Args:
        coarse: the coarser triangulation.
        vertices: (k,) the numbers of its vertices in the finer one.
        loop: vertices of the finer one.
    """
    return next((own for own in coarse.loops if np.isin(vertices[own], loop).all()), None)


def much_coarser(
    points: Real, faces: Index, z: Complex | None, large: int, stay: Index
) -> tuple[Index, Index, Removed] | None:
    """Return the vertices (k,) that remain, the triangles (m, 3) between them, and what was removed.

    None where there are fewer than `large` vertices, or more than half of them would remain. For z see `coarser`.
    """
    count = len(points)
    if count < large:
        return None
    coarse, removed = coarser(points, faces, z, count // COARSER_FACTOR, stay)
    vertices = np.unique(coarse)
    return None if 2 * vertices.size > count else (vertices, np.searchsorted(vertices, coarse), removed)


def coarser(
    points: Real, faces: Index, z: Complex | None, goal: int, stay: Index = NONE
) -> tuple[Index, Removed]:
    """Coarsen triangles to about `goal` vertices, or as few as possible, without folds in the layout z (n,).

    Without a layout, triangles do not fold in the geodesic polar map around each vertex that is removed (as Lee et al.,
    *MAPS: multiresolution adaptive parameterization of surfaces*, 1998), so that the result is still a triangulation of
    the same surface, except where it is bent too sharply. The vertices `stay` are kept.

    Returns (k, 3) triangles and what was removed.
    """
    faces, points = np.array(faces, np.int64), np.ascontiguousarray(points, np.float64)
    z = None if z is None else np.ascontiguousarray(z, np.complex128)
    rounds: list[Removed] = []
    remaining = len(points)
    while remaining > goal:
        # The vertices of a round are not neighbours: with degree six, that is at most a third of all vertices.
        most = min(remaining - goal, remaining // 3 + 1)
        removed, faces = _remove_round(points, faces, z, most, stay)
        rounds.append(removed)
        remaining -= removed.vertex.size
        if removed.vertex.size < LEAST_REMOVED_SHARE * remaining:
            break
    return faces, Removed.joined(rounds)


def _remove_round(
    points: Real, faces: Index, z: Complex | None, most: int, stay: Index
) -> tuple[Removed, Index]:
    """Remove at most `most` vertices that are not neighbours; return them, and the triangles (m, 3) that are left."""
    starts, around = _stars(faces, len(points))
    blocked = np.zeros(len(points), bool)
    blocked[stay] = True
    room = Removed.of_size(most, edges=faces.size)
    number = _remove(
        faces,
        points,
        z is None,
        np.empty(0, np.complex128) if z is None else z,
        len(points),
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


def _stars(faces: Index, count: int) -> tuple[Index, Index]:
    """Return the triangles of each vertex: those of vertex v are around[starts[v] : starts[v + 1]]."""
    corners, starts = grouped(faces.ravel(), count)
    return starts, corners // 3


def reinsert_vertices(
    removed: Removed, points: Real, theta: float, u: Complex, *, q: float = 1.0, share: float = SOURCE_AREA
) -> bool:
    """Restore the positions of removed vertices, the last one first; return False where one has no place.

    Each goes to where the triangles around it have the least energy without folding.

    Args:
        removed: what was removed.
        points: (n, 3) vertices in space.
        theta: weight of the area part of the energy.
        u: (n,) positions; those of the removed vertices are written.
        q, share: see `Objective`.
    """
    points = np.ascontiguousarray(points, np.float64)
    return bool(_put_back(*removed, removed.vertex.size, points, theta, q, share, SMALL_GAIN_SHARE, u))


def smooth(
    faces: Index,
    points: Real,
    fixed: Flags,
    sweeps: int,
    theta: float,
    u: Complex,
    *,
    forces: Complex | None = None,
    q: float = 1.0,
    share: float = SOURCE_AREA,
) -> None:
    """Move vertices one after the other to where the triangles around them have the least energy, without folds.

    Args:
        faces: (m, 3) triangles.
        points: (n, 3) vertices in space.
        fixed: (n,) vertices that stay.
        sweeps: number of times that each vertex is moved.
        theta: weight of the area part of the energy.
        u: (n,) positions without folds, changed in place.
        forces: (n,) on the vertices, whose work is subtracted from the energy; None if there are none.
        q, share: see `Objective`.
    """
    forces = np.zeros(u.size, np.complex128) if forces is None else forces
    starts, around = _stars(faces, u.size)
    points = np.ascontiguousarray(points, np.float64)
    gain = SMALL_GAIN_SHARE
    _smooth(faces, points, u.size, starts, around, fixed, forces, sweeps, theta, q, share, gain, u)


def gradient(
    faces: Index, points: Real, theta: float, u: Complex, *, q: float = 1.0, share: float = SOURCE_AREA
) -> tuple[float, Complex]:
    """Return the energy of positions u (n,), infinite with folds, and its gradient (n,).

    Needs no sparsity pattern, unlike `energy.assemble`. Arguments are as in `smooth`.
    """
    slopes, points = np.empty(u.size, np.complex128), np.ascontiguousarray(points, np.float64)
    energy = _gradient(faces, points, u.size, len(faces), theta, q, share, u, slopes)
    return float(energy), slopes


def interpolate(removed: Removed, step: Complex) -> None:
    """Interpolate displacements (n,) linearly at the removed vertices, in place."""
    _interpolate(removed.vertex, removed.corners, removed.weights, removed.vertex.size, step)


def restrict(removed: Removed, forces: Complex) -> None:
    """Transfer forces (n,) on removed vertices to the others, in place, by the transpose of `interpolate`.

    Those on removed vertices are then meaningless.
    """
    _restrict(removed.vertex, removed.corners, removed.weights, removed.vertex.size, forces)
