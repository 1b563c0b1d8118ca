"""Insert vertices at given points of a surface, and edges along straight paths between them."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Index, Real
from ..meshes.locate import barycentric
from ..meshes.mesh import Mesh
from ..meshes.patch import Patch
from .refined import RefinedSurface

NEAR_BARYCENTRIC = 0.03
"""Barycentric coordinate below which a point is moved to the opposite edge, which avoids thin triangles."""
MOST_CROSSED_TRIANGLES = 1000
"""Most triangles that a path may cross between two of its points (far more than usual), which bounds the time."""


class Opening(NamedTuple):
    """A closed surface with triangles split so that it can be cut along edges through points (p, 3)."""

    mesh: Mesh
    points: Real


def with_vertices(whole: Patch, points: Real) -> Mesh:
    """Return the triangles of a patch with a vertex at the surface point nearest to each of the points (k, 3).

    New vertices come after the mesh's own; their texture coordinates are interpolated linearly.
    """
    return _as_mesh(whole, _at_points(whole, points)[0])


def with_way(whole: Patch, points: Real) -> Opening | None:
    """Insert points (k, 3) as `with_vertices` does, and edges along the straight path from each point to the next.

    Returns None where the path crosses itself or does not arrive.
    """
    refined, stops = _at_points(whole, points)
    path = stops[:1]
    for stop in stops[1:]:
        if stop != path[-1]:
            refined, crossed = _insert_line(refined, whole.mesh.points, path[-1], stop)
            path += crossed
    joined = {(a, b) for face in refined.faces.tolist() for a, b in pairwise([*face, face[0]])}
    if len(set(path)) < len(path) or not joined.issuperset(pairwise(path)):
        return None
    mesh = _as_mesh(whole, refined)
    return Opening(mesh, mesh.points[path])


def _at_points(whole: Patch, points: Real) -> tuple[RefinedSurface, list[int]]:
    """Return the surface with vertices at the points (k, 3), and the numbers of these vertices."""
    space, numbers = whole.mesh.points, []
    refined = RefinedSurface.of(whole.vertex[whole.faces], len(space))
    for point in points:
        refined, number = refined.with_point(*_nearest(refined.carried(space), refined.faces, point))
        numbers.append(number)
    return refined, numbers


def _insert_line(
    refined: RefinedSurface, points: Real, vertex: int, end: int
) -> tuple[RefinedSurface, list[int]]:
    """Insert edges from one vertex to another, each step in the plane through the surface normal and the end point.

    Args:
        refined: the triangles.
        points: (n, 3) positions of the original mesh.
        vertex: vertex where the path begins.
        end: vertex where it ends.

    Returns:
        The refined triangles and the vertices on the path after `vertex`. If the path does not arrive, it stops short
        of `end`.
    """
    path: list[int] = []
    for _ in range(MOST_CROSSED_TRIANGLES):
        fan = np.flatnonzero((refined.faces == vertex).any(axis=1))
        corners = refined.faces[fan]
        if (corners == end).any():
            return refined, [*path, end]
        corners = np.take_along_axis(
            corners, (np.argmax(corners == vertex, 1)[:, None] + np.arange(3)) % 3, 1
        )
        space = refined.carried(points)
        crossing = _crossing(space[corners], space[end])
        if crossing is None:
            break
        t, share = crossing
        place = np.where(refined.faces[fan[t]] == corners[t, 2], share, 1 - share)
        refined, vertex = refined.with_point(fan[t], np.where(refined.faces[fan[t]] == vertex, 0, place))
        path.append(vertex)
    return refined, path


def _crossing(fan: Real, end: Real) -> tuple[int, float] | None:
    """Find the triangle of a vertex's fan that the straight path to a point crosses.

    Args:
        fan: (k, 3, 3) corners of the triangles, the vertex first.
        end: (3,) the point.

    Returns:
        The triangle, and where the path leaves it on the opposite side (0 to 1), snapped to a corner if that is close.
        None where no triangle lies ahead.
    """
    sides = fan[:, 1:] - fan[:, :1]
    normal = np.cross(sides[:, 0], sides[:, 1]).sum(axis=0)
    ahead = end - fan[0, 0]
    offsets = sides @ np.cross(normal, ahead)
    gap = offsets[:, 0] - offsets[:, 1]
    share = np.divide(offsets[:, 0], gap, out=np.full(len(fan), -1.0), where=gap != 0)
    distances = (sides[:, 0] + share[:, None] * (sides[:, 1] - sides[:, 0])) @ ahead
    distances[(share < 0) | (share > 1)] = 0
    t = int(np.argmax(distances))
    if distances[t] <= 0:
        return None
    ends_nearby = np.array([0.0, 1.0])[np.abs(share[t] - [0, 1]) < NEAR_BARYCENTRIC]
    return t, float(ends_nearby[0] if ends_nearby.size else share[t])


def _as_mesh(whole: Patch, refined: RefinedSurface) -> Mesh:
    mesh, faces = whole.mesh, whole.vertex[whole.faces]
    space = refined.carried(mesh.points)
    attributes: dict[str, Any] = {"base": mesh.base, "whole": mesh.whole}
    if mesh.uv is None or mesh.uv_corners is None:
        return Mesh.triangles(mesh.name, space, refined.faces, **attributes)
    corners = mesh.uv_corners[whole.corner][refined.original]
    split = np.flatnonzero(np.any(refined.faces != faces[refined.original], axis=1))
    originals = np.repeat(refined.original[split], 3)
    weights = barycentric(mesh.points[faces[originals]], space[refined.faces[split]].reshape(-1, 3))
    uv = np.einsum("pk,pkc->pc", weights, mesh.uv[mesh.uv_corners[whole.corner]][originals])
    has_uv = corners[split].min(axis=1, keepdims=True) >= 0
    numbers = len(mesh.uv) + np.arange(len(uv)).reshape(-1, 3)
    corners[split] = np.where(has_uv, numbers, -1)
    attributes |= {"uv": np.concatenate([mesh.uv, uv]), "uv_corners": corners.ravel()}
    return Mesh.triangles(mesh.name, space, refined.faces, **attributes)


def _nearest(points: Real, faces: Index, point: Real) -> tuple[int, Real]:
    """Return the triangle with the point nearest to the given one, and that point's barycentric coordinates (3,)."""
    import igl

    faces = np.ascontiguousarray(faces)
    _, face, foot = igl.point_mesh_squared_distance(point[None], np.ascontiguousarray(points), faces)
    face = int(np.ravel(face)[0])
    weights = barycentric(points[faces[face]][None], np.reshape(foot, (1, 3)))[0]
    weights = np.where(weights < NEAR_BARYCENTRIC, 0, weights)
    return face, weights / weights.sum()
