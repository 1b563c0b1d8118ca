"""The choice among conformal maps: three real parameters, taken for the least distortion or by pins.

With both boundaries seen as unit circles, every conformal map of one domain onto the other is a Möbius map of the disc,

    m(u) = exp(iρ) (u - b) / (1 - conj(b) u),

between them, and |f'| on the boundary is the quotient of the harmonic densities times |m'|.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from .. import progress
from ..arrays import Complex, Real
from ..curve import Curve
from ..errors import InputError
from ..maps import cauchy_green
from .correspondence import TURN, Coarse, Correspondence, Moebius, View
from .harmonic_measure import HarmonicMeasure
from .panels import thickness

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
CENTRES_TRIED = 8
CLEARANCE_SHARE = 0.25  # least clearance of a centre, relative to the largest
ROTATIONS_TRIED = 16
POLISHED_CANDIDATES = 6
FAR_HYPERBOLIC_DISTANCE = 1.5  # hyperbolic distance from a centre, beyond which another one sees better
SIMPLEX = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.2]])
ROUGH_SEARCH = {"maxfev": 250, "xatol": 1e-2, "fatol": 1e-3}
FINE_SEARCH = {"maxfev": 250, "xatol": 1e-5, "fatol": 1e-7}
NEARLY_BEST_RATIO = 1.05  # candidates this close to the least are polished to the end
APART_CIRCLE_DISTANCE = 0.25
"""Mean distance on the unit circle between the places of candidates that are different."""
UPRIGHT = np.radians(30)  # turns that do not count, and so do not decide between neighbouring optima
UPSIDE_DOWN_RATIO = 1.5
"""A map that turns the picture upside down is as good as one that distorts so much more."""
LEAST_ROTATION_GAIN_RADIANS = 0.05  # radians that a turn must be less by, to be worth it
SAME_DISTORTION = 3e-3  # distortions that differ by less are the same
RIGHT_ANGLE_DISTORTION = 0.05
"""Distortion that a turn by a right angle is worth on its own, which decides between equals."""
SAME_SCORE = 1e-6  # scores that differ by less are the same: the first is taken


def centres(curve: Curve, spacing: float) -> Complex:
    """Up to CENTRES_TRIED points spread over the medial axis, the widest place first: each sees its surroundings
    sharply."""
    edge, z, radius = thickness(curve, spacing)
    middle = z - radius * curve.normals[edge]
    inside = curve.contains(middle)
    middle, radius = middle[inside], radius[inside]
    if not middle.size:
        raise InputError("an outline is too thin; simplify it, or make it wider")
    clear = curve.distances(middle)
    fair = (clear > 0.5 * radius) & (clear > CLEARANCE_SHARE * clear.max())
    middle, clear = middle[fair], clear[fair]
    chosen = [int(np.argmax(clear))]
    for _ in range(CENTRES_TRIED - 1):
        apart = np.min([np.abs(middle - middle[k]) / (clear + clear[k]) for k in chosen], axis=0)
        if apart.max() < 0.7:
            break
        chosen.append(int(np.argmax(apart)))
    return middle[chosen]


def distortion(source: Coarse, target: Coarse, m: Moebius) -> Real:
    """Variance of log|f'| over both boundaries, each weighted by its own arclength: zero exactly for similarities.

    One number, or with m.rho of shape (r, 1) those of r rotations.
    """
    # Moebius.__call__ and .inverse, whose quotients give log|m'| too
    shrunk = np.log1p(-(abs(m.b) ** 2))
    forward = 1 - np.conj(m.b) * source.units
    back = 1 + np.conj(m.b) * np.exp(-1j * m.rho) * target.units
    here = source.middles + (m.rho - 2 * np.angle(forward)) / TURN
    there = target.middles - (m.rho + 2 * np.angle(back)) / TURN
    stretch = np.concatenate(
        [
            source.log_density + shrunk - 2 * np.log(np.abs(forward)) - target.density(here),
            source.density(there) + 2 * np.log(np.abs(back)) - shrunk - target.log_density,
        ],
        axis=-1,
    )
    weight = np.concatenate([source.weight, target.weight])
    return (stretch - (stretch @ weight)[..., None]) ** 2 @ weight


def charged_distortion(distortion: Real, cosine: Real) -> Real:
    """Distortion, and more by the cosine of the angle that the picture is turned by: it is looked at upright."""
    beyond = np.maximum(np.cos(UPRIGHT) - cosine, 0) / (np.cos(UPRIGHT) + 1)
    return distortion * (1 + (UPSIDE_DOWN_RATIO - 1) * beyond) + RIGHT_ANGLE_DISTORTION * (1 - cosine)


def search(
    source: HarmonicMeasure, target: HarmonicMeasure, pins: Complex | None = None, upright: complex = 1.0
) -> Correspondence:
    """Return the correspondence of least distortion, or with pins the one that meets them best and then distorts least.

    Every pair of centres and rotations is tried, the best are polished over all three parameters. Of maps that distort
    about as much the one that turns the least from `upright` is taken, and none that turns where any turn is as good,
    as between discs. Pins choose alone.
    """
    views = [View.of(h, centres(h.curve, 0.1)) for h in (source, target)]
    wish = Wish(pins if pins is not None and pins.size else None, upright)
    pairs = [(a, b) for a in views[0] for b in views[1]]
    tried = [t for a, b in progress.counted("Möbius maps", pairs) for t in wish.rotations(a, b)]
    tried.sort(key=lambda t: round(t.score / SAME_SCORE))
    starts = _distinct(tried)
    rough = [wish.polished(t, ROUGH_SEARCH) for t in progress.counted("Möbius maps polished", starts)]
    close = NEARLY_BEST_RATIO * min(t.score for t in rough) + SAME_SCORE
    found = [*starts, *(wish.finished(t, views) for t in rough if t.score <= close)]
    least = min(t.score for t in found)
    return wish.stood(next(t for t in found if t.score <= least + SAME_SCORE)).correspondence


@dataclass(frozen=True, eq=False)
class Candidate:
    """A Möbius map between two views, by its parameters; its cost, and its score among others, less being better."""

    score: float
    cost: float
    source: View
    target: View
    p: Real

    @property
    def correspondence(self) -> Correspondence:
        """What it makes of the boundaries."""
        return Correspondence(self.source, self.target, Moebius.of(self.p), self.cost)


@dataclass(frozen=True, eq=False)
class Wish:
    """What a correspondence is chosen by: pins, else distortion and the turn from `upright`."""

    pins: Complex | None
    upright: complex

    def rotations(self, a: View, b: View) -> list[Candidate]:
        """Rotations of the circle, all round."""
        rho = TURN * np.arange(ROTATIONS_TRIED) / ROTATIONS_TRIED
        m = Moebius(0, rho[:, None])
        costs = self.cost(a, b)(m)
        scores = self.score(a, b, m, costs)
        return [
            Candidate(score, cost, a, b, np.array([0, 0, r]))
            for score, cost, r in zip(scores.tolist(), costs.tolist(), rho)
        ]

    def polished(self, t: Candidate, ends: dict[str, float], turn: float = 0.0) -> Candidate:
        """Return the least cost that is found from a candidate, `turn` being the price of a turn by a right angle."""
        a, b, cost = t.source, t.target, self.cost(t.source, t.target)

        def objective(p: Real) -> float:
            m = Moebius.of(p)
            return float(cost(m) + turn * (1 - self.cosine(a, b, m)) if turn else cost(m))

        options = {"initial_simplex": t.p + SIMPLEX, **ends}
        p = minimize(objective, t.p, method="Nelder-Mead", options=options).x
        m = Moebius.of(p)
        found = cost(m)
        return Candidate(float(self.score(a, b, m, found)), float(found), a, b, p)

    def finished(self, t: Candidate, views: list[list[View]]) -> Candidate:
        """Return a candidate polished to the end, from the centres that see it best unless that leads elsewhere."""
        polished = self.polished(_seen_well(t, views), FINE_SEARCH)
        return polished if polished.cost <= NEARLY_BEST_RATIO * t.cost else self.polished(t, FINE_SEARCH)

    def stood(self, t: Candidate) -> Candidate:
        """Return a candidate turned upright, if any turn is as good, as between discs."""
        if self.pins is not None or (turned := self._turned(t)) < LEAST_ROTATION_GAIN_RADIANS:
            return t
        up = self.polished(t, FINE_SEARCH, turn=RIGHT_ANGLE_DISTORTION)
        return (
            up
            if up.cost <= t.cost + SAME_DISTORTION and turned - self._turned(up) > LEAST_ROTATION_GAIN_RADIANS
            else t
        )

    def _turned(self, t: Candidate) -> float:
        """Radians from the upright."""
        return float(np.arccos(np.clip(self.cosine(t.source, t.target, Moebius.of(t.p)), -1, 1)))

    def score(self, a: View, b: View, m: Moebius, cost: Real) -> Real:
        """Of maps with their costs."""
        if self.pins is not None:
            return cost
        return charged_distortion(cost, self.cosine(a, b, m))

    def cosine(self, a: View, b: View, m: Moebius) -> Real:
        """Of the angle by which a map turns the boundary about its middle, from the upright; m as for `distortion`."""
        z, w = a.coarse, b.coarse
        moment = w.place(m(z.middles)) @ (z.weight * (self.upright * z.places).conj())
        return moment.real / np.maximum(np.abs(moment), 1e-300)

    def cost(self, a: View, b: View) -> Callable[[Moebius], Real]:
        """Distortion of a Möbius map, plus the distance by which it misses the pins where there are any."""
        pins = self.pins
        if pins is None:
            return lambda m: distortion(a.coarse, b.coarse, m)
        u, v = a.disc(pins[:, 0]), b.disc(pins[:, 1])
        scale = np.abs(
            cauchy_green.derivatives(b.measure.z, pins[:, 1]) @ np.exp(1j * TURN * b.circle.turns[:-1])
        )

        def cost(m: Moebius) -> Real:
            miss = np.minimum(np.abs(m.inside(u) - v) / np.maximum(scale, 1e-9), 2.0)
            return distortion(a.coarse, b.coarse, m) + 1e3 * np.mean(miss**2, axis=-1)

        return cost


def _distinct(tried: list[Candidate]) -> list[Candidate]:
    """Return the best candidates, no two of which send the boundary to nearly the same places."""
    chosen: list[Candidate] = []
    places: list[Complex] = []
    for t in tried:
        a, b = t.source.coarse, t.target.coarse
        probes = np.interp(np.arange(8) / 8 * a.length + a.knots[0], a.knots, a.turns)
        place = np.exp(1j * TURN * b.arclength(probes + t.p[2] / TURN) / b.length)
        if all(np.mean(np.abs(place - other)) > APART_CIRCLE_DISTANCE for other in places):
            chosen.append(t)
            places.append(place)
        if len(chosen) == POLISHED_CANDIDATES:
            break
    return chosen


def _seen_well(t: Candidate, views: list[list[View]]) -> Candidate:
    """About the same map, seen from the two centres between which it is closest to a rotation.

    Polishing may lead far from the centres it began at, where they see everything crowded in one place.
    """
    if np.hypot(*t.p[:2]) <= FAR_HYPERBOLIC_DISTANCE:
        return t
    forward, best = t.correspondence.forward, (0.0, t)
    for a in views[0]:
        image = forward(a.circle.knots)
        for b in views[1]:
            there = b.circle.turn(image)
            shared = float(np.minimum(np.diff(there), a.circle.mass).sum())
            if shared > best[0]:
                middle = there[:-1] - a.circle.turns[:-1] + 0.5 * np.diff(there - a.circle.turns)
                rho = float(np.angle(a.circle.mass @ np.exp(1j * TURN * middle)))
                best = shared, Candidate(t.score, t.cost, a, b, np.array([0, 0, rho]))
    return best[1]
