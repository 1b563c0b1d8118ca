"""Which conformal map: the three real parameters left free, chosen for the least distortion or by pins.

With both boundaries seen as unit circles, every conformal map of one domain onto the other is a Möbius map of the disc,

    m(u) = exp(iρ) (u - b) / (1 - conj(b) u),

between them, and |f'| on the boundary is the quotient of the harmonic densities times |m'|.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize

from . import cauchy
from .cauchy import Complex
from .curve import Curve, Real
from .measure import Circle, HarmonicMeasure
from .panels import thickness

CENTRES = 8
CLEARANCE = 0.25  # least clearance of a centre, relative to the largest
ROTATIONS = 16
POLISHED = 6
APART = 0.25  # mean distance on the unit circle between the places of candidates that are different
COARSE = 150  # panels of a boundary while parameters are searched
# maps this close to the least distortion are all as good (symmetric shapes): the one that turns least is taken
NEAR_TIE = 1.005
LESS = 0.2  # radians that count as less: two polishings of one optimum differ by less
TURN = 2 * np.pi

if TYPE_CHECKING:
    from .strain import CircleMap


@dataclass(frozen=True)
class Moebius:
    """m(u) = exp(iρ) (u - b) / (1 - conj(b) u) on the circle, in turns; lifted and increasing."""

    b: complex
    rho: float

    def __call__(self, turn: Real) -> Real:
        """Image of boundary points."""
        return turn + (self.rho - 2 * np.angle(1 - np.conj(self.b) * np.exp(1j * TURN * turn))) / TURN

    def inverse(self, turn: Real) -> Real:
        """Preimage of boundary points."""
        angle = TURN * turn - self.rho
        return (angle - 2 * np.angle(1 + np.conj(self.b) * np.exp(1j * angle))) / TURN

    def log_stretch(self, turn: Real) -> Real:
        """log |m'| at boundary points."""
        return np.log((1 - abs(self.b) ** 2) / np.abs(1 - np.conj(self.b) * np.exp(1j * TURN * turn)) ** 2)

    def inside(self, u: Complex) -> Complex:
        """Image of points of the disc."""
        return np.exp(1j * self.rho) * (u - self.b) / (1 - np.conj(self.b) * u)

    @classmethod
    def of(cls, p: Real) -> "Moebius":
        """From unbounded parameters: the hyperbolic vector of b, and ρ."""
        q = complex(p[0], p[1])
        return cls(np.tanh(abs(q)) * np.exp(1j * np.angle(q)), float(p[2]))


