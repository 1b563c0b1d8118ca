"""Exact pins and strokes: random ones on random pairs of drawings, compared with the map without constraints.

python -m tests.bench.constraints [--pairs 16] [--seed 1] [--only KIND] [--share 1.0]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

import iccm
from iccm import Curve, InputError
from iccm.balanced.minimise.energy import energy_of

from . import shapes

PIN_ERROR, OFF_LINE, GAP = 1e-9, 2e-4, 1e-3  # goals, relative to the diagonal
TURNED = 120  # largest rotation of strokes in degrees
# relative to the diagonal: distance of random pins from the outlines; half of it from each other
CLEAR = 0.03
TRIES = 400
REDRAWN = 3  # attempts to draw constraints for a pair before the next pair is taken


@dataclass(frozen=True)
class Case:
    """A pair of domains, and the map without constraints."""

    name: str
    source: Curve
    target: Curve
    free: iccm.Fit
    seconds: float


@dataclass(frozen=True)
class Row:
    """Results for a case; ratios are relative to the map without constraints."""

    error: float
    gap: float
    off: float
    certified: bool
    slower: float
    seconds: float
    energy: float
    p95: float
    status: str

    @property
    def met(self) -> bool:
        """Whether all goals are met."""
        return (
            self.error <= PIN_ERROR
            and self.off <= OFF_LINE
            and self.gap <= GAP
            and self.certified
            and self.status == "reached"
        )


def clear(curve: Curve, z: np.ndarray) -> np.ndarray:
    """Return which points are inside and far enough from the outline."""
    return curve.contains(z) & (curve.distances(z) > CLEAR * curve.diagonal)


def apart(points: list, z: complex, unit: float) -> bool:
    """Return whether a point is far enough from the others."""
    return all(abs(z - point) > CLEAR * unit for point in points)


def inner(rng, free: iccm.Fit, count: int, low: float, high: float) -> np.ndarray | None:
    """Return pins inside, displaced from their unconstrained images by shares `low` to `high` of the diagonal."""
    points, pins = free._interior, []
    for _ in range(TRIES):
        z = complex(rng.choice(points))
        w = complex(free.map(np.array([z]))[0])
        displacement = rng.uniform(low, high) * np.exp(2j * np.pi * rng.uniform()) * free.target.diagonal
        sides = zip((z, w + displacement), (free.source, free.target), zip(*pins) if pins else ([], []))
        if all(clear(c, np.array([p]))[0] and apart(have, p, c.diagonal) for p, c, have in sides):
            pins.append((z, w + displacement))
        if len(pins) == count:
            return np.array(pins)
    return None


def outer(rng, free: iccm.Fit, count: int, slide: float) -> np.ndarray | None:
    """Return pins on the outline, moved along it by up to a share of its length, in order."""
    source, target = free.source, free.target
    for _ in range(TRIES):
        s = np.sort(rng.uniform(0, source.length, count))
        tau = target.closest(free.map(source.at(s)))
        tau = tau + rng.uniform(-slide, slide, count) * target.length
        gaps = np.mod(np.diff(tau, append=tau[:1] + target.length), target.length)
        spans = np.diff(s, append=s[:1] + source.length) / source.length
        if (
            abs(gaps.sum() - target.length) < 1e-6
            and gaps.min() > 0.02 * target.length
            and spans.min() > 0.02
        ):
            return np.column_stack([source.at(s), target.at(tau)])
    return None


def some_stuck(line: tuple | None, k: int) -> tuple:
    """Return a stroke whose ends slide, or with pins at its ends, alternately."""
    if line is None or k % 2:
        return (), [line]
    return np.column_stack([np.asarray(side)[[0, -1]] for side in line]), [line]


def stroke(rng, free: iccm.Fit, low: float = 0.15, high: float = 0.4, turned: float = TURNED) -> tuple | None:
    """Return a bent stroke and its target: its unconstrained image, rotated, moved and scaled."""
    for _ in range(10 * TRIES):
        length = rng.uniform(low, high) * free.source.diagonal
        t = np.linspace(0, length, 40)
        bend = np.exp(1j * (rng.uniform(0, 2 * np.pi) + rng.uniform(-1.2, 1.2) / length * t[1:]))
        z = complex(rng.choice(free._interior)) + np.append(0, np.cumsum(bend) * length / 39)
        if not clear(free.source, z).all():
            continue
        w = free.map(z)
        factor = np.exp(1j * np.radians(rng.uniform(-turned, turned))) * rng.uniform(0.7, 1.3)
        shift = rng.uniform(0.03, 0.15) * free.target.diagonal * np.exp(2j * np.pi * rng.uniform())
        w = w.mean() + shift + factor * (w - w.mean())
        goal = Curve(w, closed=False)
        goal = Curve(goal.at(np.linspace(0, goal.length, rng.integers(3, 7))), closed=False)
        line = shapely.LineString(np.column_stack([goal.z.real, goal.z.imag]))
        if line.is_simple and clear(free.target, goal.at(np.linspace(0, goal.length, 60))).all():
            return z[:: rng.integers(4, 14)], goal.z
    return None


def mixed(rng, free: iccm.Fit, count: int) -> tuple | None:
    """Return a stroke and pins inside and on the outline, as far as they are compatible."""
    line = stroke(rng, free, 0.1, 0.25, 30)
    pins = inner(rng, free, 1 + count % 2, 0.03, 0.1), outer(rng, free, 2 + count % 2, 0.05)
    if line is None or any(part is None for part in pins):
        return None
    lines = [Curve(np.asarray(z), closed=False) for z in line]
    clear_of_line = [
        c.distances(side).min() > CLEAR * d.diagonal
        for c, side, d in zip(lines, pins[0].T, (free.source, free.target))
    ]
    return (np.concatenate(pins), [line]) if all(clear_of_line) else None


def touching(rng, free: iccm.Fit, k: int) -> tuple:
    """Return a stroke from the outline inwards, or across the shape, and its unconstrained image with the ends moved
    along the outline and the middle displaced.
    """
    source, target, across = free.source, free.target, k % 2
    share = np.linspace(0, 1, 40)
    for _ in range(TRIES // 10):
        z = ray(rng, source, across)
        if z is None or not clear_but_for_ends(source, z, across):
            continue
        w = free.map(z) + displacement(rng, 0.02, 0.08) * target.diagonal * np.sin(np.pi * share) ** 2
        feet_at = target.closest(w[[0, -1]]) + rng.uniform(-0.03, 0.03, 2) * target.length
        feet = target.at(feet_at) - w[[0, -1]]
        w = w + feet[0] * (1 - share) ** 2 + across * feet[1] * share**2
        goal = Curve(w, closed=False)
        goal = Curve(goal.at(np.linspace(0, goal.length, 6)), closed=False)
        line = shapely.LineString(np.column_stack([goal.z.real, goal.z.imag]))
        if line.is_simple and clear_but_for_ends(target, goal.at(share * goal.length), across):
            return (), [(z[::13], goal.z)]
    return (), [None]


def displacement(rng, low: float, high: float) -> complex:
    """Return a random vector with a length between two bounds."""
    return rng.uniform(low, high) * np.exp(2j * np.pi * rng.uniform())


def ray(rng, curve: Curve, across: int) -> np.ndarray | None:
    """Return (40,) points from a random point of the outline inwards, all the way `across` or half of it; None if
    short.
    """
    s = rng.uniform(0, curve.length)
    foot, ahead = curve.at(np.array([s, s + 1e-6 * curve.length]))
    direction = 1j * (ahead - foot) / abs(ahead - foot) * np.exp(1j * rng.uniform(-0.6, 0.6))
    ends = foot + np.array([1e-6, 1]) * direction * curve.diagonal
    ring = shapely.LinearRing(np.column_stack([curve.z.real, curve.z.imag]))
    hits = shapely.get_coordinates(
        ring.intersection(shapely.LineString(np.column_stack([ends.real, ends.imag])))
    )
    lengths = np.abs(hits @ np.array([1, 1j]) - foot)
    if not lengths.size or not 0.15 < lengths.min() / curve.diagonal < 0.8:
        return None
    return foot + np.linspace(0, lengths.min() * (1 if across else rng.uniform(0.4, 0.7)), 40) * direction


def clear_but_for_ends(curve: Curve, z: np.ndarray, both_ends: int) -> bool:
    """Return whether a polyline (n,) starts on the outline, ends there if `both_ends`, and stays clear of it in
    between.
    """
    away = curve.distances(z)
    steps = np.arange(z.size) / z.size
    from_ends = np.minimum(steps, 1 - steps if both_ends else 1.0)
    inner = curve.contains(z[1 : z.size - both_ends]).all()
    return bool(
        inner and np.all(away > np.minimum(CLEAR, 0.1 * from_ends) * curve.diagonal - 1e-9 * curve.diagonal)
    )


KINDS: dict[str, tuple[int, float, Callable]] = {
    "inner": (100, 1.0, lambda rng, free, k: (inner(rng, free, 1 + k % 6, 0.03, 0.15), [])),
    "far": (50, 0.95, lambda rng, free, k: (inner(rng, free, 1 + k % 6, 0.15, 0.40), [])),
    "outline": (60, 1.0, lambda rng, free, k: (outer(rng, free, 2 + k % 5, 0.08), [])),
    "stroke": (60, 0.98, lambda rng, free, k: some_stuck(stroke(rng, free), k)),
    "mixed": (40, 0.95, mixed),
    "touching": (32, 0.95, touching),
}
"""Number of cases of each kind, the share of constraints that must be met, and the function that makes them."""


def free_fits(count: int, seed: int) -> list[Case]:
    """Return random pairs with their maps without constraints."""
    cases = []
    for source, target in shapes.drawn_pairs(count, seed, []):
        name = f"{shapes.label(source)[:22]} → {shapes.label(target)[:22]}"
        try:
            iccm.fit(source.curve, target.curve) if not cases else None  # for compilation
            start = time.process_time()
            free = iccm.fit(source.curve, target.curve)
        except InputError as error:
            print(f"{name}: no map without constraints: {error}", flush=True)
            continue
        seconds = time.process_time() - start
        cases.append(Case(name, source.curve, target.curve, free, seconds))
    return cases


def off_line(fit: iccm.Fit) -> float:
    """Return the largest distance of strokes' images from their targets, relative to the diagonal; if ends have pins,
    also of targets from images.
    """
    worst = 0.0
    for a, b in fit.strokes:
        image = Curve(fit.map(a.at(np.linspace(0, a.length, 400))), closed=False)
        goal = b.at(np.linspace(0, b.length, 400))
        worst = max(worst, b.distances(image.z).max())
        if np.isin(a.z[[0, -1]], fit.pins[:, 0]).all():
            worst = max(worst, image.distances(goal).max())
    return worst / fit._diagonal


def energy(fit: iccm.Fit) -> float:
    """Return the minimised energy at q = 1."""
    return energy_of(fit.map.source, fit.map.image, fit.map.faces)


def measured(case: Case, pins: np.ndarray, strokes: list) -> Row:
    """Measure a fit with constraints."""
    start = time.process_time()
    fit = iccm.fit(case.source, case.target, pins=pins, strokes=strokes)
    seconds = time.process_time() - start
    r, free = fit.report(), case.free.report()
    return Row(
        max((pin["error"] for pin in r["pins"]), default=0.0),
        r["boundary"]["hausdorff"],
        off_line(fit),
        r["injective"]["certified"],
        seconds / case.seconds,
        seconds,
        energy(fit) / energy(case.free),
        r["stretch"]["p95"] / free["stretch"]["p95"],
        r["status"],
    )


def drawn_for(rng, cases: list[Case], make: Callable, k: int) -> tuple | None:
    """Return a pair with pins and strokes for it; if none are found, try the next pair."""
    for pair in range(k, k + len(cases)):
        case = cases[pair % len(cases)]
        for _ in range(REDRAWN):
            request = make(rng, case.free, k // len(cases) + k)
            if request is not None and request[0] is not None and None not in request[1]:
                return case, *request
    return None


def summed_up(rows: list[Row]) -> str:
    """Return medians and maxima of the results."""
    middle = [float(np.median([getattr(row, f) for row in rows])) for f in ("slower", "energy", "p95")]
    return (
        f"CPU × {middle[0]:.2f} in the median (goal 2), most {max(r.seconds for r in rows):.1f} s (goal 20), "
        f"energy × {middle[1]:.2f}, p95 × {middle[2]:.2f}"
    )


def run(kind: str, cases: list[Case], seed: int, share: float) -> list[Row]:
    """Run all cases of a kind; print a line for each, and a summary with the goals."""
    count, least, make = KINDS[kind]
    rng, rows, failed, tried = np.random.default_rng(seed), [], 0, 0
    for k in range(max(1, round(count * share))):
        drawn = drawn_for(rng, cases, make, k)
        if drawn is None:
            continue
        case, *request = drawn
        tried += 1
        name = f"{kind:8} {case.name:48} {len(request[0])}"
        try:
            row = measured(case, *request)
        except InputError as error:
            print(f"{name} NO MAP: {error}", flush=True)
            failed += 1
            continue
        rows.append(row)
        print(
            f"{name} {'met' if row.met else 'NOT'} error {row.error:.0e} off {row.off:.0e} gap {row.gap:.0e} "
            f"{'' if row.certified else 'FOLDS '}energy × {row.energy:.2f} p95 × {row.p95:.2f} "
            f"{row.seconds:.2f}s × {row.slower:.1f} {row.status}",
            flush=True,
        )
    met = sum(row.met for row in rows)
    print(
        f"{kind}: {met} of {tried} met (goal {least:.0%}), folds {sum(not r.certified for r in rows)} (goal 0), "
        f"no map {failed}, {summed_up(rows)}; seed {seed}\n"
    )
    return rows


def main() -> None:
    """Run the bench; see the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=KINDS, action="append")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases")
    args = parser.parse_args()
    cases = free_fits(args.pairs, args.seed)
    rows = [row for kind in args.only or KINDS for row in run(kind, cases, args.seed, args.share)]
    print(f"all {len(rows)} cases: {summed_up(rows)}")


if __name__ == "__main__":
    main()
