"""Curve segments in the plane, Bézier and elliptical; flattening to polylines, and simplification of polylines."""

import cmath
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arrays import Complex, Real
from .affine import Affine

WORTHWHILE_KEPT_SHARE = 0.99  # `thinned` stops when a round leaves more than this share of the vertices


class Piece(ABC):
    """One segment, parametrized over [0, 1]."""

    __slots__ = ()

    @abstractmethod
    def under(self, affine: Affine) -> "Piece":
        """Return the image of the segment under an affine map."""

    @abstractmethod
    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1]."""

    @abstractmethod
    def bend(self) -> float:
        """Return an upper bound on |f''|."""

    @abstractmethod
    def last(self) -> complex:
        """Return the exact end point of the segment."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """A polyline through the vertices z (n,), stored without an object for each of its segments."""

    z: Complex


@dataclass(frozen=True, eq=False, slots=True)
class Bezier(Piece):
    """A Bézier curve of degree 1 to 3, given by its control points."""

    p: tuple[complex, ...]

    def under(self, affine: Affine) -> "Bezier":
        """Return the image of the segment under an affine map."""
        return Bezier(tuple(affine(point) for point in self.p))

    def last(self) -> complex:
        """Return the exact end point of the segment."""
        return self.p[-1]

    def bend(self) -> float:
        """Return an upper bound on |f''|."""
        degree = len(self.p) - 1
        return degree * (degree - 1) * float(np.abs(np.diff(self.p, 2)).max()) if degree > 1 else 0.0

    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1], by de Casteljau's algorithm."""
        points = [np.full(t.shape, point) for point in self.p]
        while len(points) > 1:
            points = [a * (1 - t) + b * t for a, b in pairwise(points)]
        return points[0]


@dataclass(frozen=True, eq=False)
class Arc(Piece):
    """The arc centre + u cos θ + v sin θ, with θ from `begin` over `sweep`, up to the exact `end`."""

    centre: complex
    u: complex
    v: complex
    begin: float
    sweep: float
    end: complex

    def under(self, affine: Affine) -> "Arc":
        """Return the image of the segment under an affine map."""
        centre = affine(self.centre)
        u, v = (affine(axis) - affine(0j) for axis in (self.u, self.v))
        return Arc(centre, u, v, self.begin, self.sweep, affine(self.end))

    def last(self) -> complex:
        """Return the exact end point of the segment."""
        return self.end

    def bend(self) -> float:
        """Return an upper bound on |f''|."""
        return math.hypot(abs(self.u), abs(self.v)) * self.sweep**2

    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1]."""
        angle = self.begin + self.sweep * t
        return self.centre + self.u * np.cos(angle) + self.v * np.sin(angle)


def bezier(points: list[complex]) -> Bezier:
    """Return the Bézier curve with the given control points."""
    return Bezier(tuple(points))


def arc(
    start: complex, rx: float, ry: float, rotation: float, large: float, sweep: float, end: complex
) -> Piece:
    """Return SVG's elliptical arc (SVG 2, appendix B.2): radii too small are enlarged, zero radii give a line."""
    rx, ry, turn = abs(rx), abs(ry), cmath.exp(1j * math.radians(rotation % 360))
    half = (start - end) / 2 * turn.conjugate()
    # half the chord, with the ellipse scaled to the unit circle
    a = complex(half.real / rx, half.imag / ry) if rx and ry else 0j
    if not (0 < abs(a) < 1e30):
        return Bezier((start, end))
    grow = max(1.0, abs(a))
    a, rx, ry = a / grow, rx * grow, ry * grow
    away = math.sqrt(max(0.0, 1 - abs(a) ** 2)) / abs(a)
    centre = -1j * a * (away if large != sweep else -away)
    begin, until = cmath.phase(a - centre), cmath.phase(-a - centre)
    angle = (until - begin) % (2 * math.pi) if sweep else -((begin - until) % (2 * math.pi))
    middle = (start + end) / 2 + turn * complex(rx * centre.real, ry * centre.imag)
    return Arc(middle, turn * rx, 1j * turn * ry, begin, angle, end)


def thinned(z: Complex, tolerance: float, *, closed: bool) -> Complex:
    """Return a simplified polyline that stays within a tolerance of the given one.

    In each round every other vertex is removed where that moves the line little enough. Each segment carries a bound on
    its deviation from the original; when two are merged, the bound is the larger one plus the distance of the removed
    vertex. The time is linear in the number of vertices in all cases.
    """
    missing = np.zeros(z.size)  # bound on the deviation of the segment from each vertex to the next
    parity = 0
    while z.size > 4:
        vertices = np.arange(1 + parity, z.size - 1, 2)
        worst = np.maximum(missing[vertices - 1], missing[vertices]) + _away(
            z[vertices], z[vertices - 1], z[vertices + 1]
        )
        removable = worst <= tolerance
        missing[vertices[removable] - 1] = worst[removable]
        keep = np.ones(z.size, dtype=bool)
        keep[vertices[removable]] = False
        old_size = z.size
        z, missing = z[keep], missing[keep]
        if z.size > WORTHWHILE_KEPT_SHARE * old_size and parity:
            break
        parity = 1 - parity
    return z[:-1] if closed and z[0] == z[-1] else z


def _away(point: Complex, a: Complex, b: Complex) -> Real:
    """Return distances of points from segments ab."""
    chord = b - a
    square = np.maximum(np.abs(chord) ** 2, 1e-300)
    t = np.clip(((point - a) * chord.conj()).real / square, 0, 1)
    return np.abs(point - a - t * chord)