class Coarse:
    """A boundary as the unit circle in a few panels: enough to compare the distortion of Möbius maps, and fast."""

    def __init__(self, measure: HarmonicMeasure, mass: Real):
        """Join neighbouring panels."""
        first = np.arange(0, mass.size, max(1, mass.size // COARSE))
        self.length = measure.curve.length
        self.lengths = np.add.reduceat(measure.lengths, first)
        mass = np.add.reduceat(mass, first)
        self.turns = np.concatenate([[0.0], np.cumsum(mass)]) / mass.sum()
        self.knots = measure.ends[0] + np.concatenate([[0.0], np.cumsum(self.lengths)])
        self.middles = 0.5 * (self.turns[1:] + self.turns[:-1])
        self.log_density = np.log(mass / self.lengths)
        self._centres = 0.5 * (self.knots[1:] + self.knots[:-1])

    def arclength(self, turn: Real) -> Real:
        """s(F), within one lap."""
        return np.interp(turn - np.floor(turn), self.turns, self.knots)

    def density(self, s: Real) -> Real:
        """log dF/ds at arclengths within one lap."""
        return np.interp(s, self._centres, self.log_density)


@dataclass(frozen=True, eq=False)
class View:
    """A boundary with its harmonic measure seen from one centre."""

    measure: HarmonicMeasure
    centre: complex
    circle: Circle
    coarse: Coarse

    @classmethod
    def of(cls, measure: HarmonicMeasure, centre: complex) -> "View":
        """The view from a point inside."""
        mass = measure.masses(np.array([centre]))[0]
        return cls(measure, centre, Circle(measure, mass), Coarse(measure, mass))

    def disc(self, z: Complex) -> Complex:
        """Images of points inside under the Riemann map to the disc: the Cauchy integral of its boundary values."""
        values = np.exp(1j * TURN * self.circle.turns[:-1])
        return cauchy.coordinates(self.measure.z, z) @ values


@dataclass(frozen=True, eq=False)
class Correspondence:
    """A boundary correspondence: source view, target view, and an increasing map between their circles."""

    source: View
    target: View
    between: "Moebius | CircleMap"
    distortion: float

    def forward(self, s: Real) -> Real:
        """Target arclength at source arclengths, lifted and increasing."""
        return self.target.circle.arclength(self.between(self.source.circle.turn(s)))

    def backward(self, tau: Real) -> Real:
        """Source arclength at target arclengths, lifted and increasing."""
        return self.source.circle.arclength(self.between.inverse(self.target.circle.turn(tau)))


def centres(curve: Curve, spacing: float) -> Complex:
    """Up to CENTRES points spread over the medial axis, the widest place first: each sees its surroundings sharply."""
    edge, z, radius = thickness(curve, spacing)
    middle = z - radius * curve.normals[edge]
    inside = curve.contains(middle)
    middle, radius = middle[inside], radius[inside]
    clear = np.abs(curve.at(curve.closest(middle)) - middle)
    fair = (clear > 0.5 * radius) & (clear > CLEARANCE * clear.max())
    middle, clear = middle[fair], clear[fair]
    chosen = [int(np.argmax(clear))]
    for _ in range(CENTRES - 1):
        apart = np.min([np.abs(middle - middle[k]) / (clear + clear[k]) for k in chosen], axis=0)
        if apart.max() < 0.7:
            break
        chosen.append(int(np.argmax(apart)))
    return middle[chosen]


def distortion(source: Coarse, target: Coarse, m: Moebius) -> float:
    """Variance of log|f'| over both boundaries, each weighted by its own arclength: zero exactly for similarities."""
    here = m(source.middles)
    there = m.inverse(target.middles)
    stretch = np.concatenate(
        [
            source.log_density + m.log_stretch(source.middles) - target.density(target.arclength(here)),
            source.density(source.arclength(there)) + m.log_stretch(there) - target.log_density,
        ]
    )
    weight = 0.5 * np.concatenate([source.lengths / source.length, target.lengths / target.length])
    return float(weight @ (stretch - weight @ stretch) ** 2)


def search(
    source: HarmonicMeasure, target: HarmonicMeasure, pins: Complex | None = None, upright: complex = 1.0
) -> Correspondence:
    """The correspondence of least distortion, or with pins the one that meets them best and then distorts least.

    Every pair of centres and rotations is tried, the best are polished over all three parameters. Where several are
    as good (symmetric shapes) the one that turns the least from `upright` is taken.
    """
    views = [[View.of(h, c) for c in centres(h.curve, 0.1)] for h in (source, target)]
    tried = []
    for a in views[0]:
        for b in views[1]:
            objective = _objective(a, b, pins)
            tried += [
                (objective([0, 0, TURN * k / ROTATIONS]), TURN * k / ROTATIONS, a, b)
                for k in range(ROTATIONS)
            ]
    tried.sort(key=lambda t: t[0])
    found = [_polish(a, b, rho, pins) for _, rho, a, b in _distinct(tried)]
    best = min(found, key=lambda c: c.distortion)
    for c in found:
        if (
            c.distortion <= NEAR_TIE * best.distortion + 1e-6
            and _turned(c, upright) < _turned(best, upright) - LESS
        ):
            best = c
    return best


def _distinct(tried: list[tuple[float, float, View, View]]) -> list[tuple[float, float, View, View]]:
    """The best candidates, no two of which send the boundary to nearly the same places."""
    chosen: list[tuple[float, float, View, View]] = []
    places: list[Complex] = []
    for candidate in tried:
        _, rho, a, b = candidate
        probes = np.interp(
            np.arange(8) / 8 * a.coarse.length + a.coarse.knots[0], a.coarse.knots, a.coarse.turns
        )
        place = np.exp(1j * TURN * b.coarse.arclength(probes + rho / TURN) / b.coarse.length)
        if all(np.mean(np.abs(place - other)) > APART for other in places):
            chosen.append(candidate)
            places.append(place)
        if len(chosen) == POLISHED:
            break
    return chosen


def _polish(source: View, target: View, rho: float, pins: Complex | None) -> Correspondence:
    objective = _objective(source, target, pins)
    simplex = np.array([[0, 0, rho], [0.3, 0, rho], [0, 0.3, rho], [0, 0, rho + 0.2]])
    options = {"maxfev": 250, "xatol": 1e-5, "fatol": 1e-7, "initial_simplex": simplex}
    best = minimize(objective, simplex[0], method="Nelder-Mead", options=options)
    return Correspondence(source, target, Moebius.of(best.x), float(best.fun))


def _objective(source: View, target: View, pins: Complex | None):
    """Distortion of a Möbius map, plus the distance by which it misses the pins where there are any."""
    if pins is None or not pins.size:
        return lambda p: distortion(source.coarse, target.coarse, Moebius.of(p))
    u, v = source.disc(pins[:, 0]), target.disc(pins[:, 1])
    scale = np.abs(
        cauchy.derivatives(target.measure.z, pins[:, 1]) @ np.exp(1j * TURN * target.circle.turns[:-1])
    )

    def objective(p) -> float:
        m = Moebius.of(p)
        miss = np.minimum(np.abs(m.inside(u) - v) / np.maximum(scale, 1e-9), 2.0)
        return distortion(source.coarse, target.coarse, m) + 1e3 * float(np.mean(miss**2))

    return objective


def _turned(c: Correspondence, upright: complex) -> float:
    """Angle by which a correspondence turns the boundary about the centroids, from the upright."""
    z, w = c.source.measure.z, c.target.measure.curve.at(c.forward(c.source.measure.ends))
    return float(np.abs(np.angle(np.sum(c.source.measure.lengths * w * (upright * z).conj()))))
