"""A surface's triangles with vertices added in faces, on boundary edges and in the middle of chords."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays import Flags, Index, Real
from ..meshes.topology import Triangles

ON_EDGE_BARYCENTRIC = 1e-6
"""Barycentric coordinate below which a point is on the opposite edge: far above rounding."""


@dataclass(frozen=True, eq=False)
class RefinedSurface:
    """Triangles, some of whose vertices were added later.

    Attributes:
        faces: (m, 3) triangles.
        original: (m,) the original triangle that each is a part of.
        count: number of vertices.
        added: for each round of additions, (k, 3) parent vertices of the new ones, and (k, 3) their weights.
    """

    faces: Index
    original: Index
    count: int
    added: tuple[tuple[Index, Real], ...] = ()

    def carried(self, values: np.ndarray) -> np.ndarray:
        """Return values (n, …), given at the original vertices, at all vertices, interpolated linearly."""
        for parents, weights in self.added:
            values = np.concatenate([values, np.einsum("ij,ij...->i...", weights, values[parents])])
        return values

    @classmethod
    def of(cls, faces: Index, count: int) -> "RefinedSurface":
        """Return triangles (m, 3) of `count` vertices without any additions."""
        return cls(faces, np.arange(len(faces)), count)

    def _with(
        self, hit: Flags, parts: Sequence, originals: Sequence, parents: Index, weights: Real
    ) -> "RefinedSurface":
        """Add vertices, and replace the triangles marked in `hit` by parts (k, 3) of the triangles `originals` (k,)."""
        added = (*self.added, (parents.reshape(-1, 3), weights.reshape(-1, 3)))
        faces = np.concatenate([self.faces[~hit], np.array(parts, np.int64).reshape(-1, 3)])
        whole = np.concatenate([self.original[~hit], self.original[np.array(originals, np.int64)]])
        return RefinedSurface(faces, whole, self.count + len(added[-1][0]), added)

    def with_point(self, face: int, place: Real) -> tuple["RefinedSurface", int]:
        """Add a vertex in a triangle at barycentric coordinates (3,).

        Returns the new triangles and the vertex's number; an existing vertex if the point coincides with it.
        """
        corners, on = self.faces[face], place > ON_EDGE_BARYCENTRIC
        if on.sum() == 1:
            return self, int(corners[np.argmax(place)])
        weights = np.where(on, place, 0) / place[on].sum()
        ends = corners[on]
        hit = np.isin(self.faces, ends).sum(axis=1) == on.sum()
        swapped = [(v, t) for t in np.flatnonzero(hit) for v in ends]
        parts = [np.where(self.faces[t] == v, self.count, self.faces[t]) for v, t in swapped]
        return self._with(hit, parts, [t for _, t in swapped], corners, weights), self.count

    def with_points_on(self, tails: Index, heads: Index, shares: Real) -> "RefinedSurface":
        """Add vertices (k,) on boundary edges, each at a share (0 to 1) of the edge from tail to head.

        No triangle may have two such edges.
        """
        low, high = np.minimum(tails, heads), np.maximum(tails, heads)
        along = np.where(tails == low, shares, 1 - shares)
        keys = low * self.count + high
        chains: dict[int, list[int]] = {}
        for k in np.lexsort((along, keys)):
            chains.setdefault(int(keys[k]), []).append(self.count + int(k))
        starts, ends = self.faces, np.roll(self.faces, -1, axis=1)
        sides = np.minimum(starts, ends) * self.count + np.maximum(starts, ends)
        hit = np.isin(sides, keys)
        parts, originals = [], []
        for t in np.flatnonzero(hit.any(axis=1)):
            side = int(np.argmax(hit[t]))
            tail, head, apex = np.roll(self.faces[t], -side)
            chain = chains[int(sides[t, side])]
            chain = [tail, *(chain if tail < head else chain[::-1]), head]
            parts += [(a, b, apex) for a, b in pairwise(chain)]
            originals += [t] * (len(chain) - 1)
        parents = np.column_stack([tails, heads, heads])
        weights = np.column_stack([1 - shares, shares, 0 * shares])
        return self._with(np.asarray(hit.any(axis=1)), parts, originals, parents, weights)

    def without_chords(self, still: Flags) -> "RefinedSurface":
        """Split every inner edge between two vertices marked in `still` (n,) at its middle.

        Afterwards no triangle has two boundary edges. A single triangle is split at its centroid.
        """
        if len(self.faces) == 1:
            return self.with_point(0, np.full(3, 1 / 3))[0]
        shape = Triangles(self.faces, self.count)
        chords = np.flatnonzero(
            (shape.twin > np.arange(shape.twin.size)) & still[shape.tail] & still[shape.head]
        )
        middle = np.full(shape.twin.size, -1)
        middle[chords] = middle[shape.twin[chords]] = self.count + np.arange(chords.size)
        sides = middle.reshape(-1, 3)
        hit = np.asarray((sides >= 0).any(axis=1))
        split = [(part, t) for t in np.flatnonzero(hit) for part in _parts(self.faces[t], sides[t])]
        parents = np.column_stack([shape.tail[chords], shape.head[chords], shape.head[chords]])
        weights = np.tile([0.5, 0.5, 0.0], (chords.size, 1))
        return self._with(hit, [part for part, _ in split], [t for _, t in split], parents, weights)


def _parts(corners: Index, middle: Index) -> Sequence[tuple]:
    """Return the parts of a triangle that is split at the middle vertices of its sides; -1 marks unsplit sides."""
    split = middle >= 0
    if split.all():
        (i, j, k), (a, b, c) = corners, middle
        return (i, a, c), (a, j, b), (c, b, k), (a, b, c)
    if split.sum() == 1:
        first = int(np.argmax(split))
        (i, j, k), a = np.roll(corners, -first), middle[first]
        return (i, a, k), (a, j, k)
    first = int(np.argmin(split))
    (i, j, k), (_, b, c) = np.roll(corners, -first), np.roll(middle, -first)
    return (i, j, b), (i, b, c), (c, b, k)
