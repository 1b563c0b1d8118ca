"""A triangulation of a frame around regions that has all their borders as edges.

Its vertices are those of the borders, further ones on long edges, and graded points between them. Borders become edges
of the Delaunay triangulation by splitting those that are not (a conforming triangulation). Edges that meet at a corner
are split on common circles around it (Ruppert 1995), so that splitting ends at acute corners, too.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from ..arrays import Complex, Flags, Index, xy_of
from ..errors import InputError
from ..plane import bounding_box, triangle_areas

FRAME_MARGIN_SHARE = 0.25  # relative to the longer side of the regions' box: space between it and the frame
GRID_SPACING_SHARE = 1 / 48  # largest distance of vertices, relative to the frame's longer side
EDGE_SPACING_SHARE = 1 / 200  # longest part of a border, relative to the frame's longer side
CLEARANCE_RATIO = 0.8  # distance of points from borders, relative to the spacing of the points
MOST_LEVELS = 12  # of points between the borders, each with half the spacing of the previous one
FINEST_GAPS = 3.0  # spacing of the points closest to borders, in median distances of the borders' vertices
SPLITTING_ROUNDS = 60  # at most


@dataclass(frozen=True, eq=False)
class FrameTriangulation:
    """A triangulation of a rectangular frame.

    Attributes:
        z: (n,) vertices; those of the frame come first.
        faces: (m, 3) triangles, counter-clockwise.
        frame: number of vertices on the frame, counter-clockwise.
        parents: (e, 2) the vertices of the edges of the original borders.
        chains: for each of them the vertices along it, including its ends.
    """

    z: Complex
    faces: Index
    frame: int
    parents: Index
    chains: list[Index]


def mesh_of(points: Complex, edges: Index) -> FrameTriangulation:
    """Triangulate a frame around borders.

    Args:
        points: (n,) vertices of the borders, all different.
        edges: (e, 2) the edges between them, which meet in vertices only.

    Raises:
        InputError: rounding decides where borders are.
    """
    low, high = bounding_box(points)
    margin = FRAME_MARGIN_SHARE * max((high - low).real, (high - low).imag)
    low, high = low - margin * (1 + 1j), high + margin * (1 + 1j)
    side = max((high - low).real, (high - low).imag)
    frame = _frame(low, high, GRID_SPACING_SHARE * side)
    z = np.concatenate([frame, points])
    segments = edges + frame.size
    z, segments, owner = _divided(z, segments, EDGE_SPACING_SHARE * side)
    has_grid = False
    for _ in range(SPLITTING_ROUNDS):
        faces = Delaunay(xy_of(z)).simplices.astype(np.int64)
        missing = ~_has_edges(faces, segments, z.size)
        if missing.any():
            is_corner = (segments >= frame.size) & (segments < frame.size + points.size)
            added, segments, owner = _split(z, segments, owner, missing, is_corner)
        elif not has_grid:  # only now, so that few of its points are in the way of borders
            added = _graded(z, low, high, GRID_SPACING_SHARE * side)
            added = added[_far_from(added, z, segments)]
            has_grid = True
        else:
            break
        z = np.append(z, added)
    else:
        raise InputError("borders are too close to each other for a triangulation; simplify them")
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    if used.size != z.size:
        raise InputError("vertices of borders are too close to each other for a triangulation; simplify them")
    flipped = triangle_areas(z[faces]) < 0
    faces[flipped] = faces[flipped][:, ::-1]
    faces = faces[triangle_areas(z[faces]) > 0]
    return FrameTriangulation(
        z, faces, frame.size, edges + frame.size, _chains(edges + frame.size, segments, owner)
    )


def _frame(low: complex, high: complex, spacing: float) -> Complex:
    """Return vertices along a rectangle, counter-clockwise, including its corners."""
    corners = np.array([low, complex(high.real, low.imag), high, complex(low.real, high.imag)])
    sides = []
    for start, end in zip(corners, np.roll(corners, -1)):
        count = int(np.ceil(abs(end - start) / spacing))
        sides.append(start + (end - start) * np.arange(count) / count)
    return np.concatenate(sides)


def _divided(z: Complex, segments: Index, longest: float) -> tuple[Complex, Index, Index]:
    """Divide long segments into equal parts; return vertices, parts, and the segment of each part."""
    count = np.maximum(1, np.ceil(np.abs(z[segments[:, 1]] - z[segments[:, 0]]) / longest)).astype(int)
    owner = np.repeat(np.arange(len(segments)), count)
    step = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    is_last = step == count[owner] - 1
    new = np.flatnonzero(~is_last)
    number = np.full(owner.size, -1)
    number[new] = z.size + np.arange(new.size)
    start, end = z[segments[owner[new], 0]], z[segments[owner[new], 1]]
    added = start + (end - start) * (step[new] + 1) / count[owner[new]]
    heads = np.where(is_last, segments[owner, 1], number)
    tails = np.where(step == 0, segments[owner, 0], np.roll(number, 1))
    return np.append(z, added), np.column_stack([tails, heads]), owner


def _graded(z: Complex, low: complex, high: complex, spacing: float) -> Complex:
    """Return points between vertices, which are denser near these: hexagonal grids, each with half the spacing."""
    tree = cKDTree(xy_of(z))
    gaps = tree.query(xy_of(z), k=2)[0][:, 1]
    points = [np.empty(0, complex)]
    for level in range(MOST_LEVELS):
        # each finer grid fills only the strip that is too close to vertices for the previous one
        width = spacing / 2**level
        candidates = _candidates(z, low, high, width, everywhere=level == 0)
        distances = tree.query(xy_of(candidates), distance_upper_bound=2 * CLEARANCE_RATIO * width * 1.01)[0]
        keep = distances > CLEARANCE_RATIO * width
        if level:
            keep &= distances <= 2 * CLEARANCE_RATIO * width
        points.append(candidates[keep])
        if width < FINEST_GAPS * np.median(gaps):
            break
    return np.concatenate(points)


def _candidates(z: Complex, low: complex, high: complex, width: float, *, everywhere: bool) -> Complex:
    """Return the points of a hexagonal grid in a box: all of them, or those near vertices."""
    rise = width * np.sqrt(3) / 2
    if everywhere:
        columns, rows = np.ceil((high - low).real / width), np.ceil((high - low).imag / rise)
        i, j = (part.ravel() for part in np.meshgrid(np.arange(columns + 1), np.arange(rows + 1)))
    else:
        # grid points within three steps of each vertex; row and column are packed into one number to drop duplicates
        reach = np.arange(-3, 4)
        near_j = np.rint((z.imag - low.imag) / rise).astype(np.int64)
        near_i = np.rint((z.real - low.real) / width - 0.5 * (near_j % 2)).astype(np.int64)
        cells = np.unique(near_i << 32 | near_j)
        i, j = cells >> 32, cells & 0xFFFFFFFF
        i = (i[:, None, None] + reach[:, None]) + 0 * reach
        j = (j[:, None, None] + reach) + 0 * reach[:, None]
        cells = np.unique((i.ravel() << 32) | (j.ravel() & 0xFFFFFFFF))
        i, j = cells >> 32, cells & 0xFFFFFFFF
        j = np.where(j >= 1 << 31, j - (1 << 32), j)  # the lower half lost its sign in the mask
    points = low + width * (i + 0.5 * (j % 2)) + 1j * rise * j
    inside = (points.real > low.real + width / 2) & (points.real < high.real - width / 2)
    inside &= (points.imag > low.imag + width / 2) & (points.imag < high.imag - width / 2)
    return points[inside]


def _has_edges(faces: Index, segments: Index, count: int) -> Flags:
    """Return (s,) whether each segment is an edge of a triangulation of `count` vertices."""
    tails, heads = faces[:, (0, 1, 2)].ravel(), faces[:, (1, 2, 0)].ravel()
    edges = np.minimum(tails, heads) * count + np.maximum(tails, heads)
    return np.isin(segments.min(axis=1) * count + segments.max(axis=1), edges)


def _split(
    z: Complex, segments: Index, owner: Index, is_split: Flags, is_corner: Flags
) -> tuple[Complex, Index, Index]:
    """Split some of the segments near their midpoints; where one end is a corner, on a circle around the corner.

    Returns the new vertices, all segments, and the original edge of each.
    """
    tails, heads = segments[is_split].T
    length = np.abs(z[heads] - z[tails])
    share = np.full(length.size, 0.5)
    has_one_corner = is_corner[is_split].sum(axis=1) == 1
    # radii are powers of two, so that edges from one corner are split at equal distances from it, and their parts never
    # encroach on each other however acute the angle is
    radius = 2.0 ** np.rint(np.log2(0.5 * length)) / length
    share = np.where(has_one_corner, np.where(is_corner[is_split, 0], radius, 1 - radius), share)
    new = z.size + np.arange(tails.size)
    added = z[tails] + share * (z[heads] - z[tails])
    parts = np.concatenate(
        [segments[~is_split], np.column_stack([tails, new]), np.column_stack([new, heads])]
    )
    return added, parts, np.concatenate([owner[~is_split], owner[is_split], owner[is_split]])


def _far_from(grid: Complex, z: Complex, segments: Index) -> Flags:
    """Return which points of a grid are outside of the circles on segments (s, 2), so that these are Delaunay edges."""
    middles, radii = z[segments].mean(axis=1), 0.5 * np.abs(z[segments[:, 1]] - z[segments[:, 0]])
    keep = np.ones(grid.size, bool)
    inside = cKDTree(xy_of(grid)).query_ball_point(xy_of(middles), 1.05 * radii)
    keep[np.unique(np.concatenate([np.empty(0, int), *inside]).astype(int))] = False
    return keep


def _chains(edges: Index, segments: Index, owner: Index) -> list[Index]:
    """Return the vertices along each original edge, from its first to its second end."""
    order = np.argsort(owner, kind="stable")
    bounds = np.searchsorted(owner[order], np.arange(len(edges) + 1))
    chains = []
    for number, (start, end) in enumerate(edges.tolist()):
        parts = segments[order[bounds[number] : bounds[number + 1]]]
        if len(parts) == 1:
            chains.append(np.array([start, end]))
            continue
        following = dict(parts.tolist())
        chain = [start]
        while chain[-1] != end:
            chain.append(following[chain[-1]])
        chains.append(np.array(chain))
    return chains
