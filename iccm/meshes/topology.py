"""Topology of triangle meshes: edges, components, orientation, fans, boundary loops, cuts.

Half-edge 3 f + k runs from corner k of triangle f to its next corner. libigl is not used here, since it assumes
valid meshes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real
from ..maps.triangulated.adjacency import loops_along
from ..sorting import counting_order_of_pairs

# Limits on the pairs of surfaces with common crowded edges that are checked, those with most edges first,
# which bound the time.
MOST_SEAMS, MOST_LOOKED = (
    64,
    10_000_000,
)  # number of pairs, and number of pairs times triangles of the mesh
MOST_FACES = 64  # faces at one edge that are checked: more would take their number squared


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles over numbered vertices.

    Attributes:
        faces: (m, 3) vertices among 0 .. count - 1.
        count: number of vertices.
    """

    faces: Index
    count: int

    @cached_property
    def tail(self) -> Index:
        """(3m,) the vertex at which each half-edge starts."""
        return self.faces.ravel()

    @cached_property
    def head(self) -> Index:
        """(3m,) the vertex at which each half-edge ends."""
        return self.faces[:, [1, 2, 0]].ravel()

    @cached_property
    def _sorted_edges(self) -> tuple[Index, Index]:
        """(3m,) half-edges sorted by their edge, and where each edge's half-edges begin."""
        low, high = np.minimum(self.tail, self.head), np.maximum(self.tail, self.head)
        order = counting_order_of_pairs(low, high, self.count)
        low, high = low[order], high[order]
        begins = np.flatnonzero((np.diff(low, prepend=-1) != 0) | (np.diff(high, prepend=-1) != 0))
        return order, begins

    @property
    def edge_count(self) -> int:
        """Number of edges."""
        return self._sorted_edges[1].size

    @property
    def crowded_edges(self) -> int:
        """Number of edges with more than two triangles."""
        order, begins = self._sorted_edges
        return int((np.diff(begins, append=order.size) > 2).sum())

    @cached_property
    def twin(self) -> Index:
        """(3m,) the other half-edge of the same edge, -1 on the boundary and where more than two triangles meet."""
        order, begins = self._sorted_edges
        inner = begins[np.diff(begins, append=order.size) == 2]
        twin = np.full(order.size, -1)
        twin[order[inner]], twin[order[inner + 1]] = order[inner + 1], order[inner]
        return twin

    def mended(self, points: Real) -> tuple["Triangles", Index, int]:
        """Split vertices so that edges shared by more than two triangles are separated.

        Of the faces at such an edge, the two that continue each other most smoothly, with consistent
        orientation, stay joined if they belong to surfaces that nothing else joins, so that these do not fall
        into pieces. Surfaces that can be flattened (with a boundary, without handles) are joined only if the
        result can be flattened, too.

        Args:
            points: (n, 3) positions of the vertices.

        Returns:
            The triangles, the old vertex (p,) of each new one, and the number of such edges.
        """
        crowded = self.crowded_edges
        if not crowded:
            return self, np.arange(self.count), 0
        twin = self.twin.copy()
        for pairs in _seams(self, points):
            joined = twin.copy()
            joined[pairs[:, 0]], joined[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
            twin = joined if _flattens(self, twin, joined, pairs) else twin
        fan = _fans(twin, self.tail)
        old = self.tail[firsts(fan, int(fan.max()) + 1)]
        return Triangles(fan.reshape(-1, 3), old.size), old, crowded

    def apart(self, fan: Index) -> "Triangles":
        """Return the triangles with their fans (3m,) as vertices; neighbours remain neighbours."""
        separate = Triangles(fan.reshape(-1, 3), int(fan.max()) + 1)
        if not self.crowded_edges:  # keep them, so that they are not searched again
            separate.__dict__["twin"] = self.twin
        return separate

    def components(self) -> Index:
        """Return (m,) the component of each triangle, connected across edges; that of the first triangle is 0."""
        return self._components

    @cached_property
    def _components(self) -> Index:
        inner = np.flatnonzero(self.twin > np.arange(self.twin.size))
        return labels(inner // 3, self.twin[inner] // 3, len(self.faces))

    def oriented(self) -> tuple["Triangles", int] | None:
        """Return consistently oriented triangles and how many were flipped, a minority; None for a one-sided surface.

        Two copies of every triangle, one for each side, are joined across edges: a surface is one-sided exactly
        if both copies of a triangle are connected.
        """
        inner = np.flatnonzero(self.twin >= 0)
        is_opposed = self.tail[inner] == self.tail[self.twin[inner]]
        if not is_opposed.any():
            return self, 0
        a, b, m = inner // 3, self.twin[inner] // 3, len(self.faces)
        side = labels(np.append(a, a + m), np.append(b + is_opposed * m, b + ~is_opposed * m), 2 * m)
        if (side[:m] == side[m:]).any():
            return None
        turn = side[:m] != side[0]
        turn = ~turn if 2 * turn.sum() > m else turn
        faces = np.where(turn[:, None], self.faces[:, ::-1], self.faces)
        return Triangles(faces, self.count), int(turn.sum())

    def fans(self, cut: NDArray[np.bool_] | None = None) -> Index:
        """Return (3m,) the fan of triangles to which each corner belongs.

        Half-edges in `cut` separate their triangles. Without a cut, a vertex has one fan unless the surface
        touches itself there. With a cut, fans are the new vertices.
        """
        return _fans(self.twin if cut is None else np.where(cut, -1, self.twin), self.tail)

    def loops(self) -> list[Index]:
        """Return the boundary loops as vertices, with the surface on their left.

        The triangles have to be oriented, with one fan per vertex.
        """
        border = np.flatnonzero(self.twin < 0)
        return loops_along(self.tail[border], self.head[border])

    def paths(
        self,
        points: Real,
        sources: Index,
        usable: NDArray[np.bool_],
        factors: Real | None = None,
        *,
        lengths: Real | None = None,
        rims: bool = True,
    ) -> tuple[Real, Index]:
        """Return (n,) the length of the shortest path from a source, and the previous vertex on it.

        Paths follow the usable half-edges. A source has a negative previous vertex.

        Args:
            points: (n, 3) positions.
            sources: vertices.
            usable: (3m,) half-edges.
            factors: (n,) factors for the length of edges; an edge has the mean of those of both ends.
            lengths: (3m,) lengths of half-edges; those between the points if None.
            rims: whether boundary edges have a length; otherwise it is zero.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import dijkstra

        half = np.flatnonzero(usable & ((self.twin < 0) | (self.twin > np.arange(self.twin.size))))
        a, b = self.tail[half], self.head[half]
        length = np.linalg.norm(points[a] - points[b], axis=1) if lengths is None else lengths[half]
        if factors is not None:
            length = length * 0.5 * (factors[a] + factors[b])
        if not rims:
            length = np.where(self.twin[half] < 0, 0.0, length)
        graph = coo_matrix((length, (a, b)), shape=(self.count, self.count)).tocsr()
        reach, predecessors, _ = dijkstra(
            graph, directed=False, indices=sources, min_only=True, return_predecessors=True
        )
        return reach, predecessors

    def along(self, ends: tuple[Index, Index]) -> NDArray[np.bool_]:
        """Return (3m,) whether half-edges are on the edges between ends[0] and ends[1]."""
        return np.isin(self.edge_key(self.tail, self.head), self.edge_key(*ends))

    def edge_key(self, a: Index, b: Index) -> Index:
        """Return (k,) numbers of the edges between vertices a (k,) and b (k,), the same in both directions."""
        return np.minimum(a, b) * self.count + np.maximum(a, b)


def _fans(twin: Index, tail: Index) -> Index:
    """Return (3m,) the fan of triangles to which each corner belongs.

    Triangles may be wound in different directions.

    Args:
        twin: (3m,) twin half-edges, -1 for none.
        tail: (3m,) the vertex at which each half-edge starts.
    """
    joined = np.flatnonzero(twin >= 0)
    opposite = twin[joined]
    alike = tail[joined] == tail[opposite]  # both run in the same direction
    after = 3 * (opposite // 3) + (opposite + 1) % 3
    heads = 3 * (joined // 3) + (joined + 1) % 3
    first = np.concatenate([joined, heads[alike]])
    return labels(first, np.concatenate([np.where(alike, opposite, after), after[alike]]), twin.size)


def _seams(shape: Triangles, points: Real) -> list[Index]:
    """Return pairs of half-edges (k, 2) along which two surfaces could be joined.

    Surfaces with most common edges come first.
    """
    order, begins = shape._sorted_edges
    label, seams = shape.components(), dict[tuple[int, int], list[tuple[int, int]]]()
    ends, most = np.append(begins[1:], order.size), min(MOST_SEAMS, 1 + MOST_LOOKED // len(shape.faces))
    for a, b in zip(*(v[ends - begins > 2] for v in (begins, ends))):
        for pair in _even(shape, points, order[a:b][:MOST_FACES]):
            first, second = sorted(label[[pair[0] // 3, pair[1] // 3]].tolist())
            if first != second:
                seams.setdefault((first, second), []).append(pair)
    return [np.array(pairs) for pairs in sorted(seams.values(), key=len, reverse=True)][:most]


def _even(shape: Triangles, points: Real, half: Index) -> list[tuple[int, int]]:
    """Return the half-edges (k,) of an edge in pairs that continue each other most smoothly, each once."""
    a, b, c = (
        points[v] for v in (shape.tail[half], shape.head[half], shape.tail[3 * (half // 3) + (half + 2) % 3])
    )
    along = b - a
    square = np.maximum(np.einsum("ki,ki->k", along, along), 1e-300)  # the ends may coincide
    out = c - a - along * (np.einsum("ki,ki->k", c - a, along) / square)[:, None]
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
    bend = np.where(shape.tail[half][:, None] == shape.head[half], out @ out.T, np.inf)
    pairs = []
    while np.isfinite(bend).any():
        i, j = np.unravel_index(np.argmin(bend), bend.shape)
        pairs.append((int(half[i]), int(half[j])))
        bend[[i, j]], bend[:, [i, j]] = np.inf, np.inf
    return pairs


def _flattens(shape: Triangles, original: Index, welded: Index, pairs: Index) -> bool:
    """Return whether surfaces joined at pairs of half-edges can be flattened if one of them could.

    They must also be connected there.
    """
    label = _labels_of(original)
    joined = _labels_of(welded) == _labels_of(welded)[pairs[0, 0] // 3]
    tail = shape.tail
    whole, half = _apart(welded, tail, joined), np.cumsum(np.repeat(joined, 3)) - 1
    if not (whole.twin[half[pairs[:, 0]]] == half[pairs[:, 1]]).all():
        return False
    parts = (_apart(original, tail, label == k) for k in np.unique(label[pairs // 3]))
    return _is_open(whole) or not any(map(_is_open, parts))


def _labels_of(twin: Index) -> Index:
    """Return (m,) the surface of each triangle, connected across half-edges."""
    inner = np.flatnonzero(twin > np.arange(twin.size))
    return labels(inner // 3, twin[inner] // 3, twin.size // 3)


def _apart(twin: Index, tail: Index, marked: NDArray[np.bool_]) -> Triangles:
    """Return the marked triangles (m,), all of one surface, with a vertex for each of their fans."""
    half = np.flatnonzero(np.repeat(marked, 3))
    number = np.full(twin.size, -1)
    number[half] = np.arange(half.size)
    fan = _fans(np.where(twin[half] < 0, -1, number[twin[half]]), tail[half])
    return Triangles(fan.reshape(-1, 3), int(fan.max()) + 1)


def _is_open(surface: Triangles) -> bool:
    """Return whether a surface has a boundary and no handles, by Euler's formula."""
    border = np.flatnonzero(surface.twin < 0)
    tail, head = surface.tail[border], surface.head[border]
    loops = np.unique(labels(tail, head, surface.count)[tail]).size
    return bool(loops) and surface.count - surface.edge_count + len(surface.faces) == 2 - loops


def walk(predecessors: Index, end: int) -> list[int]:
    """Return the path from `end` back to a source, following `predecessors` of `Triangles.paths`."""
    path = [end]
    while predecessors[path[-1]] >= 0:
        path.append(int(predecessors[path[-1]]))
    return path


def labels(a: Index, b: Index, count: int) -> Index:
    """Return (count,) the component of each node of a graph with edges a[i] - b[i], numbered by first appearance."""
    from scipy.sparse import coo_matrix  # slow to import, and not needed for maps between drawings
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(a.size, np.int8), (a, b)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    first = firsts(label, number)
    rank = np.empty(number, np.int64)
    rank[np.argsort(first)] = np.arange(number)
    return rank[label]


def firsts(label: Index, count: int) -> Index:
    """Return (count,) the first position of each of the labels 0 .. count - 1, all of which have to occur."""
    first = np.empty(count, np.int64)
    first[label[::-1]] = np.arange(label.size)[::-1]  # of several assignments the last one is kept
    return first
