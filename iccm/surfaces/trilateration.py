"""The seam of one surface as it runs on another one that is about as long everywhere: where geodesic distances from
landmarks are the same."""

from itertools import pairwise

import numpy as np

from ..arrays import Flags, Index, Real
from ..meshes.cut import way_through
from ..meshes.geodesics import GeodesicGraph
from ..meshes.locate import barycentric
from ..meshes.mesh import Mesh, face_areas
from ..meshes.patch import Patch
from ..meshes.topology import Triangles
from .refined import ON_EDGE_BARYCENTRIC, RefinedSurface

FINE_TRIANGLES, MOST_HALVINGS = 10_000, 3
"""Triangles on which ways are looked for, and how often edges are halved at most (by hand)."""
SAMPLES_PER_EDGE = 8  # of each edge of a seam
ASTRAY_DISTANCE_SHARE = (
    0.01  # of the root of the area: difference of distances that makes a way twice as long, by hand
)


def subdivide(points: Real, faces: Index) -> RefinedSurface:
    """Triangles of a closed surface with all edges halved, and again, until they are fine."""
    fine = RefinedSurface.of(faces, len(points))
    for _ in range(MOST_HALVINGS):
        if len(fine.faces) < FINE_TRIANGLES:
            fine = fine.without_chords(np.ones(fine.count, bool))
    return fine


def distances(fine: RefinedSurface, points: Real, stops: Index) -> Real:
    """Return (n, k) geodesic distances from vertices, the area taken as one: along ways that are straight within the
    first mesh's triangles and change direction at vertices on their edges, so 0.2 to 0.7 % too long (medians of two
    capsules).

    Args:
        fine: triangles halved, see `subdivide`.
        points: (n, 3) its vertices.
        stops: (k,) vertices.
    """
    area = face_areas(points[fine.faces]).sum()
    return GeodesicGraph.within(points, _lattices(fine)).distances(stops).T / np.sqrt(area)


def _lattices(fine: RefinedSurface) -> Index:
    """Return (m, p) vertices on each of the first triangles; all have as many."""
    keys = np.unique(np.repeat(fine.own, 3) * fine.count + fine.faces.ravel())
    return (keys % fine.count).reshape(fine.own.max() + 1, -1)


def same_way(source: Patch, target: Patch, stops: Index, way: list[int]) -> Real:
    """Return (p, 3) where a way on the target runs on the source, in straight lines from point to point on its
    triangles.

    Args:
        source: a closed surface.
        target: as above.
        stops: (k, 2) landmarks, vertices of both, in order.
        way: vertices of the target, through the landmarks.

    Raises:
        InputError: it would cross itself.
    """
    fine, other = (subdivide(each.points, each.faces) for each in (source, target))
    points = fine.carried(source.points)
    here = distances(fine, points, stops[:, 0])
    there = distances(other, other.carried(target.points), stops[:, 1])
    here = here * _detour(here[stops[:, 0]], there[stops[:, 1]])
    mesh = Mesh.triangles(source.mesh.name, points, fine.faces)
    whole = Patch(
        mesh,
        points,
        Triangles(fine.faces, fine.count),
        np.arange(fine.count),
        np.arange(3 * len(fine.faces)).reshape(-1, 3),
    )
    ends = [way.index(stop) for stop in stops[:, 1]]
    dear = [1 + (_off(here, there[way[i : j + 1]]) / ASTRAY_DISTANCE_SHARE) ** 2 for i, j in pairwise(ends)]
    found = points[way_through(whole, stops[:, 0].tolist(), dear)]
    return found[_on_edges(source, found)]


def _detour(here: Real, there: Real) -> Real:
    """Return (k,) by how much distances (k, k) from each landmark to the others are longer there."""
    others = ~np.eye(len(here), dtype=bool)
    return np.array([np.median(b[on] / a[on]) for a, b, on in zip(here.T, there.T, others)])


def _off(values: Real, goals: Real) -> Real:
    """Return (n,) distances of values (n, k) to the polyline of goals (p, k)."""
    from scipy.spatial import cKDTree

    share = np.arange(SAMPLES_PER_EDGE)[:, None, None] / SAMPLES_PER_EDGE
    samples = (goals[:-1] * (1 - share) + goals[1:] * share).reshape(-1, goals.shape[1])
    return cKDTree(np.concatenate([samples, goals[-1:]])).query(values)[0]


def _on_edges(whole: Patch, points: Real) -> Flags:
    """Return (p,) which points (p, 3) of a surface are on its edges."""
    import igl

    faces = np.ascontiguousarray(whole.faces)
    _, face, foot = igl.point_mesh_squared_distance(points, np.ascontiguousarray(whole.points), faces)
    weights = barycentric(whole.points[faces[face]], foot)
    return np.asarray((weights < ON_EDGE_BARYCENTRIC).any(axis=1))
