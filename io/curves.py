"""Pieces of curves in the plane, Bézier and elliptical: points of them, and polylines within a tolerance."""

import cmath
import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..cauchy import Complex
from .affine import Affine


@dataclass(frozen=True, eq=False)
class Bezier:
    """A Bézier curve of degree 1 to 3, by its control points."""

    p: tuple[complex, ...]

    def under(self, affine: Affine) -> "Bezier":
        """Its image."""
        return Bezier(tuple(affine(point) for point in self.p))

    @property
    def end(self) -> complex:
        """Its last point."""
        return self.p[-1]

    @property
    def bend(self) -> float:
        """A bound on |f''|, f running over it in unit time."""
        degree = len(self.p) - 1
        return degree * (degree - 1) * float(np.abs(np.diff(self.p, 2)).max()) if degree > 1 else 0.0

    def at(self, t: np.ndarray) -> Complex:
        """Points at parameters in [0, 1], by de Casteljau."""
        points = [np.full(t.shape, point) for point in self.p]
        while len(points) > 1:
            points = [a * (1 - t) + b * t for a, b in pairwise(points)]
        return points[0]

    def rough(self) -> list[complex]:
        """A few points on it: their box is never larger than the curve's."""
        return _rough(self)

    def points(self, tolerance: float) -> Complex:
        """Vertices of a polyline at most `tolerance` away, without the start."""
        return _points(self, tolerance)


@dataclass(frozen=True, eq=False)
class Arc:
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

    @property
    def bend(self) -> float:
        """A bound on |f''|, f running over it in unit time."""
        return math.hypot(abs(self.u), abs(self.v)) * self.sweep**2

    def at(self, t: np.ndarray) -> Complex:
        """Points at parameters in [0, 1]."""
        angle = self.begin + self.sweep * t
        return self.centre + self.u * np.cos(angle) + self.v * np.sin(angle)

    def rough(self) -> list[complex]:
        """A few points on it: their box is never larger than the curve's."""
        return _rough(self)

    def points(self, tolerance: float) -> Complex:
        """Vertices of a polyline at most `tolerance` away, without the start."""
        return _points(self, tolerance)


Piece = Bezier | Arc


def bezier(points: list[complex]) -> Bezier:
    """The Bézier curve with these control points."""
    return Bezier(tuple(points))


def arc(
    start: complex, rx: float, ry: float, turned: float, large: float, sweep: float, end: complex
) -> Piece:
    """SVG's elliptical arc (SVG 2, appendix B.2): radii that are too small are enlarged; without radii it is a line."""
    rx, ry, turn = abs(rx), abs(ry), cmath.exp(1j * math.radians(turned % 360))
    half = (start - end) / 2 * turn.conjugate()
    a = (
        complex(half.real / rx, half.imag / ry) if rx and ry else 0j
    )  # half the chord, the ellipse made a unit circle
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


def _rough(piece: Piece) -> list[complex]:
    return [*piece.at(np.array([0.25, 0.5, 0.75])), piece.end] if piece.bend else [piece.end]


def _points(piece: Piece, tolerance: float) -> Complex:
    bend = piece.bend
    if not bend or not tolerance:
        return np.array([piece.end])
    count = max(1, math.ceil(math.sqrt(bend / (8 * tolerance))))
    points = piece.at(np.arange(1, count + 1) / count)
    points[-1] = piece.end
    return points
