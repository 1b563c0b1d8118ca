"""Find the correspondence of two polygon meshes with the same connectivity, whatever the order of faces and vertices.

On a connected surface one pair of corresponding half-edges, the seed, determines all others: "next" corresponds to
"next", and "twin" to "twin". Seeds are half-edges with a rare neighbourhood (color refinement, Weisfeiler and Leman
1968). If several partners of a seed fit, as on symmetric meshes, those are kept for which a similarity brings the
vertices closest to each other, and of these the one with the least rotation is chosen.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Flags, Index, Real, distinct_rows
from ..meshes.topology import labels

SURROUNDING_STEPS = 32
"""Radius, in half-edges, of the neighbourhoods that are compared: farther ones rarely tell candidates apart."""
SEEDS_TRIED = 64
"""Candidates tried as partner of one half-edge; with many equal pieces, the nearest ones, which bounds the time."""
MOST_PIECES = 1000
"""Meshes with more pieces are polygon soups, whose pieces would take too long to match."""
ALIKE_RESIDUAL_RATIO = 2.0
"""Times the least residual: candidates that fit this well are ranked by their rotation instead, since rounding
decides between them."""
EXACT_RESIDUAL = 1e-12  # a residual of nothing but rounding


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons; vertices at the same position count as one.

    Attributes:
        points: (n, 3) positions.
        corners: (c,) vertices of all polygons, one polygon after the other.
        starts: (f + 1,) where each polygon begins in `corners`.
    """

    points: Real
    corners: Index
    starts: Index

    @classmethod
    def triangles(cls, points: Real, faces: Index) -> "Polygons":
        """Create polygons from triangles (m, 3)."""
        return cls(points, faces.ravel(), np.arange(0, faces.size + 1, 3))

    @cached_property
    def places(self) -> Index:
        """Number of each corner's position; equal positions have equal numbers; shape (c,)."""
        return distinct_rows(self.points)[1][self.corners]

    @cached_property
    def following(self) -> Index:
        """The next corner in the same polygon; shape (c,)."""
        next_corners = np.arange(1, self.corners.size + 1)
        next_corners[self.starts[1:] - 1] = self.starts[:-1]
        return next_corners

    @cached_property
    def twin(self) -> Index:
        """(c,) the opposite half-edge, given by the corner where it starts; itself if there is none or several."""
        ends = np.sort(np.stack([self.places, self.places[self.following]], axis=-1), axis=1)
        key = ends[:, 0] * (int(ends.max(initial=0)) + 1) + ends[:, 1]
        order = np.argsort(key, kind="stable")
        begins = np.flatnonzero(np.diff(key[order], prepend=-1))
        two = begins[np.diff(begins, append=order.size) == 2]
        twins = np.arange(order.size)
        twins[order[two]], twins[order[two + 1]] = order[two + 1], order[two]
        return twins

    @cached_property
    def component(self) -> Index:
        """The connected component of each corner; shape (c,)."""
        every = np.arange(self.corners.size)
        sides = np.concatenate([self.following, self.twin])
        return labels(np.concatenate([every, every]), sides, every.size)

    @cached_property
    def surroundings(self) -> NDArray[np.uint64]:
        """Hash of each half-edge's neighbourhood; equal connectivity has equal hashes; shape (c,)."""
        hashes = np.bincount(self.places)[self.places].astype(np.uint64)
        hashes += np.repeat(np.diff(self.starts), np.diff(self.starts)).astype(np.uint64) << np.uint64(32)
        for _ in range(SURROUNDING_STEPS):
            hashes = _mixed(
                hashes + np.uint64(3) * hashes[self.following] + np.uint64(7) * _mixed(hashes[self.twin])
            )
        return hashes


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return x (c,) scrambled by the finalizer of SplitMix64 (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def isomorphism(old: Polygons, new: Polygons) -> Index | None:
    """Return (c,) the old mesh's corner for each corner of the new mesh.

    Returns None where the connectivity differs, is too regular to find a seed, or has too many pieces.

    Example:
        >>> import numpy as np
        >>> points, starts = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [3, 3, 0.0]]), np.array([0, 4, 7])
        >>> old = Polygons(points, np.array([0, 1, 2, 3, 2, 1, 4]), starts)
        >>> new = Polygons(points[::-1] * 9, np.array([0, 2, 3, 3, 2, 1, 4]), np.array([0, 3, 7]))
        >>> isomorphism(old, new).tolist()
        [6, 4, 5, 1, 2, 3, 0]
    """
    if old.corners.size != new.corners.size or old.starts.size != new.starts.size or not new.corners.size:
        return None
    kinds, shared = np.unique(np.concatenate([old.surroundings, new.surroundings]), return_inverse=True)
    kind, kind_new = np.split(shared, 2)
    count = np.bincount(kind, minlength=kinds.size)
    if not np.array_equal(count, np.bincount(kind_new, minlength=kinds.size)):
        return None
    by_kind, begins = np.argsort(kind_new, kind="stable"), np.concatenate([[0], np.cumsum(count)])
    rarest = np.lexsort([count[kind], old.component])
    seeds = rarest[np.flatnonzero(np.diff(old.component[rarest], prepend=-1))]
    if seeds.size > MOST_PIECES:
        return None
    sizes = np.bincount(old.component)
    old_corners, fit = np.full(old.corners.size, -1), _Fit()
    visited, trial = np.zeros(old_corners.size, bool), np.empty_like(old_corners)
    for seed in seeds[np.lexsort([-sizes, count[kind[seeds]]])]:
        candidates = by_kind[begins[kind[seed]] : begins[kind[seed] + 1]]
        candidates = candidates[old_corners[candidates] < 0]
        if candidates.size > SEEDS_TRIED:
            if not fit.count:
                return None
            differences = fit.of(old.points[old.corners[seed]]) - new.points[new.corners[candidates]]
            candidates = candidates[
                np.argpartition(np.sum(differences * differences, axis=1), SEEDS_TRIED)[:SEEDS_TRIED]
            ]
        steps, fits = _steps(old, int(seed), visited), list[tuple[_Fit, Index, Index]]()
        for candidate in candidates:
            if (match := _follow(old, new, steps, int(seed), int(candidate), trial)) is None:
                continue
            half_edges, partner = match
            fits.append(
                (
                    fit.with_pairs(old.points[old.corners[half_edges]], new.points[new.corners[partner]]),
                    half_edges,
                    partner,
                )
            )
        if not fits:
            return None
        least = min(fitted.residual for fitted, _, _ in fits)
        best = [entry for entry in fits if entry[0].residual <= ALIKE_RESIDUAL_RATIO * least + EXACT_RESIDUAL]
        fit, half_edges, partner = min(best, key=lambda entry: entry[0].upright_residual)
        old_corners[partner] = half_edges
    return old_corners


def _steps(old: Polygons, seed: int, visited: Flags) -> list[tuple[Index, Index, Flags]]:
    """Return the half-edges of a component in breadth-first rings around one of them.

    Each ring has its half-edges, the half-edge from which each was reached, and whether that was along the polygon
    (next) rather than across an edge (twin). Visited half-edges are marked in `visited` (c,).
    """
    visited[seed] = True
    ring, rings = np.array([seed]), []
    while ring.size:
        reached = np.concatenate([old.following[ring], old.twin[ring]])
        origin, along = np.concatenate([ring, ring]), np.arange(reached.size) < ring.size
        fresh = ~visited[reached]
        reached, origin, along = reached[fresh], origin[fresh], along[fresh]
        ring, first = np.unique(reached, return_index=True)
        visited[ring] = True
        rings.append((ring, origin[first], along[first]))
    return rings


def _follow(
    old: Polygons,
    new: Polygons,
    steps: list[tuple[Index, Index, Flags]],
    seed: int,
    candidate: int,
    partners: Index,
) -> tuple[Index, Index] | None:
    """Return the half-edges of a component and their partners, given one partner; None where connectivity differs.

    `partners` (c,) is overwritten for these half-edges.
    """
    partners[seed] = candidate
    for ring, origin, along in steps:
        previous = partners[origin]
        partners[ring] = np.where(along, new.following[previous], new.twin[previous])
    half_edges = np.concatenate([[seed], *(ring for ring, _, _ in steps)])
    partner = partners[half_edges]
    is_alike = np.array_equal(partners[old.following[half_edges]], new.following[partner]) and np.array_equal(
        partners[old.twin[half_edges]], new.twin[partner]
    )
    return (half_edges, partner) if is_alike and np.unique(partner).size == half_edges.size else None


@dataclass(frozen=True, eq=False)
class _Fit:
    """Sums over pairs of points that give the best similarity and its residual (Umeyama 1991)."""

    count: int = 0
    sums: Real = field(default_factory=lambda: np.zeros((2, 3)))
    squares: Real = field(default_factory=lambda: np.zeros(2))
    products: Real = field(default_factory=lambda: np.zeros((3, 3)))

    def with_pairs(self, a: Real, b: Real) -> "_Fit":
        """Return the sums with further pairs added."""
        return _Fit(
            self.count + len(a),
            self.sums + np.stack([a.sum(axis=0), b.sum(axis=0)]),
            self.squares + np.array([np.sum(a * a), np.sum(b * b)]),
            self.products + a.T @ b,
        )

    @cached_property
    def _moments(self) -> tuple[Real, float]:
        """The cross-covariance (3, 3) of both point sets, and the product of their sums of squares about the mean."""
        middle = self.sums / self.count
        spread = self.squares - self.count * np.sum(middle * middle, axis=1)
        return self.products - self.count * np.outer(*middle), max(float(spread.prod()), 1e-300)

    @cached_property
    def residual(self) -> float:
        """Residual of the best similarity, relative to the squared distances from the mean."""
        covariance, spread = self._moments
        values = np.linalg.svd(covariance, compute_uv=False)
        if np.linalg.det(covariance) < 0:
            values[-1] *= -1
        return float(1 - values.sum() ** 2 / spread)

    def of(self, points: Real) -> Real:
        """Return points (…, 3) mapped by the best similarity."""
        covariance, _ = self._moments
        left_vectors, values, right_vectors = np.linalg.svd(covariance)
        signs = np.array([1, 1, np.sign(np.linalg.det(left_vectors @ right_vectors)) or 1.0])
        a, b = self.sums / self.count
        scale = (values * signs).sum() / max(self.squares[0] - self.count * (a @ a), 1e-300)
        return scale * (points - a) @ (left_vectors * signs) @ right_vectors + b

    @property
    def upright_residual(self) -> float:
        """Residual of the best similarity without rotation, as `residual`."""
        covariance, spread = self._moments
        return float(1 - max(np.trace(covariance), 0) ** 2 / spread)
