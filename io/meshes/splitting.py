"""Vertices that formats of one texture coordinate a vertex need: more of them, where coordinates part."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Index, Real, distinct_rows


@dataclass(frozen=True, eq=False)
class Split:
    """The vertices of a file, and after them copies of those whose corners have several coordinates.

    Attributes:
        count: how many the file has.
        order: (n,) which of them each is.
        coordinate: (n,) the coordinate of each, -1 where no corner says any.
        number: (c,) the vertex of each corner.
    """

    count: int
    order: Index
    coordinate: Index
    number: Index

    @classmethod
    def of(cls, vertices: Index, coordinates: Index, count: int) -> "Split":
        """From the vertex and the coordinate (c,) of each corner; every vertex keeps its number once."""
        pairs = np.stack([vertices, coordinates], axis=1)
        first, place = distinct_rows(pairs)
        pairs = pairs[first]
        further = np.append(False, pairs[1:, 0] == pairs[:-1, 0])[: len(pairs)]
        number = np.where(further, count + np.cumsum(further) - 1, pairs[:, 0])
        order = np.concatenate([np.arange(count), pairs[further, 0]])
        coordinate = np.full(order.size, -1)
        coordinate[number] = pairs[:, 1]
        return cls(count, order, coordinate, number[place])

    @property
    def copies(self) -> Index:
        """(k,) what those that are added are copies of."""
        return self.order[self.count :]

    def values(self, new: Real, old: Real) -> Real:
        """(n, 2) coordinates: the new ones (t, 2), and the old ones of the file's vertices where no corner says any."""
        return np.where((self.coordinate >= 0)[:, None], new[self.coordinate], old[self.order])
