"""Two polygon meshes of the same connectivity, their faces and vertices in any order.

A half-edge and its partner in the other mesh, the seed, determine all others of a connected surface: next goes to
next, and the other side of an edge to the other side. Seeds are half-edges whose surroundings occur seldom (colour
refinement, Weisfeiler and Leman 1968). Of several that fit, as on symmetric meshes, those are kept with which a
similarity brings the vertices closest to each other, and of these the one that turns least is taken.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Flags, Index, Real, distinct_rows
from ..meshes.topology import labels

SURROUNDING_STEPS = 32  # steps along the surface up to which surroundings are compared (by hand)
SEEDS_TRIED = (
    64  # partners that are tried for a half-edge; of more pieces of one connectivity the nearest (by hand)
)
MOST_PIECES = (
    1000  # meshes of more are soups, in which looking for each piece's partner takes too long (by hand)
)
ALIKE_RESIDUAL_RATIO = 2.0
"""Times the least residual: partners that fit so well are distinguished by how little they turn (by hand)."""
EXACT_RESIDUAL = 1e-12  # residual that is nothing but rounding


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons whose vertices in one place are one.

    Attributes:
        points: (n, 3) positions.
        corners: (c,) vertices of all polygons, one after the other.
        starts: (f + 1,) where each polygon's begin.
    """

    points: Real
    corners: Index
    starts: Index

    @classmethod
    def triangles(cls, points: Real, faces: Index) -> "Polygons":
        """Of triangles (m, 3)."""
        return cls(points, faces.ravel(), np.arange(0, faces.size + 1, 3))

    @cached_property
    def places(self) -> Index:
        """(c,) the place of each corner."""
        return distinct_rows(self.points)[1][self.corners]

    @cached_property
    def following(self) -> Index:
        """(c,) the next corner of the same polygon."""
        found = np.arange(1, self.corners.size + 1)
        found[self.starts[1:] - 1] = self.starts[:-1]
        return found

    @cached_property
    def twin(self) -> Index:
        """(c,) the corner from which the other polygon's half-edge on the same edge runs; itself where there is
        no
        other, or several."""
        ends = np.sort(np.stack([self.places, self.places[self.following]], axis=-1), axis=1)
        key = ends[:, 0] * (int(ends.max(initial=0)) + 1) + ends[:, 1]
        order = np.argsort(key, kind="stable")
        begins = np.flatnonzero(np.diff(key[order], prepend=-1))
        two = begins[np.diff(begins, append=order.size) == 2]
        found = np.arange(order.size)
        found[order[two]], found[order[two + 1]] = order[two + 1], order[two]
        return found

    @cached_property
    def component(self) -> Index:
        """(c,) the connected surface that each corner is on."""
        every = np.arange(self.corners.size)
        sides = np.concatenate([self.following, self.twin])
        return labels(np.concatenate([every, every]), sides, every.size)

    @cached_property
    def surroundings(self) -> NDArray[np.uint64]:
        """(c,) numbers that are the same for half-edges with the same connectivity around them."""
        found = np.bincount(self.places)[self.places].astype(np.uint64)
        found += np.repeat(np.diff(self.starts), np.diff(self.starts)).astype(np.uint64) << np.uint64(32)
        for _ in range(SURROUNDING_STEPS):
            found = _mixed(
                found + np.uint64(3) * found[self.following] + np.uint64(7) * _mixed(found[self.twin])
            )
        return found


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return the finaliser of SplitMix64 (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def isomorphism(old: Polygons, new: Polygons) -> Index | None:
    """Return (c,) the corner of the old mesh for each of the new one; None where the connectivity is not the same, too
    regular to find a seed, or that of too many pieces.

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
    there, fit = np.full(old.corners.size, -1), _Fit()
    known, trial = np.zeros(there.size, bool), np.empty_like(there)
    for seed in seeds[np.lexsort([-sizes, count[kind[seeds]]])]:
        tried = by_kind[begins[kind[seed]] : begins[kind[seed] + 1]]
        tried = tried[there[tried] < 0]
        if tried.size > SEEDS_TRIED:
            if not fit.count:
                return None
            away = fit.of(old.points[old.corners[seed]]) - new.points[new.corners[tried]]
            tried = tried[np.argpartition(np.sum(away * away, axis=1), SEEDS_TRIED)[:SEEDS_TRIED]]
        steps, fits = _steps(old, int(seed), known), list[tuple[_Fit, Index, Index]]()
        for other in tried:
            if (found := _followed(old, new, steps, int(seed), int(other), trial)) is None:
                continue
            own, partner = found
            fits.append(
                (fit.with_pairs(old.points[old.corners[own]], new.points[new.corners[partner]]), own, partner)
            )
        if not fits:
            return None
        least = min(fitted.turned for fitted, _, _ in fits)
        alike = [each for each in fits if each[0].turned <= ALIKE_RESIDUAL_RATIO * least + EXACT_RESIDUAL]
        fit, own, partner = min(alike, key=lambda each: each[0].upright)
        there[partner] = own
    return there


def _steps(old: Polygons, seed: int, known: Flags) -> list[tuple[Index, Index, Flags]]:
    """Return the half-edges of a surface in rings around one: those of each ring, where they are reached from, and
    whether along a polygon, not across an edge. Marks them in `known` (c,).
    """
    known[seed] = True
    ring, found = np.array([seed]), []
    while ring.size:
        reached = np.concatenate([old.following[ring], old.twin[ring]])
        origin, along = np.concatenate([ring, ring]), np.arange(reached.size) < ring.size
        fresh = ~known[reached]
        reached, origin, along = reached[fresh], origin[fresh], along[fresh]
        ring, first = np.unique(reached, return_index=True)
        known[ring] = True
        found.append((ring, origin[first], along[first]))
    return found


def _followed(
    old: Polygons, new: Polygons, steps: list[tuple[Index, Index, Flags]], seed: int, other: int, there: Index
) -> tuple[Index, Index] | None:
    """Return the half-edges of a surface and their partners, if one is given; None where connectivity differs.
    Overwrites those in `there` (c,).
    """
    there[seed] = other
    for ring, origin, along in steps:
        at = there[origin]
        there[ring] = np.where(along, new.following[at], new.twin[at])
    own = np.concatenate([[seed], *(ring for ring, _, _ in steps)])
    partner = there[own]
    alike = np.array_equal(there[old.following[own]], new.following[partner]) and np.array_equal(
        there[old.twin[own]], new.twin[partner]
    )
    return (own, partner) if alike and np.unique(partner).size == own.size else None


@dataclass(frozen=True, eq=False)
class _Fit:
    """Sums over pairs of points from which the best similarity's residuals follow (Umeyama 1991)."""

    count: int = 0
    sums: Real = field(default_factory=lambda: np.zeros((2, 3)))
    squares: Real = field(default_factory=lambda: np.zeros(2))
    products: Real = field(default_factory=lambda: np.zeros((3, 3)))

    def with_pairs(self, a: Real, b: Real) -> "_Fit":
        """With further pairs."""
        return _Fit(
            self.count + len(a),
            self.sums + np.stack([a.sum(axis=0), b.sum(axis=0)]),
            self.squares + np.array([np.sum(a * a), np.sum(b * b)]),
            self.products + a.T @ b,
        )

    @cached_property
    def _moments(self) -> tuple[Real, float]:
        """(3, 3) covariance, and the product of both sets' sums of squared distances from the middle."""
        middle = self.sums / self.count
        spread = self.squares - self.count * np.sum(middle * middle, axis=1)
        return self.products - self.count * np.outer(*middle), max(float(spread.prod()), 1e-300)

    @cached_property
    def turned(self) -> float:
        """What the best similarity leaves of the squared distances from the middle."""
        covariance, spread = self._moments
        values = np.linalg.svd(covariance, compute_uv=False)
        if np.linalg.det(covariance) < 0:
            values[-1] *= -1
        return float(1 - values.sum() ** 2 / spread)

    def of(self, points: Real) -> Real:
        """Return points (…, 3) by the best similarity."""
        covariance, _ = self._moments
        left, values, right = np.linalg.svd(covariance)
        signs = np.array([1, 1, np.sign(np.linalg.det(left @ right)) or 1.0])
        a, b = self.sums / self.count
        scale = (values * signs).sum() / max(self.squares[0] - self.count * (a @ a), 1e-300)
        return scale * (points - a) @ (left * signs) @ right + b

    @property
    def upright(self) -> float:
        """What the best similarity without a turn leaves."""
        covariance, spread = self._moments
        return float(1 - max(np.trace(covariance), 0) ** 2 / spread)
