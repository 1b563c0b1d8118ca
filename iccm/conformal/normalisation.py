"""The choice of one conformal map: three real parameters, determined by least distortion or by pins.

With both boundaries as unit circles, every conformal map of one domain onto the other is a Möbius map of the
disc,

    m(u) = exp(iρ) (u - b) / (1 - conj(b) u),

between them, and |f'| on the boundary is the quotient of the harmonic densities times |m'|.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from .. import progress
from ..arrays import Complex, Real
from ..curve import Curve
from ..errors import InputError
from ..maps import cauchy_green
from ..symmetry import centre_of
from .correspondence import TURN, Coarse, Correspondence, HarmonicView, Moebius
from .harmonic_measure import HarmonicMeasure
from .panels import thickness
from .symmetry import centres_between, common_axes, shift_of, translation

# Values were chosen by hand unless a comment gives a reason.
CENTRES_TRIED = 8
CLEARANCE_SHARE = 0.25  # least clearance of a centre, relative to the largest clearance
ROTATIONS_TRIED = 16  # evenly spaced rotations for each pair of centres
POLISHED_CANDIDATES = 6  # the best ones, which are refined
# Hyperbolic distance from a centre beyond which another centre resolves better.
FAR_HYPERBOLIC_DISTANCE = 1.5
SIMPLEX = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.2]])
ROUGH_SEARCH = {"maxfev": 250, "xatol": 1e-2, "fatol": 1e-3}
FINE_SEARCH = {"maxfev": 250, "xatol": 1e-5, "fatol": 1e-7}
MOST_SHIFT, SHIFTS_TRIED = 6.0, 49
"""Range of shifts along an axis of symmetry that are tried from each pair of centres: hyperbolic lengths, twice that
of `FAR_HYPERBOLIC_DISTANCE` in either direction."""
SHIFT_TOLERANCE = 1e-5  # hyperbolic length
NEARLY_SAME_RATIO = (
    1.001  # relative score up to which symmetric maps are the same, seen from different centres
)
NEARLY_BEST_RATIO = 1.05  # relative cost up to which candidates are refined until convergence
APART_CIRCLE_DISTANCE = 0.25
"""Mean distance on the unit circle above which candidates count as different."""
UPRIGHT = np.radians(30)  # smaller rotations are free, and so do not decide between neighbouring optima
UPSIDE_DOWN_RATIO = 1.5
"""An upside-down map is as good as an upright one with this times the distortion."""
# Least reduction of the rotation, in radians, that is accepted as an improvement.
LEAST_ROTATION_GAIN_RADIANS = 0.05
SAME_DISTORTION = 3e-3  # distortions that differ by less are equal
RIGHT_ANGLE_DISTORTION = 0.05
"""Cost of a rotation by 90°, which decides between maps with equal distortion."""
SAME_SCORE = 1e-6  # scores that differ by less are equal; the first is chosen


def centres(curve: Curve, spacing: float) -> Complex:
    """Return up to CENTRES_TRIED points spread over the medial axis, the widest place first.

    Each resolves the harmonic measure of its surroundings well.

    Raises:
        InputError: the outline is too thin.
    """
    edge, z, radius = thickness(curve, spacing)
    middle = z - radius * curve.normals[edge]
    inside = curve.contains(middle)
    middle, radius = middle[inside], radius[inside]
    if not middle.size:
        raise InputError("an outline is too thin; simplify it, or make it wider")
    clear = curve.distances(middle)
    fair = (clear > 0.5 * radius) & (clear > CLEARANCE_SHARE * clear.max())
    middle, clear = middle[fair], clear[fair]
    selection = [int(np.argmax(clear))]
    for _ in range(CENTRES_TRIED - 1):
        apart = np.min([np.abs(middle - middle[k]) / (clear + clear[k]) for k in selection], axis=0)
        if apart.max() < 0.7:
            break
        selection.append(int(np.argmax(apart)))
    return middle[selection]


def distortion(source: Coarse, target: Coarse, m: Moebius) -> Real:
    """Return the variance of log|f'| over both boundaries, weighted by arclength; it is zero exactly for similarities.

    Args:
        source: boundary of the source.
        target: boundary of the target.
        m: the map between the circles; with m.rho of shape (r, 1), the result has r values.
    """
    # as in Moebius.__call__ and .inverse, whose quotients are also needed for log|m'|
    shrunk = np.log1p(-(abs(m.b) ** 2))
    forward = 1 - np.conj(m.b) * source.units
    back = 1 + np.conj(m.b) * np.exp(-1j * m.rho) * target.units
    source_images = source.middles + (m.rho - 2 * np.angle(forward)) / TURN
    target_preimages = target.middles - (m.rho + 2 * np.angle(back)) / TURN
    stretch = np.concatenate(
        [
            source.log_density + shrunk - 2 * np.log(np.abs(forward)) - target.density(source_images),
            source.density(target_preimages) + 2 * np.log(np.abs(back)) - shrunk - target.log_density,
        ],
        axis=-1,
    )
    weight = np.concatenate([source.weight, target.weight])
    return (stretch - (stretch @ weight)[..., None]) ** 2 @ weight


def charged_distortion(distortion: Real, cosine: Real) -> Real:
    """Return the distortion with the cost of a rotation, given by its cosine: pictures should be upright."""
    beyond = np.maximum(np.cos(UPRIGHT) - cosine, 0) / (np.cos(UPRIGHT) + 1)
    return distortion * (1 + (UPSIDE_DOWN_RATIO - 1) * beyond) + RIGHT_ANGLE_DISTORTION * (1 - cosine)


def search(
    source: HarmonicMeasure, target: HarmonicMeasure, pins: Complex | None = None, upright: complex = 1.0
) -> Correspondence:
    """Return the correspondence with the least distortion.

    With pins, it is the one with the least distortion of those that meet them best. Every pair of centres is
    tried with several rotations, and the best candidates are refined over all three parameters. Of maps with
    about the same distortion, the one with the least rotation from `upright` is chosen, in particular if the
    distortion does not depend on the rotation, as between discs. With pins, rotation is ignored.

    Between two shapes with the same axis of symmetry, it is the symmetric map with the least distortion, unless there
    are pins.
    """
    if pins is None or not pins.size:
        symmetric = search_symmetric(source, target, upright)
        if symmetric is not None:
            return symmetric
    views = [HarmonicView.of(h, centres(h.curve, 0.1)) for h in (source, target)]
    wish = Wish(pins if pins is not None and pins.size else None, upright)
    pairs = [(a, b) for a in views[0] for b in views[1]]
    candidates = [t for a, b in progress.counted("Möbius maps", pairs) for t in wish.rotations(a, b)]
    candidates.sort(key=lambda t: round(t.score / SAME_SCORE))
    starts = _distinct(candidates)
    rough = [wish.polished(t, ROUGH_SEARCH) for t in progress.counted("Möbius maps polished", starts)]
    close = NEARLY_BEST_RATIO * min(t.score for t in rough) + SAME_SCORE
    finished = [*starts, *(wish.finished(t, views) for t in rough if t.score <= close)]
    least = min(t.score for t in finished)
    return wish.stood(next(t for t in finished if t.score <= least + SAME_SCORE)).correspondence


def search_symmetric(
    source: HarmonicMeasure, target: HarmonicMeasure, upright: complex
) -> Correspondence | None:
    """Return the correspondence of the symmetric map with the least distortion.

    It is None if the shapes have no axis of symmetry in common. A map is symmetric about an axis if it takes the axis,
    a geodesic of the domain, to that of the other shape. Then one parameter is left, a shift along the axis, and
    none if there are two axes in common.
    """
    axes = common_axes(source.curve, target.curve, upright)
    if not axes:
        return None
    wish = Wish(None, upright)
    centres_of_sides = [
        centres_between(h.curve, axes[0][side]) if len(axes) == 1 else np.array([centre_of(h.curve)])
        for side, h in enumerate((source, target))
    ]
    views = [HarmonicView.of(h, points) for h, points in zip((source, target), centres_of_sides)]
    pairs = [(a, b) for a in views[0] for b in views[1]]
    candidates = [
        candidate
        for a, b in progress.counted("symmetric Möbius maps", pairs)
        for swapped in (False, True)
        if (candidate := wish.along_axis(a, b, axes, swapped=swapped)) is not None
    ]
    if not candidates:
        return None
    least = min(candidate.score for candidate in candidates)
    close = [t for t in candidates if t.score <= NEARLY_SAME_RATIO * least + SAME_SCORE]
    # the same map, as seen from the centres between which it is closest to a rotation
    best = min(close, key=lambda t: float(np.hypot(*t.p[:2])))
    fixed = source.curve.closest(np.concatenate([ends for ends, _ in axes[:2]]))
    found = best.correspondence
    return replace(found, fixed=fixed, fixed_images=found.forward(fixed))


@dataclass(frozen=True, eq=False)
class Candidate:
    """A Möbius map between two views, with its parameters, its cost, and its score in comparisons; less is better."""

    score: float
    cost: float
    source: HarmonicView
    target: HarmonicView
    p: Real

    @property
    def correspondence(self) -> Correspondence:
        """The boundary correspondence of the map."""
        return Correspondence(self.source, self.target, Moebius.of(self.p), self.cost)


@dataclass(frozen=True, eq=False)
class Wish:
    """Criteria for the choice of a correspondence: pins, else distortion and the rotation from `upright`."""

    pins: Complex | None
    upright: complex

    def rotations(self, a: HarmonicView, b: HarmonicView) -> list[Candidate]:
        """Return candidates with evenly spaced rotations of the circle."""
        rho = TURN * np.arange(ROTATIONS_TRIED) / ROTATIONS_TRIED
        m = Moebius(0, rho[:, None])
        costs = self.cost(a, b)(m)
        scores = self.score(a, b, m, costs)
        return [
            Candidate(score, cost, a, b, np.array([0, 0, r]))
            for score, cost, r in zip(scores.tolist(), costs.tolist(), rho)
        ]

    def along_axis(
        self, a: HarmonicView, b: HarmonicView, axes: list[tuple[Complex, Complex]], *, swapped: bool
    ) -> Candidate | None:
        """Return the best map that takes the ends of an axis to those of another, for views of both shapes.

        Args:
            a: view of the source.
            b: view of the target.
            axes: the ends (2,) of each axis in the source and in the target; the first two determine the map.
            swapped: whether the map is upside down.
        """
        order = slice(None, None, -1 if swapped else 1)
        ends = [
            (a.on_circle(source_ends), b.on_circle(target_ends)[order])
            for source_ends, target_ends in axes[:2]
        ]
        cost = self.cost(a, b)
        shift: float | None
        if len(ends) > 1:
            shift = shift_of(*ends[0], *ends[1])
            if shift is None:
                return None
        else:
            tried = np.linspace(-MOST_SHIFT, MOST_SHIFT, SHIFTS_TRIED)
            k = int(np.argmin(cost(translation(*ends[0], tried[:, None]))))
            shift = minimize_scalar(
                lambda shift: float(cost(translation(*ends[0], shift))),
                bounds=(tried[max(k - 1, 0)], tried[min(k + 1, tried.size - 1)]),
                method="bounded",
                options={"xatol": SHIFT_TOLERANCE},
            ).x
        m = translation(*ends[0], shift)
        if not abs(m.b) < 1:  # too far from these centres for double precision
            return None
        least_cost = cost(m)
        return Candidate(float(self.score(a, b, m, least_cost)), float(least_cost), a, b, m.parameters)

    def polished(self, t: Candidate, ends: dict[str, float], turn: float = 0.0) -> Candidate:
        """Minimise the cost from a candidate; `turn` is the cost of a rotation by 90°."""
        a, b, cost = t.source, t.target, self.cost(t.source, t.target)

        def objective(p: Real) -> float:
            m = Moebius.of(p)
            return float(cost(m) + turn * (1 - self.cosine(a, b, m)) if turn else cost(m))

        options = {"initial_simplex": t.p + SIMPLEX, **ends}
        p = minimize(objective, t.p, method="Nelder-Mead", options=options).x
        m = Moebius.of(p)
        least_cost = cost(m)
        return Candidate(float(self.score(a, b, m, least_cost)), float(least_cost), a, b, p)

    def finished(self, t: Candidate, views: list[list[HarmonicView]]) -> Candidate:
        """Return a candidate refined until convergence.

        It is seen from the centres that resolve it best, unless that leads elsewhere.
        """
        polished = self.polished(_seen_well(t, views), FINE_SEARCH)
        return polished if polished.cost <= NEARLY_BEST_RATIO * t.cost else self.polished(t, FINE_SEARCH)

    def stood(self, t: Candidate) -> Candidate:
        """Return a candidate rotated upright, if the distortion does not depend on the rotation, as between discs."""
        if self.pins is not None or (rotation := self._turned(t)) < LEAST_ROTATION_GAIN_RADIANS:
            return t
        up = self.polished(t, FINE_SEARCH, turn=RIGHT_ANGLE_DISTORTION)
        return (
            up
            if up.cost <= t.cost + SAME_DISTORTION
            and rotation - self._turned(up) > LEAST_ROTATION_GAIN_RADIANS
            else t
        )

    def _turned(self, t: Candidate) -> float:
        """Return the angle from upright, in radians."""
        return float(np.arccos(np.clip(self.cosine(t.source, t.target, Moebius.of(t.p)), -1, 1)))

    def score(self, a: HarmonicView, b: HarmonicView, m: Moebius, cost: Real) -> Real:
        """Return the scores of maps with given costs."""
        if self.pins is not None:
            return cost
        return charged_distortion(cost, self.cosine(a, b, m))

    def cosine(self, a: HarmonicView, b: HarmonicView, m: Moebius) -> Real:
        """Return the cosine of the mean rotation of the boundary from upright; m as for `distortion`."""
        z, w = a.coarse, b.coarse
        moment = w.place(m(z.middles)) @ (z.weight * (self.upright * z.places).conj())
        return moment.real / np.maximum(np.abs(moment), 1e-300)

    def cost(self, a: HarmonicView, b: HarmonicView) -> Callable[[Moebius], Real]:
        """Return the cost as a function of the Möbius map.

        It is the distortion, plus the distances from pins if there are any.
        """
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


def _distinct(candidates: list[Candidate]) -> list[Candidate]:
    """Return the best candidates, no two of which map the boundary to nearly the same places."""
    distinct: list[Candidate] = []
    places: list[Complex] = []
    for t in candidates:
        a, b = t.source.coarse, t.target.coarse
        probes = np.interp(np.arange(8) / 8 * a.length + a.knots[0], a.knots, a.turns)
        place = np.exp(1j * TURN * b.arclength(probes + t.p[2] / TURN) / b.length)
        if all(np.mean(np.abs(place - other)) > APART_CIRCLE_DISTANCE for other in places):
            distinct.append(t)
            places.append(place)
        if len(distinct) == POLISHED_CANDIDATES:
            break
    return distinct


def _seen_well(t: Candidate, views: list[list[HarmonicView]]) -> Candidate:
    """Return about the same map, with the two centres between which it is closest to a rotation.

    Refinement may lead far away from the initial centres, from which everything is crowded in one place.
    """
    if np.hypot(*t.p[:2]) <= FAR_HYPERBOLIC_DISTANCE:
        return t
    forward, best = t.correspondence.forward, (0.0, t)
    for a in views[0]:
        image = forward(a.circle.knots)
        for b in views[1]:
            turns = b.circle.turn(image)
            shared = float(np.minimum(np.diff(turns), a.circle.mass).sum())
            if shared > best[0]:
                middle = turns[:-1] - a.circle.turns[:-1] + 0.5 * np.diff(turns - a.circle.turns)
                rho = float(np.angle(a.circle.mass @ np.exp(1j * TURN * middle)))
                best = shared, Candidate(t.score, t.cost, a, b, np.array([0, 0, rho]))
    return best[1]
