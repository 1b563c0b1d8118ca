"""Transfer a seam to another surface of similar proportions.

It is moved to the points with the same geodesic distances from landmarks.
"""

from itertools import pairwise

import numpy as np

from ..arrays import Flags, Index, Real
from ..meshes.cut import path_through
from ..meshes.geodesics import GeodesicGraph
from ..meshes.locate import barycentric
from ..meshes.mesh import face_areas
from ..meshes.patch import Patch, patch_of
from .refined import ON_EDGE_BARYCENTRIC, RefinedSurface

FINE_TRIANGLES, MOST_HALVINGS = 10_000, 3
"""Triangles that are enough for the paths, and how often edges are halved at most to get them, which bounds the
time."""
SAMPLES_PER_EDGE = 8  # samples of each edge of a seam
ASTRAY_DISTANCE_SHARE = 0.01
"""Difference of distances that doubles the cost of a path, as a share of the root of the area: what the eye takes
for another place."""


def subdivide(points: Real, faces: Index) -> RefinedSurface:
    """Halve all edges of a closed surface until it has FINE_TRIANGLES, or MOST_HALVINGS times."""
    fine = RefinedSurface.of(faces, len(points))
    for _ in range(MOST_HALVINGS):
        if len(fine.faces) < FINE_TRIANGLES:
            fine = fine.without_chords(np.ones(fine.count, bool))
    return fine


def distances(fine: RefinedSurface, points: Real, stops: Index) -> Real:
    """Return (n, k) geodesic distances from vertices, relative to the root of the area.

    Paths are straight within the original triangles and bend at vertices on their edges, which makes them 0.2 to 0.7 %
    too long (medians on two capsules).

    Args:
        fine: the subdivided triangles, see `subdivide`.
        points: (n, 3) their vertices.
        stops: (k,) vertices from which to measure.
    """
    area = face_areas(points[fine.faces]).sum()
    return GeodesicGraph.within(points, _lattices(fine)).distances(stops).T / np.sqrt(area)


def _lattices(fine: RefinedSurface) -> Index:
    """Return (m, p) the vertices on each of the original triangles; the number p is the same for all."""
    keys = np.unique(np.repeat(fine.original, 3) * fine.count + fine.faces.ravel())
    return (keys % fine.count).reshape(fine.original.max() + 1, -1)


def same_way(source: Patch, target: Patch, stops: Index, path: list[int]) -> Real:
    """Return (p, 3) the path on the source that corresponds to a path on the target.

    It is straight between consecutive points, within the source's triangles.

    Args:
        source: a closed surface.
        target: as above.
        stops: (k, 2) landmarks, vertices of both, in order.
        path: vertices of the target along the path through the landmarks.

    Raises:
        InputError: the path would cross itself.
    """
    fine_source = subdivide(source.points, source.faces)
    fine_target = subdivide(target.points, target.faces)
    points = fine_source.carried(source.points)
    source_distances = distances(fine_source, points, stops[:, 0])
    target_distances = distances(fine_target, fine_target.carried(target.points), stops[:, 1])
    source_distances = source_distances * _detour(
        source_distances[stops[:, 0]], target_distances[stops[:, 1]]
    )
    whole = patch_of(source.mesh.name, points, fine_source.faces)
    ends = [path.index(stop) for stop in stops[:, 1]]
    length_factors = [
        1 + (_off(source_distances, target_distances[path[i : j + 1]]) / ASTRAY_DISTANCE_SHARE) ** 2
        for i, j in pairwise(ends)
    ]
    points_on_path = points[path_through(whole, stops[:, 0].tolist(), length_factors)]
    return points_on_path[_on_edges(source, points_on_path)]


def _detour(source: Real, target: Real) -> Real:
    """Return (k,) median ratios of distances (k, k) between landmarks, on the target relative to the source."""
    is_other = ~np.eye(len(source), dtype=bool)
    return np.array([np.median(b[on] / a[on]) for a, b, on in zip(source.T, target.T, is_other)])


def _off(values: Real, goals: Real) -> Real:
    """Return (n,) distances of values (n, k) to the polyline of goals (p, k)."""
    from scipy.spatial import cKDTree

    share = np.arange(SAMPLES_PER_EDGE)[:, None, None] / SAMPLES_PER_EDGE
    samples = (goals[:-1] * (1 - share) + goals[1:] * share).reshape(-1, goals.shape[1])
    return cKDTree(np.concatenate([samples, goals[-1:]])).query(values)[0]


def _on_edges(whole: Patch, points: Real) -> Flags:
    """Mark (p,) the points (p, 3) of a surface that are on its edges."""
    import igl

    faces = np.ascontiguousarray(whole.faces)
    _, face, foot = igl.point_mesh_squared_distance(points, np.ascontiguousarray(whole.points), faces)
    weights = barycentric(whole.points[faces[face]], foot)
    return np.asarray((weights < ON_EDGE_BARYCENTRIC).any(axis=1))
