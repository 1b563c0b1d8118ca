"""Split a map's boundary edges at the vertices of both outlines that its mesh skips.

If a mesh's boundary has vertices only at the corners of the outlines, its vertices slide past all smaller
corners, and the correspondence of the outlines is as smooth as the energy makes it. The smaller corners are
added afterwards. Each one, on either outline, gets its partner by linear interpolation in arclength. A mesh
vertex that is close moves there; otherwise the triangle at the edge is bisected.
"""

from dataclasses import replace

import numpy as np

from ...arrays import Flags, Index, Real
from ..errors import Stuck
from .boundary import MatchedBoundary, MatchedLoop
from .boundary_pairs import Match, Pairs, loops_of
from .discrete_map import DiscreteMap, folds
from .outline import Outline

SAME_PLACE_SHARE = 1e-7  # relative to an outline's length: vertices this close are the same
SNAPPED_EDGE_SHARE = (
    0.35  # relative to the shorter edge at a mesh vertex: the vertex moves to a corner this close
)


def split_at_vertices(state: DiscreteMap) -> DiscreteMap:
    """Return the map with a boundary vertex at every vertex of both outlines.

    Raises:
        Stuck: a triangle at the outline is too flat to contain a corner of the outline.
    """
    boundary, old = _split_boundary(state.matched)
    added = old.size - state.border
    place = np.append(np.flatnonzero(old >= 0), np.arange(state.border, state.z.size) + added)
    z, u = (np.empty(state.z.size + added, np.complex128) for _ in range(2))
    z[place], u[place] = state.z, state.u
    for loop in boundary.loops:
        z[loop.vertices] = loop.source.curve.at(boundary.pairs.s[loop.vertices])
    u[: old.size] = boundary.images()
    faces, parents = _bisect(place[state.faces], boundary.slices, old)
    if folds(faces, z):
        raise Stuck("a corner of the source's outline lies outside the adjacent triangle")
    split = replace(
        state,
        faces=faces,
        z=z,
        u=u,
        boundary=boundary,
        weights=None if state.weights is None else state.weights[parents],
        rigid=None if state.rigid is None else state.rigid[parents],
    ).with_pattern()
    return split.unfold_locally(weighed=True, further=split.rigid_vertices) if folds(faces, u) else split


def _split_boundary(boundary: MatchedBoundary) -> tuple[MatchedBoundary, Index]:
    """Return the boundary with all vertices of its outlines.

    The second result is (b,) the former number of each vertex, -1 for new ones.
    """
    outer = boundary.match
    matches = [outer, *(hole.match for hole in outer.holes)]
    splits = [_split_loop(loop, match, boundary) for loop, match in zip(boundary.loops, matches)]
    pairs = [split_pairs for split_pairs, _ in splits]
    number = np.concatenate([old for _, old in splits])
    counts = [split_pairs.s.size for split_pairs in pairs]
    added, anchored = number.size - boundary.size, np.zeros(number.size, bool)
    anchored[number >= 0] = boundary.anchored
    holes = boundary.holes
    sizes = [(loop.source, loop.target, count) for loop, count in zip(holes.loops, counts[1:])]
    outlines = tuple((_with_all_corners(a), _with_all_corners(b)) for a, b in holes.outlines)
    filled = tuple(loop._replace(first=loop.first + added, after=loop.after + added) for loop in holes.filled)
    split = replace(
        boundary,
        source=_with_all_corners(boundary.source),
        target=_with_all_corners(boundary.target),
        pairs=Pairs.joined(pairs),
        anchored=anchored,
        holes=holes._replace(outlines=outlines, loops=loops_of(sizes, counts[0]), filled=filled),
    )
    return split, number


def _with_all_corners(outline: Outline) -> Outline:
    return replace(outline, corners=outline.curve.knots[:-1])


def _split_loop(loop: MatchedLoop, match: Match, boundary: MatchedBoundary) -> tuple[Pairs, Index]:
    """Add all vertices of the outlines to a loop's pairs; return them and their former numbers (b,), -1 if new."""
    present = boundary.pairs.of(loop.vertices)
    s, at_source = _missing(present.s, loop.source)
    tau, at_target = _missing(present.tau, loop.target)
    new = np.full(s.size + tau.size, -1)
    number = np.append(np.arange(loop.vertices.start, loop.vertices.stop), new)
    pairs = Pairs(
        np.concatenate([present.s, s, match.inverse().at(tau)]),
        np.concatenate([present.tau, match.at(s), tau]),
        np.concatenate([at_source, np.ones(s.size, bool), np.zeros(tau.size, bool)]),
        np.concatenate([at_target, np.zeros(s.size, bool), np.ones(tau.size, bool)]),
    )
    order = np.lexsort((-number, pairs.tau, pairs.s))
    order = np.append(0, order[order != 0])  # the first vertex stays the first
    pairs, number = pairs.of(order), number[order]
    return _merge(*_snap(pairs, number, boundary.anchored), loop)


