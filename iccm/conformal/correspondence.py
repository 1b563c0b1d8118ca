"""A boundary correspondence: both boundaries as circles of harmonic measure, and a map between the circles."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..arrays import Complex, Real
from ..maps import cauchy_green
from .harmonic_measure import Circle, HarmonicMeasure

# Values were chosen by hand unless a comment gives a reason.
COARSE_PANELS = 150  # panels of a boundary during the search of parameters
TURN = 2 * np.pi  # radians
PANELS_PER_KNOT = 3  # distance of knots in panels of either shape
MOST_KNOTS = 500  # of an interpolated correspondence, about
CLOSEST_TURNS = 1e-14  # least distance of knots, in turns
LAPS = np.array([-1, 0, 1])[:, None]  # turns of copies that make an interpolation periodic


@dataclass(frozen=True)
class Moebius:
    """The Möbius map m(u) = exp(iρ) (u - b) / (1 - conj(b) u) on the circle, in turns; lifted and increasing."""

    b: complex
    rho: float | Real

    def __call__(self, turn: Real) -> Real:
        """Return the images of boundary points."""
        return turn + (self.rho - 2 * np.angle(1 - np.conj(self.b) * np.exp(1j * TURN * turn))) / TURN

    def inverse(self, turn: Real) -> Real:
        """Return the preimages of boundary points."""
        angle = TURN * turn - self.rho
        return (angle - 2 * np.angle(1 + np.conj(self.b) * np.exp(1j * angle))) / TURN

    def inside(self, u: Complex) -> Complex:
        """Return the images of points of the disc."""
        return np.exp(1j * self.rho) * (u - self.b) / (1 - np.conj(self.b) * u)

    @property
    def parameters(self) -> Real:
        """The unbounded parameters; see `of`; shape (3,)."""
        q = np.arctanh(abs(self.b)) * np.exp(1j * np.angle(self.b))
        return np.array([q.real, q.imag, float(self.rho)])

    @classmethod
    def of(cls, p: Real) -> "Moebius":
        """Return the map with unbounded parameters: the hyperbolic vector of b, and ρ."""
        q = complex(p[0], p[1])
        return cls(np.tanh(abs(q)) * np.exp(1j * np.angle(q)), float(p[2]))


class Coarse:
    """A boundary as the unit circle with few panels: enough to compare the distortion of Möbius maps, and fast."""

    def __init__(self, measure: HarmonicMeasure, mass: Real):
        """Join neighbouring panels."""
        first = np.arange(0, mass.size, max(1, mass.size // COARSE_PANELS))
        self.length = measure.curve.length
        self.lengths = np.add.reduceat(measure.lengths, first)
        self.weight = 0.5 * self.lengths / self.length
        mass = np.add.reduceat(mass, first)
        self.turns = np.concatenate([[0.0], np.cumsum(mass)]) / mass.sum()
        self.knots = measure.ends[0] + np.concatenate([[0.0], np.cumsum(self.lengths)])
        self.middles = 0.5 * (self.turns[1:] + self.turns[:-1])
        self.units = np.exp(1j * TURN * self.middles)
        self.log_density = np.log(mass / self.lengths)
        self._centres = 0.5 * (self.knots[1:] + self.knots[:-1])
        self._places, self.places = measure.curve.at(self.knots), measure.curve.at(self._centres)

    def arclength(self, turn: Real) -> Real:
        """Return s(F), within one lap."""
        return np.interp(turn - np.floor(turn), self.turns, self.knots)

    def place(self, turn: Real) -> Complex:
        """Return the point of the boundary at s(F), linear inside panels."""
        return np.interp(turn - np.floor(turn), self.turns, self._places)

    def density(self, turn: Real) -> Real:
        """Return log dF/ds at s(F)."""
        return np.interp(self.arclength(turn), self._centres, self.log_density)


@dataclass(frozen=True, eq=False)
class HarmonicView:
    """A boundary with its harmonic measure seen from one centre."""

    measure: HarmonicMeasure
    centre: complex
    mass: Real

    @classmethod
    def of(cls, measure: HarmonicMeasure, centres: Complex) -> "list[HarmonicView]":
        """Return the views from points inside."""
        return [cls(measure, c, mass) for c, mass in zip(centres, measure.masses(centres))]

    @cached_property
    def circle(self) -> Circle:
        """The boundary as the unit circle."""
        return Circle(self.measure, self.mass)

    @cached_property
    def coarse(self) -> Coarse:
        """The boundary as the unit circle with few panels."""
        return Coarse(self.measure, self.mass)

    def on_circle(self, z: Complex) -> Complex:
        """Return the points of the unit circle that stand for the points of the boundary closest to z (k,)."""
        return np.exp(1j * TURN * self.circle.turn(self.measure.curve.closest(z)))

    def disc(self, z: Complex) -> Complex:
        """Return the images of points inside under the Riemann map to the disc.

        They are Cauchy integrals of its boundary values.
        """
        values = np.exp(1j * TURN * self.circle.turns[:-1])
        return cauchy_green.coordinates(self.measure.z, z) @ values


@dataclass(frozen=True, eq=False)
class Correspondence:
    """A boundary correspondence: source view, target view, and an increasing map between their circles.

    Attributes:
        source: the source.
        target: the target.
        between: the map between their circles.
        distortion: of the map.
        fixed: source arclengths of the ends of axes of symmetry: (0,), (2,) or (4,). Their images stay where they are.
        fixed_images: target arclengths of these.
    """

    source: HarmonicView
    target: HarmonicView
    between: "Moebius | CircleMap"
    distortion: float
    fixed: Real = field(default_factory=lambda: np.empty(0))
    fixed_images: Real = field(default_factory=lambda: np.empty(0))

    def forward(self, s: Real) -> Real:
        """Return the target arclengths at source arclengths, lifted and increasing."""
        return self.target.circle.arclength(self.between(self.source.circle.turn(s)))

    def backward(self, tau: Real) -> Real:
        """Return the source arclengths at target arclengths, lifted and increasing."""
        return self.source.circle.arclength(self.between.inverse(self.target.circle.turn(tau)))


class CircleMap:
    """An increasing map of the circle onto itself, in turns: monotone cubic between knots."""

    def __init__(self, a: Real, b: Real):
        """Interpolate increasing knots a and their images b, each within one lap."""
        keep = _apart(a, b)
        self.a, self.b = a[keep], b[keep]
        long = (self.a + LAPS).ravel(), (self.b + LAPS).ravel()
        self._forward, self._backward = PchipInterpolator(*long), PchipInterpolator(*long[::-1])

    @classmethod
    def of(cls, c: Correspondence) -> "CircleMap":
        """Return the circle map of a correspondence, with knots at every few panel ends of both shapes."""
        source_turns, target_turns = c.source.circle.turns[:-1], c.target.circle.turns[:-1]
        a = np.concatenate([source_turns, c.between.inverse(target_turns)])
        b = np.concatenate([c.between(source_turns), target_turns])
        lap = np.floor(a)
        order = np.argsort(a - lap, kind="stable")
        a, b = (a - lap)[order], (b - lap)[order]
        keep = _apart(a, b)
        keep = keep[:: max(PANELS_PER_KNOT, len(keep) // MOST_KNOTS)]
        return cls(a[keep], b[keep])

    def __call__(self, turn: Real) -> Real:
        """Return the images of boundary points."""
        lap = np.floor(turn - self.a[0])
        return lap + self._forward(turn - lap)

    def inverse(self, turn: Real) -> Real:
        """Return the preimages of boundary points."""
        lap = np.floor(turn - self.b[0])
        return lap + self._backward(turn - lap)

    @property
    def gaps(self) -> Real:
        """Turns from each image knot to the next; shape (k,)."""
        return np.diff(np.append(self.b, self.b[0] + 1))

    def hats(self, turn: Real) -> Real:
        """Return (p, k) the piecewise linear basis functions at points."""
        ends = np.append(self.a, self.a[0] + 1)
        x = turn - np.floor(turn - self.a[0])
        k = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, self.a.size - 1)
        t = (x - ends[k]) / (ends[k + 1] - ends[k])
        out = np.zeros((x.size, self.a.size))
        rows = np.arange(x.size)
        out[rows, k] += 1 - t
        out[rows, (k + 1) % self.a.size] += t
        return out

    def strained(self, strain: Real, shift: float) -> "CircleMap":
        """Return the map with each gap scaled by its strain (without changing sign), and all knots shifted."""
        gaps = self.gaps * np.where(strain > -0.5, 1 + strain, 0.5 * np.exp(np.clip(2 * strain + 1, -5, 0)))
        gaps /= gaps.sum()
        return CircleMap(self.a, self.b[0] + shift + np.concatenate([[0.0], np.cumsum(gaps[:-1])]))

    def shifted(self, turn: Real, by: Real) -> "CircleMap":
        """Return the map with images moved by amounts that are given at some points, and linear between them."""
        return CircleMap(self.a, np.maximum.accumulate(self.b + np.interp(self.a, turn, by, period=1.0)))


def _apart(a: Real, b: Real) -> list[int]:
    """Return the indices of knots that are distinct in double precision on both circles."""
    keep = [0]
    for k in range(1, a.size):
        if a[k] - a[keep[-1]] > CLOSEST_TURNS and b[k] - b[keep[-1]] > CLOSEST_TURNS:
            keep.append(k)
    while a[keep[0]] + 1 - a[keep[-1]] <= CLOSEST_TURNS or b[keep[0]] + 1 - b[keep[-1]] <= CLOSEST_TURNS:
        keep.pop()
    return keep
