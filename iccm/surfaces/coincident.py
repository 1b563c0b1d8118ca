"""A map between two surfaces in the same place, such as a model and its subdivision: every point to the nearest one.

The target is cut along the source's seam, on its own edges, so that both layouts have the same outline. Newton's method
then starts next to its result, instead of searching for a correspondence of two outlines that were cut independently.
"""

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Index, Real
from ..errors import InputError
from ..maps.triangulated.map import TriangulatedMap
from ..meshes.cut import cut_along
from ..meshes.flatten import Flattening
from ..meshes.locate import barycentric
from ..meshes.patch import Patch
from ..meshes.topology import walk

ASTRAY_EDGES = 0.1
"""Distance from the source's seam, in edges of the target, that doubles the cost of a path."""
SPREAD_SHARE = 1e-3
"""Share by which places on an outline are moved towards even spacing, so that no two of them are the same."""


class Twin(NamedTuple):
    """A target that is cut along the same seam as the source.

    Attributes:
        patch: the target, cut.
        nodes: vertices of the source's mesh where its seam begins, ends or branches, and those of the target's mesh
            that are there.
    """

    patch: Patch
    nodes: dict[int, int]


def join_loops(patch: Patch) -> Patch:
    """Return a patch cut further along shortest paths until it has a single boundary loop."""
    while len(patch.loops) > 1:
        reach, predecessors = patch.paths(patch.loops[0], rims=False)
        end = min((vertex for loop in patch.loops[1:] for vertex in loop), key=lambda vertex: reach[vertex])
        joined = cut_along(patch, [walk(predecessors, int(end))])
        if len(joined.loops) >= len(patch.loops):
            raise InputError(f"{patch.mesh.name}: its holes cannot be joined by a cut")
        patch = joined
    return patch


def twin_of(source: Patch, whole: Patch) -> Twin:
    """Cut a surface along the seam of another one in the same place.

    Args:
        source: a disk.
        whole: the target, before it is cut.

    Raises:
        InputError: the target has no such seam, for example because it is too coarse.
    """
    branches = _branches(source)
    rim = np.unique(np.concatenate([np.zeros(0, np.int64), *whole.loops]))
    on_rim = np.zeros(len(whole.points), bool)
    on_rim[rim] = True
    on_source_rim = _own_rim(source)
    # without a seam, the outline begins anywhere
    ends = {int(v) for branch in branches for v in (branch[0], branch[-1])} or {
        int(source.vertex[source.loops[0][0]])
    }
    nodes = {v: _nearest(whole, source.mesh.points[v], on_rim == (v in on_source_rim)) for v in ends}
    if len(set(nodes.values())) < len(nodes):
        raise InputError(f"{whole.mesh.name}: is too coarse for the seam of {source.mesh.name}")
    free = ~on_rim
    free[list(nodes.values())] = False
    sides = whole.points[whole.faces]
    edge = float(np.median(np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2)))
    paths = []
    for branch in sorted(branches, key=len, reverse=True):
        start, end = (nodes[int(branch[k])] for k in (0, -1))
        away, _ = _along(source.mesh.points[branch], whole.points)
        free[[start, end]] = True
        usable = whole.drawn & free[whole.triangles.tail] & free[whole.triangles.head]
        factors = 1 + (away / (ASTRAY_EDGES * edge)) ** 2
        path = walk(whole.triangles.paths(whole.points, np.array([start]), usable, factors)[1], end)
        if path[-1] != start:
            raise InputError(f"{whole.mesh.name}: cannot be cut along the seam of {source.mesh.name}")
        free[path] = False
        paths.append(path)
    patch = cut_along(whole, paths)
    if len(patch.loops) != 1 or patch.genus:
        raise InputError(f"{whole.mesh.name}: the seam of {source.mesh.name} does not open it to a disk")
    return Twin(patch, {v: int(whole.vertex[node]) for v, node in nodes.items()})


