"""Subdivide triangles of a mesh: all of them evenly, or those at the rim of a layout.

At the rim, edges are split until the chords between vertices follow an outline (--subdivide-rim).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index, Real, distinct_rows
from ..buckets import nearest_segments
from ..maps.approximation import AnyMap, triangulated
from ..meshes.flatten import Flattening
from ..meshes.mesh import Mesh, triangulate
from ..plane import triangle_heights
from .refined import ON_EDGE_BARYCENTRIC, RefinedSurface

OWN_TOLERANCE_SHARE = 0.5
"""Of the tolerance: allowed deviation of chords from the map's outline, which itself may deviate from the drawn one."""


@dataclass(frozen=True, eq=False)
class Subdivision:
    """Triangles that replace some polygons of a mesh.

    Attributes:
        faces: (k,) the polygon that each triangle is a part of, ascending.
        corners: (k, 3) mesh corners of the original triangle that contains it.
        weights: (k, 3, 3) barycentric weights of those corners at each corner of the triangle.
    """

    faces: Index
    corners: Index
    weights: Real

    @classmethod
    def even(cls, mesh: Mesh, halvings: int) -> "Subdivision":
        """Divide every triangle of a checked mesh into 4 to the power of `halvings` triangles of its shape.

        Polygons without a triangle stay as they are.
        """
        corners = triangulate(mesh)
        side = 2**halvings
        i, j = (indices.ravel() for indices in np.mgrid[:side, :side])
        upright = [(i, j), (i + 1, j), (i, j + 1)]
        downward = [(i + 1, j + 1), (i, j + 1), (i + 1, j)]
        first = np.concatenate([i + j < side, i + j < side - 1])
        places = np.concatenate([np.stack(upright, axis=2), np.stack(downward, axis=2)], axis=1)
        along, across = places
        weights = np.stack([side - along - across, along, across], axis=2)[first] / side
        owner = np.searchsorted(mesh.starts, corners[:, 0], side="right") - 1
        return cls(
            np.repeat(owner, len(weights)),
            np.repeat(corners, len(weights), axis=0),
            np.tile(weights, (len(corners), 1, 1)),
        )

    @classmethod
    def joined(cls, parts: Sequence["Subdivision"]) -> "Subdivision":
        """Join the subdivisions of several parts of a mesh."""
        order = np.argsort(np.concatenate([part.faces for part in parts]), kind="stable")
        return cls(
            *(
                np.concatenate([getattr(part, name) for part in parts])[order]
                for name in ("faces", "corners", "weights")
            )
        )

    def mixtures(self, items: Index, count: int) -> "Mixtures":
        """Interpolate vertices, coordinates or normals at the corners of the triangles.

        `items` (c,) numbers the item at each corner of the mesh, below `count`, or is -1. Corners at the same place of
        an edge between the same items share one new item.
        """
        has_weight = self.weights > 0
        parents = np.where(has_weight, items[self.corners][:, None, :], -1)
        lacks_item = (has_weight & (parents < 0)).any(axis=2)
        highest = parents.max(axis=2)
        is_single = np.where(has_weight, parents, highest[:, :, None]).min(axis=2) == highest
        number = np.where(lacks_item, -1, highest)
        new = ~(lacks_item | is_single)
        order = np.argsort(parents[new], axis=1)
        rows = [np.take_along_axis(values[new], order, axis=1) for values in (parents, self.weights)]
        first, place = distinct_rows(np.hstack(rows))
        number[new] = count + place
        return Mixtures(np.maximum(rows[0][first], 0), rows[1][first], number)

    def sizes(self, old_sizes: Index) -> Index:
        """Return (f,) how many faces replace each of the faces, whose sizes were `old_sizes` (f,); 1 if unchanged."""
        count = np.bincount(self.faces, minlength=old_sizes.size)
        return np.where(count > 0, count, 1)