def _missing(present: Real, outline: Outline) -> tuple[Real, Flags]:
    """Return the vertices of an outline that the mesh lacks.

    Args:
        present: (k,) arclengths of the mesh's vertices.
        outline: the outline.

    Returns:
        Arclengths of the outline's vertices that are not among `present`, ascending from its first, and (k,)
        whether each of `present` is at a vertex of the outline.
    """
    length = outline.length
    knots = present[0] + np.sort(np.mod(outline.curve.knots[:-1] - present[0], length))
    ends = np.append(present, present[0] + length)
    after = np.clip(np.searchsorted(ends, knots), 1, present.size)
    nearest = np.where(knots - ends[after - 1] < ends[after] - knots, after - 1, after)
    matched = np.abs(ends[nearest] - knots) < SAME_PLACE_SHARE * length
    at_vertex = np.zeros(present.size, bool)
    at_vertex[nearest[matched] % present.size] = True
    return knots[~matched], at_vertex


def _snap(pairs: Pairs, number: Index, anchored: Flags) -> tuple[Pairs, Index]:
    """Merge mesh vertices that are not at corners into new vertices that are close.

    The new vertex takes the number of the mesh vertex, whose pair is removed.
    """
    number, kept = number.copy(), np.ones(number.size, bool)
    old = np.flatnonzero(number >= 0)
    widths = np.diff(pairs.s[old])
    loose = ~(pairs.at_source | pairs.at_target)[old] & ~anchored[number[old]]
    for k in np.flatnonzero(loose[1:-1]) + 1:
        v = old[k]
        neighbours = [w for w in (v - 1, v + 1) if number[w] < 0]
        gaps = [abs(pairs.s[w] - pairs.s[v]) for w in neighbours]
        if gaps and min(gaps) < SNAPPED_EDGE_SHARE * min(widths[k - 1 : k + 1]):
            number[neighbours[int(np.argmin(gaps))]], kept[v] = number[v], False
    return pairs.of(kept), number[kept]


def _merge(pairs: Pairs, number: Index, loop: MatchedLoop) -> tuple[Pairs, Index]:
    """Merge a vertex of the source and one of the target into one where they coincide.

    Raises:
        Stuck: other vertices coincide.
    """
    (length, goal), (s, tau, at_source, at_target) = loop.lengths, pairs.of(np.arange(pairs.s.size))
    close = (np.diff(s) < SAME_PLACE_SHARE * length) & (np.diff(tau) < SAME_PLACE_SHARE * goal)
    close &= (number[:-1] < 0) & (number[1:] < 0) & (at_source[:-1] != at_source[1:])
    first = np.flatnonzero(close)
    s[first] = np.where(at_source[first], s[first], s[first + 1])
    tau[first] = np.where(at_target[first], tau[first], tau[first + 1])
    at_source[first] = at_target[first] = True
    kept = np.ones(s.size, bool)
    kept[first + 1] = False
    s, tau = s[kept], tau[kept]
    if not (np.diff(s, append=s[0] + length) > 0).all() or not (np.diff(tau, append=tau[0] + goal) > 0).all():
        raise Stuck("two vertices of the outlines coincide")
    return Pairs(s, tau, at_source[kept], at_target[kept]), number[kept]


def _bisect(faces: Index, loops: list[slice], old: Index) -> tuple[Index, Index]:
    """Bisect triangles at the new vertices of the loops.

    Args:
        faces: (m, 3) triangles.
        loops: the range of vertices of each loop.
        old: (b,) former numbers of the loops' vertices, -1 for new ones.

    Returns:
        (k, 3) triangles, and (k,) the former triangle that contains each.
    """
    chains: dict[tuple[int, int], range] = {}
    for loop in loops:
        old_vertices = loop.start + np.flatnonzero(old[loop] >= 0)
        for a, b in zip(old_vertices, np.append(old_vertices[1:], loop.stop)):
            if b > a + 1:
                chains[int(a), int(b if b < loop.stop else old_vertices[0])] = range(a + 1, b)
    where = _triangles_at(faces, list(chains))
    count = sum(map(len, chains.values()))
    out = np.concatenate([faces, np.empty((count, 3), faces.dtype)])
    parents, end = np.append(np.arange(len(faces)), np.empty(count, np.int64)), len(faces)
    for (a, b), chain in chains.items():
        t = where[a, b]
        (c,) = set(out[t].tolist()) - {a, b}
        tail = a
        for m in chain:
            out[t], out[end], parents[end] = (tail, m, c), (m, b, c), parents[t]
            tail, t, end = m, end, end + 1
        if (b, c) in where:  # both sides are on the outline
            where[b, c] = t
    return out, parents


def _triangles_at(faces: Index, edges: list[tuple[int, int]]) -> dict[tuple[int, int], int]:
    """Return the triangle to the left of each edge, as a dictionary."""
    count = int(faces.max()) + 1
    keys = (faces * count + np.roll(faces, -1, axis=1)).ravel()
    order = np.argsort(keys)
    edge_keys = np.array(edges, np.int64).reshape(-1, 2) @ [count, 1]
    triangles = order[np.searchsorted(keys, edge_keys, sorter=order)] // 3
    return dict(zip(edges, triangles.tolist()))
