"""Pieces of curves in the plane, Bézier and elliptical; polylines within a tolerance, and with fewer vertices."""

import cmath
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arrays import Complex, Real
from .affine import Affine

LEFT = 0.99  # of the vertices after a round of `thinned`: when no more go, the rest is worth no other round


class Piece(ABC):
    """One piece, run over in unit time."""

    __slots__ = ()

    @abstractmethod
    def under(self, affine: Affine) -> "Piece":
        """Its image."""

    @abstractmethod
    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1]."""

    @abstractmethod
    def bend(self) -> float:
        """Return a bound on |f''|."""

    @abstractmethod
    def last(self) -> complex:
        """Its end, exactly."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight segments from vertex to vertex: the long stretches of a drawing, without an object for each."""

    z: Complex


@dataclass(frozen=True, eq=False, slots=True)
class Bezier(Piece):
    """A Bézier curve of degree 1 to 3, by its control points."""

    p: tuple[complex, ...]

    def under(self, affine: Affine) -> "Bezier":
        """Its image."""
        return Bezier(tuple(affine(point) for point in self.p))

    def last(self) -> complex:
        """Its end, exactly."""
        return self.p[-1]

    def bend(self) -> float:
        """Return a bound on |f''|."""
        degree = len(self.p) - 1
        return degree * (degree - 1) * float(np.abs(np.diff(self.p, 2)).max()) if degree > 1 else 0.0

    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1], by de Casteljau."""
        points = [np.full(t.shape, point) for point in self.p]
        while len(points) > 1:
            points = [a * (1 - t) + b * t for a, b in pairwise(points)]
        return points[0]


@dataclass(frozen=True, eq=False)
class Arc(Piece):
    """centre + u cos θ + v sin θ, θ from `begin` over `sweep`, up to the exact `end`."""

    centre: complex
    u: complex
    v: complex
    begin: float
    sweep: float
    end: complex

    def under(self, affine: Affine) -> "Arc":
        """Its image."""
        centre = affine(self.centre)
        u, v = (affine(axis) - affine(0j) for axis in (self.u, self.v))
        return Arc(centre, u, v, self.begin, self.sweep, affine(self.end))

    def last(self) -> complex:
        """Its end, exactly."""
        return self.end

    def bend(self) -> float:
        """Return a bound on |f''|."""
        return math.hypot(abs(self.u), abs(self.v)) * self.sweep**2

    def at(self, t: np.ndarray) -> Complex:
        """Return points at parameters in [0, 1]."""
        angle = self.begin + self.sweep * t
        return self.centre + self.u * np.cos(angle) + self.v * np.sin(angle)


def bezier(points: list[complex]) -> Bezier:
    """Return the Bézier curve with these control points."""
    return Bezier(tuple(points))


def arc(
    start: complex, rx: float, ry: float, turned: float, large: float, sweep: float, end: complex
) -> Piece:
    """SVG's elliptical arc (SVG 2, appendix B.2): radii that are too small are enlarged; without radii it is a line."""
    rx, ry, turn = abs(rx), abs(ry), cmath.exp(1j * math.radians(turned % 360))
    half = (start - end) / 2 * turn.conjugate()
    # half the chord, the ellipse made a unit circle
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
    """Return a polyline without vertices that it hardly needs: it stays within the tolerance of the one that was given.

    Every other vertex goes in a round where that moves the line little enough. A segment knows a bound on what is
    already missing from it; where two become one, that is the larger of theirs and how far the vertex is away.
    Linear in the number of vertices, whatever they do.
    """
    missing = np.zeros(z.size)  # from each vertex to the next
    parity = 0
    while z.size > 4:
        at = np.arange(1 + parity, z.size - 1, 2)
        worst = np.maximum(missing[at - 1], missing[at]) + _away(z[at], z[at - 1], z[at + 1])
        gone = worst <= tolerance
        missing[at[gone] - 1] = worst[gone]
        keep = np.ones(z.size, dtype=bool)
        keep[at[gone]] = False
        before = z.size
        z, missing = z[keep], missing[keep]
        if z.size > LEFT * before and parity:
            break
        parity = 1 - parity
    return z[:-1] if closed and z[0] == z[-1] else z


def _away(point: Complex, a: Complex, b: Complex) -> Real:
    """Return distances of points from segments."""
    chord = b - a
    square = np.maximum(np.abs(chord) ** 2, 1e-300)
    t = np.clip(((point - a) * chord.conj()).real / square, 0, 1)
    return np.abs(point - a - t * chord)