class Mixtures(NamedTuple):
    """New vertices, coordinates or normals as weighted means of old ones.

    Attributes:
        parents: (n, 3) the old items that each new one is made of.
        weights: (n, 3) their weights.
        number: (k, 3) item of each corner; new ones are numbered after the old ones; -1 for none.
    """

    parents: Index
    weights: Real
    number: Index

    def of(self, values: np.ndarray) -> Real:
        """Return (n, …) values at the new items, given those at the old ones."""
        return np.einsum("nk,nk...->n...", self.weights, values[self.parents].astype(float))


class SplitLayout(NamedTuple):
    """A layout with rim edges split.

    Attributes:
        surface: the triangles.
        flat: (p,) positions of its vertices in the layout.
    """

    surface: RefinedSurface
    flat: Complex


@dataclass(frozen=True, eq=False)
class RimSplits:
    """Split points of rim edges in the layouts of parts of one mesh.

    Attributes:
        layouts: of the parts.
        rims: per layout, (e, 2) edges that may be split, the end that is lexicographically smaller in space first.
        kinds: per layout, (e,) kind of each edge. Edges that coincide in space, as at seams, have the same kind, and
            are split alike.
        shares: per kind, split points as shares (0 to 1) of the edge, ascending.
    """

    layouts: Sequence[Flattening]
    rims: Sequence[Index]
    kinds: Sequence[Index]
    shares: dict[int, Real]

    @classmethod
    def of(
        cls,
        layouts: Sequence[Flattening],
        images: Sequence[Complex],
        maps: Sequence[AnyMap],
        tolerance: float,
    ) -> "RimSplits":
        """Choose splits so that chords between the images of rim vertices follow the rims of the maps' sources.

        Args:
            layouts: each the image of a map.
            images: per layout, (p,) the places of its vertices in the map's source.
            maps: one onto each layout.
            tolerance: relative to the diagonals of the maps' sources and images.
        """
        splits = [_places(layout, image, map, tolerance) for layout, image, map in zip(layouts, images, maps)]
        rims = [_oriented(layout, _rim(layout)) for layout in layouts]
        ends = [*rims, *(np.column_stack([edges.tails, edges.heads]) for edges in splits)]
        positions = [layout.patch.points[edges] for layout, edges in zip([*layouts, *layouts], ends)]
        kinds = np.split(
            _same_edges(np.concatenate(positions)), np.cumsum([len(part) for part in positions])[:-1]
        )
        rim_kinds, split_kinds = kinds[: len(layouts)], np.concatenate(kinds[len(layouts) :])
        return cls(
            layouts, rims, rim_kinds, _shares(split_kinds, np.concatenate([edges.shares for edges in splits]))
        )

    @property
    def edges(self) -> int:
        """Number of edges that are split; coinciding edges count once."""
        return len(self.shares)

    def layouts_split(self) -> list[SplitLayout]:
        """Return the layouts with their rims split."""
        return [
            _split(layout, rim, kinds, self.shares)
            for layout, rim, kinds in zip(self.layouts, self.rims, self.kinds)
        ]

    def without(self, flipped: Sequence[Index]) -> "RimSplits":
        """Drop splits near flipped triangles.

        `flipped` holds triangles (k,) of each layout. Edges of these triangles are no longer split, or the nearest
        split edges if they have none.
        """
        dropped = set[int]()
        for layout, rim, kinds, triangles in zip(self.layouts, self.rims, self.kinds, flipped):
            split, faces = np.isin(kinds, list(self.shares)), layout.patch.faces
            for corners in faces[triangles if split.any() else []]:
                is_near = np.zeros(layout.flat.size, bool)
                is_near[corners] = True
                while not (ends := np.where(split, is_near[rim].sum(axis=1), 0)).any():
                    is_near[faces[is_near[faces].any(axis=1)]] = True
                dropped |= set(kinds[ends == ends.max()].tolist())
        dropped = dropped or set(self.shares)
        return replace(
            self, shares={k: split_shares for k, split_shares in self.shares.items() if k not in dropped}
        )