def map_by_nearest_points(source: Flattening, target: Flattening, nodes: dict[int, int]) -> TriangulatedMap:
    """Return the map from one layout to another of a surface in the same place; some triangles may be flipped.

    Args:
        source: layout of a disk.
        target: layout of the target, cut by `twin_of`.
        nodes: see `Twin`.

    Raises:
        InputError: the parts of both outlines between nodes do not correspond.
    """
    import igl

    patch, target_patch = source.patch, target.patch
    faces = np.ascontiguousarray(patch.faces)
    _, face, foot = igl.point_mesh_squared_distance(
        np.ascontiguousarray(target_patch.points), np.ascontiguousarray(patch.points), faces
    )
    weights = barycentric(patch.points[faces[face]], foot)
    z: Complex = (weights * source.flat[faces[face]]).sum(axis=1)
    parts = _parts(source.loop, patch.vertex, nodes.keys())
    target_parts = _parts(target.loop, target_patch.vertex, nodes.values())
    ends = [tuple(nodes[int(v)] for v in patch.vertex[part[[0, -1]]]) for part in parts]
    target_ends = [tuple(target_patch.vertex[part[[0, -1]]].tolist()) for part in target_parts]
    turns = [k for k in range(len(ends)) if ends[k:] + ends[:k] == target_ends]
    if not turns:
        raise InputError(f"{target_patch.mesh.name}: its outline differs from that of {patch.mesh.name}")
    for part, target_part in zip(parts[turns[0] :] + parts[: turns[0]], target_parts):
        _, shares = _along(patch.points[part], target_patch.points[target_part])
        z[target_part] = np.interp(_ascending(shares), _shares(patch.points[part]), source.flat[part])
    return TriangulatedMap(z, target.flat, target_patch.faces, (target.loop,))


def _own_rim(patch: Patch) -> set[int]:
    """Return the vertices of the mesh on the boundary that a patch had before it was cut."""
    rim = np.flatnonzero(patch.triangles.twin < 0)
    edges = np.sort(patch.vertex[np.column_stack([patch.triangles.tail[rim], patch.triangles.head[rim]])])
    seam = set(map(tuple, np.sort(patch.seam).tolist()))
    return {v for edge in edges.tolist() if tuple(edge) not in seam for v in edge}


def _branches(patch: Patch) -> list[Index]:
    """Return the vertices of the mesh along each part of a seam between places where it begins, ends or branches."""
    neighbours = dict[int, list[int]]()
    for a, b in np.unique(np.sort(patch.seam), axis=0).tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    rim = _own_rim(patch)
    ends = {v for v, around in neighbours.items() if len(around) != 2 or v in rim}
    branches = []
    for end in sorted(ends):
        for second in neighbours[end]:
            path = [end, second]
            while path[-1] not in ends:
                path.append(next(v for v in neighbours[path[-1]] if v != path[-2]))
            if path <= path[::-1]:  # each branch is found from both ends
                branches.append(np.array(path))
    return branches


def _nearest(whole: Patch, point: Real, usable: np.ndarray) -> int:
    """Return the vertex nearest to a point (3,) among those marked in `usable` (p,)."""
    if not usable.any():
        raise InputError(f"{whole.mesh.name}: has no boundary where the source has one")
    return int(np.argmin(np.where(usable, ((whole.points - point) ** 2).sum(axis=1), np.inf)))


def _parts(loop: Index, vertex: Index, nodes: Iterable[int]) -> list[Index]:
    """Return the vertices of a loop from each node to the next, both included, in order.

    Args:
        loop: (b,) vertices of a patch.
        vertex: (p,) the mesh's vertex for each of the patch.
        nodes: vertices of the mesh.
    """
    stops = np.flatnonzero(np.isin(vertex[loop], list(nodes)))
    around = np.append(stops, stops[:1] + loop.size)
    return [loop[np.arange(a, b + 1) % loop.size] for a, b in pairwise(around.tolist())]


def _shares(points: Real) -> Real:
    """Return the shares (n,) of the length of a polyline (n, 3) at its vertices."""
    lengths = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return lengths / lengths[-1]


def _along(line: Real, points: Real) -> tuple[Real, Real]:
    """Return the distances (p,) of points (p, 3) to a polyline (n, 3), and the shares of its length at the nearest."""
    away, nearest, shares = np.full(len(points), np.inf), np.zeros(len(points)), _shares(line)
    for k, (tail, head) in enumerate(pairwise(line)):
        step = head - tail
        share = np.clip((points - tail) @ step / max(float(step @ step), 1e-300), 0, 1)
        distances = np.linalg.norm(points - tail - share[:, None] * step, axis=1)
        closer = distances < away
        away[closer] = distances[closer]
        nearest[closer] = (shares[k] + share * (shares[k + 1] - shares[k]))[closer]
    return away, nearest


def _ascending(shares: Real) -> Real:
    """Return shares (n,) along a line, from 0 to 1, such that each is larger than the one before."""
    shares = np.maximum.accumulate(shares)
    shares[0], shares[-1] = 0, 1
    return (1 - SPREAD_SHARE) * shares + SPREAD_SHARE * np.linspace(0, 1, shares.size)
