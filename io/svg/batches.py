"""Flatten many curve segments of one kind at once: the arithmetic of `curves` on arrays."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...arrays import Complex, Index, Real
from .affine import Affine
from .curves import Arc, Bezier, Piece, Polyline

ROUGH = np.array([0.25, 0.5, 0.75])


class Batch:
    """Segments of one kind under an affine map.

    Attributes:
        number: (k,) their indices among all segments.
        end: (k,) their end points.
        bend: (k,) upper bounds on |f''|.
    """

    number: Index
    end: Complex
    bend: Real

    def at(self, segment: Index, t: Real) -> Complex:
        """Return points at parameters t of the segments `segment`."""
        raise NotImplementedError

    def counts(self, tolerance: Real) -> Index:
        """Return (k,) numbers of points that keep each segment within its tolerance (k,).

        With equal parameter steps h a chord errs by at most h² max|f''| / 8.
        """
        safe = np.where(tolerance > 0, tolerance, 1)
        steps = np.where(tolerance > 0, np.ceil(np.sqrt(self.bend / (8 * safe))), 1)
        return np.maximum(1, np.minimum(steps, 2**40)).astype(np.int64)

    def rough(self) -> tuple[Complex, Index]:
        """Return a few points on the segments, and for each point the index of its segment.

        The bounding box of the points is at most as large as that of the segments.
        """
        if not self.bend.any():
            return self.end, self.number
        segment = np.repeat(np.arange(self.end.size), ROUGH.size)
        inner = self.at(segment, np.tile(ROUGH, self.end.size))
        return np.concatenate([inner, self.end]), np.concatenate([self.number[segment], self.number])

    def points(self, counts: Index) -> Complex:
        """Return the points of all segments, one after the other, without their start points."""
        segment, last = np.repeat(np.arange(counts.size), counts), np.cumsum(counts) - 1
        step = np.arange(segment.size) - (last - counts + 1)[segment] + 1
        z = self.at(segment, step / counts[segment])
        z[last] = self.end
        return z


class Beziers(Batch):
    """Bézier curves of one degree."""

    def __init__(self, number: Index, pieces: Sequence[Bezier], affine: Affine):
        self.number = number
        self.p = affine(np.array([piece.p for piece in pieces]))
        self.end = self.p[:, -1]
        degree = self.p.shape[1] - 1
        bend = np.abs(np.diff(self.p, 2, axis=1)).max(axis=1) if degree > 1 else np.zeros(self.end.size)
        self.bend = degree * (degree - 1) * bend

    def at(self, segment: Index, t: Real) -> Complex:
        """Return points at parameters t of the segments `segment`, by de Casteljau's algorithm."""
        points = [column[segment] for column in self.p.T]
        while len(points) > 1:
            points = [a * (1 - t) + b * t for a, b in pairwise(points)]
        return points[0]


class Arcs(Batch):
    """Elliptical arcs."""

    def __init__(self, number: Index, pieces: Sequence[Arc], affine: Affine):
        self.number = number
        self.centre, u, v, self.end = (
            affine(np.array([getattr(piece, name) for piece in pieces], complex))
            for name in ("centre", "u", "v", "end")
        )
        self.u, self.v = u - affine(0j), v - affine(0j)
        self.begin, self.sweep = (np.array([getattr(p, name) for p in pieces]) for name in ("begin", "sweep"))
        self.bend = np.hypot(np.abs(self.u), np.abs(self.v)) * self.sweep**2

    def at(self, segment: Index, t: Real) -> Complex:
        """Return points at parameters t of the segments `segment`."""
        angle = self.begin[segment] + self.sweep[segment] * t
        return self.centre[segment] + self.u[segment] * np.cos(angle) + self.v[segment] * np.sin(angle)


class Stretches(Batch):
    """Polylines of straight segments; their points are their vertices."""

    def __init__(self, number: Index, pieces: Sequence[Polyline], affine: Affine):
        self.number = number
        self.z = [affine(piece.z) for piece in pieces]

    def counts(self, tolerance: Real) -> Index:
        """Return the number of vertices of each polyline, without its first; the tolerance is not used."""
        return np.array([z.size - 1 for z in self.z])

    def rough(self) -> tuple[Complex, Index]:
        """Return all vertices, and for each the index of its polyline among all segments."""
        return np.concatenate(self.z), np.repeat(self.number, [z.size for z in self.z])

    def points(self, counts: Index) -> Complex:
        """Return the points of all polylines, one after the other, without their start points."""
        return np.concatenate([z[1:] for z in self.z])


def batches(pieces: Sequence[Piece | Polyline], affine: Affine) -> list[Batch]:
    """Group segments by kind."""
    groups: dict[Any, list[int]] = {}
    for number, piece in enumerate(pieces):
        groups.setdefault(len(piece.p) if isinstance(piece, Bezier) else type(piece), []).append(number)
    makers: dict[Any, Any] = {Arc: Arcs, Polyline: Stretches}
    return [
        makers.get(kind, Beziers)(np.array(numbers), [pieces[k] for k in numbers], affine)
        for kind, numbers in groups.items()
    ]