def least_heights(layout: Flattening, z: Complex) -> Real:
    """Return (m,) the least height over all triangulations of each triangle's polygon, with vertices at z (p,).

    It is negative where one of these triangles is flipped.
    """
    patch = layout.patch
    triangles, face = patch.fans
    lowest = np.full(patch.mesh.sizes.size, np.inf)
    np.minimum.at(lowest, face, triangle_heights(z[triangles]))
    return np.minimum(triangle_heights(z[patch.faces]), lowest[patch.polygon])


class _Places(NamedTuple):
    """Points (k,) on edges: their ends, the lexicographically smaller one in space first, and the share from it."""

    tails: Index
    heads: Index
    shares: Real


def _rim(layout: Flattening) -> Index:
    """Return (e, 2) rim edges that may be split: those of polygons that are in the layout completely."""
    patch = layout.patch
    shape, mesh = patch.triangles, patch.mesh
    half = np.flatnonzero(shape.twin < 0)
    face = patch.polygon
    whole = np.bincount(face, minlength=mesh.sizes.size)[face] == mesh.sizes[face] - 2
    half = half[whole[half // 3]]
    return np.column_stack([shape.tail[half], shape.head[half]])


def _oriented(layout: Flattening, rim: Index) -> Index:
    """Orient edges (e, 2) from the lexicographically smaller end in space, so that both sides of a seam agree."""
    a, b = layout.patch.points[rim[:, 0]], layout.patch.points[rim[:, 1]]
    first = np.argmax(a != b, axis=1)[:, None]
    swap = np.take_along_axis(a, first, 1) > np.take_along_axis(b, first, 1)
    return np.where(swap, rim[:, ::-1], rim)


def _places(layout: Flattening, image: Complex, map: AnyMap, tolerance: float) -> _Places:
    """Return the points at which the edges of a layout's rim have to be split."""
    piecewise, rim = triangulated(map), _oriented(layout, _rim(layout))
    tails, heads = rim.T
    image_outline = np.concatenate([piecewise.image[loop] for loop in piecewise.loops])
    source_outline = np.concatenate([piecewise.source[loop] for loop in piecewise.loops])
    start, end = layout.flat[tails], layout.flat[heads]
    edge, part = nearest_segments(image_outline, start, end)
    is_near = (
        np.abs(start[edge] + part * (end - start)[edge] - image_outline)
        <= tolerance * piecewise.image_diagonal
    )
    inner = is_near & (part > ON_EDGE_BARYCENTRIC) & (part < 1 - ON_EDGE_BARYCENTRIC)
    order = np.lexsort((part[inner], edge[inner]))
    edge, part, source_outline = edge[inner][order], part[inner][order], source_outline[inner][order]
    begins = np.flatnonzero(np.diff(edge, prepend=-1))
    allowed, needed = OWN_TOLERANCE_SHARE * tolerance * piecewise.diagonal, []
    for first, last in zip(begins, np.append(begins[1:], edge.size)):
        k = edge[first]
        chain = np.concatenate([[image[tails[k]]], source_outline[first:last], [image[heads[k]]]])
        needed.append(first - 1 + np.flatnonzero(_simplified(chain, allowed))[1:-1])
    indices = np.concatenate([np.zeros(0, np.int64), *needed])
    return _Places(tails[edge[indices]], heads[edge[indices]], part[indices])


def _simplified(z: Complex, allowed: float) -> Flags:
    """Mark (n,) the points of a polyline that are needed to approximate it (Douglas and Peucker 1973)."""
    is_needed = np.zeros(z.size, bool)
    is_needed[[0, -1]] = True
    waiting = [(0, z.size - 1)]
    while waiting:
        a, b = waiting.pop()
        if b - a < 2:
            continue
        along, inner = z[b] - z[a], z[a + 1 : b]
        share = ((inner - z[a]) * np.conj(along)).real / max(abs(along) ** 2, 1e-300)
        distances = np.abs(z[a] + np.clip(share, 0, 1) * along - inner)
        worst = int(np.argmax(distances))
        if distances[worst] > allowed:
            is_needed[a + 1 + worst] = True
            waiting += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return is_needed


def _same_edges(ends: Real) -> Index:
    """Return (e,) numbers of edges (e, 2, 3), equal for edges between the same two points."""
    _, point = distinct_rows(ends.reshape(-1, 3))
    return distinct_rows(np.sort(point.reshape(-1, 2), axis=1))[1]


def _shares(kinds: Index, shares: Real) -> dict[int, Real]:
    """Return the split points of each kind of edge, ascending; of nearly equal ones only the first is kept."""
    order = np.lexsort((shares, kinds))
    kinds, shares = kinds[order], shares[order]
    is_distinct = (np.diff(kinds, prepend=-1) != 0) | (np.diff(shares, prepend=-1.0) > ON_EDGE_BARYCENTRIC)
    kinds, shares = kinds[is_distinct], shares[is_distinct]
    begins = np.flatnonzero(np.diff(kinds, prepend=-1))
    return dict(zip(kinds[begins].tolist(), np.split(shares, begins[1:])))


def _split(layout: Flattening, rim: Index, kinds: Index, shares: dict[int, Real]) -> SplitLayout:
    """Return a layout with rim edges (e, 2) split at the shares of their kinds (e,)."""
    faces, count = layout.patch.faces, len(layout.patch.points)
    surface = RefinedSurface.of(faces, count)
    hit = [(k, shares[kind]) for k, kind in enumerate(kinds.tolist()) if kind in shares]
    if hit:
        times = [len(split_shares) for _, split_shares in hit]
        tails, heads = (np.repeat(ends, times) for ends in rim[[k for k, _ in hit]].T)
        ends, on = np.zeros((2, count), bool)
        ends[np.concatenate([tails, heads])] = True
        on[np.concatenate(layout.patch.loops)] = True
        is_beside = (ends[faces].sum(axis=1) > 1)[:, None] & on[faces]
        ends[faces[is_beside]] = True  # the opposite vertex too: triangles need room behind a concave outline
        surface = surface.without_chords(ends)
        surface = surface.with_points_on(
            tails, heads, np.concatenate([split_shares for _, split_shares in hit])
        )
    return SplitLayout(surface, surface.carried(layout.flat))


def subdivision(layout: Flattening, surface: RefinedSurface) -> tuple[Subdivision, Index, Index]:
    """Return the split triangles of a layout in terms of its mesh.

    Returns:
        The triangles that replace polygons, wound as in the mesh; (k,) their numbers in the surface; and (k,) whether
        the surface winds each the other way round.
    """
    patch, count = layout.patch, len(layout.patch.points)
    face = patch.polygon[surface.original]
    changed = (surface.faces >= count).any(axis=1)
    rows = np.flatnonzero(np.isin(face, np.unique(face[changed])))
    rows = rows[np.argsort(face[rows], kind="stable")]
    triangles = surface.original[rows]
    parents = [np.column_stack([np.arange(count)] * 3), *(ends for ends, _ in surface.added)]
    parts = [np.tile([1.0, 0.0, 0.0], (count, 1)), *(shares for _, shares in surface.added)]
    corners = surface.faces[rows]
    parent_vertices, parent_weights = np.concatenate(parents)[corners], np.concatenate(parts)[corners]
    original_corners = patch.faces[triangles]
    weights = (
        (parent_vertices[:, :, :, None] == original_corners[:, None, None, :]) * parent_weights[..., None]
    ).sum(axis=2)
    is_reversed = (np.roll(patch.corner[triangles], -1, axis=1) < patch.corner[triangles]).sum(axis=1) == 2
    weights = np.where(is_reversed[:, None, None], weights[:, ::-1], weights)
    return Subdivision(face[rows], patch.corner[triangles], weights), rows, is_reversed
