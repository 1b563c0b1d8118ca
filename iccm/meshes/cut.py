"""Cut a surface open into a disk.

Closed surfaces are cut along a path, handles along short loops; further cuts relieve stretch.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import minimum_spanning_tree

from ..arrays import Index, Real
from ..errors import InputError
from .geodesics import GeodesicGraph
from .patch import Patch
from .topology import Triangles, walk

MOST_GEODESIC_TRIANGLES = 100_000
"""With more triangles, paths along edges are used: geodesics would take too long, and edges are short."""
CORRIDOR_EDGES = 2.0
"""Width, in mean edge lengths, of the corridor around an approximate shortest path in which it is refined:
shortest paths of usual meshes stay inside.
"""
PARTS_OF_EDGE = 32
"""Parts of an edge near a geodesic; with these, maps of four models by landmarks are the same as with exact
geodesics.
"""
MOST_KEPT_PATHS = 64
"""Number of cached paths: orders of up to six landmarks share 30 on each of two surfaces."""


def open_to_disk(whole: Patch) -> Patch:
    """Return a disk, with or without holes: closed surfaces are cut between distant vertices, handles along loops."""
    if whole.genus:
        result = whole.cut(_on(whole, *handle_loops(whole)))
        if (
            result.genus or result.triangles.components().any()
        ):  # loops that touch a hole twice divide the surface
            result = whole.cut(_on(whole, *spanning_cut(whole)))
        return result
    farthest = int(np.argmax(whole.paths(np.array([whole.first_vertex]))[0]))
    reach, predecessors = whole.paths(np.array([farthest]))
    path = walk(predecessors, int(np.argmax(reach)))
    if len(path) == 2:  # a single edge does not open a surface
        path = _detour(whole, path)
    return whole.cut(_on(whole, np.array(path[:-1]), np.array(path[1:])))


def cut_through(whole: Patch, stops: Sequence[int]) -> Patch:
    """Cut a closed surface without handles along paths through vertices.

    The paths are close to geodesics, so that they hardly depend on the triangulation.
    """
    return cut_along_path(whole, path_through(whole, stops))


def cut_along_path(whole: Patch, path: Sequence[int]) -> Patch:
    """Cut a closed surface without handles along a path of vertices."""
    if len(path) == 2:  # a single edge does not open a surface
        path = _detour(whole, list(path))
    return whole.cut(_on(whole, np.array(path[:-1]), np.array(path[1:])))


def path_through(
    whole: Patch, stops: Sequence[int], length_factors: Sequence[Real] | None = None
) -> list[int]:
    """Return the vertices along paths from each of some vertices to the next.

    The paths touch neither each other nor the other vertices.

    Args:
        whole: a closed surface.
        stops: (k,) vertices.
        length_factors: for each path, (n,) factors of lengths; by default they are large away from geodesics.

    Raises:
        InputError: there are no such paths.
    """
    free, path = np.ones(whole.triangles.count, bool), list(stops[:1])
    small = len(whole.faces) <= MOST_GEODESIC_TRIANGLES
    free[list(stops)] = False
    for k, (start, end) in enumerate(pairwise(stops)):
        joined = ((whole.faces == start).any(axis=1) & (whole.faces == end).any(axis=1)).any()
        if joined and length_factors is None:
            path.append(end)
            continue
        corridor = _beside_geodesic(whole, start, end) if small and length_factors is None else None
        factors = corridor if length_factors is None else length_factors[k]
        free[[start, end]] = True
        usable = whole.drawn & free[whole.triangles.tail] & free[whole.triangles.head]
        part = walk(whole.triangles.paths(whole.points, np.array([start]), usable, factors)[1], end)
        if part[-1] != start:
            raise InputError(
                f"{whole.mesh.name}: no cut passes through the pins in their order without crossing "
                "itself; remove some pins, or change their order"
            )
        free[part] = False
        path += part[-2::-1]
    return path


@lru_cache(maxsize=MOST_KEPT_PATHS)
def _beside_geodesic(whole: Patch, start: int, end: int) -> Real:
    """Return (n,) factors of lengths for paths close to the geodesic between two vertices.

    They are 1 on the geodesic, and large at an edge's distance from it. A detour through a vertex at a small
    distance x from the middle of a geodesic of length L is longer by 2x²/L.
    """
    from scipy.spatial import cKDTree

    ends = whole.points[whole.triangles.tail], whole.points[whole.triangles.head]
    edge = np.linalg.norm(ends[0] - ends[1], axis=1).mean()
    graph = GeodesicGraph.of(whole.points, whole.triangles)
    away = cKDTree(graph.path(start, end)).query(whole.points)[0] / edge
    corridor = whole.faces[(away < CORRIDOR_EDGES)[whole.faces].any(axis=1)]
    narrow = GeodesicGraph.of(whole.points, Triangles(corridor, whole.triangles.count), PARTS_OF_EDGE)
    from_start, from_end = narrow.distances(np.array([start, end]))[:, : whole.triangles.count]
    detour = np.maximum(from_start + from_end - from_start[end], 0) * from_start[end] / edge**2
    return 1 + np.where(np.isfinite(detour), detour, 2 * away**2)


def extend_cut(opening: Patch, to: int) -> Patch:
    """Return the patch cut further, along the shortest path from its boundary to one of its inner vertices."""
    border = np.unique(np.concatenate(opening.loops))
    return cut_along(opening, [walk(opening.paths(border)[1], to)])


def cut_along(opening: Patch, paths: Sequence[Sequence[int]]) -> Patch:
    """Return the patch cut along paths of vertices, or the patch itself if they have no edges."""
    ends = np.array([edge for path in paths for edge in pairwise(path)], np.int64).reshape(-1, 2)
    return opening.cut(_on(opening, *ends.T)) if ends.size else opening


def vertex_path(patch: Patch, stops: list[int]) -> Index:
    """Return the vertices along the shortest paths on edges from each of the stops to the next."""
    path = stops[:1]
    for start, end in pairwise(stops):
        path += walk(patch.triangles.paths(patch.points, np.array([start]), patch.drawn)[1], end)[-2::-1]
    return np.array(path)


def handle_loops(whole: Patch) -> tuple[Index, Index]:
    """Return the ends of the edges of 2g loops that open all handles.

    Erickson, Whittlesey, *Greedy Optimal Homotopy and Homology Generators*, SODA 2005. There is a tree of
    shortest paths, and a tree of triangles joined across the other edges, in which edges with the longest loops
    are joined first; each of the 2g edges in neither tree closes a loop through the root. A hole counts as an
    additional triangle, so that it remains a hole.
    """
    shape = whole.triangles
    reach, predecessors = whole.paths(np.array([whole.first_vertex]))
    half = np.flatnonzero((shape.twin > np.arange(shape.twin.size)) | (shape.twin < 0))
    a, b = shape.tail[half], shape.head[half]
    in_tree = (predecessors[a] == b) | (predecessors[b] == a)
    left_face, right_face = half // 3, np.where(shape.twin[half] >= 0, shape.twin[half] // 3, 0)
    right_face = np.where(shape.twin[half] >= 0, right_face, len(shape.faces) + _hole_of(whole, a))
    inner_diagonal = ~whole.drawn[half]
    length = reach[a] + reach[b] + whole.seam_lengths[half]
    # edges with the least cost are joined first
    cost = np.where(inner_diagonal, 1.0, 3.0 - length / (length.max() + 1e-300))
    free = np.flatnonzero(~in_tree)
    joined = _spanning(left_face[free], right_face[free], cost[free], len(shape.faces) + len(whole.loops))
    closing = free[~joined]
    paths = [walk(predecessors, int(v)) for e in closing for v in (a[e], b[e])]
    tails = [np.array(path[:-1], np.int64) for path in paths]
    heads = [np.array(path[1:], np.int64) for path in paths]
    return np.concatenate([*tails, a[closing]]), np.concatenate([*heads, b[closing]])


def spanning_cut(whole: Patch) -> tuple[Index, Index]:
    """Return the ends of edges that open the surface into one disk without holes.

    They are the edges that a tree of triangles does not cross. Dangling edges are removed; the remaining ones
    connect handles and holes.
    """
    shape = whole.triangles
    half = np.flatnonzero(shape.twin > np.arange(shape.twin.size))
    a, b = shape.tail[half], shape.head[half]
    length = whole.seam_lengths[half]
    reach = whole.paths(np.array([whole.first_vertex]))[0]
    cost = np.where(
        whole.drawn[half], 3.0 - (reach[a] + reach[b] + length) / (2 * reach.max() + length.max()), 0.5
    )
    in_cut = ~_spanning(half // 3, shape.twin[half] // 3, cost, len(shape.faces))
    fixed = np.zeros(shape.count, bool)
    fixed[shape.tail[shape.twin < 0]] = True
    while True:
        degree = np.bincount(np.concatenate([a[in_cut], b[in_cut]]), minlength=shape.count)
        loose = (degree == 1) & ~fixed
        ends = in_cut & (loose[a] | loose[b])
        if not ends.any():
            return a[in_cut], b[in_cut]
        in_cut &= ~ends


def _on(patch: Patch, a: Index, b: Index):
    return patch.triangles.along((a, b))


def _detour(patch: Patch, path: list[int]) -> list[int]:
    """Return the path through a third vertex adjacent to both ends, along edges of the file."""
    ends = patch.triangles.tail[patch.drawn], patch.triangles.head[patch.drawn]
    neighbours = [np.union1d(ends[1][ends[0] == v], ends[0][ends[1] == v]) for v in path]
    common = np.intersect1d(neighbours[0], neighbours[1])
    return (
        [path[0], int(common[0]), path[1]]
        if common.size
        else [int(np.setdiff1d(neighbours[0], path)[0]), *path]
    )


def _hole_of(patch: Patch, vertex: Index) -> Index:
    """Return the boundary loop of each vertex; 0 for vertices that are on none."""
    number = np.zeros(patch.triangles.count, np.int64)
    for k, loop in enumerate(patch.loops):
        number[loop] = k
    return number[vertex]


def _spanning(a: Index, b: Index, cost: Real, count: int) -> np.ndarray:
    """Return whether each edge a - b is in a minimum spanning tree; of parallel edges only the cheapest can be."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort([cost, low * count + high])
    key = (low * count + high)[order]
    first = order[np.append(True, key[1:] != key[:-1])] if order.size else order
    tree = minimum_spanning_tree(
        coo_matrix((cost[first], (low[first], high[first])), shape=(count, count))
    ).tocoo()
    inside = np.isin(low[first] * count + high[first], tree.row.astype(np.int64) * count + tree.col)
    in_tree = np.zeros(a.size, bool)
    in_tree[first[inside]] = True
    return in_tree
